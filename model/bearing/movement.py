"""How far rings move until their axial forces balance.

Unknown are the axial movements of what carries rings and is rigid in itself, and of rings that slide on springs; the
balance of the axial forces on each gives the equations. A spindle is preloaded as it is put together: at the reference
every row has its preload, springs have theirs, joints hold what that asks of them, and from there on all give.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.bearing.centred import Centres, centred_axial
from thermospindle.model.changed import changed
from thermospindle.model.errors import NoEquilibrium, listed
from thermospindle.model.machine import Bearing, Spindle, kept
from thermospindle.model.types import Array

MOST = 100  # steps
FARTHEST, REACH = 1e-4, 5e-3  # m, in one of them at first, and at all
STEEP = 0.5  # of the slope along a step, at most where it ends
EXACT, ROUNDED = 1e-17, 1e-15  # m, of what is left of a step, and below which a step that does not get shorter is rounding
LOOSE, PUSHED = 1.0, 1e-9  # N/m, less than which nothing is held by, and N, from which it goes where it is pushed
BEYOND = 1.6  # of a step to where a force of the power 1.5 begins, more than which ends where it has not begun


def moved_rings(spindle: Spindle, rows: Mapping[str, BallRow], centres: Centres) -> dict[str, float]:
    """Movement (m) of every row's outer ring against its inner one, where the axial forces on all
    carriers balance. `centres` keeps where balls settled. Raises `NoEquilibrium`."""
    moved: dict[str, float] = {}
    for balance in balances(spindle):
        try:
            moved |= balanced(balance, rows, centres)
        except NoEquilibrium as error:
            load = f" under axial_load_N = {spindle.axial_load:g}" if spindle.axial_load else ""
            carriers = dict.fromkeys(c for name in balance.names for c in _carriers(spindle, spindle.bearing(name)))
            raise NoEquilibrium(f"{error}{load}; they lie between {' and '.join(carriers)}") from None
    return moved


@dataclass(frozen=True, eq=False)
class Balance:
    """What movements (m) along the axis balance, n of them: of parts that carry rings, and of rings that slide on springs.

    A row's outer ring moves against its inner one by `motion` (rows, n) times the movements, in the order of `names`.
    `stiffness` (n, n) is that of springs and joints, `force` (n,) what acts beside the rows and these where nothing has moved.
    """

    names: tuple[str, ...]
    motion: Array
    stiffness: Array
    force: Array

    @cached_property
    def turned(self) -> Array:
        """The motion (n, rows) the other way round."""
        return np.ascontiguousarray(self.motion.T)


def balanced(balance: Balance, rows: Mapping[str, BallRow], centres: Centres) -> dict[str, float]:
    """Movement (m) of every row's outer ring against its inner one without imbalance; that of balls with inertia is sought
    from the answer of balls without, whose energy is convex. `centres` keeps where balls settled. Raises `NoEquilibrium`."""
    own = [rows[name] for name in balance.names]
    y = np.zeros(len(balance.force))
    if any(row.inertia is not None for row in own):
        y = _stepped(balance, y, [changed(row, inertia=None) for row in own], centres)
    return dict(zip(balance.names, (balance.motion @ _stepped(balance, y, own, centres)).tolist(), strict=True))


def _stepped(balance: Balance, y: Array, rows: list[BallRow], centres: Centres) -> Array:
    """Newton's method. A row's force rises with its own movement: what is out of balance is the
    slope of an energy that is convex, of which every step finds less."""
    here, last = _imbalance(balance, y, rows, centres), 0.0
    for _ in range(MOST):
        move = -_yielding(*here) @ here[0]
        length = _largest(move)
        if length <= EXACT or last / 2 < length < ROUNDED:
            return y
        if length**3 <= EXACT * last**2:  # steps that double their digits leave this
            return np.asarray(y + move)
        if length > ROUNDED and _largest(here[0]) < PUSHED:  # at the end of a play, which steps come near and do not reach
            share, there = BEYOND, _imbalance(balance, y + BEYOND * move, rows, centres)
        else:
            share, there = _along(balance, y, move, float(here[0] @ move), rows, centres)
        y, here, last = y + share * move, there, length if share == 1.0 else 0.0
    raise NoEquilibrium("the bearings find no axial equilibrium")


def _along(balance: Balance, y: Array, move: Array, slope: float, rows: list[BallRow], centres: Centres) -> tuple[float, tuple[Array, Array]]:
    """The share of a step at which what is out of balance along it has become less than `STEEP` of
    what it was, the `slope` at its start; and the imbalance there."""
    length = _largest(move)
    least, most, share = 0.0, np.inf, min(1.0, FARTHEST / length)
    while share * length < REACH and share - least > 1e-12 * share:
        there = _imbalance(balance, y + share * move, rows, centres)
        left = float(there[0] @ move)
        if abs(left) <= STEEP * abs(slope) or length < 1e3 * ROUNDED:
            return share, there
        least, most = (share, most) if left < 0 else (least, share)
        share = (least + most) / 2 if most < np.inf else 2 * share
    raise NoEquilibrium(f"the bearings find no axial equilibrium within {REACH * 1e3:g} mm")


def _imbalance(balance: Balance, y: Array, rows: list[BallRow], centres: Centres) -> tuple[Array, Array]:
    """Forces (n,) that are not balanced (N), and their derivatives (n, n)."""
    forces, slopes = np.array([centred_axial(row, m, centres) for row, m in zip(rows, (balance.motion @ y).tolist(), strict=True)]).T
    off = forces @ balance.motion + balance.stiffness @ y - balance.force
    return off, (balance.turned * slopes) @ balance.motion + balance.stiffness


def _largest(values: Array) -> float:
    """As numpy's of so few numbers, which takes five times as long."""
    return max(map(abs, values.tolist()))


