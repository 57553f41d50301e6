"""Pictures of measured runout: its lines beside the scene's, the map of their residuals, and what a diagnosis says of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from thermospindle.diagnosis.runout.compare import LineBeside, RunoutBeside
from thermospindle.diagnosis.runout.explanation import Explanation
from thermospindle.diagnosis.runout.moved import MovedLine, leading, moved_lines
from thermospindle.diagnosis.runout.verdict import RunoutDiagnosis
from thermospindle.model.machine import Spindle
from thermospindle.model.units import TO_NM
from thermospindle.report.figures.common import INK, PALE, STYLE, cells, label, logarithmic, residual_bar, residual_norm, spread
from thermospindle.report.figures.diagnosis import NAMED, OTHER, evidence_bars
from thermospindle.report.figures.runout import BAND, REPEATS
from thermospindle.report.typeset import plain, signed_short
from thermospindle.sim.effects.effect import called

PANELS = 6  # tests whose lines are drawn, those that agree least
LABELS = 9  # lines of a test with names
ROWS = 28  # lines of the map, the strongest
MOVED = 24  # lines of the picture of an effect
BARS = 10  # explanations
DECADES, ROOM = 3.5, 3.2  # below the strongest line, and above it for names


def comparison_figures(found: Sequence[RunoutBeside]) -> dict[str, Figure]:
    """All pictures of measured runout beside the scene's, by the name of their file."""
    if not any(t.lines for t in found):
        return {}
    return {"runout_lines": lines_figure(found), "runout_pulls": pulls_figure(found)}


def diagnosis_figures(d: RunoutDiagnosis, spindle: Spindle) -> dict[str, Figure]:
    """All pictures of a diagnosis of runout, by the name of their file."""
    drawn = {}
    if d.explanations:
        drawn["runout_explanations"] = explanations(d, spindle)
    lead = leading(d)
    moved = moved_lines(d, lead) if lead else []
    if lead and moved:
        drawn["runout_moved"] = moved_figure(moved, lead)
    return drawn


def line_words(g: LineBeside) -> str:
    """What a line is called: its name, and what causes it most."""
    cause = g.causes[0]
    return f"{cause.name}: " + f"{cause.bearing} {cause.cause}".strip() + (f" {cause.order}" if cause.order else "")


def strongest_probe(t: RunoutBeside) -> list[LineBeside]:
    """Every line at the probe where it was measured largest, strongest first."""
    found: dict[float, LineBeside] = {}
    for g in sorted(t.lines, key=lambda g: -g.measured):
        found.setdefault(g.frequency, g)
    return list(found.values())


# ---------------------------------------------------------------- compare


@rc_context(STYLE)
def lines_figure(found: Sequence[RunoutBeside]) -> Figure:
    """Measured lines with their errors over computed ones with what chance and build leave open, a panel a test."""
    worst = sorted(found, key=lambda t: -float(np.mean([g.residual**2 for g in t.lines] or [0.0])))[:PANELS]
    shown = [t for t in found if t in worst]
    figure = Figure(figsize=(10.3, 0.5 + 3.5 * len(shown)))
    panels = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
    for axes, t in zip(panels, shown, strict=True):
        _lines(axes, t)
    panels[-1].set_xlabel("frequency, Hz")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels))
    return figure


def _lines(axes: Axes, t: RunoutBeside) -> None:
    own = strongest_probe(t)
    f = np.array([g.frequency for g in own])
    measured, sd, computed, scatter = (TO_NM * np.array([getattr(g, name) for g in own]) for name in ("measured", "measured_sd", "computed", "scatter"))
    top = float(max(measured.max(), (computed + scatter).max()))
    low, high = top * 10**-DECADES, top * 10**ROOM
    axes.set_yscale("log")
    axes.vlines(f, np.maximum(computed - scatter, low), np.maximum(computed + scatter, low), color=BAND, lw=5, alpha=0.3, label="computed, with likely scatter")
    axes.plot(f, np.maximum(computed, low), "_", color=BAND, ms=7, mew=1.6)
    error = np.array([np.minimum(sd, np.maximum(measured - low, 0.0)), sd])
    axes.errorbar(f, np.maximum(measured, low), error, fmt="D", color=INK, ms=3.2, lw=0.8, capsize=1.5, label="measured, with its error")
    if t.unexplained:
        axes.plot([u.frequency for u in t.unexplained], [TO_NM * u.amplitude for u in t.unexplained], "x", color=REPEATS, ms=6, label="unexplained")
    end = 1.03 * float(f.max())
    named = sorted(own[:LABELS], key=lambda g: g.frequency)
    places = spread(np.array([g.frequency for g in named]), 0.03 * end, 0.012 * end, 0.985 * end)
    for g, x in zip(named, places, strict=True):
        look = {"arrowstyle": "-", "color": PALE, "lw": 0.6, "shrinkA": 0, "shrinkB": 3}
        axes.annotate(
            line_words(g).replace(": ", "\n"), (g.frequency, TO_NM * max(g.measured, g.computed)), (x, 1.7 * top),
            rotation=90, ha="center", va="bottom", ma="left", fontsize=6.5, linespacing=1.1, arrowprops=look,
        )  # fmt: skip
    axes.set(xlim=(0, end), ylim=(low, high), ylabel="nm, zero to peak")
    axes.yaxis.set_major_locator(LogLocator(numticks=8))
    axes.set_yticks([v for v in axes.get_yticks() if low <= v <= 2 * top])
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(low, high)
    axes.set_title(f"{t.test.id}: {label(t.test, ', ')}")


