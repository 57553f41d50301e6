"""The evidence of linear toys, whose integrals are known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import multivariate_normal, norm

from tests.virtual_campaign import effect
from thermospindle.diagnosis.forward.mechanism import REFERENCE_DEPARTURE, REFERENCE_WIDTH, Mechanism, size_covariance, variants
from thermospindle.diagnosis.forward.nuisance import (
    BUILD,
    DAMPING,
    DAMPING_DRIFT,
    DAMPING_DRIFT_SD,
    DAMPING_SD,
    DRIFT,
    DRIFT_SD,
    STIFFNESS,
    STIFFNESS_DRIFT,
    STIFFNESS_DRIFT_SD,
    STIFFNESS_SD,
    TEMPERATURE,
    Nuisance,
)
from thermospindle.diagnosis.inference.evidence import WIDER, WIDTHS, Learned, amplitudes_apart, evidence, left_out
from thermospindle.diagnosis.inference.fit import Fit, Held
from thermospindle.diagnosis.inference.gaussian import Quadratic, impossible, marginal
from thermospindle.diagnosis.inference.prior import ACTION, Root, misjudged, nuisance_variances, precision_and_variances, whole_root
from thermospindle.model.machine import Condition
from thermospindle.sim.effects.effect import Effect, Parameter

CONDITIONS = [Condition(20.0), Condition(40.0), Condition(60.0)]


@dataclass(frozen=True)
class Toy:
    """y_t = J_t p + errors of unit variance, in `rows` numbers a test; p = [nuisances, whitened sizes]."""

    model: SimpleNamespace
    fit: Fit
    jacobians: list[np.ndarray]
    y: list[np.ndarray]
    mechanisms: tuple[Mechanism, ...]

    def prior(self, stiffness: float, damping: float, drift: float, own=()) -> np.ndarray:
        size = {STIFFNESS: stiffness / STIFFNESS_SD, DAMPING: damping / DAMPING_SD, DRIFT: drift / DRIFT_SD}
        n = len(self.model.parameters)
        whole = np.zeros((len(self.fit.point), len(self.fit.point)))
        whole[:n, :n] = np.diag([size.get(p.kind, 1.0) ** 2 for p in self.model.parameters])
        for m, root, (width, departure) in zip(self.mechanisms, self.fit.roots, own, strict=True):
            inverse = np.linalg.inv(root)
            whole[n:, n:] = inverse @ size_covariance(CONDITIONS, width * m.size.prior_sd, departure) @ inverse.T
        return whole

    def ln(self, prior: np.ndarray, errors: float = 1.0) -> float:
        """ln of the integral of likelihood times prior; the evidence leaves out (2 pi)^(-n/2)."""
        jacobian, y = np.concatenate(self.jacobians), np.concatenate(self.y)
        covariance = errors**2 * np.eye(len(y)) + jacobian @ prior @ jacobian.T
        return float(multivariate_normal(np.zeros(len(y)), covariance).logpdf(y) + len(y) / 2 * np.log(2 * np.pi))


def toy(
    seed: int, stiffness: float, hidden: float | tuple[float, ...] | None = None, limits=(-50.0, 50.0), rows: int = 40, errors: float = 1.0,
    confused: tuple[float, ...] = (0.0, 0.0, 0.0), build: float = 1.0,
) -> Toy:
    """Data drawn with a discrepancy of the size `stiffness`, build tolerances `build` times those stated, and, with a mechanism in the fit, a `hidden` size in every test, of which the first
    tolerance cannot be told from `confused` times its change."""
    random = np.random.default_rng(seed)
    parameters = [Nuisance(BUILD, f"b{i}", 0.01) for i in range(3)] + [Nuisance(STIFFNESS, f"k{i}", STIFFNESS_SD, modes=(i, i)) for i in range(8)]
    parameters += [Nuisance(DAMPING, f"c{i}", DAMPING_SD, modes=(i, i)) for i in range(2)]
    parameters += [Nuisance(TEMPERATURE, f"t{t}", 0.2, test=t) for t in range(3)] + [Nuisance(DRIFT, f"g{t}", DRIFT_SD, test=t) for t in range(3)]
    mechanisms, roots = (), ()
    if hidden is not None:
        size = Parameter("size", "1", 1.0, 1.5, 0.4, limits, "", "")
        mechanisms = (Mechanism(Effect("toy", "", "", (size,), "", (), ""), {}, ()),)
        roots = (np.linalg.cholesky(size_covariance(CONDITIONS, REFERENCE_WIDTH * size.prior_sd, REFERENCE_DEPARTURE)),)
    n = len(parameters)
    sizes = {STIFFNESS: stiffness / STIFFNESS_SD, BUILD: build, TEMPERATURE: 1.0}
    p = np.array([sizes.get(q.kind, 0.0) for q in parameters])
    p = np.concatenate([p * random.standard_normal(n), *([np.linalg.solve(r, np.full(3, np.array(hidden) - 1.0)) for r in roots])])
    own_of_test = np.array([q.test is None for q in parameters])
    jacobians, y = [], []
    for t in range(3):
        j = random.standard_normal((rows, n)) * np.where(own_of_test | np.array([q.test == t for q in parameters]), 1.0, 0.0)
        j[:, [q.kind == STIFFNESS for q in parameters]] *= 5  # the smallest size shows by about five standard errors
        by_size = 2 * random.standard_normal((rows, 1))
        if any(confused):
            j[:, :1] = confused[t] * by_size
        j = np.concatenate([j, *[by_size * r[t][None, :] for r in roots]], axis=1)
        jacobians.append(j)
        y.append(j @ p + errors * random.standard_normal(rows))
    point = p + 0.3 * random.standard_normal(len(p))  # the quadratic is the same about any point
    by_test = tuple((float((j @ point - v) @ (j @ point - v)), j.T @ (j @ point - v), j.T @ j) for j, v in zip(jacobians, y, strict=True))
    tests = tuple(SimpleNamespace(condition=c, count=rows) for c in CONDITIONS)
    fit = Fit(
        mechanisms, point, np.zeros((len(mechanisms), 3)), ((),) * len(mechanisms), roots, sum(b[0] for b in by_test),
        np.sum([b[1] for b in by_test], axis=0), np.sum([b[2] for b in by_test], axis=0), by_test, 3 * rows, None, 1.0,
    )  # fmt: skip
    return Toy(SimpleNamespace(parameters=tuple(parameters), tests=tests), fit, jacobians, y, mechanisms)


@pytest.mark.parametrize("errors", [1.0, 1.3])
@pytest.mark.parametrize("sizes", [(0.0, 0.0, 0.0), (1e-3, 0.03, 1e-3), (1e-2, 0.1, 0.0)])
def test_one_choice_of_priors_is_the_gaussian_integral(sizes, errors):
    made = toy(1, 1e-3)
    found = evidence(made.model, made.fit, [Learned(dict(zip((STIFFNESS, DAMPING, DRIFT), sizes, strict=True)), errors, (), ())])
    assert found.ln == pytest.approx(made.ln(made.prior(*sizes), errors), abs=1e-6)


def test_mean_and_covariance_are_the_posterior():
    made = toy(3, 1e-3, hidden=1.6)
    found = evidence(made.model, made.fit)
    learned = found.learned
    prior = made.prior(*(learned.sizes[k] for k in (STIFFNESS, DAMPING, DRIFT)), list(zip(learned.widths, learned.departures, strict=True)))
    jacobian, y = np.concatenate(made.jacobians), np.concatenate(made.y)
    gain = prior @ jacobian.T @ np.linalg.inv(learned.errors**2 * np.eye(len(y)) + jacobian @ prior @ jacobian.T)
    assert found.mean == pytest.approx(gain @ y, abs=1e-5)
    assert found.covariance == pytest.approx(prior - gain @ jacobian @ prior, abs=1e-5)
    left = jacobian @ (gain @ y) - y
    assert found.chi2 == pytest.approx(left @ left, rel=1e-6)
    root = made.fit.roots[0]
    assert found.sizes[0] == pytest.approx(1.0 + root @ (gain @ y)[-3:], abs=1e-5)
    assert np.all(np.abs(found.sizes[0] - 1.6) < 5 * np.sqrt(np.diag(found.size_covariance[0])))


@pytest.mark.parametrize("size", [0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2])
def test_the_size_of_the_discrepancy_is_learned(size):
    """Of twenty campaigns at least eighteen learn the size that they were drawn with; drift and damping, of which there is none, none."""
    right = [evidence(made.model, made.fit).learned for made in (toy(seed, size) for seed in range(20))]
    assert sum(learned.sizes[STIFFNESS] == size for learned in right) >= 18
    assert sum(learned.sizes[DAMPING] == 0.0 and learned.sizes[DRIFT] == 0.0 for learned in right) >= 14


def test_a_model_that_is_wrong_may_be_wrong_in_what_an_effect_does():
    """In proportion: nothing for a model that is right, or a mode that does not move; `ACTION` times the frequencies' error of what moves."""
    parameters = [Nuisance(BUILD, "b", 0.01)] + [
        Nuisance(kind, kind, sd, test=t, modes=(i, i))
        for kind, sd in ((STIFFNESS_DRIFT, STIFFNESS_DRIFT_SD), (DAMPING_DRIFT, DAMPING_DRIFT_SD)) for t in (0, 1) for i in (0, 1)
    ]  # fmt: skip
    model = SimpleNamespace(parameters=parameters)
    moved = np.zeros((1, 2, 2, 2))
    moved[0, 0, 0, 1], moved[0, 1, 0, 1], moved[0, 1, 1, 0] = 0.01, 0.02, -0.3  # frequency of the second mode in both tests, damping of the first in one
    right = {STIFFNESS: 0.0, STIFFNESS_DRIFT: 0.0, DAMPING_DRIFT: DAMPING_DRIFT_SD}
    assert nuisance_variances(model, right).tolist() == [1, 0, 0, 0, 0, 1, 1, 1, 1]
    assert misjudged(model, right, moved).shape == (9, 0)
    found = misjudged(model, right | {STIFFNESS: 0.01}, moved)
    one_number = ACTION * 0.01 / STIFFNESS_DRIFT_SD * np.array([0.01, 0.02])
    assert found[[2, 4], 0] == pytest.approx(one_number)  # of one mode in all tests
    assert found[7] == pytest.approx([0, -ACTION * 0.01 * 0.3 / DAMPING_DRIFT_SD])
    assert np.count_nonzero(found) == 3
    opposed = misjudged(model, right | {STIFFNESS: 0.01}, np.concatenate([moved, -moved]))
    assert opposed @ opposed.T == pytest.approx(2 * found @ found.T)  # two mechanisms may be misjudged though together they move nothing


