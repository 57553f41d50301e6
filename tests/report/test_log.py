"""The Rerun log: what goes in comes out bit for bit, pictures show what was computed, and no file is half written."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from tests.test_imports import SIMULATES, loaded_by
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.frf import point_rows
from thermospindle.model.scene.reading import load
from thermospindle.report.log import content as log_content
from thermospindle.report.log import run as log
from thermospindle.report.log.blueprint import model_views, shapes_tab
from thermospindle.report.log.read import read_log
from thermospindle.report.log.run import write_log
from thermospindle.report.log.told import describe
from thermospindle.sim import posing
from thermospindle.sim.hammer.test import impact_tests
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run, Step, as_campaign, measured_campaigns
from thermospindle.sim.run import run as chain

HDD = Path(__file__).parents[2] / "scenes" / "hdd_2003"


def identified(point: Any, shift: float) -> Any:
    """What an identification would find: the first four modes, each `shift` (relative) off."""
    rows = point_rows(point.spindle, point.chain)
    own = point.modes[:4]
    return SimpleNamespace(
        frequency=np.array([m.frequency * (1 + shift) for m in own]),
        frequency_sd=np.full(len(own), 0.25),
        damping=np.array([m.damping_ratio for m in own]),
        shape=np.array([rows @ m.shape for m in own]).reshape(len(own), -1),
        status="made up",
    )


@pytest.fixture(scope="module")
def run() -> Run:
    spindle = load(HDD)
    spindle = replace(spindle, hammer=replace(spindle.hammer, hits=2, record_length=0.05))
    points = [operating_point(spindle, Condition(t)) for t in (20.0, 60.0)]
    tests = impact_tests(points)
    steps = tuple(Step(p, t, identified(p, 1e-4)) for p, t in zip(points, tests, strict=True))
    return Run(spindle, steps, measured_campaigns(spindle))


@pytest.fixture(scope="module")
def file(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.rrd"
    write_log(run, path)
    return path


@pytest.fixture(scope="module")
def logged(file: Path) -> dict[str, list[Any]]:
    """Record batches by entity."""
    batches = defaultdict(list)
    for chunk in RrdReader(file).stream():
        batches[chunk.entity_path].append(chunk.to_record_batch())
    return batches


def column(logged: dict[str, list[Any]], entity: str, name: str) -> np.ndarray:
    values = [value for batch in logged[entity] if name in batch.schema.names for value in batch.column(name).to_pylist()]
    return np.array(values)


# ---------------------------------------------------------------- numbers


def test_frfs_come_back_bit_for_bit(run: Run, file: Path) -> None:
    contents = read_log(file)
    tests = log_content.tests_of(run)
    assert list(contents.frfs) == [t.id for t in tests] == ["T20_n0", "T60_n0"]
    for test in tests:
        frf = contents.frfs[test.id]
        assert frf == test.frf  # Frf compares bytes
        assert frf.value.dtype == np.complex128
        assert frf.value.shape == (7, 2, 281)


def test_a_changed_number_is_seen(run: Run, file: Path) -> None:
    frf = read_log(file).frfs["T20_n0"]
    value = frf.value.copy()
    value[3, 1, 7] = np.nextafter(value[3, 1, 7].real, np.inf) + 1j * value[3, 1, 7].imag
    assert replace(frf, value=value) != log_content.tests_of(run)[0].frf


def test_lines_closer_than_one_hertz_keep_their_order(run: Run, tmp_path: Path) -> None:
    step = run.steps[0]
    h1 = step.test.estimate.h1
    fine = replace(h1, frequency=1000 + 0.03 * np.arange(len(h1.frequency)), coherence=None, sd=np.abs(h1.value) / 3)
    changed = replace(step, test=replace(step.test, estimate=replace(step.test.estimate, h1=fine)))
    write_log(replace(run, steps=(changed,)), tmp_path / "fine.rrd")
    assert read_log(tmp_path / "fine.rrd").frfs["T20_n0"] == fine


def test_contents(run: Run, file: Path) -> None:
    contents = read_log(file)
    assert (contents.scene, contents.application) == ("hdd_2003", "thermospindle")
    assert contents.about["title"] == run.spindle.title
    assert contents.temperatures == (20.0, 60.0)
    assert contents.timelines == ("frequency", "slow motion", "temperature", "time")
    assert contents.blueprint
    assert contents.entities["/frf/hammer_2/response_3/coherence/T60_n0"] == 281 + 1  # the series and its look
    assert contents.entities["/records/hammer\\ 1/force/T20_n0"] == 1250 + 1
    assert contents.entities["/bearings/preload/lower"] == 2 + 1
    np.testing.assert_equal([vars(p) for p in contents.peaks], [vars(p) for p in log_content.peaks(run)])


def test_describe_names_what_is_inside(file: Path) -> None:
    text = describe(read_log(file))
    for words in (
        "hdd_2003",
        "with a blueprint",
        "20, 60 C",
        "frequency, slow motion",
        "281 lines from 400 to 6000 Hz",
        "peaks jang_2003, T60: 1026.0",
    ):
        assert words in text


# ---------------------------------------------------------------- pictures


def test_level_phase_and_coherence_are_those_of_the_frf(run: Run, logged: dict[str, list[Any]]) -> None:
    frf = log_content.frf_of(log_content.tests_of(run)[1])
    value = frf.value[frf.response_nodes.index(5), frf.reference_nodes.index(2)]
    series = {
        name: column(logged, f"/frf/hammer_2/response_5/{name}/T60_n0", "Scalars:scalars").ravel()
        for name in ("level", "phase", "coherence")
    }
    np.testing.assert_allclose(10 ** (series["level"] / 20) * np.exp(1j * np.radians(series["phase"])), value, rtol=1e-12)
    assert frf.coherence is not None
    assert np.array_equal(series["coherence"], frf.coherence[frf.response_nodes.index(5), frf.reference_nodes.index(2)])
    assert np.array_equal(column(logged, "/frf/hammer_2/response_5/level/T60_n0", "frequency"), np.round(frf.frequency))


def test_identified_peaks_stand_on_the_curve_and_measured_ones_beside_them(run: Run, logged: dict[str, list[Any]]) -> None:
    frequency = column(logged, "/frf/hammer_1/response_1/level/identified/mode\\ 1", "frequency")
    assert sorted(frequency) == [1000, 1002]  # rows are sorted in time, here frequency
    level = column(logged, "/frf/hammer_1/response_1/level/identified/mode\\ 1", "Scalars:scalars").ravel()
    top = [log_content.decibel(s.test.estimate.h1.value[0, 0]).max() for s in run.steps]
    assert np.all(
        (sorted(level) > np.array(sorted(top)) - 6) & (sorted(level) <= np.array(sorted(top)))
    )  # mode 1 is the highest; lines of 20 Hz hide its tip
    assert np.array_equal(
        column(logged, "/frf/hammer_1/response_1/level/measured/jang_2003\\ T60", "frequency"), [1026, 1550, 1710, 1761, 2049]
    )


def test_measured_modes_are_the_models_of_their_kind_in_order(run: Run) -> None:
    measured = {p.mode: (p.kind, p.frequency) for p in log_content.peaks(run) if p.source == "jang_2003" and p.test == "T20"}
    assert measured == {
        1: ("axial", 1023.0),
        2: ("axial", 1552.0),
        3: ("rocking", 1738.0),
        4: ("rocking", 1788.0),
        5: ("axial", 2068.0),
    }
    table = log_content.summary(run, log_content.peaks(run))
    assert "Modal peaks, Hz: **computed** / identified / *measured*\n" in table
    assert "| 3 rocking | **1795** / 1795 / *1738* | **1775** / 1775 / *1710* |" in table
    alone = replace(run, measured=())
    assert "measured" not in log_content.summary(alone, log_content.peaks(alone)).lower()


def test_an_identified_peak_without_a_mode_is_shown_too(run: Run, tmp_path: Path) -> None:
    steps = tuple(replace(s, identified=identified(s.point, 0.1)) for s in run.steps)  # ten per cent off: no mode's
    strange = replace(run, steps=steps)
    found = [p for p in log_content.peaks(strange) if p.source == "identified"]
    assert [p.mode for p in found[:2]] == [0, 0]
    assert "1102.2 Hz is none of the model's modes" in log_content.summary(strange, log_content.peaks(strange))
    write_log(strange, tmp_path / "run.rrd")
    assert "/frf/hammer_1/response_1/level/identified/mode\\ 0" in read_log(tmp_path / "run.rrd").entities


@pytest.mark.parametrize("mode", range(5))
def test_bodies_of_the_mujoco_model_move_as_the_mode_says(run: Run, mode: int) -> None:
    point = run.steps[0].point
    motion = posing.mode_motion(point, point.modes[mode], posing.CYCLE)
    largest = 0.0
    for body, (place, turn) in posing.poses(point, motion).items():
        for mesh in posing.body_meshes(run.spindle).get(body, []):
            rest = 1e3 * mesh.vertices
            q, w = turn[:, None, :3], turn[:, None, 3:]
            rotated = rest + 2 * np.cross(q, np.cross(q, rest) + w * rest)
            moved = rotated + place[:, None] - rest
            largest = max(largest, float(np.linalg.norm(moved, axis=2).max()))
            if point.modes[mode].kind == "axial" and body != "base":
                assert np.abs(moved[..., 2]).max() > 5 * np.abs(moved[..., :2]).max()
    wanted = 1e3 * posing.VISIBLE * posing.reach(run.spindle)
    assert largest == pytest.approx(wanted, rel=0.05)  # tilts of some 0.15 rad are finite


def test_the_overview_draws_the_modes_that_the_hammers_excite(run: Run) -> None:
    """Not the lowest five: of the two rocking ones, one shape in two planes, only one, and a lateral one instead."""
    content = log_content.shown(run)
    assert [content.modes[i - 1].kind for i in content.drawn] == ["axial", "axial", "rocking", "axial", "lateral"]
    views = [v.name for v in model_views(content)]
    assert views == [*(f"{i} {content.modes[i - 1].kind} {content.modes[i - 1].frequency:.0f} Hz" for i in content.drawn), "Sweep at 1"]
    assert len(shapes_tab(content).contents) == len(content.modes)


def test_bodies_are_lit_from_where_one_looks(run: Run, logged: dict[str, list[Any]]) -> None:
    """By the viewer's light, fixed in its shaders, what faces the eye is bright, and no colour is near that of the ground."""
    hub = next(m for m in posing.body_meshes(run.spindle)["hub"] if len(m.vertices) > 100)
    entity = f"/model/mode_1/hub/{hub.region}"
    normals = column(logged, entity, "Mesh3D:vertex_normals")[0]
    lights = [(1.0, (1.0, 2.0, 3.0)), (0.5, (-1.0, -3.0, -5.0))]
    shade = np.clip(0.2 + sum(strength * np.clip(normals @ d / np.linalg.norm(d), 0, 1) for strength, d in lights), 0, 1)
    eye = np.array([1.8, -1.4, 1.35]) / np.linalg.norm([1.8, -1.4, 1.35])  # of `model_views`
    facing = hub.shaded()[2] @ eye > 0.6
    assert facing.sum() > 20
    assert shade[facing].min() > 0.4
    [albedo] = column(logged, entity, "Mesh3D:albedo_factor")[0]
    assert min(int(albedo) >> 24, int(albedo) >> 16 & 255, int(albedo) >> 8 & 255) >= 0.35 * 255


