"""The states of a spindle that are asked what is odd about it."""

from __future__ import annotations

from dataclasses import dataclass

from thermospindle.model.errors import NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.units import RPM
from thermospindle.sim.operating import OperatingPoint, operating_point


@dataclass(frozen=True)
class Looked:
    """A spindle at its reference temperature at rest, and in its hottest state at rest and turning; in words where there is none."""

    spindle: Spindle
    reference: OperatingPoint
    hot: OperatingPoint | str
    turning: OperatingPoint | str


def looked(spindle: Spindle, reference: OperatingPoint) -> Looked:
    """The states that the questions of `odd` and `odd_bearings` are asked of."""
    hottest = max(spindle.temperatures, key=lambda t: abs(t - spindle.reference_temperature))

    def at(temperature: float, speed: float) -> OperatingPoint | str:
        try:
            return operating_point(spindle, Condition(temperature, speed))
        except (NoEquilibrium, OutsideRange) as error:
            return f"at {temperature:g} C and {speed / RPM:.0f} rpm: {error}"

    turns = spindle.structure.turns
    return Looked(spindle, reference, at(hottest, 0.0), at(spindle.reference_temperature, spindle.nominal_speed) if turns else "")
