"""Hertz contact against published numbers and limits."""

import numpy as np
import pytest

from thermospindle.model.bearing.hertz import ellipticity, in_series, point_contact, race_contact


@pytest.mark.parametrize(("ratio", "expected"), [(5, 2.8902), (20, 6.9287), (100, 18.187)])
def test_ellipticity_by_radius_ratio(ratio, expected):
    """Exact ellipticity for Ry/Rx; four to five printed digits."""
    assert ellipticity((ratio - 1) / (ratio + 1)) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("difference", [0.0, 1e-9, 1e-5, 5e-4, 1.1e-3])
def test_nearly_round_contacts(difference):
    """For small differences log k is proportional to F: k = 1 + 4/3 F (series of the elliptic integrals about m = 0)."""
    assert ellipticity(difference) - 1 == pytest.approx(4 / 3 * difference, rel=2e-3, abs=1e-15)


def test_sphere_on_sphere():
    """Two equal spheres of radius R: K = (2/3) E* sqrt(R/2) * 2 with E* = E / (2 (1 - nu^2)) (Hertz; Johnson 1985, Eq. 4.23)."""
    e, nu, radius = 210e9, 0.3, 5e-3
    contact = point_contact(2 * radius, 1 / radius, 1 / radius, (e, nu), (e, nu))
    reduced = e / (2 * (1 - nu**2))
    assert contact.stiffness == pytest.approx(4 / 3 * reduced * np.sqrt(radius / 2), rel=1e-9)


def test_papers_bearing():
    """Constants of the paper's bearing (verification.md: computed outside this project, 1e-3)."""
    args = (9.1e-3, np.radians(24.51))
    steel = (208e9, 0.3)
    inner = race_contact(1.588e-3, 0.529, *args, True, steel, steel).stiffness
    outer = race_contact(1.588e-3, 0.535, *args, False, steel, steel).stiffness
    assert inner == pytest.approx(1.0145e10, rel=1e-3)
    assert outer == pytest.approx(1.0012e10, rel=1e-3)
    assert in_series(inner, outer) == pytest.approx(3.5632e9, rel=1e-3)


def test_pressure_of_the_ellipse_carries_the_load():
    """Mean pressure of the ellipse a, b satisfies the ellipse's own geometry: k = a / b, and area grows as load^(2/3)."""
    contact = race_contact(1.588e-3, 0.529, 9.1e-3, 0.4, True, (208e9, 0.3), (208e9, 0.3))
    (a1, b1), (a8, _) = contact.half_axes(1.0), contact.half_axes(8.0)
    assert a1 / b1 == pytest.approx(contact.ellipticity, rel=1e-12)
    assert a8 / a1 == pytest.approx(2.0, rel=1e-12)


def test_impossible_contacts_are_refused():
    with pytest.raises(ValueError, match="conformity"):
        point_contact(1e-3, 0.0, -1 / (0.49e-3), (2e11, 0.3), (2e11, 0.3))
    with pytest.raises(ValueError, match="outside"):
        ellipticity(1.0)
