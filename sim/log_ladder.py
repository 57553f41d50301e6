"""The Rerun log of a ladder: on the timeline `rung` everything moves as one model after the other takes its place.

Rerun shows one timeline at a time, so FRFs and the pull map stand as drawings on `rung`; the same FRFs stand as series on the
timeline `frequency`, measured and of every rung on one axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from model.ball_row import Array
from sim.log_columns import curve_look, draw, log_curve, log_peak_numbers, over_frequency, whole_log
from sim.log_content import Peak
from sim.log_drawing import Colours, Curve, Drawing, charts

MEASURED, COMPUTED, HELD_OUT = np.array([(120, 255, 140), (255, 170, 80), (90, 200, 255)], np.uint8)
FRAME, MARK = np.array([(60, 60, 66), (150, 150, 158)], np.uint8)
LOW, ZERO, HIGH = np.array([(70, 120, 255), (38, 38, 42), (255, 60, 60)], float)
DARK = (13, 13, 15)
SIZES = {"error": (560.0, 225.0), "pulls": (560.0, 345.0), "responses": (830.0, 790.0)}
PANELS = 2  # columns of the FRF drawings
FLOOR = 80.0  # dB below the top that FRF drawings show
LINEAR = 3.0  # standard errors, about where the colours of the pull map turn from linear to logarithmic


@dataclass(frozen=True, eq=False)
class Level:
    """Measured and computed level (n,) dB of one FRF of one test."""

    test: str
    temperature: float  # C
    name: str
    frequency: Array  # (n,) Hz
    measured: Array
    computed: Array


@dataclass(frozen=True, eq=False)
class Track:
    """Measured and computed frequency (n,) Hz of one mode over temperature (n,) C."""

    mode: str
    temperature: Array
    measured: Array
    computed: Array


@dataclass(frozen=True, eq=False)
class ShownRung:
    name: str
    cells: tuple[str, ...]  # of its row of the table
    error: float  # rms pull
    held_out: float
    pulls: Array  # (modes, tests), NaN where not measured
    levels: tuple[Level, ...]  # none for a campaign of mode tables
    tracks: tuple[Track, ...]


@dataclass(frozen=True, eq=False)
class ShownLadder:
    provenance: Mapping[str, str]
    title: str
    modes: tuple[str, ...]
    tests: tuple[str, ...]
    unit: str  # of the levels
    rungs: tuple[ShownRung, ...]
    top: int  # index of the rung that the ladder leads to
    sentences: tuple[str, ...]
    peaks: tuple[Peak, ...]  # measured, and computed on the top rung


def write_ladder_log(content: ShownLadder, path: Path) -> None:
    """Write the log of a ladder, whole or not at all. BadInput if its folder does not exist."""
    with whole_log(path) as (recording, partial):
        _write(content, recording, partial)


def _write(content: ShownLadder, recording: rr.RecordingStream, file: Path) -> None:
    recording.save(file, default_blueprint=_blueprint(content))
    recording.set_log_time_enabled(False)
    recording.send_recording_name(content.title)
    about: dict[str, Any] = {"title": content.title, **content.provenance}
    recording.send_property("run", rr.AnyValues(**about))
    log_peak_numbers(recording, content.peaks)
    numbers: dict[str, Any] = {"names": [r.name for r in content.rungs], "error": [r.error for r in content.rungs], "top": content.top}
    recording.log("numbers/rungs", rr.AnyValues(**numbers), static=True)
    for k, rung in enumerate(content.rungs, 1):
        recording.set_time("rung", sequence=k)
        draw(recording, "charts/error", errors(content, k - 1), static=False)
        recording.log("charts/pulls/map", rr.Image(pull_image(content, rung)))
        draw(recording, "charts/pulls", pull_labels(content, rung), static=False)
        draw(recording, "charts/responses", responses(content, rung), static=False)
        recording.log("rung", rr.TextDocument(words(content, k - 1), media_type=rr.MediaType.MARKDOWN))
        for name, value in (("all data", rung.error), ("left-out temperatures", rung.held_out)):
            recording.log(rr.new_entity_path(["error", name]), rr.Scalars(value))
    for name, colour in (("all data", COMPUTED), ("left-out temperatures", HELD_OUT)):
        recording.log(rr.new_entity_path(["error", name]), rr.SeriesLines(colors=[colour], names=name), static=True)
    log_levels(recording, content)


def log_levels(recording: rr.RecordingStream, content: ShownLadder) -> None:
    """FRFs on the timeline `frequency` (whole Hz): measured, and of every rung, the later the brighter."""
    for i, level in enumerate(content.rungs[0].levels):
        times = over_frequency(level.frequency)
        origin = _level_path(level)
        curves = [("measured", level.measured, MEASURED, 2.0)]
        for k, rung in enumerate(content.rungs):
            bright = COMPUTED * (0.35 + 0.65 * (k / max(len(content.rungs) - 1, 1)))
            curves.append((f"{k + 1} {rung.name}", rung.levels[i].computed, bright.astype(np.uint8), 1.0 if k != content.top else 2.0))
        for name, values, colour, width in curves:
            log_curve(recording, rr.new_entity_path([*origin, name]), times, values, curve_look(colour, name, width))


def _level_path(level: Level) -> list[str]:
    return ["frf", level.test, level.name]


# ---------------------------------------------------------------- drawings of one rung


def errors(content: ShownLadder, now: int) -> Drawing:
    """Decimal logarithm of the rms pull over the rungs, with a mark at the present one."""
    place = np.arange(1.0, len(content.rungs) + 1)
    curves = [(np.log10([getattr(r, key) for r in content.rungs]), colour) for key, colour in (("held_out", HELD_OUT), ("error", COMPUTED))]
    ends = [float(f(np.concatenate([c for c, _ in curves]))) for f in (np.min, np.max)]
    here = Curve(np.full(2, now + 1.0), np.array(ends), MARK)
    panel = [_frame(place, ends), here, *(Curve(place, values, colour) for values, colour in curves)]
    width, height = SIZES["error"]
    return charts([("lg rms pull: all data orange, left-out temperatures blue", "rung", panel)], 1, width, height)


def _frame(x: Array, ends: Sequence[float]) -> Curve:
    """A line at the left end that keeps the axes of a chart as they are on all rungs."""
    return Curve(np.array([x[0], x[0]]), np.array(ends), FRAME)


def responses(content: ShownLadder, rung: ShownRung) -> Drawing:
    """Measured and computed FRFs on one axis, or frequencies over temperature where there are no FRFs."""
    width, height = SIZES["responses"]
    if rung.levels:
        rows = -(-len(rung.levels) // PANELS)
        panels = [_level_panel(content, i, level) for i, level in enumerate(rung.levels)]
        return charts(panels, PANELS, width / PANELS, height / rows)
    columns = 3 if len(rung.tracks) > 4 else 2
    rows = -(-len(rung.tracks) // columns)
    tracks = [_track_panel(content, i, track) for i, track in enumerate(rung.tracks)]
    return charts(tracks, columns, width / columns, height / rows)


def _level_panel(content: ShownLadder, i: int, level: Level) -> tuple[str, str, list[Curve]]:
    every = np.concatenate([level.measured, *(r.levels[i].computed for r in content.rungs)])
    top = float(every.max())
    ends = (max(float(every.min()), top - FLOOR), top)
    measured, computed = (np.clip(v, *ends) for v in (level.measured, level.computed))
    curves = [_frame(level.frequency, ends), Curve(level.frequency, measured, MEASURED), Curve(level.frequency, computed, COMPUTED)]
    return f"{level.name}, {level.test}, {content.unit}", "Hz", curves


def _track_panel(content: ShownLadder, i: int, track: Track) -> tuple[str, str, list[Curve]]:
    every = np.concatenate([track.measured, *(r.tracks[i].computed for r in content.rungs)])
    ends = (float(every.min()), float(every.max()))
    curves = [_frame(track.temperature, ends), Curve(track.temperature, track.measured, MEASURED)]
    return f"mode {track.mode}, Hz", "°C", [*curves, Curve(track.temperature, track.computed, COMPUTED)]


def pull_colours(pulls: Array, largest: float) -> Colours:
    """Colours (..., 3): blue for computed too low, red for too high, dark for none or not measured."""
    size = np.log1p(np.abs(pulls) / LINEAR) / np.log1p(max(largest, 10 * LINEAR) / LINEAR)
    share = np.nan_to_num(np.clip(size, 0, 1))[..., None]
    return np.asarray(ZERO + share * (np.where((pulls < 0)[..., None], LOW, HIGH) - ZERO), np.uint8)


def _cells(content: ShownLadder) -> tuple[Array, Array]:
    """Edges (tests + 1,) and (modes + 1,) of the map's cells."""
    width, height = SIZES["pulls"]
    return np.linspace(86.0, width - 4.0, len(content.tests) + 1), np.linspace(30.0, height - 56.0, len(content.modes) + 1)


