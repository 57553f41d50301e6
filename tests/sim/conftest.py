"""A short run and a small campaign, for tests of all that comes after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import SCENE
from tests.made_campaign import campaign
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.campaign import Campaign, write_campaign
from thermospindle.sim.hammer.test import impact_tests
from thermospindle.sim.identification.modal import extract
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run, Step, measured_campaigns


def small_run(spindle: Spindle, temperatures: Sequence[float], measured: tuple[Campaign, ...]) -> Run:
    """One hit on every hammer point and a short record; modes identified in a narrow band."""
    settings = replace(spindle.hammer, hits=1, record_length=0.1, exponential_end=0.05)
    steps = []
    for temperature in temperatures:
        point = operating_point(spindle, Condition(temperature))
        test = impact_tests([point], settings)[0]
        frf = test.estimate.h1
        steps.append(Step(point, test, extract(frf.frequency, frf.value, band=(700.0, 1700.0))))
    return Run(spindle, tuple(steps), measured)


@pytest.fixture(scope="session")
def run() -> Run:
    spindle = load(SCENE)
    return small_run(spindle, (20.0, 60.0), measured_campaigns(spindle))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A campaign's folder."""
    write_campaign(campaign(), tmp_path / "c")
    return tmp_path / "c"
