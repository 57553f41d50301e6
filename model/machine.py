"""What a spindle is: frozen definitions in SI units, made by `model.scene.reading.load`.

Temperatures are in degrees Celsius (only differences enter the physics), angles in radians, everything else SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.imperfections import Imperfections
from thermospindle.model.shaft import Shaft

PARTS = ("stationary", "rotating")
SENSE = {"back-to-back": (-1, 1), "face-to-face": (1, -1), "tandem": (1, 1)}
"""`Bearing.sense` of the (lower, upper) bearing of a pair: back-to-back outer rings load as they move apart."""
RACEWAY_WIDTH = 1.9
"""Width of a bearing over its ball diameter where none is told and rings share a tube: 1.7 to 2.1 in series 70, 719 and miniature ones."""
MOVES = ("x", "y", "z", "tilt_x", "tilt_y")
"""Degrees of freedom of a body on the spindle axis, in the order of every 5-vector and 5x5 matrix of the project."""


@dataclass(frozen=True)
class Law:
    """A material property over temperature: piecewise linear between `temperature` (C), constant when there is one entry."""

    temperature: tuple[float, ...]
    value: tuple[float, ...]

    def __call__(self, temperature: float) -> float:
        if len(self.value) == 1:
            return self.value[0]
        low, high = self.temperature[0], self.temperature[-1]
        if not low <= temperature <= high:
            raise OutsideRange(f"a material law given from {low:g} to {high:g} C was asked at {temperature:g} C")
        return float(np.interp(temperature, self.temperature, self.value))

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


@dataclass(frozen=True)
class Region:
    """A ring of rectangular section, r0 <= r <= r1, z0 <= z <= z1 (m); later regions of a part cut earlier ones."""

    name: str
    part: str  # one of PARTS
    material: str
    r: tuple[float, float]
    z: tuple[float, float]
    role: str = ""  # shaft, hub, insert or support: what effects know it by; empty for none of these


@dataclass(frozen=True)
class Bearing:
    """One ball row at `z` (m), between two ring regions; `contact_angle` is the loaded one of the reference state."""

    name: str
    z: float
    inner_ring: str
    outer_ring: str
    balls: int
    ball_diameter: float
    pitch_diameter: float
    contact_angle: float
    inner_conformity: float
    outer_conformity: float
    clearance: tuple[float, float] | None  # diametral, smallest and largest; None where nobody says
    ball_material: str
    ring_material: str
    damping_ratio: float  # at Structure.damping_frequency
    sense: int  # -1 or 1: direction along z in which moving the outer ring loads the row
    inner_body: str  # the bodies that carry its rings; "ground" stands still
    outer_body: str
    turning_ring: str  # inner | outer
    preload: float  # N, axial, its share of its set's at the reference temperature
    raceway_width: float | None = None  # m, along z; None for the whole height of a ring that is this bearing's alone
    constant_factor: float = 1.0  # load-deflection constant over that of Hertz, where a catalogue tells it
    rated_stiffness: float | None = None  # N/m, radial, as a catalogue or designer states it

    @property
    def unloaded_distance(self) -> float:
        """Distance of the groove curvature centres at zero load, (f_i + f_o - 1) d_B: Jang et al. 2003, Eq. (2)."""
        return (self.inner_conformity + self.outer_conformity - 1.0) * self.ball_diameter


@dataclass(frozen=True)
class LinearBearing:
    """A bearing given by numbers: the 5x5 matrix of its ring's motion against its seat, constant or over temperature and speed."""

    name: str
    z: float
    inner_body: str
    outer_body: str
    temperature: tuple[float, ...]  # C, rising; one where nothing depends on it
    speed: tuple[float, ...]  # rad/s, rising
    stiffness: tuple[float, ...]  # N/m, N/rad, N m/rad: (temperatures, speeds, 5, 5), flat
    damping_ratio: float  # at Structure.damping_frequency


@dataclass(frozen=True)
class RollerBearing:
    """Cylindrical roller rows side by side at `z` (m): line contacts with a radial clearance, free along the axis.

    `clearance` is the diametral one of the mounted bearing at the reference temperature, negative where its rollers are preloaded. Its rings
    are regions of the section, or none, whose clearance then stays.
    """

    name: str
    z: float
    inner_ring: str  # region; empty for none
    outer_ring: str
    rows: int
    row_spacing: float  # m, between the middles of neighbouring rows
    rollers: int  # of one row
    roller_diameter: float
    roller_length: float  # m, effective, of one roller
    pitch_diameter: float
    clearance: float
    roller_material: str
    ring_material: str
    damping_ratio: float  # at Structure.damping_frequency
    inner_body: str
    outer_body: str
    raceway_width: float | None = None  # m, as of a ball row

    @property
    def ball_diameter(self) -> float:
        """Diameter of the rolling elements, under the name that ball rows have for it."""
        return self.roller_diameter

    @property
    def ball_material(self) -> str:
        """Material of the rolling elements, under the name that ball rows have for it."""
        return self.roller_material


@dataclass(frozen=True)
class PreloadSpring:
    """The spring behind one ring of each of the bearings `rings_of`, which slide as one; the others locate the shaft and take axial loads.

    Without a `rate` the spring's force is the preload wherever the rings slide, and in vibration friction holds them in their seat. With
    one, force falls as they follow, and they slide in vibration too, with their own `mass`.
    """

    rings_of: tuple[str, ...]
    rate: float | None = None  # N/m
    mass: float = 0.0  # kg, of the sliding rings


