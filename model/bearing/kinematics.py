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

Rings that a radial load or weight displaces press their balls by azimuth, so that each of these comes with sidebands, and in every
direction: a race wave of order k Z + s at k Z (f_race - f_cage) + s f_race for any s (s = 1 and -1 across, 0 along the axis are those above),
ball sizes at s f_cage, ball waves at 2 k f_ball + s f_cage. The balls that carry change as they pass, which moves the rings of a perfect
row too, at k Z f_cage (*varying compliance*: Sunnersjo 1978, *J. Sound Vib.* 58, 363; Harris, ch. 25). What whirls one way between centred
rings does so mostly still, and is called as there; the others go both ways.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

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
    `displaced`: under a radial load or weight, with sidebands.
    """

    inner: float
    outer: float
    cage: float
    spin: float
    balls: int
    angled: bool = True
    displaced: bool = False

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
    field's words; `direction` radial or axial; `whirl` +1 in the sense of turning (forward), -1 against it, 0 for axial ones and for what
    displaced rings alone make, which goes both ways.
    """

    bearing: str
    cause: str
    order: int
    name: str
    direction: str
    whirl: int
    frequency: float  # Hz, not negative


VARYING = "varying compliance"
CAUSES = ("unbalance", "inner waviness", "outer waviness", "ball waviness", "ball size", "cage unbalance", VARYING)
SIDEBANDS = 2
"""Of a row with displaced rings, up to which `lines` has them unless more are asked for, of waves up to the highest
multiple of balls and one more, as they are drawn; further ones are in runout, as far as `sim.running.pulls` says."""


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

    displaced = {b.name for b in state.rolling if any(b.displacement)}
    return {b.name: replace(of(b), displaced=b.name in displaced) for b in spindle.rolling}


# ---------------------------------------------------------------- lines


def unbalance_line(speed: float) -> Line:
    """The line of the turning body's unbalance at its speed (rad/s)."""
    return Line("", "unbalance", 0, "1x", "radial", 1, abs(speed) / (2 * np.pi))


def cage_line(bearing: str, kin: Kinematics, cause: str, times: int = 1, direction: str = "radial") -> Line:
    """The line at the cage frequency, of ball sizes or of the cage's unbalance; between displaced rings also at several `times` that, and axial."""
    name = "fc" if times == 1 else f"{times} fc"
    return _line(bearing, cause, 0, name, direction, 1 if times == 1 else 0, times * kin.cage, kin)


def varying_line(bearing: str, kin: Kinematics, passes: int, direction: str) -> Line:
    """The line of a perfect row whose balls pass where displaced rings press them; `passes` is a multiple of their number."""
    return _line(bearing, VARYING, 0, f"{passes} fc", direction, 0, passes * kin.cage, kin)


def race_line(bearing: str, kin: Kinematics, side: str, order: int, direction: str, passes: int | None = None) -> Line:
    """The line of a race wave of `order`; `side` is inner or outer, `passes` the multiple of the number Z of balls at
    whose passing it is felt. Between centred rings that follows: order - 1 or order + 1 across the axis, order along it.

    Raises ValueError for an order that the row cancels.
    """
    if passes is None:
        passes = _centred_passes(kin.balls, order, direction)
    ring, f, sideband = kin.ring(side), f"f{side[0]}", order - passes
    turn = passes * (ring - kin.cage) + sideband * ring
    name = f"{abs(passes)} fc" if ring == 0.0 else _sum((passes, f"({f}-fc)"), (sideband, f), turn * ring < 0)
    return _line(bearing, f"{side} waviness", order, name, direction, sideband, turn, kin)


def _centred_passes(balls: int, order: int, direction: str) -> int:
    for passes in (order,) if direction == "axial" else (order - 1, order + 1):
        if passes % balls == 0:
            return passes
    raise ValueError(f"a race wave of order {order} does nothing {direction} on {balls} balls")


def ball_line(bearing: str, kin: Kinematics, order: int, direction: str, side: int = 0) -> Line:
    """The line of a ball wave of `order`: axial, or radial with the cage added (`side` +1) or taken away (-1); between displaced rings any side."""
    forward = np.sign(kin.turning)
    turn = forward * order * kin.spin + side * kin.cage
    return _line(bearing, "ball waviness", order, _sum((order, "fb"), (side, "fc"), turn * forward < 0), direction, side, float(turn), kin)


