"""Hidden physics of rings, preload and bearings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.blind.hidden import Mechanism
from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.built.tolerance import scaled_preload
from thermospindle.model.machine import RingMotion, Spindle
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.types import Array

OMEGA = 2 * np.pi * 1500.0  # rad/s, at which a loss factor becomes a damper


def of_rings(spindle: Spindle) -> list[Mechanism]:
    turning, standing = ("outer", "inner") if spindle.bearings[0].turning_ring == "outer" else ("inner", "outer")
    first = spindle.bearings[0].name
    found = [
        Mechanism("preload falls", "%", 1.0, 40.0, ("preload_loss",), "preload",
                  {"spindle": lambda s, a, _: scaled_preload(s, max(1 + a / 100, 0.02))}, sign=-1),
        Mechanism("turning part warmer", "K", 0.3, 8.0, ("thermal_gradient", "soak_lag", "fixture_lag", "cooling_imbalance"), "rings", {"temperatures": _warmer(turning)}),
        Mechanism("standing part warmer", "K", 0.3, 8.0, ("thermal_gradient", "soak_lag", "fixture_lag", "cooling_imbalance"), "rings", {"temperatures": _warmer(standing)}),
        Mechanism("outer rings grow", "um", 0.02, 0.8, ("clearance_opening", "ring_growth", "loose_inserts", "expansion_mismatch"),
                  "rings apart radially", {"motions": _moved(None, "outer_r")}, sign=1),
        Mechanism("inner rings shrink", "um", 0.02, 0.8, ("clearance_opening", "loose_inserts", "expansion_mismatch"),
                  "rings apart radially", {"motions": _moved(None, "inner_r", -1.0)}, sign=1),
        Mechanism("balls grow", "1e-6", 20.0, 600.0, ("ball_material", "clearance_opening"), "rings", {"motions": _moved(None, "ball_strain")}),
        Mechanism("inner grooves grow", "1e-6", 20.0, 600.0, ("expansion_mismatch", "clearance_opening"), "rings",
                  {"motions": _moved(None, "inner_strain")}),
    ]  # fmt: skip
    if spindle.sets[0].spring is None:
        found.append(Mechanism("rings move along the axis", "um", 0.02, 0.8, ("preload_loss", "expansion_mismatch", "tandem_sharing"), "preload",
                               {"motions": _moved((first,), "outer_z")}))  # fmt: skip
    return found


def _warmer(ring: str):
    """All regions of the part that carries the `ring` rings warmer by the amount (K)."""

    def temperatures(spindle: Spindle, amount: float, before: dict[str, float]) -> dict[str, float]:
        b = spindle.bearings[0]
        part = spindle.region(b.inner_ring if ring == "inner" else b.outer_ring).part
        return {name: t + amount * (spindle.region(name).part == part) for name, t in before.items()}

    return temperatures


def _moved(names: tuple[str, ...] | None, coordinate: str, factor: float = 1.0):
    def motions(spindle: Spindle, amount: float, before: dict[str, RingMotion]) -> dict[str, RingMotion]:
        more = 1e-6 * factor * amount
        return {
            b: replace(m, **{coordinate: getattr(m, coordinate) + more}) if names is None or b in names else m for b, m in before.items()
        }

    return motions


# ---- bearings


def of_bearings(spindle: Spindle) -> list[Mechanism]:
    last = spindle.bearings[-1].name
    return [
        Mechanism("compliance in series with the bearings", "% of the bearing's", 0.5, 25.0, ("bond_softening", "housing_flexibility"), "bearings",
                  {"bearings": _in_series(None)}, sign=1, laws="any"),
        Mechanism(f"compliance in series with the {last} bearing", "% of the bearing's", 0.5, 25.0, ("bond_softening", "seat_clearance"), last,
                  {"bearings": _in_series(last)}, sign=1),
        Mechanism("bearing damping", "% (ln)", 10.0, 150.0, ("grease_damping", "lubricant_film", "seat_friction"), "bearings damping",
                  {"bearings": _each(None, lambda b, a: replace(b, damping=np.exp(a / 100) * b.damping))}),
        Mechanism("negative stiffness between rotor and stator", "% of a bearing's radial", 0.1, 3.0, ("magnetic_pull",), "bearings",
                  {"chain": _pull}, sign=1, laws="any"),
        # nothing in any list of names: stiffer, and in one direction alone; a whirl force; loss without its stiffness
        Mechanism("bearings stiffen across the axis", "%", 1.0, 20.0, (), "bearings radial", {"bearings": _each(None, _radially)}, sign=1),
        Mechanism(f"{last} bearing stiffens", "%", 1.0, 20.0, (), last, {"bearings": _each(last, _stiffer)}, sign=1),
        Mechanism("cross-coupled stiffness of the bearings", "% of the radial", 0.3, 4.0, (), "bearings", {"bearings": _each(None, _crossed)}),
    ]  # fmt: skip


def _each(name: str | None, change: Callable[[BearingState, float], BearingState]):
    def bearings(spindle: Spindle, amount: float, before: tuple[BearingState, ...]) -> tuple[BearingState, ...]:
        return tuple(change(b, amount) if name in (None, b.name) else b for b in before)

    return bearings


def _with_stiffness(b: BearingState, stiffness: Array) -> BearingState:
    """The damping keeps its ratio to the stiffness."""
    return replace(b, stiffness=stiffness, damping=b.damping[2, 2] / b.stiffness[2, 2] * stiffness)


def _in_series(name: str | None):
    """A compliance of force only, alike along all three axes, of some share of the bearing's radial compliance; 5 % lossy itself."""

    def change(b: BearingState, amount: float) -> BearingState:
        if amount <= 0:
            return b
        compliance = np.diag([1.0, 1.0, 1.0, 0.0, 0.0]) * amount / 100 / b.stiffness[0, 0]
        k = b.stiffness + 1j * OMEGA * b.damping
        both = k @ np.linalg.inv(np.eye(5) + compliance / (1 + 0.05j) @ k)
        both = (both + both.T) / 2
        return replace(b, stiffness=both.real, damping=both.imag / OMEGA)

    return _each(name, change)