def test_what_is_wrong_in_an_effect_is_alike_in_all_tests():
    """The evidence with drift in proportion to what an effect moves is that of one parameter more for every mode, in closed form."""
    random = np.random.default_rng(5)
    jacobian, y = random.standard_normal((60, 5)), random.standard_normal(60)
    beside, diagonal = random.standard_normal((5, 2)), np.array([1.0, 0.0, 0.3, 0.0, 2.0])
    left = marginal(Quadratic(float(y @ y), jacobian.T @ y, jacobian.T @ jacobian), Root(np.sqrt(diagonal), beside, np.zeros((0, 0))))
    prior = np.diag(diagonal) + beside @ beside.T
    whole = multivariate_normal(np.zeros(60), np.eye(60) + jacobian @ prior @ jacobian.T)
    assert left.constant == pytest.approx(whole.logpdf(y) + 30 * np.log(2 * np.pi), rel=1e-9)


def test_a_fit_and_the_evidence_have_one_prior():
    """The precision of a fit is the inverse of the covariance whose root the evidence has, what is misjudged included."""
    made = toy(3, 1e-3, hidden=1.6)
    learned = evidence(made.model, made.fit).learned
    sizes = dict.fromkeys((*learned.sizes, STIFFNESS_DRIFT, DAMPING_DRIFT), 1e-3)
    learned = replace(learned, sizes=sizes, departures=(0.3,))
    tests = range(len(made.model.tests))
    parameters = tuple(
        Nuisance(kind, "drift", sd, test=t, modes=(i, i))
        for kind, sd in ((STIFFNESS_DRIFT, STIFFNESS_DRIFT_SD), (DAMPING_DRIFT, DAMPING_DRIFT_SD)) for t in tests for i in (0, 1)
    )  # fmt: skip
    model = SimpleNamespace(parameters=parameters, tests=made.model.tests)
    moved = np.random.default_rng(8).normal(0, 0.2, (1, len(tests), 2, 2))
    found = whole_root(model, made.fit.mechanisms, learned, moved)
    n = len(found.scale) + len(found.own)
    assert (found.beside.shape[1], len(found.own)) == (4, len(tests) + len(made.fit.mechanisms[0].shape))
    inverse, variances = precision_and_variances(model, made.fit.mechanisms, learned, moved)
    assert variances == pytest.approx(np.diag(found.times(found.turned(np.eye(n)))), abs=1e-7)
    covariance = found.times(found.turned(np.eye(n)))
    assert np.abs(found.beside).max() > 0.1
    assert inverse @ covariance == pytest.approx(np.eye(n), abs=1e-5)
    assert found.within(np.eye(n)) == pytest.approx(found.turned(found.times(np.eye(len(found.within(np.eye(n)))))))


