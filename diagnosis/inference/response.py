"""FRFs of one test's linear model at the lines of its data, with what their derivatives need."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.rotor.modes import poles
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.beside import POWER
from thermospindle.sim.effects.effect import Measurement

SILENT = 1e-6  # of a mode's answer, left at the end of a record


@dataclass(frozen=True, eq=False)
class Linear:
    """One test's linear model: matrices with dofs, and its measuring chain (None for a table of modes)."""

    matrices: Matrices
    chain: Measurement
    layout: tuple


class Response:
    """FRFs of one test's linear model at its lines, in the measured quantity.

    `cut` is the share in which records end before the answer has died away: 0 for FRFs of an infinite record.
    """

    def __init__(self, linear: Linear, data: LineData, gain: Array, cut: float = 0.0) -> None:
        chain, m = linear.chain, linear.matrices
        n_resp = data.value.shape[0]
        omega = 2 * np.pi * data.frequency
        window = data.test.window_decay
        self.s: ComplexArray = np.asarray(1j * omega + (chain.decay + window), complex)
        dynamic = self.s[:, None, None] ** 2 * m.mass + self.s[:, None, None] * m.damping + m.stiffness
        inverse = np.linalg.inv(dynamic)
        self.left: ComplexArray = chain.response_rows[:n_resp] @ inverse  # (L, n_resp, n)
        self.right: ComplexArray = inverse @ chain.reference_rows.T  # (L, n, n_ref)
        self._references = chain.reference_rows.T
        self.factor: ComplexArray = (
            (gain[:n_resp] * chain.gain[:n_resp])[:, None]
            * np.exp(-1j * omega * chain.delay[:n_resp, None])
            * (self.s * (1j * omega + window) ** POWER[data.quantity])
        )  # (n_resp, L)
        receptance = self.left @ self._references  # (L, n_resp, n_ref)
        self.value: ComplexArray = receptance.transpose(1, 2, 0) * self.factor[:, None, :]
        self._of = linear, data
        if cut:
            self.value = self.value + cut * self.cut_off

    @cached_property
    def cut_off(self) -> ComplexArray:
        """What a record of finite length T leaves out, (n_resp, n_ref, L): of a velocity's mode p A e^(p t) the part after T,
        -p A e^((p - w) T) / (s - p) with w what windows add. At the lines 1/T apart of a discrete Fourier transform e^(-i omega T) is one, so
        that the part is smooth over lines (Brandt, *Noise and Vibration Analysis*, 2011, 10.3)."""
        linear, data = self._of
        if not np.isfinite(data.duration):
            return np.zeros_like(self.value)
        p = poles(linear.matrices)
        chain = linear.chain
        window = chain.decay + data.test.window_decay
        decayed = np.exp(np.minimum((p.value.real - window) * data.duration, 0.0)) * np.exp(1j * p.value.imag * data.duration)
        seen = np.abs(decayed) > SILENT
        residue = (chain.response_rows[: self.left.shape[1]] @ p.right[:, seen])[:, None, :] * (p.left[seen] @ self._references).T[None]
        away = (p.value[seen] * decayed[seen])[:, None] / (self.s[None, :] - p.value[seen, None])
        return -(residue @ away) * (self.factor / self.s)[:, None, :]

    def moved(self, mass: Array, damping: Array, stiffness: Array) -> ComplexArray:
        """Derivatives (k, n_resp, n_ref, L) for dM, dC, dK (k, n, n)."""
        k, n = mass.shape[:2]
        lines, n_resp, _ = self.left.shape
        flat = self.left.reshape(lines * n_resp, n)
        total: ComplexArray = np.zeros((lines, n_resp, k, n), complex)
        for power, matrix in ((2, mass), (1, damping), (0, stiffness)):
            if matrix.any():
                part = (flat @ matrix.transpose(1, 0, 2).reshape(n, k * n)).reshape(lines, n_resp, k, n)
                total += part * (self.s**power)[:, None, None, None] if power else part
        product = total.reshape(lines, n_resp * k, n) @ self.right  # (L, n_resp k, n_ref)
        n_ref = product.shape[-1]
        value = product.reshape(lines, n_resp, k, n_ref).transpose(2, 1, 3, 0)
        return -value * self.factor[:, None, :]


def same_chain(a: Measurement, b: Measurement) -> bool:
    return a is b or (
        a.decay == b.decay
        and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("response_rows", "reference_rows", "gain", "delay"))
    )
