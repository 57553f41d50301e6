"""Derivatives of mode tables against differences of their residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.forward.made import CONDITIONS, SCENES, differences, worst_by_kind
from tests.virtual_campaign import effect, mode_campaign, model_of
from thermospindle.diagnosis.forward.derivatives import nuisance_jacobian
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.model.scene.reading import load


def test_derivatives_of_mode_tables():
    """ln frequency and ln damping, by perturbation of the poles; at rest, where members of a pair
    must not swap from one side to the other, and at speed."""
    scene = load(SCENES["reference"])
    for damping in (True, False):
        model = model_of(scene, mode_campaign(scene, CONDITIONS, 3, damping=damping))
        x = 0.3 * np.random.default_rng(2).standard_normal(len(model.parameters))
        for t in (0, 1):
            assert max(worst_by_kind(model, t, x).values()) < 5e-3


@pytest.mark.parametrize(("name", "real"), [("reference", False), ("reference", True), ("symmetric", False)])
def test_derivatives_of_shapes(name, real):
    """At rest, where two modes of a plane each coincide, and at speed, where whirls part."""
    scene = load(SCENES[name])
    model = model_of(scene, mode_campaign(scene, CONDITIONS, 3, shapes=[p.node for p in scene.points], real=real))
    data = model.tests[0]
    assert data.count == 2 * len(data.frequency) + len(data.frequency) * (len(scene.points) - 1) * (1 if real else 2)
    x = 0.1 * np.random.default_rng(2).standard_normal(len(model.parameters))
    for t in (0, 1):
        r, by = nuisance_jacobian(model, t, x, [], rates_of(model, x, [[] for _ in model.tests]))
        jacobian, numbers = by.whole, by.numbers
        assert len(r) == model.tests[t].count
        shapes = slice(2 * len(data.frequency), None)  # the others are a hundred times as sure
        wanted = differences(model, t, x, numbers)[shapes]
        error = np.abs(jacobian.T[shapes] - wanted).max(axis=0)
        assert np.all(error < 0.04 * np.abs(wanted).max(axis=0) + 2e-3 * np.abs(wanted).max())


@pytest.mark.parametrize("decay", [8.0, -3.0])
def test_derivatives_of_mode_tables_under_a_window(decay):
    """One that was not corrected, or corrected though there was none, at speed: damping ratios are
    those seen, a quarter more than the poles' own. Their derivatives were wrong by as much."""
    window = effect("window_damping")
    model = model_of(load(SCENES["symmetric"]), mode_campaign(load(SCENES["symmetric"]), CONDITIONS[1:], 3))
    model = replace(model, present=((window, {p.name: p.neutral for p in window.parameters} | {"decay": decay}),))
    x = 0.3 * np.random.default_rng(2).standard_normal(len(model.parameters))
    assert model.linear(0, x, []).chain.decay == decay
    assert max(worst_by_kind(model, 0, x).values()) < 5e-3
