"""Errors that come true: virtual tests of the model itself, fitted."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy import stats

from tests.blind.campaigns import campaign as blind_campaign
from tests.blind.world import Plan, Record, World
from tests.conftest import ROOT
from tests.virtual_campaign import fitted, model_of, truth, virtual_campaign
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.points import otherwise
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.parameters.nuisance import (
    APART,
    ASKEW,
    BUILD,
    DAMPING,
    DAMPING_DRIFT,
    DRIFT,
    GAIN,
    PLACE,
    STIFFNESS,
    STIFFNESS_DRIFT,
    TEMPERATURE,
)
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Noise
from thermospindle.sim.operating import operating_point

COLD_AND_WARM = (Condition(20.0), Condition(55.0, 7200 * RPM))
THREE = (Condition(20.0), Condition(60.0), Condition(40.0, 7200 * RPM))
SCENES = {name: ROOT / "tests" / "scenes" / name for name in ("symmetric", "inner_turning_spring")} | {"reference": ROOT / "scenes" / "hdd_2003"}


def kinds(model: CampaignModel) -> np.ndarray:
    """Numbers of the parameters that were drawn."""
    return np.array([i for i, p in enumerate(model.parameters) if p.kind in (BUILD, TEMPERATURE, GAIN)])


def standardised(model: CampaignModel, done, errors) -> np.ndarray:
    """Posterior mean less truth of what was drawn, whitened by the posterior covariance."""
    found, own = evidence(model, done), kinds(model)
    root = np.linalg.cholesky(found.covariance[np.ix_(own, own)])
    return np.linalg.solve(root, (found.mean - truth(model, errors))[own])


@pytest.mark.parametrize("seed", [0, 1])
def test_errors_come_true(spindle, seed):
    """At the truth and at the fit chi2 is 1 a number within four of its standard deviations; no discrepancy is found where none is."""
    model, done, errors = fitted(spindle, COLD_AND_WARM, seed, frequency=np.arange(400.0, 6000.1, 8.0))
    at = truth(model, errors)
    exact = sum(float(r @ r) for r in (model.residual(t, at, []) for t in range(2)))
    spread = np.sqrt(2 * done.count)
    assert abs(exact - done.count) < 4 * spread + 0.02 * done.count
    assert exact - 120 < done.chi2 < exact  # 24 parameters were drawn; as many again of the discrepancy are free in the fit
    assert done.chi2 + done.point @ done.point <= exact + at @ at + 1.0  # the fit costs no more than the truth
    learned = evidence(model, done).learned
    assert (learned.sizes[STIFFNESS], learned.sizes[DRIFT], learned.errors) == (0.0, 0.0, 1.0)
    z = standardised(model, done, errors)
    assert stats.chi2.sf(z @ z, len(z)) > 1e-3


def test_bearings_that_differ_are_no_discrepancy_of_modes(spindle):
    """One bearing damps a tenth more than drawn and the other a tenth less: that is found, and the modes' constant errors are none."""
    shares = {b.name: sign * 0.1 for b, sign in zip(spindle.all_bearings, (1, -1), strict=True)}
    true = replace(spindle, bearings=tuple(replace(b, damping_ratio=(1 + shares[b.name]) * b.damping_ratio) for b in spindle.bearings))
    campaign = virtual_campaign(true, COLD_AND_WARM, 4, noise=Noise(1e-3, 1e-4))
    model = model_of(spindle, campaign)
    found = evidence(model, fit(model))
    assert found.learned.sizes[STIFFNESS] == found.learned.sizes[DAMPING] == 0.0
    for name, share in shares.items():
        i = next(i for i, p in enumerate(model.parameters) if p.name == f"damping of {name} beside the others")
        others = [j for j, p in enumerate(model.parameters) if p.kind == APART[1] and j != i]
        apart = (found.mean[i] - found.mean[others].mean()) / 2 * model.parameters[i].sd
        assert apart == pytest.approx(share, abs=0.02)


@pytest.mark.parametrize(
    ("scene", "name", "share", "hidden"),
    [
        ("reference", "axial stiffness of the balls", -0.02, otherwise({0: -0.02})),
        ("reference", "tilt stiffness of the balls", 0.02, otherwise({1: 0.02})),
        ("inner_turning_spring", "change of the balls' stiffness with temperature", 0.0015, otherwise({}, 0.0015)),
    ],
)
def test_what_two_programs_differ_by_in_a_bearing_is_no_discrepancy_of_modes(scene, name, share, hidden):
    """What races give, where a row's forces act, whether a contact's constant is kept: found as
    that, without constant errors of modes, or modes that drift."""
    spindle = load(SCENES[scene])
    model = model_of(spindle, virtual_campaign(spindle, THREE, 4, [hidden], noise=Noise(3e-4, 3e-5), frequency=np.arange(400.0, 6000.1, 8.0)))
    found = evidence(model, fit(model))
    assert [found.learned.sizes[kind] for kind in (STIFFNESS, DAMPING, STIFFNESS_DRIFT, DAMPING_DRIFT)] == [0.0] * 4
    i = next(i for i, p in enumerate(model.parameters) if p.name == name)
    sd = model.parameters[i].sd
    assert found.mean[i] * sd == pytest.approx(share, abs=4 * sd * np.sqrt(found.covariance[i, i]))
    assert found.covariance[i, i] < 0.5  # the data tell


