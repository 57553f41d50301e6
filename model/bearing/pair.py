"""The ball rows of all sets against each other: axial equilibrium at a temperature, and the bearing states that follow.

Jang, Kim, Han, Kim (2003): load-deflection and stiffness, Eqs. (6), (7); the hub moves until the axial forces balance, Eq. (8) and
Fig. 5. The secant method of Fig. 5 is replaced by Newton's, and by brackets where it does not arrive (`model.bearing.movement`): every
row's axial force rises monotonically with the hub's movement, so the root is unique and cannot be missed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sin

import numpy as np

from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.bearing.centred import Centres, centred
from thermospindle.model.bearing.heavy_ball.inertia import Vector
from thermospindle.model.bearing.movement import Parts, Rings, Sleeve, balanced, equilibrium
from thermospindle.model.bearing.roller import RollerState, roller_state
from thermospindle.model.bearing.row import row_at
from thermospindle.model.bearing.state import ByDirection, LinearState, linear_state
from thermospindle.model.changed import changed
from thermospindle.model.errors import BadInput, NoEquilibrium, named
from thermospindle.model.machine import Bearing, BearingSet, Condition, RingMotion, Spindle, kept
from thermospindle.model.types import Array

TOUCHING = 1e-9
"""Contact force, over that of the preload, below which a ball is loose."""

IN_CONTACT = "in contact"


@dataclass(frozen=True)
class BearingState(ByDirection):
    """One bearing at its operating point; forces in N, lengths in m, angles in rad.

    `stiffness`, `damping`: (5, 5) between the inner and the outer body at the ring centre, order x, y, z, tilt_x, tilt_y.
    `row` is the ball row at its loaded position, centred. `movement` is the rigid axial
    movement of its outer ring against its inner one, beyond thermal expansion. `preload` is the axial force in the row's own sense: less than nothing where
    a load turns it round.
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
        """What a title says of the bearings: the status of ball rows, which names those that have lost contact itself; else what bearings there are."""
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

    def bearing(self, name: str) -> BearingState:
        """A ball row's state. Raises `BadInput` naming those there are, and `any_bearing` for what is no ball row."""
        if any(b.name == name for b in self.linear):
            kind = "a roller row" if name in self.rollers else "given by numbers"
            raise BadInput(f"bearing {name!r} is {kind}, no ball row; any_bearing({name!r}) has its state")
        return named(name, self.bearings, "ball bearing")


def check_centred(spindle: Spindle, state: PairState, what: str) -> None:
    """`BadInput` where radial loads or weight displace rings, for `what` takes rows with centred ones."""
    if any(b.displacement for b in state.bearings):
        told = spindle.radial_loads[0].told if spindle.radial_loads else f"gravity_m_per_s2 = [{spindle.gravity[0]:g}, {spindle.gravity[1]:g}]"
        raise BadInput(
            f"{spindle.file or spindle.name}: {told}: {what} is for centred rings, and this displaces them; take it out, or ask what their stiffness decides: "
            "modes, table, static, impact with linear elements"
        )


def solve(spindle: Spindle, condition: Condition, motions: Mapping[str, RingMotion]) -> PairState:
    """Axial equilibrium of all rows under the thermal ring `motions` (by bearing name).

    Unknown are the axial positions of what carries rings and is rigid in itself; the balance of the axial forces on each gives the
    equations. Raises `NoEquilibrium` where they have no answer.
    """
    rows = {b.name: row_at(spindle, b, b.sense, motions[b.name], condition.speed) for b in spindle.bearings}
    moved: dict[str, float] = {}
    centres: Centres = {}
    for rotor in rotors(spindle):
        moved |= _positions(spindle, rotor, rows, centres)
    states = []
    for b in spindle.bearings:
        row = rows[b.name]
        states.append(bearing_state(spindle, b, changed(row, axial=row.axial + moved[b.name]), centres.get(id(row)), moved[b.name]))
    sliding = {name for s in spindle.sets if s.spring is not None for name in s.spring.rings_of}
    hub = next((moved[b.name] for b in spindle.bearings if b.name not in sliding), 0.0)
    linear: tuple[LinearState, ...] = tuple(linear_state(spindle, b, condition) for b in spindle.linear_bearings)
    linear += tuple(roller_state(spindle, b, motions.get(b.name), condition.temperature) for b in spindle.roller_bearings)
    return PairState(condition, tuple(states), hub, contact_status(tuple(states)), linear)


