"""A short run, for tests of what comes after it and of what shows it (the fixture `run` of conftest.py)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.hammer.test import impact_tests
from thermospindle.sim.identification.modal import extract
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run, Step


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
