"""The taper of a tool holder touches over a part of its length: worn, or ground to another angle."""

from __future__ import annotations

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import joints, lacking, with_stiffness


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    share = values["share"]
    if share == 0.0:
        return spindle
    names = joints(spindle, "holder")
    left = 1 - share
    return with_stiffness(spindle, dict.fromkeys(names, left), dict.fromkeys(names, left ** values["tilt_power"]))


def idle(spindle: Spindle) -> str | None:
    return None if joints(spindle, "holder") else lacking("joint", "holder")


EFFECT = Effect(
    name="taper_contact",
    title="A tool holder that touches over part of its taper",
    equation=(
        "joints with role holder: k -> (1 - share) k along and across the axis, k_tilt -> (1 - share)^3 k_tilt: a layer of stiffness c per "
        "length over a contact of length L holds with c L across and c L^3 / 12 in tilt (Rivin, Stiffness and Damping in Mechanical "
        "Design, 1999, ch. 4: conical connections as elastic foundations)"
    ),
    parameters=(
        Parameter(
            "share", "1", 0.0, 0.25, 0.2, (0.0, 0.9),
            "share of the contact's length that is lost, evenly at both ends",
            "assumed: tapers of grade AT3 touch over 80 % and more by blue paste, worn ones over half",
        ),
        Parameter(
            "tilt_power", "1", 1.0, 3.0, 1.0, (0.0, 4.0),
            "power of the length that the tilt stiffness follows", "3 of an even elastic foundation; 1 where a face contact holds against tilt",
        ),
    ),
    sees="the modes in which the holder rocks against the nose lower, most of all the tool's own; the same at every temperature and speed",
    resembles=("drawbar_force", "shaft_bending", "sensor_mass"),
    valid="a contact lost evenly at both ends; small vibration that does not slip",
    spindle=spindle,
    idle=idle,
)  # fmt: skip
