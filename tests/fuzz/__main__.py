"""`make fuzz`: every reader under atheris for so many seconds each; what is found stands in out/fuzz/NAME.

    python -m tests.fuzz [NAME ...] [--seconds 60] [--keep]

Begins with the whole files of `tests/torture/readers.py` (their first `LONGEST` bytes), the corpus,
and what earlier runs found. With `--keep` the corpus is made anew: of all inputs the smallest that
reach everything, up to `MOST` bytes a reader. Exit code 1 where anything was found.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.conftest import ROOT
from tests.torture.damage import BITS, VALUES
from tests.torture.readers import READERS

CORPUS = Path(__file__).with_name("corpus")
LONGEST, MOST = 30_000, 24_000
"""Bytes of one input, and of what is kept in the corpus for one reader."""
LIMITS = ("-timeout=30", "-rss_limit_mb=4096", f"-max_len={LONGEST}", "-print_final_stats=1")
DONE = {"tries": r"stat::number_of_executed_units:\s+(\d+)", "branches": r"cov: (\d+)(?!.*cov: )", "inputs": r"corp: (\d+)/(?!.*corp: )"}


def words(name: str) -> bytes:
    """A dictionary for libFuzzer: the words of whole files, and what breaks numbers and texts."""
    text = b"\n".join(READERS[name].whole())
    found = {*re.findall(rb"[A-Za-z_][A-Za-z0-9_]{2,30}", text[:200_000]), *(v for v in (*VALUES, *BITS) if 0 < len(v) < 40)}
    escaped = ("".join(f"\\x{byte:02x}" for byte in word) for word in sorted(found)[:600])
    return "\n".join(f'"{word}"' for word in escaped).encode()


def seeded(name: str, folder: Path) -> Path:
    """The folder of inputs of a reader, with what there is to begin with."""
    place = folder / name / "inputs"
    place.mkdir(parents=True, exist_ok=True)
    for data in [*READERS[name].whole(), *(f.read_bytes() for f in sorted((CORPUS / name).glob("*")))]:
        (place / hashlib.sha1(data).hexdigest()).write_bytes(data[:LONGEST])
    (folder / name / "words").write_bytes(words(name))
    return place


def run(name: str, *options: str) -> str:
    """What atheris says of one reader."""
    with tempfile.TemporaryDirectory() as temporary:
        surroundings = {**os.environ, "TMPDIR": temporary, "THERMOSPINDLE_CACHE": temporary, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-m", "tests.fuzz.one", name, *LIMITS, *options]
        done = subprocess.run(command, cwd=ROOT, env=surroundings, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    return done.stderr.decode(errors="replace")


def keep(name: str, place: Path) -> int:
    """Writes the corpus of a reader anew, the smallest first; its bytes."""
    with tempfile.TemporaryDirectory() as least:
        run(name, "-merge=1", least, str(place))
        files = sorted((f for f in Path(least).iterdir()), key=lambda f: f.stat().st_size)
        shutil.rmtree(CORPUS / name, ignore_errors=True)
        (CORPUS / name).mkdir(parents=True)
        total = 0
        for file in files:
            if (total := total + file.stat().st_size) > MOST:
                break
            shutil.copy(file, CORPUS / name / file.name[:12])
    return sum(f.stat().st_size for f in (CORPUS / name).iterdir())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(READERS))
    parser.add_argument("--seconds", type=int, default=60, help="for each reader")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "fuzz")
    parser.add_argument("--keep", action="store_true", help="make the corpus anew of what was found")
    asked, console = parser.parse_args(), Console()
    if unknown := set(asked.names) - set(READERS):
        parser.error(f"{', '.join(sorted(unknown))}: there are {', '.join(READERS)}")
    if importlib.util.find_spec("atheris") is None:
        parser.error("atheris is not there: pip install '.[fuzz]' (Linux; elsewhere it has to be built with Clang)")
    table, found = Table("reader", *DONE, "findings", show_edge=False), 0
    for name in asked.names or READERS:
        place = seeded(name, asked.out.resolve())
        before = set(place.parent.glob("*-*"))
        said = run(name, f"-max_total_time={asked.seconds}", f"-dict={place.parent / 'words'}", f"-artifact_prefix={place.parent}/", str(place))
        (place.parent / "said.txt").write_text(said, encoding="utf-8")
        told = [re.search(pattern, said, re.DOTALL) for pattern in DONE.values()]
        new = sorted(set(place.parent.glob("*-*")) - before)
        if not new and told[0] is None:
            raise SystemExit(f"{name}: {said[-3000:]}")
        found += len(new)
        table.add_row(name, *(m[1] if m else "?" for m in told), str(len(new)))
        kept = f", {keep(name, place)} bytes kept" if asked.keep else ""
        console.print(f"{name}: {told[0][1] if told[0] else '?'} tries, {len(new)} findings{kept}", markup=False)
        for file in new:
            console.print(f"    {file}; again: python -m tests.fuzz.one {name} {file}", markup=False, soft_wrap=True)
    console.print(table)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
