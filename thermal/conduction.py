"""The discrete heat equation of both parts together, with second-order elements.

C dT/dt + K T = motor loss + bearing friction + film x air temperature + bath. K couples the parts: by rank one through each bearing,
its conductance times the difference of the two mean raceway temperatures, and point by point at equal height (or radius)
across air gaps. Half of a bearing's friction heat enters each raceway face, motor loss the volume of its regions, both evenly.
Chamber air reaches neither the raceways nor those parts of exposed faces that look at each other across a gap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, diags_array
from skfem import Basis, BilinearForm, FacetBasis, LinearForm
from skfem.helpers import dot, grad

from thermospindle.model.drawing.heating import AirGap
from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Bearing, RollerBearing, Spindle
from thermospindle.thermal import influence
from thermospindle.thermal.mesh import PartMesh, element
from thermospindle.thermal.temperature import TemperatureField

GAUSS = 3  # points between nodes of an air gap: exact for products of quadratics, and for r in them


@BilinearForm
def conduct(u, v, w):
    return w.coefficient * dot(grad(u), grad(v)) * w.x[0]


@BilinearForm
def mass(u, v, w):
    return w.coefficient * u * v * w.x[0]


@LinearForm
def supply(v, w):
    return w.coefficient * v * w.x[0]


@dataclass(frozen=True, eq=False)
class HeatModel:
    """Discrete heat equation over the nodes of all parts, in the order of `sections`; W, K, J, whole turns (2 pi included).

    `conduction`, `convection`, `exchange` (bearings and gaps) add up to K; `capacity` is C. `film` is convection's load for air
    1 K above zero, `bath` that of coolants at their own temperatures, `motor[s]` the load of heat source s for 1 W, `bearing[b]`
    that of 1 W of friction in bearing b. The same vector reads a bearing's temperature, the mean of its two raceway means.
    """

    spindle: Spindle
    sections: Mapping[str, PartMesh]
    spans: Mapping[str, slice]
    conduction: csr_array
    convection: csr_array
    exchange: csr_array
    capacity: csr_array
    film: np.ndarray  # (nodes,)
    bath: np.ndarray  # (nodes,)
    motor: np.ndarray  # (sources, nodes)
    bearing: np.ndarray  # (bearings, nodes)

    @cached_property
    def conductance(self) -> csr_array:
        return self.conduction + self.convection + self.exchange

    @cached_property
    def cooled(self) -> np.ndarray:
        """Convection (nodes,) in W/K, to air and coolants alike; all zero of a spindle that nothing cools."""
        return np.asarray(self.convection.sum(axis=1)).ravel()

    @cached_property
    def lumped_capacity(self) -> np.ndarray:
        """Heat capacity (nodes,) in J/K: weights of the stored heat, and of the mean temperature."""
        return np.asarray(self.capacity.sum(axis=1)).ravel()

    def field(self, nodal: np.ndarray) -> TemperatureField:
        """Temperatures (nodes,) of the model as a field of both parts."""
        return TemperatureField(self.sections, {part: nodal[span] for part, span in self.spans.items()})

    def nodal(self, start: float | TemperatureField) -> np.ndarray:
        """A uniform temperature (C) or a field of this model as one array (nodes,)."""
        if isinstance(start, TemperatureField):
            return np.concatenate([start.nodal[part] for part in self.sections])
        return np.full(self.film.size, float(start))


def model(spindle: Spindle, sections: Mapping[str, PartMesh]) -> HeatModel:
    """Assemble the heat equation of `spindle` on its parts' meshes, for example `influence(spindle).sections`.

    ValueError for an air gap whose regions do not face each other.
    """
    bases = {part: Basis(s.mesh, element(s.mesh), intorder=4) for part, s in sections.items()}
    ends = np.cumsum([0, *[b.N for b in bases.values()]])
    spans = {part: slice(int(a), int(b)) for part, a, b in zip(bases, ends[:-1], ends[1:], strict=True)}
    size = int(ends[-1])
    inside = [_conduction(spindle, sections[part], basis) for part, basis in bases.items()]
    films = [_film(spindle, section) for section in sections.values()]
    convection: csr_array = csr_array(block_diag([matrix for matrix, _, _ in films]))
    film, bath = (np.concatenate([loads[k] for loads in films]) for k in (1, 2))
    faces = [_raceways(spindle, bearing, sections, spans) for bearing in spindle.ringed]
    through = [spindle.thermal.friction.conductance * _square(outer - inner) for inner, outer in faces]
    across: list[csr_array] = []
    hidden: list[GapFace] = []
    for gap in spindle.thermal.gaps:
        exchange, faces_of_gap = _gap(spindle, gap, sections, spans)
        across.append(exchange)
        hidden += faces_of_gap
    for matrix, of_air, of_coolant in (_film_behind(spindle, face) for face in _apart(hidden)):
        convection, film, bath = convection - matrix, film - of_air, bath - of_coolant
    sources = [np.concatenate([_volume(s, h.regions) for s in sections.values()]) for h in spindle.thermal.sources]
    return HeatModel(
        spindle,
        dict(sections),
        spans,
        conduction=csr_array(block_diag([k for k, _ in inside])),
        convection=csr_array(convection),
        exchange=csr_array(sum([*through, *across], start=csr_array((size, size)))),
        capacity=csr_array(block_diag([c for _, c in inside])),
        film=film,
        bath=bath,
        motor=np.array([s / s.sum() for s in sources]).reshape(-1, size),
        bearing=np.array([(inner + outer) / 2 for inner, outer in faces]).reshape(-1, size),
    )


def _conduction(spindle: Spindle, section: PartMesh, basis: Basis) -> tuple[csr_array, csr_array]:
    """Conduction (W/K) and heat capacity (J/K) matrices of one part."""
    materials = [spindle.materials[spindle.region(name).material] for name in section.regions]

    def at_points(values: Sequence[float]) -> np.ndarray:
        return np.tile(np.array(values)[section.region_of, None], (1, basis.X.shape[-1]))

    conductivity = at_points([m.conductivity for m in materials])
    capacity = at_points([m.density * m.heat_capacity for m in materials])
    return 2 * np.pi * conduct.assemble(basis, coefficient=conductivity), 2 * np.pi * mass.assemble(basis, coefficient=capacity)


def _film(spindle: Spindle, section: PartMesh) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Convection matrix (W/K) of one part and its loads (W) for air 1 K above zero and of coolants, as if there were no air gaps."""
    size = Basis(section.mesh, element(section.mesh)).N
    races = [section.race(race.ring, race.r, race.z) for race in influence.races(spindle, section.part)]
    matrix, film, bath = csr_array((size, size)), np.zeros(size), np.zeros(size)
    for c in spindle.thermal.convections:
        if (facets := np.setdiff1d(section.exposed(c.regions), np.concatenate([[], *races]).astype(int))).size:
            matrix = matrix + 2 * np.pi * mass.assemble(_face(section, facets), coefficient=c.coefficient)
            load = 2 * np.pi * supply.assemble(_face(section, facets), coefficient=c.coefficient)
            if c.coolant is None:
                film += load
            else:
                bath += c.coolant * load
    return matrix, film, bath


