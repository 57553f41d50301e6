"""A harder hammer meets a softer bearing: the describing function of the Hertz contact.

A ball under deformation d0 that vibrates by x cos(theta) answers with K (d0 + x cos(theta))^1.5, and nothing where it lifts off.
Its first harmonic over x is the stiffness that vibration sees. Expanding in a = x / d0,

    k(a) / k(0) = 2 / (1.5 pi a) int_0^pi (1 + a cos t)^1.5 cos t dt = 1 - a^2 / 32 - ...,

since the cubic term of (1 + e)^1.5 is -1/16 e^3 and cos^3 has 3/4 of a first harmonic: 1/16 3/4 / 1.5 = 1/32. The mean
deformation stays: the two rows of a rigid pair push their mean forces against each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.row import reference_deformation
from thermospindle.model.machine import Bearing, Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, scale_parameter

COEFFICIENT = 1 / 32
"""Of a^2 in the small-amplitude law."""

NODES = np.pi * (np.arange(256) + 0.5) / 256
COSINE = np.cos(NODES)


def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    scale = values["scale"]
    if scale == 0.0 or condition.level == 0.0:
        return state
    force, bearings = condition.level / len(state.bearings), []
    for b, drawn in zip(state.bearings, spindle.bearings, strict=True):
        mounted = reference_amplitude(spindle, drawn, b, force)
        bearings.append(_softened(b, scale * mounted * (amplitude(b, force) / mounted) ** values["softness_power"]))
    return replace(state, bearings=tuple(bearings))


def amplitude(b: BearingState, force: float) -> float:
    """Ball deformation (m) under an axial force (N) on one bearing, quasi-static: force / (n sin(angle)) over the ball stiffness."""
    if b.deformation <= 0:
        return 0.0
    return force / (b.row.balls * np.sin(b.contact_angle) * b.ball_stiffness)


def reference_amplitude(spindle: Spindle, drawn: Bearing, b: BearingState, force: float) -> float:
    """The same in the state in which the pair was mounted."""
    stiffness = 1.5 * b.row.constant * reference_deformation(spindle, drawn) ** 0.5
    return float(force / (drawn.balls * np.sin(drawn.contact_angle) * stiffness))


def describing_function(relative: float) -> float:
    """k(a) / k(0) at the relative amplitude a = x / d0, by the midpoint rule, lift-off included."""
    if abs(relative) < 1e-4:
        return 1 - COEFFICIENT * relative**2
    force = np.maximum(1 + relative * COSINE, 0.0) ** 1.5
    return float(2 / (1.5 * relative) * np.mean(force * COSINE))


def _softened(b: BearingState, ball_amplitude: float) -> BearingState:
    if ball_amplitude == 0.0:
        return b
    factor = describing_function(ball_amplitude / b.deformation)
    return replace(b, stiffness=factor * b.stiffness, damping=factor * b.damping)


EFFECT = Effect(
    name="hertz_amplitude",
    title="Hammer level softens the Hertz contacts",
    equation=(
        "K -> K k(a), k(a) = 2 / (1.5 pi a) int_0^pi max(1 + a cos t, 0)^1.5 cos t dt = 1 - a^2 / 32 - ..., "
        "a = scale (level / bearings) / (n sin(alpha) k_ball d0): the peak force, shared by the ball rows, as a static axial load, times "
        "(c_ref / c)^(1 - softness_power) with c = 1 / (n sin(alpha) k_ball), where mass and damping rather than contacts limit the motion "
        "(harmonic balance: Nayfeh & Mook, Nonlinear Oscillations, 1979, ch. 2)"
    ),
    parameters=(
        scale_parameter(
            typical=1.0,
            prior_sd=0.7,
            limits=(0.0, 5.0),
            meaning="ball vibration amplitude over the static deformation that the hammer's peak force would make",
            source="below 1 by the blow's shortness and the decay over the record, above 1 by resonance; set by the rig",
        ),
        Parameter(
            "softness_power",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="how the amplitude follows the compliance of the contacts as temperature changes it: 1 in proportion, 0 not at all",
            source="1 for a slow push; at resonance the amplitude is the blow over mass and damping",
        ),
    ),
    sees="frequencies of bearing modes fall with the square of the hammer's level and most where preload is low; soft hits agree",
    resembles=("preload_loss", "bond_softening", "bearing_misalignment"),
    valid=(
        "one amplitude for all balls (axial motion; across the axis the small-amplitude coefficient is 3/4 of it); a below 1, "
        "beyond which balls lift off and modes are no longer well separated lines"
    ),
    pair=pair,
    acts_on=(ROWS,),
)
