"""How fast cage and balls turn, and at which frequencies a running spindle is excited.

Rolling without slip at both races, and no spin at the outer one (Harris, *Rolling Bearing Analysis*, 3rd ed., ch. 8), as the balls of
`heavy_ball` orbit: with gamma = d / D, and a_i, a_o the contact angles, which ball inertia parts at speed,

    cage = outer - (outer - inner) (1 - gamma cos a_i) / (1 + cos(a_i - a_o)),      spin = |outer - cage| (1 + gamma cos a_o) / gamma,

the spin being that of rolling on the outer race. With a_i = a_o = a this is cage = inner (1 - gamma cos a) / 2 + outer (1 + gamma cos a) / 2
and spin = |outer - inner| (1 - gamma^2 cos^2 a) / (2 gamma).

A ball row sums what happens at its Z contacts, with e^(i azimuth) across the axis and with 1 along it, so that a race wave of order n
is felt across the axis only where n + 1 or n - 1 is a multiple of Z, and along it only where n is; all other orders cancel exactly.
Every line follows from the frame it lives in (Wardle 1988, *J. Mech. Eng. Sci.* 202, parts 1 and 2; Jang & Jeong 2002, *J. Tribology*
124):

=================  ====================  =========  ==========================================================
cause              order                 direction  frequency, signed in the sense of turning
=================  ====================  =========  ==========================================================
unbalance          -                     radial     f
race waviness      k Z + 1               radial     k Z (f_race - f_cage) + f_race
race waviness      k Z - 1               radial     f_race - k Z (f_race - f_cage)
race waviness      k Z                   axial      k Z |f_race - f_cage|
ball size, cage    -                     radial     f_cage
ball waviness      2 k                   radial     2 k f_ball + f_cage and f_cage - 2 k f_ball
ball waviness      2 k                   axial      2 k f_ball
=================  ====================  =========  ==========================================================

Odd orders of a ball lift it at one contact as much as they lower it at the opposite one and cancel to first order. Cylindrical rollers have the
same lines under the same names, Z those of one row and the contact angle 0, but none along the axis, in which they are free.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.row import ring_speeds
from thermospindle.model.carrier import unbalanced
from thermospindle.model.machine import Bearing, RollerBearing, Spindle

SMALLEST = 1e-9
"""Frequency (Hz) below which a line is a displacement that stands still, not an excitation."""


@dataclass(frozen=True)
class Kinematics:
    """Angular speeds of one ball row (rad/s), signed like the spindle's, positive about +z.

    `inner`, `outer`: rings; `cage`: the set of balls about the spindle axis; `spin`: a ball about its own axis, seen from the cage, a
    magnitude; `balls` those of one row, or its rollers, whose `angled` is False: no contact angle moves their lines, and none are axial.
    """

    inner: float
    outer: float
    cage: float
    spin: float
    balls: int
    angled: bool = True

    @property
    def over_inner(self) -> float:
        """Rate (rad/s) at which balls pass a point of the inner race."""
        return self.balls * abs(self.inner - self.cage)

    @property
    def over_outer(self) -> float:
        """Rate (rad/s) at which balls pass a point of the outer race."""
        return self.balls * abs(self.outer - self.cage)

    @property
    def turning(self) -> float:
        """Speed (rad/s) of the ring that turns."""
        return self.inner or self.outer

    def ring(self, side: str) -> float:
        """Speed (rad/s) of the inner or outer ring."""
        return {"inner": self.inner, "outer": self.outer}[side]


@dataclass(frozen=True)
class Line:
    """One frequency at which the unbalance or an imperfection of a bearing excites, in linear theory.

    `bearing` is empty for the unbalance; `cause` is one of CAUSES; `order` is that of the waviness, 0 where there is none; `name` in the
    field's words; `direction` radial or axial; `whirl` +1 in the sense of turning (forward), -1 against it, 0 for axial ones.
    """

    bearing: str
    cause: str
    order: int
    name: str
    direction: str
    whirl: int
    frequency: float  # Hz, not negative


CAUSES = ("unbalance", "inner waviness", "outer waviness", "ball waviness", "ball size", "cage unbalance")


def kinematics(
    bearing: BearingState, balls: int, ball_diameter: float, pitch_diameter: float, inner_speed: float, outer_speed: float
) -> Kinematics:
    """Cage and ball speeds of a row at its operating contact angles (diameters in m, speeds in rad/s)."""
    return rolling((bearing.contact_angle, bearing.outer_contact_angle), balls, ball_diameter / pitch_diameter, inner_speed, outer_speed)


def rolling(angles: tuple[float, float], balls: int, ratio: float, inner_speed: float, outer_speed: float, angled: bool = True) -> Kinematics:
    """Speeds of rolling elements without slip at contact `angles` (rad) with the inner and the
    outer race, `ratio` their diameter over the pitch diameter."""
    a_i, a_o = angles
    cage = outer_speed - (outer_speed - inner_speed) * (1 - ratio * np.cos(a_i)) / (1 + np.cos(a_i - a_o))
    spin = abs(outer_speed - cage) * (1 + ratio * np.cos(a_o)) / ratio
    return Kinematics(inner_speed, outer_speed, float(cage), float(spin), balls, angled)


def row_kinematics(spindle: Spindle, state: PairState) -> dict[str, Kinematics]:
    """Cage and rolling element speeds of every ball and roller bearing of a spindle at its operating point, by name."""

    def of(b: Bearing | RollerBearing) -> Kinematics:
        inner, outer = ring_speeds(spindle, b, state.condition.speed)
        if isinstance(b, RollerBearing):
            return rolling((0.0, 0.0), b.rollers, b.roller_diameter / b.pitch_diameter, inner, outer, angled=False)
        return kinematics(state.bearing(b.name), b.balls, b.ball_diameter, b.pitch_diameter, inner, outer)

    return {b.name: of(b) for b in spindle.rolling}


# ---------------------------------------------------------------- lines


def unbalance_line(speed: float) -> Line:
    """The line of the turning body's unbalance at its speed (rad/s)."""
    return Line("", "unbalance", 0, "1x", "radial", 1, abs(speed) / (2 * np.pi))


