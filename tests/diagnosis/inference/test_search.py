"""What is tried besides what screening promises."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.virtual_campaign import drawn, effect, mode_campaign, model_of, virtual_campaign
from thermospindle.diagnosis.decision.explanations import explanations
from thermospindle.diagnosis.decision.verdict import decide
from thermospindle.diagnosis.forward.mechanism import asked_at, variants, with_own_laws
from thermospindle.diagnosis.forward.nuisance import BUILD, HAMMER_DRIFT, STIFFNESS
from thermospindle.diagnosis.inference import hypothesis, pairs
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, fit
from thermospindle.diagnosis.inference.freeform import free_forms, runs_against
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.inference.pairs import exchanged, joined, joined_early, without_one
from thermospindle.diagnosis.inference.prior import CHANGING, steady, undrifted
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.inference.screening import Screened, linearised, screen
from thermospindle.diagnosis.inference.search import Search, _other_ways, _without_what_does_nothing, search
from thermospindle.diagnosis.inference.singles import HIDING, Singles, cost_of, fit_singles, lasting
from thermospindle.model.built.tolerance import deviated
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.text.diagnosis.answer import told_values

TESTS = (Condition(20.0), Condition(40.0), Condition(60.0))


def test_what_stalls_on_its_way_is_settled_from_its_fit(spindle, monkeypatch):
    """Of the two starts the one that costs less may stall: campaign 413 of the blind study had an explanation fall by 780 in ln evidence there, and 404 one
    by 116,000. What ends below its promise is fitted from the other start too."""
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
    """What was learned to be nothing is taken from it, and all else left: campaign 691 of the blind study had an explanation that cost 32,000 start at 4e8."""
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
    """A fit that has not arrived holds derivatives of an earlier point: in campaign 640 of the blind study every mechanism promised 29,500 by that."""
    model = model_of(spindle, virtual_campaign(spindle, TESTS[:2], 5, [], drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 32.0)))
    about, mechanism = fit(model), variants(effect("preload_loss"))[0]
    learned = steady(evidence(model, about).learned)
    late = replace(about, gradient=about.gradient + 10.0, information=1.1 * about.information)
    fresh, old = (screen(model, at, 1.0, learned, [mechanism], 1, turned=False)[0].gain for at in (about, late))
    assert old == pytest.approx(fresh, abs=1e-6)
    at = np.append(about.point, np.zeros(2))
    one, other = (replace(about, mechanisms=(m,), point=at) for m in free_forms(spindle)[:2])  # at the very same parameters
    assert np.abs(linearised(model, one).information - linearised(model, other).information).max() > 1.0


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


def test_ways_that_the_data_do_not_tell_apart_are_told_as_such(spindle):
    """A fifth of the preload lost, in tests at 60 C alone: whether it was lost at assembly or comes with temperature makes no difference to them. Screening chose one, and
    practice campaign d was answered `common_share` 1 without an error where 0 was hidden."""
    lost, hot = effect("preload_loss"), (Condition(60.0), Condition(60.0, 7200 * RPM))
    model = model_of(spindle, mode_campaign(spindle, hot, 3, [(lost, {"loss": 0.2, "thermal_share": 1.0})]))
    every = variants(lost)
    assembly, warm = (next(m for m in every if m.choices.get("thermal_share") == end) for end in (0.0, 1.0))
    first = fit(model, [assembly])
    best, none = Hypothesis(first, evidence(model, first)), fit(model)
    tried = Singles([best], (), np.inf, steady(best.evidence.learned))
    found = _other_ways(model, [best], every, tried, 1)
    other = next(h for h in found if h.mechanisms == (warm,))
    assert other.evidence.ln == pytest.approx(best.evidence.ln, abs=0.5)
    assert other.evidence.sizes[0] == pytest.approx(best.evidence.sizes[0], abs=0.01)
    base = Hypothesis(none, evidence(model, none))
    hypotheses = tuple(sorted([base, best, *found], key=lambda h: -h.evidence.ln))
    looked = tuple(Screened(m, 0.0, first.point, 1.0) for m in every)
    (told,), _, _ = explanations(Search(model, base, hypotheses, looked), 1.0)
    assert len(told.ways) == 3
    assert all(share > 0.2 for _, share in told.ways)
    values = told_values(told, 0, spindle)
    assert values["thermal_share"]["sd"] > 0.3
    assert abs(values["loss"]["value"] - 0.2) < 2 * values["loss"]["sd"] < 0.2


def test_a_way_that_promised_next_to_nothing_is_not_followed(spindle):
    """Of a gain on one channel the eight others: on a machine-tool spindle half of a diagnosis went into these. Not where screening was of one effect, and two explain the data."""
    gain = effect("sensor_gain")
    model = model_of(spindle, mode_campaign(spindle, TESTS[:2], 3, [(gain, {"gain": 0.1, "channel": 0.0})]))
    first, second, third = variants(gain)[:3]
    own = fit(model, [first])
    best = Hypothesis(own, evidence(model, own))
    screened = tuple(Screened(m, promise, own.point, 1.0) for m, promise in ((first, 300.0), (second, 90.0), (third, 120.0)))
    tried = Singles([best], screened, np.inf, steady(best.evidence.learned))
    asked = []

    def followed(model, tasks, *rest, **kind):
        asked.extend(task.mechanisms[0] for task in tasks)
        return []

    for early, ways in (((), [third]), ((best,), [])):
        asked.clear()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("thermospindle.diagnosis.inference.search.fitted", followed)
            _other_ways(model, [best], [first, second, third], replace(tried, early=early), 1)
        assert asked == ways


@pytest.mark.parametrize(("promise", "kind", "weighed"), [(4.0, {}, True), (1.0, {}, False), (4.0, {"own_law": True}, False), (11.0, {"free": True}, False), (13.0, {"free": True}, True)])
def test_a_second_cause_that_hardly_shows_is_weighed(spindle, monkeypatch, promise, kind, weighed):
    """Beside one that leaves no misfit: blind campaigns 902 and 921 were answered the first of two for sure, for what promised less than 12 in ln evidence was not even asked. The more
    there is to choose, the more is asked."""
    model = model_of(spindle, mode_campaign(spindle, TESTS[:2], 3, []))
    bond, preload = (variants(effect(name))[0] for name in ("bond_softening", "preload_loss"))
    preload = replace(preload, **kind)
    none, own = fit(model), fit(model, [bond])
    base, lead = (Hypothesis(f, evidence(model, f)) for f in (none, own))
    lead = replace(lead, evidence=replace(lead.evidence, ln=base.evidence.ln + 50))
    start = np.concatenate([own.point, np.zeros(len(TESTS[:2]) + len(preload.shape))])
    monkeypatch.setattr(pairs, "screen", lambda model, about, temper, learned, mechanisms, workers: [Screened(m, promise, start, 1.0) for m in mechanisms])
    found = joined(model, base, [lead], [bond, preload], np.inf, steady(base.evidence.learned), 1)
    assert [h.names for h in found] == ([("bond_softening", "preload_loss")] if weighed else [])


@pytest.mark.slow
@pytest.mark.parametrize("tests", [TESTS, TESTS[::2]])
def test_two_constant_causes_of_which_neither_is_found_alone(spindle, tests):
    """A disk of 3 g on the hub and a mount 30 % softer, in every test: no single mechanism moves all peaks to where they are, and no fit arrives. Joined while
    errors are enlarged they do. Campaign 640 of the blind study was unexplained for that. Of two tests discrepancies may be all of it: asked as if they were not."""
    disk, mount = effect("added_disk"), effect("mount_compliance")
    hidden = [(e, {q.name: q.neutral for q in e.parameters} | own) for e, own in ((disk, {"mass": 3.0}), (mount, {"compliance": 0.3, "thermal_share": 0.0}))]
    few = len(tests) == 2
    campaign = virtual_campaign(spindle, tests, 5, hidden, drawn(spindle, len(tests), 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 24.0))
    model = model_of(spindle, campaign)
    first = fit(model)
    none = settled(model, Hypothesis(first, evidence(model, first)))
    mechanisms = [m for name in ("added_disk", "mount_compliance", *([] if few else ["window_damping"])) for m in variants(effect(name))]
    tried = fit_singles(model, none, mechanisms, lambda done: None, 1)
    before = max(h.evidence.ln for h in (none, *tried.singles))
    if few:
        learned = replace(none.evidence.learned, errors=1.5)
        none, tried = replace(none, evidence=replace(none.evidence, learned=learned)), replace(tried, singles=[])
    found = max(joined_early(model, none, tried, [], mechanisms, 1), key=lambda h: h.evidence.ln)
    assert set(found.names) == {"added_disk", "mount_compliance"}
    assert found.evidence.ln > before + 10
    sizes = dict(zip(found.names, found.evidence.sizes, strict=True))
    assert sizes["added_disk"] == pytest.approx(3.0, abs=0.3)
    assert sizes["mount_compliance"] == pytest.approx(0.3, abs=0.03)


def test_what_came_first_is_tried_without(spindle):
    """A bond that softens and a weaker preload, and a third mechanism that came before the preload: of the rest, which nobody fitted, each two are, and those that
    are known are not again."""
    names = ("bond_softening", "preload_loss", "modulus_softening")
    mechanisms = bond, preload, modulus = [variants(effect(name))[0] for name in names]
    hidden = [(m.effect, m.values(m.size.typical, [q.neutral for q in m.shape])) for m in (bond, preload)]
    model = model_of(spindle, mode_campaign(spindle, TESTS, 3, hidden))

    def fitted_with(of):
        found = fit(model, of, tempers=TEMPERS[-2:])
        return Hypothesis(found, evidence(model, found))

    found = [fitted_with(of) for of in ([bond], [bond, modulus], mechanisms)]
    prior = steady(found[0].evidence.learned)
    best = max(found, key=lambda h: h.evidence.ln)
    best = replace(found[2], evidence=replace(found[2].evidence, ln=best.evidence.ln + 1))  # as one that leads
    more = {h.names: h.evidence.ln for h in without_one(model, [*found[:2], best], np.inf, prior, 1)}
    assert set(more) == {("bond_softening", "preload_loss"), ("preload_loss", "modulus_softening")}
    assert more["bond_softening", "preload_loss"] > max(h.evidence.ln for h in found) - 1
    assert more["bond_softening", "preload_loss"] > more["preload_loss", "modulus_softening"] + 10


def test_two_effects_without_laws_are_exchanged_for_others(spindle):
    """A bond that softens and a weaker preload, and a pair that leads with neither's law: in the place of either every other effect is tried. Not where one has its law."""
    bond, preload, modulus = (variants(effect(name))[0] for name in ("bond_softening", "preload_loss", "modulus_softening"))
    hidden = [(m.effect, m.values(m.size.typical, [q.neutral for q in m.shape])) for m in (bond, preload)]
    model = model_of(spindle, mode_campaign(spindle, TESTS[:2], 3, hidden))
    own = fit(model, (bond, modulus), tempers=TEMPERS[-2:])
    pair = Hypothesis(own, evidence(model, own))
    lawless = replace(pair, evidence=replace(pair.evidence, learned=replace(pair.evidence.learned, departures=(1.0, 0.3))))
    screened = tuple(Screened(m, 1.0, np.zeros(0), 1.0) for m in (bond, preload, modulus))
    tried = Singles([], screened, np.inf, steady(pair.evidence.learned))
    more = {h.names: h.evidence.ln for h in exchanged(model, [lawless], tried, 1)}
    assert set(more) == {("bond_softening", "preload_loss"), ("modulus_softening", "preload_loss")}
    assert more["bond_softening", "preload_loss"] > max(pair.evidence.ln, more["modulus_softening", "preload_loss"])
    lawful = replace(pair, evidence=replace(pair.evidence, learned=replace(pair.evidence.learned, departures=(1.0, 0.1))))
    assert exchanged(model, [lawful], tried, 1) == []


