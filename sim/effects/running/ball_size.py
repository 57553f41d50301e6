"""One ball of a row is larger than the others."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, bearing_parameter
from thermospindle.sim.effects.running.race_waviness import bearing


def imperfections(spindle: Spindle, condition: Condition, values: Values, imperfections: Imperfections) -> Imperfections:
    if values["difference"] == 0.0:
        return imperfections
    own = spindle.bearings[bearing(spindle, values)]
    row = imperfections.row(own.name)
    sizes = list(row.ball_diameter or [0.0] * own.balls)
    sizes[0] += values["difference"] * 1e-9
    return replace(imperfections, bearings={**imperfections.bearings, own.name: replace(row, ball_diameter=tuple(sizes))})


EFFECT = Effect(
    name="ball_size",
    title="A ball larger than the others of its row",
    equation=(
        "the contacts of ball 0 are each closer by difference / 2; the row pushes the hub towards the side away from it, at the cage frequency; "
        "what all balls share is a preload and left out (Harris, Rolling Bearing Analysis, 3rd ed., ch. 25; Jang & Jeong 2002)"
    ),
    parameters=(
        Parameter(
            "difference",
            "nm",
            neutral=0.0,
            typical=1000.0,
            prior_sd=1000.0,
            limits=(0.0, 20000.0),
            meaning="diameter of one ball over that of the others, beyond what the scene has",
            source="ISO 3290-1:2014: lot diameter variation 0.13 um in grade 3, 1 um in grade 20; a ball of another lot",
        ),
        bearing_parameter("either may hold it: both are filled from one lot"),
    ),
    sees="the line at the cage frequency (fc, radial, forward) is large, and the same at every speed far from resonances",
    resembles=("cage_unbalance",),
    valid="difference small beside the balls' elastic deformation; every ball loaded",
    imperfections=imperfections,
    acts_on=(ROWS,),
)
