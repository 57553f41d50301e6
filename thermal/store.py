"""Influence on disk: one file a part, named by the hash of its question and of the code that answers it."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import skfem
from skfem import MeshTri

from thermal.elastic import Race, Response
from thermal.mesh import PartMesh
from thermal.refine import Convergence

ARRAYS = ("gain", "density", "shape")


def folder() -> Path | None:
    """Where results are kept; None when `THERMOSPINDLE_CACHE` is empty."""
    chosen = os.environ.get("THERMOSPINDLE_CACHE")
    if chosen is not None:
        return Path(chosen) if chosen else None
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "thermospindle"


def load(question: str) -> tuple[Response, Convergence] | None:
    """The kept answer, or None where there is none or its file cannot be read."""
    file = _file(question)
    if file is None or not file.is_file():
        return None
    try:
        with np.load(file, allow_pickle=False) as data:
            notes = json.loads(str(data["notes"]))
            if notes["question"] != question:
                return None
            mesh = MeshTri(np.ascontiguousarray(data["p"]), np.ascontiguousarray(data["t"]))
            section = PartMesh(notes["part"], mesh, tuple(notes["regions"]), data["region_of"])
            response = Response(section, tuple(Race(*race) for race in notes["races"]), *(data[name] for name in ARRAYS))
        return response, Convergence(tuple(notes["unknowns"]), tuple(notes["change"]), notes["error"])
    except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile):
        return None


def save(question: str, response: Response, convergence: Convergence) -> None:
    """Keep an answer; a folder that cannot be written is passed over, since the answer can always be computed again."""
    file = _file(question)
    if file is None:
        return
    section = response.section
    notes = {
        "question": question,
        "part": section.part,
        "regions": section.regions,
        "races": [(race.ring, race.r) for race in response.races],
        "unknowns": convergence.unknowns,
        "change": convergence.change,
        "error": convergence.error,
    }
    arrays = {name: getattr(response, name) for name in ARRAYS}
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent) as scratch:
            part = Path(scratch) / file.name
            np.savez(part, notes=json.dumps(notes), p=section.mesh.p, t=section.mesh.t, region_of=section.region_of, **arrays)
            os.replace(part, file)
    except OSError:
        return


def _file(question: str) -> Path | None:
    place = folder()
    return place / f"influence-{hashlib.sha256((_code() + question).encode()).hexdigest()[:32]}.npz" if place else None


@cache
def _code() -> str:
    """The text of this package and the version of the finite-element library: new code does not trust old results."""
    return skfem.__version__ + "".join(f.read_text(encoding="utf-8") for f in sorted(Path(__file__).parent.glob("*.py")))
