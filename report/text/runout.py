"""What `spindle runout` says and writes: the JSON object, the terminal table, CSV files, figures, and a section for the report.

The repeatable part (RRO) is made of the lines at whole multiples of the turning frequency of the part
that is seen, the nonrepeatable one (NRRO) is the rest of the record; `averaged` holds the same values
with the RRO from averaging over the record's revolutions, which lets some of the other lines through.
"""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.model.bearing.pair import IN_CONTACT
from thermospindle.model.machine import Spindle
from thermospindle.model.units import TO_UM, in_rpm
from thermospindle.report.check.words import LEFT_OUT, NOTABLE
from thermospindle.report.text.grid import OF_LINES, grid, show_grid
from thermospindle.report.typeset import table, write_csv
from thermospindle.sim.operating import provenance
from thermospindle.sim.running.lines import FoundLine
from thermospindle.sim.running.probes import AXIAL, X, Y, looked_at
from thermospindle.sim.running.revolutions import ErrorMotion
from thermospindle.sim.running.rows import cage_spread
from thermospindle.sim.running.runout import Runout
from thermospindle.sim.running.waterfall import run_up, waterfall

STATISTICS = {
    "rro_um": "peak to valley of the repeatable part (lines that repeat every revolution of the part seen)",
    "nrro_um": "peak to valley of the nonrepeatable part over the whole record",
    "total_um": "peak to valley of the record",
    "rro_rms_um": "root mean square of the repeatable part about its mean",
    "nrro_rms_um": "root mean square of the nonrepeatable part",
    "nrro_6_sigma_um": "six standard deviations of the nonrepeatable part",
    "total_error_um": "total error motion, ISO 230-7 / ASME B89.3.4, fixed sensitive direction",
    "synchronous_error_um": "synchronous error motion, about the least-squares circle when radial",
    "asynchronous_error_um": "asynchronous error motion: widest band of all revolutions at one angle",
    "once_per_revolution_um": "part once per revolution, zero to peak",
}
NONREPEATABLE = ("nrro_um", "nrro_rms_um", "nrro_6_sigma_um", "asynchronous_error_um")
"""Unknown of a spindle whose bearings are all given by numbers: they roll no balls, and what is computed of it is 0."""
MAIN = {"radial": X, "radial_y": Y, "axial": AXIAL}
"""The probe each direction is quoted from, across the axis along x and along y; the others are under `probes`."""
SHOWN = 14  # lines in the terminal


def _quoted(m: ErrorMotion, rolls: bool) -> dict[str, float | None]:
    values = (
        m.repeatable, m.nonrepeatable, m.total, m.repeatable_rms, m.nonrepeatable_rms, m.six_sigma,
        m.total_error, m.synchronous_error, m.asynchronous_error, m.eccentricity,
    )  # fmt: skip
    return {name: TO_UM * v if rolls or name not in NONREPEATABLE else None for name, v in zip(STATISTICS, values, strict=True)}


def runout_json(runout: Runout, path: str, element: str, seed: int | None) -> dict[str, Any]:
    """The answer: values by direction, the lines strongest first, every probe, and how they were made."""
    rolls = bool(runout.point.spindle.rolling)
    quoted = {name: _quoted(m, rolls) for name, m in runout.values().items()}
    averaged = {name: _quoted(m, rolls) for name, m in runout.values(averaged=True).items()}
    leaked = dict(zip(quoted, (TO_UM * runout.leaked).tolist(), strict=True))
    condition = runout.point.condition
    time = runout.averaged.time
    return {
        "temperature_C": condition.temperature,
        "speed_rpm": in_rpm(condition.speed),
        "status": runout.point.state.status,
        "cage_spread": {b.name: cage_spread(b) for b in runout.point.state.rolling},
        "seconds": runout.averaged.count / abs(runout.revolving),
        "revolutions": runout.averaged.count,
        "samples_per_revolution": len(time) // runout.averaged.count,
        "seen_speed_rpm": in_rpm(condition.speed * runout.ratios[0]),
        "path": path,
        "element": element,
        "imperfections": "of the scene" if seed is None else f"drawn from seed {seed}",
        **{name: {d: quoted[probe][name] for d, probe in MAIN.items()} for name in STATISTICS},
        "averaged": {
            **{
                name: {d: averaged[probe][name] for d, probe in MAIN.items()} for name in ("rro_um", "nrro_um", "rro_rms_um", "nrro_rms_um")
            },
            "leakage_um": {d: leaked[probe] for d, probe in MAIN.items()},
        },
        "statistics": STATISTICS | {"leakage_um": "most by which other lines can have changed the averaged RRO, zero to peak"},
        "lines": [line_json(line) for line in runout.lines],
        "probes": {
            p.name: {"body": p.body, "position_mm": [1e3 * x for x in p.position], "direction": list(p.direction), "seen_speed_rpm": in_rpm(condition.speed * ratio), **quoted[p.name]}
            for p, ratio in zip(runout.signals.probes, runout.ratios, strict=True)
        },
        "provenance": provenance(runout.point.spindle),
    }


