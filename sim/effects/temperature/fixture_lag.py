"""Parts short of chamber temperature: the standing part, bolted to a fixture that has not soaked, has risen less than the turning part in the air."""

from __future__ import annotations

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, SECTION, Effect, Parameter, Values
from thermospindle.sim.effects.temperature.soak_lag import left_after


def temperatures(spindle: Spindle, condition: Condition, values: Values, by_region: dict[str, float]) -> dict[str, float]:
    missing = left_after(condition, values["standing_share"], values["nominal_soak"])
    if missing == 0.0:
        return by_region
    reference = spindle.reference_temperature
    standing = {g.name for g in spindle.regions if g.part != "rotating"}
    return {name: t - missing * (t - reference) if name in standing else t for name, t in by_region.items()}


EFFECT = Effect(
    name="fixture_lag",
    title="The fixture holds the standing part back from chamber temperature",
    equation=(
        "T_standing = T_ref + (1 - s) (T - T_ref); s = standing_share, or after a told soak time t s = exp(-t / tau) with "
        "tau = nominal_soak / ln(1 / standing_share): Newton's law of cooling of a lumped body, the fixture and what is bolted to it"
    ),
    parameters=(
        Parameter(
            "standing_share",
            "1",
            neutral=0.0,
            typical=0.1,
            prior_sd=0.1,
            limits=(0.0, 0.9),
            meaning="share of the standing part's temperature rise that is missing after the nominal soak",
            source="assumed: a fixture of some kilograms of steel in still air has a time constant of hours, the turning part one of half an hour",
        ),
        Parameter(
            "nominal_soak",
            "s",
            neutral=2700.0,
            typical=2700.0,
            prior_sd=900.0,
            limits=(60.0, 86400.0),
            meaning="soak time after which standing_share is missing; matters only in tests that tell their soak time",
            source="assumed: three quarters of an hour, a usual soak of a small spindle",
        ),
    ),
    sees=(
        "the turning rings are warmer than the standing ones in a hot chamber, at rest as well as turning: where outer rings turn preload is lost beyond "
        "what expansion takes, where inner ones do it is gained; nothing at the reference temperature"
    ),
    resembles=("soak_lag", "expansion_mismatch", "thermometer_error", "clearance_opening"),
    valid="each part at one temperature, balls at the mean of their rings'; the turning part has the chamber's temperature",
    temperatures=temperatures,
    acts_on=(ROWS, SECTION),
)
