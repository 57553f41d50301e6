"""One ball row: forces, contact loss and the exact 5x5 tangent stiffness under any load.

A ball pulls the two groove curvature centres together: a spring in tension along the line between them, force
K deformation**1.5 beyond the unloaded distance and none below (Jones 1960; Harris 1991, ch. 9). Ball j sits at azimuth
psi_j in its own r-z plane; the outer ring's displacement relative to the inner, (x, y, z, tilt_x, tilt_y), moves the outer
centre there by u_r = x cos + y sin and u_z = z + arm (tilt_x sin - tilt_y cos). Forces are those needed on the outer ring.

With ball inertia the ball centre is an unknown of its own (`model.bearing.heavy_ball.balance`), and so is the speed of the cage, with which
all balls orbit: the mean of what rolling at the angles of each would make it. What one ring is pushed aside with the other is then, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import hypot, sqrt

import numpy as np
import scipy
from numpy.typing import NDArray

from thermospindle.model.bearing.heavy_ball.balance import (
    LEAST_STRETCH,
    Balance,
    Driven,
    HeavyBall,
    balance,
    driven,
    settled,
)
from thermospindle.model.bearing.heavy_ball.inertia import MANY, BallInertia, Vector, rolling
from thermospindle.model.bearing.heavy_ball.together import at_own_speeds, of_each, of_numbers, settled_together
from thermospindle.model.bearing.hertz import in_series
from thermospindle.model.changed import changed
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array

CHANGES, EVERY = 1e-7, 16
"""Of the force of a row, what is a change as its balls pass; then places of its cage from one ball to the next whose mean is taken."""
TURNS = 48
"""Places of the cage from one ball to the next at which a row is asked how far it departs from its mean."""
ROUNDED = 4 * 2.0**-52
"""Of a distance of groove centres, what rounding may change of the two that a ball's centre divides it into."""


@dataclass(frozen=True)
class BallRow:
    """Geometry and contact constants of a row with centred rings.

    `radial`, `axial`: components (m) of the distance of the groove curvature centres, inner minus outer in r, outer minus inner
    in z; the sign of `axial` is the direction in which moving the outer ring loads the row.
    `inner_length`, `outer_length`: groove radius less ball radius (m), the unloaded distances ball centre to groove centre.
    `inner_constant`, `outer_constant`: Hertz constants (N/m^1.5). `arm`: lever of a tilt (m).
    """

    balls: int
    radial: float
    axial: float
    inner_length: float
    outer_length: float
    inner_constant: float
    outer_constant: float
    arm: float
    inertia: BallInertia | None = None

    @cached_property
    def constant(self) -> float:
        """Load-deflection constant of both contacts in series (N/m^1.5)."""
        return in_series(self.inner_constant, self.outer_constant)

    @cached_property
    def unloaded_distance(self) -> float:
        return self.inner_length + self.outer_length

    @property
    def heavy(self) -> bool:
        """Whether its balls have inertia of which one asks."""
        return self.inertia is not None and self.inertia.share != 0.0

    @cached_property
    def ball(self) -> HeavyBall:
        """One of its balls, of those with inertia."""
        assert self.inertia is not None
        return HeavyBall(self.inner_length, self.outer_length, self.inner_constant, self.outer_constant, self.inertia)

    @property
    def azimuths(self) -> Array:
        return azimuths(self.balls)


def azimuths(balls: int) -> Array:
    """Angles (balls,) about the axis (rad) at which the balls of a row stand."""
    return 2 * np.pi * np.arange(balls) / balls


@dataclass(frozen=True)
class Rolled:
    """Where balls with inertia have settled: the speed of their cage (rad/s), and every ball's centre, r and z (balls,) from the inner groove's (m)."""

    cage: float
    centres: Vector


@dataclass(frozen=True)
class RowForce:
    """Answer of a row at one displacement; per-ball arrays have shape (balls,)."""

    force: Array  # (5,) N, N m: on the outer ring, to hold it there
    tangent: Array  # (5, 5) its exact derivative
    ball_force: Array  # (balls,) N, at the inner contact
    outer_ball_force: Array  # (balls,) N
    inner_angle: Array  # (balls,) rad
    outer_angle: Array  # (balls,) rad
    deformation: Array  # (balls,) m, both contacts together, negative: play
    rolled: Rolled | None = None  # of balls with inertia

    @property
    def in_contact(self) -> NDArray[np.bool_]:
        return self.ball_force > 0


