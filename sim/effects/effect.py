"""What a physical effect is: a file with its equation, parameters and pure functions that change what one step of the chain sees.

A condition, as it is said to be, flows  the condition as it is -> spindle -> region temperatures -> ring motions -> bearing pair ->
rotor-base chain -> measurement;  an effect changes any of these, and at its neutral values it changes nothing, exactly. Effects are
applied in the order of the scene. No other code knows an effect by name: where it seemed to need to, the state would lack a field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.model.types import Array

Values = Mapping[str, float]
Question = Callable[[Spindle], str | None]
"""Asked of a spindle: None where all is well, else why not."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect: a readable row.

    `typical` is a plausible size where the effect is present; `prior_sd` the width of what one believes before measuring, about
    `neutral`; values outside `limits` are not physical. A parameter that counts or names something has `choices`: no other values mean
    anything, and a fit tries them one by one.
    """

    name: str
    unit: str
    neutral: float
    typical: float
    prior_sd: float
    limits: tuple[float, float]
    meaning: str
    source: str
    choices: tuple[float, ...] = ()
    counts: str = ""
    """What its choices are the numbers of, from 0: "bearings" a spindle's ball bearings, "all bearings" those of any kind, "sets" what
    shares a preload, "rings" the inner and the outer one of a bearing. One that is -1 where neutral stands for all of them there."""

    @property
    def sign(self) -> float:
        """The one sign that limits allow of what differs from neutral; 0 where it may be either."""
        low, high = self.limits
        return 1.0 if low >= self.neutral else -1.0 if high <= self.neutral else 0.0


ALL = -1.0
"""Of a parameter that numbers things: every one of them."""

REFERENCE_HUB = 0.0259
"""kg, the turning mass of the spindle for which absolute sizes in the catalogue are written; a spindle twice as long has eight times it."""


def mass_ratio(spindle: Spindle) -> float:
    """Turning mass over that of the reference spindle; of a machine in which nothing turns the mass of all that moves."""
    return (spindle.turning_mass or sum(b.mass for b in spindle.structure.bodies)) / REFERENCE_HUB


ROWS, ROLLING, RINGS = "ball row", "ball or roller row", "ball or roller row between rings of the section"
SECTION, TURNING, SHAFT = "section", "turning body", "flexible shaft"
PARTS: Mapping[str, Callable[[Spindle], bool]] = {
    ROWS: lambda spindle: bool(spindle.bearings),
    ROLLING: lambda spindle: bool(spindle.rolling),
    RINGS: lambda spindle: bool(spindle.ringed),
    SECTION: lambda spindle: bool(spindle.regions),
    TURNING: lambda spindle: spindle.structure.turns,
    SHAFT: lambda spindle: bool(spindle.structure.shafts),
}
"""What an effect may need of a spindle, as a message names it."""


def fitted_to(effect: Effect, spindle: Spindle) -> Effect:
    """The effect with its parameters as plausible for a spindle: sizes in its scale, to two digits,
    a choice for each of its bearings, and what is meant by the scene's own names.

    Limits only widen. On the reference spindle it is the effect itself, and so is one that has been fitted already.
    """
    if refusal(effect, spindle) is not None:
        return effect
    factors = effect.sized(spindle) if effect.sized else {}
    counts = {kind: len(names) for kind, names in _counted(spindle).items()}
    meant = effect.meant(spindle) if effect.meant else {}
    rows = tuple(replace(_fitted(p, factors.get(p.name, 1.0), counts), meaning=meant.get(p.name, p.meaning)) for p in effect.parameters)
    return effect if rows == effect.parameters else replace(effect, parameters=rows, sized=None)


def _counted(spindle: Spindle) -> dict[str, list[str]]:
    """Names of what parameters may count (`Parameter.counts`)."""
    return {"bearings": [b.name for b in spindle.bearings], "all bearings": [b.name for b in spindle.all_bearings], "sets": [s.name for s in spindle.sets], "rings": ["inner", "outer"]}


def called(p: Parameter, value: float, spindle: Spindle) -> str | None:
    """The name of what the value of a parameter that counts something means; None for other parameters."""
    return None if not p.counts else "all" if value == ALL else _counted(spindle)[p.counts][int(value)]


def _fitted(p: Parameter, factor: float, counts: Mapping[str, int]) -> Parameter:
    """The whole of a value goes with the machine, what is neutral too: a radius twice as large is so where it changes nothing."""
    if p.counts:
        numbers = tuple(float(k) for k in range(counts[p.counts]))
        if p.neutral == ALL:  # of one alone that is the same as all of them
            return replace(p, choices=(ALL, *numbers) if len(numbers) > 1 else (ALL,), limits=(ALL, max((0.0, *numbers))))
        return replace(p, choices=numbers, limits=(0.0, max(numbers[-1], 1.0)), typical=min(p.typical, numbers[-1]))
    if float(f"{factor:.1e}") == 1.0:
        return p

    def scaled(value: float) -> float:
        return float(f"{factor * value:.1e}")

    low, high = (scaled(limit) for limit in p.limits)
    limits = (min(low, p.limits[0]), max(high, p.limits[1]))
    return replace(p, neutral=scaled(p.neutral), typical=scaled(p.typical), prior_sd=scaled(p.prior_sd), limits=limits)


def refusal(effect: Effect, spindle: Spindle) -> str | None:
    """Why an effect is not to be added to a spindle, or looked for in its tests; None where it may."""
    for part in effect.acts_on:
        if not PARTS[part](spindle):
            return f"nothing to act on here: the scene has no {part}"
    if effect.idle and (why := effect.idle(spindle)):
        return f"nothing to act on here: {why}"
    if effect.outside and (why := effect.outside(spindle)):
        return f"outside its validity here: {why}"
    return None


def scale_parameter(typical: float, prior_sd: float, limits: tuple[float, float], meaning: str, source: str) -> Parameter:
    """The size of an effect in units of what its formula gives: 0 nothing, 1 all of it."""
    return Parameter("scale", "1", 0.0, typical, prior_sd, limits, meaning, source)


def direction_parameter(prior_sd: float, half_turn: float, meaning: str) -> Parameter:
    """A direction (deg) of which nothing is known; `half_turn` is where it comes back to itself from either side."""
    return Parameter("direction", "deg", 0.0, 0.0, prior_sd, (-half_turn, half_turn), meaning, "unknown before measuring: any")


def bearing_parameter(source: str) -> Parameter:
    """Which bearing holds an imperfection."""
    meaning = "0 the first bearing of the scene (the lowest one), 1 the second, and so on"
    return Parameter("bearing", "1", 0.0, 1.0, 1.0, (0.0, 1.0), meaning, source, choices=(0.0, 1.0), counts="bearings")


def which_parameter(name: str, counts: str, here: int, meaning: str, source: str) -> Parameter:
    """Which of what `counts` is meant: all of them, or one; the reference spindle has `here` of them."""
    says = f"{meaning}: -1 all, 0 the first of the scene, and so on"
    return _fitted(Parameter(name, "1", ALL, ALL, 1.0, (ALL, 1.0), says, source, (ALL,), counts), 1.0, {counts: here})


def chosen(values: Values, name: str, names: Sequence[str]) -> tuple[str, ...]:
    """Those that the value of a `which_parameter` means; all of them where there is none, as in
    scripts from before there was such a choice."""
    number = values.get(name, ALL)
    return tuple(names) if number == ALL else (names[int(number)],)


def channel_parameter(meaning: str) -> Parameter:
    """Which response channel is meant, counted from 1; 0 for the ordinary case of many."""
    source = "a whole group of channels is assumed; one alone where a sensor or its amplifier is set wrongly"
    return Parameter("channel", "1", 0.0, 0.0, 1.0, (0.0, 16.0), meaning, source, choices=tuple(float(c) for c in range(17)))


def channel_numbers(spindle: Spindle) -> Array:
    """Numbers (n_points,) of the points as response channels, from 1: of a campaign's test those that its sensors have in all tests."""
    return np.array([p.channel or k for k, p in enumerate(spindle.points, 1)])


