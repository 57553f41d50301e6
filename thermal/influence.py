"""The influence of thermal strain on the motion of the rings: computed once for a geometry and elasticity, then kept.

Where a modulus follows the temperature, the influence at any temperatures comes from a reduced basis (`thermal.reduced`), made once for a
section and its laws.

It is kept in the process, and on disk (`model.files.kept`) under a hash of all it depends on, this package's code included.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial

import numpy as np

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Bearing, RollerBearing, Spindle, kept
from thermospindle.model.material import Law
from thermospindle.thermal import store
from thermospindle.thermal.elastic import Elasticity, Race, Response
from thermospindle.thermal.mesh import PartMesh, tiled
from thermospindle.thermal.reduced import Reduced, reduced
from thermospindle.thermal.reduced import Region as Softening
from thermospindle.thermal.refine import Convergence, converged_response

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
        if (start := (sections or {}).get(part)) is not None:
            answers[part] = _answer(_question(spindle, part, tolerance, temperatures), start)
        elif (moduli := _softened(spindle, part, temperatures)) is not None:
            family = _family(spindle, part, tolerance)
            answers[part] = _response(family, moduli), _kept(family.reference)[1]
        else:
            answers[part] = _kept(_question(spindle, part, tolerance, None))
    return Influence({p: response for p, (response, _) in answers.items()}, {p: how for p, (_, how) in answers.items()})


@dataclass(frozen=True, eq=False)
class Gain:
    """Motion of `races` (2 races, regions) in m for unit strains of `regions`."""

    races: tuple[Race, ...]
    regions: tuple[str, ...]
    value: np.ndarray


def gains(spindle: Spindle, tolerance: float, temperatures: Mapping[str, float]) -> tuple[Gain, ...]:
    """The gains of `influence` at temperatures (C, by region), part by part, without what only fields of temperature need."""
    return tuple(gain_at(temperatures) for gain_at in _gains(_of(spindle), tolerance))


@dataclass(frozen=True)
class _Of:
    """What of a spindle its influence depends on."""

    regions: tuple[Region, ...]
    materials: tuple[tuple[str, Law, float], ...]
    races: tuple[tuple[Race, Race], ...]
    reference_temperature: float
    spindle: Spindle = field(compare=False)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash((self.regions, self.materials, self.races, self.reference_temperature))


@kept
def _of(spindle: Spindle) -> _Of:
    made_of = tuple((name, m.youngs_modulus, m.poisson_ratio) for name, m in spindle.materials.items())
    return _Of(spindle.regions, made_of, tuple(every_race(spindle).values()), spindle.reference_temperature, spindle)


@lru_cache(maxsize=64)
def _gains(of: _Of, tolerance: float) -> tuple[Callable[[Mapping[str, float]], Gain], ...]:
    """The gain of every part as a function of its regions' temperatures."""
    found = []
    for part in dict.fromkeys(g.part for g in of.regions):
        family = _family(of.spindle, part, tolerance)
        if all(len(region.youngs_modulus.value) == 1 for region in family.regions):
            response = _kept(family.reference)[0]
            found.append(partial(_constant, Gain(response.races, response.section.regions, response.gain)))
        else:
            found.append(partial(_softening, _space(family)))
    return tuple(found)


def at_reference(spindle: Spindle) -> tuple[Response, ...]:
    """`influence` at the reference temperature to its own tolerance, part by part."""
    return _at_reference(_of(spindle))


@lru_cache(maxsize=64)
def _at_reference(of: _Of) -> tuple[Response, ...]:
    return tuple(influence(of.spindle).responses.values())


def _constant(gain: Gain, temperatures: Mapping[str, float]) -> Gain:
    return gain


def _softening(space: Reduced, temperatures: Mapping[str, float]) -> Gain:
    moduli = np.array([region.youngs_modulus(temperatures[region.name]) for region in space.regions])
    return Gain(space.races, space.section.regions, space.solution(moduli)[0])


def _softened(spindle: Spindle, part: str, temperatures: Mapping[str, float] | None) -> tuple[tuple[str, float], ...] | None:
    """Moduli (Pa) by region of a part at its temperatures; None where they are those of the reference."""
    if temperatures is None:
        return None
    now = elasticity(spindle, temperatures)
    own = [g for g in spindle.regions if g.part == part]
    if all(len(spindle.materials[g.material].youngs_modulus.value) == 1 for g in own):
        return None
    return tuple((g.name, now[g.name].youngs_modulus) for g in own)


@dataclass(frozen=True)
class Family:
    """The influence of one part at all temperatures: that at `temperature` (C), and what its regions' moduli follow."""

    reference: Elastic
    regions: tuple[Softening, ...]
    temperature: float


def _family(spindle: Spindle, part: str, tolerance: float) -> Family:
    own = [g for g in spindle.regions if g.part == part]
    made_of = {g.name: spindle.materials[g.material] for g in own}
    regions = tuple(Softening(name, m.youngs_modulus, m.poisson_ratio) for name, m in made_of.items())
    return Family(_question(spindle, part, tolerance, None), regions, spindle.reference_temperature)


@lru_cache(maxsize=16)
def _space(family: Family) -> Reduced:
    response = _kept(family.reference)[0]
    if (found := store.load_space(repr(family), response.section, family.regions)) is not None:
        return found
    space = reduced(response.section, response.races, family.regions, family.temperature)
    store.save_space(repr(family), space)
    return space


@lru_cache(maxsize=16)
def _response(family: Family, moduli: tuple[tuple[str, float], ...]) -> Response:
    return _space(family).response(dict(moduli))


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
    faces = [face for pair in every_race(spindle).values() for face in pair]
    return tuple(face for face in faces if spindle.region(face.ring).part == part)


@kept
def every_race(spindle: Spindle) -> dict[str, tuple[Race, Race]]:
    """The raceway faces of every bearing with rings, by its name."""
    return {b.name: raceways(spindle, b) for b in spindle.ringed}


def raceways(spindle: Spindle, bearing: Bearing | RollerBearing) -> tuple[Race, Race]:
    """The raceway faces of the inner and the outer ring of a bearing; a ring of its own counts with its whole height."""
    found = []
    for ring, side in ((bearing.inner_ring, 1), (bearing.outer_ring, 0)):
        g, span = spindle.region(ring), spindle.raceway(ring, bearing)
        found.append(Race(ring, g.r[side], None if span == g.z else span))
    return found[0], found[1]


def _question(spindle: Spindle, part: str, tolerance: float, temperatures: Mapping[str, float] | None) -> Elastic:
    regions = tuple(g.outline for g in spindle.regions if g.part == part)
    moduli = elasticity(spindle, temperatures)
    return Elastic(part, regions, tuple((g.name, moduli[g.name]) for g in regions), races(spindle, part), tolerance)


@lru_cache(maxsize=64)
def _kept(question: Elastic) -> tuple[Response, Convergence]:
    key = repr(question)
    if (found := store.load(key)) is not None:
        return found
    size = max(np.ptp([g.r for g in question.regions]), np.ptp([g.z for g in question.regions])) / CELLS_ACROSS
    heights = [race.z for race in question.races if race.z is not None]
    answer = _answer(question, tiled(question.part, question.regions, size, heights=heights))
    store.save(key, *answer)
    return answer


def _answer(question: Elastic, start: PartMesh) -> tuple[Response, Convergence]:
    return converged_response(start, dict(question.elasticity), question.races, question.tolerance)


def forget() -> None:
    """Drop what this process has kept, so that it reads from disk or computes again as a new one would."""
    for cached in (_kept, _space, _response, _gains, _at_reference):
        cached.cache_clear()
