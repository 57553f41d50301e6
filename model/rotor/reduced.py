"""A reduced basis for the response of a flexible shaft within a band: fewer degrees of freedom, with an error that is known.

Galerkin: q = Q a, with M, C, K projected on the columns of Q. Q holds the undamped modes below `BEYOND` times the band and, of
all modes above together, the static answer to a force on every row asked for (residual flexibility: MacNeal 1971, *Comput.
Struct.* 1, 581) and to the damping and gyroscopic forces of the modes kept, then what inertia, damping and gyroscopic forces make
of these answers in turn (a second-order Krylov space: Bai & Su 2005, *SIAM J. Matrix Anal. Appl.* 26, 640); of the whole what is
larger than `SMALL` of the largest. What is left out enters an FRF by the product of the errors of a force's and of a point's
field: measured on `five_bearing` and `mk7702`, at rest and at 12,000 rpm, an FRF is off by at most 1e-5 of the largest response
at the same frequency (`tests/model/test_reduced.py`). Derivatives by any change of M, C and K are those of the reduced model.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.types import Array

BEYOND, SMALL = 1.5, 1e-4
"""Modes up to so many times the band are kept as they are; of the answers of those above what is
smaller than this share of the largest is left out."""
FINE = 2.0, 1e-5
"""The same for modes and their shapes: frequencies in the band to 1e-9 where masses are at nodes."""
HALF = 2.0, 1e-4
"""The same for modes up to twice the band, those within it to 1e-5: `five_bearing` at 8000 rpm has
a basis of 56 then, and of 88 with `FINE` for all."""
ORDER = 2  # of the answers of the modes above


@dataclass(frozen=True, eq=False)
class Reduced:
    """M, C + G and K (r, r) over the columns of `basis` (n, r); `stiffest` (rad/s) is the highest undamped frequency of the whole model."""

    basis: Array
    mass: Array
    damping: Array
    stiffness: Array
    stiffest: float


def reduced(linear: Matrices, rows: Array, highest: float, beyond: float = BEYOND, small: float = SMALL) -> Reduced:
    """The reduced model of a chain with lumped (diagonal) mass for forces and responses along `rows` (m, n), up to `highest` (rad/s).

    Raises `ValueError` where a mass is not positive.
    """
    q, stiffest = _basis(linear, rows, highest, beyond, small)
    return Reduced(q, q.T @ linear.mass @ q, q.T @ linear.damping @ q, q.T @ linear.stiffness @ q, stiffest)


def _basis(linear: Matrices, rows: Array, highest: float, beyond: float, small: float) -> tuple[Array, float]:
    """The basis (n, r) of `reduced`, with Q^T M Q = 1, and the highest undamped frequency (rad/s)."""
    masses = np.diag(linear.mass)
    if not np.all(masses > 0):  # of an effect that is fitted beyond its limit
        raise ValueError("a mass of nothing, or less, has no modes")
    root = np.sqrt(masses)
    squares, vectors = np.linalg.eigh((linear.stiffness + linear.stiffness.T) / 2 / np.outer(root, root))
    kept, stiffest = squares < (beyond * highest) ** 2, float(np.sqrt(squares[-1]))
    kept[0] = True  # where there is none in the band and no force, something is left
    if kept.all():
        return np.asarray(vectors / root[:, None]), stiffest
    damping = vectors.T @ (linear.damping / np.outer(root, root)) @ vectors
    flexible = 1 / squares[~kept, None]
    asked = vectors[:, ~kept].T @ (rows / root).T * flexible
    size = np.linalg.norm(asked, axis=0)
    inner, outer = damping[np.ix_(~kept, ~kept)], damping[np.ix_(~kept, kept)]
    answers = [asked[:, size > 0] / size[size > 0], highest * flexible * outer, highest * flexible * damping[np.ix_(kept, ~kept)].T]
    every = [last := np.concatenate(answers, axis=1)]
    for _ in range(ORDER - 1):
        last = np.concatenate([highest**2 * flexible * last, highest * flexible * (inner @ last)], axis=1)
        every.append(last)
    directions, sizes, _ = np.linalg.svd(np.concatenate(every, axis=1), full_matrices=False)
    directions = directions[:, sizes > small * sizes[0]]
    return np.asarray(np.concatenate([vectors[:, kept], vectors[:, ~kept] @ directions], axis=1) / root[:, None]), stiffest
