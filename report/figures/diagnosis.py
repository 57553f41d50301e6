"""Pictures of a diagnosis: how far every explanation leads, its law as the data have it, what would have to drift, and the error left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thermospindle.diagnosis.decision.errors import arrived, as_drawn, fitted, predicted
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.verdict import Diagnosis
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.report.figures.common import INK, STYLE, label
from thermospindle.report.typeset import unit_cell

NAMED, OTHER, FREE = "#1f6f5c", "#8c9aa8", "#d9b36c"
MOST = 10  # explanations, and three drifts


def figures(d: Diagnosis) -> dict[str, Figure]:
    """All pictures of a diagnosis, by the name of their file."""
    drawn = {"errors": errors(d)}
    if d.verdict.candidates or d.drifts:
        drawn["explanations"] = explanations(d)
    lead = leading(d)
    if lead is not None:
        drawn["law"] = law(d, lead)
    if d.drifts:
        drawn["drift"] = drifts(d)
    return drawn


def leading(d: Diagnosis) -> Candidate | None:
    """The candidate whose law is shown: the best of those the verdict names."""
    return next((c for c in d.verdict.candidates if d.verdict.effects and set(c.names) <= set(d.verdict.effects)), None)


@rc_context(STYLE)
def explanations(d: Diagnosis) -> Figure:
    """ln evidence of explanations over the model without effects; free forms beside those of the catalogue."""
    asked = [c for c in (*d.verdict.candidates[:MOST], *d.verdict.free[:4]) if c.hypothesis.mechanisms]
    best = sorted(asked, key=lambda c: (not arrived(c.hypothesis), -c.delta_evidence))[: MOST + 2]
    value = np.array([c.delta_evidence for c in best])
    paint = [FREE if c.free else NAMED if d.verdict.effects and set(c.names) <= set(d.verdict.effects) else OTHER for c in best]
    drawn = evidence_bars([" + ".join(c.names) + (" (drifts)" if c.free else "") for c in best], value, paint, [arrived(c.hypothesis) for c in best])
    if not arrived(d.search.base):
        drawn.axes[0].set_xlabel("ln evidence over the model without effects, whose own fit has not arrived")
    return drawn


@rc_context(STYLE)
def evidence_bars(names: Sequence[str], value: Array, paint: Sequence[str], ended: Sequence[bool] | None = None) -> Figure:
    """Bars of ln evidence `value` (n,) in the colours `paint`, with their numbers. The axis is that of fits that
    have `ended` where they arrive, others are hatched; a bar that goes on beyond the axis ends in an arrow."""
    ended = [True] * len(names) if ended is None else ended
    figure = Figure(figsize=(8.6, 0.85 + (0.13 + 0.14 * max(n.count("\n") + 1 for n in names)) * len(names)), layout="constrained")
    axes = figure.add_subplot()
    shown = value[np.array(ended)] if any(ended) else value
    low, high = min(float(shown.min()), 0.0), max(float(shown.max()), 1.0)
    low = max(low, -0.2 * high)
    for y, (v, settled, colour) in enumerate(zip(value, ended, paint, strict=True)):
        look: dict[str, Any] = {"color": colour} if settled else {"color": "none", "edgecolor": colour, "hatch": "////", "lw": 0.8}
        axes.barh(y, v, height=0.66, **look)
        end = float(np.clip(v, low, high))
        beyond = v < low or v > high
        if beyond:
            axes.plot([1.02 * low if v < low else high], [y], marker="<" if v < low else ">", ms=6, color=INK, mec="white", zorder=4, clip_on=False)
        told = f"{v:+z.1f}" if abs(v) < 1000 else f"{v:+z.0f}" if abs(v) < 1e9 else f"{v:+.1e}"
        more = f"{', beyond the axis' if beyond else ''}{'' if settled else ', the fit has not arrived'}"
        axes.text(max(end, 0.0) + 0.012 * (high - low), y, told.replace("-", "−") + more, va="center", fontsize=8, color=INK)
    axes.axvline(0, color=INK, lw=0.8)
    axes.set_yticks(range(len(names)), names)
    axes.set(xlim=(1.05 * low, high + (0.14 if all(ended) else 0.3) * (high - low)), ylim=(len(names) - 0.4, -0.6))
    axes.set_xlabel("ln evidence over the model without effects")
    axes.set_title("How far the best explanations lead")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    return figure


@rc_context(STYLE)
def law(d: Diagnosis, c: Candidate) -> Figure:
    """The size of every effect of a candidate in each test: constant where the law that the effect assumes holds."""
    count = len(c.hypothesis.mechanisms)
    figure = Figure(figsize=(8.6, 2.4 * count + 0.3), layout="constrained")
    conditions = [t.condition for t in d.search.model.tests]
    for k, m in enumerate(c.hypothesis.mechanisms):
        axes = figure.add_subplot(count, 1, k + 1)
        own = c.hypothesis.evidence
        sd = np.sqrt(np.maximum(np.diag(own.size_covariance[k]), 0.0))
        axes.set_ylabel(", ".join(filter(None, (m.size.name, unit_cell(m.size.unit)))))
        if own.learned.departures[k] == 0.0 and not m.own_law:
            _one_value(axes, conditions, float(own.sizes[k][0]), float(sd[0]))
            axes.set_title(f"{m.name}: its size (one value, fitted to all tests together)")
            continue
        _over_temperature(axes, conditions, own.sizes[k], sd)
        level = "with a law of the data's own" if m.own_law else "a level line is the law assumed"
        axes.set_title(f"{m.name}: its size in every test ({level})")
    return figure


def _one_value(axes: Axes, conditions: Sequence[Condition], value: float, sd: float) -> None:
    """One number of all tests, with a band of one standard error: no measurement in each."""
    at = [c.temperature for c in conditions]
    axes.axhspan(value - sd, value + sd, color=NAMED, alpha=0.18, lw=0, label="one standard error")
    axes.axhline(value, color=NAMED, lw=1.2)
    axes.plot(at, np.zeros(len(at)), "|", color=INK, ms=8, transform=axes.get_xaxis_transform(), clip_on=False, label="temperatures of the tests")
    reach = 4 * sd or 1.0
    axes.set_ylim(value - reach, value + reach)
    axes.set_xlabel("temperature, °C")
    axes.legend(frameon=False, fontsize=8, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)


@rc_context(STYLE)
def drifts(d: Diagnosis) -> Figure:
    """What would have to change from test to test, without any catalogue."""
    shown = d.drifts[:3]
    figure = Figure(figsize=(8.6, 2.3 * len(shown) + 0.3), layout="constrained")
    for k, p in enumerate(shown):
        axes = figure.add_subplot(len(shown), 1, k + 1)
        _over_temperature(axes, p.conditions, *np.array(p.told).T)
        axes.set_ylabel(f"change, {'%' if p.unit == '%' else 'µm'}")
        axes.set_title(f"{p.element}: {p.gain:.0f} in ln evidence")
    return figure


def _over_temperature(axes: Axes, conditions: Sequence[Condition], value: Array, sd: Array) -> None:
    """Values with one standard error over temperature, a line and marker for each speed."""
    speeds = sorted({c.speed for c in conditions})
    for k, speed in enumerate(speeds):
        own = [i for i, c in enumerate(conditions) if c.speed == speed]
        own.sort(key=lambda i: conditions[i].temperature)
        axes.errorbar(
            [conditions[i].temperature + 0.4 * k for i in own], value[own], sd[own], fmt="o-s-^-D-v-"[2 * (k % 5) : 2 * (k % 5) + 2],
            color=(NAMED, "#a0741a", "#7a3d8f", "#555f6b", "#2166ac")[k % 5], ms=4, lw=1.0, capsize=2, label=f"{speed / RPM:.0f} rpm",
        )  # fmt: skip
    axes.set_xlabel("temperature, °C")
    axes.legend(frameon=False, fontsize=8, ncols=min(len(speeds), 5), loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)


@rc_context(STYLE)
def errors(d: Diagnosis) -> Figure:
    """Rms residual of every test, as drawn, with tolerances fitted and with what the verdict names:
    fitted to all tests, and predicted from all other conditions where there are any."""
    model, base, accepted = d.search.model, d.search.base, d.verdict.accepted
    shown: list[tuple[str, Hypothesis, str, str]] = [("tolerances and constant errors fitted", base, "s", OTHER)]
    if accepted is not base:
        shown.append((" + ".join(accepted.names), accepted, "D", NAMED))
    unseen = [predicted(model, h) for _, h, _, _ in shown]
    panels = 1 if np.isnan(unseen[0]).all() else 2
    figure = Figure(figsize=(8.6, 3.0), layout="constrained")
    every = figure.subplots(1, panels, sharey=True, squeeze=False)[0]
    place, tests = np.arange(len(model.tests)), [label(t.test) for t in model.tests]
    every[0].plot(place, as_drawn(model), "o", mfc="none", color=INK, label="as drawn, nothing fitted")
    for k, (name, h, marker, paint) in enumerate(shown):
        for axes, value in zip(every, (fitted(model, h), unseen[k]), strict=False):
            axes.plot(place, value, marker, ms=7 - 3 * k, color=paint, label=name)
    for axes, title in zip(every, ("Error left, fitted to all tests", "Each condition predicted from all others"), strict=False):
        axes.axhline(1.0, color=INK, lw=0.8, ls="--")
        axes.set_xticks(place, tests, fontsize=7 if panels * len(tests) <= 12 else 6, rotation=0 if panels * len(tests) <= 16 else 90)
        axes.set_xlim(-0.6, len(tests) - 0.4)
        axes.set_title(title)
        axes.grid(visible=False, axis="x")
    every[0].set_yscale("log")
    every[0].yaxis.set_major_formatter(lambda value, place: f"{value:g}")
    low, high = every[0].get_ylim()
    every[0].set_ylim(min(low, 0.5), max(high, 2.0))
    every[0].set_ylabel("rms, standard errors")
    figure.legend(*every[0].get_legend_handles_labels(), frameon=False, fontsize=8, loc="outside lower center", ncols=len(shown) + 1)
    return figure
