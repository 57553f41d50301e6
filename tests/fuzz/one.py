"""One reader under atheris: `python -m tests.fuzz.one NAME [options of libFuzzer] FOLDER ...`, or
with FILE instead of folders to try it again."""

from __future__ import annotations

import os
import random
import shlex
import sys
import tempfile
import warnings
from pathlib import Path

import atheris

ROOT = Path(__file__).parents[2]
LIBRARIES = ["pyuff", "tomllib", "zipfile"]
OURS = (
    "model.files", "model.scene", "model.files.stiffness_table", "sim.campaign", "sim.importing", "sim.identification.frf", "sim.study.form",
    "sim.study.parts", "diagnosis.answer", "diagnosis.draft.answer", "diagnosis.draft.draft", "diagnosis.prediction.outcomes", "report.log.read",
)  # fmt: skip
"""Modules whose branches count as coverage: those that read. All of them would take a minute to prepare; what is compiled has none to show."""


def others() -> list[str]:
    """Names of all other modules of this program."""
    names = (p.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".") for f in ("model", "thermal", "sim", "diagnosis", "report") for p in (ROOT / f).rglob("*.py"))
    kept = tuple(f"{own}." for own in OURS)
    return [f"thermospindle.{name.removesuffix('.__init__')}" for name in names if not f"{name}.".startswith(kept)]


with atheris.instrument_imports(include=["thermospindle", *LIBRARIES], exclude=others()):
    from tests.torture.conftest import NAMED
    from tests.torture.damage import damaged, drawn
    from tests.torture.readers import READERS


def mutated(data: bytes, most: int, seed: int) -> bytes:
    """Every other time bytes as libFuzzer moves them, else numbers, lines and pieces as `damage`
    does: text seldom stays text under the first."""
    rng = random.Random(seed)
    if rng.random() < 0.5:
        return atheris.Mutate(data, most)
    return damaged(data, [drawn(rng) for _ in range(rng.randint(1, 3))])[:most]


def main() -> None:
    name = os.environ.get("FUZZ_READER") or sys.argv.pop(1)
    os.environ["FUZZ_READER"] = name  # libFuzzer starts this file again, without it, where it merges
    reader = READERS[name]
    warnings.simplefilter("ignore")
    warnings.simplefilter("error", RuntimeWarning)  # as under pytest
    folder = Path(tempfile.mkdtemp())

    def once(data: bytes) -> None:
        try:
            reader(folder, data)
        except NAMED as error:
            if not 0 < len(str(error).strip()) < 4000:
                raise AssertionError("a named error says what is wrong, in a sentence") from error

    atheris.Setup([f"{shlex.quote(sys.executable)} {shlex.quote(__file__)}", *sys.argv[1:]], once, custom_mutator=mutated)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
