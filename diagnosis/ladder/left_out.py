"""What is left out of a fit, which then has to predict it: the tests of one condition, or, where
all were made at one, some modes of the tables.

At one condition nothing but other modes can tell of a mode, and what the model misses constantly
may be anything there: a mode left out is what tells a missing effect from a constant error of every
frequency. Modes that nearly coincide, as the two planes of a shaft do, are left out together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.mode_table import ModeData, TestData
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.ladder.fitting import Settled
from thermospindle.diagnosis.parameters.reference import COINCIDE
from thermospindle.model.types import Array

MOST = 5  # groups of modes; of more modes every fifth is left out at once


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Numbers of the tests of which something is left out, and of `modes` of a table which rows (m,); without any, the whole test."""

    tests: tuple[int, ...] = ()
    modes: Mapping[int, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Missed:
    """How far a fit is from what it has not seen: squares and number of the residuals in standard errors
    of its prediction, and squares and number of the relative errors of the frequencies of tables."""

    squares: float = 0.0
    count: int = 0
    relative: float = 0.0
    frequencies: int = 0


def at_one_condition(model: CampaignModel) -> bool:
    """Whether all data are tables of modes measured at one condition."""
    return all(isinstance(d, ModeData) for d in model.tests) and len(conditions_of(model.spindle, model.tests)) == 1


def groups_of(model: CampaignModel) -> list[LeftOut]:
    """What is left out in turn: the tests of every condition; at one condition the modes of tables; nothing where that is all there is."""
    apart = conditions_of(model.spindle, model.tests)
    if len(apart) > 1:
        return [LeftOut(tuple(tests)) for tests in apart]
    return _modes_of(model) if at_one_condition(model) else []


def _modes_of(model: CampaignModel) -> list[LeftOut]:
    tables = {t: d.frequency for t, d in enumerate(model.tests) if isinstance(d, ModeData)}
    every = np.sort(np.concatenate(list(tables.values())))
    starts = every[np.concatenate([[True], np.diff(every) > COINCIDE * every[1:]])]  # of modes, or pairs of them
    number = {t: np.searchsorted(starts, own, side="right") - 1 for t, own in tables.items()}
    count = min(len(starts), MOST)
    return [LeftOut(tuple(tables), {t: own % count == k for t, own in number.items()}) for k in range(count)] if count > 1 else []


def unseen(model: CampaignModel, group: LeftOut) -> CampaignModel:
    """The model with the data of a group taken away; their conditions and parameters stay."""
    return replace(model, tests=tuple(_without(model, t, group) if t in group.tests else data for t, data in enumerate(model.tests)))


def _without(model: CampaignModel, t: int, group: LeftOut) -> TestData:
    data = model.tests[t]
    if isinstance(data, ModeData) and t in group.modes and not group.modes[t].all():
        kept = np.flatnonzero(np.logical_not(group.modes[t]))
        return data.only(kept)
    nothing = np.zeros((0 if not isinstance(data, LineData) else len(data.value), len(model.scenes[t].hammer.hammer_nodes), 0))
    quantity = data.quantity if isinstance(data, LineData) else "receptance"
    return LineData(data.test, data.condition, np.zeros(0), nothing.astype(complex), nothing, quantity, "left out", 0)


def missed(found: Settled, tests: Sequence[TestData], group: LeftOut) -> Missed:
    """How far `found`, which has not seen a group, is from it in `tests`.

    With r the residuals there in standard errors of the data, J their derivatives by all parameters and S = R
    R^T the covariance of these, the squares are r (1 + J S J^T)^-1 r, the least that |r - J R z|^2 + |z|^2 can
    be: what is not known of the left-out test itself (its temperature, its gains) is part of S, with its prior.
    They are found as those, for of a test that the fit is far from they are a small difference of large numbers.
    """
    model = replace(found.model, tests=tuple(tests))
    problem = Problem(model, found.mechanisms)
    point, covariance = found.posterior
    rates = rates_of(model, problem.parts(point)[0], problem.effects_of(point))
    size, directions = np.linalg.eigh(covariance)
    root = directions * np.sqrt(np.maximum(size, 0.0))
    off: list[Array] = []
    by_known: list[Array] = []
    relative: list[Array] = []
    for t in group.tests:
        r, by = problem.linearised(t, point, rates)
        own = _rows(tests[t], group.modes.get(t), len(r))
        if isinstance(data := tests[t], ModeData):
            of_frequency = own[: len(data.frequency)]
            relative.append(np.expm1(r[: len(of_frequency)] * data.frequency_sd)[of_frequency])
        off.append(r[own])
        by_known.append(by.whole[:, own].T @ root[by.numbers])
    squares, count = least(np.concatenate(off), np.concatenate(by_known)), sum(map(len, off))
    apart = np.concatenate(relative) if relative else np.zeros(0)
    return Missed(squares, count, float(apart @ apart), len(apart))


def least(r: Array, a: Array) -> float:
    """The least of |r - a z|^2 + |z|^2 over z (n,), of r (N,) and a (N, n)."""
    n = a.shape[1]
    q = np.linalg.qr(np.concatenate([a, np.eye(n)]))[0]
    whole = np.concatenate([r, np.zeros(n)])
    for _ in range(2):  # once more, for of what is far within reach the first leaves rounding
        whole = whole - q @ (q.T @ whole)
    return float(whole @ whole)


def _rows(data: TestData, modes: Array | None, count: int) -> Array:
    """Which residuals (count,) of a test are left out: its frequencies, then the dampings that are known, then its shapes."""
    if modes is None or not isinstance(data, ModeData):
        return np.ones(count, bool)
    of_shapes = np.repeat(modes, [own.count for own in data.shapes]) if data.shapes else np.zeros(0, bool)
    return np.concatenate([modes, modes[np.isfinite(data.damping_sd)], of_shapes])
