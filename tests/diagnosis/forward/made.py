"""Models of two tests, at nuisance values off the drawing, and differences of their residuals."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.virtual_campaign import drawn, model_of, truth, virtual_campaign
from thermospindle.diagnosis.forward.derivatives import nuisance_jacobian
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Noise

NOISELESS = Noise(0.0, 0.0)
CONDITIONS = (Condition(20.0), Condition(45.0, 7200 * RPM))
FREQUENCY = np.arange(400.0, 6000.1, 40.0)
KINDS = (kinds_of.BUILD, kinds_of.EXPANSION, kinds_of.COEFFICIENT, *kinds_of.APART, kinds_of.BALLS, kinds_of.CHANGE, kinds_of.FLUNG, kinds_of.ORBITS, kinds_of.LAW, kinds_of.MASSES, kinds_of.TEMPERATURE, kinds_of.GAIN, kinds_of.DRIFT, kinds_of.HAMMER, kinds_of.HAMMER_DRIFT, kinds_of.MISS, kinds_of.MISS_DRIFT, kinds_of.PLACE, kinds_of.ASKEW, kinds_of.LATE, kinds_of.STIFFNESS, kinds_of.DAMPING, kinds_of.RECORD)
SCENES = {"reference": ROOT / "scenes" / "hdd_2003", "symmetric": ROOT / "tests" / "scenes" / "symmetric"}


def made(scene, **changes):
    """A model of two tests, and nuisance values one to two standard deviations from the drawing."""
    errors = drawn(scene, 2, 3)
    model = model_of(scene, virtual_campaign(scene, CONDITIONS, 3, errors=errors, **{"frequency": FREQUENCY} | changes))
    x = truth(model, errors) + 0.7 * np.random.default_rng(11).standard_normal(len(model.parameters))
    x[[p.kind == kinds_of.RECORD for p in model.parameters]] = 0.0  # records are long enough
    return model, x


def differences(model, t, x, numbers):
    """Central differences (N, k) of the residuals; over less of what bends them, the law of the damping."""
    columns = []
    for i in numbers:
        up, down = x.copy(), x.copy()
        step = 1e-4 if model.parameters[i].kind == kinds_of.LAW else 2e-3
        up[i] += step
        down[i] -= step
        columns.append((model.residual(t, up, []) - model.residual(t, down, [])) / (2 * step))
    return np.array(columns).T


def worst_by_kind(model, t, x):
    """Largest error of a derivative over the length of that derivative, for every kind of nuisance parameter."""
    rates = rates_of(model, x, [[] for _ in model.tests])
    r, by = nuisance_jacobian(model, t, x, [], rates)
    jacobian, numbers = by.whole, by.numbers
    assert len(by.rows) <= len(numbers)  # a gain and its drift do the same
    assert by.information == pytest.approx(jacobian @ jacobian.T, rel=1e-9, abs=1e-9 * np.abs(by.information).max())
    assert by.products(r) == pytest.approx(jacobian @ r, abs=1e-9 * np.abs(jacobian @ r).max())
    assert np.array_equal(r, model.residual(t, x, []))
    assert len(set(numbers)) == len(numbers)
    wanted = differences(model, t, x, numbers)
    length = np.linalg.norm(wanted, axis=0)
    error = np.linalg.norm(jacobian.T - wanted, axis=0) / np.maximum(length, 1e-3 * np.median(length))
    kinds = np.array([model.parameters[i].kind for i in numbers])
    return {k: error[kinds == k].max() for k in KINDS if k in kinds}
