"""The base does not stand as stiffly as drawn: a gasket, a foot or a screw joint in series with the mount, softening when warm."""

from __future__ import annotations

from dataclasses import replace

from model.machine import Condition, Joint, Spindle
from sim.effect import Effect, Parameter, Values

RISE = 40.0
"""Temperature rise (K) at which `compliance` is told."""


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    added = compliance(spindle, condition, values)
    if added == 0.0 or values["compliance"] == 0.0:
        return spindle
    return with_stiffness(spindle, {j.name: 1 / (1 + added) for j in spindle.structure.joints if role(spindle, j) == "mount"})


def compliance(spindle: Spindle, condition: Condition, values: Values) -> float:
    """Compliance added at a condition, in units of the mount's own."""
    warm, share = (condition.temperature - spindle.reference_temperature) / RISE, values["thermal_share"]
    return float((1 + values["compliance"]) ** (1 - share + share * warm)) - 1


def role(spindle: Spindle, joint: Joint) -> str:
    """What a joint is: "flange" where it holds the body of the standing rings, else "mount" on the ground, else "plate"."""
    if spindle.standing.name in joint.bodies:
        return "flange"
    return "mount" if "ground" in joint.bodies else "plate"


def with_stiffness(spindle: Spindle, factor: dict[str, float], tilt: dict[str, float] | None = None) -> Spindle:
    """The spindle with the stiffness of the joints named in `factor` multiplied, that against tilt by `tilt` (the same by default).

    The damping ratio stays, so that damping follows stiffness.
    """
    tilt = factor if tilt is None else tilt
    joints = tuple(_scaled(j, factor[j.name], tilt[j.name]) if j.name in factor else j for j in spindle.structure.joints)
    return replace(spindle, structure=replace(spindle.structure, joints=joints))


def _scaled(joint: Joint, factor: float, tilt: float) -> Joint:
    x, y, z, tilt_x, tilt_y = joint.stiffness
    return replace(joint, stiffness=(factor * x, factor * y, factor * z, tilt * tilt_x, tilt * tilt_y))


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
)
