"""Figures of a run's report as inline SVG: bearing states over temperature, natural frequencies by source, FRFs, the section."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Rectangle

from thermospindle.model.drawing.section import PARTS
from thermospindle.model.machine import RollerBearing, Spindle
from thermospindle.model.types import Array
from thermospindle.report.figures.common import BEARINGS, INK, PALE, STYLE, colour, least_span, svg
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.posing import round_down
from thermospindle.thermal.expansion import DeformedSection, field

SOURCES = {
    "measured": (INK, "D", True),
    "published": (INK, "s", False),
    "computed": ("#1f8a70", "o", True),
    "identified": ("#1f8a70", "o", False),
}
MATERIALS = ("#c9d6e2", "#8c9aa8", "#d9b36c", "#b98a9e", "#a8c3a0", "#e0cfc0")
LEVEL = 0.02  # of a value: curves that stay within it are drawn as level


@dataclass(frozen=True)
class Peaks:
    """Natural frequencies (Hz) with standard errors (NaN where not known) of one source at one temperature, by mode number."""

    source: str  # a key of SOURCES
    label: str
    temperature: float
    value: Mapping[int, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Curve:
    """One mobility in (m/s)/N over frequency (Hz); `style` is exact, test or measured."""

    style: str
    temperature: float
    frequency: Array
    mobility: np.ndarray
    coherence: Array | None = None


# ---------------------------------------------------------------- bearing states over temperature


FEW, COLUMNS = 2, 3  # bearings named among the curves; names side by side above them


@rc_context(STYLE)
def trend(key: str, temperature: Sequence[float], curves: Mapping[str, Mapping[str, Sequence[float]]], label: str, from_zero: bool) -> str:
    """One quantity of every bearing over temperature, or several beside their names, the second
    with open marks: values by name and by bearing."""
    figure = Figure(figsize=(3.55, 2.45))
    axes = figure.add_subplot()
    for k, (name, values) in enumerate(curves.items()):
        for (bearing, series), (c, marker, line) in zip(values.items(), BEARINGS * len(values), strict=False):
            axes.plot(temperature, series, color=c, marker=marker, linestyle=line, label=bearing, clip_on=False, mfc="white" if k else c)
        if len(curves) > 1:
            highest = max(series[0] for series in values.values())
            axes.annotate(f"{name}, open marks" if k else name, (temperature[0], highest), (2, 6), textcoords="offset points", fontsize=8.5)
    axes.set(xlabel="temperature, °C", ylabel=label)
    axes.margins(x=0.06, y=0.12)
    axes.ticklabel_format(useOffset=False)
    every = np.array([series for values in curves.values() for series in values.values()])
    least_span(axes, every, LEVEL * float(abs(every.mean())))
    if from_zero:
        axes.set_ylim(1.15 * min(every.min(), 0.0), 1.15 * max(every.max(), 0.0) or 1.0)
    handles = axes.get_lines()[: len(next(iter(curves.values())))]
    if len(handles) > FEW:  # no room among the curves
        figure.set_size_inches(3.55, 2.45 + 0.2 * -(-len(handles) // COLUMNS))
        figure.legend(handles=handles[::-1], loc="outside upper center", ncols=COLUMNS, columnspacing=1.0, handletextpad=0.4)
    else:
        axes.legend(handles=handles[::-1], loc="best")
    return svg(figure, key, f"{label} over temperature")


# ---------------------------------------------------------------- natural frequencies by source


@rc_context(STYLE)
def comparison(key: str, modes: Mapping[int, str], sources: Sequence[Peaks], cold: float, hot: float) -> str:
    """Every source's frequency less the measured one at the `cold` temperature, and its shift to the `hot` one, mode by mode.

    `modes` are labels by mode number. Without measured frequencies only the shift is drawn.
    """
    by = {(p.label, p.temperature): p for p in sources}
    labels = {p.label: p.source for p in sources}
    measured = next((by[p.label, cold] for p in sources if p.source == "measured" and (p.label, cold) in by), None)
    figure = Figure(figsize=(10.3, 0.9 + 0.5 * len(modes)))
    panels = figure.subplots(1, 2 if measured else 1, sharey=True, squeeze=False)[0]
    rows = {mode: -i for i, mode in enumerate(modes)}
    for axes in panels:
        axes.axvline(0, color=INK, lw=0.8)
        axes.set_yticks(list(rows.values()), list(modes.values()))
        axes.set_ylim(-len(rows) + 0.45, 0.55)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_visible(False)
        axes.grid(False, axis="y")
        axes.margins(x=0.08)
        for i in range(0, len(rows), 2):
            axes.axhspan(-i - 0.5, -i + 0.5, color=INK, alpha=0.04, lw=0)
    for k, (label, source) in enumerate(labels.items()):
        c, marker, filled = SOURCES[source]
        place = (0.5 - (k + 0.5) / len(labels)) * 0.72
        look = {"fmt": marker, "color": c, "mfc": c if filled else "none", "ms": 5, "lw": 1.0, "capsize": 2, "label": label}
        first, last = by.get((label, cold)), by.get((label, hot))
        if measured and first:
            own = {m: first.value[m] for m in rows if m in first.value and m in measured.value}
            x = [f - measured.value[m][0] for m, (f, _) in own.items()]
            panels[0].errorbar(x, [rows[m] + place for m in own], xerr=[2 * sd for _, sd in own.values()], **look)
        if first and last:
            both = [m for m in rows if m in first.value and m in last.value]
            x = [last.value[m][0] - first.value[m][0] for m in both]
            error = [2 * np.hypot(first.value[m][1], last.value[m][1]) for m in both]
            panels[-1].errorbar(x, [rows[m] + place for m in both], xerr=error, **look)
    if measured:
        panels[0].set(title=f"Frequency at {cold:g} °C", xlabel="difference from the measured frequency, Hz")
    panels[-1].set(title=f"Shift from {cold:g} to {hot:g} °C", xlabel="shift, Hz")
    shown = {name: handle for axes in panels for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(shown.values(), shown.keys(), loc="outside upper right", ncols=len(shown), handletextpad=0.3)
    return svg(figure, key, "frequencies and shifts of every mode by source")


# ---------------------------------------------------------------- frequency responses


@rc_context(STYLE)
def responses(key: str, panels: Mapping[str, Sequence[Curve]], peaks: Sequence[Peaks], band: tuple[float, float]) -> str:
    """FRFs, with their coherence below where there is one, a panel a driving point, under a strip
    of the natural frequencies of every source."""
    every = sorted({curve.temperature for curves in panels.values() for curve in curves})
    own = ("computed", "identified")
    labels = list(dict.fromkeys(p.label for p in sorted(peaks, key=lambda p: p.source not in own)))
    coherent = any(curve.coherence is not None for curves in panels.values() for curve in curves)
    heights = [0.26 * len(labels) + 0.22, *(h for _ in panels for h in (2.35, *[0.55] * coherent))]
    figure = Figure(figsize=(10.3, sum(heights) + 1.2))
    strip, *rest = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    _strip(strip, peaks, labels, every, band)
    levels, coherences = (rest[::2], rest[1::2]) if coherent else (rest, [])
    for (title, curves), axes in zip(panels.items(), levels, strict=True):
        for curve in curves:
            look = {"exact": (3.2, 0.3, "-"), "test": (1.0, 1.0, "-"), "measured": (0.9, 1.0, ":")}[curve.style]
            kind = dict(zip(("lw", "alpha", "ls"), look, strict=True), color=colour(curve.temperature, every))
            axes.plot(curve.frequency, 20 * np.log10(np.maximum(np.abs(curve.mobility), 1e-300)), **kind)
        axes.set_title(title)
        axes.set_ylabel("mobility, dB re 1 (m/s)/N")
    for curves, axes in zip(panels.values(), coherences, strict=False):
        for curve in (c for c in curves if c.coherence is not None):
            axes.plot(curve.frequency, curve.coherence, lw=0.9, color=colour(curve.temperature, every))
        axes.set(ylim=(0, 1.08), yticks=(0, 0.5, 1))
        axes.set_ylabel("coherence", fontsize=7.5)
    rest[-1].set(xlabel="frequency, Hz", xlim=band)
    handles = [Line2D([], [], color=colour(t, every), lw=2.2, label=f"{t:g} °C") for t in every]
    handles += [
        Line2D([], [], color=INK, lw=1.0, label="virtual test"),
        Line2D([], [], color=INK, lw=3.2, alpha=0.3, label="exact"),
    ]
    if any(c.style == "measured" for curves in panels.values() for c in curves):
        handles.append(Line2D([], [], color=INK, lw=0.9, ls=":", label="measured"))
    figure.legend(handles=handles, loc="outside upper right", ncols=len(handles))
    figure.align_ylabels(rest)
    return svg(figure, key, "frequency response functions" + " and coherence" * coherent + " at the driving points")


def _strip(axes: Axes, peaks: Sequence[Peaks], labels: Sequence[str], every: Sequence[float], band: tuple[float, float]) -> None:
    """Natural frequencies as marks, one row a source, the coldest temperature uppermost in it."""
    for p in peaks:
        _, marker, filled = SOURCES[p.source]
        c = colour(p.temperature, every)
        share = every.index(p.temperature) / (len(every) - 1) - 0.5 if len(every) > 1 else 0.0
        y = -labels.index(p.label) - 0.42 * share
        marks = [f for f, _ in p.value.values()]
        axes.plot(marks, [y] * len(marks), marker, color=c, mfc=c if filled else "none", ms=4, mew=0.9, ls="none")
    numbered = next((p for p in peaks if p.source == "computed"), None)
    for names, f in grouped(numbered, 0.011 * (band[1] - band[0])) if numbered else ():
        axes.annotate(names, (f, 0.36), ha="center", va="bottom", fontsize=8)
    axes.set(yticks=[-i for i in range(len(labels))], yticklabels=labels, ylim=(-len(labels) + 0.4, 1.15))
    axes.tick_params(axis="both", length=0, labelbottom=False)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.set_title("Natural frequencies")


def grouped(peaks: Peaks, apart: float) -> list[tuple[str, float]]:
    """Mode numbers as labels at their frequencies; numbers share a label where two would stand less
    than `apart` (Hz), a digit's width and a half, from each other."""
    found: list[tuple[str, list[float]]] = []
    for mode, (f, _) in sorted(peaks.value.items(), key=lambda item: item[1][0]):
        name, at = str(mode), [f]
        while found and np.mean(at) - np.mean(found[-1][1]) < apart * (0.35 * (len(name) + len(found[-1][0])) + 0.3):
            before, others = found.pop()
            name, at = f"{before}, {name}", [*others, *at]
        found.append((name, at))
    return [(name, float(np.mean(at))) for name, at in found]


