"""What a spindle is: frozen definitions in SI units, made by `model.scene.reading.load`.

Temperatures are in degrees Celsius (only differences enter the physics), angles in radians, everything else SI. What a bearing, a material
and a structure is stands in `model.bearing.definitions`, `model.material` and `model.structure`, the rest of a drawing in `model.drawing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, wraps
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from thermospindle.model.bearing.definitions import Bearing, BearingSet, LinearBearing, RollerBearing
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.drawing.heating import Thermal
from thermospindle.model.drawing.measuring import HammerTest, Point, Tolerances
from thermospindle.model.drawing.section import Region
from thermospindle.model.errors import BadInput, named
from thermospindle.model.material import Material
from thermospindle.model.structure import Body, Structure

RACEWAY_WIDTH = 1.9
"""Largest width of a bearing over its ball diameter where none is told and rings share a tube: 1.7
to 2.1 in series 70, 719 and miniature ones."""


@dataclass(frozen=True)
class Provenance:
    """Where a number comes from: `origin` is printed, assumed or calibrated."""

    origin: str
    source: str


@dataclass(frozen=True)
class Addition:
    """A physical effect that a scene adds to the base model: its name and its parameter values (their units).

    `definition` is the effect itself where it is not one of the catalogue (`sim.effects.resolved` puts it there).
    """

    effect: str
    values: Mapping[str, float]
    definition: Any = field(default=None, compare=False, repr=False)


@dataclass(frozen=True)
class Build:
    """How a built spindle differs from its drawing, fitted to tests; the numbers of the spindle that holds it are the built ones.

    `deviations` are relative, by name of the toleranced parameter (`model.built.tolerance`);
    `tests` the ids of the tests they were fitted to.
    """

    deviations: Mapping[str, float]
    tests: tuple[str, ...]


@dataclass(frozen=True)
class RadialLoad:
    """An external force (N) along x and y on what turns at a height `z` (m): on the `body` or shaft named,
    or on the one that the height tells (`model.carrier`); `key` begins the keys of the scene that tell it."""

    force: tuple[float, float]
    z: float
    body: str = ""
    key: str = field(default="radial_load_", compare=False)

    @property
    def told(self) -> str:
        """The key of its force and the value, as the scene has it."""
        return f"{self.key}{'force_' if self.key.endswith('.') else ''}N = [{self.force[0]:g}, {self.force[1]:g}]"


@dataclass(frozen=True)
class Spindle:
    name: str
    title: str
    reference_temperature: float
    materials: Mapping[str, Material]
    regions: tuple[Region, ...]
    bearings: tuple[Bearing, ...]  # ball rows, lowest first
    sets: tuple[BearingSet, ...]  # every ball row is in one of them
    structure: Structure
    points: tuple[Point, ...]
    hammer: HammerTest
    thermal: Thermal
    tolerances: Tolerances
    nominal_speed: float  # rad/s, the service speed
    temperatures: tuple[float, float]  # C, between which it is meant to run
    ball_inertia: float = 0.0  # share of the balls' centrifugal force and gyroscopic moment in the equilibrium, 0 to 1
    axial_load: float = 0.0  # N, external axial force on what carries the outer rings, positive along z
    radial_loads: tuple[RadialLoad, ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)  # m/s2 along x and y, on all that has mass: of a spindle that lies
    linear_bearings: tuple[LinearBearing, ...] = ()  # those given by numbers
    roller_bearings: tuple[RollerBearing, ...] = ()  # cylindrical ones, lowest first
    effects: tuple[Addition, ...] = ()
    build: Build | None = None
    imperfections: Imperfections = field(default_factory=Imperfections)
    provenance: Mapping[str, Provenance] = field(default_factory=dict, repr=False)  # by dotted key of the file
    file: Path | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}: {len(self.all_bearings)} bearings, {len(self.structure.bodies)} bodies, {len(self.points)} points>"

    @property
    def loaded_across(self) -> bool:
        """Whether radial loads or its weight displace its rings."""
        return any(any(load.force) for load in self.radial_loads) or any(self.gravity)

    @property
    def all_bearings(self) -> tuple[Bearing | LinearBearing | RollerBearing, ...]:
        """Ball rows, bearings given by numbers and roller bearings, lowest first."""
        every: list[Bearing | LinearBearing | RollerBearing] = [*self.bearings, *self.linear_bearings, *self.roller_bearings]
        return tuple(sorted(every, key=lambda b: b.z))

    def __getstate__(self) -> dict:
        """Without what was worked out: it is on its way to another process."""
        return {k: v for k, v in self.__dict__.items() if k != "_known"}

    @cached_property
    def _known(self) -> dict[Callable, Any]:
        """Answers of functions that are `kept`."""
        return {}

    @cached_property
    def ringed(self) -> tuple[Bearing | RollerBearing, ...]:
        """The bearings whose rings are regions of the section: ball rows, then roller bearings."""
        return (*self.bearings, *(b for b in self.roller_bearings if b.inner_ring))

    @property
    def rolling(self) -> tuple[Bearing | RollerBearing, ...]:
        """The bearings with rolling elements: ball rows, then roller bearings."""
        return (*self.bearings, *self.roller_bearings)

    @property
    def used_materials(self) -> tuple[str, ...]:
        """Names of the materials that regions, balls, rollers and rings are made of, in order."""
        used = {g.material for g in self.regions} | {name for b in self.bearings for name in (b.ball_material, b.ring_material)}
        return tuple(sorted(used | {name for r in self.roller_bearings for name in (r.roller_material, r.ring_material)}))

    def bearing(self, name: str) -> Bearing:
        """The ball row of that name."""
        return named(name, self.bearings, "ball row")

    def set_of(self, bearing: str) -> BearingSet:
        """The set a ball row is in."""
        return next(s for s in self.sets if bearing in s.bearings)

    def one_way(self, bearings: BearingSet) -> bool:
        """Whether all rows of a set are loaded the same way, so that only an outer force can preload them."""
        return len({self.bearing(name).sense for name in bearings.bearings}) == 1

    @property
    def turning(self) -> Body:
        """The body that turns; of several the one nearest their common centre of mass."""
        turning = [b for b in self.structure.bodies if b.turns]
        if not turning:
            raise BadInput(f"{self.file or self.name}: structure: nothing turns, so there is nothing to spin; a body or shaft needs turns = true")
        centre = sum(b.mass * b.z for b in turning) / sum(b.mass for b in turning)
        return min(turning, key=lambda b: abs(b.z - centre))

    @property
    def standing(self) -> Body:
        """The body that holds the first bearing's ring that does not turn."""
        first = self.bearings[0]
        return self.structure.body(first.inner_body if first.turning_ring == "outer" else first.outer_body)

    def axial_on_turning(self, force: float) -> float:
        """`axial_load` (N) of an axial force (N) on what turns: itself where outer rings turn, its
        opposite where inner rings do, since bearings feel the motion between both alone."""
        return -force if any(b.turning_ring == "inner" for b in self.bearings) else force

    @property
    def turning_mass(self) -> float:
        """Mass (kg) of all that turns."""
        return sum(b.mass for b in self.structure.bodies if b.turns)

    def turning_at(self, z: float) -> Body:
        """The turning body nearest a height (m): a node of a flexible shaft, or the rigid hub wherever one asks."""
        return min((b for b in self.structure.bodies if b.turns), key=lambda b: abs(b.z - z))

    def raceway(self, ring: str, bearing: Bearing | RollerBearing) -> tuple[float, float]:
        """Heights (m) between which the raceway of `bearing` lies on its region `ring`.

        The bearing's height plus and minus half its `raceway_width`, inside the region. Without a width the whole height
        of a region that serves one bearing, and on one that several share `RACEWAY_WIDTH` ball diameters, or as much as
        the nearest row leaves: half of what is between them, or what its own width leaves; but no less than a ball.
        """
        region, width = self.region(ring), bearing.raceway_width
        if width is None:
            sharing = [b for b in self.ringed if b.name != bearing.name and ring in (b.inner_ring, b.outer_ring)]
            if not sharing:
                return region.z
            left = [apart if b.raceway_width is None else 2 * apart - b.raceway_width for b in sharing for apart in [abs(b.z - bearing.z)]]
            width = max(bearing.ball_diameter, min(RACEWAY_WIDTH * bearing.ball_diameter, *left))
        return max(region.z[0], bearing.z - width / 2), min(region.z[1], bearing.z + width / 2)

    def region(self, name: str) -> Region:
        return self._regions[name]

    @cached_property
    def _regions(self) -> dict[str, Region]:
        return {r.name: r for r in self.regions}

    def point(self, node: int) -> Point:
        """The measuring point of that number; `BadInput` where there is none."""
        for p in self.points:
            if p.node == node:
                return p
        raise BadInput(f"no point has the node {node!r}; allowed are {', '.join(f'{p.node} ({p.name})' for p in self.points)}")


