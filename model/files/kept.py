"""Results kept on disk between runs: one file a result, named by the hash of its question and of the code that answers it.

They stand in `THERMOSPINDLE_CACHE` (a folder; empty for none), by default `$XDG_CACHE_HOME/thermospindle`. Only a folder that nobody else
can write to is used, and nothing in it is trusted that does not have its digest. Files that were not asked for longest go first when all
of them together take more than `MOST_BYTES`. A file that is damaged, or a folder that cannot be written, costs time, never a result.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.files.whole import whole

MOST_BYTES = 256 << 20
KINDS = ("influence", "modes")  # how files begin that may be removed


def folder() -> Path | None:
    """Where results are kept; None when `THERMOSPINDLE_CACHE` is empty."""
    chosen = os.environ.get("THERMOSPINDLE_CACHE")
    if chosen is not None:
        return Path(chosen) if chosen else None
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "thermospindle"


@cache
def trusted(place: Path) -> bool:
    """Whether nobody but this user (and root) could have put something into a folder: it and all
    above it are theirs, and none is open to others.

    One that is not is passed over, with a warning: what lies there could be anybody's, however right it looks. Where there are no owners
    (Windows) a folder is as safe as its place.
    """
    if not hasattr(os, "geteuid"):
        return True
    for folder in (place, *place.resolve().parents):
        try:
            info = folder.stat()
        except OSError:
            continue  # is not there: what is made is this user's, in what is above it
        shared = info.st_mode & stat.S_IWOTH or (info.st_mode & stat.S_IWGRP and info.st_gid not in (0, os.getegid()))
        if info.st_uid not in (0, os.geteuid()) or (shared and not (folder != place and info.st_mode & stat.S_ISVTX)):
            warnings.warn(f"{folder}: belongs to another user, or others may write there; nothing of {place} is used, and all is computed anew", stacklevel=2)
            return False
    return True


@cache
def code(package: Path) -> str:
    """The text of a package's modules: new code does not trust old results."""
    return "".join(f.read_text(encoding="utf-8") for f in sorted(package.glob("*.py")))


def read(kind: str, question: str, code: str) -> tuple[dict[str, Any], dict[str, np.ndarray]] | None:
    """Notes and arrays that the `code` (its text and versions) answered a question of some `kind`
    with, None where there are none; they count as asked for now."""
    file = _file(kind, question, code)
    if file is None or not file.is_file():
        return None
    try:
        with np.load(file, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        notes = json.loads(str(arrays["notes"]))
        if notes["question"] != question or str(arrays.pop("digest")) != digest(arrays):
            return None
        os.utime(file)
        return notes, arrays
    except Exception:  # a damaged archive fails in many ways (zipfile, tokenize, json); whatever it is, the answer is computed again
        return None


def write(kind: str, question: str, code: str, notes: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    """Keep an answer; a folder that cannot be written is passed over, since the answer can always be computed again."""
    file = _file(kind, question, code)
    if file is None:
        return
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with whole(file) as part:
            kept: dict[str, Any] = {name: np.asarray(a) for name, a in {**arrays, "notes": json.dumps({**notes, "question": question})}.items()}
            np.savez(part, digest=digest(kept), **kept)
        _make_room(file.parent)
    except OSError:
        return


def digest(arrays: Mapping[str, np.ndarray]) -> str:
    """Of names, shapes and bytes: what somebody wrote anew in the right form is not what was computed."""
    found = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        found.update(f"{name} {array.dtype} {array.shape} ".encode() + np.ascontiguousarray(array).tobytes())
    return found.hexdigest()


def _make_room(place: Path) -> None:
    """Remove the files that were not asked for longest, until the rest takes `MOST_BYTES` at most."""
    total = 0
    every = [f for kind in KINDS for f in place.glob(f"{kind}-*.npz")]
    for file in sorted(every, key=lambda f: f.stat().st_mtime, reverse=True):
        total += file.stat().st_size
        if total > MOST_BYTES:
            file.unlink(missing_ok=True)


def _file(kind: str, question: str, code: str) -> Path | None:
    place = folder()
    if kind not in KINDS:
        raise ValueError(f"{kind!r} is kept nowhere; there are {', '.join(KINDS)}")
    if place is None or not trusted(place):
        return None
    return place / f"{kind}-{hashlib.sha256((code + question).encode()).hexdigest()[:32]}.npz"
