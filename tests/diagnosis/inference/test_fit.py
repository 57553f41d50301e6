"""Fits: where they rest, how they come there, and what is hidden."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import optimize

from tests.virtual_campaign import drawn, effect, fitted, mode_campaign, model_of, virtual_campaign
from thermospindle.diagnosis.forward.derivatives import Derivatives
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import AFAR, TEMPERS, _from_afar, _settled, fit
from thermospindle.diagnosis.inference.freeform import free_forms
from thermospindle.diagnosis.inference.hypothesis import scan
from thermospindle.diagnosis.inference.prior import steady
from thermospindle.diagnosis.inference.problem import Linearisation, Problem
from thermospindle.diagnosis.parameters.mechanism import asked_at, variants, with_own_laws
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

COLD_AND_WARM = (Condition(20.0), Condition(55.0, 7200 * RPM))
THREE = (Condition(20.0), Condition(60.0), Condition(40.0, 7200 * RPM))



def test_a_fit_rests(spindle):
    """From its own result it goes nowhere, and the quadratic it hands on is that of its residuals."""
    model, done, _ = fitted(spindle, COLD_AND_WARM, 2, frequency=np.arange(400.0, 6000.1, 16.0))
    again = fit(model, start=done.point, tempers=(1.0,))
    assert abs(again.chi2 + again.point @ again.point - done.chi2 - done.point @ done.point) < 0.2
    own = np.concatenate([model.residual(t, done.point, []) for t in range(2)])
    assert done.chi2 == pytest.approx(own @ own, rel=1e-9)
    downhill = done.gradient + done.point
    assert downhill @ np.linalg.solve(done.information + np.eye(len(downhill)), downhill) < 0.2  # cost still to be gained
    step = 0.05 * np.random.default_rng(1).standard_normal(len(done.point)) / np.sqrt(1 + np.diag(done.information))
    moved = np.concatenate([model.residual(t, done.point + step, []) for t in range(2)])
    promised = done.chi2 + 2 * done.gradient @ step + step @ done.information @ step
    assert moved @ moved == pytest.approx(promised, abs=0.02 * abs(promised - done.chi2) + 0.05)


def test_a_fit_rests_where_the_gradient_is_right(spindle):
    """What tolerances do to the matrices changes with an effect that grows in the fit. With what they did where the fit began its
    gradient was wrong, and it rested in a valley 19 in cost above the end (a free bearing stiffness, where bonds soften by the half)."""
    hidden = (effect("bond_softening"), effect("bond_softening").typical())
    model = model_of(spindle, virtual_campaign(spindle, THREE, 3, effects=[hidden], frequency=np.arange(400.0, 6000.1, 16.0)))
    softer = next(m for m in free_forms(spindle) if m.name == "bearings radial stiffness")
    done = fit(model, (softer,))
    problem, p = Problem(model, (softer,)), done.point
    for i in [i for i, q in enumerate(model.parameters) if q.name in ("preload", "bearing damping", "radial motion of the rings")]:
        step = np.where(np.arange(len(p)) == i, 1e-3, 0.0)
        slope = (problem.cost(p + step, 1.0) - problem.cost(p - step, 1.0)) / 2e-3
        curvature = 2 * (done.information[i, i] + 1.0)
        assert slope == pytest.approx(2 * (done.gradient[i] + p[i]), abs=2e-3 * np.sqrt(curvature))


class Ring(Problem):
    """Two parameters, known well across a circle of radius 1 about (0, -1), and little along it: they are to be at an angle of 2.6 on it."""

    def __init__(self):
        self.length, self.tests = 2, 1
        self.model = SimpleNamespace(tests=[SimpleNamespace(count=3)])
        self.precision, self.least_stiff, self.reach = 1e-3 * np.eye(2), np.full(2, 1e-3), np.ones(2)
        self.low, self.high = np.full(2, -np.inf), np.full(2, np.inf)

    def parts(self, p):
        return p, np.zeros((0, 1)), []

    def effects_of(self, p):
        return [[]]

    def residuals(self, p):
        return [np.array([100 * (np.hypot(p[0], p[1] + 1) - 1), *(3 * (p - [np.sin(2.6), np.cos(2.6) - 1]))])]

    def linearisation(self, p, rates):
        across = np.array([p[0], p[1] + 1]) / np.hypot(p[0], p[1] + 1)
        return Linearisation(2, [(self.residuals(p)[0], Derivatives(np.column_stack([100 * across, 3 * np.eye(2)]), np.arange(2), np.arange(2), np.ones(2)))])


def test_a_bent_valley_is_followed_to_its_end(monkeypatch):
    """In steps as short as its bends ask for. A fit had ended where a long one gained next to nothing,
    30 in ln evidence behind, and of two effects of another program's campaign the wrong one was named."""
    monkeypatch.setattr("thermospindle.diagnosis.inference.fit.rates_of", lambda model, x, effects, rates: rates)
    problem = Ring()
    p, *_ = _settled(problem, np.array([0.3, np.sqrt(1 - 0.09) - 1]), None, 1.0, np.inf)
    assert np.arctan2(p[0], p[1] + 1) == pytest.approx(2.6, abs=0.02)


