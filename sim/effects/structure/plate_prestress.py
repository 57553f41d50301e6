"""A base plate that cannot expand freely carries in-plane stress, which stiffens or softens it against bending."""

from __future__ import annotations

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import beyond, joints, lacking, with_stiffness
from thermospindle.sim.effects.structure.mount_compliance import RISE


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    axial = values["stiffening"] * beyond(condition.temperature - spindle.reference_temperature, values["play"]) / RISE
    if axial == 0.0:
        return spindle
    plates = joints(spindle, "plate")
    tilt = values["tilt_share"] * axial
    return with_stiffness(spindle, dict.fromkeys(plates, 1 + axial), dict.fromkeys(plates, 1 + tilt))


def idle(spindle: Spindle) -> str | None:
    return None if joints(spindle, "plate") else lacking("joint", "plate")


EFFECT = Effect(
    name="plate_prestress",
    title="Thermal stress in the base plate",
    equation=(
        "k = k_0 (1 + N / N_cr), N in-plane force per length (tension positive), N / N_cr = stiffening (T - T_ref -+ play) / 40 K for axial "
        "motion and tilt_share times that for tilts, 0 within the play; clamped disc N_cr = 14.68 D / a^2, with one nodal diameter 26.37 D / a^2, "
        "D = E t^3 / (12 (1 - nu^2)), held at its rim N = E t Delta_alpha Delta_T / (1 - nu) "
        "(Timoshenko & Gere, Theory of Elastic Stability, 1961)"
    ),
    parameters=(
        Parameter(
            "stiffening",
            "1",
            neutral=0.0,
            typical=0.03,
            prior_sd=0.02,
            limits=(-0.3, 0.3),
            meaning="relative change of the plate's axial stiffness 40 K above the reference: tension positive, compression negative",
            source=(
                "3 mm of aluminium, 30 mm in radius, fully held over 40 K: N / N_cr = -0.10 by the formulas, compression; a third of it where "
                "the frame expands too, and tension where it expands more than the plate: of either sign, the typical value as of the latter"
            ),
        ),
        Parameter(
            "tilt_share",
            "1",
            neutral=0.56,
            typical=0.56,
            prior_sd=0.2,
            limits=(0.0, 1.2),
            meaning="relative change of the plate's tilt stiffness over that of its axial one",
            source="14.68 / 26.37: buckling loads of a clamped disc without and with one nodal diameter",
        ),
        Parameter(
            "play",
            "K",
            neutral=0.0,
            typical=0.0,
            prior_sd=5.0,
            limits=(0.0, 35.0),
            meaning="change of temperature, up or down, that the screws' play takes before the plate is held",
            source="assumed: held from the start; 1 um of play in 30 mm of aluminium on steel is 3 K",
        ),
    ),
    sees="axial modes of the plate rise (tension) or fall with temperature against the model, rocking ones less; nothing at the reference",
    resembles=("mount_compliance", "modulus_softening", "flange_fit_loosening"),
    valid="far below the buckling load, linear in temperature beyond the play; the plate stays flat (bowing is another effect)",
    spindle=spindle,
    idle=idle,
)
