"""What the report adds to a run: sections in order, what is drawn or left out is said, and a ladder where modes were measured."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.conftest import SCENE
from thermospindle.model.built.imperfections import Imperfections
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
    monkeypatch.setattr(whole_report, "runout", partial(runout, path="linear"))


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
    """Without imperfections plausible ones are drawn; without convection there is no warm-up; at one temperature no map."""
    bare = replace(spindle, imperfections=Imperfections(), thermal=replace(spindle.thermal, convections=()))
    told = dict(turning(bare, [20.0], SPEED, lambda done: None))
    assert list(told) == ["Runout", "Warm-up"]
    assert "drawn from seed 0" in told["Runout"]
    assert "Not computed" in told["Warm-up"]
    assert "cools no face" in told["Warm-up"]


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
