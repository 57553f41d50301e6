"""Two causes at once: which are asked together, and what came first without the second."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.virtual_campaign import drawn, effect, mode_campaign, model_of, neutral_but, virtual_campaign
from thermospindle.diagnosis.inference import pairs
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.inference.pairs import exchanged, joined, joined_early, rivals_beside, without_one
from thermospindle.diagnosis.inference.prior import steady
from thermospindle.diagnosis.inference.screening import Screened
from thermospindle.diagnosis.inference.singles import Singles, fit_singles
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.machine import Condition

TESTS = (Condition(20.0), Condition(40.0), Condition(60.0))


@pytest.mark.parametrize(("promise", "kind", "weighed"), [(4.0, {}, True), (1.0, {}, False), (4.0, {"own_law": True}, False), (11.0, {"free": True}, False), (13.0, {"free": True}, True)])
def test_a_second_cause_that_hardly_shows_is_weighed(spindle, monkeypatch, promise, kind, weighed):
    """Beside one that leaves no misfit: blind campaigns 902 and 921 were answered the first of two for sure, for
    what promised less than 12 in ln evidence was not even asked. The more there is to choose, the more is asked."""
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


def of_a_disk_and_a_mount(spindle, tests):
    """A disk of 3 g on the hub and a mount 30 % softer, in every test: no single mechanism moves all peaks to where they are."""
    both = neutral_but(("added_disk", {"mass": 3.0}), ("mount_compliance", {"compliance": 0.3, "thermal_share": 0.0}))
    return virtual_campaign(spindle, tests, 5, both, drawn(spindle, len(tests), 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 24.0))


@pytest.mark.slow
def test_two_constant_causes_are_joined_while_errors_are_enlarged(spindle):
    """Where nothing that was tried explains the data. Campaign 640 of the blind study was unexplained for that."""
    model = model_of(spindle, of_a_disk_and_a_mount(spindle, TESTS))
    first = fit(model)
    none = settled(model, Hypothesis(first, evidence(model, first)))
    mechanisms = [m for name in ("added_disk", "mount_compliance") for m in variants(effect(name))]
    strained = replace(none, evidence=replace(none.evidence, learned=replace(none.evidence.learned, errors=1.5)))  # as where bodies' masses are as drawn
    tried = fit_singles(model, strained, mechanisms, lambda done: None, 1)
    before = max(h.evidence.ln for h in (none, *tried.singles))
    found = max(joined_early(model, strained, replace(tried, singles=[]), [], mechanisms, 1), key=lambda h: h.evidence.ln)
    assert set(found.names) == {"added_disk", "mount_compliance"}
    assert found.evidence.ln > before + 10


@pytest.mark.slow
@pytest.mark.parametrize("tests", [TESTS, TESTS[::2]])
def test_two_constant_causes_are_both_named(spindle, tests):
    """By the whole diagnosis. Of three tests a light resonance at 15 kHz, far beyond the band, stood in for the disk's mass, and
    a mass at the sensor was named; of two the true pair was never fitted, and a mass at the sensor, of no size, named beside it."""
    found = diagnose(spindle, of_a_disk_and_a_mount(spindle, tests))
    assert (found.verdict.word, set(found.verdict.effects)) == ("two effects", {"added_disk", "mount_compliance"})
    told = found.verdict.candidates[0].told
    sizes = dict(zip(told.names, told.evidence.sizes, strict=True))
    assert sizes["added_disk"] == pytest.approx(3.0, abs=0.5)
    assert sizes["mount_compliance"] == pytest.approx(0.3, abs=0.03)


@pytest.mark.slow
def test_what_came_first_is_tried_without(spindle):
    """A bond that softens and a weaker preload, and a third mechanism that came before the preload:
    of the rest, which nobody fitted, each two are, and those that are known are not again."""
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


@pytest.mark.parametrize(("size", "known", "again"), [(0.0, -100.0, True), (0.0, 0.0, False), (0.1, -100.0, False)])
def test_what_fell_behind_without_one_that_does_nothing_is_fitted_again(spindle, size, known, again):
    """A bond that softens, and a modulus that does nothing beside it; with the bond alone 100
    behind in ln evidence that fit had stalled, not so where the modulus does something."""
    bond, modulus = (variants(effect(name))[0] for name in ("bond_softening", "modulus_softening"))
    model = model_of(spindle, mode_campaign(spindle, TESTS[:2], 3, [(bond.effect, bond.values(bond.size.typical, [q.neutral for q in bond.shape]))]))
    alone, both = (Hypothesis(f, evidence(model, f)) for f in (fit(model, of, tempers=TEMPERS[-2:]) for of in ([bond], [bond, modulus])))
    sizes = np.array([both.evidence.sizes[0], np.full(2, modulus.size.neutral + size)])
    covariance = np.array([1e-6 * np.eye(2)] * 2)
    both = replace(both, evidence=replace(both.evidence, ln=0.0, sizes=sizes, size_covariance=covariance, as_shaped=covariance))
    assert both.idle == (False, size == 0.0)
    alone = replace(alone, evidence=replace(alone.evidence, ln=known))
    other = replace(alone, fit=replace(alone.fit, mechanisms=(modulus,)))
    found = without_one(model, [alone, other, both], np.inf, steady(both.evidence.learned), 1)
    assert [h.names for h in found] == ([("bond_softening",)] if again else [])


def test_two_effects_without_laws_are_exchanged_for_others(spindle):
    """A bond that softens and a weaker preload, and a pair that leads with neither's law: in the
    place of either every other effect is tried. Not where one has its law."""
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


@pytest.mark.parametrize(("behind", "tried_too", "asked"), [(17.0, False, True), (45.0, False, False), (17.0, True, False)])
def test_a_rival_of_the_first_gets_the_second_too(spindle, behind, tried_too, asked):
    """A bond that softens and a weaker preload, of which a modulus that softens leads with the preload, by 40 over itself alone: the bond,
    which alone is 17 behind it, is fitted with the preload. Not where it is farther behind than the preload gains, or has been."""
    bond, preload, modulus = (variants(effect(name))[0] for name in ("bond_softening", "preload_loss", "modulus_softening"))
    hidden = [(m.effect, m.values(m.size.typical, [q.neutral for q in m.shape])) for m in (bond, preload)]
    model = model_of(spindle, mode_campaign(spindle, TESTS[:2], 3, hidden))

    def told(mechanisms, ln):
        found = fit(model, mechanisms, tempers=TEMPERS[-2:])
        return Hypothesis(found, replace(evidence(model, found), ln=ln))

    pair, first, rival = told((modulus, preload), 0.0), told((modulus,), -40.0), told((bond,), -40.0 - behind)
    known = [told((bond, preload), 1.0 - 40.0)] if tried_too else []
    tried = Singles([first, rival], (), np.inf, steady(pair.evidence.learned))
    more = rivals_beside(model, [pair, first, rival, *known], tried, 1)
    assert [h.names for h in more] == ([("bond_softening", "preload_loss")] if asked else [])
    if asked:
        assert more[0].evidence.ln > evidence(model, pair.fit).ln
        assert more[0].fit.sizes[1] != pytest.approx(preload.size.neutral)
