"""What the data tell of sizes that nobody states: discrepancies, errors, tolerances and thermal motions."""

from __future__ import annotations

import pytest

from tests.diagnosis.inference.toy import toy
from thermospindle.diagnosis.inference.evidence import Learned, evidence
from thermospindle.diagnosis.inference.prior import REFERENCE, steady
from thermospindle.diagnosis.parameters.nuisance import (
    BUILD,
    DAMPING,
    DRIFT,
    EXPANSION,
    STIFFNESS,
    STIFFNESS_DRIFT,
)
from thermospindle.diagnosis.parameters.sizes import FAR_OFF, FARTHER, WIDER, finer


@pytest.mark.parametrize(("size", "within"), [(0.0, 1.0), (1e-4, 1.6), (3e-4, 1.6), (5.5e-4, 2.0), (1e-3, 1.6), (1.7e-3, 2.0), (3e-3, 1.6), (1e-2, 1.6)])
def test_the_size_of_the_discrepancy_is_learned(size, within):
    """Of twenty campaigns at least eighteen learn the size that they were drawn with, or the next
    place of its grid; drift and damping, of which there is none, none."""
    right = [evidence(made.model, made.fit).learned for made in (toy(seed, size) for seed in range(20))]
    assert sum(size / within < learned.sizes[STIFFNESS] < within * size or learned.sizes[STIFFNESS] == size for learned in right) >= 18
    assert sum(learned.sizes[DAMPING] == 0.0 and learned.sizes[DRIFT] == 0.0 for learned in right) >= 14


def test_between_two_places_of_a_grid_there_are_two_more():
    assert finer((0.0, 1e-3, 3e-3)) == (0.001, 0.0014, 0.0021, 0.003)


@pytest.mark.parametrize("size", [5.5e-4, 1.7e-3])
def test_a_size_between_two_places_loses_nothing(size):
    """Against the evidence at the very size that was drawn, of which a prior wrong by 1.8 loses 0.2 for every number that it is of."""
    for seed in range(5):
        made = toy(seed, size)
        found = evidence(made.model, made.fit)
        assert found.ln > evidence(made.model, made.fit, [Learned({**found.learned.sizes, STIFFNESS: size}, found.learned.errors)]).ln - 0.5


def test_errors_larger_than_stated_are_learned():
    for seed in range(5):
        made = toy(seed, 0.0, rows=200, errors=1.5)
        assert evidence(made.model, made.fit).learned.errors == pytest.approx(1.5, rel=0.1)
        fine = toy(seed, 0.0, rows=200)
        assert evidence(fine.model, fine.fit).learned.errors < 1.1


def test_tolerances_that_are_wider_stay_so_where_effects_are_sought_beside_them():
    """What drifts, or thermal motions that are off, does not: it may be the effect."""
    beside = steady(Learned({BUILD: 4.0, "hub mass": 16.0, EXPANSION: 3.0, STIFFNESS_DRIFT: 1e-3, STIFFNESS: 1e-2}, 1.3)).sizes
    assert beside == {BUILD: 4.0, "hub mass": 16.0, EXPANSION: REFERENCE[EXPANSION], STIFFNESS_DRIFT: REFERENCE[STIFFNESS_DRIFT], STIFFNESS: 1e-2}


@pytest.mark.parametrize(
    ("build", "every", "of_one"),
    [((1.0,) * 10, {1.0}, {1.0}), ((10.0,) * 10, {4.0, 8.0}, {1.0}), ((40.0, *(1.0,) * 9), {1.0}, {1.0, 4.0, 16.0})],
    ids=["as stated", "all of them", "one by itself"],
)
def test_tolerances_wider_than_stated_are_learned(build, every, of_one):
    """All of them or those that are, which cost their prior odds beside the integral with as wide a prior."""
    found_wide = 0
    for seed in range(5):
        made = toy(seed, 0.0, rows=200, build=build)
        found = evidence(made.model, made.fit, wide=True)
        sizes = found.learned.sizes
        assert sizes[BUILD] in every
        assert sizes["b0"] in of_one
        assert all(sizes[f"b{k}"] == 1.0 for k in range(1, 10))
        assert (sizes["b0"] > 1.0) == (max(of_one) > 1.0 and abs(float(found.mean[0])) > 6.0)
        found_wide += sizes["b0"] > 1.0
        prior = made.prior(*(sizes[k] for k in (STIFFNESS, DAMPING, DRIFT)))
        own = [q.kind == BUILD for q in made.model.parameters]
        prior[own, own] *= sizes[BUILD] ** 2
        prior[0, 0] *= sizes["b0"] ** 2
        assert found.ln == pytest.approx(made.ln(prior, found.learned.errors) + WIDER[sizes[BUILD]] + FAR_OFF[sizes["b0"]], abs=1e-6)
    assert found_wide >= 3 * (max(of_one) > 1.0)


@pytest.mark.parametrize(("off", "times"), [(1.0, {1.0}), (12.0, {3.0, 6.0})])
def test_how_far_thermal_motions_are_off_is_learned(off, times):
    """Whatever is asked, and at their prior odds beside the integral with as wide a prior."""
    for seed in range(5):
        made = toy(seed, 0.0, rows=200, build=off, drawing=EXPANSION)
        found = evidence(made.model, made.fit)
        wider = found.learned.sizes[EXPANSION]
        assert wider in times
        prior = made.prior(*(found.learned.sizes[k] for k in (STIFFNESS, DAMPING, DRIFT)))
        own = [q.kind == EXPANSION for q in made.model.parameters]
        prior[own, own] *= wider**2
        assert found.ln == pytest.approx(made.ln(prior, found.learned.errors) + FARTHER[wider], abs=1e-6)
        assert found.as_fitted == pytest.approx(found.ln, abs=1e-6)  # of nothing that is fitted
