"""The operating point of a spindle that turns with imperfections of a test's own."""

from dataclasses import replace

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.units import RPM
from thermospindle.sim.operating import OperatingPoint, operating_point

SPIN = 7200 * RPM


def at(spindle: Spindle, imperfections: Imperfections, temperature: float = 20.0, speed: float = SPIN) -> OperatingPoint:
    return operating_point(replace(spindle, imperfections=imperfections), Condition(temperature, speed))
