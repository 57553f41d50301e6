"""What the command line says: the JSON objects, the terminal tables, and the files of a run's folder."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from model import mjcf
from model.modes import Mode, group_energy
from model.table import StiffnessTable, write_table
from sim.campaign import Campaign, write_campaign
from sim.log import LogContents, write_log
from sim.mode_numbers import measured_rows, numbered
from sim.operating import OperatingPoint, provenance, stiffness_table
from sim.report import write_report
from sim.run import Run, Step, as_campaign
from sim.shift import match

RPM = 2 * np.pi / 60

JSON_COLUMNS = (
    "contact_angle_deg",
    "deformation_um",
    "contact_force_N",
    "ball_stiffness_N_per_m",
    "preload_N",
    "radial_stiffness_N_per_m",
    "axial_stiffness_N_per_m",
    "tilt_stiffness_N_m_per_rad",
    "coupling_stiffness_N_per_rad",
)


# ---------------------------------------------------------------- JSON


def table_json(table: StiffnessTable) -> dict[str, Any]:
    """Lists over temperature at the first speed; with several speeds each entry of `speeds` holds its own."""

    def at(speed: int) -> dict[str, Any]:
        return {name: {c: v[c][:, speed].tolist() for c in JSON_COLUMNS} for name, v in table.values.items()}

    answer = {"temperature_C": table.temperature.tolist(), "bearings": at(0), "unloads_C": dict(table.unloads)}
    if len(table.speed) > 1:
        answer["speeds"] = [{"speed_rpm": s / RPM, "bearings": at(i)} for i, s in enumerate(table.speed.tolist())]
    return answer | {"provenance": dict(table.provenance)}


def modes_json(point: OperatingPoint, highest: float) -> dict[str, Any]:
    return {
        "temperature_C": point.condition.temperature,
        "speed_rpm": point.condition.speed / RPM,
        "status": point.state.status,
        "modes": [_mode_json(point, m) for m in point.modes if m.frequency <= highest],
    }


def _mode_json(point: OperatingPoint, mode: Mode) -> dict[str, Any]:
    return {
        "frequency_Hz": mode.frequency,
        "damping_ratio": mode.damping_ratio,
        "kind": mode.kind,
        "whirl": mode.whirl,
        "energy": group_energy(point.chain, mode),
        "energy_by_element": dict(mode.energy),
    }


def impact_json(step: Step) -> dict[str, Any]:
    m = step.identified
    rows = zip(m.frequency, m.frequency_sd, m.damping, m.damping_sd, strict=True)
    keys = ("frequency_Hz", "frequency_sd_Hz", "damping_ratio", "damping_ratio_sd")
    return {
        "temperature_C": step.point.condition.temperature,
        "speed_rpm": step.point.condition.speed / RPM,
        "modes": [dict(zip(keys, map(float, row), strict=True)) for row in rows],
    }


def run_json(run: Run) -> dict[str, Any]:
    highest = run.spindle.hammer.band[1]
    return {
        "provenance": provenance(run.spindle),
        "conditions": [modes_json(s.point, highest) | {"identified": impact_json(s)["modes"]} for s in run.steps],
    }


def log_json(contents: LogContents) -> dict[str, Any]:
    """What a log holds, with its FRFs as nested lists [response][reference][line]."""
    return {
        "scene": contents.scene,
        "temperatures_C": list(contents.temperatures),
        "entities": list(contents.entities),
        "frfs": {
            test: {
                "frequency_Hz": frf.frequency.tolist(),
                "response_nodes": list(frf.response_nodes),
                "reference_nodes": list(frf.reference_nodes),
                "quantity": frf.quantity,
                "real": frf.value.real.tolist(),
                "imag": frf.value.imag.tolist(),
            }
            for test, frf in contents.frfs.items()
        },
    }


# ---------------------------------------------------------------- files


def campaign_of(run: Run) -> Campaign:
    return as_campaign(run, f"virtual tests of {run.spindle.title}"[:80])


def write_campaign_of(run: Run, folder: Path) -> None:
    write_campaign(campaign_of(run), folder)


def write_modes(point: OperatingPoint, folder: Path) -> None:
    """`modes.csv` and the MuJoCo model `spindle.xml` of one operating point."""
    (folder / "spindle.xml").write_text(mjcf.xml(point.spec(looks=True)), encoding="utf-8")
    _write_modes_csv([point], folder / "modes.csv")


def _write_modes_csv(points: list[OperatingPoint], path: Path) -> None:
    elements = [e.name for e in points[0].chain.elements]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        shares = [f"energy_share_{name}" for name in elements]
        writer.writerow(["temperature_C", "speed_rpm", "mode", "kind", "whirl", "frequency_Hz", "damping_ratio", *shares])
        for point in points:
            for i, m in enumerate(point.modes, 1):
                where = (point.condition.temperature, point.condition.speed / RPM)
                energy = [m.energy[name] for name in elements]
                writer.writerow([*where, i, m.kind, m.whirl, m.frequency, m.damping_ratio, *energy])


def write_run(run: Run, folder: Path, progress: Callable[[str], None]) -> None:
    """Everything a run leaves behind: tables, model, campaign, report, Rerun log."""
    temperatures = [s.point.condition.temperature for s in run.steps]
    write_table(stiffness_table(run.spindle, temperatures, [run.steps[0].point.condition.speed]), folder / "table.csv")
    points = [s.point for s in run.steps]
    _write_modes_csv(points, folder / "modes.csv")
    for point in points:
        name = f"spindle_{point.condition.temperature:g}C.xml"
        (folder / name).write_text(mjcf.xml(point.spec(looks=True)), encoding="utf-8")
    progress("tables and MuJoCo models written")
    write_campaign_of(run, folder / "campaign")
    progress("campaign written")
    write_report(run, folder / "report.html")
    progress("report written")
    write_log(run, folder / "run.rrd")
    progress("Rerun log written")


def write_frf_tables(contents: LogContents, folder: Path) -> None:
    """One CSV a test: frequency and the real and imaginary part of every FRF."""
    for test, frf in contents.frfs.items():
        names = [f"H({i},{j})" for i in frf.response_nodes for j in frf.reference_nodes]
        with (folder / f"{test}.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["frequency_Hz", *(f"{part} {name} ({frf.quantity})" for name in names for part in ("re", "im"))])
            flat = frf.value.reshape(len(names), -1)
            for line, column in zip(frf.frequency, flat.T, strict=True):
                writer.writerow([repr(float(line)), *(repr(float(v)) for z in column for v in (z.real, z.imag))])
    (folder / "contents.json").write_text(json.dumps({"scene": contents.scene, "entities": list(contents.entities)}, indent=1))


# ---------------------------------------------------------------- terminal


def _grid(title: str, *columns: str) -> Table:
    grid = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for column in columns:
        words = column in ("bearing", "kind", "main\nflexibility", "whirl")
        grid.add_column(column, justify="left" if words else "right", no_wrap=True)
    return grid


def show_table(console: Console, table: StiffnessTable) -> None:
    grid = _grid(
        "Bearing state",
        "T\nC", "speed\nrpm", "bearing", "angle\ndeg", "deform.\num", "ball force\nN", "ball k\nN/um", "preload\nN", "k_RR\nN/um", "k_AA\nN/um",
    )  # fmt: skip
    scale = (1, 1, 1, 1e-6, 1, 1e-6, 1e-6)
    digits = (2, 3, 3, 3, 2, 2, 3)
    for i, temperature in enumerate(table.temperature):
        for j, speed in enumerate(table.speed):
            for name, values in table.values.items():
                cells = zip(JSON_COLUMNS, scale, digits, strict=False)
                row = [f"{values[c][i, j] * s:.{d}f}" for c, s, d in cells]
                grid.add_row(f"{temperature:g}", f"{speed / RPM:g}", name, *row)
    console.print(grid)
    for name, where in table.unloads.items():
        if where is not None:
            console.print(f"{name} bearing loses contact at {where:.2f} C")


def show_modes(console: Console, answer: dict[str, Any], point: OperatingPoint) -> None:
    groups = list(answer["modes"][0]["energy"]) if answer["modes"] else []
    grid = _grid(
        f"Modes at {answer['temperature_C']:g} C, {answer['speed_rpm']:g} rpm (bearings {answer['status']})",
        "mode", "f\nHz", "damping\n%", "kind", "whirl", *(f"{g}\n%" for g in groups),
    )  # fmt: skip
    for i, m in enumerate(answer["modes"], 1):
        shares = [f"{100 * m['energy'][g]:.1f}" for g in groups]
        grid.add_row(str(i), f"{m['frequency_Hz']:.2f}", f"{100 * m['damping_ratio']:.3f}", m["kind"], m["whirl"], *shares)
    console.print(grid)
    console.print("The last columns share each mode's strain energy between the element groups.")


def show_impact(console: Console, step: Step) -> None:
    condition = step.point.condition
    grid = _grid(
        f"Impact test at {condition.temperature:g} C, {condition.speed / RPM:g} rpm: identified modes beside the model's own",
        "f\nHz", "+-", "damping\n%", "+-", "model f\nHz", "model damping\n%",
    )  # fmt: skip
    m = step.identified
    pairs = match(step)
    for i, (f, sf, z, sz) in enumerate(zip(m.frequency, m.frequency_sd, m.damping, m.damping_sd, strict=True)):
        exact = pairs.get(i)
        own = ("-", "-") if exact is None else (f"{exact.frequency:.2f}", f"{100 * exact.damping_ratio:.3f}")
        grid.add_row(f"{f:.2f}", f"{sf:.2f}", f"{100 * z:.3f}", f"{100 * sz:.3f}", *own)
    console.print(grid)


def show_run(console: Console, run: Run, out: Path) -> None:
    temperatures = [s.point.condition.temperature for s in run.steps]
    show_table(console, stiffness_table(run.spindle, temperatures, [run.steps[0].point.condition.speed]))
    console.print()
    highest = run.spindle.hammer.band[1]
    numbers, beside = numbered(run), measured_rows(run)
    measured = [t for c in run.measured for t in c.tests if t.id in beside]
    own = _grid(
        "Natural frequencies of the model, Hz, and what was measured",
        "mode", "kind", "main\nflexibility", *(f"{t:g} C" for t in temperatures), "shift",
        *(f"measured\n{t.temperature:g} C" for t in measured),
    )  # fmt: skip
    peaks = _grid("Modal peaks of the virtual hammer test, Hz +- standard error", "mode", *(f"{t:g} C" for t in temperatures))
    first = run.steps[0].point
    for number, mode in enumerate((m for m in first.modes if m.frequency <= highest), 1):
        followed = [next((i for i, n in of_step.items() if n == number), None) for of_step in numbers]
        found = [None if i is None else step.point.modes[i] for i, step in zip(followed, run.steps, strict=True)]
        frequency = ["-" if m is None else f"{m.frequency:.1f}" for m in found]
        shift = "-" if found[-1] is None else f"{found[-1].frequency - mode.frequency:+.1f}"
        group = max(group_energy(first.chain, mode).items(), key=lambda item: item[1])[0]
        rows = [beside[t.id].get(number - 1) for t in measured]
        own.add_row(str(number), mode.kind, group, *frequency, shift, *(f"{row.frequency:.0f}" if row else "" for row in rows))
        seen = []
        for m, step in zip(found, run.steps, strict=True):
            k = next((k for k, v in match(step).items() if v is m), None)
            seen.append("-" if k is None else f"{step.identified.frequency[k]:.2f} +- {step.identified.frequency_sd[k]:.3f}")
        peaks.add_row(str(number), *seen)
    console.print(own)
    console.print()
    console.print(peaks)
    console.print(f"\n{out}: report.html, run.rrd, table.csv, modes.csv, spindle_*.xml, campaign/", highlight=False)
