"""Poles of a linearised spindle, of flexible shafts by a reduced model.

With state (q, q'), poles and left and right vectors come from one eigenproblem of size 2n.
Source: Genta, *Dynamics of Rotating Systems* (2005), ch. 5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.rotor.reduced import FINE, HALF, reduced
from thermospindle.model.rotor.static import free_motions
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.model.units import HERTZ

FREE = 5e-8
"""Of the highest undamped frequency: what oscillates slower is a free body's rounding error."""
ROUNDING = 1e-14
"""The same of the largest pole of all, a light damper's: what its own rounding leaves."""
PARALLEL = 1e10
"""Condition of a block's vectors, from which a sum over its poles would have less than six digits."""

Between = tuple[Array, Array, Array]
"""What the mass between nodes of shafts adds to M, the matrix N beside it, and what it adds to C +
G (`model.rotor.distributed`), (n, n) each."""


@dataclass(frozen=True, eq=False)
class Block:
    """Degrees of freedom that move by themselves: their numbers (m,) of n, vectors (2m, 2m) of the state (q, q'), and M^-1 (m, m)."""

    own: Integers
    vectors: ComplexArray
    inverse: Array

    @cached_property
    def left(self) -> ComplexArray:
        """Left vectors (2m, m); kept where poles are `replace`d."""
        m = len(self.own)
        return np.asarray(np.linalg.inv(self.vectors)[:, m:] @ self.inverse, complex)


@dataclass(frozen=True, eq=False)
class Poles:
    """All 2n poles (rad/s) with right vectors (n, 2n) and left vectors (2n, n) scaled so that H = right / (i w - pole) left."""

    value: ComplexArray
    right: ComplexArray
    blocks: tuple[Block, ...]

    @property
    def parallel(self) -> bool:
        """Whether vectors of two poles are one to rounding, as of a body that nothing holds, nor
        damps: its double pole at zero has a single vector, and FRFs are no sum over poles."""
        size = np.abs(self.value)
        return bool((size <= FREE * size.max()).any() and any(np.linalg.cond(b.vectors, 1) > PARALLEL for b in self.blocks))

    @cached_property
    def left(self) -> ComplexArray:
        found, at = np.zeros(self.right.shape[::-1], complex), 0
        for b in self.blocks:
            m = len(b.own)
            found[at : at + 2 * m, b.own] = b.left
            at += 2 * m
        return found


LARGE = 40
"""Degrees of freedom from which a chain is taken apart into what moves by itself: the planes of a flexible shaft at rest, its axis always."""


def poles(linear: Matrices) -> Poles:
    """Poles and vectors of M q'' + C q' + K q = f."""
    n = len(linear.mass)
    value, right, blocks = np.zeros(2 * n, complex), np.zeros((n, 2 * n), complex), []
    at = 0
    for own in _apart(linear):
        m, grid = len(own), np.ix_(own, own)
        value[at : at + 2 * m], block = _poles(linear.mass[grid], linear.damping[grid], linear.stiffness[grid], own)
        right[own, at : at + 2 * m] = block.vectors[:m]
        blocks.append(block)
        at += 2 * m
    return Poles(value, right, tuple(blocks))


def _apart(linear: Matrices) -> list[Integers]:
    """Degrees of freedom in blocks that nothing couples; a small chain stays one."""
    n = len(linear.mass)
    if n <= LARGE:
        return [np.arange(n)]
    pattern = sum(_coupled(matrix) for matrix in (linear.mass, linear.damping, linear.stiffness))
    count, label = scipy.sparse.csgraph.connected_components(scipy.sparse.csr_array(pattern), directed=False)
    return [np.flatnonzero(label == k) for k in range(count)]


def _coupled(matrix: Array) -> Array:
    """1 where an entry of a matrix is more than rounding beside its diagonal, else 0."""
    size = np.sqrt(np.abs(np.diag(matrix)))
    return np.asarray(np.abs(matrix) > 1e-12 * np.outer(size, size), float)


def _poles(mass: Array, damping: Array, stiffness: Array, own: Integers) -> tuple[ComplexArray, Block]:
    n = len(mass)
    inverse: Array = np.asarray(np.linalg.inv(mass), float)
    state = np.zeros((2 * n, 2 * n))
    state[:n, n:] = np.eye(n)
    state[n:, :n] = -inverse @ stiffness
    state[n:, n:] = -inverse @ damping
    size = np.sqrt(abs(np.trace(state[n:, :n])) / n) or 1.0  # 0 of what nothing holds
    scale = np.concatenate([np.ones(n), np.full(n, size)])  # balances q against q'
    value, vectors = np.linalg.eig(state * scale / scale[:, None])
    return value, Block(own, vectors * scale[:, None], inverse)


def with_mass_between(linear: Matrices, between: Between | None) -> Poles:
    """Poles p of K + s C + s^2 M - s^4 N, in the order of those without N, which left p^4 N right moves to first order
    (Lancaster 1964, *AIAA J.* 2, 1659). Of an undamped mode that is -w^2 n w / 2 with n of N for a mass of one, and w /
    sqrt(1 + w^2 n) is taken: right where N is, for modes far below those of one element, and no mode above falls among these."""
    if between is None:
        return poles(linear)
    mass, quartic, damping = between
    p = poles(replace(linear, mass=linear.mass + mass, damping=linear.damping + damping))
    return replace(p, value=p.value / np.sqrt(1 - 2 * p.value**3 * np.einsum("mi,im->m", p.left, quartic @ p.right)))


