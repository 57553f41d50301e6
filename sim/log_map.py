"""The Rerun log of a resonance map: a Campbell diagram that moves with temperature, and where its lines meet a mode.

On the timeline `temperature, 0.01 C` the Campbell diagram plays; the map of coincidences and the diagram over temperature
at the nominal speed are drawings that every timeline shows, with a mark that follows the temperature. As series stand the natural frequencies and the
strongest lines over `temperature` at the nominal speed and over `speed` (rpm, rounded) at the nominal temperature. `numbers/` holds grid,
frequencies and coincidences as computed; `sim.log_map_read` reads them back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib.colors import to_rgb
from numpy.typing import ArrayLike

from model.ball_row import Array
from sim.log_blueprint import DARK, at
from sim.log_columns import any_values, curve_look, draw, log_curve, number_column, whole_log
from sim.log_drawing import Colours, Drawing, round_ticks
from sim.operating import provenance
from sim.resonance import LineTrack, ResonanceMap, strongest
from sim.resonance_output import map_json, sentences
from sim.resonance_plots import CAUSES, drawn_lines
from sim.resonance_point import key
from sim.warmup_plots import spread

RPM = 2 * np.pi / 60
CAMPBELL, SMALL = (760.0, 720.0), (590.0, 262.0)
WHIRL = {"forward": (255, 110, 80), "backward": (90, 160, 255), "none": (90, 220, 160)}
SHOWN = 9  # curves in the map of coincidences
GREY, WHITE = (70, 70, 76), (235, 235, 235)
TICK = 100  # ticks of the timeline in a degree
TEMPERATURE = "temperature, 0.01 C"


@dataclass(frozen=True)
class Frame:
    """A chart's axes: from values to places in a drawing `size` wide and high, y down, with margins left, top, right, bottom."""

    x: tuple[float, float]
    y: tuple[float, float]
    size: tuple[float, float]
    margins: tuple[float, float, float, float] = (46.0, 26.0, 118.0, 40.0)

    def place(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Points (n, 2)."""
        left, top, right, bottom = self.margins
        across = left + (np.asarray(x, float) - self.x[0]) / (self.x[1] - self.x[0]) * (self.size[0] - left - right)
        down = self.size[1] - bottom - (np.asarray(y, float) - self.y[0]) / (self.y[1] - self.y[0]) * (self.size[1] - top - bottom)
        return np.stack(np.broadcast_arrays(across, down), axis=-1)

    def inside(self, x: Array, y: Array) -> tuple[Array, Array]:
        """A line cut where it leaves the axes upwards."""
        if np.nanmax(y) <= self.y[1]:
            return x, y
        end = float(np.interp(self.y[1], y, x))
        kept = y < self.y[1]
        return np.append(x[kept], end), np.append(y[kept], self.y[1])

    def axes(self, xlabel: str, ylabel: str) -> Drawing:
        drawing = Drawing()
        for tick in round_ticks(np.array(self.x)):
            if self.x[0] - 1e-9 <= tick <= self.x[1] + 1e-9:
                drawing.line(self.place([tick, tick], list(self.y)), GREY)
                px, py = self.place(tick, self.y[0])
                drawing.label(float(px), float(py) + 12.0, f"{tick:g}")
        for tick in round_ticks(np.array(self.y)):
            if self.y[0] - 1e-9 <= tick <= self.y[1] + 1e-9:
                drawing.line(self.place(list(self.x), [tick, tick]), GREY)
                px, py = self.place(self.x[0], tick)
                drawing.label(float(px) - 22.0, float(py) + 4.0, f"{tick:g}")
        middle, base = self.place(sum(self.x) / 2, self.y[0])
        drawing.label(float(middle), float(base) + 29.0, xlabel, WHITE)
        corner, top = self.place(self.x[0], self.y[1])
        drawing.label(float(corner) + 3.4 * len(ylabel), float(top) - 10.0, ylabel, WHITE)
        return drawing

    def name_ends(self, drawing: Drawing, ends: Sequence[tuple[float, str, Colours | tuple[int, ...]]]) -> None:
        """Names right of the axes, at heights near their values, apart from each other."""
        places = np.array([(self.size[1] - self.place(0.0, value)[1]) / self.size[1] for value, _, _ in ends])
        apart = spread(places, 18.0 / self.size[1])
        right = self.size[0] - self.margins[2]
        for (_, name, paint), place, start in zip(ends, apart, places, strict=True):
            y = self.size[1] * (1 - place)
            drawing.line(np.array([(right, self.size[1] * (1 - start)), (right + 10.0, y)]), paint)
            drawing.label(right + 14.0 + 3.3 * len(name), y + 4.0, name, paint)


# ---------------------------------------------------------------- writing


def write_map_log(found: ResonanceMap, path: Path) -> None:
    """Write the log, whole or not at all. BadInput if its folder does not exist."""
    with whole_log(path) as (recording, partial):
        _write(found, recording, partial)


def _write(found: ResonanceMap, recording: rr.RecordingStream, file: Path) -> None:
    recording.save(file, default_blueprint=blueprint(found))
    recording.send_recording_name(f"{found.spindle.name}, resonance map")
    about = {"title": found.spindle.title, "temperature_C": found.nominal.temperature, "speed_rad_per_s": found.nominal.speed}
    recording.send_property("map", any_values({**about, **provenance(found.spindle)}))
    log_numbers(recording, found)
    log_campbell(recording, found)
    log_coincidences(recording, found)
    log_temperature(recording, found)
    log_series(recording, found)
    recording.log("summary", rr.TextDocument(summary(found), media_type=rr.MediaType.MARKDOWN), static=True)


def _over_temperature(found: ResonanceMap) -> rr.TimeColumn:
    return rr.TimeColumn(TEMPERATURE, sequence=np.round(TICK * found.temperatures).astype(int))


def log_numbers(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """Speeds, and a row a temperature with all modes over all speeds; coincidences in columns."""
    recording.log("numbers/speeds", any_values({"speed_rad_per_s": found.speeds}), static=True)
    grid = np.stack([m.frequency for m in found.modes], axis=1)  # (T, modes, S)
    columns: list[rr.ComponentColumn] = [*number_column("temperature_C", found.temperatures)]
    columns += number_column("frequency_Hz", grid.reshape(-1)).partition(np.full(len(grid), grid[0].size))
    recording.send_columns("numbers/modes", [_over_temperature(found)], columns)
    told = map_json(found)["coincidences"]
    if told:
        recording.log("numbers/coincidences", any_values({name: [c[name] for c in told] for name in told[0]}), static=True)


def log_campbell(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """The diagram over speed, a row a temperature: modes, lines, crossings."""
    speed, shown = found.speeds / RPM, drawn_lines(found)
    top = 1.1 * max(float(np.nanmax(m.frequency)) for m in found.modes)
    frame = Frame((0.0, float(speed[-1])), (0.0, top), CAMPBELL)
    draw(recording, "campbell/axes", frame.axes("speed, rpm", "frequency, Hz"))
    modes, lines, crossings, counts = [], [], [], []
    crossed = {(key(c.line), c.mode.number) for c in strongest(found.coincidences)}
    for i, t in enumerate(found.temperatures):
        modes += [frame.place(speed, m.frequency[i]) for m in found.modes]
        lines += [frame.place(*frame.inside(speed, track.frequency[i])) for track in shown]
        here = []
        for curve in found.curves:
            if (key(curve.line), curve.mode.number) in crossed and any(key(curve.line) == key(s.line) for s in shown):
                for s in curve.speed[curve.temperature == t]:
                    here.append(frame.place(s / RPM, float(np.interp(s, found.speeds, curve.mode.frequency[i]))))
        crossings += here
        counts.append(len(here))
    count = len(found.temperatures)
    for name, strips, paints, width in (
        ("modes", modes, [WHIRL[m.whirl] for m in found.modes], 1.6),
        ("lines", lines, [_paint(track) for track in shown], 0.7),
    ):
        columns = rr.LineStrips2D.columns(strips=strips).partition(np.full(count, len(strips) // count))
        recording.log(f"campbell/{name}", rr.LineStrips2D.from_fields(colors=paints, radii=rr.Radius.ui_points(width)), static=True)
        recording.send_columns(f"campbell/{name}", [_over_temperature(found)], columns)
    if crossings:
        recording.log("campbell/coincidences", rr.Points2D.from_fields(colors=[WHITE], radii=rr.Radius.ui_points(4.0)), static=True)
        columns = rr.Points2D.columns(positions=np.array(crossings)).partition(counts)
        recording.send_columns("campbell/coincidences", [_over_temperature(found)], columns)
    names = Drawing()
    t0, _ = found.nominal_index
    ends = [(float(m.frequency[t0, -1]), f"mode {m.number} {m.kind}", WHIRL[m.whirl]) for m in found.modes]
    for s in shown:
        leaves = float(np.interp(top, s.frequency[t0], speed))  # the last speed where it stays inside
        if leaves > 0.9 * speed[-1]:
            ends.append((min(float(s.frequency[t0, -1]), top), s.line.name, _paint(s)))
        else:
            px, py = frame.place(leaves, top)
            names.label(float(px), float(py) + 2.0, s.line.name, _paint(s))
    frame.name_ends(names, ends)
    nominal = frame.place([found.nominal.speed / RPM] * 2, [0.0, top])
    names.line(nominal, (120, 120, 126))
    draw(recording, "campbell/names", names)
    _follow(recording, found, "campbell/temperature", np.tile(frame.place(0.12 * speed[-1], 0.965 * top), (count, 1)))


def _follow(recording: rr.RecordingStream, found: ResonanceMap, entity: str, places: Array) -> None:
    """The temperature as text at one place (2,) a temperature."""
    recording.log(entity, rr.Points2D.from_fields(colors=[WHITE], radii=0.0, show_labels=True), static=True)
    columns = rr.Points2D.columns(positions=places, labels=[f"{t:.1f} °C" for t in found.temperatures])
    recording.send_columns(entity, [_over_temperature(found)], columns)


def log_coincidences(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """Curves over speed and temperature of the `SHOWN` strongest coincidences, and a bar at the temperature of the moment."""
    ends = (float(found.temperatures[0]), float(found.temperatures[-1]))
    frame = Frame((0.0, float(found.speeds[-1] / RPM)), ends, SMALL, (46.0, 72.0, 40.0, 40.0))
    chart = frame.axes("speed, rpm", "")
    chosen = strongest(found.coincidences)[:SHOWN]
    tops: list[tuple[float, str, tuple[int, int, int]]] = []
    for c in chosen:
        curve = next(k for k in found.curves if key(k.line) == key(c.line) and k.mode.number == c.mode.number)
        order = np.argsort(curve.temperature)
        paint = WHIRL[c.mode.whirl]
        strip = frame.place(curve.speed[order] / RPM, curve.temperature[order])
        chart.line(strip if len(strip) > 1 else strip + np.array([(0.0, -2.0), (0.0, 2.0)]), paint)
        tops.append((float(strip[-1, 0]), f"{c.line.name}, {c.mode.number}", paint))
    tops.sort()
    for row in range(3):
        own = tops[row::3]
        apart = spread(np.array([x for x, _, _ in own]) / SMALL[0], 100.0 / SMALL[0]) * SMALL[0]
        for (start, name, paint), place in zip(own, apart, strict=True):
            chart.line(np.array([(start, frame.margins[1]), (place, 22.0 + 18.0 * row)]), paint)
            chart.label(float(place), 17.0 + 18.0 * row, name, paint)
    draw(recording, "coincidences/curves", chart)
    bar = [frame.place(list(frame.x), [t, t]) for t in found.temperatures]
    recording.log("coincidences/now", rr.LineStrips2D.from_fields(colors=[WHITE], radii=rr.Radius.ui_points(0.6)), static=True)
    columns = rr.LineStrips2D.columns(strips=bar).partition(np.ones(len(bar), int))
    recording.send_columns("coincidences/now", [_over_temperature(found)], columns)
    nominal = rr.Points2D(
        frame.place([found.nominal.speed / RPM], [found.nominal.temperature]), colors=[WHITE], radii=rr.Radius.ui_points(5.0)
    )
    recording.log("coincidences/nominal", nominal, static=True)


def log_temperature(recording: rr.RecordingStream, found: ResonanceMap) -> None:
    """Modes and lines over temperature at the nominal speed, and nonrepeatable runout below as series."""
    _, s0 = found.nominal_index
    named: list[tuple[float, str, tuple[int, int, int]]] = []
    values = np.array([m.frequency[:, s0] for m in found.modes])
    ends = (float(found.temperatures[0]), float(found.temperatures[-1]))
    frame = Frame(ends, (0.93 * float(np.nanmin(values)), 1.05 * float(np.nanmax(values))), SMALL)
    chart = frame.axes("temperature, °C", "frequency, Hz")
    for m in found.modes:
        chart.line(frame.place(found.temperatures, m.frequency[:, s0]), WHIRL[m.whirl])
        named.append((float(m.frequency[-1, s0]), f"mode {m.number} {m.kind}", WHIRL[m.whirl]))
    for c in (c for c in found.coincidences if c.at_nominal_speed):
        track = next(t for t in found.lines if key(t.line) == key(c.line))
        chart.line(frame.place(found.temperatures, track.frequency[:, s0]), _paint(track))
        named.append((float(track.frequency[-1, s0]), f"{c.line.name} {c.line.bearing}", _paint(track)))
    frame.name_ends(chart, named)
    draw(recording, "temperature", chart)
    met = [(c.condition.temperature, c.frequency) for c in found.coincidences if c.at_nominal_speed]
    if met:
        x, y = np.array(met).T
        recording.log("temperature/met", rr.Points2D(frame.place(x, y), colors=[WHITE], radii=rr.Radius.ui_points(4.0)), static=True)


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
            log_curve(
                recording, at("series", f"over {over}", name), times, pick(track.frequency), curve_look(_paint(track), track.line.name)
            )
    along = (
        ("temperature", TICK * found.nrro_temperature[:, 0], found.nrro_temperature),
        ("speed", found.nrro_speed[:, 0] / RPM, found.nrro_speed),
    )
    for over, places, values in along:
        times = rr.TimeColumn(TEMPERATURE if over == "temperature" else over, sequence=np.round(places).astype(int))
        for column, direction, paint in ((1, "radial", (200, 140, 255)), (2, "axial", (240, 200, 90))):
            log_curve(
                recording,
                at("nrro", f"over {over}", direction),
                times,
                1e9 * values[:, column],
                curve_look(paint, f"{direction} NRRO, nm rms", 1.5),
            )


def _paint(track: LineTrack) -> tuple[int, int, int]:
    """The colour of a line's cause, light enough for a dark ground."""
    red, green, blue = (round(255 * (0.45 + 0.55 * c)) for c in to_rgb(CAUSES[track.line.cause]))
    return red, green, blue


def summary(found: ResonanceMap) -> str:
    """Markdown: what is crossed at the nominal speed, and the strongest coincidences."""
    lines = [
        *(f"{s}\n" for s in sentences(found)),
        "| line | cause | mode | °C | rpm | Hz | nm | margin % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for c in strongest(found.coincidences)[:16]:
        numbers = f"{c.condition.temperature:.1f} | {c.condition.speed / RPM:.0f} | {c.frequency:.0f} | {1e9 * c.strength:.1f} | {100 * c.margin:+.1f}"
        lines.append(f"| {c.line.name} | {c.line.cause} {c.line.bearing} | {c.mode.number} {c.mode.kind} | {numbers} |")
    lines += ["", "Made from:", "", *(f"- {name}: {text}" for name, text in provenance(found.spindle).items())]
    return "\n".join(lines) + "\n"


def blueprint(found: ResonanceMap) -> rrb.Blueprint:
    """The moving Campbell diagram, and beside it the map, the diagram over temperature and the summary; series in tabs."""

    def drawing(origin: str, name: str, size: tuple[float, float]) -> rrb.View:
        bounds = rrb.VisualBounds2D(x_range=(0, size[0]), y_range=(0, size[1]))
        return rrb.Spatial2DView(origin=origin, name=name, visual_bounds=bounds, background=DARK)

    title = "Campbell diagram over temperature: forward red, backward blue, axial or standing green"
    rpm = f"{found.nominal.speed / RPM:g} rpm"
    overview = rrb.Horizontal(
        drawing("campbell", title, CAMPBELL),
        rrb.Vertical(
            drawing("coincidences", "Where the strongest lines meet a mode (line, mode), °C over rpm", SMALL),
            drawing("temperature", f"Over temperature at {rpm}", SMALL),
            rrb.TextDocumentView(origin="summary", name="Summary"),
            row_shares=[1.25, 1.25, 1],
        ),
        column_shares=[1.3, 1],
        name="Overview",
    )
    tabs = [
        rrb.Vertical(
            rrb.TimeSeriesView(origin=at("series", f"over {over}"), name=f"Hz over {over}"),
            rrb.TimeSeriesView(origin=at("nrro", f"over {over}"), name=f"NRRO over {over}"),
            name=f"Over {over} (choose the timeline {over})",
        )
        for over in ("temperature", "speed")
    ]
    return rrb.Blueprint(
        rrb.Tabs(overview, *tabs),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TEMPERATURE, fps=4.0 * TICK, play_state="playing", loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )
