"""Figures of a warm-up: temperatures, preload, friction heat and natural frequencies over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thermospindle.model.types import Array
from thermospindle.model.units import MINUTE
from thermospindle.report.figures.common import BEARINGS, PALE, SAME, STYLE, least_span, spread
from thermospindle.report.typeset import power
from thermospindle.sim.warmup import Warmup, most_friction, roller_names, rollers

PARTS = {"stationary": "#3b6ea5", "rotating": "#c2622d"}
LETTERS = 7.5  # points, of names beside lines
WARMER = 0.1  # K that the panel of temperatures shows at least: their time steps are right within a tenth of it
MODES = ("#1f8a70", "#7a3d8f", "#a0741a", "#3b6ea5", "#c9371c", "#555f6b", "#d18a0f", "#b0457b")


@rc_context(STYLE)
def figure(warmup: Warmup) -> Figure:
    """Four panels over time in minutes, six where there are rollers; every line is named at its end."""
    rolling = roller_names(warmup)
    drawn = Figure(figsize=(15.5 if rolling else 9.6, 7.0))
    panels = drawn.subplots(2, 3 if rolling else 2, sharex=True, gridspec_kw={"wspace": 0.08})
    minutes = warmup.times / MINUTE
    bearings = [b.name for b in warmup.spindle.bearings]
    axes, groups = panels[0, 0], region_groups(warmup)
    for _, part, temperature in groups:
        axes.plot(minutes, temperature, color=PARTS[part], lw=1.0)
    least_span(axes, np.concatenate([temperature for *_, temperature in groups], axis=1), WARMER)
    ends = np.array([temperature[-1].mean() for *_, temperature in groups])
    name_ends(axes, ends, [name for name, *_ in groups], [PARTS[part] for _, part, _ in groups])
    axes.set(title="Region temperatures", ylabel="temperature, °C")
    for part, paint in PARTS.items():
        axes.plot([], [], color=paint, label=f"{part} part")
    axes.legend(loc="lower right")
    preload = np.array([[m.preload[b] for b in bearings] for m in warmup.moments])
    if warmup.speed:
        unit, scale = power(most_friction(warmup))
        third = np.array([[scale * m.friction[b] for b in (*bearings, *rolling)] for m in warmup.moments])
        about = ("Friction heat of each bearing", f"friction heat, {unit}")
    else:
        third = np.degrees([[m.point.state.bearing(b).contact_angle for b in bearings] for m in warmup.moments])
        about = ("Contact angle", "contact angle, degrees")
    _of_bearings(panels[0, 1], minutes, preload, bearings, "Preload" + " of the ball rows" * bool(rolling), "preload, N")
    _of_bearings(panels[1, 0], minutes, third, [*bearings, *(rolling if warmup.speed else ())], *about)
    if rolling:
        series = [rollers(warmup, name) for name in rolling]
        clearance, stiffness = (np.array([s[key] for s in series]).T for key in ("clearance_um", "radial_stiffness_N_per_m"))
        _of_bearings(panels[0, 2], minutes, clearance, rolling, "Clearance of the rollers, pressed below 0", "diametral clearance, µm")
        _of_bearings(panels[1, 2], minutes, 1e-6 * stiffness, rolling, "Radial stiffness of the rollers", "stiffness, N/µm")
    axes = panels[1, 1]
    shift = warmup.frequencies - warmup.frequencies[0]
    names = [f"{k} {m.kind} {f:.0f}" for k, (m, f) in enumerate(zip(warmup.modes, warmup.frequencies[0], strict=True), 1)]
    paints = [MODES[k % len(MODES)] for k in range(len(names))]
    for series, paint in zip(shift.T, paints, strict=True):
        axes.plot(minutes, series, color=paint)
    least_span(axes, shift, SAME * float(np.nanmax(warmup.frequencies[0], initial=0.0)))
    name_ends(axes, shift[-1], names, paints)
    axes.axhline(0.0, color=PALE, lw=0.6)
    axes.set(title="Natural frequencies (names: Hz at the start)", ylabel="change since the start, Hz")
    for axes in panels[1]:
        axes.set_xlabel("time, min")
    for axes in panels.flat:
        axes.set_xlim(0, minutes[-1])
    return drawn


def _of_bearings(axes: Axes, minutes: Array, values: Array, bearings: Sequence[str], title: str, label: str) -> None:
    """A line for each bearing, (times, bearings), or one for all where they are the same; an empty place where there is none."""
    if not bearings:
        axes.set_axis_off()
        return
    names = bearing_names(values, bearings)
    for k, series in enumerate(values.T[: len(names)]):
        paint, _, dashes = BEARINGS[k % len(BEARINGS)]
        axes.plot(minutes, series, color=paint, ls=dashes, lw=1.5)
    least_span(axes, values)
    name_ends(axes, values[-1, : len(names)], names, [BEARINGS[k % len(BEARINGS)][0] for k in range(len(names))])
    axes.set(title=title, ylabel=label)


def bearing_names(values: Array, bearings: Sequence[str]) -> list[str]:
    """Names of `values` (times, bearings): those of the bearings, or one for all where they are the same."""
    same = len(bearings) > 1 and np.ptp(values, axis=1).max() < 1e-6 * np.abs(values).max()
    return ["both bearings" if len(bearings) == 2 else f"all {len(bearings)} bearings"] if same else list(bearings)


def region_groups(warmup: Warmup) -> list[tuple[str, str, Array]]:
    """Regions that have nearly one temperature together: their name, their part, and their temperatures (times, regions) in C."""
    parts = {g.name: g.part for g in warmup.spindle.regions}
    regions = list(warmup.moments[0].temperatures)
    temperature = np.array([[m.temperatures[g] for g in regions] for m in warmup.moments])
    groups = _alike(temperature, [parts[g] for g in regions])
    return [(_group_name([regions[k] for k in group], parts), parts[regions[group[0]]], temperature[:, group]) for group in groups]


def _alike(series: Array, parts: Sequence[str]) -> list[list[int]]:
    """Columns of `series` that stay within a fortieth of its span of each other and are of the same part, together."""
    groups: list[list[int]] = []
    near = np.ptp(series) / 40
    for k in range(series.shape[1]):
        for group in groups:
            if parts[group[0]] == parts[k] and np.abs(series[:, group[0]] - series[:, k]).max() < near:
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _group_name(names: Sequence[str], parts: Mapping[str, str]) -> str:
    part = parts[names[0]]
    if len(names) > 2 and len(names) == sum(p == part for p in parts.values()):
        return f"all {len(names)} rotating" if part == "rotating" else f"all {len(names)} stationary"
    return ", ".join(names) if len(names) < 3 else f"{names[0]} and {len(names) - 1} more"


def name_ends(axes: Axes, ends: Array, names: Sequence[str], colours: Sequence[str]) -> None:
    """Names beside the right ends of lines, moved apart where they would overlap, the first of them
    where there is no room for all; a thin line leads to a name that moved."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    figure = axes.figure
    assert isinstance(figure, Figure)
    spec = axes.get_subplotspec()
    rows = spec.get_geometry()[0] if spec else 1
    height = 0.8 * figure.get_size_inches()[1] / rows * 72  # points, about
    apart = 1.25 * LETTERS / height
    used = [k for k in range(len(names)) if np.isfinite(ends[k])][: int(1 / apart) + 1]
    at = spread((np.array([ends[k] for k in used]) - low) / (high - low), apart)
    for k, place in zip(used, at, strict=True):
        start = (ends[k] - low) / (high - low)
        axes.annotate(
            names[k],
            xy=(1.0, start),
            xytext=(1.035, place),
            xycoords="axes fraction",
            textcoords="axes fraction",
            va="center",
            fontsize=LETTERS,
            color=colours[k],
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colours[k], "lw": 0.5, "shrinkA": 0, "shrinkB": 0, "relpos": (0.0, 0.5)},
        )
