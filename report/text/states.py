"""What `table`, `modes` and `static` say: states of equilibrium as JSON, in the terminal and as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.model.bearing.pressure import OF_BALLS, OF_ROLLERS
from thermospindle.model.bearing.state import ALIKE
from thermospindle.model.errors import listed
from thermospindle.model.files.stiffness_table import BETWEEN, FURTHER, PRESSURE, StiffnessTable
from thermospindle.model.rotor.modes import Mode, group_energy, to_real
from thermospindle.model.rotor.static import Around, Static
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, in_rpm
from thermospindle.report.text.grid import show_grid
from thermospindle.report.typeset import write_csv
from thermospindle.sim.operating import OperatingPoint

JSON_COLUMNS = (
    "contact_angle_deg",
    "outer_contact_angle_deg",
    "deformation_um",
    "contact_force_N",
    "ball_stiffness_N_per_m",
    "preload_N",
    "radial_stiffness_N_per_m",
    "axial_stiffness_N_per_m",
    "tilt_stiffness_N_m_per_rad",
    "coupling_stiffness_N_per_rad",
)


# ---------------------------------------------------------------- tables of bearings, and modes


def table_json(table: StiffnessTable) -> dict[str, Any]:
    """Lists over temperature at the first speed; with several speeds each entry of `speeds` holds its own."""

    def at(speed: int) -> dict[str, Any]:
        columns = [*JSON_COLUMNS, *FURTHER]
        return {name: {c: [None if np.isnan(x) else x for x in v[c][:, speed].tolist()] for c in columns if c in v} for name, v in table.values.items()}

    answer = {"temperature_C": table.temperature.tolist(), "bearings": at(0), "unloads_C": dict(table.unloads), "loose": {name: table.loose(name) or None for name in table.unloads}}
    if len(table.speed) > 1:
        answer["speeds"] = [{"speed_rpm": in_rpm(s), "bearings": at(i)} for i, s in enumerate(table.speed.tolist())]
    return answer | {"provenance": dict(table.provenance)}


def modes_json(point: OperatingPoint, highest: float) -> dict[str, Any]:
    return {
        "temperature_C": point.condition.temperature,
        "speed_rpm": in_rpm(point.condition.speed),
        "status": point.state.status,
        "modes": [_mode_json(point, m) for m in point.modes_below(highest)],
    }


def _mode_json(point: OperatingPoint, mode: Mode) -> dict[str, Any]:
    return {
        "frequency_Hz": mode.frequency,
        "damping_ratio": mode.damping_ratio,
        "kind": mode.kind,
        "whirl": mode.whirl,
        "energy": group_energy(point.chain, mode),
        "energy_by_element": dict(mode.energy),
        "shape": _shape_json(point, mode),
    }


def _shape_json(point: OperatingPoint, mode: Mode) -> list[dict[str, Any]]:
    """The shape at the measuring points in their directions, as FRFs show it: largest 1, turned so
    that what moves in phase is real; nothing where no point moves."""
    seen = point.measurement.response_rows @ mode.shape
    seen = seen * to_real(seen)
    seen = seen / (seen[np.argmax(np.abs(seen.real))].real or 1.0) if len(seen) else seen
    return [{"node": p.node, "name": p.name, "real": float(v.real), "imaginary": float(v.imag)} for p, v in zip(point.spindle.points, seen, strict=True)]


def write_modes(point: OperatingPoint, folder: Path) -> None:
    """`modes.csv` and the MuJoCo model `spindle.xml` of one operating point."""
    (folder / "spindle.xml").write_text(point.xml(looks=True), encoding="utf-8")
    write_modes_csv([point], folder / "modes.csv")


def write_modes_csv(points: list[OperatingPoint], path: Path) -> None:
    elements = [e.name for e in points[0].chain.elements]
    head = ["temperature_C", "speed_rpm", "mode", "kind", "whirl", "frequency_Hz", "damping_ratio", *(f"energy_share_{name}" for name in elements)]
    rows = [
        [p.condition.temperature, in_rpm(p.condition.speed), i, m.kind, m.whirl, m.frequency, m.damping_ratio, *(m.energy[e] for e in elements)]
        for p in points
        for i, m in enumerate(p.modes, 1)
    ]
    write_csv(path, head, rows)


def _changes(value: Array) -> bool:
    """Whether a column of a bearing has more than one value, or is unknown somewhere, over the conditions."""
    known = np.isfinite(value)
    return bool(known.any() and not (known.all() and np.ptp(value) == 0.0))


def show_table(console: Console, table: StiffnessTable, radial_load: bool = False) -> None:
    """Bearings by condition. At speed, where heavy balls have two angles and forces, angle and force are
    called those of the inner contact; under a `radial_load` the force is called the largest of the balls."""
    if not table.values:
        console.print("The scene has no bearings.")
        return
    contact = "inner" if table.speed.any() else "contact"
    angle = "inner\nangle\ndeg" if table.speed.any() else "angle\ndeg"
    force = "\n".join([*(["largest"] if radial_load else []), contact, "force", "N"])
    told_apart = any(_apart(values) for values in table.values.values())
    shown = [
        ("contact_angle_deg", angle, 1, 2), ("deformation_um", "deform.\num", 1, 3), ("clearance_um", "clear-\nance\num", 1, 2),
        ("contact_force_N", force, 1, 3), ("ball_stiffness_N_per_m", "of a ball\nN/um", 1e-6, 3), ("preload_N", "preload\nN", 1, 2),
        ("radial_stiffness_N_per_m", "radial x\nN/um" if told_apart else "radial\nN/um", 1e-6, 2), ("radial_stiffness_y_N_per_m", "radial y\nN/um", 1e-6, 2), ("axial_stiffness_N_per_m", "axial\nN/um", 1e-6, 3),
    ]  # fmt: skip
    shown = [row for row in shown if all(row[0] in values for values in table.values.values()) and (told_apart or row[0] != "radial_stiffness_y_N_per_m")]
    shown = [row for row in shown if any(np.isfinite(values[row[0]]).any() for values in table.values.values())]
    constant = table.temperature.size * table.speed.size > 1 and not any(_changes(values[row[0]]) for values in table.values.values() for row in shown)
    columns, rows = ["T\nC", "speed\nrpm", "bearing", *(head for _, head, _, _ in shown)], []
    for i, temperature in enumerate(table.temperature[:1] if constant else table.temperature):
        for j, speed in enumerate(table.speed[:1] if constant else table.speed):
            for name, values in table.values.items():
                row = ["" if np.isnan(values[c][i, j]) else f"{values[c][i, j] * scale:.{digits}f}" for c, _, scale, digits in shown]
                rows.append([f"{temperature:g}", f"{speed / RPM:g}", name, *row])
    show_grid(console, "Bearing state", columns, rows, ("bearing",), keys=3)
    if constant:
        console.print("The same at every temperature and speed asked for.")
    rows_of_balls = any("contact_angle_deg" in values and np.isfinite(values["contact_angle_deg"]).any() for values in table.values.values())
    if table.speed.any() and rows_of_balls:
        console.print("Inner angle and force: of the contact with the inner ring; those of the outer one are in table.csv of --out.")
    if radial_load and rows_of_balls:
        console.print("Under the radial load deformation, force and stiffness of a ball are those of the most loaded ball; the angle is the mean of all, weighted with their force.")
    if any(column in values for values in table.values.values() for column in BETWEEN):
        console.print("Stiffness between these directions, as k_xz, is in table.csv of --out.")
    if pressed := _pressed(table):
        console.print(pressed, highlight=False)
    for name in table.unloads:
        if loose := _loose(table, name):
            console.print(loose)


def _loose(table: StiffnessTable, name: str) -> str:
    """Where a bearing has no contact, in words; empty where it has contact everywhere."""
    where, loose, low, high = table.unloads[name], table.loose(name), table.temperature[0], table.temperature[-1]
    speed = f" at {table.speed[0] / RPM:g} rpm" if len(table.speed) > 1 else ""
    if loose == "throughout":
        return f"{name} bearing has no contact at {f'{low:g} C' if low == high else f'any of {low:g} to {high:g} C'}{speed}; where it has was not asked"
    again = table.contact(name)[-1] == (loose == "above")
    end = f"; at {high:g} C it has {'it again' if loose == 'above' else 'none either'}" if again else ""
    return f"{name} bearing {'loses contact at' if loose == 'above' else 'has no contact below'} {where:.2f} C{speed}{end}" if loose else ""


def _apart(values: Mapping[str, Array]) -> bool:
    """Whether a bearing's stiffness along y is another than along x, by more than nobody sees."""
    if "radial_stiffness_y_N_per_m" not in values:
        return False
    x, y, xy = (values[f"radial_stiffness{way}_N_per_m"] for way in ("", "_y", "_xy"))
    return bool((np.maximum(abs(x - y), abs(xy)) > ALIKE * np.maximum(x, y)).any())


