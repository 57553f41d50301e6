"""One test's linear model, and how its matrices change with parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.types import Array, Integers
from thermospindle.sim.effects.effect import Measurement

EXACT = 1e-11  # of the largest singular value of a change: products that are left out


@dataclass(frozen=True, eq=False)
class Linear:
    """One test's linear model: matrices with dofs, and its measuring chain (None for a table of modes)."""

    matrices: Matrices
    chain: Measurement
    layout: tuple


@dataclass(frozen=True, eq=False)
class Rates:
    """Derivatives (k, n, n) of mass, damping and stiffness of every test by the nuisance parameters `numbers` (k,)."""

    numbers: tuple[Integers, ...]
    mass: tuple[Array, ...]
    damping: tuple[Array, ...]
    stiffness: tuple[Array, ...]

    @cached_property
    def products(self) -> list[Products]:
        return [products(*of_test) for of_test in zip(self.mass, self.damping, self.stiffness, strict=True)]


@dataclass(frozen=True, eq=False)
class Products:
    """Changes of M, C and K by k parameters as sums of few products of two vectors, for an element moves few degrees of freedom: the change of
    the dynamic stiffness by parameter `of`[i] is the sum over its rows r of s^`power`[r] `left`[:, r] `right`[:, r]^T, of which `first`[i] is the first."""

    count: int
    of: Integers
    first: Integers
    power: Integers
    left: Array
    right: Array


def products(mass: Array, damping: Array, stiffness: Array) -> Products:
    """The products of dM, dC, dK (k, n, n), to `EXACT` of the largest of each."""
    of, first, left, right = [], [], [], []
    power: list[int] = []
    for k in range(len(mass)):
        start = len(power)
        for exponent, change in ((2, mass[k]), (1, damping[k]), (0, stiffness[k])):
            if change.any():
                u, size, v = np.linalg.svd(change)
                kept = np.flatnonzero(size > EXACT * size[0])
                power += [exponent] * len(kept)
                left.append(u[:, kept] * size[kept])
                right.append(v[kept].T)
        if len(power) > start:
            of.append(k)
            first.append(start)
    n = mass.shape[1]
    none = [np.zeros((n, 0))]
    return Products(
        len(mass), np.array(of, int), np.array(first, int), np.array(power, int), np.concatenate(left or none, axis=1), np.concatenate(right or none, axis=1)
    )


def same_chain(a: Measurement, b: Measurement) -> bool:
    return a is b or (
        a.decay == b.decay
        and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("response_rows", "reference_rows", "gain", "delay"))
    )
