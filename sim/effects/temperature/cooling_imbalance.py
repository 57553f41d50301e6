"""The jacket cools the housing and not the shaft: at speed the standing parts are colder than the turning ones between them."""

from __future__ import annotations

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import RINGS, Effect, Parameter, Values
from thermospindle.sim.effects.roles import turning_ring


def temperatures(spindle: Spindle, condition: Condition, values: Values, by_region: dict[str, float]) -> dict[str, float]:
    """Standing regions colder, turning ones warmer, each by half the difference at the condition's speed."""
    if values["difference"] == 0.0 or condition.speed == 0.0:
        return by_region
    apart = values["difference"] * abs(condition.speed / spindle.nominal_speed) ** values["exponent"]
    part = {g.name: g.part for g in spindle.regions}
    return {name: t + (apart / 2 if part[name] == "rotating" else -apart / 2) for name, t in by_region.items()}


def idle(spindle: Spindle) -> str | None:
    inner = all(turning_ring(spindle, b) == "inner" for b in spindle.ringed)
    return None if inner else "its outer rings turn, and no housing round them is cooled"


EFFECT = Effect(
    name="cooling_imbalance",
    title="A cooled housing round a warm shaft",
    equation=(
        "T -> T + D / 2 in turning regions, T - D / 2 in standing ones, D = difference (speed / nominal speed)^exponent: friction heats both rings, "
        "a jacket takes it from the outer ones (Bossmanns & Tu, Int. J. Mach. Tools Manuf. 39, 1999, 1345: power flow in motor spindles)"
    ),
    parameters=(
        Parameter(
            "difference", "K", 0.0, 5.0, 5.0, (-40.0, 40.0),
            "shaft and inner rings above housing and outer rings at the nominal speed",
            "5 to 10 K in cooled spindles with oil-air lubrication (Bossmanns & Tu 1999)",
        ),
        Parameter(
            "exponent", "1", 1.5, 1.5, 0.3, (0.5, 3.0),
            "how it grows with speed", "Palmgren's friction torque goes with speed^(2/3), so its heat with speed^(5/3)",
        ),
    ),
    sees="rigid sets gain preload with speed, beyond what centrifugal force of the balls does; at rest nothing",
    resembles=("thermal_gradient", "soak_lag", "tandem_sharing"),
    valid="inner rings turning; each part at one temperature; steady state",
    temperatures=temperatures,
    acts_on=(RINGS,),
    idle=idle,
)  # fmt: skip
