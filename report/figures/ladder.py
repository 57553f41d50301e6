"""Pictures of the ladder: the error at every step, and residuals by mode and test at the first step and at the top."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from thermospindle.diagnosis.ladder.ladder import Ladder
from thermospindle.model.types import Array
from thermospindle.report.figures.common import PALE, STYLE, broken, cells, logarithmic, residual_bar, residual_norm
from thermospindle.report.text.ladder_table import ResidualMap, residual_map
from thermospindle.report.typeset import signed_short

ERROR, HELD_OUT = "#b3402a", "#2166ac"
GROUND = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
"""Of a number, which no line crosses."""
BESIDE = 12  # names of steps that fit beside each other


@rc_context(STYLE)
def figure(found: Ladder) -> Figure:
    first, last = (residual_map(found, r) for r in (found.steps[0], found.top))
    rows = len(_shown(first))
    tall = 0.32 * len(first.modes) + 0.75
    drawn = Figure(figsize=(10.0, 3.1 + rows * tall))
    parts: Any = drawn.subfigures(2, 1, height_ratios=[3.1, rows * tall])
    _errors(parts[0].subplots(), found)
    draw_maps(parts[1], [(found.steps[0].name, first), (found.top.name, last)])
    return drawn


def _errors(axes: Axes, found: Ladder) -> None:
    place = np.arange(len(found.steps))
    rows = [([r.error for r in found.steps], ERROR, "o", "all data", False)]
    if any(r.fitted and np.isfinite(r.held_out) for r in found.steps):
        rows.insert(0, ([r.held_out for r in found.steps], HELD_OUT, "s", f"{found.left_out} left out", True))
    for values, colour, marker, label, up in rows:
        axes.plot(place, values, color=colour, marker=marker, label=label, zorder=3)
        for x, r in enumerate(found.steps):
            if up and r.fitted is None:
                continue  # both are the same there, written once
            above = up if r.held_out != r.error else not up
            if r.held_out < r.error:
                above = not up
            shift = (0, 7) if above or r.fitted is None else (0, -14)
            axes.annotate(
                _short(values[x]), (x, values[x]), xytext=shift, textcoords="offset points", ha="center", color=colour, fontsize=8, bbox=GROUND, zorder=4
            )
    axes.axhline(1.0, color=PALE, lw=0.9, ls="--", zorder=1, label="errors of the data")
    logarithmic(axes)
    low = min(1.0, *(min(r.error, r.held_out) for r in found.steps))
    high = max(max(r.error, r.held_out) for r in found.steps)
    span = max(np.log10(high / low), 0.5)
    axes.set_ylim(low / 10 ** (0.16 * span), high * 10 ** (0.16 * span))
    axes.set_xlim(-0.5, len(place) - 0.5)
    if len(place) > BESIDE:
        axes.set_xticks(place, [r.name for r in found.steps], rotation=30, ha="right", rotation_mode="anchor")
    else:
        axes.set_xticks(place, [broken(r.name) for r in found.steps])
    axes.set_ylabel("rms residual, standard errors")
    axes.set_title("The error at every step")
    axes.legend(loc="upper right")
    axes.grid(visible=False, axis="x")


def draw_maps(part: Any, steps: Sequence[tuple[str, ResidualMap]]) -> None:
    """Maps of residuals beside each other in a figure or a part of one, each below its name; dampings below frequencies."""
    rows = len(_shown(steps[0][1]))
    norm = residual_norm(max(float(np.nanmax(np.abs(m.frequency))) for _, m in steps))
    grid = part.subplots(rows, len(steps), squeeze=False)
    for k, (name, residuals) in enumerate(steps):
        for i, (what, values, own) in enumerate(_shown(residuals)):
            axes = grid[i][k]
            cells(axes, values, norm if own is None else own, "RdBu_r", signed_short)
            axes.set_xticks(range(len(residuals.tests)), [t.replace(", ", "\n").removesuffix(" rpm") for t in residuals.tests], fontsize=7.5)
            axes.set_yticks(range(len(residuals.modes)), residuals.modes if k == 0 else [])
            axes.set_title(f"{name}: {what}")
            if i == rows - 1 and any(t.endswith(" rpm") for t in residuals.tests):
                axes.set_xlabel("temperature, and below it speed in rpm")
        grid[0][0].set_ylabel("mode")
    residual_bar(part, norm, grid, shrink=0.9, pad=0.01)


def _shown(residuals: ResidualMap) -> list[tuple[str, Array, Normalize | None]]:
    """What each map is of, and its values; with colours of its own where they are no standard errors, and small."""
    found: list[tuple[str, Array, Normalize | None]] = [("frequencies", residuals.frequency, None)]
    if residuals.damping is not None:
        found.append(("damping ratios", residuals.damping, None))
    elif residuals.damping_percent is not None:
        found.append(("damping ratios, % (no errors told)", residuals.damping_percent, Normalize(-100.0, 100.0)))
    return found


def _short(value: float) -> str:
    return f"{value:.0f}" if value >= 99.5 else (f"{value:.1f}" if value >= 9.95 else f"{value:.2f}")
