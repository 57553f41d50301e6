"""The Rerun log of a warm-up: its numbers are those of `warmup.csv`, and the section has the colours of its temperatures."""

from __future__ import annotations

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from rich.console import Console

import thermospindle as ts
from tests.conftest import coarse_warmups
from thermospindle.model.bearing.pair import contact_status
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.units import MINUTE, RPM
from thermospindle.report.figures.warmup import figure
from thermospindle.report.log import told
from thermospindle.report.log.drawing import HEAT
from thermospindle.report.log.turning import warmup as log
from thermospindle.report.text.warmup import lost_contact, rows, show_warmup, warmup_json
from thermospindle.sim.warmup import Warmup, warm_up


@pytest.fixture(scope="module")
def warm(spindle: Spindle) -> Warmup:
    with coarse_warmups():
        return warm_up(spindle, 7200 * RPM, 20.0, duration=200.0)


@pytest.fixture(scope="module")
def file(warm: Warmup, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "warmup.rrd"
    log.write_warmup_log(warm, path)
    return path


def test_numbers_come_back_bit_for_bit(warm: Warmup, file: Path) -> None:
    contents = ts.read_log(file)
    assert (contents.kind, contents.scene, contents.timelines, contents.blueprint) == ("warmup", "hdd_2003", ("time",), True)
    header, body = rows(warm)
    table = contents.table("/numbers/warmup")
    assert set(table) == set(header)
    for name, column in zip(header, np.array(body).T, strict=True):
        np.testing.assert_array_equal(table[name], column, err_msg=name)


def test_what_is_drawn_is_what_was_computed(warm: Warmup, file: Path) -> None:
    answer, drawn = warmup_json(warm), log.series(warm)
    assert drawn["bearings/preload"]["both bearings"][0].tolist() == pytest.approx(answer["preload_N"], abs=1e-9)  # rounded, so that a constant one looks constant
    assert drawn["bearings/temperature"]["upper"][0].tolist() == answer["bearings"]["upper"]["temperature_C"]
    assert sum(drawn["bearings/friction heat"][b][0] for b in ("lower", "upper")) == pytest.approx(1e3 * np.array(answer["friction_W"]), rel=1e-12)
    shift = np.array(answer["frequencies_Hz"], float)[:, 0] - answer["frequencies_Hz"][0][0]
    name = f"1 axial {answer['frequencies_Hz'][0][0]:.0f} Hz"
    assert drawn["modes"][name][0].tolist() == shift.tolist()
    contents = ts.read_log(file)
    assert contents.entities["/series/bearings/preload/both\\ bearings"] == len(warm.times) + 1  # the series and its look


def test_the_section_has_the_colours_of_its_temperatures(warm: Warmup, file: Path) -> None:
    """Red where and when the section is hottest, blue all over at the start."""
    colours: dict[str, np.ndarray] = {}
    for chunk in RrdReader(file).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if chunk.entity_path.startswith("/section/") and name.endswith("vertex_colors"):
                packed = np.array(batch.column(name).to_pylist(), np.uint32)
                colours[chunk.entity_path] = (packed[..., None] >> np.array([24, 16, 8])) & 255
    assert set(colours) == {f"/section/{part}/{side}" for part in ("stationary", "rotating") for side in ("left", "right")}
    model = warm.history.model
    for part, span in model.spans.items():
        mesh = model.sections[part].mesh
        own = colours[f"/section/{part}/right"]
        assert own.shape == (len(warm.times), mesh.p.shape[1], 3)
        assert np.abs(own[0] - HEAT[0]).max() <= 1
        corners = warm.history.nodal[:, span][:, : mesh.p.shape[1]]
        k, node = np.unravel_index(np.argmax(corners), corners.shape)
        nearly = (corners[k, node] - warm.history.nodal.min()) / np.ptp(warm.history.nodal)
        wanted = [np.interp(nearly, np.linspace(0, 1, len(HEAT)), channel) for channel in HEAT.T]
        assert own[k, node] == pytest.approx(np.array(wanted), abs=1.0)


def test_corners_come_first_among_nodal_values(warm: Warmup) -> None:
    """On what the colours rest: the heat model's nodes begin with the mesh's corners."""
    from skfem import Basis

    from thermospindle.thermal.mesh import element

    for section in warm.history.model.sections.values():
        corners = section.mesh.p.shape[1]
        assert Basis(section.mesh, element(section.mesh)).doflocs[:, :corners] == pytest.approx(section.mesh.p)


def test_json_and_words(warm: Warmup, file: Path) -> None:
    contents = ts.read_log(file)
    answer = json.loads(json.dumps(told.log_json(contents)))
    assert answer["speed_rpm"] == pytest.approx(7200)
    assert answer["columns"]["preload of lower bearing_N"] == [m.preload["lower"] for m in warm.moments]
    words = told.describe(contents)
    first, last = warm.moments[0], warm.moments[-1]
    assert "warm-up from 20 C in air of 20 C at 7200 rpm" in words
    assert f"preload of lower bearing_N: {first.preload['lower']:.6g} to {last.preload['lower']:.6g}" in words


def test_a_lost_contact_is_said_before_anything_else(warm: Warmup) -> None:
    """Before the table, which has no other sign of it than frequencies of a loose spindle; from the first moment without contact on."""
    state = warm.moments[2].point.state
    bearings = tuple(replace(b, in_contact=b.name != "upper") for b in state.bearings)
    loose = replace(state, bearings=bearings, status=contact_status(bearings))
    moment = replace(warm.moments[2], point=replace(warm.moments[2].point, state=loose))
    assert lost_contact(warm) == ""
    console = Console(width=200, record=True, file=StringIO())
    show_warmup(console, replace(warm, moments=(*warm.moments[:2], moment, *warm.moments[3:])))
    words = console.export_text()
    assert words.startswith(f"The upper bearing lost contact at {warm.times[2] / MINUTE:.3g} min: no preload from there on")
    assert words.index("lost contact") < words.index("Warm-up of")


def test_friction_of_the_table_is_that_of_each_bearing(warm: Warmup) -> None:
    """Each under its own name, as the figure has it, and not the sum of all under the first."""
    console = Console(width=200, record=True, file=StringIO())
    show_warmup(console, warm)
    lines = console.export_text().split("\n\n", 1)[1].splitlines()  # what comes before is a sentence
    first = next(line.split() for line in lines if line.split()[:1] == ["0.00"])
    assert lines[1].split() == ["lower", "lower", "upper"]
    assert lines[2].split()[5:8] == ["preload", "friction", "friction"]
    assert [float(x) for x in first[6:8]] == [round(1e3 * warm.moments[0].friction[b]) for b in ("lower", "upper")]


def test_the_summary_says_start_end_and_steady(warm: Warmup) -> None:
    text = log.summary(warm)
    first, last = warm.moments[0], warm.moments[-1]
    values = " | ".join(f"{m.preload['lower']:.2f}" for m in (first, last, warm.steady))
    assert f"| lower preload, N | {values} |" in text
    assert f"Slowest time constant {warm.time_constant:.0f} s." in text


def test_a_lost_mode_is_null(warm: Warmup, tmp_path: Path) -> None:
    from dataclasses import replace

    frequencies = warm.frequencies.copy()
    frequencies[-1, 0] = np.nan
    log.write_warmup_log(replace(warm, frequencies=frequencies), tmp_path / "lost.rrd")
    column = told.log_json(ts.read_log(tmp_path / "lost.rrd"))["columns"]["mode 1 axial_Hz"]
    assert column[-1] is None
    assert None not in column[:-1]


def test_an_absent_folder(warm: Warmup, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"absent/warmup\.rrd: its folder does not exist"):
        log.write_warmup_log(warm, tmp_path / "absent" / "warmup.rrd")


def test_entities_are_short_paths_of_the_names_in_the_figure(warm: Warmup, file: Path) -> None:
    """They were long titles in escaped letters, regions had no names at all, and nothing said what
    the section's colours between the ends are."""
    entities = [e for e in ts.read_log(file).entities if e.startswith("/series/")]
    assert {e.split("/")[2] for e in entities} == {"regions", "bearings", "modes"}
    assert {"/series/regions/shaft", "/series/bearings/temperature/lower", "/series/bearings/friction\\ heat/upper"} <= set(entities)
    with_names = {t.get_text() for axes in figure(warm).axes for t in axes.texts}
    assert {*log.series(warm)["regions"], *log.series(warm)["bearings/preload"]} <= with_names
    assert set(log.titles(warm)) >= set(log.series(warm))
    key = log.key_to_colours(warm)
    labels = key.labels.as_arrow_array().to_pylist()
    assert (labels[0], labels[-1], len(labels)) == ("20 °C", f"{warm.history.nodal.max():.4g} °C", len(HEAT))


def test_keys_stand_beyond_the_end_of_their_curves() -> None:
    """They covered the curves."""
    assert log.beyond(60.0, ["lower", "upper"]) == pytest.approx(60.0 / (1 - 0.1825))
    assert log.beyond(60.0, ["lower", "x" * 36]) > 2 * 60.0
    assert log.beyond(60.0, []) > 60.0
