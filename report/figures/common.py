"""What all figures share: style, colours, inline SVG, maps of residuals in standard errors.

Text stays text and takes the page's font; the same data give the same characters. Two palettes never mix: cold to hot for
temperatures, the rest for bearings and sources.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize, SymLogNorm, to_hex
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import LogLocator, NullLocator
from scipy.optimize import isotonic_regression

from thermospindle.model.files.whole import whole
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.report.typeset import LINEAR, SMALLEST
from thermospindle.report.typeset import figure as framed
from thermospindle.sim.campaign.campaign import Test

INK, PALE = "#1b1c1d", "#84898f"
TEMPERATURES = LinearSegmentedColormap.from_list("cold to hot", ["#2166ac", "#8073ac", "#c9371c"])
BEARINGS = (
    ("#a0741a", "o", "-"), ("#7a3d8f", "^", "--"), ("#2e7d6b", "s", ":"), ("#555f6b", "D", "-."), ("#b0457b", "v", (0, (7, 2))), ("#3b6ea5", "P", (0, (3, 1, 1, 1, 1, 1))),
)  # fmt: skip
"""Colour, marker and dashes of a spindle's bearings in their order."""
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "thermospindle",
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": INK,
    "grid.alpha": 0.13,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "figure.constrained_layout.use": True,
    "savefig.facecolor": "none",
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    **{key: INK for key in ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color")},
}
DRAWN: dict[Any, Any] = STYLE | {"figure.constrained_layout.use": False}
"""The style of figures that are `laid_out`: where it asks for a layout, each time a figure is saved makes one anew."""

SVG = "{http://www.w3.org/2000/svg}"
REFERENCE = re.compile(r"#([a-zA-Z][\w.-]*)(?=\)|$)")  # of url(#id) and #id; also a colour, which is no element's id
DRAWN_BY = ("d", "points", "transform", "style", "x", "y", "x1", "y1", "x2", "y2", "width", "height", "viewBox")
"""Attributes that say where and how an element is drawn, in points: two decimals of them are enough."""
LONG = re.compile(r"-?\d+\.\d{3,}(?:e[-+]?\d+)?")
ElementTree.register_namespace("", SVG[1:-1])
ElementTree.register_namespace("xlink", "http://www.w3.org/1999/xlink")


def colour(temperature: float, every: Sequence[float]) -> str:
    """Colour of a temperature (C) among `every`: cold blue to hot red."""
    low, high = min(every), max(every)
    return to_hex(TEMPERATURES((temperature - low) / (high - low) if high > low else 0.0))


def laid_out(figure: Figure) -> Figure:
    """The figure with its axes where its layout puts them: worked out once, however often it is drawn then, in `DRAWN`."""
    if (layout := figure.get_layout_engine()) is not None:
        layout.execute(figure)
        figure.set_layout_engine(None)
    return figure


def save(figure: Figure, folder: Path, name: str, dpi: float = 150) -> None:
    """`name`.png and `name`.svg in a folder that exists: files of their own, on white; the same figure gives the same SVG."""
    with rc_context(DRAWN):
        laid_out(figure)
        look: dict[str, Any] = {"dpi": dpi, "facecolor": "white", "bbox_inches": "tight"}  # tight: no name beside the axes is cut off
        with whole(folder / f"{name}.png") as file:
            figure.savefig(file, **look)
        with whole(folder / f"{name}.svg") as file:
            figure.savefig(file, **look, metadata={"Date": None})


def save_all(figures: Mapping[str, Figure], folder: Path, dpi: float = 150) -> None:
    """Every figure as a PNG and an SVG of its name."""
    for name, figure in figures.items():
        save(figure, folder, name, dpi)


