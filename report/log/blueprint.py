"""The blueprint stored in a log: an overview that needs no click, and tabs for the other timelines."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.shaft_look import extent
from thermospindle.model.units import TO_MM
from thermospindle.report.log.content import Pair, Shown
from thermospindle.report.log.pictures import DARK, view
from thermospindle.sim.posing import CYCLE, reach, size

CHARTS = {"bearings": (4.2, 3.7), "records": (4.2, 1.9), "key": (6.2, 0.7)}
"""Width and height in inches of the pictures, in proportion to their views in a window of 1400 x 900."""


def at(*parts: str) -> str:
    """The path of an entity from its parts, which may hold any characters."""
    return rr.new_entity_path(list(parts))


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
        view("charts/bearings", f"Bearings: {_sides(shown)}", CHARTS["bearings"]),
        view("charts/records", "First hits of the hammers", CHARTS["records"]),
        rrb.TextDocumentView(origin="summary", name="Summary"),
        row_shares=[3.9, 2.1, 2.9],
    )
    overview = rrb.Horizontal(left, middle, right, column_shares=[1.2, 1.5, 1.02], name="Overview")
    return sweeping(shown, overview, _time_tab(shown), _temperature_tab(shown, quantities, factor))


def sweeping(shown: Shown, *tabs: rrb.Container) -> rrb.Blueprint:
    """The tabs in a window of their own, the cursor of `frequency` sweeping through the band."""
    return rrb.Blueprint(
        rrb.Tabs(*tabs),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline="frequency", fps=CYCLE * shown.step, play_state="playing", loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )


def frfs_below_key(shown: Shown) -> rrb.Container:
    """The key of colours and marks, and below it the FRFs that have views of their own, a tab each."""
    return rrb.Vertical(view("charts/key", None, CHARTS["key"]), rrb.Tabs(*(frf_views(shown, pair) for pair in shown.pairs)), row_shares=[1, 12])


def _sides(shown: Shown) -> str:
    return ", ".join(f"{b.name} {colour}" for b, colour in zip(shown.run.spindle.bearings, ("blue", "orange"), strict=False))


def model_views(shown: Shown) -> list[rrb.View]:
    """The first mode shapes, and the answer to a swept force."""
    views = [(f"{i} {m.kind} {m.frequency:.0f} Hz", f"mode_{i}") for i, m in enumerate(shown.modes[:5], 1)]
    views.append((f"Sweep at {shown.pairs[0][1]}", "sweep"))
    _, r, z = framed(shown.run.spindle)
    eye = rrb.EyeControls3D(position=(1.8 * r, -1.4 * r, z + 1.35 * r), look_target=(0, 0, z - 0.08 * r), eye_up=(0, 0, 1))
    return [
        rrb.Spatial3DView(origin=at("model", entity), name=name, eye_controls=eye, line_grid=False, background=DARK)
        for name, entity in views
    ]


def _section_view(shown: Shown, which: str, name: str) -> rrb.View:
    long, r, z = framed(shown.run.spindle)
    x, away = (0.0, 1.3) if which == "compared" else (0.5, 2.2)  # one half in a tall view
    x, away, z = (x * r, away * r, 0.3 * r) if not long else (x * TO_MM * reach(shown.run.spindle), 2.2 * r, z)
    eye = rrb.EyeControls3D(position=(x, -away, z), look_target=(x, 0, z), eye_up=(0, 0, 1))
    return rrb.Spatial3DView(origin=at("section", which), name=name, eye_controls=eye, line_grid=False, background=DARK)


def framed(spindle: Spindle) -> tuple[bool, float, float]:
    """Whether a spindle is longer than wide; what a view must reach, its radius or half its length, and the height of what it looks at, in mm."""
    radius, low, high = extent(spindle)
    whole = size(spindle)
    return whole > radius, TO_MM * whole, TO_MM * (low + high) / 2 if whole > radius else 0.0


def frf_views(shown: Shown, pair: Pair) -> rrb.Container:
    """Level, phase and coherence of one FRF below each other."""
    origin, label = at(*pair_path(pair)), f"H({pair[0]},{pair[1]})"
    return rrb.Vertical(
        plot(shown, f"{origin}/level", f"{label} level, dB re 1 (m/s)/N, over frequency (#1000 is 1000 Hz)", shown.level),
        plot(shown, f"{origin}/phase", "phase, deg", (-185.0, 185.0)),
        plot(shown, f"{origin}/coherence", "coherence", (0.0, 1.03)),
        row_shares=[2.6, 1, 1],
        name=label + (" driving point" if pair[0] == pair[1] else ""),
    )


def plot(shown: Shown, origin: str, name: str, limits: tuple[float, float]) -> rrb.View:
    """Series over the band, between `limits`."""
    ends = [rr.TimeRangeBoundary.absolute(seq=f) for f in shown.band]
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=rrb.TimeAxis(view_range=rr.TimeRange(*ends)),
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
            ends = [rr.TimeRangeBoundary.absolute(seconds=t) for t in (0.0, end)]
            axis = rrb.TimeAxis(view_range=rr.TimeRange(*ends))
            origin = at("records", f"hammer {hammer}", entity)
            views.append(rrb.TimeSeriesView(origin=origin, name=name, axis_x=axis, plot_legend=rrb.Corner2D.RightTop))
    return rrb.Grid(*views, grid_columns=1 + len(hammers), name="Records (choose the timeline time)")


def _temperature_tab(shown: Shown, quantities: list[tuple[str, str]], factor: float) -> rrb.Container:
    section = _section_view(shown, "by temperature", f"Deformed section, displacement × {factor:g}")
    views = [rrb.TimeSeriesView(origin=at("bearings", name), name=f"{name}, {unit}, over °C") for name, unit in quantities]
    name = "Bearings and section (choose the timeline temperature)"
    return rrb.Horizontal(section, rrb.Grid(*views, grid_columns=3), column_shares=[1, 2], name=name)
