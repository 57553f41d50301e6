"""Constant loss factors as viscous damping: each mode is damped by the strain energy that it has in what is lossy.

A material or a joint with the loss factor eta has the complex stiffness (1 + i eta) K_e, the same at all
frequencies, which no motion in time follows: it would answer before it is struck (Crandall, *J. Sound Vib.*
11 (1970) 3). What a mode of the whole loses in a cycle is known, though, and a damper loses as much of it:

    2 zeta_r = sum over e of eta_e phi_r^T K_e phi_r / (phi_r^T K phi_r)

(Ungar & Kerwin, *J. Acoust. Soc. Am.* 34 (1962) 954; Johnson & Kienholz, *AIAA J.* 20 (1982) 1284). With the
undamped modes at rest Phi, Phi^T M Phi = 1 and Phi^T K Phi = W^2, the matrix that has this on its diagonal is

    C = (M Phi) W^-1/2 (sum over e of eta_e Phi^T K_e Phi) W^-1/2 (M Phi)^T,

symmetric and never negative, eta M^1/2 (M^-1/2 K M^-1/2)^1/2 M^1/2 where everything is lossy alike. It is a constant matrix of
dampers, so that FRFs are causal, and so are records in time: those of `model.rotor.reduced` for a flexible shaft, between all
of whose nodes the dampers lie, and MuJoCo's for a few rigid bodies. What it is not: between resonances the loss is that of the
nearest modes and not eta; the modes of a turning rotor have the damper of those at rest, eta f / f_0 of one that has moved from
f_0 to f; and it acts in the fixed frame, as all damping of a chain. A free body's modes, of the frequency 0, lose nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from thermospindle.model.types import Array

RIGID = 1e-13
"""Of the largest square of a frequency: below is a free body's rounding error."""


def damping_of_loss(mass: Array, stiffness: Array, lossy: Sequence[tuple[Array, Array]]) -> Array:
    """Damping matrix (n, n), N s/m and so on, of elements `lossy` (loss factor times stiffness (5,
    5), rows (5, n)) in a chain with masses (n,) and stiffness (n, n).

    Degrees of freedom that nothing couples are worked out by themselves, so that equal modes of two planes stay in their planes.
    """
    whole = np.zeros_like(stiffness)
    k, size = (stiffness + stiffness.T) / 2, np.sqrt(np.abs(np.diag(stiffness)))
    coupled = scipy.sparse.csr_array((np.abs(k) > 1e-12 * np.outer(size, size)).astype(float))
    count, label = scipy.sparse.csgraph.connected_components(coupled, directed=False)
    felt = (_roots(np.array([own for own, _ in lossy])) @ np.array([rows for _, rows in lossy])).reshape(-1, len(mass))
    for block in range(count):
        own = np.flatnonzero(label == block)
        root = np.sqrt(mass[own])
        squares, vectors = np.linalg.eigh(k[np.ix_(own, own)] / np.outer(root, root))
        flexible = squares > RIGID * max(float(squares[-1]), 0.0)
        if not flexible.any():
            continue
        shares = (felt[:, own] / root) @ vectors[:, flexible] * squares[flexible] ** -0.25  # rows of sqrt(eta K_e) Phi W^-1/2
        damper = shares @ (vectors[:, flexible] * root[:, None]).T
        whole[np.ix_(own, own)] = damper.T @ damper
    return whole


def _roots(matrices: Array) -> Array:
    """Matrices R (k, 5, 5) with R^T R = each of some symmetric ones, or the nearest ones without negative stiffness."""
    value, vector = np.linalg.eigh((matrices + matrices.transpose(0, 2, 1)) / 2)
    return np.asarray(np.sqrt(np.maximum(value, 0.0))[:, :, None] * vector.transpose(0, 2, 1))
