"""The fit without effects where a drawing is far off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.forward.made import SCENES
from tests.virtual_campaign import drawn, effect, model_of, neutral_but, virtual_campaign
from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.inference.base.afar import envelope
from thermospindle.diagnosis.inference.base.drawn import without_effects
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.resonance import with_resonance
from thermospindle.diagnosis.inference.search import search
from thermospindle.diagnosis.inference.singles import fit_singles
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.parameters.nuisance import BUILD
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.types import ComplexArray
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Test

TESTS = (Condition(20.0), Condition(40.0), Condition(60.0))


def of_a_softer_mount(spindle, tests, seed, softer, step, *beside):
    """A model of tests of a mount that is softer than drawn, so much that from the drawing its peaks have no slope to follow."""
    hidden = neutral_but(*beside, ("mount_compliance", {"compliance": softer, "thermal_share": 0.0}))
    return model_of(spindle, virtual_campaign(spindle, tests, seed, hidden, drawn(spindle, len(tests), seed), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, step)))


@pytest.mark.slow
def test_effects_do_not_stall_where_a_drawing_is_far_off(spindle):
    """One that does little arrives where the model without effects has: 60 times the errors were left beside it."""
    tests = (Condition(20.0), Condition(40.0, 7200.0 * RPM))
    model = of_a_softer_mount(spindle, tests, 7, 0.5, 24.0, ("thermal_gradient", {"scale": 4.0}))
    found = fit_singles(model, without_effects(model, 1), variants(effect("window_damping"))[:1], lambda done: None, 1).singles
    assert [h.names for h in found] == [("window_damping",)]
    assert found[0].fit.chi2 < 1.3 * found[0].fit.count


def test_a_mount_far_from_the_drawing_is_no_light_resonance(spindle):
    """90 times the errors were left, and a light resonance stood in for what is one build tolerance."""
    model = of_a_softer_mount(spindle, TESTS[:1], 112, 0.46, 48.0)
    none = without_effects(model, 1)
    assert none.fit.chi2 < 1.3 * none.fit.count
    assert with_resonance(model, none, 1) is None
    (stiffness,) = [v for q, v in zip(model.parameters, none.evidence.mean, strict=True) if q.name == "mount axial stiffness"]
    assert stiffness < -5.0


@pytest.mark.slow
def test_where_no_other_start_can_be_built_the_first_fit_stands(spindle, monkeypatch):
    """Of five_bearing, every tolerance 12 times as far off as it may be, one start ended in a LinAlgError."""
    model = of_a_softer_mount(spindle, TESTS[:1], 112, 0.46, 48.0)
    asked: list[object] = []

    def fails(model, *args, **kinds):
        if args or kinds.keys() - {"done"}:
            asked.append(kinds)
            raise np.linalg.LinAlgError("SVD did not converge")
        return fit(model)

    for module in ("afar", "drawn"):
        monkeypatch.setattr(f"thermospindle.diagnosis.inference.base.{module}.fit", fails)
    assert without_effects(model, 1).fit.chi2 > 1000 * model.tests[0].count
    assert len(asked) == 9  # two from one tolerance, four from envelopes, two from four, and where wider tolerances lead


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "factor"), [(303, 10.0), (402, 12.0)])
def test_a_drawing_that_is_far_off_everywhere_is_fitted(spindle, seed, factor):
    """Every tolerance is `factor` times as far off as it may be: 50 times the errors were left."""
    far = drawn(spindle, 1, seed)
    far = replace(far, build=np.clip(factor * far.build, -0.6, 1.5))
    model = model_of(spindle, virtual_campaign(spindle, TESTS[:1], seed, [], far, responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 24.0)))
    none = without_effects(model, 1)
    assert none.fit.chi2 < 1.3 * none.fit.count


@pytest.mark.slow
@pytest.mark.parametrize("softer", [-0.41, -0.53])
def test_joints_that_are_far_off_together_are_fitted(softer):
    """No one of three brings peaks nearer: 50 to 100 times the errors were left, and a light resonance of 1530 Hz was taken in."""
    symmetric = load(SCENES["symmetric"])
    frequency = np.arange(400.0, 6000.1, 24.0)
    far = drawn(symmetric, len(TESTS), 1)
    names = [q.name for q in model_of(symmetric, virtual_campaign(symmetric, TESTS, 1, [], far, frequency=frequency)).parameters][: len(far.build)]
    far = replace(far, build=np.where([name.endswith("axial stiffness") for name in names], softer, far.build))
    model = model_of(symmetric, virtual_campaign(symmetric, TESTS, 1, [], far, frequency=frequency))
    assert fit(model).chi2 > 1000 * model.tests[0].count
    none = without_effects(model)
    assert none.fit.chi2 < 1.1 * none.fit.count
    assert with_resonance(model, none) is None


def test_envelopes_are_the_farther_apart_the_farther_peaks_are():
    """Where differences of FRFs themselves no longer grow."""
    frequency = np.arange(400.0, 6000.1, 24.0)

    def peak(at: float) -> ComplexArray:
        return np.asarray(1 / (at**2 - frequency**2 + 0.02j * at * frequency))[None, None]

    data = LineData(Test("T20", 20.0, 0.0), Condition(20.0), frequency, peak(2000.0), np.full((1, 1, len(frequency)), 1e-12), "receptance", "", len(frequency))
    seen = envelope(data, 0.016)
    apart = [np.linalg.norm(seen(peak(at)) - seen(data.value)) for at in (2000.0, 2200.0, 2600.0, 3200.0, 4000.0)]
    plain = [np.linalg.norm(peak(at) - data.value) for at in (2200.0, 2600.0, 3200.0, 4000.0)]
    assert apart[0] == 0.0
    assert np.all(np.diff(apart) > 0.1 * apart[-1])
    assert np.all(np.diff(plain) < 0.0)


@pytest.mark.slow
def test_effects_are_sought_beside_a_drawing_that_is_off():
    """With tolerances as stated three softer joints left grease that damps 575 in ln evidence behind wider tolerances alone, though
    it does nothing; beside wider ones a bond that softens by itself leads, and what does nothing is as good as nothing."""
    symmetric = load(SCENES["symmetric"])
    frequency, tests = np.arange(400.0, 6000.1, 24.0), (*TESTS, Condition(50.0))
    far = drawn(symmetric, len(tests), 1)
    hidden = neutral_but(("bond_softening", {"hot_compliance": 1.0}))
    names = [q.name for q in model_of(symmetric, virtual_campaign(symmetric, tests, 1, [], far, frequency=frequency)).parameters][: len(far.build)]
    far = replace(far, build=np.where([name.endswith("axial stiffness") for name in names], -0.41, far.build))
    model = model_of(symmetric, virtual_campaign(symmetric, tests, 1, hidden, far, frequency=frequency))
    found = search(model, [m for name in ("bond_softening", "grease_damping", "magnetic_pull", "hub_flexibility", "shaft_bending", "preload_loss") for m in variants(effect(name))[:1]], [])
    assert found.base.evidence.learned.sizes[BUILD] > 1.0
    assert found.hypotheses[0].names == ("bond_softening",)
    assert all(h.evidence.ln > found.base.evidence.ln - 20.0 for h in found.hypotheses if len(h.mechanisms) == 1)
