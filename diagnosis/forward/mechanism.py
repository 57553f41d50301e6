"""A mechanism and its law: what is changed, where, and how much of it is expected over temperature, speed, level and time.

The size of an effect is its first parameter. Its law is what the effect's formula makes of one size at every condition. A law is a prior,
not a gospel: the size that acts in test t is a_t = a (1 + r_t), with departures r that are continuous over the conditions (an
exponential covariance, Rasmussen & Williams, *Gaussian Processes*, 2006, Eq. 4.18) and whose size is learned. Where a law gives nothing it
goes on giving nothing. Beyond a limit of its size an effect continues in a straight line, so that sizes may scatter about zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from thermospindle.model.machine import Condition
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.effects.effect import Effect, Parameter

MEMORY_K = 40.0  # K over which departures from a law are alike
MEMORY_RPM = 6000.0
MEMORY_LEVEL = 2.0  # of ln level
MEMORY_SOAK = 2.0  # of ln soak time
REFERENCE_DEPARTURE = 0.5  # of the size, in the fit itself; evidence takes others into account
REFERENCE_WIDTH = 2.0  # prior standard deviations of the size, likewise


@dataclass(frozen=True, eq=False)
class Mechanism:
    """An effect with its choices made; `free` for free-form models, which have no law and no name in the catalogue."""

    effect: Effect
    choices: Mapping[str, float]
    shape: tuple[Parameter, ...]
    free: bool = False

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def size(self) -> Parameter:
        return self.effect.parameters[0]

    def values(self, size: float, shape: Sequence[float]) -> dict[str, float]:
        """Parameter values of the effect for a size and shape parameters, in their units."""
        return {self.size.name: size, **self.choices, **{p.name: v for p, v in zip(self.shape, shape, strict=True)}}


def variants(effect: Effect) -> list[Mechanism]:
    """One mechanism for every combination of what an effect has to choose from; and, of each share between two ideal cases, both of these beside
    what lies between: a law that is all constant, or all thermal, has nothing to choose."""
    chosen = [p for p in effect.parameters[1:] if p.choices]
    shape = tuple(p for p in effect.parameters[1:] if not p.choices and p.prior_sd > 0)
    found = []
    for row in product(*[p.choices for p in chosen]):
        choices = dict(zip([p.name for p in chosen], row, strict=True))
        found.append(Mechanism(effect, choices, shape))
        for share in [p for p in shape if p.limits == (0.0, 1.0)] if len(chosen) == 0 else []:
            others = tuple(p for p in shape if p is not share)
            found += [Mechanism(effect, choices | {share.name: end}, others) for end in (0.0, 1.0)]
    return found


def likeness(conditions: Sequence[Condition]) -> Array:
    """Correlation (n, n) of departures from a law between tests: 1 where conditions agree, falling with their distance."""
    t = np.array([c.temperature for c in conditions]) / MEMORY_K
    n = np.array([c.speed for c in conditions]) / (MEMORY_RPM * RPM)
    level = np.log(np.maximum([c.level for c in conditions], 0.1)) / MEMORY_LEVEL
    soak = np.log(np.clip([c.soak_time for c in conditions], 60.0, 1e6)) / MEMORY_SOAK
    distance = sum(np.abs(v[:, None] - v[None, :]) for v in (t, n, level, soak))
    return np.exp(-distance)


def size_covariance(conditions: Sequence[Condition], width: float, departure: float) -> Array:
    """Prior covariance (n, n) of the sizes in all tests: `width`^2 (1 + `departure`^2 likeness), with a little of each test's own."""
    n = len(conditions)
    return width**2 * (np.ones((n, n)) + departure**2 * (0.98 * likeness(conditions) + 0.02 * np.eye(n)) + 1e-9 * np.eye(n))
