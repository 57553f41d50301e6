"""What the terminal shows of runs and tests."""

from __future__ import annotations

import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.report.text.effects import show_effects
from thermospindle.report.text.grid import show_grid
from thermospindle.report.text.run import show_impact, show_run
from thermospindle.report.text.states import show_table
from thermospindle.sim.effects import CATALOGUE
from thermospindle.sim.identification.numbering import identified
from thermospindle.sim.operating import stiffness_table
from thermospindle.sim.run import Run


def test_the_terminal_promises_what_there_is(run: Run):
    """Measurements stand in a title only where there are some; why a mode has no peak is told by where the hammer strikes."""
    said = []
    for measured in (run.measured, ()):
        out = StringIO()
        show_run(Console(file=out, width=200), replace(run, measured=measured), Path("out"))
        said.append(out.getvalue())
    assert "and what was measured" in said[0]
    assert "measured" not in said[1]
    assert "-: no peak was found. The hammer strikes node" in said[1]


@pytest.mark.parametrize(
    ("verb", "sentence"),
    [
        (("table", "hdd_2003"), "From 20 to 60 C at 0 rpm: lower preload 16.00 to 8.00 N, radial stiffness"),
        (("table", "hdd_2003", "--temperatures", "20"), "At 20 C at 0 rpm: lower preload 16.00 N, radial stiffness"),
        pytest.param(("warmup", "hdd_2003"), "In the steady state the bearings are at lower 27.1 C, upper 28.1 C, the preload of lower goes from 16.00 to 14.75 N", marks=pytest.mark.slow),
        (("impact", "hdd_2003", "--element", "reduced"), "8 modes were found, 8 of the 8 that the model has from 400 to 6000 Hz; furthest off is that at 5551.47 Hz"),
    ],
    ids=lambda x: x[0] if isinstance(x, tuple) else "",
)
def test_a_sentence_comes_before_the_table(verb, sentence, capsys):
    """What came out, in one sentence, and then the numbers."""
    assert main(list(verb)) == 0
    assert " ".join(capsys.readouterr().out.split()).startswith(sentence)


def test_a_table_says_which_contact_and_which_ball(spindle):
    """At speed balls have two angles and forces; under a radial load each ball has its own."""
    said = []
    for speed, load in ((0.0, False), (754.0, False), (754.0, True)):
        out = StringIO()
        show_table(Console(file=out, width=120), stiffness_table(spindle, [20.0], [speed]), load)
        said.append(" ".join(out.getvalue().split()))
    assert "inner" not in said[0]
    assert "largest" not in said[0]
    assert said[1].count("inner") >= 2
    assert "Inner angle and force: of the contact with the inner ring" in said[1]
    assert "largest" not in said[1]
    assert "largest" in said[2]
    assert "those of the most loaded ball" in said[2]


# ---------------------------------------------------------------- pictures


def test_the_title_of_a_narrow_table_stays_on_a_line():
    out = StringIO()
    show_grid(Console(file=out, width=30), "Bearings at the reference", ["bearing", "axial"], [["front", "34.18"]])
    assert out.getvalue().startswith("Bearings at the reference\n")


def test_the_list_of_effects_breaks_no_word():
    out = StringIO()
    show_effects(Console(file=out, width=80), CATALOGUE)
    said = out.getvalue()
    assert max(map(len, said.splitlines())) <= 80
    told = {word for e in CATALOGUE for word in e.title.split()}
    assert told <= set(said.split())


def test_modes_that_an_impact_test_does_not_show_are_named(run: Run):
    """The tests of the run are looked at up to 1700 Hz only."""
    step = run.steps[0]
    band = run.spindle.hammer.band
    inside = [(i, m) for i, m in enumerate(step.point.modes) if band[0] <= m.frequency <= band[1]]
    unseen = [m for i, m in inside if i not in identified(step)]
    assert 0 < len(unseen) < len(inside)
    out = StringIO()
    show_impact(Console(file=out, width=80), step)
    said = re.search(r"No peak was found of (.*?)\. The hammer strikes", " ".join(out.getvalue().split()))
    assert said is not None
    assert said[1].split(", ") == [f"{m.frequency:.2f} Hz ({m.kind})" for m in unseen]


