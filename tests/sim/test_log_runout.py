"""The log of a turning spindle: what goes in comes out, the model and the orbit move as computed, and it is not large."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from model.imperfections import Imperfections
from model.kinematics import row_kinematics
from model.machine import Condition
from model.scene import BadInput
from sim.log_drawing import MM
from sim.log_read import contents_of, open_log
from sim.log_runout import log_signals, write_runout_log
from sim.log_runout_read import describe_runout, is_runout, runout_contents
from sim.operating import operating_point
from sim.runout import X, Y, runout, with_imperfections
from sim.runout_drawing import RANGE, cage_turns, frame_indices, orbit_pieces, polar, turning_poses, waterfall_chart
from sim.waterfall import LineSpectrum, on_grid, run_up, waterfall
from spindle import main

SPEED = 7200 * np.pi / 30


@pytest.fixture(scope="module")
def record(spindle):
    return runout(operating_point(spindle, Condition(40.0, SPEED)), 0.25, path="linear")


@pytest.fixture(scope="module")
def spectra(spindle):
    return waterfall(spindle, 40.0, run_up(SPEED))


@pytest.fixture(scope="module")
def file(record, spectra, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "runout.rrd"
    write_runout_log(record, spectra, path)
    return path


def test_numbers_come_back_bit_for_bit(record, spectra, file):
    contents = runout_contents(open_log(file))
    cut = record.by_lines
    assert np.array_equal(contents.nonrepeatable, 1e9 * cut.nonrepeatable[:3].reshape(3, -1))
    assert np.array_equal(contents.repeatable, 1e9 * np.tile(cut.repeatable[:3], cut.count))
    assert contents.repeatable + contents.nonrepeatable == pytest.approx(1e9 * cut.value[:3].reshape(3, -1), abs=1e-9)
    assert (contents.temperature, contents.speed, contents.revolutions, contents.blueprint) == (40.0, SPEED, cut.count, True)
    assert {"time", "speed"} <= set(contents.timelines)
    assert contents.quoted[X]["asynchronous_error"] == record.values()[X].asynchronous_error
    assert set(contents.quoted) == {p.name for p in record.signals.probes}
    assert [g["frequency"] for g in contents.lines] == [g.frequency for g in record.lines]
    assert [g["cause"] for g in contents.lines] == [g.causes[0].cause for g in record.lines]
    assert len(contents.spectra) == len(spectra)
    for own, other in zip(contents.spectra, spectra, strict=True):
        assert own.speed == other.speed
        for name in ("frequency", "radial", "axial", "natural"):
            assert np.array_equal(getattr(own, name), getattr(other, name))


def test_a_logged_value_costs_at_most_25_bytes(record, file, tmp_path):
    """The whole file, model and drawings included, over the values of its series: RRO and NRRO of three probes at every sample."""
    values = 6 * record.averaged.value[0].size
    alone = tmp_path / "signals.rrd"
    recording = rr.RecordingStream("thermospindle", send_properties=False)
    recording.save(alone)
    log_signals(recording, record)
    recording.disconnect()
    assert alone.stat().st_size / values < 14
    longer = runout(record.point, 0.5, path="linear")
    write_runout_log(longer, [], tmp_path / "longer.rrd")
    write_runout_log(record, [], tmp_path / "shorter.rrd")
    grown = (tmp_path / "longer.rrd").stat().st_size - (tmp_path / "shorter.rrd").stat().st_size
    assert grown / (6 * longer.averaged.value[0].size - values) < 25
    assert (tmp_path / "longer.rrd").stat().st_size / (6 * longer.averaged.value[0].size) < 25


def test_series_are_sent_in_columns(file):
    """One row a sample in few chunks, not a chunk a sample."""
    chunks: dict[str, int] = {}
    for chunk in RrdReader(file).stream():
        chunks[chunk.entity_path] = chunks.get(chunk.entity_path, 0) + 1
    assert open_log(file).rows["/signals"] > 4000
    assert chunks["/signals"] <= 10
    assert chunks["/orbit/growing"] <= 10
    assert chunks["/model/hub"] <= 10


def test_the_drawn_hub_stands_where_the_probe_sees_it(record):
    """The material point under a probe, turned by the spin and moved by the pose, lies where the probe's signal says, enlarged."""
    moved, factor = turning_poses(record, 0.0004)
    assert factor >= 10
    translation, turn = moved["hub"]
    frames = frame_indices(record)
    angle = record.signals.angle[frames]
    for name, axis in ((X, 0), (Y, 1)):
        probe = next(p for p in record.signals.probes if p.name == name)
        at_rest = Rotation.from_euler("z", -angle[:, None]).apply(MM * np.array(probe.position))
        drawn = translation + Rotation.from_quat(turn).apply(at_rest)
        seen = (drawn[:, axis] - MM * probe.position[axis]) / (MM * factor)
        largest = np.abs(record.signals.of(name)).max()
        assert seen == pytest.approx(record.signals.of(name)[frames], abs=1e-3 * largest)  # of second order in the enlarged tilt
    still = moved["base"][1]
    assert np.abs(still[:, 2]).max() < 1e-12  # the base does not spin