def poles_below(linear: Matrices, highest: float, between: Between | None = None) -> tuple[ComplexArray, ComplexArray]:
    """Poles (m,) of the oscillating modes below `highest` (Hz), one of each conjugate pair, and their right vectors (n, m); of a
    flexible shaft by its reduced model, where `highest` is finite, and with its mass where it is and not at nodes, where that is told."""
    value, right, _ = _below(linear, highest, highest, FINE, between, False)
    return value, right


def vectors_below(linear: Matrices, highest: float, between: Between | None = None) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The same, with their left vectors (m, n), scaled as those of `Poles`; of a flexible shaft
    those up to half of `highest` to 1e-5, the rest to 1e-4."""
    return _below(linear, highest, highest / 2, HALF, between, True)


def _below(
    linear: Matrices, highest: float, band: float, sizes: tuple[float, float], between: Between | None, lefts: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """What these two return, left vectors (0, n) where none are asked for. Large chains by reduced models of each part that moves by
    itself, so that equal modes of two planes stay in their planes; those are for a `band` (Hz), with `sizes` of what they leave out."""
    n, first = len(linear.mass), 0
    if n <= LARGE or not np.isfinite(highest):
        whole = with_mass_between(linear, between)
        kept = oscillating(whole, highest, stiffest_of(linear))
        return whole.value[kept], whole.right[:, kept], whole.left[kept] if lefts else np.zeros((0, n), complex)
    parts, stiffest = [], 0.0
    for own in _apart(linear):
        grid = np.ix_(own, own)
        part = Matrices(linear.mass[grid], linear.damping[grid], linear.stiffness[grid], ())
        small = reduced(part, np.zeros((0, len(own))), HERTZ * band, *sizes)
        q = small.basis
        added = None if between is None else (q.T @ between[0][grid] @ q, q.T @ between[1][grid] @ q, q.T @ between[2][grid] @ q)
        parts.append((own, q, with_mass_between(Matrices(small.mass, small.damping, small.stiffness, ()), added)))
        stiffest = max(stiffest, small.stiffest)
    value = np.concatenate([p.value for _, _, p in parts])
    found = np.array(oscillating(Poles(value, np.zeros((0, len(value)), complex), ()), highest, stiffest), int)
    right, left = np.zeros((n, len(found)), complex), np.zeros((len(found) if lefts else 0, n), complex)
    for own, q, p in parts:
        here = np.flatnonzero((found >= first) & (found < first + len(p.value)))
        which = found[here] - first
        right[np.ix_(own, here)] = q @ p.right[:, which]
        if lefts:
            left[np.ix_(here, own)] = p.left[which] @ q.T
        first += len(p.value)
    return value[found], right, left


def oscillating(p: Poles, highest: float = np.inf, stiffest: float = 0.0) -> list[int]:
    """Indices of the oscillating poles below `highest` (Hz), one of each conjugate pair, in order of frequency.

    A body that nothing holds, as a hub whose bearings have lost contact, moves without oscillating: its double pole
    at zero comes out as a pair of the size sqrt(rounding) of `stiffest` (rad/s), the highest undamped frequency of
    the whole model, by default the largest of the poles, which a damper of light parts makes larger than that.
    """
    size = np.abs(p.value)
    least = max(FREE * (stiffest or size.max()), ROUNDING * size.max())
    order = np.argsort(size, kind="stable")
    return [int(i) for i in order if p.value[i].imag > least and size[i] < HERTZ * highest]


@dataclass(frozen=True)
class Lost:
    """How many natural frequencies rounding hides: undamped ones below `below` (Hz) beside the
    `stiffest` (Hz), and not of a motion that nothing holds."""

    count: int
    below: float
    stiffest: float


def lost_to_rounding(linear: Matrices) -> Lost:
    """What `oscillating` cannot tell from a free motion; parts nearly without mass between stiff neighbours make it so."""
    root, stiffest = np.sqrt(np.diag(linear.mass)), stiffest_of(linear)
    squares = np.linalg.eigvalsh((linear.stiffness + linear.stiffness.T) / 2 / np.outer(root, root))
    slow = int((squares <= (FREE * stiffest) ** 2).sum())
    return Lost(max(slow - free_motions(linear.stiffness).shape[1], 0), FREE * stiffest / HERTZ, stiffest / HERTZ)


def stiffest_of(linear: Matrices) -> float:
    """Bound (rad/s) on the highest undamped frequency of a chain: the largest sum of a row of
    M^-1/2 K M^-1/2 (Gershgorin 1931), which is that or little more."""
    root = np.sqrt(np.abs(np.diag(linear.mass)))
    return float(np.sqrt(np.abs(linear.stiffness / np.outer(root, root)).sum(axis=1).max(initial=0.0)))
