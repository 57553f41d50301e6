"""Which modes a hammer test shows: how high each one's peak is where the hammers strike, which no
FRF shows, and which are the same shape in two planes.

Ewins, *Modal Testing* (2000), 2.5-2.7: a mode's term in the mobility is residue / (i omega - pole),
at its resonance |residue| / (damping ratio x omega).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import HERTZ
from thermospindle.sim.operating import OperatingPoint

TWIN = 0.8
"""MAC of two shapes, planes left aside, from which they are one shape in two planes."""
SILENT = 1e-5
"""Of the highest peak; what is lower no hammer excites."""
SEEN = 0.05
"""Of an FRF at its frequency, by which a mode changes it at least where one sees it: half a decibel."""
ONE = 1e-6
"""Of a pole, within which two are taken together: their vectors are any combination."""


def peaks(point: OperatingPoint, modes: Sequence[Mode]) -> Array:
    """Height (m,) of every mode's own term at its resonance, (m/s)/N, in the driving point's mobility that shows it best."""
    struck = point_rows(point.spindle, point.chain, point.spindle.hammer.hammer_nodes)
    found = point.poles
    residue = np.abs((struck @ found.right) * (found.left @ struck.T).T * found.value).max(axis=0) / np.abs(found.value.real)
    return np.array([residue[np.argmin(np.abs(found.value - m.pole))] for m in modes])


def unseen(point: OperatingPoint, band: tuple[float, float], widths: float = 2.0) -> list[Mode]:
    """Modes within a band (Hz) that no FRF of the points and hammers shows.

    At a mode's frequency its own term of an FRF, with those of modes less than so many half-widths away,
    is below `SEEN` of the whole FRF there: its peak is a change of the curve by no more than that.
    """
    within, m = [mode for mode in point.modes if band[0] <= mode.frequency <= band[1]], point.measurement
    if not within:
        return []
    found, at = point.poles, np.array([mode.damped_frequency() for mode in within])
    residues = np.einsum("rk,kh->rhk", m.response_rows @ found.right, found.left @ m.reference_rows.T)
    whole = np.abs(frf(point.linear, m.response_rows, m.reference_rows, at))
    hidden = []
    for k, mode in enumerate(within):
        near = np.abs(found.value - mode.pole) <= max(widths * abs(mode.pole.real), ONE * abs(mode.pole))
        own = np.abs((residues[:, :, near] / (1j * HERTZ * at[k] - found.value[near])).sum(-1))
        if not np.any(own > SEEN * whole[:, :, k]):
            hidden.append(mode)
    return hidden


def most_excited(point: OperatingPoint, modes: Sequence[Mode], count: int) -> list[int]:
    """At most `count` indices of `modes`, rising: those with the highest peaks. The lesser one of a pair
    that is one shape in two planes is taken only where places are left, and then what no hammer excites."""
    height = peaks(point, modes)
    order = [int(i) for i in np.argsort(-height, kind="stable")]
    profiles = [_profile(point, m) for m in modes]
    first: list[int] = []
    for i in order:
        if height[i] > SILENT * height.max() and all(abs(np.vdot(profiles[i], profiles[k])) ** 2 < TWIN for k in first):
            first.append(i)
    return sorted([*first, *(i for i in order if i not in first)][:count])


def _profile(point: OperatingPoint, mode: Mode) -> ComplexArray:
    """A shape along the axis with its plane left aside, of length 1 in terms of mass: axial motion,
    then the lateral motion and tilt that both planes share most of.

    Planes are the columns of a matrix, whose first left singular vector is what they share: all of
    it for a shape in one plane, however that lies, and for a whirl.
    """
    moved = dict(zip(point.linear.dofs, np.sqrt(np.diag(point.linear.mass)) * mode.shape, strict=True))
    bodies = list(dict.fromkeys(body for body, _ in moved))
    x, y, z, about_x, about_y = ([moved.get((body, move), 0.0) for body in bodies] for move in MOVES)
    left, size, _ = np.linalg.svd(np.array([x + about_y, y + [-tilt for tilt in about_x]]).T, full_matrices=False)
    profile = np.concatenate([z, size[0] * left[:, 0]])
    return np.asarray(profile / np.linalg.norm(profile))
