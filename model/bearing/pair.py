"""The ball rows of all sets against each other: axial equilibrium at a temperature, and the bearing states that follow.

Jang, Kim, Han, Kim (2003): load-deflection and stiffness, Eqs. (6), (7); the hub moves until the axial forces balance, Eq. (8) and
Fig. 5. The secant method of Fig. 5 is replaced by Newton's (`model.bearing.movement`), for any number of rows and of parts that carry them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import sin

from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.bearing.centred import Centres, centred
from thermospindle.model.bearing.heavy_ball.inertia import Vector
from thermospindle.model.bearing.movement import moved_rings
from thermospindle.model.bearing.roller import RollerState, roller_state
from thermospindle.model.bearing.row import row_at
from thermospindle.model.bearing.state import ByDirection, LinearState, linear_state
from thermospindle.model.changed import changed
from thermospindle.model.errors import BadInput, named
from thermospindle.model.machine import Bearing, Condition, RingMotion, Spindle
from thermospindle.model.types import Array

TOUCHING = 1e-9
"""Contact force, over that of the preload, below which a ball is loose."""

IN_CONTACT = "in contact"


@dataclass(frozen=True)
class BearingState(ByDirection):
    """One bearing at its operating point; forces in N, lengths in m, angles in rad.

    `stiffness`, `damping`: (5, 5) between the inner and the outer body at the ring centre, order x, y, z, tilt_x, tilt_y. `row` is
    the ball row at its loaded position, centred. `movement` is the rigid axial movement of its outer ring against its inner one,
    beyond thermal expansion. `preload` is the axial force in the row's own sense: less than nothing where a load turns it round.
    """

    name: str
    z: float
    contact_angle: float
    outer_contact_angle: float
    deformation: float
    contact_force: float  # at the inner contact
    ball_stiffness: float
    preload: float
    stiffness: Array
    damping: Array
    row: BallRow
    in_contact: bool
    outer_contact_force: float  # larger at speed, by what centrifugal force adds
    movement: float = 0.0
    displacement: tuple[float, ...] = ()  # (5,), of its outer ring under a radial load; empty for centred rings
    radial_force: tuple[float, float] = (0.0, 0.0)  # on its outer ring under that load, to hold it there


@dataclass(frozen=True)
class PairState:
    """All bearings at one condition.

    `hub_movement` (m) is the rigid axial movement of what carries the outer ring of the first bearing against what carries its inner one.
    Every bearing's ring makes it too, but one behind a spring, which slides in its seat (`BearingState.movement`).
    """

    condition: Condition
    bearings: tuple[BearingState, ...]  # in the order of Spindle.bearings
    hub_movement: float
    status: str  # "in contact", or which bearing lost contact
    linear: tuple[LinearState, ...] = ()  # in the order of Spindle.linear_bearings, then of its roller bearings

    @property
    def words(self) -> str:
        """Status and the first ball row's preload, in words; of other bearings what they are."""
        return f"{self.status}, preload {self.bearings[0].preload:.2f} N" if self.bearings else self.of_bearings

    @property
    def of_bearings(self) -> str:
        """What a title says of the bearings: the status of ball rows, which names those that have
        lost contact itself; else what bearings there are."""
        if self.bearings:
            return f"bearings {self.status}" if self.status == IN_CONTACT else self.status
        kinds = {"roller bearings" if isinstance(b, RollerState) else "bearings given by numbers" for b in self.linear}
        return " and ".join(sorted(kinds)) or "no bearings"

    @property
    def all_bearings(self) -> tuple[BearingState | LinearState, ...]:
        """Ball rows, bearings given by numbers and roller bearings, lowest first."""
        every: list[BearingState | LinearState] = [*self.bearings, *self.linear]
        return tuple(sorted(every, key=lambda b: b.z))

    def any_bearing(self, name: str) -> BearingState | LinearState:
        """The ball row, roller bearing, or bearing given by numbers, of that name."""
        return named(name, self.all_bearings, "bearing")

    @property
    def rollers(self) -> dict[str, RollerState]:
        """The roller bearings by name."""
        return {b.name: b for b in self.linear if isinstance(b, RollerState)}

    @property
    def rolling(self) -> tuple[BearingState | RollerState, ...]:
        """Ball rows, then roller bearings."""
        return (*self.bearings, *(b for b in self.linear if isinstance(b, RollerState)))

    def bearing(self, name: str) -> BearingState:
        """A ball row's state. Raises `BadInput` naming those there are, and `any_bearing` for what is no ball row."""
        if any(b.name == name for b in self.linear):
            kind = "a roller row" if name in self.rollers else "given by numbers"
            raise BadInput(f"bearing {name!r} is {kind}, no ball row; any_bearing({name!r}) has its state")
        return named(name, self.bearings, "ball bearing")


