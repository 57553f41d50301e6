"""Pictures of the misfit: where it sits, and what would have to change from condition to condition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from diagnosis.misfit import Drift, Misfit
from diagnosis.misfit_words import merged
from diagnosis.shares import BY
from model.machine import Condition
from sim.plots import INK, PALE, STYLE

RPM = 2 * np.pi / 60
SHOWN = 6  # panels
SPEEDS = (("#1f8a70", "o", "-"), ("#a0741a", "^", "--"), ("#7a3d8f", "s", ":"), ("#555f6b", "D", "-."))
PARTS = ("#1f6f5c", "#d9b36c", "#8c9aa8", "#b98a9e", "#c9d6e2", "#a0741a", "#a8c3a0", "#7a3d8f", "#e0cfc0", "#555f6b")
DARK = ("#1f6f5c", "#a0741a", "#7a3d8f", "#555f6b")
NARROW = 0.045  # share below which a part of a bar has no room for its name


def figures(m: Misfit) -> dict[str, Figure]:
    """All pictures of a misfit, by the name of their file."""
    found = {"misfit_shares": shares_figure(m)}
    if m.places:
        found["misfit_places"] = changes(m.places, "What would have to change, without any catalogue")
    if m.drift:
        found["misfit_drift"] = changes(m.drift, "Toleranced parameters, each free at every condition")
    return found


@rc_context(STYLE)
def shares_figure(m: Misfit) -> Figure:
    """Every division of the misfit as one bar; grey ticks mark what each part's count of numbers would give by chance."""
    rows = [by for by in BY if sum(s.by == by for s in m.shares) > 1]
    figure = Figure(figsize=(10.3, 0.9 + 0.52 * len(rows)))
    axes = figure.add_subplot()
    for y, by in enumerate(rows):
        start, fair = 0.0, 0.0
        own = [s for s in m.shares if s.by == by]
        for k, s in enumerate(own):
            paint = PARTS[k % len(PARTS)]
            axes.barh(y, 100 * s.share, left=100 * start, height=0.62, color=paint, edgecolor="white", lw=0.6)
            if s.share > NARROW * max(1.0, 0.17 * len(s.name)):
                ink = "white" if paint in DARK else INK
                axes.text(100 * (start + s.share / 2), y, s.name, ha="center", va="center", fontsize=7.5, color=ink)
            start += s.share
            fair += s.count / m.count
            if k < len(own) - 1:
                axes.plot([100 * fair] * 2, [y + 0.31, y + 0.42], color=PALE, lw=1.2)
    axes.set_yticks(range(len(rows)), [f"by {by}" for by in rows])
    axes.set(xlim=(0, 100), ylim=(len(rows) - 0.4, -0.6), xlabel="share of the misfit, % (ticks below a bar: shares by chance)")
    axes.set_title(f"Where the misfit sits: chi² {m.chi2:.0f} for {m.count} numbers")
    axes.grid(False)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    return figure


@rc_context(STYLE)
def changes(found: Sequence[Drift], title: str) -> Figure:
    """The change at every condition with its standard error, over temperature, a line a speed; one panel for each of the best."""
    best = found[:SHOWN]
    columns = min(3, len(best))
    rows = -(-len(best) // columns)
    figure = Figure(figsize=(max(4.2, 3.43 * columns), 0.75 + 2.25 * rows))
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True)
    labels: dict[str, Artist] = {}
    for k, d in enumerate(best):
        axes = panels[k // columns, k % columns]
        axes.axhline(0, color=INK, lw=0.8)
        for (name, own), (paint, marker, line) in zip(_lines(d.conditions).items(), SPEEDS * len(d.conditions), strict=False):
            t = [d.conditions[i].temperature for i in own]
            look = {"color": paint, "marker": marker, "ls": line, "capsize": 2.5, "ms": 4.5, "lw": 1.1}
            labels[name] = axes.errorbar(t, 100 * d.change[own], yerr=100 * d.sd[own], label=name, **look)[0]
        axes.set_title(_wrapped(merged(d.names)), fontsize=8.5)
        axes.text(0.03, 0.04, f"removes {100 * d.removes:.0f} %", transform=axes.transAxes, fontsize=8, color=INK)
        axes.margins(x=0.08, y=0.16)
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        if k % columns == 0:
            axes.set_ylabel("change, %")
        if k + columns >= len(best):
            axes.set_xlabel("temperature, °C")
            axes.tick_params(labelbottom=True)
    for k in range(len(best), rows * columns):
        panels[k // columns, k % columns].set_axis_off()
    figure.suptitle(f"{title} (with one standard error)", x=0.01, ha="left", fontsize=9.5, fontweight="bold")
    if len(labels) > 1:
        figure.legend(labels.values(), labels.keys(), loc="outside lower right", ncols=len(labels))
    return figure


def _lines(conditions: Sequence[Condition]) -> dict[str, list[int]]:
    """Conditions that differ in temperature only, by what they share, in order of temperature."""
    found: dict[str, list[int]] = {}
    for i, c in enumerate(conditions):
        name = "at rest" if c.speed == 0 else f"{c.speed / RPM:.0f} rpm"
        name += f", {c.level:g} N" if len({x.level for x in conditions}) > 1 else ""
        found.setdefault(name, []).append(i)
    return {name: sorted(own, key=lambda i: conditions[i].temperature) for name, own in found.items()}


def _wrapped(name: str, width: int = 34) -> str:
    """A long name in two lines."""
    if len(name) <= width:
        return name
    cut = name.rfind(" ", 0, width)
    return f"{name[:cut]}\n{name[cut + 1 :]}"