def kinematics(row: BallRow) -> Array:
    """Rows (balls, 2, 5) that take the outer ring's displacement to (u_r, u_z) at each ball; read only."""
    return kinematics_of(row.balls, row.arm)


@lru_cache(maxsize=1024)
def kinematics_of(balls: int, arm: float) -> Array:
    """The same from what it depends on."""
    c, s = np.cos(azimuths(balls)), np.sin(azimuths(balls))
    o, i = np.zeros_like(c), np.ones_like(c)
    rows = np.stack([np.stack([c, s, o, o, o], -1), np.stack([o, o, i, arm * s, -arm * c], -1)], 1)
    rows.flags.writeable = False
    return rows


def centre_line(row: BallRow, displacement: Array) -> Array:
    """Vector (balls, 2) from inner to outer groove centre, (r, z) components (m)."""
    return np.array([-row.radial, row.axial]) + kinematics(row) @ displacement


def energy(row: BallRow, displacement: Array) -> float:
    """Elastic energy (J) without ball inertia: sum of 2/5 K deformation**2.5."""
    stretch = np.linalg.norm(centre_line(row, displacement), axis=1) - row.unloaded_distance
    return float(0.4 * row.constant * np.sum(np.maximum(stretch, 0.0) ** 2.5))


def respond(row: BallRow, displacement: Array | None = None, near: Rolled | None = None) -> RowForce:
    """Force and tangent stiffness at a displacement (5,) of the outer ring relative to the inner; centred rings by default.

    `near` is what balls with inertia did at another displacement, from which they are sought.
    """
    return respond_all([row], [np.zeros(5) if displacement is None else np.asarray(displacement, float)], [near])[0]


def respond_all(rows: Sequence[BallRow], displacements: Sequence[Array], near: Sequence[Rolled | None]) -> list[RowForce]:
    """`respond` of many rows, whose balls with inertia are sought together."""
    lines = [centre_line(row, u) for row, u in zip(rows, displacements, strict=True)]
    heavy = [k for k, row in enumerate(rows) if row.heavy]
    told = at_one_speed([rows[k] for k in heavy], [lines[k] for k in heavy], [near[k] for k in heavy])
    found = {k: _with_inertia(rows[k], *own) for k, own in zip(heavy, told, strict=True)}
    return [_of_row(row, *(found.get(k) or (massless(row, lines[k]), None, None))) for k, row in enumerate(rows)]


def _of_row(row: BallRow, local: tuple[Array, ...], cage: Cage | None, rolled: Rolled | None) -> RowForce:
    force, stiffness, inner, outer, inner_angle, outer_angle, deformation = local
    b = kinematics(row)
    flat = b.reshape(-1, 5)
    tangent = flat.T @ (stiffness @ b).reshape(-1, 5)
    if cage is not None:
        tangent += np.outer(cage.force_by_speed.ravel() @ flat, cage.speed_by_line.ravel() @ flat)
    return RowForce(force.ravel() @ flat, tangent, inner, outer, inner_angle, outer_angle, deformation, rolled)


def massless(row: BallRow, line: Array) -> tuple[Array, ...]:
    """Force (balls, 2) and stiffness (balls, 2, 2) of balls without inertia: f = F e, k = F' e e^T + F/L (1 - e e^T)."""
    length = np.linalg.norm(line, axis=1)
    e = line / length[:, None]
    deformation = length - row.unloaded_distance
    pressed = np.maximum(deformation, 0.0)
    force = row.constant * pressed**1.5
    along = 1.5 * row.constant * np.sqrt(pressed)
    ee = e[:, :, None] * e[:, None, :]
    stiffness = along[:, None, None] * ee + (force / length)[:, None, None] * (np.eye(2) - ee)
    angle = np.arctan2(np.abs(e[:, 1]), -e[:, 0])
    return force[:, None] * e, stiffness, force, force, angle, angle, deformation


@dataclass(frozen=True)
class Cage:
    """What the balls' forces on the outer ring (balls, 2) change by with the cage's speed, and that with every ball's line (balls, 2)."""

    force_by_speed: Array
    speed_by_line: Array


def _with_inertia(row: BallRow, speed: float, here: Balance, each: Driven) -> tuple[tuple[Array, ...], Cage | None, Rolled]:
    """As `massless` at the speed of the cage, with the centre of every ball an unknown of its own; and what the cage does as rings move."""
    stiffness = np.stack(here.stiffness(), -1).reshape(-1, 2, 2)
    values = np.stack(here.on_outer, -1), stiffness, here.inner, here.outer, here.inner_angle, here.outer_angle, here.deformation
    if row.inertia is not None and row.inertia.cage is not None:
        return values, None, Rolled(speed, here.centre)
    by_itself = 1.0 - float(np.mean(each.by_cage))
    cage = Cage(np.stack(each.force_by_cage, -1), np.stack(each.by_line, -1) / row.balls / by_itself)
    return values, cage, Rolled(speed, here.centre)


