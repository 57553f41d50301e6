"""How the bodies of the MuJoCo model stand when modes swing, a force sweeps or the spindle turns: for pictures of motion.

Motions are complex displacements (n, frames) of the chain's degrees of freedom, of which the real part is taken; poses are translations
(frames, 3) in mm and quaternions (frames, 4) x, y, z, w for points in world coordinates at rest.
"""

from __future__ import annotations

import mujoco
import numpy as np

from thermospindle.model.bearing.kinematics import row_kinematics
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.rotor.look.meshes import RegionMesh, plate_meshes, region_meshes, shaft_meshes
from thermospindle.model.rotor.look.shafts import extent
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import TO_MM
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.lines import slices
from thermospindle.sim.running.runout import Runout

VISIBLE = 0.16  # largest displacement of an animated mode, of the size of the spindle
VISIBLE_TURNING = 0.04  # the same of the turning model, of its largest radius
CYCLE = 20  # frames of one cycle of an animation
FRAMES = 16  # of the turning model, a revolution

Poses = dict[str, tuple[Array, Array]]


def reach(spindle: Spindle) -> float:
    """Largest radius of section and shafts (m)."""
    return extent(spindle)[0]


def size(spindle: Spindle) -> float:
    """Largest radius of section and shafts, or half their length where that is more (m): so that a long shaft is seen to bend."""
    radius, low, high = extent(spindle)
    return max(radius, (high - low) / 2)


def round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above the positive `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(m for m in (1, 2, 5) if m * power <= value * (1 + 1e-12)))


def body_meshes(spindle: Spindle) -> dict[str, list[RegionMesh]]:
    """The cut-away meshes by the body they move with."""
    meshes = [*region_meshes(spindle), *shaft_meshes(spindle), *plate_meshes(spindle)]
    return {b.name: own for b in spindle.structure.bodies if (own := [m for m in meshes if m.body == b.name])}


def largest_displacement(point: OperatingPoint, motion: Array | ComplexArray) -> Array:
    """Largest displacement (frames,) in m of any drawn vertex under `motion` (dofs, frames), real or phasors."""
    largest = np.zeros(motion.shape[1])
    for name, meshes in body_meshes(point.spindle).items():
        arm = np.concatenate([m.vertices for m in meshes]) - [0.0, 0.0, point.chain.body(name).z]
        rows = {move: i for i, (body, move) in enumerate(point.linear.dofs) if body == name}
        u = np.array([motion[rows[m]] if m in rows else 0 * motion[0] for m in MOVES])  # (5, frames)
        x, y, z = arm.T
        by_vertex = np.zeros((len(arm), 3, 5))  # displacement of every vertex from a unit motion
        by_vertex[:, range(3), range(3)] = 1.0
        by_vertex[:, 1, 3], by_vertex[:, 2, 3], by_vertex[:, 0, 4], by_vertex[:, 2, 4] = -z, y, z, -x
        lever = by_vertex.reshape(-1, 5)
        for piece in slices(motion.shape[1], len(lever)):
            squared = (lever @ u[:, piece].real) ** 2
            if np.iscomplexobj(motion):
                squared += (lever @ u[:, piece].imag) ** 2
            moved = np.sqrt(squared.reshape(len(arm), 3, -1).sum(axis=1).max(axis=0))
            largest[piece] = np.maximum(largest[piece], moved)
    return largest


def mode_motion(point: OperatingPoint, mode: Mode, frames: int) -> ComplexArray:
    """Motion (n, frames) of a mode shape turning through one cycle every `CYCLE` frames, scaled to be visible."""
    shape = mode.shape[:, None]
    return VISIBLE * size(point.spindle) / largest_displacement(point, shape) * shape * _turning(frames)


def sweep_motion(point: OperatingPoint, node: int, frequency: Array) -> ComplexArray:
    """Motion (n, frames) under a force at `node` that sweeps `frequency` (frames,) Hz.

    Its size is drawn as the square root, so that the motion between resonances is visible.
    """
    row = point_rows(point.spindle, point.chain, (node,))
    response = frf(point.linear, np.eye(len(point.linear.mass)), row, frequency, "mobility")[:, 0]
    largest = largest_displacement(point, response)
    return response * VISIBLE * size(point.spindle) / np.sqrt(largest * largest.max()) * _turning(len(frequency))


def _turning(frames: int) -> ComplexArray:
    return np.exp(2j * np.pi * np.arange(frames) / CYCLE)


def poses(point: OperatingPoint, motion: Array | ComplexArray) -> Poses:
    """The pose of every body relative to rest."""
    model = point.model
    data = mujoco.MjData(model)
    address = [model.joint(f"{body}.{move}").qposadr[0] for body, move in point.linear.dofs]
    mujoco.mj_kinematics(model, data)
    rest = data.xpos.copy()
    translations, turns = [], []
    for frame in motion.real.T:
        data.qpos[address] = frame
        mujoco.mj_kinematics(model, data)
        turned = np.einsum("bij,bj->bi", data.xmat.reshape(-1, 3, 3), rest)
        translations.append(TO_MM * (data.xpos - turned))
        turns.append(data.xquat[:, [1, 2, 3, 0]])
    translation, turn = np.array(translations), np.array(turns)
    return {b.name: (translation[:, i], turn[:, i]) for b in point.chain.bodies for i in [model.body(b.name).id]}


# ---------------------------------------------------------------- the turning spindle


def frame_indices(runout: Runout) -> Array:
    """Samples (frames,) of the record at which the turning model is drawn."""
    time = runout.signals.time
    wanted = np.arange(0.0, time[-1], 1 / (FRAMES * abs(runout.turning)))
    return np.round((wanted - time[0]) / (time[1] - time[0])).astype(int)


def turning_poses(runout: Runout, share: float = VISIBLE_TURNING) -> tuple[Poses, float]:
    """Poses of every body, turning ones with their spin, and by what factor displacements are enlarged, so that the largest is about
    `share` of the section's radius."""
    point, frames = runout.point, frame_indices(runout)
    motion = runout.signals.motion[frames].T
    largest = float(largest_displacement(point, motion).max())
    factor = round_down(share * reach(point.spindle) / largest) if largest > 0 else 1.0
    moved = poses(point, factor * motion)
    for body in point.chain.bodies:
        if body.turns:
            translation, turn = moved[body.name]
            moved[body.name] = translation, product(turn, quaternions(body.speed_ratio * runout.signals.angle[frames]))
    return moved, factor


def cage_turns(runout: Runout) -> dict[str, Array]:
    """Quaternions (frames, 4) of every ball set about the axis."""
    time = runout.signals.time[frame_indices(runout)]
    return {name: quaternions(kin.cage * time) for name, kin in row_kinematics(runout.point.spindle, runout.point.state).items()}


def quaternions(angle: Array) -> Array:
    """Turns (n, 4) x, y, z, w about the z axis by `angle` (n,) rad."""
    return np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)


def product(a: Array, b: Array) -> Array:
    """Quaternions (n, 4) x, y, z, w that turn by `b` first, then by `a`."""
    u, v, s, t = a[:, :3], b[:, :3], a[:, 3:], b[:, 3:]
    return np.hstack([s * v + t * u + np.cross(u, v), s * t - (u * v).sum(axis=1, keepdims=True)])
