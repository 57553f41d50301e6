"""What is stuck on to measure weighs: accelerometers on standing parts, reflective tape on the hub."""

from __future__ import annotations

from collections.abc import Mapping

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.sensors import carrying
from thermospindle.sim.effects.effect import Effect, Parameter, Values, mass_ratio


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    mass = values["mass"] * 1e-3
    if mass == 0.0:
        return spindle
    share = {turns: values["turning_share" if turns else "standing_share"] * mass for turns in (True, False)}
    return carrying(spindle, lambda body, point: share[body.turns] * point.listens, values["unbalanced"])


def sized(spindle: Spindle) -> Mapping[str, float]:
    """One takes a sensor to suit the machine: a gram on a hub of some 25 g, 20 g on a spindle of 10 kg, so by the root of the mass."""
    return {"mass": mass_ratio(spindle) ** 0.5}


EFFECT = Effect(
    name="sensor_mass",
    title="Mass of the sensors at the measuring points",
    equation=(
        "m -> m + sum mass, I_x -> I_x + sum mass (y^2 + z^2), I_y -> I_y + sum mass (x^2 + z^2), I_z -> I_z + sum mass (x^2 + y^2) about "
        "the common centre of mass; on a turning body x^2, y^2 -> (x^2 + y^2) / 2; "
        "d ln f = -mass |phi(point)|^2 / (2 modal mass) (Rayleigh; Ewins, Modal Testing, 2000)"
    ),
    parameters=(
        Parameter(
            "mass",
            "g",
            neutral=0.0,
            typical=1.0,
            prior_sd=0.6,
            limits=(0.0, 100.0),
            meaning="mass of a sensor",
            source="miniature accelerometers with their wax and cable end: 0.2 to 2 g by their makers' data sheets, those for machines 5 to 50 g",
        ),
        Parameter(
            "standing_share",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="mass at every measuring point on a part that does not turn, in sensors",
            source="one a point; none where these are looked at by light",
        ),
        Parameter(
            "turning_share",
            "1",
            neutral=0.02,
            typical=0.02,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="the same on the turning part",
            source="assumed: 1 cm2 of retroreflective tape, 0.2 kg/m2; sensors too where it was hit at rest",
        ),
        Parameter(
            "unbalanced",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=0.5,
            limits=(0.0, 1.0),
            meaning="share of the mass that moves the centre of mass along the axis; the rest is balanced about it",
            source="1 for sensors alone; 0 where dummy masses, cables or clamps on the other side balance them",
        ),
    ),
    sees="modes that move the sensors' parts lie lower, the same at every temperature and speed; gone when sensors are moved",
    resembles=("added_disk", "mount_compliance", "sensor_gain"),
    valid=(
        "sensors rigid and small against what they sit on; bodies keep their centre of mass on the axis: the first moment of a sensor off "
        "the axis, which couples axial motion and tilt, is left out (it moves purely axial and purely tilting modes in second order)"
    ),
    spindle=spindle,
    sized=sized,
    lasting=True,
)
