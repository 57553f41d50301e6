"""Modes of a linearised spindle: their frequencies and damping, what moves, and where their energy is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thermospindle.model.rotor.chain import Matrices, RotorBase, element_rows, matrices, motion_rows
from thermospindle.model.rotor.poles import poles_below
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array, ComplexArray

LINE, LESSER = 0.04, 0.05
"""Of the largest motion, below which a mode moves along a line, and of the largest orbit's area, above which one of the other sense counts."""


@dataclass(frozen=True)
class Mode:
    """One mode: pole = -damping_ratio w + i w sqrt(1 - damping_ratio^2) with w = 2 pi frequency.

    `shape` (n,) complex over the dofs, largest element 1; `energy`: share of the strain energy in every element, sum 1; `kind`: axial,
    rocking or lateral; `whirl`: forward, backward, mixed (forward at one place, backward at another) or none, of all that turns.
    """

    frequency: float  # Hz, undamped
    damping_ratio: float
    kind: str
    whirl: str
    energy: Mapping[str, float]
    shape: ComplexArray
    pole: complex

    def __repr__(self) -> str:
        whirl = "" if self.whirl == "none" else f", {self.whirl}"
        return f"<{type(self).__name__} {self.kind}{whirl}, {self.frequency:.2f} Hz, damping {100 * self.damping_ratio:z.3f} %>"

    def damped_frequency(self) -> float:
        return abs(self.pole.imag) / (2 * np.pi)


def to_real(shape: ComplexArray) -> complex:
    """The factor of size one by which the parts of a shape (n,) that move in phase are real."""
    return complex(np.exp(-0.5j * np.angle(np.sum(shape**2))))


def modes(chain: RotorBase, linear: Matrices | None = None, highest: float = np.inf) -> list[Mode]:
    """Oscillating modes below `highest` (Hz) in order of frequency; `linear` defaults to the chain's own matrices.

    Those of a flexible shaft below a finite `highest` come from its reduced model, frequencies to 1e-9.
    """
    linear = linear or matrices(chain)
    value, shapes = poles_below(linear, highest)
    shapes = shapes / shapes[np.argmax(np.abs(shapes), axis=0), np.arange(len(value))]
    every = np.concatenate([element_rows(chain, e) for e in chain.elements]) @ shapes
    strain = np.array([_quadratic(part, e.stiffness) for part, e in zip(every.reshape(len(chain.elements), 5, len(value)), chain.elements, strict=True)])
    whole = strain.sum(axis=0)
    strain = strain / np.where(whole > 0, whole, 1.0)  # none of a part that hangs free, but for rounding
    names = [e.name for e in chain.elements]
    kind, whirl = kinds(linear, shapes), _whirls(chain, shapes)
    return [
        Mode(
            frequency=float(abs(p) / (2 * np.pi)),
            damping_ratio=float(-p.real / abs(p)),
            kind=kind[m],
            whirl="none" if kind[m] == "axial" else whirl[m],
            energy=dict(zip(names, strain[:, m].tolist(), strict=True)),
            shape=shapes[:, m],
            pole=complex(p),
        )
        for m, p in enumerate(value)
    ]


def _quadratic(vectors: ComplexArray, matrix: Array) -> Array:
    return np.real(np.sum(vectors.conj() * (matrix @ vectors), axis=0))


def kinds(linear: Matrices, shapes: ComplexArray) -> tuple[str, ...]:
    """Kind of every shape (n, m): axial when most kinetic energy is along z, else rocking when most of the rest is in tilts, else lateral."""
    kinetic = np.diag(linear.mass)[:, None] * np.abs(shapes) ** 2
    share = {move: kinetic[[i for i, (_, own) in enumerate(linear.dofs) if own == move]].sum(axis=0) for move in MOVES}
    axial = share["z"] > 0.5 * kinetic.sum(axis=0)
    rocking = share["tilt_x"] + share["tilt_y"] > share["x"] + share["y"]
    return tuple("axial" if a else "rocking" if r else "lateral" for a, r in zip(axial, rocking, strict=True))


def _whirls(chain: RotorBase, shapes: ComplexArray) -> list[str]:
    """Sense in which the axis of what turns circulates in every shape (n, m): y a quarter period behind x is forward for +z speed.

    Asked at the two places of every turning body, its radius of gyration below and above its centre, that have its inertia. Of an orbit 2 Im(x y*) is its area over pi / 2, and
    |x|^2 + |y|^2 where it is a circle. None, where the largest area has less than `LINE` of the largest motion. On supports that differ in x and y one place may
    go forward where another goes backward (Genta, 2005, 6.2; Friswell and others, *Dynamics of Rotating Machines*, 2010, 6.4): mixed, where the largest area of the
    lesser sense has more than `LESSER` of the largest.
    """
    ends = [(b.name, b.z + side * np.sqrt((b.inertia[0] + b.inertia[1]) / (2 * b.mass))) for b in chain.bodies if b.turns for side in (-1.0, 1.0)]
    if not ends:
        return ["none"] * shapes.shape[1]
    x, y = (np.array(rows) @ shapes for rows in zip(*(motion_rows(chain, name, (0.0, 0.0, float(z)))[:2] for name, z in ends), strict=True))
    area = 2 * np.imag(x * y.conj()) * np.sign(chain.speed)
    forward, backward = np.maximum(area.max(axis=0), 0.0), np.maximum(-area.min(axis=0), 0.0)
    line = np.maximum(forward, backward) <= LINE * np.max(np.abs(x) ** 2 + np.abs(y) ** 2, axis=0)
    mixed = np.minimum(forward, backward) > LESSER * np.maximum(forward, backward)
    return np.select([line, mixed, forward > backward], ["none", "mixed", "forward"], "backward").tolist()


def group_energy(chain: RotorBase, mode: Mode) -> dict[str, float]:
    """Strain energy shares summed over the elements' groups (base, flange, bearings, ...), in chain order."""
    shares: dict[str, float] = {}
    for element in chain.elements:
        shares[element.group] = shares.get(element.group, 0.0) + mode.energy[element.name]
    return shares
