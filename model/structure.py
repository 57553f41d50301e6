"""What a structure is: rigid bodies, the joints between them and its flexible shafts, in SI units; `model.machine` has it in a spindle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import pi

from thermospindle.model.shaft import Shaft

MOVES = ("x", "y", "z", "tilt_x", "tilt_y")
"""Degrees of freedom of a body on the spindle axis, in the order of every 5-vector and 5x5 matrix of the project."""


@dataclass(frozen=True)
class Body:
    """A rigid body of the rotor-base chain: centre of mass on the axis at `z`, moving in `moves`."""

    name: str
    mass: float  # kg
    inertia: tuple[float, float, float]  # about x, y (through the centre of mass) and z, kg m2
    z: float
    moves: tuple[str, ...]
    turns: bool
    regions: tuple[str, ...]  # the section regions it is made of; empty for a body given by numbers
    role: str = ""  # base, seat, shaft, hub or housing: what effects know it by; empty for none of these
    speed_ratio: float = 1.0  # of its speed to the spindle's, where it turns


def with_mass(body: Body, mass: float, z: float, inertia: tuple[float, float, float]) -> Body:
    """The body with another one rigidly on it, of centre of mass at height `z` on the axis and its own `inertia` (x, y, z)."""
    total = body.mass + mass
    centre = (body.mass * body.z + mass * z) / total
    steiner = body.mass * (body.z - centre) ** 2 + mass * (z - centre) ** 2
    about = (body.inertia[0] + inertia[0] + steiner, body.inertia[1] + inertia[1] + steiner, body.inertia[2] + inertia[2])
    return replace(body, mass=total, z=centre, inertia=about)


@dataclass(frozen=True)
class Joint:
    """A compliant joint between two bodies at height `z`: a diagonal stiffness (N/m, N m/rad) in the order of MOVES."""

    name: str
    group: str
    bodies: tuple[str, str]
    z: float
    stiffness: tuple[float, float, float, float, float]
    damping_ratio: float
    role: str = ""  # mount, plate or flange: what effects know it by; empty for none of these
    material: str = ""  # whose elastic modulus its stiffness follows; empty for none
    loss_factor: float = 0.0  # the same at all frequencies, beside damping_ratio (`model.rotor.loss`)

    def stiffer(self, factor: float, tilt: float) -> Joint:
        """With its stiffness multiplied, and that against tilt by `tilt`."""
        x, y, z, tilt_x, tilt_y = self.stiffness
        return replace(self, stiffness=(factor * x, factor * y, factor * z, tilt * tilt_x, tilt * tilt_y))


@dataclass(frozen=True)
class Structure:
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    damping_frequency: float  # Hz; damping = 2 zeta stiffness / (2 pi this)
    inner_body: str = ""  # the bodies that carry the rings of bearings that name none of their own
    outer_body: str = ""
    shafts: tuple[Shaft, ...] = ()  # those whose nodes and elements are among `bodies` and `joints`

    def damping_time(self, ratio: float) -> float:
        """Damping over stiffness (s) of what has this damping ratio."""
        return 2 * ratio / (2 * pi * self.damping_frequency)

    @property
    def turns(self) -> bool:
        """Whether anything does."""
        return any(b.turns for b in self.bodies)

    def carrier(self, body: str) -> str:
        """What a body is axially rigid with: its shaft, or itself."""
        return self._shaft_of.get(body, body)

    def body(self, name: str) -> Body:
        return self._bodies[name]

    @cached_property
    def _bodies(self) -> dict[str, Body]:
        return {b.name: b for b in self.bodies}

    @cached_property
    def _shaft_of(self) -> dict[str, str]:
        """For every node's body the name of its shaft."""
        return {node: s.name for s in self.shafts for node in s.bodies}

    @property
    def rigid_bodies(self) -> list[Body]:
        """Those that are no node of a shaft."""
        return [b for b in self.bodies if self.carrier(b.name) == b.name]

    @property
    def parts(self) -> list[str]:
        """Names of what is axially rigid: of bodies, and of shafts in place of their nodes."""
        return [*(b.name for b in self.rigid_bodies), *(s.name for s in self.shafts)]

    @property
    def own_joints(self) -> list[Joint]:
        """Those that are no element of a shaft."""
        return [j for j in self.joints if not any(j.name in s.elements for s in self.shafts)]