def bounded(low: list[float], high: list[float]) -> Problem:
    """A problem of which only limits are asked."""
    problem = object.__new__(Problem)
    problem.length, problem.low, problem.high, problem.reach = len(low), np.array(low), np.array(high), np.zeros(len(low))
    return problem


@pytest.fixture(scope="module")
def softer(spindle):
    """The model of a campaign in which bearings are softer at 60 C, and what softens them."""
    bond = effect("bond_softening")
    values = {q.name: q.neutral for q in bond.parameters} | {"hot_compliance": 2.0, "bearing": -1.0}
    model = model_of(spindle, virtual_campaign(spindle, THREE[:2], 3, [(bond, values)], drawn(spindle, 2, 3), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 32.0)))
    return model, variants(bond)[0]


def test_from_afar_errors_are_enlarged_first(softer):
    """A start six prior standard deviations off costs tens of times the noise: from there errors are taken larger first,
    as `AFAR` has it, and not from near. By the data's own errors alone practice campaign g had fits of 51 linearisations."""
    model, m = softer
    problem = Problem(model, (m,))
    near = fit(model, (m,))
    p = problem.within_limits(problem.start({0: m.size.neutral + 6 * m.size.prior_sd}))
    far = problem.cost(p, 1.0) / sum(d.count for d in model.tests)
    assert far > AFAR
    tempers = _from_afar(problem, p, 1.0)
    assert tuple(tempers) == TEMPERS[TEMPERS.index(tempers[0]) : -1]
    assert far * tempers[0] ** 2 <= AFAR < far * TEMPERS[TEMPERS.index(tempers[0]) + 1] ** 2
    assert _from_afar(problem, near.point, 1.0) == ()
    assert fit(model, (m,), p, tempers=TEMPERS[-1:]).cost == pytest.approx(near.cost, abs=1.0)


def test_a_gain_that_no_step_has_found_is_not_counted(softer, monkeypatch):
    """What a fit that stopped on its way owes is taken from its evidence; one that rests owes nothing."""
    model, m = softer
    rested = fit(model, (m,))
    assert rested.owed < 0.3
    start = rested.point + 0.3 * np.sign(rested.gradient)
    monkeypatch.setattr("thermospindle.diagnosis.inference.fit.MOST_STEPS", (0, 0))
    stopped = fit(model, (m,), start, rested.rates, TEMPERS[-1:])
    assert stopped.cost > rested.cost + 10
    assert stopped.owed > 10
    told = evidence(model, stopped)
    assert told.learned.errors > 1
    assert told.ln == pytest.approx(evidence(model, replace(stopped, owed=0.0)).ln - stopped.owed / (2 * told.learned.errors**2))
    assert told.ln < evidence(model, rested).ln


def test_what_is_beaten_ends_early(softer, monkeypatch):
    """A fit that comes no nearer a cost that others have reached is left; one that does goes on to its end."""
    model, m = softer
    asked = []
    taken = Problem.linearisation
    monkeypatch.setattr(Problem, "linearisation", lambda self, *given: asked.append(self) or taken(self, *given))
    found, counts = [], []
    for beaten in (np.inf, -1e7):
        asked.clear()
        found.append(fit(model, (), beaten=beaten))
        counts.append(len(asked))
    assert counts[1] < counts[0]
    assert found[1].cost > found[0].cost
    rests = fit(model, (m,))
    assert fit(model, (m,), beaten=rests.cost).cost == pytest.approx(rests.cost, abs=1.0)