# ---------------------------------------------------------------- the section


def _rigid(point: OperatingPoint, d: DeformedSection) -> np.ndarray:
    """Rigid movement (nodes, 2) in m of the part with the outer rings: the hub's, and of a ring behind a preload spring its own."""
    movement = np.zeros_like(d.displacement)
    movement[:, 1] = point.state.hub_movement
    for b in point.spindle.bearings:
        own = point.state.bearing(b.name).movement
        if own != point.state.hub_movement and b.outer_ring in d.regions:
            movement[d.triangles[d.region_of == d.regions.index(b.outer_ring)].ravel(), 1] = own
    return movement


SLENDER = 0.6
"""Radius over height below which a section is drawn in a taller and narrower picture."""


@rc_context(STYLE)
def section(key: str, point: OperatingPoint) -> tuple[str, float]:
    """The axisymmetric section with its materials, and deformed at the point's temperature; also the exaggeration drawn."""
    spindle = point.spindle
    deformed = field(spindle, point.regions)
    carried = spindle.region(spindle.bearings[0].outer_ring).part if spindle.bearings else ""  # the bearings move the part with the outer rings
    moved = {p: d.displacement + (_rigid(point, d) if p == carried else 0.0) for p, d in deformed.items()}
    largest = max(float(np.hypot(*u.T).max()) for u in moved.values())
    extent = max(float(np.ptp(np.concatenate([d.nodes for d in deformed.values()]), axis=0).max()), 1e-9)
    scale = round_down(0.06 * extent / largest) if largest > 0 else 1.0
    radius, height = np.ptp(np.concatenate([d.nodes for d in deformed.values()] + [[[0.0, d.nodes[0, 1]] for d in deformed.values()]]), axis=0)
    slender = radius < SLENDER * height
    figure = Figure(figsize=(6.6, 5.2) if slender else (10.3, 4.3))
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    key_entries = _materials(left, spindle)
    figure.legend(handles=key_entries, loc="outside lower center", ncols=len(key_entries), handlelength=1.2)
    left.set_title("Materials and bearings")
    picture: Any = None
    for part, d in deformed.items():
        size = np.hypot(*moved[part].T) * 1e6
        where = (d.nodes + scale * moved[part]) * 1e3
        picture = right.tripcolor(
            *where.T, d.triangles, size, shading="gouraud", cmap="YlOrBr", vmin=0, vmax=max(largest * 1e6, 1e-6), rasterized=True
        )
        for position, look in ((d.nodes * 1e3, {"lw": 0.7, "color": PALE}), (where, {"lw": 1.0, "color": INK})):
            right.plot(*_polyline(d, position).T, **look)
    right.set_title(f"At {point.condition.temperature:g} °C, displacement × {scale:g}")
    bar = figure.colorbar(picture, ax=right, shrink=0.75, pad=0.02)
    bar.set_label("displacement, µm")
    bar.outline.set_visible(False)
    for axes in (left, right):
        axes.set_aspect("equal", anchor="W" if slender else "C")  # beside a slender section there is room for names and title
        axes.set_xlabel("radius, mm")
        axes.grid(False)
        axes.axvline(0, color=INK, lw=0.6, ls="-.")
    left.set_ylabel("height z, mm")
    return svg(figure, key, "section of the spindle with materials, and its thermal deformation"), scale