def _raceways(
    spindle: Spindle, bearing: Bearing | RollerBearing, sections: Mapping[str, PartMesh], spans: Mapping[str, slice]
) -> tuple[np.ndarray, np.ndarray]:
    """Weights (nodes,) of the mean over the inner and over the outer raceway face, every area of it counting alike."""
    weights = np.zeros((2, max(span.stop for span in spans.values())))
    for weight, race in zip(weights, influence.raceways(spindle, bearing), strict=True):
        part = spindle.region(race.ring).part
        area = supply.assemble(_face(sections[part], sections[part].race(race.ring, race.r, race.z)), coefficient=1.0)
        weight[spans[part]] = area / area.sum()
    return weights[0], weights[1]


def _square(vector: np.ndarray) -> csr_array:
    """vector vector^T, sparse."""
    column = csr_array(vector[:, None])
    return csr_array(column @ column.T)


def _face(section: PartMesh, facets: np.ndarray) -> FacetBasis:
    return FacetBasis(section.mesh, element(section.mesh), facets=facets, intorder=5)


def _volume(section: PartMesh, regions: Sequence[str]) -> np.ndarray:
    """Weights (nodes,) of the volume integral over those of `regions` that are in the section."""
    own = section.elements(*[name for name in regions if name in section.regions])
    if not own.size:
        return np.zeros(Basis(section.mesh, element(section.mesh)).N)
    return 2 * np.pi * supply.assemble(Basis(section.mesh, element(section.mesh), intorder=4, elements=own), coefficient=1.0)


@dataclass(frozen=True, eq=False)
class GapFace:
    """The part of a region's face that looks across a gap: `rows` (points, nodes) read temperatures there, `area` (points,) in m2.

    `line` is the axis (0 for r, 1 for z) and position (m) of the face, `stretches` (stretches, 2) the ends in the other coordinate.
    """

    region: str
    line: tuple[int, float]
    stretches: np.ndarray
    rows: csr_array
    area: np.ndarray


def _film_behind(spindle: Spindle, face: GapFace) -> tuple[csr_array, np.ndarray, np.ndarray]:
    """Convection matrix and loads of a gap's face, which neither chamber air nor a coolant reaches."""
    own = [c for c in spindle.thermal.convections if face.region in c.regions]
    air = sum(c.coefficient for c in own if c.coolant is None)
    coolant = sum(c.coefficient * c.coolant for c in own if c.coolant is not None)
    matrix = csr_array(face.rows.T @ diags_array(sum(c.coefficient for c in own) * face.area) @ face.rows)
    return matrix, air * face.area @ face.rows, coolant * face.area @ face.rows


