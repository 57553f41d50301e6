"""What `spindle warmup` says: JSON, terminal table, CSV, figures, and a section of the report."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.model.errors import listed
from thermospindle.model.types import Array
from thermospindle.model.units import MINUTE, RPM, in_rpm
from thermospindle.report.text.grid import show_grid
from thermospindle.report.typeset import figure, known, minus, power, write_csv
from thermospindle.sim.operating import provenance
from thermospindle.sim.warmup import Moment, Warmup, clearance, energy, loose_rollers, most_friction, roller_names, rollers

LINES = 16  # of the terminal table
NEAR = 0.5
"""Of a load that is added, what may come back by heat before a warm-up speaks of it."""
STIFFNESSES = (("radial", "radial_stiffness", "N_per_m"), ("axial", "axial_stiffness", "N_per_m"), ("tilt", "tilt_stiffness", "N_m_per_rad"))
"""Of ball rows: name, attribute of their state, unit."""
ROLLER_COLUMNS = (("temperature", "C"), ("clearance", "um"), ("radial stiffness", "N_per_m"), ("friction", "W"))
"""Of the CSV, in the order of `rollers`."""


def warmup_json(warmup: Warmup) -> dict[str, Any]:
    """Series over `time_s`; a row of `frequencies_Hz` holds all followed modes at one time, null where one was lost.

    `preload_N` is the first ball row's, null where there is none, `friction_W` all bearings'
    together; `bearings` has each its own, of rollers clearance instead of preload.
    """
    moments = warmup.moments
    first = first_row(warmup)
    return {
        "start_C": warmup.start,
        "air_C": warmup.air,
        "speed_rpm": in_rpm(warmup.speed),
        "time_s": warmup.times.tolist(),
        "temperature_C": {g: [m.temperatures[g] for m in moments] for g in moments[0].temperatures},
        "preload_N": None if first is None else [m.preload[first] for m in moments],
        "friction_W": [sum(m.friction.values()) for m in moments],
        "frequencies_Hz": known(warmup.frequencies),
        "modes": [{"kind": m.kind, "whirl": m.whirl} for m in warmup.modes],
        "bearings": {
            b.name: {
                "temperature_C": [m.bearing_temperatures[b.name] for m in moments],
                "preload_N": [m.preload[b.name] for m in moments],
                "contact_angle_deg": [float(np.degrees(m.point.state.bearing(b.name).contact_angle)) for m in moments],
                "friction_W": [m.friction[b.name] for m in moments],
                **{f"{key}_{unit}": [getattr(m.point.state.bearing(b.name), key) for m in moments] for _, key, unit in STIFFNESSES},
            }
            for b in warmup.spindle.bearings
        }
        | {name: rollers(warmup, name) for name in roller_names(warmup)},
        "status": moments[-1].point.state.status,
        "steady": _steady_json(warmup, first),
        "unsteady": warmup.unsteady,
        "time_constant_s": warmup.time_constant,
        "energy_J": energy(warmup),
        "left_out_effects": list(warmup.left_out),
        "provenance": provenance(warmup.spindle),
    }


def first_row(warmup: Warmup) -> str | None:
    """Name of the lowest ball row, whose preload stands for all; None of a spindle on rollers."""
    return next((b.name for b in warmup.spindle.bearings), None)


def _steady_json(warmup: Warmup, first: str | None) -> dict[str, Any] | None:
    """None where there is none."""
    steady = warmup.steady
    return None if steady is None else {
        "temperature_C": dict(steady.temperatures),
        "bearing_temperature_C": dict(steady.bearing_temperatures),
        "preload_N": None if first is None else steady.preload[first],
        "friction_W": sum(steady.friction.values()),
        "frequencies_Hz": known(warmup.steady_frequencies),
        "status": steady.point.state.status,
        "load_feedback": warmup.feedback,
    }


def rows(warmup: Warmup) -> tuple[list[str], list[list[float]]]:
    """Header with units and one row a time, for the CSV."""
    bearings = [b.name for b in warmup.spindle.bearings]
    regions = list(warmup.moments[0].temperatures)
    header = ["time_s", *(f"temperature of {g}_C" for g in regions)]
    for name, unit in (("temperature", "C"), ("preload", "N"), ("contact angle", "deg"), ("friction", "W")):
        header += [f"{name} of {b} bearing_{unit}" for b in bearings]
    header += [f"mode {k} {m.kind}_Hz" for k, m in enumerate(warmup.modes, 1)]
    of_rollers = {b: rollers(warmup, b) for b in roller_names(warmup)}
    header += [f"{name} of {b} bearing_{unit}" for b in of_rollers for name, unit in ROLLER_COLUMNS]
    columns = [series for own in of_rollers.values() for series in own.values()]
    for name, key, unit in STIFFNESSES:
        header += [f"{name} stiffness of {b} bearing_{unit}" for b in bearings]
        columns += [[getattr(m.point.state.bearing(b), key) for m in warmup.moments] for b in bearings]
    further = np.array(columns).T.tolist() or [[]] * len(warmup.times)
    body = []
    for time, moment, frequency, more in zip(warmup.times, warmup.moments, warmup.frequencies, further, strict=True):
        row = [float(time), *(moment.temperatures[g] for g in regions)]
        row += [moment.bearing_temperatures[b] for b in bearings] + [moment.preload[b] for b in bearings]
        row += [float(np.degrees(moment.point.state.bearing(b).contact_angle)) for b in bearings]
        body.append(row + [moment.friction[b] for b in bearings] + frequency.tolist() + more)
    return header, body


def write_warmup(warmup: Warmup, folder: Path) -> None:
    """`warmup.csv` (a comment line of provenance, a header with units, all steps), `warmup.png` and `warmup.svg`."""
    header, body = rows(warmup)
    about = ", ".join(f"{k} {v}" for k, v in provenance(warmup.spindle).items())
    write_csv(folder / "warmup.csv", header, body, about)
    from thermospindle.report.figures.common import save  # matplotlib takes its time to load
    from thermospindle.report.figures.warmup import figure as drawn

    save(drawn(warmup), folder, "warmup")


def show_warmup(console: Console, warmup: Warmup) -> None:
    soak = "" if warmup.air == warmup.start else f" in air of {warmup.air:g} C"
    title = f"Warm-up of {warmup.spindle.name} from {warmup.start:g} C{soak} at {warmup.speed / RPM:g} rpm"
    lost = lost_contact(warmup)
    if lost:
        console.print(f"{lost[0].upper()}{lost[1:]}.\n", highlight=False)
    console.print(f"{told(warmup)}\n", highlight=False, markup=False)
    bearings, of_rollers = [b.name for b in warmup.spindle.bearings], roller_names(warmup)
    unit, scale = power(max(max(m.friction.values()) for m in warmup.every))
    columns = ["time\nmin", *(f"{b}\nC" for b in (*bearings, *of_rollers)), "coolest\nC", "hottest\nC", *(f"{b}\npreload\nN" for b in bearings[:1])]
    columns += [*(f"{b}\nclearance\num" for b in of_rollers), *(f"{b}\nfriction\n{unit}" for b in (*bearings, *of_rollers))]
    columns += [f"f{k}\nHz" for k in range(1, len(warmup.modes) + 1)]
    rows = [
        [f"{warmup.times[k] / MINUTE:.2f}", *_cells(warmup.moments[k], bearings, of_rollers, warmup.frequencies[k], scale)] for k in _shown(warmup.times)
    ]
    steady = [] if warmup.steady is None else [["steady", *_cells(warmup.steady, bearings, of_rollers, warmup.steady_frequencies, scale)]]
    show_grid(console, title, columns, [*rows, *steady])
    kinds = ", ".join(f"f{k} {m.kind}" for k, m in enumerate(warmup.modes, 1))
    console.print(f"Bearings, coolest and hottest region; {kinds}.")
    total = heat_sums(warmup)
    console.print(
        f"Slowest time constant {warmup.time_constant:.0f} s. Heat of the whole time: motor {total['motor']} and bearings "
        f"{total['friction']} in, convection {total['convection']}, {total['stored']} stored."
    )
    if warmup.feedback > NEAR:
        console.print(f"Near runaway: of bearing loads that are added, {warmup.feedback:.0%} come back through the heat they make; at 100% there is no steady state. It warms up more slowly than the time constant says, which is that of loads that stay.")
    if warmup.left_out:
        console.print(f"Left out, since region temperatures are computed here: {', '.join(warmup.left_out)}.")


def told(warmup: Warmup) -> str:
    """Where a warm-up ends, what it passes through on the way, and how near to running away it is."""
    end, begin = warmup.every[-1], warmup.moments[0].preload
    first = max((b.name for b in warmup.spindle.bearings), key=lambda b: abs(end.preload[b] - begin[b]) / max(abs(begin[b]), 1e-9), default=None)
    warm = ", ".join(f"{name} {t:.1f} C" for name, t in end.bearing_temperatures.items()) or f"the hottest region {max(end.temperatures.values()):.1f} C"
    pressed = "" if first is None else _pressed(first, begin[first], end.preload[first])
    if warmup.steady is None:
        return " ".join([without_steady(warmup), f"{_at_the_end(warmup)} the bearings are at {warm}{pressed}.", *_on_the_way(warmup)])
    near = f"it is near runaway, {warmup.feedback:.0%} of a load that is added come back as heat" if warmup.feedback > NEAR else "it does not run away"
    return " ".join([f"In the steady state the bearings are at {warm}{pressed}; {near}.", *_on_the_way(warmup)])


def without_steady(warmup: Warmup) -> str:
    """That no steady state was found, and why; empty where one was."""
    return f"No steady state was found: {warmup.unsteady}." if warmup.unsteady else ""


def _at_the_end(warmup: Warmup) -> str:
    """When that is which comes last."""
    return "In the steady state" if warmup.steady is not None else f"After {warmup.times[-1] / MINUTE:.3g} min"


def _pressed(name: str, begin: float, end: float) -> str:
    before, after = f"{begin:.2f}", f"{end:.2f}"
    return f", the preload of {name} stays {after} N" if before == after else f", the preload of {name} goes from {before} to {after} N"


def _on_the_way(warmup: Warmup) -> list[str]:
    """Sentences on the least and the largest preload of any bearing, and on the mode that is ever furthest from its frequency at the start."""
    said = []
    loads = [(load, name, _when(warmup, k)) for k, m in enumerate(warmup.every) for name, load in m.preload.items()]
    if loads:
        (least, low, early), (most, high, late) = min(loads, key=lambda row: row[0]), max(loads, key=lambda row: row[0])
        ends = f"the smallest preload of any bearing is {least:.2f} N ({low}, {early}), the largest {most:.2f} N ({high}, {late})"
        said.append(f"Over the whole warm-up {ends}." if f"{least:.2f}" != f"{most:.2f}" else "The preload of no bearing changes on the way.")
    if (furthest := furthest_mode(warmup)) is not None:
        moment, k = furthest
        start, there = warmup.frequencies[0, k], warmup.every_frequency[moment, k]
        said.append(f"Of the natural frequencies f{k + 1} ({warmup.modes[k].kind}) moves most: it is {there:.1f} Hz {_when(warmup, moment)}, {there - start:+z.1f} Hz from {start:.1f} Hz at the start.")
    return said


def _shifts(warmup: Warmup) -> str:
    """By what each mode has moved at the end, and which none there has the shape of."""
    shift = warmup.every_frequency[-1] - warmup.frequencies[0]
    moved = [f"mode {k} ({escape(m.kind)}) {by:+z.1f}" for k, (m, by) in enumerate(zip(warmup.modes, shift, strict=True), 1) if np.isfinite(by)]
    lost = [f"{k} ({escape(m.kind)})" for k, (m, by) in enumerate(zip(warmup.modes, shift, strict=True), 1) if not np.isfinite(by)]
    said = [f"natural frequencies move by {', '.join(moved)} Hz"] if moved else []
    return ", and ".join([*said, f"no mode there has the shape of mode{'s' * (len(lost) > 1)} {listed(lost)}"] if lost else said)


def furthest_mode(warmup: Warmup) -> tuple[int, int] | None:
    """Moment and mode, from 0, of the largest change of a natural frequency since the start; the
    steady state counts as the last moment. None without modes."""
    every = warmup.every_frequency
    shift = np.nan_to_num(np.abs(every - every[0]))
    if not shift.size:
        return None
    moment, mode = np.unravel_index(int(np.argmax(shift)), shift.shape)
    return int(moment), int(mode)


def _when(warmup: Warmup, moment: int) -> str:
    """The time of a moment in words; the one after the last is the steady state."""
    return "in the steady state" if moment == len(warmup.times) else "at the start" if moment == 0 else f"at {warmup.times[moment] / MINUTE:.2f} min"


def lost_contact(warmup: Warmup) -> str:
    """From when on which bearings are without contact, and so without preload and stiffness; empty where none ever is."""
    if (loose := _loose_rollers(warmup)) and all(map(_all_loaded, warmup.every)):
        return loose
    lost = [(t, m) for t, m in zip(warmup.times, warmup.moments, strict=True) if not _all_loaded(m)]
    if lost:
        time, moment = lost[0]
        return f"the {moment.point.state.status} at {time / MINUTE:.3g} min: no preload from there on, and frequencies are of a loose spindle"
    if warmup.steady is not None and not _all_loaded(warmup.steady):
        return f"in the steady state, after the times computed, the {warmup.steady.point.state.status}"
    return ""


def _loose_rollers(warmup: Warmup) -> str:
    """From when on which rollers are loose; empty where none ever are."""
    for time, moment in zip(warmup.times, warmup.moments, strict=True):
        if names := loose_rollers(moment):
            return f"from {time / MINUTE:.3g} min on the rollers of {' and '.join(names)} are loose: they carry nothing then"
    names = [] if warmup.steady is None else loose_rollers(warmup.steady)
    return f"in the steady state, after the times computed, the rollers of {' and '.join(names)} are loose: they carry nothing" if names else ""


def heat_sums(warmup: Warmup) -> dict[str, str]:
    """Where the heat of the whole time came from and went, in joules or kilojoules; convection with its way, for air that is warmer heats."""
    total = energy(warmup)
    large = max(map(abs, total.values())) >= 1e4
    way = {"convection": "out" if total["convection"] >= 0 else "in"}
    sizes = total | {"convection": abs(total["convection"])}
    return {name: " ".join(filter(None, (f"{1e-3 * value:.1f} kJ" if large else f"{value:.1f} J", way.get(name)))) for name, value in sizes.items()}


def _all_loaded(moment: Moment) -> bool:
    return all(b.in_contact for b in moment.point.state.bearings)


def _cells(moment: Moment, bearings: Sequence[str], of_rollers: Sequence[str], frequency: Array, scale: float) -> list[str]:
    regions = moment.temperatures.values()
    clearances = [1e6 * clearance(moment, b) for b in of_rollers]
    temperatures = [*(moment.bearing_temperatures[b] for b in (*bearings, *of_rollers)), min(regions), max(regions)]
    return [
        *(f"{t:.2f}" for t in temperatures),
        *(f"{moment.preload[b]:.3f}" for b in bearings[:1]),
        *(f"{c:.2f}" for c in clearances),
        *(f"{scale * moment.friction[b]:.0f}" for b in (*bearings, *of_rollers)),
        *("-" if np.isnan(f) else f"{f:.1f}" for f in frequency),
    ]


def _shown(times: Array) -> list[int]:
    """Some of the times: the first, the last, and about evenly in the square root between."""
    wanted = times[-1] * np.linspace(0, 1, LINES) ** 2
    return sorted({int(np.argmin(np.abs(times - t))) for t in wanted})


def warmup_section(warmup: Warmup) -> tuple[str, str]:
    """Title and HTML of a report section."""
    from thermospindle.report.figures.common import svg
    from thermospindle.report.figures.warmup import figure as drawn

    last, total = warmup.every[-1], heat_sums(warmup)
    bearings = ", ".join(f"{b} {t:.1f}" for b, t in last.bearing_temperatures.items())
    first = first_row(warmup)
    pressed = "" if first is None else f", the preload of {escape(first)} is {last.preload[first]:.2f} N (at the start {warmup.moments[0].preload[first]:.2f} N)"
    unit, scale = power(most_friction(warmup))
    clear = {name: rollers(warmup, name)["clearance_um"][0] for name in roller_names(warmup)}
    fits = "".join(f", the clearance of the rollers of {escape(b)} {1e6 * clearance(last, b):.1f} µm (at the start {c:.1f} µm)" for b, c in clear.items())
    about = (
        f"<p>From {warmup.start:g} °C in air of {warmup.air:g} °C at {warmup.speed / RPM:.0f} rpm. The slowest time constant is "
        f"{warmup.time_constant:.0f} s. {escape(f'{without_steady(warmup)} '.lstrip())}{_at_the_end(warmup)} the bearings are at {escape(bearings)} °C{pressed}{fits} and bearing friction is "
        f"{scale * sum(last.friction.values()):.0f} {unit}; {_shifts(warmup)}.</p>"
        f"{''.join(f'<p>{escape(said)}</p>' for said in _on_the_way(warmup))}"
        f"<p>Heat: motor {total['motor']}, bearings {total['friction']} in; convection {total['convection']}; "
        f"stored {total['stored']}.</p>"
    )
    return "Warm-up", minus(about) + figure(svg(drawn(warmup), "warmup", "temperatures, preload, friction and natural frequencies over time"))