def as_forces(lever: float) -> Array:
    """What makes force and moment (5,) of a ring forces alone, N: moments act at a `lever` (m)."""
    return np.array([1, 1, 1, 1 / lever, 1 / lever])


def at_all_places(row: BallRow, displacement: Array) -> tuple[BallRow, int]:
    """A row with its balls at so many places of the cage at once, whose forces are so many times the mean of them; the row itself, and
    1, where no place differs from another, as between rings that press all balls: asked of balls without inertia."""
    light, scale = replace(row, inertia=None), as_forces(row.arm)
    alone, between = (respond(replace(light, balls=n * row.balls), displacement).force / n for n in (1, 2))
    changes = np.abs(scale * (between - alone)).max() > CHANGES * np.abs(scale * alone).max()
    return (replace(row, balls=EVERY * row.balls), EVERY) if changes else (row, 1)


def cage_spread(row: BallRow, displacement: Array) -> float:
    """By how much of itself the stiffness of a row whose rings stand at a displacement (5,) departs, at most, along x or y
    from its mean as its balls pass from each to the place of the next; 0 of one that carries nothing."""
    near, across = respond(row, displacement).rolled, []
    for turn in 2 * np.pi / row.balls * np.arange(TURNS) / TURNS:
        c, s = np.cos(turn), np.sin(turn)
        turned = np.eye(5)
        turned[:2, :2] = turned[3:, 3:] = [[c, s], [-s, c]]
        across.append(np.diag(turned.T @ respond(row, turned @ displacement, near).tangent @ turned)[:2])
    mean = np.mean(across, axis=0)
    return float(max((np.abs(np.array(across)[:, i] / mean[i] - 1).max() for i in (0, 1) if mean[i] > 0), default=0.0))


def by_own_orbits(row: BallRow, displacement: Array | None = None) -> Array:
    """What of the tangent stiffness (5, 5) at a displacement (5,) of the outer ring were another if every ball
    orbited as fast as it rolls by itself, and no cage held them together (Jones 1960; Harris 1991, ch. 9, have
    each ball so); its symmetric part. Nothing where balls have no inertia, or a cage whose speed is held."""
    if row.inertia is None or not row.heavy or row.inertia.cage is not None:
        return np.zeros((5, 5))
    held = respond(row, displacement, respond(row).rolled)
    assert held.rolled is not None
    line = centre_line(row, np.zeros(5) if displacement is None else displacement)
    alone = _settled(row, line, held.rolled.centres).stiffness()
    b = kinematics(row)
    tangent = b.reshape(-1, 5).T @ (np.stack(alone, -1).reshape(-1, 2, 2) @ b).reshape(-1, 5) - held.tangent
    return np.asarray((tangent + tangent.T) / 2)


def at_one_speed(rows: Sequence[BallRow], lines: Sequence[Array], near: Sequence[Rolled | None]) -> list[tuple[float, Balance, Driven]]:
    """Of rows with heavy balls, whose groove centres are apart by `lines` (balls, 2) each, the speed of the cage, and what
    every ball is, arrays (balls,); sought from where they are `near`, as far as that is known. Raises `NoEquilibrium`."""
    found = {k: told for k, row in enumerate(rows) if (told := _without_others(row, lines[k], near[k])) is not None}
    rest = [k for k in range(len(rows)) if k not in found]
    if rest:
        rolled = [near[k] or _by_themselves(rows[k], lines[k]) for k in rest]
        allowed = [tolerances(rows[k], _longest(lines[k])) for k in rest]
        own = at_own_speeds([rows[k].ball for k in rest], [lines[k] for k in rest], allowed, [r.cage for r in rolled], [r.centres for r in rolled])
        found |= dict(zip(rest, own, strict=True))
    return [found[k] for k in range(len(rows))]


