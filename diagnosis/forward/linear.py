"""One test's linear model, and how its matrices change with parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import svd

from thermospindle.diagnosis.parameters.masses import MassTerm
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.rotor.poles import Between
from thermospindle.model.structure import MOVES
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.effects.effect import Measurement

Dofs = tuple[tuple[str, str], ...]
Pairs = Sequence[tuple[Integers, Integers]]
"""Numbers (k,) of a first and of a second vector of k parameters, once or more."""

CHAIN = ("response_rows", "reference_rows", "gain", "delay", "decay")
BY_LAW = 3  # and on: what stands in place of a power of s, of what a law of damping is about
EXACT = 1e-11  # of the largest singular value of a change: products that are left out


@dataclass(frozen=True, eq=False)
class Linear:
    """One test's linear model: matrices with dofs, and its measuring chain; `between` is what the mass between nodes
    of shafts adds to M, the N beside it, and what it adds to C + G (`model.rotor.distributed`), None without shafts;
    `lost` (3, n, n), of a test of lines, what another law of damping has otherwise (`model.rotor.chain.losses`)."""

    matrices: Matrices
    chain: Measurement
    layout: tuple
    between: Between | None = None
    lost: Array | None = None

    def moved(self, first: Linear, second: Linear, times: float) -> Linear:
        """With `times` the difference of two others added, in all that may differ; the same where these have other degrees of freedom."""
        if first.matrices.dofs != second.matrices.dofs:
            return self

        def on(own: Any, one: Any, other: Any, names: Sequence[str]) -> Any:
            return replace(own, **{name: getattr(own, name) + times * (getattr(other, name) - getattr(one, name)) for name in names})

        matrices = on(self.matrices, first.matrices, second.matrices, ("mass", "damping", "stiffness"))
        chain = self.chain if same_chain(first.chain, second.chain) else on(self.chain, first.chain, second.chain, CHAIN)
        lost = None if self.lost is None or first.lost is None or second.lost is None else self.lost + times * (second.lost - first.lost)
        return replace(self, matrices=matrices, chain=chain, lost=lost)


def shown(chain: Measurement, pole: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Shapes (k, n_resp) of modes with poles (k,) as they are seen and right vectors (n, k), with the gains and delays of their channels."""
    return (chain.response_rows @ right).T * (chain.gain * np.exp(-1j * np.abs(pole[:, None]) * chain.delay))


def mass_changes(spindle: Spindle, terms: Sequence[MassTerm], dofs: Dofs) -> tuple[Array, Array]:
    """What a standard deviation of each term adds to M and, per rad/s of the spindle, to G (k, n, n)."""
    place = {dof: i for i, dof in enumerate(dofs)}
    mass, gyroscopic = np.zeros((2, len(terms), len(dofs), len(dofs)))
    for k, term in enumerate(terms):
        for first, second, amount in term.entries:
            i, j = place[first], place[second]
            mass[k, i, j] = mass[k, j, i] = term.sd * amount
        for name, inertia in term.polar:
            i, j = (place[name, move] for move in MOVES[3:])
            moment = term.sd * inertia * spindle.structure.body(name).speed_ratio
            gyroscopic[k, i, j], gyroscopic[k, j, i] = moment, -moment
    return mass, gyroscopic


@dataclass(frozen=True, eq=False)
class Products:
    """Changes of M, C and K by `count` parameters as sums of few products of two vectors, for an element moves few degrees of freedom:
    the change of the dynamic stiffness by parameter `of`[i] is the sum over its rows r of s^`power`[r] `left`[:, r] `right`[:, r]^T, of
    which `first`[i] is the first; a power from `BY_LAW` on stands for what a law of damping has in its place (`response.Law.whole`)."""

    count: int
    of: Integers
    first: Integers
    power: Integers
    left: Array
    right: Array

    @cached_property
    def of_dampers(self) -> Products:
        """With dampers for all that is lost: what a law of damping adds to them is left out, and s stands where it may have something else."""
        left, power = as_dampers(self.left, self.power)
        return replace(self, power=power, left=left)


