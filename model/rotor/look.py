"""What a spindle looks like: cut-away bodies of its section, and the visual part of its MuJoCo model.

Nothing here enters the physics: geoms have no mass and collide with nothing, and bodies keep their explicit inertia. Meshes are
plain arrays, so that the Rerun log shows the same bodies; MuJoCo's enumerations are its own integers, so that this file need
not import it. Regions hang on the body they move with, and turn with it: the stripe on the turning body shows how far.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.springs import ball_springs
from thermospindle.model.machine import PARTS, Region, Spindle
from thermospindle.model.rotor.section import Cell, cells
from thermospindle.model.rotor.shaft_look import boxes, drawn_by_shaft, extent, host, slices
from thermospindle.model.structure import Body
from thermospindle.model.types import Array

MjSpec = Any  # mujoco.MjSpec
SPHERE, MESH, SKYBOX, GRADIENT = 2, 7, 2, 1  # mjtGeom, mjtTexture, mjtBuiltin
SOLIDS, BALLS = 1, 2  # geom groups, switched on and off in the viewer

CUT = np.deg2rad([-10.0, 260.0])
"""Azimuths between which bodies are shown; the quarter between is cut away."""
STEP = np.deg2rad(5.0)  # of azimuth, at most
COLOURS = {
    "aluminium": (0.79, 0.80, 0.80),
    "steel": (0.46, 0.53, 0.61),
    "yoke": (0.46, 0.34, 0.25),
    "magnet": (0.15, 0.20, 0.36),
    "cast iron": (0.43, 0.44, 0.46),
}
SHADES = (1.0, 0.84, 0.70, 0.58)  # of touching regions of one material
PLATE, STRIPE, BALL, LOOSE_BALL = (0.33, 0.36, 0.40), (0.95, 0.62, 0.10), (0.74, 0.75, 0.77), (0.85, 0.30, 0.15)


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


# ---------------------------------------------------------------- meshes


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
    """A plate for every body that no region shows: a ring as wide as its measuring points lie, its top at their height, or a disc of its inertia."""
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


# ---------------------------------------------------------------- which body, which colour


def region_bodies(spindle: Spindle) -> dict[str, str]:
    """The body each region moves with.

    A region that makes up no body touches, at once or through others like it, a body that has regions: it is part of the body
    without regions which that one is joined to (the seat of a shaft), or of that body itself if there is none.
    """
    structure, touching = spindle.structure, _touching(spindle.regions)
    made_of = {region: b.name for b in structure.bodies for region in b.regions}
    without = [b.name for b in structure.bodies if not b.regions]

    def seat(body: str) -> str:
        joined = (other for joint in structure.joints if body in joint.bodies for other in joint.bodies if other in without)
        return next(joined, body)

    hosts = dict(made_of)
    while found := {
        name: seat(made_of[first]) if (first := min(near)) in made_of else hosts[first]
        for name, all_near in touching.items()
        if name not in hosts and (near := all_near & hosts.keys())
    }:
        hosts |= found
    on_shafts = {g.name: node for g in spindle.regions if g.name not in made_of and (node := host(spindle, g))}
    turning = spindle.turning.name if structure.turns else ""
    still = next((name for b in spindle.bearings for name in (b.inner_body, b.outer_body) if name != "ground" and not structure.body(name).turns), "")
    still = still or next((b.name for b in structure.bodies if not b.turns), turning)
    return {g.name: on_shafts.get(g.name) or hosts.get(g.name, turning if g.part == "rotating" else still) for g in spindle.regions}


def _touching(regions: Sequence[Region]) -> dict[str, set[str]]:
    """The regions of the same part that each region shares a side or an area with."""
    near: dict[str, set[str]] = {g.name: set() for g in regions}
    for a, b in combinations(regions, 2):
        overlap = [min(p[1], q[1]) - max(p[0], q[0]) for p, q in ((a.r, b.r), (a.z, b.z))]
        if a.part == b.part and min(overlap) >= 0 and max(overlap) > 0:
            near[a.name].add(b.name)
            near[b.name].add(a.name)
    return near


def colour(material: str) -> tuple[float, float, float]:
    """The colour of a material; a name without one gets a muted colour that depends on the name alone."""
    return COLOURS.get(material) or colorsys.hsv_to_rgb(crc32(material.encode()) % 360 / 360, 0.35, 0.70)


def region_colours(spindle: Spindle) -> dict[str, tuple[float, float, float]]:
    """The material's colour, bearing rings lighter; of two touching regions alike the larger has the lighter shade."""
    rings, touching = _rings(spindle), _touching(spindle.regions)
    kind = {g.name: (g.material, g.name in rings) for g in spindle.regions}
    shade: dict[str, int] = {}
    for region in sorted(spindle.regions, key=_bulk, reverse=True):
        alike = {near for near in touching[region.name] if kind[near] == kind[region.name]}
        free = set(range(len(SHADES))) - {shade[near] for near in alike & shade.keys()}
        shade[region.name] = min(free, default=0)
    tones = {name: np.array(colour(material)) * SHADES[shade[name]] for name, (material, _) in kind.items()}
    tones |= {name: 0.75 * tones[name] + 0.25 for name in rings}
    return {name: (float(red), float(green), float(blue)) for name, (red, green, blue) in tones.items()}


