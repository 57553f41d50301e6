"""The Rerun log of a run: one `.rrd` with what was computed, and a blueprint that shows it at a glance.

Rerun shows one timeline at a time, so everything that moves, moves on the timeline `frequency` (Hz, rounded to whole numbers):
FRFs are series on it, bodies swing while its cursor sweeps. Charts over other axes are pictures that every timeline shows; the
same numbers stand as series on `temperature` and `time`. `numbers/` holds the FRFs as computed, bit for bit (`report.log.read`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any, Literal

import numpy as np
import rerun as rr

from thermospindle.model.types import Array
from thermospindle.report.figures import run as figures
from thermospindle.report.log import drawing
from thermospindle.report.log.blueprint import CHARTS, blueprint, pair_path
from thermospindle.report.log.columns import (
    curve_look,
    log_curve,
    log_frf_numbers,
    log_mesh,
    log_peak_numbers,
    log_words,
    over_frequency,
    whole_log,
)
from thermospindle.report.log.content import Pair, Shown, bearing_series, frf_of, one, shown, summary
from thermospindle.report.log.drawing import heat
from thermospindle.report.log.pictures import for_dark, log_figure
from thermospindle.report.log.views import at
from thermospindle.sim import posing
from thermospindle.sim.identification.frf import decibel
from thermospindle.sim.identification.peak import Peak
from thermospindle.sim.operating import provenance
from thermospindle.sim.run import Run
from thermospindle.thermal.expansion import DeformedSection, field

BEARINGS = ((90, 200, 255), (255, 170, 80), (130, 225, 120), (255, 125, 185), (185, 150, 255), (235, 225, 110))  # in their order
MEASURED: tuple[tuple[tuple[int, int, int], Literal["up", "down"], str], ...] = (((120, 255, 140), "up", "^"), ((255, 215, 80), "down", "v"))
"""Of measured modes at one temperature and the next: colour, and mark in the log and in a figure."""
KEYS = 5  # temperatures named in the key, at most
LIGHT = (235, 235, 235)
TURNING = (0.95, 0.62, 0.25)  # tint of what turns, among the mode shapes


def write_log(run: Run, path: Path) -> None:
    """Write the log of a run, whole or not at all. BadInput if its folder does not exist."""
    content, spindle = shown(run), run.spindle
    sections = [field(step.point.spindle, step.point.regions) for step in run.steps]
    factor = drawing.exaggeration(sections, posing.reach(spindle)) if spindle.regions else 1.0
    names = [b.name for b in spindle.bearings] + [b.name for b in spindle.roller_bearings]
    series = {name: bearing_series(run, name) for name in names}
    quantities = dict.fromkeys(quantity for own in series.values() for quantity in own)
    ends = (min(content.temperatures), max(content.temperatures))
    name = f"{spindle.name}, " + " to ".join(f"{t:g} C" for t in dict.fromkeys(ends))
    with whole_log(path, "run", name, {"title": spindle.title, **provenance(spindle)}, blueprint(content, list(quantities), factor)) as recording:
        log_test(recording, content)
        log_section(recording, content, sections, factor)
        if series:
            log_bearings(recording, content, series)
        log_records(recording, content)


def log_test(recording: rr.RecordingStream, content: Shown) -> None:
    """What the logs of a run and of an impact test have in common: FRFs, peaks, mode shapes and the summary."""
    log_numbers(recording, content)
    log_frfs(recording, content)
    log_peaks(recording, content)
    log_key(recording, content)
    log_motion(recording, content)
    log_words(recording, "summary", summary(content.run, content.peaks))


# ---------------------------------------------------------------- frequency response


def log_numbers(recording: rr.RecordingStream, content: Shown) -> None:
    """Every FRF as computed; and the peaks."""
    for order, test in enumerate(content.tests):
        log_frf_numbers(recording, test.id, order, test.temperature, test.speed, frf_of(test))
    log_peak_numbers(recording, content.peaks)


def log_frfs(recording: rr.RecordingStream, content: Shown) -> None:
    """Level, phase and coherence of every FRF for the eye."""
    for test in content.tests:
        frf, colour = frf_of(test), heat(test.temperature, content.temperatures)
        look = curve_look(colour, f"{test.temperature:g} °C", 1.5)
        for pair in ((r, h) for r in frf.response_nodes for h in frf.reference_nodes):
            value = one(frf.value, frf, pair)
            series = {"level": decibel(value), "phase": np.degrees(np.angle(value))}
            series |= {} if frf.coherence is None else {"coherence": one(frf.coherence, frf, pair)}
            for name, values in series.items():
                log_curve(recording, at(*pair_path(pair), name, test.id), over_frequency(frf.frequency), values, look)


def log_peaks(recording: rr.RecordingStream, content: Shown) -> None:
    """Identified peaks on the curves, a series for each mode; measured frequencies in rows at the bottom."""
    frfs = {t.id: frf_of(t) for t in content.tests}
    marks: dict[tuple[str, str], tuple[rr.SeriesPoints, list[Peak], float | None]] = {}
    for mode, kind in enumerate(["none of the model's", *(m.kind for m in content.modes)]):
        look = rr.SeriesPoints(colors=[LIGHT], markers="diamond", marker_sizes=4, names=f"{mode} {kind}, identified")
        own = [p for p in content.peaks if p.source == "identified" and p.mode == mode]
        marks["identified", f"mode {mode}"] = (look, own, None)
    for k, ((source, test), own) in enumerate(content.measured.items()):
        name = f"measured {own[0].temperature:g} °C ({source})"
        paint, marker, _ = MEASURED[k % len(MEASURED)]
        look = rr.SeriesPoints(colors=[paint], markers=marker, marker_sizes=5, names=name)
        marks["measured", f"{source} {test}"] = (look, own, content.level[0] + 2.0 + 4.0 * k)
    for pair in content.pairs:
        for (group, name), (look, own, height) in marks.items():
            if own:
                values = [_level(frfs[p.test], pair, p.frequency) if height is None else height for p in own]
                times = over_frequency(np.array([p.frequency for p in own]))
                log_curve(recording, at(*pair_path(pair), "level", group, name), times, np.array(values), look)


def _level(frf: Any, pair: Pair, frequency: float) -> float:
    return float(np.interp(frequency, frf.frequency, decibel(one(frf.value, frf, pair))))


def log_key(recording: rr.RecordingStream, content: Shown) -> None:
    """What the colours and marks of the level plots mean, and the numbers of the modes above their peaks."""
    some = np.unique(np.linspace(0, len(content.tests) - 1, KEYS).round().astype(int))
    curves = [(f"{t:g} °C", for_dark(heat(t, content.temperatures))) for t in np.array(content.temperatures)[some]]
    marks = [("identified", for_dark(LIGHT), "D")]
    for k, own in enumerate(content.measured.values()):
        paint, _, marker = MEASURED[k % len(MEASURED)]
        marks.append((f"measured {own[0].temperature:g} °C", for_dark(paint), marker))
    modes = [m.frequency for m in content.modes]
    log_figure(recording, "charts/key", figures.key(curves, marks, modes, content.band, CHARTS["key"]))


# ---------------------------------------------------------------- model, section, bearings


def log_motion(recording: rr.RecordingStream, content: Shown) -> None:
    """Mode shapes, and the answer to a swept force, at the first temperature, what turns amber; on
    two timelines at once, at rest on the others."""
    point = content.run.steps[0].point
    frequency = np.arange(content.band[0], content.band[1] + 1, content.step)
    motions = {f"mode_{i}": posing.mode_motion(point, m, len(frequency)) for i, m in enumerate(content.modes, 1)}
    motions["sweep"] = posing.sweep_motion(point, content.pairs[0][1], frequency.astype(float))
    slow = rr.TimeColumn("slow motion", duration=np.arange(len(frequency)) / posing.CYCLE)
    meshes = posing.body_meshes(point.spindle)
    for name, motion in motions.items():
        for body, (translation, turn) in posing.poses(point, motion).items():
            if body in meshes:
                moves = rr.Transform3D.columns(translation=translation, quaternion=turn)
                recording.send_columns(at("model", name, body), [rr.TimeColumn("frequency", sequence=frequency), slow], moves)
            for mesh in meshes.get(body, []):
                log_mesh(recording, at("model", name, body, mesh.region), mesh, TURNING if point.spindle.structure.body(body).turns else None)


def log_section(recording: rr.RecordingStream, content: Shown, sections: Sequence[Mapping[str, DeformedSection]], factor: float) -> None:
    """The deformed section: lowest against highest temperature in one picture, and every one on its timeline."""
    spindle, temperatures = content.run.spindle, content.temperatures
    ends = [("left", -1, int(np.argmin(temperatures))), ("right", 1, int(np.argmax(temperatures)))]
    for part in sections[0]:
        drawn = []
        for section, step, t in zip(sections, content.run.steps, temperatures, strict=True):
            shift = step.point.state.hub_movement if spindle.bearings and part == spindle.region(spindle.bearings[0].outer_ring).part else 0.0
            drawn.append(drawing.section_mesh(spindle, section[part], shift, factor, heat(t, temperatures)))
        for name, side, k in ends:
            vertices, triangles, colours = drawn[k]
            mesh = rr.Mesh3D(vertex_positions=vertices * [side, 1, 1], triangle_indices=triangles, vertex_colors=colours)
            recording.log(at("section", "compared", name, part), mesh, static=True)
        entity = at("section", "by temperature", part)
        recording.log(entity, rr.Mesh3D.from_fields(triangle_indices=drawn[0][1]), static=True)
        vertices, colours = (np.concatenate([d[i] for d in drawn]) for i in (0, 2))
        columns = rr.Mesh3D.columns(vertex_positions=vertices, vertex_colors=colours).partition([len(d[0]) for d in drawn])
        recording.send_columns(entity, [_over_temperature(content)], columns)
    for picture, sides in (("compared", (-1, 1)), ("by temperature", (1,))):
        lines = [strip * [side, 1, 1] for strip in drawing.outlines(spindle) for side in sides]
        outline = rr.LineStrips3D(lines, colors=[(255, 255, 255, 120)], radii=rr.Radius.ui_points(0.4))
        recording.log(at("section", picture, "undeformed"), outline, static=True)
    recording.log("section", rr.AnyValues(displacement_is_drawn_times=factor), static=True)


def log_bearings(recording: rr.RecordingStream, content: Shown, series: Mapping[str, Mapping[tuple[str, str], Array]]) -> None:
    """The bearing states as series over temperature, and as charts; a ring gap is the outer ring's thermal motion less the
    inner ring's."""
    panels: dict[str, list[tuple[Array, Array, figures.Colour]]] = {}
    colours = dict(zip(series, cycle(BEARINGS), strict=False))
    for bearing, own in series.items():
        for (name, unit), values in own.items():
            look = curve_look(colours[bearing], bearing)
            log_curve(recording, at("bearings", name, bearing), _over_temperature(content), values, look)
            panels.setdefault(f"{name}, {unit}", []).append((np.array(content.temperatures), values, for_dark(colours[bearing])))
    named = {bearing: for_dark(colour) for bearing, colour in colours.items()}
    log_figure(recording, "charts/bearings", figures.panels(panels, 3, CHARTS["bearings"], "°C", named))


