"""A manufacturer's catalogue of spindle bearings: preload, unloading force and axial rigidity of a back-to-back pair.

Quoted: the rows of five bearings of the FAG catalogue of spindle bearings (series B70 and B72, steel
balls). The whole table is not shipped; with 990 of its bearings the same fit leaves 0.95 % rms (15
degrees) and 0.60 % (25 degrees), 2.7 % of the worst, a model with fixed contact angle 14 % and 5.5 %. Two
unknowns a bearing: the unloaded distance of the groove centres, and balls times load-deflection constant.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

from thermospindle.model.bearing.ball_row import BallRow, respond
from thermospindle.model.bearing.catalogue import CatalogueRow, derived

BALLS = 10  # only balls times constant counts

ROWS = {  # angle deg: (preload N, unloading force N, axial rigidity N/um) at light, medium, heavy preload
    "B706C.T.P4S": (15, [(9, 28, 8.6), (34, 119, 16.4), (77, 294, 25.5)]),
    "B706E.T.P4S": (25, [(14, 42, 20.9), (60, 187, 36.5), (132, 429, 51.4)]),
    "B7212C.T.P4S": (15, [(315, 986, 71.4), (1022, 3479, 122.8), (2100, 7697, 178.8)]),
    "B7015C.T.P4S": (15, [(283, 880, 76.8), (931, 3138, 131.9), (1923, 6964, 191.7)]),
    "B7015E.T.P4S": (25, [(408, 1196, 177.7), (1439, 4365, 286.7), (3027, 9505, 389.8)]),
}


def row(distance: float, constant: float, angle: float) -> BallRow:
    """A row whose two equal contacts in series have `constant` / BALLS."""
    each = constant / BALLS * 2**1.5
    return BallRow(BALLS, distance * np.cos(angle), distance * np.sin(angle), distance / 2, distance / 2, each, each, 1e-2)


def pair_at(bearing: BallRow, preload: float, fixed_angle: float | None = None) -> tuple[float, float]:
    """Unloading force and rigidity (N/m) of a rigidly preloaded pair: one row unloads where the other is pressed twice as far."""

    def axial(z: float) -> tuple[float, float]:
        if fixed_angle is not None:
            pressed = z * np.sin(fixed_angle)
            k = BALLS * bearing.constant
            return k * pressed**1.5 * np.sin(fixed_angle), 1.5 * k * np.sqrt(pressed) * np.sin(fixed_angle) ** 2
        answer = respond(replace(bearing, axial=bearing.axial + z))
        return float(answer.force[2]), float(answer.tangent[2, 2])

    reach = 1e-6
    while axial(reach)[0] < preload:
        reach *= 2
    z = brentq(lambda z: axial(z)[0] - preload, 0.0, reach)
    return axial(2 * z)[0], 2 * axial(z)[1]


def residuals(unknowns: np.ndarray, name: str, fixed: bool) -> np.ndarray:
    """ln of model over catalogue (6,): unloading force and rigidity at three preloads."""
    angle, rows = ROWS[name]
    bearing = row(*np.exp(unknowns), np.radians(angle))
    found = [pair_at(bearing, preload, np.radians(angle) if fixed else None) for preload, _, _ in rows]
    return np.log([[f / force, k / (1e6 * rigidity)] for (f, k), (_, force, rigidity) in zip(found, rows, strict=True)]).ravel()


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def fitted(name: str, fixed: bool = False):
    """Least squares far from all bounds, from distances at which 5 to 40 um carry the middle preload."""
    angle, rows = ROWS[name]
    starts = [np.log((distance, rows[1][0] / (z**1.5 * np.sin(np.radians(angle)) ** 2.5))) for distance in (2e-4, 8e-4) for z in (5e-6, 40e-6)]
    fits = [least_squares(residuals, s, bounds=(s - 7, s + 7), args=(name, fixed), x_scale="jac", xtol=1e-12, ftol=1e-12) for s in starts]
    return min(fits, key=lambda f: f.cost)


@pytest.mark.parametrize("name", ROWS)
def test_what_the_program_derives_is_the_best_there_is(name):
    """Bounds about a start that was e^2.8 too high had refused one bearing in twelve, and kept B7015C 4 % too stiff."""
    angle, rows = ROWS[name]
    found = derived(CatalogueRow(np.radians(angle), *(tuple(row[k] * scale for row in rows) for k, scale in enumerate((1.0, 1.0, 1e6)))))
    best = fitted(name)
    assert found.misfit == pytest.approx(rms(best.fun), rel=1e-4)
    assert np.log([found.unloaded_distance, found.constant]) == pytest.approx(best.x, abs=1e-3)


@pytest.mark.parametrize("name", ROWS)
def test_the_angle_change_is_in_the_catalogue(name):
    """Two unknowns fit six numbers to the stated 0.95 % (15 deg) or 0.60 % (25 deg) over all bearings; single ones within twice that."""
    moving, fixed = fitted(name), fitted(name, fixed=True)
    assert rms(moving.fun) < (0.022 if ROWS[name][0] == 15 else 0.012)
    assert rms(fixed.fun) > 3 * rms(moving.fun)


@pytest.mark.parametrize(("known", "twin"), [("B706E.T.P4S", "B706C.T.P4S"), ("B7015E.T.P4S", "B7015C.T.P4S")])
def test_a_15_degree_bearing_from_its_25_degree_twin(known, twin):
    """Same balls and grooves: fitted at 25 degrees, the 15 degree twin is predicted (1.9 % rms over the catalogue; 4 % for one)."""
    assert rms(residuals(fitted(known).x, twin, False)) < 0.04
