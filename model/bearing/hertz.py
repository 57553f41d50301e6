"""Hertz point contact with exact elliptic integrals.

Source: Hertz (1881) in the form of Harris, *Rolling Bearing Analysis*, 3rd ed., ch. 5-6, and Hamrock & Dowson, *Ball Bearing
Lubrication* (1981), ch. 3; only the ellipticity equation is solved numerically, no curve fits are used.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cache, lru_cache
from math import cos, exp, expm1, isfinite, log, nan, pi, sqrt

import numpy as np
import scipy

NEARLY_ROUND = 1e-3  # of ln k, below which the quotient cancels, and ln k is proportional to the difference
FLATTEST, KNOTS = 17.0, 400  # of ln k, which it is at most; and how many of it a first guess is made from
MOST_STEPS, ENOUGH = 6, 1e-8  # of Newton's method, whose next step is the square of the last


@dataclass(frozen=True)
class Contact:
    """An elliptic point contact: `stiffness` K in Q = K deformation**1.5 (N/m^1.5), ellipticity a/b >= 1."""

    stiffness: float
    ellipticity: float
    curvature_sum: float  # 1/m
    effective_modulus: float  # Pa, 2 / ((1 - nu1^2)/E1 + (1 - nu2^2)/E2)

    def half_axes(self, load: float) -> tuple[float, float]:
        """Half axes (a, b) of the contact ellipse (m) at `load` (N), a across the rolling direction."""
        k = self.ellipticity
        e = float(scipy.special.ellipe(1 - 1 / k**2))
        cube = 6 * e * load / (np.pi * self.curvature_sum * self.effective_modulus)
        return float((k**2 * cube) ** (1 / 3)), float((cube / k) ** (1 / 3))

    def pressure(self, load: float) -> float:
        """Largest pressure (Pa) at `load` (N), in the middle of the ellipse; 0 where nothing presses."""
        if load <= 0:
            return 0.0
        a, b = self.half_axes(load)
        return 1.5 * load / (np.pi * a * b)


def ellipticity(curvature_difference: float) -> float:
    """Ellipticity k = a/b >= 1 for the curvature difference F(rho), 0 <= F < 1 (Hamrock & Dowson 1981, Eq. 3.27).

    Solves F = ((k^2 + 1) E - 2 K) / ((k^2 - 1) E), K and E complete elliptic integrals of parameter m = 1 - 1/k^2.
    """
    if not 0 <= curvature_difference < 1:
        raise ValueError(f"curvature difference {curvature_difference:g} is outside [0, 1)")

    nearly_round = _of_nearly_round()
    if curvature_difference <= nearly_round:
        return exp(NEARLY_ROUND * curvature_difference / nearly_round)
    log_k = exp(_guessed(log(1 - curvature_difference)))
    if not isfinite(log_k):
        raise ValueError(f"curvature difference {curvature_difference!r} is of a contact flatter than exp({FLATTEST:g})")
    for _ in range(MOST_STEPS):
        found, slope = _difference(log_k)
        step = (curvature_difference - found) / slope
        log_k += step
        if abs(step) < ENOUGH * log_k:
            break
    return exp(log_k)


def _difference(log_k: float) -> tuple[float, float]:
    """Curvature difference F of the ellipticity k and its derivative by ln k; those of K and E by
    the parameter are Abramowitz & Stegun, 17.3.29 to 30's."""
    k2, m = exp(2 * log_k), -expm1(-2 * log_k)
    first, second = float(scipy.special.ellipkm1(1 / k2)), float(scipy.special.ellipe(m))
    quotient = first / second
    found = (k2 + 1 - 2 * quotient) / (k2 - 1)
    by_first, by_second = (second - first / k2) / m, (second - first) / (m * k2)  # by ln k
    slope = 2 * (k2 - (by_first - quotient * by_second) / second) / (k2 - 1) - 2 * k2 * found / (k2 - 1)
    return found, slope


@cache
def _of_nearly_round() -> float:
    return _difference(NEARLY_ROUND)[0]


def _guessed(rest: float) -> float:
    """ln ln k where ln(1 - F) is `rest`: the cubic between two knots with its slopes there, right
    to 1e-9, from where Newton's method takes a step."""
    rests, values, slopes = _knots()
    i = bisect_right(rests, rest)
    if i == 0:
        return nan
    i = min(i, KNOTS - 1)
    long, rise = rests[i] - rests[i - 1], values[i] - values[i - 1]
    t = (rest - rests[i - 1]) / long
    return values[i - 1] + t * (rise + (1 - t) * ((1 - t) * (long * slopes[i - 1] - rise) - t * (long * slopes[i] - rise)))


@cache
def _knots() -> tuple[list[float], list[float], list[float]]:
    """ln(1 - F), rising, ln ln k and its derivative by that."""
    log_k = [float(v) for v in np.geomspace(FLATTEST, NEARLY_ROUND, KNOTS)]
    found = [(v, *_difference(v)) for v in log_k]
    return [log(1 - f) for _, f, _ in found], [log(v) for v in log_k], [-(1 - f) / (slope * v) for v, f, slope in found]


@lru_cache(maxsize=4096)
def point_contact(
    ball_diameter: float, rolling_curvature: float, groove_curvature: float, ball: tuple[float, float], race: tuple[float, float]
) -> Contact:
    """Contact of a ball with a surface of curvature `rolling_curvature` along and `groove_curvature` across rolling (1/m).

    Curvatures are positive where convex. `ball` and `race` are (Young's modulus Pa, Poisson's ratio).
    """
    along = 2 / ball_diameter + rolling_curvature
    across = 2 / ball_diameter + groove_curvature
    total = along + across
    if min(along, across) <= 0:
        raise ValueError("the groove is tighter than the ball; conformity must exceed 0.5")
    k = ellipticity(abs(along - across) / total)
    m = 1 - 1 / k**2
    first, second = float(scipy.special.ellipk(m)), float(scipy.special.ellipe(m))
    modulus = 2 / ((1 - ball[1] ** 2) / ball[0] + (1 - race[1] ** 2) / race[0])
    stiffness = pi * k * modulus * sqrt(2 * second / (9 * total * first**3))
    return Contact(stiffness, k, total, modulus)


def race_contact(
    ball_diameter: float,
    conformity: float,
    pitch_diameter: float,
    contact_angle: float,
    inner: bool,
    ball: tuple[float, float],
    race: tuple[float, float],
) -> Contact:
    """Contact of a ball with the inner or outer race of a ball bearing (Harris 1991, Eqs. 2.24-2.31)."""
    gamma = ball_diameter * cos(contact_angle) / pitch_diameter
    rolling = 2 / ball_diameter * (gamma / (1 - gamma) if inner else -gamma / (1 + gamma))
    return point_contact(ball_diameter, rolling, -1 / (conformity * ball_diameter), ball, race)


def in_series(inner: float, outer: float) -> float:
    """Load-deflection constant of both contacts of a ball that carry the same force: K of Jang et al. 2003, Eq. (6)."""
    return (inner ** (-2 / 3) + outer ** (-2 / 3)) ** -1.5
