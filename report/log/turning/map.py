"""The Rerun log of a resonance map: a Campbell diagram that moves with temperature, and where its lines meet a mode.

On the timeline `temperature, 0.01 C` the Campbell diagram plays; the map of coincidences and the diagram over temperature
at the nominal speed are pictures that every timeline shows, with a bar that follows the temperature. As series stand the natural
frequencies and the strongest lines over `temperature` at the nominal speed and over `speed` (rpm, rounded) at the nominal temperature.
`numbers/` holds grid, frequencies and coincidences as computed; `report.log.read` reads them back.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import rc_context

from thermospindle.model.units import RPM
from thermospindle.report.figures.common import STYLE
from thermospindle.report.figures.resonance import CAUSES, both, campbell, drawn_lines, over_temperature
from thermospindle.report.log.columns import curve_look, log_curve, log_values, log_words, number_column, whole_log
from thermospindle.report.log.content import made_from
from thermospindle.report.log.drawing import light
from thermospindle.report.log.pictures import log_figure, log_figures, place, view
from thermospindle.report.log.views import at, axis, summary_view, window
from thermospindle.report.text.resonance import map_json, mapped, on_the_map, told
from thermospindle.sim.operating import provenance
from thermospindle.sim.resonance.found import ResonanceMap, strongest

CAMPBELL, SMALL = (8.5, 8.3), (6.5, 3.1)  # inches
WHIRL = {"forward": (255, 110, 80), "backward": (90, 160, 255), "mixed": (150, 150, 150), "none": (235, 235, 235)}
WHITE = (235, 235, 235)
TICK = 100  # ticks of the timeline in a degree
TEMPERATURE = "temperature, 0.01 C"


# ---------------------------------------------------------------- writing


def write_map_log(found: ResonanceMap, path: Path) -> None:
    """Write the log, whole or not at all. BadInput if its folder does not exist."""
    about = {"title": found.spindle.title, "temperature_C": found.nominal.temperature, "speed_rad_per_s": found.nominal.speed}
    about |= provenance(found.spindle)
    with whole_log(path, "map", f"{found.spindle.name}, resonance map", about, blueprint(found)) as recording:
        log_numbers(recording, found)
        log_pictures(recording, found)
        log_series(recording, found)
        log_words(recording, "summary", summary(found))


def _over_temperature(found: ResonanceMap) -> rr.TimeColumn:
    return rr.TimeColumn(TEMPERATURE, sequence=np.round(TICK * found.temperatures).astype(int))


def log_numbers(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """Speeds, and a row a temperature with all modes over all speeds; coincidences in columns."""
    log_values(recording, "numbers/speeds", {"speed_rad_per_s": found.speeds})
    grid = np.stack([m.frequency for m in found.modes], axis=1)  # (T, modes, S)
    columns: list[rr.ComponentColumn] = [*number_column("temperature_C", found.temperatures)]
    columns += number_column("frequency_Hz", grid.reshape(-1)).partition(np.full(len(grid), grid[0].size))
    recording.send_columns("numbers/modes", [_over_temperature(found)], columns)
    rows = map_json(found)["coincidences"]
    if rows:
        log_values(recording, "numbers/coincidences", {name: [c[name] for c in rows] for name in rows[0]})


def _several(found: ResonanceMap) -> bool:
    """Whether the map has more than one temperature, over which anything can be drawn."""
    return len(found.temperatures) > 1


def log_pictures(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """The Campbell diagram of every temperature; coincidences and the diagram over temperature,
    with a bar at the temperature of the moment."""
    times = _over_temperature(found)
    with rc_context(STYLE):
        log_figures(recording, "campbell", times, [campbell(found, k, CAMPBELL) for k in range(len(found.temperatures))])
        charts = {"coincidences": both(found, SMALL, bare=True), "temperature": over_temperature(found, SMALL, bare=True)} if _several(found) else {}
    for name, figure in charts.items():
        log_figure(recording, f"{name}/picture", figure)
        axes = figure.axes[0]
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        across = name == "coincidences"  # its temperatures go up
        bars = [place(axes, *(([left, right], [t, t]) if across else ([t, t], [low, high]))) for t in found.temperatures]
        recording.log(f"{name}/now", rr.LineStrips2D.from_fields(colors=[WHITE], radii=rr.Radius.ui_points(0.6)), static=True)
        recording.send_columns(f"{name}/now", [times], rr.LineStrips2D.columns(strips=bars).partition([1] * len(bars)))


def log_series(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """Natural frequencies, strongest lines and runout as series on both timelines."""
    t0, s0 = found.nominal_index
    speed = rr.TimeColumn("speed", sequence=np.round(found.speeds / RPM).astype(int))
    for over, times, pick in (
        ("temperature", _over_temperature(found), lambda values: values[:, s0]),
        ("speed", speed, lambda values: values[t0]),
    ):
        for m in found.modes:
            look = curve_look(WHIRL[m.whirl], f"mode {m.number} {m.kind}", 2.0)
            log_curve(recording, at("series", f"over {over}", f"mode {m.number}"), times, pick(m.frequency), look)
        for track in drawn_lines(found):
            name = f"{track.line.name} {track.line.cause} {track.line.order} {track.line.bearing}"
            look = curve_look(light(CAUSES[track.line.cause], 0.45), track.line.name)
            log_curve(recording, at("series", f"over {over}", name), times, pick(track.frequency), look)
    along = (
        ("temperature", TICK * found.nrro_temperature[:, 0], found.nrro_temperature),
        ("speed", found.nrro_speed[:, 0] / RPM, found.nrro_speed),
    )
    for over, places, values in along:
        times = rr.TimeColumn(TEMPERATURE if over == "temperature" else over, sequence=np.round(places).astype(int))
        for column, direction, paint in ((1, "radial", (200, 140, 255)), (2, "axial", (240, 200, 90))):
            look = curve_look(paint, f"{direction} NRRO, nm rms", 1.5)
            log_curve(recording, at("nrro", f"over {over}", direction), times, 1e9 * values[:, column], look)


def summary(found: ResonanceMap) -> str:
    """Markdown: what is crossed at the nominal speed, and the strongest coincidences."""
    met = strongest(found.coincidences)[:16]
    lines = [*(f"{s}\n" for s in told(found)), f"{mapped(found)}\n"]
    lines += ["| line | cause | mode | °C | rpm | Hz | nm | margin % |", "|---|---|---|---|---|---|---|---|"] if met else [f"{on_the_map(found)}\n"]
    for c in met:
        numbers = f"{c.condition.temperature:.1f} | {c.condition.speed / RPM:.0f} | {c.frequency:.0f} | {1e9 * c.strength:.1f} | {100 * c.margin:+z.1f}"
        lines.append(f"| {c.line.name} | {c.line.cause} {c.line.bearing} | {c.mode.number} {c.mode.kind} | {numbers} |")
    return "\n".join([*lines, *made_from(found.spindle)]) + "\n"


def blueprint(found: ResonanceMap) -> rrb.Blueprint:
    """The moving Campbell diagram, and beside it the map, the diagram over temperature and the summary; series in tabs."""
    rpm = f"{found.nominal.speed / RPM:g} rpm"
    charts = [view("coincidences", "Where the strongest lines meet a mode (line, mode)", SMALL), view("temperature", f"Over temperature at {rpm}", SMALL)] if _several(found) else []
    overview = rrb.Horizontal(
        view("campbell", f"Campbell diagram{', moving with temperature' * _several(found)}", CAMPBELL),
        rrb.Vertical(*charts, summary_view(), row_shares=[*[1.25] * len(charts), 1]),
        column_shares=[1.3, 1],
        name="Overview",
    )
    whole = {"temperature": TICK * found.temperatures[[0, -1]], "speed": found.speeds[[0, -1]] / RPM}
    read = {"temperature": f"#{20 * TICK} is 20 °C", "speed": "in rpm"}
    tabs = [
        rrb.Vertical(
            rrb.TimeSeriesView(origin=at("series", f"over {over}"), name=f"Hz over {over}, {read[over]}", axis_x=axis("seq", *ends.round().astype(int))),
            rrb.TimeSeriesView(origin=at("nrro", f"over {over}"), name=f"NRRO (nonrepeatable runout) over {over}", axis_x=axis("seq", *ends.round().astype(int))),
            name=f"Over {over} (choose the timeline {over})",
        )
        for over, ends in whole.items()
        if ends[0] < ends[-1]
    ]
    return window(rrb.Tabs(overview, *tabs), TEMPERATURE, fps=4.0 * TICK)
