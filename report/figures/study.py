"""Figures of a study: frequencies along a sweep, spread and sensitivities of a Monte Carlo, a fleet with who stands apart."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from thermospindle.model.types import Array
from thermospindle.report.figures.common import BEARINGS, INK, PALE, SAME, STYLE, colour, least_span
from thermospindle.sim.study.rows import OF_RUNOUT, Cases, of_runout
from thermospindle.sim.study.sensitivity import APART
from thermospindle.sim.study.summary import at_conditions, first_set, frequencies, numbers

Told = dict[str, Any]
SHOWN = 12  # parameters of a map of sensitivities, campaigns' numbers of a map of distances
PANELS, COLUMNS = 6, 4  # half the modes drawn, and how many beside each other
NAMED = 4  # scenes of a title
KEYED = 12  # lines named below a figure
WIDTH, HANDLE, LETTER = 10.0, 0.6, 0.067  # inches: of a figure of panels, of a key's line, of a letter beside it
CHANNELS: dict[str, list[dict[str, Any]]] = {
    "dashes": [{"ls": "-"}, {"ls": (0, (3, 1.5)), "lw": 1.9, "zorder": 1.9}, {"ls": (0, (1, 1)), "lw": 3.4, "zorder": 1.8}, {"ls": (0, (6, 1, 1, 1)), "lw": 4.6, "zorder": 1.7}],
    "marks": [{"marker": "o", "ms": 2.2}, {"marker": "o", "ms": 5.5, "mfc": "none"}, {"marker": "x", "ms": 5.0}, {"marker": "s", "ms": 7.5, "mfc": "none"}, {"marker": "+", "ms": 8.0}],
    "colours": [{"color": paint} for paint, _, _ in BEARINGS],
}
"""What sets lines apart, value by value."""


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
    kinds = kinds_of(of)
    panels = [(f"mode {n} {kinds.get(n, '')}".rstrip() + ", Hz", y) for n, y in frequencies(table).items()][: 2 * PANELS]
    if of.study.runout:
        panels += [(f"{key.split('_')[0].upper()} {probe}, µm", numbers(table, f"{key}.{probe}")) for key in of_runout(of.spindle) for probe in ("x", "axial")]
    panels += [(f"preload {b.name}, N", numbers(table, f"preload_N.{b.name}")) for b in of.spindle.bearings]
    with rc_context(STYLE):
        figure, grid = _grid(len(panels))
        looks, key = looks_of(others, list(lines))
        for axes, (title, y) in zip(grid, panels, strict=False):
            for told, rows in lines.items():
                rows = sorted(rows, key=lambda i: x[i])
                axes.plot(x[rows], y[rows], **looks[told])
            least_span(axes, y)
            axes.set_title(title)
        for axes in grid[max(0, len(panels) - COLUMNS) : len(panels)]:
            axes.set_xlabel(_worded(varied[along]))
        if 1 < len(key) <= KEYED:
            longest = max(len(str(line.get_label())) for line in key)
            figure.legend(handles=key, loc="outside lower center", ncols=max(1, min(COLUMNS, len(key), int(WIDTH / (HANDLE + LETTER * longest)))))
    return {"sweep": figure}


Look = dict[str, Any]


def kinds_of(of: Cases) -> dict[int, str]:
    """The kinds of the numbered modes of the scene as it stands, at the first condition that has them."""
    found: dict[int, str] = {}
    for _, modes in of.own.values():
        for number, mode in enumerate(modes, 1):
            found.setdefault(number, mode.kind)
    return found


UNIT = re.compile(r"_((?:N|W|J|Pa|GPa|C|K|Hz|kg|g|m|mm|um|s|deg|rad)\d?(?:_m\d?)?(?:_per_\w+)?)$")


def _worded(key: str) -> str:
    """A key of a scene in words with its unit: of `bearing_pair.preload_N` 'bearing pair preload, N'."""
    unit = UNIT.search(key)
    name = (key[: unit.start()] if unit else key).split(".")[-2:]
    return " ".join(name).replace("_", " ") + (f", {unit[1].replace('_per_', '/').replace('_', ' ').replace('um', 'µm')}" if unit else "")


def headed(drawn: Mapping[str, Figure], title: str, scenes: Sequence[str]) -> Mapping[str, Figure]:
    """The figures of a study, each below what study it is of and of which scene or scenes."""
    said = f"{title}: {', '.join(scenes[:NAMED])}" + f" and {len(scenes) - NAMED} more" * (len(scenes) > NAMED)
    for figure in drawn.values():
        figure.suptitle(textwrap.fill(said, int(figure.get_figwidth() / 0.09)), x=0.01, ha="left", fontweight="bold", fontsize=9.5)
    return drawn


def looks_of(others: Sequence[str], lines: Sequence[tuple[Any, ...]]) -> tuple[dict[tuple[Any, ...], Look], list[Line2D]]:
    """How each line is drawn, whose values of `others` are its key, and the key of the figure: one entry for each value.

    A quantity has a look of its own: temperature the colours from cold to hot, of the others the first that are free
    of dashes, marks, and, where temperature is none of them, the colours of things. What is left shares the last.
    Lines that cover each other are told apart: wide dashes beneath thin ones, large open marks about small ones.
    """
    free = ["dashes", "marks"] if "temperature_C" in others else ["dashes", "marks", "colours"]
    names = sorted((c for c in others if c != "temperature_C"), key=lambda c: c != "speed_rpm")  # speed dashed, wherever it varies
    channels = {"colours": ["temperature_C"]} if "temperature_C" in others else {}
    for k, name in enumerate(names):
        channels.setdefault(free[min(k, len(free) - 1)], []).append(name)
    looks: dict[tuple[Any, ...], Look] = {told: {"color": INK, "lw": 0.9, "marker": "o", "ms": 2.2} for told in lines}
    key = []
    for channel, own in channels.items():
        at = [others.index(name) for name in own]
        values = list(dict.fromkeys(tuple(told[i] for i in at) for told in lines))
        for k, value in enumerate(values):
            look = {"color": colour(value[0], [v[0] for v in values])} if own == ["temperature_C"] else CHANNELS[channel][k % len(CHANNELS[channel])]
            key.append(Line2D([], [], **({"color": INK, "lw": 0.9} | look), label=", ".join(map(_said, own, value))))
            for told in lines:
                if tuple(told[i] for i in at) == value:
                    looks[told] = looks[told] | look
    return looks, key


def _said(column: str, value: Any) -> str:
    """What a line is at, by the last two words of the key, of which the first says whose it is."""
    unit = {"temperature_C": "°C", "speed_rpm": "rpm"}.get(column)
    told = value if isinstance(value, float) else json.loads(value)  # as a table of cases has what is no number
    number = ", ".join(f"{v:g}" if isinstance(v, int | float) else str(v) for v in (told if isinstance(told, list) else [told]))
    return f"{number} {unit}" if unit else f"{' '.join(column.removeprefix('vary.').split('.')[-2:])} {number}"


def _grid(count: int) -> tuple[Figure, list[Axes]]:
    """Panels in rows of four, those beyond `count` empty."""
    rows = max(1, -(-count // COLUMNS))
    figure = Figure(figsize=(WIDTH, 1.9 * rows + 0.9))
    grid = list(figure.subplots(rows, COLUMNS, squeeze=False).flat)
    for axes in grid[count:]:
        axes.set_axis_off()
    return figure, grid


def monte_carlo(of: Cases, table: pa.Table, told: Told) -> dict[str, Figure]:
    """Spread of modes and preload at every condition, and sensitivities at the last."""
    with rc_context(STYLE):
        found = {"spread": _spreads(of, first_set(of, table))}
        last = told["conditions"][-1]
        if any(own.get("sensitivity") for _, own in _answers(last)):
            found["sensitivity"] = _sensitivities(last)
        if any(own.get("indices") for _, own in _answers(last)):
            found["indices"] = _indices(last)
    return found


def _spreads(of: Cases, table: pa.Table) -> Figure:
    parts = at_conditions(of, table)
    every = [here["temperature_C"] for here, _ in parts]
    modes = sorted({n for _, rows in parts for n in frequencies(rows)})[: 2 * PANELS]
    columns = {f"preload {b.name}": f"preload_N.{b.name}" for b in of.spindle.bearings}
    if of.study.runout:
        columns |= {f"{'RRO' if key == 'rro_um' else 'NRRO 6 s.d.'} {probe}": f"{key}.{probe}" for key in of_runout(of.spindle) for probe in ("x", "y", "axial")}
    kinds = kinds_of(of)
    titles = [f"mode {n} {kinds.get(n, '')}".rstrip() for n in modes] + list(columns)
    figure, grid = _grid(len(titles))
    for k, title in enumerate(titles):
        axes = grid[k]
        for here, rows in parts:
            values = frequencies(rows).get(modes[k]) if k < len(modes) else numbers(rows, columns[title])
            known = values[np.isfinite(values)] if values is not None else np.array([])
            if len(known) > 1 and not known.any():
                axes.axvline(0.0, color=colour(here["temperature_C"], every), ls="--" if here["speed_rpm"] else "-")
            elif len(known) > 1:
                label = f"{here['temperature_C']:g} °C" + (f", {here['speed_rpm']:g} rpm" if here["speed_rpm"] else "")
                least, middle = SAME * float(np.abs(known).max()), float(known.mean())
                bins: Look = {"bins": "auto"} if np.ptp(known) > least else {"bins": 1, "range": (middle - least, middle + least)}
                axes.hist(known, **bins, density=True, histtype="step", color=colour(here["temperature_C"], every), ls="--" if here["speed_rpm"] else "-", label=label)  # fmt: skip
        if axes.lines and not axes.patches:
            axes.set(xlim=(-1.0, 1.0), xticks=[0.0])
            axes.text(0.04, 0.5, "0 in every draw", transform=axes.transAxes, va="center", color=PALE)
        axes.set_title(title)
        axes.set_yticks([])
        if k % COLUMNS == 0:
            axes.set_ylabel("density of the draws")
        axes.set_xlabel("Hz" if k < len(modes) else "µm" if "RRO" in title else "N")
    handles, labels = grid[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=min(6, len(handles)))
    return figure


def _answers(told: Told) -> list[tuple[str, Told]]:
    """What a condition tells, and of what: modes, preloads, runout."""
    own = [(f"{m['mode']} {m['kind']}", m) for m in told["modes"]] + [(f"preload {name}", p) for name, p in told["preload_N"].items()]
    return own + [(f"{key.split('_')[0].upper()} {probe}", v) for key in OF_RUNOUT for probe, v in told.get(key, {}).items()]


def _sensitivities(told: Told) -> Figure:
    """Coefficients that are clear; the others are left blank."""
    own = [(f"{label}\nr² {s['r2']:.2f}", {n: c["value"] if c["clear"] else np.nan for n, c in s["coefficients"].items()}) for label, a in _answers(told) if (s := a.get("sensitivity"))]
    return _inputs_map(own, 1.0, "Standardised regression coefficients", told)


def _indices(told: Told) -> Figure:
    """Total indices that are clear."""
    own = [(label, {n: i["total"] if i["clear"] else np.nan for n, i in s["of"].items()}) for label, a in _answers(told) if (s := a.get("indices"))]
    return _inputs_map(own, 1.0, "Shares of variance with all interactions (total Sobol indices)", told)


def _inputs_map(own: Sequence[tuple[str, Mapping[str, float]]], largest: float, title: str, told: Told) -> Figure:
    """The inputs that matter most somewhere, against what they move."""
    most = {n: max(float(np.nan_to_num(abs(values.get(n, np.nan)))) for _, values in own) for n in dict.fromkeys(n for _, values in own for n in values)}
    shown = sorted(most, key=lambda n: -most[n])[:SHOWN]
    values = np.array([[by.get(n, np.nan) for _, by in own] for n in shown])
    figure = Figure(figsize=(2.8 + 0.62 * len(own), 1.5 + 0.3 * len(shown)))
    axes = figure.subplots()
    picture = _map(axes, values, largest, shown, [label for label, _ in own], ".2f", 0.05)
    bar = figure.colorbar(picture, ax=axes, shrink=0.9, pad=0.01)
    bar.outline.set_visible(False)
    bar.set_label("blank: not clear of chance")
    heading = f"{title}, {told['temperature_C']:g} °C, {told['speed_rpm']:g} rpm"
    axes.set_title(textwrap.fill(heading, int((figure.get_figwidth() - 1.5) / 0.09)))
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


def _map(axes: Axes, values: Array, largest: float, rows: Sequence[str], columns: Sequence[str], form: str, least: float) -> AxesImage:
    """A matrix in colours, its numbers of at least `least` written into it."""
    picture = axes.imshow(values, aspect="auto", cmap="RdBu_r", norm=TwoSlopeNorm(0.0, -largest, largest))
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", fontsize=7.5)
    axes.grid(visible=False)
    for i, j in zip(*np.nonzero(np.abs(np.nan_to_num(values)) >= least), strict=True):
        value = values[i, j]
        axes.text(j, i, format(value, form).replace("-", "−"), ha="center", va="center", fontsize=7, color="white" if abs(value) > 0.7 * largest else INK)
    return picture
