"""Modes and exact FRFs of a linearised spindle.

With state (q, q'), poles and left and right vectors come from one eigenproblem of size 2n, and every FRF is the sum of its modal
terms: H(omega) = sum over all 2n poles of (row phi)(psi^H column) / (i omega - lambda).
Sources: Genta, *Dynamics of Rotating Systems* (2005), ch. 5; Ewins, *Modal Testing* (2000), 2.5-2.8.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import scipy

from thermospindle.model.machine import Point, Spindle
from thermospindle.model.rotor.chain import Layout, Matrices, RotorBase, element_rows, matrices, motion_rows, row_of
from thermospindle.model.rotor.reduced import FINE, HALF, reduced
from thermospindle.model.rotor.static import free_motions
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.model.units import HERTZ

LINE, LESSER = 0.04, 0.05
"""Of the largest motion, below which a mode moves along a line, and of the largest orbit's area, above which one of the other sense counts."""
FREE = 5e-8
"""Of the highest undamped frequency: what oscillates slower is a free body's rounding error."""
ROUNDING = 1e-14
"""The same of the largest pole of all, a light damper's: what its own rounding leaves."""
PARALLEL = 1e10
"""Condition of a block's vectors, from which a sum over its poles would have less than six digits."""
LINES = 256
"""Lines of an FRF that are solved for at once."""


@dataclass(frozen=True)
class Mode:
    """One mode: pole = -damping_ratio w + i w sqrt(1 - damping_ratio^2) with w = 2 pi frequency.

    `shape` (n,) complex over the dofs, largest element 1; `energy`: share of the strain energy in every element, sum 1;
    `kind`: axial, rocking or lateral; `whirl`: forward, backward, mixed (forward at one place, backward at another) or none, of all that turns.
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
        """Whether vectors of two poles are one to rounding, as of a body that nothing holds, nor damps: its double pole at zero has a single vector, and FRFs are no sum over poles."""
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


POWER = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Of s, by which an FRF is more than the receptance."""


Between = tuple[Array, Array, Array]
"""What the mass between nodes of shafts adds to M, the matrix N beside it, and what it adds to C + G (`model.rotor.distributed`), (n, n) each."""


def frf(
    linear: Matrices, response: Array, reference: Array, frequency: Array | ComplexArray, kind: str = "receptance", between: Between | None = None
) -> ComplexArray:
    """Exact FRF (n_resp, n_ref, n_freq) between response rows (n_resp, n) and force rows (n_ref, n) at `frequency` (Hz).

    `kind`: receptance m/N, mobility (m/s)/N, accelerance (m/s2)/N. With the mass `between` nodes of shafts it is that of the reduced model, whose modes know nothing of it: 3e-4 of the largest
    off at the highest lines, where masses at nodes are off by percents.
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
    """s^power times response (n_resp, n) (s^2 M + s C + K - s^4 N)^-1 reference^T (n_ref, n), line by line (n_freq,), which asks nothing of the poles; N is `quartic`."""
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


def modes(chain: RotorBase, linear: Matrices | None = None, highest: float = np.inf) -> list[Mode]:
    """Oscillating modes below `highest` (Hz) in order of frequency; `linear` defaults to the chain's own matrices.

    Those of a flexible shaft below a finite `highest` come from its reduced model, frequencies to 1e-9.
    """
    linear = linear or matrices(chain)
    value, shapes = poles_below(linear, highest)
    shapes = shapes / shapes[np.argmax(np.abs(shapes), axis=0), np.arange(len(value))]
    every = np.concatenate([element_rows(chain, e) for e in chain.elements]) @ shapes
    strain = np.array([_quadratic(part, e.stiffness) for part, e in zip(every.reshape(len(chain.elements), 5, len(value)), chain.elements, strict=True)])
    strain = strain / strain.sum(axis=0)
    names = [e.name for e in chain.elements]
    kind = kinds(linear, shapes)
    return [
        Mode(
            frequency=float(abs(p) / (2 * np.pi)),
            damping_ratio=float(-p.real / abs(p)),
            kind=kind[m],
            whirl="none" if kind[m] == "axial" else _whirl(chain, shapes[:, m]),
            energy=dict(zip(names, strain[:, m].tolist(), strict=True)),
            shape=shapes[:, m],
            pole=complex(p),
        )
        for m, p in enumerate(value)
    ]


def with_mass_between(linear: Matrices, between: Between | None) -> Poles:
    """Poles p of K + s C + s^2 M - s^4 N, in the order of those without N, which left p^4 N right moves to first order (Lancaster 1964, *AIAA J.* 2, 1659). Of an undamped
    mode that is -w^2 n w / 2 with n of N for a mass of one, and w / sqrt(1 + w^2 n) is taken: right where N is, for modes far below those of one element, and no mode above
    falls among these."""
    if between is None:
        return poles(linear)
    mass, quartic, damping = between
    p = poles(replace(linear, mass=linear.mass + mass, damping=linear.damping + damping))
    return replace(p, value=p.value / np.sqrt(1 - 2 * p.value**3 * np.einsum("mi,im->m", p.left, quartic @ p.right)))


def poles_below(linear: Matrices, highest: float, between: Between | None = None) -> tuple[ComplexArray, ComplexArray]:
    """Poles (m,) of the oscillating modes below `highest` (Hz), one of each conjugate pair, and their right vectors (n, m); of a flexible shaft by
    its reduced model, where `highest` is finite, and with its mass where it is and not at nodes, where that is told."""
    value, right, _ = _below(linear, highest, highest, FINE, between, False)
    return value, right


def vectors_below(linear: Matrices, highest: float, between: Between | None = None) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The same, with their left vectors (m, n), scaled as those of `Poles`; of a flexible shaft those up to half of `highest` to 1e-5, the rest to 1e-4."""
    return _below(linear, highest, highest / 2, HALF, between, True)


