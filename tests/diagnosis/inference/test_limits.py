"""The evidence of linear toys whose sizes and shape parameters have limits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import norm

from tests.diagnosis.inference.toy import toy
from tests.virtual_campaign import effect
from thermospindle.diagnosis.inference.evidence import Learned, amplitudes_apart, evidence
from thermospindle.diagnosis.inference.fit import Held, _held
from thermospindle.diagnosis.inference.gaussian import impossible, ln_within_limits, opposite
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.parameters.nuisance import (
    DAMPING,
    DRIFT,
    STIFFNESS,
)
from thermospindle.sim.effects.effect import Parameter


def test_a_size_of_one_sign_has_half_a_prior():
    """Twice the probability of the sign that limits allow: for a size well on that side ln 2, on the other far less than nothing."""
    free, bound = toy(4, 0.0, hidden=1.6), toy(4, 0.0, hidden=1.6, limits=(1.0, 50.0))
    assert evidence(bound.model, bound.fit).ln - evidence(free.model, free.fit).ln == pytest.approx(np.log(2), abs=1e-2)
    wrong = toy(4, 0.0, hidden=0.4, limits=(1.0, 50.0))
    other = toy(4, 0.0, hidden=0.4)
    assert evidence(wrong.model, wrong.fit).ln - evidence(other.model, other.fit).ln < norm.logcdf(-5)


def test_sizes_that_depart_from_their_law_keep_the_sign_that_all_have():
    """Errors that all sizes share weigh them against each other: the mean of least variance of 1.8, 3.4 and 1.7 is then less than 1."""
    sizes = {"hidden": (1.8, 3.4, 1.7), "confused": (0.3, 0.6, 0.3), "rows": 400}
    free, bound = toy(6, 0.0, **sizes), toy(6, 0.0, **sizes, limits=(1.0, 50.0))
    found = evidence(free.model, free.fit)
    gls = np.linalg.solve(found.size_covariance[0], np.ones(3))
    assert gls @ found.sizes[0] / gls.sum() < 1.0 < found.sizes[0].min()
    assert 0 < evidence(bound.model, bound.fit).ln - found.ln < np.log(2) + 1e-9  # the sign is more probable than not


@pytest.mark.parametrize("held", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_shape_within_limits_is_the_integral_over_these(held, monkeypatch):
    """A share from nothing to one, neutral at nothing: the integral over it alone, by quadrature;
    held at nothing where the data would have it less."""
    own, plain, random = (1.0, 0.0, 1.0), toy(3, 0.0, hidden=2.0), np.random.default_rng(8)
    monkeypatch.setattr("thermospindle.diagnosis.inference.evidence.own_grid", lambda m: {own: 0.0})
    jacobians = [np.column_stack([j, random.standard_normal(len(j))]) for j in plain.jacobians]
    y = [v + (-0.4 if held else 0.6) * j[:, -1] for v, j in zip(plain.y, jacobians, strict=True)]
    prior = plain.prior(0.0, 0.0, 0.0, [own])
    kept = np.diag(prior) > 0  # sizes of nothing are no parameters
    precision = np.eye(len(kept) + 1)
    precision[np.ix_([*kept, False], [*kept, False])] = np.linalg.inv(prior[np.ix_(kept, kept)])
    kept = np.append(kept, True)

    def ln(u: float) -> float:
        return replace(plain, y=[v - u * j[:, -1] for v, j in zip(y, jacobians, strict=True)]).ln(prior)

    us = np.linspace(0.0, 2.0, 1001)
    values = np.array([ln(u) + norm.logpdf(u) for u in us]) - np.log(norm.cdf(2.0) - 0.5)
    by_quadrature = np.log(trapezoid(np.exp(values - values.max()), us)) + values.max()

    whole, right, free = np.concatenate(jacobians), np.concatenate(y), kept.copy()
    normal, point = whole.T @ whole + precision, np.zeros(len(kept))
    free[-1] = not held
    point[free] = np.linalg.solve(normal[np.ix_(free, free)], (whole.T @ right)[free])
    slope = float(whole[:, -1] @ (whole @ point - right) + point[-1])
    stands = (Held(len(point) - 1, slope, 1 / np.linalg.inv(normal[np.ix_(kept, kept)])[-1, -1] - 1),) if held else ()
    moving = [j * np.append(np.ones(len(kept) - 1), not held) for j in jacobians]
    by_test = tuple((float((r := j @ point - v) @ r), m.T @ r, m.T @ m) for j, m, v in zip(jacobians, moving, y, strict=True))
    mechanism = replace(plain.mechanisms[0], shape=(Parameter("share", "1", 0.0, 0.0, 0.5, (0.0, 1.0), "", ""),))
    chi2, gradient, information = (sum(b[k] for b in by_test) for k in range(3))
    done = replace(
        plain.fit, mechanisms=(mechanism,), point=point, shapes=((0.5 * point[-1],),), chi2=chi2, gradient=gradient, information=information,
        by_test=by_test, held=stands,
    )  # fmt: skip
    found = evidence(plain.model, done, [Learned({STIFFNESS: 0.0, DAMPING: 0.0, DRIFT: 0.0}, 1.0)])
    assert (slope > 0) if held else (point[-1] > 0)
    assert found.ln == pytest.approx(by_quadrature, abs=0.02)
    assert (found.mean[-1] == 0.0) == held
    known = np.flatnonzero(np.diag(found.covariance) > 1e-12)
    precision = np.linalg.inv(found.covariance[np.ix_(known, known)])
    others = known != len(point) - 1
    [root], first = done.roots, len(plain.fit.nuisance)
    part = np.isin(known[others], range(first, first + len(root)))
    with_it = np.linalg.inv(precision[np.ix_(others, others)])[np.ix_(part, part)]  # the shape as it is: its row and column of the precision left out
    assert found.as_shaped[0] == pytest.approx(root @ with_it @ root.T, rel=1e-6, abs=1e-9)
    assert np.trace(found.as_shaped[0]) < np.trace(found.size_covariance[0]) or held


@pytest.mark.parametrize("errors", [1.0, 2.5])
def test_what_a_shape_that_is_held_gives_up_does_not_depend_on_the_errors_of_its_fit(errors):
    """Three standard deviations from where it is neutral, held by data that would have it farther: the
    integral over what is inside, by quadrature, of fits with errors as stated and as learned. That of
    a fit with errors 2.5 times as large counted its prior as if they had been as stated, 0.6 off."""
    share, low, slope, information = Parameter("share", "1", 0.0, 0.0, 0.5, (-1.5, 1.5), "", ""), -3.0, 30.0, np.array([[50.0, 20.0], [20.0, 40.0]])
    p = np.array([0.0, low])
    for fitted in (1.0, 2.5):
        precision = fitted**2 * np.eye(2)
        problem = SimpleNamespace(length=2, precision=precision, held=lambda p, slope: np.array([1]))
        [held] = _held(problem, p, np.array([0.0, slope]) + precision @ p, information + precision)
        done = SimpleNamespace(nuisance=np.zeros(1), mechanisms=(SimpleNamespace(shape=(share,)),), roots=(np.zeros((0, 0)),), held=(held,), point=p)
        found = ln_within_limits(done, np.zeros(2), np.eye(2), errors)
        x = np.linspace(0.0, 6.0, 20001)
        curved = information[1, 1] - information[0, 1] ** 2 / (information[0, 0] + fitted**2)
        exact = np.log(trapezoid(np.exp(-(slope * x + curved * x**2 / 2) / errors**2) * norm.pdf(low + x), x)) - np.log(norm.cdf(3.0) - norm.cdf(-3.0))
        assert found == pytest.approx(exact, abs=1e-3)


def test_a_shape_with_a_law_of_the_datas_own_says_nothing_of_amounts():
    """What it moves in a test has no part of what the size moves there; of a law that is assumed it keeps it, for it may be the law's."""
    plain, random = toy(3, 0.0, hidden=2.0), np.random.default_rng(9)
    share = Parameter("share", "1", 0.0, 0.0, 0.5, (0.0, 1.0), "", "")
    n = len(plain.fit.nuisance)
    for own_law in (True, False):
        m = replace(plain.mechanisms[0], shape=(share,), own_law=own_law)
        moved = [np.column_stack([j, 3 * j[:, n + t] + random.standard_normal(len(j))]) for t, j in enumerate(plain.jacobians)]
        by_test = tuple((1.0, np.zeros(n + 4), j.T @ j) for j in moved)
        done = replace(plain.fit, mechanisms=(m,), point=np.append(plain.fit.point, 0.3), by_test=by_test)
        turn = amplitudes_apart(done)
        for t, (_, _, information) in enumerate(by_test):
            before, after = information[n + t, -1], (turn.T @ information @ turn)[n + t, -1]
            assert abs(after) < 1e-9 * abs(before) if own_law else after == before


