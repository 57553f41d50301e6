"""Spindle bearings as their catalogues print them: preload, unloading force and axial rigidity of a pair at three preloads.

A row with unloaded distance A of the groove centres, free contact angle a and n K balls times load-deflection constant carries, moved by z
along the axis, with L^2 = (A cos a)^2 + (A sin a + z)^2,

    F(z) = n K (L - A)^1.5 (A sin a + z) / L .

A rigid pair of two has its rows at z where F(z) is the preload. Its rigidity is 2 F'(z), and an external
force F(2 z) unloads one of them, which has then moved back by z and the other forward by as much. So three
numbers at each of three preloads tell A and n K: with 990 bearings of one catalogue the fit leaves 0.95 %
rms at 15 degrees, 0.60 % at 25, and 2.7 % of the worst (`tests/literature/test_fag_catalogue.py` has five).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array

WORST = 0.08
"""rms misfit (ln) beyond which three preloads are not those of one bearing: several times what the
catalogues' own rounding and models leave."""
STARTS = (1e-4, 3e-4, 1e-3)  # m, of the unloaded distance
REACH = 5.0  # ln, of both unknowns about their start


@dataclass(frozen=True)
class CatalogueRow:
    """A universal pair at its light, medium and heavy preload: free contact angle (rad), forces (N), axial rigidity (N/m) of the pair."""

    contact_angle: float
    preload: tuple[float, float, float]
    unloading_force: tuple[float, float, float]
    axial_rigidity: tuple[float, float, float]


@dataclass(frozen=True)
class Derived:
    """Unloaded distance (m) of the groove centres, balls times load-deflection constant (N/m^1.5), and the rms of ln(model / catalogue)."""

    unloaded_distance: float
    constant: float
    misfit: float


@lru_cache(maxsize=64)
def derived(row: CatalogueRow) -> Derived:
    """The two numbers that fit a catalogue's entry best; `BadInput` where no bearing does within `WORST`."""
    moved = 3 * row.preload[1] / row.axial_rigidity[1]  # of one row, were its angle constant: F goes with z^1.5
    start = row.preload[1] / (moved**1.5 * np.sin(row.contact_angle) ** 2.5)
    best = None
    for distance in STARTS:
        begin = np.log([distance, start])
        fit = scipy.optimize.least_squares(_residuals, begin, bounds=(begin - REACH, begin + REACH), args=(row,), x_scale="jac", xtol=1e-12, ftol=1e-12)
        best = fit if best is None or fit.cost < best.cost else best
    assert best is not None
    misfit = float(np.sqrt(np.mean(best.fun**2)))
    if misfit > WORST:
        raise BadInput(
            f"catalogue: preload_N = {list(row.preload)}, unloading_force_N = {list(row.unloading_force)} and axial_rigidity_N_per_um = "
            f"{[k / 1e6 for k in row.axial_rigidity]} fit no ball bearing of {np.degrees(row.contact_angle):g} degrees: the best one misses "
            f"them by {misfit:.0%} rms, where catalogues leave 1 %; are they of one pair, and in the order light, medium, heavy?"
        )
    distance, constant = np.exp(best.x)
    return Derived(float(distance), float(constant), misfit)


def axial(distance: float, constant: float, angle: float, z: float) -> tuple[float, float]:
    """Force (N) and rigidity (N/m) of one row moved by `z` (m) from its free position."""
    radial, height = distance * np.cos(angle), distance * np.sin(angle) + z
    length = float(np.hypot(radial, height))
    pressed = max(length - distance, 0.0)
    sine = height / length
    force = constant * pressed**1.5 * sine
    return float(force), float(constant * (1.5 * np.sqrt(pressed) * sine**2 + pressed**1.5 * (1 - sine**2) / length))


def pair(distance: float, constant: float, angle: float, preload: float) -> tuple[float, float]:
    """Unloading force (N) and axial rigidity (N/m) of a rigid pair."""
    reach = 1e-6
    while axial(distance, constant, angle, reach)[0] < preload:
        reach *= 2
    z = scipy.optimize.brentq(lambda z: axial(distance, constant, angle, z)[0] - preload, 0.0, reach, xtol=1e-15)
    return axial(distance, constant, angle, 2 * z)[0], 2 * axial(distance, constant, angle, z)[1]


def _residuals(unknowns: Array, row: CatalogueRow) -> Array:
    distance, constant = np.exp(unknowns)
    found = [pair(distance, constant, row.contact_angle, p) for p in row.preload]
    told = zip(row.unloading_force, row.axial_rigidity, strict=True)
    return np.log([[f / force, k / rigidity] for (f, k), (force, rigidity) in zip(found, told, strict=True)]).ravel()
