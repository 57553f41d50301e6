"""Flexible shafts against closed forms of beams, with the rates at which the mesh converges."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

from tests.conftest import ROOT
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Material
from thermospindle.model.material import Law
from thermospindle.model.rotor.beam import elements, nodes, shear_factor, with_shafts, with_theory
from thermospindle.model.rotor.chain import RotorBase, joint_element, matrices, motion_rows
from thermospindle.model.rotor.static import displacement
from thermospindle.model.scene.reading import build
from thermospindle.model.shaft import Segment, Shaft, mesh
from thermospindle.model.structure import Structure

E, NU, RHO = 207e9, 0.3, 7850.0
STEEL = {"steel": Material("steel", Law((0.0,), (E,)), NU, Law((0.0,), (1e-5,)), RHO, 46.0, 460.0)}


def shaft(length=1.3, radius=(0.02, 0.02), bore=(0.0, 0.0), count=20, shear=0.0, rotary=0.0, heights=(), cuts=()) -> Shaft:
    """One segment, or one cut at `cuts` into several of the same radii."""
    segment = Segment((0.0, length), radius, bore, radius, "steel")
    return Shaft("s", (segment,), mesh((segment,), heights, length / count), False, 1.0, 0.0, "", shear, rotary)


def plane(s: Shaft, clamped: bool = False):
    """Stiffness and mass in the x-z plane; clamped at the lower end where asked."""
    structure = with_shafts(Structure((), (), 100.0, shafts=(s,)), STEEL, 20.0)
    chain = RotorBase(structure.bodies, tuple(joint_element(structure, i) for i in range(len(structure.joints))), 0.0)
    linear = matrices(chain)
    own = [i for i, (_, move) in enumerate(linear.dofs) if move in ("x", "tilt_y")]
    k, m = linear.stiffness[np.ix_(own, own)], linear.mass[np.ix_(own, own)]
    if clamped:  # springs at the node itself, far stiffer than the beam
        rows = motion_rows(chain, s.bodies[0], (0.0, 0.0, 0.0))[[0, 4]][:, own]
        k = k + 1e15 * rows.T @ rows
    return k, m


def frequencies(s: Shaft, clamped: bool = False) -> np.ndarray:
    """Hz, without rigid motion."""
    value = eigh(*plane(s, clamped), eigvals_only=True)
    found = np.sqrt(np.abs(value)) / (2 * np.pi)
    return found if clamped else found[2:]


EULER = {  # roots of the characteristic equation (k l), Timoshenko, Vibration Problems in Engineering
    "free": [brentq(lambda x: np.cos(x) - 1 / np.cosh(x), a, a + 1) for a in (4.4, 7.5, 10.6, 13.8)],
    "clamped": [brentq(lambda x: np.cos(x) + 1 / np.cosh(x), a, a + 1) for a in (1.5, 4.4, 7.5, 10.6)],
}


@pytest.mark.parametrize("end", EULER)
def test_euler_bernoulli_frequencies_and_their_rate(end):
    """Closed forms of a uniform beam; halving the elements takes at least 2^3 off the error of every mode."""
    d, length = 0.04, 1.3
    unit = np.sqrt(E * np.pi * d**4 / 64 / (RHO * np.pi * d**2 / 4)) / (2 * np.pi * length**2)
    exact = unit * np.array(EULER[end]) ** 2
    errors = [np.abs(frequencies(shaft(count=n), end == "clamped")[:4] / exact - 1) for n in (10, 20, 40)]
    assert errors[1].max() < 2e-3
    assert errors[2].max() < 2.5e-4
    assert (errors[0][2:] / errors[1][2:] > 7).all()


def timoshenko_free(length, radius, count):
    """First `count` frequencies (Hz) of a free uniform Timoshenko beam: Han, Benaroya, Wei, J. Sound Vib. 225 (1999) 935, from the
    differential equations as a boundary value problem: the transfer matrix over the length leaves no force and moment at the far end."""
    area, inertia = np.pi * radius**2, np.pi * radius**4 / 4
    shear = shear_factor(0.0, NU) * E / (2 * (1 + NU)) * area

    def left_over(f):
        w = 2 * np.pi * f
        # y, tilt, moment, force: y' = tilt + V / kGA, tilt' = M / EI, M' = -V - rho I w^2 tilt, V' = -rho A w^2 y
        a = np.array([[0, 1, 0, 1 / shear], [0, 0, 1 / (E * inertia), 0], [0, -RHO * inertia * w**2, 0, -1], [-RHO * area * w**2, 0, 0, 0]])
        value, vector = np.linalg.eig(a)
        transfer = np.real(vector @ np.diag(np.exp(value * length)) @ np.linalg.inv(vector))
        return np.linalg.det(transfer[2:, :2])

    grid = np.linspace(20.0, 3000.0, 6000)
    values = [left_over(f) for f in grid]
    found = [brentq(left_over, a, b) for a, b, x, y in zip(grid, grid[1:], values, values[1:], strict=False) if x * y < 0]
    return np.array(found[:count])


def test_timoshenko_frequencies_against_the_differential_equation():
    exact = timoshenko_free(1.3, 0.04, 4)
    coarse, fine = (np.abs(frequencies(shaft(radius=(0.04, 0.04), count=n, shear=1.0, rotary=1.0))[:4] / exact - 1) for n in (20, 40))
    assert fine.max() < 8e-4
    assert (coarse / fine > 3.5).all()


def test_static_deflection_is_exact_on_any_mesh():
    """Tip of a clamped beam under a force: l^3 / 3EI + l / kappa G A, tilt l^2 / 2EI."""
    length, r = 0.5, 0.03
    area, inertia = np.pi * r**2, np.pi * r**4 / 4
    exact = length**3 / (3 * E * inertia) + length / (shear_factor(0.0, NU) * E / (2 * (1 + NU)) * area)
    for count in (1, 3, 17):
        s = shaft(length, (r, r), count=count, shear=1.0)
        chain_elements = elements(s, STEEL, 20.0)
        # in series from the clamp: every element's relative motion under the force and its moment
        tip = sum(1 / j.stiffness[0] + (length - j.z) ** 2 / j.stiffness[4] for j in chain_elements)
        assert tip == pytest.approx(exact, rel=1e-12)


def test_a_cone_in_one_element():
    """Clamped cone, radius a to b, force at the thin end: l^3 4 / (3 pi E a^3 b) (Roark, 7th ed., table 8.1), by one element."""
    length, a, b = 0.3, 0.03, 0.02
    [joint] = elements(shaft(length, (a, b), count=1), STEEL, 20.0)
    tip = 1 / joint.stiffness[0] + (length - joint.z) ** 2 / joint.stiffness[4]
    assert tip == pytest.approx(4 * length**3 / (3 * np.pi * E * a**3 * b), rel=1e-9)


def test_nodes_have_the_shafts_mass_and_inertia():
    """Mass, centre and polar inertia are those of the drawing, and the transverse one to the square
    of the element's length over the shaft's."""
    s = shaft(0.4, (0.03, 0.03), (0.01, 0.01), count=10, rotary=1.0)
    bodies = nodes(s, STEEL)
    m = RHO * np.pi * (0.03**2 - 0.01**2) * 0.4
    mass, z = np.array([b.mass for b in bodies]), np.array([b.z for b in bodies])
    assert mass.sum() == pytest.approx(m, rel=1e-12)
    assert mass @ z == pytest.approx(0.2 * m, rel=1e-12)
    assert sum(b.inertia[2] for b in bodies) == pytest.approx(m / 2 * (0.03**2 + 0.01**2), rel=1e-12)
    transverse = sum(b.inertia[0] for b in bodies) + mass @ (z - 0.2) ** 2
    assert transverse == pytest.approx(m / 12 * (3 * (0.03**2 + 0.01**2) + 0.4**2), rel=3e-3)


def test_another_theory_changes_what_it_says_and_nothing_else():
    own = with_shafts(Structure((), (), 100.0, shafts=(shaft(shear=1.0, rotary=1.0),)), STEEL, 20.0)
    there = with_theory(own, STEEL, 20.0, (0.0, 0.0))
    back = with_theory(there, STEEL, 20.0, (1.0, 1.0))
    assert [j.stiffness[2:] for j in there.joints] == [pytest.approx(j.stiffness[2:], rel=1e-14) for j in own.joints]
    assert all(a.stiffness[0] > b.stiffness[0] for a, b in zip(there.joints, own.joints, strict=True))
    for a, b in zip(back.joints, own.joints, strict=True):
        assert a.stiffness == pytest.approx(b.stiffness, rel=1e-12)
    for a, b in zip(back.bodies, own.bodies, strict=True):
        assert a.inertia == pytest.approx(b.inertia, rel=1e-9)


def test_a_force_on_what_nothing_holds_has_no_static_answer():
    """A couple of a free beam's own has one: ends pulled together across it bend it."""
    k, _ = plane(shaft(count=4))
    push = np.zeros(len(k))
    push[0] = 1.0
    assert displacement(k, push) is None
    z = np.array([b.z for b in nodes(shaft(count=4), STEEL)])
    bend = np.zeros(len(k))
    bend[0], bend[4], bend[8] = 1.0, -(z[4] - z[0]) / (z[4] - z[2]), (z[2] - z[0]) / (z[4] - z[2])
    moved = displacement(k, bend)
    assert moved is not None
    assert k @ moved == pytest.approx(bend, abs=1e-6)


