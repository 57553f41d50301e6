"""What `spindle map` says: JSON, sentences, terminal table, CSV and a section of the report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.model.bearing.kinematics import VARYING, Line
from thermospindle.model.errors import listed
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, in_rpm
from thermospindle.report.text.grid import OF_LINES, show_grid
from thermospindle.report.typeset import figure, known, prose, table, write_csv
from thermospindle.sim.operating import provenance
from thermospindle.sim.resonance.found import NEARBY, Coincidence, ResonanceMap, nearest, strongest
from thermospindle.sim.resonance.point import key
from thermospindle.sim.running.probes import looked_at

SAID = 4  # crossings at the nominal speed told in words, of more than one more
FEW = 4  # temperatures or speeds that are told one by one
SHOWN = 18  # coincidences in the terminal and the report


def map_json(found: ResonanceMap) -> dict[str, Any]:
    """Coincidences; modes over the grid [temperature][speed]; lines at the nominal condition; runout along both axes."""
    return {
        "nominal": {"temperature_C": found.nominal.temperature, "speed_rpm": in_rpm(found.nominal.speed)},
        "mapped": mapped(found),
        "sentences": [*sentences(found), *nearby(found)],
        "coincidences": [_coincidence_json(c) for c in found.coincidences],
        "beyond": [_coincidence_json(c) for c in found.beyond],
        "modes": [{"mode": m.number, "kind": m.kind, "whirl": m.whirl, "frequency_Hz": known(m.frequency)} for m in found.modes],
        "lines": [
            {
                "line": t.line.name,
                "bearing": t.line.bearing,
                "cause": t.line.cause,
                "order": t.line.order,
                "direction": t.line.direction,
                "whirl": t.line.whirl,
                "amplitude_um": 1e6 * t.amplitude,
                "frequency_Hz": t.line.frequency,
            }
            for t in found.lines
        ],
        "grid": {"temperature_C": found.temperatures.tolist(), "speed_rpm": [in_rpm(s) for s in found.speeds]},
        "nrro_um": {
            "over_speed": _runout_json(found.nrro_speed, "speed_rpm", in_rpm),
            "over_temperature": _runout_json(found.nrro_temperature, "temperature_C", float),
        },
        "interpolated": _interpolated_json(found),
        "imperfections": "of the scene" if found.drawn_from is None else f"drawn with seed {found.drawn_from}",
        "provenance": provenance(found.spindle),
    }


def _interpolated_json(found: ResonanceMap) -> dict[str, Any] | None:
    """How many coincidences are interpolated between grid points, and the errors where others were
    found both ways; None where all are exact."""
    i = found.interpolated
    if i is None:
        return None
    return {
        "coincidences": i.crossings,
        "checked": i.checked,
        "largest_frequency_error": i.frequency_error,
        "median_strength_error": i.strength_error,
        "largest_strength_error": i.largest_strength_error,
    }


def _coincidence_json(c: Coincidence) -> dict[str, Any]:
    return {
        "line": c.line.name,
        "mode": c.mode.number,
        "temperature_C": c.condition.temperature,
        "speed_rpm": in_rpm(c.condition.speed),
        "frequency_Hz": c.frequency,
        "mode_frequency_Hz": c.mode_frequency,
        "bearing": c.line.bearing,
        "cause": c.line.cause,
        "order": c.line.order,
        "direction": c.line.direction,
        "line_whirl": {1: "forward", -1: "backward", 0: "none"}[c.line.whirl],
        "mode_kind": c.mode.kind,
        "mode_whirl": c.mode.whirl,
        "sense": c.sense,
        "strength_um": 1e6 * c.strength,
        "strength_um_per_unit": 1e6 * c.unit_strength,
        "unit": None if c.line.cause == VARYING else "g mm" if c.line.cause in ("unbalance", "cage unbalance") else "um",
        "margin_percent": 100 * c.margin,
        "nrro_um": 1e6 * c.nrro,
        "at_nominal_speed": c.at_nominal_speed,
        "interpolated": c.interpolated,
    }


def _runout_json(along: Array, name: str, told: Callable[[float], float]) -> dict[str, list[float]]:
    place, radial, axial = along.T
    return {name: [told(x) for x in place], "radial": (1e6 * radial).tolist(), "axial": (1e6 * axial).tolist()}


def mapped(found: ResonanceMap) -> str:
    """Which temperatures and speeds the map has, in a sentence."""
    temperatures, speeds = _spoken(found.temperatures, "temperature", "C"), _spoken(found.speeds / RPM, "speed", "rpm")
    return f"Mapped at {temperatures}, and at {speeds}; the nominal {found.nominal.temperature:g} C and {found.nominal.speed / RPM:g} rpm are always among them."


def _spoken(values: Array, name: str, unit: str) -> str:
    """All of a few values, of many their number and ends."""
    if len(values) > FEW:
        return f"{len(values)} {name}s from {values[0]:g} to {values[-1]:g} {unit}"
    if len(values) == 1:
        return f"one {name}, {values[0]:g} {unit}"
    return f"{len(values)} {name}s, {', '.join(f'{v:g}' for v in values[:-1])} and {values[-1]:g} {unit}"


def sentences(found: ResonanceMap) -> list[str]:
    """One sentence for every line that crosses a mode at the nominal speed, strongest first; else that none does, and the nearest."""
    rpm = f"{found.nominal.speed / RPM:g} rpm"
    crossed = [c for c in found.coincidences if c.at_nominal_speed]
    if not crossed:
        apart = nearest(found.coincidences)
        near = f"; nearest is {_line(apart)}, {100 * apart.margin:+z.{2 if abs(apart.margin) < 1e-3 else 1}f} % from {_mode(apart)}{_width(apart)}" if apart else ""
        return [f"This spindle at {rpm} crosses no line {_between(found)}{near}."]
    said = []
    for alike in _same_line(crossed):
        c = alike[0]
        meets = f"This spindle at {rpm} crosses {_line(c, [a.line.bearing for a in alike])} at {c.condition.temperature:.1f} C with {_mode(c)} at {c.frequency:.1f} Hz"
        said.append(f"{meets}; {_repeatable(found, alike) if c.repeats else _nonrepeatable(found, c)}.")
    return said


def _width(c: Coincidence) -> str:
    """That a line is within the half-power width of its mode, which it excites there as if it met it."""
    ratio = c.mode.damping_ratio
    return f", within its half-power width of +-{100 * ratio:.2g} %, where it is excited nearly as at a crossing" if abs(c.margin) <= ratio else ""


def _between(found: ResonanceMap) -> str:
    """The temperatures of the map, in words."""
    low, high = found.temperatures[0], found.temperatures[-1]
    return f"between {low:g} and {high:g} C" if low < high else f"at {low:g} C"


def _same_line(crossed: Sequence[Coincidence]) -> list[list[Coincidence]]:
    """Crossings, those of one wave in several bearings that repeats every revolution together: at
    one frequency they are one line of the spectrum."""
    groups: dict[tuple[Any, ...], list[Coincidence]] = {}
    for c in crossed:
        alike = (*key(c.line)[1:], c.mode.number, round(c.condition.temperature, 1)) if c.line.bearing and c.repeats else (id(c), len(groups))
        groups.setdefault(alike, []).append(c)
    return list(groups.values())


def _repeatable(found: ResonanceMap, alike: Sequence[Coincidence]) -> str:
    """Runout of a line at a whole multiple of the speed, of several bearings their sum, which no phases make larger."""
    if not any(c.strength for c in alike):
        return "it repeats every revolution (RRO), and no imperfection here makes it: runout stays as it is"
    which = {key(c.line) for c in alike}
    before = sum(t.amplitude for t in found.lines if key(t.line) in which)
    most = "at most " if len(alike) > 1 else ""
    there = f"{most}{1e9 * sum(c.strength for c in alike):.1f} nm zero to peak there, of that mode alone"
    return f"it repeats every revolution (RRO), and the runout in it is {there}, and {most}{1e9 * before:.1f} nm at {found.nominal.temperature:g} C"


def _nonrepeatable(found: ResonanceMap, c: Coincidence) -> str:
    start = int(np.argmin(np.abs(found.nrro_temperature[:, 0] - found.nominal.temperature)))
    before = found.nrro_temperature[start, 2 if c.line.direction == "axial" else 1]
    return f"{c.line.direction} NRRO (nonrepeatable runout) is {1e9 * c.nrro:.1f} nm rms there and {1e9 * before:.1f} nm at {found.nominal.temperature:g} C"


def told(found: ResonanceMap) -> list[str]:
    """What a reader is told of `sentences`: the first `SAID`, and how many more there are."""
    every, alone = sentences(found), [_all_repeats(found)] if found.repeats else []
    left = len(every) - SAID
    many = f"So do {left} weaker lines {_between(found)}; all are in coincidences.csv of spindle map --out, and in its --json."
    return [*(every if left <= 1 else [*every[:SAID], many]), *nearby(found), *alone]


def nearby(found: ResonanceMap) -> list[str]:
    """One sentence of what is met just beyond the speeds of the map, of what its imperfections
    excite if they excite any; none where nothing is."""
    every = strongest([c for c in found.beyond if c.strength > 0] or found.beyond)
    if not every:
        return []
    told = [f"{_line(c)} meets {_mode(c)} at {c.condition.speed / RPM:.0f} rpm and {c.frequency:.1f} Hz" for c in every[:FEW]]
    more = [f"so do {len(every) - FEW} weaker lines"] if len(every) > FEW else []
    return [f"Just beyond the mapped speeds, less than {NEARBY:.0%} away, at {found.nominal.temperature:g} C: {'; '.join([*told, *more])}."]


def _all_repeats(found: ResonanceMap) -> str:
    why = "" if found.spindle.bearings or found.spindle.roller_bearings else " (bearings given by numbers roll no balls)"
    return f"All runout of this map repeats every revolution{why}, so there is no figure of nonrepeatable runout (NRRO)."


def _line(c: Coincidence, bearings: Sequence[str] = ()) -> str:
    return _named(c.line, bearings)


def _named(line: Line, bearings: Sequence[str] = ()) -> str:
    order = f" of order {line.order}" if line.order else ""
    names = [*dict.fromkeys(bearings)] or [line.bearing]
    where = f" of the {listed(names)} bearing{'s' * (len(names) > 1)}" if names[0] else ""
    return f"{line.name} ({line.cause}{order}{where})"


def _mode(c: Coincidence) -> str:
    whirl = "" if c.mode.whirl == "none" else f", {c.mode.whirl}"
    return f"mode {c.mode.number} ({c.mode.kind}{whirl})"


def show_map(console: Console, found: ResonanceMap) -> None:
    for said in [*told(found), mapped(found)]:
        console.print(said, highlight=False)
    if not found.coincidences:
        console.print(on_the_map(found), highlight=False)
        return
    console.print()
    title = f"Coincidences {_between(found)}, {found.speeds[0] / RPM:g} to {found.speeds[-1] / RPM:g} rpm, strongest first"
    columns = ("line", "wave", "bearing", "mode", "T\nC", "speed\nrpm", "f\nHz", "strong\nnm", "NRRO\nnm rms", "margin\n%")
    show_grid(console, title, columns, [_cells(c) for c in strongest(found.coincidences)[:SHOWN]], columns[:4], keys=4)
    console.print(
        f"{len(found.coincidences)} in all. Strength: amplitude of the mode at the {looked_at(found.spindle)} under {_whose(found)}. "
        f"NRRO: of all lines there, - where the line repeats every revolution and NRRO leaves it out. "
        f"Margin: of the line from the mode at {found.nominal.temperature:g} C, {found.nominal.speed / RPM:g} rpm. {OF_LINES}; fw, bw: a mode that whirls forward, backward.",
        highlight=False,
    )
    if found.interpolated:
        i = found.interpolated
        console.print(
            f"{i.crossings} of them, the weaker ones, are interpolated between grid points. How good that is, the {i.checked} strongest tell, which are exact and were "
            f"interpolated too: frequencies are off by {100 * i.frequency_error:.2g} % at most, strengths by {100 * i.largest_strength_error:.2g} %.",
            highlight=False,
        )


def on_the_map(found: ResonanceMap) -> str:
    """What stands in place of a table of coincidences where there are none."""
    names = [*dict.fromkeys(_named(t.line) for t in found.lines)]
    return f"Lines on the map: {listed(names) or 'none'}; of {_whose(found)}."


def _whose(found: ResonanceMap) -> str:
    return "the scene's imperfections" if found.drawn_from is None else f"plausible imperfections (seed {found.drawn_from}; the scene names none)"


def _cells(c: Coincidence) -> list[str]:
    cause = c.line.cause.replace("waviness", str(c.line.order)) if c.line.order else c.line.cause
    mode = f"{c.mode.number} {c.mode.kind}" + {"none": "", "forward": " fw", "backward": " bw", "mixed": " mixed"}[c.mode.whirl]
    numbers = (
        f"{c.condition.temperature:.1f}",
        f"{c.condition.speed / RPM:.0f}",
        f"{c.frequency:.1f}",
        f"{1e9 * c.strength:.1f}",
        "-" if c.repeats else f"{1e9 * c.nrro:.1f}",
        f"{100 * c.margin:+z.1f}",
    )
    return [c.line.name, cause, c.line.bearing, mode, *numbers]


def write_map(found: ResonanceMap, folder: Path) -> None:
    """`coincidences.csv`, `modes.csv` over the grid, and the figures."""
    about = ", ".join(f"{k} {v}" for k, v in provenance(found.spindle).items())
    coincidences = [_coincidence_json(c) for c in found.coincidences]
    names = list(coincidences[0]) if coincidences else ["line", "mode", "temperature_C", "speed_rpm", "frequency_Hz"]
    write_csv(folder / "coincidences.csv", names, (row.values() for row in coincidences), about)
    grid = [
        [float(v) for v in (t, in_rpm(s), *(m.frequency[i, j] for m in found.modes))]
        for i, t in enumerate(found.temperatures)
        for j, s in enumerate(found.speeds)
    ]
    write_csv(folder / "modes.csv", ["temperature_C", "speed_rpm", *(f"mode {m.number} {m.kind}_Hz" for m in found.modes)], grid, about)
    from thermospindle.report.figures.common import save_all  # matplotlib takes its time to load
    from thermospindle.report.figures.resonance import figures

    save_all(figures(found), folder)


def map_section(found: ResonanceMap) -> tuple[str, str]:
    """Title and HTML of a report section."""
    met = strongest(found.coincidences)[:SHOWN]
    said = "".join(f"<p>{prose(s)}</p>" for s in [*told(found), mapped(found), *([] if met else [on_the_map(found)])])
    head = ("line", "wave and order", "bearing", "mode", "°C", "rpm", "Hz", "strength, nm", "NRRO (nonrepeatable runout), nm rms", "margin, %")
    grid = table(head, [[prose(cell) for cell in _cells(c)] for c in met], range(4)) if met else ""
    from thermospindle.report.figures.common import svg
    from thermospindle.report.figures.resonance import figures

    drawn = figures(found)
    captions = {
        "campbell": "Campbell diagram: natural frequencies and lines over speed.",
        "temperature": "The same over temperature at the nominal speed.",
        "coincidences": "Where lines meet modes, over both.",
        "nrro": "Nonrepeatable runout along temperature and speed, linear response.",
    }
    return "Resonance map", said + grid + "".join(figure(svg(drawn[k], f"map-{k}", k), caption) for k, caption in captions.items() if k in drawn)
