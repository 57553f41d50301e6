"""The base does not stand as stiffly as drawn: a gasket, a foot or a screw joint in series with the mount, softening when warm."""

from __future__ import annotations

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import joints, lacking, with_stiffness

RISE = 40.0
"""Temperature rise (K) at which `compliance` is told."""


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    added = compliance(spindle, condition, values)
    if added == 0.0 or values["compliance"] == 0.0:
        return spindle
    return with_stiffness(spindle, dict.fromkeys(joints(spindle, "mount"), 1 / (1 + added)))


def compliance(spindle: Spindle, condition: Condition, values: Values) -> float:
    """Compliance added at a condition, in units of the mount's own."""
    warm, share = (condition.temperature - spindle.reference_temperature) / RISE, values["thermal_share"]
    return float((1 + values["compliance"]) ** (1 - share + share * warm)) - 1


def idle(spindle: Spindle) -> str | None:
    return None if joints(spindle, "mount") else lacking("joint", "mount")


EFFECT = Effect(
    name="mount_compliance",
    title="Added compliance under the base, at all temperatures or when warm",
    equation=(
        "1/k(T) = (1/k) (1 + compliance)^(1 - w + w (T - T_ref) / 40 K), w = thermal_share: springs in series (w = 0); "
        "for small values d ln k / dT = -compliance w / 40 K"
    ),
    parameters=(
        Parameter(
            "compliance",
            "1",
            neutral=0.0,
            typical=0.05,
            prior_sd=0.05,
            limits=(-0.8, 5.0),
            meaning="compliance added 40 K above the reference temperature over the mount's own; negative stiffens",
            source="assumed: screwed feet and gaskets add some percent to a machine's footing; polymers soften by 0.5 %/K and more",
        ),
        Parameter(
            "thermal_share",
            "1",
            neutral=0.5,
            typical=0.5,
            prior_sd=0.4,
            limits=(0.0, 1.0),
            meaning="share of the added compliance that comes with temperature; 0 is the same at all temperatures",
            source="assumed: half until a test at a second temperature says else",
        ),
    ),
    sees="modes of the base on its mount move, in proportion to their strain energy there; bearing modes hardly, at any speed alike",
    resembles=("plate_prestress", "modulus_softening", "sensor_mass", "flange_fit_loosening"),
    valid="added part without mass and with the mount's own loss factor",
    spindle=spindle,
    idle=idle,
)
