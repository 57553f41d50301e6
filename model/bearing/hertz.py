"""Hertz point contact with exact elliptic integrals.

Source: Hertz (1881) in the form of Harris, *Rolling Bearing Analysis*, 3rd ed., ch. 5-6, and Hamrock & Dowson, *Ball Bearing
Lubrication* (1981), ch. 3; only the ellipticity equation is solved numerically, no curve fits are used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy


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


def ellipticity(curvature_difference: float) -> float:
    """Ellipticity k = a/b >= 1 for the curvature difference F(rho), 0 <= F < 1 (Hamrock & Dowson 1981, Eq. 3.27).

    Solves F = ((k^2 + 1) E - 2 K) / ((k^2 - 1) E), K and E complete elliptic integrals of parameter m = 1 - 1/k^2.
    """
    if not 0 <= curvature_difference < 1:
        raise ValueError(f"curvature difference {curvature_difference:g} is outside [0, 1)")

    def difference(log_k: float) -> float:
        k2 = np.exp(2 * log_k)
        m = -np.expm1(-2 * log_k)
        e = scipy.special.ellipe(m)
        return float(((k2 + 1) * e - 2 * scipy.special.ellipkm1(1 / k2)) / ((k2 - 1) * e))

    nearly_round = 1e-3  # below this the quotient cancels, and log k is proportional to the difference
    if curvature_difference <= difference(nearly_round):
        return float(np.exp(nearly_round * curvature_difference / difference(nearly_round)))
    return float(np.exp(scipy.optimize.brentq(lambda log_k: difference(log_k) - curvature_difference, nearly_round, 17.0, xtol=1e-14, rtol=1e-14)))


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
    modulus = 2 / sum((1 - nu**2) / e for e, nu in (ball, race))
    stiffness = np.pi * k * modulus * np.sqrt(2 * second / (9 * total * first**3))
    return Contact(float(stiffness), k, total, modulus)


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
    gamma = ball_diameter * np.cos(contact_angle) / pitch_diameter
    rolling = 2 / ball_diameter * (gamma / (1 - gamma) if inner else -gamma / (1 + gamma))
    return point_contact(ball_diameter, float(rolling), -1 / (conformity * ball_diameter), ball, race)


def in_series(inner: float, outer: float) -> float:
    """Load-deflection constant of both contacts of a ball that carry the same force: K of Jang et al. 2003, Eq. (6)."""
    return float((inner ** (-2 / 3) + outer ** (-2 / 3)) ** -1.5)
