"""Blocks of lines, compressed without loss.

A measured FRF is smooth over a few lines wherever no pole is near, so that k neighbouring lines hold p < k numbers and noise. A block of
lines is replaced by the values of its least-squares polynomial of degree p - 1 at the p Gauss nodes of the block's own discrete measure.
By discrete orthogonality (Gautschi, *Orthogonal Polynomials*, 2004, Theorem 1.31 and 1.4.1) these values have independent errors of
variance sd^2 / weight, the weights adding up to k: nothing is lost, and the model is evaluated at p frequencies instead of k. A block is
divided until what its polynomial leaves is noise; where poles are sharp, single lines remain.
Polynomials are in the lines' numbers: a sweep whose steps grow evenly (a logarithmic one) is as smooth in these as one of even steps.
Under an exponential window the noise of lines is correlated (`window`), and so is that of values.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.sparse import block_diag, csr_array

from thermospindle.diagnosis.data.window import Alike, Window, covariance, left_by
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.frf import even

NODES = 5  # of a block: polynomials of degree 4
LONGEST = 160  # lines in a block
BEYOND = 4  # polynomials of the next degrees, where what a block lacks shows first
LACK_OF_FIT = 4.0  # standard deviations of a block's chi2, and of that of the next degrees alone, from which it is divided


def basis(k: int, p: int = NODES) -> tuple[Array, Array, Array]:
    """Orthonormal polynomials (k, p) on k equally spaced lines; Gauss nodes (p,) in lines from the first, and their weights (p,)."""
    x = np.arange(float(k)) - (k - 1) / 2
    j = np.arange(1, p)
    off = np.sqrt(j**2 * (k**2 - j**2) / (4 * (4 * j**2 - 1.0)))  # Gram polynomials: Gautschi 2004, Table 1.2 (discrete Chebyshev)
    nodes, vectors = np.linalg.eigh(np.diag(off, 1) + np.diag(off, -1))
    weights = k * vectors[0] ** 2  # Golub & Welsch 1969
    return at_nodes(x, k, p), nodes + (k - 1) / 2, weights


def divided(value: ComplexArray, sd: Array, window: Window, gaps: Sequence[int] = ()) -> list[tuple[int, int]]:
    """Ranges of lines [first, after) whose polynomial leaves nothing but noise, from the whole band
    down by halves; none reaches over `gaps`, the lines before which some were left out."""
    n, found = value.shape[-1], []
    parts = sorted({*np.linspace(0, n, n // LONGEST + 2).astype(int).tolist(), *gaps})
    open_ranges = list(pairwise(parts))
    while open_ranges:
        first, after = open_ranges.pop()
        k = after - first
        if k <= NODES + 1:
            found.append((first, after))
            continue
        q, _, _ = basis(k, min(NODES + BEYOND, k))
        v, variance = value[:, :, first:after], sd[:, :, first:after] ** 2
        left = v - (v @ q[:, :NODES]) @ q[:, :NODES].T
        beyond = np.abs(v @ q[:, NODES:]) ** 2 / (variance @ q[:, NODES:] ** 2)
        _, rest, spread = left_by(q[:, :NODES], window)
        following, _, _ = left_by(q[:, NODES:], window)
        frfs = left.shape[0] * left.shape[1]
        whole = _lacking(np.abs(left) ** 2 / variance, frfs * rest, frfs * spread)
        if whole or _lacking(beyond, frfs * following.sum(), frfs * (following**2).sum()):
            middle = (first + after) // 2
            open_ranges += [(first, middle), (middle, after)]
        else:
            found.append((first, after))
    return sorted(found)


def _lacking(squares: Array, mean: float, variance: float) -> bool:
    return float(squares.sum()) > mean + LACK_OF_FIT * np.sqrt(variance)


def compressed(
    frequency: Array, value: ComplexArray, parts: Array, blocks: list[tuple[int, int]], window: Window
) -> tuple[Array, ComplexArray, Array, Alike | None]:
    """Frequencies (L,), values and standard errors (n_resp, n_ref, L), and how these go together; `parts` (parts,
    n_resp, n_ref, n) of the variance of lines are each by itself, but for the last of two, which a window makes alike."""
    at, kept, mixing, variance = [], [], [], []
    for first, after in blocks:
        k, own = after - first, slice(first, after)
        if k <= NODES + 1:
            at.append(frequency[own])
            kept.append(value[:, :, own])
            mixing.append(np.eye(k))
            variance.append(parts[..., own])
            continue
        q, nodes, weights = basis(k)
        polynomials = at_nodes(nodes - (k - 1) / 2, k)  # (p nodes, p polynomials)
        at.append(_between(nodes, frequency[own]))
        kept.append((value[:, :, own] @ q) @ polynomials.T)
        mixing.append(polynomials @ q.T)
        of_nodes = (parts[..., own] @ q**2) @ (polynomials**2).T  # equal white noise gives sd^2 / weight
        variance.append(np.maximum(of_nodes, parts[..., own].min(axis=-1, keepdims=True) / weights))
    whole, alike = np.concatenate(variance, axis=-1), None
    if window.damped:
        number, every = np.rint(frequency * window.length).astype(int), csr_array(block_diag(mixing))
        whole[1] *= np.diag(covariance(every, number, window)).real / every.power(2).sum(axis=1)
        alike = Alike(every, number, window, whole[1] / whole.sum(axis=0))
    return np.concatenate(at), np.concatenate(kept, axis=-1), np.sqrt(whole.sum(axis=0)), alike


def _between(nodes: Array, frequency: Array) -> Array:
    """Frequencies at fractions of line numbers: straight between even lines, by a cubic spline
    between others, exact to 1e-9 on a logarithmic axis."""
    lines = np.arange(float(len(frequency)))
    return np.asarray(np.interp(nodes, lines, frequency) if even(frequency) else CubicSpline(lines, frequency)(nodes), float)


def at_nodes(x: Array, k: int, p: int = NODES) -> Array:
    """The orthonormal polynomials (len(x), p) of `basis` at positions `x` in lines from the middle."""
    j = np.arange(1, p)
    off = np.sqrt(j**2 * (k**2 - j**2) / (4 * (4 * j**2 - 1.0)))
    previous, current = np.zeros(len(x)), np.full(len(x), 1 / np.sqrt(k))
    columns = [current]
    for m in range(p - 1):
        following = (x * current - (off[m - 1] if m else 0.0) * previous) / off[m]
        previous, current = current, following
        columns.append(current)
    return np.stack(columns, axis=1)
