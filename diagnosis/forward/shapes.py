"""A measured shape beside the nearest one that a model has at its frequency, in coordinates across the measured one.

Let m be the measured shape and phi the computed one, each divided by the standard errors of its points; the size and
the phase of either tell nothing. With Q an orthonormal basis across m and a = m^H phi / |m| |phi| the residual is
|m| Q^H phi / |phi| a* / |a|, whose length is |m| sin(angle between them), that of the least-squares residual m - c
phi. Of modes that coincide phi is the combination nearest to m: they turn in their plane at the slightest asymmetry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.mode_table import MeasuredShape
from thermospindle.model.types import Array, ComplexArray


@dataclass(frozen=True, eq=False)
class ShapeBeside:
    """One measured shape and the computed ones `basis` (n, g) of the modes that may be it."""

    measured: MeasuredShape
    basis: ComplexArray

    @cached_property
    def combination(self) -> ComplexArray:
        """Of the computed shapes (g,) the one nearest to the measured."""
        return np.asarray(np.linalg.lstsq(self.basis / self.measured.sd[:, None], self.measured.along, rcond=None)[0], complex)

    @property
    def _nearest(self) -> ComplexArray:
        return (self.basis @ self.combination) / self.measured.sd

    @property
    def residual(self) -> Array:
        """(n - 1,) of real parts, or (2n - 2,) of real and imaginary parts, in standard errors."""
        near = self._nearest
        length, phase = np.linalg.norm(near), _phase(self.measured.along.conj() @ near)
        return self._told(self.measured.size * (self.measured.across.conj().T @ near) * phase / (length or 1.0))

    def moved(self, by: ComplexArray) -> Array:
        """Derivatives (k, N) of the residual where the nearest shape moves by the columns of `by`
        (n, k); what lies among the `basis` is a turn, and none.

        That the combination follows is left out, which is of the second order in the angle (Kaufman 1975, BIT 15, 49).
        """
        near, m = self._nearest, self.measured
        length = np.linalg.norm(near)
        moved = by / m.sd[:, None]
        basis = np.linalg.qr(self.basis / m.sd[:, None])[0]
        turned = (moved - basis @ (basis.conj().T @ moved)) / length
        unit = near / length
        a = m.along.conj() @ unit
        follows = turned + unit[:, None] * (-1j * ((m.along.conj() @ turned) / a).imag)
        return self._told(m.size * (m.across.conj().T @ follows) * _phase(a)).T

    def _told(self, numbers: ComplexArray) -> Array:
        return numbers.real if self.measured.real else np.concatenate([numbers.real, numbers.imag])


def _phase(a: ComplexArray) -> complex:
    size = float(np.abs(a))
    return complex(a.conj()) / size if size else 1.0
