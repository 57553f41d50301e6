"""Closed surfaces of the section's regions, of shafts, plates and stripes, cut away by a quarter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.drawing.section import PARTS
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.look.colours import PLATE, SHADES, STRIPE, colour, region_bodies, region_colours
from thermospindle.model.rotor.look.shafts import boxes, drawn_by_shaft, extent, slices
from thermospindle.model.rotor.section import Cell, cells
from thermospindle.model.structure import Body
from thermospindle.model.types import Array

CUT = np.deg2rad([-10.0, 260.0])
"""Azimuths between which bodies are shown; the quarter between is cut away."""
STEP = np.deg2rad(5.0)  # of azimuth, at most


@dataclass(frozen=True, eq=False)
class RegionMesh:
    """A closed surface, oriented outward: `vertices` (n, 3) in m, world coordinates at rest; `triangles` (m, 3).

    `patches` (m,): number of the smooth surface a triangle is part of; edges between patches are sharp.
    """

    region: str
    body: str
    vertices: Array
    triangles: NDArray[np.int64]
    patches: NDArray[np.int64]
    rgba: tuple[float, float, float, float]

    def shaded(self) -> tuple[Array, NDArray[np.int64], Array]:
        """Vertices (k, 3), triangles (m, 3) and unit normals (k, 3) with every sharp edge opened, for smooth shading."""
        corners = self.patches[:, None] * len(self.vertices) + self.triangles
        kept, triangles = np.unique(corners, return_inverse=True)
        vertices, triangles = self.vertices[kept % len(self.vertices)], triangles.reshape(-1, 3)
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        normals = np.zeros_like(vertices)
        np.add.at(normals, triangles, np.cross(b - a, c - a)[:, None])
        return vertices, triangles, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def region_meshes(spindle: Spindle) -> list[RegionMesh]:
    """Every region of the section as a sector of a ring between the azimuths `CUT`, in the order of the regions."""
    hosts, colours = region_bodies(spindle), region_colours(spindle)
    tiles = [tile for part in PARTS for tile in cells([g for g in spindle.regions if g.part == part])]
    owned = {g.name: [t for t in tiles if t.region == g.name] for g in spindle.regions if not drawn_by_shaft(spindle, g)}
    return [RegionMesh(name, hosts[name], *revolve(own), (*colours[name], 1.0)) for name, own in owned.items() if own]


def shaft_meshes(spindle: Spindle) -> list[RegionMesh]:
    """A slice for every node of every flexible shaft, neighbours in different shades."""
    return [
        RegionMesh(name, name, *mesh, (*(SHADES[k % 2] * np.array(colour(shaft.segments[0].material))).tolist(), 1.0))
        for shaft in spindle.structure.shafts
        for k, (name, mesh) in enumerate((boxes(shaft) if shaft.segments[0].sides else {n: revolve(t) for n, t in slices(shaft).items() if t}).items())
    ]


def plate_meshes(spindle: Spindle) -> list[RegionMesh]:
    """A plate for every body that no region shows: a ring as wide as its measuring points lie, its
    top at their height, or a disc of its inertia."""
    shown = set(region_bodies(spindle).values()) | {name for shaft in spindle.structure.shafts for name in shaft.bodies}
    return [
        RegionMesh(f"{body.name} plate", body.name, *revolve([plate(spindle, body)]), (*PLATE, 1.0))
        for body in spindle.structure.bodies if body.name not in shown
    ]


def stripe_meshes(spindle: Spindle) -> list[RegionMesh]:
    """A stripe of paint on the top and the side of every turning body's highest region: it shows the spin."""
    meshes = []
    for shaft in (s for s in spindle.structure.shafts if s.turns):
        name, tiles = next(iter(slices(shaft).items()))
        thick, middle, half = 0.01 * tiles[0].r[1], CUT[1] - np.deg2rad(24.0), np.deg2rad(4.0)
        face = Cell(name, tiles[0].r, (tiles[0].z[0] - thick, tiles[0].z[0]))
        meshes.append(RegionMesh(f"{name} stripe", name, *revolve([face], middle - half, middle + half), (*STRIPE, 1.0)))
    for body in (b for b in spindle.structure.bodies if b.turns and b.regions):
        top = max((spindle.region(name) for name in body.regions), key=lambda g: (g.z[1], g.r[1]))
        (r0, r1), (z0, z1), thick = top.r, top.z, 0.004 * top.r[1]
        tiles = [Cell(top.name, (r0, r1), (z1, z1 + thick)), Cell(top.name, (r1, r1 + thick), (z0, z1 + thick))]
        middle, half = CUT[1] - np.deg2rad(24.0), np.deg2rad(4.0)
        meshes.append(RegionMesh(f"{body.name} stripe", body.name, *revolve(tiles, middle - half, middle + half), (*STRIPE, 1.0)))
    return meshes


