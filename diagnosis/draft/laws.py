"""The simple laws that physics has over temperature T and speed n, and how each fits what drifts.

None, linear, linear beyond a temperature, power, exponential (that grows, or saturates), Arrhenius, sigmoid, step;
and a power of speed, alone, times one of these or beside it. Each is fitted alone and with what is there everywhere
beside it, weighted by the covariance over the tests; the Bayesian information criterion chooses (Schwarz, *Ann.
Statist.* 6 (1978) 461). A law with as many parameters as it has temperatures, speeds, or pairs of these fits
whatever changes over them: it is taken where chi2 rules all others out, and the file says that it is not tested.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from thermospindle.model.types import Array

REFERENCE = 20.0  # C from which laws count temperature, where a diagnosis does not tell its scene's reference
REFUTED = 1e-3  # chance of a chi2 as large, below which a law is ruled out
SCALE = ("scale", "K", 20.0, (3.0, 200.0))
POWER = ("power", "1", 1.0, (0.2, 4.0))
ACTIVATION = ("activation", "K", 4000.0, (300.0, 20000.0))
KELVIN = 273.15


@dataclass(frozen=True)
class Law:
    """A law size (g(T, n; shape) + offset): the Python expression of g, the shape parameters with
    unit, start and limits, and whether it has an offset.

    The offset is counted in sizes: an effect of no size is none at all, also of a law that has one.
    """

    name: str
    expression: str
    shape: tuple[tuple[str, str, float, tuple[float, float]], ...] = ()
    has_offset: bool = False

    @cached_property
    def asks(self) -> tuple[bool, bool]:
        """Whether it depends on temperature, and on speed."""
        names = compile(self.expression, "law", "eval").co_names
        return "T" in names, "n" in names

    @property
    def is_step(self) -> bool:
        """Between two tests: nothing tells where."""
        return self.expression.startswith("where")

    def __call__(self, temperature: Array, share: Array, values: Any) -> Array:
        names = {"T": temperature, "n": share, "exp": np.exp, "where": np.where, "max": np.maximum, **{s[0]: v for s, v in zip(self.shape, values, strict=True)}}
        return np.broadcast_to(np.asarray(eval(self.expression, {"__builtins__": {}}, names), float), temperature.shape)  # the text is one of ours, above


def of_temperature(reference: float, hottest: float) -> tuple[Law, ...]:
    """Laws that count temperature from a scene's reference (C); the steep ones are 1 at the hottest
    test (C), so that their sizes are what was seen there."""
    from_reference, from_hottest = _less(reference), _less(hottest)
    cold, hot = f"{reference + KELVIN:.8g}", f"{hottest + KELVIN:.8g}"
    exponential, arrhenius = f"exp(({reference - hottest:.6g}) / scale)", f"exp(activation * (1 / {hot} - 1 / {cold}))"
    return (
        Law("linear in temperature", f"({from_reference}) / 40"),
        Law("linear above a temperature", "max(T - start, 0.0) / 40", (("start", "C", 35.0, (-40.0, 200.0)),)),
        Law("power of temperature", f"max(({from_reference}) / {hottest - reference:.6g}, 0.0) ** power", (POWER,)),
        Law("exponential in temperature", f"(exp(({from_hottest}) / scale) - {exponential}) / (1 - {exponential})", (SCALE,)),
        Law("saturating exponential in temperature", f"(1 - exp(({reference:.6g} - T) / scale)) / (1 - {exponential})", (SCALE,)),
        Law("Arrhenius", f"(exp(activation * (1 / {hot} - 1 / (T + 273.15))) - {arrhenius}) / (1 - {arrhenius})", (ACTIVATION,)),
        Law("sigmoid in temperature", "1 / (1 + exp((middle - T) / width))", (("middle", "C", 40.0, (-40.0, 200.0)), ("width", "K", 4.0, (0.5, 40.0)))),
        Law("step in temperature", "where(T > middle, 1.0, 0.0)", (("middle", "C", 35.0, (-40.0, 200.0)),)),
    )


def of_both(reference: float, hottest: float) -> tuple[Law, ...]:
    """Laws linear in speed whose slope grows with temperature."""
    return (
        Law("linear in speed, linear in temperature", f"n * (1 + ({_less(reference)}) / 40)"),
        Law("linear in speed, exponential in temperature", f"n * exp(({_less(hottest)}) / scale)", (SCALE,)),
        Law("linear in speed, Arrhenius", f"n * exp(activation * (1 / {hottest + KELVIN:.8g} - 1 / (T + 273.15)))", (ACTIVATION,)),
    )


def _less(temperature: float) -> str:
    return f"T {'-' if temperature >= 0 else '+'} {abs(temperature):.6g}"


OF_SPEED = (Law("linear in speed", "n"), Law("power of speed", "n ** power", (POWER,)))


def laws(temperature: Array, share: Array, reference: float = REFERENCE) -> list[Law]:
    """The laws that tests at temperatures (n,) C and shares (n,) of the highest speed can tell;
    temperature counts from the `reference` (C)."""
    found = [Law("constant", "1.0")]
    hottest = float(temperature.max() if abs(temperature.max() - reference) > 1 else temperature.min())  # a law from the reference is nothing there
    thermal = of_temperature(reference, hottest) if np.ptp(temperature) > 1 else ()
    speed = OF_SPEED if np.ptp(share) > 0 else ()
    found += [*thermal, *speed]
    if thermal and speed:
        told = [law for law in (*of_both(reference, hottest), *thermal) if len(law.shape) + 1 < len(np.unique(temperature))]  # beside speed too
        found += [law for law in told if law.asks[1]]
        found += [Law(f"{t.name} and linear in speed", f"{t.expression} + of_speed * n", (*t.shape, ("of_speed", "1", 0.0, (-20.0, 20.0)))) for t in told if not (t.asks[1] or t.is_step)]
    return found + [replace(law, name=f"{law.name}, and a constant", has_offset=True) for law in found[1:]]


@dataclass(frozen=True, eq=False)
class Fitted:
    """A law fitted: `size`, `offset` (in sizes; 0 of a law without) and shape values with standard errors; chi2
    in how many `tests`, in which what it depends on has so many different `places`, and the number of parameters."""

    law: Law
    values: Array  # size, offset, shape...
    sd: Array
    chi2: float
    tests: int
    places: int
    count: int

    @property
    def tested(self) -> bool:
        """Whether there are more tests than parameters, and more places: else a law fits whatever changes from one to the other."""
        return self.count < self.tests and (self.count < self.places or not any(self.law.asks))

    @property
    def criterion(self) -> float:
        """The Bayesian information criterion; smaller is better."""
        return self.chi2 + self.count * float(np.log(self.tests))

    @property
    def refuted(self) -> bool:
        """By chi2; what is not tested counts as refuted too."""
        return not self.tested or bool(chdtrc(self.tests - self.count, self.chi2) < REFUTED)


def fit_law(law: Law, temperature: Array, share: Array, change: Array, white: Array) -> Fitted | None:
    """Least squares in size, size times offset and shape, the first two linear; None where there are more parameters
    than tests, or no size is best. `white` (n, n) makes errors of `change` (n,) independent and of unit variance."""
    offset = law.has_offset
    count = 1 + offset + len(law.shape)
    places = len(np.unique(np.stack([temperature * law.asks[0], share * law.asks[1]]), axis=1).T)
    if count > (places if any(law.asks) else len(change)):
        return None
    best: Fitted | None = None
    for begin in _starts(law, temperature):

        def linear(shape: Array) -> tuple[Any, Array]:
            columns = [law(temperature, share, shape)] + ([np.ones_like(change)] if offset else [])
            a = white @ np.stack(columns, axis=1)
            found = np.linalg.lstsq(a, white @ change, rcond=None)[0]
            return found, a @ found - white @ change

        low, high = ([s[3][k] for s in law.shape] for k in (0, 1))
        shape = begin
        if law.shape and not law.is_step:
            shape = least_squares(lambda v: linear(v)[1], begin, bounds=(low, high)).x
        amplitude, residual = linear(shape)
        squares = float(residual @ residual)
        if amplitude[0] != 0.0 and (best is None or squares < best.chi2):
            values = np.array([amplitude[0], amplitude[1] / amplitude[0] if offset else 0.0, *shape])
            best = Fitted(law, values, _errors(law, values, offset, temperature, share, white), squares, len(change), places, count)
    return best


def ranked(found: Sequence[Fitted]) -> list[Fitted]:
    """By the criterion, the best first; laws with as many parameters as tests, which fit whatever
    the tests are, only where all others are refuted."""
    tested = [f for f in found if f.tested]
    return sorted(found if all(f.refuted for f in tested) else tested, key=lambda f: f.criterion)


def _starts(law: Law, temperature: Array) -> list[Array]:
    if not law.shape:
        return [np.zeros(0)]
    start = np.array([s[2] for s in law.shape])
    places = [i for i, s in enumerate(law.shape) if s[0] in ("middle", "start")]
    if not places:
        return [start]
    every, place = np.unique(temperature), places[0]
    middles = np.clip((every[1:] + every[:-1]) / 2, *law.shape[place][3])
    return [np.where(np.arange(len(start)) == place, m, start) for m in middles] or [start]


def _errors(law: Law, values: Array, offset: bool, temperature: Array, share: Array, white: Array) -> Array:
    def model(v: Array) -> Array:
        return v[0] * (law(temperature, share, v[2:]) + v[1])

    columns = []
    for i in range(len(values)):
        h = 1e-4 * max(abs(values[i]), 1e-3)
        step = values + h * (np.arange(len(values)) == i)
        columns.append((model(step) - model(values)) / h)
    columns[1] = columns[1] if offset else np.zeros_like(temperature)
    a = white @ np.stack(columns, axis=1)
    return np.sqrt(np.maximum(np.diag(np.linalg.pinv(a.T @ a)), 0.0))