@rc_context(STYLE)
def pulls_figure(found: Sequence[RunoutBeside]) -> Figure:
    """Computed less measured amplitude in standard errors, line by test, at the probe where they differ most."""
    size: dict[str, float] = {}
    for t in found:
        for g in t.lines:
            size[line_words(g)] = max(size.get(line_words(g), 0.0), g.measured, g.computed)
    rows = sorted(size, key=lambda name: -size[name])[:ROWS]
    grid = np.full((len(rows), len(found)), np.nan)
    for j, t in enumerate(found):
        for g in t.lines:
            if line_words(g) in rows:
                i = rows.index(line_words(g))
                if not abs(grid[i, j]) > abs(g.residual):
                    grid[i, j] = g.residual
    figure = Figure(figsize=(min(10.3, 4.3 + 0.72 * len(found)), 1.2 + 0.24 * len(rows)))
    axes = figure.subplots()
    norm = residual_norm(float(np.nanmax(np.abs(grid))))
    cells(axes, grid, norm, "RdBu_r", signed_short)
    axes.set_xticks(range(len(found)), [label(t.test) for t in found], fontsize=7)
    axes.set_yticks(range(len(rows)), rows, fontsize=7.5)
    axes.set_title("Lines: computed − measured")
    residual_bar(figure, norm, axes, shrink=0.9, pad=0.02, aspect=25)
    return figure


# ---------------------------------------------------------------- diagnose


def explanations(d: RunoutDiagnosis, spindle: Spindle) -> Figure:
    """ln evidence of explanations over the scene without effects."""
    best = sorted(d.explanations, key=lambda e: -e.delta_evidence)[:BARS]
    paint = [NAMED if set(e.effects) <= set(d.effects) and (len(e.effects) == 1) != (d.verdict == "two effects") else OTHER for e in best]
    return evidence_bars([explanation_words(e, spindle) for e in best], np.array([e.delta_evidence for e in best]), paint)


def explanation_words(e: Explanation, spindle: Spindle) -> str:
    """Effects with what was chosen for them: ring, order, bearing."""
    words = []
    for v in e.variants:
        chosen = ", ".join(f"{p.name} {called(p, v.values[p.name], spindle) or plain(v.values[p.name])}" for p in v.effect.parameters[1:] if p.choices)
        words.append(v.effect.name + (f" ({chosen})" if chosen else ""))
    return "\n+ ".join(words)


@rc_context(STYLE)
def moved_figure(moved: Sequence[MovedLine], lead: Explanation) -> Figure:
    """Every line that the leading effect moves: measured, as the scene alone likely shows it, and with the effect."""
    shown = moved[:MOVED]
    figure = Figure(figsize=(8.6, 1.25 + 0.27 * len(shown)), layout="constrained")
    axes = figure.subplots()
    y = np.arange(len(shown))
    logarithmic(axes, "x")
    scene, effect, measured, sd = (TO_NM * np.array([getattr(m, name) for m in shown]) for name in ("scene", "with_effect", "measured", "measured_sd"))
    axes.hlines(y, scene, effect, color=PALE, lw=1.0)
    axes.plot(scene, y, "o", mfc="none", color=OTHER, ms=6, ls="none", label="scene alone, likely")
    axes.plot(effect, y, "o", color=NAMED, ms=6, ls="none", label=f"with {' + '.join(lead.effects)}")
    axes.errorbar(measured, y, xerr=np.array([np.minimum(sd, 0.9 * measured), sd]), fmt="D", color=INK, ms=3.6, lw=0.9, capsize=2, label="measured")
    axes.set_yticks(y, [f"{m.test}: {m.name}, {m.frequency:.1f} Hz" for m in shown], fontsize=7.5)
    axes.set(ylim=(len(shown) - 0.4, -0.6), xlabel="amplitude, nm zero to peak")
    axes.set_title("The lines that it moves")
    axes.tick_params(axis="y", length=0)
    figure.legend(loc="outside lower center", ncols=3)
    return figure
