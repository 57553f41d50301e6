"""What one test's linear model says of a table of modes."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.mode_table import ModeData
from thermospindle.diagnosis.forward.linear import Linear, Products, shown
from thermospindle.diagnosis.forward.shapes import ShapeBeside
from thermospindle.model.errors import listed
from thermospindle.model.rotor.modes import kinds
from thermospindle.model.rotor.poles import Poles, oscillating, poles_below, stiffest_of, vectors_below, with_mass_between
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.identification import pairing
from thermospindle.sim.identification.pairing import MIXING, ModeSet

REACH = 2.5  # times the highest measured frequency, up to which modes of the model may be those of a table
LOWEST, MANY = 3, 8  # modes of the model at least, and of the table at most, that are named where it has too few


class Table:
    """Modes of one test's linear model beside those of a table, with what their derivatives need."""

    def __init__(self, linear: Linear, data: ModeData) -> None:
        self._linear, self._data = linear, data

    def too_few(self) -> str:
        """Why the modes of the model cannot be those of the table, in words; else empty."""
        measured, n = self._data.frequency, len(self._data.frequency)
        below = len(poles_below(self._linear.matrices, self._reach, self._linear.between)[0])
        if below >= n:
            return ""
        lowest = np.abs(poles_below(self._linear.matrices, np.inf, self._linear.between)[0][: max(n, LOWEST)]) / (2 * np.pi)
        return (
            f"{n} mode{'s' * (n > 1)} measured at {listed([f'{f:.5g}' for f in measured[:MANY]])}{' and more' * (n > MANY)} Hz, and the model has {below or 'none'} below {self._reach:.5g} Hz, {REACH:g} times "
            f"the highest of them; its lowest are at {listed([f'{f:.5g}' for f in lowest])} Hz: are frequencies in another unit, or of another machine?"
        )

    @cached_property
    def residual(self) -> Array:
        """Frequencies and the dampings and shapes that are known, computed less measured in standard errors (N,)."""
        data = self._data
        pole = self._vectors[0] - self._linear.chain.decay
        frequency, damping = np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole)
        known = np.isfinite(data.damping_sd)
        by_frequency = np.log(frequency / data.frequency) / data.frequency_sd
        by_damping = np.log(np.maximum(damping[known], 1e-9) / data.damping[known]) / data.damping_sd[known]
        return np.concatenate([by_frequency, by_damping, *(own.residual for own in self._shapes)])

    def moved(self, by: Products) -> Array:
        """Derivatives (k, N) of the residual by the parameters that change M, C and K as `by` says: first-order perturbation of the poles,
        -left (p^2 dM + p dC + dK) right (Lancaster 1964, AIAA J. 2, 1659)."""
        data = self._data
        pole, right, left = self._vectors
        moved = np.zeros((len(pole), by.count), complex)
        if len(by.of):
            moved[:, by.of] = -np.add.reduceat(pole[:, None] ** by.power * (left @ by.left) * (right.T @ by.right), by.first, axis=1)
        seen = (pole - self._linear.chain.decay)[:, None]  # under a window, whose decay no parameter moves
        by_frequency = (moved * seen.conj()).real / np.abs(seen) ** 2
        by_damping = moved.real / seen.real - by_frequency
        known = np.isfinite(data.damping_sd)
        of_poles = [by_frequency / data.frequency_sd[:, None], by_damping[known] / data.damping_sd[known, None]]
        return np.concatenate([*of_poles, *self._shapes_moved(by)]).T

    def _shapes_moved(self, by: Products) -> list[Array]:
        """Derivatives (N, k) of the residual of every shape. That of a right vector over those of other modes than
        its group's is right_j (left_j (p^2 dM + p dC + dK) right) / (p_j - p), p its own pole: first order again,
        for the terms of the pole's own change add up to a multiple of the vector (Adhikari 1999, AIAA J. 37, 1452)."""
        if not self._shapes:
            return []
        p, found = self._poles, []
        felt, seen = p.left @ by.left, self._seen(np.arange(len(p.value)))
        for group, own in zip(self._groups, self._shapes, strict=True):
            moved = np.zeros((len(seen), by.count), complex)
            others = np.setdiff1d(np.arange(len(p.value)), group)
            for j, share in zip(group.tolist(), own.combination, strict=True):
                each = felt[others] * p.value[j] ** by.power * (p.right[:, j] @ by.right)
                if len(by.of):
                    moved[:, by.of] += share * np.add.reduceat((seen[:, others] / (p.value[others] - p.value[j])) @ each, by.first, axis=1)
            found.append(own.moved(moved).T)
        return found

    @cached_property
    def _shapes(self) -> list[ShapeBeside]:
        groups = self._groups if self._data.shapes else []
        return [ShapeBeside(own, self._seen(group)) for own, group in zip(self._data.shapes, groups, strict=True)]

    def _seen(self, modes: Integers) -> ComplexArray:
        """Shapes (n, k) of modes of `_poles` at the table's points, as the measuring chain shows them."""
        chain, p = self._linear.chain, self._poles
        return shown(chain, p.value[modes] - chain.decay, p.right[:, modes])[:, : len(self._data.test.shape_nodes)].T

    @cached_property
    def _groups(self) -> list[Integers]:
        """The modes of `_poles` that may be each mode of the table: its own first, and those of its kind within `MIXING` of it."""
        p, found = self._poles, self._found
        axial = np.array([kind == "axial" for kind in kinds(self._linear.matrices, p.right[:, found])])
        near = [found[(np.abs(np.log(np.abs(p.value[found] / p.value[j]))) <= MIXING) & (axial == axial[found == j])] for j in self._own.tolist()]
        return [np.concatenate([[j], group[group != j]]) for j, group in zip(self._own.tolist(), near, strict=True)]

    @property
    def _reach(self) -> float:
        return REACH * float(self._data.frequency.max())

    @cached_property
    def _poles(self) -> Poles:
        return with_mass_between(self._linear.matrices, self._linear.between)

    @cached_property
    def _found(self) -> Integers:
        return np.array(oscillating(self._poles, self._reach, stiffest_of(self._linear.matrices)))

    @cached_property
    def _vectors(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Poles (m,) of the table's modes with right (n, m) and left vectors (m, n); of a flexible
        shaft without shapes by its reduced model."""
        if self._data.shapes:
            own = self._own
            return self._poles.value[own], self._poles.right[:, own], self._poles.left[own]
        value, right, left = vectors_below(self._linear.matrices, self._reach, self._linear.between)
        own = self._partners(value, right)
        return value[own], right[:, own], left[own]

    @cached_property
    def _own(self) -> Integers:
        """Which of `_poles` is which mode of the table."""
        return self._found[self._partners(self._poles.value[self._found], self._poles.right[:, self._found])]

    def _partners(self, pole: ComplexArray, shape: ComplexArray) -> Integers:
        """Which pole, in order of frequency, is which mode of the table: of its shape, or its kind, near in ln frequency."""
        data, n = self._data, len(self._data.test.shape_nodes)
        at = (self._linear.chain.response_rows[:n] @ shape).T if data.shapes else None
        computed = ModeSet(np.abs(pole) / (2 * np.pi), at, kinds(self._linear.matrices, shape))
        policy = pairing.OF_SHAPES if data.shapes else pairing.OF_A_TABLE
        partner = pairing.partners(ModeSet(data.frequency, data.shape, data.kind), computed, policy)
        if np.any(partner < 0):
            raise ValueError("the model has fewer modes than the table")
        return partner
