"""Output folders: written whole or not at all, and replaced only where they hold nothing but what spindle wrote."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import datetime
from pathlib import Path
from typing import Any

from thermospindle.model.errors import BadInput
from thermospindle.model.files.whole import ATTEMPTS, check_not_here, whole

MARK = "made-by-spindle.json"
"""File that every output folder holds: how it was made, its answer, and a digest of every file that was written beside it."""

COMMAND: ContextVar[str] = ContextVar("COMMAND", default="")
"""The command line that a verb was called by; empty where it was called from Python."""


def check_folder(path: Path, scene: bool = False) -> None:
    """`BadInput` if something stands at `path` that spindle did not write, or that was changed
    since; or a scene, in whose place only another `scene` comes."""
    path = path.resolve()
    check_not_here(path)  # before what it holds is looked at
    _refuse_foreign_now(path)
    if not scene and (path / "spindle.toml").is_file():
        raise BadInput(f"--out {path}: holds a scene, spindle.toml; name a new or empty folder")
    for parent in path.parents:
        if parent.is_file():
            raise BadInput(f"--out {path}: {parent} is a file, so no folder can be made in it; name a new or empty folder")


@contextmanager
def whole_folder(path: Path, scene: bool = False) -> Iterator[Path]:
    """A temporary folder beside `path` that takes its place when the block ends well, and vanishes
    when it does not; `BadInput` as of `check_folder`."""
    path = path.resolve()
    check_folder(path, scene)
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as folder:
        folder.mkdir()
        yield folder


def mark(folder: Path, options: Mapping[str, Any], answer: Mapping[str, Any]) -> None:
    """Write the mark of an output folder, when all its files stand, and into its pages with what they were made and when."""
    if any(folder.glob("*.html")):
        from thermospindle.report.page.report import stamp

        stamp(folder, COMMAND.get() or _call(options), datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"))
    record = {"options": dict(options), "answer": dict(answer), "files": {name: digest(folder / name) for name in _entries(folder)}}
    (folder / MARK).write_text(json.dumps(record, indent=1, default=str), encoding="utf-8")


def _call(options: Mapping[str, Any]) -> str:
    """The call of a verb's function from Python."""
    said = (f"{name}={(str(value) if isinstance(value, Path) else value)!r}" for name, value in options.items() if name != "verb")
    return f"{options['verb']}({', '.join(said)})"


def _refuse_foreign_now(path: Path) -> None:
    """`_refuse_foreign`, of what stood there all the while: another writer may have exchanged it meanwhile."""
    for _ in range(ATTEMPTS):
        before = _identity(path)
        try:
            _refuse_foreign(path)
            return
        except (BadInput, OSError):
            if _identity(path) == before:
                raise


def _identity(path: Path) -> tuple[int, int, int] | None:
    """What stands at a path, whatever it holds; None where nothing does. A number of an inode is soon given to another."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_ctime_ns


def _refuse_foreign(path: Path) -> None:
    if not path.exists() and not path.is_symlink():
        return
    if path.is_file():
        raise BadInput(f"--out {path}: is a file; name a new or empty folder")
    if not path.is_dir() or (any(path.iterdir()) and not (path / MARK).is_file()):
        raise BadInput(f"--out {path}: holds something that spindle did not write; name a new or empty folder")
    written = _written(path)
    for name in _entries(path):
        if name != MARK and name not in written:
            raise BadInput(f"--out {path}: holds {name}, which spindle did not write; name a new or empty folder, or take it out")
        if name != MARK and digest(path / name) != written[name]:
            raise BadInput(f"--out {path}: {name} was changed since spindle wrote it; name a new or empty folder, or take it out")


def _written(path: Path) -> dict[str, str]:
    """Digests by name that the mark of a folder lists; none of a mark that cannot be read."""
    try:
        files = json.loads((path / MARK).read_text(encoding="utf-8"))["files"]
        return {str(name): str(value) for name, value in files.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _entries(folder: Path) -> list[str]:
    """Everything in a folder that is no folder itself, by its path from there; links are not followed."""
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_symlink() or not p.is_dir())


def digest(file: Path) -> str:
    """A name for what a file holds; of what is no file, for where it points."""
    if file.is_symlink() or not file.is_file():
        return "no file"
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()[:16]
