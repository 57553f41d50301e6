"""The verb `inspect`: what a Rerun log holds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from thermospindle.report.log.read import check_readable, read_log
from thermospindle.report.log.told import describe, log_json, write_frf_tables
from thermospindle.report.verbs.answer import Answer, answered, write_json


def inspect(log: Path, out: Path | None = None) -> Answer:
    """What a log of spindle holds; of a run its FRFs as numbers, which a folder holds as one CSV a test."""
    asked = dict(locals()) | {"verb": "inspect"}
    check_readable(log)
    found = read_log(log)

    def write(folder: Path, values: dict[str, Any]) -> None:
        if found.kind == "run":
            write_frf_tables(found, folder)
        else:
            write_json("contents.json")(folder, values)

    return answered(log_json(found), lambda console: console.print(describe(found), markup=False, highlight=False), out, asked, write)
