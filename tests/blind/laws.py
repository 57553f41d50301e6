"""Laws over temperature and speed, drawn anew for every campaign and nobody's: plain shapes (linear, power, exponential, Arrhenius,
sigmoid, step, their mixtures, constant), zero at 20 C and at rest unless constant, one at their largest over the tests of the campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Place = tuple[float, float]
"""Temperature (C) and speed over the nominal one."""
Shape = Callable[[float], float]
REFERENCE = 20.0  # C
RANGE = 40.0  # K, over which shapes are told


@dataclass(frozen=True, eq=False)
class Law:
    """`kind` in words; its value at a place is at most one in magnitude over the places of its campaign."""

    kind: str
    value: Callable[[Place], float]

    def __call__(self, place: Place) -> float:
        return self.value(place)


CONSTANT = Law("constant", lambda place: 1.0)


def shape(random: np.random.Generator, of_temperature: bool, simple: bool = False) -> tuple[str, Shape]:
    """A shape over x = (T - 20 C) / 40 K, or x = speed over the nominal one; zero at x = 0."""
    kinds = (
        ["linear", "power", "exponential", "sigmoid", "step"] + (["Arrhenius"] if of_temperature else []) + ([] if simple else ["mixture"])
    )
    kind = str(random.choice(kinds))
    if kind == "linear":
        return kind, lambda x: x
    if kind == "power":
        p = float(np.exp(random.uniform(np.log(0.4), np.log(3.0))))
        return f"power {p:.2f}", lambda x: float(np.sign(x) * abs(x) ** p)
    if kind == "exponential":
        b = float(random.choice([-1, 1]) * random.uniform(0.5, 4.0))
        return f"exponential {b:+.2f}", lambda x: float(np.expm1(b * x) / np.expm1(b))
    if kind == "Arrhenius":
        b = float(random.uniform(1000.0, 6000.0))
        return f"Arrhenius {b:.0f} K", lambda x: float(np.expm1(b * (1 / 293.15 - 1 / (293.15 + RANGE * x))))
    if kind in ("sigmoid", "step"):
        middle, width = random.uniform(0.25, 0.8), random.uniform(0.05, 0.25) if kind == "sigmoid" else 0.005
        return f"{kind} at {middle:.2f}", lambda x: float((np.tanh((x - middle) / width) - np.tanh(-middle / width)) / 2)
    share = random.uniform(0.2, 0.8)
    (one, f), (two, g) = shape(random, of_temperature, True), shape(random, of_temperature, True)
    return f"mixture of {one}, {two}", lambda x: share * f(x) / (abs(f(1.0)) or 1.0) + (1 - share) * g(x) / (abs(g(1.0)) or 1.0)


def law(random: np.random.Generator, places: Sequence[Place]) -> Law:
    """A random law that differs between the tests at `places`: of temperature in three of five, of speed in one, of both in one."""
    for _ in range(100):
        (name_t, of_t), (name_n, of_n) = shape(random, True), shape(random, False)
        kind = str(random.choice(["temperature", "temperature", "temperature", "speed", "both"]))
        product = bool(random.random() < 0.5)

        def raw(place: Place, kind=kind, product=product, of_t=of_t, of_n=of_n) -> float:
            t, n = of_t((place[0] - REFERENCE) / RANGE), of_n(place[1])
            if kind == "temperature":
                return t
            return n if kind == "speed" else n * (1 + t) if product else 0.5 * t + 0.5 * n

        values = np.array([raw(p) for p in places])
        largest = np.abs(values).max()
        if largest > 1e-3 and np.ptp(values) > 0.2 * largest:
            told = {"temperature": name_t, "speed": f"speed: {name_n}"}.get(kind, f"{name_t} {'x' if product else '+'} speed: {name_n}")
            return Law(told, lambda place, raw=raw, largest=largest: raw(place) / largest)
    raise ValueError("no law differs between these tests")
