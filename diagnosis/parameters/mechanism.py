"""A mechanism and its law: what is changed, where, and how much of it is expected over temperature, speed, level and time.

The size of an effect is its first parameter. Its law is what the effect's formula makes of one size at every condition. A law
is a prior, not a gospel: the size that acts in test t is a_t = a (1 + r_t), with departures r that are continuous over the
conditions (an exponential covariance, Rasmussen & Williams, *Gaussian Processes*, 2006, Eq. 4.18) and whose size is learned.
Where a law gives nothing it goes on giving nothing; with a law of the data's own the same mechanism acts in every test as its
formula has it where it does most, and its size alone says how much. What drifts begins at the reference: where a formula
gives nothing there, a law of the data's own does not either, and what is the same in all tests is an offset of the drawing.
Beyond a limit of its size the matrices of an effect continue in a straight line, so that sizes may scatter about zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.effects import of_scene
from thermospindle.sim.effects.effect import HOOKS, Effect, Parameter
from thermospindle.sim.operating import operating_point

MEMORY_K = 40.0  # K over which departures from a law are alike
MEMORY_RPM = 6000.0
MEMORY_LEVEL = 2.0  # of ln level
MEMORY_SOAK = 2.0  # of ln soak time
LITTLE = 0.02  # of an effect's typical size, which is linear in all that it changes
IDLE = 0.02  # of what an effect changes where it does most, by which it may change something where it does nothing
SAME = 1e-6  # of the square of a change, by which it may differ from another that is the same
FAILS = (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError)
"""What asking an effect at a condition may end in, some effects being a user's own."""
Changes = Callable[[Condition, Effect, Mapping[str, float]], Array]
REFERENCE_DEPARTURE = 0.5  # of the size, in the fit itself; evidence takes others into account
REFERENCE_WIDTH = 2.0  # prior standard deviations of the size, likewise


@dataclass(frozen=True, eq=False)
class Mechanism:
    """An effect with its choices made; `free` for free-form models, which have no law and no name in the
    catalogue, `own_law` for effects of the catalogue whose law is the data's own. Sizes of one that has a
    `reference` grow from there, where it does nothing; those of the others start from one that all tests share.
    One that is `beyond` changes what an effect does, by sizes that this cannot have: something unknown, and free."""

    effect: Effect
    choices: Mapping[str, float]
    shape: tuple[Parameter, ...]
    free: bool = False
    own_law: bool = False
    beyond: bool = False
    reference: Condition | None = None

    @property
    def kind(self) -> str:
        return "free" if self.free else "own law" if self.own_law else "law"

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def variant(self) -> tuple:
        """What it is told by: its effect's name, whose law, and the choices made."""
        return self.name, self.kind, *sorted(self.choices.items())

    @property
    def lasting(self) -> bool:
        """Whether it does the same in every test: for what its effect is, or of the share chosen that temperature has in it."""
        return self.effect.lasting or self.choices.get("thermal_share") == 0.0

    @property
    def size(self) -> Parameter:
        return self.effect.parameters[0]

    def values(self, size: float, shape: Sequence[float]) -> dict[str, float]:
        """Parameter values of the effect for a size and shape parameters, in their units."""
        return {self.size.name: size, **self.choices, **{p.name: v for p, v in zip(self.shape, shape, strict=True)}}


def variants(effect: Effect) -> list[Mechanism]:
    """One mechanism for every combination of what an effect has to choose from; and, of each share between two ideal cases, both of
    these beside what lies between, for the first combination: a law that is all constant, or all thermal, has nothing to choose."""
    chosen = [p for p in effect.parameters[1:] if p.choices]
    shape = tuple(p for p in effect.parameters[1:] if not p.choices and p.prior_sd > 0)
    found = []
    for row in product(*[p.choices for p in chosen]):
        choices = dict(zip([p.name for p in chosen], row, strict=True))
        found.append(Mechanism(effect, choices, shape))
        for share in [p for p in shape if p.limits == (0.0, 1.0)] if len(found) == 1 else []:
            others = tuple(p for p in shape if p is not share)
            found += [Mechanism(effect, choices | {share.name: end}, others) for end in (0.0, 1.0)]
    return found


