"""Sizes of what a fit moves beside effects, where these are to be learned: places of a grid, their prior odds, and the likeliest of them.

Every size is that of one kind of nuisance (`nuisance`), of the model's constant and drifting discrepancies, of
gain drift, of thermal motions; or by its name of one build tolerance: how many times as wide as stated it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise, product
from typing import TypeVar

import numpy as np

from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.model.types import Array

GRIDS = {
    kinds_of.STIFFNESS: (0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2),  # relative error of a frequency
    kinds_of.DAMPING: (0.0, 0.01, 0.03, 0.1),
    kinds_of.STIFFNESS_DRIFT: (0.0, 3e-5, 1e-4, 3e-4, 1e-3),
    kinds_of.DAMPING_DRIFT: (0.0, 0.01, 0.03),
    kinds_of.DRIFT: (0.0, 3e-4, 1e-3, 3e-3, 1e-2),
    kinds_of.HAMMER: (1.0, 3.0),
    kinds_of.HAMMER_DRIFT: (0.0, 1e-3, 3e-3, 1e-2),
    kinds_of.MISS_DRIFT: (0.0, 3e-5, 1e-4, 3e-4),  # m
    kinds_of.CHANGE: (0.0, 0.01, 0.03),
    kinds_of.EXPANSION: (1.0, 3.0, 6.0),
    kinds_of.ACTION: (0.0, 0.01, 0.03, 0.1),
    kinds_of.OF_CONDITIONS: (0.0, 0.01, 0.03, 0.1),
}
WIDER = {1.0: 0.0, 2.0: -12.0, 4.0: -13.0, 8.0: -14.0}
"""Prior odds (ln) that a drawing is off by so many times the build tolerances that the scene states, assumed, and less
than those of any two effects."""
FAR_OFF = {1.0: 0.0, 4.0: -16.0, 16.0: -17.0}
"""Prior odds (ln) of the same of one build tolerance by itself, likewise assumed: a joint that nobody has measured is off by tens of per
cent, and all others are as stated. An effect of the catalogue that does the very same (a mount softer by a third in all tests: blind
campaign 3329) is to be named: it has 4 of its own sizes' width to pay, a prior of one in a hundred, and evidence counts two thirds."""
FARTHER = {1.0: 0.0, 3.0: -2.0, 6.0: -4.0}
"""Prior odds (ln) that thermal motions are off by so many times what two finite-element programs differ by,
assumed: one spindle in eight by a per cent, one in sixty by two, where any one effect is in one of a hundred."""
UNCALIBRATED = {1.0: 0.0, 3.0: -2.0}
"""Prior odds (ln) that hammers' gains are off by three times what the scene's channels are, assumed: a hammer whose calibration is
old, or that always hits askew by 10 to 15 degrees, is off by some per cent, which a sensor's gain would have to explain in part."""
OTHERWISE = {0.0: 0.0, 0.01: 0.0, 0.03: -2.0, 0.1: -4.0}
"""Prior odds (ln) that what temperature and speed do to a mode is off by such a share of it,
assumed: one spindle in eight by 3 %, one in sixty by a tenth, which a missing effect may be as well."""
ODDS = {kinds_of.BUILD: WIDER, kinds_of.EXPANSION: FARTHER, kinds_of.HAMMER: UNCALIBRATED, kinds_of.OF_CONDITIONS: OTHERWISE}
"""By kind of nuisance, of sizes of which one is that of the scene or of the model itself."""
UNTOLD = 1e-6  # of its prior's variance, by which data tell something of a tolerance
T = TypeVar("T")
Each = Callable[[float, Mapping[str, float]], Array]
Found = tuple[Array, float, dict[str, float]]
BETWEEN = 2  # places between two of a grid that are not nothing


def finer(grid: Sequence[float]) -> tuple[float, ...]:
    """What is not nothing of a grid, with places `BETWEEN`. Dozens of numbers share the size of a drift: between places that are
    three times apart they lose some 0.2 in ln evidence each, which one effect that takes one channel's part of it would win."""
    sizes = [size for size in grid if size > 0]
    return *(float(f"{f:.2g}") for low, high in pairwise(sizes) for f in np.geomspace(low, high, BETWEEN + 1, endpoint=False)), sizes[-1]


FINER = {kind: finer(grid) for kind, grid in GRIDS.items() if kind not in ODDS}
SWEEPS = 3  # at most, between the places of the grids
SWAPPED = (*kinds_of.DISCREPANCIES, kinds_of.CHANGE)


def ln_odds(sizes: Mapping[str, float]) -> float:
    """Prior odds (ln) of sizes that may be other than the scene's or the model's own."""
    return sum(ODDS[of][size] if of in ODDS else FAR_OFF[size] for of, size in sizes.items() if of not in FINER)


def of_tolerances(sizes: Mapping[str, T]) -> dict[str, T]:
    """Of sizes, or of their grids, those of build tolerances: of all, and of each that may be far off by itself."""
    return {of: size for of, size in sizes.items() if of not in GRIDS}