def test_transforms_of_one_cycle_repeat_over_the_band(run: Run, logged: dict[str, list[Any]]) -> None:
    place = column(logged, "/model/mode_1/hub", "Transform3D:translation")[:, 0]
    frequency = column(logged, "/model/mode_1/hub", "frequency")
    assert (frequency[0], frequency[-1], len(place)) == (400, 5998, 934)
    np.testing.assert_allclose(place[: posing.CYCLE], place[posing.CYCLE : 2 * posing.CYCLE], atol=1e-5)  # float32, mm
    assert np.ptp(place[: posing.CYCLE, 2]) > 1.0


def test_the_sweep_is_largest_at_the_highest_resonance(run: Run) -> None:
    point, frequency = run.steps[0].point, np.arange(400.0, 6000.0, 2.0)
    size = posing.largest_displacement(point, posing.sweep_motion(point, 1, frequency))
    assert frequency[size.argmax()] == pytest.approx(point.modes[0].frequency, abs=4.0)
    assert size.max() == pytest.approx(posing.VISIBLE * posing.reach(run.spindle))


def test_section_grows_with_the_free_expansion_of_the_base(run: Run, logged: dict[str, list[Any]]) -> None:
    vertices = column(logged, "/section/compared/right/stationary", "Mesh3D:vertex_positions")[0]
    factor = column(logged, "/section", "displacement_is_drawn_times")[0, 0]
    grown = (vertices[:, 0].max() - 30.0) / factor
    assert grown == pytest.approx(30.0 * 23e-6 * 40.0, rel=0.1)  # mm; the steel shaft holds it back a little
    left = column(logged, "/section/compared/left/stationary", "Mesh3D:vertex_positions")[0]
    assert left[:, 0].min() == pytest.approx(-30.0)  # 20 C is the reference


