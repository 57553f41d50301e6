"""Thermal motion of the rings, and the deformed section for pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.machine import RingMotion, Spindle
from thermospindle.thermal.elastic import Race, Response, Solid
from thermospindle.thermal.influence import TOLERANCE, Influence, elasticity, every_race, gains, influence
from thermospindle.thermal.temperature import TemperatureField, region_temperatures, thermal_strain

__all__ = ["DeformedSection", "Influence", "expand", "field", "influence"]

Temperature = float | Mapping[str, float] | TemperatureField
"""A uniform soak (C), a temperature for every region (C), or a temperature field."""

TILES = {6: ((0, 3, 5), (1, 4, 3), (2, 5, 4), (3, 4, 5)), 8: ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 6), (4, 6, 7))}
"""Triangles that draw a second-order element, by its number of nodes: corners first, middle k between corners k and k + 1."""


def expand(spindle: Spindle, temperature: Temperature, tolerance: float = TOLERANCE) -> dict[str, RingMotion]:
    """Motion of the rings of every bearing, by its name, from the reference temperature to `temperature`.

    Balls and grooves have the mean temperature of their two rings, or of their own ring: of the whole region, also where
    bearings share one. Where every region has the reference temperature nothing moves, and no finite elements are asked.
    ValueError for region temperatures that do not match the spindle's regions; OutsideRange where a material law does not reach.
    """
    means = region_temperatures(spindle, temperature)
    moves: dict[Race, tuple[float, float]] = {}
    if isinstance(temperature, TemperatureField):
        for response in influence(spindle, tolerance, means).responses.values():
            strains = _strain_field(spindle, Solid(response.section, elasticity(spindle, means)), temperature)
            moves |= _by_race(response.races, np.einsum("ieq,eq->i", response.density, strains))
    elif not any((free := _region_strains(spindle, means)).values()):
        moves = {race: (0.0, 0.0) for pair in every_race(spindle).values() for race in pair}
    else:
        for gain in gains(spindle, tolerance, means):
            moves |= _by_race(gain.races, gain.value @ np.array([free[region] for region in gain.regions]))
    return ring_motions(spindle, means, moves)


def _by_race(races: Sequence[Race], motion: np.ndarray) -> dict[Race, tuple[float, float]]:
    """Motions (2 races,) as (r, z) of every race."""
    return {race: (r, z) for race, (r, z) in zip(races, motion.reshape(-1, 2).tolist(), strict=True)}


def ring_motions(spindle: Spindle, means: Mapping[str, float], moves: Mapping[Race, tuple[float, float]]) -> dict[str, RingMotion]:
    """Motion of every bearing's rings from what their races move by (r, z in m) and the region means (C)."""
    result, races, reference = {}, every_race(spindle), spindle.reference_temperature
    for b in spindle.ringed:
        inner_race, outer_race = races[b.name]
        inner, outer = means[b.inner_ring], means[b.outer_ring]
        ring, ball = spindle.materials[b.ring_material], spindle.materials[b.ball_material]
        result[b.name] = RingMotion(
            *moves[inner_race],
            *moves[outer_race],
            inner_strain=ring.thermal_strain(inner, reference),
            outer_strain=ring.thermal_strain(outer, reference),
            ball_strain=ball.thermal_strain((inner + outer) / 2, reference),
            temperature=(inner + outer) / 2,
        )
    return result


@dataclass(frozen=True, eq=False)
class DeformedSection:
    """The section of one part, ready to draw. Its mean axial displacement is zero; the hub's rigid movement is not in it."""

    regions: tuple[str, ...]
    nodes: np.ndarray  # (nodes, 2), r and z in m, undeformed
    triangles: np.ndarray  # (triangles, 3), node indices
    displacement: np.ndarray  # (nodes, 2), m
    temperature: np.ndarray  # (nodes,), C; a node between regions of unlike temperatures has that of the later one
    region_of: np.ndarray  # (triangles,), index into regions


def field(spindle: Spindle, temperature: Temperature, tolerance: float = TOLERANCE) -> dict[str, DeformedSection]:
    """The deformed section of every part, by its name; raises as `expand`."""
    means = region_temperatures(spindle, temperature)
    return {
        part: _deformed_by_field(spindle, temperature, means, part)
        if isinstance(temperature, TemperatureField)
        else _deformed_by_regions(spindle, response, means)
        for part, response in influence(spindle, tolerance, means).responses.items()
    }


def _deformed_by_field(spindle: Spindle, temperature: TemperatureField, means: Mapping[str, float], part: str) -> DeformedSection:
    """Solved on the field's own mesh."""
    solid = Solid(temperature.sections[part], elasticity(spindle, means))
    displacement = solid.displacement(_strain_field(spindle, solid, temperature)[None])[0]
    return _drawing(solid, displacement, temperature.nodal[part])


def _deformed_by_regions(spindle: Spindle, response: Response, means: Mapping[str, float]) -> DeformedSection:
    solid = Solid(response.section, elasticity(spindle, means))
    nodal = np.empty(solid.scalar.N)
    for name in response.section.regions:
        nodal[solid.scalar.element_dofs[:, response.section.elements(name)]] = means[name]
    free = _region_strains(spindle, means)
    return _drawing(solid, np.tensordot([free[name] for name in response.section.regions], response.shape, axes=1), nodal)


def _drawing(solid: Solid, displacement: np.ndarray, temperature: np.ndarray) -> DeformedSection:
    section, nodes = solid.section, solid.scalar.element_dofs
    tiles = TILES[len(nodes)]
    triangles = np.concatenate([nodes[list(tile)].T for tile in tiles])
    owner = np.tile(section.region_of, len(tiles))
    return DeformedSection(section.regions, solid.nodes, triangles, displacement, temperature, owner)


def _region_strains(spindle: Spindle, means: Mapping[str, float]) -> dict[str, float]:
    """Free thermal strain of every region, by its name."""
    return {g.name: spindle.materials[g.material].thermal_strain(means[g.name], spindle.reference_temperature) for g in spindle.regions}


def _strain_field(spindle: Spindle, solid: Solid, temperature: TemperatureField) -> np.ndarray:
    """Free thermal strain (elements, points) at the quadrature points of `solid`."""
    values = temperature.at_points(solid.section.part, solid.scalar)
    strains = np.empty_like(values)
    for name in solid.section.regions:
        own = solid.section.elements(name)
        material = spindle.materials[spindle.region(name).material]
        strains[own] = thermal_strain(material, values[own], spindle.reference_temperature)
    return strains