def two_metals(**keys):
    """The shipped free shaft in two pieces, 500 mm of steel and 800 mm of a metal half as heavy and
    a third as stiff, in elements over which that change lies."""
    path = ROOT / "scenes" / "free_shaft" / "spindle.toml"
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    raw["materials"]["light"] = raw["materials"]["steel"] | {"youngs_modulus_GPa": 69.0, "density_kg_per_m3": 3925.0}
    raw["measuring"]["points"] = [p for p in raw["measuring"]["points"] if p["position_mm"][2] in (100.0, 1200.0)]
    shaft = raw["shafts"][0]
    del shaft["material"]
    raw["shafts"][0] = shaft | {"outer_mm": [[40.0, 500.0], [40.0, 800.0]], "materials": ["steel", "light"], "longest_element_mm": 2000.0} | keys
    raw["shafts"][0] = {k: v for k, v in raw["shafts"][0].items() if v is not None}
    return build(raw, path)


def test_each_piece_of_a_shaft_has_its_material():
    """Mass, and the bending of the middle element, 400 mm of steel and 700 mm of the other, by sums
    over the pieces: one material a shaft was all that a scene could say."""
    spindle = two_metals()
    area, moment = np.pi / 4 * 0.04**2, np.pi / 64 * 0.04**4
    assert sum(b.mass for b in spindle.structure.bodies) == pytest.approx(area * (7850.0 * 0.5 + 3925.0 * 0.8), rel=1e-12)
    [middle] = [j for j in spindle.structure.joints if j.name == "shaft 1-2"]
    assert 1 / middle.stiffness[4] == pytest.approx((0.4 / 207e9 + 0.7 / 69e9) / moment, rel=1e-9)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"materials": ["steel"]}, "materials has 1 names; allowed is one for each of the 2 pieces of outer_mm"),
        ({"material": "steel"}, "material and materials: both told"),
        ({"materials": None}, "material and materials: neither told"),
        ({"materials": ["steel", "wood"]}, "shafts.shaft.materials = 'wood': allowed are steel, light"),
    ],
)
def test_materials_that_do_not_fit_the_pieces_are_refused(keys, words):
    with pytest.raises(BadInput, match=re.escape(words)):
        two_metals(**keys)
