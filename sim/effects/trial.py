"""Trying an effect on a spindle: at three conditions, and what is seen of it there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import inf

import numpy as np

from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase, matrices
from thermospindle.model.rotor.frf import frf
from thermospindle.model.rotor.modes import modes
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import RPM
from thermospindle.sim.effects.effect import Effect, Values
from thermospindle.sim.effects.own import guarded
from thermospindle.sim.operating import OperatingPoint, operating_point

WARMER = ((0.0, 0.0, 0.0, inf), (40.0, 7200.0, 0.0, inf), (30.0, 3600.0, 10.0, 1500.0))
"""Conditions: K above the reference temperature, rpm, hammer level (N), soak time (s)."""
LINES = 100  # of the FRF, over the scene's band
Observables = Mapping[str, Array | ComplexArray | object]


class Broken(Exception):
    """What is wrong with an effect; the sentence goes on after the effect's name."""


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect under guard, and a spindle to try it on: its words (`every_word`), conditions it
    bears, and what is seen of it without the effect."""

    effect: Effect
    spindle: Spindle
    conditions: tuple[Condition, ...]
    before: tuple[Observables, ...]
    words: str

    def points(self, values: Values) -> list[OperatingPoint]:
        points = []
        for c in self.conditions:
            try:
                points.append(operating_point(self.spindle, c, [(self.effect, values)]))
            except (NoEquilibrium, OutsideRange) as error:
                raise Broken(f"{told(values)} at {c.temperature:g} C, {c.speed / RPM:g} rpm: {error}") from None
        return points

    def seen(self, values: Values) -> list[Observables]:
        found = []
        for point in self.points(values):
            c = point.condition
            try:
                found.append(observables(point))
            except Broken as error:
                raise Broken(f"{told(values)} at {c.temperature:g} C, {c.speed / RPM:g} rpm: {error}") from None
        return found


def trial(effect: Effect, spindle: Spindle, where: str = "") -> Trial:
    """The conditions are those of `WARMER` at which the spindle without effects has a bearing equilibrium."""
    conditions, before = [], []
    for warmer, speed, level, soak in WARMER:
        c = Condition(spindle.reference_temperature + warmer, speed * RPM, level, soak)
        try:
            before.append(observables(operating_point(spindle, c, ())))
        except (NoEquilibrium, OutsideRange):
            continue
        conditions.append(c)
    if not conditions:
        raise BadInput(f"{spindle.name}: the spindle has no bearing equilibrium at any condition on which to try an effect")
    return Trial(guarded(effect, where or f"effect {effect.name}"), spindle, tuple(conditions), tuple(before), every_word(spindle))


def every_word(spindle: Spindle) -> str:
    """All that a spindle is, in words: what changes it changes them."""
    return repr([getattr(spindle, f.name) for f in fields(spindle)])


def observables(point: OperatingPoint) -> Observables:
    """Frequencies, damping ratios and FRFs of a point as the measuring chain shows them, and what excites it when it runs."""
    _check_chain(point.chain)
    linear, chain = matrices(point.chain), point.measurement
    if not all(np.isfinite(m).all() for m in (linear.mass, linear.damping, linear.stiffness)):
        raise Broken("the matrices of the rotor-base chain are not finite")
    if not (np.diag(linear.mass) > 0).all():
        raise Broken("a body has no mass or inertia left")
    band = point.spindle.hammer.band
    found = modes(point.chain, linear, highest=band[1])
    lines = np.linspace(*band, LINES)
    s: ComplexArray = np.asarray(lines - 1j * chain.decay / (2 * np.pi), complex)
    value = frf(linear, chain.response_rows, chain.reference_rows, s, "mobility")
    seen = chain.gain[:, None] * np.exp(-2j * np.pi * lines * chain.delay[:, None])
    answer = {
        "frequency": np.array([m.frequency for m in found]),
        "damping": np.array([m.damping_ratio for m in found]),
        "frf": value * seen[:, None, :],
    }
    for what, numbers in answer.items():
        if not np.isfinite(numbers).all():
            raise Broken(f"a {what} is not finite")
    return {**answer, "imperfections": point.imperfections}


def _check_chain(chain: RotorBase) -> None:
    bodies = [b.name for b in chain.bodies]
    for element in chain.elements:
        for name in (element.a, element.b):
            if name not in (*bodies, "ground"):
                raise Broken(f"the element {element.name!r} ends at {name!r}; allowed are ground, {', '.join(bodies)}")


def moved(one: Observables, other: Observables) -> float:
    """The largest relative change; a mode that comes or goes, and another excitation, count as one."""
    if one["imperfections"] != other["imperfections"]:
        return 1.0
    changes = []
    for what in ("frequency", "damping", "frf"):
        a, b = np.asarray(one[what]), np.asarray(other[what])
        if a.shape != b.shape:
            return 1.0
        changes.append(float(np.max(np.abs(a - b), initial=0.0) / np.max(np.abs(a), initial=1e-300)))
    return max(changes)


def told(values: Values) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in values.items())
