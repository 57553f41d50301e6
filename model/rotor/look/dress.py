"""The looks of a MuJoCo model: solids, balls, lights and cameras. MuJoCo's enumerations are its own
integers, so that this file need not import it."""

from __future__ import annotations

from typing import Any

import numpy as np

from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.springs import ball_springs
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.look.colours import BALL, LOOSE_BALL, colour, ring_regions
from thermospindle.model.rotor.look.meshes import CUT, RegionMesh, plate_meshes, region_meshes, shaft_meshes, stripe_meshes
from thermospindle.model.rotor.look.shafts import extent
from thermospindle.model.types import Array

MjSpec = Any  # mujoco.MjSpec
SPHERE, MESH, SKYBOX, GRADIENT = 2, 7, 2, 1  # mjtGeom, mjtTexture, mjtBuiltin
SOLIDS, BALLS = 1, 2  # geom groups, switched on and off in the viewer


def dress(out: MjSpec, spindle: Spindle, state: PairState) -> None:
    """Give the specification made by `model.rotor.mjcf.spec` its looks; its masses, modes and states stay as they are."""
    _add_surroundings(out, spindle)
    for name in sorted({g.material for g in spindle.regions}):
        out.add_material(name=name, rgba=[*colour(name), 1.0], specular=0.35, shininess=0.45)
    out.add_material(name="matt finish", specular=0.15, shininess=0.3)
    out.add_material(name="polished finish", rgba=[*BALL, 1.0], specular=0.7, shininess=0.8)
    for mesh in region_meshes(spindle):
        polished = mesh.region in ring_regions(spindle)
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
    moved = np.array(bearing.displacement)
    pressed = respond(row, moved, respond(row).rolled).in_contact if moved.any() else [bearing.in_contact] * len(centres)
    size = [spindle.bearing(bearing.name).ball_diameter / 2, 0, 0]
    for j, centre in enumerate(centres - [0.0, 0.0, inner.z]):
        rgba = [*(BALL if pressed[j] else LOOSE_BALL), 1.0]
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
