"""What records that end before the answer has died away leave out of FRFs, and how that moves.

Of a velocity's mode p A e^(p t) a record of R seconds that was hit at t0 leaves out the part after T = R - t0, -p A e^((p
- w) T) e^(-i omega T) / (s - p) with w what windows add. At the lines 1/R apart of a discrete Fourier transform e^(-i
omega T) is e^(i omega t0), so that the part is smooth over lines (Brandt, *Noise and Vibration Analysis*, 2011, 10.3).

With the state matrix A = V diag(p) V^-1 it is -C (s - A)^-1 e^((A - w) T) B. Its derivatives need that of
the exponential, whose elements in V are those of V^-1 dA V times the divided differences of e^(p T)
(Higham, *Functions of Matrices*, 2008, Theorem 3.11). A change s^q u v^T of the dynamic stiffness has (V^-1
dA V)_ij = -(l_i u) p_j^q (v r_j), l and r the left and right vectors; one of the mass changes B, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermospindle.model.rotor.poles import Poles
from thermospindle.model.types import Array, ComplexArray, Integers

CLOSE = 1e-5  # times 1 / T, below which two poles' difference is their derivative


@dataclass(frozen=True, eq=False)
class RecordEnd:
    """The end of records, `duration` T seconds after the hit: `poles` p, with `force` (n, n_ref) of the
    references on them and `at_end` (n,) e^((p - w) T); of those `seen` at the end `away` (k, L), (s - p)
    e^(-i omega t0), and what responses read of a velocity, `factor` (n_resp, L) of their `rows` (n_resp, r)."""

    duration: float
    poles: Poles
    force: ComplexArray
    at_end: ComplexArray
    seen: Integers
    away: ComplexArray
    factor: ComplexArray
    rows: Array

    @cached_property
    def read(self) -> ComplexArray:
        """What responses read of the velocity of the poles seen, (k, n_resp, L)."""
        return np.asarray((self.rows @ (self.poles.right * self.poles.value)[:, self.seen]).T[:, :, None] * self.factor / self.away[:, None, :])

    @property
    def value(self) -> ComplexArray:
        """(n_resp, n_ref, L)."""
        return self.of(self.force)

    def of(self, force: ComplexArray) -> ComplexArray:
        """(n_resp, k, L) of other forces (n, k) on the poles."""
        return -self.moved((self.at_end[:, None] * force)[None, self.seen])[0]

    def moved(self, amplitude: ComplexArray) -> ComplexArray:
        """Sums (m, n_resp, n_ref, L) of the seen poles with `amplitude` (m, k, n_ref) each."""
        m, k, n_ref = amplitude.shape
        n_resp, lines = self.read.shape[1:]
        found = amplitude.transpose(0, 2, 1).reshape(m * n_ref, k) @ self.read.reshape(k, n_resp * lines)
        return np.asarray(found.reshape(m, n_ref, n_resp, lines).transpose(0, 2, 1, 3))

    def tail(self, columns: Array, power: Integers) -> ComplexArray:
        """The answer (m, n_ref, L) after the records' end, read as s^`power` `columns` (r, m)."""
        p = self.poles.value[self.seen]
        shape = (columns.T @ self.poles.right[:, self.seen]) * p ** power[:, None]
        amplitude = shape[:, None, :] * (self.at_end[:, None] * self.force)[self.seen].T
        return np.asarray(amplitude @ (1 / self.away))

    @cached_property
    def _swept(self) -> ComplexArray:
        """How much of what drives a pole comes to each pole seen by the references, (n, k n_ref):
        divided differences of e^(p T), times `force`."""
        p, e, t = self.poles.value, self.at_end, self.duration
        apart = p[self.seen, None] - p[None, :]
        close = np.abs(apart) * t < CLOSE
        between = np.where(close, t * (e[self.seen, None] + e[None, :]) / 2, (e[self.seen, None] - e[None, :]) / np.where(close, 1.0, apart))
        return np.ascontiguousarray((between.T[:, :, None] * self.force[:, None, :]).reshape(len(p), -1))

    def kicked(self, left: Array, right: Array, power: Integers) -> ComplexArray:
        """How the amplitudes (m, k, n_ref) of the seen poles at the records' end change with
        s^`power` `left` `right`^T (r, m) in the dynamic stiffness, of powers up to 2."""
        p = self.poles.value
        shape, heavy = right.T @ self.poles.right, power == 2
        amplitude = ((shape * np.stack([np.ones_like(p), p, p**2])[power]) @ self._swept).reshape(len(shape), len(self.seen), -1)
        if heavy.any():  # a force's first velocity, which the mass sets
            amplitude[heavy] += self.at_end[self.seen, None] * ((shape[heavy] * p) @ self.force)[:, None, :]
        return np.asarray((left.T @ self.poles.left[self.seen].T)[:, :, None] * amplitude)
