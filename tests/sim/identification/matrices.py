"""The reference spindle as a matrix model of the data sheet's chain (`reference/hdd_2003.md`), its
bearing stiffness written out from the sheet's numbers: nothing of `model` or `sim` but the code
under test. Coordinates: base z | seat z, tilts | shaft x y z, tilts | hub x y z, tilts.
"""

from __future__ import annotations

import numpy as np

from thermospindle.sim.identification.modal import Modes, noise_model

WIDE = np.arange(400.0, 6001.0, 2.0)


# ---- the reference spindle as matrices: base z | seat z, tilts | shaft x y z, tilts | hub x y z, tilts


def solid(*rings):
    """Mass, centre, transverse and polar inertia of rings (inner and outer radius, bottom, top in mm, density)."""
    r0, r1, z0, z1 = np.array([ring[:4] for ring in rings]).T * 1e-3
    m = np.array([ring[4] for ring in rings]) * np.pi * (r1**2 - r0**2) * (z1 - z0)
    z = (z0 + z1) / 2
    centre = m @ z / m.sum()
    transverse = m / 12 * (3 * (r0**2 + r1**2) + (z1 - z0) ** 2) + m * (z - centre) ** 2
    return m.sum(), centre, transverse.sum(), (m / 2 * (r0**2 + r1**2)).sum()


SHAFT = solid((0, 2.5, -3, 19, 7800), (2.5, 3.752, 3.5, 6.5, 7800), (2.5, 3.752, 15, 18, 7800))
HUB = solid(
    (6.5, 7.5, 3, 10, 2700),
    (6.5, 12.5, 10, 20, 2700),
    (7.5, 16, 5, 8, 2700),
    (14.5, 16, 1, 5, 7700),
    (13, 14.5, 1, 5, 7500),
    (5.349, 6.5, 3.5, 6.5, 7800),
    (5.349, 6.5, 15, 18, 7800),
)


def bearing(side: int) -> np.ndarray:
    """5x5 stiffness of ten balls at 24.51 deg under 16 N: springs along the contact lines, their tension across (verification.md)."""
    stiffness, deflection, distance, angle, arm = 3.5632e9, 1.0542e-6, 101.63e-6, np.radians(24.51), 4.55e-3
    along = np.array([-np.cos(angle), side * np.sin(angle)])
    tension = stiffness * deflection**1.5 / (distance + deflection)
    ball = 1.5 * stiffness * deflection**0.5 * np.outer(along, along) + tension * (np.eye(2) - np.outer(along, along))
    at = [np.array([[c, s, 0, 0, 0], [0, 0, 1, arm * s, -arm * c]]) for c, s in ((np.cos(p), np.sin(p)) for p in np.arange(10) * np.pi / 5)]
    return sum(a.T @ ball @ a for a in at)


def spindle(speed: float = 0.0, softness: float = 1.0):
    """Mass, damping with gyroscopic terms, and stiffness (14, 14) at `speed` rad/s with bearings `softness` times as stiff."""
    mass = np.diag([0.8, 0.099839, 2.0e-5, 2.0e-5, *[SHAFT[0]] * 3, *[SHAFT[2]] * 2, *[HUB[0]] * 3, *[HUB[2]] * 2])

    def motion(part, z=0.0):  # of the point of a part on the axis at height z
        rows = np.zeros((5, 14))
        if part == "base":
            rows[2, 0] = 1
        elif part == "seat":
            rows[[2, 3, 4], [1, 2, 3]] = 1
            rows[0, 3], rows[1, 2] = z, -z
        elif part:
            first, arm = (4, z - SHAFT[1]) if part == "shaft" else (9, z - HUB[1])
            rows[range(5), range(first, first + 5)] = 1
            rows[0, first + 4], rows[1, first + 3] = arm, -arm
        return rows

    springs = [
        (motion("base"), motion(""), np.diag([0, 0, 6.7484e7, 0, 0]), 0.006),
        (motion("seat"), motion("base"), np.diag([0, 0, 7.1734e6, 23539, 2.0e5]), 0.008),
        (motion("shaft", 1e-3), motion("seat", 1e-3), np.diag([5e7, 5e7, 3.375e6, 699.93, 699.93]), 0.010),
        (motion("hub", 16.5e-3), motion("shaft", 16.5e-3), softness * bearing(1), 0.020),
        (motion("hub", 5e-3), motion("shaft", 5e-3), softness * bearing(-1), 0.020),
    ]
    parts = [((a - b).T @ k @ (a - b), zeta) for a, b, k, zeta in springs]
    damping = sum(2 * zeta * k / (2 * np.pi * 1500) for k, zeta in parts)
    damping[12, 13] += HUB[3] * speed
    damping[13, 12] -= HUB[3] * speed
    return mass, damping, sum(k for k, _ in parts)


def sensors() -> np.ndarray:
    """(7, 14) displacements of the data sheet's points; hammers act on the first and the second."""
    rows, arm = np.zeros((7, 14)), 15e-3 - HUB[1]
    rows[0, [11, 13]], rows[1, [11, 12]] = (1, -12e-3), (1, 12e-3)
    rows[2, [9, 13]], rows[3, [10, 12]] = (1, arm), (1, -arm)
    rows[4, [1, 3]], rows[5, [1, 2]], rows[6, 0] = (1, -20e-3), (1, 20e-3), 1
    return rows


def eigen(mass, damping, stiffness, rows):
    """Frequencies (Hz), damping ratios and shapes (m, n_resp) of the poles in the upper half plane, rising."""
    n = len(mass)
    values, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, np.hstack([stiffness, damping]))]]))
    order = [i for i in np.argsort(np.abs(values)) if values[i].imag > 0]
    return np.abs(values[order]) / (2 * np.pi), -values[order].real / np.abs(values[order]), (rows @ vectors[:n, order]).T


def mobility(frequency, matrices, rows, hammers):
    s = 2j * np.pi * np.asarray(frequency)[:, None, None]
    mass, damping, stiffness = matrices
    x = np.linalg.solve(s**2 * mass + s * damping + stiffness, np.broadcast_to(hammers.T, (len(s), *hammers.T.shape)))
    return np.moveaxis(s * (rows @ x), 0, 2)


def noisy(frf, seed, relative=0.005, floor=0.0002):
    """With complex noise of E|e|^2 = sd^2, and the standard deviation as one would take it from the noisy values."""
    e = np.random.default_rng(seed).standard_normal((2, *frf.shape))
    measured = frf + noise_model(frf, relative, floor) * (e[0] + 1j * e[1]) / np.sqrt(2)
    return measured, noise_model(measured, relative, floor)


def reference(frequency, speed=0.0):
    return mobility(frequency, spindle(speed), sensors(), sensors()[[0, 1]])


def distance(modes: Modes, frequency, damping) -> float:
    """Squared error of all frequencies and dampings in units of their covariance: chi-square of 2m degrees of freedom."""
    error = np.append(modes.frequency - frequency, modes.damping - damping)
    return float(error @ np.linalg.solve(modes.covariance, error))