def test_rounding_does_not_end_an_evidence():
    """A mechanism that does what a tolerance does, each worth 1e16 in information: what is left of it is rounding, and says nothing."""
    column = np.random.default_rng(1).standard_normal(50) * 1e8
    jacobian = np.stack([column, column, 0.5 * column])
    information = jacobian @ jacobian.T
    information[1:, 1:] -= 1e3 * np.eye(2)  # as rounding may have it
    left = marginal(Quadratic(0.0, np.zeros(3), information), Root(np.ones(1), np.zeros((1, 0)), np.zeros((0, 0))))
    root = np.array([np.eye(2), 3 * np.eye(2)])
    assert np.isfinite(left.integrated([root])).all()


def test_errors_larger_than_stated_are_learned():
    for seed in range(5):
        made = toy(seed, 0.0, rows=200, errors=1.5)
        assert evidence(made.model, made.fit).learned.errors == pytest.approx(1.5, rel=0.1)
        fine = toy(seed, 0.0, rows=200)
        assert evidence(fine.model, fine.fit).learned.errors < 1.1


@pytest.mark.parametrize(("build", "times"), [(1.0, {1.0}), (10.0, {4.0, 8.0})])
def test_tolerances_wider_than_stated_are_learned(build, times):
    """And cost their prior odds beside the integral with as wide a prior."""
    for seed in range(5):
        made = toy(seed, 0.0, rows=200, build=build)
        found = evidence(made.model, made.fit, wide=True)
        assert found.learned.sizes[BUILD] in times
        prior = made.prior(*(found.learned.sizes[k] for k in (STIFFNESS, DAMPING, DRIFT)))
        own = [q.kind == BUILD for q in made.model.parameters]
        prior[own, own] *= found.learned.sizes[BUILD] ** 2
        assert found.ln == pytest.approx(made.ln(prior, found.learned.errors) + WIDER[found.learned.sizes[BUILD]], abs=1e-6)


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