def solve(spindle: Spindle, condition: Condition, motions: Mapping[str, RingMotion]) -> PairState:
    """Axial equilibrium of all rows under the thermal ring `motions` (by bearing name).

    Raises `NoEquilibrium` where the axial forces do not balance (`model.bearing.movement`).
    """
    rows = {b.name: row_at(spindle, b, b.sense, motions[b.name], condition.speed) for b in spindle.bearings}
    centres: Centres = {}
    moved = moved_rings(spindle, rows, centres)
    states = []
    for b in spindle.bearings:
        row = rows[b.name]
        states.append(bearing_state(spindle, b, changed(row, axial=row.axial + moved[b.name]), centres.get(id(row)), moved[b.name]))
    sliding = {name for s in spindle.sets if s.spring is not None for name in s.spring.rings_of}
    hub = next((moved[b.name] for b in spindle.bearings if b.name not in sliding), 0.0)
    linear: tuple[LinearState, ...] = tuple(linear_state(spindle, b, condition) for b in spindle.linear_bearings)
    linear += tuple(roller_state(spindle, b, motions.get(b.name), condition.temperature) for b in spindle.roller_bearings)
    return PairState(condition, tuple(states), hub, contact_status(tuple(states)), linear)


def contact_status(bearings: tuple[BearingState, ...]) -> str:
    """The status of a pair: that all bearings are in contact, or which of them is not."""
    loose = [b.name for b in bearings if not b.in_contact]
    return IN_CONTACT if not loose else f"{' and '.join(loose)} bearing lost contact"


def bearing_state(spindle: Spindle, b: Bearing, row: BallRow, centre: Vector | None = None, movement: float = 0.0) -> BearingState:
    """What bearing `b` is with its balls as in `row`: centred rings at their loaded position, after
    a rigid `movement` (m) of the outer one.

    Its balls settle at or near `centre`, where one knows.
    """
    answer = centred(row, centre)
    # where rings are free to move between their balls, the equilibrium that is found lies at an end of that play, a rounding error within contact
    felt = TOUCHING * b.preload / (b.balls * sin(b.contact_angle))
    stiffness = answer.tangent
    if row.inertia is not None:
        # outer-race control makes the tangent of heavy balls unsymmetric, by 1e-4 of it, under radial loads with the cage's speed by up to a hundredth; springs, in MuJoCo too, carry the symmetric part
        stiffness = (stiffness + stiffness.T) / 2
    return BearingState(
        name=b.name,
        z=b.z,
        contact_angle=answer.inner_angle,
        outer_contact_angle=answer.outer_angle,
        deformation=answer.deformation,
        contact_force=answer.ball_force,
        ball_stiffness=1.5 * row.constant * max(answer.deformation, 0.0) ** 0.5,
        preload=b.sense * answer.axial_force,
        stiffness=stiffness,
        damping=spindle.structure.damping_time(b.damping_ratio) * stiffness,
        row=row,
        in_contact=answer.ball_force > max(felt, 0.0),
        outer_contact_force=answer.outer_ball_force,
        movement=movement,
    )