def test_a_model_without_effects_that_stalled_is_fitted_from_one_whose_effect_does_nothing(spindle):
    """A campaign of another's, with an absorber, left it at a chi2 of 729 a number, and bearing damping of 0 +- 6 % at 1.2. An effect that does
    something says nothing of it."""
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


def test_a_joint_that_is_drawn_alike_all_around_is_not_built_so(spindle):
    """Another's campaign with nothing hidden: the flange 1 % stiffer against one tilt and 1.5 % less against the other, in every test. Told as an element that
    drifts, at 158 in ln evidence."""
    joints = tuple(
        replace(j, stiffness=(*j.stiffness[:3], 1.01 * j.stiffness[3], 0.985 * j.stiffness[4])) if j.name == "flange" else j for j in spindle.structure.joints
    )
    built = replace(spindle, structure=replace(spindle.structure, joints=joints))
    campaign = virtual_campaign(built, TESTS, 5, [], responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 32.0))
    form = next(m for m in free_forms(spindle) if m.name == "flange tilt y stiffness")
    found = search(model_of(spindle, campaign), variants(effect("support_anisotropy")), [form], workers=1)
    assert decide(found).word == "none"
    of = [i for i, p in enumerate(found.model.parameters) if p.name == "flange stiffer against tilt x than tilt y"]
    [share] = found.base.evidence.mean[of] * found.model.parameters[of[0]].sd
    assert share == pytest.approx(0.0125, abs=0.002)