def test_a_log_is_inspected_without_what_computes_and_draws(file: Path) -> None:
    loaded = loaded_by("inspect", str(file))
    assert "rerun" in loaded
    assert not loaded & (SIMULATES | {"thermospindle.sim.operating"})


# ---------------------------------------------------------------- files


def test_nothing_half_written(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.rrd"
    path.write_bytes(b"the old one")

    def fail(*_: Any) -> None:
        raise RuntimeError("disk full")

    monkeypatch.setattr(log, "log_records", fail)
    with pytest.raises(RuntimeError, match="disk full"):
        write_log(run, path)
    assert [p.name for p in tmp_path.iterdir()] == ["run.rrd"]
    assert path.read_bytes() == b"the old one"


def test_errors_of_rerun_are_raised_while_writing_only(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def bad(*_: Any) -> None:
        rr.Points3D("no points")  # type: ignore[arg-type]

    monkeypatch.setattr(log, "log_records", bad)
    before = rr.strict_mode()
    with pytest.raises(ValueError):
        write_log(run, tmp_path / "run.rrd")
    assert rr.strict_mode() == before


def test_no_folder(run: Run, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"absent/run\.rrd: its folder does not exist"):
        write_log(run, tmp_path / "absent" / "run.rrd")


def foreign(path: Path) -> None:
    with rr.RecordingStream("another_program") as recording:
        recording.save(path)
        recording.log("x", rr.TextDocument("hello"), static=True)
        recording.disconnect()


def ours_without_content(path: Path) -> None:
    with rr.RecordingStream("thermospindle") as recording:
        recording.save(path)
        recording.log("x", rr.TextDocument("hello"), static=True)
        recording.disconnect()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        pytest.param(lambda path: None, "no such file", id="missing"),
        pytest.param(lambda path: path.mkdir(), "is a folder; a log is a file, *.rrd: none is in it", id="folder"),
        pytest.param(lambda path: path.write_bytes(b""), "not a Rerun log that can be read", id="empty"),
        pytest.param(lambda path: path.write_text("frequency,level\n1,2\n"), "other.rrd: not a Rerun log", id="text"),
        pytest.param(foreign, "is a recording of 'another_program', not of 'thermospindle'", id="foreign"),
        pytest.param(ours_without_content, "not a whole log of thermospindle", id="nothing in it"),
    ],
)
def test_other_files_are_refused_by_name(make: Any, message: str, tmp_path: Path) -> None:
    path = tmp_path / "other.rrd"
    make(path)
    with pytest.raises(BadInput) as error:
        read_log(path)
    assert str(error.value).startswith(f"{path}: ")
    assert message in str(error.value)


@pytest.mark.parametrize("share", [0.001, 0.1, 0.5, 0.9, 0.999])
def test_a_file_cut_short_is_refused(share: float, file: Path, tmp_path: Path) -> None:
    path, whole = tmp_path / "cut.rrd", file.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(BadInput, match=r"cut\.rrd"):
        read_log(path)


def test_tests_are_hit_as_hard_as_their_model_says() -> None:
    """A campaign tells the force of its hits, and effects of the force act by it: it was told one that its model had not."""
    spindle = load(HDD)
    spindle = replace(spindle, hammer=replace(spindle.hammer, hits=1, record_length=0.02, level=5.0))
    made = chain(spindle, [20.0])
    assert [t.level for t in as_campaign(made, "virtual").tests] == [s.point.condition.level for s in made.steps] == [5.0]
