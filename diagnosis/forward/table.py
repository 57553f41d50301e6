"""What one test's linear model says of a table of modes."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.forward.linear import Linear, Products
from thermospindle.model.rotor.modes import kinds, oscillating, poles_below, with_mass_between
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.identification import pairing
from thermospindle.sim.identification.pairing import ModeSet

REACH = 2.5  # times the highest measured frequency, up to which modes of the model may be those of a table


class Table:
    """Modes of one test's linear model beside those of a table, with what their derivatives need."""

    def __init__(self, linear: Linear, data: ModeData) -> None:
        self._linear, self._data = linear, data

    @cached_property
    def residual(self) -> Array:
        """Frequencies and the dampings that are known, computed less measured in standard errors (N,)."""
        data = self._data
        every, shape = poles_below(self._linear.matrices, REACH * float(data.frequency.max()), self._linear.between)
        pole = every[self._partners(every, shape)] - self._linear.chain.decay
        frequency, damping = np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
        known = np.isfinite(data.damping_sd)
        by_frequency = np.log(frequency / data.frequency) / data.frequency_sd
        by_damping = np.log(np.maximum(damping[known], 1e-9) / data.damping[known]) / data.damping_sd[known]
        return np.concatenate([by_frequency, by_damping])

    def moved(self, by: Products) -> Array:
        """Derivatives (k, N) of the residual by the parameters that change M, C and K as `by` says: first-order perturbation of the poles,
        -left (p^2 dM + p dC + dK) right (Lancaster 1964, AIAA J. 2, 1659)."""
        data, (pole, right, left) = self._data, self._modes
        moved = np.zeros((len(pole), by.count), complex)
        if len(by.of):
            moved[:, by.of] = -np.add.reduceat(pole[:, None] ** by.power * (left @ by.left) * (right.T @ by.right), by.first, axis=1)
        seen = (pole - self._linear.chain.decay)[:, None]  # under a window, whose decay no parameter moves
        by_frequency = (moved * seen.conj()).real / np.abs(seen) ** 2
        by_damping = moved.real / seen.real - by_frequency
        known = np.isfinite(data.damping_sd)
        return np.concatenate([by_frequency / data.frequency_sd[:, None], by_damping[known] / data.damping_sd[known, None]]).T

    @cached_property
    def _modes(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Pole, right and left vector of every mode of the table."""
        p = with_mass_between(self._linear.matrices, self._linear.between)
        found = oscillating(p, REACH * float(self._data.frequency.max()))
        own = np.array(found)[self._partners(p.value[found], p.right[:, found])]
        return p.value[own], p.right[:, own], p.left[own]

    def _partners(self, pole: ComplexArray, shape: ComplexArray) -> Integers:
        """Which pole, in order of frequency, is which mode of the table: of its kind, near in ln frequency."""
        computed = ModeSet(np.abs(pole) / (2 * np.pi), kind=kinds(self._linear.matrices, shape))
        partner = pairing.partners(ModeSet(self._data.frequency, kind=self._data.kind), computed, pairing.OF_A_TABLE)
        if np.any(partner < 0):
            raise ValueError("the model has fewer modes than the table")
        return partner
