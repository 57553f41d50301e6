"""What sits on measuring points weighs: rigid bodies with a point mass at a height, as sensors of known mass are part of what is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle, kept
from thermospindle.model.structure import Body, with_mass


@kept
def with_sensors(drawing: Spindle) -> Spindle:
    """The spindle whose bodies carry the sensors that its points tell the mass of, which these do no longer."""
    if not any(p.mass for p in drawing.points):
        return drawing
    heavier = carrying(drawing, lambda body, point: point.mass)
    return replace(heavier, points=tuple(replace(p, mass=0.0) for p in drawing.points))


def carrying(spindle: Spindle, mass: Callable[[Body, Point], float], unbalanced: float = 1.0) -> Spindle:
    """The spindle with a mass (kg) at each of its points, on the body that carries it."""
    bodies = []
    for body in spindle.structure.bodies:
        for point in spindle.points:
            if point.body == body.name and (here := mass(body, point)) > 0.0:
                body = loaded(body, point, here, unbalanced)
        bodies.append(body)
    return replace(spindle, structure=replace(spindle.structure, bodies=tuple(bodies)))


def loaded(body: Body, point: Point, mass: float, unbalanced: float = 1.0) -> Body:
    """The body with a point mass at a measuring point; a turning body has it spread round the axis, its mean over a turn.

    What is not `unbalanced` has a twin at the same distance below the body's centre of mass, half a mass each.
    """
    x, y, z = point.position
    arm = z - body.z
    square = ((x**2 + y**2) / 2, (x**2 + y**2) / 2) if body.turns else (y**2, x**2)
    twin = (1 - unbalanced) * mass
    balanced = with_mass(body, twin, body.z, (twin * (square[0] + arm**2), twin * (square[1] + arm**2), twin * (x**2 + y**2)))
    own = mass - twin
    return with_mass(balanced, own, z, (own * square[0], own * square[1], own * (x**2 + y**2)))