@pytest.mark.parametrize(("hidden", "much"), [(2.0, False), ((1.2, 4.0, 1.1), True)])
def test_what_departures_gain_is_told(hidden, much, monkeypatch):
    """By how much the evidence is larger than that of the same sizes held to their law; less than nothing where the law holds."""
    made = toy(3, 0.0, hidden=hidden, rows=200)
    found = evidence(made.model, made.fit)
    monkeypatch.setattr("thermospindle.diagnosis.inference.evidence._own_grid", lambda lawless, departures: tuple((w, 0.0) for w in WIDTHS))
    held = evidence(made.model, made.fit, [found.learned])
    assert found.by_departing == pytest.approx(found.ln - held.ln, abs=1e-6)
    assert found.by_departing > 20.0 if much else -2.0 < found.by_departing < 0.0


def test_a_law_that_mechanics_gives_is_followed():
    """Sizes that have nothing of their law are evidence for an effect whose law is assumed, and not for one whose law is exact, by more than e^5; where they
    follow it the exact one has the more of it, for it had less to choose."""
    for hidden, exact_gains in (((1.2, 4.0, 1.1), False), (2.0, True)):
        made = toy(3, 0.0, hidden=hidden, rows=200)
        mechanism = replace(made.mechanisms[0], effect=replace(made.mechanisms[0].effect, exact=True))
        gain = evidence(made.model, replace(made.fit, mechanisms=(mechanism,))).ln - evidence(made.model, made.fit).ln
        assert gain > 0.1 if exact_gains else gain < -5.0


