"""What the Rerun log of a ladder shows, as plain numbers for `report.log.ladder`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from thermospindle.diagnosis.data.observe import condition_of
from thermospindle.diagnosis.ladder.ladder import Ladder
from thermospindle.diagnosis.ladder.rung import Rung, frequencies
from thermospindle.model.types import ComplexArray
from thermospindle.report.figures.ladder import pull_map
from thermospindle.report.log.content import Peak, decibel, one
from thermospindle.report.log.ladder import Level, ShownLadder, ShownRung, Track
from thermospindle.report.text.ladder import sentences
from thermospindle.report.text.ladder_table import cells
from thermospindle.sim.campaign.beside import Beside, measured_at
from thermospindle.sim.operating import operating_point, provenance

TINY = 1e-3  # Hz, instead of zero, where a receptance has no level
UNITS = {"receptance": "m/N", "mobility": "(m/s)/N", "accelerance": "(m/s²)/N"}


def shown(found: Ladder) -> ShownLadder:
    maps = [pull_map(found, r) for r in found.rungs]
    rungs = tuple(
        ShownRung(r.name, cells(r), r.error, r.held_out, m.frequency, tuple(_levels(found, r)), tuple(_tracks(found, r)))
        for r, m in zip(found.rungs, maps, strict=True)
    )
    quantity = found.campaign.quantity
    return ShownLadder(
        provenance(found.spindle),
        f"{found.campaign.title} against scene {found.spindle.name}",
        tuple(maps[0].modes),
        tuple(maps[0].tests),
        f"dB re 1 {UNITS[quantity]}",
        rungs,
        found.rungs.index(found.top),
        tuple(sentences(found)),
        tuple(_peaks(found)),
    )


def _peaks(found: Ladder) -> Iterator[Peak]:
    """Measured modes, and those of the top rung."""
    data, top = found.theory.data, found.top
    damping = {(f.test, f.mode): k for k, f in enumerate(data.features) if f.what == "damping"}
    for source in ("measured", top.name):
        values = data.value if source == "measured" else data.value - top.residual
        for k, f in enumerate(data.features):
            if f.what == "frequency":
                test, number = data.observations[f.test].test, int(found.mode[k])
                frequency = float(np.exp(values[k]))
                sd = frequency * float(data.sd[k]) if source == "measured" else np.nan
                ratio = float(np.exp(values[damping[f.test, f.mode]])) if (f.test, f.mode) in damping else np.nan
                yield Peak(source, test.id, test.temperature, number, found.kinds.get(number, "unknown"), frequency, sd, ratio)


def _ends(found: Ladder) -> list[int]:
    """The coldest and the hottest test with FRFs, at the lowest speed of those."""
    tests = [(abs(o.condition.speed), o.condition.temperature, t) for t, o in enumerate(found.theory.data.observations) if o.test.frf]
    slow = [w for w in tests if w[0] == min(tests)[0]]
    return sorted({min(slow)[2], max(slow)[2]}) if slow else []


def _levels(found: Ladder, rung: Rung) -> list[Level]:
    """Measured and computed level at the driving points of two tests, at the campaign's lines inside the band of the spindle."""
    levels = []
    low, high = found.spindle.hammer.band
    for t in _ends(found):
        test = found.theory.data.observations[t].test
        assert test.frf is not None
        computed = response(found, rung, t)
        inside = (test.frf.frequency >= low) & (test.frf.frequency <= high) & (test.frf.frequency > 0)
        points = [n for n in test.frf.reference_nodes if n in test.frf.response_nodes]
        for node in points[:2]:
            measured, own = (decibel(one(np.abs(v), test.frf, (node, node)))[inside] for v in (test.frf.value, computed))
            levels.append(Level(test.id, test.temperature, f"H({node},{node})", test.frf.frequency[inside], measured, own))
    return levels


def response(found: Ladder, rung: Rung, t: int) -> ComplexArray:
    """FRFs (n_resp, n_ref, n) of test `t` as a rung's model has them, at the test's lines, in its quantity, with the fitted gains."""
    about = found.theory
    test = about.data.observations[t].test
    assert test.frf is not None
    condition = condition_of(test)
    spindle = measured_at(about.built(rung.nuisance), found.campaign.points, test.frf)
    warm = replace(condition, temperature=condition.temperature + about.warmer(rung.nuisance)[t])
    value = Beside(test, test.frf, operating_point(spindle, warm, (*about.present, *rung.applied))).computed(
        np.maximum(test.frf.frequency, TINY)
    )
    gain = np.ones(len(value))
    fitted = rung.nuisance[len(rung.nuisance) - about.channels :]
    gain[: len(fitted)] += fitted
    return np.asarray(value * gain[:, None, None], complex)


def _tracks(found: Ladder, rung: Rung) -> list[Track]:
    """Measured and computed frequency of every mode over temperature, at the lowest speed."""
    data = found.theory.data
    measured, computed = frequencies(found.theory, rung.residual)
    slowest = min(abs(o.condition.speed) for o in data.observations)
    rows = [k for k, f in enumerate(data.features) if f.what == "frequency"]
    tracks = []
    for number, kind in found.kinds.items():
        own = [
            (data.observations[data.features[k].test].condition.temperature, measured[i], computed[i])
            for i, k in enumerate(rows)
            if found.mode[k] == number and abs(data.observations[data.features[k].test].condition.speed) == slowest
        ]
        if own:
            temperature, m, c = np.array(sorted(own)).T
            tracks.append(Track(f"{number} {kind}", temperature, m, c))
    return tracks
