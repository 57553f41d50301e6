"""Which modes a hammer test shows: peaks against exact FRFs, one shape of every pair, and the shaft's own among those that a log draws."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.hammer.excited import most_excited, peaks
from thermospindle.sim.operating import OperatingPoint, operating_point


def in_band(scene: str, speed: float = 0.0) -> tuple[OperatingPoint, list]:
    spindle = load(ROOT / "scenes" / scene)
    point = operating_point(spindle, Condition(20.0, speed))
    low, high = spindle.hammer.band
    return point, [m for m in point.modes if low <= m.frequency <= high]


def test_a_lone_mode_peaks_as_its_frf_does():
    point, modes = in_band("free_shaft")
    row = point_rows(point.spindle, point.chain, point.spindle.hammer.hammer_nodes)
    exact = np.abs(frf(point.linear, row, row, np.array([modes[0].frequency]), "mobility")).max()
    assert peaks(point, modes)[0] == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(("scene", "drawn"), [("five_bearing", [770, 881, 1629, 1805, 2054]), ("mk7702", [707, 1059, 1558, 3101])])
def test_every_shape_once(scene: str, drawn: list[int]):
    """The first of `five_bearing` are axial, which no hammer excites, and its housing's in two planes; its shaft bends at 1629 and 1641 Hz."""
    point, modes = in_band(scene)
    chosen = [round(modes[i].frequency) for i in most_excited(point, modes, len(drawn))]
    assert chosen == pytest.approx(drawn, abs=1)
    shaft = max(sum(share for element, share in modes[i].energy.items() if element.startswith("spindle")) for i in most_excited(point, modes, len(drawn)))
    assert shaft > 0.7, "strain energy in the shaft's own elements"


def test_forward_and_backward_are_one_shape():
    point, modes = in_band("hdd_2003", 8000 * RPM)
    pair = [i for i, m in enumerate(modes) if m.kind == "rocking" and m.whirl in ("forward", "backward")][:2]
    assert {modes[i].whirl for i in pair} == {"forward", "backward"}
    assert len({*most_excited(point, modes, 4)} & {*pair}) == 1


def test_places_left_go_to_the_others():
    point, modes = in_band("five_bearing")
    ten = most_excited(point, modes, 10)
    assert [m.kind for i, m in enumerate(modes) if i not in ten] == ["axial", "axial"], "what no hammer excites comes last"
    assert most_excited(point, modes, 99) == list(range(len(modes)))
