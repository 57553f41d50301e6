"""Searches made by hand, with the evidence that a test asks for."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from thermospindle.diagnosis.decision.explanations import TOO_SURE
from thermospindle.diagnosis.decision.verdict import Verdict
from thermospindle.diagnosis.inference.evidence import Evidence
from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.prior import Learned
from thermospindle.diagnosis.inference.screening import Screened
from thermospindle.diagnosis.inference.search import Search
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.diagnosis.parameters.numbers import Numbers
from thermospindle.model.machine import Condition
from thermospindle.sim.effects.effect import Effect, Parameter

CONDITIONS = (Condition(20.0), Condition(40.0))
SIZE = Parameter("size", "1", 0.0, 1.0, 1.0, (-9.0, 9.0), "", "")


def mechanism(name: str, shaped: bool = False) -> Mechanism:
    """With a shape parameter where it is `shaped`; a free form where the name starts with `~`; with
    a law of the data's own where it ends with an apostrophe."""
    return Mechanism(Effect(name.rstrip("'"), "", "", (SIZE,), "", (), ""), {}, (SIZE,) * shaped, free=name.startswith("~"), own_law=name.endswith("'"))


def hypothesis(names: tuple[str, ...], ln: float, shape: float | None = None) -> Hypothesis:
    """With the same `shape` in all, where they have one."""
    n, count = (2 if shape is None else 3) * len(names), 100
    by_test = tuple((50.0, np.zeros(n), np.zeros((n, n))) for _ in CONDITIONS)
    fit = Fit(
        tuple(mechanism(k, shape is not None) for k in names), np.zeros(n), np.zeros((len(names), 2)), (() if shape is None else (shape,),) * len(names), (np.eye(2),) * len(names), 100.0,
        np.zeros(n), np.zeros((n, n)), by_test, count, None, 1.0,
    )  # fmt: skip
    learned = Learned({}, 1.0, (1.0,) * len(names), (0.1,) * len(names), (1.0,) * len(names))
    sizes = np.zeros((len(names), 2))
    return Hypothesis(fit, Evidence(-1000.0 + ln, learned, np.zeros(n), np.eye(n), sizes, *np.zeros((2, len(names), 2, 2)), 100.0, -1000.0 + ln))


def made(gains: dict[str | tuple[str, ...], float], catalogue: int = 30, forms: int = 20) -> Search:
    """A search that found `gains` in ln evidence over the model without effects, as much as it is
    worth (`TOO_SURE`); so many mechanisms were screened."""
    spindle = SimpleNamespace(tolerances=SimpleNamespace(temperature=0.2))
    tests = tuple(SimpleNamespace(condition=c, count=50) for c in CONDITIONS)
    model = SimpleNamespace(parameters=(), tests=tests, numbers=Numbers((), tests, None), spindle=spindle, resonances=())
    none = hypothesis((), 0.0)
    others = [hypothesis((k,) if isinstance(k, str) else k, TOO_SURE * v) for k, v in gains.items()]
    screened = [Screened(mechanism(f"effect_{i}"), 0.0, np.zeros(2), 1.0) for i in range(catalogue)]
    screened += [Screened(mechanism(f"~form_{i}"), 0.0, np.zeros(2), 1.0) for i in range(forms)]
    return Search(model, none, tuple(sorted([none, *others], key=lambda h: -h.evidence.ln)), tuple(screened))


def total(v: Verdict) -> float:
    return v.probability_none + v.probability_unknown + sum(c.probability for c in v.candidates)


def by_departing(h: Hypothesis, gained: float) -> Hypothesis:
    return replace(h, evidence=replace(h.evidence, by_departing=TOO_SURE * gained))
