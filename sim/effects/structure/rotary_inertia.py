"""The shaft's sections turn as it bends: rotary inertia, which an Euler-Bernoulli beam leaves out."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.beam import with_theory
from thermospindle.sim.effects.effect import SHAFT, Effect, Values, scale_parameter


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    if values["scale"] == 0.0:
        return spindle
    shares = {s.name: (s.shear, s.rotary + values["scale"] * (1 - s.rotary)) for s in spindle.structure.shafts}
    return replace(spindle, structure=with_theory(spindle.structure, spindle.materials, spindle.reference_temperature, shares))


def idle(spindle: Spindle) -> str | None:
    return "its flexible shafts have rotary inertia already" if all(s.rotary == 1.0 for s in spindle.structure.shafts) else None


EFFECT = Effect(
    name="rotary_inertia",
    title="Rotary inertia of the flexible shaft",
    equation=(
        "J of a node -> (s + scale (1 - s)) integral(rho I dz), polar 2 J, s what the scene's beam has, 0 without (Rayleigh, Theory of Sound, 1894, "
        "sec. 186); against Euler-Bernoulli d ln f = -(r k)^2 / 2, r = sqrt(I / A)"
    ),
    parameters=(
        scale_parameter(
            typical=1.0,
            prior_sd=0.5,
            limits=(0.0, 3.0),
            meaning="share of the section's rotary inertia that the scene's beam is short of",
            source="1 is the whole of it, by section and density; rings and sleeves on the shaft add to it",
        ),
    ),
    sees="bending modes of the shaft lie lower, the more so the higher they are, by a third of what shear does; at speed they split",
    resembles=("shear", "sensor_mass", "added_disk"),
    valid="wave lengths longer than the shaft is thick, as for all beams",
    spindle=spindle,
    acts_on=(SHAFT,),
    idle=idle,
    lasting=True,
)