T = TypeVar("T")


def kept(worked_out: Callable[[Spindle], T]) -> Callable[[Spindle], T]:
    """A function of a drawing alone, asked at many conditions: its answer stays with the drawing."""

    @wraps(worked_out)
    def of(spindle: Spindle) -> T:
        if worked_out not in spindle._known:
            spindle._known[worked_out] = worked_out(spindle)
        found: T = spindle._known[worked_out]
        return found

    return of


@dataclass(frozen=True)
class Condition:
    """One operating condition: chamber temperature (C), speed (rad/s, positive about +z), and what else a test may vary."""

    temperature: float
    speed: float = 0.0
    level: float = 0.0  # N, peak force of the hammer; 0 is the limit of a light tap
    soak_time: float = np.inf  # s in the chamber before the test


@dataclass(frozen=True)
class RingMotion:
    """Thermal motion of one bearing's rings from the reference state (m): means over the raceway faces, r outward, z up.

    The outer ring's axial motion excludes the rigid movement of the hub, which the bearings decide (Jang et al. 2003, 2.2).
    `inner_strain`, `outer_strain`, `ball_strain` are the free thermal strains of grooves and balls.
    """

    inner_r: float
    inner_z: float
    outer_r: float
    outer_z: float
    inner_strain: float
    outer_strain: float
    ball_strain: float
    temperature: float  # C, of the balls and grooves, for their elastic modulus