def strongest(spindle: Spindle, conditions: Sequence[Condition]) -> Condition:
    """Where effects do most, of all that tests were made at together: the temperature furthest from the
    reference, the highest speed (the nominal one where nothing turned), the hardest hit and the shortest soak."""
    furthest = max((c.temperature for c in conditions), key=lambda t: abs(t - spindle.reference_temperature))
    fastest = max((c.speed for c in conditions), key=abs) or spindle.nominal_speed
    return Condition(furthest, fastest, max(c.level for c in conditions), min(c.soak_time for c in conditions))


def unmoved(spindle: Spindle, conditions: Sequence[Condition]) -> Condition:
    """Where nothing has drifted yet: the reference temperature, at rest, at the softest hit and the longest soak of all tests."""
    return Condition(spindle.reference_temperature, 0.0, min(c.level for c in conditions), max(c.soak_time for c in conditions))


def with_own_laws(mechanisms: Sequence[Mechanism], spindle: Spindle, conditions: Sequence[Condition]) -> list[Mechanism]:
    """The same with laws of the data's own: every effect does at any condition what its formula gives where it
    does most, and what gives nothing at the reference grows from there. Of what lies between two ideal cases of a
    law one serves for all, and what there is but another size is no shape; what lasts, or asks for no condition,
    has no law but a constant, what is `exact` no other, and what changes the condition cannot be asked at another."""
    at, reference, changes = strongest(spindle, conditions), unmoved(spindle, conditions), _changes_of(spindle)
    found: dict[tuple, Mechanism] = {}
    for m in mechanisms:
        chosen = {p.name: m.choices[p.name] for p in m.effect.parameters if p.choices}
        if not (m.effect.lasting or m.effect.exact or m.effect.condition) and (m.name, *chosen.items()) not in found and _asks(m.effect, spindle, at):
            grows = _idle(m.effect, changes, reference, at)
            own = replace(m, effect=asked_at(m.effect, at), own_law=True, reference=reference if grows else None)
            found[m.name, *chosen.items()] = _without_scales(own, changes, at)
    return list(found.values())


def asked_at(effect: Effect, at: Any) -> Effect:
    """The effect, whose functions are all given the condition `at` instead of the test's."""

    def asked(hook: Callable) -> Callable:
        def changed(spindle: Spindle, condition: Condition, *rest: Any) -> Any:
            return hook(spindle, at, *rest)

        return changed

    hooks: dict[str, Any] = {name: asked(hook) for name in HOOKS if (hook := getattr(effect, name)) is not None}
    return replace(effect, **hooks)


def _changes_of(spindle: Spindle) -> Changes:
    """What an effect changes at a condition beside those of the scene, in shares of the largest
    entry of each matrix; what is without it is worked out once a condition."""
    present, plain = of_scene(spindle), cache(lambda at: operating_point(spindle, at).linear)

    def changes(at: Condition, effect: Effect, values: Mapping[str, float]) -> Array:
        before, found = plain(at), operating_point(spindle, at, [*present, (effect, values)]).linear
        return np.concatenate([np.ravel(getattr(found, w) - getattr(before, w)) / np.abs(getattr(before, w)).max() for w in ("mass", "damping", "stiffness")])

    return changes


def _without_scales(m: Mechanism, changes: Changes, at: Condition) -> Mechanism:
    """Without the shape parameters that do no more than a size does where one condition alone is asked: a
    law's, such as the interference by which a fit opens with temperature. They stay where they are neutral."""
    try:
        neutral = m.values(m.size.neutral + LITTLE * (m.size.typical - m.size.neutral), [q.neutral for q in m.shape])
        drawn = changes(at, m.effect, neutral)
        scales = [q for q in m.shape if _parallel(drawn, changes(at, m.effect, {**neutral, q.name: _inside(q)}))]
    except FAILS:
        return m
    return replace(m, choices={**m.choices, **{q.name: q.neutral for q in scales}}, shape=tuple(q for q in m.shape if q not in scales))


def _idle(effect: Effect, changes: Changes, reference: Condition, at: Condition) -> bool:
    """Whether an effect of typical size changes next to nothing at the `reference` of what it changes `at` another condition."""
    if effect.measurement is not None:
        return False
    try:
        there, here = (changes(c, effect, effect.typical()) for c in (reference, at))
    except FAILS:
        return False
    return bool(float(there @ there) < IDLE**2 * float(here @ here))


def _inside(q: Parameter) -> float:
    """A value of a parameter about a prior standard deviation from neutral, within its limits."""
    up = q.neutral + q.prior_sd
    return up if up < q.limits[1] else (q.neutral + max(q.limits[0], q.neutral - q.prior_sd)) / 2


