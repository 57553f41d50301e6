"""What one test's linear model says of a table of modes."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.forward.linear import Linear, Products
from thermospindle.model.rotor.modes import kinds, oscillating, poles, poles_below
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.identification import pairing
from thermospindle.sim.identification.pairing import ModeSet

REACH = 2.5  # times the highest measured frequency, up to which modes of the model may be those of a table


def partners(data: ModeData, linear: Linear):
    """Poles of the model in order of frequency, and which of them is which measured mode: of its kind, near in ln frequency."""
    p = poles(linear.matrices)
    found = oscillating(p, REACH * float(data.frequency.max()))
    return found, _partners(data, linear, p.value[found], p.right[:, found]), p


def _partners(data: ModeData, linear: Linear, pole: ComplexArray, shape: ComplexArray) -> Integers:
    computed = ModeSet(np.abs(pole) / (2 * np.pi), kind=kinds(linear.matrices, shape))
    partner = pairing.partners(ModeSet(data.frequency, kind=data.kind), computed, pairing.OF_A_TABLE)
    if np.any(partner < 0):
        raise ValueError("the model has fewer modes than the table")
    return partner


def mode_residual(data: ModeData, linear: Linear) -> Array:
    every, shape = poles_below(linear.matrices, REACH * float(data.frequency.max()))
    pole = every[_partners(data, linear, every, shape)] - linear.chain.decay
    frequency, damping = np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
    known = np.isfinite(data.damping_sd)
    by_frequency = np.log(frequency / data.frequency) / data.frequency_sd
    by_damping = np.log(np.maximum(damping[known], 1e-9) / data.damping[known]) / data.damping_sd[known]
    return np.concatenate([by_frequency, by_damping])


def mode_jacobian(data: ModeData, linear: Linear, by: Products) -> tuple[Array, Array]:
    """Residual (N,) of a table of modes and its derivatives (k, N) by the parameters that change M, C and K as `by` says: first-order perturbation of
    the poles, -left (p^2 dM + p dC + dK) right (Lancaster 1964, AIAA J. 2, 1659)."""
    found, partner, p = partners(data, linear)
    pole, right, left = p.value[found][partner], p.right[:, found][:, partner], p.left[found][partner]
    moved = np.zeros((len(pole), by.count), complex)
    moved[:, by.of] = -np.add.reduceat(pole[:, None] ** by.power * (left @ by.left) * (right.T @ by.right), by.first, axis=1)
    by_frequency = (moved * pole.conj()[:, None]).real / np.abs(pole[:, None]) ** 2
    by_damping = moved.real / pole.real[:, None] - by_frequency
    known = np.isfinite(data.damping_sd)
    jacobian = np.concatenate([by_frequency / data.frequency_sd[:, None], by_damping[known] / data.damping_sd[known, None]])
    return mode_residual(data, linear), jacobian.T
