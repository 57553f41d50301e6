"""The folder of a study: part files of results, each written whole, so that a run killed at any moment is gone on with.

`study.json` says what the study is of; a folder is gone on with only by the same study. Part k holds the rows of cases k chunk to
(k + 1) chunk, and is there or not, never half.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from thermospindle.model.errors import BadInput
from thermospindle.model.files import whole
from thermospindle.sim.study.executors import Executor

KEY, PARTS, RESULTS = "study.json", "parts", "results.parquet"

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Folder:
    """The folder of a study with `cases` cases, `chunk` a part."""

    path: Path
    cases: int
    chunk: int
    schema: pa.Schema

    @property
    def count(self) -> int:
        """Of parts."""
        return -(-self.cases // self.chunk)

    def part(self, k: int) -> Path:
        return self.path / PARTS / f"part-{k:06d}.parquet"

    def missing(self) -> list[int]:
        return [k for k in range(self.count) if not self.part(k).exists()]

    def table(self) -> pa.Table:
        """All rows, in order of the cases. Raises `BadInput` for a part that was damaged."""
        return pa.concat_tables([self._read(k) for k in range(self.count)])

    def _read(self, k: int) -> pa.Table:
        file = self.part(k)
        try:
            found = pq.read_table(file)
        except (OSError, pa.ArrowException) as error:
            raise BadInput(f"{file}: cannot be read ({' '.join(str(error).split())}); take it out, and the next run makes it again") from None
        if found.schema != self.schema:
            raise BadInput(f"{file}: has other columns than this study; take it out, and the next run makes it again")
        return found


@cache
def versions() -> dict[str, str]:
    """What numbers depend on beside the study: this program and the libraries that compute."""
    return {name: version(name) for name in ("thermospindle", "mujoco", "numpy", "scipy", "scikit-fem", "pyarrow")}


@contextmanager
def opened(path: Path, key: Mapping[str, Any], cases: int, chunk: int, schema: pa.Schema) -> Iterator[Folder]:
    """The folder at `path`, new or gone on with, for this process alone.

    Raises `BadInput` where something else stands there, another run is writing, or the study has another `key` than the one begun there.
    """
    path = path.resolve()
    told = {**key, "cases": cases, "chunk": chunk, "versions": versions()}
    for parent in (path, *path.parents):
        if parent.exists() and not parent.is_dir():
            raise BadInput(f"--out {path}: {parent} is a file, so no folder can be made there; name a new or empty folder")
    path.mkdir(parents=True, exist_ok=True)
    with whole.alone(path):
        file = path / KEY
        if not file.exists():
            if any(p for p in path.iterdir() if not p.name.startswith(f".{KEY}.")):  # what a killed run left of the file
                raise BadInput(f"--out {path}: holds something that is no study of spindle; name a new or empty folder")
            write(file, json.dumps(told, indent=1))
        begun = _begun(file)
        for name in {**begun, **told}:
            if begun.get(name) != told.get(name):
                raise BadInput(f"--out {path}: was begun with another {_short(name)} ({_short(begun.get(name))}, now {_short(told.get(name))}); name a new folder to begin anew")
        (path / PARTS).mkdir(exist_ok=True)
        for folder in (path, path / PARTS):  # a part that stands is not written again, and what a run killed just then left of it would stay
            whole.tidy(folder)
        yield Folder(path, cases, chunk, schema)


def _begun(file: Path) -> dict[str, Any]:
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInput(f"{file}: cannot be read ({error}); name a new folder to begin anew") from None
    if not isinstance(found, dict) or not {"cases", "chunk", "versions"} <= set(found):
        raise BadInput(f"{file}: is not what spindle wrote; name a new folder to begin anew")
    return found


def _short(value: Any) -> str:
    text = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else str(value)
    return text if len(text) <= 150 else f"{text[:150]}..."


def write(file: Path, text: str) -> None:
    """A text file, whole or not at all."""
    with whole.whole(file) as new:
        new.write_text(text, encoding="utf-8")


def write_table(table: pa.Table, file: Path) -> None:
    """A Parquet file, whole or not at all."""
    with whole.whole(file) as new:
        pq.write_table(table, new, compression="zstd")


def fill(folder: Folder, rows: Callable[[int], Rows], run: Executor, progress: Callable[[str], None]) -> None:
    """Compute the parts that are missing, and write each as it comes."""

    def done(k: int, table: pa.Table) -> None:
        write_table(table, folder.part(k))
        progress(f"cases up to {min((k + 1) * folder.chunk, folder.cases)} of {folder.cases}")

    run(partial(_chunk, rows, folder.schema, folder.cases, folder.chunk), folder.missing(), done)


def _chunk(rows: Callable[[int], Rows], schema: pa.Schema, cases: int, chunk: int, k: int) -> pa.Table:
    found = [row for case in range(k * chunk, min((k + 1) * chunk, cases)) for row in rows(case)]
    return pa.Table.from_pylist(found, schema=schema)
