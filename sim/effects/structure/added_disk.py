"""Something turns with the hub that the drawing does not show: a disk, a clamp, a reflector ring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.structure import with_mass
from thermospindle.sim.effects.effect import TURNING, Effect, Parameter, Values, mass_ratio


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    mass = values["mass"] * 1e-3
    if mass == 0.0:
        return spindle
    polar = mass * (values["outer_radius"] * 1e-3) ** 2 / 2
    name, face, outward = seat(spindle)
    z = face + outward * values["height"] * 1e-3
    bodies = tuple(with_mass(b, mass, z, (polar / 2, polar / 2, polar)) if b.name == name else b for b in spindle.structure.bodies)
    return replace(spindle, structure=replace(spindle.structure, bodies=bodies))


def seat(spindle: Spindle) -> tuple[str, float, float]:
    """The body that carries the disk, the height (m) of the face it sits on, and which way is outward.

    The turning body's upper face; its centre of mass where no section is drawn; of a flexible shaft the end nearest the first hammer point.
    """
    turning = next((s for s in spindle.structure.shafts if s.turns), None)
    if turning is not None:
        low, high = turning.nodes[0], turning.nodes[-1]
        hit = spindle.point(spindle.hammer.hammer_nodes[0]).position[2]
        return (turning.bodies[-1], high, 1.0) if abs(hit - high) < abs(hit - low) else (turning.bodies[0], low, -1.0)
    body = spindle.turning
    return body.name, max((spindle.region(name).z[1] for name in body.regions), default=body.z), 1.0


def sized(spindle: Spindle) -> Mapping[str, float]:
    """Masses go with the turning mass, lengths with its cube root."""
    ratio = mass_ratio(spindle)
    return {"mass": ratio, "outer_radius": ratio ** (1 / 3), "height": ratio ** (1 / 3)}


EFFECT = Effect(
    name="added_disk",
    title="A disk on the hub that the model does not know",
    equation=(
        "m -> m + mass, centre of mass and I_x, I_y by the parallel axis theorem, I_z -> I_z + mass a^2 / 2; thin disk of radius "
        "a = outer_radius: I_x = I_y = mass a^2 / 4 about its own centre"
    ),
    parameters=(
        Parameter(
            "mass",
            "g",
            neutral=0.0,
            typical=1.0,
            prior_sd=0.7,
            limits=(0.0, 500.0),
            meaning="mass of the disk",
            source="assumed: a clamp ring or reflector is a gram, a 65 mm platter 5 g, a 95 mm platter 22 g",
        ),
        Parameter(
            "outer_radius",
            "mm",
            neutral=12.5,
            typical=12.5,
            prior_sd=5.0,
            limits=(0.0, 100.0),
            meaning="radius of the full thin disk of the same polar inertia",
            source="a hub of 25 mm diameter, the bore of 95 mm platters",
        ),
        Parameter(
            "height",
            "mm",
            neutral=0.0,
            typical=0.0,
            prior_sd=6.0,
            limits=(-50.0, 50.0),
            meaning="height of the disk above the upper face of the turning body, or before the end of a flexible shaft that is hammered",
            source="on top, or within a turning part some 20 mm tall",
        ),
    ),
    sees=(
        "bearing modes lower at every temperature, by as much relatively hot as cold; rocking ones split further with speed "
        "through the polar inertia"
    ),
    resembles=("sensor_mass", "hub_flexibility", "shaft_bending", "preload_loss"),
    valid="rigid disk, balanced and centred on the axis",
    spindle=spindle,
    sized=sized,
    acts_on=(TURNING,),
    lasting=True,
)