def products(mass: Array, damping: Array, stiffness: Array, lost: Array | None = None) -> Products:
    """The products of one parameter's dM, dC, dK (n, n), and of the change of what is `lost` (3, n,
    n), which of dC it is then, to `EXACT` of the largest of each."""
    n = len(mass)
    if lost is not None:
        rest = damping - lost[1] - lost[2]
        damping = np.where(np.abs(rest) > EXACT * np.abs(damping).max(), rest, 0.0)
    power: list[int] = []
    left, right = [np.zeros((n, 0))], [np.zeros((n, 0))]
    for exponent, change in ((2, mass), (1, damping), (0, stiffness), *enumerate(() if lost is None else lost, BY_LAW)):
        rows, columns = np.flatnonzero(change.any(axis=1)), np.flatnonzero(change.any(axis=0))
        if len(rows):
            u, size, v = _singular(change[np.ix_(rows, columns)])
            kept = np.flatnonzero(size > EXACT * size[0])
            power += [exponent] * len(kept)
            left.append(np.zeros((n, len(kept))))
            right.append(np.zeros((n, len(kept))))
            left[-1][rows], right[-1][columns] = u[:, kept] * size[kept], v[kept].T
    moves = np.zeros(min(len(power), 1), int)
    return Products(1, moves, moves, np.array(power, int), np.concatenate(left, axis=1), np.concatenate(right, axis=1))


def _singular(change: Array) -> tuple[Array, Array, Array]:
    """Singular vectors and values; by QR where divide and conquer, which is quicker, does not converge on a matrix without fault."""
    try:
        return np.linalg.svd(change, full_matrices=False)
    except np.linalg.LinAlgError:
        found: tuple[Array, Array, Array] = svd(change, full_matrices=False, lapack_driver="gesvd")
        return found


def as_dampers(left: Array, power: Integers) -> tuple[Array, Integers]:
    """Left vectors (n, m) and powers of s (m,) of products with dampers for all that is lost: what
    a law of damping adds to them is nothing, and s stands where it may have something else."""
    return np.where(power == BY_LAW, 0.0, left), np.select([power > BY_LAW, power == BY_LAW], [1, 0], power)


def pairs(vectors: Array, power: int, of: Pairs) -> Products:
    """Products of k parameters, of each s^`power` times the sum over pairs i, j `of` its own of u_i
    u_j^T + u_j u_i^T, u the columns of `vectors` (n, m)."""
    k, rows = len(of[0][0]), 2 * len(of)
    first = np.stack([n for i, j in of for n in (i, j)], axis=1).ravel()
    second = np.stack([n for i, j in of for n in (j, i)], axis=1).ravel()
    every = np.arange(k)
    return Products(k, every, rows * every, np.full(rows * k, power), vectors[:, first], vectors[:, second])


def together(every: Sequence[Products]) -> Products:
    """All parameters of several, one after the other."""
    counts, rows = np.cumsum([0, *(p.count for p in every)]), np.cumsum([0, *(len(p.power) for p in every)])
    return Products(
        int(counts[-1]), np.concatenate([p.of + n for p, n in zip(every, counts, strict=False)]),
        np.concatenate([p.first + n for p, n in zip(every, rows, strict=False)]), np.concatenate([p.power for p in every]),
        np.concatenate([p.left for p in every], axis=1), np.concatenate([p.right for p in every], axis=1),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Rates:
    """Derivatives of mass, damping and stiffness of every test, over its `dofs`, by the nuisance parameters `numbers` (k,), each by itself."""

    numbers: tuple[Integers, ...]
    each: tuple[tuple[Products, ...], ...]
    dofs: tuple[Dofs, ...]

    @cached_property
    def products(self) -> list[Products]:
        """Of every test those by all its parameters."""
        return [together(of_test) for of_test in self.each]

    def __getstate__(self) -> dict:
        """Without what was worked out: it is on its way to another process."""
        return {"numbers": self.numbers, "each": self.each, "dofs": self.dofs}


def change_between(at: Linear, moved: Linear, apart: float) -> Products:
    """The products of what differs between the matrices of two linear models so far `apart`."""
    mass, damping, stiffness = ((getattr(moved.matrices, k) - getattr(at.matrices, k)) / apart for k in ("mass", "damping", "stiffness"))
    return products(mass, damping, stiffness, None if at.lost is None or moved.lost is None else (moved.lost - at.lost) / apart)


def same_chain(a: Measurement, b: Measurement) -> bool:
    return a is b or (
        a.decay == b.decay
        and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("response_rows", "reference_rows", "gain", "delay"))
    )
