"""Pictures of a comparison: map of residuals, shapes, FRFs over each other, FDAC, correlation by
band and by FRF. Every function returns a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D

from thermospindle.diagnosis.compare.compare import Comparison, PairedMode, TestComparison
from thermospindle.diagnosis.compare.correlation import Band, Correlation, Pair
from thermospindle.model.rotor.modes import to_real
from thermospindle.model.types import Array
from thermospindle.model.units import MM
from thermospindle.report.figures.common import INK, PALE, STYLE, cells, colour, label, residual_bar, residual_norm
from thermospindle.report.typeset import UNITS, signed_short
from thermospindle.sim.identification.frf import decibel

MOST, MOST_ALONE = 3, 6  # FRFs over each other, of every test and of one alone
ACROSS, FEW = 4, 4  # shapes in a row, and points along an axis from which these are drawn over height
MEASURED = "#c9371c"
NUMBER = 0.04  # of the width of an FRF that the number of a mode takes
FDAC_LINES = 260  # about, of an FDAC map


def figures(c: Comparison) -> dict[str, Figure]:
    """All pictures that the campaign has data for, by the name of their file."""
    drawn: dict[str, Figure] = {}
    if any(t.modes for t in c.tests):
        drawn["pulls"] = residual_map(c)
    if any(t.shapes for t in c.tests):
        drawn["shapes"] = shapes(c)
    if with_frfs(c):
        drawn |= {"frfs": overlay(c), "bands": by_band(c), "channels": by_frf(c), "fdac": fdac_maps(c)}
    return drawn


def with_frfs(c: Comparison) -> list[tuple[TestComparison, Correlation]]:
    return [(t, t.correlation) for t in c.tests if t.correlation is not None]


@rc_context(STYLE)
def residual_map(c: Comparison) -> Figure:
    """Errors in standard errors, mode by test, frequencies and dampings; what has no partner stands below."""
    modes = {m.number: f"{m.number} {m.kind}" for t in c.tests for m in sorted(t.modes, key=lambda m: m.number)}
    modes = dict(sorted(modes.items()))
    measures: list[tuple[str, Callable[[PairedMode], float | None]]] = [("Frequency", lambda m: m.residual)]
    if any(m.damping_residual is not None for t in c.tests for m in t.modes):
        measures.append(("Damping ratio", lambda m: m.damping_residual))
    wide = max(4.6, 1.5 + 0.72 * len(c.tests))
    figure = _figure(min(11.0, wide * len(measures)) if len(measures) > 1 else wide, 1.9 + 0.3 * (len(modes) + 2))
    panels = figure.subplots(1, len(measures), squeeze=False, sharey=True)[0]
    grids = [_grid(c, list(modes), value) for _, value in measures]
    largest = max(float(np.nanmax(np.abs(g), initial=0.0)) for g in grids)
    norm = residual_norm(largest)
    for axes, grid, (title, _) in zip(panels, grids, measures, strict=True):
        cells(axes, grid, norm, "RdBu_r", signed_short)
        axes.set_title(f"{title}: computed − measured")
        axes.set_xticks(range(len(c.tests)), [label(t.test) for t in c.tests], fontsize=7.5)
    panels[0].set_yticks(range(len(modes) + 2), [*modes.values(), "only measured", "only computed"])
    for k, t in enumerate(c.tests):
        for row, lost in enumerate((t.missing, t.extra)):
            panels[0].text(k, len(modes) + row, str(len(lost)) if lost else "–", ha="center", va="center", fontsize=8, color=INK)
    for axes in panels:
        axes.set_ylim(len(modes) + 1.5, -0.5)
        axes.axhline(len(modes) - 0.5, color=INK, lw=0.8)
    residual_bar(figure, norm, list(panels), shrink=0.9, pad=0.015, aspect=25)
    return figure


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height))
    engine = figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)  # STYLE asks for it
    engine.set(w_pad=0.06, h_pad=0.07)
    return figure


def _grid(c: Comparison, modes: Sequence[int], value: Callable[[PairedMode], float | None]) -> Array:
    """Values (modes, tests), NaN where there is none."""
    grid = np.full((len(modes), len(c.tests)), np.nan)
    for k, t in enumerate(c.tests):
        for m in t.modes:
            number = value(m)
            grid[modes.index(m.number), k] = np.nan if number is None else number
    return grid


@rc_context(STYLE)
def shapes(c: Comparison) -> Figure:
    """Measured and computed shapes of the first test that tells any: over height where its points
    stand along the axis in one direction, else point by point."""
    test = next(t for t in c.tests if t.shapes)
    told = sorted(test.shapes, key=lambda own: own.number)
    columns = min(len(told), ACROSS)
    rows = -(-len(told) // columns)
    points = told[0].points
    heights = np.array([p.position[2] / MM for p in points])
    along = len({round(float(z), 6) for z in heights}) == len(points) >= FEW and len({p.axis[1] for p in points}) == 1
    order = np.argsort(heights) if along else np.arange(len(points))
    at = heights[order] if along else np.arange(len(points), dtype=float)
    figure = _figure(1.0 + 2.6 * columns, 0.8 + 1.9 * rows)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    frequency = {m.number: m.measured for m in test.modes}
    for axes, own in zip_longest(panels.flat, told):
        if own is None:
            axes.set_axis_off()
            continue
        turn = to_real(own.measured)
        measured, computed = ((shape * turn).real[order] for shape in (own.measured, own.computed))
        axes.plot(at, computed, color=INK, lw=0.9, marker="_", ms=9, mew=1.2, ls=(0, (4, 2)) if along else "none")
        axes.errorbar(at, measured, own.sd[order], color=MEASURED, fmt="o", ms=3.5, lw=0.9, capsize=1.5)
        axes.axhline(0.0, color=PALE, lw=0.6)
        axes.set_title(f"{own.number}   {frequency[own.number]:.4g} Hz")
        if not along:
            axes.set_xticks(at, [p.name or str(p.node) for p in points], rotation=90, fontsize=7)
    if along:
        figure.supxlabel("height of the point, mm", fontsize=8.5)
    figure.supylabel("of the largest", fontsize=8.5)
    handles = [Line2D([], [], color=MEASURED, marker="o", ms=3.5, ls="none", label=f"measured, {label(test.test, ', ')}"), Line2D([], [], color=INK, lw=0.9, marker="_", ms=9, ls=(0, (4, 2)) if along else "none", label="computed")]
    figure.legend(handles=handles, loc="outside upper right", ncols=2)
    return figure


@rc_context(STYLE)
def overlay(c: Comparison) -> Figure:
    """Measured and computed FRFs over each other, a row a test, a column an FRF; of one test alone more of them, in rows of their own."""
    tests = with_frfs(c)
    every = [t.test.temperature for t, _ in tests]
    alone = len(tests) == 1
    pairs = shown_pairs(tests[0][1], MOST_ALONE if alone else MOST)
    columns = min(len(pairs), MOST)
    rows = -(-len(pairs) // columns) if alone else len(tests)
    figure = _figure(10.3, 0.9 + (2.1 if alone else 1.35) * rows)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=False if alone else "col")
    every_row = [(*tests[0], pairs[k : k + columns]) for k in range(0, len(pairs), columns)] if alone else [(*row, pairs) for row in tests]
    for k, ((t, found, own), row) in enumerate(zip(every_row, panels, strict=True), 1):
        for axes, pair in zip_longest(row, own):
            axes.tick_params(labelbottom=alone or k == rows)
            ij = found.pairs.get(pair)
            if ij is None:
                axes.set_axis_off()
                continue
            axes.plot(found.frequency, decibel(found.measured[ij]), color=colour(t.test.temperature, every), lw=2.4, alpha=0.55)
            axes.plot(found.frequency, decibel(found.computed[ij]), color=INK, lw=0.8, ls=(0, (4, 2)))
            _number_modes(axes, t.modes, (found.frequency[0], found.frequency[-1]))
        row[0].set_ylabel(label(t.test))
    for k, pair in enumerate(pairs):
        panels.flat[k].set_title(f"H({pair[0]},{pair[1]})" + (" driving point" if pair[0] == pair[1] else ""), pad=14)
    for axes in panels[-1]:
        axes.set_xlabel("frequency, Hz")
        axes.set_xlim(tests[0][1].frequency[0], tests[0][1].frequency[-1])
    quantity = tests[0][1].beside.measured.quantity
    figure.supylabel(f"{quantity}, dB re 1 {UNITS[quantity]}", fontsize=8.5)
    handles = [Line2D([], [], color=colour(t, every), lw=2.4, alpha=0.55, label=f"measured, {t:g} °C") for t in sorted(set(every))]
    handles.append(Line2D([], [], color=INK, lw=0.8, ls=(0, (4, 2)), label="computed"))
    if any(t.modes for t, _ in tests):
        handles.append(Line2D([], [], color=PALE, marker="|", ls="none", ms=6, label="paired mode and its number, where measured"))
    figure.legend(handles=handles, loc="outside upper right", ncols=min(len(handles), 6))
    return figure


def _number_modes(axes: Axes, modes: Sequence[PairedMode], band: tuple[float, float]) -> None:
    """A tick at the top of an FRF at every paired mode's measured frequency, with its number;
    neighbours without room for two numbers share a place."""
    groups: list[list[PairedMode]] = []
    for m in sorted((m for m in modes if band[0] <= m.measured <= band[1]), key=lambda m: m.measured):
        axes.plot(m.measured, 0.985, marker="|", ms=6, color=PALE, transform=axes.get_xaxis_transform(), clip_on=False)
        groups.append([m])
        while len(groups) > 1 and _middle(groups[-1]) - _middle(groups[-2]) < NUMBER * (len(groups[-2]) + len(groups[-1])) / 2 * (band[1] - band[0]):
            groups[-2:] = [groups[-2] + groups[-1]]
    for group in groups:
        axes.text(_middle(group), 1.01, ",".join(str(m.number) for m in group), transform=axes.get_xaxis_transform(), ha="center", va="bottom", fontsize=7, color=PALE)


def _middle(group: Sequence[PairedMode]) -> float:
    return float(np.mean([m.measured for m in group]))


def shown_pairs(found: Correlation, most: int) -> list[Pair]:
    """Driving points, then the loudest of the other FRFs, `most` of them."""
    return sorted(found.pairs, key=lambda p: (p[0] != p[1], -float(np.linalg.norm(found.measured[found.pairs[p]])) if p[0] != p[1] else 0.0))[:most]


def _share(value: float) -> str:
    """Of one, in two digits and little room."""
    return f"{value:.2f}".removeprefix("0") if value < 0.995 else "1"


def _third(b: Band) -> int:
    """The number of a third of an octave, counted from that about 1000 Hz."""
    return round(10 * np.log10(np.sqrt(b.low * b.high) / 1000))


@rc_context(STYLE)
def by_band(c: Comparison) -> Figure:
    """CSAC, CSF and the shift by FDAC, test by band."""
    tests = with_frfs(c)
    parts: dict[int, list[Band]] = {}  # a third of an octave is one column, however much of it each test's lines reach
    for b in (b for _, found in tests for b in found.bands):
        parts.setdefault(_third(b), []).append(b)
    edges = {k: (min(b.low for b in parts[k]), max(b.high for b in parts[k])) for k in sorted(parts)}
    values: dict[str, Array] = {name: np.full((len(tests), len(edges)), np.nan) for name in ("csac", "csf", "shift")}
    for i, (_, found) in enumerate(tests):
        for b in found.bands:
            place = i, list(edges).index(_third(b))
            numbers = (b.csac, b.csf, np.nan if b.shift is None else 100 * b.shift)
            for grid, value in zip(values.values(), numbers, strict=True):
                grid[place] = value
    figure = _figure(10.3, 1.0 + 3 * (0.45 + 0.3 * len(tests)))
    panels = figure.subplots(3, 1, sharex=True)  # below each other, where there is room for numbers
    far = max(1.0, float(np.nanmax(np.abs(values["shift"]), initial=0.0)))
    looks: list[tuple[str, Normalize, str, Callable[[float], str]]] = [
        ("Shape: mean CSAC", Normalize(0, 1), "YlGnBu", _share),
        ("Amplitude: mean CSF", Normalize(0, 1), "YlGnBu", _share),
        ("Shift of the model, %, by FDAC", Normalize(-far, far), "RdBu_r", lambda v: "0" if abs(v) < 0.05 else f"{v:+z.1f}"),
    ]
    size = min(7.5, 170 / max(len(edges), 1))  # signed numbers stand side by side
    for axes, grid, (title, norm, colours, text) in zip(panels, values.values(), looks, strict=True):
        picture = cells(axes, grid, norm, colours, text, size)
        axes.set_title(title)
        axes.set_xticks(range(len(edges)), [f"{a:.0f}–{b:.0f}" for a, b in edges.values()], fontsize=7, rotation=90)
        axes.set_yticks(range(len(tests)), [label(t.test, ", ") for t, _ in tests])
        figure.colorbar(picture, ax=axes, pad=0.01, aspect=3 + 2 * len(tests)).outline.set_visible(False)
    panels[-1].set_xlabel("band, Hz")
    return figure


@rc_context(STYLE)
def by_frf(c: Comparison) -> Figure:
    """FRAC and CSF of every FRF over all its lines, FRF by test; grey where symmetry forbids an answer."""
    tests = with_frfs(c)
    pairs = list(dict.fromkeys(p for _, found in tests for p in found.pairs))
    grids = [np.full((len(pairs), len(tests)), np.nan) for _ in range(2)]
    for j, (_, found) in enumerate(tests):
        for pair, shape in found.whole.by_frf.items():
            for grid, value in zip(grids, (shape.frac, shape.csf), strict=True):
                grid[pairs.index(pair), j] = np.nan if value is None else value
    figure = _figure(10.3, 1.5 + 0.24 * len(pairs))
    panels = figure.subplots(1, 2, sharey=True)
    for axes, grid, title in zip(panels, grids, ("Shape: FRAC", "Amplitude: CSF"), strict=True):
        picture = cells(axes, grid, Normalize(0, 1), "YlGnBu", lambda v: f"{v:.2f}", 7.0)
        axes.set_title(title)
        axes.set_xticks(range(len(tests)), [label(t.test) for t, _ in tests], fontsize=7.5)
    panels[0].set_yticks(range(len(pairs)), [f"H({r},{h})" for r, h in pairs])
    figure.colorbar(picture, ax=list(panels), shrink=0.9, pad=0.015, aspect=25).outline.set_visible(False)
    return figure


@rc_context(STYLE)
def fdac_maps(c: Comparison) -> Figure:
    """FDAC of the tests with the best and the worst CSAC: computed over measured frequency."""
    tests = sorted(with_frfs(c), key=lambda pair: -np.nan_to_num(pair[1].whole.csac))
    chosen = tests if len(tests) < 2 else [tests[0], tests[-1]]
    figure = _figure(4.9 * len(chosen) + 0.5, 4.4)
    panels = figure.subplots(1, len(chosen), squeeze=False)[0]
    for axes, (t, found) in zip(panels, chosen, strict=True):
        some = range(0, len(found.frequency), max(1, len(found.frequency) // FDAC_LINES))
        lines = found.frequency[list(some)]
        picture = axes.pcolormesh(lines, lines, found.fdac(some, some), cmap="YlGnBu", vmin=0, vmax=1, shading="nearest", rasterized=True)
        axes.axline((lines[0], lines[0]), slope=1, color=PALE, lw=0.7)
        shifts: Mapping[tuple[float, float], float] = {(b.low, b.high): b.shift for b in found.bands if b.shift is not None}
        for (low, high), shift in shifts.items():
            axes.plot([low, high], np.array([low, high]) * (1 + shift), color="#c9371c", lw=1.4)
        words = "" if found.whole.shift is None else f", shift {100 * found.whole.shift:+z.2f} %".replace("-", "−")
        axes.set_title(f"{label(t.test, ', ')}{words}")
        axes.set(xlabel="measured frequency, Hz", ylabel="computed frequency, Hz", aspect="equal")
        axes.set(xlim=(lines[0], lines[-1]), ylim=(lines[0], lines[-1]))
        axes.grid(False)
    bar = figure.colorbar(picture, ax=list(panels), shrink=0.85, pad=0.02)
    bar.set_label("FDAC")
    bar.outline.set_visible(False)
    return figure