def pull_image(content: ShownLadder, rung: ShownRung) -> Colours:
    """The map as a picture, one pixel a unit."""
    width, height = SIZES["pulls"]
    image = np.full((int(height), int(width), 3), DARK, np.uint8)
    largest = max(float(np.nanmax(np.abs(r.pulls))) for r in content.rungs)
    colours, (x, y) = pull_colours(rung.pulls, largest), _cells(content)
    for i in range(len(content.modes)):
        for j in range(len(content.tests)):
            image[round(y[i]) + 1 : round(y[i + 1]) - 1, round(x[j]) + 1 : round(x[j + 1]) - 1] = colours[i, j]
    return image


def pull_labels(content: ShownLadder, rung: ShownRung) -> Drawing:
    drawing, (x, y) = Drawing(), _cells(content)
    drawing.label(SIZES["pulls"][0] / 2, 14.0, f"{rung.name}: (computed - measured) / s.e. of every mode and test", (255, 255, 255))
    for i, mode in enumerate(content.modes):
        drawing.label(43.0, (y[i] + y[i + 1]) / 2, mode)
        for j in range(len(content.tests)):
            if np.isfinite(rung.pulls[i, j]):
                text = f"{rung.pulls[i, j]:+.1f}" if abs(rung.pulls[i, j]) < 10 else f"{rung.pulls[i, j]:+.0f}"
                drawing.label((x[j] + x[j + 1]) / 2, (y[i] + y[i + 1]) / 2, text, (255, 255, 255))
    for j, test in enumerate(content.tests):
        for row, line in enumerate(test.split(", ")):
            drawing.label((x[j] + x[j + 1]) / 2, y[-1] + 14.0 + 25.0 * row, line.removesuffix(" rpm"))
    if any(test.endswith(" rpm") for test in content.tests):
        drawing.label(43.0, y[-1] + 39.0, "rpm")
    return drawing