def _below(
    linear: Matrices, highest: float, band: float, sizes: tuple[float, float], between: Between | None, lefts: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """What these two return, left vectors (0, n) where none are asked for. Large chains by reduced models of each part that moves by itself, so that equal modes of two planes stay in their planes; those
    are for a `band` (Hz), with `sizes` of what they leave out."""
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

    A body that nothing holds, as a hub whose bearings have lost contact, moves without oscillating: its double pole at zero comes
    out as a pair of the size sqrt(rounding) of `stiffest` (rad/s), the highest undamped frequency of the whole model, by default the largest of the poles, which a damper of
    light parts makes larger than that.
    """
    size = np.abs(p.value)
    least = max(FREE * (stiffest or size.max()), ROUNDING * size.max())
    order = np.argsort(size, kind="stable")
    return [int(i) for i in order if p.value[i].imag > least and size[i] < HERTZ * highest]


@dataclass(frozen=True)
class Lost:
    """How many natural frequencies rounding hides: undamped ones below `below` (Hz) beside the `stiffest` (Hz), and not of a motion that nothing holds."""

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
    """Bound (rad/s) on the highest undamped frequency of a chain: the largest sum of a row of M^-1/2 K M^-1/2 (Gershgorin 1931), which is that or little more."""
    root = np.sqrt(np.abs(np.diag(linear.mass)))
    return float(np.sqrt(np.abs(linear.stiffness / np.outer(root, root)).sum(axis=1).max(initial=0.0)))


def _quadratic(vectors: ComplexArray, matrix: Array) -> Array:
    return np.real(np.sum(vectors.conj() * (matrix @ vectors), axis=0))


def kinds(linear: Matrices, shapes: ComplexArray) -> tuple[str, ...]:
    """Kind of every shape (n, m): axial when most kinetic energy is along z, else rocking when most of the rest is in tilts, else lateral."""
    kinetic = np.diag(linear.mass)[:, None] * np.abs(shapes) ** 2
    share = {move: kinetic[[i for i, (_, own) in enumerate(linear.dofs) if own == move]].sum(axis=0) for move in MOVES}
    axial = share["z"] > 0.5 * kinetic.sum(axis=0)
    rocking = share["tilt_x"] + share["tilt_y"] > share["x"] + share["y"]
    return tuple("axial" if a else "rocking" if r else "lateral" for a, r in zip(axial, rocking, strict=True))


def _whirl(chain: RotorBase, shape: ComplexArray) -> str:
    """Sense in which the axis of what turns circulates: y a quarter period behind x is forward for +z speed.

    Asked at the two places of every turning body, its radius of gyration below and above its centre, that have its inertia. Of an orbit 2 Im(x y*) is its area over pi / 2, and
    |x|^2 + |y|^2 where it is a circle. None, where the largest area has less than `LINE` of the largest motion. On supports that differ in x and y one place may
    go forward where another goes backward (Genta, 2005, 6.2; Friswell and others, *Dynamics of Rotating Machines*, 2010, 6.4): mixed, where the largest area of the
    lesser sense has more than `LESSER` of the largest.
    """
    ends = [(b.name, b.z + side * np.sqrt((b.inertia[0] + b.inertia[1]) / (2 * b.mass))) for b in chain.bodies if b.turns for side in (-1.0, 1.0)]
    if not ends:
        return "none"
    x, y = np.array([motion_rows(chain, name, (0.0, 0.0, float(z)))[:2] @ shape for name, z in ends]).T
    area = 2 * np.imag(x * y.conj()) * np.sign(chain.speed)
    forward, backward = max(float(area.max()), 0.0), max(-float(area.min()), 0.0)
    if max(forward, backward) <= LINE * float(np.max(np.abs(x) ** 2 + np.abs(y) ** 2)):
        return "none"
    if min(forward, backward) > LESSER * max(forward, backward):
        return "mixed"
    return "forward" if forward > backward else "backward"


def group_energy(chain: RotorBase, mode: Mode) -> dict[str, float]:
    """Strain energy shares summed over the elements' groups (base, flange, bearings, ...), in chain order."""
    shares: dict[str, float] = {}
    for element in chain.elements:
        shares[element.group] = shares.get(element.group, 0.0) + mode.energy[element.name]
    return shares
