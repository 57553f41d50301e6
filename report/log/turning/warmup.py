"""The Rerun log of a warm-up: the section heats up on the timeline `time`, and temperatures,
preload, friction and natural frequencies beside it.

`numbers/warmup` holds what `warmup.csv` holds, a component a column of it and a row a time step, as
computed; the series for the eye are the same numbers under the names of warmup.png: of regions of nearly one
temperature their mean, natural frequencies as their change since the start. `report.log.read` reads it back.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from thermospindle.model.types import Array
from thermospindle.model.units import MINUTE, RPM, TO_MM
from thermospindle.report.figures.common import BEARINGS
from thermospindle.report.figures.warmup import MODES, bearing_names, region_groups
from thermospindle.report.log.blueprint import framed
from thermospindle.report.log.columns import curve_look, log_curve, log_words, number_column, whole_log
from thermospindle.report.log.content import made_from
from thermospindle.report.log.drawing import HEAT, heat, light, outlines
from thermospindle.report.log.views import at, axis, scene, summary_view, window
from thermospindle.report.text.warmup import heat_sums, lost_contact, rows, without_steady
from thermospindle.report.typeset import power
from thermospindle.sim.operating import provenance
from thermospindle.sim.warmup import Warmup, clearance, most_friction, roller_names, rollers

CLEARANCE = "bearings/clearance"
LETTER, MARGIN, MOST = 0.0125, 0.12, 0.6  # of the width of a view that a letter of the key to its curves takes, what surrounds it, and all of it at most
SECONDS = 12.0  # in which all of it is played


def write_warmup_log(warmup: Warmup, path: Path) -> None:
    """Write the log, whole or not at all. BadInput if its folder does not exist."""
    name = f"warm-up of {warmup.spindle.name} at {warmup.speed / RPM:.6g} rpm"
    about = {"title": warmup.spindle.title, "start_C": warmup.start, "air_C": warmup.air, "speed_rad_per_s": warmup.speed}
    about |= {"time_constant_s": warmup.time_constant, **provenance(warmup.spindle)}
    with whole_log(path, "warmup", name, about, _blueprint(warmup)) as recording:
        log_numbers(recording, warmup)
        log_series(recording, warmup)
        log_section(recording, warmup)
        log_words(recording, "summary", summary(warmup))


def _over_time(warmup: Warmup) -> rr.TimeColumn:
    return rr.TimeColumn("time", duration=warmup.times)


def log_numbers(recording: rr.RecordingStream, warmup: Warmup) -> None:
    """Every column of `warmup.csv` under its name."""
    header, body = rows(warmup)
    columns: list[rr.ComponentColumn] = []
    for name, values in zip(header, np.array(body).T, strict=True):
        columns += number_column(name, np.ascontiguousarray(values))
    recording.send_columns("numbers/warmup", [_over_time(warmup)], columns)


def series(warmup: Warmup) -> dict[str, dict[str, tuple[Array, Any]]]:
    """What is drawn over time, (times,) with its colour, by entity and name; `titles` says what it is."""
    moments, spindle = warmup.moments, warmup.spindle
    friction = [b.name for b in spindle.ringed]
    bearings, rolling = [b.name for b in spindle.bearings], roller_names(warmup)
    _, scale = power(most_friction(warmup))
    shift = warmup.frequencies - warmup.frequencies[0]
    modes = {f"{k} {m.kind} {f:.0f} Hz": k - 1 for k, (m, f) in enumerate(zip(warmup.modes, warmup.frequencies[0], strict=True), 1)}
    regions = region_groups(warmup)
    paints = {b: _of_bearing(k) for k, b in enumerate(friction)}

    def each(values: Array, names: list[str]) -> dict[str, tuple[Array, Any]]:
        """(times, bearings) by bearing, or once where they are the same."""
        return {told: (own, paints[name]) for told, name, own in zip(bearing_names(values, names), names, values.T, strict=False)}

    return {
        "regions": {
            name: (own.mean(axis=1), light(MODES[k % len(MODES)])) for k, (name, _, own) in enumerate(regions)
        },
        "bearings/temperature": each(np.array([[m.bearing_temperatures[b] for b in friction] for m in moments]), friction),
        # in nN, or rounding errors of a spring's constant force fill the panel
        "bearings/preload": each(np.round([[m.preload[b] for b in bearings] for m in moments], 9), bearings),
        "bearings/contact angle": each(np.degrees([[m.point.state.bearing(b).contact_angle for b in bearings] for m in moments]), bearings),
        **({CLEARANCE: each(np.array([rollers(warmup, b)["clearance_um"] for b in rolling]).T, rolling)} if rolling else {}),
        "bearings/friction heat": each(scale * np.array([[m.friction[b] for b in friction] for m in moments]), friction),
        "modes": {n: (shift[:, k], light(MODES[k % len(MODES)])) for n, k in modes.items()},
    }


def titles(warmup: Warmup) -> dict[str, str]:
    """What stands above the views of `series`."""
    unit, _ = power(most_friction(warmup))
    return {
        "regions": "Regions, °C",
        "bearings/temperature": "Bearings, °C",
        "bearings/preload": "Preload, N",
        "bearings/contact angle": "Contact angle, deg",
        CLEARANCE: "Clearance of rollers, µm across",
        "bearings/friction heat": f"Friction heat, {unit}",
        "modes": "Natural frequencies, Hz of change since the start",
    }


def log_series(recording: rr.RecordingStream, warmup: Warmup) -> None:
    for group, own in series(warmup).items():
        for name, (values, paint) in own.items():
            log_curve(recording, at("series", *group.split("/"), name), _over_time(warmup), values, curve_look(paint, name, 1.5))


def _of_bearing(k: int) -> tuple[int, int, int]:
    return light(BEARINGS[k % len(BEARINGS)][0])


def _ends(warmup: Warmup) -> tuple[float, float]:
    """Lowest and highest temperature (C) of any node at any time."""
    return float(warmup.history.nodal.min()), float(warmup.history.nodal.max())


def log_section(recording: rr.RecordingStream, warmup: Warmup) -> None:
    """Both halves of the section with the temperature of every corner of its elements as its colour, at every time."""
    model = warmup.history.model
    for part, span in model.spans.items():
        mesh = model.sections[part].mesh  # nodal values of its second-order elements begin with its corners
        r, z = TO_MM * mesh.p
        corners = np.concatenate([mesh.t[[0, k, k + 1]].T for k in range(1, len(mesh.t) - 1)])
        paint = np.concatenate([heat(row[span][: len(r)], _ends(warmup)) for row in warmup.history.nodal])
        for side, name in ((-1, "left"), (1, "right")):
            entity = at("section", part, name)
            shape = rr.Mesh3D.from_fields(vertex_positions=np.stack([side * r, 0 * r, z], axis=1), triangle_indices=corners)
            recording.log(entity, shape, static=True)
            columns = rr.Mesh3D.columns(vertex_colors=paint).partition(np.full(len(warmup.times), len(r)))
            recording.send_columns(entity, [_over_time(warmup)], columns)
    lines = [strip * [side, 1, 1] for strip in outlines(warmup.spindle) for side in (-1, 1)]
    recording.log("section/key", key_to_colours(warmup), static=True)
    recording.log("section/outline", rr.LineStrips3D(lines, colors=[(255, 255, 255, 90)], radii=rr.Radius.ui_points(0.4)), static=True)


def key_to_colours(warmup: Warmup) -> rr.Points3D:
    """Dots in the colours of `drawing.HEAT`, each with its temperature: a row above the section, or beside that of a long spindle."""
    low, high = _ends(warmup)
    long, r, z = framed(warmup.spindle)
    temperatures = np.linspace(low, high, len(HEAT))
    places = [(0.95 * r, 0.0, z + s * r) if long else (s * r, 0.0, 1.1 * r) for s in np.linspace(-0.7, 0.7, len(HEAT))]
    labels = [f"{t:.4g} °C" for t in temperatures]
    return rr.Points3D(places, colors=heat(temperatures, (low, high)), labels=labels, show_labels=True, radii=rr.Radius.ui_points(6.0))


def summary(warmup: Warmup) -> str:
    """Markdown: bearings and natural frequencies at the start, at the end and in the steady state,
    as far as there is one, and where the heat went."""
    spindle, lost = warmup.spindle, lost_contact(warmup)
    moments = warmup.every
    shown = sorted({0, len(warmup.moments) - 1, len(moments) - 1})
    lines = [
        f"**From {warmup.start:g} °C in air of {warmup.air:g} °C at {warmup.speed / RPM:.6g} rpm**",
        "",
        *([f"{lost[0].upper()}{lost[1:]}.", ""] if lost else []),
        *([told, ""] if (told := without_steady(warmup)) else []),
        f"| | start | {warmup.times[-1] / MINUTE:.3g} min |" + " steady |" * (len(shown) > 2),
        "|---|---|---|" + "---|" * (len(shown) > 2),
    ]
    for b in spindle.ringed:
        lines.append(f"| {b.name}, °C | " + " | ".join(f"{moments[k].bearing_temperatures[b.name]:.2f}" for k in shown) + " |")
    for b in spindle.bearings:
        lines.append(f"| {b.name} preload, N | " + " | ".join(f"{moments[k].preload[b.name]:.2f}" for k in shown) + " |")
    for name in roller_names(warmup):
        clear = (1e6 * clearance(moments[k], name) for k in shown)
        lines.append(f"| {name} clearance, µm | " + " | ".join(f"{c:.2f}" for c in clear) + " |")
    for number, (mode, frequency) in enumerate(zip(warmup.modes, warmup.every_frequency.T, strict=True), 1):
        values = frequency[shown]
        lines.append(f"| {number} {mode.kind}, Hz | " + " | ".join(f"{f:.1f}" if np.isfinite(f) else "lost" for f in values) + " |")
    heat = heat_sums(warmup)
    lines += ["", f"Slowest time constant {warmup.time_constant:.0f} s.", ""]
    lines += [f"Heat: motor {heat['motor']}, bearings {heat['friction']} in; convection {heat['convection']}; stored {heat['stored']}."]
    lines += ["", f"Left out: {', '.join(warmup.left_out)}."] if warmup.left_out else []
    return "\n".join([*lines, *made_from(spindle)]) + "\n"


# ---------------------------------------------------------------- what is shown


def beyond(end: float, names: Sequence[str]) -> float:
    """Where an axis of time (s) ends that leaves room for the key to its curves, with these names, beyond the `end` of them."""
    return float(end / (1 - min(MARGIN + LETTER * max(map(len, names), default=0), MOST)))


def _blueprint(warmup: Warmup) -> rrb.Blueprint:
    """The section heating up over the summary, and all series beside them."""
    low, high = _ends(warmup)
    long, r, z = framed(warmup.spindle)
    away, height = (2.1 * r, z) if long else (2.6 * r, 0.3 * r)
    section = scene("section", f"Section, {low:.4g} to {high:.4g} °C", (0, -away, height), (0, 0, height))
    named, title = rrb.PlotLegend(corner=rrb.Corner2D.RightTop), titles(warmup)
    views = [
        rrb.TimeSeriesView(origin=at("series", *group.split("/")), name=title[group], axis_x=axis("seconds", 0.0, beyond(warmup.times[-1], [*own])), plot_legend=named)
        for group, own in series(warmup).items()
    ]
    left = rrb.Vertical(section, summary_view(), row_shares=[1.2, 1])
    everything = rrb.Horizontal(left, rrb.Grid(*views, grid_columns=2), column_shares=[1, 1.9])
    return window(everything, "time", playback_speed=float(warmup.times[-1]) / SECONDS)
