"""How bodies may have their mass otherwise than drawn: against particles, and against mass that is moved along a beam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.virtual_campaign import effect, model_of, virtual_campaign
from thermospindle.diagnosis.decision.verdict import decide
from thermospindle.diagnosis.forward.linear import mass_changes
from thermospindle.diagnosis.inference.search import search
from thermospindle.diagnosis.parameters.masses import GYRATION, mass_terms
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.parameters.nuisance import MASSES
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import matrices, motion_rows
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

SHARE = 1e-4


def changes(spindle, speed=0.0):
    """The chain at a speed (rpm), its matrices, and what the whole of each term adds to M and, per rad/s, to G."""
    point = operating_point(spindle, Condition(spindle.reference_temperature, speed * RPM))
    terms = mass_terms(spindle)
    added = mass_changes(spindle, [replace(m, sd=1.0) for m in terms], point.chain.dofs)
    return point, {m.name: both for m, *both in zip(terms, *added, strict=True)}


def moved(spindle, body, at, mass):
    """M (n, n) of particles of a `mass` (of either sign) at positions `at` of a body."""
    chain = operating_point(spindle, Condition(spindle.reference_temperature)).chain
    found = np.zeros((len(chain.dofs),) * 2)
    for position, m in zip(at, mass, strict=True):
        rows = motion_rows(chain, body, position)[:3]
        found += m * rows.T @ rows
    return found


def of(body, found, dofs):
    own = [i for i, (name, _) in enumerate(dofs) if name == body]
    return found[np.ix_(own, own)]


@pytest.mark.parametrize(
    ("body", "name", "way"),
    [("shaft", "height of the centre of mass", 2), ("shaft", "place along x of the centre of mass", 0), ("shaft", "place along y of the centre of mass", 1), ("seat", "place along x of the centre of mass", 0)],
)
def test_a_centre_of_mass_that_is_off(spindle, body, name, way):
    """As two particles have it, a little taken away on one side of the centre and put on the other:
    first moment alone. Whole, it is off by a radius of gyration."""
    point, found = changes(spindle)
    own = spindle.structure.body(body)
    arm = np.sqrt(np.mean(own.inertia[:2]) / own.mass)
    ends = np.zeros((2, 3))
    ends[:, 2] = own.z
    ends[:, way] += [arm, -arm]
    wanted = of(body, moved(spindle, body, ends, [own.mass / 2, -own.mass / 2]), point.chain.dofs)
    assert of(body, found[f"{name} of {body}{GYRATION}"][0], point.chain.dofs) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
    assert np.abs(wanted).max() > 0


def test_a_product_of_inertia(spindle):
    """Four particles at the corners of a square about the axis, two more and two less: -sum m x y."""
    point, found = changes(spindle)
    own = spindle.structure.body("shaft")
    arm = np.sqrt(np.mean(own.inertia[:2]) / own.mass)
    corners = [(a * arm, b * arm, own.z) for a in (1, -1) for b in (1, -1)]
    wanted = of("shaft", moved(spindle, "shaft", corners, [-0.25 * own.mass * np.sign(x * y) for x, y, _ in corners]), point.chain.dofs)
    assert of("shaft", found["product of inertia of shaft beside the other inertias"][0], point.chain.dofs) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())


def test_masses_and_inertias_are_those_of_a_body_that_has_more(spindle):
    """Of the shaft, which no tolerance holds, and the hub's polar inertia, by which it turns."""
    point, found = changes(spindle, 7200.0)
    at = matrices(point.chain)

    def other(name, **more):
        bodies = tuple(replace(b, **{k: f(b) for k, f in more.items()}) if b.name == name else b for b in point.chain.bodies)
        return matrices(replace(point.chain, bodies=bodies))

    f = 1 + SHARE
    for wanted, of_it in (
        (other("shaft", mass=lambda b: f * b.mass), "mass of shaft"),
        (other("shaft", inertia=lambda b: (f * b.inertia[0], *b.inertia[1:])), "inertia about x of shaft"),
        (other("shaft", inertia=lambda b: (b.inertia[0], f * b.inertia[1], b.inertia[2])), "inertia about y of shaft"),
        (other("hub", inertia=lambda b: (*b.inertia[:2], f * b.inertia[2])), "polar inertia of hub beside the other"),
    ):
        mass, gyroscopic = found[of_it]
        assert SHARE * mass == pytest.approx(wanted.mass - at.mass, rel=1e-9, abs=1e-16)
        assert SHARE * point.chain.speed * gyroscopic == pytest.approx(wanted.damping - at.damping, rel=1e-6, abs=1e-14)
        assert mass.any() != gyroscopic.any()


def test_a_shaft_that_is_heavier_towards_its_end_weighs_as_much():
    """Nothing for a shaft of even mass as a whole, and as much about its middle: the first two of
    Legendre's polynomials; three terms of a shaft and four of its housing."""
    spindle = load(ROOT / "scenes" / "free_shaft")
    assert mass_terms(spindle) == ()  # it stands still, and is of one piece
    structure = replace(spindle.structure, shafts=tuple(replace(s, turns=True) for s in spindle.structure.shafts))
    point, found = changes(replace(spindle, structure=structure))
    across = [i for i, (_, move) in enumerate(point.chain.dofs) if move == "x"]
    whole = np.diag(matrices(point.chain).mass)[across].sum()
    for name in ("mass of shaft towards its end", "mass of shaft away from its middle"):
        mass, gyroscopic = found[name]
        assert abs(np.diag(mass)[across].sum()) < 0.01 * whole  # nodes have what lies about them
        assert np.abs(np.diag(mass)[across]).sum() > 0.3 * whole
        assert not gyroscopic.any()
    assert len(mass_terms(load(ROOT / "scenes" / "five_bearing"))) == 7


@pytest.mark.parametrize("which", [pytest.param("polar inertia of the hub", marks=pytest.mark.slow), "mass and inertia of the shaft"])
def test_masses_that_are_off_are_no_disk_and_no_sensors(spindle, which):
    """A newcomer's simulator with nothing hidden, every mass and inertia off by some thousandths:
    `added_disk` or `sensor_mass` for the polar inertia of its hub alone, 30 in ln evidence."""
    if which == "polar inertia of the hub":
        share = {"hub": lambda b: {"inertia": (*b.inertia[:2], 0.995 * b.inertia[2])}}
    else:
        share = {"shaft": lambda b: {"mass": 1.03 * b.mass, "inertia": (0.97 * b.inertia[0], 1.02 * b.inertia[1], b.inertia[2])}}
    bodies = tuple(replace(b, **share[b.name](b)) if b.name in share else b for b in spindle.structure.bodies)
    built = replace(spindle, structure=replace(spindle.structure, bodies=bodies))
    tests = (Condition(20.0), Condition(60.0), Condition(20.0, 7200 * RPM))
    campaign = virtual_campaign(built, tests, 7, [], frequency=np.arange(400.0, 6000.1, 8.0))
    named = [m for name in ("added_disk", "sensor_mass") for m in variants(effect(name))]
    found = search(model_of(spindle, campaign), named, [], workers=1)
    assert decide(found).word == "none"
    told = {p.name: found.base.evidence.mean[i] * p.sd for i, p in enumerate(found.model.parameters) if p.kind == MASSES}
    if which == "polar inertia of the hub":
        assert told["polar inertia of hub beside the other"] == pytest.approx(-0.005, abs=0.002)