# ---------------------------------------------------------------- records


def log_records(recording: rr.RecordingStream, content: Shown) -> None:
    """Hammer force and responses of the first hit of every hammer, as series over time and as charts."""
    panels: dict[str, list[tuple[Array, Array, figures.Colour]]] = {}
    hammers = content.run.spindle.hammer.hammer_nodes
    for step, test in zip(content.run.steps, content.tests, strict=True):
        record, colour = step.test.record, heat(test.temperature, content.temperatures)
        time = rr.TimeColumn("time", duration=record.time)
        look = curve_look(colour, f"{test.temperature:g} °C")
        place = {node: i for i, node in enumerate(frf_of(test).response_nodes)}
        for h, hammer in enumerate(hammers):
            force, velocity = record.force[h, 0], 1e3 * record.velocity[h, 0]
            log_curve(recording, at("records", f"hammer {hammer}", "force", test.id), time, force, look)
            for node in hammers:
                entity = at("records", f"hammer {hammer}", f"velocity {node}", test.id)
                log_curve(recording, entity, time, velocity[place[node]], look)
            for title, values, end in (("force", force, 5e-3), ("velocity", velocity[place[hammer]], 0.1)):
                part = slice(int(np.searchsorted(record.time, end)) + 1)
                curve = (1e3 * record.time[part], values[part], for_dark(colour))
                panels.setdefault(f"{title} at {hammer}, {'N' if title == 'force' else 'mm/s'}", []).append(curve)
    log_figure(recording, "charts/records", figures.panels(panels, 2, CHARTS["records"], "ms"))


def _over_temperature(content: Shown) -> rr.TimeColumn:
    """Whole degrees where all are, else hundredths."""
    whole = all(float(t).is_integer() for t in content.temperatures)
    name, unit = ("temperature", 1.0) if whole else ("temperature, 0.01 C", 0.01)
    return rr.TimeColumn(name, sequence=np.round(np.array(content.temperatures) / unit).astype(int))