def line_json(line: FoundLine) -> dict[str, Any]:
    """One line; `cause` is that of the largest share, "unexplained" where theory has none."""
    first = line.causes[0] if line.causes else None
    return {
        "frequency_Hz": line.frequency,
        "order": line.order,
        "amplitude_um": TO_UM * line.amplitude,
        "direction": line.direction,
        "cause": first.cause if first else "unexplained",
        "bearing": first.bearing if first else "",
        "waviness_order": first.order if first else 0,
        "name": first.name if first else f"{line.order:.5g}x",
        "repeatable": line.repeatable,
        "whirl": line.whirl,
        "forward_um": TO_UM * line.forward,
        "backward_um": TO_UM * line.backward,
        "predicted_um": TO_UM * line.predicted,
        "causes": [
            {"bearing": c.bearing, "cause": c.cause, "order": c.order, "name": c.name, "amplitude_um": TO_UM * share}
            for c, share in zip(line.causes, line.shares, strict=True)
        ],
    }


# ---------------------------------------------------------------- terminal


def _of_contact(answer: dict[str, Any]) -> str:
    """The status of ball rows; it names those that have lost contact itself."""
    return "bearings in contact" if answer["status"] == IN_CONTACT else str(answer["status"])


def show_runout(console: Console, answer: dict[str, Any], spindle: Spindle) -> None:
    where = looked_at(spindle)
    nominal = f" ({answer['speed_from']})" if answer["speed_from"] != "--speed" else ""
    title = f"Runout at {answer['temperature_C']:g} C, {answer['speed_rpm']:g} rpm{nominal}, {answer['revolutions']} revolutions{_of_part(answer, where)}, um"
    title += f" ({_of_contact(answer)})" if spindle.bearings else ""
    quoted = grid(title, ("", f"radial\n({where} x)", f"radial\n({where} y)", "axial"), words=("",))
    for key, meaning in STATISTICS.items():
        quoted.add_row(meaning, *("-" if (value := answer[key][d]) is None else f"{value:.4f}" for d in MAIN))
    console.print(quoted)
    console.print()
    if not answer["lines"]:
        return
    columns = ("Hz", "orders of\nthe spindle" if _of_part(answer, where) else "orders", "direction", "um", "whirl", "line", "cause", "bearing")
    rows = []
    for row in answer["lines"][:SHOWN]:
        numbers = (f"{row['frequency_Hz']:.2f}", f"{row['order']:.3f}", row["direction"], f"{row['amplitude_um']:.4f}", row["whirl"])
        rows.append([*numbers, row["name"], row["cause"], _bearings(row)])
    show_grid(console, f"Strongest lines of {len(answer['lines'])}", columns, rows, (*columns[4:], "direction"), keys=2)
    if spindle.rolling:
        console.print(f"{OF_LINES}.", highlight=False)
    if changing := _changing(answer):
        console.print(changing, highlight=False)


def _changing(answer: dict[str, Any]) -> str:
    """Of which bearings stiffness changes as balls pass a load, in a sentence; empty where next to nothing does."""
    own = [f"{name} {100 * share:.2g} %" for name, share in answer["cage_spread"].items() if share > NOTABLE]
    return f"Stiffness across changes as balls pass the load: {', '.join(own)}. Lines are those of a constant one, and {LEFT_OUT}." if own else ""


def _bearings(row: dict[str, Any]) -> str:
    """All bearings that have a part in a line, strongest first."""
    return ", ".join(dict.fromkeys(c["bearing"] for c in row["causes"] if c["bearing"]))


def _of_part(answer: dict[str, Any], where: str) -> str:
    """Whose revolutions are counted, where that is not the spindle's."""
    seen, speed = answer["seen_speed_rpm"], answer["speed_rpm"]
    return "" if abs(seen) == abs(speed) else f" of the {where} (it turns at {seen:g} rpm)"


# ---------------------------------------------------------------- files


