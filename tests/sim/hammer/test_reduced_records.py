"""Records by the reduced model: against exact FRFs of the whole linear model, against MuJoCo, and where MuJoCo's step would be too short."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.sim.hammer.test_impact import error, exact_frf
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.elements import LINEAR, REDUCED
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.verbs import chain
from thermospindle.report.verbs.chain import impact, simulate
from thermospindle.sim.hammer import test as hammer_test
from thermospindle.sim.hammer.reduced import IMAGES
from thermospindle.sim.hammer.test import impact_tests, stages, takes_long
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import identify

SCENES = ROOT / "scenes"


def quick_point(name, rpm=0.0, **changes):
    spindle = load(SCENES / name)
    spindle = replace(spindle, hammer=replace(spindle.hammer, hits=1, **changes))
    return operating_point(spindle, Condition(25.0, rpm * RPM))


@pytest.mark.parametrize(("scene", "rpm"), [("five_bearing", 0.0), ("five_bearing", 12000.0), ("hdd_2003", 7200.0)])
def test_records_hold_the_exact_frfs(scene, rpm):
    """Of the whole model, gyroscopic terms included, to some times the images of the held force:
    they show most where all points hardly move, and of a node's mass alone."""
    test = impact_tests([quick_point(scene, rpm)], element="reduced", noise=False)[0]
    assert error(test, exact_frf(test, test.estimate.window_decay)) < 8 * IMAGES


def test_records_are_those_of_mujoco():
    """At steps of 8 and 3.6 us, over which both channels are means; FRFs do not know them, at the
    nose neither, whose node is light: images of the held force were 2e-3 of all FRFs."""
    point = quick_point("five_bearing", record_length=0.02)
    same = replace(point.spindle.hammer, hammer_nodes=(1,))
    mujoco, small = (impact_tests([point], same, element, noise=False)[0] for element in ("linear", "reduced"))
    size = np.abs(mujoco.record.velocity).max()
    assert np.abs(small.record.velocity - mujoco.record.velocity).max() < 2e-3 * size
    assert size > 0
    assert error(mujoco, small.estimate.h1.value) < 4e-4  # what a record that ends so soon makes of two means


def test_a_beam_too_stiff_to_step():
    """A thin shaft without rotary inertia: MuJoCo's step would be 0.07 us. Who asks for it is told what to ask for,
    and who asks for nothing gets that, with its four modes: it was refused, and the scene's own record showed two."""
    point = quick_point("free_shaft")
    with pytest.raises(BadInput, match="--element reduced"):
        impact_tests([point], element="linear")
    test = impact_tests([operating_point(load(ROOT / "scenes" / "free_shaft"), Condition(20.0))])[0]
    assert test.element == "reduced"
    wanted = [m.frequency for m in point.modes_below(1100.0)]
    assert wanted == pytest.approx([111.994, 308.711, 605.180, 1000.358], abs=2e-3)
    assert identify(test).frequency == pytest.approx(wanted, rel=1e-4)


@pytest.mark.slow
def test_the_verbs_say_that_the_reduced_model_was_taken(tmp_path):
    """`impact`, `run` and `simulate` of a beam too stiff to step, asked for no element, end well and say so; asked for it, they need not."""
    beam = ROOT / "scenes" / "free_shaft"
    told = [impact(beam), impact(beam, element="reduced"), simulate(beam, temperatures=[20.0], out=tmp_path / "campaign")]
    assert [any("reduced model" in w for w in a.values["warnings"]) for a in told] == [True, False, True]


def test_minutes_in_mujoco_are_told_before_them_and_what_takes_seconds(spindle, capsys):
    """Of the linear model alone: a test of balls has no other way."""
    beams = load(SCENES / "five_bearing")
    said = takes_long(beams, None, 5)
    assert said == takes_long(beams, LINEAR, 5)
    assert "of 125 degrees of freedom for each of 20 hits" in said
    assert "--element reduced" in said
    for of, element, temperatures in ((beams, None, 1), (beams, REDUCED, 5), (beams, "ball-by-ball", 5), (spindle, None, 5), (load(SCENES / "free_shaft"), None, 5)):
        assert takes_long(of, element, temperatures) == ""
    chain._hint(beams, [20.0] * 5, None)
    chain._hint(spindle, [20.0] * 5, None)
    assert capsys.readouterr() == ("", f"spindle: hint: {said}\n")


def test_pieces_of_a_record_are_one_record(spindle, monkeypatch):
    point = operating_point(spindle, Condition(20.0, 7200 * RPM))
    short = replace(spindle.hammer, record_length=0.02, hits=1)
    told: list[str] = []
    whole = impact_tests([point], short, progress=told.append)[0].record.velocity
    assert len(told) == stages(short, 1) > 10
    monkeypatch.setattr(hammer_test, "PIECES", 1)
    assert np.array_equal(impact_tests([point], short)[0].record.velocity, whole)