@kept
def joined(spindle: Spindle) -> list[list[Bearing]]:
    """The ball rows in groups that share carriers: what one rotor's equilibrium is made of."""
    groups: list[tuple[set[str], list[Bearing]]] = []
    for b in spindle.bearings:
        carriers = set(_carriers(spindle, b)) - {"ground"}
        touching = [g for g in groups if g[0] & carriers]
        rest = [g for g in groups if not g[0] & carriers]
        merged = (carriers.union(*(g[0] for g in touching)), [row for g in touching for row in g[1]] + [b])
        groups = [*rest, merged]
    return [rows for _, rows in groups]


def _carriers(spindle: Spindle, b: Bearing) -> tuple[str, str]:
    """What carries the inner and the outer ring of a row and is axially rigid."""
    return spindle.structure.carrier(b.inner_body), spindle.structure.carrier(b.outer_body)


@dataclass(frozen=True)
class Rotor:
    """One group of rows that share carriers, as drawn: the carriers of the rings `of` every row, which way the hub takes each row (1 or -1), rows on springs, as `Sleeve` has these, and the
    force on the hub that preloads rows which are loaded one way (N).

    The one unknown of two carriers is how far the second carrier of the first row has moved against its first.
    """

    carriers: list[str]
    of: dict[str, tuple[str, str]]
    sets: list[BearingSet]
    towards: dict[str, int]
    springs: list[tuple[tuple[str, ...], float, float]]
    outside: float


@kept
def rotors(spindle: Spindle) -> list[Rotor]:
    """Every group of `joined`."""
    return [_rotor(spindle, group) for group in joined(spindle)]


def _rotor(spindle: Spindle, group: Sequence[Bearing]) -> Rotor:
    of = {b.name: _carriers(spindle, b) for b in group}
    sets = [s for s in spindle.sets if s.bearings[0] in of]
    towards = {name: 1 if pair == of[group[0].name] else -1 for name, pair in of.items()}
    springs = [(s.spring.rings_of, spindle.bearing(s.spring.rings_of[0]).sense * s.preload, s.spring.rate or 0.0) for s in sets if s.spring is not None]
    # rows loaded one way carry all shares together, from outside; opposed ones carry each other's
    outside = sum(towards[name] * spindle.bearing(name).sense * s.preload / len(s.bearings) for s in sets if spindle.one_way(s) for name in s.bearings)
    return Rotor(list(dict.fromkeys(c for pair in of.values() for c in pair)), of, sets, towards, springs, outside)


def _positions(spindle: Spindle, rotor: Rotor, every: Mapping[str, BallRow], centres: Centres) -> dict[str, float]:
    """Movement (m) of every row's outer ring against its inner one, for one group of rows that share carriers."""
    rows = {name: every[name] for name in rotor.of}
    if len(rotor.carriers) > 2:
        return _many_positions(spindle, rows, rotor, centres)
    towards, sliding = rotor.towards, {name for names, _, _ in rotor.springs for name in names}
    fixed = tuple((row, towards[name]) for name, row in rows.items() if name not in sliding)
    sleeves = tuple(Sleeve(tuple(rows[n] for n in names), towards[names[0]], push, rate) for names, push, rate in rotor.springs)
    try:
        hub, *slid = equilibrium(Rings(fixed, sleeves, rotor.outside + spindle.axial_load), centres)
    except NoEquilibrium as error:
        raise NoEquilibrium(f"{error} under axial_load_N = {spindle.axial_load:g}" if spindle.axial_load else str(error)) from None
    moved = {name: towards[name] * hub for name in rows}
    for (names, _, _), r in zip(rotor.springs, slid, strict=True):
        moved |= dict.fromkeys(names, r)
    return moved


