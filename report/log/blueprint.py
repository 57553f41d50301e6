"""The blueprint stored in a log: an overview that needs no click, and tabs for the other timelines."""

from __future__ import annotations

from collections.abc import Iterable

import rerun.blueprint as rrb

from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.look.shafts import extent
from thermospindle.model.units import TO_MM
from thermospindle.report.log.content import NO_COHERENCE, Pair, Shown
from thermospindle.report.log.pictures import view
from thermospindle.report.log.views import at, axis, scene, summary_view, window
from thermospindle.sim.posing import CYCLE, reach, size

CHARTS = {"bearings": (4.2, 3.7), "records": (4.2, 1.9), "key": (6.2, 0.7)}
"""Width and height in inches of the pictures, in proportion to their views in a window of 1400 x 900."""


def pair_path(pair: Pair) -> tuple[str, str, str]:
    return "frf", f"hammer_{pair[1]}", f"response_{pair[0]}"


def blueprint(shown: Shown, quantities: list[tuple[str, str]], factor: float) -> rrb.Blueprint:
    """`quantities`: names and units of the bearing series; `factor`: by which the section's displacements are enlarged."""
    cold, hot = min(shown.temperatures), max(shown.temperatures)
    sides = f"{cold:g} °C left, {hot:g} °C right" if hot > cold else f"{cold:g} °C"
    section = f"Section, {sides}, moved × {factor:g}"
    left = rrb.Vertical(rrb.Grid(*model_views(shown), grid_columns=2), _section_view(shown, "compared", section), row_shares=[2.6, 1])
    middle = frfs_below_key(shown)
    right = rrb.Vertical(
        view("charts/bearings", "Bearings over temperature", CHARTS["bearings"]),
        view("charts/records", "First hits of the hammers", CHARTS["records"]),
        summary_view(),
        row_shares=[3.9, 2.1, 2.9],
    )
    overview = rrb.Horizontal(left, middle, right, column_shares=[1.2, 1.5, 1.02], name="Overview")
    return sweeping(shown, overview, shapes_tab(shown), _time_tab(shown), _temperature_tab(shown, quantities, factor))


def sweeping(shown: Shown, *tabs: rrb.Container) -> rrb.Blueprint:
    """The tabs in a window of their own, the cursor of `frequency` sweeping through the band."""
    return window(rrb.Tabs(*tabs), "frequency", fps=CYCLE * shown.step)


def frfs_below_key(shown: Shown) -> rrb.Container:
    """The key of colours and marks, and below it the FRFs that have views of their own, a tab each."""
    return rrb.Vertical(view("charts/key", None, CHARTS["key"]), rrb.Tabs(*(frf_views(shown, pair) for pair in shown.pairs)), row_shares=[1, 12])


def model_views(shown: Shown) -> list[rrb.View]:
    """The mode shapes that the hammers excite most, and the answer to a swept force."""
    return [*_shape_views(shown, shown.drawn), _body_view(shown, f"Sweep at {shown.pairs[0][1]}", "sweep")]


def shapes_tab(shown: Shown) -> rrb.Container:
    """Every mode shape in the band."""
    return rrb.Grid(*_shape_views(shown, range(1, len(shown.modes) + 1)), name="Every mode shape")


def _shape_views(shown: Shown, numbers: Iterable[int]) -> list[rrb.View]:
    named = [(i, shown.modes[i - 1]) for i in numbers]
    return [_body_view(shown, f"{i} {mode.kind} {mode.frequency:.0f} Hz", f"mode_{i}") for i, mode in named]


def _body_view(shown: Shown, name: str, entity: str) -> rrb.View:
    long, r, z = framed(shown.run.spindle)
    away, middle = (0.9 * r, z + 0.1 * r) if long else (r, z - 0.08 * r)  # a slender one leaves room at its sides, and its upper end is nearer
    return scene(at("model", entity), name, (1.8 * away, -1.4 * away, z + 1.35 * away), (0, 0, middle))


def _section_view(shown: Shown, which: str, name: str) -> rrb.View:
    long, r, z = framed(shown.run.spindle)
    x, away = (0.0, 1.3) if which == "compared" else (0.5, 2.2)  # one half in a tall view
    x, away, z = (x * r, away * r, 0.3 * r) if not long else (x * TO_MM * reach(shown.run.spindle), 2.2 * r, z)
    return scene(at("section", which), name, (x, -away, z), (x, 0, z))


def framed(spindle: Spindle) -> tuple[bool, float, float]:
    """Whether a spindle is longer than wide; what a view must reach, its radius or half its length,
    and the height of what it looks at, in mm."""
    radius, low, high = extent(spindle)
    whole = size(spindle)
    return whole > radius, TO_MM * whole, TO_MM * (low + high) / 2 if whole > radius else 0.0


def frf_views(shown: Shown, pair: Pair) -> rrb.Container:
    """Level, phase and, of several hits, coherence of one FRF below each other."""
    origin, label = at(*pair_path(pair)), f"H({pair[0]},{pair[1]})"
    views = [
        plot(shown, f"{origin}/level", f"{label} level, dB re 1 (m/s)/N, over frequency (#1000 is 1000 Hz)", shown.level),
        plot(shown, f"{origin}/phase", "phase, deg" + f" ({NO_COHERENCE})" * (not shown.coherent), (-185.0, 185.0)),
    ]
    if shown.coherent:
        views.append(plot(shown, f"{origin}/coherence", "coherence", (-0.15, 1.05)))  # its 0 above the numbers of the axis below
    return rrb.Vertical(
        *views,
        row_shares=[2.6, 1, 1][: len(views)],
        name=label + (" driving point" if pair[0] == pair[1] else ""),
    )


def plot(shown: Shown, origin: str, name: str, limits: tuple[float, float]) -> rrb.View:
    """Series over the band, between `limits`."""
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=axis("seq", *shown.band),
        axis_y=rrb.ScalarAxis(range=limits),
        plot_legend=rrb.PlotLegend(visible=False),
    )


def _time_tab(shown: Shown) -> rrb.Container:
    hammers = shown.run.spindle.hammer.hammer_nodes
    length = shown.run.steps[0].test.settings.record_length
    views = []
    for hammer in hammers:
        series = [("force", f"force of hammer {hammer}, N", 0.006)]
        series += [(f"velocity {n}", f"velocity at {n}, mm/s, hammer at {hammer}", length) for n in hammers]
        for entity, name, end in series:
            origin = at("records", f"hammer {hammer}", entity)
            views.append(rrb.TimeSeriesView(origin=origin, name=name, axis_x=axis("seconds", 0.0, end), plot_legend=rrb.Corner2D.RightTop))
    return rrb.Grid(*views, grid_columns=1 + len(hammers), name="Records (choose the timeline time)")


def _temperature_tab(shown: Shown, quantities: list[tuple[str, str]], factor: float) -> rrb.Container:
    section = _section_view(shown, "by temperature", f"Deformed section, displacement × {factor:g}")
    views = [rrb.TimeSeriesView(origin=at("bearings", name), name=f"{name}, {unit}, over °C") for name, unit in quantities]
    name = "Bearings and section (choose the timeline temperature)"
    return rrb.Horizontal(section, rrb.Grid(*views, grid_columns=3), column_shares=[1, 2], name=name)
