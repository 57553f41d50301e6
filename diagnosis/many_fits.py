"""Many fits at once, on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

from diagnosis.fit import Fit, fit
from diagnosis.theory import Theory
from model.ball_row import Array
from sim.effect import Effect

Task = tuple[tuple[Effect, ...], list[float]]
"""Effects to fit, and a start value for every parameter of theirs."""

From = tuple[tuple[Effect, ...], list[float], Array | None]
"""The same with start values of the nuisance parameters."""


def side_by_side(theory: Theory, about: Array, tasks: Sequence[From], thorough: bool, workers: int) -> list[Fit]:
    """Fits of all tasks, in their order."""
    work = Work(theory, about, tuple(tasks), thorough)
    if workers < 2 or len(tasks) < 2:
        return [work.fit(i) for i in range(len(tasks))]
    with ProcessPoolExecutor(workers, get_context("fork"), _take, (work,)) as pool:
        found = pool.map(_done, range(len(tasks)))
        return [replace(f, effects=task[0]) for f, task in zip(found, tasks, strict=True)]


@dataclass(frozen=True, eq=False)
class Work:
    """Fits to be made by several processes, which get them by being forked: effects, of users too, need not be picklable."""

    theory: Theory
    about: Array
    tasks: tuple[From, ...]
    thorough: bool

    def fit(self, i: int) -> Fit:
        effects, start, nuisance = self.tasks[i]
        return fit(self.theory, self.about, effects, start, self.thorough, nuisance)


_work: list[Work] = []  # of a forked process: what it was given


def _take(work: Work) -> None:
    _work[:] = [work]


def _done(i: int) -> Fit:
    return replace(_work[0].fit(i), effects=())
