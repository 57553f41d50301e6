"""Where records that end early were hit: found from the data of a damped spindle whose answers
these cut off, and not sought where they need not be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.virtual_campaign import drawn, model_of, noisy, truth, virtual_campaign
from thermospindle.diagnosis.forward.hit import hit_found
from thermospindle.diagnosis.forward.response import Response
from thermospindle.diagnosis.inference.base.drawn import hit_when_it_was
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Noise

CONDITIONS = (Condition(20.0), Condition(40.0, 7200 * RPM))
FREQUENCY = np.arange(400.0, 6000.1, 40.0)  # of records of 25 ms, at whose ends a tenth of the slowest answers is left
WITHOUT, NOISE = Noise(0.0, 0.0), Noise(4e-3, 2e-4)
LEAST = 24.0


def hit(spindle, *before, told=(), times=1.0):
    """Tests whose records begin so many seconds before the hit, None for records without end, alike or
    each by its own, and do not tell but for those `told`; what that leaves out is there so many `times`."""
    before = before * (2 // len(before))
    errors = drawn(spindle, 2, 4)
    whole = virtual_campaign(spindle, CONDITIONS, 4, errors=errors, noise=WITHOUT, frequency=FREQUENCY)
    model, random, tests = model_of(spindle, replace(whole, noise=NOISE)), np.random.default_rng(5), []
    x = truth(model, errors)
    for t, (test, data) in enumerate(zip(whole.tests, model.tests, strict=True)):
        every = replace(data, frequency=FREQUENCY, value=test.frf.value)
        answer = Response(model.linear(t, x, []), every, np.exp(errors.gain))
        value = test.frf.value + (0.0 if before[t] is None else times * answer.cut_off_after(before[t]))
        tests.append(replace(test, frf=replace(test.frf, value=noisy(value, random, NOISE)), pretrigger=before[t] if t in told else None))
    return model_of(spindle, replace(whole, tests=tuple(tests), noise=NOISE))


@pytest.mark.parametrize("before", [2.2e-3, pytest.param(0.6e-3, marks=pytest.mark.slow)])
def test_a_hit_is_found(spindle, before):
    model = hit(spindle, before)
    found, after = hit_when_it_was(model)
    assert [d.test.pretrigger for d in found.tests] == pytest.approx([before] * 2, abs=2e-5)
    before_it = fit(model)
    assert before_it.chi2 / before_it.count > 1.3
    assert after.fit.chi2 / after.fit.count < 1.1
    assert hit_found(found, after.fit.nuisance, LEAST) is None  # it is told now


@pytest.mark.parametrize("before", [None, 0.0])
def test_it_is_not_sought_without_need(spindle, before):
    """Where records have no end, and where they begin with the hit."""
    model = hit(spindle, before)
    assert hit_found(model, fit(model).nuisance, LEAST) is None


@pytest.mark.parametrize("times", [1.0, 4.0])
def test_what_gains_more_than_is_left_out_is_something_else(spindle, times):
    """Another's FRFs were computed, without any records: every one of eight campaigns was said to end early, with hits 0.2
    to 46 ms after the start. What is left out was of 2 standard errors a test, and gained 20 to 40 in squares of them."""
    model = hit(spindle, 0.6e-3, times=times)
    x = truth(model, drawn(spindle, 2, 4))
    assert (hit_found(model, x, LEAST) is None) == (times > 1)


@pytest.mark.slow
@pytest.mark.parametrize("told", [(0,), ()])
def test_tests_may_be_hit_at_times_of_their_own(spindle, told):
    """Where neither tells, and where one does: what is told stays as it is."""
    before = (0.6e-3, 2.2e-3)
    model = hit(spindle, *before, told=told)
    found, after = hit_when_it_was(model)
    assert [d.test.pretrigger for d in found.tests] == pytest.approx(before, abs=3e-5)
    assert after.fit.chi2 / after.fit.count < 1.1
