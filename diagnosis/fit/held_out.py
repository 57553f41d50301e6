"""Conditions left out one after the other, each predicted from all others by a fit of nuisance parameters and effects."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.fit.fit import Fit, prior_widths
from thermospindle.diagnosis.prediction.theory import Theory
from thermospindle.model.types import Array


def held_out(theory: Theory, result: Fit, rating: Array | None = None) -> tuple[float, int]:
    """Sum of squares and number of whitened residuals of conditions left out one after the other, each predicted from all others.

    About the optimum the model is linear in its parameters, so leaving a condition out is algebra: minimise without its rows, then look.
    The prediction is rated by the errors of its parameters and by those that `rating` (n, n) whitens, the data's own by default.
    """
    rating = theory.data.whiten if rating is None else rating
    data = theory.data
    temperatures = [o.condition.temperature for o in data.observations]
    widths = prior_widths(theory, result)
    fitted, rated = (w @ (result.jacobian * widths) for w in (result.whiten, rating))
    residual, rated_residual = result.whiten @ result.residual, rating @ result.residual
    offset = np.concatenate([result.nuisance / theory.sd, np.zeros(len(widths) - len(theory.sd))])
    total, count = 0.0, 0
    for leave in sorted(set(temperatures)):
        out = np.array([temperatures[f.test] == leave for f in data.features])
        normal = fitted[~out].T @ fitted[~out] + np.eye(len(widths))
        step = np.linalg.solve(normal, fitted[~out].T @ residual[~out] - offset)
        left = rated_residual[out] - rated[out] @ step
        spread = np.eye(out.sum()) + rated[out] @ np.linalg.solve(normal, rated[out].T)
        total += float(left @ np.linalg.solve(spread, left))
        count += int(out.sum())
    return total, count
