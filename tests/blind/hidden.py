"""Hidden physics: a mechanism (what is changed) times a law over temperature and speed that is drawn anew for every campaign.

Written without a look at the catalogue of effects: nothing here is imported from `sim.effects`, and only the names of effects are
known. A mechanism says which names would be right answers to it, as far as names tell (`alike` measures it), and which element
changes; where a scene has none of these names it is outside every catalogue there. Sizes are drawn evenly in their logarithm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.blind.laws import CONSTANT, Law, Place, law
from thermospindle.model.machine import Spindle


@dataclass(frozen=True, eq=False)
class Hidden:
    """One hidden piece of physics with its law and size; `acts` by step of the chain (`world.STEPS`): (spindle, amount, state) -> state.

    `names` are the right answers, none for what is outside every catalogue; `element` what changes, for the free-form answer.
    """

    mechanism: str
    unit: str
    size: float
    law: Law
    names: tuple[str, ...]
    element: str
    acts: dict[str, Callable[[Spindle, float, Any], Any]] = field(repr=False)

    def amount(self, place: Place) -> float:
        return self.size * self.law(place)


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A generator of `Hidden`: sizes from `low` to `high` in `unit`, with `sign` or either (0);
    `constant` laws only, `drift` only, or `any`."""

    name: str
    unit: str
    low: float
    high: float
    names: tuple[str, ...]
    element: str
    acts: dict[str, Callable[[Spindle, float, Any], Any]] = field(repr=False)
    sign: int = 0
    laws: str = "drift"

    def drawn(self, random: np.random.Generator, places: Sequence[Place]) -> Hidden:
        constant = self.laws == "constant" or (self.laws == "any" and random.random() < 0.3)
        own = CONSTANT if constant else law(random, places)
        size = float(np.exp(random.uniform(np.log(self.low), np.log(self.high))))
        size *= self.sign or float(random.choice([-1, 1]))
        return Hidden(self.name, self.unit, size, own, self.names, self.element, self.acts)

    def of_size(self, share: float, own: Law = CONSTANT) -> Hidden:
        """With the size at `share` between low and high, its sign (or plus), and a given law."""
        size = self.low * (self.high / self.low) ** share * (self.sign or 1)
        return Hidden(self.name, self.unit, size, own, self.names, self.element, self.acts)
