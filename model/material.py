"""What a material is: laws over temperature, and an isotropic linear thermo-elastic material made
of them; `model.machine` has them in a spindle."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import log10

import numpy as np

from thermospindle.model.errors import OutsideRange
from thermospindle.model.types import Array

BEYOND = 0.01  # K, to which a law goes on straight beyond its ends: computed temperatures overshoot by as much, and no thermometer tells


@dataclass(frozen=True)
class Entries:
    """Values of a property at rising temperatures (C); `key` of the scene's file where they stand, empty where they stand in none."""

    temperature: tuple[float, ...]
    value: tuple[float, ...]
    key: str = field(default="", compare=False, repr=False)

    def check(self, temperature: float | Array) -> None:
        """OutsideRange where one of some temperatures (C) lies further than `BEYOND` from a law of several entries."""
        (low, high), (least, most) = (self.temperature[0], self.temperature[-1]), (np.min(temperature), np.max(temperature))
        if not (low - BEYOND <= least and most <= high + BEYOND):
            asked = f"at {least:.6g} C" if least == most else f"from {least:.6g} to {most:.6g} C"
            raise OutsideRange(f"{f'{self.key}: a law' if self.key else 'a material law'} given from {low:g} to {high:g} C was asked {asked}")

    def _after(self, temperature: float) -> int:
        """The entry up to which a temperature reaches from the one before."""
        return min(max(bisect_right(self.temperature, temperature), 1), len(self.value) - 1)


@dataclass(frozen=True)
class Law(Entries):
    """A material property over temperature: piecewise linear between its entries, constant when there is one."""

    def __call__(self, temperature: float) -> float:
        if len(self.value) == 1:
            return self.value[0]
        if not self.temperature[0] - BEYOND <= temperature <= self.temperature[-1] + BEYOND:
            self.check(temperature)
        k = self._after(temperature)
        (start, end), (first, last) = self.temperature[k - 1 : k + 1], self.value[k - 1 : k + 1]
        return first + (temperature - start) / (end - start) * (last - first)

    def integral(self, start: float, stop: float) -> float:
        """Integral of the property from `start` to `stop` (C), exact for the piecewise linear law."""
        if len(self.value) == 1:
            return self.value[0] * (stop - start)
        low, high = sorted((start, stop))
        knots = [low, *[t for t in self.temperature if low < t < high], high]
        value = [self(t) for t in knots]
        area = sum((b - a) * (u + v) / 2 for (a, b), (u, v) in zip(pairwise(knots), pairwise(value), strict=True))
        return area if stop >= start else -area


LEAST_VISCOSITY = 0.35e-6  # m2/s; log10 log10 (nu + 0.7 mm2/s) ends at 0.3 mm2/s


@dataclass(frozen=True)
class Viscosity(Entries):
    """Kinematic viscosity (m2/s) of an oil, at least `LEAST_VISCOSITY`: between its entries log10
    log10 (nu + 0.7) is linear in log10 T, nu in mm2/s and T in K (ASTM D341)."""

    @cached_property
    def _straight(self) -> list[tuple[float, float]]:
        """Entries as they lie on straight lines."""
        return [(log10(t + 273.15), log10(log10(1e6 * v + 0.7))) for t, v in zip(self.temperature, self.value, strict=True)]

    def __call__(self, temperature: float) -> float:
        if len(self.value) == 1:
            return self.value[0]
        if not self.temperature[0] - BEYOND <= temperature <= self.temperature[-1] + BEYOND:
            self.check(temperature)
        k = self._after(temperature)
        (start, first), (end, last) = self._straight[k - 1 : k + 1]
        asked = log10(temperature + 273.15)
        return 1e-6 * (float(10 ** 10 ** (first + (asked - start) / (end - start) * (last - first))) - 0.7)


@dataclass(frozen=True)
class Material:
    """An isotropic linear thermo-elastic material.

    `thermal_expansion` is the instantaneous coefficient d(strain)/dT; the strain is its integral.
    """

    name: str
    youngs_modulus: Law  # Pa
    poisson_ratio: float
    thermal_expansion: Law  # 1/K
    density: float  # kg/m3
    conductivity: float  # W/(m K)
    heat_capacity: float  # J/(kg K)

    def thermal_strain(self, temperature: float, reference: float) -> float:
        return self.thermal_expansion.integral(reference, temperature)
