"""A part that has not soaked: what effects of a lag share."""

from __future__ import annotations

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import Parameter, Values

EQUATION = "s = {share}, or after a told soak time t s = exp(-t / tau) with tau = nominal_soak / ln(1 / {share}): Newton's law of cooling of a lumped body"


def left_after(condition: Condition, first: float, values: Values) -> float:
    """Share of a rise that is missing after a condition's soak time, if `first` is after the
    nominal one; `first` itself where no soak time is told."""
    if first == 0.0 or not np.isfinite(condition.soak_time):
        return first
    return float(first ** (condition.soak_time / values["nominal_soak"]))


def held_back(spindle: Spindle, missing: float, by_region: dict[str, float], *, turning: bool) -> dict[str, float]:
    """Temperatures (C) where the turning part, or all that stands, lacks the share `missing` of its
    rise over the reference; the same object where none is."""
    if missing == 0.0:
        return by_region
    reference = spindle.reference_temperature
    behind = {g.name for g in spindle.regions if (g.part == "rotating") == turning}
    return {name: t - missing * (t - reference) if name in behind else t for name, t in by_region.items()}


def nominal_soak(share: str) -> Parameter:
    """The soak time after which the share so called is missing."""
    return Parameter(
        "nominal_soak",
        "s",
        neutral=2700.0,
        typical=2700.0,
        prior_sd=900.0,
        limits=(60.0, 86400.0),
        meaning=f"soak time after which {share} is missing; matters only in tests that tell their soak time",
        source="assumed: three quarters of an hour, a usual soak of a small spindle",
    )
