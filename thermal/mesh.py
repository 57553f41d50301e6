"""Meshes of a part's axisymmetric section, made here or read from Gmsh; every element belongs to one named region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import meshio
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import ElementQuadS2, ElementTriP2, Mesh, MeshQuad, MeshTri
from skfem.element import Element

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.section import cells


@dataclass(frozen=True, eq=False)
class PartMesh:
    """The section of one part: `mesh` in (r, z), m, and for each of its elements the index of its region in `regions`."""

    part: str
    mesh: Mesh
    regions: tuple[str, ...]
    region_of: np.ndarray  # (elements,) int

    def elements(self, *regions: str) -> np.ndarray:
        """Indices of the elements of `regions`; ValueError for one that has none."""
        if unknown := sorted(set(regions) - set(self.regions)):
            raise ValueError(f"the mesh of the {self.part} part has no element of {', '.join(map(repr, unknown))}")
        return np.flatnonzero(np.isin(self.region_of, [self.regions.index(name) for name in regions]))

    def side(self, region: str, axis: int, position: float) -> np.ndarray:
        """Facets of the outline of `region` on the line r = position (axis 0) or z = position (axis 1); ValueError where there is none.

        Of the outline: a facet inside may come as near to the line where small elements are thin.
        """
        every, count = np.unique(self.mesh.t2f[:, self.elements(region)].ravel(), return_counts=True)
        facets = every[count == 1]
        offset = np.abs(self.mesh.p[axis][self.mesh.facets[:, facets]] - position).max(axis=0)
        found = facets[offset < 1e-6 * np.ptp(self.mesh.p)]
        if not found.size:
            raise ValueError(f"the mesh of the {self.part} part has no face of {region!r} at {'rz'[axis]} = {position:g} m")
        return found

    def race(self, ring: str, r: float, z: tuple[float, float] | None) -> np.ndarray:
        """Facets of the raceway of `ring` at radius `r` (m), between the heights `z` (m) or all of that side.

        ValueError for a mesh whose lines do not follow the raceway's ends.
        """
        facets = self.side(ring, 0, r)
        if z is None:
            return facets
        ends = self.mesh.p[1][self.mesh.facets[:, facets]]
        near = 1e-6 * np.ptp(self.mesh.p)
        if cut := [end for end in z if np.any((ends.min(axis=0) < end - near) & (ends.max(axis=0) > end + near))]:
            raise ValueError(f"the mesh of the {self.part} part has no line at z = {cut[0]:g} m, where a raceway of {ring!r} ends")
        found = facets[(ends.min(axis=0) > z[0] - near) & (ends.max(axis=0) < z[1] + near)]
        if not found.size:
            raise ValueError(f"the mesh of the {self.part} part has no face of {ring!r} at r = {r:g} m between z = {z[0]:g} and {z[1]:g} m")
        return np.asarray(found)

    def exposed(self, regions: Sequence[str]) -> np.ndarray:
        """Boundary facets of elements of `regions`, without the axis r = 0."""
        facets = self.mesh.boundary_facets()
        owner = self.region_of[self.mesh.f2t[0, facets]]
        off_axis = self.mesh.p[0][self.mesh.facets[:, facets]].max(axis=0) > 0
        return facets[np.isin(owner, [self.regions.index(name) for name in regions if name in self.regions]) & off_axis]

    def refined(self, elements: np.ndarray | None = None) -> PartMesh:
        """Every element divided in four, or `elements` only and what conformity then asks for (quadrilaterals: all)."""
        named = self.mesh.with_subdomains({name: self.elements(name) for name in self.regions})
        whole = elements is None or not isinstance(self.mesh, MeshTri)
        return _with_regions(self.part, named.refined(1 if whole else elements), self.regions)


def element(mesh: Mesh) -> Element:
    """The second-order element of a mesh: 6-node triangle, 8-node quadrilateral."""
    return ElementTriP2() if isinstance(mesh, MeshTri) else ElementQuadS2()


def part_regions(spindle: Spindle, part: str) -> tuple[Region, ...]:
    """The regions of `part` in the order of the file; ValueError when there is none."""
    regions = tuple(g for g in spindle.regions if g.part == part)
    if not regions:
        raise ValueError(f"the spindle {spindle.name!r} has no region of a {part} part")
    return regions


def section_mesh(spindle: Spindle, part: str, size: float, shape: str = "triangle") -> PartMesh:
    """A structured mesh of `part` whose lines follow every region edge and whose cells are at most `size` (m) wide.

    `shape` is triangle or quadrilateral. ValueError when regions of the part do not hold together.
    """
    raceways = [spindle.raceway(ring, b) for b in spindle.ringed for ring in (b.inner_ring, b.outer_ring)]
    return tiled(part, part_regions(spindle, part), size, shape, raceways)


def tiled(
    part: str, regions: Sequence[Region], size: float, shape: str = "triangle", heights: Sequence[tuple[float, float]] = ()
) -> PartMesh:
    """`section_mesh` of bare regions: where they overlap, the later one owns the element. `heights` (m) are further lines in z."""
    low, high = min(g.z[0] for g in regions), max(g.z[1] for g in regions)
    inside = [span for span in heights if low <= span[0] and span[1] <= high]
    grid = MeshQuad.init_tensor(_lines([g.r for g in regions], size), _lines([*(g.z for g in regions), *inside], size))
    r, z = grid.p[:, grid.t].mean(axis=1)
    owner = np.full(r.size, -1)
    for index, g in enumerate(regions):
        owner[(g.r[0] < r) & (r < g.r[1]) & (g.z[0] < z) & (z < g.z[1])] = index
    owned = {g.name: np.flatnonzero(owner == index) for index, g in enumerate(regions) if np.any(owner == index)}
    mesh = grid.with_subdomains(owned).restrict(np.flatnonzero(owner >= 0))
    if shape == "triangle":
        mesh = mesh.to_meshtri()
    elif shape != "quadrilateral":
        raise ValueError(f"an element is a triangle or a quadrilateral, not a {shape!r}")
    return _with_regions(part, mesh, tuple(owned))


def read_gmsh(path: str | Path, spindle: Spindle, part: str) -> PartMesh:
    """The mesh of `part` from a Gmsh file (m; x is r, y is z) whose physical surfaces are named like the part's regions.

    First-order triangles or quadrilaterals; groups of other names are not of this part and are left out. ValueError names
    the regions that have no physical surface, or says what else the mesh lacks.
    """
    try:
        data = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio ends the program on files it does not know
        raise ValueError(f"{path}: not a Gmsh file that can be read: {type(error).__name__} {error}") from None
    kinds = [kind for kind in ("triangle", "quad") if kind in data.cells_dict]
    if len(kinds) != 1:
        raise ValueError(f"{path}: one kind of element is needed, first-order triangles or quadrilaterals")
    kind = kinds[0]
    tags = data.cell_data_dict.get("gmsh:physical", {}).get(kind)
    named = {name: int(tag) for name, (tag, dimension) in data.field_data.items() if dimension == 2}
    regions = part_regions(spindle, part)
    visible = {cell.region for cell in cells(regions)}
    expected = tuple(g.name for g in regions if g.name in visible)
    missing = [name for name in expected if tags is None or name not in named or not np.any(tags == named[name])]
    if missing:
        raise ValueError(f"{path}: no physical surface is named {', '.join(map(repr, missing))} ({part} part)")
    region_of = np.full(len(tags), -1)
    for index, name in enumerate(expected):
        region_of[tags == named[name]] = index
    points, corners = np.unique(data.cells_dict[kind][region_of >= 0], return_inverse=True)
    vertices = np.ascontiguousarray(data.points[points, :2].T)
    if not np.all(np.isfinite(vertices)):
        raise ValueError(f"{path}: a node has a coordinate that is no finite number")
    if vertices[0].min() < 0:
        raise ValueError(f"{path}: radii (x) must not be negative")
    mesh = (MeshTri if kind == "triangle" else MeshQuad)(vertices, corners.reshape(-1, 3 if kind == "triangle" else 4).T)
    return _whole(PartMesh(part, mesh, expected, region_of[region_of >= 0]))


def _lines(intervals: Sequence[tuple[float, float]], size: float) -> np.ndarray:
    edges = sorted({edge for interval in intervals for edge in interval})
    steps = [np.linspace(a, b, int(np.ceil((b - a) / size - 1e-9)) + 1)[:-1] for a, b in pairwise(edges)]
    return np.append(np.concatenate(steps), edges[-1])


def _with_regions(part: str, mesh: Mesh, names: tuple[str, ...]) -> PartMesh:
    region_of = np.empty(mesh.nelements, dtype=int)
    for index, name in enumerate(names):
        region_of[mesh.subdomains[name]] = index
    return _whole(PartMesh(part, mesh, names, region_of))


def _whole(section: PartMesh) -> PartMesh:
    """The section itself, or ValueError naming the regions that are not bonded to the rest."""
    a, b = section.mesh.f2t[:, section.mesh.f2t[1] >= 0]
    graph = coo_array((np.ones(a.size), (a, b)), shape=(section.mesh.nelements,) * 2)
    count, piece = connected_components(graph, directed=False)
    if count > 1:
        loose = {section.regions[k] for k in section.region_of[piece != np.bincount(piece).argmax()]}
        raise ValueError(f"the {section.part} part falls apart: {', '.join(sorted(loose))} not bonded to the rest")
    return section
