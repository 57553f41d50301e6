"""`python -m tests.bench_shaft`: two ways of a flexible shaft into MuJoCo, side by side on a free
shaft of steel, 40 mm thick and 500 mm long.

The program's: every node a body of its own from the world, elements as fixed tendons over shape functions (`model.rotor.mjcf`).
The other: rigid segments, each the child of the one before, with hinges and slides that carry E I / h and k G A / h (the rigid
finite element method: Wittbrodt, Adamiec-Wojcik & Wojciech, *Dynamics of Flexible Multibody Systems*, 2006, ch. 2). Errors are
against the limit of many elements without MuJoCo; the longest step is that of RK4, 2.8 over the highest natural frequency.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.linalg import eigvalsh

from tests.bench_beams import best
from tests.literature.test_rotors import chain, rotor
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.mjcf import chain_spec
from thermospindle.model.types import Array

YOUNG, POISSON, DENSITY = 210e9, 0.3, 7850.0
LENGTH, DIAMETER = 0.5, 0.04
AREA, SECOND = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
SHEAR = 6 * (1 + POISSON) / (7 + 6 * POISSON)  # of a solid circle (Cowper, J. Appl. Mech. 33 (1966) 335)
ELEMENTS = (5, 10, 20, 40)
MODES = 4
RIGID = 1.0  # Hz, below which a free shaft moves as a whole
STABLE = 2.8  # of RK4, over the highest natural frequency


def by_tendons(elements: int) -> mujoco.MjModel:
    return chain_spec(_built(elements), 1e-6).compile()


def by_segments(elements: int) -> mujoco.MjModel:
    """Rigid segments in a row, the first one free across the axis."""
    h = LENGTH / elements
    mass = DENSITY * AREA * h
    inertia = mass * np.array([(3 * DIAMETER**2 / 4 + h**2) / 12] * 2 + [DIAMETER**2 / 8])
    bend, shear = YOUNG * SECOND / h, SHEAR * YOUNG / (2 * (1 + POISSON)) * AREA / h
    out = mujoco.MjSpec()
    out.compiler.degree = False
    out.option.gravity = np.zeros(3)
    out.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    out.option.timestep = 1e-6
    out.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT)
    parent = out.worldbody
    for k in range(elements):
        parent = parent.add_body(name=f"s{k}", pos=[0, 0, h if k else 0], ipos=[0, 0, h / 2], mass=mass, inertia=inertia, explicitinertial=True)
        for kind, axes, stiffness in ((mujoco.mjtJoint.mjJNT_SLIDE, np.eye(3)[:2], shear), (mujoco.mjtJoint.mjJNT_HINGE, np.eye(3)[:2], bend)):
            for axis in axes:
                joint = parent.add_joint(type=kind, axis=axis)
                if k:
                    joint.stiffness = [stiffness, 0, 0] if np.ndim(joint.stiffness) else stiffness
    return out.compile()


def frequencies(model: mujoco.MjModel) -> Array:
    """Natural frequencies (n,) Hz across the axis, of the model at rest, from its own mass matrix and passive forces."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass, stiffness, step = np.zeros((model.nv, model.nv)), np.zeros((model.nv, model.nv)), 1e-9
    mujoco.mj_fullM(model, data, mass)
    for i in range(model.nv):
        forces = []
        for sign in (1, -1):
            data.qpos[:] = 0.0
            data.qpos[i] = sign * step
            mujoco.mj_forward(model, data)
            forces.append(data.qfrc_passive.copy())
        stiffness[:, i] = (forces[1] - forces[0]) / (2 * step)
    across = [i for i in range(model.nv) if not model.joint(model.dof_jntid[i]).name.endswith((".z", ".spin"))]
    squares = eigvalsh((stiffness + stiffness.T)[np.ix_(across, across)] / 2, mass[np.ix_(across, across)])
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)


def bending(model: mujoco.MjModel) -> tuple[Array, float]:
    """The first bending frequencies, of two planes alike, and the highest of all."""
    every = frequencies(model)
    return every[every > RIGID][: 2 * MODES : 2], float(every[-1])


def stepping(model: mujoco.MjModel) -> float:
    """s a step, at rest: every step costs the same."""
    data = mujoco.MjData(model)
    return best(lambda: mujoco.mj_step(model, data, nstep=200), 5) / 200


def _built(elements: int):
    return chain(rotor((YOUNG / 1e9, POISSON, DENSITY), [(DIAMETER * 1e3, LENGTH * 1e3)], [], [], [], longest=LENGTH * 1e3 / elements * (1 + 1e-9)))


def exact() -> Array:
    """Of 200 and 400 elements, whose error falls with the square of their number."""
    coarse, fine = (_without_mujoco(n) for n in (200, 400))
    return np.asarray(fine + (fine - coarse) / 3)


def _without_mujoco(elements: int) -> Array:
    whole = matrices(_built(elements))
    across = np.array([move in ("x", "tilt_y") for _, move in whole.dofs])
    squares = eigvalsh(whole.stiffness[np.ix_(across, across)], whole.mass[np.ix_(across, across)])
    found = np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
    return found[found > RIGID][:MODES]


def main() -> None:
    known = exact()
    table = Table("elements", "way", "dofs", *(f"mode {k + 1}\nerror" for k in range(MODES)), "us\na step", "longest\nstep, us", "s for 0.1 s\nof record", title=f"Free shaft: {', '.join(f'{f:.1f}' for f in known)} Hz")
    for elements in ELEMENTS:
        for way, make in (("tendons", by_tendons), ("segments", by_segments)):
            model = make(elements)
            found, highest = bending(model)
            longest, cost = STABLE / (2 * np.pi * highest), stepping(model)
            table.add_row(str(elements), way, str(model.nv), *(f"{f / k - 1:+.1e}" for f, k in zip(found, known, strict=True)), f"{1e6 * cost:.1f}", f"{1e6 * longest:.2f}", f"{0.1 / longest * cost:.1f}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
