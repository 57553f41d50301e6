"""The balls are heavy: centrifugal force and gyroscopic moment make inner and outer contact angles differ at speed."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    share, own = values["share"], spindle.ball_inertia
    if share == 0.0:
        return spindle
    return replace(spindle, ball_inertia=own + share * (1 - own))


def idle(spindle: Spindle) -> str | None:
    return "its balls have all of their inertia already" if spindle.ball_inertia == 1.0 else None


EFFECT = Effect(
    name="ball_inertia",
    title="Centrifugal force and gyroscopic moment of the balls",
    equation=(
        "Q_i and Q_o balance with F_c = m d_m omega_c^2 / 2 and M_g = J omega_b omega_c sin(beta) on every ball, outer-race control "
        "(Jones 1960; Harris, Rolling Bearing Analysis, 3rd ed. 1991, ch. 9)"
    ),
    parameters=(
        Parameter(
            "share",
            "1",
            neutral=0.0,
            typical=1.0,
            prior_sd=0.5,
            limits=(0.0, 1.0),
            meaning="share of the balls' inertia loads that the model leaves out and that is put in; 1 is all of them",
            source="from the balls' mass and kinematics: nothing to choose but whether they are in the model",
        ),
    ),
    sees="only at speed, as its square: outer contact angles fall, bearing modes move by parts of a percent at 7200 rpm",
    resembles=("ring_growth", "thermal_gradient", "lubricant_film"),
    valid="rolling without gross slip under outer-race control; loaded balls",
    spindle=spindle,
    acts_on=(ROWS,),
    idle=idle,
    exact=True,
)
