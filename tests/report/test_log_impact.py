"""The Rerun log of an impact test: every sample of every hit and every FRF comes back, bit for bit, and views show what the log holds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

import thermospindle as ts
from tests.small_run import small_run
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.scene.reading import load
from thermospindle.report.figures.run import panels
from thermospindle.report.log import impact as log
from thermospindle.report.log.blueprint import framed
from thermospindle.report.log.content import decibel, peaks, shown
from thermospindle.report.log.drawing import HEAT
from thermospindle.report.log.run import MEASURED
from thermospindle.report.log.told import describe
from thermospindle.sim import posing
from thermospindle.sim.hammer.test import estimate_of
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture(scope="module")
def run(spindle: Spindle) -> Run:
    return small_run(spindle, [40.0], ())


@pytest.fixture(scope="module")
def two_hits(run: Run) -> Run:
    """The records once more as a second hit, half as hard."""
    [step] = run.steps
    record, settings = step.test.record, replace(step.test.settings, hits=2)
    twice = replace(record, force=np.concatenate([record.force, record.force / 2], axis=1), velocity=np.concatenate([record.velocity, record.velocity / 2], axis=1))
    spindle = replace(run.spindle, hammer=replace(run.spindle.hammer, hits=2))
    test = replace(step.test, record=twice, settings=settings, estimate=estimate_of(settings, step.point, twice))
    return replace(run, spindle=spindle, steps=(replace(step, test=test),))


@pytest.fixture(scope="module")
def file(two_hits: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "impact.rrd"
    log.write_impact_log(two_hits, path)
    return path


def test_every_sample_of_every_hit_comes_back_bit_for_bit(two_hits: Run, file: Path) -> None:
    record, found = two_hits.steps[0].test.record, ts.read_log(file).records
    assert list(found) == list(two_hits.spindle.hammer.hammer_nodes)
    for k, own in enumerate(found.values()):
        np.testing.assert_array_equal(own.time, record.time)
        np.testing.assert_array_equal(own.force, record.force[k])
        np.testing.assert_array_equal(own.velocity, record.velocity[k])
    assert found[1].velocity.shape == (2, 7, 2500)


def test_frfs_and_peaks_come_back(two_hits: Run, file: Path) -> None:
    contents = ts.read_log(file)
    [frf] = contents.frfs.values()
    assert frf["hub_top0", "hub_top0"] is not None  # nodes by name
    h1 = two_hits.steps[0].test.estimate.h1
    assert (frf.value == h1.value).all()
    assert frf.coherence is not None
    np.testing.assert_array_equal(frf.coherence, h1.coherence)
    np.testing.assert_equal([vars(p) for p in contents.peaks], [vars(p) for p in peaks(two_hits)])
    assert contents.temperatures == (40.0,)
    assert contents.timelines == ("frequency", "slow motion", "time")


def test_words_tell_of_the_records(two_hits: Run, file: Path) -> None:
    most = two_hits.steps[0].test.record.force[0].max()
    assert f"records of hammer 1: 2 hits of 2500 samples to 0.09996 s, 7 responses, {most:.3g} N at most" in describe(ts.read_log(file))


def test_a_run_has_no_records_to_give(tmp_path: Path, run: Run) -> None:
    from thermospindle.report.log.run import write_log

    write_log(run, tmp_path / "run.rrd")
    assert ts.read_log(tmp_path / "run.rrd").records == {}


def viewed(file: Path) -> set[str]:
    """The entities that the views of a log show."""
    [blueprint] = RrdReader(file).blueprints()
    told: list[Any] = []
    for chunk in RrdReader(file).stream(store=blueprint):
        batch = chunk.to_record_batch()
        told += [v for name in batch.schema.names if name.endswith(("space_origin", "query")) for v in batch.column(name).to_pylist()]
    return {path for values in told for path in values or () if path.startswith("/")}


def test_views_name_what_is_in_the_log(file: Path) -> None:
    wanted, there = viewed(file), ts.read_log(file).entities
    assert "/frf/hammer_1/response_1/coherence" in wanted
    assert {f"/records/hammer\\ {h}/hit\\ {k}/{what}" for h in (1, 2) for k in (1, 2) for what in ("force", "velocity")} <= wanted
    for path in wanted:
        assert any(entity == path or entity.startswith(f"{path}/") for entity in there), path


def test_a_single_hit_has_no_coherence_to_show(run: Run, tmp_path: Path) -> None:
    log.write_impact_log(run, tmp_path / "impact.rrd")
    there = ts.read_log(tmp_path / "impact.rrd")
    assert not [path for path in (*there.entities, *viewed(tmp_path / "impact.rrd")) if "coherence" in path]
    assert all(frf.coherence is None and frf.sd is None for frf in there.frfs.values())  # nor scatter


def test_the_picture_shows_the_pulse(two_hits: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: dict[str, Any] = {}
    panels = log.figures.panels
    monkeypatch.setattr(log.figures, "panels", lambda titled, *more: (drawn.update(titled), panels(titled, *more))[1])
    log.write_impact_log(two_hits, tmp_path / "impact.rrd")
    record = two_hits.steps[0].test.record
    for k, curves in enumerate((drawn["force at 1, N"], drawn["force at 2, N"])):
        assert [y.max() for _, y, _ in curves] == record.force[k].max(axis=1).tolist()
    assert [1e-3 * np.abs(y).max() for _, y, _ in drawn["velocity at 1, mm/s"]] == pytest.approx(np.abs(record.velocity[0, :, 0]).max(axis=1), rel=1e-12)


# ------------------------------------------------------------ any spindle


@pytest.mark.parametrize(("scene", "long"), [("hdd_2003", False), ("five_bearing", True), ("free_shaft", True)])
def test_a_view_holds_the_whole_spindle(scene: str, long: bool) -> None:
    """A long one is looked at in its middle, from so far that both its ends are in sight."""
    spindle = load(SCENES / scene)
    is_long, reach, middle = framed(spindle)
    assert is_long == long
    if long:
        heights = [1e3 * p.position[2] for p in spindle.points]
        assert middle - 1.01 * reach < min(heights) < max(heights) < middle + 1.01 * reach


def test_a_long_shaft_is_seen_to_bend() -> None:
    """By as much of half its length as a disk's spindle moves of its radius; a mode and a swept force alike."""
    spindle = load(SCENES / "mk7702")
    point = operating_point(spindle, Condition(20.0))
    half = 0.711 / 2
    mode = posing.mode_motion(point, point.modes[1], 20)
    swept = posing.sweep_motion(point, 1, np.linspace(300.0, 4000.0, 400))
    for motion in (mode, swept):
        assert posing.largest_displacement(point, motion).max() == pytest.approx(posing.VISIBLE * half)
    assert framed(spindle)[1] == pytest.approx(1e3 * half)


