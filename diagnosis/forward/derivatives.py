"""Derivatives of a test's residuals: by all nuisance parameters, by what differs between two lists
of effects, and by a light resonance that is not there yet.

Everything that moves the dynamic stiffness D alone has the exact derivative -A D^-1 (s^2 dM + s dC + dK) D^-1
B^T of the receptance A D^-1 B^T, so that one factorisation a line serves all parameters; what also moves rows,
gains or delays is differenced. Structure enters K, C and M in proportion: these derivatives are taken once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.linear import BY_LAW, Linear, Pairs, Rates, change_between, pairs, same_chain, together
from thermospindle.diagnosis.forward.measuring import aside, askew, hammer_gain
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.points import Applied
from thermospindle.diagnosis.forward.response import Response
from thermospindle.diagnosis.forward.table import Table
from thermospindle.model.types import Array, ComplexArray, Integers


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of residuals (N,) of one test by the parameters `numbers` (k,): by each `times` (k,)
    that of the `rows` (m, N) which has the number `of` (k,). A gain and its drift, a constant discrepancy
    and the one that drifts, the sizes that a mechanism has in several tests do the same to one of them."""

    rows: Array
    numbers: Integers
    of: Integers
    times: Array

    @property
    def whole(self) -> Array:
        """(k, N)."""
        return self.times[:, None] * self.rows[self.of]

    @property
    def information(self) -> Array:
        """Products (k, k) with each other."""
        own = self.rows @ self.rows.T
        return self.times[:, None] * own[np.ix_(self.of, self.of)] * self.times

    def products(self, residual: Array) -> Array:
        """With residuals (N,), (k,)."""
        return self.times * (self.rows @ residual)[self.of]

    def by(self, kept: np.ndarray) -> Derivatives:
        """By some of the parameters alone."""
        return replace(self, numbers=self.numbers[kept], of=self.of[kept], times=self.times[kept])

    def further(self, numbers: Integers, of: Integers, times: Array) -> Derivatives:
        """By more parameters, whose rows are there."""
        return replace(self, numbers=np.concatenate([self.numbers, numbers]), of=np.concatenate([self.of, of]), times=np.concatenate([self.times, times]))