def with_wider_tolerances(each: Each, grids: Mapping[str, Sequence[float]], scales: Sequence[float], tolerances: Sequence[str], told: Callable[[float, Mapping[str, float]], tuple[Array, Array]]) -> Found:
    """`likeliest`, with build `tolerances` as stated, all of them wider, or some far off by themselves, whichever is likeliest.

    One by one those that promise most are wider, beside the discrepancies that were learned or none, by the posterior mean and
    variance of each that are `told` beside some sizes: all of them could be tried at every step, but a flexible shaft has sixty.
    """
    as_stated = dict.fromkeys((kinds_of.BUILD, *tolerances), (1.0,))
    together = likeliest(each, {**grids, **as_stated, kinds_of.BUILD: tuple(WIDER)}, scales)
    found = together if together[2][kinds_of.BUILD] == 1.0 else likeliest(each, {**grids, **as_stated}, scales)
    nothing = {kind: grids[kind][0] for kind in kinds_of.DISCREPANCIES if kind in grids}
    while True:
        _, s, sizes = found
        far = {of: (size,) for of, size in of_tolerances(sizes).items()}
        steps = {_farthest(*told(s, beside), sizes, tolerances) for beside in (sizes, {**sizes, **nothing})}
        tried = [likeliest(each, {**grids, **far, name: (times,)}, scales) for name, times, gain in sorted(steps) if gain > 0]
        best = max([found, *tried], key=_whole)
        if best is found:
            return max(found, together, key=_whole)
        found = best


def _whole(found: Found) -> float:
    return float(np.logaddexp.reduce(found[0]))


def _farthest(mean: Array, variance: Array, sizes: Mapping[str, float], tolerances: Sequence[str]) -> tuple[str, float, float]:
    """The build tolerance that by another width of its own gains most ln evidence, that width, and what it gains; by the posterior
    `mean` and `variance` (n,) of each, which tell the likelihood of each by itself (Gaussian conditioning, backwards)."""
    best = "", 1.0, 0.0
    for name, m, c in zip(tolerances, mean, variance, strict=True):
        prior = sizes[name] ** 2
        if c < (1 - UNTOLD) * prior:
            own = c * prior / (prior - c)  # variance of the data's own estimate, which is own / c times the mean
            for times, odds in FAR_OFF.items():
                whole, as_is = own + times**2, own + prior
                gain = odds - FAR_OFF[sizes[name]] + 0.5 * float((m * own / c) ** 2 * (1 / as_is - 1 / whole) - np.log(whole / as_is))
                best = max(best, (name, times, gain), key=lambda row: row[2])
    return best


def likeliest(each: Each, grids: Mapping[str, Sequence[float]], scales: Sequence[float]) -> Found:
    """The ln evidence that `each` gives, the errors of `scales` and the sizes of discrepancies of
    `grids`, and between their places, that have most of it: by the step that gains most, until none does.

    Steps in a set order end lower: what comes first takes for constant errors of modes what is a
    change of the balls' stiffness, and no step of one size leads back.
    """
    known: dict[tuple[float, ...], tuple[float, Array]] = {}

    def at(s: float, sizes: Mapping[str, float]) -> tuple[float, Array]:
        """All of it together, and each."""
        key = s, *(sizes[kind] for kind in grids)
        if key not in known:
            values = each(s, sizes)
            known[key] = float(np.logaddexp.reduce(values)), values
        return known[key]

    s, sizes = scales[len(scales) // 2], {kind: grid[0] for kind, grid in grids.items()}
    best, moves = at(s, sizes), _moves(grids)
    gains = True
    while gains:
        for steps in ([(s, {**sizes, **move}) for move in moves] + [(scale, sizes) for scale in scales], [(s, {**sizes, **swap}) for swap in _swaps(grids, sizes)]):
            to = max(steps, key=lambda step: at(*step)[0], default=(s, sizes))
            if gains := at(*to)[0] - best[0] > 0.01:
                (s, sizes), best = to, at(*to)
                break
    for _ in range(SWEEPS):
        before = best[0]
        for kind, by in product([kind for kind in FINER if kind in sizes], (1, -1)):
            while (size := _beside(FINER[kind], sizes[kind], by)) is not None and (there := at(s, {**sizes, kind: size}))[0] > best[0]:
                best, sizes = there, {**sizes, kind: size}
        if best[0] - before < 0.1:
            break
    return best[1], s, sizes


def _moves(grids: Mapping[str, Sequence[float]]) -> list[dict[str, float]]:
    """Steps: one size; and build tolerances that are wider, without discrepancies."""
    found = [{kind: size} for kind, grid in grids.items() for size in grid]
    if kinds_of.BUILD in grids:
        as_drawn = {kind: grids[kind][0] for kind in kinds_of.DISCREPANCIES if kind in grids}
        found += [{**as_drawn, kinds_of.BUILD: times} for times in grids[kinds_of.BUILD]]
    return found


def _swaps(grids: Mapping[str, Sequence[float]], sizes: Mapping[str, float]) -> list[dict[str, float]]:
    """Steps from one kind of what is wrong with modes and bearings to another: what is off by the same in all tests could be taken
    for drift, what changes in damping for a change of frequencies, and beside the one the other costs more than it gains. With
    nothing hidden a stranger's grinding spindle stood 67 in ln evidence below by that, and any effect gained what came by it."""
    own = [kind for kind in SWAPPED if kind in grids]
    return [{a: grids[a][0], b: size} for a in own if sizes[a] != grids[a][0] for b in own if b != a for size in grids[b] if size != sizes[b]]


def _beside(grid: Sequence[float], size: float, by: int) -> float | None:
    """The next place of a grid, up or down; none beyond its ends, or for a size of nothing."""
    k = grid.index(size) + by if size in grid else -1
    return grid[k] if 0 <= k < len(grid) else None