def test_a_step_ends_within_limits():
    """At the least of a quadratic there, by another solver; what stands at a limit that it would leave is held."""
    random, inf = np.random.default_rng(4), np.inf
    for _ in range(20):
        root = random.standard_normal((5, 5))
        normal, slope = root @ root.T + 0.1 * np.eye(5), 3 * random.standard_normal(5)
        problem = bounded([-inf, -inf, -inf, 0.0, -inf], [inf] * 5)
        p = np.array([0.3, -0.2, 0.1, 0.0, 0.4])
        factor = np.linalg.cholesky(normal)
        by_other = optimize.lsq_linear(factor.T, -np.linalg.solve(factor, slope), (problem.low - p, problem.high - p), tol=1e-14).x
        assert problem.step(p, slope, normal) == pytest.approx(by_other, abs=1e-6)
    problem = bounded([0.0, -1.0, -inf], [2.0, 1.0, inf])
    slope = np.array([1.0, 1.0, 1.0])
    assert problem.held(np.array([0.0, 0.5, 0.0]), slope).tolist() == [0]
    assert problem.held(np.array([2.0, 1.0, 0.0]), slope).tolist() == []
    assert problem.held(np.array([2.0, 1.0, 0.0]), -slope).tolist() == [0, 1]


def test_a_fit_does_not_stall_at_a_limit(spindle):
    """A share that would be negative is held at nothing, and all else fitted beside it: no worse than without that parameter.
    It had gone on beyond, where nothing changes, and steps that promised much there and gained nothing ended the fit."""
    conditions = [Condition(t, n * RPM) for t, n in ((20.0, 0.0), (60.0, 0.0), (60.0, 7200.0))]
    at = Condition(60.0, 7200.0 * RPM)
    rings = asked_at(effect("thermal_gradient"), at)

    def warmer(spindle, condition, values, by_region):
        return rings.temperatures(spindle, condition, values | {"scale": values["scale"] * (condition.temperature - 20) / 40}, by_region)

    hidden = {q.name: q.neutral for q in rings.parameters} | {"scale": 4.0}
    model = model_of(spindle, mode_campaign(spindle, conditions, 3, [(replace(rings, temperatures=warmer), hidden)]))
    own = with_own_laws(variants(effect("thermal_gradient")), spindle, conditions)[0]
    fixed = replace(own, shape=(), choices={q.name: q.neutral for q in own.shape})
    prior = steady(evidence(model, fit(model)).learned, (own,))
    with_shape, without = (fit(model, (m,), scan(model, (m,)), tempers=(1.0,), learned=prior) for m in (own, fixed))
    assert with_shape.cost < without.cost + 0.5
    assert all(0.0 <= v <= 1.0 for v in with_shape.shapes[0])
    shapes = with_shape.point[-2:]
    assert [h.number for h in with_shape.held] == [len(with_shape.point) - 2 + i for i in np.flatnonzero(shapes == 0.0)]
    assert len(with_shape.held) > 0
    assert not with_shape.information[[h.number for h in with_shape.held]].any()
    known = evidence(model, without)
    assert evidence(model, with_shape).ln == pytest.approx(known.ln, abs=4.0)


def test_the_size_of_what_is_hidden(spindle):
    """A fifth of the preload lost by temperature comes back within its error, test by test, and the law's neutral test says nothing."""
    lost = effect("preload_loss")
    values = {"loss": 0.2, "thermal_share": 0.0}
    errors = drawn(spindle, 2, 4)
    campaign = virtual_campaign(
        spindle, COLD_AND_WARM, 4, [(lost, values)], errors, responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 8.0)
    )
    model = model_of(spindle, campaign)
    m = variants(lost)[0]
    done = fit(model, (m,))
    assert done.chi2 / done.count == pytest.approx(1.0, abs=0.1)
    found = evidence(model, done)
    assert Problem(model, (m,)).length == len(done.point)
    apart, sd = found.sizes[0] - 0.2, np.sqrt(np.diag(found.size_covariance[0]))
    assert np.all(np.abs(apart) < 4 * sd)