@pytest.mark.parametrize(
    ("count", "off", "alike", "cannot"),
    [(4, 1.2, 0.0, False), (8, 1.2, 0.0, False), (8, 1.7, 0.0, True), (4, 2.4, 0.99, False), (4, 2.4, 0.0, True), (1, 2.9, 0.0, False), (1, 3.1, 0.0, True)],
)
def test_what_a_size_cannot_be_is_asked_of_all_tests_together(count, off, alike, cannot):
    """Sizes `off` standard errors below what they can be, in each of so many tests: independent errors make root-n
    as much of it, what is alike in all tests hardly more than once. One that is well within makes no difference."""
    m = variants(effect("preload_loss"))[0]
    sd, low = 0.05, m.size.limits[0]
    covariance = sd**2 * (alike * np.ones((count, count)) + (1 - alike) * np.eye(count))
    assert impossible(m, np.full(count, low - off * sd), covariance) == cannot
    well = np.block([[covariance, np.zeros((count, 1))], [np.zeros((1, count)), np.array([[sd**2]])]])
    assert impossible(m, np.append(np.full(count, low - off * sd), 0.1), well) == cannot
    assert not impossible(m, np.full(count, 0.1), covariance)
    assert not impossible(m, np.full(count, 0.1), np.zeros((count, count)))
    assert impossible(m, np.full(count, low - 0.01), -1e-18 * np.eye(count))  # rounding of what is known


