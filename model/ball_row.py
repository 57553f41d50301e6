"""One ball row: forces, contact loss and the exact 5x5 tangent stiffness under any load.

A ball pulls the two groove curvature centres together: a spring in tension along the line between them, force
K deformation**1.5 beyond the unloaded distance and none below (Jones 1960; Harris 1991, ch. 9). Ball j sits at azimuth
psi_j in its own r-z plane; the outer ring's displacement relative to the inner, (x, y, z, tilt_x, tilt_y), moves the outer
centre there by u_r = x cos + y sin and u_z = z + arm (tilt_x sin - tilt_y cos). Forces are those needed on the outer ring.

With ball inertia the ball centre is an unknown of its own: centrifugal force and gyroscopic moment make the inner and outer
contact angles differ (Jones 1960; Harris 1991, Eqs. 9.9-9.25, outer-race control).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, root

from model.hertz import in_series

Array = NDArray[np.float64]


class NoEquilibrium(RuntimeError):
    """A bearing equilibrium was not found; the message says which and how far off it stayed."""


@dataclass(frozen=True)
class BallInertia:
    """What makes a ball heavy at speed; `share` scales centrifugal force and gyroscopic moment (0 none, 1 full)."""

    diameter: float
    pitch_diameter: float
    density: float
    inner_speed: float  # rad/s
    outer_speed: float
    share: float = 1.0

    @property
    def mass(self) -> float:
        return np.pi / 6 * self.density * self.diameter**3


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

    @property
    def unloaded_distance(self) -> float:
        return self.inner_length + self.outer_length

    @property
    def azimuths(self) -> Array:
        return 2 * np.pi * np.arange(self.balls) / self.balls


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

    @property
    def in_contact(self) -> NDArray[np.bool_]:
        return self.ball_force > 0


def kinematics(row: BallRow) -> Array:
    """Rows (balls, 2, 5) that take the outer ring's displacement to (u_r, u_z) at each ball."""
    c, s = np.cos(row.azimuths), np.sin(row.azimuths)
    o, i = np.zeros_like(c), np.ones_like(c)
    return np.stack([np.stack([c, s, o, o, o], -1), np.stack([o, o, i, row.arm * s, -row.arm * c], -1)], 1)


def centre_line(row: BallRow, displacement: Array) -> Array:
    """Vector (balls, 2) from inner to outer groove centre, (r, z) components (m)."""
    return np.array([-row.radial, row.axial]) + kinematics(row) @ displacement


def energy(row: BallRow, displacement: Array) -> float:
    """Elastic energy (J) without ball inertia: sum of 2/5 K deformation**2.5."""
    stretch = np.linalg.norm(centre_line(row, displacement), axis=1) - row.unloaded_distance
    return float(0.4 * row.constant * np.sum(np.maximum(stretch, 0.0) ** 2.5))


def respond(row: BallRow, displacement: Array | None = None) -> RowForce:
    """Force and tangent stiffness at a displacement (5,) of the outer ring relative to the inner; centred rings by default."""
    u = np.zeros(5) if displacement is None else np.asarray(displacement, float)
    line = centre_line(row, u)
    if row.inertia is None or row.inertia.share == 0.0:
        local = _massless(row, line)
    else:
        local = _with_inertia(row, line)
    force, stiffness, inner, outer, inner_angle, outer_angle, deformation = local
    b = kinematics(row)
    return RowForce(
        np.einsum("jik,ji->k", b, force),
        np.einsum("jik,jil,jlm->km", b, stiffness, b),
        inner,
        outer,
        inner_angle,
        outer_angle,
        deformation,
    )


def _massless(row: BallRow, line: Array) -> tuple[Array, ...]:
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


# ---------------------------------------------------------------- balls with inertia


def _with_inertia(row: BallRow, line: Array) -> tuple[Array, ...]:
    """As `_massless`, with each ball's centre found by damped Newton and condensed out of the stiffness."""
    centre = _ball_centres(row, line)
    residual_by, force_by = _derivatives(row, centre, line)
    follow = -np.linalg.solve(residual_by[:, :, :2], residual_by[:, :, 2:])  # d centre / d line
    stiffness = force_by[:, :, 2:] + force_by[:, :, :2] @ follow
    _, force, inner, outer, inner_angle, outer_angle, deformation = _ball_forces(row, centre, line)
    return force, stiffness, inner, outer, inner_angle, outer_angle, deformation


def _ball_centres(row: BallRow, line: Array) -> Array:
    """Ball centres (balls, 2) measured from the inner groove centre, where the forces on each ball balance.

    The energy of the two contacts less the work of the centrifugal force is convex, so a Newton step that is halved until the
    residual falls finds its minimum; the gyroscopic friction is a small addition.
    """
    share = (row.inner_constant / row.outer_constant) ** (2 / 3)
    length = np.linalg.norm(line, axis=1, keepdims=True)
    stretch = np.maximum(length - row.unloaded_distance, 0.02e-6)
    inner = stretch / (1 + share)
    centre = line / length * (row.inner_length + inner)
    scale = 1e-12 * row.constant * np.max(stretch) ** 1.5
    residual = _ball_forces(row, centre, line)[0]
    for _ in range(100):
        worst = np.linalg.norm(residual, axis=1)
        if np.all(worst < scale):
            return centre
        jacobian = _derivatives(row, centre, line)[0][:, :, :2]
        jacobian = jacobian - 1e-9 * row.constant * np.sqrt(np.max(stretch)) * np.eye(2)
        step = -np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 2e-6 / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-30))
        factor = np.ones(row.balls)
        for _ in range(30):
            trial = centre + factor[:, None] * step
            trial_residual = _ball_forces(row, trial, line)[0]
            worse = np.linalg.norm(trial_residual, axis=1) > worst + scale
            if not worse.any():
                break
            factor[worse] *= 0.5
        centre, residual = trial, trial_residual
    raise NoEquilibrium(f"ball centres did not settle; the largest residual is {np.max(np.linalg.norm(residual, axis=1)):.2g} N")


