"""Derivatives of a test's residuals: by all nuisance parameters, by what differs between two lists of effects, and by a light resonance that is not there yet.

Everything that moves the dynamic stiffness D alone has the exact derivative -A D^-1 (s^2 dM + s dC + dK) D^-1 B^T of the receptance A D^-1 B^T, so that one factorisation a
line serves all parameters; what also moves rows, gains or delays is differenced. Structure enters K, C and M in proportion: these derivatives are taken once.
"""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.linear import Linear, Pairs, Rates, pairs, products, same_chain, together
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.points import Applied, aside
from thermospindle.diagnosis.forward.response import Response
from thermospindle.diagnosis.forward.table import Table
from thermospindle.model.types import Array, ComplexArray, Integers


def nuisance_jacobian(model: CampaignModel, t: int, x: Array, effects: Applied, rates: Rates, more: int = 0) -> tuple[Array, Array, Integers]:
    """Residuals (N,) of test `t`, their derivatives (k + more, N) by k nuisance parameters, and the numbers (k,) of these; rows `more` are
    left zero for whoever has further parameters."""
    data, linear = model.tests[t], model.linear(t, x, effects)
    response = model.standing(t, x, effects, linear)
    if isinstance(response, Table):
        r, found = response.residual, response.moved(together([rates.products[t], *(pairs(*of) for of in _by_discrepancies(model, t, linear, x))]))
        numbers = np.concatenate([rates.numbers[t], *[row[0] for row in model.numbers.discrepancies[t]]])
        return r, np.concatenate([found, np.zeros((more, len(r)))]), numbers
    assert isinstance(data, LineData)
    (own, channel), (struck, hammer) = model.numbers.gains[t], model.numbers.hammers[t]
    missed, way = model.numbers.misses[t]
    record = [] if model.numbers.record is None else [model.numbers.record]
    lights = model.lights(t, linear.matrices.dofs, x)
    numbers = np.concatenate([rates.numbers[t], *[row[0] for row in model.numbers.discrepancies[t]], own, struck, missed, np.array(record, int), *[n for _, n in lights]])
    n_resp, n_ref, lines = response.value.shape
    weight = np.sqrt(2) / data.sd
    jacobian = np.zeros((len(numbers) + more, 2, n_resp, n_ref, lines))

    def fill(first: int, moved: ComplexArray) -> int:
        rows = jacobian[first : first + len(moved)]
        np.multiply(moved.real, weight, out=rows[:, 0])
        np.multiply(moved.imag, weight, out=rows[:, 1])
        return first + len(moved)

    at = fill(0, response.moved(rates.products[t]))
    for columns, power, paired, size in _by_discrepancies(model, t, linear, x):
        for moved in response.moved_together(response.over(columns), power, paired, size):
            at = fill(at, moved)
    for k, c in enumerate(channel):
        for row in np.flatnonzero(model.numbers.channel_of[t][:n_resp] == c):
            gain = response.value[row] * weight[row] * model.parameters[own[k]].sd
            jacobian[at + k, 0, row], jacobian[at + k, 1, row] = gain.real, gain.imag
    at += len(own)
    for k, h in enumerate(hammer):
        for of in np.flatnonzero(model.numbers.hammer_of[t] == h):
            gain = response.value[:, of] * weight[:, of] * model.parameters[struck[k]].sd
            jacobian[at + k, 0, :, of], jacobian[at + k, 1, :, of] = gain.real, gain.imag
    at += len(struck)
    missing, struck_by = aside(model.operating(t, x, effects)), model.numbers.hammer_of[t]
    for ref, gain in enumerate(model.hammer_gain(t, x)):
        moved = gain * response.struck(missing[:, ref]) * weight[:, ref][:, None]
        for n in np.flatnonzero(way // 2 == struck_by[ref]):
            miss = moved[:, way[n] % 2] * model.sd[missed[n]]
            jacobian[at + n, 0, :, ref], jacobian[at + n, 1, :, ref] = miss.real, miss.imag
    at += len(missed)
    if record:
        at = fill(at, response.cut_off[None])
    for light, of_light in lights:
        at = fill(at, response.by_light(light) * np.array([model.parameters[i].sd for i in of_light])[:, None, None, None])
    if data.whitening is not None:
        white = data.independent(jacobian[:at, 0] + 1j * jacobian[:at, 1])
        jacobian[:at, 0], jacobian[:at, 1] = white.real, white.imag
    return model.whitened(t, response.value, data.value), jacobian.reshape(len(jacobian), -1), numbers


def _by_discrepancies(model: CampaignModel, t: int, linear: Linear, x: Array) -> list[tuple[Array, int, Pairs, Array]]:
    """What discrepancies of stiffness change in test `t`, and those of damping: vectors (n, m), a power of s, pairs of vectors, and the size of each."""
    w, ((_, i, j, stiffness), (_, a, b, damping)) = model.reference.over(linear.matrices.dofs), model.numbers.discrepancies[t]
    modes, k = w.shape[1], len(i)
    beside = w @ model.turned(t, x).by_pairs(i, j)
    turned = [(i, modes + np.arange(k)), (j, modes + k + np.arange(k))]
    return [(np.hstack([w, beside]), 0, turned, stiffness), (w, 1, [(a, b)], damping * np.where(a == b, 0.5, 1.0))]


def column(model: CampaignModel, t: int, x: Array, first: Applied, second: Applied, apart: float) -> Array:
    """(residual at `second` - residual at `first`) / apart, (N,): the derivative by what differs between two lists of effects.

    Where matrices alone differ the exact derivative of the FRF is taken, which has no error of the second order in the FRF.
    """
    at, moved = model.linear(t, x, first), model.linear(t, x, second)
    answer = model.standing(t, x, first, at)
    if at.layout == moved.layout and at.matrices.dofs == moved.matrices.dofs and same_chain(at.chain, moved.chain):
        by = products(*((getattr(moved.matrices, k) - getattr(at.matrices, k)) / apart for k in ("mass", "damping", "stiffness")))
        return answer.moved(by)[0] if isinstance(answer, Table) else model.whitened(t, answer.moved(by)[0], 0.0)
    return (model.in_errors(t, model.answer(t, x, moved)) - model.in_errors(t, answer)) / apart


def by_products_of_shares(model: CampaignModel, t: int, x: Array, effects: Applied, modes: int) -> tuple[ComplexArray, ComplexArray]:
    """Derivatives (k, channels, L) of the FRFs of test `t`, in standard errors each `alone` (`LineData`), by the products of two shares each, in the first reference `modes`, of a light resonance
    that is not there yet and felt as a mass of -1 / s^2; and s (L,)."""
    linear, data = model.linear(t, x, effects), model.tests[t]
    answer = model.standing(t, x, effects, linear)
    assert isinstance(answer, Response)
    assert isinstance(data, LineData)
    moved = answer.by_products_of_shares(model.reference.over(linear.matrices.dofs)[:, :modes], *np.triu_indices(modes)) * (np.sqrt(2 / data.smooth) / data.sd)
    return moved.reshape(len(moved), -1, moved.shape[-1]), answer.s
