"""The Rerun log of a turning spindle: the model spins and its orbit grows on the timeline `time`, RRO and NRRO run beside them.

The record is one entity, `signals`, with six values a sample in nm, RRO and NRRO of the hub's probes x, y and axial, sent in one piece of
columns; their sums are the record. The waterfall is a picture that every timeline shows, and the same lines stand as numbers on the
timeline `speed` (rpm, rounded). `report.log.read` reads it all back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import rerun as rr

from thermospindle.model.bearing.definitions import Bearing, RollerBearing
from thermospindle.model.rotor.look.meshes import stripe_meshes
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, TO_MM, TO_NM
from thermospindle.report.figures.runout import polar_figure, waterfall_figure
from thermospindle.report.log.columns import log_mesh, log_values, log_words, number_column, whole_log
from thermospindle.report.log.content import made_from
from thermospindle.report.log.pictures import log_figure
from thermospindle.report.log.turning.blueprint import POLAR, WATERFALL, blueprint
from thermospindle.report.log.views import at
from thermospindle.sim.operating import provenance
from thermospindle.sim.posing import body_meshes, cage_turns, frame_indices, turning_poses
from thermospindle.sim.running.probes import AXIAL, X, Y, looked_at
from thermospindle.sim.running.runout import Runout
from thermospindle.sim.running.waterfall import LineSpectrum

COLOURS = ((255, 120, 90), (90, 200, 255), (190, 220, 90))  # x, y, axial
BALL = (225, 205, 150)
SEGMENTS = 8  # of a revolution: pieces in which the orbit grows


def write_runout_log(runout: Runout, spectra: Sequence[LineSpectrum], path: Path) -> None:
    """Write the log of a record and of the `spectra` over speed (may be empty), whole or not at all. BadInput if its folder does not exist."""
    condition, spindle = runout.point.condition, runout.point.spindle
    spectra = spectra if any(len(s.frequency) for s in spectra) else ()  # of a perfect spindle there is nothing to show
    moved, factor = turning_poses(runout)
    name = f"{spindle.name} at {condition.temperature:g} C, {condition.speed / RPM:.6g} rpm"
    about = {"title": spindle.title, "temperature_C": condition.temperature, "speed_rad_per_s": condition.speed}
    about |= {"revolutions": runout.averaged.count, "samples": len(runout.averaged.angle), "displacements_are_drawn_times": factor}
    with whole_log(path, "runout", name, about | provenance(spindle), blueprint(runout, factor, bool(spectra))) as recording:
        log_signals(recording, runout)
        log_orbit(recording, runout)
        log_model(recording, runout, moved)
        log_numbers(recording, runout)
        log_waterfall(recording, spectra)
        log_figure(recording, "charts/polar", polar_figure(runout, POLAR))
        log_words(recording, "summary", summary(runout))


def log_signals(recording: rr.RecordingStream, runout: Runout) -> None:
    """RRO and NRRO of the hub's probes, six values a sample (nm): one entity, so that time and row stand in the file once for all six."""
    cut = runout.by_lines
    repeatable = np.broadcast_to(cut.repeatable[:3, None], cut.value[:3].shape)
    values = TO_NM * np.concatenate([repeatable, cut.nonrepeatable[:3]]).reshape(6, -1)
    names = [f"{part} {probe}" for part in ("RRO", "NRRO") for probe in (X, Y, AXIAL)]
    look = rr.SeriesLines(colors=[*COLOURS, *COLOURS], names=names, widths=[1.0] * 6)
    recording.log("signals", look, static=True)
    columns = rr.Scalars.columns(scalars=values.T.ravel()).partition(np.full(values.shape[1], 6))
    recording.send_columns("signals", [rr.TimeColumn("time", duration=cut.time)], columns)


