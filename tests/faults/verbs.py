"""Every verb that writes, with little to do: its command, what may stand there before, and when what it wrote is whole."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.conftest import ROOT, SCENE
from tests.torture.wholes import MAPPING, TABLE, diagnosis
from thermospindle.report.folder import MARK, digest

JANG = SCENE / "measured" / "jang_2003"
STUDY = 'title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20]\ndraws = 6\nchunk = 1\n'


def prepare(folder: Path) -> Path:
    """What the verbs read, in a new folder."""
    folder.mkdir(parents=True)
    (folder / "lab.csv").write_bytes(TABLE)
    (folder / "lab.toml").write_bytes(MAPPING)
    (folder / "d.json").write_bytes(diagnosis())
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    return folder


def tree(path: Path) -> dict[str, str]:
    """Digests of all files of a folder, or of one."""
    if path.is_file():
        return {"": digest(path)}
    return {p.relative_to(path).as_posix(): digest(p) for p in sorted(path.rglob("*")) if not p.is_dir()}


def marked(path: Path, reference: dict[str, str]) -> bool:
    """An output folder holds just what its mark lists, and the same files as `reference`."""
    try:
        told = json.loads((path / MARK).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError):
        return False
    own = {name: value for name, value in tree(path).items() if name != MARK}
    return told == own and set(own) | {MARK} == set(reference)


def same(path: Path, reference: dict[str, str]) -> bool:
    """Byte for byte what a run that nothing disturbed writes."""
    return tree(path) == reference


@dataclass(frozen=True)
class Verb:
    """`target` is what it writes: a folder that it replaces (`marked`), or something that it only makes new (`same`)."""

    name: str
    command: tuple[str, ...]  # {} is the folder of `prepare`
    target: str = "out"
    whole: Callable[[Path, dict[str, str]], bool] = marked
    weight: float = 1.0  # of its share in all kills: less where it takes long

    def line(self, folder: Path, *more: str) -> list[str]:
        return [part.format(folder) for part in (*self.command, *more)]


S, J = str(SCENE), str(JANG)
OUT = ("--out", "{}/out")
VERBS = (
    Verb("new", ("new", "mine", "--like", "hdd", *OUT), whole=same, weight=2),
    Verb("modes", ("modes", S, *OUT), weight=2),
    Verb("table", ("table", S, "--temperatures", "20", *OUT), weight=2),
    Verb("static", ("static", S, *OUT), weight=2),
    Verb("check", ("check", S, *OUT), weight=2),
    Verb("add", ("add", S, "bond_softening", *OUT), weight=2),
    Verb("draft", ("draft", "{}/d.json", "--out", "{}/own_effect.py"), target="own_effect.py", whole=same, weight=2),
    Verb("import", ("import", "{}/lab.csv", "--mapping", "{}/lab.toml", *OUT), whole=same, weight=2),
    Verb("import form", ("import", "{}/lab.csv", "--mapping", "{}/new.toml"), target="new.toml", whole=same, weight=2),
    Verb("impact", ("impact", S, "--hits", "2", *OUT), weight=1.5),
    Verb("simulate", ("simulate", S, "--temperatures", "20", "--hits", "2", *OUT), whole=same, weight=1.5),
    Verb("run", ("run", S, "--temperatures", "20", "--hits", "2", *OUT), weight=1),
    Verb("compare", ("compare", S, J, *OUT), weight=1.5),
    Verb("study", ("study", "{}/study.toml", *OUT), whole=same, weight=2),
    Verb("warmup", ("warmup", S, "--soak", "40", *OUT), weight=1),
    Verb("runout", ("runout", S, "--speed", "7200", "--seconds", "0.3", *OUT), weight=1),
    Verb("map", ("map", S, "--speed", "7200", "--temperatures", "20", "30", *OUT), weight=0.5),
    Verb("save", ("save", S, J, "{}/out"), weight=1),
    Verb("diagnose", ("diagnose", S, J, *OUT), weight=0.25),
    Verb("ladder", ("ladder", S, J, "--effects", "bond_softening", *OUT), weight=0.25),
    Verb("report", ("report", S, "--temperatures", "20", "--hits", "2", *OUT), weight=0.25),
)
QUICKEST = next(v for v in VERBS if v.name == "add")
"""A third of what others take to start, and it replaces an older result: the one of every run of the tests."""


def surroundings(cache: Path, **more: str) -> dict[str, str]:
    """The environment of a run: its own cache, this checkout, and `more`."""
    own = {"PYTHONPATH": str(ROOT), "THERMOSPINDLE_CACHE": str(cache), "OPENBLAS_NUM_THREADS": "1", "COLUMNS": "100"}
    return {**os.environ, **own, **more}


def launched(folder: Path, line: list[str], cache: Path, kill_at: int = 0, **more: object) -> subprocess.CompletedProcess:
    """One run of a verb as a process of its own; where `kill_at` is told, killed before that act on files below `folder`."""
    count = folder.parent / "acts"
    count.unlink(missing_ok=True)
    command = [sys.executable, "-m", "tests.faults.launch", str(folder), str(kill_at), str(count), *line]
    return subprocess.run(command, env=surroundings(cache), cwd=folder, capture_output=True, text=True, timeout=3600, **more)


def acts(folder: Path) -> int:
    return int((folder.parent / "acts").read_text(encoding="utf-8"))


def work_folders(folder: Path) -> list[Path]:
    """What runs that were killed left beside their place."""
    return sorted(p for p in folder.rglob(".*") if ".spindle-" in p.name)


def fresh(folder: Path) -> None:
    """Nothing at all of what was there before."""
    shutil.rmtree(folder, ignore_errors=True)
