"""Tables of modes: the residual of frequencies and damping ratios, and its derivative by what moves matrices."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.inference.response import Linear
from thermospindle.model.rotor.modes import kinds, oscillating, poles
from thermospindle.model.types import Array
from thermospindle.sim.identification import pairing
from thermospindle.sim.identification.pairing import ModeSet


def partners(data: ModeData, linear: Linear):
    """Poles of the model in order of frequency, and which of them is which measured mode: of its kind, near in ln frequency."""
    p = poles(linear.matrices)
    found = oscillating(p, 2.5 * float(data.frequency.max()))
    frequency = np.abs(p.value[found]) / (2 * np.pi)
    computed = ModeSet(frequency, kind=kinds(linear.matrices, p.right[:, found]))
    partner = pairing.partners(ModeSet(data.frequency, kind=data.kind), computed, pairing.OF_A_TABLE)
    if np.any(partner < 0):
        raise ValueError("the model has fewer modes than the table")
    return found, partner, p


def mode_residual(data: ModeData, linear: Linear) -> Array:
    found, partner, p = partners(data, linear)
    pole = p.value[found][partner] - linear.chain.decay
    frequency, damping = np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
    known = np.isfinite(data.damping_sd)
    by_frequency = np.log(frequency / data.frequency) / data.frequency_sd
    by_damping = np.log(np.maximum(damping[known], 1e-9) / data.damping[known]) / data.damping_sd[known]
    return np.concatenate([by_frequency, by_damping])
