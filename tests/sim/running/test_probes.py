"""Probes: where they look, at what, and what it is called."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.verbs.starting import new
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.probes import all_probes, hub_probes, looked_at, second_plane


def test_probes_see_the_hub_at_their_places(spindle):
    point = operating_point(spindle, Condition(20.0, 7200 * RPM))
    chain, (x, y, axial) = point.chain, hub_probes(spindle)
    assert [p.radial for p in (x, y, axial)] == [True, True, False]
    z, centre = x.position[2], chain.body("hub").z
    assert z == pytest.approx(19e-3)  # a tenth of the hub body's 10 mm below its top
    tilt = np.array([move == "tilt_y" and body == "hub" for body, move in chain.dofs], float) * 1e-6
    assert x.row(chain) @ tilt == pytest.approx(1e-6 * (z - centre))
    assert y.row(chain) @ tilt == 0
    assert axial.row(chain) @ tilt == 0  # on the axis
    four = next(p for p in all_probes(spindle) if p.name == "4 hub_side90")
    assert four.row(chain) == pytest.approx(motion_rows(chain, "hub", (0.0, 12.5e-3, 15e-3))[1])


@pytest.mark.parametrize(
    ("scene", "points", "word"), [("hdd_2003", None, "hub"), ("five_bearing", None, "nose"), ("mk7702", None, "nose"), ("mk7702", 0, "end of spindle")]
)
def test_what_they_look_at_has_a_name_of_the_machine(scene, points, word):
    own = load(scene)
    assert looked_at(own if points is None else replace(own, points=own.points[:points])) == word


@pytest.mark.parametrize(("like", "word", "body", "other"), [("machine-tool", "tip", "tool 0", 0.4), ("grinding", "wheel", "wheel", 0.18), ("rotor", "disc", "disc", 0.6)])
def test_a_tool_is_looked_at_and_not_the_tail(like, word, body, other, tmp_path):
    new(like, like=like, out=tmp_path / like)
    own = load(tmp_path / like)
    x, _, axial = hub_probes(own)
    assert (looked_at(own), x.body, x.position[2], axial.position[2]) == (word, body, own.points[0].position[2], own.points[0].position[2])
    assert second_plane(own)[0].position[2] == pytest.approx(other)
