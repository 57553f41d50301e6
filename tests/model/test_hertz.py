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


@pytest.mark.parametrize(
    ("difference", "a", "b"),
    [(0.3204, 1.2623, 0.8114), (0.6716, 1.8258, 0.6245), (0.87366, 2.800, 0.4863), (0.93657, 3.738, 0.4166), (0.97290, 5.267, 0.3490), (0.983797, 6.448, 0.3150)],
)
def test_half_axes_and_pressure_of_the_published_table(difference, a, b):
    """Harris, Rolling Bearing Analysis, Table 6.1: dimensionless half axes by the curvature
    difference; of steel they are 0.0236 (Q / rho)^(1/3) mm times these."""
    load, total = 800.0, 0.202e3
    across, along = total * (1 - difference) / 2, total * (1 + difference) / 2
    contact = point_contact(10e-3, along - 200.0, across - 200.0, (207e9, 0.3), (207e9, 0.3))
    unit = 0.0236e-3 * (load / 0.202) ** (1 / 3)
    assert contact.half_axes(load) == pytest.approx((a * unit, b * unit), rel=2e-3)
    assert contact.pressure(load) == pytest.approx(1.5 * load / (np.pi * a * b * unit**2), rel=3e-3)
    assert contact.pressure(0.0) == contact.pressure(-1.0) == 0.0


def test_pressure_of_a_209_bearing():
    """12.7 mm balls in grooves of 6.6 mm on a pitch circle of 65 mm: curvature sums 0.202 and 0.138
    1/mm, differences 0.940 and 0.912 (Harris, ch. 2), whence the half axes of Table 6.1 between its
    rows. The pressure over the ellipse, half an ellipsoid, carries the load."""
    load, steel = 4536.0, (207e9, 0.3)
    rows = np.array([[0.87366, 2.800, 0.4863], [0.90999, 3.233, 0.4499], [0.93657, 3.738, 0.4166], [0.95738, 4.395, 0.3830]])
    for inner, total, difference in ((True, 0.202, 0.940), (False, 0.138, 0.912)):
        contact = race_contact(12.7e-3, 6.6 / 12.7, 65e-3, 0.0, inner, steel, steel)
        assert contact.curvature_sum == pytest.approx(total * 1e3, rel=3e-3)
        a, b = (np.interp(difference, rows[:, 0], rows[:, k]) * 0.0236e-3 * (load / total) ** (1 / 3) for k in (1, 2))
        assert contact.pressure(load) == pytest.approx(1.5 * load / (np.pi * a * b), rel=1e-2)
        x, y = np.meshgrid(*[np.linspace(-1, 1, 801)] * 2)
        shape = np.sqrt(np.maximum(1 - x**2 - y**2, 0.0)).mean() * 4
        assert contact.pressure(load) * np.prod(contact.half_axes(load)) * shape == pytest.approx(load, rel=5e-3)


def test_impossible_contacts_are_refused():
    with pytest.raises(ValueError, match="conformity"):
        point_contact(1e-3, 0.0, -1 / (0.49e-3), (2e11, 0.3), (2e11, 0.3))
    with pytest.raises(ValueError, match="outside"):
        ellipticity(1.0)