def revolve(tiles: Sequence[Cell], start: float = CUT[0], stop: float = CUT[1]) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Vertices (n, 3), triangles (m, 3) and patches (m,) of rectangles of the section turned from azimuth `start` to `stop`.

    Circles are polygons of the circle's area: volumes are exact. Tiles must not meet at a corner only.
    """
    r, z, filled = _merged_grid(tiles)
    count = int(np.ceil((stop - start) / STEP - 1e-9))
    azimuth = np.linspace(start, stop, count + 1)
    width = (stop - start) / count
    radius, height = (a.ravel() for a in np.meshgrid(r * np.sqrt(width / np.sin(width)), z, indexing="ij"))
    node = np.arange(len(radius)).reshape(len(r), len(z))
    x, y = np.outer(np.cos(azimuth), radius), np.outer(np.sin(azimuth), radius)
    vertices = np.stack([x, y, np.broadcast_to(height, x.shape)], axis=2).reshape(-1, 3)
    index = np.arange(len(vertices)).reshape(count + 1, len(radius))
    index[:, radius == 0] = index[0, radius == 0]  # points on the axis do not turn

    i, j = np.nonzero(filled)
    ring = np.stack([node[i, j], node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]], axis=1)  # counterclockwise in (r, z)
    ends = np.concatenate([ring[:, [0, 1, 2]], ring[:, [0, 2, 3]]])
    padded = np.pad(filled, 1)
    beyond = (padded[i + 1, j], padded[i + 2, j + 1], padded[i + 1, j + 2], padded[i, j + 1])  # below, right, above, left
    outline = np.concatenate([ring[~empty][:, [k, (k + 1) % 4]] for k, empty in enumerate(beyond)])
    a, b = index[:-1, outline[:, 0]], index[:-1, outline[:, 1]]
    c, d = index[1:, outline[:, 1]], index[1:, outline[:, 0]]
    swept = np.stack([np.stack([a, d, c], axis=2), np.stack([a, c, b], axis=2)])

    triangles = np.concatenate([swept.reshape(-1, 3), index[0, ends], index[-1, ends[:, ::-1]]])
    sides = np.broadcast_to(np.arange(len(outline)), swept.shape[:3]).ravel()
    patches = np.concatenate([sides, np.repeat(len(outline) + np.arange(2), len(ends))])
    solid = np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)  # on the axis a quad is a triangle or nothing
    used, triangles = np.unique(triangles[solid], return_inverse=True)
    return vertices[used], triangles.reshape(-1, 3), patches[solid]


def _merged_grid(tiles: Sequence[Cell]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Lines r (p,) and z (q,) at which the union of the tiles changes, and which cells (p - 1, q - 1) between them it fills."""
    r, z = (np.unique([getattr(t, axis) for t in tiles]) for axis in ("r", "z"))
    filled = np.zeros((len(r) - 1, len(z) - 1), bool)
    for t in tiles:
        filled[np.ix_((t.r[0] <= r[:-1]) & (r[1:] <= t.r[1]), (t.z[0] <= z[:-1]) & (z[1:] <= t.z[1]))] = True
    padded = np.pad(filled, 1)
    across, up = np.any(padded[1:] != padded[:-1], axis=1), np.any(padded[:, 1:] != padded[:, :-1], axis=0)
    return r[across], z[up], filled[np.ix_(np.flatnonzero(across)[:-1], np.flatnonzero(up)[:-1])]


def plate(spindle: Spindle, body: Body) -> Cell:
    """The ring plate that stands for a body of which no region is drawn; one whose points all lie
    on the axis is a disc of its mass and inertia."""
    reach = extent(spindle)[0]
    points = [p.position for p in spindle.points if p.body == body.name]
    if points and max(float(np.hypot(x, y)) for x, y, _ in points) < 1e-3 * reach:
        gyration = np.sqrt(2 * max(body.inertia[2], *body.inertia[:2]) / body.mass)
        thick = 0.1 * reach
        return Cell(body.name, (0.0, float(np.clip(gyration, thick, 2 * reach))), (body.z - thick / 2, body.z + thick / 2))
    outer = 1.05 * max((float(np.hypot(x, y)) for x, y, _ in points), default=1.2 * reach)
    top = min((z for *_, z in points), default=body.z)
    return Cell(body.name, (min(0.85 * reach, 0.7 * outer), outer), (top - 0.1 * reach, top))
