"""Which measured mode is which computed one: partners, numbers through all conditions, crossings, shapes of close modes.

Every computed mode is numbered at the coldest test at rest and followed from there by shape and frequency; a measured mode takes the
number of its partner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

from thermospindle.diagnosis.data.features import ALONE
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.prediction.theory import FAR, UNLIKE, Predicted, pair
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import RPM

BELIEVABLE = 0.08  # relative frequency error up to which two modes are taken for the same


def partners(o: Observation, p: Predicted) -> Array:
    """Index of the computed partner of every measured mode, -1 where none is within `BELIEVABLE`."""
    partner = pair(o, p)
    far = np.abs(p.frequency[partner] / o.frequency - 1) > BELIEVABLE
    return np.where(far | (partner < 0), -1, partner)


def numbered(observed: Sequence[Observation], predicted: Sequence[Predicted]) -> list[dict[int, int]]:
    """Number of every computed mode by its index in each test, counted from 1 at the first and followed by shape and frequency.

    The first is the coldest at the lowest speed; each test follows the nearest one already numbered (10 K as far as 1000 rpm).
    """
    state = [(o.condition.temperature / 10, o.condition.speed / (1000 * RPM)) for o in observed]
    order = sorted(range(len(state)), key=lambda t: (abs(state[t][1]), state[t][0]))
    found: dict[int, dict[int, int]] = {}
    for t in order:
        if not found:
            found[t] = {i: i + 1 for i in range(len(predicted[t].frequency))}
            continue
        near = min(found, key=lambda s: abs(state[s][0] - state[t][0]) + abs(state[s][1] - state[t][1]))
        a, b = predicted[near], predicted[t]
        unit = [_unit(p.shape) for p in (a, b)]
        cost = np.abs(np.log(a.frequency[:, None] / b.frequency)) / FAR
        if unit[0].shape[1] == unit[1].shape[1]:
            cost = cost + 1 - np.abs(unit[0].conj() @ unit[1].T) ** 2
        cost = cost + UNLIKE * np.array([[(x == "axial") != (y == "axial") for y in b.kind] for x in a.kind])
        partner = {int(j): int(i) for i, j in zip(*linear_sum_assignment(cost), strict=True)}
        radial = [j for j in sorted(partner) if b.kind[j] != "axial"]
        for j, k in pairwise(radial):  # a close pair that stays one keeps its order
            i, h = partner[j], partner[k]
            if i > h and a.frequency[i] < (1 + ALONE) * a.frequency[h] and b.frequency[k] < (1 + ALONE) * b.frequency[j]:
                partner[j], partner[k] = h, i
        followed = {j: found[near][i] for j, i in partner.items()}
        following = max(max(f.values(), default=0) for f in found.values())
        for j in range(len(b.frequency)):
            if j not in followed:
                following += 1
                followed[j] = following
        found[t] = followed
    return [found[t] for t in range(len(observed))]


def crossings(observed: Sequence[Observation], predicted: Sequence[Predicted], numbers: Sequence[Mapping[int, int]]) -> tuple[str, ...]:
    """Pairs of computed modes among the measured ones that change places, told once each."""
    first: dict[tuple[int, int], tuple[str, bool]] = {}
    told: dict[tuple[int, int], str] = {}
    for o, p, number in zip(observed, predicted, numbers, strict=True):
        inside = {n: p.frequency[i] for i, n in number.items() if p.frequency[i] <= 1.1 * o.frequency.max(initial=0.0)}
        for two in combinations(sorted(inside), 2):
            below = bool(inside[two[0]] < inside[two[1]])
            where, was = first.setdefault(two, (o.test.id, below))
            if below != was:
                told.setdefault(two, f"computed modes {two[0]} and {two[1]} change places between {where} and {o.test.id}")
    return tuple(told.values())


def group(o: Observation, p: Predicted, partner: Array, mode: int) -> list[int]:
    """Measured modes within `ALONE` of one, itself included, whose partners may turn in one plane with its own."""

    def axial(i: int) -> bool:
        return p.kind[partner[i]] == "axial"

    near = np.flatnonzero((np.abs(np.log(o.frequency / o.frequency[mode])) <= ALONE) & (partner >= 0)).tolist()
    return [i for i in near if axial(i) == axial(mode)]


def expected_shapes(o: Observation, p: Predicted, partner: Array) -> dict[int, ComplexArray]:
    """Computed shape (n_resp,) for every paired measured mode: its partner's, in a close group the combination nearest to it."""
    if o.shape is None:
        return {}
    found = {}
    for i in np.flatnonzero(partner >= 0).tolist():
        basis = p.shape[partner[group(o, p, partner, i)]].T
        found[i] = basis @ np.linalg.lstsq(basis, o.shape[i], rcond=None)[0]
    return found


def _unit(shape: ComplexArray) -> ComplexArray:
    return shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-300)
