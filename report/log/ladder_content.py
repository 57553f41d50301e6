"""What the Rerun log of a ladder shows, as plain numbers for `report.log.ladder`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from thermospindle.diagnosis.ladder.ladder import Ladder
from thermospindle.diagnosis.ladder.step import Step
from thermospindle.model.types import ComplexArray
from thermospindle.report.log.content import one
from thermospindle.report.log.ladder import Level, ShownLadder, ShownStep, Track
from thermospindle.report.text.ladder import sentences
from thermospindle.report.text.ladder_table import cells, residual_map
from thermospindle.report.typeset import UNITS
from thermospindle.sim.identification.frf import decibel
from thermospindle.sim.identification.peak import Peak
from thermospindle.sim.operating import provenance

TINY = 1e-3  # Hz, instead of zero, where a receptance has no level


def shown(found: Ladder) -> ShownLadder:
    maps = [residual_map(found, r) for r in found.steps]
    steps = tuple(
        ShownStep(r.name, cells(r), r.error, r.held_out, m.frequency, tuple(_levels(found, r)), tuple(_tracks(found, r)))
        for r, m in zip(found.steps, maps, strict=True)
    )
    return ShownLadder(
        provenance(found.spindle),
        f"{found.campaign.title} against scene {found.spindle.name}",
        tuple(maps[0].modes),
        tuple(maps[0].tests),
        f"dB re 1 {UNITS[found.campaign.quantity]}",
        steps,
        found.steps.index(found.top),
        tuple(sentences(found)),
        tuple(_peaks(found)),
        found.left_out,
    )


def _peaks(found: Ladder) -> Iterator[Peak]:
    """Measured modes, and those of the top step."""
    m, top = found.measured, found.top
    nothing = np.full(len(m.test), np.nan)
    for source, frequency, sd, damping in (("measured", m.frequency, m.sd, m.damping), (top.name, top.frequency, nothing, top.damping)):
        for t, number, f, error, ratio in zip(m.test.tolist(), m.number.tolist(), frequency, sd, damping, strict=True):
            if np.isfinite(f):
                test = m.observations[t].test
                yield Peak(source, test.id, test.temperature, number, m.kinds.get(number, "unknown"), float(f), float(error), float(ratio))


def _ends(found: Ladder) -> list[int]:
    """The coldest and the hottest test with FRFs, at the lowest speed of those."""
    tests = [(abs(d.condition.speed), d.condition.temperature, t) for t, d in enumerate(found.model.tests) if d.test.frf]
    slow = [w for w in tests if w[0] == min(tests)[0]]
    return sorted({min(slow)[2], max(slow)[2]}) if slow else []


def _levels(found: Ladder, step: Step) -> list[Level]:
    """Measured and computed level at the driving points of two tests, at the campaign's lines inside the band of the spindle."""
    levels = []
    low, high = found.spindle.hammer.band
    for t in _ends(found):
        test = found.model.tests[t].test
        assert test.frf is not None
        computed = response(step, t)
        inside = (test.frf.frequency >= low) & (test.frf.frequency <= high) & (test.frf.frequency > 0)
        points = [n for n in test.frf.reference_nodes if n in test.frf.response_nodes]
        for node in points[:2]:
            measured, own = (decibel(one(np.abs(v), test.frf, (node, node)))[inside] for v in (test.frf.value, computed))
            levels.append(Level(test.id, test.temperature, f"H({node},{node})", test.frf.frequency[inside], measured, own))
    return levels


def response(step: Step, t: int) -> ComplexArray:
    """FRFs (n_resp, n_ref, n) of test `t` as a step's model has them, at the test's lines, in its quantity, with the fitted gains."""
    frf = step.model.tests[t].test.frf
    assert frf is not None
    return step.model.response(t, step.nuisance, step.applied[t], np.maximum(frf.frequency, TINY))


def _tracks(found: Ladder, step: Step) -> list[Track]:
    """Measured and computed frequency of every mode over temperature, at the lowest speed."""
    m = found.measured
    conditions = [o.condition for o in m.observations]
    slowest = min(abs(c.speed) for c in conditions)
    tracks = []
    for number, kind in m.kinds.items():
        own = [
            (conditions[t].temperature, measured, computed)
            for t, n, measured, computed in zip(m.test, m.number, m.frequency, step.frequency, strict=True)
            if n == number and abs(conditions[t].speed) == slowest and np.isfinite(computed)
        ]
        if own:
            temperature, measured, computed = np.array(sorted(own)).T
            tracks.append(Track(f"{number} {kind}", temperature, measured, computed))
    return tracks
