"""The modes of a run numbered at its first step and followed by their shapes; measured and identified modes set beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from thermospindle.model.rotor.frf import point_rows
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.identification.pairing import FOLLOWED_BY_KIND, IDENTIFIED, ModeSet, by_kind, follow, pairs
from thermospindle.sim.operating import OperatingPoint, operating_point
from thermospindle.sim.run import Run, Step

STRIDE = 10.0  # K, over which a mode can be followed by its shape


def measured_rows(run: Run) -> dict[str, dict[int, ModeRow]]:
    """Which measured mode is which computed one: by test id, the measured row by index of the computed mode at the first step.

    Measured modes come without shapes. So the k-th measured mode of a kind, in order of frequency, is taken for the k-th computed
    mode of this kind at the temperature of the run nearest to the test's; from there the computed mode is followed by its shape.
    A mode that the measurement missed would therefore shift the later ones of its kind by one place. Measured modes beyond
    the computed ones of their kind in the band, and tests at another speed, are left out.
    """
    numbers = numbered(run)
    return {name: row for campaign in run.measured for name, row in rows_of(run, campaign, numbers).items()}


def rows_of(run: Run, campaign: Campaign, numbers: Sequence[Mapping[int, int]]) -> dict[str, dict[int, ModeRow]]:
    """`measured_rows` of one campaign."""
    found = {}
    for test in (t for t in campaign.tests if t.modes and same_speed(t, run)):
        k = nearest(run, test.temperature)
        pairs = by_kind([(r.kind, r.frequency) for r in test.modes], [m.kind for m in run.steps[k].point.modes])
        found[test.id] = {numbers[k][c] - 1: test.modes[m] for m, c in pairs.items() if c in numbers[k]}
    return found


def numbered(run: Run) -> list[dict[int, int]]:
    """At every step, the number of each mode by its index: modes in the band at the first step count from 1 in order of
    frequency, and are followed from there by their shapes."""
    rows = [{i: i + 1 for i in in_band(run.steps[0])}]
    for a, b in pairwise(s.point for s in run.steps):
        numbers = rows[-1]
        for here, there in pairwise(_path(a, b)):
            partner = follow(here.linear.mass, here.modes, there.modes, FOLLOWED_BY_KIND)
            numbers = {partner[i]: number for i, number in numbers.items() if partner[i] >= 0}
        rows.append(numbers)
    return rows


def _path(a: OperatingPoint, b: OperatingPoint) -> list[OperatingPoint]:
    """From one operating point to another in steps of at most `STRIDE`."""
    count = int(np.ceil(abs(b.condition.temperature - a.condition.temperature) / STRIDE - 1e-9))
    between = np.linspace(a.condition.temperature, b.condition.temperature, max(count, 1) + 1)[1:-1]
    return [a, *(operating_point(a.spindle, replace(a.condition, temperature=float(t))) for t in between), b]


def in_band(step: Step) -> list[int]:
    """Indices of the modes below the upper end of the scene's frequency band."""
    return [i for i, m in enumerate(step.point.modes) if m.frequency <= step.point.spindle.hammer.band[1]]


def identified(step: Step) -> dict[int, int]:
    """Index of the identified mode by index of the computed one, paired by shape at the measuring points and frequency."""
    rows, top = point_rows(step.point.spindle, step.point.chain), 1.2 * step.point.spindle.hammer.band[1]
    own = [i for i, m in enumerate(step.point.modes) if m.frequency < top]
    computed = ModeSet(
        np.array([step.point.modes[i].frequency for i in own]), np.array([rows @ step.point.modes[i].shape for i in own])
    )
    found = ModeSet(step.identified.frequency, step.identified.shape)
    return {own[j]: int(i) for i, j in pairs(found, computed, IDENTIFIED)}


def nearest(run: Run, temperature: float) -> int:
    """Index of the step nearest to a temperature (C)."""
    return min(range(len(run.steps)), key=lambda k: abs(temperature_of(run.steps[k]) - temperature))


def temperature_of(step: Step) -> float:
    return step.point.condition.temperature


def same_speed(test: Test, run: Run) -> bool:
    return bool(abs(test.speed - run.steps[0].point.condition.speed) < 0.5 * RPM)
