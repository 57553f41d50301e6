"""The log of a turning spindle: what goes in comes out, the model and the orbit move as computed, and it is not large."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb
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
    LINE,
    RANGE,
    _polar,
    line_label,
    motion_figure,
    polar_figure,
    spectrum_figure,
    waterfall_figure,
)
from thermospindle.report.log.read import read_log
from thermospindle.report.log.told import describe
from thermospindle.report.log.turning.blueprint import blueprint, reach
from thermospindle.report.log.turning.runout import log_signals, orbit_pieces, rolling_elements, summary, write_runout_log
from thermospindle.sim.operating import operating_point
from thermospindle.sim.posing import cage_turns, frame_indices, turning_poses
from thermospindle.sim.running.probes import AXIAL, X, Y
from thermospindle.sim.running.runout import runout, with_imperfections
from thermospindle.sim.running.waterfall import LineSpectrum, on_grid, run_up, waterfall

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


def test_spectra_are_drawn_at_their_frequencies_and_levels():
    made = LineSpectrum(100.0, np.array([100.0, 400.0]), np.array([1.0, 1e-1]), np.array([0.0, 1.0]), np.array([250.0]))
    grid = np.linspace(0, 500, 501)
    assert np.flatnonzero(on_grid(made, grid, "radial")).tolist() == [100, 400]
    assert np.flatnonzero(on_grid(made, grid, "axial")).tolist() == [400]
    curve = waterfall_figure([made], "radial", (6.0, 4.0)).axes[0].lines[0]
    height = curve.get_ydata() - curve.get_ydata().min()
    peaks = np.flatnonzero(height > 0)
    assert curve.get_xdata()[peaks] == pytest.approx([100.0, 400.0], abs=0.5)
    assert height[peaks[0]] / height[peaks[1]] == pytest.approx(RANGE / (RANGE - 20))


def test_the_polar_plot_holds_the_band(record):
    lines = {line.get_label(): line.get_ydata() for line in polar_figure(record, (4.0, 3.0)).axes[0].lines}
    mean = lines["repeatable part (RRO)"]
    text = polar_figure(record, (4.0, 3.0)).axes[0].texts[0].get_text()
    quoted = record.values()[X]
    assert f"asynchronous {1e9 * quoted.asynchronous_error:.3g} nm" in text
    assert 1e-9 * np.ptp(mean) == pytest.approx(quoted.synchronous_error, rel=1e-6, abs=1e-15)


# ---------------------------------------------------------------- reading, refusing


def test_the_spectrum_holds_the_strongest_lines_of_both_directions(record):
    """Axial lines far above a strong 1x, and small beside it: the axial panel was empty."""
    far = [replace(g, frequency=40 * record.turning, amplitude=1e-4 * record.lines[0].amplitude, direction="axial") for g in record.lines[:1]]
    few = replace(record, lines=(*(g for g in record.lines if g.direction == "radial"), *far))
    axial = spectrum_figure(few).axes[1]
    assert axial.get_xlim()[1] > 40 * record.turning
    assert len(axial.texts) == 1
    nothing = replace(few, lines=(*few.lines[:-1], replace(far[0], amplitude=1e-12 * record.lines[0].amplitude)))
    assert spectrum_figure(nothing).axes[1].get_xlim()[1] < 40 * record.turning


def test_the_least_squares_circle_lies_above_the_repeatable_part(record):
    """Where both are one circle the dashes are seen on it."""
    polar = motion_figure(record).axes[1]
    named = {line.get_label(): line.get_zorder() for line in polar.lines}
    assert named["least-squares circle (axial: mean)"] > named["repeatable part (RRO)"]


def test_revolutions_go_on_from_each_to_the_next(record):
    """Each was closed on itself: of a motion that does not repeat that drew spokes at 0 degrees."""
    cut = record.by_lines
    [line] = [line for line in motion_figure(record).axes[1].lines if str(line.get_label()).startswith("the first")]
    angle, value = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
    assert len(angle) == LINE * len(cut.angle)
    assert np.diff(angle) == pytest.approx(np.full(len(angle) - 1, 2 * np.pi / len(cut.angle)), rel=1e-6)
    jumps = np.abs(np.diff(value))
    assert jumps[len(cut.angle) - 1 :: len(cut.angle)].max() < 2 * np.delete(jumps, np.s_[len(cut.angle) - 1 :: len(cut.angle)]).max()


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


# ---------------------------------------------------------------- what can be read off


@pytest.mark.parametrize(("largest", "high"), [(82.9, 100.0), (100.0, 100.0), (101.0, 150.0), (2.2, 3.0), (0.061, 0.08), (0.0, 1.0)])
def test_panels_reach_to_a_round_number(largest, high):
    assert reach(largest) == pytest.approx(high)


def test_panels_of_runout_tell_their_range(record, monkeypatch):
    """Their only tick was 0, so that no amplitude could be read."""
    made = []
    monkeypatch.setattr(rrb, "TimeSeriesView", lambda **look: made.append(look) or rrb.Spatial2DView())
    blueprint(record, 100.0, True)
    cut = record.by_lines
    for look, part, values in zip(made, ("RRO", "NRRO"), (cut.repeatable[:3], cut.nonrepeatable[:3]), strict=True):
        high = reach(1e9 * float(np.abs(values).max()))
        assert look["name"].startswith(f"{part} ({'non' * (part == 'NRRO')}repeatable), panel ±{high:g} nm: hub x red, y blue, axial green")
        assert 1e9 * np.abs(values).max() <= high
        assert look["axis_y"].range.as_arrow_array().to_pylist() == [[-high, high]]


def test_the_waterfall_says_what_its_decibels_are_relative_to(spectra):
    title = waterfall_figure(spectra, "radial", (6.6, 4.8)).axes[0].get_title(loc="left")
    assert f"{RANGE:g} dB below the strongest of all, {1e9 * max(s.radial.max() for s in spectra if len(s.radial)):.3g} nm zero to peak" in title
    assert "Dots: natural frequencies" in title


def test_labels_of_a_spectrum_say_the_bearing_and_their_leaders_do_not_cross(record):
    """Twice '2 fb - fc, ball waviness' of bearings of two sizes stood side by side, and a leader went across another."""
    first = next(g for g in record.lines if g.causes and g.causes[0].bearing and not g.repeatable and g.direction == "radial")
    cause, far = first.causes[0], 40 * record.turning
    assert line_label(replace(first, causes=(cause,)), ["lower"], 2) == f"{cause.name}\n{cause.cause}\nlower"
    assert line_label(first, ["lower", "upper"], 2) == f"{cause.name}\n{cause.cause}\nboth bearings"
    assert line_label(first, ["lower", "upper"], 5) == f"{cause.name}\n{cause.cause}\nlower, upper"
    assert line_label(first, ["lower"], 1) == f"{cause.name}\n{cause.cause}"
    close = [replace(first, frequency=far + k, amplitude=a * first.amplitude, causes=(replace(cause, name=f"{k}"),)) for k, a in enumerate((0.02, 1.0, 0.1, 0.5))]
    axes = spectrum_figure(replace(record, lines=(*record.lines[:4], *close))).axes[0]
    leaders = [line.get_xydata() for line in axes.lines if len(line.get_xdata()) == 3]
    assert len(leaders) >= 5
    for one, other in combinations(leaders, 2):
        low, high = sorted((one, other), key=lambda line: line[0, 0])
        assert low[2, 0] < high[2, 0], "labels stand in the order of their lines, so neither upright nor slanted parts meet"
        assert low[1, 1] == high[1, 1] >= max(low[0, 1], high[0, 1])
        assert low[0, 0] == low[1, 0]
