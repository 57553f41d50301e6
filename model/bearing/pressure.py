"""Hertz pressure in the contacts of a bearing: the largest of its rolling elements', at the inner and the outer race.

Of an elliptic point contact p = 3 Q / (2 pi a b), of a line contact p = sqrt(Q rho / (pi l s)) with rho the sum of curvatures and
s the sum of (1 - nu^2) / E of both bodies (Harris, Rolling Bearing Analysis, 4th ed. 2001, ch. 6). Curvatures are those of the
drawing, which heat changes by a thousandth; rollers are pressed alike over their length, so that neither tilt nor ends are in it.
"""

from __future__ import annotations

import numpy as np

from thermospindle.model.bearing.definitions import Bearing, RollerBearing
from thermospindle.model.bearing.hertz import race_contact
from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.row import elastic
from thermospindle.model.machine import Spindle

OF_BALLS, OF_ROLLERS = 4200e6, 4000e6
"""Pa, which ISO 76 rates bearings by at rest: element and race together stay dented by a ten-thousandth of the element's diameter."""


def pressures(spindle: Spindle, state: PairState) -> dict[str, float]:
    """Largest contact pressure (Pa) of every bearing with rolling elements; 0 of one that is loose."""
    balls = {b.name: of_balls(spindle, b, state.bearing(b.name), state.condition.temperature) for b in spindle.bearings}
    return balls | {b.name: of_rollers(spindle, b, state.rollers[b.name].contact_force, state.condition.temperature) for b in spindle.roller_bearings}


def of_balls(spindle: Spindle, b: Bearing, state: BearingState, temperature: float) -> float:
    """Pa, of the most loaded ball; with the true ellipse, whatever load-deflection constant a catalogue tells."""
    materials = elastic(spindle, b, temperature)
    return max(
        race_contact(b.ball_diameter, conformity, b.pitch_diameter, angle, inner, *materials).pressure(force)
        for inner, conformity, angle, force in (
            (True, b.inner_conformity, state.contact_angle, state.contact_force),
            (False, b.outer_conformity, state.outer_contact_angle, state.outer_contact_force),
        )
    )


def of_rollers(spindle: Spindle, b: RollerBearing, force: float, temperature: float) -> float:
    """Pa, under `force` (N) on one roller; at the inner race, which curves the other way."""
    softness = sum((1 - m.poisson_ratio**2) / m.youngs_modulus(temperature) for m in (spindle.materials[b.roller_material], spindle.materials[b.ring_material]))
    curvature = 2 / b.roller_diameter / (1 - b.roller_diameter / b.pitch_diameter)
    return float(np.sqrt(max(force, 0.0) * curvature / (np.pi * b.roller_length * softness)))