def _yielding(off: Array, stiffness: Array) -> Array:
    """The inverse (n, n) of a stiffness: what hangs loose stays, or goes far where it is pushed."""
    if len(off) == 1 and stiffness[0, 0] > LOOSE:
        return np.asarray(1 / stiffness)
    rates, ways = np.linalg.eigh(stiffness)
    if rates[0] > LOOSE:
        return np.asarray((ways / rates) @ ways.T)
    pushed = (rates > LOOSE) | (np.abs(off @ ways) > PUSHED)
    return np.asarray((ways * (pushed / np.maximum(rates, LOOSE))) @ ways.T)


# ---------------------------------------------------------------- what carries the rings


@kept
def balances(spindle: Spindle) -> list[Balance]:
    """What all rows balance, as drawn: a group of those that share carriers, or whose carriers joints tie together, each."""
    groups: list[tuple[set[str], list[Bearing]]] = []
    ties = _ties(spindle)
    for b in spindle.bearings:
        carriers = set().union(*(_tied_to(c, (t for t in ties if "ground" not in t)) for c in _carriers(spindle, b))) - {"ground"}
        touching = [g for g in groups if g[0] & carriers]
        rest = [g for g in groups if not g[0] & carriers]
        groups = [*rest, (carriers.union(*(g[0] for g in touching)), [row for g in touching for row in g[1]] + [b])]
    if spindle.axial_load and len(groups) > 1:
        apart = "; ".join(listed([b.name for b in group]) for _, group in groups)
        raise NoEquilibrium(f"axial_load_N = {spindle.axial_load:g}: there is no one part that carries all inner rings, or all outer ones, for it to act on; rows that share no part are {apart}")
    return [_balance(spindle, group) for _, group in groups]


def _carriers(spindle: Spindle, b: Bearing) -> tuple[str, str]:
    """What carries the inner and the outer ring of a row and is axially rigid."""
    return spindle.structure.carrier(b.inner_body), spindle.structure.carrier(b.outer_body)


def _ties(spindle: Spindle) -> list[tuple[str, str, float]]:
    """The joints between what is axially rigid, with their axial stiffness (N/m)."""
    structure = spindle.structure
    every = [(structure.carrier(j.bodies[0]), structure.carrier(j.bodies[1]), j.stiffness[2]) for j in structure.own_joints]
    return [(a, b, k) for a, b, k in every if k > 0 and a != b]


