"""Pictures of a diagnosis: how far every explanation leads, and the pull map before and after; those of the misfit are in `misfit_plots`."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from diagnosis import misfit_plots
from diagnosis.decide import Diagnosis
from diagnosis.fit import Fit
from diagnosis.ladder_plots import PullMap, draw_maps, pulls
from diagnosis.misfit import Misfit
from diagnosis.screening import CLEAR
from diagnosis.shares import Modes, modes_at
from diagnosis.theory import Theory
from sim.plots import INK, PALE, STYLE

NAMED, OTHER, REFUSED = "#1f6f5c", "#8c9aa8", "#d9b36c"
WIDE = 10  # tests from which maps stand below instead of beside each other


def figures(found: Diagnosis, about: Theory, m: Misfit) -> dict[str, Figure]:
    """All pictures of a diagnosis, by the name of their file."""
    drawn = {"pulls": pull_maps(found, about)}
    if found.candidates:
        drawn["explanations"] = explanations(found)
    return drawn | misfit_plots.figures(m)


def maps(found: Diagnosis, about: Theory) -> list[tuple[str, PullMap]]:
    """Pulls with the tolerances fitted, and with the best explanation unless nothing is missing."""
    modes = modes_at(about, found.base.nuisance)
    told = [("tolerances fitted", _pulls(about, found.base, modes))]
    if found.best is not None and found.verdict != "none":
        nearest = "nearest: " if found.verdict == "unexplained" else "with "
        told.append((nearest + " + ".join(found.best.effects), _pulls(about, found.best.fit, modes)))
    return told


def _pulls(about: Theory, fit: Fit, modes: Modes) -> PullMap:
    mode = np.array([modes.number[f.test][f.mode] for f in about.data.features], int)
    return pulls(about.data, mode, dict(sorted(modes.kind.items())), fit.residual)


@rc_context(STYLE)
def pull_maps(found: Diagnosis, about: Theory) -> Figure:
    """Errors in standard errors, mode by test, before and after; below each other where there are many tests."""
    told = maps(found, about)
    first = told[0][1]
    rows = 1 if first.damping is None else 2
    tall = rows * (0.3 * len(first.modes) + 0.62) + 0.25
    if len(told) > 1 and len(first.tests) >= WIDE:
        figure = Figure(figsize=(10.0, len(told) * tall))
        parts: Any = figure.subfigures(len(told), 1)
        for part, one in zip(parts, told, strict=True):
            draw_maps(part, [one])
    else:
        figure = Figure(figsize=(10.0 if len(told) > 1 else max(5.0, 1.9 + 0.62 * len(first.tests)), tall))
        draw_maps(figure, told)
    return figure


@rc_context(STYLE)
def explanations(found: Diagnosis, most: int = 10) -> Figure:
    """ln evidence of every explanation over the model without effects."""
    best = found.candidates[:most]
    value = np.array([c.delta_evidence for c in best])
    paint = [NAMED if set(c.effects) <= set(found.effects) and found.effects else (OTHER if c.believable else REFUSED) for c in best]
    figure = Figure(figsize=(8.6, 0.85 + 0.27 * len(best)))
    axes = figure.add_subplot()
    axes.barh(range(len(best)), value, height=0.66, color=paint)
    span = max(float(value.max()), CLEAR, 0.0) - min(float(value.min()), 0.0)
    for y, v in enumerate(value):
        axes.text(
            max(v, 0.0) + 0.012 * span,
            y,
            (f"{v:+.1f}" if abs(v) < 1000 else f"{v:+.0f}").replace("-", "−"),
            va="center",
            fontsize=8,
            color=INK,
        )
    axes.axvline(0, color=INK, lw=0.8)
    axes.axvline(CLEAR, color=PALE, lw=1.0, ls="--", zorder=0)
    axes.set_yticks(range(len(best)), [" + ".join(c.effects) for c in best])
    axes.set(xlim=(min(0.0, 1.05 * float(value.min())), max(0.0, float(value.max()), CLEAR) + 0.12 * span), ylim=(len(best) - 0.4, -0.6))
    axes.set_xlabel(f"ln evidence over the model without effects (dashed: {CLEAR:g}, asked before any is believed)")
    axes.set_title("How far every explanation leads")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    return figure
