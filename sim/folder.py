"""Output folders that are written whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from model.scene import BadInput

MARK = "made-by-spindle.json"
"""File that every output folder holds; only a folder with it, or an empty one, is ever replaced."""


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A temporary folder beside `path` that takes its place when the block ends well, and vanishes when it does not.

    Raises `BadInput` if something that spindle did not make stands at `path`.
    """
    path = path.resolve()
    if path.exists() and (not path.is_dir() or (any(path.iterdir()) and not (path / MARK).is_file())):
        raise BadInput(f"--out {path}: holds something that spindle did not write; name a new or empty folder")
    path.parent.mkdir(parents=True, exist_ok=True)
    work = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        yield work
        work.chmod(0o755)
        if path.exists():
            shutil.rmtree(path)
        work.rename(path)
    except BaseException:
        shutil.rmtree(work, ignore_errors=True)
        raise