def cage_line(bearing: str, kin: Kinematics, cause: str) -> Line:
    """The radial line at the cage frequency, of ball sizes or of the cage's unbalance."""
    return _radial(bearing, cause, 0, "fc", kin.cage, kin)


def race_line(bearing: str, kin: Kinematics, side: str, order: int, direction: str) -> Line:
    """The line of a race wave of `order` k Z + 1 or k Z - 1 (radial) or k Z (axial); `side` is inner or outer.

    Raises ValueError for an order that the row cancels.
    """
    cause, ring = f"{side} waviness", kin.ring(side)
    f = "f" + side[0]
    if direction == "axial":
        if order % kin.balls:
            raise ValueError(f"a race wave of order {order} does nothing axial on {kin.balls} balls")
        name = f"{order} fc" if ring == 0.0 else f"{order} ({f}-fc)"
        return Line(bearing, cause, order, name, "axial", 0, order * abs(ring - kin.cage) / (2 * np.pi))
    if (order - 1) % kin.balls and (order + 1) % kin.balls:
        raise ValueError(f"a race wave of order {order} does nothing radial on {kin.balls} balls")
    sign = 1 if (order - 1) % kin.balls == 0 else -1
    passes = order - sign  # k Z
    speed = ring + sign * passes * (ring - kin.cage)
    if passes == 0:
        name = f
    elif ring == 0.0:
        name = f"{passes} fc"
    elif sign > 0:
        name = f"{passes} ({f}-fc) + {f}"
    else:
        name = f"{passes} ({f}-fc) - {f}" if speed * ring < 0 else f"{f} - {passes} ({f}-fc)"
    return _radial(bearing, cause, order, name, speed, kin)


def ball_line(bearing: str, kin: Kinematics, order: int, direction: str, side: int = 0) -> Line:
    """The line of a ball wave of `order`: axial, or radial with the cage added (`side` +1) or taken away (-1)."""
    if direction == "axial":
        return Line(bearing, "ball waviness", order, f"{order} fb", "axial", 0, order * kin.spin / (2 * np.pi))
    forward = np.sign(kin.turning)
    speed = kin.cage + side * forward * order * kin.spin
    if side > 0 or speed * forward < 0:
        name = f"{order} fb {'+' if side > 0 else '-'} fc"
    else:
        name = f"fc - {order} fb"
    return _radial(bearing, "ball waviness", order, name, float(speed), kin)


def _radial(bearing: str, cause: str, order: int, name: str, speed: float, kin: Kinematics) -> Line:
    whirl = int(np.sign(speed) * np.sign(kin.turning))
    return Line(bearing, cause, order, name, "radial", whirl, abs(speed) / (2 * np.pi))


def lines(spindle: Spindle, kinematics_by_bearing: Mapping[str, Kinematics], speed: float, highest_multiple: int = 3) -> list[Line]:
    """All lines of linear theory for k up to `highest_multiple`, multiples of Z and even ball orders alike, in order of frequency.

    `speed` (rad/s) is the spindle's, of which what is unbalanced has its own ratio. Orders that
    stand still (order 1 of a ring at rest, anything at speed zero) excite nothing and are left out.
    """
    found: list[Line] = []
    for name in (b.name for b in spindle.rolling):
        kin = kinematics_by_bearing[name]
        found += [cage_line(name, kin, "ball size"), cage_line(name, kin, "cage unbalance")]
        for side in ("inner", "outer"):
            found.append(race_line(name, kin, side, 1, "radial"))
            for passes in range(kin.balls, highest_multiple * kin.balls + 1, kin.balls):
                found += [race_line(name, kin, side, passes + by, "radial") for by in (-1, 1)]
                found += [race_line(name, kin, side, passes, "axial")] if kin.angled else []
        for order in range(2, 2 * highest_multiple + 1, 2):
            found += [ball_line(name, kin, order, "radial", by) for by in (-1, 1)]
            found += [ball_line(name, kin, order, "axial")] if kin.angled else []
    found.append(unbalance_line(speed * unbalanced(spindle).speed_ratio))
    return sorted((line for line in found if line.frequency > SMALLEST), key=lambda line: line.frequency)
