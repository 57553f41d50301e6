"""Phasors of what whirls about the spindle's axis."""

from __future__ import annotations

import numpy as np

from thermospindle.model.types import ComplexArray


def whirling(amplitude: complex, speed: float) -> ComplexArray:
    """Phasors (2,) of the real and imaginary part of amplitude exp(i speed t), for time dependence exp(+i |speed| t)."""
    if speed < 0:
        return np.array([np.conj(amplitude), 1j * np.conj(amplitude)])
    return np.array([amplitude, -1j * amplitude])