def _radially(b: BearingState, amount: float) -> BearingState:
    d = np.diag([np.sqrt(1 + max(amount, -90) / 100)] * 2 + [1.0] * 3)
    return _with_stiffness(b, d @ b.stiffness @ d)


def _stiffer(b: BearingState, amount: float) -> BearingState:
    return _with_stiffness(b, (1 + max(amount, -90) / 100) * b.stiffness)


def _crossed(b: BearingState, amount: float) -> BearingState:
    """k_xy = -k_yx, as fluid films have it: it feeds one whirl and damps the other."""
    skew = np.zeros((5, 5))
    skew[0, 1], skew[1, 0] = 1.0, -1.0
    return replace(b, stiffness=b.stiffness + amount / 100 * b.stiffness[0, 0] * skew)


def _pull(spindle: Spindle, amount: float, chain: RotorBase) -> RotorBase:
    own = [e for e in chain.elements if e.group == "bearings"]
    k = -amount / 100 * own[0].stiffness[0, 0]
    z = float(np.mean([e.z for e in own]))
    turns = next(name for name in (own[0].a, own[0].b) if spindle.structure.body(name).turns)
    stands = own[0].a if turns == own[0].b else own[0].b
    if spindle.structure.shafts:  # on the shaft's node there, not at the end of an arm from the first bearing's
        node = min((b for b in chain.bodies if b.turns), key=lambda b: abs(b.z - z))
        turns, z = node.name, node.z
    pull = Element("pull", "pull", stands, turns, z, np.diag([k, k, 0.0, 0.0, 0.0]), np.zeros((5, 5)))
    return replace(chain, elements=(*chain.elements, pull))
