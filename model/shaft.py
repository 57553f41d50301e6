"""Flexible shafts as they are drawn: plain and tapered round segments along the spindle axis, or
rectangular ones, and the nodes a beam model gives them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

SAME_HEIGHT = 1e-6  # m, within which two heights are one node
THEORIES = {"euler-bernoulli": (0.0, 0.0), "rayleigh": (0.0, 1.0), "timoshenko": (1.0, 1.0)}
"""Shear and rotary inertia of the beam theories, as shares of those of the section."""


@dataclass(frozen=True)
class Segment:
    """A piece of a shaft between two heights (m), its radii at both ends (m), which change evenly between them.

    `outer` carries stiffness, `mass_outer` mass: a clamped-on ring is heavy and hardly stiff. A rectangular one is
    solid and has `sides` (m) along x and y, the same at both ends; its radii are half of that along x, as it is drawn.
    """

    z: tuple[float, float]
    outer: tuple[float, float]
    bore: tuple[float, float]
    mass_outer: tuple[float, float]
    material: str
    sides: tuple[float, float] | None = None


@dataclass(frozen=True)
class Shaft:
    """A flexible shaft, or a housing that gives: segments in order of z, and the heights (m) of its nodes.

    `shear` and `rotary` are the shares of shear flexibility and of rotary inertia that its beams have, 1 for a Timoshenko beam.
    """

    name: str
    segments: tuple[Segment, ...]
    nodes: tuple[float, ...]
    turns: bool
    speed_ratio: float
    damping_ratio: float
    role: str = ""
    shear: float = 1.0
    rotary: float = 1.0
    moves: tuple[str, ...] = ("x", "y", "z", "tilt_x", "tilt_y")  # of its nodes, in the order of `structure.MOVES`
    loss_factor: float = 0.0  # of its elements, the same at all frequencies
    regions: tuple[str, ...] = field(default=(), compare=False, repr=False)  # the section regions whose mass it has; empty for a shaft given by numbers

    @cached_property
    def bodies(self) -> tuple[str, ...]:
        """Names of its nodes' bodies, lowest first."""
        return tuple(f"{self.name} {i}" for i in range(len(self.nodes)))

    @cached_property
    def elements(self) -> tuple[str, ...]:
        """Names of the beam elements between its nodes."""
        return tuple(f"{self.name} {i}-{i + 1}" for i in range(len(self.nodes) - 1))

    def node_at(self, z: float) -> str:
        """Name of the node's body nearest a height (m)."""
        nearest = min(range(len(self.nodes)), key=lambda i: abs(self.nodes[i] - z))
        return self.bodies[nearest]


def mesh(segments: Sequence[Segment], heights: Sequence[float], longest: float) -> tuple[float, ...]:
    """Heights (m) of nodes: both ends, every one of `heights` on the shaft, and between them elements of equal length up to `longest`."""
    low, high = segments[0].z[0], segments[-1].z[1]
    wanted = [low]
    for z in sorted((*heights, high)):
        if low < z <= high + SAME_HEIGHT and z - wanted[-1] > SAME_HEIGHT:
            wanted.append(min(z, high))
    nodes = [low]
    for a, b in itertools.pairwise(wanted):
        count = max(1, int(-((b - a) // -(longest * (1 + 1e-9)))))
        nodes += [a + (b - a) * k / count for k in range(1, count + 1)]
    return tuple(nodes)