@rc_context(DRAWN)
def svg(figure: Figure, key: str, description: str) -> str:
    """The figure as an SVG element for the inside of a page; `key` keeps its ids apart from those of other figures.

    Ids that nothing refers to go, the others are numbered: matplotlib's own are hashes of places to their last bit, which the layout's
    solver leaves to chance. Places are rounded to a hundredth of a point; what is written stays as it is.
    """
    buffer = io.BytesIO()
    laid_out(figure).savefig(buffer, format="svg", dpi=170, bbox_inches="tight", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    root = ElementTree.fromstring(buffer.getvalue())  # without comments
    for metadata in root.findall(f"{SVG}metadata"):
        root.remove(metadata)
    used = {m for e in root.iter() for value in e.attrib.values() for m in REFERENCE.findall(value)}
    number: dict[str, str] = {}
    for element in root.iter():
        name = element.attrib.pop("id", None)
        if name is not None and name in used:
            element.set("id", number.setdefault(name, f"{key}-{len(number)}"))
    for element in root.iter():
        for attribute, value in element.items():
            value = REFERENCE.sub(lambda m: "#" + number.get(m[1], m[1]), value)
            element.set(attribute, LONG.sub(_rounded, value) if attribute in DRAWN_BY else value)
    width = float(root.attrib["viewBox"].split()[2])
    root.attrib = {"viewBox": root.attrib["viewBox"], "style": f"max-width: {width / 11:.2f}rem", "role": "img", "aria-label": description}
    text = ElementTree.tostring(root, encoding="unicode", short_empty_elements=True)
    text = re.sub(r' xmlns(:xlink)?="[^"]+"', "", text)  # HTML knows both
    return re.sub(r"\n\s*", "\n", text)


def _rounded(number: re.Match[str]) -> str:
    """Of a number its two decimals, without zeros at the end."""
    return f"{float(number[0]):z.2f}".rstrip("0").rstrip(".")


def pictures(figures: Mapping[str, Figure], captions: Mapping[str, str], key: str = "") -> dict[str, str]:
    """Figures as HTML of a page above their captions; `key` stands before their names in ids."""
    return {name: framed(svg(one, f"{key}{name}".replace("_", "-"), captions[name]), captions[name]) for name, one in figures.items()}


def label(test: Test, line: str = "\n") -> str:
    """A test in two short lines: temperature, and speed, level and repeat where they say something."""
    words = [f"{test.temperature:g} °C"]
    words += [f"{test.speed / RPM:.0f} rpm"] if test.speed else []
    words += [f"{test.level:g} N"] if test.level else []
    words += [f"no. {test.repeat}"] if test.repeat > 1 else []
    return line.join(words)


SAME = 1e-4
"""Of a value: what changes by less is drawn nearly level."""


def least_span(axes: Axes, values: Array, least: float | None = None) -> None:
    """The upright axis shows `least` (by default `SAME` of the largest) on either side of what is drawn,
    where all `values` are nearer to each other than that: else its rounding would fill the panel."""
    known = values[np.isfinite(values)]
    if not known.size:
        return
    least = SAME * float(np.abs(known).max()) if least is None else least
    middle = (known.min() + known.max()) / 2
    if np.ptp(known) < least:
        axes.set_ylim(middle - least, middle + least)


def spread(wanted: Array, apart: float, low: float = 0.0, high: float = 1.0) -> Array:
    """Places (n,) nearest to the `wanted` ones (any order), in least squares, that keep their
    order, are `apart` and lie between `low` and `high`; closer together where so many do not fit."""
    if not len(wanted):
        return wanted
    order = np.argsort(wanted, kind="stable")
    steps = min(apart, (high - low) / max(len(wanted) - 1, 1)) * np.arange(len(wanted))
    level = isotonic_regression(wanted[order] - steps).x
    return np.asarray((np.clip(level, low, high - steps[-1]) + steps)[np.argsort(order)])


# ---------------------------------------------------------------- residuals in standard errors


def residual_norm(largest: float) -> SymLogNorm:
    """Colours of normalised residuals: the same on every page up to `SMALLEST` standard errors, linear up to `LINEAR`."""
    return SymLogNorm(LINEAR, vmin=-max(SMALLEST, largest), vmax=max(SMALLEST, largest))


def logarithmic(axes: Axes, which: str = "y") -> None:
    """A logarithmic axis with plain numbers at 1, 2 and 5 of every decade."""
    axes.set(**{f"{which}scale": "log"})
    axis = axes.yaxis if which == "y" else axes.xaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def residual_bar(part: Any, norm: SymLogNorm, axes: Any, **look: Any) -> None:
    """Their colour bar beside `axes` of a figure or a part of one, with plain numbers as ticks."""
    decades = [10.0**k for k in range(1, 7) if norm.vmax is not None and 10.0**k <= norm.vmax]
    ticks = [*(-d for d in reversed(decades)), -LINEAR, 0.0, LINEAR, *decades]
    bar = part.colorbar(ScalarMappable(norm, "RdBu_r"), ax=axes, ticks=ticks, format="{x:g}", **look)
    bar.minorticks_off()
    bar.outline.set_visible(False)
    bar.set_label("(computed − measured) / s.e.")


# ---------------------------------------------------------------- maps of cells


def cells(axes: Axes, grid: Array, norm: Normalize, colours: str, text: Callable[[float], str], size: float = 7.5) -> AxesImage:
    """A grid (rows, columns) of coloured cells with their numbers; grey where there is none."""
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    colour_map = colormaps[colours].with_extremes(bad="#e4e6e8")
    picture = axes.imshow(np.ma.masked_invalid(grid), cmap=colour_map, norm=norm, aspect="auto", interpolation="nearest")
    for (i, j), value in np.ndenumerate(grid):
        if np.isfinite(value):
            r, g, b, _ = colour_map(norm(value))
            dark = 0.299 * r + 0.587 * g + 0.114 * b < 0.5
            axes.text(j, i, text(value).replace("-", "−"), ha="center", va="center", fontsize=size, color="white" if dark else INK)
    return picture


def broken(name: str) -> str:
    """A name on lines short enough to stand beside its neighbours."""
    lines = [""]
    for word in name.replace("_", "_ ").replace(": ", ": ").split(" "):
        joint = "" if not lines[-1] or lines[-1].endswith("_") else " "
        if len(lines[-1]) + len(word) > 12 and lines[-1] not in ("", "+"):
            lines.append(word)
        else:
            lines[-1] += joint + word
    return "\n".join(lines)
