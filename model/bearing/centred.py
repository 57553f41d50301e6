"""A ball row with centred rings: its balls are all alike, and one of them stands for all.

Plain numbers, as in `heavy_ball`: rings that look for their balance ask for a row many times.
"""

from __future__ import annotations

from functools import lru_cache
from math import atan2, hypot, sqrt
from typing import NamedTuple

import numpy as np

from thermospindle.model.bearing.ball_row import BallRow, kinematics_of, of_alike, tolerances
from thermospindle.model.bearing.heavy_ball.balance import settled, spring
from thermospindle.model.bearing.heavy_ball.inertia import Vector
from thermospindle.model.types import Array

Centres = dict[int, Vector]
"""Where the balls of rows settled last, by where the rows are in memory: whoever keeps these keeps those."""


class Centred(NamedTuple):
    """Answer of a row: what holds its outer ring, with the exact tangent, and what one of its balls is, as in `ball_row.RowForce`."""

    axial_force: float  # N
    tangent: Array  # (5, 5)
    ball_force: float  # N, at the inner contact
    outer_ball_force: float  # N
    inner_angle: float  # rad
    outer_angle: float  # rad
    deformation: float  # m


def centred(row: BallRow, centre: Vector | None = None) -> Centred:
    """What `ball_row.respond` says of centred rings; `centre` is where balls with inertia may settle, as far as one knows."""
    squares, sums = _of_all(row.balls, row.arm)
    if not row.heavy:
        length, deformation, force, along = _pull(row, row.axial)
        sine, angle = row.axial / length, atan2(abs(row.axial), row.radial)
        tangent = np.array(spring((-row.radial / length, sine), along, force / length)) @ squares
        return Centred(row.balls * force * sine, tangent.reshape(5, 5), force, force, angle, angle, deformation)
    _, ball, driven = of_alike(row, (-row.radial, row.axial), centre)
    tangent = (np.array(ball.stiffness()) @ squares).reshape(5, 5)
    if row.inertia is not None and row.inertia.cage is None:  # it turns with what it drives
        tangent += np.outer(np.array(driven.force_by_cage) @ sums, np.array(driven.by_line) @ sums) / (row.balls * (1.0 - driven.by_cage))
    return Centred(row.balls * ball.on_outer[1], tangent, ball.inner, ball.outer, ball.inner_angle, ball.outer_angle, ball.deformation)


@lru_cache(maxsize=1024)
def _of_all(balls: int, arm: float) -> tuple[Array, Array]:
    """Sums over the balls of what their kinematics b (2, 5) make: of b_i b_k, (4, 25), by which a
    ball's stiffness (rr, rz, zr, zz) is the row's, and of b."""
    b = kinematics_of(balls, arm)
    return np.einsum("jpk,jql->pqkl", b, b).reshape(4, 25), b.sum(axis=0)


def centred_axial_force(row: BallRow, movement: float = 0.0, centres: Centres | None = None) -> float:
    """Axial force (N) needed on the outer ring when it has moved by `movement` (m)."""
    return centred_axial(row, movement, centres)[0]


def centred_axial(row: BallRow, movement: float, centres: Centres | None = None) -> tuple[float, float]:
    """`centred_axial_force` and its derivative by the movement (N/m).

    Of rows that are asked at many places near each other `centres` keeps where their balls have settled.
    """
    axial = row.axial + movement
    if row.heavy:
        centres = {} if centres is None else centres
        line = -row.radial, axial
        found = settled(row.ball, line, *tolerances(row, hypot(*line)), centres.get(id(row)))  # all balls roll alike, and the cage with them
        centres[id(row)] = found.centre
        return row.balls * found.on_outer[1], row.balls * found.stiffness()[3]
    length, _, force, along = _pull(row, axial)
    sine = axial / length
    return row.balls * force * sine, row.balls * (along * sine**2 + force / length * (1 - sine**2))


def _pull(row: BallRow, axial: float) -> tuple[float, float, float, float]:
    """Distance of the groove centres (m), deformation of a ball without inertia (m), its force (N) and that force's slope (N/m)."""
    length = hypot(row.radial, axial)
    deformation = length - row.unloaded_distance
    pressed = max(deformation, 0.0)
    root = row.constant * sqrt(pressed)
    return length, deformation, root * pressed, 1.5 * root