def log_orbit(recording: rr.RecordingStream, runout: Runout) -> None:
    """The orbit in pieces of an eighth of a revolution, which stay as time goes on; the repeatable
    part, and what all revolutions cover, from the start."""
    cut = runout.by_lines
    x, y = (cut.value[i].ravel() for i in (0, 1))
    pieces, ends = orbit_pieces(x, y, len(cut.angle))
    lengths = [len(p) for p in pieces]
    look = rr.LineStrips2D.from_fields(colors=[COLOURS[1]], radii=rr.Radius.ui_points(0.7))
    recording.log("orbit/growing", look, static=True)
    strips = rr.LineStrips2D.columns(strips=pieces)
    assert len(lengths) == len(ends)
    recording.send_columns("orbit/growing", [rr.TimeColumn("time", duration=cut.time[ends])], strips)
    covered = TO_NM * np.stack([x, -y], axis=1)[:: max(1, len(x) // 2000)]
    recording.log("orbit/covered", rr.Points2D(covered, colors=[(70, 76, 90)], radii=rr.Radius.ui_points(0.8)), static=True)
    mean = TO_NM * np.stack([cut.repeatable[0], -cut.repeatable[1]], axis=1)
    closed = np.concatenate([mean, mean[:1]])
    recording.log("orbit/repeatable", rr.LineStrips2D([closed], colors=[COLOURS[0]], radii=rr.Radius.ui_points(1.6)), static=True)


def orbit_pieces(x: Array, y: Array, samples: int) -> tuple[list[Array], Array]:
    """Strips (k, 2) nm of an orbit (n,) m, y pointing down, that begin where the one before ends, and the sample at which each ends."""
    ends = np.unique(np.append(np.arange(max(samples // SEGMENTS, 1), len(x), max(samples // SEGMENTS, 1)), len(x) - 1))
    track = TO_NM * np.stack([x, -y], axis=1)
    starts = np.concatenate([[0], ends[:-1]])
    return [track[a : b + 1] for a, b in zip(starts, ends, strict=True)], ends


def log_model(recording: rr.RecordingStream, runout: Runout, moved: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """The cut-away model turning, with its displacements enlarged, and the balls going round with their cages."""
    spindle = runout.point.spindle
    time = rr.TimeColumn("time", duration=runout.signals.time[frame_indices(runout)])
    stripes = stripe_meshes(spindle)
    for body, meshes in body_meshes(spindle).items():
        translation, turn = moved[body]
        recording.send_columns(at("model", body), [time], rr.Transform3D.columns(translation=translation, quaternion=turn))
        for mesh in (*meshes, *(s for s in stripes if s.body == body)):
            log_mesh(recording, at("model", body, mesh.region), mesh)
    turned = cage_turns(runout)
    for bearing in spindle.rolling:
        if bearing.name not in turned:
            continue
        kind, drawn = rolling_elements(bearing)
        entity = f"{kind} of {bearing.name} bearing"
        recording.send_columns(at("model", entity), [time], rr.Transform3D.columns(quaternion=turned[bearing.name]))
        recording.log(at("model", entity, kind), drawn, static=True)


def rolling_elements(bearing: Bearing | RollerBearing) -> tuple[str, rr.Ellipsoids3D | rr.Cylinders3D]:
    """What a bearing's rolling elements are called, and they themselves where they are at first, in mm."""
    azimuth = 2 * np.pi * np.arange(bearing.balls) / bearing.balls

    def centres(z: float) -> Array:
        return TO_MM * np.stack([bearing.pitch_diameter / 2 * np.cos(azimuth), bearing.pitch_diameter / 2 * np.sin(azimuth), 0 * azimuth + z], axis=1)

    radius = TO_MM * bearing.ball_diameter / 2
    if isinstance(bearing, RollerBearing):
        every = np.concatenate([centres(bearing.z + offset) for offset in bearing.offsets])
        lengths = [TO_MM * bearing.roller_length] * bearing.elements
        return "rollers", rr.Cylinders3D(centers=every, radii=[radius] * bearing.elements, lengths=lengths, colors=[BALL], fill_mode="solid")
    return "balls", rr.Ellipsoids3D(centers=centres(bearing.z), radii=[radius] * bearing.balls, colors=[BALL], fill_mode="solid")


def log_numbers(recording: rr.RecordingStream, runout: Runout) -> None:
    """What is quoted, in m, and the lines found, as columns of numbers."""
    values = runout.values()
    names = list(next(iter(values.values())).__dataclass_fields__)
    quoted = {"probe": list(values), **{n: [asdict(m)[n] for m in values.values()] for n in names}}
    log_values(recording, "numbers/quoted", quoted)
    lines = runout.lines
    plain = ("frequency", "direction", "amplitude", "forward", "backward", "repeatable")
    columns_of_lines = {name: [getattr(g, name) for g in lines] for name in plain} | {"orders": [g.order for g in lines]}
    columns_of_lines["name"] = [g.causes[0].name if g.causes else "" for g in lines]
    columns_of_lines["cause"] = [g.causes[0].cause if g.causes else "unexplained" for g in lines]
    columns_of_lines["bearing"] = [g.causes[0].bearing if g.causes else "" for g in lines]
    if lines:
        log_values(recording, "numbers/lines", columns_of_lines)


def log_waterfall(recording: rr.RecordingStream, spectra: Sequence[LineSpectrum]) -> None:
    """Line spectra over speed: frequencies and amplitudes (m) a row a speed, and the picture."""
    if not spectra:
        return
    speed = rr.TimeColumn("speed", sequence=np.round([s.speed / RPM for s in spectra]).astype(int))
    columns: list[rr.ComponentColumn] = []
    columns += number_column("speed_rad_per_s", np.array([s.speed for s in spectra]))
    for name in ("frequency", "radial", "axial", "natural"):
        parts = [getattr(s, name) for s in spectra]
        columns += number_column(name, np.concatenate(parts)).partition([len(p) for p in parts])
    recording.send_columns("numbers/waterfall", [speed], columns)
    for direction in ("radial", "axial"):
        log_figure(recording, f"charts/waterfall_{direction}", waterfall_figure(spectra, direction, WATERFALL))


def summary(runout: Runout) -> str:
    """Markdown: what is quoted, and the strongest lines."""
    condition, where, rolls = runout.point.condition, looked_at(runout.point.spindle), bool(runout.point.spindle.rolling)
    of_what = "" if abs(runout.ratios[0]) == 1 else f" of the {where}"
    shown = {X: f"{where} x", Y: f"{where} y", AXIAL: f"{where} axial"}
    lines = [
        f"**{condition.temperature:g} °C, {condition.speed / RPM:.6g} rpm, {runout.averaged.count} revolutions{of_what}**",
        "",
        "| nm | RRO | NRRO | 6σ NRRO | synchr. | asynchr. |",
        "|---|---|---|---|---|---|",
    ]
    for name, m in runout.values().items():
        row = (m.repeatable, *((m.nonrepeatable, m.six_sigma) if rolls else (None, None)), m.synchronous_error, m.asynchronous_error if rolls else None)
        lines.append(f"| {shown.get(name, name)} | " + " | ".join("-" if v is None else f"{TO_NM * v:.1f}" for v in row) + " |")
    if not rolls:
        lines += ["", "What does not repeat every revolution is unknown: the bearings are given by numbers and roll no balls."]
    lines += ["", "Strongest lines:", "", "| Hz | | nm | line | cause |", "|---|---|---|---|---|"] if runout.lines else ["", "No line: nothing moves."]
    for g in runout.lines[:16]:
        cause = f"{', '.join(dict.fromkeys(c.bearing for c in g.causes if c.bearing))} {g.causes[0].cause}".strip() if g.causes else "unexplained"
        name = g.causes[0].name if g.causes else ""
        lines.append(f"| {g.frequency:.1f} | {g.direction} | {TO_NM * g.amplitude:.1f} | {name} | {cause} |")
    return "\n".join([*lines, *made_from(runout.point.spindle)]) + "\n"
