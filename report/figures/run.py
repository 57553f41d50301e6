"""Small figures of a run for its Rerun log: bearing states over temperature, first hits, and the key to the FRFs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from thermospindle.model.types import Array
from thermospindle.report.figures.common import INK, STYLE, least_span

Colour = str | tuple[float, float, float]
Curves = Sequence[tuple[Array, Array, Colour]]
FITS = 5  # names beside each other above the charts
SMALL = {**STYLE, "font.size": 7.5, "axes.titlesize": 7.5, "axes.titleweight": "normal", "xtick.labelsize": 7, "ytick.labelsize": 7}


def panels(titled: Mapping[str, Curves], columns: int, size: tuple[float, float], unit: str, named: Mapping[str, Colour] | None = None) -> Figure:
    """Small charts of curves (x, y, colour) in rows of `columns`; `unit` of x below the lowest of
    them, above them what colours are `named`."""
    with rc_context(SMALL):
        figure = Figure(figsize=size)
        rows = -(-len(titled) // columns)
        every = figure.subplots(rows, columns, squeeze=False)
        for k, (axes, (title, curves)) in enumerate(zip(every.flat, titled.items(), strict=False)):
            for x, y, colour in curves:
                axes.plot(x, y, color=colour, lw=1.2, marker="o" if len(x) == 1 else "")
            if curves:
                least_span(axes, np.concatenate([np.ravel(y) for _, y, _ in curves]))
            axes.set_title(title)
            axes.xaxis.set_major_locator(MaxNLocator(2))
            axes.yaxis.set_major_locator(MaxNLocator(3))
            axes.ticklabel_format(useOffset=False)
            if k + columns >= len(titled):
                axes.set_xlabel(unit)
        for axes in every.flat[len(titled) :]:
            axes.set_axis_off()
        handles = [Line2D([], [], color=colour, lw=2, label=name) for name, colour in (named or {}).items()]
        if handles:
            figure.legend(handles=handles, loc="outside upper left", ncols=FITS, fontsize=7, columnspacing=1.0, handlelength=1.0, handletextpad=0.4)
    return figure


LETTER = 0.012
"""Width of a letter of the key over that of the band."""


def _numbers(group: Sequence[int]) -> str:
    return ("mode " if group[0] == 1 else "") + " ".join(map(str, group))


def _middle(modes: Sequence[float], group: Sequence[int]) -> float:
    return float(np.mean([modes[n - 1] for n in group]))


def _touch(modes: Sequence[float], left: Sequence[int], right: Sequence[int], band: tuple[float, float]) -> bool:
    """Whether the numbers of two groups, each about the middle of its modes, would run into each other."""
    letters = (len(_numbers(left)) + len(_numbers(right))) / 2 + 1
    return _middle(modes, right) - _middle(modes, left) < letters * LETTER * (band[1] - band[0])


def key(curves: Sequence[tuple[str, Colour]], marks: Sequence[tuple[str, Colour, str]], modes: Sequence[float], band: tuple[float, float],
        size: tuple[float, float]) -> Figure:  # fmt: skip
    """What colours and marks (name, colour, marker) of a plot of FRFs mean, and below it the numbers of the `modes` (Hz, from 1) where
    they stand in its `band`."""
    with rc_context(SMALL):
        figure = Figure(figsize=size)
        figure.set_layout_engine("none")
        handles = [Line2D([], [], color=colour, lw=2, label=name) for name, colour in curves]
        handles += [Line2D([], [], color=colour, marker=marker, ls="none", ms=5, label=name) for name, colour, marker in marks]
        figure.legend(handles=handles, loc="upper center", ncols=len(handles), columnspacing=1.0, handlelength=1.0, handletextpad=0.4)
        axes = figure.add_axes((0.06, 0.0, 0.94, 0.45))
        axes.set_axis_off()
        axes.set(xlim=band, ylim=(0, 1))
        groups: list[list[int]] = []
        for number in range(1, len(modes) + 1):
            groups.append([number])
            while len(groups) > 1 and _touch(modes, groups[-2], groups[-1], band):
                groups[-2:] = [groups[-2] + groups[-1]]
        for group in groups:
            axes.text(_middle(modes, group), 0.4, _numbers(group), ha="center", va="center", color=INK)
    return figure
