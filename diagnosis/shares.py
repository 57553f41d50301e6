"""Where the misfit sits: the chi2 that tolerances leave, shared out over modes, points, bands and conditions so that shares add up to one.

Errors of one test are correlated, so no number has a chi2 of its own. The residual is whitened by W = P^(-1/2) V^(-1/2), with the
variances V and the correlations P of the errors: of all whitenings the one whose numbers stay most correlated with the original
ones, so that each keeps its meaning whatever the order (ZCA-cor: Kessy, Lewin, Strimmer, *American Statistician* 72, 2018). Squares of these
add up to chi2.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from diagnosis.correlation import bands
from diagnosis.data import Feature
from diagnosis.fit import Fit
from diagnosis.observe import Observation
from diagnosis.partners import numbered
from diagnosis.theory import Predicted, Theory, pair, predict
from model.ball_row import Array

RPM = 2 * np.pi / 60
BY = ("quantity", "mode", "point", "band", "temperature", "speed", "level")


@dataclass(frozen=True)
class Share:
    """One part of the misfit: `share` of the whole, `misfit` its chi2, `count` the numbers in it; chi2 / count is one by chance."""

    by: str  # one of BY
    name: str
    share: float
    misfit: float
    count: int


@dataclass(frozen=True, eq=False)
class Modes:
    """Number and kind of every measured mode: `number[test][mode]`, zero where the model has no partner; `kind` by number."""

    number: tuple[Array, ...]
    kind: dict[int, str]

    def name(self, number: int) -> str:
        return f"{number} {self.kind[number]}" if number else "without a partner"


def modes_at(theory: Theory, x: Array) -> Modes:
    """The measured modes with the numbers of their partners in the model at nuisance values x, followed by shape through all tests."""
    observed = theory.data.observations
    warmer, spindle = theory.warmer(x), theory.built(x)
    predicted: list[Predicted] = [predict(spindle, o, (), w) for o, w in zip(observed, warmer, strict=True)]
    numbers = numbered(observed, predicted)
    found: list[Array] = []
    kinds: dict[int, str] = {}
    for o, p, number in zip(observed, predicted, numbers, strict=True):
        partner = pair(o, p).tolist()
        found.append(np.array([number[j] if j >= 0 else 0 for j in partner], int))
        kinds |= {number[j]: p.kind[j] for j in partner if j >= 0 and number[j] not in kinds}
    return Modes(tuple(found), kinds)


def whitened(theory: Theory, residual: Array) -> Array:
    """The residual (n,) whitened so that every number stays itself; squares add up to the chi2 of the data."""
    data = theory.data
    found = np.zeros(len(residual))
    tests = np.array([f.test for f in data.features])
    for t in np.unique(tests):
        own = np.flatnonzero(tests == t)
        block = data.whiten[np.ix_(own, own)]
        precision = block.T @ block
        sd = np.sqrt(np.diag(np.linalg.inv(precision)))
        value, vector = np.linalg.eigh(precision * np.outer(sd, sd))
        found[own] = (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T @ (residual[own] / sd)
    return found


def shares(theory: Theory, base: Fit, modes: Modes) -> tuple[Share, ...]:
    """Shares of the misfit of a fit, by every entry of `BY`, each adding up to one."""
    squares = whitened(theory, base.residual) ** 2
    total = float(squares.sum())
    observed = theory.data.observations
    edges = _edges(observed)

    def point(f: Feature) -> str:
        frf = observed[f.test].test.frf
        if f.channel < 0:
            return "of the poles"
        return f"channel {f.channel + 1}" if frf is None else f"node {frf.response_nodes[f.channel]}"

    def band(f: Feature) -> str:
        frequency = observed[f.test].frequency[f.mode]
        low, high = next((a, b) for a, b in edges if frequency <= b)
        return f"{low:.0f}-{high:.0f} Hz"

    names: dict[str, Callable[[Feature], str]] = {
        "quantity": lambda f: f.what,
        "mode": lambda f: modes.name(int(modes.number[f.test][f.mode])),
        "point": point,
        "band": band,
        "temperature": lambda f: f"{observed[f.test].condition.temperature:g} C",
        "speed": lambda f: f"{observed[f.test].condition.speed / RPM:.0f} rpm",
        "level": lambda f: "not stated" if (level := observed[f.test].test.level) is None else f"{level:g} N",
    }
    found = []
    for by in BY:
        rows: dict[str, list[int]] = {}
        for i, f in enumerate(theory.data.features):
            rows.setdefault(names[by](f), []).append(i)
        for name, own in sorted(rows.items(), key=lambda row: _order(row[0])):
            part = float(squares[own].sum())
            found.append(Share(by, name, part / total if total > 0 else len(own) / len(squares), part, len(own)))
    return tuple(found)


def _order(name: str) -> tuple[float, str]:
    """Names by the first number in them; those without one first."""
    number = re.search(r"-?\d+(\.\d+)?", name)
    return (float(number.group()) if number else -np.inf, name)


def _edges(observed: tuple[Observation, ...]) -> list[tuple[float, float]]:
    """Whole third-octave bands that hold all measured modes."""
    every = np.concatenate([o.frequency for o in observed])
    return bands(0.8 * float(every.min()), 1.25 * float(every.max())) if len(every) else []
