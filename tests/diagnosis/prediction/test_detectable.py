"""Smallest sizes: what a campaign with an effect of such a size holds of it, found by whole fits of other data."""

from __future__ import annotations

import numpy as np
import pytest

from tests.virtual_campaign import drawn, effect, model_of, virtual_campaign
from thermospindle.diagnosis.forward.mechanism import variants
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.screening import screen
from thermospindle.diagnosis.prediction.detectable import ASKED, smallest, visibility
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM

THREE = (Condition(20.0), Condition(55.0, 7200 * RPM), Condition(40.0))
NAMES = ("preload_loss", "sensor_mass", "channel_delay")


@pytest.fixture(scope="module")
def plain(spindle):
    """The fitted model of a campaign with nothing hidden, and what screening says of some effects."""
    model = model_of(spindle, virtual_campaign(spindle, THREE, 4, [], drawn(spindle, 3, 4)))
    done = fit(model)
    looked = screen(model, done, 1.0, evidence(model, done).learned, [v for name in NAMES for v in variants(effect(name))], 1)
    return model, done, looked


def test_what_is_left_at_the_smallest_size_is_worth_what_is_asked(plain):
    model, done, looked = plain
    found = smallest(model, done, looked, 1)
    assert set(found) == set(NAMES)
    for m, size in found.values():
        assert visibility(model.thinned, done, m, m.size.neutral + size) == pytest.approx(np.sqrt(2 * ASKED), rel=0.1)
        assert visibility(model.thinned, done, m, m.size.neutral) == pytest.approx(0.0, abs=1e-9)


def test_what_tolerances_take_is_not_counted(plain):
    """A mass at a sensor is nearly a heavier body: to first order it would show at a sixth of the size that it needs."""
    model, done, looked = plain
    m, size = smallest(model, done, looked, 1)["sensor_mass"]
    promised = min(np.sqrt(2 * ASKED) * m.size.typical / s.visibility for s in looked if s.mechanism.name == "sensor_mass" and s.visibility > 0)
    assert size > 3 * promised


@pytest.mark.parametrize(("times", "seen"), [(2.0, True), (0.4, False)])
def test_a_fit_finds_it_at_twice_that_size(spindle, plain, times, seen):
    model, done, looked = plain
    m, size = smallest(model, done, looked, 1)["preload_loss"]
    values = m.values(m.size.neutral + times * size, [q.neutral for q in m.shape])
    hidden = model_of(spindle, virtual_campaign(spindle, THREE, 4, [(m.effect, values)], drawn(spindle, 3, 4)))
    without, beside = fit(hidden), fit(hidden, (m,))
    assert (evidence(hidden, beside).ln - evidence(hidden, without).ln > ASKED / 2) == seen