def _pressed(table: StiffnessTable) -> str:
    """In one sentence the largest contact pressure of every bearing, and what bearings are rated by; empty where none has rolling elements."""
    most = {name: float(np.nanmax(values[PRESSURE])) for name, values in table.values.items() if PRESSURE in values and np.isfinite(values[PRESSURE]).any()}
    if not most:
        return ""
    limits = [
        f"{limit / 1e6:.0f} MPa for {kind}"
        for kind, limit, own in (("ball bearings", OF_BALLS, "contact_angle_deg"), ("roller bearings", OF_ROLLERS, "clearance_um"))
        if any(own in values and np.isfinite(values[own]).any() for values in table.values.values())
    ]
    return f"Largest contact pressure (Hertz): {', '.join(f'{name} {p:.0f}' for name, p in most.items())} MPa; the static limit of ISO 76 is {' and '.join(limits)}."


def show_told_table(console: Console, table: StiffnessTable, radial_load: bool = False) -> None:
    """In one sentence how far each bearing's preload and radial stiffness go, then the table."""
    ends = [f"{name} {said}" for name, values in table.values.items() if (said := _range_of(table, values))]
    if ends:
        span = f"From {table.temperature[0]:g} to {table.temperature[-1]:g} C" if len(table.temperature) > 1 else f"At {table.temperature[0]:g} C"
        rpm = f" at {table.speed[0] / RPM:g} rpm" if len(table.speed) == 1 else f" and {table.speed[0] / RPM:g} to {table.speed[-1] / RPM:g} rpm"
        console.print(f"{span}{rpm}: {'; '.join(ends)}.\n", highlight=False, markup=False)
    show_table(console, table, radial_load)


