"""Influence on disk (`model.files.kept`), a file a part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import skfem
from skfem import MeshTri

from thermospindle.model import material
from thermospindle.model.files import kept
from thermospindle.model.rotor import section as drawn_section
from thermospindle.thermal.elastic import Race, Response
from thermospindle.thermal.mesh import PartMesh
from thermospindle.thermal.reduced import Reduced, Region
from thermospindle.thermal.refine import Convergence

ARRAYS = ("gain", "density", "shape", "stiffening")
SPACE = ("fields", "stiffness", "load", "motion")
KIND = "influence"


def load(question: str) -> tuple[Response, Convergence] | None:
    """The kept answer, or None where there is none or its file cannot be read."""
    if (found := _read(question)) is None:
        return None
    notes, data = found
    try:
        response = Response(_section(notes, data), _races(notes), *(data[name] for name in ARRAYS))
        return response, Convergence(tuple(notes["unknowns"]), tuple(notes["change"]), notes["error"])
    except Exception:  # as in `kept.read`
        return None


def save(question: str, response: Response, convergence: Convergence) -> None:
    """Keep an answer."""
    notes = {"unknowns": convergence.unknowns, "change": convergence.change, "error": convergence.error}
    _write(question, response.section, response.races, notes, {name: getattr(response, name) for name in ARRAYS})


def load_space(question: str, section: PartMesh, regions: Sequence[Region]) -> Reduced | None:
    """The kept space of a part whose `regions` follow the temperature, if it was made on the mesh of `section`, or None."""
    if (found := _read(question)) is None:
        return None
    notes, data = found
    try:
        if not all(np.array_equal(data[name], getattr(section.mesh, name)) for name in ("p", "t")):
            return None
        ordered = tuple(next(r for r in regions if r.name == name) for name in section.regions)
        fields, stiffness, load, motion = (data[name] for name in SPACE)
        return Reduced(section, _races(notes), ordered, fields, stiffness, load, motion, notes["error"], notes["solved"])
    except Exception:  # as in `kept.read`
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
    return kept.read(KIND, question, _code())


def _write(question: str, section: PartMesh, races: Sequence[Race], more: dict[str, Any], arrays: dict[str, Any]) -> None:
    notes = more | {"part": section.part, "regions": section.regions, "races": [(race.ring, race.r, race.z) for race in races]}
    kept.write(KIND, question, _code(), notes, {"p": section.mesh.p, "t": section.mesh.t, "region_of": section.region_of, **arrays})


@cache
def _code() -> str:
    """The text of this package and of what it asks of others, and the versions of the libraries."""
    libraries = f"{skfem.__version__} {np.__version__} {scipy.__version__}"
    return libraries + kept.code(Path(__file__).parent) + "".join(Path(str(m.__file__)).read_text(encoding="utf-8") for m in (material, drawn_section))
