"""Static answers of a spindle: stiffness at its points, what its bearings carry, and which part gives how much.

K u = f for a unit force at a point. By Clapeyron's theorem the compliance at the point is twice the strain energy, so that
the shares of energy are the shares of compliance. Where the whole may move freely, as along the axis or as a shaft that
nothing holds, a force that does work on that motion has no static answer; any other has, and the free motion stays out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy

from thermospindle.model.bearing.state import ALIKE
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Element, RotorBase, element_rows, matrices, point_row
from thermospindle.model.types import Array

FREE = 1e-12
"""Of the largest eigenvalue of D^-1/2 K D^-1/2 with D the diagonal of K: what is below is a motion that nothing resists."""
CLEARLY = 100.0
"""Times that, from which the reciprocal condition says that there is none; its estimate is seldom more than three times too large."""


@dataclass(frozen=True)
class Static:
    """Answer to a unit force at a point, along its direction.

    `stiffness` (N/m) is inf where the point cannot move and 0 where nothing holds it; `reactions` (N) are the forces of the bearings
    on what turns, along the direction; `shares` those of the compliance by shaft, bearing and joint group, sum 1.
    """

    point: Point
    stiffness: float
    reactions: Mapping[str, float]
    shares: Mapping[str, float]


def static(spindle: Spindle, chain: RotorBase, point: Point) -> Static:
    """Stiffness, reactions and shares at one point of a chain at its operating state."""
    linear = matrices(chain)
    row = point_row(chain, point)
    moved = displacement(linear.stiffness, row)
    names = {b.name: b for b in spindle.all_bearings}
    if moved is None:
        return Static(point, 0.0, dict.fromkeys(names, 0.0), {})
    reactions = dict.fromkeys(names, 0.0)
    energy: dict[str, float] = {}
    turning = {b.name for b in chain.bodies if b.turns}
    for element in chain.elements:
        relative = element_rows(chain, element) @ moved
        force = element.stiffness @ relative
        key = element.name if element.name in names else element.group
        energy[key] = energy.get(key, 0.0) + float(relative @ force)
        if element.name in names:
            on_turning = -1.0 if element.b in turning and element.a not in turning else 1.0
            reactions[element.name] = on_turning * float(np.array(point.direction) @ force[:3])
    compliance = float(row @ moved)
    total = sum(energy.values())
    shares = {key: value / total for key, value in energy.items()} if total > 0 else {}
    return Static(point, 1 / compliance if compliance > 0 else np.inf, reactions, shares)


@dataclass(frozen=True)
class Around:
    """Answers at one point: its `own`, of a force on the axis along it at the point's height, and
    `across`, the other way across the axis, None of a point that measures along it."""

    own: Static
    axial: Static
    across: Static | None

    @property
    def alike(self) -> bool:
        """Whether the point is as stiff the other way across the axis as along its direction."""
        return self.across is None or bool(np.isclose(self.across.stiffness, self.own.stiffness, rtol=ALIKE))


def around(spindle: Spindle, chain: RotorBase, point: Point) -> Around:
    """The answers at a point of a chain at its operating state."""
    x, y, _ = point.direction
    axial = replace(point, position=(0.0, 0.0, point.position[2]), direction=(0.0, 0.0, 1.0))  # off the axis it would tilt what it acts on
    across = static(spindle, chain, replace(point, direction=(abs(y), abs(x), 0.0))) if x or y else None
    return Around(static(spindle, chain, point), static(spindle, chain, axial), across)


def free_motions(stiffness: Array) -> Array:
    """Motions (n, m) that nothing resists, orthonormal. Degrees of freedom are scaled by their own stiffness
    (Jacobi's scaling, van der Sluis 1969, *Numer. Math.* 14, 14: within a factor n of the best condition that
    a diagonal gives), so that neither units nor masses count: a light part on a stiff seat frees nothing else."""
    own = np.diag(stiffness)
    root = np.sqrt(np.where(own > 0, own, 1.0))
    scaled = stiffness / np.outer(root, root)
    if _regular(scaled):
        return np.zeros((len(own), 0))
    value, vector = np.linalg.eigh(scaled)
    free = vector[:, value < FREE * value[-1]] / root[:, None]
    return np.linalg.qr(free / np.linalg.norm(free, axis=0))[0] if free.size else free


def _regular(scaled: Array) -> bool:
    """Whether a symmetric matrix is clearly positive: by its Cholesky factor, a tenth of the work of
    its eigenvalues, and an estimate of its condition in the sum norm, which is no less than that of
    its eigenvalues (Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed. 2002, ch. 15)."""
    factor, failed = scipy.linalg.lapack.dpotrf(scaled, lower=1)
    if failed:
        return False
    reciprocal, failed = scipy.linalg.lapack.dpocon(factor, np.linalg.norm(scaled, 1), uplo="L")
    return not failed and reciprocal > CLEARLY * FREE


def displacement(stiffness: Array, force: Array) -> Array | None:
    """Displacement (n,) under a force (n,); None where the force drives a motion that nothing resists."""
    held = firmly(stiffness, force)
    return None if held is None else np.asarray(np.linalg.solve(held, force))


def firmly(stiffness: Array, force: Array) -> Array | None:
    """The stiffness (n, n) with what nothing resists held, which the force (n,) does not drive; None where it does."""
    free = free_motions(stiffness)
    if free.size and np.linalg.norm(free.T @ force) > 1e-6 * np.linalg.norm(force):
        return None
    return np.asarray(stiffness + np.trace(stiffness) / len(stiffness) * free @ free.T)


def rated(spindle: Spindle) -> bool:
    """Whether every bearing of a spindle has a rated stiffness or is given by numbers."""
    return bool(spindle.all_bearings) and all(b.rated_stiffness is not None for b in spindle.bearings)


def rated_chain(spindle: Spindle, chain: RotorBase) -> RotorBase:
    """The chain with every bearing a spring of its rated radial stiffness from what turns to rigid
    ground, as catalogues and design calculations have it: without tilt stiffness, coupling or housing.
    Bearings given by numbers keep theirs, to ground; those between two turning parts stay between them."""
    ratings = {b.name: b for b in spindle.bearings}
    given = {b.name for b in spindle.linear_bearings} | {r.name for r in spindle.roller_bearings}
    turning = {b.name for b in chain.bodies if b.turns}
    elements: list[Element] = []
    for e in chain.elements:
        if e.name not in ratings and e.name not in given:
            elements.append(e)
            continue
        own, other = (e.b, "ground") if e.a not in turning else (e.a, e.b if e.b in turning else "ground")
        stiffness = e.stiffness
        if e.name in ratings:
            radial = ratings[e.name].rated_stiffness or 0.0
            stiffness = np.diag([radial, radial, e.stiffness[2, 2], 0.0, 0.0])
        damping = e.damping * (stiffness[0, 0] / e.stiffness[0, 0] if e.stiffness[0, 0] else 1.0)
        elements.append(replace(e, a=own, b=other, stiffness=stiffness, damping=damping, slides=""))
    moved = {e.slides for e in chain.elements if e.slides}
    bodies = tuple(b for b in chain.bodies if b.name not in moved)
    return replace(chain, bodies=bodies, elements=tuple(e for e in elements if e.b not in moved))
