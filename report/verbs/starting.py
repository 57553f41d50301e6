"""The verbs `new` and `check`: a scene of one's own, and what the program understands of it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from thermospindle.model.errors import BadInput
from thermospindle.model.scene.fields import read_toml
from thermospindle.report.folder import whole_folder
from thermospindle.report.verbs.answer import Answer, answered, with_effects, write_json

TEMPLATES = Path(__file__).parents[2] / "scenes" / "templates"
"""Commented scenes to start from, a file each."""


def new(name: str, like: str, out: Path | None = None) -> Answer:
    """A commented scene called `name` to start from, in the new folder `out`, by default ./`name`."""
    if not name.strip() or any(c in name for c in "/\\") or not name.isprintable() or name in (".", ".."):
        raise BadInput(f"NAME {name!r}: is no name of a folder; --out takes a path")
    kinds = sorted(file.stem for file in TEMPLATES.glob("*.toml"))
    if like not in kinds:
        raise BadInput(f"--like {like}: allowed are {', '.join(kinds)}")
    folder = Path(name) if out is None else Path(out)
    if folder.exists() or folder.is_symlink():
        raise BadInput(f"{folder}: is there already; new overwrites nothing, so name another folder with --out")
    text = (TEMPLATES / f"{like}.toml").read_text(encoding="utf-8")
    with whole_folder(folder) as written:
        (written / "spindle.toml").write_text(text.replace('"TITLE"', json.dumps(name, ensure_ascii=False), 1), encoding="utf-8")
        read_toml(written / "spindle.toml")  # whatever characters its name has
    file = folder / "spindle.toml"
    typed = shlex.quote(str(folder))

    def show(console: Console) -> None:
        console.print(f"{file}: a spindle like {like}, every key explained. Then:", highlight=False)
        console.print(f"  spindle check {typed}     what the program understands of it\n  spindle modes {typed}", highlight=False)

    return Answer({"scene": str(folder), "file": str(file), "like": like, "warnings": []}, show)


def check(scene: Path, effect_files: Sequence[Path] = (), out: Path | None = None) -> Answer:
    """What the program understands of a scene, assumes and finds odd; a folder holds `check.json`, `check.html` and the picture."""
    asked = dict(locals())
    from thermospindle.model.machine import Condition  # `new` computes nothing, and waits for nothing that does
    from thermospindle.report.check.odd import told
    from thermospindle.report.check.words import show_check
    from thermospindle.sim.operating import operating_point

    spindle, catalogue = with_effects(scene, effect_files)
    point = operating_point(spindle, Condition(spindle.reference_temperature))
    values = told(spindle, point, catalogue)

    def page(folder: Path) -> None:
        from thermospindle.report.check.page import write_check  # matplotlib takes its time to load

        write_check(point, values, folder)

    write = write_json("check.json", page)
    return answered(values, lambda console: show_check(console, values), out, {"verb": "check"} | asked, write)
