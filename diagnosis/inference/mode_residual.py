"""Tables of modes: the residual of frequencies and damping ratios, and its derivative by what moves matrices."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.inference.response import Linear
from thermospindle.model.rotor.modes import kinds, oscillating, poles
from thermospindle.model.types import Array


def partners(data: ModeData, linear: Linear):
    """Poles of the model in order of frequency, and which of them is which measured mode: of its kind, near in ln frequency."""
    p = poles(linear.matrices)
    found = oscillating(p, 2.5 * float(data.frequency.max()))
    frequency = np.abs(p.value[found]) / (2 * np.pi)
    unlike = np.array(data.kind)[:, None] != np.array(kinds(linear.matrices, p.right[:, found]))[None, :]
    # squares: two modes of a kind on one side of two measured ones cost the same either way in absolute differences, and would swap at random
    cost = np.log(data.frequency[:, None] / frequency[None, :]) ** 2 + 9.0 * unlike
    if cost.shape[1] < cost.shape[0]:
        raise ValueError("the model has fewer modes than the table")
    rows, columns = linear_sum_assignment(cost)
    return found, columns[np.argsort(rows)], p


def mode_residual(data: ModeData, linear: Linear) -> Array:
    found, partner, p = partners(data, linear)
    pole = p.value[found][partner] - linear.chain.decay
    frequency, damping = np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
    known = np.isfinite(data.damping_sd)
    by_frequency = np.log(frequency / data.frequency) / data.frequency_sd
    by_damping = np.log(np.maximum(damping[known], 1e-9) / data.damping[known]) / data.damping_sd[known]
    return np.concatenate([by_frequency, by_damping])
