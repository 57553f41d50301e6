"""The cage of a row is out of balance."""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import replace
from math import radians

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, bearing_parameter, phase_parameter
from thermospindle.sim.effects.running.race_waviness import bearing


def imperfections(spindle: Spindle, condition: Condition, values: Values, imperfections: Imperfections) -> Imperfections:
    if values["amount"] == 0.0:
        return imperfections
    name = spindle.bearings[bearing(spindle, values)].name
    row = imperfections.row(name)
    sum_ = cmath.rect(row.cage_unbalance, row.cage_phase) + cmath.rect(values["amount"] * 1e-6, radians(values["phase"]))
    turned = replace(row, cage_unbalance=abs(sum_), cage_phase=cmath.phase(sum_))
    return replace(imperfections, bearings={**imperfections.bearings, name: turned})


def sized(spindle: Spindle) -> Mapping[str, float]:
    """Clearances hardly grow with size, and large cages are thin: of 80 mm they weigh 40 to 80 g, as the square of the diameter has it."""
    return {"amount": (spindle.bearings[-1].pitch_diameter / 9.1e-3) ** 2}


EFFECT = Effect(
    name="cage_unbalance",
    title="Unbalance of a cage",
    equation="F = U omega_cage^2 on the outer ring, which guides the cage, turning with it; added to the scene's as a vector",
    parameters=(
        Parameter(
            "amount",
            "g mm",
            neutral=0.0,
            typical=0.2,
            prior_sd=0.2,
            limits=(0.0, 20.0),
            meaning="unbalance of the cage beyond the scene's",
            source="a cage of 0.5 to 1 g that runs 0.2 to 0.3 mm off centre in its guiding clearance",
        ),
        phase_parameter("azimuth to which it points at time zero, when ball 0 is at azimuth 0"),
        bearing_parameter("either may have it: both come from one lot"),
    ),
    sees="the line at the cage frequency (fc, radial, forward) grows as the square of the speed",
    resembles=("ball_size",),
    valid="a cage that keeps its place against the balls and is guided by the outer ring",
    imperfections=imperfections,
    sized=sized,
    acts_on=(ROWS,),
)