def _parallel(one: Array, other: Array) -> bool:
    """Whether two changes, of some size, are the same but for that."""
    square, across, whole = float(one @ one), float(one @ other), float(other @ other)
    return min(square, whole) > 0 and square * whole - across**2 < SAME * square * whole


class _Watched:
    """A condition that knows whether it was asked."""

    def __init__(self, at: Condition) -> None:
        self._at, self.asked = at, False

    def __getattr__(self, name: str) -> Any:
        self.asked = True
        return getattr(self._at, name)


def _asks(effect: Effect, spindle: Spindle, at: Condition) -> bool:
    """Whether what an effect of typical size changes in a hammer test depends on the condition."""
    watched = _Watched(at)
    try:
        point = operating_point(spindle, at, [(asked_at(effect, watched), effect.typical())])
        point.chain, point.measurement  # noqa: B018 - worked out here
    except FAILS:
        return True
    return watched.asked


def _places(conditions: Sequence[Condition]) -> Array:
    """Temperature, speed, ln level and ln soak time (4, n), each over the distance within which
    departures are alike; heat and loads of balls know no sense of rotation."""
    t = np.array([c.temperature for c in conditions]) / MEMORY_K
    n = np.array([abs(c.speed) for c in conditions]) / (MEMORY_RPM * RPM)
    level = np.log(np.maximum([c.level for c in conditions], 0.1)) / MEMORY_LEVEL
    soak = np.log(np.clip([c.soak_time for c in conditions], 60.0, 1e6)) / MEMORY_SOAK
    return np.array([t, n, level, soak])


def likeness(conditions: Sequence[Condition], others: Sequence[Condition] | None = None) -> Array:
    """Correlation (n, m) of departures from a law between tests, and the same or `others`: 1 where
    conditions agree, falling with their distance."""
    one, other = _places(conditions), _places(conditions if others is None else others)
    return np.exp(-np.abs(one[:, :, None] - other[:, None, :]).sum(axis=0))


def grown(conditions: Sequence[Condition], reference: Condition) -> Array:
    """How far (4, n) every test is from the reference in temperature, speed, level and soak: what grows in a straight line with each."""
    return _places(conditions) - _places([reference])


def shared(m: Mechanism, conditions: Sequence[Condition]) -> Array:
    """Of one size of a mechanism how much (n,) every test has where its law holds: all of it, or
    what has grown from its reference, 1 at most."""
    if m.reference is None:
        return np.ones(len(conditions))
    amounts = grown(conditions, m.reference).sum(axis=0)
    return np.asarray(amounts / max(float(np.abs(amounts).max()), 1e-9))


def size_covariance(conditions: Sequence[Condition], width: float, departure: float, offset: float = 1.0, reference: Condition | None = None) -> Array:
    """Prior covariance (n, n) of the sizes in all tests, with a little of each test's own: `width`^2 (`offset`^2 +
    `departure`^2 likeness); of what grows from a `reference` `width`^2 (`offset`^2 + what grows straight, for each of
    temperature, speed, level and soak + `departure`^2 times the covariance of x - x there, x having the likeness)."""
    n = len(conditions)
    alike, straight = likeness(conditions), np.zeros((n, n))
    if reference is not None:
        to = likeness(conditions, [reference])
        alike, away = 1.0 + alike - to - to.T, grown(conditions, reference)
        straight = away.T @ away
    return width**2 * (offset**2 + straight + departure**2 * (0.98 * alike + 0.02 * np.eye(n)) + 1e-9 * np.eye(n))


def one_size(m: Mechanism, root: Array, sizes: Array, covariance: Array) -> tuple[float, float]:
    """One size for all tests, with its standard error, within its limits: of `sizes` (tests,) with their
    `covariance`, weighted by what the data tell beyond the prior whose `root` (tests, tests) that is.

    A test at the reference, where what grows from it is nothing by its definition, tells nothing.
    """
    precision = 1 / np.maximum(np.diag(covariance), 1e-300)
    told = np.maximum(precision - 1 / np.einsum("tk,tk->t", root, root), 0.0)
    weight = told if told.any() else precision
    weight = weight / weight.sum()
    return float(np.clip(weight @ sizes, *m.size.limits)), float(np.sqrt(weight @ covariance @ weight))
