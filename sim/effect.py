"""What a physical effect is: a file with its equation, parameters and pure functions that change what one step of the chain sees.

A condition flows  spindle -> region temperatures -> ring motions -> bearing pair -> rotor-base chain -> measurement;  an effect changes
any of these, and at its neutral values it changes nothing, exactly. Effects are applied in the order of the scene. No other code
knows an effect by name: where it seemed to need to, the state would lack a field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from model.ball_row import Array
from model.imperfections import Imperfections
from model.machine import Condition, RingMotion, Spindle
from model.pair import PairState
from model.rotor_base import RotorBase

Values = Mapping[str, float]


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


def scale_parameter(typical: float, prior_sd: float, limits: tuple[float, float], meaning: str, source: str) -> Parameter:
    """The size of an effect in units of what its formula gives: 0 nothing, 1 all of it."""
    return Parameter("scale", "1", 0.0, typical, prior_sd, limits, meaning, source)


def direction_parameter(prior_sd: float, half_turn: float, meaning: str) -> Parameter:
    """A direction (deg) of which nothing is known; `half_turn` is where it comes back to itself from either side."""
    return Parameter("direction", "deg", 0.0, 0.0, prior_sd, (-half_turn, half_turn), meaning, "unknown before measuring: any")


def bearing_parameter(source: str) -> Parameter:
    """Which bearing holds an imperfection."""
    meaning = "0 the first bearing of the scene (the lower one), 1 the second"
    return Parameter("bearing", "1", 0.0, 1.0, 1.0, (0.0, 1.0), meaning, source, choices=(0.0, 1.0))


def channel_parameter(meaning: str) -> Parameter:
    """Which response channel is meant, counted from 1; 0 for the ordinary case of many."""
    source = "a whole group of channels is assumed; one alone where a sensor or its amplifier is set wrongly"
    return Parameter("channel", "1", 0.0, 0.0, 1.0, (0.0, 16.0), meaning, source, choices=tuple(float(c) for c in range(17)))


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


@dataclass(frozen=True)
class Effect:
    """A physical effect. Each function may be left out; `Values` hold every parameter.

    `spindle(spindle, condition, values)` the drawing itself at a condition: materials, structure, preload, bearings;
    `temperatures(spindle, condition, values, by_region)` region temperatures (C);
    `motions(spindle, condition, values, by_bearing)` thermal and other ring motions;
    `pair(spindle, condition, values, state)` bearing states;
    `chain(spindle, condition, values, chain)` bodies and elements;
    `imperfections(spindle, condition, values, imperfections)` what excites the running spindle;
    `measurement(spindle, condition, values, chain, measurement)` the measuring chain.

    `form_error` is the share of its own size by which the formula may be wrong, `damping_form_error` the same for what it does to damping:
    nobody's law of a bond or a film is exact to a percent, and a law of its losses is worth far less.
    """

    name: str
    title: str
    equation: str
    parameters: tuple[Parameter, ...]
    sees: str  # what one sees of it
    resembles: tuple[str, ...]  # effects it is easily confused with
    valid: str  # where it is valid
    spindle: Callable[[Spindle, Condition, Values], Spindle] | None = None
    temperatures: Callable[[Spindle, Condition, Values, dict[str, float]], dict[str, float]] | None = None
    motions: Callable[[Spindle, Condition, Values, dict[str, RingMotion]], dict[str, RingMotion]] | None = None
    pair: Callable[[Spindle, Condition, Values, PairState], PairState] | None = None
    chain: Callable[[Spindle, Condition, Values, RotorBase], RotorBase] | None = None
    imperfections: Callable[[Spindle, Condition, Values, Imperfections], Imperfections] | None = None
    measurement: Callable[[Spindle, Condition, Values, RotorBase, Measurement], Measurement] | None = None
    form_error: float = 0.05
    damping_form_error: float = 0.5

    def neutral(self) -> dict[str, float]:
        return {p.name: p.neutral for p in self.parameters}

    def typical(self) -> dict[str, float]:
        return {p.name: p.typical for p in self.parameters}

    def typical_list(self) -> list[float]:
        """Typical values in the order of the parameters."""
        return [p.typical for p in self.parameters]


HOOKS: Mapping[str, type] = {
    "spindle": Spindle,
    "temperatures": dict,
    "motions": dict,
    "pair": PairState,
    "chain": RotorBase,
    "imperfections": Imperfections,
    "measurement": Measurement,
}
"""What each function of an effect returns; the dicts keep the keys that they are given."""