def _range_of(table: StiffnessTable, values: Mapping[str, Array]) -> str:
    """From the first condition to the last, of what the bearing has, and the least and the most
    where they lie between; empty where its table tells neither."""
    told = []
    apart = _apart(values)
    for column, words, unit, scale in (
        ("preload_N", "preload", "N", 1.0),
        ("radial_stiffness_N_per_m", f"radial stiffness{' along x' if apart else ''}", "N/um", 1e-6),
        *([("radial_stiffness_y_N_per_m", "along y", "N/um", 1e-6)] if apart else []),
    ):
        if column in values and np.all(np.isfinite(ends := values[column][[0, -1], [0, -1]] * scale)):
            first, last = (f"{x:.2f}" for x in ends)
            told.append((f"{words} {first} {unit}" if first == last else f"{words} {first} to {last} {unit}") + _between(table, values[column] * scale))
    return ", ".join(told)


def _between(table: StiffnessTable, values: Array) -> str:
    """The least and the most of values (T, S) that their first and last do not show, and where, in brackets."""
    first, last = sorted(values[[0, -1], [0, -1]])
    found = []
    for word, at, beyond in (("least", np.nanargmin(values), lambda x: x < first), ("most", np.nanargmax(values), lambda x: x > last)):
        i, j = np.unravel_index(at, values.shape)
        if beyond(round(values[i, j], 2)) and f"{values[i, j]:.2f}" not in (f"{first:.2f}", f"{last:.2f}"):
            where = [*([f"{table.temperature[i]:g} C"] if len(table.temperature) > 1 else []), *([f"{table.speed[j] / RPM:g} rpm"] if len(table.speed) > 1 else [])]
            found.append(f"{word} {values[i, j]:.2f} at {listed(where)}")
    return f" ({', '.join(found)})" if found else ""


def show_modes(console: Console, answer: dict[str, Any], point: OperatingPoint, highest: float) -> None:
    """A table of the modes below `highest` (Hz), or in a sentence that there are none, and where the lowest is."""
    if not answer["modes"]:
        lowest = f"the lowest is at {point.modes[0].frequency:.2f} Hz" if point.modes else "nothing here oscillates"
        console.print(f"No mode lies below {highest:g} Hz at {answer['temperature_C']:g} C, {answer['speed_rpm']:g} rpm; {lowest}.", highlight=False)
        return
    groups = list(answer["modes"][0]["energy"])
    title = f"Modes at {answer['temperature_C']:g} C, {answer['speed_rpm']:g} rpm ({point.state.of_bearings})"
    columns = ("mode", "f\nHz", "damping\n%", "kind", "whirl", *(f"{g}\n%" for g in groups))
    rows = []
    for i, m in enumerate(answer["modes"], 1):
        shares = [f"{100 * m['energy'][g]:.1f}" for g in groups]
        rows.append([str(i), f"{m['frequency_Hz']:.2f}", f"{100 * m['damping_ratio']:z.3f}", m["kind"], m["whirl"], *shares])
    show_grid(console, title, columns, rows, ("kind", "whirl"), keys=2)
    console.print("The last columns share each mode's strain energy between the element groups.")