def test_a_response_that_vanishes_by_symmetry_does_not_set_the_limits(run: Run) -> None:
    [step] = run.steps
    h1 = step.test.estimate.h1
    value = h1.value.copy()
    value[h1.response_nodes.index(2), h1.reference_nodes.index(1)] *= 1e-6
    less = replace(run, steps=(replace(step, test=replace(step.test, estimate=replace(step.test.estimate, h1=replace(h1, value=value)))),))
    others = [h1.value[h1.response_nodes.index(r), h1.reference_nodes.index(h)] for r, h in shown(run).pairs if (r, h) != (2, 1)]
    assert shown(less).level[0] == 10 * np.floor(np.percentile(decibel(np.array(others)), 0.5) / 10) - 5
    assert shown(less).level[1] == shown(run).level[1]


def test_colours_of_hits_are_no_temperatures_and_have_a_key(two_hits: Run, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They were blue and red beside blue and red of temperatures, without a word; and measured
    modes at two temperatures were two like greens."""
    keys = []
    monkeypatch.setattr(log.figures, "panels", lambda *args: keys.append(args[4]) or panels(*args))
    with rr.RecordingStream("thermospindle") as recording:
        log.log_records(recording, shown(two_hits))
    assert list(keys[0]) == ["hit 1", "hit 2"]
    for paint in log.HITS:
        others = np.array([*HEAT, *(m[0] for m in MEASURED)])
        assert np.abs(others - paint).max(axis=1).min() > 40
    (first, mark, _), (second, other, _) = MEASURED
    assert np.abs(np.subtract(first, second)).max() > 100
    assert mark != other