def test_sensors_that_are_glued_by_hand_are_no_discrepancy_of_modes():
    """Some tenths of a millimetre off and a degree askew, as in any laboratory: found as that.
    Without a place for it chi2 was 4 a number, and the verdict *unexplained* (another's campaign)."""
    scene = load(SCENES["reference"])
    plans, world = (Plan(20.0, 0.0), Plan(60.0, 0.0), Plan(40.0, 7200 * RPM)), World(place=3e-4, askew=0.02)
    made = blind_campaign(scene, plans, (), 3, world, Record("line", told="noise"))
    model = model_of(scene, made.campaign)
    done = fit(model)
    found = evidence(model, done)
    assert done.chi2 / done.count == pytest.approx(1.0, abs=0.05)
    assert [found.learned.sizes[kind] for kind in (DAMPING, STIFFNESS_DRIFT, DAMPING_DRIFT)] == [0.0] * 3
    assert found.learned.sizes[STIFFNESS] <= 3e-4
    own = [i for i, p in enumerate(model.parameters) if p.kind in (PLACE, ASKEW)]
    assert len(own) == 4 * len(scene.points)
    assert np.abs(found.mean[own]).max() > 1.0
    assert np.median(np.diag(found.covariance)[own]) < 0.3  # the data tell most of it


@pytest.mark.parametrize("apart", [0, 2])
def test_pairs_cost_nothing(apart):
    """The lateral pair at 4323 Hz, 5 % damped, exactly coincident on the symmetric scene and 2 Hz apart on the reference."""
    scene = load(SCENES["symmetric" if apart == 0 else "reference"])
    pair = [m for m in operating_point(scene, Condition(40.0)).modes if 4000 < m.frequency < 5000]
    assert len(pair) == 2
    assert pair[1].frequency - pair[0].frequency == pytest.approx(apart, abs=0.2)
    assert all(m.damping_ratio == pytest.approx(0.05, abs=0.002) for m in pair)
    model, done, errors = fitted(scene, (Condition(20.0), Condition(60.0)), 1, frequency=np.arange(400.0, 6000.1, 8.0))
    assert done.chi2 / done.count == pytest.approx(1.0, abs=4 * np.sqrt(2 / done.count) + 0.02)
    z = standardised(model, done, errors)
    assert stats.chi2.sf(z @ z, len(z)) > 1e-3


@lru_cache
def over_seeds(name: str) -> tuple[list[float], list[float], float, int]:
    """Of ten campaigns of three tests chi2/n at the fit, chi2 at the truth in its standard
    deviations, and the sum of squares of so many standardised errors of what was drawn."""
    scene = load(SCENES[name])
    ratios, shares, squares, free = [], [], 0.0, 0
    for seed in range(10):
        model, done, errors = fitted(scene, THREE, seed, responses=(1, 2, 3) if name == "inner_turning_spring" else (1, 3, 6))
        at = truth(model, errors)
        exact = sum(float(r @ r) for r in (model.residual(t, at, []) for t in range(3)))
        shares.append((exact - done.count) / np.sqrt(2 * done.count))
        ratios.append(done.chi2 / done.count)
        z = standardised(model, settled(model, Hypothesis(done, evidence(model, done))).fit, errors)  # what is told stands where the widths that were learned have it
        squares, free = squares + z @ z, free + len(z)
    print(name, "chi2/n at the fit", np.round(ratios, 3), "at the truth, in sd", np.round(shares, 2), "mean square of z", squares / free, "of", free)
    return ratios, shares, squares, free


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_residuals_come_true_over_many_seeds(name):
    """Chi2 at the truth has its distribution; at the fit measured 0.95 to 0.996 a number."""
    ratios, shares, _, _ = over_seeds(name)
    assert min(ratios) > 0.93
    assert max(ratios) < 1.07
    assert abs(np.mean(shares)) < 1.5
    assert np.std(shares) < 2


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_errors_of_what_is_fitted_come_true_over_many_seeds(name):
    """What was drawn comes back with errors of mean square 1 (measured: 0.95, 0.79 and 1.11), as far as so many of them tell: within
    the 99.9 % of a chi-squared. Of fits that had not settled it was 1.43 and 1.35, which were taken for errors a fifth too small."""
    _, _, squares, free = over_seeds(name)
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], free)
    assert low < squares < high