def _sum(first: tuple[int, str], second: tuple[int, str], negative: bool) -> str:
    """Two multiples in words, such as "12 (fi-fc) - 2 fi"; the other way round where they add up to less than nothing,
    unless both are of one sign, for the sense of a line is no part of its name."""
    every = [n for n, _ in (first, second) if n]
    turned = max(every) < 0 or (negative and min(every) < 0)
    terms = [(-n if turned else n, name) for n, name in (first, second) if n]
    terms.sort(key=lambda term: term[0] < 0)
    words = [name if abs(n) == 1 else f"{abs(n)} {name}" for n, name in terms]
    return f" {'-' if terms[-1][0] < 0 else '+'} ".join(words)


def _line(bearing: str, cause: str, order: int, name: str, direction: str, side: int, turn: float, kin: Kinematics) -> Line:
    """Of what turns by `turn` (rad/s) and is felt with the azimuth's harmonic `side`: 1 or -1 whirl."""
    whirl = int(side * np.sign(turn) * np.sign(kin.turning)) if direction == "radial" and abs(side) == 1 else 0
    return Line(bearing, cause, order, name, direction, whirl, abs(turn) / (2 * np.pi))


def lines(
    spindle: Spindle, kinematics_by_bearing: Mapping[str, Kinematics], speed: float, highest_multiple: int = 3,
    sidebands: Mapping[str, int] | None = None, highest_passing: int = 0,
) -> list[Line]:
    """All lines of linear theory for k up to `highest_multiple`, multiples of Z and even ball orders
    alike, in order of frequency; of a row with displaced rings with so many `sidebands` (by name; `SIDEBANDS`) as half
    its balls allow, and what its perfect balls do as they pass up to that multiple of Z or to the `highest_passing`.

    `speed` (rad/s) is the spindle's, of which what is unbalanced has its own ratio. Orders that
    stand still (order 1 of a ring at rest, anything at speed zero) excite nothing and are left out.
    """
    found: list[Line] = []
    for name in (b.name for b in spindle.rolling):
        kin = kinematics_by_bearing[name]
        sides = (sidebands or {}).get(name, SIDEBANDS)
        found += _sidebands(name, kin, highest_multiple, sides, highest_passing) if kin.displaced else _centred(name, kin, highest_multiple)
    found.append(unbalance_line(speed * unbalanced(spindle).speed_ratio))
    return sorted((line for line in found if line.frequency > SMALLEST), key=lambda line: line.frequency)


def _centred(name: str, kin: Kinematics, highest: int) -> Iterator[Line]:
    yield cage_line(name, kin, "ball size")
    yield cage_line(name, kin, "cage unbalance")
    for side in ("inner", "outer"):
        yield race_line(name, kin, side, 1, "radial")
        for passes in range(kin.balls, highest * kin.balls + 1, kin.balls):
            yield from (race_line(name, kin, side, passes + by, "radial") for by in (-1, 1))
            if kin.angled:
                yield race_line(name, kin, side, passes, "axial")
    for order in range(2, 2 * highest + 1, 2):
        yield from (ball_line(name, kin, order, "radial", by) for by in (-1, 1))
        if kin.angled:
            yield ball_line(name, kin, order, "axial")


def _sidebands(name: str, kin: Kinematics, highest: int, sidebands: int, highest_passing: int) -> Iterator[Line]:
    passing, perfect = (range(kin.balls, most * kin.balls + 1, kin.balls) for most in (highest, max(highest, highest_passing)))
    most = min(sidebands, (kin.balls - 1) // 2)
    sides = range(-most, most + 1)
    yield cage_line(name, kin, "cage unbalance")
    for direction in ("radial", "axial") if kin.angled else ("radial",):
        yield from (cage_line(name, kin, "ball size", times, direction) for times in range(1, most + 1))
        yield from (varying_line(name, kin, passes, direction) for passes in perfect)
        for ring in ("inner", "outer"):
            yield from (race_line(name, kin, ring, passes + by, direction, passes) for passes in (0, *passing) for by in sides if 0 < passes + by <= passing[-1] + 1)
        yield from (ball_line(name, kin, order, direction, by) for order in range(2, 2 * highest + 1, 2) for by in sides)
