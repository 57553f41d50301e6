"""Reads any of our Rerun logs back: what is in it as numbers, bit for bit as computed, as JSON, and in words.

A log says by its property which kind it is: `run` (also comparison and ladder), `map`, `runout` or `study`. Numbers stand under `numbers/` as
components with plain names; `Log.table` gives those of one entity, and a row a kind in `SHOW` says what they mean.
"""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, TO_NM
from thermospindle.report.log.content import Peak
from thermospindle.sim.identification.frf import Frf

APPLICATION = "thermospindle"
KINDS = ("run", "map", "runout", "study")
NEEDS = {"run": "/numbers/peaks", "map": "/numbers/modes", "runout": "/signals", "study": "/numbers/rows"}


@dataclass(frozen=True)
class Log:
    """A log as it stands in its file. `columns`: chunks of lists by entity and component; `entities`: number of rows by path."""

    path: Path
    application: str
    recording: str
    blueprint: bool
    columns: Mapping[str, Mapping[str, list[pa.Array]]]
    entities: Mapping[str, int]
    timelines: tuple[str, ...]

    def array(self, entity: str, component: str) -> Any:
        """All values (n,) of a component, in the order in which they were written."""
        try:
            return pa.concat_arrays([column.flatten() for column in self.columns[entity][component]]).to_numpy(zero_copy_only=False)
        except KeyError as missing:
            raise BadInput(f"{self.path}: is not a whole log of {APPLICATION}: {missing} is missing") from None

    def table(self, entity: str) -> dict[str, list[Any]]:
        """The components of an entity by name; empty where the log has no such entity."""
        names = [name for name in self.columns.get(entity, {}) if not name.startswith("rerun")]
        return {name: pa.concat_arrays([c.flatten() for c in self.columns[entity][name]]).to_pylist() for name in names}

    def rows(self, entity: str) -> list[dict[str, Any]]:
        """The components of an entity, all of one length, as rows by name."""
        table = self.table(entity)
        return [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]

    @cached_property
    def kind(self) -> str:
        """One of `KINDS`. BadInput where nothing says so or what this kind must hold is missing."""
        kind = next((k for k in KINDS if f"/__properties/{k}" in self.columns), "run")
        for entity in (f"/__properties/{kind}", NEEDS[kind]):
            if entity not in self.columns:
                raise BadInput(f"{self.path}: is not a whole log of {APPLICATION}: {entity} is missing")
        return kind

    @cached_property
    def about(self) -> dict[str, Any]:
        """What the log says of itself: title, scene, condition, versions."""
        return {name: values[0] for name, values in self.table(f"/__properties/{self.kind}").items()}

    @property
    def scene(self) -> str:
        return str(self.about["scene"])

    # ------------------------------------------------------------ runs, comparisons, ladders

    @cached_property
    def peaks(self) -> tuple[Peak, ...]:
        return tuple(Peak(**row) for row in self.rows("/numbers/peaks"))

    @cached_property
    def tests(self) -> list[tuple[str, dict[str, Any]]]:
        """Entity and description of every test with FRFs, in order."""
        found = {e.removesuffix("/about"): self.table(e) for e in self.columns if e.startswith("/numbers/") and e.endswith("/about")}
        return sorted(found.items(), key=lambda item: int(item[1]["order"][0]))

    @property
    def temperatures(self) -> tuple[float, ...]:
        """In C, of the tests."""
        return tuple(about["temperature_C"][0] for _, about in self.tests)

    @cached_property
    def frfs(self) -> dict[str, Frf]:
        """By test."""
        return {about["id"][0]: self._frf(entity, about) for entity, about in self.tests}

    def _frf(self, entity: str, about: Mapping[str, list[Any]]) -> Frf:
        """Every row holds one line of all (response, reference) pairs; Rerun may have reordered rows on the same whole number of Hz."""
        responses, references = (tuple(about[f"{role}_nodes"]) for role in ("response", "reference"))
        frequency = self.array(entity, "frequency_Hz")
        rising = np.argsort(frequency)

        def lines(name: str) -> Array:
            values = self.array(entity, name).reshape(len(frequency), len(responses), len(references))
            return np.ascontiguousarray(np.moveaxis(values[rising], 0, 2))

        value = np.empty((len(responses), len(references), len(frequency)), complex)
        value.real, value.imag = lines("real"), lines("imaginary")
        coherence, sd = (lines(name) if name in self.columns[entity] else None for name in ("coherence", "standard_error"))
        return Frf(frequency[rising], value, responses, references, about["quantity"][0], coherence, sd)

    # ------------------------------------------------------------ maps

    @cached_property
    def grid(self) -> tuple[Array, Array, Array]:
        """Temperatures (T,) C, speeds (S,) rad/s and natural frequencies (T, modes, S) Hz of a map."""
        temperatures, speeds = self.array("/numbers/modes", "temperature_C"), self.array("/numbers/speeds", "speed_rad_per_s")
        modes = self.array("/numbers/modes", "frequency_Hz").reshape(len(temperatures), -1, len(speeds))
        rising = np.argsort(temperatures)
        return temperatures[rising], speeds, modes[rising]

    # ------------------------------------------------------------ runout

    @cached_property
    def signals(self) -> Array:
        """RRO of the hub's probes x, y and axial, then their NRRO (6, n) in nm."""
        [values] = [name for name in self.columns["/signals"] if name.endswith("scalars")]
        return np.asarray(self.array("/signals", values).reshape(-1, 6).T)

    @cached_property
    def quoted(self) -> dict[str, dict[str, float]]:
        """What is quoted of a record (m), by probe and value."""
        return {row["probe"]: {k: v for k, v in row.items() if k != "probe"} for row in self.rows("/numbers/quoted")}

    @cached_property
    def waterfall(self) -> list[dict[str, Any]]:
        """Line spectra: speed (rad/s), and frequency, radial, axial, natural as arrays. A row is a speed."""
        columns = self.columns.get("/numbers/waterfall", {})
        names = [name for name in columns if not name.startswith("rerun")]
        rows = zip(*([row.as_py() for chunk in columns[name] for row in chunk] for name in names), strict=True)
        tables = [dict(zip(names, map(np.array, row), strict=True)) for row in rows]
        return [table | {"speed_rad_per_s": float(table["speed_rad_per_s"][0])} for table in tables]


