"""Figures of a study: frequencies along a sweep, spread and sensitivities of a Monte Carlo, a fleet with who stands apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from thermospindle.model.types import Array
from thermospindle.report.figures.common import INK, PALE, STYLE, colour
from thermospindle.sim.study.rows import OF_RUNOUT, Cases
from thermospindle.sim.study.sensitivity import APART
from thermospindle.sim.study.summary import at_conditions, frequencies, numbers

Told = dict[str, Any]
SHOWN = 12  # parameters of a map of sensitivities, campaigns' numbers of a map of distances
PANELS, COLUMNS = 6, 4  # half the modes drawn, and how many beside each other
KEYED = 12  # lines named below a figure


def sweep(of: Cases, table: pa.Table) -> dict[str, Figure]:
    """Every mode, and every preload, along the number that takes the most values; a line for each combination of the others."""
    numeric = {f"vary.{key}": key for key, _ in of.study.vary if table.schema.field(f"vary.{key}").type == pa.float64()}
    varied = {**numeric, "temperature_C": "temperature, °C", "speed_rpm": "speed, rpm"}
    counts = {column: len(set(table[column].to_pylist())) for column in varied}
    along = max(counts, key=lambda column: counts[column])
    if counts[along] < 2:
        return {}
    others = [c for c in [f"vary.{key}" for key, _ in of.study.vary] + ["temperature_C", "speed_rpm"] if c != along and len(set(table[c].to_pylist())) > 1]
    lines: dict[tuple[Any, ...], list[int]] = {}
    for i, told in enumerate(zip(*(table[c].to_pylist() for c in others), strict=True) if others else [()] * len(table)):
        lines.setdefault(told, []).append(i)
    x = numbers(table, along)
    panels = [(f"mode {n}, Hz", y) for n, y in frequencies(table).items()][: 2 * PANELS]
    if of.study.runout:
        panels += [(f"{key.split('_')[0].upper()} {probe}, µm", numbers(table, f"{key}.{probe}")) for key in OF_RUNOUT for probe in ("x", "axial")]
    panels += [(f"preload {b.name}, N", numbers(table, f"preload_N.{b.name}")) for b in of.spindle.bearings]
    with rc_context(STYLE):
        figure, grid = _grid(len(panels))
        every = sorted(set(table["temperature_C"].to_pylist()))
        for axes, (title, y) in zip(grid, panels, strict=False):
            for k, (told, rows) in enumerate(lines.items()):
                rows = sorted(rows, key=lambda i: x[i])
                hot = told[others.index("temperature_C")] if "temperature_C" in others else None
                paint = colour(hot, every) if hot is not None else colour(k, range(len(lines)))
                marker, dash = _mark([v for c, v in zip(others, told, strict=True) if c != "temperature_C"], lines, others)
                axes.plot(x[rows], y[rows], dash, marker=marker, ms=2.5, lw=0.9, color=paint, label=", ".join(map(_said, others, told)))
            axes.set_title(title)
        for axes in grid[max(0, len(panels) - COLUMNS) : len(panels)]:
            axes.set_xlabel(varied[along])
        if 1 < len(lines) <= KEYED:
            figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return {"sweep": figure}


def _said(column: str, value: Any) -> str:
    """What a line is at, by the last word of the key."""
    unit = {"temperature_C": "°C", "speed_rpm": "rpm"}.get(column)
    number = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{number} {unit}" if unit else f"{column.rpartition('.')[2]} {number}"


def _mark(own: Sequence[Any], lines: Mapping[tuple[Any, ...], Any], others: Sequence[str]) -> tuple[str, str]:
    """Marker and dashes of a line by what sets it apart beside its temperature."""
    rest = list(dict.fromkeys(tuple(v for c, v in zip(others, told, strict=True) if c != "temperature_C") for told in lines))
    k = rest.index(tuple(own))
    return "o^sDv"[k % 5], ("-", "--", ":", "-.")[k % 4]


def _grid(count: int) -> tuple[Figure, list[Axes]]:
    """Panels in rows of four, those beyond `count` empty."""
    rows = max(1, -(-count // COLUMNS))
    figure = Figure(figsize=(10.0, 1.9 * rows + 0.9))
    grid = list(figure.subplots(rows, COLUMNS, squeeze=False).flat)
    for axes in grid[count:]:
        axes.set_axis_off()
    return figure, grid


def monte_carlo(of: Cases, table: pa.Table, told: Told) -> dict[str, Figure]:
    """Spread of modes and preload at every condition, and sensitivities at the last."""
    with rc_context(STYLE):
        found = {"spread": _spreads(of, table)}
        if any(m.get("sensitivity") for m in told["conditions"][-1]["modes"]):
            found["sensitivity"] = _sensitivities(told["conditions"][-1])
    return found


def _spreads(of: Cases, table: pa.Table) -> Figure:
    parts = at_conditions(of, table)
    every = [here["temperature_C"] for here, _ in parts]
    modes = sorted({n for _, rows in parts for n in frequencies(rows)})[: 2 * PANELS]
    columns = {f"preload {b.name}": f"preload_N.{b.name}" for b in of.spindle.bearings}
    if of.study.runout:
        columns |= {f"{'RRO' if key == 'rro_um' else 'NRRO 6 s.d.'} {probe}": f"{key}.{probe}" for key in OF_RUNOUT for probe in ("x", "y", "axial")}
    titles = [f"mode {n}" for n in modes] + list(columns)
    figure, grid = _grid(len(titles))
    for k, title in enumerate(titles):
        axes = grid[k]
        for here, rows in parts:
            values = frequencies(rows).get(modes[k]) if k < len(modes) else numbers(rows, columns[title])
            known = values[np.isfinite(values)] if values is not None else np.array([])
            if len(known) > 1:
                label = f"{here['temperature_C']:g} °C" + (f", {here['speed_rpm']:g} rpm" if here["speed_rpm"] else "")
                axes.hist(known, bins="auto" if np.ptp(known) > 0 else 1, density=True, histtype="step", color=colour(here["temperature_C"], every), ls="--" if here["speed_rpm"] else "-", label=label)  # fmt: skip
        axes.set_title(title)
        axes.set_yticks([])
        axes.set_xlabel("Hz" if k < len(modes) else "µm" if "RRO" in title else "N")
    handles, labels = grid[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(6, len(handles)))
    return figure


def _sensitivities(told: Told) -> Figure:
    own = [(f"{m['mode']} {m['kind']}", m["sensitivity"]) for m in told["modes"] if m.get("sensitivity")]
    own += [(f"preload {name}", p["sensitivity"]) for name, p in told["preload_N"].items() if p.get("sensitivity")]
    names = list(dict.fromkeys(n for _, s in own for n in s["coefficients"]))
    names.sort(key=lambda n: -max(abs(s["coefficients"][n]["value"]) for _, s in own))
    shown = names[:SHOWN]
    values = np.array([[s["coefficients"][n]["value"] for _, s in own] for n in shown])
    figure = Figure(figsize=(2.8 + 0.62 * len(own), 1.5 + 0.3 * len(shown)))
    axes = figure.subplots()
    _map(axes, values, 1.0, shown, [f"{label}\nr² {s['r2']:.2f}" for label, s in own], ".2f", 0.05)
    axes.set_title(f"Standardised regression coefficients, {told['temperature_C']:g} °C, {told['speed_rpm']:g} rpm")
    return figure


def fleet(rows: Sequence[Told], apart: Mapping[str, Array]) -> dict[str, Figure]:
    """The campaigns by their error, the largest first, and how far each number of each stands from the fleet's middle."""
    known = [k for k, r in enumerate(rows) if r.get("rms_residual") is not None]
    if not known:
        return {}
    order = sorted(known, key=lambda k: -rows[k]["rms_residual"])
    columns = [name for name, z in apart.items() if np.isfinite(z).any()]
    columns = sorted(columns, key=lambda name: -float(np.nanmax(np.abs(apart[name]))))[:SHOWN]
    with rc_context(STYLE):
        figure = Figure(figsize=(5.2 + 0.52 * len(columns), 1.9 + 0.26 * len(order)))
        left, right = figure.subplots(1, 2, width_ratios=[2.6, max(1.0, 0.5 * len(columns))])
        place = np.arange(len(order))
        left.barh(place, [rows[k]["rms_residual"] for k in order], color=PALE)
        left.axvline(1.0, color=INK, lw=0.8, ls="--")
        left.set_yticks(place, [rows[k]["campaign"] for k in order])
        left.invert_yaxis()
        left.set_xlabel("rms residual, standard errors")
        left.set_title("Error of the scene")
        values = np.array([[apart[name][k] for name in columns] for k in order])
        _map(right, values, 2 * APART, [""] * len(order), columns, ".1f", 1.0)
        right.set_title(f"Robust distance from the fleet; framed beyond {APART:g}")
        for i, j in zip(*np.nonzero(np.abs(np.nan_to_num(values)) > APART), strict=True):
            right.add_patch(_frame(int(j), int(i)))
    return {"fleet": figure}


def _frame(x: int, y: int) -> Rectangle:
    return Rectangle((x - 0.5, y - 0.5), 1, 1, fill=False, edgecolor=INK, lw=1.4)


def _map(axes: Axes, values: Array, largest: float, rows: Sequence[str], columns: Sequence[str], form: str, least: float) -> None:
    """A matrix in colours, its numbers of at least `least` written into it."""
    axes.imshow(values, aspect="auto", cmap="RdBu_r", norm=TwoSlopeNorm(0.0, -largest, largest))
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", fontsize=7.5)
    axes.grid(visible=False)
    for i, j in zip(*np.nonzero(np.abs(np.nan_to_num(values)) >= least), strict=True):
        value = values[i, j]
        axes.text(j, i, format(value, form).replace("-", "−"), ha="center", va="center", fontsize=7, color="white" if abs(value) > 0.7 * largest else INK)
