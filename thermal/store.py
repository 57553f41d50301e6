"""Influence on disk: one file a part, named by the hash of its question and of the code that answers it.

Files that were not asked for longest go first when all of them together take more than `MOST_BYTES`.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import warnings
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import skfem
from skfem import MeshTri

from thermospindle.model.whole import whole
from thermospindle.thermal.elastic import Race, Response
from thermospindle.thermal.mesh import PartMesh
from thermospindle.thermal.reduced import Reduced, Region
from thermospindle.thermal.refine import Convergence

ARRAYS = ("gain", "density", "shape")
SPACE = ("fields", "stiffness", "load", "motion")
MOST_BYTES = 256 << 20


def folder() -> Path | None:
    """Where results are kept; None when `THERMOSPINDLE_CACHE` is empty."""
    chosen = os.environ.get("THERMOSPINDLE_CACHE")
    if chosen is not None:
        return Path(chosen) if chosen else None
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "thermospindle"


@cache
def trusted(place: Path) -> bool:
    """Whether nobody but this user (and root) could have put something into a folder: it and all above it are theirs, and none is open to others.

    One that is not is passed over, with a warning: what lies there could be anybody's, however right it looks. Where there are no owners
    (Windows) a folder is as safe as its place.
    """
    if not hasattr(os, "geteuid"):
        return True
    for folder in (place, *place.resolve().parents):
        try:
            info = folder.stat()
        except OSError:
            return True  # is not there: nothing is read, and what is made is this user's
        shared = info.st_mode & stat.S_IWOTH or (info.st_mode & stat.S_IWGRP and info.st_gid not in (0, os.getegid()))
        if info.st_uid not in (0, os.geteuid()) or (shared and not (folder != place and info.st_mode & stat.S_ISVTX)):
            warnings.warn(f"{folder}: belongs to another user, or others may write there; nothing of {place} is used, and all is computed anew", stacklevel=2)
            return False
    return True


def load(question: str) -> tuple[Response, Convergence] | None:
    """The kept answer, or None where there is none or its file cannot be read."""
    if (found := _read(question)) is None:
        return None
    notes, data = found
    try:
        response = Response(_section(notes, data), _races(notes), *(data[name] for name in ARRAYS))
        return response, Convergence(tuple(notes["unknowns"]), tuple(notes["change"]), notes["error"])
    except Exception:  # as in `_read`
        return None


def save(question: str, response: Response, convergence: Convergence) -> None:
    """Keep an answer; a folder that cannot be written is passed over, since the answer can always be computed again."""
    notes = {"unknowns": convergence.unknowns, "change": convergence.change, "error": convergence.error}
    _write(question, response.section, response.races, notes, {name: getattr(response, name) for name in ARRAYS})


def load_space(question: str, regions: Sequence[Region]) -> Reduced | None:
    """The kept space of a part whose `regions` follow the temperature, or None."""
    if (found := _read(question)) is None:
        return None
    notes, data = found
    try:
        section = _section(notes, data)
        ordered = tuple(next(r for r in regions if r.name == name) for name in section.regions)
        fields, stiffness, load, motion = (data[name] for name in SPACE)
        return Reduced(section, _races(notes), ordered, fields, stiffness, load, motion, notes["error"], notes["solved"])
    except Exception:  # as in `_read`
        return None


def save_space(question: str, space: Reduced) -> None:
    """Keep a space, as `save` keeps an answer."""
    arrays = {name: getattr(space, name) for name in SPACE}
    _write(question, space.section, space.races, {"error": space.error, "solved": space.solved}, arrays)


def _section(notes: dict[str, Any], data: Mapping[str, np.ndarray]) -> PartMesh:
    mesh = MeshTri(np.ascontiguousarray(data["p"]), np.ascontiguousarray(data["t"]))
    return PartMesh(notes["part"], mesh, tuple(notes["regions"]), data["region_of"])


def _races(notes: dict[str, Any]) -> tuple[Race, ...]:
    return tuple(Race(ring, r, z and (z[0], z[1])) for ring, r, z in notes["races"])


def _read(question: str) -> tuple[dict[str, Any], dict[str, np.ndarray]] | None:
    """Notes and arrays of a file; it counts as asked for now."""
    file = _file(question)
    if file is None or not file.is_file():
        return None
    try:
        with np.load(file, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        notes = json.loads(str(arrays["notes"]))
        if notes["question"] != question or str(arrays.pop("digest")) != _digest(arrays):
            return None
        os.utime(file)
        return notes, arrays
    except Exception:  # a damaged archive fails in many ways (zipfile, tokenize, json); whatever it is, the answer is computed again
        return None


def _write(question: str, section: PartMesh, races: Sequence[Race], more: dict[str, Any], arrays: dict[str, Any]) -> None:
    file = _file(question)
    if file is None:
        return
    notes = more | {
        "question": question,
        "part": section.part,
        "regions": section.regions,
        "races": [(race.ring, race.r, race.z) for race in races],
    }
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with whole(file) as part:
            mesh = {"p": section.mesh.p, "t": section.mesh.t, "region_of": section.region_of}
            kept: dict[str, Any] = {name: np.asarray(a) for name, a in {"notes": json.dumps(notes), **mesh, **arrays}.items()}
            np.savez(part, digest=_digest(kept), **kept)
        _make_room(file.parent)
    except OSError:
        return


def _digest(arrays: Mapping[str, np.ndarray]) -> str:
    """Of names, shapes and bytes: what somebody wrote anew in the right form is not what was computed."""
    found = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        found.update(f"{name} {array.dtype} {array.shape} ".encode() + np.ascontiguousarray(array).tobytes())
    return found.hexdigest()


def _make_room(place: Path) -> None:
    """Remove the files that were not asked for longest, until the rest takes `MOST_BYTES` at most."""
    total = 0
    for file in sorted(place.glob("influence-*.npz"), key=lambda f: f.stat().st_mtime, reverse=True):
        total += file.stat().st_size
        if total > MOST_BYTES:
            file.unlink(missing_ok=True)


def _file(question: str) -> Path | None:
    place = folder()
    if place is None or not trusted(place):
        return None
    return place / f"influence-{hashlib.sha256((_code() + question).encode()).hexdigest()[:32]}.npz"


@cache
def _code() -> str:
    """The text of this package and the version of the finite-element library: new code does not trust old results."""
    return skfem.__version__ + "".join(f.read_text(encoding="utf-8") for f in sorted(Path(__file__).parent.glob("*.py")))
