"""The draw bar pulls the holder with less than its force: the taper's contact is softer, and softer still at speed."""

from __future__ import annotations

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import joints, lacking, with_stiffness

LEAST = 0.01
"""Share of the force below which the holder is held by friction alone."""


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    if values["loss"] == 0.0:
        return spindle
    factor = float(np.sqrt(force(spindle, condition, values)))
    return with_stiffness(spindle, dict.fromkeys(joints(spindle, "holder"), factor))


def force(spindle: Spindle, condition: Condition, values: Values) -> float:
    """Force on the holder over that of a draw bar in order."""
    speed = condition.speed / spindle.nominal_speed
    return max(1 - values["loss"] * (1 + values["growth"] * speed**2), LEAST)


def idle(spindle: Spindle) -> str | None:
    return None if joints(spindle, "holder") else lacking("joint", "holder")


EFFECT = Effect(
    name="drawbar_force",
    title="Draw bar short of force",
    equation=(
        "joints with role holder: k -> k sqrt(F / F0), F / F0 = 1 - loss (1 + growth (n / n_nominal)^2): ground surfaces in contact give by c p^m with m = "
        "0.5, so that their stiffness goes with the root of the pressure (Levina; in Rivin, Stiffness and Damping in Mechanical Design, 1999, 4.2)"
    ),
    parameters=(
        Parameter(
            "loss", "1", 0.0, 0.3, 0.2, (0.0, 0.95),
            "share of the draw bar's force that is missing at rest",
            "disc springs of clamping units lose a tenth to a half of their force as they wear, when lubrication fails (makers' service notes)",
        ),
        Parameter(
            "growth", "1", 0.0, 0.5, 0.5, (0.0, 5.0),
            "how much more is missing at the nominal speed, over what is at rest", "assumed: the taper's bore widens at speed and the bar follows",
        ),
    ),
    sees="the modes in which the holder moves against the nose lower, the more the faster the spindle turns",
    resembles=("taper_contact", "shaft_bending", "ball_inertia"),
    valid="a taper without face contact, clamped well enough not to slip in vibration",
    spindle=spindle,
    idle=idle,
)  # fmt: skip