def hammer_numbers(spindle: Spindle) -> Array:
    """Numbers (n_ref,) of the hammer's points, likewise."""
    return np.array([spindle.point(n).hammer or k for k, n in enumerate(spindle.hammer.hammer_nodes, 1)])


def phase_parameter(meaning: str) -> Parameter:
    """An azimuth (deg) of which nothing is known."""
    source = "any azimuth is as likely as another: the standard deviation is that of a uniform angle"
    return Parameter("phase", "deg", 0.0, 60.0, 104.0, (-180.0, 180.0), meaning, source)


@dataclass(frozen=True, eq=False)
class Measurement:
    """The measuring chain: what is read of the chain's motion, and how.

    A measured mobility is gain exp(-i omega delay) H(i omega + decay) with H between the reference and response rows.
    """

    response_rows: Array  # (n_resp, n)
    reference_rows: Array  # (n_ref, n)
    gain: Array  # (n_resp,)
    delay: Array  # (n_resp,) s
    decay: float  # 1/s, damping an uncorrected exponential window adds


Sizes = Callable[[Spindle], Mapping[str, float]]
"""Factors by parameter name: how much larger than on the reference spindle a size is plausible."""


@dataclass(frozen=True)
class Effect:
    """A physical effect. Each function may be left out; `Values` hold every parameter.

    `condition(spindle, condition, values)` the condition that a test was made at, of which all others ask;
    `spindle(spindle, condition, values)` the drawing itself at a condition: materials, structure, preload, bearings;
    `temperatures(spindle, condition, values, by_region)` region temperatures (C);
    `motions(spindle, condition, values, by_bearing)` thermal and other ring motions;
    `pair(spindle, condition, values, state)` bearing states;
    `chain(spindle, condition, values, chain)` bodies and elements;
    `imperfections(spindle, condition, values, imperfections)` what excites the running spindle;
    `measurement(spindle, condition, values, chain, measurement)` the measuring chain.

    `acts_on` names the parts of a spindle (`PARTS`) without any of which the effect has nothing to act on; `idle(spindle)`
    says why it has nothing to act on in a spindle that has them, `outside(spindle)` why that spindle is outside its
    validity; None where neither is so (`refusal` asks both). `sized(spindle)` gives what is plausible for a machine of
    that size: factors by parameter name, of typical size, prior and limits, for sizes that are written for the reference
    spindle; `meant(spindle)` the meaning of parameters, by name, with the names that the scene has for its parts.
    """

    name: str
    title: str
    equation: str
    parameters: tuple[Parameter, ...]
    sees: str  # what one sees of it
    resembles: tuple[str, ...]  # effects it is easily confused with
    valid: str  # where it is valid
    condition: Callable[[Spindle, Condition, Values], Condition] | None = None
    spindle: Callable[[Spindle, Condition, Values], Spindle] | None = None
    temperatures: Callable[[Spindle, Condition, Values, dict[str, float]], dict[str, float]] | None = None
    motions: Callable[[Spindle, Condition, Values, dict[str, RingMotion]], dict[str, RingMotion]] | None = None
    pair: Callable[[Spindle, Condition, Values, PairState], PairState] | None = None
    chain: Callable[[Spindle, Condition, Values, RotorBase], RotorBase] | None = None
    imperfections: Callable[[Spindle, Condition, Values, Imperfections], Imperfections] | None = None
    measurement: Callable[[Spindle, Condition, Values, RotorBase, Measurement], Measurement] | None = None
    acts_on: tuple[str, ...] = ()  # of PARTS, what a spindle must have for it
    idle: Question | None = None
    outside: Question | None = None
    sized: Sizes | None = None
    meant: Callable[[Spindle], Mapping[str, str]] | None = None
    drifts: str = ""  # of one drafted from a diagnosis: the element, or effect, whose change it is
    lasting: bool = False  # its size is the same in every test, as a mass is: no law that data may depart from
    exact: bool = False  # mechanics or the material alone gives its law over speed and temperature: data may hardly depart from it, and have none of their own

    @cached_property
    def hooks(self) -> frozenset[str]:
        """Names of the functions that it has."""
        return frozenset(hook for hook in HOOKS if getattr(self, hook))

    def neutral(self) -> dict[str, float]:
        return {p.name: p.neutral for p in self.parameters}

    def typical(self) -> dict[str, float]:
        return {p.name: p.typical for p in self.parameters}


HOOKS: Mapping[str, type] = {
    "condition": Condition,
    "spindle": Spindle,
    "temperatures": dict,
    "motions": dict,
    "pair": PairState,
    "chain": RotorBase,
    "imperfections": Imperfections,
    "measurement": Measurement,
}
"""What each function of an effect returns; the dicts keep the keys that they are given."""