def test_hammers_that_tell_the_force_otherwise_in_each_test_are_no_missing_effect(spindle):
    """Another's simulator, three campaigns with nothing hidden: the force of each of two hammers off by 0.4 % from test to test, and all three were *two effects*, a hammer beside its point
    and rings that are askew, by 1063 to 1740 in ln evidence."""
    campaign = virtual_campaign(spindle, TESTS, 5, [], drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 16.0))
    random = np.random.default_rng(8)
    tests = [
        replace(t, frf=replace(t.frf, value=t.frf.value * np.exp(0.004 * random.standard_normal(len(t.frf.reference_nodes)))[:, None])) for t in campaign.tests
    ]
    named = [m for name in ("hammer_position", "bearing_misalignment") for m in variants(effect(name))]
    found = search(model_of(spindle, replace(campaign, tests=tuple(tests))), named, [], workers=1)
    assert decide(found).word == "none"
    assert found.base.evidence.learned.sizes[HAMMER_DRIFT] > 0
    assert found.base.fit.chi2 / found.base.fit.count == pytest.approx(1.0, abs=0.1)


def test_a_thermometer_that_is_wrong_in_one_test_is_told(spindle):
    """Another's campaign, whose spindle was at 48 C where its file says 40: `expansion_mismatch` was named, 98.5 % probable, by sizes that are nothing in all other tests: to the quadratic its law held, for its shape, which a fit moves in proportion to what it changes, moved that
    test alone."""
    at = (20.0, 40.0, 50.0, 60.0)
    true = mode_campaign(spindle, [Condition(48.0 if t == 40.0 else t) for t in at], 3, [])
    told = replace(true, tests=tuple(replace(test, temperature=t) for test, t in zip(true.tests, at, strict=True)))
    model = model_of(spindle, told)
    found = {}
    for name in ("thermometer_error", "expansion_mismatch"):
        own = fit(model, variants(effect(name))[:1])
        found[name] = settled(model, Hypothesis(own, evidence(model, own)))
    thermometer = found["thermometer_error"].evidence
    assert thermometer.ln > found["expansion_mismatch"].evidence.ln + 1
    assert all(h.evidence.by_departing > 100 for h in found.values())  # no law of either holds
    [offset] = thermometer.sizes
    errors = np.sqrt(np.diag(thermometer.size_covariance[0]))
    assert (np.abs(offset - [0, 8, 0, 0]) < 4 * errors).all()
    assert offset[1] - offset[[0, 2, 3]].mean() == pytest.approx(8.0, abs=1.0)


