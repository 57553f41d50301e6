"""Centrifugal growth against closed forms and finite elements."""

from itertools import pairwise

import numpy as np
import pytest

from tests.mounting import turning_inside
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.machine import Condition
from thermospindle.sim.effects.bearing import ring_growth

STEEL = (208e9, 0.30, 7800.0)
ALUMINIUM = (70e9, 0.33, 2700.0)


def stack(*parts):
    return [ring_growth.Layer(a, b, *constants) for a, b, constants in parts]


def spinning_discs(layers, at, elements=400):
    """Radial displacement for 1 rad/s by minimising the energy of linear elements: independent of the layers' closed solution."""
    r = np.unique(np.concatenate([np.linspace(layer.inner, layer.outer, elements + 1) for layer in layers]))
    matrix, load = np.zeros((r.size, r.size)), np.zeros(r.size)
    for i, (a, b) in enumerate(pairwise(r)):
        layer = next(x for x in layers if x.inner <= (a + b) / 2 <= x.outer)
        e, nu = layer.modulus / (1 - layer.poisson_ratio**2), layer.poisson_ratio
        for x in (a + b) / 2 + (b - a) / 2 * np.array([-1, 1]) / np.sqrt(3):
            value, slope = np.array([b - x, x - a]) / (b - a), np.array([-1, 1]) / (b - a)
            weight = (b - a) / 2 * x
            strain = np.array([slope, value / x])
            matrix[i : i + 2, i : i + 2] += weight * e * strain.T @ np.array([[1, nu], [nu, 1]]) @ strain
            load[i : i + 2] += weight * layer.density * x * value
    return float(np.interp(at, r, np.linalg.solve(matrix, load)))


def test_spinning_ring_closed_form():
    """Timoshenko & Goodier at the bore; a ring cut into layers is the same ring; a thin hoop grows rho r^3 / E."""
    e, nu, rho = STEEL
    a, b = 5.349e-3, 12.5e-3
    bore = rho * a / (4 * e) * ((3 + nu) * b**2 + (1 - nu) * a**2)
    assert ring_growth.displacement(stack((a, b, STEEL)), a) == pytest.approx(bore, rel=1e-12)
    cut = stack((a, 6e-3, STEEL), (6e-3, 9e-3, STEEL), (9e-3, b, STEEL))
    assert ring_growth.displacement(cut, a) == pytest.approx(bore, rel=1e-10)
    assert ring_growth.displacement(stack((a, 1.0001 * a, STEEL)), a) == pytest.approx(rho * a**3 / e, rel=3e-4)


def test_spinning_solid_disc_closed_form():
    """u(b) = rho b^3 (1 - nu) / (4 E): what a turning shaft with its inner ring does."""
    e, nu, rho = STEEL
    solid = stack((0.0, 2.5e-3, STEEL), (2.5e-3, 3.752e-3, STEEL))
    assert ring_growth.displacement(solid, 3.752e-3) == pytest.approx(rho * 3.752e-3**3 * (1 - nu) / (4 * e), rel=1e-12)


@pytest.mark.parametrize("bearing", [0, 1])
def test_growth_of_the_reference_rings_against_finite_elements(spindle, bearing):
    """Steel ring, sleeve and hub as layers; the lower ring has the hub plate over half its height. Linear elements: 1e-4."""
    half = (ALUMINIUM[0] / 2, ALUMINIUM[1], ALUMINIUM[2] / 2)
    outside = [(6.5e-3, 7.5e-3, ALUMINIUM), (7.5e-3, 16e-3, half)] if bearing == 0 else [(6.5e-3, 12.5e-3, ALUMINIUM)]
    layers = stack((5.349e-3, 6.5e-3, STEEL), *outside)
    found = ring_growth.unit_growth(spindle, (b := spindle.bearings[bearing]), b.outer_ring)
    assert found == pytest.approx(spinning_discs(layers, 5.349e-3), rel=1e-4)


def test_growth_reaches_the_turning_race(spindle):
    """As the square of the speed, and as large as the layers say, which the closed forms above verify."""
    nothing = {b.name: reference_motion(20.0) for b in spindle.bearings}
    turning = turning_inside(spindle)
    for made, field, other in ((spindle, "outer_r", "inner_r"), (turning, "inner_r", "outer_r")):
        slow, fast = (ring_growth.EFFECT.motions(made, Condition(20.0, w), {"scale": 0.8}, nothing)["upper"] for w in (500.0, 1000.0))
        upper = next(b for b in made.bearings if b.name == "upper")
        growth = ring_growth.unit_growth(made, upper, upper.outer_ring if field == "outer_r" else upper.inner_ring)
        assert getattr(slow, field) == pytest.approx(0.8 * 500.0**2 * growth, rel=1e-12)
        assert getattr(fast, field) == pytest.approx(4 * getattr(slow, field), rel=1e-12)
        assert getattr(slow, field) > 0
        assert getattr(slow, other) == 0