def nuisance_jacobian(model: CampaignModel, t: int, x: Array, effects: Applied, rates: Rates, more: int = 0) -> tuple[Array, Derivatives]:
    """Residuals (N,) of test `t` and their derivatives by nuisance parameters; the last `more` rows
    are left zero for whoever has further parameters."""
    data, (linear, response) = model.tests[t], model.standing(t, x, effects)
    discrepancies = _by_discrepancies(model, t, linear, x)
    shared = [_each(rates.numbers[t]), *(of for *_, of in discrepancies)]
    if isinstance(response, Table):
        r, found = response.residual, response.moved(together([rates.products[t], *(pairs(vectors, int(power[0]), of) for vectors, power, of, _ in discrepancies)]))
        return r, Derivatives(np.concatenate([found, np.zeros((more, len(r)))]), *_after_each_other(shared))
    assert isinstance(data, LineData)
    record = [] if model.numbers.record is None else [model.numbers.record]
    lights = model.lights(t, linear.matrices.dofs, x)
    channels, hammers, ways = (_alike(model, *which[t]) for which in (model.numbers.gains, model.numbers.hammers, model.numbers.misses))
    glued, late = _alike(model, *model.numbers.sensors), _alike(model, *model.numbers.delays)
    shared += [_each(model.numbers.law[0]), channels, late, hammers, ways, glued, _each(np.array(record, int)), *(_alike(model, n, n) for _, n in lights)]
    numbers, of, times = _after_each_other(shared)
    n_resp, n_ref, lines = response.value.shape
    weight = np.sqrt(2) / data.sd
    jacobian, of_parts = np.zeros((int(of.max(initial=-1)) + 1 + more, n_resp, n_ref, 2 * lines)), np.repeat(weight, 2, axis=-1)

    def fill(first: int, moved: ComplexArray) -> int:
        np.multiply(np.ascontiguousarray(moved).view(float), of_parts, out=jacobian[first : first + len(moved)])
        return first + len(moved)

    at = fill(0, response.moved(rates.products[t]))
    for columns, power, paired, _ in discrepancies:
        for moved in response.moved_together(response.over(columns), power, paired):
            at = fill(at, moved)
    for kind in model.numbers.law[1]:
        at = fill(at, response.by_law(int(kind))[None])
    for by, (_, channel) in ((response.value, model.numbers.gains[t]), (-2j * np.pi * data.frequency * response.value, model.numbers.delays)):
        for c in np.unique(channel):
            at = fill(at, np.where((model.numbers.channel_of[t][:n_resp] == c)[:, None, None], by, 0.0)[None])
    for h in np.unique(model.numbers.hammers[t][1]):
        at = fill(at, np.where((model.numbers.hammer_of[t] == h)[:, None], response.value, 0.0)[None])
    missing, struck_by, way = aside(model.operating(t, x, effects)), model.numbers.hammer_of[t], np.unique(model.numbers.misses[t][1])
    for ref, gain in enumerate(hammer_gain(model.numbers, t, x)):
        missed = gain * response.struck(missing[:, ref]) * weight[:, ref][:, None]
        for n in np.flatnonzero(way // 2 == struck_by[ref]):
            jacobian[at + n, :, ref] = missed[:, way[n] % 2].view(float)
    at += len(way)
    channel, off = np.divmod(np.unique(model.numbers.sensors[1]), 4)
    for w, rows in enumerate(askew(model.operating(t, x, effects))[:, :n_resp]):
        heard = (response.heard(rows) * weight).view(float)
        for n in np.flatnonzero(off == w):
            own = model.numbers.channel_of[t][:n_resp] == channel[n]
            jacobian[at + n, own] = heard[own]
    at += len(channel)
    if record:
        at = fill(at, response.cut_off[None])
    for light, _ in lights:
        at = fill(at, response.by_light(light))
    if data.whitening is not None:
        jacobian[:at] = data.independent(jacobian[:at].view(complex)).view(float)
    return model.whitened(t, response.value, data.value), Derivatives(jacobian.reshape(len(jacobian), -1), numbers, of, times)


Shared = tuple[Integers, Integers, Array]
"""Parameters (k,), by number, that have rows of derivatives in common: which of these is each one's (k,), and how many times (k,) it is."""


def _each(numbers: Integers) -> Shared:
    """Of parameters that have a row each."""
    return numbers, np.arange(len(numbers)), np.ones(len(numbers))


def _alike(model: CampaignModel, numbers: Integers, of: Integers) -> Shared:
    """Of parameters that move what they are `of`, in proportion to their standard deviations; rows are in its order."""
    return numbers, np.unique(of, return_inverse=True)[1], model.numbers.sd[numbers]


def _after_each_other(every: Sequence[Shared]) -> Shared:
    """Of several, the rows of one after those of another."""
    numbers, of, times = zip(*every, strict=True)
    first = np.cumsum([0, *(int(rows.max(initial=-1)) + 1 for rows in of)])
    return np.concatenate(numbers), np.concatenate([rows + n for rows, n in zip(of, first, strict=False)]), np.concatenate(times)


def _by_discrepancies(model: CampaignModel, t: int, linear: Linear, x: Array) -> list[tuple[Array, Integers, Pairs, Shared]]:
    """What discrepancies of stiffness change in test `t`, and those of damping: vectors (n, m), the power
    of s of each (m,) or what stands in its place, pairs of vectors, and the parameters that they are of."""
    w, ((number, i, j, stiffness), (lossy, a, b, damping)) = model.reference.over(linear.matrices.dofs), model.numbers.discrepancies[t]
    modes = w.shape[1]
    _, first, of = np.unique(i * modes + j, return_index=True, return_inverse=True)
    i, j, k = i[first], j[first], len(first)
    beside = w @ model.turned(t, x).by_pairs(i, j)
    turned = [(i, modes + np.arange(k)), (j, modes + k + np.arange(k))]
    halved = damping * np.where(a == b, 0.5, 1.0)
    _, first, of_damping = np.unique(a * modes + b, return_index=True, return_inverse=True)
    parts: list[tuple[Array, int]] = [(w, 1)]
    if linear.lost is not None:  # the shares of loss factors, as complex stiffness and as dampers, and of dampers
        share = model.by_factors
        every = (share, w * np.sqrt(model.reference.omega), BY_LAW), (share, w, BY_LAW + 1), (1 - share, w, BY_LAW + 2)
        parts = [(np.sqrt(part) * vectors, power) for part, vectors, power in every if part > 0]
    lost, powers = np.hstack([vectors for vectors, _ in parts]), np.repeat([power for _, power in parts], modes)
    pairs_of = [(n * modes + a[first], n * modes + b[first]) for n in range(len(parts))]
    stiff = np.hstack([w, beside])
    return [(stiff, np.zeros(stiff.shape[1], int), turned, (number, of, stiffness)), (lost, powers, pairs_of, (lossy, of_damping, halved))]


def column(model: CampaignModel, t: int, x: Array, first: Applied, second: Applied, apart: float) -> Array:
    """(residual at `second` - residual at `first`) / apart, (N,): the derivative by what differs between two lists of effects.

    Where matrices alone differ the exact derivative of the FRF is taken, which has no error of the second order in the FRF.
    """
    (at, answer), moved = model.standing(t, x, first), model.linear(t, x, second)
    if at.layout == moved.layout and at.matrices.dofs == moved.matrices.dofs and same_chain(at.chain, moved.chain):
        by = change_between(at, moved, apart)
        return answer.moved(by)[0] if isinstance(answer, Table) else model.whitened(t, answer.moved(by)[0], 0.0)
    return (model.in_errors(t, model.answer(t, x, moved)) - model.in_errors(t, answer)) / apart


def by_products_of_shares(model: CampaignModel, t: int, x: Array, effects: Applied, modes: int) -> tuple[ComplexArray, ComplexArray]:
    """Derivatives (k, channels, L) of the FRFs of test `t`, in standard errors each `alone` (`LineData`), by the products of two
    shares each, in the first reference `modes`, of a light resonance that is not there yet and felt as a mass of -1 / s^2; and s (L,)."""
    data, (linear, answer) = model.tests[t], model.standing(t, x, effects)
    assert isinstance(answer, Response)
    assert isinstance(data, LineData)
    moved = answer.by_products_of_shares(model.reference.over(linear.matrices.dofs)[:, :modes], *np.triu_indices(modes)) * (np.sqrt(2 / data.smooth) / data.sd)
    return moved.reshape(len(moved), -1, moved.shape[-1]), answer.s