def _rings(spindle: Spindle) -> set[str]:
    return {ring for b in spindle.bearings for ring in (b.inner_ring, b.outer_ring)}


def _bulk(region: Region) -> float:
    return (region.r[1] ** 2 - region.r[0] ** 2) * (region.z[1] - region.z[0])


def plate(spindle: Spindle, body: Body) -> Cell:
    """The ring plate that stands for a body of which no region is drawn; one whose points all lie on the axis is a disc of its mass and inertia."""
    reach = extent(spindle)[0]
    points = [p.position for p in spindle.points if p.body == body.name]
    if points and max(float(np.hypot(x, y)) for x, y, _ in points) < 1e-3 * reach:
        gyration = np.sqrt(2 * max(body.inertia[2], *body.inertia[:2]) / body.mass)
        thick = 0.1 * reach
        return Cell(body.name, (0.0, float(np.clip(gyration, thick, 2 * reach))), (body.z - thick / 2, body.z + thick / 2))
    outer = 1.05 * max((float(np.hypot(x, y)) for x, y, _ in points), default=1.2 * reach)
    top = min((z for *_, z in points), default=body.z)
    return Cell(body.name, (min(0.85 * reach, 0.7 * outer), outer), (top - 0.1 * reach, top))


# ---------------------------------------------------------------- MuJoCo


def dress(out: MjSpec, spindle: Spindle, state: PairState) -> None:
    """Give the specification made by `model.rotor.mjcf.spec` its looks; its masses, modes and states stay as they are."""
    _add_surroundings(out, spindle)
    for name in sorted({g.material for g in spindle.regions}):
        out.add_material(name=name, rgba=[*colour(name), 1.0], specular=0.35, shininess=0.45)
    out.add_material(name="matt finish", specular=0.15, shininess=0.3)
    out.add_material(name="polished finish", rgba=[*BALL, 1.0], specular=0.7, shininess=0.8)
    for mesh in region_meshes(spindle):
        polished = mesh.region in _rings(spindle)
        _add_mesh(out, spindle, mesh, "polished finish" if polished else spindle.region(mesh.region).material)
    for shaft in spindle.structure.shafts:
        if shaft.segments[0].material not in {g.material for g in spindle.regions}:
            out.add_material(name=shaft.segments[0].material, rgba=[*colour(shaft.segments[0].material), 1.0], specular=0.35, shininess=0.45)
    for mesh in (*shaft_meshes(spindle), *plate_meshes(spindle), *stripe_meshes(spindle)):
        _add_mesh(out, spindle, mesh, "matt finish")
    for bearing in state.bearings:
        _add_balls(out, spindle, bearing)


