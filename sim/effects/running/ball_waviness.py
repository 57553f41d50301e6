"""One ball of a row is not round."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.built.imperfections import Imperfections, Wave
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, bearing_parameter
from thermospindle.sim.effects.running.race_waviness import bearing


def imperfections(spindle: Spindle, condition: Condition, values: Values, imperfections: Imperfections) -> Imperfections:
    if values["amplitude"] == 0.0:
        return imperfections
    own = spindle.bearings[bearing(spindle, values)]
    row = imperfections.row(own.name)
    waves = list(row.ball_waves or [()] * own.balls)
    waves[0] = (*waves[0], Wave(2 * round(values["half_order"]), values["amplitude"] * 1e-9, 0.0))
    return replace(imperfections, bearings={**imperfections.bearings, own.name: replace(row, ball_waves=tuple(waves))})


EFFECT = Effect(
    name="ball_waviness",
    title="A ball that is not round",
    equation=(
        "the surface of ball 0 is raised by amplitude cos(2 k angle): radial lines at 2 k f_ball +- f_cage and an axial one at 2 k f_ball; "
        "odd orders cancel between the two contacts (Wardle 1988, part 2; Jang & Jeong 2002)"
    ),
    parameters=(
        Parameter(
            "amplitude",
            "nm",
            neutral=0.0,
            typical=500.0,
            prior_sd=500.0,
            limits=(0.0, 10000.0),
            meaning="amplitude of the wave on one ball, zero to peak, beyond what the scene has",
            source="ISO 3290-1:2014: deviation from spherical form 0.08 um in grade 3, 1 um in grade 40; a dent or a worn band",
        ),
        Parameter(
            "half_order",
            "1",
            neutral=2.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(1.0, 4.0),
            meaning="half the order of the wave; 1 is an oval ball",
            source="ovals are what lapping leaves most (Wardle 1988, part 2)",
            choices=(1.0, 2.0, 3.0),
        ),
        bearing_parameter("either may hold it: both are filled from one lot"),
    ),
    sees="three lines belong together: 2 k fb - fc and 2 k fb + fc across the axis and 2 k fb along it",
    resembles=("race_waviness",),
    valid="the ball keeps its axis of spin; amplitude small beside its elastic deformation",
    imperfections=imperfections,
    acts_on=(ROWS,),
)
