"""Parts short of chamber temperature: the standing part, bolted to a fixture that has not soaked,
has risen less than the turning part in the air."""

from __future__ import annotations

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import RINGS, Effect, Parameter, Values
from thermospindle.sim.effects.lag import EQUATION, held_back, left_after, nominal_soak


def temperatures(spindle: Spindle, condition: Condition, values: Values, by_region: dict[str, float]) -> dict[str, float]:
    return held_back(spindle, left_after(condition, values["standing_share"], values), by_region, turning=False)


EFFECT = Effect(
    name="fixture_lag",
    title="The fixture holds the standing part back from chamber temperature",
    equation=f"T_standing = T_ref + (1 - s) (T - T_ref); {EQUATION.format(share='standing_share')}, the fixture and what is bolted to it",
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
        nominal_soak("standing_share"),
    ),
    sees=(
        "the turning rings are warmer than the standing ones in a hot chamber, at rest as well as turning: where outer rings turn preload is lost beyond "
        "what expansion takes, where inner ones do it is gained; nothing at the reference temperature"
    ),
    resembles=("soak_lag", "expansion_mismatch", "thermometer_error", "clearance_opening"),
    valid="each part at one temperature, balls at the mean of their rings'; the turning part has the chamber's temperature",
    temperatures=temperatures,
    acts_on=(RINGS,),
)
