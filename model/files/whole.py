"""Files and folders that are written whole or not at all.

Everything is written in a hidden work folder beside its place and moved there when it is complete. What stood there before is moved
into the same work folder first and deleted last, so at every moment the old or the new one can be had: when the program is killed
between the two moves, the next writer at that place moves the old one back. A lock that dies with its process tells the work
folder of a killed run from that of one still running.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from errno import EEXIST, ENOENT, ENOTEMPTY
from glob import escape
from pathlib import Path

from thermospindle.model.errors import BadInput

try:
    import fcntl
except ImportError:  # Windows: without locks of folders, what killed runs left is not told from what others write, and stays
    fcntl = None  # type: ignore[assignment]

HELD = -1
ATTEMPTS = 100  # to put something where other writers put theirs, too
NEW, OLD = "new", "old"
"""Folders of a work folder: what is being written, and what it replaces; the thing in each has the name of its place."""


def check_not_here(path: Path) -> None:
    """`BadInput` where the folder in which one stands, or one above it, would be replaced: an empty
    name is such a one, too, and a shell would stand in what is gone."""
    if path.is_dir() and (path := path.resolve()) in (here := Path.cwd(), *here.parents):
        raise BadInput(f"{path}: is where you stand, or above it, and would be replaced; name a new or empty folder")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Where to write the file or folder that shall stand at `path`: it is moved there when the block ends well, removed otherwise.

    The block must make it, a file or a folder; what stands at `path` then is replaced. The folder of `path` must exist. OSError, as
    the system has it, where nothing can be written; it and a `BadInput` of the block name `path` and not the work folder.
    """
    path = Path(path).absolute()
    check_not_here(path)
    _tidy(path)
    work, lock = _work_folder(path)
    try:
        new = work / NEW / path.name
        new.parent.mkdir()
        try:
            yield new
        except BadInput as error:
            raise BadInput(str(error).replace(str(new), str(path))) from None
        _exchange(path, new, work / OLD / path.name)
    finally:
        shutil.rmtree(work, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def _exchange(path: Path, new: Path, old: Path) -> None:
    """Put `new` in the place of `path`; `old` keeps what stood there, and goes back if `new` cannot
    be moved. Of several writers the last one's stays, whole."""
    old.parent.mkdir()
    for attempt in range(ATTEMPTS):
        try:
            if path.is_dir():
                os.replace(path, old)
            os.replace(new, path)
            return
        except OSError as error:  # another writer has taken away what stood here, or put its own
            if error.errno not in (ENOENT, ENOTEMPTY, EEXIST) or not new.exists() or attempt == ATTEMPTS - 1:
                _put_back(old, path)
                raise OSError(error.errno, error.strerror, str(path)) if error.errno else error from None
        except BaseException:
            _put_back(old, path)
            raise
        shutil.rmtree(old, ignore_errors=True)


def _put_back(old: Path, path: Path) -> None:
    if old.exists() and not path.exists():
        os.replace(old, path)


def _prefix(path: Path) -> str:
    """Begin of the names of work folders for `path`: short enough for any file system."""
    return f".{path.name[:80]}.spindle-"


def _work_folder(path: Path) -> tuple[Path, int | None]:
    """A new work folder and its lock; made again where another writer took it for a dead one's before it was locked."""
    while True:
        try:
            work = Path(tempfile.mkdtemp(prefix=_prefix(path), dir=path.parent))
        except OSError as error:
            error.filename = str(path)  # nobody has asked for the work folder
            raise
        lock = _lock(work)
        if lock is None or (lock != HELD and work.exists()):
            return work, lock
        if lock != HELD:
            os.close(lock)


def tidy(folder: Path) -> None:
    """Remove what killed runs left of anything in a folder, and put back what they had moved away: of what is never written again too."""
    _clear(folder, ".*.spindle-*")


def _tidy(path: Path) -> None:
    _clear(path.parent, f"{escape(_prefix(path))}*")


def _clear(folder: Path, pattern: str) -> None:
    """Put back what killed runs had moved away, and remove their work folders."""
    for work in folder.glob(pattern):
        lock = _lock(work)
        if lock is None or lock == HELD:
            continue  # another process is writing there, or nobody can tell
        try:
            for old in (work / OLD).glob("*"):
                if not (place := folder / old.name).exists():
                    os.replace(old, place)
            shutil.rmtree(work, ignore_errors=True)
        finally:
            os.close(lock)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """The only process that writes into a folder bit by bit; `BadInput` where another one does, until it ends or dies.

    Without locks of folders (Windows, some network drives) nothing is said. FileNotFoundError where there is no such folder.
    """
    held = _lock(folder)
    if held == HELD:
        folder.stat()
        raise BadInput(f"{folder}: another run is writing there; wait for it to end, or name another folder")
    try:
        yield
    finally:
        if held is not None:
            os.close(held)


def _lock(folder: Path) -> int | None:
    """A descriptor that holds the lock of a folder until it is closed or the process ends; `HELD`
    where another process has it or the folder is gone, and None where folders have no locks."""
    if fcntl is None:
        return None
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except FileNotFoundError:  # another writer took it for a dead one's
        return HELD
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        return HELD if isinstance(error, BlockingIOError) else None
    return descriptor
