"""Runout tests of a spindle whose rings a radial load or its weight displaces: sidebands and what perfect rows do are lines too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.diagnosis.test_runout_diagnosis import CONDITIONS, HIDDEN, hidden
from thermospindle.diagnosis.runout.compare import compare_runout, rms_residual
from thermospindle.diagnosis.runout.fit import families
from thermospindle.diagnosis.runout.lines import felt_sidebands, key_of, look
from thermospindle.diagnosis.runout.sources import phasors, sources
from thermospindle.diagnosis.runout.verdict import diagnose_runout
from thermospindle.model.bearing.kinematics import VARYING
from thermospindle.model.built.drawn import drawn
from thermospindle.model.machine import Condition, RadialLoad, Spindle
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.text.runout_diagnosis import runout_diagnosis_json
from thermospindle.sim.campaign.campaign import Test
from thermospindle.sim.campaign.runout_record import RunoutRecord
from thermospindle.sim.campaign.simulated import hub_points, runout_campaign
from thermospindle.sim.effects import CATALOGUE, by_name
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.moving_balls import run_moving_balls


def pushed(spindle: Spindle, newton: float) -> Spindle:
    return replace(spindle, radial_loads=(RadialLoad((newton, 0.3 * newton), 0.008, ""),))


@pytest.fixture(scope="module")
def belted(spindle: Spindle) -> Spindle:
    return pushed(spindle, 30.0)


@pytest.fixture(scope="module")
def quiet(belted: Spindle):
    """A campaign with nothing hidden."""
    return hidden(belted, {}, 4)


def test_every_line_is_compared_in_its_errors_sidebands_among_them(belted, quiet):
    found = compare_runout(belted, quiet)
    assert 0.6 < rms_residual(found) < 1.2
    assert not any(test.unexplained for test in found)
    causes = [g for test in found for line in test.lines for g in line.causes]
    assert {VARYING, "ball size", "inner waviness"} <= {g.cause for g in causes}
    assert {"2 fc", "3 fc"} & {g.name for g in causes} or any(g.name.endswith("2 fc") for g in causes)
    assert {"radial", "radial and axial"} == {g.direction for g in causes}
    for test in found:  # an imperfection that moves both ways is one cause
        for line in test.lines:
            assert len({key_of(g) for g in line.causes}) == len(line.causes)


def test_nothing_is_named_where_nothing_hides(belted, quiet):
    d = diagnose_runout(belted, quiet)
    assert (d.verdict, d.effects) == ("none", ()), d.reason


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cage_unbalance", "race_waviness", "ball_size"])
def test_a_hidden_imperfection_is_named_with_its_size_and_place(belted, name):
    values = HIDDEN[name]
    d = diagnose_runout(belted, hidden(belted, {name: values}, 1))
    assert (d.verdict, d.effects) == ("identified", (name,)), d.reason
    best = next(e for e in d.explanations if e.effects == (name,))
    assert best.size[0] == pytest.approx(values[by_name(name).parameters[0].name], abs=4 * best.size_sd[0])
    assert {k: v for k, v in best.variants[0].values.items() if k in ("bearing", "ring", "multiple", "offset")}.items() <= values.items()
    assert runout_diagnosis_json(d, CATALOGUE, belted)["verdict"] == "identified"


def test_what_a_belt_does_is_no_imperfection_of_a_spindle_without_one(spindle, quiet):
    d = diagnose_runout(spindle, quiet)
    assert (d.verdict, d.effects) == ("unexplained", ()), d.reason


@pytest.mark.slow
@pytest.mark.parametrize("newton", [35.0, 60.0])
def test_where_balls_are_let_go_further_sidebands_are_lines_too(spindle, newton):
    """They were lines that no imperfection has, four and five of them, as far as third and fourth sidebands went."""
    belted = pushed(spindle, newton)
    assert max(felt_sidebands(operating_point(belted, CONDITIONS[-1])).values()) > 2
    d = diagnose_runout(belted, hidden(belted, {}, 1))
    assert (d.verdict, d.effects) == ("none", ()), d.reason
    assert not d.unexplained


def test_what_perfect_rows_do_is_a_source_of_its_own(belted, quiet):
    """Once, in lines of the cage's clock, beside waves of the ring that stands; nothing without the load."""
    seen = [look(belted, test) for test in quiet.tests[:2]]
    found = sources(belted, seen, quiet.points)
    perfect = [s for s in found.shown if s[0][1] == VARYING]
    assert {s[0][3] for s in perfect} >= {"10 fc", "20 fc"}
    assert all(found.likely[s] == 1.0 and s[1] == "perfect" for s in perfect)
    for f in families(seen, found):
        names = [source for source, _ in f.source]
        for source in names:
            if source[0][1] == VARYING and not source[0][3].startswith(("50", "60")):
                assert any(key[0] == source[0][0] and key[1] == "inner waviness" and key[3] == source[0][3] for key, _ in names)
    assert not sources(replace(belted, radial_loads=()), seen, quiet.points).shown.keys() & set(perfect)


@pytest.mark.slow
def test_a_weak_line_that_one_build_has_and_another_has_not(tmp_path):
    """Of a row with displaced rings lines below 1e-4 of the strongest are left out: of the drawn tailstock under 256.2 N one is just there."""
    spindle = load(ROOT / "scenes" / "tailstock")
    belted = replace(spindle, radial_loads=(RadialLoad((256.2, 76.86), 0.008, ""),), imperfections=drawn(spindle, 3))
    made = runout_campaign(belted, [Condition(20.0, spindle.nominal_speed)], 0.3, path="linear")
    found = sources(belted, [look(belted, made.tests[0])], made.points)
    assert all(np.isfinite(by).all() for by in found.by_tolerance.values())


@pytest.mark.slow
def test_records_of_moving_balls_have_these_lines(spindle):
    """Balls that move one by one, without small amplitudes, under 10 N:
    every line of 0.05 nm or more to 2 % of its
    largest and the record's errors, sidebands and what perfect rows do among them."""
    own = drawn(spindle, 1)
    belted = replace(pushed(spindle, 10.0), imperfections=own)
    condition = Condition(20.0, 7200 * RPM)
    point = operating_point(belted, condition)
    time, moved = run_moving_balls(point, own, 0.45, (1.0,), step=1e-5)
    points = hub_points(belted)
    rows = np.array([np.array(p.direction) @ motion_rows(point.chain, p.body, p.position)[:3] for p in points])
    late = time >= 0.05
    value = (moved[0, late] @ rows.T).T[:, ::2]
    record = RunoutRecord(tuple(p.node for p in points), "time", time[late][::2] - 0.05, value - value.mean(axis=1, keepdims=True))
    seen = look(belted, Test("moving", 20.0, condition.speed, runout=record))
    made = phasors(point, own, points, perfect=True)
    checked: list[str] = []
    for line in seen.seen:
        computed = np.abs(sum((made[key] for key in map(key_of, line.lines) if key in made), np.zeros(len(points), complex)))
        if computed.max() > 5e-11:
            assert np.abs(line.phasor) == pytest.approx(computed, abs=0.02 * computed.max() + 3 * line.sd.max()), line.lines[0].name
            checked += [g.cause for g in line.lines]
    assert not seen.unexplained
    assert checked.count(VARYING) == 6
    assert checked.count("ball size") == 6  # fc, 2 fc and 3 fc of both rows
    assert len(checked) > 100
