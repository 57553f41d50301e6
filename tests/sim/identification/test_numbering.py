"""Which mode is which: numbers by kind, measured rows, modes followed from one temperature to the next."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import SCENE
from tests.made_campaign import other_campaign
from tests.mounting import told_preload
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.report.page.comparison import compared
from thermospindle.report.page.headlines import misses
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.identification.numbering import measured_rows, numbered
from thermospindle.sim.identification.pairing import by_kind
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run, Step


def test_by_kind_takes_the_order_of_frequency_within_a_kind():
    known = [("rocking", 1790.0), ("axial", 1550.0), ("rocking", 1740.0), ("axial", 1020.0), ("lateral", 5.0), ("axial", 1e4)]
    kinds = ["axial", "rocking", "axial", "rocking", "rocking"]
    assert by_kind(known, kinds) == {0: 3, 1: 2, 2: 1, 3: 0}


def test_measured_rows_go_by_the_first_step(run: Run):
    """Also for a test at the last temperature, and for a run from hot to cold; tests at another speed are left out."""
    found = measured_rows(run)
    assert {test: {i: row.mode for i, row in rows.items()} for test, rows in found.items()} == {
        "T20": {i: i + 1 for i in range(5)},
        "T60": {i: i + 1 for i in range(5)},
    }
    assert measured_rows(replace(run, steps=run.steps[::-1])) == found
    turning = other_campaign([ModeRow("a", 1, "axial", 1010.0, 1.0)], speed=100.0)
    assert measured_rows(replace(run, measured=(turning,))) == {}


def test_same_test_names_in_two_campaigns(run: Run):
    """Each campaign keeps its own frequencies."""
    campaign = replace(run.measured[0], folder=Path("first"))
    tests = tuple(replace(t, modes=tuple(replace(m, frequency=m.frequency + 7) for m in t.modes)) for t in campaign.tests)
    table = compared(replace(run, measured=(campaign, replace(campaign, tests=tests, folder=Path("second")))))
    for n in range(1, 6):
        a, b = (table.at(f"measured, {name}", 20.0, n) for name in ("first", "second"))
        assert a is not None
        assert b is not None
        assert b[0] - a[0] == pytest.approx(7)


def test_repeated_tests_give_their_mean(run: Run):
    """Two tests at one temperature, 1 Hz each: the mean, with 1 / sqrt(2) Hz."""
    modes = [ModeRow(t, 1, "axial", f, 1.0) for t, f in (("a", 1000.0), ("b", 1004.0))]
    value = compared(replace(run, measured=(other_campaign(modes),))).at("measured", 20.0, 1)
    assert value == pytest.approx((1002.0, np.sqrt(0.5)))


def test_modes_are_followed_over_a_long_way():
    """From 20 C to 120 C under eight times the preload, two lateral modes fall past a rocking one; one jump finds the same modes as
    small steps."""
    spindle = load(SCENE)
    spindle = told_preload(spindle, 125.0)

    def steps(*temperatures: float) -> Run:
        return Run(spindle, tuple(Step(operating_point(spindle, Condition(t)), None, None) for t in temperatures), ())  # type: ignore[arg-type]

    direct, slow = steps(20.0, 120.0), steps(*range(20, 121, 5))
    assert numbered(direct)[-1] == numbered(slow)[-1]
    modes = direct.steps[-1].point.modes
    index = {number: i for i, number in numbered(direct)[-1].items()}
    assert [modes[index[n]].kind for n in (1, 2, 5)] == ["axial"] * 3
    assert [modes[index[n]].kind for n in (3, 4, 6)] == ["rocking"] * 3
    assert [modes[index[n]].kind for n in (7, 8)] == ["lateral"] * 2
    assert index[6] > max(index[7], index[8])  # they have crossed


def test_a_perfect_measurement_misses_nothing(run: Run):
    """Sentences come from the numbers: with the model's own frequencies as measurement, no shift or split is complained about."""
    rows = [
        ModeRow(f"t{k}", i + 1, m.kind, m.frequency, 0.5) for k, step in enumerate(run.steps) for i, m in enumerate(step.point.modes[:7])
    ]
    tests = tuple(Test(f"t{k}", t, 0.0, modes=tuple(r for r in rows if r.test == f"t{k}")) for k, t in enumerate((20.0, 60.0)))
    said = misses(compared(Run(replace(run.spindle, file=None), run.steps, (Campaign("self", "", "mobility", (), tests),))))
    assert len(said) == 1
    assert "0.0 Hz or 0.0 %" in said[0]
