"""What warms a spindle and what cools it."""

from __future__ import annotations

from dataclasses import dataclass

from thermospindle.model.material import Viscosity


@dataclass(frozen=True)
class Convection:
    """Convection on the exposed faces of `regions`, to the chamber air, or to a coolant at a temperature of its own."""

    regions: tuple[str, ...]
    coefficient: float  # W/(m2 K)
    coolant: float | None = None  # C


@dataclass(frozen=True)
class HeatSource:
    """Heat made in the volume of `regions` while turning; scales with (speed / `speed`) ** `exponent`."""

    name: str
    regions: tuple[str, ...]
    power: float  # W at `speed`
    speed: float  # rad/s
    exponent: float


@dataclass(frozen=True)
class AirGap:
    """Heat conductance between two facing regions of different parts, over the facing area of the first."""

    regions: tuple[str, str]
    coefficient: float  # W/(m2 K)


@dataclass(frozen=True)
class Friction:
    """Palmgren's bearing friction torque M0 + M1 and the conductance through one bearing (Harris, Rolling Bearing Analysis)."""

    f0: float
    f1: float
    viscosity: Viscosity  # kinematic, m2/s
    conductance: float  # W/K through one bearing


@dataclass(frozen=True)
class Thermal:
    convections: tuple[Convection, ...]
    sources: tuple[HeatSource, ...]
    gaps: tuple[AirGap, ...]
    friction: Friction