def _without_others(row: BallRow, line: Array, near: Rolled | None) -> tuple[float, Balance, Driven] | None:
    """Of a row whose balls all have the same line, or whose cage has a speed that is held; None of another."""
    starts = None if near is None else near.centres
    if not np.ptp(line, axis=0).any():
        start = None if starts is None else (float(starts[0][0]), float(starts[1][0]))
        cage, here, each = of_alike(row, (float(line[0, 0]), float(line[0, 1])), start)
        return cage, of_numbers(here, lambda x: np.full(row.balls, x)), of_numbers(each, lambda x: np.full(row.balls, x))
    if row.inertia is None or row.inertia.cage is None:
        return None
    here = _settled(row, line, starts)
    return row.inertia.cage, here, driven(row.ball, here, tuple(line.T), MANY)


def _by_themselves(row: BallRow, line: Array) -> Rolled:
    """Where balls settle of which each orbits as fast as it rolls, and their mean speed."""
    here = _settled(row, line)
    return Rolled(float(np.mean(rolling(row.ball.inertia, here.centre, tuple(line.T), MANY).speed)), here.centre)


def _settled(row: BallRow, line: Array, starts: Vector | None = None) -> Balance:
    tolerance, least = tolerances(row, _longest(line))
    return settled_together(of_each([row.ball], [row.balls]), tuple(line.T), np.full(row.balls, tolerance), np.full(row.balls, least), starts)


def of_alike(row: BallRow, line: Vector, start: Vector | None = None) -> tuple[float, Balance, Driven]:
    """Speed of the cage of balls that all have the same `line`, and what one of them is: it rolls with them."""
    ball = row.ball
    here = settled(ball, line, *tolerances(row, hypot(*line)), start)
    cage = ball.inertia.cage
    if cage is None:
        cage = rolling(ball.inertia, here.centre, line).speed
        ball = changed(ball, inertia=changed(ball.inertia, cage=cage))
        here = balance(ball, here.centre, line)
    return cage, here, driven(ball, here, line)


def _longest(line: Array) -> float:
    return float(np.hypot(*line.T).max())


def tolerances(row: BallRow, longest: float) -> tuple[float, float]:
    """Of the resultant on a settled ball (N), and of the stiffness added to the step of one that
    touches nothing (N/m); no groove centres are farther apart than `longest` (m)."""
    stretch, flung = max(LEAST_STRETCH, longest - row.unloaded_distance), row.ball.inertia.flung
    contact = row.constant * stretch**1.5
    tolerance, least = 1e-12 * contact + 1e-13 * flung, 1e-9 * row.constant * sqrt(stretch)
    # a groove distance is rounded to some of its last bits, which the stiffer race turns into force: 1.5 K^(2/3) F^(1/3) of it
    stiffest = 1.5 * max(row.inner_constant, row.outer_constant) ** (2 / 3) * max(contact, flung) ** (1 / 3)
    return tolerance + ROUNDED * row.unloaded_distance * stiffest, least


# ---------------------------------------------------------------- loads


def displacement_under(row: BallRow, load: Array) -> Array:
    """Displacement (5,) of the outer ring under a load (5,) (N, N m) on it.

    Without ball inertia the total potential is convex and is minimised with its exact Hessian (trust region); the answer, or
    the start for balls with inertia, is finished by Powell's hybrid method on the force balance.
    Raises `NoEquilibrium` when the row cannot carry the load.
    """
    load = np.asarray(load, float)
    massless = replace(row, inertia=None)
    unit = 1e-6 / np.array([1, 1, 1, row.arm, row.arm])
    work = 1e-6 * max(float(np.linalg.norm(load * unit)) / 1e-6, 1e-6)

    def potential(v: Array) -> float:
        return (energy(massless, v * unit) - float(load @ (v * unit))) / work

    def gradient(v: Array) -> Array:
        return (respond(massless, v * unit).force - load) * unit / work

    def hessian(v: Array) -> Array:
        return respond(massless, v * unit).tangent * np.outer(unit, unit) / work + 1e-12 * np.eye(5)

    start = np.sign(load) * np.array([1.0, 1.0, 1.0, 0.1, 0.1])
    found = scipy.optimize.minimize(potential, start, jac=gradient, hess=hessian, method="trust-exact", options={"gtol": 1e-9, "maxiter": 500})
    end = scipy.optimize.root(
        lambda v: (respond(row, v * unit).force - load) * unit / work,
        found.x,
        jac=lambda v: respond(row, v * unit).tangent * np.outer(unit, unit) / work,
        options={"xtol": 1e-13},
    )
    residual = float(np.linalg.norm(end.fun))
    if residual > 1e-6:
        raise NoEquilibrium(f"the row cannot carry the load {load.tolist()}; the best displacement leaves {residual:.1e} of it")
    return end.x * unit