# ---------------------------------------------------------------- a unit force

SPRINGS = "bearings"
"""Share of the compliance in what is of the bearings and is none of them: the springs of preloads."""


def static_json(answers: Sequence[Around], bearings: str, beam: str) -> dict[str, Any]:
    """By point: stiffness (None where nothing holds it), reactions and shares of the compliance;
    the same `axial`, and `across` where the point measures across the axis."""
    points = {a.own.point.name: _static_json(a.own) | {"axial": _static_json(a.axial), "across": a.across and _static_json(a.across)} for a in answers}
    return {"bearings": bearings, "beam": beam, "points": points}


def _static_json(answer: Static) -> dict[str, Any]:
    return {
        "direction": answer.point.axis,
        "stiffness_N_per_m": answer.stiffness if 0 < answer.stiffness < float("inf") else None,
        "free": answer.stiffness == 0.0,
        "reactions_N": dict(answer.reactions),
        "compliance_shares": dict(answer.shares),
    }


def show_static(console: Console, values: dict[str, Any], answers: Sequence[Around]) -> None:
    """A table of stiffness and bearing reactions, and one of where the compliance of each point sits."""
    points = values["points"]
    rows = _told(values, answers)
    reactions, parts = (list(dict.fromkeys(name for row in points.values() for name in row[key])) for key in ("reactions_N", "compliance_shares"))
    told = f"bearings {values['bearings']}" + (f", beam {values['beam']}" if values["beam"] != "none" else "")
    show_grid(
        console,
        f"Stiffness at each point, and the reaction of every bearing to 1 N there ({told})",
        ["point", "along", "stiffness\nN/um", *(f"{name}\nN" for name in reactions)],
        [[name, along, _stiffness(row), *("-" if row["free"] else f"{row['reactions_N'].get(b, 0.0):+z.4f}" for b in reactions)] for name, along, row in rows],
        words=("point", "along"),
    )
    if any(along == "axis" for _, along, _ in rows):
        console.print("axis: a force along it, on the axis at the point's height.")
    if values["bearings"] == "rated":
        console.print("rated: bearings are springs of the stiffness that they are rated at, to rigid ground; --bearings computed has them as they are loaded, and what they stand in.")
    if not parts:
        return  # every point is free to move
    shares = {part: [f"{100 * row['compliance_shares'].get(part, 0.0):z.1f}" for row in points.values()] for part in parts}
    if set(shares.get(SPRINGS, ())) == {"0.0"}:  # preload springs, which act along the axis alone
        del shares[SPRINGS]
    console.print()
    show_grid(
        console,
        "Share of the compliance at each point in every part, %",
        ["point", *(f"{'preload springs' if part == SPRINGS else part}\n%" for part in shares)],
        [[name, *("-" if row["free"] else share[i] for share in shares.values())] for i, (name, row) in enumerate(points.items())],
        words=("point",),
    )


def _told(values: dict[str, Any], answers: Sequence[Around]) -> list[tuple[str, str, dict[str, Any]]]:
    """Name, direction and answer of the rows shown: every point's own, then, each place once, the
    axis and what differs the other way across it, where it can move so."""

    def place(of: Static) -> tuple[object, ...]:
        x, y, z = of.point.position
        return (of.point.body, z, *((x, y) if of.point.axis[1] == "Z" else of.point.axis[1]))

    known, rows = {place(a.own) for a in answers}, []
    for a in answers:
        name = a.own.point.name
        row = values["points"][name]
        rows.append((name, row["direction"], row))
        if a.across and not a.alike and np.isfinite(a.across.stiffness) and place(a.across) not in known:
            rows.append((name, row["across"]["direction"], row["across"]))
        if np.isfinite(a.axial.stiffness) and place(a.axial) not in known:
            rows.append((name, "axis", row["axial"]))
        known |= {place(found) for found in (a.across, a.axial) if found}
    return rows


def _stiffness(row: dict[str, Any]) -> str:
    if row["free"]:
        return "free to move"
    return "rigid" if row["stiffness_N_per_m"] is None else f"{row['stiffness_N_per_m'] / 1e6:.6g}"