TRIAL = """
import sys
from rerun.chunk import RrdReader
try:
    reader = RrdReader(sys.argv[1])
    reader.blueprints()
    for recording in reader.recordings():
        for chunk in reader.stream(store=recording):
            chunk.to_record_batch().validate(full=True)
except Exception:
    pass
"""
"""Reads a log as `read_log` does. What Python can catch is for that to say; what remains is the native library aborting."""


def check_readable(path: Path) -> None:
    """Refuse (`BadInput`) a damaged log on which the library that reads it would abort the whole process, by letting it abort another."""
    if not Path(path).is_file():
        raise BadInput(f"{path}: no such file")
    done = subprocess.run([sys.executable, "-P", "-c", TRIAL, str(path)], capture_output=True)
    if done.returncode:
        raise BadInput(f"{path}: is damaged; the library that reads Rerun logs breaks off on it")


def read_log(path: Path) -> Log:
    """Everything in a log. Raises `BadInput`, one sentence that names the file, for anything but a whole log of ours."""
    path = Path(path)
    if not path.is_file():
        raise BadInput(f"{path}: no such file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a file cut short; the error below says so
            reader = RrdReader(path)
            recordings, blueprints = reader.recordings(), reader.blueprints()
            ours = [r for r in recordings if r.application_id == APPLICATION]
            if recordings and not ours:
                raise BadInput(f"{path}: is a recording of {recordings[0].application_id!r}, not of {APPLICATION!r}")
            if not ours:
                raise BadInput(f"{path}: is not a whole log of {APPLICATION}: its recording is missing")
            batches = [(c.entity_path, c.timeline_names, c.to_record_batch()) for c in reader.stream(store=ours[0])]
            for _, _, batch in batches:
                batch.validate(full=True)
    except (RuntimeError, ValueError, OSError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"{path}: not a Rerun log that can be read: {error}") from None
    columns: dict[str, dict[str, list[pa.Array]]] = {}
    rows: dict[str, int] = {}
    for entity, timelines, batch in batches:
        rows[entity] = rows.get(entity, 0) + batch.num_rows
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            if name not in timelines:
                columns.setdefault(entity, {}).setdefault(name, []).append(column)
    every = tuple(sorted({t for _, timelines, _ in batches for t in timelines}))
    log = Log(path, ours[0].application_id, ours[0].recording_id, bool(blueprints), columns, dict(sorted(rows.items())), every)
    assert log.kind in KINDS
    return log


# ---------------------------------------------------------------- as JSON and in words


def log_json(log: Log) -> dict[str, Any]:
    """What a log holds, with its numbers as nested lists."""
    return {"scene": log.scene, "entities": list(log.entities), **SHOW[log.kind][0](log)}


def describe(log: Log) -> str:
    """What a log holds, for the terminal."""
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
        nodes = [" ".join(map(str, side)) for side in (frf.response_nodes, frf.reference_nodes)]
        first, second, last = frf.frequency[[0, 1, -1]]
        lines.append(
            f"FRFs of {test}: {frf.quantity}, responses {nodes[0]}, references {nodes[1]}, "
            f"{len(frf.frequency)} lines from {first:g} to {last:g} Hz every {second - first:.4g} Hz"
        )
    for source, test in dict.fromkeys((p.source, p.test) for p in log.peaks):
        own = [p.frequency for p in log.peaks if (p.source, p.test) == (source, test)]
        lines.append(f"peaks {source}, {test}: {', '.join(f'{f:.1f}' for f in own)} Hz")
    return lines


def _map_json(log: Log) -> dict[str, Any]:
    temperatures, speeds, modes = log.grid
    return {
        "grid": {"temperature_C": temperatures.tolist(), "speed_rpm": (speeds / RPM).tolist()},
        "modes_Hz": [[[float(f) if np.isfinite(f) else None for f in row] for row in m] for m in modes],
        "coincidences": log.rows("/numbers/coincidences"),
    }


def _map_words(log: Log) -> list[str]:
    (count, modes, speeds), coincidences = log.grid[2].shape, log.rows("/numbers/coincidences")
    return [
        f"resonance map: {modes} modes at {count} temperatures x {speeds} speeds, {len(coincidences)} coincidences",
        *(
            f"{c['line']} with mode {c['mode']} at {c['temperature_C']:.1f} C, {c['speed_rpm']:.0f} rpm, {c['frequency_Hz']:.1f} Hz"
            for c in coincidences[:10]
        ),
    ]


def _runout_json(log: Log) -> dict[str, Any]:
    """The record as lists in nm."""
    return {
        "temperature_C": log.about["temperature_C"],
        "speed_rpm": log.about["speed_rad_per_s"] / RPM,
        "revolutions": log.about["revolutions"],
        "quoted_m": log.quoted,
        "lines": log.rows("/numbers/lines"),
        "repeatable_nm": log.signals[:3].tolist(),
        "nonrepeatable_nm": log.signals[3:].tolist(),
        "waterfall": [
            {
                "speed_rpm": s["speed_rad_per_s"] / RPM,
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


def _study_json(log: Log) -> dict[str, Any]:
    """Columns of numbers as they stand in the results, null where a row has none."""
    told = {key: log.about[key] for key in ("title", "kind", "cases", "rows", "errors")}
    table = log.table("/numbers/rows")
    return told | {"columns": {name: [v if v == v else None for v in values] for name, values in table.items()}}


def _study_words(log: Log) -> list[str]:
    about = log.about
    lines = [f"{about['kind']} of {about['cases']} cases: {about['rows']} rows, {about['errors']} without a result"]
    for name, values in log.table("/numbers/rows").items():
        known = [v for v in values if v == v]
        lines.append(f"{name}: {len(known)} of {len(values)} known" + (f", {min(known):.6g} to {max(known):.6g}" if known else ""))
    return lines


SHOW: dict[str, tuple[Callable[[Log], dict[str, Any]], Callable[[Log], list[str]]]] = {
    "run": (_run_json, _run_words),
    "map": (_map_json, _map_words),
    "runout": (_runout_json, _runout_words),
    "study": (_study_json, _study_words),
}
