"""Reads a Rerun log back: what is in it, and its FRFs as numbers, bit for bit as computed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

from model.scene import BadInput
from sim.frf import Frf
from sim.log_content import Peak

APPLICATION = "thermospindle"
Columns = dict[str, list[pa.Array]]  # of one entity: chunks of lists by component


@dataclass(frozen=True)
class LogContents:
    """What a log holds. `entities`: number of rows by path; `temperatures` in C, of the tests in their order."""

    path: Path
    application: str
    recording: str
    blueprint: bool
    scene: str
    title: str
    entities: Mapping[str, int]
    timelines: tuple[str, ...]
    temperatures: tuple[float, ...]
    peaks: tuple[Peak, ...]
    frfs: Mapping[str, Frf]  # by test


@dataclass(frozen=True)
class Opened:
    """A log as it stands in its file: values by entity and component, and the number of rows by entity."""

    path: Path
    application: str
    recording: str
    blueprint: bool
    columns: Mapping[str, Columns]
    rows: Mapping[str, int]
    timelines: tuple[str, ...]


def open_log(path: Path) -> Opened:
    """Everything in a log. Raises `BadInput`, one sentence that names the file, for anything but a log of ours."""
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
    except (RuntimeError, ValueError, OSError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"{path}: not a Rerun log that can be read: {error}") from None
    columns: dict[str, Columns] = {}
    rows: dict[str, int] = {}
    for entity, timelines, batch in batches:
        rows[entity] = rows.get(entity, 0) + batch.num_rows
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            if name not in timelines:
                columns.setdefault(entity, {}).setdefault(name, []).append(column)
    every = tuple(sorted({t for _, timelines, _ in batches for t in timelines}))
    return Opened(path, ours[0].application_id, ours[0].recording_id, bool(blueprints), columns, dict(sorted(rows.items())), every)


def read_log(path: Path) -> LogContents:
    """What is in the log of a run. Raises `BadInput`, one sentence that names the file, for anything but a whole one of ours."""
    return contents_of(open_log(path))


def contents_of(log: Opened) -> LogContents:
    """What is in an opened log of a run. Raises `BadInput` where something is missing."""
    columns = log.columns
    try:
        about = columns["/__properties/run"]
        peaks = columns["/numbers/peaks"]
        tests = {e.removesuffix("/about"): own for e, own in columns.items() if e.startswith("/numbers/") and e.endswith("/about")}
        order = sorted(tests, key=lambda e: int(component_list(tests[e], "order")[0]))
        return LogContents(
            path=log.path,
            application=log.application,
            recording=log.recording,
            blueprint=log.blueprint,
            scene=component_list(about, "scene")[0],
            title=component_list(about, "title")[0],
            entities=log.rows,
            timelines=log.timelines,
            temperatures=tuple(component_list(tests[e], "temperature_C")[0] for e in order),
            peaks=tuple(Peak(*row) for row in zip(*(component_list(peaks, name) for name in Peak.__dataclass_fields__), strict=True)),
            frfs={component_list(tests[e], "id")[0]: _frf(columns[e], tests[e]) for e in order},
        )
    except (KeyError, IndexError) as error:
        raise BadInput(f"{log.path}: is not a whole log of {APPLICATION}: {error} is missing") from None


def component_array(columns: Columns, name: str) -> Any:
    """All values (n,) of a component, in the order in which they were written."""
    return pa.concat_arrays([column.flatten() for column in columns[name]])


def component_list(columns: Columns, name: str) -> list[Any]:
    return component_array(columns, name).to_pylist()


def component_rows(columns: Columns) -> tuple[dict[str, Any], ...]:
    """The components of an entity, all of one length, as rows by their names; none where the log has no such entity."""
    names = [name for name in columns if not name.startswith("rerun")]
    return tuple(dict(zip(names, row, strict=True)) for row in zip(*(component_list(columns, name) for name in names), strict=True))


def _frf(columns: Columns, about: Columns) -> Frf:
    """The FRFs of one test: every row holds one line of all (response, reference) pairs.

    Rerun may have reordered rows that fall on the same whole number of Hz.
    """
    responses, references = (tuple(component_list(about, f"{role}_nodes")) for role in ("response", "reference"))
    frequency = component_array(columns, "frequency_Hz").to_numpy()
    rising = np.argsort(frequency)

    def array(name: str) -> np.ndarray:
        lines = component_array(columns, name).to_numpy().reshape(len(frequency), len(responses), len(references))
        return np.ascontiguousarray(np.moveaxis(lines[rising], 0, 2))

    value = np.empty((len(responses), len(references), len(frequency)), complex)
    value.real, value.imag = array("real"), array("imaginary")
    others = [array(name) if name in columns else None for name in ("coherence", "standard_error")]
    return Frf(frequency[rising], value, responses, references, component_list(about, "quantity")[0], *others)


def describe(contents: LogContents) -> str:
    """What a log holds, for the terminal."""
    lines = [
        f"{contents.path}: {contents.title}",
        f"  scene {contents.scene}, recording {contents.recording}, {'with' if contents.blueprint else 'without'} a blueprint",
        f"  temperatures: {', '.join(f'{t:g}' for t in contents.temperatures)} C",
        f"  timelines: {', '.join(contents.timelines)}",
    ]
    groups: dict[str, list[int]] = {}
    for entity, rows in contents.entities.items():
        groups.setdefault(entity.split("/")[1], []).append(rows)
    lines += [f"  {name}: {len(rows)} entities, {sum(rows)} rows" for name, rows in groups.items() if name != "__properties"]
    for test, frf in contents.frfs.items():
        step = frf.frequency[1] - frf.frequency[0]
        lines.append(
            f"  FRFs of {test}: {frf.quantity}, "
            f"responses {_nodes(frf.response_nodes)}, references {_nodes(frf.reference_nodes)}, "
            f"{len(frf.frequency)} lines from {frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz every {step:.4g} Hz"
        )
    for source, test in dict.fromkeys((p.source, p.test) for p in contents.peaks):
        own = [p.frequency for p in contents.peaks if (p.source, p.test) == (source, test)]
        lines.append(f"  peaks {source}, {test}: {', '.join(f'{f:.1f}' for f in own)} Hz")
    return "\n".join(lines)


def _nodes(nodes: tuple[int, ...]) -> str:
    return " ".join(map(str, nodes))
