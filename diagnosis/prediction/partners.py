"""Which measured mode is which computed one: partners, numbers through all conditions, crossings, shapes of close modes.

Every computed mode is numbered at the coldest test at rest and followed from there by shape and frequency; a measured mode takes the
number of its partner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, count

import numpy as np

from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.prediction.modes import Predicted
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.model.units import RPM
from thermospindle.sim.identification import pairing
from thermospindle.sim.identification.pairing import COMPARED, COMPUTED, MIXING, at_shared, in_order, kept_in_order

BELIEVABLE = 0.08  # relative frequency error up to which two modes are taken for the same
ALONE = MIXING  # relative distance to the next mode from which a shape is trusted
DISTINCT = 0.3  # 1 - MAC with its partner below which even a close mode is known by its shape


def paired(o: Observation, p: Predicted) -> Integers:
    """Index of the computed partner of every measured mode, -1 for one that nothing is like.

    Modes closer than `ALONE` that are not axial keep their order, unless their shapes all tell them apart: those may cross.
    """
    measured, computed = o.modes, p.modes(o.channels)
    return in_order(pairing.partners(measured, computed, COMPARED), measured, computed, ALONE, DISTINCT)


def partners(o: Observation, p: Predicted) -> Integers:
    """The same, and -1 too where no computed mode is within `BELIEVABLE`."""
    partner = paired(o, p)
    near = np.abs(of_partners(p.frequency, partner) / o.frequency - 1) <= BELIEVABLE
    return np.where(near, partner, -1)


def of_partners(values: Array, partner: Integers) -> Array:
    """What of computed modes belongs to every measured one; NaN for one without a partner."""
    found = np.full(len(partner), np.nan)
    found[partner >= 0] = values[partner[partner >= 0]]
    return found


def numbered(observed: Sequence[Observation], predicted: Sequence[Predicted]) -> list[dict[int, int]]:
    """Number of every computed mode by its index in each test, counted from 1 at the first and followed by shape and frequency.

    The first is the coldest at the lowest speed; each test follows the nearest one already numbered (10 K as far as 1000 rpm).
    """
    state = [(o.condition.temperature / 10, o.condition.speed / (1000 * RPM)) for o in observed]
    order = sorted(range(len(state)), key=lambda t: (abs(state[t][1]), state[t][0]))
    found = {order[0]: {i: i + 1 for i in range(len(predicted[order[0]].frequency))}} if order else {}
    for t in order[1:]:
        near = min(found, key=lambda s: abs(state[s][0] - state[t][0]) + abs(state[s][1] - state[t][1]))
        before, now = at_shared(predicted[near].modes(), predicted[t].modes(), observed[near].test.response_nodes, observed[t].test.response_nodes)
        partner = kept_in_order(pairing.partners(before, now, COMPUTED), before, now, ALONE)
        followed = {int(j): found[near][i] for i, j in enumerate(partner) if j >= 0}
        new = count(1 + max(max(f.values(), default=0) for f in found.values()))
        found[t] = followed | {j: next(new) for j in range(len(now.frequency)) if j not in followed}
    return [found[t] for t in range(len(observed))]


def crossings(observed: Sequence[Observation], predicted: Sequence[Predicted], numbers: Sequence[Mapping[int, int]]) -> tuple[str, ...]:
    """Pairs of computed modes among the measured ones that change places, in words, once each."""
    first: dict[tuple[int, int], tuple[str, bool]] = {}
    found: dict[tuple[int, int], str] = {}
    for o, p, number in zip(observed, predicted, numbers, strict=True):
        inside = {n: p.frequency[i] for i, n in number.items() if p.frequency[i] <= 1.1 * o.frequency.max(initial=0.0)}
        for two in combinations(sorted(inside), 2):
            below = bool(inside[two[0]] < inside[two[1]])
            where, was = first.setdefault(two, (o.test.id, below))
            if below != was:
                found.setdefault(two, f"computed modes {two[0]} and {two[1]} change places between {where} and {o.test.id}")
    return tuple(found.values())


def group(o: Observation, p: Predicted, partner: Integers, mode: int) -> list[int]:
    """Measured modes within `ALONE` of one, itself included, whose partners may turn in one plane with its own."""

    def axial(i: int) -> bool:
        return p.kind[partner[i]] == "axial"

    near = np.flatnonzero((np.abs(np.log(o.frequency / o.frequency[mode])) <= ALONE) & (partner >= 0)).tolist()
    return [i for i in near if axial(i) == axial(mode)]


def shapes(o: Observation, p: Predicted, partner: Integers) -> dict[int, tuple[ComplexArray, ComplexArray]]:
    """Measured and computed shape (n,) of the paired measured modes: the computed one is its partner's, in a close
    group the combination nearest to it. They are at the responses, or of a roving hammer at the references; of a mode
    whose group has as many members as there are points any shape is a combination, and there is none to compare."""
    if o.shape is None:
        return {}
    measured, computed = (o.residue, p.participation) if o.residue is not None and by_hammer(o) else (o.shape, p.shape)
    found = {}
    for i in np.flatnonzero(partner >= 0).tolist():
        basis = computed[partner[group(o, p, partner, i)]].T
        if basis.shape[1] < len(basis):
            found[i] = measured[i], basis @ np.linalg.lstsq(basis, measured[i], rcond=None)[0]
    return found


def by_hammer(o: Observation) -> bool:
    """Whether the hammer went from point to point rather than the sensors: shapes are then those at
    its points, where left vectors of the model stand for right ones."""
    return o.shape is not None and o.residue is not None and o.shape.shape[1] < o.residue.shape[1]
