"""What a bearing and a set of bearings are: frozen definitions in SI units, which `model.machine` has in a spindle.

A ball row, a bearing given by numbers, cylindrical roller rows; sets of ball rows that are preloaded together, rigidly or by a spring.
"""

from __future__ import annotations

from dataclasses import dataclass, field

SENSE = {"back-to-back": (-1, 1), "face-to-face": (1, -1), "tandem": (1, 1)}
"""`Bearing.sense` of the (lower, upper) bearing of a pair: back-to-back outer rings load as they move apart."""


@dataclass(frozen=True)
class ToldAngle:
    """The contact angle as a scene file tells it: `key` of its `row`, contact_angle_deg or
    free_contact_angle_deg, and the `value` (degrees) there."""

    row: str
    key: str
    value: float


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
    told: ToldAngle | None = field(default=None, compare=False, repr=False)  # what its contact angle was made of

    @property
    def elements(self) -> int:
        """How many balls there are."""
        return self.balls

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

    `clearance` is the diametral one of the mounted bearing at the reference temperature, negative where
    its rollers are preloaded. Its rings are regions of the section, or none, whose clearance then stays.
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
    race_give: float = 0.0  # m/N: what the clearance opens by, both races together, by the sum of all contact loads

    @property
    def ball_diameter(self) -> float:
        """Diameter of the rolling elements, under the name that ball rows have for it."""
        return self.roller_diameter

    @property
    def balls(self) -> int:
        """Rolling elements that pass a place of one row's race in a turn of the cage, under the name that ball rows have for it."""
        return self.rollers

    @property
    def offsets(self) -> tuple[float, ...]:
        """Heights (rows,) m of the rows above `z`."""
        return tuple(self.row_spacing * (k - (self.rows - 1) / 2) for k in range(self.rows))

    @property
    def elements(self) -> int:
        """How many rollers there are, of all rows."""
        return self.rows * self.rollers

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
    preload: float  # N, axial, at the reference temperature; its rows have their share of it, and the contact angle that it gives: `model.built.tolerance.scaled_preload` changes all three
    spring: PreloadSpring | None = None  # None for rings fixed in their seats, and for rows loaded from outside
