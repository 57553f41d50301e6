"""What one test's linear model says of FRFs at its lines, with what their derivatives need."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.linear import BY_LAW, Linear, Pairs, Products, as_dampers
from thermospindle.diagnosis.forward.record import RecordEnd
from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.rotor.poles import LARGE, Poles, poles
from thermospindle.model.rotor.reduced import reduced
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.identification.frf import POWER

SILENT = 1e-6  # of a mode's answer, left at the end of a record
TOGETHER = 8  # derivatives at a time
FEW = 2  # times as many products as a parameter may have, for each to be followed by itself, as there are degrees of freedom at least


@dataclass(frozen=True, eq=False)
class Light:
    """A light resonance: a mass of one on a spring on the generalised force b = `columns` (n, k) `shares`
    (k,), which adds s^2 m(s) b b^T to the dynamic stiffness with m = (2 z w s + w^2) / (s^2 + 2 z w s +
    w^2) (Den Hartog, *Mechanical Vibrations*, 1956, 3.2); its frequency drifts with what is `far`."""

    columns: Array
    shares: Array
    omega: float
    damping: float
    far: float = 0.0

    def felt(self, s: ComplexArray) -> ComplexArray:
        """What is felt of the mass, (3, L): s^2 m(s), and its derivatives by ln w and ln z."""
        lossy = 2 * self.damping * self.omega * s
        spring = lossy + self.omega**2
        whole = s**2 + spring
        moved = np.stack([lossy + 2 * self.omega**2, lossy]) * s**2 / whole**2
        return np.asarray(s**2 * np.concatenate([[spring / whole], moved]), complex)


@dataclass(frozen=True)
class Law:
    """How far what loss factors lose, and what `dampers` do, is the same at all frequencies, in
    which case dampers lose as much as they do at `omega` (rad/s)."""

    factors: float = 0.0
    dampers: float = 0.0
    omega: float = 0.0

    def over(self, s: ComplexArray) -> ComplexArray:
        """What it adds to the dynamic stiffness (3, L) of each of `Linear.lost`: of i H for s C."""
        return np.array([np.full_like(s, 1j * self.factors), -self.factors * s, self.dampers * (1j * self.omega - s)])

    def whole(self, s: ComplexArray) -> ComplexArray:
        """What the dynamic stiffness (3, L) has of each of these, with what dampers of the same loss have."""
        return self.over(s) + np.array([np.zeros_like(s), s, s])


class Response:
    """FRFs of one test's linear model at its lines, in the measured quantity.

    `cut` is the share in which records end before the answer has died away: 0 for FRFs of an infinite record. A flexible
    shaft answers through its reduced model (`model.rotor.reduced`), which is off by 1e-5 of the largest response at
    most, with its mass where it is and not at nodes, which the modes kept know nothing of: 3e-4 at the highest lines.
    """

    def __init__(self, linear: Linear, data: LineData, gain: Array, cut: float = 0.0, lights: Sequence[Light] = (), law: Law = Law()) -> None:
        chain, m = linear.chain, linear.matrices
        n_resp = data.value.shape[0]
        omega = 2 * np.pi * data.frequency
        window = data.test.window_decay
        self.s: ComplexArray = np.asarray(1j * omega + (chain.decay + window), complex)
        rows, references = chain.response_rows[:n_resp], chain.reference_rows
        self._basis: Array | None = None
        self._lights, self._law = lights, law
        self._lost: Array = np.zeros((0, *m.mass.shape)) if linear.lost is None else linear.lost
        self._matrices, between = (m.mass, m.damping, m.stiffness), linear.between
        if len(m.mass) > LARGE and len(omega):
            small = reduced(m, np.concatenate([rows, references]), float(omega.max()))
            self._basis = small.basis
            self._matrices = small.mass, small.damping, small.stiffness
            rows, references = rows @ small.basis, references @ small.basis
        self._quartic: Array | None = None
        if between is not None:
            mass, self._quartic, gyroscopic = (self._onto(added) for added in between)
            self._matrices = self._matrices[0] + mass, self._matrices[1] + gyroscopic, self._matrices[2]
        self._rows, self._references = rows, references.T
        self.right: ComplexArray = np.asarray(np.linalg.solve(self._dynamic(), references.T), complex)  # (L, r, n_ref)
        self.factor: ComplexArray = (
            (gain[:n_resp] * chain.gain[:n_resp])[:, None]
            * np.exp(-1j * omega * chain.delay[:n_resp, None])
            * (self.s * (1j * omega + window) ** POWER[data.quantity])
        )  # (n_resp, L)
        receptance = rows @ self.right  # (L, n_resp, n_ref)
        self.value: ComplexArray = receptance.transpose(1, 2, 0) * self.factor[:, None, :]
        self._of, self._cut = (linear, data), cut
        self._by_power: dict[int, ComplexArray] = {}
        if cut:
            self.value = self.value + cut * self.cut_off

    def _dynamic(self) -> ComplexArray:
        """Dynamic stiffness (L, r, r): one product of what depends on the line with what does not."""
        s = self.s
        terms = [*zip((s**2, s, np.ones_like(s)), self._matrices, strict=True)]
        if self._quartic is not None:
            terms.append((-(s**4), self._quartic))
        for light in self._lights:
            b = self.over(light.columns) @ light.shares
            terms.append((light.felt(s)[0], np.outer(b, b)))
        terms += [(by_law, self._onto(lost)) for by_law, lost in zip(self._law.over(s), self._lost, strict=False) if by_law.any()]
        by_line, matrices = (np.array(of, complex) for of in zip(*terms, strict=True))
        return np.tensordot(by_line, matrices, (0, 0))

    @cached_property
    def _read(self) -> ComplexArray:
        """What responses read of a force on each degree of freedom, in the measured quantity, (r, n_resp, L)."""
        left = np.linalg.solve(self._dynamic().transpose(0, 2, 1), self._rows.T)
        return np.asarray(np.ascontiguousarray(left.transpose(1, 2, 0)) * self.factor, complex)

    @cached_property
    def _driven(self) -> ComplexArray:
        """How references move each degree of freedom, (r, n_ref, L)."""
        return np.ascontiguousarray(self.right.transpose(1, 2, 0))

    @cached_property
    def cut_off(self) -> ComplexArray:
        """What records of finite length leave out, (n_resp, n_ref, L)."""
        return np.zeros_like(self.value) if self._end is None else self._end.value

    @cached_property
    def _end(self) -> RecordEnd | None:
        """The end of records, where some mode still answers there."""
        return self._ending(self._of[1].test.pretrigger or 0.0)

    def cut_off_after(self, before: float) -> ComplexArray:
        """What records that were hit `before` seconds after their start would leave out, (n_resp, n_ref, L)."""
        end = self._ending(before)
        return np.zeros_like(self.value) if end is None else end.value

    @cached_property
    def _every(self) -> Poles:
        return poles(Matrices(*self._matrices, ()))

    def _ending(self, before: float) -> RecordEnd | None:
        linear, data = self._of
        if not np.isfinite(data.duration):
            return None
        p = self._every
        window = linear.chain.decay + data.test.window_decay
        after = data.duration - before  # s that the answer lasts in a record
        at_end = np.exp(np.minimum((p.value.real - window) * after, 0.0) + 1j * p.value.imag * after)
        seen = np.flatnonzero(np.abs(at_end) > SILENT)
        away = (self.s[None, :] - p.value[seen, None]) * np.exp(-2j * np.pi * data.frequency * before)
        end = RecordEnd(after, p, p.left @ self._references, at_end, seen, away, self.factor / self.s, self._rows)
        return end if len(seen) else None

    @property
    def _late(self) -> RecordEnd | None:
        """The end of records, where a share of it is taken away."""
        return self._end if self._cut else None

    def _onto(self, matrix: Array) -> Array:
        """A matrix (n, n) in the coordinates (r,) of the model that answers."""
        return matrix if self._basis is None else self._basis.T @ matrix @ self._basis

    def over(self, columns: Array) -> Array:
        """Columns (n, m) of generalised forces in the coordinates (r,) of the model that answers."""
        return columns if self._basis is None else self._basis.T @ columns

    def by_light(self, light: Light) -> ComplexArray:
        """Derivatives (k + 4, n_resp, n_ref, L) by the shares of a light resonance, its ln
        frequency, its ln damping and how ln frequency drifts."""
        left, right = self._modal(light.columns)
        felt = -light.felt(self.s)
        own_left, own_right = np.tensordot(light.shares, left, 1), np.tensordot(light.shares, right, 1)
        shares = felt[0] * (left[:, :, None] * own_right[None, None] + own_left[None, :, None] * right[:, None])
        whole = own_left[:, None] * own_right[None]
        by_frequency, by_damping = felt[1:, None, None] * whole
        return np.concatenate([shares, [by_frequency, by_damping, light.far * by_frequency, light.far**2 * by_frequency]])

    def by_law(self, kind: int) -> ComplexArray:
        """Derivative (n_resp, n_ref, L) by how far what loss factors lose (0), or dampers (1), is the same at all frequencies."""
        added = replace(self._law, factors=1.0, dampers=1.0).over(self.s)
        own = ((0, 1), (2,))[kind]
        return self._answering(sum((-added[i] * _over(self._onto(self._lost[i]).T, self._driven) for i in own), np.zeros_like(self._driven)))

    def by_products_of_shares(self, columns: Array, rows: Integers, others: Integers) -> ComplexArray:
        """Derivatives (k, n_resp, n_ref, L) by products of two shares each of light resonances on
        `columns` (n, m), for one that is felt as a mass of -1 / s^2."""
        left, right = self._modal(columns)
        found = left[rows][:, :, None] * right[others][:, None] + left[others][:, :, None] * right[rows][:, None]
        return np.where(rows == others, 0.5, 1.0)[:, None, None, None] * found

    def _modal(self, columns: Array) -> tuple[ComplexArray, ComplexArray]:
        """What responses read of a force on each of a light resonance's `columns` (k, n_resp, L),
        and how references move these (k, n_ref, L)."""
        of = self.over(columns)
        return _over(of, self._read), _over(of, self._driven)

    def moved(self, by: Products) -> ComplexArray:
        """Derivatives (k, n_resp, n_ref, L) by the parameters of `by`."""
        n_resp, n_ref, lines = self.value.shape
        found: ComplexArray = np.zeros((by.count, n_resp, n_ref, lines), complex)
        if len(by.of):
            left, right = self.over(by.left), self.over(by.right)
            own = [slice(a, b) for a, b in pairwise([*by.first, len(by.power)])]
            few = np.concatenate([np.full(rows.stop - rows.start, FEW * (rows.stop - rows.start) <= len(left)) for rows in own])
            at = np.cumsum(few) - 1
            read, driven = self.read(left[:, few]), self.driven(right[:, few], by.power[few])
            for k, rows in zip(by.of, own, strict=True):
                if few[rows.start]:
                    of_it = slice(at[rows.start], at[rows.start] + rows.stop - rows.start)
                    np.sum(read[of_it][:, :, None] * driven[of_it][:, None], axis=0, out=found[k])
                else:  # so many products that their sum, acting on all degrees of freedom, is less work
                    found[k] = self._answering(self._felt(left[:, rows], right[:, rows], by.power[rows]))
            if (end := self._late) is not None:  # records end as dampers have it
                ended = by.of_dampers
                kicked = end.kicked(self.over(ended.left), right, ended.power)
                found[by.of] += self._cut * end.moved(np.add.reduceat(kicked, by.first, axis=0))
        return found

    def _answering(self, force: ComplexArray) -> ComplexArray:
        """What responses read (n_resp, n_ref, L) of forces (r, n_ref, L) on all degrees of freedom."""
        return np.asarray((self._read_by_line @ force.transpose(2, 0, 1)).transpose(1, 2, 0))

    @cached_property
    def _read_by_line(self) -> ComplexArray:
        """(L, n_resp, r)."""
        return np.ascontiguousarray(self._read.transpose(2, 1, 0))

    def _felt(self, left: Array, right: Array, power: Integers) -> ComplexArray:
        """The force (r, n_ref, L) on each degree of freedom that products (r, m) in the dynamic stiffness make together."""
        found = np.zeros_like(self._driven)
        for p in np.unique(power):
            found += _over(right[:, power == p] @ left[:, power == p].T, self._forced(int(p)))
        return found

    def moved_together(self, columns: Array, power: Integers, of: Pairs) -> Iterator[ComplexArray]:
        """Derivatives (k, n_resp, n_ref, L) by factors of the sum over pairs i, j `of` each of
        s^`power`_i (u_i u_j^T + u_j u_i^T) in the dynamic stiffness, u the `columns` (r, m), of
        equal power (m,) in a pair: a few at a time, for they fill memory rather than a cache."""
        read, driven = self.read(columns), self.driven(columns, power)
        first, second = (np.stack(numbers, axis=1) for numbers in zip(*(pair for i, j in of for pair in ((i, j), (j, i))), strict=True))
        for at in range(0, len(first), TOGETHER):
            few = slice(at, at + TOGETHER)
            found = np.empty((len(first[few]), *self.value.shape), complex)
            for of_it, i, j in zip(found, first[few], second[few], strict=True):
                np.sum(read[i][:, :, None] * driven[j][:, None], axis=0, out=of_it)
            if (end := self._late) is not None:
                i, j = first[few].ravel(), second[few].ravel()
                left, ended = as_dampers(columns[:, i], power[i])  # records end as dampers have it
                kicked = end.kicked(left, columns[:, j], ended)
                found += self._cut * end.moved(np.add.reduceat(kicked, np.arange(0, len(i), first.shape[1]), axis=0))
            yield found

    def read(self, columns: Array) -> ComplexArray:
        """What responses read of a force on `columns` (r, m), in the measured quantity: (m, n_resp, L)."""
        return _over(columns, self._read)

    def struck(self, rows: Array) -> ComplexArray:
        """The answer to a hammer whose force acts on `rows` (k, n), (n_resp, k, L), less what of it comes after the records' end."""
        columns = self.over(rows.T)
        found = self.read(columns).transpose(1, 0, 2)
        return found if (end := self._late) is None else found + self._cut * end.of(end.poles.left @ columns)

    def heard(self, rows: Array) -> ComplexArray:
        """What responses would read by as much as their rows are `rows` (n_resp, n) more, (n_resp,
        n_ref, L), less what of it comes after the records' end."""
        columns = self.over(rows.T)
        found = _over(columns, self._driven) * self.factor[:, None]
        return found if (end := self._late) is None else found + self._cut * replace(end, rows=columns.T).value

    def driven(self, columns: Array, power: Integers) -> ComplexArray:
        """The force (m, n_ref, L) that appears on one vector where s^`power` times it and `columns`
        (r, m) is added to the dynamic stiffness, less what of it comes after the records' end."""
        found = np.empty((len(power), *self._driven.shape[1:]), complex)
        for p in np.unique(power):
            found[power == p] = _over(columns[:, power == p], self._forced(int(p)))
        return found

    def _forced(self, power: int) -> ComplexArray:
        """The same (r, n_ref, L) of each degree of freedom by itself."""
        if power not in self._by_power:
            forced = -(self.s**power if power < BY_LAW else self._law.whole(self.s)[power - BY_LAW]) * self._driven
            if (end := self._late) is not None and power != BY_LAW:
                forced += self._cut * end.tail(np.eye(len(forced)), np.full(len(forced), 1 if power > BY_LAW else power))
            self._by_power[power] = forced
        return self._by_power[power]


def _over(columns: Array, each: ComplexArray) -> ComplexArray:
    """Of what belongs to each degree of freedom (r, n, L) what belongs to `columns` (r, m), (m, n, L): one real product."""
    r, n, lines = each.shape
    return np.asarray((columns.T @ each.reshape(r, n * lines).view(float)).view(complex).reshape(columns.shape[1], n, lines))
