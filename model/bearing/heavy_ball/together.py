"""The balls with inertia of many rows at once, each on a line of its own: the formulas of `balance` with arrays (balls,).

Structures whose rows are displaced ask for all of them many times; most of an array's time is its call, whatever its length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from thermospindle.model.bearing.heavy_ball.balance import (
    FEW,
    HALVINGS,
    LONGEST,
    Balance,
    Driven,
    HeavyBall,
    balance,
    driven,
    inverted,
    settled,
    start_of,
    times,
)
from thermospindle.model.bearing.heavy_ball.inertia import MANY, BallInertia, Vector
from thermospindle.model.changed import changed
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array, Integers

Told = TypeVar("Told", Balance, Driven)

MANY_STEPS = 20  # after which each ball that has not arrived is sought by itself
ROUNDS, STANDING = 20, 1e-12  # of the cage's speed, and what of it is no change
Allowed = tuple[float, float]
"""What `settled` allows: `tolerance` (N) and `least` (N/m)."""


def at_own_speeds(
    rows: Sequence[HeavyBall], lines: Sequence[Array], allowed: Sequence[Allowed], cages: Sequence[float], starts: Sequence[Vector]
) -> list[tuple[float, Balance, Driven]]:
    """Of every row, of balls like the one given on `lines` (balls, 2), the speed of its cage, near that of `cages`,
    and what its balls are, arrays (balls,), sought from their `starts`. Raises `NoEquilibrium`."""
    counts = [len(line) for line in lines]
    ends = np.cumsum(counts).tolist()
    first, line = [0, *ends[:-1]], tuple(np.concatenate(lines).T)
    balls, (tolerance, least) = of_each(rows, counts), np.repeat(np.array(allowed).T, counts, axis=1)
    centres: Vector = (np.concatenate([r for r, _ in starts]), np.concatenate([z for _, z in starts]))
    speeds = np.array(cages)
    for _ in range(ROUNDS):
        orbiting = changed(balls, inertia=changed(balls.inertia, cage=np.repeat(speeds, counts)))
        here = settled_together(orbiting, line, tolerance, least, centres)
        each, centres = driven(orbiting, here, line, MANY), here.centre
        rolled, by_cage = (np.add.reduceat(of, first) / counts for of in (each.speed, each.by_cage))
        step = (rolled - speeds) / (1.0 - by_cage)
        if (np.abs(step) <= STANDING * np.abs(rolled)).all():
            return [(float(speed), _part(here, a, b), _part(each, a, b)) for speed, a, b in zip(speeds, first, ends, strict=True)]
        speeds = speeds + step
    raise NoEquilibrium("the speed of a cage did not settle")


def of_each(rows: Sequence[HeavyBall], counts: Sequence[int]) -> HeavyBall:
    """The balls of all rows, so many of each, as one: arrays (balls,) in place of its numbers."""

    def every(things: Sequence[Any]) -> dict[str, Any]:
        own = [f.name for f in fields(things[0]) if f.name not in ("inertia", "cage")]
        return {name: np.repeat([getattr(thing, name) for thing in things], counts) for name in own}

    inertias = [row.inertia for row in rows]
    held = None if inertias[0].cage is None else np.repeat([i.cage for i in inertias], counts)
    return HeavyBall(**every(rows), inertia=BallInertia(**every(inertias), cage=held))


def settled_together(balls: HeavyBall, line: Vector, tolerance: Array, least: Array, start: Vector | None = None) -> Balance:
    """`settled` of many balls (`of_each`), with all that it is given arrays (balls,): by the same steps of all at once from where they were;
    or else, with halved ones, from where they may be; and by itself each ball that these do not bring to rest, or make no better."""
    here = None if start is None else _approached(balls, line, tolerance, least, start, FEW, 1)
    late = np.arange(len(line[0])) if here is None else np.flatnonzero(~(np.hypot(*here.resultant) < tolerance))
    if here is not None and not len(late):
        return here
    own, (r, z) = _some(balls, late), (x[late] for x in line)
    began = np.array([start_of(_one(own, k), at) for k, at in enumerate(zip(r.tolist(), z.tolist(), strict=True))]).T
    there = _approached(own, (r, z), tolerance[late], least[late], (began[0], began[1]), MANY_STEPS, HALVINGS)
    for k in np.flatnonzero(~(np.hypot(*there.resultant) < tolerance[late])).tolist():
        _put(there, k, settled(_one(own, k), (float(r[k]), float(z[k])), float(tolerance[late[k]]), float(least[late[k]])))
    if here is None:
        return there
    _put(here, late, there)
    return here


def _approached(balls: HeavyBall, line: Vector, tolerance: Array, least: Array, start: Vector, steps: int, trials: int) -> Balance:
    """What so many of Newton's steps from `start` come to, each halved until the resultant falls,
    in so many trials; a ball of which none makes it fall goes no further."""
    longest, centre = LONGEST * np.hypot(*line), np.array(start)
    here, stuck = balance(balls, (centre[0], centre[1]), line, MANY), np.zeros(len(longest), bool)
    for _ in range(steps):
        off = np.hypot(*here.resultant)
        moving = (off >= tolerance) & ~stuck
        if not moving.any():
            break
        s, g = here.by_inner, here.by_line
        step = np.array(times(inverted((s[0] + g[0] + least, s[1] + g[1], s[2] + g[2], s[3] + g[3] + least)), here.resultant))
        factor = moving * np.minimum(1.0, longest / np.maximum(np.hypot(*step), 1e-30))
        for _ in range(trials):
            trial = centre + factor * step
            here = balance(balls, (trial[0], trial[1]), line, MANY)
            farther = moving & ~(np.hypot(*here.resultant) <= off + tolerance)
            if not farther.any():
                break
            factor = np.where(farther, factor / 2, factor)
        centre, stuck = trial, stuck | farther
    return here


def _some(balls: HeavyBall, which: Integers) -> HeavyBall:
    return _of_fields(balls, lambda x: x[which])


def _one(balls: HeavyBall, k: int) -> HeavyBall:
    """Ball number k by itself, in plain numbers."""
    return _of_fields(balls, lambda x: float(x[k]))


def _of_fields(balls: HeavyBall, function: Callable[[Any], Any]) -> HeavyBall:
    """Balls with a function of every array in its place."""

    def own(thing: Any) -> dict[str, Any]:
        return {f.name: function(value) for f in fields(thing) if isinstance(value := getattr(thing, f.name), np.ndarray)}

    return HeavyBall(**own(balls), inertia=BallInertia(**own(balls.inertia)))


def _put(here: Balance, which: int | Integers, own: Balance) -> None:
    """What is said of some balls in the place of what was."""
    for every, some in zip(_numbers(here), _numbers(own), strict=True):
        every[which] = some


def _numbers(here: Balance) -> list[Any]:
    """All that a balance says, one number, or array, after the other."""
    return [number for field in here for number in (field if isinstance(field, tuple) else (field,))]


def _part(found: Told, first: int, end: int) -> Told:
    """What is said of some of the balls."""
    return of_numbers(found, lambda x: x[first:end])


def of_numbers(told: Told, function: Callable[[Any], Any]) -> Told:
    """What is said of balls, with a function of every number, or array, in its place."""
    return type(told)(*(tuple(map(function, v)) if isinstance(v, tuple) else function(v) for v in told))
