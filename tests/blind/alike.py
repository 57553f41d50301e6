"""Which effects of the catalogue could be what is hidden, by what they do and not by their names.

Whoever wrote the hidden mechanisms did not know the effects, and named right answers by their names alone: some cannot do what is hidden
(a film has no negative thickness), and others do the very same. So every effect, of whatever law (its size in each test its own, within
its limits), is fitted to the change that a hidden piece makes of the FRFs, in the small and linear, in a world that is the model's own,
beside all that tolerances can do. What is left of the change tells. This uses the effects of the catalogue, but nothing of the diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear, minimize

from tests.blind.campaigns import Made
from tests.blind.visible import SMALL, Beside, Seen, change
from tests.blind.world import Answer, World
from thermospindle.diagnosis.parameters.mechanism import Mechanism, variants, with_own_laws
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.effects import CATALOGUE, usable
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.operating import operating_point

SAME = np.sqrt(10.0)  # standard errors, up to which what is left of a change cannot be told from nothing: 5 in ln evidence
MOSTLY, NEARLY = 0.3, 0.01  # of a change, that a right answer may leave, and that any may which so is right: by as much an honest model may be wrong
TURNS = (-2.0, -1.0, 1.0, 2.0)  # prior standard deviations by which shape parameters are turned
SOUGHT = 60  # shapes between these, at most, where none of them leaves nothing


def right(made: Made, spindle: Spindle, of: Seen, catalogue: Sequence[Effect] = CATALOGUE) -> list[list[str]]:
    """Of every hidden piece the effects of the catalogue that are a right answer."""
    changes = [change(made, spindle, of, h, SMALL, World()) for h in made.hidden]
    wholes = [of.beside(d[:, None]).whole for d in changes]
    return [right_names(h.names, row, whole) for h, row, whole in zip(made.hidden, left(made, spindle, of, changes, catalogue), wholes, strict=True)]


def left(made: Made, spindle: Spindle, of: Seen, changes: Sequence[Array], catalogue: Sequence[Effect] = CATALOGUE) -> list[dict[str, float]]:
    """What each effect leaves of `changes` (N,) each, in standard errors; of its variants the least."""
    found: list[dict[str, float]] = [{} for _ in changes]
    conditions = [Condition(p.temperature, p.speed) for p in made.plans]
    base = [_Before.at(made.built, c, of) for c in conditions]

    wanted = [of.beside(d[:, None]) for d in changes]

    def rest_of(m: Mechanism, d: Beside, shape: list[float]) -> float:
        return _least(d, *_by_size(made.built, m, shape, conditions, base, of))

    named = [v for e in usable(spindle, tuple(catalogue)) for v in variants(e)]
    for m in [*named, *with_own_laws(named, spindle, conditions)]:
        if not any(getattr(m.effect, hook) for hook in ("spindle", "temperatures", "motions", "pair", "chain", "measurement")):
            continue
        tried = [(shape, _by_size(made.built, m, shape, conditions, base, of)) for shape in _shapes(m)]
        for d, row in zip(wanted, found, strict=True):
            rest, shape = min((_least(d, *columns), shape) for shape, columns in tried)
            if m.shape and SAME < rest < d.whole * (1 - MOSTLY):
                rest = min(rest, _between(m, shape, partial(rest_of, m, d)))
            row[m.name] = min(row.get(m.name, np.inf), rest)
    return found


def _between(m: Mechanism, start: Sequence[float], rest: Callable[[list[float]], float]) -> float:
    """The least `rest` over shape parameters within their limits, from a `start` on, each counted in its prior standard deviation."""
    neutral, unit = np.array([q.neutral for q in m.shape]), np.array([q.prior_sd for q in m.shape])
    ends = (np.array([q.limits for q in m.shape]).T - neutral) / unit
    first = (np.array(start) - neutral) / unit
    away = np.where(first + 0.5 <= ends[1], 0.5, -0.5)
    simplex = np.clip(np.vstack([first, first + np.diag(away)]), *ends)
    found = minimize(
        lambda z: rest((neutral + unit * z).tolist()), first, method="Nelder-Mead", bounds=ends.T, options={"initial_simplex": simplex, "maxfev": SOUGHT, "fatol": 0.1}
    )
    return float(found.fun)


def right_names(intended: Sequence[str], left_by: dict[str, float], whole: float) -> list[str]:
    """The effects that are a right answer to a change of `whole` standard errors, of those that do most of it: what leaves nothing
    that could be told, or next to nothing; what its author had in mind (`intended`); and what comes nearer than the nearest of these."""
    if whole < SAME:
        return sorted(intended)  # too little to ask
    most = {name: rest for name, rest in left_by.items() if rest < MOSTLY * whole}
    nearest = min((rest for name, rest in most.items() if name in intended), default=0.0)
    return sorted(name for name, rest in most.items() if rest < max(SAME, NEARLY * whole) or name in intended or rest <= nearest)


def _shapes(m: Mechanism) -> list[list[float]]:
    """Shape parameters as drawn and turned: all of them where there are two at most, else one by one."""
    turned = [sorted({float(np.clip(q.neutral + turn * q.prior_sd, *q.limits)) for turn in TURNS} | {q.neutral}) for q in m.shape]
    if len(turned) <= 2:
        return [list(row) for row in product(*turned)]
    neutral = [q.neutral for q in m.shape]
    alone = [[*neutral[:k], at, *neutral[k + 1 :]] for k, row in enumerate(turned) for at in row if at != neutral[k]]
    return [neutral, *alone]


@dataclass(frozen=True, eq=False)
class _Before:
    """One test without effects."""

    answer: Answer
    frf: ComplexArray
    ways: tuple[ComplexArray, ComplexArray]

    @staticmethod
    def at(built: Spindle, condition: Condition, of: Seen) -> _Before:
        answer = _answer(built, condition, [])
        return _Before(answer, answer.frf(of.frequency), answer.ways(of.frequency))

    def change(self, after: Answer, of: Seen) -> ComplexArray:
        """What the FRFs change by up to another answer that is all but the same: where the same is
        measured, by its matrices to the first order."""
        before = self.answer
        same = all(np.array_equal(getattr(after, name), getattr(before, name)) for name in ("responses", "references", "gain", "delay", "decay"))
        if same and after.linear.mass.shape == before.linear.mass.shape:
            return before.moved(of.frequency, self.ways, after.linear)
        return after.frf(of.frequency) - self.frf


def _by_size(
    built: Spindle, m: Mechanism, shape: list[float], conditions: Sequence[Condition], base: Sequence[_Before], of: Seen
) -> tuple[Beside, Array, Array]:
    """Changes (N, k) by one prior standard deviation of the size in each test, or in all at once of
    what lasts, and the limits (k,) of these."""
    up = m.size.neutral + SMALL * m.size.prior_sd <= m.size.limits[1]
    step = SMALL if up else -SMALL
    values = m.values(m.size.neutral + step * m.size.prior_sd, shape)
    moved, nothing = [], [np.zeros_like(b.frf) for b in base]
    for t, (condition, before) in enumerate(zip(conditions, base, strict=True)):
        try:
            own = before.change(_answer(built, condition, [(m.effect, values)]), of) / step
        except (ValueError, RuntimeError, ArithmeticError):
            continue
        moved.append(of.whitened([*nothing[:t], own, *nothing[t + 1 :]]))
    acting = [row for row in moved if row.any()] or [of.whitened(nothing)]
    columns = np.array([np.sum(acting, axis=0)] if m.effect.lasting or m.effect.exact else acting).T
    low, high = ((limit - m.size.neutral) / m.size.prior_sd for limit in m.size.limits)
    return of.beside(columns), np.full(columns.shape[1], low), np.full(columns.shape[1], high)


def _answer(built: Spindle, condition: Condition, effects: list[tuple[Any, Any]]) -> Answer:
    point = operating_point(built, condition, effects)
    how = point.measurement
    return Answer(point.linear, how.response_rows, how.reference_rows, how.gain, how.delay, how.decay, "")


def _least(d: Beside, columns: Beside, low: Array, high: Array) -> float:
    """Standard errors left of a change `d` (N, 1) beside sizes within their limits."""
    square, cross, whole = columns.inner(columns), columns.inner(d)[:, 0], float(d.inner(d)[0, 0])
    if columns.changes.any():
        scale = np.sqrt(np.maximum(np.diag(square), 1e-300))
        lower = np.linalg.cholesky(square / scale[:, None] / scale[None, :] + 1e-9 * np.eye(len(scale)))
        ends = (low * scale, np.maximum(high * scale, low * scale + 1e-12))
        sizes = lsq_linear(lower.T, np.linalg.solve(lower, cross / scale), ends).x / scale
        whole += float(sizes @ square @ sizes) - 2 * float(cross @ sizes)
    return float(np.sqrt(max(whole, 0.0)))