def test_balls_go_round_with_the_cage(record):
    kin = row_kinematics(record.point.spindle, record.point.state)["upper"]
    turned = np.unwrap(Rotation.from_quat(cage_turns(record)["upper"]).as_euler("zyx")[:, 0])
    time = record.signals.time[frame_indices(record)]
    assert (turned[-1] - turned[0]) / (time[-1] - time[0]) == pytest.approx(kin.cage, rel=1e-9)
    assert kin.cage / (2 * np.pi) == pytest.approx(69.44, abs=0.01)


def test_the_orbit_grows_without_gaps(record):
    cut = record.by_lines
    x, y = (cut.value[i].ravel() for i in (0, 1))
    pieces, ends = orbit_pieces(x, y, len(cut.angle))
    assert len(pieces) == len(ends) >= 8 * cut.count - 1
    for before, after in pairwise(pieces):
        assert np.array_equal(before[-1], after[0])
    whole = np.concatenate([pieces[0], *(p[1:] for p in pieces[1:])])
    assert np.array_equal(whole, 1e9 * np.stack([x, -y], axis=1))


def test_the_waterfall_at_the_speed_of_the_record_has_its_lines(record, spectra):
    own = next(s for s in spectra if s.speed == pytest.approx(SPEED))
    for g in record.lines[:6]:
        near = np.abs(own.frequency - g.frequency) < 2.5  # the record of a quarter second tells as one what lies within half a bin of 4 Hz
        amplitude = (own.radial if g.direction == "radial" else own.axial)[near]
        assert amplitude.max() <= g.amplitude * 1.6
        assert amplitude.sum() >= g.amplitude * (1 - 1e-6)


def test_unbalance_grows_with_the_square_of_the_speed_far_below_resonance(spindle):
    unbalanced = with_imperfections(spindle, Imperfections(unbalance=1e-8, unbalance_z=0.01))
    slow, fast = waterfall(unbalanced, 20.0, [SPEED / 4, SPEED / 2])
    assert slow.frequency == pytest.approx([30.0])
    assert fast.radial[0] / slow.radial[0] == pytest.approx(4.0, rel=2e-3)  # 60 Hz against a first rocking mode at 1.8 kHz: 1.001


def test_spectra_are_drawn_at_their_frequencies_and_levels():
    made = LineSpectrum(100.0, np.array([100.0, 400.0]), np.array([1.0, 1e-1]), np.array([0.0, 1.0]), np.array([250.0]))
    grid = np.linspace(0, 500, 501)
    assert np.flatnonzero(on_grid(made, grid, "radial")).tolist() == [100, 400]
    assert np.flatnonzero(on_grid(made, grid, "axial")).tolist() == [400]
    chart = waterfall_chart([made], "radial", 566.0, 400.0)
    curve = chart.strips[0]
    height = curve[:, 1].max() - curve[:, 1]
    peaks = np.flatnonzero(height > 0)
    assert np.diff(curve[peaks, 0]) == pytest.approx([300.0])  # one unit a hertz in this width
    assert height[peaks[0]] / height[peaks[1]] == pytest.approx(RANGE / (RANGE - 20))


def test_the_polar_drawing_holds_the_band(record):
    drawing = polar(record, 0, 150.0)
    radius = [np.hypot(*(strip - 150.0).T) for strip in drawing.strips]
    high, low, mean = radius[-3], radius[-2], radius[-1]
    assert np.all(low <= mean + 1e-9)
    assert np.all(mean <= high + 1e-9)
    told = record.values()[X]
    assert (high - low).max() / told.asynchronous_error == pytest.approx((high.max() - low.min()) / told.total_error, rel=1e-6)
    assert "asynchronous" in drawing.labels[2]


# ---------------------------------------------------------------- reading, refusing


def test_inspect_tells_what_is_in_it(file, capsys):
    assert main(["inspect", str(file)]) == 0
    told = capsys.readouterr().out
    assert "turning at 7200 rpm, 40 C, 30 revolutions" in told
    assert "with a blueprint" in told
    assert "waterfall of 25 speeds" in told
    assert main(["inspect", str(file), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["nonrepeatable_nm"][0]) == len(answer["repeatable_nm"][2]) > 4000
    assert answer["waterfall"][19]["speed_rpm"] == pytest.approx(7200)


def test_a_log_without_waterfall_is_read(record, tmp_path):
    write_runout_log(record, [], tmp_path / "plain.rrd")
    contents = runout_contents(open_log(tmp_path / "plain.rrd"))
    assert contents.spectra == ()
    assert "waterfall of" not in describe_runout(contents)


def test_a_log_of_a_run_is_not_one_of_runout(file):
    opened = open_log(file)
    assert is_runout(opened)
    with pytest.raises(BadInput, match=r"runout\.rrd: is not a whole log"):
        contents_of(opened)


@pytest.mark.parametrize("share", [0.01, 0.5, 0.95])
def test_a_file_cut_short_is_refused(share, file, tmp_path):
    whole = file.read_bytes()
    path = tmp_path / "cut.rrd"
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(BadInput, match=r"cut\.rrd"):
        runout_contents(open_log(path))


def test_nothing_is_left_half_written(record, tmp_path, monkeypatch):
    with pytest.raises(BadInput, match="its folder does not exist"):
        write_runout_log(record, [], tmp_path / "absent" / "runout.rrd")
    monkeypatch.setattr("sim.log_runout.summary", lambda runout: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_runout_log(record, [], tmp_path / "runout.rrd")
    assert list(tmp_path.iterdir()) == []
