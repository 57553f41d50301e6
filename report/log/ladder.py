"""The Rerun log of a ladder: on the timeline `step` everything moves as one model after the other takes its place.

Rerun shows one timeline at a time, so FRFs and the map of residuals stand as pictures on `step`; the same FRFs stand as series on the
timeline `frequency`, measured and of every step on one axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import rc_context
from matplotlib.figure import Figure

from thermospindle.model.types import Array
from thermospindle.report.figures.common import PALE, STYLE, broken, cells, logarithmic, residual_norm
from thermospindle.report.log.columns import curve_look, log_curve, log_peak_numbers, log_values, log_words, over_frequency, whole_log
from thermospindle.report.log.pictures import for_dark, log_figure, view
from thermospindle.report.log.views import at, window
from thermospindle.report.typeset import signed_short
from thermospindle.sim.identification.peak import Peak

MEASURED, COMPUTED, HELD_OUT = np.array([(120, 255, 140), (255, 170, 80), (90, 200, 255)], np.uint8)
SIZES = {"error": (6.1, 2.6), "residuals": (6.1, 3.5), "responses": (9.0, 8.7)}  # inches
PANELS = 2  # columns of the FRF pictures
FLOOR = 80.0  # dB below the top that FRF pictures show


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
class ShownStep:
    name: str
    cells: tuple[str, ...]  # of its row of the table
    error: float  # rms of the residuals in standard errors
    held_out: float
    residuals: Array  # (modes, tests), NaN where not measured
    levels: tuple[Level, ...]  # none for a campaign of mode tables
    tracks: tuple[Track, ...]


@dataclass(frozen=True, eq=False)
class ShownLadder:
    provenance: Mapping[str, str]
    title: str
    modes: tuple[str, ...]
    tests: tuple[str, ...]
    unit: str  # of the levels
    steps: tuple[ShownStep, ...]
    top: int  # index of the step that the ladder leads to
    sentences: tuple[str, ...]
    peaks: tuple[Peak, ...]  # measured, and computed on the top step
    left_out: str  # temperatures or modes


def write_ladder_log(content: ShownLadder, path: Path) -> None:
    """Write the log of a ladder, whole or not at all. BadInput if its folder does not exist."""
    with whole_log(path, "run", content.title, {"title": content.title, **content.provenance}, _blueprint(content)) as recording:
        recording.set_log_time_enabled(False)
        log_peak_numbers(recording, content.peaks)
        steps = content.steps
        log_values(recording, "numbers/steps", {"names": [r.name for r in steps], "error": [r.error for r in steps], "top": content.top})
        for k, step in enumerate(steps, 1):
            recording.set_time("step", sequence=k)
            for name, figure in (("error", errors(content, k - 1)), ("residuals", residuals(content, step)), ("responses", responses(content, step))):
                log_figure(recording, f"charts/{name}", figure, static=False)
            log_words(recording, "step", words(content, k - 1), static=False)
            for name, value in (("all data", step.error), (f"{content.left_out} left out", step.held_out)):
                recording.log(at("error", name), rr.Scalars(value))
        for name, colour in (("all data", COMPUTED), (f"{content.left_out} left out", HELD_OUT)):
            recording.log(at("error", name), rr.SeriesLines(colors=[colour], names=name), static=True)
        log_levels(recording, content)


def log_levels(recording: rr.RecordingStream, content: ShownLadder) -> None:
    """FRFs on the timeline `frequency` (whole Hz): measured, and of every step, the later the brighter."""
    for i, level in enumerate(content.steps[0].levels):
        times = over_frequency(level.frequency)
        curves = [("measured", level.measured, MEASURED, 2.0)]
        for k, step in enumerate(content.steps):
            bright = COMPUTED * (0.35 + 0.65 * (k / max(len(content.steps) - 1, 1)))
            curves.append((f"{k + 1} {step.name}", step.levels[i].computed, bright.astype(np.uint8), 1.0 if k != content.top else 2.0))
        for name, values, colour, width in curves:
            log_curve(recording, at("frf", level.test, level.name, name), times, values, curve_look(colour, name, width))


# ---------------------------------------------------------------- pictures of one step


@rc_context(STYLE)
def errors(content: ShownLadder, now: int) -> Figure:
    """Rms residual over the steps, with a bar at the present one."""
    figure = Figure(figsize=SIZES["error"])
    axes = figure.subplots()
    place = np.arange(len(content.steps))
    axes.axvline(now, color=PALE, lw=6, alpha=0.4)
    for key, label, colour in (("held_out", f"{content.left_out} left out", HELD_OUT), ("error", "all data", COMPUTED)):
        axes.plot(place, [getattr(r, key) for r in content.steps], marker="o", color=for_dark(colour), label=label)
    logarithmic(axes)
    axes.set_xticks(place, [broken(r.name) for r in content.steps], fontsize=6.5)
    axes.set_ylabel("rms residual, standard errors")
    axes.legend(loc="upper right")
    return figure


@rc_context(STYLE)
def residuals(content: ShownLadder, step: ShownStep) -> Figure:
    """(computed - measured) / standard error of every mode and test; colours mean the same at every step."""
    figure = Figure(figsize=SIZES["residuals"])
    axes = figure.subplots()
    largest = max(float(np.nanmax(np.abs(r.residuals))) for r in content.steps)
    cells(axes, step.residuals, residual_norm(largest), "RdBu_r", signed_short)
    axes.set_xticks(range(len(content.tests)), [t.replace(", ", "\n") for t in content.tests], fontsize=7)
    axes.set_yticks(range(len(content.modes)), content.modes)
    axes.set_title(f"{step.name}: (computed − measured) / standard error")
    return figure


@rc_context(STYLE)
def responses(content: ShownLadder, step: ShownStep) -> Figure:
    """Measured and computed FRFs on one axis, or frequencies over temperature where there are no FRFs; axes are the same at every step."""
    figure = Figure(figsize=SIZES["responses"])
    shown: Sequence[Level | Track] = step.levels or step.tracks
    columns = PANELS if step.levels or len(shown) <= 4 else 3
    panels = figure.subplots(-(-len(shown) // columns), columns, squeeze=False).flat[:]
    for i, (axes, one) in enumerate(zip(panels, shown, strict=False)):
        x = one.frequency if isinstance(one, Level) else one.temperature
        every = np.concatenate([one.measured, *((r.levels or r.tracks)[i].computed for r in content.steps)])
        top = float(every.max())
        low = max(float(every.min()), top - FLOOR) if isinstance(one, Level) else float(every.min())
        axes.plot(x, one.measured, color=for_dark(MEASURED), lw=1.6, label="measured")
        axes.plot(x, one.computed, color=for_dark(COMPUTED), lw=1.1, label="computed")
        axes.set_ylim(low - 0.04 * (top - low), top + 0.04 * (top - low))
        if isinstance(one, Level):
            axes.set(title=f"{one.name}, {one.test}, {content.unit}", xlabel="Hz")
        else:
            axes.set(title=f"mode {one.mode}, Hz", xlabel="°C")
            axes.ticklabel_format(useOffset=False)
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def words(content: ShownLadder, now: int) -> str:
    """Markdown: all steps so far, and on the last what the ladder shows."""
    lines = [f"## {now + 1}: {content.steps[now].name}", "", "| step | rms residual, s.e. | left out | Hz |", "|---|---|---|---|"]
    for k, r in enumerate(content.steps[: now + 1]):
        name, error, held_out, hertz, *_ = r.cells
        strong = "**" if k == now else ""
        lines.append(f"| {strong}{k + 1} {name}{strong} | {error} | {held_out} | {hertz} |")
    key = "FRFs" if content.steps[now].levels else "Frequencies"
    lines += ["", f"{key}: measured green, computed orange. Map: blue computed too low, red too high."]
    if now == len(content.steps) - 1:
        lines += ["", *(f"- {s}" for s in content.sentences)]
    return "\n".join(lines) + "\n"


# ---------------------------------------------------------------- blueprint


def _blueprint(content: ShownLadder) -> rrb.Blueprint:
    left = rrb.Vertical(
        view("charts/error", "The error at every step", SIZES["error"]), view("charts/residuals", "Residuals by mode and test", SIZES["residuals"]), rrb.TextDocumentView(origin="step", name="Step"),
        row_shares=[2.5, 3.3, 3.2],
    )  # fmt: skip
    levels = content.steps[0].levels
    right = view("charts/responses", "Measured (green) and computed (orange)", SIZES["responses"])
    tabs: list[rrb.View | rrb.Container] = [rrb.Horizontal(left, right, column_shares=[1, 1.5], name="Ladder")]
    if levels:
        views = [
            rrb.TimeSeriesView(origin=at("frf", g.test, g.name), name=f"{g.name}, {g.test}, {content.unit}, over frequency (#1000 is 1000 Hz)")
            for g in levels
        ]
        tabs.append(rrb.Grid(*views, grid_columns=2, name="FRFs (choose the timeline frequency)"))
    return window(rrb.Tabs(*tabs), "step", fps=0.7)
