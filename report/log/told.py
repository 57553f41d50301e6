"""What a log holds, as JSON and in words, a row a kind in `SHOW`; and the FRFs of a run as tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.units import RPM, TO_NM, in_rpm
from thermospindle.report.log.read import APPLICATION, Log
from thermospindle.report.typeset import known, write_csv


@contextmanager
def _as_described(log: Log) -> Iterator[None]:
    """`BadInput` where what a log holds is not what it says of itself."""
    try:
        yield
    except (KeyError, IndexError, TypeError, ValueError, OverflowError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"{log.path}: is not a whole log of {APPLICATION}: what it holds is not what it says of itself ({error})") from None


def log_json(log: Log) -> dict[str, Any]:
    """What a log holds, with its numbers as nested lists."""
    with _as_described(log):
        return {"scene": log.scene, "entities": list(log.entities), "units": log.units, **SHOW[log.kind][0](log)}


def describe(log: Log) -> str:
    """What a log holds, for the terminal."""
    with _as_described(log):
        lines = [
            f"{log.path}: {log.about['title']}",
            f"  scene {log.scene}, recording {log.recording}, {'with' if log.blueprint else 'without'} a blueprint",
            f"  timelines: {', '.join(log.timelines)}",
        ]
        return "\n".join([*lines, *(f"  {line}" for line in SHOW[log.kind][1](log))])


def _run_json(log: Log) -> dict[str, Any]:
    """FRFs as [response][reference][line]."""
    frfs = {
        test: {
            "frequency_Hz": frf.frequency.tolist(),
            "response_nodes": list(frf.response_nodes),
            "reference_nodes": list(frf.reference_nodes),
            "quantity": frf.quantity,
            "real": frf.value.real.tolist(),
            "imag": frf.value.imag.tolist(),
        }
        for test, frf in log.frfs.items()
    }
    return {"temperatures_C": list(log.temperatures), "frfs": frfs}


def _run_words(log: Log) -> list[str]:
    lines = [f"temperatures: {', '.join(f'{t:g}' for t in log.temperatures)} C"]
    groups: dict[str, list[int]] = {}
    for entity, rows in log.entities.items():
        groups.setdefault(entity.split("/")[1], []).append(rows)
    lines += [f"{name}: {len(rows)} entities, {sum(rows)} rows" for name, rows in groups.items() if name != "__properties"]
    for test, frf in log.frfs.items():
        nodes = [", ".join(f"{n} {frf.names.get(n, '')}".strip() for n in side) for side in (frf.response_nodes, frf.reference_nodes)]
        first, second, last = frf.frequency[[0, 1, -1]]
        lines.append(
            f"FRFs of {test}: {frf.quantity}, responses {nodes[0]}, references {nodes[1]}, "
            f"{len(frf.frequency)} lines from {first:g} to {last:g} Hz every {second - first:.4g} Hz"
        )
    for hammer, record in log.records.items():
        lines.append(
            f"records of hammer {hammer}: {len(record.force)} hits of {len(record.time)} samples to {record.time[-1]:.4g} s, "
            f"{record.velocity.shape[1]} responses, {record.force.max():.3g} N at most"
        )
    for source, test in dict.fromkeys((p.source, p.test) for p in log.peaks):
        own = [p.frequency for p in log.peaks if (p.source, p.test) == (source, test)]
        lines.append(f"peaks {source}, {test}: {', '.join(f'{f:.1f}' for f in own)} Hz")
    return lines


def _map_json(log: Log) -> dict[str, Any]:
    temperatures, speeds, modes = log.grid
    return {
        "grid": {"temperature_C": temperatures.tolist(), "speed_rpm": [in_rpm(s) for s in speeds]},
        "modes_Hz": known(modes),
        "coincidences": log.rows("/numbers/coincidences"),
    }


def _line_of(c: Mapping[str, Any]) -> str:
    """A line with its cause, the bearing that it is of and the way it whirls: several have one name."""
    own = [c["cause"], f"of {c['bearing']}" if c["bearing"] else "", "" if c["line_whirl"] == "none" else c["line_whirl"]]
    return f"{c['line']} ({' '.join(word for word in own if word)})"


def _map_words(log: Log) -> list[str]:
    (count, modes, speeds), coincidences = log.grid[2].shape, log.rows("/numbers/coincidences")
    return [
        f"resonance map: {modes} modes at {count} temperature{'s' * (count != 1)} x {speeds} speeds, {len(coincidences)} coincidences",
        *(
            f"{_line_of(c)} with {c['mode_kind']} mode {c['mode']} at {c['temperature_C']:.1f} C, {c['speed_rpm']:.0f} rpm, {c['frequency_Hz']:.1f} Hz"
            for c in coincidences[:10]
        ),
    ]


def _runout_json(log: Log) -> dict[str, Any]:
    """The record as lists in nm."""
    return {
        "temperature_C": log.about["temperature_C"],
        "speed_rpm": in_rpm(log.about["speed_rad_per_s"]),
        "revolutions": log.about["revolutions"],
        "quoted_m": log.quoted,
        "lines": log.rows("/numbers/lines"),
        "repeatable_nm": log.signals[:3].tolist(),
        "nonrepeatable_nm": log.signals[3:].tolist(),
        "waterfall": [
            {
                "speed_rpm": in_rpm(s["speed_rad_per_s"]),
                "frequency_Hz": s["frequency"].tolist(),
                "radial_m": s["radial"].tolist(),
                "axial_m": s["axial"].tolist(),
            }
            for s in log.waterfall
        ],
    }


def _runout_words(log: Log) -> list[str]:
    about = log.about
    lines = [
        f"turning at {about['speed_rad_per_s'] / RPM:.6g} rpm, {about['temperature_C']:g} C, {about['revolutions']} revolutions, "
        f"{log.signals.shape[1]} samples of 3 probes"
    ]
    for probe, own in log.quoted.items():
        lines.append(
            f"{probe}: RRO (repeatable runout) {TO_NM * own['repeatable']:.1f} nm, "
            f"NRRO (nonrepeatable) {TO_NM * own['nonrepeatable']:.1f} nm peak to valley"
        )
    for g in log.rows("/numbers/lines")[:10]:
        cause = f"{g['name']} {g['bearing']} {g['cause']}".replace("  ", " ").strip()
        lines.append(f"line {g['frequency']:.2f} Hz, {g['direction']}, {TO_NM * g['amplitude']:.2f} nm: {cause}")
    if log.waterfall:
        rpm = [s["speed_rad_per_s"] / RPM for s in log.waterfall]
        lines.append(f"waterfall of {len(rpm)} speeds from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm")
    return lines


def _columns(log: Log, entity: str) -> dict[str, Any]:
    return {name: known(values) for name, values in log.table(entity).items()}


def _warmup_json(log: Log) -> dict[str, Any]:
    """Columns as in `warmup.csv`, null where a mode was lost."""
    about = {"start_C": log.about["start_C"], "air_C": log.about["air_C"], "speed_rpm": in_rpm(log.about["speed_rad_per_s"])}
    return {**about, "time_constant_s": log.about["time_constant_s"], "columns": _columns(log, "/numbers/warmup")}


def _warmup_words(log: Log) -> list[str]:
    about, table = log.about, log.table("/numbers/warmup")
    lines = [f"warm-up from {about['start_C']:g} C in air of {about['air_C']:g} C at {about['speed_rad_per_s'] / RPM:.6g} rpm"]
    lines.append(f"{len(table['time_s'])} times to {table['time_s'][-1]:.4g} s, slowest time constant {about['time_constant_s']:.4g} s")
    return lines + [f"{name}: {values[0]:.6g} to {values[-1]:.6g}" for name, values in table.items() if name != "time_s"]


def _study_json(log: Log) -> dict[str, Any]:
    """Columns of numbers as they stand in the results, null where a row has none."""
    told = {key: log.about[key] for key in ("title", "kind", "cases", "rows", "errors")}
    return told | {"columns": _columns(log, "/numbers/rows")}


def _study_words(log: Log) -> list[str]:
    about = log.about
    lines = [f"{about['kind']} of {about['cases']} cases: {about['rows']} rows, {about['errors']} without a result"]
    for name, values in log.table("/numbers/rows").items():
        given = [v for v in values if v == v]
        lines.append(f"{name}: {len(given)} of {len(values)} known" + (f", {min(given):.6g} to {max(given):.6g}" if given else ""))
    return lines


def write_frf_tables(log: Log, folder: Path) -> None:
    """One CSV a test: frequency and the real and imaginary part of every FRF."""
    for test, frf in log.frfs.items():
        names = [f"H({i},{j})" for i in frf.response_nodes for j in frf.reference_nodes]
        head = ["frequency_Hz", *(f"{part} {name} ({frf.quantity})" for name in names for part in ("re", "im"))]
        lines = np.ascontiguousarray(frf.value.reshape(len(names), -1).T).view(float)
        write_csv(folder / f"{test}.csv", head, np.column_stack([frf.frequency, lines]).tolist())
    (folder / "contents.json").write_text(json.dumps({"scene": log.scene, "entities": list(log.entities)}, indent=1))


SHOW: dict[str, tuple[Callable[[Log], dict[str, Any]], Callable[[Log], list[str]]]] = {
    "run": (_run_json, _run_words),
    "map": (_map_json, _map_words),
    "runout": (_runout_json, _runout_words),
    "warmup": (_warmup_json, _warmup_words),
    "study": (_study_json, _study_words),
}