@pytest.mark.slow
def test_a_drawing_that_is_off_is_no_missing_effect(spindle):
    """Three stiffnesses a tenth off and the preload by an eighth, four to eight times their tolerances, and nothing hidden."""
    off = {"mount axial stiffness": 0.125, "flange lateral stiffness": -0.107, "flange tilt stiffness": 0.094, "preload": -0.12}
    conditions = [Condition(t, n * RPM) for t, n in ((20.0, 0.0), (60.0, 0.0), (60.0, 7200.0))]
    model = model_of(spindle, mode_campaign(deviated(spindle, off), conditions, 3, []))
    named = [m for name in ("clearance_opening", "mount_compliance") for m in variants(effect(name))]
    found = search(model, named, [], workers=1)
    v = decide(found)
    assert v.word == "none"
    assert found.base.evidence.learned.sizes[BUILD] > 1.0
    assert "The drawing is off by more than its tolerances" in v.reason


def test_an_effect_is_found_where_its_law_gives_nothing(spindle):
    """The turning part is warmer by a law of temperature, at rest too, where no friction heats it. Its formula's law explains little of that; a law of the
    data's own all, and reads it off: nothing at 20 C, then in proportion. Half as much is what coefficients of expansion 4 % off do, and told as that."""
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
    assert "with a law of the data's own" in v.reason


def test_a_law_that_runs_against_its_own_is_anothers(spindle):
    """A flange that stiffened by 0.2 % where it was warm or turned was named a fit that loosens with warmth: of sizes that it could have, less and less of them, for a tolerance of the
    flange made up for what all tests have in common."""
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
