"""One ball row: forces, contact loss and the exact 5x5 tangent stiffness under any load.

A ball pulls the two groove curvature centres together: a spring in tension along the line between them, force
K deformation**1.5 beyond the unloaded distance and none below (Jones 1960; Harris 1991, ch. 9). Ball j sits at azimuth
psi_j in its own r-z plane; the outer ring's displacement relative to the inner, (x, y, z, tilt_x, tilt_y), moves the outer
centre there by u_r = x cos + y sin and u_z = z + arm (tilt_x sin - tilt_y cos). Forces are those needed on the outer ring.

With ball inertia the ball centre is an unknown of its own (`model.bearing.heavy_ball.balance`), and so is the speed of the cage, with which
all balls orbit: the mean of what rolling at the angles of each would make it. What one ring is pushed aside with the other is then, too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import hypot, sqrt
from types import MappingProxyType

import numpy as np
import scipy
from numpy.typing import NDArray

from thermospindle.model.bearing.heavy_ball.balance import LEAST_STRETCH, Balance, Driven, HeavyBall, balance, driven, settled
from thermospindle.model.bearing.heavy_ball.inertia import BallInertia, Vector, rolling
from thermospindle.model.bearing.hertz import in_series
from thermospindle.model.changed import changed
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array

ROUNDS, STANDING = 20, 1e-12  # of the cage's speed, and what of it is no change
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
    """Where balls with inertia have settled: the speed of their cage (rad/s), and every ball's centre, (r, z) from the inner groove's (m)."""

    cage: float
    centres: tuple[Vector, ...]


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
    u = np.zeros(5) if displacement is None else np.asarray(displacement, float)
    line = centre_line(row, u)
    local, cage, rolled = _with_inertia(row, line, near) if row.heavy else (massless(row, line), None, None)
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


def _with_inertia(row: BallRow, line: Array, near: Rolled | None) -> tuple[tuple[Array, ...], Cage | None, Rolled]:
    """As `massless` at the speed of the cage, with the centre of every ball an unknown of its own; and what the cage does as rings move."""
    lines = [(r, z) for r, z in line.tolist()]
    speed, found = at_one_speed(row, lines) if near is None else at_one_speed(row, lines, dict(zip(lines, near.centres, strict=True)), near.cage)
    balances, each = zip(*(found[at] for at in lines), strict=True)
    stiffness = {at: np.reshape(b.stiffness(), (2, 2)) for at, (b, _) in found.items()}
    told = np.array([(*b.on_outer, b.inner, b.outer, b.inner_angle, b.outer_angle, b.deformation) for b in balances]).T
    values, rolled = (told[:2].T, np.array([stiffness[at] for at in lines]), *told[2:]), Rolled(speed, tuple(b.centre for b in balances))
    if row.inertia is not None and row.inertia.cage is not None:
        return values, None, rolled
    by_itself = 1.0 - float(np.mean([d.by_cage for d in each]))
    cage = Cage(np.array([d.force_by_cage for d in each]), np.array([d.by_line for d in each]) / len(each) / by_itself)
    return values, cage, rolled


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
    lines = [(r, z) for r, z in centre_line(row, np.zeros(5) if displacement is None else displacement).tolist()]
    allowed = tolerances(row, max(hypot(r, z) for r, z in lines))
    starts = dict(zip(lines, held.rolled.centres, strict=True))
    alone = {at: np.reshape(settled(row.ball, at, *allowed, start).stiffness(), (2, 2)) for at, start in starts.items()}
    b = kinematics(row)
    tangent = b.reshape(-1, 5).T @ (np.array([alone[at] for at in lines]) @ b).reshape(-1, 5) - held.tangent
    return np.asarray((tangent + tangent.T) / 2)


def at_one_speed(
    row: BallRow, lines: Sequence[Vector], starts: Mapping[Vector, Vector] = MappingProxyType({}), near: float | None = None
) -> tuple[float, dict[Vector, tuple[Balance, Driven]]]:
    """Speed of the cage, and what a ball is at every different one of `lines` (balls, 2) between
    the groove centres; balls on the same line, as of centred rings, are one. Balls are sought from
    their `starts`, and the speed from one that is `near`, as far as these are known."""
    free, weights = row.ball, Counter(lines)
    allowed = tolerances(row, max(hypot(r, z) for r, z in weights))

    def mean(values: Mapping[Vector, float]) -> float:
        return sum(n * values[at] for at, n in weights.items()) / len(lines)

    def held(cage: float) -> HeavyBall:
        return changed(free, inertia=changed(free.inertia, cage=cage))

    def at_speed(ball: HeavyBall, balances: Mapping[Vector, Balance]) -> dict[Vector, tuple[Balance, Driven]]:
        return {at: (here, driven(ball, here, at)) for at, here in balances.items()}

    if near is None or free.inertia.cage is not None or len(weights) == 1:
        here = {at: settled(free, at, *allowed, starts.get(at)) for at in weights}
        if (cage := free.inertia.cage) is not None:
            return cage, at_speed(free, here)
        cage = mean({at: rolling(free.inertia, b.centre, at).speed for at, b in here.items()})
        ball = held(cage)
        if len(here) == 1:  # it rolls with them
            return cage, at_speed(ball, {at: balance(ball, b.centre, at) for at, b in here.items()})
        starts = {at: b.centre for at, b in here.items()}
    else:
        cage, ball = near, held(near)
    for _ in range(ROUNDS):
        here = {at: settled(ball, at, *allowed, starts.get(at)) for at in weights}
        starts = {at: b.centre for at, b in here.items()}
        found = at_speed(ball, here)
        speed, by_cage = (mean({at: getattr(d, of) for at, (_, d) in found.items()}) for of in ("speed", "by_cage"))
        step = (speed - cage) / (1.0 - by_cage)
        if abs(step) <= STANDING * abs(speed):
            return cage, found
        cage += step
        ball = held(cage)
    raise NoEquilibrium("the speed of a cage did not settle")


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