@pytest.mark.parametrize("held", [False, True])
def test_a_shape_within_limits_is_the_integral_over_these(held, monkeypatch):
    """A share from nothing to one, neutral at nothing: the integral over it alone, by quadrature; held at nothing where the data would have it less."""
    own, plain, random = (1.0, 0.0), toy(3, 0.0, hidden=2.0), np.random.default_rng(8)
    monkeypatch.setattr("thermospindle.diagnosis.inference.evidence._own_grid", lambda lawless, departures: (own,))
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
    stands = (Held(len(point) - 1, slope, 1 / np.linalg.inv(normal[np.ix_(kept, kept)])[-1, -1]),) if held else ()
    moving = [j * np.append(np.ones(len(kept) - 1), not held) for j in jacobians]
    by_test = tuple((float((r := j @ point - v) @ r), m.T @ r, m.T @ m) for j, m, v in zip(jacobians, moving, y, strict=True))
    mechanism = replace(plain.mechanisms[0], shape=(Parameter("share", "1", 0.0, 0.0, 0.5, (0.0, 1.0), "", ""),))
    chi2, gradient, information = (sum(b[k] for b in by_test) for k in range(3))
    done = replace(
        plain.fit, mechanisms=(mechanism,), point=point, shapes=((0.5 * point[-1],),), chi2=chi2, gradient=gradient, information=information,
        by_test=by_test, held=stands,
    )  # fmt: skip
    found = evidence(plain.model, done, [Learned({STIFFNESS: 0.0, DAMPING: 0.0, DRIFT: 0.0}, 1.0, (), ())])
    assert (slope > 0) if held else (point[-1] > 0)
    assert found.ln == pytest.approx(by_quadrature, abs=0.02)
    assert (found.mean[-1] == 0.0) == held


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


@pytest.mark.parametrize("hidden", [None, 1.6])
def test_what_is_left_out_is_predicted_from_the_rest(hidden):
    """Against a fit of the other tests anew, group by group."""
    made = toy(5, 1e-3, hidden)
    found = evidence(made.model, made.fit)
    learned = found.learned
    prior = made.prior(*(learned.sizes[k] for k in (STIFFNESS, DAMPING, DRIFT)), list(zip(learned.widths, learned.departures, strict=True)))
    groups = [[0], [1, 2]]
    total, density = 0.0, 0.0
    for group in groups:
        rest = [t for t in range(3) if t not in group]
        jacobian, y = (np.concatenate([v[t] for t in rest]) for v in (made.jacobians, made.y))
        p = prior @ jacobian.T @ np.linalg.solve(learned.errors**2 * np.eye(len(y)) + jacobian @ prior @ jacobian.T, y)
        total += sum(float(np.sum((made.jacobians[t] @ p - made.y[t]) ** 2)) for t in group)
        without = replace(made, jacobians=[made.jacobians[t] for t in rest], y=[made.y[t] for t in rest])
        density += made.ln(prior, learned.errors) - without.ln(prior, learned.errors)
    assert left_out(made.model, made.fit, found, groups) == pytest.approx((np.sqrt(total / made.fit.count), density), rel=1e-4)
    assert np.isnan(left_out(made.model, made.fit, found, [[0, 1, 2]])).all()


@pytest.mark.parametrize(("count", "off", "alike", "cannot"), [(4, 1.2, 0.0, False), (8, 1.2, 0.0, True), (4, 2.4, 0.99, False), (4, 2.4, 0.0, True), (1, 2.9, 0.0, False), (1, 3.1, 0.0, True)])
def test_what_a_size_cannot_be_is_asked_of_all_tests_together(count, off, alike, cannot):
    """Sizes `off` standard errors below what they can be, in each of so many tests: independent errors make root-n as much of it, what is alike in all tests
    hardly more than once. One that is well within makes no difference."""
    m = variants(effect("preload_loss"))[0]
    sd, low = 0.05, m.size.limits[0]
    covariance = sd**2 * (alike * np.ones((count, count)) + (1 - alike) * np.eye(count))
    assert impossible(m, np.full(count, low - off * sd), covariance) == cannot
    well = np.block([[covariance, np.zeros((count, 1))], [np.zeros((1, count)), np.array([[sd**2]])]])
    assert impossible(m, np.append(np.full(count, low - off * sd), 0.1), well) == cannot
    assert not impossible(m, np.full(count, 0.1), covariance)
    assert not impossible(m, np.full(count, 0.1), np.zeros((count, count)))
    assert impossible(m, np.full(count, low - 0.01), -1e-18 * np.eye(count))  # rounding of what is known
