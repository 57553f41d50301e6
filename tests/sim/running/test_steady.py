"""Runout from the lines alone, against records of the same steady state."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.probes import hub_probes
from thermospindle.sim.running.runout import linear, runout
from thermospindle.sim.running.steady import steady_runout


@pytest.fixture(scope="module")
def point(spindle):
    return operating_point(spindle, Condition(20.0, 7200 * np.pi / 30))


def test_it_is_what_a_long_record_shows(point):
    """The mean over many revolutions, and the rest about it, of the signals in time."""
    turns, samples, rate = 400, 256, 120.0
    time = np.arange(turns * samples) / (samples * rate)
    value = linear(point, hub_probes(point.spindle), time).value.reshape(3, turns, samples)
    mean = value.mean(axis=1)
    found = list(steady_runout(point).values())
    for k, own in enumerate(found):
        assert own.six_sigma == pytest.approx(6 * (value[k] - mean[k]).std(), rel=0.01)
    for k in (0, 1):
        assert found[k].repeatable == pytest.approx(np.ptp(mean[k]), rel=0.03)  # into which other lines leak
    by_lines = runout(point, path="linear").values()
    assert found[0].repeatable == pytest.approx(by_lines["hub x"].repeatable, rel=1e-4)
    assert found[0].six_sigma == pytest.approx(by_lines["hub x"].six_sigma, rel=0.02)
    assert found[2].repeatable < 1e-3 * found[0].repeatable  # nothing along the axis repeats: unbalance acts across it


def test_unbalance_alone_is_a_circle_that_repeats(point):
    """Without bearings' imperfections the hub runs on a circle of radius r: 2 r from peak to valley, and no rest."""
    own = point.spindle.imperfections
    alone = replace(point.spindle, imperfections=Imperfections(unbalance=own.unbalance, unbalance_phase=own.unbalance_phase, unbalance_z=own.unbalance_z))
    turning = replace(point, spindle=alone)
    found = steady_runout(turning)
    time = np.linspace(0, 1 / 120, 2000)
    x = linear(turning, hub_probes(alone), time).value[0]
    assert found["hub x"].repeatable == pytest.approx(np.ptp(x), rel=1e-4)
    assert found["hub x"].six_sigma == 0.0


def test_nothing_moves_a_perfect_spindle(point):
    perfect = replace(point, spindle=replace(point.spindle, imperfections=Imperfections()))
    assert {(r.repeatable, r.six_sigma) for r in steady_runout(perfect).values()} == {(0.0, 0.0)}


def test_at_rest_there_is_none(spindle):
    with pytest.raises(BadInput, match="at rest"):
        steady_runout(operating_point(spindle, Condition(20.0)))
