"""What the report adds to a run: sections in order, what is drawn or left out is said, and a ladder where modes were measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import SCENE
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.scene.reading import load
from thermospindle.report.page import whole_report
from thermospindle.report.page.whole_report import climbed, more_sections, steps, turning
from thermospindle.sim.campaign.campaign import Test, read_campaign
from thermospindle.sim.effects import by_name
from thermospindle.sim.run import Run
from thermospindle.sim.running.runout import runout

SPEED = 7200 * np.pi / 30


@pytest.fixture
def quick(monkeypatch):
    """Runout from the linear answer, which takes no time."""
    monkeypatch.setattr(whole_report, "runout", lambda point, path: runout(point, path="linear"))


@pytest.fixture(scope="module")
def table2():
    return read_campaign(SCENE / "measured" / "jang_2003")


def test_a_ladder_only_where_modes_were_measured(spindle, table2):
    turned = replace(table2, tests=(Test("turning", 20.0, SPEED),))
    mixed = replace(table2, tests=(*table2.tests, *turned.tests))
    assert climbed(Run(spindle, (), (table2, turned))) == [table2]
    assert climbed(Run(spindle, (), (mixed,))) == [table2]
    assert steps(Run(spindle, (), (table2,))) - steps(Run(spindle, (), (turned,))) > len(table2.tests)


def test_what_a_scene_does_not_say_is_drawn_or_left_out_aloud(spindle, quick):
    """Without imperfections plausible ones are drawn; without convection there is no warm-up; at
    one temperature no map, which the page did not tell."""
    bare = replace(spindle, imperfections=Imperfections(), thermal=replace(spindle.thermal, convections=()))
    told = dict(turning(bare, [20.0], SPEED, lambda done: None))
    assert list(told) == ["Runout", "Warm-up", "Resonance map"]
    assert "drawn from seed 0" in told["Runout"]
    assert "Not computed" in told["Warm-up"]
    assert "cools no face" in told["Warm-up"]
    assert "Left out: a map goes over temperatures, and this report has 20 °C alone" in told["Resonance map"]


def test_where_nothing_turns_the_rest_of_the_report_is_written(monkeypatch):
    """A minute of computing for free_shaft ended in the sentence that nothing turns, and no page."""
    monkeypatch.setattr(whole_report, "runout", None)
    shaft, said = load("free_shaft"), []
    [(title, text)] = turning(shaft, [15.0, 25.0], SPEED, said.append)
    assert title == "Runout, warm-up and resonance map"
    assert "Left out, all three: nothing of this machine turns" in text
    assert said == []
    assert steps(Run(shaft, (), ())) == 0


def test_what_has_no_section_or_no_rows_has_no_warm_up(spindle, quick, monkeypatch):
    """Bearings by numbers: runout and map of unbalance, over the speeds of their tables; a path of the scene is no reason."""
    asked = []
    monkeypatch.setattr(whole_report, "resonance_map", lambda _, temperatures, speeds, *more, **named: asked.append(speeds))
    monkeypatch.setattr(whole_report, "map_section", lambda found: ("Resonance map", ""))
    monkeypatch.setattr(whole_report, "warm_up", None)
    rotor = load("mk7702")
    tabled = replace(rotor, bearings=(), linear_bearings=tuple(replace(b, speed=(0.0, 1.5 * SPEED), stiffness=np.tile(b.stiffness, 2)) for b in rotor.linear_bearings))
    told = dict(turning(tabled, [20.0, 40.0], SPEED, lambda done: None))
    assert "<svg" in told["Runout"]
    assert told["Warm-up"] == "<p>Left out: the scene has no section that heat could flow through.</p>"
    assert asked[0][-1] == pytest.approx(1.5 * SPEED)
    rowless = replace(spindle, bearings=(), sets=())
    monkeypatch.setattr(whole_report, "runout_section", lambda *made: ("Runout", ""))
    monkeypatch.setattr(whole_report, "operating_point", fails)
    told = dict(turning(rowless, [20.0, 40.0], SPEED, lambda done: None))
    assert "Left out: no ball or roller row runs between rings of the section" in told["Warm-up"]
    assert told["Runout"] == "<p>Not computed: no &lt;equilibrium&gt;.</p>"


def fails(*asked):
    raise NoEquilibrium("no <equilibrium>")


@pytest.mark.slow
def test_everything(spindle, table2, quick):
    from thermospindle.sim.run import run

    result = replace(run(spindle, [20.0, 60.0]), measured=(table2,))
    said: list[str] = []
    told = list(more_sections(result, SPEED, (by_name("shaft_bending"), by_name("magnetic_pull")), said.append))
    assert [title for title, _ in told] == ["Runout", "Warm-up", "Resonance map", f"The ladder: {table2.title}"]
    assert all("<svg" in body for _, body in told)
    assert "imperfections of the scene" in told[0][1]
    assert len(said) <= steps(result)