def _apart(faces: Sequence[GapFace]) -> Sequence[GapFace]:
    """The faces themselves; ValueError where two gaps claim the same stretch of one, whose air would count twice."""
    for i, a in enumerate(faces):
        for b in (b for b in faces[:i] if (b.region, b.line) == (a.region, a.line)):
            if np.any((a.stretches[:, None, 0] < b.stretches[:, 1]) & (b.stretches[:, 0] < a.stretches[:, None, 1])):
                raise ValueError(f"air gap: two gaps share a stretch of the face of {a.region!r}")
    return faces


def _gap(
    spindle: Spindle, gap: AirGap, sections: Mapping[str, PartMesh], spans: Mapping[str, slice]
) -> tuple[csr_array, tuple[GapFace, GapFace]]:
    """Exchange across an air gap, P^T W P, P the temperature difference at points of the first face, W = h dA; and its two faces.

    The points are Gauss points between neighbouring nodes of either face, so the integral is exact. ValueError where the
    regions do not face each other.
    """
    first, second = (spindle.region(name) for name in gap.regions)
    apart = [axis for axis, (a, b) in enumerate(((first.r, second.r), (first.z, second.z))) if a[1] <= b[0] or b[1] <= a[0]]
    if not apart:
        raise ValueError(f"air gap: {first.name!r} and {second.name!r} overlap")
    across, along = apart[0], 1 - apart[0]
    faces = [_facing(sections[g.part], g, other, across) for g, other in ((first, second), (second, first))]
    meshes = [sections[g.part].mesh for g in (first, second)]
    ends = [mesh.p[along][mesh.facets[:, facets]].ravel() for mesh, facets in zip(meshes, faces, strict=True)]
    knots = np.unique(np.concatenate(ends))
    abscissa, weight = np.polynomial.legendre.leggauss(GAUSS)
    width = np.diff(knots)[:, None]
    position = (knots[:-1, None] + width * (abscissa + 1) / 2).ravel()
    sides = (_near_side(first, second, across), _near_side(second, first, across))
    length = (width * weight / 2).ravel()
    areas = [2 * np.pi * (position if along == 0 else side) * length for side in sides]
    size = max(span.stop for span in spans.values())
    (here, on_first), (there, on_second) = (
        _on_line(sections[g.part], spans[g.part].start, facets, along, position, size)
        for g, facets in zip((first, second), faces, strict=True)
    )
    facing = on_first & on_second
    if not facing.any():
        raise ValueError(f"air gap: no exposed faces of {first.name!r} and {second.name!r} face each other")
    difference = (here - there)[facing]
    exchange = csr_array(difference.T @ diags_array(gap.coefficient * areas[0][facing]) @ difference)
    stretches = np.column_stack([knots[:-1], knots[1:]])[facing.reshape(-1, GAUSS).all(axis=1)]
    one, other = (
        GapFace(g.name, (across, side), stretches, csr_array(rows[facing]), area[facing])
        for g, side, rows, area in zip((first, second), sides, (here, there), areas, strict=True)
    )
    return exchange, (one, other)


def _facing(section: PartMesh, g: Region, other: Region, axis: int) -> np.ndarray:
    """Exposed facets of region `g` on its side towards `other`."""
    return np.intersect1d(section.side(g.name, axis, _near_side(g, other, axis)), section.exposed([g.name]))


def _near_side(g: Region, other: Region, axis: int) -> float:
    (low, high), (start, _) = ((g.r, other.r), (g.z, other.z))[axis]
    return high if high <= start else low


def _on_line(
    section: PartMesh, offset: int, facets: np.ndarray, axis: int, position: np.ndarray, size: int
) -> tuple[csr_array, np.ndarray]:
    """Interpolation (points, size) at `position` along a straight face, and which points lie on its facets."""
    if not facets.size:
        return csr_array((position.size, size)), np.zeros(position.size, dtype=bool)
    mesh = section.mesh
    ends = mesh.facets[:, facets]
    ends = np.where(mesh.p[axis][ends[0]] < mesh.p[axis][ends[1]], ends, ends[::-1])
    order = np.argsort(mesh.p[axis][ends[0]])
    ends, facets = ends[:, order], facets[order]
    low, high = mesh.p[axis][ends]
    k = np.clip(np.searchsorted(low, position, side="right") - 1, 0, None)
    s = (position - low[k]) / (high - low)[k]
    on_face = (s >= 0) & (s <= 1)
    values = np.array([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)]) * on_face
    dofs = Basis(mesh, element(mesh)).dofs
    nodes = offset + np.array([dofs.nodal_dofs[0, ends[0]][k], dofs.nodal_dofs[0, ends[1]][k], dofs.facet_dofs[0, facets][k]])
    rows = np.tile(np.arange(position.size), 3)
    return csr_array(coo_array((values.ravel(), (rows, nodes.ravel())), shape=(position.size, size))), on_face
