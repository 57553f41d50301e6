"""The Rerun log of an impact test: every hit in time, the FRFs with their coherence, and the modal peaks.

`records/<hammer>/<hit>/` holds `force` (N) and `velocity` (m/s, as many values a sample as there
are responses) on the timeline `time`, every sample as the analyser took it. FRFs, peaks and mode
shapes stand as in the log of a run, on `frequency`; `report.log.read` reads all of it back.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.report.figures import run as figures
from thermospindle.report.log.blueprint import frfs_below_key, model_views, pair_path, plot, shapes_tab, sweeping
from thermospindle.report.log.columns import curve_look, log_curve, log_values, whole_log
from thermospindle.report.log.content import Shown, frf_of, shown
from thermospindle.report.log.pictures import for_dark, log_figure, view
from thermospindle.report.log.run import BEARINGS, log_test
from thermospindle.report.log.views import at, axis, summary_view
from thermospindle.sim.hammer.pulse import pulse_duration
from thermospindle.sim.operating import provenance
from thermospindle.sim.run import Run

CHART = (4.2, 4.4)  # inches, of the picture of the records
EARLY = 0.1  # of a record, drawn in the picture: later it has died away
HITS = ((200, 150, 255), (90, 220, 210), (255, 160, 210), (225, 225, 225), (205, 155, 95))
"""Colours of hits: none of them is a temperature's (`drawing.HEAT`) or that of measured modes."""
MOST = 12  # FRFs in the tab that shows them beside each other


def write_impact_log(run: Run, path: Path) -> None:
    """Write the log of a run that is one impact test, whole or not at all. BadInput if its folder does not exist."""
    content = shown(run)
    [test] = content.tests
    name = f"impact test of {run.spindle.name} at {test.temperature:g} C, {test.speed / RPM:.6g} rpm"
    about = {"title": f"{run.spindle.title}: {name}", **provenance(run.spindle)}
    with whole_log(path, "run", name, about, _blueprint(content)) as recording:
        log_test(recording, content)
        log_records(recording, content)


def log_records(recording: rr.RecordingStream, content: Shown) -> None:
    """Force and responses of every hit, every sample of them; and a picture of the first moments."""
    [step], nodes = content.run.steps, frf_of(content.tests[0]).response_nodes
    record, hammers = step.test.record, content.run.spindle.hammer.hammer_nodes
    time = rr.TimeColumn("time", duration=record.time)
    hits = record.force.shape[1]
    about = {"hammer": list(hammers), "hits": [hits] * len(hammers), "sample_rate_Hz": [step.test.settings.sample_rate] * len(hammers)}
    log_values(recording, "numbers/records", about)
    log_values(recording, "numbers/responses", {"node": list(nodes)})
    paints, colours = [HITS[k % len(HITS)] for k in range(hits)], [BEARINGS[k % len(BEARINGS)] for k in range(len(nodes))]
    panels: dict[str, list[tuple[Array, Array, figures.Colour]]] = {}
    for h, hammer in enumerate(hammers):
        for k in range(hits):
            force, velocity = record.force[h, k], record.velocity[h, k]
            place = ("records", f"hammer {hammer}", f"hit {k + 1}")
            log_curve(recording, at(*place, "force"), time, force, curve_look(paints[k], f"hit {k + 1}", 1.5))
            names = [f"{n}" for n in nodes]
            recording.log(at(*place, "velocity"), rr.SeriesLines(colors=colours, names=names, widths=[1.0] * len(nodes)), static=True)
            columns = rr.Scalars.columns(scalars=np.ascontiguousarray(velocity.T).ravel()).partition(np.full(len(record.time), len(nodes)))
            recording.send_columns(at(*place, "velocity"), [time], columns)
            driving = 1e3 * velocity[nodes.index(hammer)]
            struck, pulse = record.time[int(force.argmax())], pulse_duration(step.test.settings)
            for title, values, begin, end in (
                (f"force at {hammer}, N", force, max(0.0, struck - 4 * pulse), struck + 8 * pulse),
                (f"velocity at {hammer}, mm/s", driving, 0.0, EARLY * record.time[-1]),
            ):
                part = slice(*np.searchsorted(record.time, (begin, end)))
                panels.setdefault(title, []).append((1e3 * record.time[part], values[part], for_dark(paints[k])))
    log_figure(recording, "charts/records", figures.panels(panels, 2, CHART, "ms", {f"hit {k + 1}": for_dark(paint) for k, paint in enumerate(paints)} if hits > 1 else None))


