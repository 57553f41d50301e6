"""The lubricant's film lifts the balls off the races: each ball counts as thicker by the films on its two sides, which also give a little."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.bearing.hertz import race_contact
from thermospindle.model.bearing.pair import PairState
from thermospindle.model.bearing.row import relative_speed
from thermospindle.model.machine import Bearing, Condition, RingMotion, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, scale_parameter

LOAD_POWER = 0.067  # h ~ W^-0.067 (Hamrock & Dowson 1977)
PRESSURE_VISCOSITY = 22e-9  # 1/Pa, mineral oils 18 to 26 per GPa (Hamrock & Dowson, *Ball Bearing Lubrication*, 1981)
OIL_DENSITY = 890.0  # kg/m3, mineral oil at 15 C (Harris, *Rolling Bearing Analysis*, 2001); turns kinematic into dynamic viscosity


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    wedging = values["scale"] * values["wedge"]
    if wedging == 0.0 or condition.speed == 0.0:
        return by_bearing
    thicker = {}
    for b in spindle.bearings:
        motion = by_bearing[b.name]
        film = sum(films(spindle, b, relative_speed(spindle, b, condition.speed), motion.temperature))
        thicker[b.name] = replace(motion, ball_strain=motion.ball_strain + wedging * film / b.ball_diameter)
    return by_bearing | thicker


def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    """The films' own compliance beside that of the contacts of every ball, and its loss.

    h ~ Q^-0.067 gives 0.067 h / Q where Hertz gives 2 delta / (3 Q): the share p = 0.1005 h / delta, for all motions alike.
    """
    scale = values["scale"]
    if scale == 0.0 or condition.speed == 0.0:
        return state
    omega = 2 * np.pi * spindle.structure.damping_frequency
    bearings = []
    for b, drawn in zip(state.bearings, spindle.bearings, strict=True):
        if not b.in_contact:
            bearings.append(b)
            continue
        film = scale * sum(films(spindle, drawn, relative_speed(spindle, drawn, condition.speed), condition.temperature))
        p = 1.5 * LOAD_POWER * film / b.deformation
        damping = b.damping / (1 + p) ** 2 + values["loss_factor"] / omega * p / (1 + p) ** 2 * b.stiffness
        bearings.append(replace(b, stiffness=b.stiffness / (1 + p), damping=damping))
    return replace(state, bearings=tuple(bearings))


def films(
    spindle: Spindle, b: Bearing, speed: float, temperature: float, pressure_viscosity: float = PRESSURE_VISCOSITY
) -> tuple[float, float]:
    """Central film (m) at the inner and the outer race, of a fully flooded contact under the
    reference preload; `speed` (rad/s) of the rings against each other."""
    ball, ring = (
        (spindle.materials[name].youngs_modulus(temperature), spindle.materials[name].poisson_ratio)
        for name in (b.ball_material, b.ring_material)
    )
    viscosity = OIL_DENSITY * spindle.thermal.friction.viscosity(temperature)
    gamma = b.ball_diameter * np.cos(b.contact_angle) / b.pitch_diameter
    load = b.preload / (b.balls * np.sin(b.contact_angle))
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
    return float(2.69 * radius * u**0.67 * g**0.53 * w**-LOAD_POWER * (1 - 0.61 * np.exp(-0.73 * ellipticity)))


EFFECT = Effect(
    name="lubricant_film",
    title="Elastohydrodynamic film between balls and races",
    equation=(
        "h_c / R_x = 2.69 U^0.67 G^0.53 W^-0.067 (1 - 0.61 exp(-0.73 k)), U = eta u / (E' R_x), G = xi E', W = Q / (E' R_x^2) "
        "(Hamrock & Dowson 1977); u = speed d_m (1 - gamma^2) / 4; unloaded distance less by wedge scale h, h = h_inner + h_outer; "
        "K -> K / (1 + p), D -> (D + (eta / omega_0) p K) / (1 + p)^2, p = 1.5 0.067 scale h / delta, omega_0 = 2 pi damping_frequency"
    ),
    parameters=(
        scale_parameter(
            typical=0.3,
            prior_sd=0.3,
            limits=(0.0, 2.5),
            meaning="film thickness in units of the fully flooded one of the scene's viscosity",
            source="grease starves its contacts to about 0.3 to 0.7 of flooded (Lugt, Grease Lubrication in Rolling Bearings, 2013)",
        ),
        Parameter(
            "wedge",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="share of the film that loads the pair: 1 between rings that stay where they are, 0 where a ring gives way",
            source="rings are bonded (paper); a spring preload would give way",
        ),
        Parameter(
            "loss_factor",
            "1",
            neutral=0.3,
            typical=0.3,
            prior_sd=0.3,
            limits=(0.0, 2.0),
            meaning="loss factor of the films' compliance",
            source="assumed; films damp a bearing little (Wijnant, Wensing & van Nijen 1999, J. Sound Vib. 222, 579)",
        ),
    ),
    sees=(
        "only at speed: bearings load up as speed to the power 0.67, most when cold and viscous; bearing modes rise with speed "
        "beside their gyroscopic split; where rings give way they fall a little instead, and losses rise"
    ),
    resembles=("thermal_gradient", "ring_growth", "ball_inertia"),
    valid=(
        "isothermal, smooth, fully developed film; load of the reference state (the film follows load by a power of -0.067 only); "
        "its compliance is that of slow changes of load, at the condition's temperature"
    ),
    motions=motions,
    pair=pair,
    acts_on=(ROWS,),
)
