"""Ceramic balls instead of steel ones: stiffer, lighter, and hardly growing with temperature."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Material, Spindle
from thermospindle.model.material import Law
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values
from thermospindle.sim.effects.temperature.loose_inserts import blend

CERAMIC = Material(
    "silicon nitride",
    youngs_modulus=Law((20.0,), (310e9,)),
    poisson_ratio=0.27,
    thermal_expansion=Law((20.0,), (3.2e-6,)),
    density=3200.0,
    conductivity=30.0,
    heat_capacity=800.0,
)
"""Hot-pressed silicon nitride for rolling elements: Harris, *Rolling Bearing Analysis*, 4th ed. (2001); makers of balls give the same."""

NAME = "balls of mixed material"


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    share = values["share"]
    if share == 0.0:
        return spindle
    materials, bearings = dict(spindle.materials), []
    for b in spindle.bearings:
        name = f"{NAME} ({b.ball_material})"
        materials[name] = mixture(name, spindle.materials[b.ball_material], share)
        bearings.append(replace(b, ball_material=name))
    return replace(spindle, materials=materials, bearings=tuple(bearings))


def mixture(name: str, own: Material, share: float) -> Material:
    """`own` changed by `share` of the way to silicon nitride, constant by constant."""

    def between(a: float, b: float) -> float:
        return (1 - share) * a + share * b

    return Material(
        name,
        blend(own.youngs_modulus, CERAMIC.youngs_modulus, share),
        between(own.poisson_ratio, CERAMIC.poisson_ratio),
        blend(own.thermal_expansion, CERAMIC.thermal_expansion, share),
        between(own.density, CERAMIC.density),
        between(own.conductivity, CERAMIC.conductivity),
        between(own.heat_capacity, CERAMIC.heat_capacity),
    )


def idle(spindle: Spindle) -> str | None:
    """Of ceramic are balls that are as stiff and as light as it is, to a tenth."""
    balls = [spindle.materials[b.ball_material] for b in spindle.bearings]
    stiff = CERAMIC.youngs_modulus(spindle.reference_temperature)
    alike = (abs(m.density / CERAMIC.density - 1) < 0.1 and abs(m.youngs_modulus(spindle.reference_temperature) / stiff - 1) < 0.1 for m in balls)
    return "its balls are ceramic already" if all(alike) else None


EFFECT = Effect(
    name="ball_material",
    title="Ceramic (silicon nitride) balls instead of steel",
    equation=(
        "E, nu, alpha, rho of the balls = (1 - share) steel + share Si3N4 (310 GPa, 0.27, 3.2e-6/K, 3200 kg/m3); "
        "Hertz constant K ~ 2 / ((1 - nu_b^2)/E_b + (1 - nu_r^2)/E_r); ball growth alpha D (T - T_ref), Jang et al. 2003, Eqs. (3), (5)"
    ),
    parameters=(
        Parameter(
            "share",
            "1",
            neutral=0.0,
            typical=0.25,
            prior_sd=0.3,
            limits=(0.0, 1.0),
            meaning="share of the way from the drawing's ball material to silicon nitride; 1 is a hybrid bearing",
            source=(
                "0 or 1 as built, constants from Harris 2001; the typical value is what a small rigid pair bears over 40 K "
                "without unloading"
            ),
        ),
    ),
    sees=(
        "bearing modes a little higher at the reference temperature (K up by a tenth at equal preload) and falling further with "
        "temperature, as the balls no longer grow with the rings; a small rigidly preloaded pair may unload altogether"
    ),
    resembles=("expansion_mismatch", "clearance_opening", "preload_loss"),
    valid="mounted to the drawing's preload and loaded contact angle; shares between 0 and 1 only bridge the two materials",
    spindle=spindle,
    acts_on=(ROWS,),
    idle=idle,
)
