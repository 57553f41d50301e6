"""The lubricant's film lifts the balls off the races: each ball counts as thicker by the films on its two sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.hertz import race_contact
from model.machine import Bearing, Condition, RingMotion, Spindle
from sim.effect import Effect, Parameter, Values, scale_parameter

OIL_DENSITY = 890.0  # kg/m3, mineral oil at 15 C (Harris, *Rolling Bearing Analysis*, 2001); turns kinematic into dynamic viscosity


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    scale = values["scale"]
    if scale == 0.0 or condition.speed == 0.0:
        return by_bearing
    thicker = {}
    for b in spindle.bearings:
        motion = by_bearing[b.name]
        inner, outer = films(spindle, b, condition.speed, motion.temperature, values["pressure_viscosity"] * 1e-9)
        thicker[b.name] = replace(motion, ball_strain=motion.ball_strain + scale * (inner + outer) / b.ball_diameter)
    return by_bearing | thicker


def films(spindle: Spindle, b: Bearing, speed: float, temperature: float, pressure_viscosity: float) -> tuple[float, float]:
    """Central film (m) at the inner and the outer race, of a fully flooded contact under the reference preload."""
    ball, ring = (
        (spindle.materials[name].youngs_modulus(temperature), spindle.materials[name].poisson_ratio)
        for name in (b.ball_material, b.ring_material)
    )
    viscosity = OIL_DENSITY * spindle.thermal.friction.viscosity(temperature)
    gamma = b.ball_diameter * np.cos(b.contact_angle) / b.pitch_diameter
    load = spindle.pair.preload / (b.balls * np.sin(b.contact_angle))
    found = []
    for conformity, inner in ((b.inner_conformity, True), (b.outer_conformity, False)):
        contact = race_contact(b.ball_diameter, conformity, b.pitch_diameter, b.contact_angle, inner, ball, ring)
        radius = b.ball_diameter / 2 * (1 - gamma if inner else 1 + gamma)
        solid = radius, contact.effective_modulus, contact.ellipticity
        found.append(central_film(*solid, viscosity, entrainment(b, speed), pressure_viscosity, load))
    return found[0], found[1]


def entrainment(b: Bearing, speed: float) -> float:
    """Mean velocity (m/s) of the two surfaces in either contact when the rings turn at `speed` (rad/s) against each other."""
    gamma = b.ball_diameter * np.cos(b.contact_angle) / b.pitch_diameter
    return float(abs(speed) * b.pitch_diameter / 4 * (1 - gamma**2))


def central_film(
    radius: float, modulus: float, ellipticity: float, viscosity: float, speed: float, pressure_viscosity: float, load: float
) -> float:
    """Central film thickness (m): Hamrock & Dowson, Isothermal elastohydrodynamic lubrication of point contacts, part III, 1977.

    `radius` along rolling (m), `modulus` E' = 2 / sum (1 - nu^2)/E (Pa), `viscosity` (Pa s), `speed` mean of the surfaces'
    (m/s), `pressure_viscosity` (1/Pa), `load` (N).
    """
    u = viscosity * speed / (modulus * radius)
    g = pressure_viscosity * modulus
    w = load / (modulus * radius**2)
    return float(2.69 * radius * u**0.67 * g**0.53 * w**-0.067 * (1 - 0.61 * np.exp(-0.73 * ellipticity)))


EFFECT = Effect(
    name="lubricant_film",
    title="Elastohydrodynamic film between balls and races",
    equation=(
        "h_c / R_x = 2.69 U^0.67 G^0.53 W^-0.067 (1 - 0.61 exp(-0.73 k)), U = eta u / (E' R_x), G = xi E', W = Q / (E' R_x^2) "
        "(Hamrock & Dowson 1977); u = speed d_m (1 - gamma^2) / 4; unloaded distance less by scale (h_inner + h_outer)"
    ),
    parameters=(
        scale_parameter(
            typical=0.3,
            prior_sd=0.3,
            limits=(0.0, 1.5),
            meaning="film thickness in units of the fully flooded one of the scene's viscosity",
            source="grease starves its contacts to about 0.3 to 0.7 of flooded (Lugt, Grease Lubrication in Rolling Bearings, 2013)",
        ),
        Parameter(
            "pressure_viscosity",
            "1/GPa",
            neutral=22.0,
            typical=22.0,
            prior_sd=4.0,
            limits=(5.0, 45.0),
            meaning="pressure-viscosity coefficient of the oil",
            source="mineral oils 18 to 26 per GPa (Hamrock & Dowson, Ball Bearing Lubrication, 1981)",
        ),
    ),
    sees=(
        "only at speed: bearings load up as speed to the power 0.67, most when cold and viscous; bearing modes rise with speed "
        "beside their gyroscopic split"
    ),
    resembles=("thermal_gradient", "ring_growth", "ball_inertia"),
    valid=(
        "isothermal, smooth, fully developed film; load of the reference state (the film follows load by a power of -0.067 only); "
        "the film's own compliance, 0.067 h / Q, is left out: some percent of Hertz's for films below a third of a micrometre"
    ),
    motions=motions,
)
