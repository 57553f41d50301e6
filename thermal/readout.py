"""Region means and ring motions of many temperature fields of one heat model.

What `expansion.expand` gives for one field, with everything that depends on the mesh alone computed once: a time history asks for it
at every stage of every step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import coo_array, csr_array, vstack
from skfem import Basis, LinearForm

from thermospindle.model.machine import RingMotion, Spindle
from thermospindle.thermal.conduction import HeatModel
from thermospindle.thermal.elastic import Race, Response, Solid
from thermospindle.thermal.expansion import expand, ring_motions
from thermospindle.thermal.influence import elasticity, influence
from thermospindle.thermal.mesh import element
from thermospindle.thermal.temperature import thermal_strain


@dataclass(frozen=True, eq=False)
class Reading:
    """Reads nodal temperatures (nodes,) of `model`.

    `means` (regions, nodes) are weights of the region means; `points` (points, nodes) of the temperature at the quadrature
    points of the elastic solution, `region_of` (points,) their regions; `gain` (2 races, points) the motion (m) of `races`
    (r, z, r, ...) for a unit strain there. They hold for a spindle of the same section with the Young's moduli `moduli`.
    """

    model: HeatModel
    regions: tuple[str, ...]
    means: csr_array
    points: csr_array
    region_of: np.ndarray
    races: tuple[Race, ...]
    gain: np.ndarray
    moduli: Mapping[str, object]

    @cached_property
    def by_region(self) -> csr_array:
        """Motions (regions x 2 races, nodes) for expansion by 1/K of one region after the other."""
        parts = [csr_array(self.gain[:, self.region_of == k] @ self.points[self.region_of == k]) for k in range(len(self.regions))]
        return _stack(parts)

    def region_means(self, nodal: np.ndarray) -> dict[str, float]:
        """Mean temperature (C) over the volume of every region."""
        return dict(zip(self.regions, (self.means @ nodal).tolist(), strict=True))

    def motions(self, spindle: Spindle, nodal: np.ndarray) -> dict[str, RingMotion]:
        """As `expand(spindle, field)`. `spindle` may differ from the model's in anything; where its
        elasticity follows the temperature, the influence is taken there; where it is another at the
        reference temperature, which has meshes of its own, the finite elements are asked again."""
        means = {g.name: spindle.reference_temperature for g in spindle.regions} | self.region_means(nodal)
        gain = self.gain
        if elasticity(spindle, means) != self.moduli:
            responses = influence(spindle, temperatures=means).responses
            if any(response.section.mesh is not self.model.sections[part].mesh for part, response in responses.items()):
                return expand(spindle, self.model.field(nodal))
            gain = _gain(responses)
        materials = [spindle.materials[spindle.region(name).material] for name in self.regions]
        if gain is self.gain and all(len(m.thermal_expansion.value) == 1 for m in materials):
            each = (self.by_region @ (nodal - spindle.reference_temperature)).reshape(len(materials), -1)
            motion = np.array([m.thermal_expansion.value[0] for m in materials]) @ each
        else:
            values = self.points @ nodal
            strain = np.empty_like(values)
            for k, material in enumerate(materials):
                own = self.region_of == k
                strain[own] = thermal_strain(material, values[own], spindle.reference_temperature)
            motion = gain @ strain
        moves = [(r, z) for r, z in motion.reshape(-1, 2).tolist()]
        return ring_motions(spindle, means, dict(zip(self.races, moves, strict=True)))


def reading(model: HeatModel) -> Reading:
    """The reading of a model on the meshes of its spindle's influence; ValueError for a model on other meshes."""
    spindle, size = model.spindle, model.film.size
    responses, moduli = influence(spindle).responses, elasticity(spindle)
    regions: list[str] = []
    races: list[Race] = []
    means, points, owners = [], [], []
    for part, response in responses.items():
        section, span = response.section, model.spans[part]
        if model.sections[part].mesh is not section.mesh:
            raise ValueError(f"the heat model of the {part} part is on another mesh than its expansion")
        solid = Solid(section, moduli)
        weight = np.array([_volume(section.mesh, section.elements(name)) for name in section.regions])
        means.append(_at(csr_array(weight / weight.sum(axis=1, keepdims=True)), span, size))
        points.append(_at(_interpolation(solid.scalar), span, size))
        each = solid.scalar.X.shape[-1]
        owners.append(len(regions) + np.repeat(section.region_of, each))
        regions += section.regions
        races += response.races
    return Reading(model, tuple(regions), _stack(means), _stack(points), np.concatenate(owners), tuple(races), _gain(responses), moduli)


def _gain(responses: Mapping[str, Response]) -> np.ndarray:
    """Motion (2 races, points) of the races of all parts for a unit strain at the quadrature points of all."""
    return block_diag(*(response.density.reshape(len(response.density), -1) for response in responses.values()))


def _interpolation(basis: Basis) -> csr_array:
    """Values (elements x points, nodes) at the quadrature points, element by element."""
    shapes = np.array([np.broadcast_to(np.asarray(b[0]), (basis.mesh.nelements, basis.X.shape[-1])) for b in basis.basis])
    elements, points = shapes.shape[1:]
    rows = np.broadcast_to(np.arange(elements * points).reshape(1, elements, points), shapes.shape)
    columns = np.broadcast_to(basis.element_dofs[:, :, None], shapes.shape)
    return csr_array(coo_array((shapes.ravel(), (rows.ravel(), columns.ravel())), shape=(elements * points, basis.N)))


def _volume(mesh: object, elements: np.ndarray) -> np.ndarray:
    return np.asarray(LinearForm(lambda v, w: v * w.x[0]).assemble(Basis(mesh, element(mesh), elements=elements)))


def _at(matrix: csr_array, span: slice, size: int) -> csr_array:
    """The matrix with its columns at `span` of `size`."""
    entries = coo_array(matrix)
    return csr_array(coo_array((entries.data, (entries.row, entries.col + span.start)), shape=(matrix.shape[0], size)))


def _stack(blocks: list[csr_array]) -> csr_array:
    return csr_array(vstack(blocks))