def test_a_peak_of_two_planes_that_are_alike_stands_for_both(run: Run):
    """The second mode of one frequency and kind is no mode that was missed: a hammer along one axis cannot show it by itself."""
    step = run.steps[0]
    mode = step.point.modes[next(iter(identified(step)))]
    alike = replace(step, point=replace(step.point))
    vars(alike.point)["modes"] = [*step.point.modes, replace(mode)]
    out = StringIO()
    show_impact(Console(file=out, width=400), alike)
    said = " ".join(out.getvalue().split())
    assert f"At {mode.frequency:.2f} Hz the model has a second mode of the same frequency, which moves across the first one: one peak stands for both." in said
    assert f"{mode.frequency:.2f} Hz" not in said.split("No peak was found of", 1)[-1].split("The hammer strikes")[0]


def test_a_peak_that_stands_for_two_modes_says_so(run: Run):
    """The second of a pair nearer than a half-width is not merely unseen, and the one that took its peak is not what is furthest off."""
    step = run.steps[0]
    number, k = next((i, k) for i, k in identified(step).items())
    mode = step.point.modes[number]
    pole = mode.pole - 0.5j * mode.pole.real
    beside = replace(mode, pole=pole, frequency=abs(pole) / (2 * np.pi))
    band = run.spindle.hammer.band
    paired = replace(step, point=replace(step.point))
    vars(paired.point)["modes"] = [*step.point.modes, beside]
    assert band[0] <= beside.frequency <= band[1]
    out = StringIO()
    show_impact(Console(file=out, width=400), paired)
    said = " ".join(out.getvalue().split())
    width = 2 * mode.damping_ratio * mode.frequency
    pair = f"{mode.frequency:.2f} and {beside.frequency:.2f} Hz ({mode.kind})"
    assert f"The peak at {step.identified.frequency[k]:.2f} Hz stands for {pair}, which at a width of {width:.3g} Hz this test does not part." in said
    assert f"{beside.frequency:.2f} Hz" not in said.split("No peak was found of", 1)[-1]
    assert f"furthest off is that at {mode.frequency:.2f} Hz" not in said


def test_a_standard_error_is_never_shown_as_none(run: Run):
    """However small it is, one digit of it is there, and the number beside it has as many decimals."""
    step = run.steps[0]
    small = replace(step, identified=replace(step.identified, covariance=1e-10 * step.identified.covariance))
    out = StringIO()
    show_impact(Console(file=out, width=80), small)
    rows = [line.split() for line in out.getvalue().splitlines() if re.match(r" *\d+\.\d\d+ ", line)]
    assert len(rows) == len(step.identified.frequency)
    assert all(len(row[k].split(".")[1]) == len(row[k + 1].split(".")[1]) for row in rows for k in (0, 2))
    assert all(float(row[1]) > 0 and float(row[3]) > 0 for row in rows)


def test_static_says_nothing_of_beams_where_there_are_none(capsys: pytest.CaptureFixture[str]):
    assert main(["static", str(ROOT / "scenes" / "hdd_2003")]) == 0
    said = capsys.readouterr().out
    assert "beam" not in said
    assert not re.search(r"-0\.0+\b", said)


def test_where_no_mode_lies_the_lowest_is_told_instead_of_an_empty_table(capsys: pytest.CaptureFixture[str]):
    assert main(["modes", "hdd_2003", "--highest", "100"]) == 0
    assert capsys.readouterr().out.strip() == "No mode lies below 100 Hz at 20 C, 0 rpm; the lowest is at 1002.00 Hz."


def test_an_effect_of_a_scene_says_what_its_numbers_mean(capsys):
    """As the message promises that refuses a bearing's name."""
    assert main(["effects", "seat_clearance", "--scene", "mk7702"]) == 0
    assert "In this scene: 0 front1, 1 front2, 2 front3, 3 rear1." in " ".join(capsys.readouterr().out.split())
    assert main(["effects", "preload_loss", "--scene", "five_bearing"]) == 0
    assert "In this scene: -1 all, 0 front, 1 rear." in " ".join(capsys.readouterr().out.split())
    assert main(["effects", "seat_clearance"]) == 0
    assert "In this scene" not in capsys.readouterr().out


def test_a_table_of_constant_numbers_is_one_row_a_bearing(capsys: pytest.CaptureFixture[str]):
    """Five empty columns and the same row at every temperature; ball rows change, and have a row for each."""
    assert main(["table", "mk7702"]) == 0
    said = capsys.readouterr().out
    assert [len(re.findall(rf"^ *20 .*{name} ", said, re.MULTILINE)) for name in ("front1", "rear1")] == [1, 1]
    assert not re.search(r"^ *[34]0 ", said, re.MULTILINE)
    assert "The same at every temperature and speed asked for" in said
    assert "preload" not in said
    assert main(["table", "hdd_2003"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"^ *60 .*upper ", said, re.MULTILINE)
    assert "The same at every temperature" not in said