def _tied_to(part: str, ties: Iterable[tuple[str, str, float]]) -> frozenset[str]:
    """A part with all that joints tie it to."""
    ties, found = list(ties), {part}
    while more := {end for a, b, _ in ties for end in (a, b) if {a, b} & found} - found:
        found |= more
    return frozenset(found)


def _balance(spindle: Spindle, group: Sequence[Bearing]) -> Balance:
    """What a group of rows balances. What joints tie to one carrier alone is left out: it moves as far as the rows ask of that one."""
    of = {b.name: _carriers(spindle, b) for b in group}
    carriers, ties = tuple(dict.fromkeys(c for pair in of.values() for c in pair)), _ties(spindle)
    tied = {c: _tied_to(c, ties) for c in carriers}
    together = [c for c in carriers if sum(c in t for t in tied.values()) > 1]
    still = "ground" if any("ground" in tied[c] for c in together) else (*together, *carriers)[0]
    parts = [p for p in dict.fromkeys([*carriers, *(p for c in together for p in sorted(tied[c]))]) if p != still]
    sprung = [(s, s.spring) for s in spindle.sets if s.spring is not None and s.bearings[0] in of]
    n = len(parts) + len(sprung)
    of_part = dict(zip(parts, np.eye(n), strict=False)) | {still: np.zeros(n)}
    apart = {name: of_part[outer] - of_part[inner] for name, (inner, outer) in of.items()}  # of the seats
    motion, stiffness, force = dict(apart), np.zeros((n, n)), _load(spindle, of, of_part)
    for a, b, k in ties:
        if a in of_part and b in of_part:
            stiffness += k * np.outer(of_part[a] - of_part[b], of_part[a] - of_part[b])
    held = bool(stiffness.any())  # by joints, which hold what preloads ask of them
    for slides, (bearings, spring) in zip(np.eye(n)[len(parts) :], sprung, strict=True):
        first = spring.rings_of[0]
        motion |= dict.fromkeys(spring.rings_of, slides)
        stiffness += (spring.rate or 0.0) * np.outer(slides - apart[first], slides - apart[first])
        on_seat = 0.0 if held or spindle.one_way(bearings) else apart[first]
        force += spindle.bearing(first).sense * bearings.preload * (slides - on_seat)
    for bearings in spindle.sets:
        rows = [spindle.bearing(name) for name in bearings.bearings if name in of]
        if not held and bearings.spring is not None and not spindle.one_way(bearings):
            continue  # the spring pushes on its seat, and presses them
        # rows that nothing holds against each other have nothing to be preloaded by
        if spindle.one_way(bearings) or len({frozenset(tied[c] for c in of[b.name]) for b in rows}) == 1:
            force += sum((b.sense * b.preload * motion[b.name] for b in rows if motion[b.name] is apart[b.name]), np.zeros(n))
    return Balance(tuple(of), np.array([motion[name] for name in of]), stiffness, force)


def _load(spindle: Spindle, of: Mapping[str, tuple[str, str]], of_part: Mapping[str, Array]) -> Array:
    """The axial load (n,), for bearings feel the motion between rings alone: on the one part that carries all outer rings, or
    its opposite on the one that carries all inner ones; of both, and of several, on what turns, for joints hold what stands."""
    none = np.zeros_like(next(iter(of_part.values())))
    if not spindle.axial_load:
        return none
    (inner, outer), carriers = next(iter(of.values())), {c for pair in of.values() for c in pair}
    ways = [(part, sign * of_part[part]) for k, part, sign in ((1, outer, 1.0), (0, inner, -1.0)) if len(carriers) == 2 or all(pair[k] == part for pair in of.values())]
    turning = carriers & {spindle.structure.carrier(b.name) for b in spindle.structure.bodies if b.turns}
    ways.sort(key=lambda way: way[0] not in turning)
    found = [load for part, load in ways if load.any() and (part in turning or len(carriers) == 2 or not turning)]
    if not found:
        raise NoEquilibrium(
            f"axial_load_N = {spindle.axial_load:g}: there is no one part that turns and carries all inner rings, or all outer ones, for it to act on; rings are on {', '.join(sorted(carriers))}"
        )
    return spindle.axial_load * found[0]
