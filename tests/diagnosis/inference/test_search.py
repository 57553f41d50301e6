"""What is tried besides what screening promises."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from tests.hand_made_search import mechanism
from tests.virtual_campaign import drawn, effect, mode_campaign, model_of, virtual_campaign
from thermospindle.diagnosis.decision.verdict import decide
from thermospindle.diagnosis.inference import hypothesis, singles
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, fit
from thermospindle.diagnosis.inference.freeform import drifting, free_forms, runs_against
from thermospindle.diagnosis.inference.hypothesis import EARLY, Hypothesis, Task, settled
from thermospindle.diagnosis.inference.prior import CHANGING, Learned, steady, undrifted
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.inference.screening import Screened, linearised, screen
from thermospindle.diagnosis.inference.search import _from_the_drawing, _without_what_does_nothing, search
from thermospindle.diagnosis.inference.singles import FAR, HIDING, cost_of, fitted_in_steps, lasting
from thermospindle.diagnosis.parameters.mechanism import asked_at, variants, with_own_laws
from thermospindle.diagnosis.parameters.nuisance import STIFFNESS
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.effects.effect import Parameter

TESTS = (Condition(20.0), Condition(40.0), Condition(60.0))


def test_what_stalls_on_its_way_is_settled_from_its_fit(spindle, monkeypatch):
    """Of the two starts the one that costs less may stall: campaign 413 of the blind study had an explanation fall by
    780 in ln evidence there, and 404 one by 116,000. What ends below its promise is fitted from the other start too."""
    model = model_of(spindle, virtual_campaign(spindle, TESTS[:2], 5, [], drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 32.0)))
    m = variants(effect("preload_loss"))[0]
    first = fit(model, [m])
    h = Hypothesis(first, evidence(model, first))
    far = Problem(model, [m], h.evidence.learned, first.moved).within_prior(first.point)
    asked = []

    def stalls(model, mechanisms, start, **kind):
        found = fit(model, mechanisms, start, **kind)
        asked.append(start)
        from_fit = len(asked) > 1 or np.array_equal(start, far)
        return found if from_fit else replace(found, chi2=found.chi2 + 1e4, cost=found.cost + 1e4)

    monkeypatch.setattr(hypothesis, "fit", stalls)
    assert settled(model, h).evidence.ln > h.evidence.ln - 5
    assert not np.array_equal(asked[0], far)  # from its own answer, which costs less, and then from the fit
    assert np.array_equal(asked[1], far)


def test_a_fit_with_wide_priors_does_not_start_one_with_narrow_priors_from_a_wall(spindle):
    """What was learned to be nothing is taken from it, and all else left: campaign 691 of the blind
    study had an explanation that cost 32,000 start at 4e8."""
    model = model_of(spindle, virtual_campaign(spindle, TESTS[:2], 5, [], drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 32.0)))
    first = fit(model)
    learned = undrifted(steady(evidence(model, first).learned))
    drifting = np.array([q.kind in CHANGING for q in model.parameters])
    p = first.point + 0.5 * drifting
    problem = Problem(model, (), learned)
    start = problem.within_prior(p)
    assert np.abs(start[drifting]).max() < 1e-3
    assert start[~drifting] == pytest.approx(p[~drifting], rel=2e-4)
    assert problem.cost(start, 1.0) < 1e-3 * problem.cost(p, 1.0)


def test_a_promise_is_over_the_model_without_it_at_the_same_place(spindle):
    """A fit that has not arrived holds derivatives of an earlier point: in campaign 640 of the
    blind study every mechanism promised 29,500 by that."""
    model = model_of(spindle, virtual_campaign(spindle, TESTS[:2], 5, [], drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 32.0)))
    about, mechanism = fit(model), variants(effect("preload_loss"))[0]
    learned = steady(evidence(model, about).learned)
    late = replace(about, gradient=about.gradient + 10.0, information=1.1 * about.information)
    fresh, old = (screen(model, at, 1.0, learned, [mechanism], 1)[0].gain for at in (about, late))
    assert old == pytest.approx(fresh, abs=1e-6)
    at = np.append(about.point, np.zeros(2))
    one, other = (replace(about, mechanisms=(m,), point=at) for m in free_forms(spindle)[:2])  # at the very same parameters
    assert np.abs(linearised(model, one).information - linearised(model, other).information).max() > 1.0


def test_what_a_mechanism_promises_has_nothing_to_do_with_what_was_screened_before(spindle):
    """Ways in which one effect may act are screened by one process on one core, and by several on more."""
    ways = variants(effect("thermal_gradient"))
    hidden = [(ways[0].effect, ways[0].values(3.0, [q.neutral for q in ways[0].shape]))]
    made = mode_campaign(spindle, (*TESTS[:2], Condition(60.0, 7200 * RPM)), 3, hidden)

    def promised(*of):
        model = model_of(spindle, made)
        about = fit(model)
        return [s.gain for s in screen(model, about, 1.0, steady(evidence(model, about).learned), of, 1)[: len(of)]]

    assert len(ways) == 5
    assert promised(*ways) == pytest.approx(promised(*ways[::-1])[::-1], rel=1e-9)


def test_what_hardly_shows_while_errors_are_enlarged_is_found_where_a_misfit_is_small(spindle):
    """A delay of half a microsecond in one channel, by hundreds in ln evidence, which thirty times as large errors hide. Blind campaign
    2448 was answered *none*: beside a misfit, told by errors some per cent larger, nothing was asked at the errors as they are."""
    delay = effect("channel_delay")
    lines, late = np.arange(400.0, 6000.1, 24.0), np.array([0.0, 0.5e-6, 0.0])
    made = virtual_campaign(spindle, TESTS[:2], 5, [], drawn(spindle, 2, 5), responses=(1, 3, 6), frequency=lines)
    turned = np.exp(-2j * np.pi * lines * late[:, None])[:, None]
    model = model_of(spindle, replace(made, tests=tuple(replace(t, frf=replace(t.frf, value=t.frf.value * turned)) for t in made.tests)))
    first = fit(model)
    none = Hypothesis(first, evidence(model, first))
    beside = replace(none, evidence=replace(none.evidence, learned=replace(none.evidence.learned, errors=1.06)))
    others = [m for name in ("hub_flexibility", "mount_compliance", "ball_inertia") for m in variants(effect(name))]
    tried = singles.fit_singles(model, beside, [*others, *variants(delay)], lambda done: None, 1)
    assert "channel_delay" not in [s.mechanism.name for s in singles.promising(tried.screened, "law") if s.gain > -2]  # while errors are enlarged
    best = max(tried.singles, key=lambda h: h.evidence.ln)
    assert (best.names, best.mechanisms[0].choices["channel"]) == (("channel_delay",), 2.0)
    assert best.evidence.ln > none.evidence.ln + 100


def test_what_moves_peaks_far_is_found_by_a_scan_where_screening_overlooks_it(spindle):
    """A flange that softens by 12 %, of which what screening promises is but a small part. In blind campaign
    2316 it was not among the first ten, and another element was told; of what cannot be seen nothing is fitted."""
    softens = drifting(
        "flange stiffness", name="softens", title="", equation="", law=lambda temperature, speed, values: values["change"] * (temperature - 20) / 40,
        parameters=(Parameter("change", "%", 0.0, 5.0, 5.0, (-100.0, 100.0), "", ""),), source="",
    )  # fmt: skip
    made = virtual_campaign(spindle, TESTS[::2], 5, [(softens, {"change": -12.0})], drawn(spindle, 2, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 24.0))
    model = model_of(spindle, made)
    expected = Learned({}, 1.0)
    about = fit(model, tempers=TEMPERS[: EARLY + 1], learned=expected)
    assert singles.far_off(model, about)
    free = [m for m in free_forms(spindle, TESTS[0]) if "stiffness" in m.name]
    promised = [Screened(m, 0.0, about.point, 1.0) for m in free] + [Screened(m, 0.0, about.point, 0.0) for m in variants(effect("ball_waviness"))]
    found = singles._from_scan(model, about, promised, {("flange lateral stiffness", "free")}, np.inf, expected, 1)
    assert found[0].mechanism.name == "flange stiffness"
    assert {s.mechanism.name for s in found} <= {m.name for m in free} - {"flange lateral stiffness"}


@pytest.mark.slow
def test_a_mass_that_strained_tolerances_hide_is_found(spindle):
    """Two grams within the hub, the same in every test: strained tolerances take all of it, and a scan of sizes as drawn finds it again."""
    disk = effect("added_disk")
    hidden = [(disk, {"mass": 2.0, "outer_radius": 14.0, "height": -11.0})]
    made = virtual_campaign(spindle, TESTS, 5, hidden, drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 16.0))
    model = model_of(spindle, made)
    first = fit(model)
    none = settled(model, Hypothesis(first, evidence(model, first)))
    assert none.evidence.learned.errors == 1.0
    assert none.evidence.learned.sizes[STIFFNESS] < HIDING
    expected = steady(none.evidence.learned)
    mechanisms = [m for name in ("added_disk", "mount_compliance") for m in variants(effect(name))]
    found = lasting(model, none, mechanisms, cost_of(model, none, expected), expected, 1)
    assert [h.names for h in found] == [("added_disk",)]
    assert found[0].evidence.ln > none.evidence.ln + 12
    assert found[0].evidence.sizes[0] == pytest.approx(2.0, abs=1.0)
    assert found[0].evidence.learned.departures == (0.0,)


def test_a_shape_in_a_valley_of_its_own_is_fitted_from_the_drawing(spindle):
    """A disk whose radius was fitted beside tolerances that were dragged away with it."""
    disk = variants(effect("added_disk"))[0]
    model = model_of(spindle, mode_campaign(spindle, TESTS[:2], 3, [(disk.effect, disk.values(3.0, [q.neutral for q in disk.shape]))]))
    found = fit(model, [disk])
    h = Hypothesis(found, evidence(model, found))
    assert _from_the_drawing(model, h) is h
    away = np.concatenate([found.nuisance + 3.0, found.point[len(found.nuisance) :]])
    stalled = Hypothesis(replace(found, point=away, cost=found.cost + 80.0), replace(h.evidence, ln=h.evidence.ln - 40.0))
    assert _from_the_drawing(model, stalled).evidence.ln == pytest.approx(h.evidence.ln, abs=1.0)


@pytest.mark.parametrize(("left", "alive"), [(100.0, {"a"}), (300.0, {"a", "b"})])
def test_what_promised_most_at_first_is_followed_until_one_explains_the_data(monkeypatch, left, alive):
    """`b` promised most and is far behind `a`, which leaves `left` of 100 numbers: where that is noise, nothing is missing beside it."""
    asked = []

    def fitted(model, tasks, tempers, *of, **more):
        asked.append({t.mechanisms[0].name for t in tasks})
        gains = {"a": 0.0, "b": -FAR - 1}
        return [
            SimpleNamespace(names=(m.name,), mechanisms=(m,), evidence=SimpleNamespace(ln=gains[m.name]), fit=SimpleNamespace(chi2=left, cost=left, point=np.zeros(2)))
            for m in (t.mechanisms[0] for t in tasks)
        ]

    monkeypatch.setattr(singles, "fitted", fitted)
    tasks = [Task((mechanism(name),), (np.zeros(2),), -np.inf) for name in "ab"]
    about = SimpleNamespace(temper=TEMPERS[EARLY], chi2=0.0, count=100)
    fitted_in_steps(SimpleNamespace(tests=(SimpleNamespace(count=100),)), tasks, {"b"}, about, np.inf, Learned({}, 1.0), 1)
    assert asked == [{"a", "b"}, alive, alive]


@pytest.mark.parametrize(("behind", "pays", "kept"), [(5.0, 5.0, True), (13.0, 12.0, True), (13.0, 0.0, False)])
def test_what_an_effect_pays_for_its_sizes_and_shapes_does_not_keep_it_back(monkeypatch, behind, pays, kept):
    """Blind campaign 3454: a flange that softened by its own law was 13.5 in ln evidence behind the free form that it is, 12 of
    them for sizes and shapes, while errors were enlarged, and not followed: the answer was something unknown."""
    form, effect = mechanism("form"), mechanism("effect")

    def fitted(model, tasks, tempers, *of, **more):
        left = {"form": (0.0, 0.0), "effect": (-behind, pays - behind)}
        return [
            SimpleNamespace(mechanisms=(m,), evidence=SimpleNamespace(ln=left[m.name][0], as_fitted=left[m.name][1]), fit=SimpleNamespace(point=np.zeros(2)))
            for m in (t.mechanisms[0] for t in tasks)
        ]

    monkeypatch.setattr(singles, "fitted", fitted)
    beside = SimpleNamespace(mechanisms=(form,), fit=SimpleNamespace(point=np.zeros(2)))
    found = singles._keeping_up(None, [Task((effect,), (np.zeros(2),), -np.inf)], beside, np.inf, Learned({}, 1.0), 1)
    assert [t.mechanisms[0].name for t in found] == ["effect"] * kept


def test_shapes_are_known_in_their_own_units(spindle):
    """What the data do not tell of an effect that does nothing is as well known as before: minutes as minutes, a share as a share."""
    model = model_of(spindle, mode_campaign(spindle, TESTS, 3))
    for name in ("soak_lag", "flange_fit_loosening", "magnetic_pull"):
        m = max(variants(effect(name)), key=lambda v: len(v.shape))
        own = fit(model, [m])
        h = Hypothesis(own, evidence(model, own))
        [errors] = h.shape_errors
        held = {n.number for n in own.held}
        free = [k for k in range(len(m.shape)) if len(own.point) - len(m.shape) + k not in held]
        assert free
        for k, q in enumerate(m.shape):
            assert errors[k] == (pytest.approx(q.prior_sd, rel=0.3) if k in free else 0.0), (name, q.name)


def test_a_model_without_effects_that_stalled_is_fitted_from_one_whose_effect_does_nothing(spindle):
    """A campaign of another's, with an absorber, left it at a chi2 of 729 a number, and bearing
    damping of 0 +- 6 % at 1.2. An effect that does something says nothing of it."""
    m = variants(effect("preload_loss"))[0]
    for hidden in ([], [(m.effect, m.values(m.size.typical, [q.neutral for q in m.shape]))]):
        model = model_of(spindle, mode_campaign(spindle, TESTS, 3, hidden))
        own, first = fit(model, [m]), fit(model)
        h, none = Hypothesis(own, evidence(model, own)), Hypothesis(first, evidence(model, first))
        away = replace(none.evidence, ln=h.evidence.ln - 1000, learned=replace(none.evidence.learned, errors=30.0))
        stalled = Hypothesis(replace(first, point=first.point + 3.0), away)
        found = _without_what_does_nothing(model, stalled, [h])
        if hidden:
            assert found is stalled
        else:
            assert found.names == ()
            assert found.evidence.ln == pytest.approx(none.evidence.ln, abs=0.5)
            assert _without_what_does_nothing(model, none, [h]) is none


@pytest.mark.slow
def test_an_effect_is_found_where_its_law_gives_nothing(spindle):
    """The turning part is warmer by a law of temperature, at rest too, where no friction heats it. Its
    formula's law explains little of that; a law of the data's own all, and reads it off: nothing at 20
    C, then in proportion. Half as much is what coefficients of expansion 4 % off do, and told as that."""
    conditions = [Condition(t, n * RPM) for t, n in ((20.0, 0.0), (40.0, 0.0), (60.0, 0.0), (60.0, 7200.0))]
    rings = asked_at(effect("thermal_gradient"), Condition(60.0, 7200.0 * RPM))
    neutral = {q.name: q.neutral for q in rings.parameters}

    def warmer(spindle, condition, values, by_region):
        return rings.temperatures(spindle, condition, neutral | {"scale": values["scale"] * (condition.temperature - 20) / 40}, by_region)

    model = model_of(spindle, mode_campaign(spindle, conditions, 3, [(replace(rings, temperatures=warmer), {"scale": 8.0})]))
    found = search(model, variants(effect("thermal_gradient")), [f for f in free_forms(spindle) if f.name == "preload"], workers=1)
    by_law = max((h.evidence.ln for h in found.hypotheses if h.names == ("thermal_gradient",) and not h.mechanisms[0].own_law), default=-np.inf)
    v = decide(found)
    assert (v.word, v.effects) == ("identified", ("thermal_gradient",))
    assert v.candidates[0].own_laws == ("thermal_gradient",)
    assert v.accepted.evidence.ln > by_law + 10
    sizes, covariance = v.accepted.evidence.sizes[0], v.accepted.evidence.size_covariance[0]
    assert np.all(np.abs(sizes - [0.0, 4.0, 8.0, 8.0]) < 2 * np.sqrt(np.diag(covariance)))  # bearings that differ may be a constant part of it
    steps = sizes[1:] - sizes[0]
    above = np.hstack([-np.ones((3, 1)), np.eye(3)])  # what takes sizes to steps
    assert np.all(np.abs(steps - [4.0, 8.0, 8.0]) < 2 * np.sqrt(np.diag(above @ covariance @ above.T)))  # thermal motions may differ by a part of it
    assert steps / steps[-1] == pytest.approx([0.5, 1.0, 1.0], abs=0.02)  # but not its course
    assert "with a law that is fitted freely" in v.reason


def test_a_law_that_runs_against_its_own_is_anothers(spindle):
    """A flange that stiffened by 0.2 % where it was warm or turned was named a fit that loosens with warmth: of sizes
    that it could have, less and less of them, for a tolerance of the flange made up for what all tests have in common."""
    conditions = (Condition(20.0), Condition(40.0), Condition(60.0))
    model = model_of(spindle, mode_campaign(spindle, conditions, 1, errors=drawn(spindle, 3, 1)))
    law = variants(effect("flange_fit_loosening"))[0]
    (own,) = with_own_laws([law], spindle, conditions)
    asked = partial(runs_against, model, np.zeros(len(model.parameters)), law, own)
    falls, common, each = np.array([0.006, 0.004, 0.002]), 1e-4 * np.ones((3, 3)), np.eye(3)
    assert asked(falls, common + 1e-8 * each)
    assert not asked(falls[::-1], common + 1e-8 * each)  # as its law has it
    assert not asked(np.array([0.004, 0.006, 0.002]), common + 1e-8 * each)  # a law of its own
    assert not asked(falls, 1e-8 * each)  # it is there, whatever its law
    assert not asked(falls, 1e-4 * each)  # nobody knows
