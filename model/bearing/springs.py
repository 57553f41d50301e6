"""Balls as springs between points of two bodies: what a ball-by-ball bearing element is made of.

Each ball pulls a point of the inner body (its groove centre) and a point of the outer body together. Jones's equations take the
ring motion at one common point and let balls follow tangential motion freely; a spring between two points also resists
tangential motion (tension / length) and its lever arms differ by the length of the spring. `tangent` is the exact Hessian of
such springs, so that the difference to Jones's 5x5 matrix, below 2 % of it, can be put beside them as a linear element.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.model.bearing.ball_row import centre_line, respond
from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.types import Array


@dataclass(frozen=True)
class BallSprings:
    """Springs of one row: ends (balls, 3) in m at the loaded state, and force = a x + b x^2 + c x^3
    beyond `rest` (m), `polynomial` (balls, 3) of a, b, c."""

    inner: Array
    outer: Array
    rest: float
    polynomial: Array


LIGHTEST = 0.1
"""Of the largest deformation of a row under a radial load, at which balls that are pressed by less, or not at all, are expanded."""


def ball_springs(state: BearingState) -> BallSprings:
    """The springs of a bearing at its operating point; a ball that has lost contact there has a spring that is slack."""
    row, q = state.row, np.array(state.displacement or (0.0,) * 5)
    c, s = np.cos(row.azimuths), np.sin(row.azimuths)
    radius = row.arm + row.radial / 2
    inner = np.stack([radius * c, radius * s, np.full_like(c, state.z - row.axial / 2)], axis=1)
    r, z = centre_line(row, q).T
    deformation = np.full(row.balls, state.deformation)
    if any(q):
        each = respond(row, q, respond(row).rolled).deformation
        deformation = np.maximum(each, LIGHTEST * each.max())
    return BallSprings(inner, inner + np.stack([r * c, r * s, z], axis=1), row.unloaded_distance, np.array([hertz_polynomial(row.constant, x) for x in deformation]))


def hertz_polynomial(constant: float, deformation: float) -> tuple[float, float, float]:
    """Cubic through zero that has value, slope and curvature of K x^1.5 at `deformation`.

    With t = x / deformation it is K deformation^1.5 (3 t + 6 t^2 - t^3) / 8: within 3 % of Hertz for 0.4 < t < 2. A row without
    load is expanded at 1 um.
    """
    at = deformation if deformation > 1e-8 else 1e-6
    force = constant * at**1.5 / 8
    return 3 * force / at, 6 * force / at**2, -force / at**3


def tangent(springs: BallSprings, inner_centre: float, outer_centre: float) -> Array:
    """Hessian (10, 10) of the springs' energy in the motions of both bodies, (x, y, z, tilt_x, tilt_y) inner then outer.

    Bodies rotate about the axis points at heights `inner_centre`, `outer_centre`, first about x, then about the turned y, as
    MuJoCo's hinges do; second derivatives of the lengths are exact.
    """
    hessian = np.zeros((10, 10))
    for p, q, (a, b, c) in zip(springs.inner, springs.outer, springs.polynomial, strict=True):
        line = q - p
        length = float(np.linalg.norm(line))
        e = line / length
        stretch = max(length - springs.rest, 0.0)
        force = a * stretch + b * stretch**2 + c * stretch**3
        slope = a + 2 * b * stretch + 3 * c * stretch**2 if stretch > 0 else 0.0
        motion = np.hstack([-_jacobian(p, inner_centre), _jacobian(q, outer_centre)])
        along = e @ motion
        bend = np.zeros((10, 10))
        bend[3:5, 3:5] = -_turned_twice(p, inner_centre, e)
        bend[8:10, 8:10] = _turned_twice(q, outer_centre, e)
        across = motion.T @ (np.eye(3) - np.outer(e, e)) @ motion
        hessian += slope * np.outer(along, along) + force * (across / length + bend)
    return hessian


def _jacobian(point: Array, centre: float) -> Array:
    x, y, z = point[0], point[1], point[2] - centre
    return np.array([[1, 0, 0, 0, z], [0, 1, 0, -z, 0], [0, 0, 1, y, -x]])


def _turned_twice(point: Array, centre: float, e: Array) -> Array:
    """Second derivatives (2, 2) of e . (Rx Ry rho) by the two angles."""
    x, y, z = point[0], point[1], point[2] - centre
    mixed = float(e @ np.array([0.0, x, 0.0]))
    return np.array([[float(e @ np.array([0.0, -y, -z])), mixed], [mixed, float(e @ np.array([-x, 0.0, -z]))]])
