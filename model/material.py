"""What a material is: laws over temperature, and an isotropic linear thermo-elastic material made of them; `model.machine` has them in a spindle."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from thermospindle.model.errors import OutsideRange
from thermospindle.model.types import Array

BEYOND = 0.01  # K, to which a law goes on straight beyond its ends: computed temperatures overshoot by as much, and no thermometer tells


@dataclass(frozen=True)
class Law:
    """A material property over temperature: piecewise linear between `temperature` (C), constant when there is one entry."""

    temperature: tuple[float, ...]
    value: tuple[float, ...]

    def __call__(self, temperature: float) -> float:
        if len(self.value) == 1:
            return self.value[0]
        if not self.temperature[0] - BEYOND <= temperature <= self.temperature[-1] + BEYOND:
            self.check(temperature)
        k = min(max(bisect_right(self.temperature, temperature), 1), len(self.value) - 1)
        (start, end), (first, last) = self.temperature[k - 1 : k + 1], self.value[k - 1 : k + 1]
        return first + (temperature - start) / (end - start) * (last - first)

    def check(self, temperature: float | Array) -> None:
        """OutsideRange where one of some temperatures (C) lies further than `BEYOND` from a law of several entries."""
        (low, high), (least, most) = (self.temperature[0], self.temperature[-1]), (np.min(temperature), np.max(temperature))
        if not (low - BEYOND <= least and most <= high + BEYOND):
            asked = f"at {least:.6g} C" if least == most else f"from {least:.6g} to {most:.6g} C"
            raise OutsideRange(f"a material law given from {low:g} to {high:g} C was asked {asked}")

    def integral(self, start: float, stop: float) -> float:
        """Integral of the property from `start` to `stop` (C), exact for the piecewise linear law."""
        if len(self.value) == 1:
            return self.value[0] * (stop - start)
        low, high = sorted((start, stop))
        knots = [low, *[t for t in self.temperature if low < t < high], high]
        area = float(np.trapezoid([self(t) for t in knots], knots))
        return area if stop >= start else -area


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
