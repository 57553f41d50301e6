"""What a test's temperature error does to its modes: one unknown for the whole test, so its errors are correlated.

The thermometer of a test is off by an unknown amount of standard deviation s (kelvin; the scene's `tolerances.temperature_K`), the same
for all its modes. With g the derivative of the computed features by temperature, the covariance of computed - measured is
C + s^2 g g^T. By the matrix inversion lemma r^T (C + s^2 g g^T)^-1 r = min over x of |r - g x|^2_C + (x / s)^2: the offset fitted with
its prior. Gains of channels scale shapes, not frequencies or dampings, and do not enter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.forward.model import Applied
from thermospindle.diagnosis.prediction.modes import Predicted, predict
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.sim.identification.pairing import NEARBY, pairs

STEP = 0.1  # K, of the difference: frequencies move by less than 1e-4 of themselves


def temperature_slope(spindle: Spindle, o: Observation, p: Predicted, effects: Applied, lumped: bool = False) -> Array:
    """Derivative (2k,) by temperature, 1/K, of [ln frequency, ln damping] of the k computed modes
    `p` of a test, `lumped` as `predict` has it.

    A one-sided difference towards the reference temperature, so that it stays inside laws that hold for the test itself.
    """
    step = -STEP if o.condition.temperature > spindle.reference_temperature else STEP
    moved = predict(spindle, o, effects, step, lumped)
    channels = p.shape.shape[1]
    found = np.zeros(2 * len(p.frequency))
    for i, j in pairs(p.modes(channels), moved.modes(channels), NEARBY):
        found[i] = np.log(moved.frequency[j] / p.frequency[i]) / step
        found[len(p.frequency) + i] = np.log(moved.damping[j] / p.damping[i]) / step
    return found


def with_temperature(o: Observation, slope: Array, sd: float) -> Observation:
    """The observation with the temperature error `sd` (K) in its covariance; `slope` (2m,) by observed mode."""
    known = np.isfinite(np.diag(o.covariance))
    slope = np.where(known, slope, 0.0)
    return replace(o, covariance=o.covariance + sd**2 * np.outer(slope, slope))


def whitened(difference: Array, covariance: Array) -> Array:
    """Errors (n,) with covariance C (n, n) as n independent ones of unit variance, L^-1 r with C =
    L L^T: their squares add up to r^T C^-1 r."""
    if not len(difference):
        return np.zeros(0)
    return np.asarray(solve_triangular(np.linalg.cholesky(covariance), difference, lower=True), float)
