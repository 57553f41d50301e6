"""What a bearing is to the rotor: a stiffness and damping between two bodies at a height, with names for its entries."""

from __future__ import annotations

from dataclasses import dataclass

from thermospindle.model.types import Array


class ByDirection:
    """The entries of a bearing's stiffness (5, 5) that have names."""

    stiffness: Array

    @property
    def radial_stiffness(self) -> float:
        return float(self.stiffness[0, 0])

    @property
    def axial_stiffness(self) -> float:
        return float(self.stiffness[2, 2])

    @property
    def tilt_stiffness(self) -> float:
        return float(self.stiffness[3, 3])

    @property
    def coupling_stiffness(self) -> float:
        """Radial force per tilt, k_x,tilt_y (N/rad)."""
        return float(self.stiffness[0, 4])


@dataclass(frozen=True)
class LinearState(ByDirection):
    """A bearing given by numbers at one condition: stiffness and damping (5, 5) between its two bodies at its height."""

    name: str
    z: float
    stiffness: Array
    damping: Array
