"""Operating points that differ in little from those that are there: in how far the rings expand, in
how bearings differ, or joints about the axis."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from thermospindle.diagnosis.forward.latest import Latest
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.nuisance import CHANGES, DIRECTIONS, RANGE_K, Nuisance, Unevenness
from thermospindle.diagnosis.parameters.numbers import Numbers
from thermospindle.model.bearing.ball_row import by_own_orbits
from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.changed import changed
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.model.types import Array, Integers
from thermospindle.sim.effects.effect import Effect, Values

Applied = Sequence[tuple[Effect, Values]]

NO_ROWS: Mapping[int, float] = {}
Told = Sequence[tuple[Nuisance, float]]
"""Parameters with how much they are, in their own units."""


def undrawn(numbers: Numbers, t: int, x: Array, bearings: Sequence[str], joints: Sequence[Unevenness], known: Latest[tuple[Effect, Values]]) -> list[tuple[Effect, Values]]:
    """What `bearings`, balls, `joints` and rings are in test `t`, at nuisance values x (P,), that
    no drawing has, as effects that act before all others; `known` keeps these."""
    ways: tuple[tuple[Integers, Callable[[Told], tuple[Effect, Values]]], ...] = (
        (numbers.expansion, lambda told: stretched(*(1 + value for _, value in told))),
        (numbers.uneven, lambda told: uneven([(joints[p.index], value) for p, value in told])),
        (numbers.balls[t], _otherwise),
        (numbers.apart, lambda told: apart(*({bearings[p.index]: value for p, value in told if p.kind == kind} for kind in kinds_of.APART))),
    )

    def acting(of: Integers, as_effect: Callable[[Told], tuple[Effect, Values]]) -> tuple[Effect, Values]:
        return known.of((of.tobytes(), x[of].tobytes()), lambda: as_effect([(p, float(x[i]) * p.sd) for i in of for p in [numbers.parameters[i]]]))

    return [acting(of, as_effect) for of, as_effect in ways if x[of].any()]


def _otherwise(told: Told) -> tuple[Effect, Values]:
    """Of balls by what they are in all tests, and in one."""
    shares = {p.index: value for p, value in told if p.kind == kinds_of.BALLS}
    warmer = sum(value for p, value in told if p.kind == kinds_of.CHANGE and p.test is None)
    own = {p.index: value for p, value in told if p.kind == kinds_of.CHANGE and p.test is not None}
    rows = {i - len(CHANGES): value for i, value in own.items() if i >= len(CHANGES)}
    orbits = sum(value for p, value in told if p.kind == kinds_of.ORBITS)
    return otherwise(shares, warmer, tuple(own.get(i, 0.0) for i in range(len(CHANGES))), rows, orbits)


def stretched(radial: float, axial: float, grooves: float) -> tuple[Effect, Values]:
    """Thermal ring motions times a factor each, in radius, along the axis, and of grooves."""
    factors = {"inner_r": radial, "outer_r": radial, "inner_z": axial, "outer_z": axial, "inner_strain": grooves, "outer_strain": grooves}

    def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
        return {b: changed(m, **{k: f * getattr(m, k) for k, f in factors.items()}) for b, m in by_bearing.items()}

    return Effect("expansion", "", "", (), "", (), "", motions=motions), {}


def apart(stiffness: Mapping[str, float], damping: Mapping[str, float]) -> tuple[Effect, Values]:
    """Stiffness and damping of bearings, by name, off by these shares less their mean: what all
    have in common is a tolerance of the preload and of the damping."""
    stiffer, lossier = ({b: 1 + share - sum(own.values()) / len(own) for b, share in own.items()} for own in (stiffness, damping))

    def of(name: str) -> tuple[float, float]:
        return stiffer.get(name, 1.0), stiffer.get(name, 1.0) * lossier.get(name, 1.0)

    def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        bearings = tuple(changed(b, stiffness=k * b.stiffness, damping=c * b.damping) for b in state.bearings for k, c in [of(b.name)])
        linear = tuple(changed(b, stiffness=k * b.stiffness, damping=c * b.damping) for b in state.linear for k, c in [of(b.name)])
        return changed(state, bearings=bearings, linear=linear)

    return Effect("apart", "", "", (), "", (), "", pair=pair), {}


def otherwise(
    shares: Mapping[int, float], warmer: float = 0.0, own: Sequence[float] = (0.0, 0.0, 0.0, 0.0), rows: Mapping[int, float] = NO_ROWS, orbits: float = 0.0
) -> tuple[Effect, Values]:
    """Stiffness and damping of ball rows off by these shares, in each of `DIRECTIONS` by number; in all directions
    by `warmer` at `RANGE_K` from the reference temperature, in proportion to that; by `own` as `CHANGES` has it; in
    all directions of `rows` by number; and by a share of what balls would be that had each its own of the `orbits`."""
    across, along, in_tilt, between = own
    d = np.sqrt(np.maximum(1 + np.array([across, across, along, along + in_tilt, along + in_tilt]), 0.0))
    for i, share in shares.items():
        d[list(DIRECTIONS[i][1])] *= np.sqrt(max(1 + share, 0.0))
    square = np.outer(d, d)
    square[:2, 3:] *= 1 + between
    square[3:, :2] *= 1 + between

    def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        factor = square * max(1 + warmer * (condition.temperature - spindle.reference_temperature) / RANGE_K, 0.0)
        each = [factor * max(1 + rows.get(i, 0.0), 0.0) for i in range(len(state.bearings))]
        bearings = _by_orbits(spindle, state.bearings, orbits)
        return changed(state, bearings=tuple(changed(b, stiffness=k * b.stiffness, damping=k * b.damping) for b, k in zip(bearings, each, strict=True)))

    return Effect("otherwise", "", "", (), "", (), "", pair=pair), {}


def _by_orbits(spindle: Spindle, bearings: Sequence[BearingState], share: float) -> Sequence[BearingState]:
    if not share:
        return bearings
    found = []
    for b, drawing in zip(bearings, spindle.bearings, strict=True):
        change = share * by_own_orbits(b.row, np.array(b.displacement) if b.displacement else None)
        found.append(changed(b, stiffness=b.stiffness + change, damping=b.damping + spindle.structure.damping_time(drawing.damping_ratio) * change))
    return found


def uneven(shares: Sequence[tuple[Unevenness, float]]) -> tuple[Effect, Values]:
    """Joints stiffer by a share one way and less stiff by as much across, or segments of a shaft
    stiffer by it, to first order: K -> S K S, damping with it."""
    by_joint: dict[str, Array] = {}
    for u, share in shares:
        for joint, pattern in u.patterns:
            by_joint[joint] = by_joint.get(joint, np.eye(5)) + share / 2 * pattern

    def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
        turned = ((e, by_joint.get(e.name)) for e in chain.elements)
        return changed(chain, elements=tuple(e if s is None else changed(e, stiffness=s @ e.stiffness @ s, damping=s @ e.damping @ s) for e, s in turned))

    return Effect("uneven", "", "", (), "", (), "", chain=chain), {}