def test_what_a_mechanism_moves(spindle):
    """Frequency and damping of every mode, against the poles with and without it; nothing where its
    law gives nothing, and nothing without one."""
    lost, values = effect("preload_loss"), {"loss": 0.02, "thermal_share": 1.0}
    made = virtual_campaign(spindle, COLD_AND_WARM, 4, [(lost, values)], drawn(spindle, 2, 4), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 16.0))
    model = model_of(spindle, made)
    thermal = next(m for m in variants(lost) if m.choices.get("thermal_share") == 1.0)
    done = fit(model, (thermal,))
    assert done.moved.shape == (2, 2, 2, model.reference.seen)
    assert np.array_equal(done.moved[0], model.by_condition)
    assert np.array_equal(fit(model).moved, done.moved[:1])
    by_effect = done.moved[1]
    assert np.abs(by_effect[0]).max() < 1e-2 * np.abs(by_effect[1]).max()
    acting = [(thermal.effect, thermal.values(float(done.sizes[0, 1]), []))]
    plain, with_it = (operating_point(spindle, COLD_AND_WARM[1], effects).modes_below(6000.0) for effects in ((), acting))
    change = np.array([np.log(b.frequency / a.frequency) for a, b in zip(plain, with_it, strict=True)])
    assert np.abs(change).max() > 1e-3
    assert by_effect[1, 0, : len(change)] == pytest.approx(change, abs=0.3 * np.abs(change).max())  # of modes at rest


def test_of_several_starts_the_best_is_taken(spindle):
    """A start that no step leads back from is passed over for one that is near, whatever their order."""
    model, done, _ = fitted(spindle, COLD_AND_WARM, 2, frequency=np.arange(400.0, 6000.1, 16.0))
    far = done.point.copy()
    far[: len(model.build)] += 5.0
    for starts in ((far, done.point), (done.point, far)):
        again = fit(model, start=starts, tempers=(1.0,))
        assert again.cost < done.cost + 0.2


@pytest.mark.parametrize(("compliance", "scanned"), [(0.2, False), (0.5, True)])
def test_peaks_that_move_by_many_widths_are_followed(spindle, compliance, scanned):
    """A mount that gives by a fifth more is found from the drawing, through all tempers, to the
    noise; by half as much again from a scan of sizes."""
    softer = effect("mount_compliance")
    values = {"compliance": compliance, "thermal_share": 0.0}
    errors = drawn(spindle, 2, 4)
    campaign = virtual_campaign(
        spindle, COLD_AND_WARM, 4, [(softer, values)], errors, responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 8.0)
    )
    model = model_of(spindle, campaign)
    m = next(v for v in variants(softer) if v.choices == {"thermal_share": 0.0})
    done = fit(model, (m,), scan(model, (m,)) if scanned else None)
    assert done.chi2 / done.count == pytest.approx(1.0, abs=0.1)
    assert evidence(model, done).sizes[0] == pytest.approx([compliance, compliance], abs=0.1 * compliance)


@pytest.mark.slow
def test_a_part_of_its_own_may_go_and_come(spindle):
    """A hub whose rim tilts by itself has two degrees of freedom more, and none where its web is
    stiff: fits from one side of that and from the other end at one cost. The derivatives of the one
    did not fit the matrices of the other, and such an effect was no candidate without a word."""
    model = model_of(spindle, virtual_campaign(spindle, COLD_AND_WARM, 0, responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 8.0)))
    rim = next(m for m in variants(effect("hub_flexibility")) if m.choices == {"seat_share": 0.0})
    problem = Problem(model, (rim,))
    found = [fit(model, (rim,), problem.start({0: size}), tempers=(1.0,)) for size in (3.0, 0.0)]
    assert found[0].cost == pytest.approx(found[1].cost, abs=4.0)  # both may stand still a little above the end of a valley as bent as this one
    dofs = [len(model.linear(0, f.nuisance, problem.effects_of(problem.start({0: size}))[0]).matrices.dofs) for f, size in zip(found, (3.0, 0.0), strict=True)]
    assert dofs[0] == dofs[1] + 2
