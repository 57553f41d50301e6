"""One race of one bearing carries a wave of an order that the balls feel."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.built.imperfections import Imperfections, Wave
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, bearing_parameter


def order(spindle: Spindle, values: Values) -> int:
    """Order of the wave, multiple Z + offset, at least 1."""
    balls = spindle.bearings[bearing(spindle, values)].balls
    return max(1, round(values["multiple"]) * balls + round(values["offset"]))


def bearing(spindle: Spindle, values: Values) -> int:
    """Number of the bearing, the lowest first; a spindle with fewer has it in the last."""
    return min(round(values["bearing"]), len(spindle.bearings) - 1)


def imperfections(spindle: Spindle, condition: Condition, values: Values, imperfections: Imperfections) -> Imperfections:
    if values["amplitude"] == 0.0:
        return imperfections
    name = spindle.bearings[bearing(spindle, values)].name
    row, wave = imperfections.row(name), Wave(order(spindle, values), values["amplitude"] * 1e-9, 0.0)
    if round(values["ring"]):
        waved = replace(row, outer_radial=(*row.outer_radial, wave))
    else:
        waved = replace(row, inner_radial=(*row.inner_radial, wave))
    return replace(imperfections, bearings={**imperfections.bearings, name: waved})


EFFECT = Effect(
    name="race_waviness",
    title="Waviness of a race",
    equation=(
        "u(azimuth) = amplitude cos(n azimuth), n = multiple Z + offset: radial lines at k Z (f_race - f_cage) +- f_race for n = k Z +- 1, "
        "an axial line at k Z |f_race - f_cage| for n = k Z, f_race for n = 1 (Wardle 1988)"
    ),
    parameters=(
        Parameter(
            "amplitude",
            "nm",
            neutral=0.0,
            typical=100.0,
            prior_sd=100.0,
            limits=(0.0, 20000.0),
            meaning="radial amplitude of the wave, zero to peak, beyond what the scene has",
            source="lobes left by centreless grinding: 0.1 um of 0.1 to 0.5 um roundness, peak to valley, of instrument bearings",
        ),
        Parameter(
            "multiple",
            "1",
            neutral=1.0,
            typical=2.0,
            prior_sd=1.0,
            limits=(0.0, 4.0),
            meaning="multiple k of the number of balls next to the order; 0 is an eccentric race, order 1",
            source="orders far from multiples of the number of balls cancel in the row (Wardle 1988, part 1)",
            choices=(0.0, 1.0, 2.0, 3.0),
        ),
        Parameter(
            "offset",
            "1",
            neutral=0.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(-1.0, 1.0),
            meaning="order less multiple times balls: -1 or 1 moves across the axis, 0 along it",
            source="the orders that a row feels (Wardle 1988, part 1)",
            choices=(-1.0, 0.0, 1.0),
        ),
        Parameter(
            "ring",
            "1",
            neutral=0.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="0 the inner race, 1 the outer one",
            source="either may be worse: both are ground the same way",
            choices=(0.0, 1.0),
            counts="rings",
        ),
        bearing_parameter("either may be worse: both come from one lot"),
    ),
    sees="one line, at a frequency that tells ring and order; growing where it meets a natural frequency; nothing in an impact test",
    resembles=("unbalance", "ball_waviness"),
    valid="waves shorter than the groove is wide and longer than the contact; amplitude small beside the balls' elastic deformation",
    imperfections=imperfections,
    acts_on=(ROWS,),
)