def words(content: ShownLadder, now: int) -> str:
    """Markdown: all rungs so far, and on the last what the ladder shows."""
    lines = [f"## {now + 1}: {content.rungs[now].name}", "", "| rung | rms pull | left out | Hz |", "|---|---|---|---|"]
    for k, r in enumerate(content.rungs[: now + 1]):
        name, error, held_out, hertz, *_ = r.cells
        strong = "**" if k == now else ""
        lines.append(f"| {strong}{k + 1} {name}{strong} | {error} | {held_out} | {hertz} |")
    key = "FRFs" if content.rungs[now].levels else "Frequencies"
    lines += ["", f"{key}: measured green, computed orange. Map: blue computed too low, red too high."]
    if now == len(content.rungs) - 1:
        lines += ["", *(f"- {s}" for s in content.sentences)]
    return "\n".join(lines) + "\n"


# ---------------------------------------------------------------- blueprint


def _blueprint(content: ShownLadder) -> rrb.Blueprint:
    left = rrb.Vertical(
        _chart("error", "The error on every rung"), _chart("pulls", "Pull map"), rrb.TextDocumentView(origin="rung", name="Rung"),
        row_shares=[2.5, 3.3, 3.2],
    )  # fmt: skip
    levels = content.rungs[0].levels
    right = _chart("responses", "Measured (green) and computed (orange)")
    tabs: list[rrb.View | rrb.Container] = [rrb.Horizontal(left, right, column_shares=[1, 1.5], name="Ladder")]
    if levels:
        views = [
            rrb.TimeSeriesView(origin=rr.new_entity_path(_level_path(level)), name=f"{level.name}, {level.test}, {content.unit}, over Hz")
            for level in levels
        ]
        tabs.append(rrb.Grid(*views, grid_columns=2, name="FRFs (choose the timeline frequency)"))
    return rrb.Blueprint(
        rrb.Tabs(*tabs),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline="rung", fps=0.7, play_state="playing", loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )


def _chart(name: str, title: str) -> rrb.View:
    width, height = SIZES[name]
    bounds = rrb.VisualBounds2D(x_range=(0, width), y_range=(0, height))
    return rrb.Spatial2DView(origin=f"charts/{name}", name=title, visual_bounds=bounds, background=DARK)
