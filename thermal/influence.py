"""The influence of thermal strain on the motion of the rings: computed once for a geometry and elasticity, then kept.

It is kept in the process, and on disk in `THERMOSPINDLE_CACHE` (a folder; empty for none), by default
`$XDG_CACHE_HOME/thermospindle`, under a hash of all it depends on, this package's code included.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from model.machine import Region, Spindle
from thermal import store
from thermal.elastic import Elasticity, Race, Response
from thermal.mesh import PartMesh, tiled
from thermal.refine import Convergence, converged_response

TOLERANCE = 1e-4
"""Of the ring motions, relative to the largest: 0.3 nm for the reference spindle at 60 C, 0.1 % of its preload."""

CELLS_ACROSS = 10  # of the mesh before refinement, over the longer side of the part


@dataclass(frozen=True, eq=False)
class Influence:
    """For every part that carries rings, how thermal strain moves them, and how well the mesh has converged."""

    responses: Mapping[str, Response]
    convergence: Mapping[str, Convergence]

    @property
    def sections(self) -> dict[str, PartMesh]:
        return {part: response.section for part, response in self.responses.items()}

    @property
    def error(self) -> float:
        """Estimated relative error of the ring motions, the larger of the parts'."""
        return max(c.error for c in self.convergence.values())


@dataclass(frozen=True)
class Elastic:
    """All that the influence of one part depends on."""

    part: str
    regions: tuple[Region, ...]
    elasticity: tuple[tuple[str, Elasticity], ...]
    races: tuple[Race, ...]
    tolerance: float


def influence(
    spindle: Spindle,
    tolerance: float = TOLERANCE,
    temperatures: Mapping[str, float] | None = None,
    sections: Mapping[str, PartMesh] | None = None,
) -> Influence:
    """Influence of every region's thermal strain on all ring motions, right to `tolerance` (relative, estimated).

    `temperatures` (C, by region) are where Young's modulus is taken, by default the reference temperature. `sections` are
    meshes to start the refinement from instead of the built-in ones, by part; these results are not kept.
    Raises ValueError for a section that does not hold together, NotConverged when the tolerance cannot be met.
    """
    answers = {}
    for part in dict.fromkeys(g.part for g in spindle.regions):
        question = _question(spindle, part, tolerance, temperatures)
        start = (sections or {}).get(question.part)
        answers[question.part] = _kept(question) if start is None else _answer(question, start)
    return Influence({p: response for p, (response, _) in answers.items()}, {p: how for p, (_, how) in answers.items()})


def elasticity(spindle: Spindle, temperatures: Mapping[str, float] | None = None) -> dict[str, Elasticity]:
    """Elastic constants of every region at its temperature (C), by default the reference temperature."""
    constants = {}
    for g in spindle.regions:
        material = spindle.materials[g.material]
        temperature = spindle.reference_temperature if temperatures is None else temperatures[g.name]
        constants[g.name] = Elasticity(material.youngs_modulus(temperature), material.poisson_ratio)
    return constants


def races(spindle: Spindle, part: str) -> tuple[Race, ...]:
    """The raceway faces on `part`: the outside of inner rings, the bore of outer rings; lower bearing first."""
    inner = [(b.inner_ring, 1) for b in spindle.bearings]
    outer = [(b.outer_ring, 0) for b in spindle.bearings]
    faces = [(spindle.region(name), side) for pair in zip(inner, outer, strict=True) for name, side in pair]
    return tuple(Race(g.name, g.r[side]) for g, side in faces if g.part == part)


def _question(spindle: Spindle, part: str, tolerance: float, temperatures: Mapping[str, float] | None) -> Elastic:
    regions = tuple(g for g in spindle.regions if g.part == part)
    moduli = elasticity(spindle, temperatures)
    return Elastic(part, regions, tuple((g.name, moduli[g.name]) for g in regions), races(spindle, part), tolerance)


@lru_cache(maxsize=64)
def _kept(question: Elastic) -> tuple[Response, Convergence]:
    if (found := store.load(repr(question))) is not None:
        return found
    size = max(np.ptp([g.r for g in question.regions]), np.ptp([g.z for g in question.regions])) / CELLS_ACROSS
    answer = _answer(question, tiled(question.part, question.regions, size))
    store.save(repr(question), *answer)
    return answer


def _answer(question: Elastic, start: PartMesh) -> tuple[Response, Convergence]:
    return converged_response(start, dict(question.elasticity), question.races, question.tolerance)
