"""A ball row where its rings are at a temperature: its contacts, and the grooves moved by thermal expansion.

Jang, Kim, Han, Kim (2003): contact angle and deformation from ring motion, Eqs. (1)-(5); load and deflection, Eq. (6).
Besides the ball (Eq. 3) the grooves grow too, which makes a uniform expansion of everything leave the contact angle alone.
"""

from __future__ import annotations

from functools import lru_cache
from math import atan2, cos, sin

from thermospindle.model.bearing.ball_row import BallInertia, BallRow
from thermospindle.model.bearing.hertz import in_series, race_contact
from thermospindle.model.machine import Bearing, RingMotion, RollerBearing, Spindle

Elastic = tuple[float, float]
"""Young's modulus (Pa) and Poisson's ratio."""


def reference_motion(temperature: float) -> RingMotion:
    """Rings that have not moved: the reference state."""
    return RingMotion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, temperature)


NOT_MOVED = reference_motion(0.0)
"""Of rings whose elastic moduli are known already."""


def row_at(spindle: Spindle, b: Bearing, sense: int, motion: RingMotion, speed: float) -> BallRow:
    """The ball row of bearing `b` with its rings moved by `motion` and the hub not yet moved.

    The groove curvature centres move with the rings, plus the growth of the groove radii and of their distance from the ring's
    middle: Jang et al. 2003, Eqs. (1)-(5).
    """
    loaded = b.unloaded_distance + reference_deformation(spindle, b)
    radial, axial = loaded * cos(b.contact_angle), loaded * sin(b.contact_angle)
    d, fi, fo = b.ball_diameter, b.inner_conformity, b.outer_conformity
    radial += motion.inner_r + fi * d * motion.inner_strain - (motion.outer_r - fo * d * motion.outer_strain)
    inner_share = (fi - 0.5) / (fi + fo - 1)  # the groove centres lie off the ring's middle by this share of their distance
    growth = inner_share * motion.inner_strain + (1 - inner_share) * motion.outer_strain
    axial += sense * (motion.outer_z - motion.inner_z) + growth * axial
    ball_radius = d / 2 * (1 + motion.ball_strain)
    inner_constant, outer_constant = contact_constants(spindle, b, motion, atan2(axial, radial))
    return BallRow(
        balls=b.balls,
        radial=radial,
        axial=sense * axial,
        inner_length=fi * d * (1 + motion.inner_strain) - ball_radius,
        outer_length=fo * d * (1 + motion.outer_strain) - ball_radius,
        inner_constant=inner_constant,
        outer_constant=outer_constant,
        arm=b.pitch_diameter / 2,
        inertia=_ball_inertia(spindle, b, speed),
    )


def reference_deformation(spindle: Spindle, b: Bearing) -> float:
    """Deformation (m) of each ball under the preload at the reference temperature, both contacts: Eq. (6) inverted."""
    return _reference_deformation(b, *elastic(spindle, b, spindle.reference_temperature))


@lru_cache(maxsize=4096)
def _reference_deformation(b: Bearing, ball: Elastic, ring: Elastic) -> float:
    constants = _contact_constants(b, ball, ring, NOT_MOVED, b.contact_angle)
    return (b.preload / (b.balls * sin(b.contact_angle)) / in_series(*constants)) ** (2 / 3)


def contact_constants(spindle: Spindle, b: Bearing, motion: RingMotion, angle: float) -> tuple[float, float]:
    """Hertz constants (inner, outer) at the temperature of `motion`, with its grown ball and its elastic moduli."""
    return _contact_constants(b, *elastic(spindle, b, motion.temperature), motion, angle)


def elastic(spindle: Spindle, b: Bearing, temperature: float) -> tuple[Elastic, Elastic]:
    """Of balls and rings at a temperature."""
    ball, ring = spindle.materials[b.ball_material], spindle.materials[b.ring_material]
    return (ball.youngs_modulus(temperature), ball.poisson_ratio), (ring.youngs_modulus(temperature), ring.poisson_ratio)


def _contact_constants(b: Bearing, ball: Elastic, ring: Elastic, motion: RingMotion, angle: float) -> tuple[float, float]:
    d = b.ball_diameter * (1 + motion.ball_strain)

    def of(conformity: float, strain: float, is_inner: bool) -> float:
        contact = race_contact(d, conformity * b.ball_diameter * (1 + strain) / d, b.pitch_diameter * (1 + strain), angle, is_inner, ball, ring)
        return b.constant_factor * contact.stiffness

    return of(b.inner_conformity, motion.inner_strain, True), of(b.outer_conformity, motion.outer_strain, False)


def _ball_inertia(spindle: Spindle, b: Bearing, speed: float) -> BallInertia | None:
    if speed == 0.0 or spindle.ball_inertia == 0.0:
        return None
    inner, outer = ring_speeds(spindle, b, speed)
    density = spindle.materials[b.ball_material].density
    return BallInertia(b.ball_diameter, b.pitch_diameter, density, inner, outer, spindle.ball_inertia)


def ring_speeds(spindle: Spindle, b: Bearing | RollerBearing, speed: float) -> tuple[float, float]:
    """Speeds (rad/s) of the inner and the outer ring of a bearing where the spindle turns at `speed`."""

    def of(name: str) -> float:
        if name == "ground":
            return 0.0
        body = spindle.structure.body(name)
        return body.speed_ratio * speed if body.turns else 0.0

    return of(b.inner_body), of(b.outer_body)


def relative_speed(spindle: Spindle, b: Bearing | RollerBearing, speed: float) -> float:
    """Speed (rad/s, not negative) of the rings of a bearing against each other: what its rolling
    elements and its lubricant know of the spindle's `speed`."""
    inner, outer = ring_speeds(spindle, b, speed)
    return abs(inner - outer)