@pytest.mark.parametrize("count", [1, 5, pytest.param(12, marks=pytest.mark.slow), pytest.param(20, marks=pytest.mark.slow)])
def test_a_size_at_its_limit_is_said_to_be_beyond_it_as_seldom_with_many_tests_as_with_one(count):
    """Sums of squares beyond a limit grow with the number of tests: against those of one a truth at
    the limit was impossible in half of all campaigns of twenty."""
    m = variants(effect("preload_loss"))[0]
    sd, low, random = 0.02, m.size.limits[0], np.random.default_rng(count)
    drawn = low + sd * random.standard_normal((1000, count))
    rate = np.mean([impossible(m, sizes, sd**2 * np.eye(count)) for sizes in drawn])
    assert rate <= 0.006  # 0.00135 of one


@pytest.mark.parametrize(("sizes", "sd", "wrong"), [
    ((-0.10, -0.12, -0.11), (0.04, 0.04, 0.04), True),  # all of them, by more than twice their errors
    ((-0.10, -0.12, -0.11), (0.10, 0.02, 0.10), True),  # where the law does anything, there far below nothing
    ((-0.10, -0.12, 0.30), (0.10, 0.02, 0.05), False),  # it is there in one
    ((-0.10, -0.05, -0.11), (0.10, 0.02, 0.10), False),  # not by so much
])  # fmt: skip
def test_a_sign_that_cannot_be(sizes, sd, wrong):
    (loosening, *_) = variants(effect("flange_fit_loosening"))
    assert opposite(loosening, np.array(sizes), np.diag(sd) ** 2) == wrong
