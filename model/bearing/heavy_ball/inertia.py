"""What makes a ball heavy at speed: how fast it orbits by rolling, its centrifugal force and its
gyroscopic moment, and how these go with both contact angles.

Plain numbers of one ball, or arrays of many, as in `balance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import atan2, hypot, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

Number = Any
"""A float, or of many balls at once an array (balls,)."""
Vector = tuple[Number, Number]


class Functions(NamedTuple):
    """What formulas ask of their numbers: `PLAIN` of a float, at a tenth of the time, and `MANY` of arrays."""

    hypot: Any
    sqrt: Any
    atan2: Any
    larger: Any


PLAIN, MANY = Functions(hypot, sqrt, atan2, max), Functions(np.hypot, np.sqrt, np.arctan2, np.maximum)

LEAST_ROLLING = 1e-9  # of 1 + cos(a_i - a_o), which is 2 where both contacts lie opposite each other


@dataclass(frozen=True)
class BallInertia:
    """What makes a ball heavy at speed; `share` scales centrifugal force and gyroscopic moment (0
    none, 1 full). It orbits with a `cage` of that speed (rad/s), or as it rolls."""

    diameter: float
    pitch_diameter: float
    density: float
    inner_speed: float  # rad/s
    outer_speed: float
    share: float = 1.0
    cage: Number | None = None

    @property
    def mass(self) -> float:
        return pi / 6 * self.density * self.diameter**3

    @cached_property
    def scales(self) -> tuple[float, float]:
        """Centrifugal force over the square of the cage's speed, and gyroscopic moment over the product of the two speeds and the sine."""
        return self.share * self.mass * self.pitch_diameter / 2, self.share * self.mass * self.diameter * self.pitch_diameter / 10

    @cached_property
    def flung(self) -> float:
        """Centrifugal force (N) of a ball whose contacts both lie across the axis."""
        return self.loads((1.0, 0.0), (1.0, 0.0)).centrifugal

    def orbit(self, outer: Vector, inner: Vector, of: Functions = PLAIN) -> Orbit:
        """Speed of the cage about the axis by rolling, for the cosine and sine of the ball's `outer` and `inner` contact angles a_o, a_i.

        Kinematics of Harris 1991, ch. 8: rolling at both races and no spin at the outer, tan beta = sin a_o / (cos a_o + gamma).
        A ball that spins with w about an axis at beta to z while it orbits with the cage's speed has dH/dt = cage z x H = J w
        cage sin(beta) about the direction of travel. Rolling is (cage - outer speed) (1 + gamma cos a_o) / cos(a_o - beta) =
        (inner speed - cage) (1 - gamma cos a_i) / cos(a_i - beta) = -gamma w; with beta put in, the cage is behind the outer
        ring by relative (1 - gamma cos a_i) / (1 + cos(a_i - a_o)) and what is left of w sin(beta) is that sin a_o / gamma.
        """
        (co, so), (ci, si) = outer, inner
        gamma = self.diameter / self.pitch_diameter
        # a step may lead to where the contacts lie on one side of the ball, and nothing rolls
        lag, both, across = 1 - gamma * ci, of.larger(1 + co * ci + so * si, LEAST_ROLLING), si * co - ci * so
        rate = (self.outer_speed - self.inner_speed) / both
        turned = lag * across / both
        return Orbit(self.outer_speed - rate * lag, rate * turned, -rate * (gamma * si + turned))

    def loads(self, outer: Vector, inner: Vector, of: Functions = PLAIN) -> Loads:
        """What the ball's inertia asks of its contacts."""
        co, so = outer
        speed, by_outer, by_inner = self.orbit(outer, inner, of) if self.cage is None else Orbit(self.cage, 0.0, 0.0)
        orbit, polar = self.scales
        behind = self.outer_speed - speed
        centrifugal_by_speed, moment_by_speed = 2 * orbit * speed, polar * (behind - speed) * so
        return Loads(
            orbit * speed**2,
            centrifugal_by_speed * by_outer,
            centrifugal_by_speed * by_inner,
            polar * speed * behind * so,
            moment_by_speed * by_outer + polar * speed * behind * co,
            moment_by_speed * by_inner,
            centrifugal_by_speed,
            moment_by_speed,
        )


class Orbit(NamedTuple):
    """Speed of the cage (rad/s), and its derivatives by the outer and the inner contact angle."""

    speed: Number
    by_outer: Number
    by_inner: Number


class Loads(NamedTuple):
    """Centrifugal force C (N) and gyroscopic moment M (N m) of a ball, their derivatives by the
    outer and the inner contact angle, and those by the cage's speed with both held."""

    centrifugal: Number
    centrifugal_by_outer: Number
    centrifugal_by_inner: Number
    moment: Number
    moment_by_outer: Number
    moment_by_inner: Number
    centrifugal_by_speed: Number
    moment_by_speed: Number


def rolling(inertia: BallInertia, centre: Vector, line: Vector, of: Functions = PLAIN) -> Orbit:
    """How fast a ball with its centre at `centre` would roll, for the outer groove's centre at `line`."""
    inner, gap = of.hypot(*centre), (line[0] - centre[0], line[1] - centre[1])
    outer = of.hypot(*gap)
    return inertia.orbit((-gap[0] / outer, gap[1] / outer), (-centre[0] / inner, centre[1] / inner), of)
