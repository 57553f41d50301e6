"""What a bearing is to the rotor: a stiffness and damping between two bodies at a height, with names for its entries."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from thermospindle.model.errors import OutsideRange
from thermospindle.model.machine import Condition, LinearBearing, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM

ALIKE = 1e-6
"""Of a stiffness across the axis, within which two directions are one."""


class ByDirection:
    """The entries of a bearing's stiffness (5, 5) that have names. Those along x and about x hold
    along y and about y too, unless a radial load or given numbers tell directions apart."""

    stiffness: Array

    @property
    def alike(self) -> bool:
        """Whether the bearing is as stiff in every direction across the axis."""
        k = self.stiffness
        return bool(max(abs(k[0, 0] - k[1, 1]), abs(k[0, 1])) <= ALIKE * max(k[0, 0], k[1, 1]))

    @property
    def radial_stiffness(self) -> float:
        return float(self.stiffness[0, 0])

    @property
    def radial_stiffness_y(self) -> float:
        return float(self.stiffness[1, 1])

    @property
    def radial_stiffness_xy(self) -> float:
        """Force along x for a motion along y (N/m)."""
        return float(self.stiffness[0, 1])

    @property
    def axial_stiffness(self) -> float:
        return float(self.stiffness[2, 2])

    @property
    def tilt_stiffness(self) -> float:
        return float(self.stiffness[3, 3])

    @property
    def tilt_stiffness_y(self) -> float:
        return float(self.stiffness[4, 4])

    @property
    def coupling_stiffness(self) -> float:
        """Radial force per tilt, k_x,tilt_y (N/rad)."""
        return float(self.stiffness[0, 4])

    @property
    def coupling_stiffness_y(self) -> float:
        """The same along y, -k_y,tilt_x (N/rad)."""
        return -float(self.stiffness[1, 3])


@dataclass(frozen=True)
class LinearState(ByDirection):
    """A bearing given by numbers at one condition: stiffness and damping (5, 5) between its two bodies at its height."""

    name: str
    z: float
    stiffness: Array
    damping: Array
    radial_force: tuple[float, float] = field(default=(0.0, 0.0), kw_only=True)  # N, on its outer ring under a radial load, to hold it there


def linear_state(spindle: Spindle, b: LinearBearing, condition: Condition) -> LinearState:
    """A bearing given by numbers at a condition, bilinear between those of its table; `OutsideRange` beyond them."""
    grid = np.reshape(b.stiffness, (len(b.temperature), len(b.speed), 5, 5))
    at = []
    for name, unit, values, where in (
        ("temperature", "C", list(b.temperature), condition.temperature),
        ("speed", "rpm", [v / RPM for v in b.speed], abs(condition.speed) / RPM),
    ):
        if len(values) > 1 and not values[0] - 1e-9 <= where <= values[-1] + 1e-9:
            of = f"{spindle.file or spindle.name}: bearings.{b.name}.numbers.table"
            raise OutsideRange(f"{of}: spans {name} {values[0]:g} to {values[-1]:g} {unit} and was asked at {where:g} {unit}")
        at.append(float(np.interp(where, values, np.arange(len(values)))))
    i, j = (min(int(x), n - 1) for x, n in zip(at, grid.shape[:2], strict=True))
    p, q = at[0] - i, at[1] - j
    i1, j1 = min(i + 1, grid.shape[0] - 1), min(j + 1, grid.shape[1] - 1)
    k = (1 - p) * ((1 - q) * grid[i, j] + q * grid[i, j1]) + p * ((1 - q) * grid[i1, j] + q * grid[i1, j1])
    return LinearState(b.name, b.z, k, spindle.structure.damping_time(b.damping_ratio) * k)
