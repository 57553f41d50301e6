"""How far rings move until their axial forces balance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import scipy

from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.errors import NoEquilibrium

SECANTS = 20  # steps of the secant method, which takes six


def balanced(rows: list[BallRow], imbalance: Callable[[list[BallRow], float], float]) -> float:
    """The movement without imbalance, by bracketing; that of balls with inertia is sought from the answer of balls without."""
    if all(row.inertia is None for row in rows):
        return _bracketed(lambda h: imbalance(rows, h), 0.0, 1e-6)
    massless = [replace(row, inertia=None) for row in rows]
    start = _bracketed(lambda h: imbalance(massless, h), 0.0, 1e-6)
    return _near(lambda h: imbalance(rows, h), start)


def _near(imbalance: Callable[[float], float], start: float) -> float:
    """The movement without imbalance near `start`, by the secant method; by bracketing where that does not arrive."""
    before, here = start, start + 1e-8
    f_before, f = imbalance(before), imbalance(here)
    for _ in range(SECANTS):
        if f == 0.0:
            return here
        if f == f_before:
            break
        step = -f * (here - before) / (f - f_before)
        if abs(step) > 1e-4:
            break
        before, f_before = here, f
        here = here + step
        if abs(step) <= 1e-17 + 1e-14 * abs(here):
            return here
        f = imbalance(here)
    return _bracketed(imbalance, start, 1e-9)


def _bracketed(imbalance: Callable[[float], float], start: float, reach: float) -> float:
    while reach < 5e-3:
        if imbalance(start - reach) <= 0 <= imbalance(start + reach):
            return float(scipy.optimize.brentq(imbalance, start - reach, start + reach, xtol=1e-17, rtol=1e-14))
        reach *= 4
    raise NoEquilibrium(f"the bearings find no axial equilibrium within {reach * 1e3:.1f} mm of hub movement")
