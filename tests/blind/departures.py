"""In what a machine departs from its drawing alike in all tests: masses otherwise, and random
matrices of stiffness and damping in its modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Matrices, RotorBase
from thermospindle.model.types import Array

OF_A_BODY, OF_A_SHAFT = 5, 2


def ways_of_mass(spindle: Spindle) -> int:
    """How many shares tell how a spindle has its mass otherwise."""
    return OF_A_BODY * len(spindle.structure.rigid_bodies) + OF_A_SHAFT * len(spindle.structure.shafts)


def distributed(chain: RotorBase, spindle: Spindle, shares: Sequence[float]) -> RotorBase:
    """Of every rigid body mass, inertias about x, y (of what turns the first for both) and z, and
    the height of its centre of mass in radii of gyration, off by five shares; of every shaft the
    masses of its nodes off by two, one that grows to its end and one to the square of the way there."""
    if not len(shares):
        return chain
    left, factor = list(shares), dict[str, float]()
    drawn = {b.name for b in spindle.structure.rigid_bodies}
    bodies = {}
    for b in chain.bodies:
        if b.name in drawn:
            m, x, y, polar, up = (left.pop(0) for _ in range(OF_A_BODY))
            arm = np.sqrt(np.mean(b.inertia[:2]) / b.mass)
            inertia = (b.inertia[0] * (1 + x), b.inertia[1] * (1 + (x if b.turns else y)), b.inertia[2] * (1 + polar))
            bodies[b.name] = replace(b, mass=b.mass * (1 + m), inertia=inertia, z=b.z + up * float(arm))
    for s in spindle.structure.shafts:
        end, square = (left.pop(0) for _ in range(OF_A_SHAFT))
        z = {b.name: b.z for b in chain.bodies if b.name in s.bodies}
        low, high = min(z.values()), max(z.values())
        along = {name: (at - low) / (high - low) for name, at in z.items()}
        factor |= {name: 1 + end * a + square * a**2 for name, a in along.items()}
    for b in chain.bodies:
        if (f := factor.get(b.name)) is not None:
            bodies[b.name] = replace(b, mass=f * b.mass, inertia=(f * b.inertia[0], f * b.inertia[1], f * b.inertia[2]))
    return replace(chain, bodies=tuple(bodies.get(b.name, b) for b in chain.bodies))


def perturbed(linear: Matrices, reference: Matrices, drawing: Spindle, errors: tuple[float, float], seed: int) -> Matrices:
    """K and C with a random symmetric matrix in the modes of the drawing's `reference` matrices, the
    same in every test, of `errors` of stiffness and damping. A weak mode is none of these: it stays
    an oscillator on its body, which modal errors of the spindle do not couple to anything else."""
    of_k, of_c, kept = modal_errors(reference, drawing, errors)
    n = len(kept)  # what is hidden, and a weak mode, may have added bodies, after these
    random = np.random.default_rng([seed, 51])

    def symmetric() -> Array:
        g = random.standard_normal((n, n))
        return (np.tril(g) + np.tril(g, -1).T)[np.ix_(kept, kept)]

    stiffness, damping = linear.stiffness.copy(), linear.damping.copy()
    stiffness[:n, :n] += of_k @ symmetric() @ of_k.T
    damping[:n, :n] += of_c @ symmetric() @ of_c.T
    return replace(linear, stiffness=stiffness, damping=damping)


def modal_errors(reference: Matrices, drawing: Spindle, errors: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Columns (n, m) each of an error of K and of C, v v^T or v w^T + w v^T, at one standard
    deviation: of the modes of `reference` to twice the drawing's band, (n,) true of all. A mode's
    frequency is wrong by half of its stiffness, relatively; its damping by a share of its own."""
    root = np.sqrt(np.diag(reference.mass))
    square, vectors = np.linalg.eigh(reference.stiffness / root[:, None] / root[None, :])
    omega = np.sqrt(np.maximum(square, 0.0))
    loss = np.sqrt(np.maximum(np.diag(vectors.T @ (reference.damping / root[:, None] / root[None, :]) @ vectors), 0.0))
    kept = omega < 2 * np.pi * 2 * drawing.hammer.band[1]
    back = (root[:, None] * vectors)[:, kept]  # M phi: takes modal matrices to the dofs'
    return back * omega[kept] * np.sqrt(2 * errors[0]), back * loss[kept] * np.sqrt(errors[1]), kept