def _many_positions(spindle: Spindle, rows: Mapping[str, BallRow], rotor: Rotor, centres: Centres) -> dict[str, float]:
    """As `_positions` for more than two carriers, as of rotors within rotors, or of rings in parts that joints hold together.

    A spindle is preloaded as it is put together: at the reference every row has its preload, joints hold what that asks of them, and from there on they give.
    """
    names, tied = list(rows), _tied_by(spindle, rotor)
    motion = np.array([[(rotor.of[n][1] == c) - (rotor.of[n][0] == c) for c in tied.parts] for n in names], float)
    at_reference = np.array([spindle.bearing(n).sense * spindle.bearing(n).preload if n in tied.preloaded else 0.0 for n in names])
    sleeves = tuple((tuple(names.index(n) for n in ring_of), push, rate) for ring_of, push, rate in rotor.springs)
    parts = Parts(tuple(rows.values()), motion, at_reference, sleeves, tied.stiffness, _loaded_part(spindle, rotor, tied.parts))
    try:
        return dict(zip(names, balanced(parts, centres).tolist(), strict=True))
    except NoEquilibrium as error:
        raise NoEquilibrium(f"{error}; they lie between {', '.join(rotor.carriers)}") from None


@dataclass(frozen=True, eq=False)
class Tied:
    """What holds the carriers of one rotor's rings along the axis: the `parts` (n,) that may move, these carriers and what joints tie them to, with the `stiffness` (n, n) of the joints between them
    and to the ground; and the rows that are `preloaded` against each other through carriers that joints tie together, or from outside."""

    parts: tuple[str, ...]
    stiffness: Array
    preloaded: frozenset[str]


def _tied_by(spindle: Spindle, rotor: Rotor) -> Tied:
    structure = spindle.structure
    carried = [(structure.carrier(j.bodies[0]), structure.carrier(j.bodies[1]), j.stiffness[2]) for j in structure.own_joints]
    ties = [(a, b, k) for a, b, k in carried if k > 0 and a != b]
    group = {part: {part} for part in dict.fromkeys([*rotor.carriers, *(part for a, b, _ in ties for part in (a, b))])}
    for a, b, _ in ties:
        together = group[a] | group[b]
        group |= dict.fromkeys(together, together)
    tied = {part for c in rotor.carriers for part in group[c]}
    still = "ground" if "ground" in tied else rotor.carriers[0]
    parts = tuple(part for part in group if part in tied and part != still)
    at, stiffness = {part: i for i, part in enumerate(parts)}, np.zeros((len(parts), len(parts)))
    for a, b, k in ties:
        ends = [at[part] for part in (a, b) if part in at]
        stiffness[ends, ends] += k
        if len(ends) == 2:
            stiffness[ends, ends[::-1]] -= k

    def between(name: str) -> frozenset[frozenset[str]]:
        return frozenset(frozenset(group[c]) for c in rotor.of[name])

    rigid = [s for s in rotor.sets if spindle.one_way(s) or len({between(name) for name in s.bearings}) == 1]
    return Tied(parts, stiffness, frozenset(name for s in rigid for name in s.bearings))


def _loaded_part(spindle: Spindle, rotor: Rotor, parts: Sequence[str]) -> Array:
    """The axial load on each part (n,): on the one that carries all outer rings, or its opposite on the one that carries all inner ones, for bearings feel the motion between both alone."""
    load = np.zeros(len(parts))
    if spindle.axial_load:
        inner, outer = ({pair[k] for pair in rotor.of.values()} for k in (0, 1))
        ways = [(on, force) for own, force in ((outer, spindle.axial_load), (inner, -spindle.axial_load)) if len(own) == 1 for on in own if on in parts]
        if not ways:
            raise NoEquilibrium(f"axial_load_N = {spindle.axial_load:g}: there is no one part that carries all inner rings, or all outer ones, for it to act on; rings are on {', '.join(rotor.carriers)}")
        on, force = ways[0]
        load[parts.index(on)] = force
    return load


def contact_status(bearings: tuple[BearingState, ...]) -> str:
    """The status of a pair: that all bearings are in contact, or which of them is not."""
    loose = [b.name for b in bearings if not b.in_contact]
    return IN_CONTACT if not loose else f"{' and '.join(loose)} bearing lost contact"


def bearing_state(spindle: Spindle, b: Bearing, row: BallRow, centre: Vector | None = None, movement: float = 0.0) -> BearingState:
    """What bearing `b` is with its balls as in `row`: centred rings at their loaded position, after a rigid `movement` (m) of the outer one.

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
