"""The section of a spindle: rings of rectangular section, each of one part and material."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

PARTS = ("stationary", "rotating")


@dataclass(frozen=True)
class Region:
    """A ring of rectangular section, r0 <= r <= r1, z0 <= z <= z1 (m); later regions of a part cut earlier ones."""

    name: str
    part: str  # one of PARTS
    material: str
    r: tuple[float, float]
    z: tuple[float, float]
    role: str = ""  # shaft, hub, insert or support: what effects know it by; empty for none of these

    @cached_property
    def outline(self) -> Region:
        """Itself without a material and a role: spindles whose outlines are equal have the same sections."""
        return replace(self, material="", role="")