@dataclass(frozen=True)
class BearingSet:
    """Ball rows that are preloaded together: each of the groups that load against each other carries `preload`, its rows share it.

    A set all of whose rows are loaded one way is preloaded from outside.
    """

    name: str
    bearings: tuple[str, ...]
    preload: float  # N, axial, at the reference temperature
    spring: PreloadSpring | None = None  # None for rings fixed in their seats, and for rows loaded from outside


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


@dataclass(frozen=True)
class Structure:
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    damping_frequency: float  # Hz; damping = 2 zeta stiffness / (2 pi this)
    inner_body: str = ""  # the bodies that carry the rings of bearings that name none of their own
    outer_body: str = ""
    shafts: tuple[Shaft, ...] = ()  # those whose nodes and elements are among `bodies` and `joints`

    def carrier(self, body: str) -> str:
        """What a body is axially rigid with: its shaft, or itself."""
        return next((s.name for s in self.shafts if body in s.bodies), body)

    def body(self, name: str) -> Body:
        return next(b for b in self.bodies if b.name == name)


@dataclass(frozen=True)
class Point:
    """A measuring point; `direction` is a unit vector along an axis."""

    node: int
    name: str
    body: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True)
class HammerTest:
    """The virtual impact test: hammer, vibrometer, acquisition and windows."""

    hammer_nodes: tuple[int, ...]
    tip_stiffness: float  # N/m
    hammer_mass: float  # kg
    level: float  # N, peak force
    level_scatter: float  # relative, hit to hit
    hits: int
    double_hit_probability: float
    sample_rate: float  # Hz
    record_length: float  # s
    exponential_end: float  # value of the exponential window at the end of the record; 1 is no window
    band: tuple[float, float]  # Hz
    noise_of_value: float  # relative FRF noise per line
    noise_of_largest: float  # of the largest response to that hammer
    step: float  # s, integration step


@dataclass(frozen=True)
class Convection:
    """Convection to the chamber air on the exposed faces of `regions`."""

    regions: tuple[str, ...]
    coefficient: float  # W/(m2 K)


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
    viscosity: Law  # kinematic, m2/s
    conductance: float  # W/K through one bearing


@dataclass(frozen=True)
class Thermal:
    convections: tuple[Convection, ...]
    sources: tuple[HeatSource, ...]
    gaps: tuple[AirGap, ...]
    friction: Friction


@dataclass(frozen=True)
class Tolerances:
    """One standard deviation of every build and measuring uncertainty, relative unless said."""

    structure: float
    hub: float
    preload: float
    damping: float
    temperature: float  # K
    gain: float


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

    `deviations` are relative, by name of the toleranced parameter (`model.tolerance`); `tests` the ids of the tests they were fitted to.
    """

    deviations: Mapping[str, float]
    tests: tuple[str, ...]


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
    radial_load: tuple[float, float] = (0.0, 0.0)  # N, external force along x and y on what turns
    radial_load_z: float = 0.0  # m, where it acts
    linear_bearings: tuple[LinearBearing, ...] = ()  # those given by numbers
    roller_bearings: tuple[RollerBearing, ...] = ()  # cylindrical ones, lowest first
    effects: tuple[Addition, ...] = ()
    build: Build | None = None
    imperfections: Imperfections = field(default_factory=Imperfections)
    provenance: Mapping[str, Provenance] = field(default_factory=dict, repr=False)  # by dotted key of the file
    file: Path | None = field(default=None, compare=False)

    @property
    def all_bearings(self) -> tuple[Bearing | LinearBearing | RollerBearing, ...]:
        """Ball rows, bearings given by numbers and roller bearings, lowest first."""
        every: list[Bearing | LinearBearing | RollerBearing] = [*self.bearings, *self.linear_bearings, *self.roller_bearings]
        return tuple(sorted(every, key=lambda b: b.z))

    @property
    def ringed(self) -> tuple[Bearing | RollerBearing, ...]:
        """The bearings whose rings are regions of the section: ball rows, then roller bearings."""
        return (*self.bearings, *(b for b in self.roller_bearings if b.inner_ring))

    def bearing(self, name: str) -> Bearing:
        """The ball row of that name."""
        return next(b for b in self.bearings if b.name == name)

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

    @property
    def turning_mass(self) -> float:
        """Mass (kg) of all that turns."""
        return sum(b.mass for b in self.structure.bodies if b.turns)

    def turning_at(self, z: float) -> Body:
        """The turning body nearest a height (m): a node of a flexible shaft, or the rigid hub wherever one asks."""
        return min((b for b in self.structure.bodies if b.turns), key=lambda b: abs(b.z - z))

    def raceway(self, ring: str, bearing: Bearing | RollerBearing) -> tuple[float, float]:
        """Heights (m) between which the raceway of `bearing` lies on its region `ring`.

        The bearing's height plus and minus half its `raceway_width`, inside the region. Without a width the whole height of a region that
        serves one bearing, and `RACEWAY_WIDTH` ball diameters on one that several share.
        """
        region, width = self.region(ring), bearing.raceway_width
        if width is None:
            if sum(ring in (b.inner_ring, b.outer_ring) for b in self.ringed) == 1:
                return region.z
            width = RACEWAY_WIDTH * bearing.ball_diameter
        return max(region.z[0], bearing.z - width / 2), min(region.z[1], bearing.z + width / 2)

    def region(self, name: str) -> Region:
        return next(r for r in self.regions if r.name == name)

    def point(self, node: int) -> Point:
        return next(p for p in self.points if p.node == node)


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