def write_runout(runout: Runout, spindle: Spindle, answer: dict[str, Any], folder: Path, progress: Callable[[str], None]) -> None:
    """`record.csv`, `repeatable.csv`, `lines.csv`, both figures as SVG and PNG, and the log `runout.rrd` with a waterfall of the `spindle`
    (as its scene has it, without what its effects change)."""
    from thermospindle.report.figures.common import save_all  # matplotlib and rerun take their time to load
    from thermospindle.report.figures.runout import figures
    from thermospindle.report.log.turning.runout import write_runout_log

    _write_record(runout, folder / "record.csv")
    _write_repeatable(runout, folder / "repeatable.csv")
    names = [k for k in line_json(runout.lines[0]) if k != "causes"] if runout.lines else ["frequency_Hz"]
    write_csv(folder / "lines.csv", names, ([row[k] for k in names] for row in answer["lines"]))
    progress("tables written")
    save_all(figures(runout), folder, 130)
    progress("figures written")
    condition = runout.point.condition
    write_runout_log(runout, waterfall(spindle, condition.temperature, run_up(condition.speed)), folder / "runout.rrd")
    progress("Rerun log written")


def _write_record(runout: Runout, path: Path) -> None:
    """Every sample of the whole revolutions: time, angle, revolution, all probes, and the hub's nonrepeatable parts."""
    cut, probes = runout.by_lines, runout.signals.probes
    revolution, place = np.divmod(np.arange(len(cut.time)), len(cut.angle))
    angle = cut.angle[place] + 2 * np.pi * revolution
    columns = [cut.time, angle, revolution, *TO_UM * cut.value.reshape(len(probes), -1), *TO_UM * cut.nonrepeatable[:3].reshape(3, -1)]
    names = ["time_s", "angle_rad", "revolution", *(f"{p.name}_um" for p in probes), *(f"{p.name}_nrro_um" for p in probes[:3])]
    _table(path, names, columns)


def _write_repeatable(runout: Runout, path: Path) -> None:
    """RRO of every probe over one revolution of what it sees: by lines, and averaged."""
    probes = runout.signals.probes
    both = (TO_UM * runout.cut_of(i, averaged).repeatable[i] for averaged in (False, True) for i in range(len(probes)))
    columns = [runout.by_lines.angle, *both]
    names = [f"{p.name}_{how}_um" for how in ("rro", "averaged") for p in probes]
    _table(path, ["angle_rad", *names], columns)


def _table(path: Path, names: list[str], columns: list[Any]) -> None:
    header = ",".join(name.replace(" ", "_") for name in names)
    np.savetxt(path, np.array(columns).T, fmt="%.9g", delimiter=",", header=header, comments="")


# ---------------------------------------------------------------- report


def runout_section(runout: Runout, answer: dict[str, Any]) -> tuple[str, str]:
    """A section of the report: title and HTML."""
    from thermospindle.report.figures.common import pictures  # matplotlib takes its time to load
    from thermospindle.report.figures.runout import figures

    where = looked_at(runout.point.spindle)
    captions = {
        "motion": f"Orbit of the {where}, and its error motion along x, y and the axis over the angle of the turning part.",
        "spectrum": "Amplitude over frequency; a mark is a line fitted at its known frequency.",
    }
    drawn = pictures(figures(runout), captions, "runout-")
    quoted = [[escape(meaning), *("-" if (value := answer[key][d]) is None else f"{1e3 * value:.2f}" for d in MAIN)] for key, meaning in STATISTICS.items()]
    lines = [
        [
            f"{g['frequency_Hz']:.2f}", f"{g['order']:.3f}", g["direction"], f"{1e3 * g['amplitude_um']:.2f}", escape(g["name"]),
            escape(" ".join(w for w in (_bearings(g), g["cause"]) if w)),
        ]
        for g in answer["lines"][:SHOWN]
    ]  # fmt: skip
    frequency = "its turning frequency; orders are those of the spindle" if _of_part(answer, where) else "the turning frequency"
    touching = f"{_of_contact(answer)}, " if runout.point.spindle.bearings else ""
    text = (
        f"<p>{answer['revolutions']} revolutions{escape(_of_part(answer, where))} at {answer['temperature_C']:g} °C and {answer['speed_rpm']:.6g} rpm, {touching}"
        f"imperfections {answer['imperfections']}. The repeatable part is made of the lines at whole multiples of {frequency}.</p>"
        f"{table(('nm', f'radial ({escape(where)} x)', f'radial ({escape(where)} y)', 'axial'), quoted)}"
        f"{''.join(drawn.values())}"
        f"{table(('Hz', 'orders', 'direction', 'nm', 'line', 'cause'), lines, (2, 4, 5))}"
        + (f"<p>{escape(changing)}</p>" if (changing := _changing(answer)) else "")
    )
    return "Runout", text