def _add_mesh(out: MjSpec, spindle: Spindle, mesh: RegionMesh, material: str) -> None:
    vertices, triangles, _ = mesh.shaded()
    local = vertices - [0.0, 0.0, spindle.structure.body(mesh.body).z]
    out.add_mesh(name=mesh.region, uservert=local.ravel(), userface=triangles.ravel())
    shape = {"type": MESH, "meshname": mesh.region, "material": material, "rgba": mesh.rgba}
    out.body(mesh.body).add_geom(name=mesh.region, **shape, **_visual(SOLIDS))


def _add_balls(out: MjSpec, spindle: Spindle, bearing: BearingState) -> None:
    """Balls between their groove centres, on a body that does not turn: they go round at a speed of their own."""
    inner = spindle.structure.body(spindle.bearing(bearing.name).inner_body)
    holder = out.body(f"{inner.name} carrier" if inner.turns else inner.name)
    springs, row = ball_springs(bearing), bearing.row
    centres = springs.inner + row.inner_length / row.unloaded_distance * (springs.outer - springs.inner)
    rgba = [*(BALL if bearing.in_contact else LOOSE_BALL), 1.0]
    size = [spindle.bearing(bearing.name).ball_diameter / 2, 0, 0]
    for j, centre in enumerate(centres - [0.0, 0.0, inner.z]):
        shape = {"type": SPHERE, "size": size, "pos": centre, "material": "polished finish", "rgba": rgba}
        holder.add_geom(name=f"{bearing.name} ball {j}", **shape, **_visual(BALLS))


def _visual(group: int) -> dict[str, float]:
    return {"mass": 0.0, "contype": 0, "conaffinity": 0, "group": group}


def _add_surroundings(out: MjSpec, spindle: Spindle) -> None:
    """Lights, cameras and the sizes MuJoCo scales its pictures by; the cameras look into the cut."""
    reach, low, high = extent(spindle)
    reach = max(reach, 0.5 * (high - low))
    centre = np.array([0.0, 0.0, (low + high) / 2])
    out.stat.center, out.stat.extent, out.stat.meansize = centre, 2.4 * reach, 0.05 * reach
    view = float(np.mean(CUT)) + np.pi
    out.visual.map.znear, out.visual.map.zfar = 0.01, 50.0
    out.visual.headlight.ambient, out.visual.headlight.diffuse, out.visual.headlight.specular = [0.3] * 3, [0.35] * 3, [0.1] * 3
    out.visual.global_.azimuth, out.visual.global_.elevation = float(np.rad2deg(view)) % 360 - 180, -28.0
    out.visual.global_.offwidth, out.visual.global_.offheight = 1600, 1200
    out.visual.quality.offsamples = 8
    out.add_texture(name="sky", type=SKYBOX, builtin=GRADIENT, rgb1=[1.0, 1.0, 1.0], rgb2=[0.62, 0.67, 0.73], width=64, height=384)
    for name, azimuth, height, diffuse in (("key", view + 1.0, 2.2, 0.55), ("fill", view - 0.9, 0.6, 0.2)):
        towards = np.array([np.cos(azimuth), np.sin(azimuth), height])
        out.worldbody.add_light(
            name=name, pos=centre + 4 * reach * towards, dir=-towards, diffuse=[diffuse] * 3, specular=[0.3] * 3, castshadow=False
        )
    bearings = np.array([0.0, 0.0, np.mean([b.z for b in spindle.all_bearings]) if spindle.all_bearings else (low + high) / 2])
    shots = {
        "front": (centre - [0.0, 0.0, 0.15 * reach], 5.6 * reach, 27.0, view + 0.1),
        "close": (bearings, 2.6 * reach, 12.0, view + 0.05),
    }
    for name, (target, distance, elevation, azimuth) in shots.items():
        _add_camera(out, name, target, distance, azimuth, np.deg2rad(elevation))


def _add_camera(out: MjSpec, name: str, target: Array, distance: float, azimuth: float, elevation: float) -> None:
    """A camera `distance` (m) from `target` (3,), seen from there at `azimuth` and `elevation` (rad)."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    right = np.array([-s, c, 0.0])
    back = np.array([c * np.cos(elevation), s * np.cos(elevation), np.sin(elevation)])
    out.worldbody.add_camera(name=name, pos=target + distance * back, fovy=25.0, xyaxes=[*right, *np.cross(back, right)])