# ---------------------------------------------------------------- what is shown


def _blueprint(content: Shown) -> rrb.Blueprint:
    """Mode shapes, FRFs with coherence, records and peaks at a glance; every record and every FRF in tabs."""
    hits = content.run.steps[0].test.record.force.shape[1]
    right = rrb.Vertical(
        view("charts/records", "Every hit at its hammer point" if hits > 1 else "The hits at their hammer points", CHART),
        summary_view(),
        row_shares=[1.2, 1],
    )
    left = rrb.Grid(*model_views(content), grid_columns=2)
    overview = rrb.Horizontal(left, frfs_below_key(content), right, column_shares=[1.25, 1.4, 1.05], name="Overview")
    return sweeping(content, overview, shapes_tab(content), _frf_tab(content), _record_tab(content))


def _frf_tab(content: Shown) -> rrb.Container:
    frf = frf_of(content.tests[0])
    pairs = [(r, h) for h in frf.reference_nodes for r in frf.response_nodes]
    groups = [pairs[k : k + MOST] for k in range(0, len(pairs), MOST)]
    grids = [
        rrb.Grid(
            *(plot(content, at(*pair_path(pair), "level"), f"H({pair[0]},{pair[1]}), dB re 1 (m/s)/N", content.level) for pair in group),
            grid_columns=3,
            name=f"H({group[0][0]},{group[0][1]}) to H({group[-1][0]},{group[-1][1]})",
        )
        for group in groups
    ]
    return rrb.Tabs(*grids, name="Every FRF")


def _record_tab(content: Shown) -> rrb.Container:
    """A column a hammer: its force, the driving point and all responses, of every hit or of the first."""
    settings, nodes = content.run.steps[0].test.settings, frf_of(content.tests[0]).response_nodes
    columns = []
    record, whole = content.run.steps[0].test.record, (0.0, settings.record_length)
    moment = float(record.time[int(record.force[0, 0].argmax())])
    struck = (max(0.0, moment - 3 * pulse_duration(settings)), moment + 6 * pulse_duration(settings))
    for hammer in content.run.spindle.hammer.hammer_nodes:
        origin, driving = at("records", f"hammer {hammer}"), nodes.index(hammer)
        every = [f"{origin}/{at(f'hit {k + 1}')[1:]}" for k in range(settings.hits)]
        only = rr.SeriesLines(visible_series=[i == driving for i in range(len(nodes))])
        columns.append(
            rrb.Vertical(
                _over_time(origin, f"force of hammer {hammer}, N, every hit", struck, [f"{p}/force" for p in every]),
                _over_time(origin, f"velocity at {hammer}, m/s, every hit", whole, [f"{p}/velocity" for p in every], only),
                _over_time(origin, f"velocity at every point, m/s, first hit at {hammer}", whole, [f"{every[0]}/velocity"]),
            )
        )
    return rrb.Horizontal(*columns, name="Records (choose the timeline time)")


def _over_time(origin: str, name: str, within: tuple[float, float], contents: list[str], look: rr.SeriesLines | None = None) -> rrb.View:
    """Series `contents` of all below `origin`, in a range of time (s), with a `look` other than their own."""
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        contents=contents,
        overrides={path: look for path in contents if look is not None},
        axis_x=axis("seconds", *within),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
    )
