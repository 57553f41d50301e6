"""Parts short of chamber temperature: the rotating part, cooled by air only, has risen less than the shaft."""

from __future__ import annotations

import numpy as np

from model.machine import Condition, Spindle
from sim.effect import Effect, Parameter, Values


def temperatures(spindle: Spindle, condition: Condition, values: Values, by_region: dict[str, float]) -> dict[str, float]:
    missing = share(condition, values)
    if missing == 0.0:
        return by_region
    reference = spindle.reference_temperature
    turning = {g.name for g in spindle.regions if g.part == "rotating"}
    return {name: t - missing * (t - reference) if name in turning else t for name, t in by_region.items()}


def share(condition: Condition, values: Values) -> float:
    """Share of the rotating part's rise that is missing; `hub_share` itself where no soak time is told."""
    first = values["hub_share"]
    if first == 0.0 or not np.isfinite(condition.soak_time):
        return first
    return float(first ** (condition.soak_time / values["nominal_soak"]))


EFFECT = Effect(
    name="soak_lag",
    title="The hub has not reached chamber temperature",
    equation=(
        "T_rotating = T_ref + (1 - s) (T - T_ref); s = hub_share, or after a told soak time t s = exp(-t / tau) with "
        "tau = nominal_soak / ln(1 / hub_share): Newton's law of cooling of a lumped body"
    ),
    parameters=(
        Parameter(
            "hub_share",
            "1",
            neutral=0.0,
            typical=0.25,
            prior_sd=0.15,
            limits=(0.0, 0.9),
            meaning="share of the rotating part's temperature rise that is missing after the nominal soak",
            source="assumed: a hub behind air gaps and two balls' width of steel, 45 minutes into a 30 minute time constant",
        ),
        Parameter(
            "nominal_soak",
            "s",
            neutral=2700.0,
            typical=2700.0,
            prior_sd=900.0,
            limits=(60.0, 86400.0),
            meaning="soak time after which hub_share is missing; matters only in tests that tell their soak time",
            source="assumed: three quarters of an hour, a usual soak of a small spindle",
        ),
    ),
    sees=(
        "bearing modes fall less from cold to hot than computed, at rest as well as turning, and the upper bearing's modes as "
        "much as the lower's; nothing at the reference temperature"
    ),
    resembles=("expansion_mismatch", "loose_inserts", "constant_force_preload", "preload_loss", "clearance_opening"),
    valid="the rotating part is isothermal (Biot number far below 1) and the stationary part has the chamber's temperature",
    temperatures=temperatures,
)