def _derivatives(row: BallRow, centre: Array, line: Array) -> tuple[Array, Array]:
    """Exact Jacobians (balls, 2, 4) of ball residual and outer-ring force by centre and line, by complex steps."""
    h = 1e-20
    residual_by, force_by = np.empty((row.balls, 2, 4)), np.empty((row.balls, 2, 4))
    for column in range(4):
        moved = np.concatenate([centre, line], axis=1).astype(complex)
        moved[:, column] += 1j * h
        residual, force, *_ = _ball_forces(row, moved[:, :2], moved[:, 2:])
        residual_by[:, :, column], force_by[:, :, column] = residual.imag / h, force.imag / h
    return residual_by, force_by


def _ball_forces(row: BallRow, centre: NDArray, line: NDArray) -> tuple[NDArray, ...]:
    """Resultant on each ball (balls, 2) and force on the outer ring (balls, 2); accepts complex steps."""
    inertia = row.inertia
    assert inertia is not None
    inner_length, inner_away = _polar(centre)
    outer_length, outer_away = _polar(line - centre)
    inner_stretch, outer_stretch = inner_length - row.inner_length, outer_length - row.outer_length
    inner = row.inner_constant * _pressed(inner_stretch) ** 1.5
    outer = row.outer_constant * _pressed(outer_stretch) ** 1.5
    cos_outer, sin_outer = -outer_away[:, 0], outer_away[:, 1]
    centrifugal, moment = _ball_inertia_loads(inertia, cos_outer, sin_outer)
    # outer-race control: the friction that turns the ball's angular momentum acts at the outer contact, 2 M / D across it
    across = np.stack([sin_outer, cos_outer], 1)
    friction = -(2 * moment / inertia.diameter)[:, None] * across * np.where(outer.real > 0, 1.0, 0.0)[:, None]
    on_outer = outer[:, None] * outer_away + friction
    radial = np.stack([centrifugal, np.zeros_like(centrifugal)], 1)
    resultant = -inner[:, None] * inner_away + on_outer + radial
    angles = [np.arctan2(np.abs(away[:, 1].real), -away[:, 0].real) for away in (inner_away, outer_away)]
    return resultant, on_outer, inner, outer, angles[0], angles[1], (inner_stretch + outer_stretch)


def _ball_inertia_loads(inertia: BallInertia, cos_outer: NDArray, sin_outer: NDArray) -> tuple[NDArray, NDArray]:
    """Centrifugal force (N) and rate of turn of angular momentum (N m about the direction of travel) of each ball.

    Kinematics after Harris 1991, ch. 8 (rolling at both races, outer-race control: tan beta = sin a / (cos a + gamma), inner
    angle taken equal to the outer). A ball spinning with `spin` about an axis at beta to z while it orbits with `cage` has
    dH/dt = cage z x H = J spin cage sin(beta) about the direction of travel.
    """
    gamma = inertia.diameter / inertia.pitch_diameter
    cage = (inertia.inner_speed * (1 - gamma * cos_outer) + inertia.outer_speed * (1 + gamma * cos_outer)) / 2
    relative = inertia.outer_speed - inertia.inner_speed
    beta_length = np.sqrt(sin_outer**2 + (cos_outer + gamma) ** 2)
    sin_beta, cos_beta = sin_outer / beta_length, (cos_outer + gamma) / beta_length
    rolling = cos_outer * cos_beta + sin_outer * sin_beta
    spin = relative / (rolling * (gamma / (1 + gamma * cos_outer) + gamma / (1 - gamma * cos_outer)))
    polar = inertia.mass * inertia.diameter**2 / 10
    centrifugal = inertia.share * inertia.mass * inertia.pitch_diameter / 2 * cage**2
    return centrifugal, inertia.share * polar * spin * cage * sin_beta


def _polar(vector: NDArray) -> tuple[NDArray, NDArray]:
    length = np.sqrt(vector[:, 0] ** 2 + vector[:, 1] ** 2)
    return length, vector / length[:, None]


def _pressed(stretch: NDArray) -> NDArray:
    return np.where(stretch.real > 0, stretch, 0.0)


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
    found = minimize(potential, start, jac=gradient, hess=hessian, method="trust-exact", options={"gtol": 1e-9, "maxiter": 500})
    end = root(
        lambda v: (respond(row, v * unit).force - load) * unit / work,
        found.x,
        jac=lambda v: respond(row, v * unit).tangent * np.outer(unit, unit) / work,
        options={"xtol": 1e-13},
    )
    residual = float(np.linalg.norm(end.fun))
    if residual > 1e-6:
        raise NoEquilibrium(f"the row cannot carry the load {load.tolist()}; the best displacement leaves {residual:.1e} of it")
    return end.x * unit
