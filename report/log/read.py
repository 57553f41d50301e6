"""Reads any of our Rerun logs back: what is in it as numbers, bit for bit as computed.

A log says by its property which kind it is: `run` (also impact test, comparison and ladder), `map`, `runout`, `warmup` or `study`. Numbers
stand under `numbers/` as components with plain names; `Log.table` gives those of one entity, and `report.log.told` says what they mean.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

from thermospindle.model.errors import BadInput
from thermospindle.model.files.apart import read_apart
from thermospindle.model.types import Array
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.identification.peak import Peak

APPLICATION = "thermospindle"
KINDS = ("run", "map", "runout", "warmup", "study")
PLAIN = re.compile(r"[A-Za-z0-9_+-][A-Za-z0-9._+ -]*")
NEEDS = {"run": "/numbers/peaks", "map": "/numbers/modes", "runout": "/signals", "warmup": "/numbers/warmup", "study": "/numbers/rows"}


@dataclass(frozen=True, eq=False)
class HammerRecords:
    """What was sampled of all hits on one hammer point: time (n,) s, force (hits, n) N, velocity (hits, responses, n) m/s."""

    time: Array
    force: Array
    velocity: Array


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

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.path}: {len(self.entities)} entities by {self.application}>"

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

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of numbers whose names have none, by what their entity begins with, and its component; nothing in logs without any."""
        table = self.table("/numbers/units")
        return dict(zip(table.get("of", ()), table.get("unit", ()), strict=True))

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
        """By test; BadInput for an id that could be a path, for files are called by it."""
        for _, about in self.tests:
            if not PLAIN.fullmatch(about["id"][0]):
                raise BadInput(f"{self.path}: the test {about['id'][0]!r}: must be letters, digits, '.', '_', '+', '-' and spaces, as those of a campaign and what is computed of them")
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
        names = dict(zip(about.get("named_nodes", ()), about.get("node_names", ()), strict=True))
        coherence, sd = (lines(name) if name in self.columns[entity] else None for name in ("coherence", "standard_error"))
        return Frf(frequency[rising], value, responses, references, about["quantity"][0], coherence, sd, names=names)

    @cached_property
    def records(self) -> dict[int, HammerRecords]:
        """Every hit of an impact test, by hammer node; empty where a log has none."""
        found: dict[int, HammerRecords] = {}
        for about in self.rows("/numbers/records"):
            node, hits = about["hammer"], range(1, about["hits"] + 1)
            force, velocity = ([self._scalars(f"/records/hammer\\ {node}/hit\\ {k}/{what}") for k in hits] for what in ("force", "velocity"))
            time = np.arange(force[0].size) / about["sample_rate_Hz"]
            found[node] = HammerRecords(time, np.array(force), np.array([v.reshape(time.size, -1).T for v in velocity]))
        return found

    def _scalars(self, entity: str) -> Array:
        [name] = [name for name in self.columns[entity] if name.endswith("scalars")]
        return np.asarray(self.array(entity, name))

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
        return self._scalars("/signals").reshape(-1, 6).T

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
    _check_file(Path(path))
    read_apart(Path(path), "Rerun logs", TRIAL, str(path))


def _check_file(path: Path) -> None:
    if path.is_dir():
        logs = sorted(p.name for p in path.glob("*.rrd"))
        raise BadInput(f"{path}: is a folder; a log is a file, *.rrd: {'there ' + ', '.join(logs) if logs else 'none is in it'}")
    if not path.is_file():
        raise BadInput(f"{path}: no such file")


def read_log(path: Path) -> Log:
    """Everything in a log. Raises `BadInput`, one sentence that names the file, for anything but a whole log of ours."""
    path = Path(path)
    _check_file(path)
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
        why = "" if "Not an RRD file" in str(error) else f" that can be read: {error}"
        raise BadInput(f"{path}: not a Rerun log{why}") from None
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
