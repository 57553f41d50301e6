"""What the pictures and tables of docs/ were made from, and how: `docs/made.toml`.

    python -m tests.docs_made FILE ...    after making files again: notes that they are of the scene and the files as they are now

Pictures of logs are taken under Xvfb, whose pointer stands in the middle of the screen: one of 7000
by 2600 has it beside the window. They come out at twice the size and are halved.
"""

from __future__ import annotations

import hashlib
import sys
import tomllib
from pathlib import Path

from tests.conftest import ROOT, SCENE
from thermospindle.model.scene.reading import content_hash, load

DOCS = ROOT / "docs"
NOTES = DOCS / "made.toml"
HOW = {
    "run.png": "spindle run hdd_2003 --out out; rerun out/run.rrd --screenshot-to docs/run.png --window-size 1400x900",
    "runout.png": "spindle runout hdd_2003 --speed 7200 --temperature 40 --out out; rerun out/*.rrd --screenshot-to docs/runout.png --window-size 1400x900",
    "map.png": "spindle map hdd_2003 --speed 7200 --out out; rerun out/map.rrd --screenshot-to docs/map.png --window-size 1400x900",
    "errors.png": "spindle compare hdd_2003 tests/data/foreign_bond --out out; out/pulls.png",
    "diagnosis.png": "spindle diagnose hdd_2003 tests/data/foreign_bond --out out; out/explanations.png",
    "workbench.png": "python -m tests.report.workbench_picture",
    "growth.png": "ROSS_PYTHON=... EMA_PYTHON=... make growth",
    "cluster.png": "python -m tests.bench_study --picture docs/cluster.png",
    "blind.txt": "python -m tests.blind.study --seeds A B; python -m tests.blind.score",
}


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16]


def notes() -> dict[str, dict[str, str]]:
    return tomllib.loads(NOTES.read_text(encoding="utf-8"))


def main(names: list[str]) -> None:
    there = notes() if NOTES.exists() else {}
    now = {name: {"how": HOW[name], "file": digest(DOCS / name), "scene": content_hash(load(SCENE))} for name in names}
    rows = [
        f'["{name}"]\nhow = "{row["how"]}"\nfile = "{row["file"]}"  # sha256, its beginning\nscene = "{row["scene"]}"  # content_hash\n'
        for name, row in sorted((there | now).items())
    ]
    NOTES.write_text("# Written by `python -m tests.docs_made FILE ...`.\n\n" + "\n".join(rows), encoding="utf-8")


if __name__ == "__main__":
    main([Path(name).name for name in sys.argv[1:]])
