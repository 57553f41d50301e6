"""The shaft shears as it bends: what an Euler-Bernoulli beam leaves out, and a Timoshenko beam has."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.beam import with_theory
from thermospindle.sim.effects.effect import SHAFT, Effect, Values, scale_parameter


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    if values["scale"] == 0.0:
        return spindle
    shares = {s.name: (s.shear + values["scale"] * (1 - s.shear), s.rotary) for s in spindle.structure.shafts}
    return replace(spindle, structure=with_theory(spindle.structure, spindle.materials, spindle.reference_temperature, shares))


def idle(spindle: Spindle) -> str | None:
    return "its flexible shafts shear already" if all(s.shear == 1.0 for s in spindle.structure.shafts) else None


EFFECT = Effect(
    name="shear",
    title="Shear of the flexible shaft",
    equation=(
        "1 / k_lateral of a beam element -> l^3 / 12 EI + (s + scale (1 - s)) l / kappa G A, s what the scene's beam has, 0 without shear; kappa of "
        "Cowper, J. Appl. Mech. 33, 1966 (Timoshenko, Phil. Mag. 41, 1921); against Euler-Bernoulli d ln f = -(E / 2 kappa G) (r k)^2, r = sqrt(I / A)"
    ),
    parameters=(
        scale_parameter(
            typical=1.0,
            prior_sd=0.5,
            limits=(0.0, 3.0),
            meaning="share of the section's shear flexibility that the scene's beam is short of",
            source="1 is the whole of it, by section and Poisson's ratio; a shaft of many shrunk-on sleeves has more",
        ),
    ),
    sees="bending modes of the shaft lie lower, the more so the higher they are: with the square of the wave number; nothing changes with speed or temperature",
    resembles=("rotary_inertia", "sensor_mass", "housing_flexibility", "modulus_softening"),
    valid="wave lengths longer than the shaft is thick, as for all beams",
    spindle=spindle,
    acts_on=(SHAFT,),
    idle=idle,
    lasting=True,
)