def _polyline(d: DeformedSection, position: Array) -> Array:
    """All region boundaries of a part as one line (n, 2) broken by NaN: edges of one triangle, or between two regions."""
    edges = np.sort(d.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(d.region_of, 3)
    every, index, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    low = np.full(len(every), len(d.regions))
    high = np.full(len(every), -1)
    np.minimum.at(low, index.ravel(), owner)
    np.maximum.at(high, index.ravel(), owner)
    ends = position[every[(count == 1) | (low != high)]]
    return np.insert(ends, 2, np.nan, axis=1).reshape(-1, 2)


def _materials(axes: Axes, spindle: Spindle) -> list[Patch]:
    """Draws regions and rolling elements; the key's entries."""
    used = list(dict.fromkeys(g.material for g in spindle.regions))
    paint = {name: MATERIALS[i % len(MATERIALS)] for i, name in enumerate(used)}
    edges = dict(zip(PARTS, (INK, "#7a3d8f"), strict=True))
    for g in spindle.regions:
        (r0, r1), (z0, z1) = (np.array(side) * 1e3 for side in (g.r, g.z))
        axes.add_patch(Rectangle((r0, z0), r1 - r0, z1 - z0, fc=paint[g.material], ec=edges[g.part], lw=0.9))
    for b in spindle.ringed:
        r, z, size = b.pitch_diameter * 500, b.z * 1e3, b.ball_diameter * 1e3
        if isinstance(b, RollerBearing):
            for offset in b.offsets:
                low = z + 1e3 * (offset - b.roller_length / 2)
                axes.add_patch(Rectangle((r - size / 2, low), size, b.roller_length * 1e3, fc="#f4f4f2", ec=INK, lw=0.8))
        else:
            axes.add_patch(Circle((r, z), size / 2, fc="#f4f4f2", ec=INK, lw=0.8))
        beside = max(g.r[1] for g in spindle.regions if g.z[0] - 1e-3 < b.z < g.z[1] + 1e-3) * 1e3
        line = {"arrowstyle": "-", "color": INK, "lw": 0.6, "shrinkA": 1, "shrinkB": 4}
        axes.annotate(f"{b.name} bearing", (r, z), (beside + 1.2, b.z * 1e3), va="center", fontsize=8.5, arrowprops=line)
    handles = [Patch(fc=paint[name], ec="none", label=name) for name in used]
    handles += [Patch(fc="none", ec=edges[part], label=f"{part} part") for part in PARTS]
    return handles
