"""Runout of one line in closed form: y = h (c + a) exp(i psi) + e with E|c|^2 = 1.5^2, E|e|^2 = sd^2 and a ~ N(0, 3^2) of an effect."""

from types import SimpleNamespace

import numpy as np
import pytest

from thermospindle.diagnosis.runout.explanation import Explanation, Variant
from thermospindle.diagnosis.runout.fit import Family, fit_family
from thermospindle.diagnosis.runout.held_out import held_out
from thermospindle.diagnosis.runout.moved import moved_lines
from thermospindle.diagnosis.runout.verdict import _information
from thermospindle.model.bearing.kinematics import Line

KEY = ("front", "inner waviness", 3, "3x")
LIKELY, PRIOR = 1.5, 3.0


def family(value, shown, sd, phase=0):
    """A row a test; the phase of its source is known, or `phase`."""
    n = len(value)
    return Family(
        np.array(value, complex), np.array(sd, float), np.ones(n, bool), np.arange(n), np.full(n, 150.0), np.full(n, 8), np.array(shown, complex)[:, None],
        np.zeros((0, n, 1), complex), np.full((n, 1), phase), np.array([LIKELY]), (((KEY, "first"), None),), np.zeros(0), 0,
    )  # fmt: skip


def explained(size):
    variant = Variant(SimpleNamespace(name="race_waviness", parameters=(SimpleNamespace(prior_sd=PRIOR),)), {}, {(KEY, "first"): 1.0}, (0,))
    return Explanation((variant,), np.array([size]), np.ones(1), 0.0, 0.0)


def test_a_size_with_and_without_its_prior():
    """The real part of y / h has the variance (sd^2 / h^2 + 1.5^2) / 2 about a."""
    h, sd, y = 2.0, 0.8, 9.0 + 1.0j
    fit = fit_family(family([y], [h], [sd]), [np.ones(1)], [PRIOR])
    free = (sd**2 / h**2 + LIKELY**2) / 2
    held = 1 / (1 / free + 1 / PRIOR**2)
    assert fit.free_sd == pytest.approx([np.sqrt(free)])
    assert fit.size_sd == pytest.approx([np.sqrt(held)])
    assert fit.size == pytest.approx([held / free * y.real / h])
    across, along = (h**2 * LIKELY**2 + sd**2) / 2, h**2 * (free + PRIOR**2)
    assert fit.chi2 == pytest.approx(y.real**2 / along + y.imag**2 / across)
    assert fit.evidence == pytest.approx(-0.5 * (fit.chi2 + np.log(along * across / (sd**2 / 2) ** 2)))


def test_evidence_of_an_unknown_phase():
    """Laplace's: a phase of variance pi^2 / 3, to which y is as certain as its amplitude is large, beside c, which may turn in its place."""
    h, sd, y = 2.0, 0.3, 7.0j
    fit = fit_family(family([y], [h], [sd], phase=1))
    ratio = (h * LIKELY / sd) ** 2
    size = abs(y) / (h * LIKELY) / (1 + 1 / ratio)  # of c / 1.5 where chi2 is least
    assert abs(fit.amplitude[0]) == pytest.approx(size, rel=1e-4)
    assert fit.chi2 == pytest.approx(2 * abs(y) ** 2 / (h**2 * LIKELY**2 + sd**2), rel=1e-6)
    assert fit.evidence == pytest.approx(-0.5 * (fit.chi2 + np.log((1 + ratio) * (1 + ratio + 2 * ratio * size**2 * np.pi**2 / 3))), rel=1e-4)


def test_conditions_left_out_by_hand():
    """Each test predicted by the size that the other has: squares of complex numbers are two, of variance (h^2 1.5^2 + sd^2) / 2 each."""
    y, h, sd = np.array([8.0, 3.0]), np.array([2.0, 0.5]), np.array([0.8, 0.2])
    free = (sd**2 / h**2 + LIKELY**2) / 2
    other = (y / h / free / (1 / free + 1 / PRIOR**2))[::-1]
    variance = (h**2 * LIKELY**2 + sd**2) / 2
    before, after = held_out(explained(1.0), [family(y, h, sd)])
    assert before == pytest.approx(np.sqrt(np.sum(y**2 / variance) / 4))
    assert after == pytest.approx(np.sqrt(np.sum((y - other * h) ** 2 / variance) / 4), rel=1e-5)


def test_the_information_of_a_size_is_that_of_its_real_and_imaginary_parts():
    """1 / variance by generalised least squares over four real numbers, of the two rows that one c moves."""
    h, sd = np.array([2.0 + 1.0j, -0.5 + 0.7j]), np.array([0.8, 0.2])
    cover = np.diag(sd**2) + LIKELY**2 * np.outer(h, h.conj())
    real = np.block([[cover.real, -cover.imag], [cover.imag, cover.real]]) / 2
    moved = np.concatenate([h.real, h.imag])
    assert _information(family([0, 0], h, sd), np.ones(1)) == pytest.approx(moved @ np.linalg.inv(real) @ moved)


def test_a_moved_line_by_hand():
    """Scene 3 and effect 4 are 5 together by chance of their angle; the amplitude of y has half the square of its error."""
    line = Line(*KEY, "radial", 1, 150.0)
    seen = SimpleNamespace(test=SimpleNamespace(id="hot"), condition=SimpleNamespace(speed=-100 * np.pi), seen=(SimpleNamespace(lines=(line,)),))
    [moved] = moved_lines(SimpleNamespace(families=(family([3.0 + 4.0j], [2.0], [0.2]),), seen=(seen,)), explained(2.0))
    assert (moved.scene, moved.with_effect, moved.measured) == pytest.approx((3.0, 5.0, 5.0))
    assert moved.measured_sd == pytest.approx(0.2 / np.sqrt(2))
    assert (moved.test, moved.name, moved.cause, moved.node) == ("hot", "3x", "front inner waviness 3", 8)
    assert (moved.frequency, moved.order) == pytest.approx((150.0, 3.0))
