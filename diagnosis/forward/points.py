"""Operating points that differ in little from those that are there: in the measuring chain, or in how far the rings expand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.sim.effects.effect import Effect, Values
from thermospindle.sim.operating import OperatingPoint

Applied = Sequence[tuple[Effect, Values]]


def replace_measuring(point: OperatingPoint, effects: Applied) -> OperatingPoint:
    """The same point under another list of effects that differs in the measuring chain alone; its chain and matrices are kept."""
    if tuple(effects) == point.effects:
        return point
    other = replace(point, effects=tuple(effects))
    other.__dict__["chain"] = point.chain
    if "_bare" in point.__dict__:
        other.__dict__["_bare"] = point.__dict__["_bare"]
    return other


def stretched(radial: float, axial: float, grooves: float) -> tuple[Effect, Values]:
    """Thermal ring motions times a factor each, in radius, along the axis, and of grooves."""
    factors = {"inner_r": radial, "outer_r": radial, "inner_z": axial, "outer_z": axial, "inner_strain": grooves, "outer_strain": grooves}

    def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
        return {b: replace(m, **{k: f * getattr(m, k) for k, f in factors.items()}) for b, m in by_bearing.items()}

    return Effect("expansion", "", "", (), "", (), "", motions=motions), {}
