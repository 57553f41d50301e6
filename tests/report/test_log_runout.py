"""The log of a turning spindle: what goes in comes out, the model and the orbit move as computed, and it is not large."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from rerun.chunk import RrdReader
from scipy.spatial.transform import Rotation

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing.kinematics import row_kinematics
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM, TO_MM
from thermospindle.report.figures.runout import (
    LEAST,
    _polar,
    spectrum_figure,
)
from thermospindle.report.log.read import read_log
from thermospindle.report.log.told import describe
from thermospindle.report.log.turning.runout import log_signals, orbit_pieces, rolling_elements, summary, write_runout_log
from thermospindle.sim.operating import operating_point
from thermospindle.sim.posing import cage_turns, frame_indices, turning_poses
from thermospindle.sim.running.probes import AXIAL, X, Y
from thermospindle.sim.running.runout import runout, with_imperfections
from thermospindle.sim.running.waterfall import waterfall

SPEED = 7200 * np.pi / 30


@pytest.fixture(scope="module")
def file(record, spectra, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("log") / "runout.rrd"
    write_runout_log(record, spectra, path)
    return path


def test_numbers_come_back_bit_for_bit(record, spectra, file):
    contents = read_log(file)
    cut = record.by_lines
    assert np.array_equal(contents.signals[3:], 1e9 * cut.nonrepeatable[:3].reshape(3, -1))
    assert np.array_equal(contents.signals[:3], 1e9 * np.tile(cut.repeatable[:3], cut.count))
    assert contents.signals[:3] + contents.signals[3:] == pytest.approx(1e9 * cut.value[:3].reshape(3, -1), abs=1e-9)
    assert [contents.about[k] for k in ("temperature_C", "speed_rad_per_s", "revolutions")] == [40.0, SPEED, cut.count]
    assert contents.blueprint
    assert {"time", "speed"} <= set(contents.timelines)
    assert contents.quoted[X]["asynchronous_error"] == record.values()[X].asynchronous_error
    assert set(contents.quoted) == {p.name for p in record.signals.probes}
    assert [g["frequency"] for g in contents.rows("/numbers/lines")] == [g.frequency for g in record.lines]
    assert [g["cause"] for g in contents.rows("/numbers/lines")] == [g.causes[0].cause for g in record.lines]
    assert len(contents.waterfall) == len(spectra)
    for own, other in zip(contents.waterfall, spectra, strict=True):
        assert own["speed_rad_per_s"] == other.speed
        for name in ("frequency", "radial", "axial", "natural"):
            assert np.array_equal(own[name], getattr(other, name))


def test_the_summary_names_every_bearing_that_has_a_part_in_a_line(record):
    """As the terminal and the page do; it named the first of both."""
    shared = next(g for g in record.lines[:16] if len({c.bearing for c in g.causes}) > 1)
    names = ", ".join(dict.fromkeys(c.bearing for c in shared.causes if c.bearing))
    assert f"| {shared.causes[0].name} | {names} {shared.causes[0].cause} |" in summary(record)


def test_the_summary_speaks_of_the_part_that_is_looked_at():
    """A shaft was called a hub, as the disk drive has one; and of a scene without imperfections the head of a table stood over no line."""
    point = operating_point(load(ROOT / "tests" / "scenes" / "inner_turning_spring"), Condition(20.0, SPEED))
    told = summary(runout(point, 0.1, path="linear"))
    assert "| shaft x | " in told
    assert "| shaft axial | " in told
    assert "hub" not in told
    assert "No line: nothing moves." in told
    assert "Strongest lines" not in told


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
    assert read_log(file).entities["/signals"] > 4000
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
        at_rest = Rotation.from_euler("z", -angle[:, None]).apply(TO_MM * np.array(probe.position))
        drawn = translation + Rotation.from_quat(turn).apply(at_rest)
        seen = (drawn[:, axis] - TO_MM * probe.position[axis]) / (TO_MM * factor)
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


def test_rollers_are_drawn_row_by_row_and_go_round_with_their_cage(tmp_path):
    """The tailstock stands on two rows of rollers in front, and on balls behind: its record once ended in a StopIteration."""
    point = operating_point(load("tailstock"), Condition(20.0, 1500 * RPM))
    made = runout(point, 0.1, path="linear")
    [rollers] = point.spindle.roller_bearings
    kind, drawn = rolling_elements(rollers)
    centres = drawn.centers.as_arrow_array().flatten().to_numpy().reshape(-1, 3)
    assert kind == "rollers"
    assert len(centres) == rollers.rows * rollers.rollers
    assert sorted({round(float(z), 3) for z in centres[:, 2]}) == pytest.approx(sorted(TO_MM * (rollers.z + o) for o in rollers.offsets), abs=1e-3)
    assert np.hypot(*centres[:, :2].T) == pytest.approx(TO_MM * rollers.pitch_diameter / 2)
    assert set(cage_turns(made)) == {b.name for b in point.spindle.rolling}
    write_runout_log(made, (), tmp_path / "runout.rrd")
    read_log(tmp_path / "runout.rrd")


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


# ---------------------------------------------------------------- reading, refusing


def test_what_does_not_move_has_no_motion_and_no_spectrum(record):
    """The rounding of an axial probe, 1e-15 nm, was drawn over the whole plot."""
    names = [p.name for p in record.signals.probes]
    k, noise = names.index(AXIAL), 1e-24 * np.random.default_rng(0).normal(size=record.signals.value.shape[-1])
    value, axial = np.array(record.signals.value), tuple(g for g in record.lines if g.direction == "radial")
    value[k] = noise
    drawn = spectrum_figure(replace(record, signals=replace(record.signals, value=value), lines=axial)).axes[1]
    assert [t.get_text() for t in drawn.texts] == ["nothing moves this way"]
    assert not np.ptp(drawn.lines[0].get_ydata())
    cut = record.by_lines
    still = np.array(cut.value)
    still[k] = np.resize(noise, still[k].shape)
    polar = Figure().add_subplot(projection="polar")
    assert isinstance(polar, PolarAxes)
    _polar(polar, replace(cut, value=still, repeatable=np.zeros_like(cut.repeatable)), k, record.values()[AXIAL], "", False, True)
    assert polar.get_ylim()[1] >= LEAST


def test_inspect_tells_what_is_in_it(record, spectra, file, capsys):
    assert main(["inspect", str(file)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "turning at 7200 rpm, 40 C, 30 revolutions" in told
    assert "with a blueprint" in told
    assert f"waterfall of 25 speeds from {spectra[0].speed * 30 / np.pi:.0f} to {spectra[-1].speed * 30 / np.pi:.0f} rpm" in told
    for i, probe in enumerate((X, Y, AXIAL)):
        rro, nrro = (1e9 * np.ptp(part[i]) for part in (record.by_lines.repeatable, record.by_lines.nonrepeatable))
        assert f"{probe}: RRO (repeatable runout) {rro:.1f} nm, NRRO (nonrepeatable) {nrro:.1f} nm peak to valley" in told
    assert f"line {record.lines[0].frequency:.2f} Hz, {record.lines[0].direction}, {1e9 * record.lines[0].amplitude:.2f} nm: " in told
    assert main(["inspect", str(file), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["nonrepeatable_nm"][0]) == len(answer["repeatable_nm"][2]) > 4000
    assert answer["waterfall"][19]["speed_rpm"] == pytest.approx(7200)


def test_a_log_without_waterfall_is_read(record, tmp_path):
    write_runout_log(record, [], tmp_path / "plain.rrd")
    contents = read_log(tmp_path / "plain.rrd")
    assert contents.waterfall == []
    assert "waterfall of" not in describe(contents)


def test_a_log_without_its_record_is_refused(tmp_path):
    """The property says a record of runout, and there is none."""
    recording = rr.RecordingStream("thermospindle", send_properties=False)
    recording.save(tmp_path / "runout.rrd")
    recording.send_property("runout", rr.AnyValues(title="t", scene="s"))
    recording.disconnect()
    with pytest.raises(BadInput, match=r"runout\.rrd: is not a whole log of thermospindle: /signals is missing"):
        read_log(tmp_path / "runout.rrd")


@pytest.mark.parametrize("share", [0.01, 0.5, 0.95])
def test_a_file_cut_short_is_refused(share, file, tmp_path):
    whole = file.read_bytes()
    path = tmp_path / "cut.rrd"
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(BadInput, match=r"cut\.rrd"):
        read_log(path)


def test_nothing_is_left_half_written(record, tmp_path, monkeypatch):
    with pytest.raises(BadInput, match="its folder does not exist"):
        write_runout_log(record, [], tmp_path / "absent" / "runout.rrd")
    monkeypatch.setattr("thermospindle.report.log.turning.runout.summary", lambda runout: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_runout_log(record, [], tmp_path / "runout.rrd")
    assert list(tmp_path.iterdir()) == []
