"""Rings in parts that joints hold together: as stiff as one housing where the joint is, and as soft
as a spring behind the ring where that is all the joint has."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.bearing.movement import _load
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.scene.reading import build
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

FILE = ROOT / "scenes" / "templates" / "grinding.toml"
AT = [Condition(20.0), Condition(60.0), Condition(20.0, 30000 * RPM), Condition(55.0, 24000 * RPM)]
MOVES = ["x", "y", "z", "tilt_x", "tilt_y"]


def mounted(plate: float | None = None, of: str = "rear", load: float = 0.0, **preload) -> Spindle:
    """The template's spindle with a preload, and the outer ring `of` a row in a plate that a joint
    of so many N/m along the axis holds to the housing."""
    raw = tomllib.loads(FILE.read_text(encoding="utf-8"))
    raw["axial_load_N"] = load
    for key in ("preload_rate_N_per_m", "sprung_bearings", "sprung_ring_mass_g"):
        raw["sets"]["main"].pop(key, None)
    raw["sets"]["main"] |= preload
    if plate is not None:
        raw["bearings"][of]["outer_body"] = "plate"
        raw["structure"]["bodies"].append({"name": "plate", "mass_kg": 0.8, "tilt_inertia_kg_m2": [4e-4, 4e-4], "z_mm": 164.0, "moves": MOVES})
        lateral = {"lateral_stiffness_N_per_m": [1e9, 1e9], "tilt_stiffness_N_m_per_rad": [1e6, 1e6], "damping_ratio": 0.02}
        joint = {"name": "bolts", "group": "bolts", "between": ["housing", "plate"], "z_mm": 164.0, "axial_stiffness_N_per_m": plate, **lateral}
        raw["structure"]["joints"].append(joint)
    return build(raw, FILE)


def preloads(spindle: Spindle) -> list[float]:
    return [b.preload for at in AT for b in operating_point(spindle, at, ()).state.bearings]


SPRUNG = {"preload_kind": "spring", "sprung_bearings": ["rear"]}


@pytest.mark.parametrize("of", ["front", "rear"])
@pytest.mark.parametrize("preload", [{"preload_kind": "rigid"}, {**SPRUNG, "preload_rate_N_per_m": 2e6}, SPRUNG], ids=["rigid", "on a spring", "by a constant force"])
@pytest.mark.parametrize("load", [0.0, 40.0])
def test_a_stiff_joint_is_one_housing(of, preload, load):
    assert preloads(mounted(1e13, of, load, **preload)) == pytest.approx(preloads(mounted(None, of, load, **preload)), rel=1e-5)


@pytest.mark.parametrize("rate", [2e5, 2e6, 2e7])
def test_a_soft_joint_is_a_spring_behind_the_ring(rate):
    """At the reference the preload is as stated, whatever the joint: spindles are preloaded as they
    are put together. It was lost whole, in silence."""
    through_the_plate, by_a_spring = (preloads(s) for s in (mounted(rate, preload_kind="rigid"), mounted(**SPRUNG, preload_rate_N_per_m=rate)))
    assert through_the_plate[:2] == pytest.approx([180.0, 180.0], rel=1e-6)
    assert through_the_plate == pytest.approx(by_a_spring, rel=1e-5)
    assert max(through_the_plate) > 1.02 * 180.0 or rate < 1e6  # at speed the rings give, and the preload rises less the softer it is held


def test_a_joint_beside_the_bearings_takes_the_load():
    """Between what carries inner and outer rings, as a magnetic thrust bearing is: of a load it
    takes what its rate is of the whole. It was left out of the balance."""

    def sharing(rate: float, load: float) -> list[float]:
        raw = tomllib.loads(FILE.read_text(encoding="utf-8"))
        raw["axial_load_N"] = load
        for key in ("preload_rate_N_per_m", "sprung_bearings", "sprung_ring_mass_g"):
            raw["sets"]["main"].pop(key, None)
        raw["sets"]["main"]["preload_kind"] = "rigid"
        lateral = {"lateral_stiffness_N_per_m": [1.0, 1.0], "tilt_stiffness_N_m_per_rad": [1.0, 1.0], "damping_ratio": 0.02}
        raw["structure"]["joints"].append({"name": "thrust", "group": "thrust", "between": ["housing", "spindle"], "z_mm": 164.0, "axial_stiffness_N_per_m": rate, **lateral})
        return preloads(build(raw, FILE))

    alone, borne = sharing(1e-3, 40.0), sharing(1e13, 40.0)
    assert borne == pytest.approx(sharing(1e13, 0.0), rel=1e-5)
    assert alone == pytest.approx(preloads(mounted(load=40.0, preload_kind="rigid")), rel=1e-6)
    assert abs(alone[0] - borne[0]) > 5.0


def of_parts(**of: tuple[str, str]) -> tuple[SimpleNamespace, dict, dict]:
    """Rows between parts that turn (spindle, wheel) or stand, with a load; the first part is still."""
    parts = list(dict.fromkeys(p for pair in of.values() for p in pair))
    bodies = [SimpleNamespace(name=p, turns=p in ("spindle", "wheel")) for p in parts]
    spindle = SimpleNamespace(axial_load=40.0, structure=SimpleNamespace(bodies=bodies, carrier=lambda name: name))
    return spindle, of, {p: row for p, row in zip(parts, np.vstack([np.zeros(len(parts) - 1), np.eye(len(parts) - 1)]), strict=True)}


def test_a_load_on_no_one_part_is_refused():
    """Three rows in a chain of four parts: what would it act on? And on a housing that carries all
    outer rings, about two shafts that turn, joints that hold it would take it all."""
    for rows in ({"a": ("spindle", "housing"), "b": ("spindle", "plate"), "c": ("wheel", "plate")}, {"a": ("spindle", "housing"), "b": ("wheel", "housing")}):
        with pytest.raises(NoEquilibrium, match="axial_load_N = 40: there is no one part that turns and carries all inner rings, or all outer ones"):
            _load(*of_parts(**rows))
    spindle, of, parts = of_parts(**rows)
    spindle.axial_load = 0.0
    assert _load(spindle, of, parts).tolist() == [0.0] * 2


def test_a_load_acts_on_what_carries_outer_rings_or_against_what_carries_inner_ones():
    assert _load(*of_parts(a=("housing", "wheel"), b=("plate", "wheel"))).tolist() == [40.0, 0.0]
    assert _load(*of_parts(a=("housing", "wheel"), b=("housing", "wheel"))).tolist() == [40.0]
    assert _load(*of_parts(a=("housing", "wheel"), b=("wheel", "housing"))).tolist() == [40.0]
    spindle, of, _ = of_parts(a=("spindle", "housing"), b=("spindle", "plate"))
    assert _load(spindle, of, {"housing": np.zeros(2), "plate": np.eye(2)[0], "spindle": np.eye(2)[1]}).tolist() == [0.0, -40.0]


def test_parts_that_nothing_ties_together_are_not_preloaded_against_each_other():
    """Rows of one set whose outer rings are on two bodies that float: there is no preload, and it is said that they are loose."""
    spindle = mounted(1e9, preload_kind="rigid")
    free = replace(spindle, structure=replace(spindle.structure, joints=tuple(j for j in spindle.structure.joints if j.name != "bolts")))
    state = operating_point(free, AT[0], ()).state
    assert state.status == "front and rear bearing lost contact"
    assert max(abs(b.preload) for b in state.bearings) < 1e-3
