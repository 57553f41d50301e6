"""Exact FRFs of a linearised spindle: the sum of its modal terms, or line by line.

H(omega) = sum over all 2n poles of (row phi)(psi^H column) / (i omega - lambda).
Source: Ewins, *Modal Testing* (2000), 2.5-2.8.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Layout, Matrices, RotorBase, row_of
from thermospindle.model.rotor.poles import LARGE, Between, poles
from thermospindle.model.rotor.reduced import reduced
from thermospindle.model.types import Array, ComplexArray

LINES = 256
"""Lines that are solved for at once."""
POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Of s, by which an FRF is more than the receptance."""


def frf(
    linear: Matrices, response: Array, reference: Array, frequency: Array | ComplexArray, kind: str = "receptance", between: Between | None = None
) -> ComplexArray:
    """Exact FRF (n_resp, n_ref, n_freq) between response rows (n_resp, n) and force rows (n_ref, n) at `frequency` (Hz).

    `kind`: receptance m/N, mobility (m/s)/N, accelerance (m/s2)/N. With the mass `between` nodes of shafts it is that of the reduced
    model, whose modes know nothing of it: 3e-4 of the largest off at the highest lines, where masses at nodes are off by percents.
    """
    rows, columns, at = np.atleast_2d(response), np.atleast_2d(reference), np.asarray(2j * np.pi * np.atleast_1d(frequency), complex)
    if between is not None:
        return _between_nodes(linear, between, rows, columns, at, POWER[kind])
    p = poles(linear)
    if p.parallel:
        return _solved(linear, rows, columns, at, POWER[kind])
    at_response = np.atleast_2d(response) @ p.right
    at_reference = p.left @ np.atleast_2d(reference).T
    s = 2j * np.pi * np.asarray(frequency)
    residues = at_response[:, None, :] * at_reference.T[None, :, :]
    # a pole and its conjugate add up to a term with real numerators, which halves the work on the lines
    upper, real = p.value.imag > 0, p.value.imag == 0
    pole, residue = p.value[upper], residues[:, :, upper]
    term = 1 / (s * (s - 2 * pole.real[:, None]) + np.abs(pole[:, None]) ** 2)
    value = (2 * residue.real) @ (s * term) - (2 * (residue * pole.conj()).real) @ term
    if real.any():
        value += residues[:, :, real] @ (1 / (s - p.value[real][:, None]))
    return value * s ** POWER[kind]


def _between_nodes(linear: Matrices, between: Between, response: Array, reference: Array, s: ComplexArray, power: int) -> ComplexArray:
    """The same as `_solved`, of a flexible shaft by its reduced model, with its mass where it is and not at nodes."""
    mass, quartic, damping = between
    if len(linear.mass) > LARGE:
        small = reduced(linear, np.concatenate([response, reference]), float(np.abs(s).max()))
        q = small.basis
        linear, response, reference = Matrices(small.mass, small.damping, small.stiffness, ()), response @ q, reference @ q
        mass, quartic, damping = (q.T @ added @ q for added in between)
    return _solved(replace(linear, mass=linear.mass + mass, damping=linear.damping + damping), response, reference, s, power, quartic)


def _solved(linear: Matrices, response: Array, reference: Array, s: ComplexArray, power: int, quartic: Array | float = 0.0) -> ComplexArray:
    """s^power times response (n_resp, n) (s^2 M + s C + K - s^4 N)^-1 reference^T (n_ref, n), line
    by line (n_freq,), which asks nothing of the poles; N is `quartic`."""
    parts = []
    for at in np.array_split(s, max(len(s) // LINES, 1)):
        x = at[:, None, None]
        parts.append(np.moveaxis(response @ np.linalg.solve(x**2 * linear.mass + x * linear.damping + linear.stiffness - x**4 * quartic, reference.T) * x**power, 0, -1))
    return np.concatenate(parts, axis=-1)


def point_rows(spindle: Spindle, chain: RotorBase, nodes: tuple[int, ...] | None = None) -> Array:
    """Rows (n_points, n) of the scene's measuring points, in the order of `nodes` (all by default); read only."""
    return _point_rows(chain.layout, spindle.points if nodes is None else tuple(spindle.point(n) for n in nodes))


@lru_cache(maxsize=256)
def _point_rows(layout: Layout, points: tuple[Point, ...]) -> Array:
    rows = np.array([row_of(layout, p) for p in points])
    rows.flags.writeable = False
    return rows
