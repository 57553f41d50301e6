"""Chosen parameters fitted to the errors that `compare` shows: for whoever turns a few of them by hand and wants the rest done.

The residuals are those of `compare` (frequencies and dampings in standard errors, with their correlations, a missing mode as an error of
`BELIEVABLE`), over the tests that are fitted; every parameter has its prior beside them, so what the tests do not tell stays where it is
expected. Least squares in a rectangular trust region within limits, on one of which it may begin: Voglis & Lagaris, WSEAS Int. Conf.
Appl. Math. (2004); one that is scaled by how far limits are (Branch, Coleman, Li, *SIAM J. Sci. Comput.* 21 (1999) 1-23) leads nowhere
from there. No model discrepancy is granted, and effects keep their law: for whether an effect is there at all `diagnose` is the tool.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.forward.model import FAILED
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.sim.campaign.campaign import Campaign

STEP = 0.01  # of a prior standard deviation, for differences
LONGEST = 25  # steps
NEARLY, STILL = 1e-7, 1e-5  # of the squares, and of the parameters, below which another step gains nothing
IMPOSSIBLE = 1e4  # standard errors, where no spindle can be built


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted: where it begins, its prior mean and standard deviation, and limits, all in its unit."""

    name: str
    start: float
    mean: float
    sd: float
    limits: tuple[float, float]


@dataclass(frozen=True)
class Fitted:
    """Values with standard errors (of the linearised fit, priors included), by name."""

    value: dict[str, float]
    sd: dict[str, float]
    steps: int


def fit(
    parameters: Sequence[Free],
    spindle_of: Callable[[dict[str, float]], Spindle],
    campaign: Campaign,
    observations: Sequence[Observation],
    left_out: Sequence[str] = (),
    progress: Callable[[str], None] = lambda done: None,
) -> Fitted:
    """Fit `parameters` to all tests but those `left_out`; `spindle_of` builds the spindle with values by name.

    Raises what building raises where even the start gives no spindle; ValueError without parameters, or without tests.
    """
    mean, sd, start = (np.array([getattr(p, key) for p in parameters], float) for key in ("mean", "sd", "start"))
    low, high = ((np.array([p.limits[k] for p in parameters], float) - mean) / sd for k in (0, 1))
    used = [o.test.id not in left_out for o in observations]
    if not parameters or not any(used):
        raise ValueError("a fit needs a parameter and a test at least")

    def named(z: Array) -> dict[str, float]:
        return {p.name: float(v) for p, v in zip(parameters, np.clip(mean + sd * z, *np.array([p.limits for p in parameters]).T), strict=True)}

    def exact(z: Array) -> Array:
        found = compare(spindle_of(named(z)), campaign, observations, frfs=False)
        return np.concatenate([*(t.residuals for t, use in zip(found.tests, used, strict=True) if use), z])

    first = exact(z0 := np.clip((start - mean) / sd, low, high))

    def residuals(z: Array) -> Array:
        try:
            return exact(z)
        except FAILED:
            return np.full(len(first), IMPOSSIBLE)

    def jacobian(z: Array) -> Array:
        here, columns = residuals(z), []
        progress(f"rms {np.sqrt(np.mean(here**2)):.3g}")
        for i in range(len(z)):
            moved = z.copy()
            moved[i] += STEP if z[i] + STEP <= high[i] else -STEP
            columns.append((residuals(moved) - here) / (moved[i] - z[i]))
        return np.stack(columns, axis=1)

    found = least_squares(residuals, z0, jacobian, bounds=(low, high), method="dogbox", max_nfev=LONGEST, ftol=NEARLY, xtol=STILL)
    error = sd * np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    return Fitted(named(found.x), {p.name: float(e) for p, e in zip(parameters, error, strict=True)}, int(found.nfev))
