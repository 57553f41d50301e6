"""The blueprint stored in the log of a turning spindle: all of it in one window, playing."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from thermospindle.model.units import TO_NM
from thermospindle.report.log.blueprint import framed
from thermospindle.report.log.pictures import view
from thermospindle.report.log.views import DARK, scene, summary_view, window
from thermospindle.sim.running.probes import looked_at
from thermospindle.sim.running.runout import Runout

WATERFALL, POLAR = (6.6, 4.8), (4.2, 3.3)  # inches
WORDS = {"RRO": "repeatable", "NRRO": "nonrepeatable"}
STANDS = 1e-3  # nm that is no motion
PLAYED = 3.0  # revolutions of the spindle that a second shows


def blueprint(runout: Runout, factor: float, waterfall: bool) -> rrb.Blueprint:
    """`factor`: by which the model's displacements are enlarged; `waterfall`: whether there is one."""
    cut, turning, where = runout.by_lines, abs(runout.turning), looked_at(runout.point.spindle)
    _, r, z = framed(runout.point.spindle)
    title = f"Displacements × {factor:g}, {PLAYED:g} revolutions a second"
    model = scene("model", title, (1.8 * r, -1.4 * r, z + 1.9 * r), (0.1 * r, -0.1 * r, z + 0.1 * r))
    span = 1.1e9 * float(np.abs(cut.value[:2] - cut.value[:2].mean(axis=(1, 2), keepdims=True)).max()) or 1.0
    grown = rrb.VisibleTimeRange("time", start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.cursor_relative(seconds=0.0))
    orbit = rrb.Spatial2DView(
        origin="orbit",
        name=f"Orbit of the {where}, ±{span / 1.1:.0f} nm; repeatable part red",
        visual_bounds=rrb.VisualBounds2D(x_range=(-span, span), y_range=(-span, span)),
        background=DARK,
        time_ranges=[grown],
    )
    charts = [
        view(f"charts/waterfall_{direction}", f"{direction.capitalize()} lines over speed", WATERFALL)
        for direction in ("radial", "axial")
        if waterfall
    ]
    largest = {"RRO": np.abs(cut.repeatable[:3]).max(), "NRRO": np.abs(cut.nonrepeatable[:3]).max()}
    series = [_series(part, some, 4 / turning, where, reach(TO_NM * float(largest[part]))) for part, some in (("RRO", (0, 1, 2)), ("NRRO", (3, 4, 5)))]
    middle = rrb.Vertical(*([rrb.Tabs(*charts)] if charts else []), *series, row_shares=[2.6, 1, 1] if charts else [1, 1])
    polar = view("charts/polar", f"Error motion of {where} x", POLAR)
    right = rrb.Vertical(polar, summary_view(), row_shares=[1, 1.5])
    return window(rrb.Horizontal(rrb.Vertical(model, orbit), middle, right, column_shares=[1, 1.55, 1.0]), "time", playback_speed=PLAYED / turning)


def reach(largest: float) -> float:
    """The next round number above the `largest` value (nm) of a panel, in which it stands from
    minus to plus that: an axis so low has no number but 0."""
    if not largest > STANDS:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(largest))
    return float(decade * next(step for step in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0) if step * decade >= largest * (1 - 1e-9)))


def _series(part: str, chosen: tuple[int, ...], seconds: float, where: str, high: float) -> rrb.View:
    """RRO or NRRO of the three probes in a window of `seconds` about the cursor, from -`high` to `high` (nm)."""
    ends = [rr.TimeRangeBoundary.cursor_relative(seconds=t) for t in (-seconds / 2, seconds / 2)]
    return rrb.TimeSeriesView(
        origin="signals",
        name=f"{part} ({WORDS[part]}), panel ±{high:g} nm: {where} x red, y blue, axial green",
        overrides={"signals": rr.SeriesLines(visible_series=[i in chosen for i in range(6)])},
        axis_x=rrb.TimeAxis(view_range=rr.TimeRange(*ends)),
        axis_y=rrb.ScalarAxis(range=(-high, high)),
        plot_legend=rrb.PlotLegend(visible=False),
    )
