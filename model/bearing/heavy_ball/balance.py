"""One ball with inertia between its two races: where its centre settles, and the stiffness it shows the outer ring.

Centrifugal force and gyroscopic moment make the inner and outer contact angles differ (Jones 1960; Harris 1991, Eqs. 9.9-9.25,
outer-race control). The ball's centre c and the outer groove's centre l are measured from the inner groove's, in the ball's r-z
plane. With phi the outer contact angle, e = (-cos phi, sin phi) from the ball to the outer groove and t = de/dphi across it,

    resultant on the ball  R = -F_i c/|c| + P + (C, 0) = 0,    force on the outer ring  P = F_o e - 2 M / D t:

a positive M pushes the ball towards a larger outer angle. C and M depend on both contact angles, the outer one by the gap l - c
between ball and outer groove and the inner one by c. With G = dR/dl, J = dP/dl, and S = -dR/dc, H = dP/dc where the gap is held,
dR/dc = -(S + G), and the ring sees k = J (S + G)^-1 S + H (S + G)^-1 G.

A ball by itself orbits as fast as rolling at its own two angles makes it. The balls of a row share a cage,
and orbit with its speed, the mean of those (`ball_row`): were each as fast as it would roll, the centrifugal
forces of a row whose rings are moved aside would add up to a force that only one of its rings feels.

With M the friction is no derivative of an energy, so k, the exact derivative of P, is not symmetric: for a row of the reference spindle the
radial-tilt entries differ by 7e-9 of their size at 7200 rpm, 7e-5 at 30,000, as the fourth power of the speed.

Plain numbers of one ball, which takes a few steps of a few operations, less than one call of an array library; the same formulas of many
balls at once, each on a line of its own, with arrays (balls,) in their place (`together`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt
from typing import NamedTuple

from thermospindle.model.bearing.heavy_ball.inertia import PLAIN, BallInertia, Functions, Number, Vector, rolling
from thermospindle.model.errors import NoEquilibrium

Matrix = tuple[Number, Number, Number, Number]
"""(rr, rz, zr, zz)."""

STEPS, FEW = 100, 6  # from where a ball may be, and from where it was
HALVINGS = 30
LONGEST = 0.05  # of the distance between the groove centres, in one step
LEAST_STRETCH = 0.02e-6  # m, pressed into the races at the start


@dataclass(frozen=True)
class HeavyBall:
    """A ball with inertia and its two contacts, as in `ball_row.BallRow`: unloaded lengths (m), Hertz constants (N/m^1.5)."""

    inner_length: float
    outer_length: float
    inner_constant: float
    outer_constant: float
    inertia: BallInertia


class Balance(NamedTuple):
    """Forces on a ball at one place of its `centre` (m), (r, z) components (N), and their derivatives (N/m): S, J, G and H above."""

    centre: Vector
    resultant: Vector
    on_outer: Vector
    inner: Number
    outer: Number
    inner_angle: Number
    outer_angle: Number
    deformation: Number
    by_inner: Matrix
    by_outer: Matrix
    by_line: Matrix
    passed_on: Matrix

    @property
    def off(self) -> float:
        """Size of the resultant (N)."""
        return hypot(*self.resultant)

    def stiffness(self) -> Matrix:
        """J (S + G)^-1 S + H (S + G)^-1 G: what the outer ring sees of the ball, whose centre follows it."""
        s, g = self.by_inner, self.by_line
        inverse = inverted((s[0] + g[0], s[1] + g[1], s[2] + g[2], s[3] + g[3]))
        own, passed = _product(self.by_outer, _product(inverse, s)), _product(self.passed_on, _product(inverse, g))
        return own[0] + passed[0], own[1] + passed[1], own[2] + passed[2], own[3] + passed[3]


def settled(ball: HeavyBall, line: Vector, tolerance: float, least: float, start: Vector | None = None) -> Balance:
    """The balance of a ball at rest, its resultant below `tolerance` (N), for the outer groove's centre at `line` (m).

    The energy of the two contacts less the work of the centrifugal force is convex, so a Newton step that is halved until the
    resultant falls finds its minimum where the gyroscopic friction is a small addition. Where it is not, as between rings that turn
    against each other, the ball is let drift there. `least` (N/m) is added to the stiffness of the step, for a ball that touches
    nothing. `start` is where its centre may be, as it was for a `line` near this one. Raises `NoEquilibrium`.
    """
    here = None if start is None else _approached(ball, line, tolerance, least, start, FEW)
    if here is None or here.off >= tolerance:
        here = _approached(ball, line, tolerance, least, start_of(ball, line), STEPS)
    if here.off >= tolerance:
        stuck, here = here, _drifted(ball, line, tolerance, least)
        if here.off >= tolerance:
            raise NoEquilibrium(f"ball centres did not settle; the largest residual is {stuck.off:.2g} N")
    return here


def _approached(ball: HeavyBall, line: Vector, tolerance: float, least: float, start: Vector, steps: int) -> Balance:
    """What so many of Newton's steps from `start` come to."""
    longest = LONGEST * hypot(*line)
    r, z = start
    here = balance(ball, start, line)
    for _ in range(steps):
        off = here.off
        if off < tolerance:
            return here
        s, g = here.by_inner, here.by_line
        inverse = inverted((s[0] + g[0] + least, s[1] + g[1], s[2] + g[2], s[3] + g[3] + least))
        step_r = inverse[0] * here.resultant[0] + inverse[1] * here.resultant[1]
        step_z = inverse[2] * here.resultant[0] + inverse[3] * here.resultant[1]
        factor = min(1.0, longest / max(hypot(step_r, step_z), 1e-30))
        for _ in range(HALVINGS):
            trial = (r + factor * step_r, z + factor * step_z)
            here = balance(ball, trial, line)
            if here.off <= off + tolerance:
                break
            factor /= 2
        r, z = trial
    return here


def _drifted(ball: HeavyBall, line: Vector, tolerance: float, least: float) -> Balance:
    """Where a ball comes to that the resultant on it pushes through something viscous:
    pseudo-transient continuation (Kelley and Keyes 1998).

    Rings that turn against each other leave a ball little centrifugal force and much moment. Where the friction 2 M / D across the
    outer race is more than the centrifugal force has across it, it carries a loose ball from the crossing of `start_of` over to the other
    one, where the drift begins, and a lightly pressed ball as far. On the way S + G is not positive, and halved steps end where it is
    singular and the resultant least, but not nothing. A drift may pass through a larger one. Each step is implicit, against a drag that
    lets the resultant carry the ball `LONGEST` at most and is twice what S + G falls short of nothing; it is Newton's at the end.
    """
    longest = LONGEST * hypot(*line)
    here = balance(ball, _other_side(start_of(ball, line), line), line)
    for _ in range(STEPS):
        if here.off < tolerance:
            break
        (s_rr, s_rz, s_zr, s_zz), (g_rr, g_rz, g_zr, g_zz) = here.by_inner, here.by_line
        rr, rz, zr, zz = s_rr + g_rr, s_rz + g_rz, s_zr + g_zr, s_zz + g_zz
        softest = (rr + zz) / 2 - sqrt(max((rr - zz) ** 2 / 4 + rz * zr, 0.0))
        drag = least + here.off / longest + 2 * max(-softest, 0.0)
        step_r, step_z = times(inverted((rr + drag, rz, zr, zz + drag)), here.resultant)
        factor = min(1.0, longest / max(hypot(step_r, step_z), 1e-30))
        here = balance(ball, (here.centre[0] + factor * step_r, here.centre[1] + factor * step_z), line)
    return here


def start_of(ball: HeavyBall, line: Vector) -> Vector:
    """Where the centre of a ball may be: between two races that press it; flung outward between two that do not.

    Then its centre lies where two circles meet, about the groove centres, each as far as its race
    is under the centrifugal force; or, where a ball on the outer race alone clears the inner one,
    on the radius of the outer groove's centre. Steps along a loose ball's circles would be many.
    """
    length = hypot(*line)
    along = -line[0] / length, abs(line[1]) / length
    flung = ball.inertia.loads(along, along).centrifugal
    inner, outer = (own + (flung / k) ** (2 / 3) for own, k in ((ball.inner_length, ball.inner_constant), (ball.outer_length, ball.outer_constant)))
    if inner + outer <= length or flung == 0.0:
        stretch = max(length - ball.inner_length - ball.outer_length, LEAST_STRETCH)
        share = (ball.inner_constant / ball.outer_constant) ** (2 / 3)
        reach = (ball.inner_length + stretch / (1 + share)) / length
        return line[0] * reach, line[1] * reach
    alone = line[0] + outer, line[1]
    if hypot(*alone) < ball.inner_length:
        return alone
    along = (length**2 + inner**2 - outer**2) / (2 * length)
    across = sqrt(max(inner**2 - along**2, 0.0))
    er, ez = line[0] / length, line[1] / length
    out = 1.0 if ez >= 0 else -1.0  # of the two crossings the one farther from the axis
    return along * er + across * abs(ez), along * ez - out * across * er


def _other_side(centre: Vector, line: Vector) -> Vector:
    """The mirror image of a centre at the line between the groove centres: the other crossing of two circles about these."""
    twice = 2 * (centre[0] * line[0] + centre[1] * line[1]) / (line[0] ** 2 + line[1] ** 2)
    return twice * line[0] - centre[0], twice * line[1] - centre[1]


def balance(ball: HeavyBall, centre: Vector, line: Vector, of: Functions = PLAIN) -> Balance:
    """Forces on a ball with its centre at `centre` (m), and their derivatives."""
    inner_length, (ir, iz), inner, inner_along = _contact(centre, ball.inner_length, ball.inner_constant, of)
    gap = (line[0] - centre[0], line[1] - centre[1])
    outer_length, (er, ez), outer, outer_along = _contact(gap, ball.outer_length, ball.outer_constant, of)
    cosine, sine = -er, ez
    loads = ball.inertia.loads((cosine, sine), (-ir, iz), of)
    # outer-race control: the friction that turns the ball's angular momentum acts at the outer contact, 2 M / D across it
    grip = 2 / ball.inertia.diameter * (outer > 0)
    friction, by_outer_angle, by_inner_angle = grip * loads.moment, grip * loads.moment_by_outer, grip * loads.moment_by_inner
    on_outer = (outer * er - friction * sine, outer * ez - friction * cosine)
    # across (sine, cosine) turns into (cosine, -sine) with the angle, which turns by across / length for a movement of the line
    turn_r, turn_z = -by_outer_angle * sine - friction * cosine, -by_outer_angle * cosine + friction * sine
    angle_r, angle_z = sine / outer_length, cosine / outer_length
    inner_r, inner_z = iz / inner_length, -ir / inner_length
    held = spring((ir, iz), inner_along, inner / inner_length)
    pulled = spring((er, ez), outer_along, outer / outer_length)
    by_outer = (pulled[0] + turn_r * angle_r, pulled[1] + turn_r * angle_z, pulled[2] + turn_z * angle_r, pulled[3] + turn_z * angle_z)
    drag_r, drag_z = -by_inner_angle * sine, -by_inner_angle * cosine
    passed_on = (drag_r * inner_r, drag_r * inner_z, drag_z * inner_r, drag_z * inner_z)
    flung_r, flung_z = loads.centrifugal_by_inner * inner_r, loads.centrifugal_by_inner * inner_z
    return Balance(
        centre,
        (on_outer[0] - inner * ir + loads.centrifugal, on_outer[1] - inner * iz),
        on_outer,
        inner,
        outer,
        of.atan2(abs(iz), -ir),
        of.atan2(abs(ez), -er),
        inner_length - ball.inner_length + outer_length - ball.outer_length,
        (held[0] - passed_on[0] - flung_r, held[1] - passed_on[1] - flung_z, held[2] - passed_on[2], held[3] - passed_on[3]),
        by_outer,
        (by_outer[0] + loads.centrifugal_by_outer * angle_r, by_outer[1] + loads.centrifugal_by_outer * angle_z, by_outer[2], by_outer[3]),
        passed_on,
    )


class Driven(NamedTuple):
    """What a ball that orbits with the cage has to do with its speed: its own by rolling (rad/s), the derivatives of that
    by the outer groove's centre (2,) and by the cage's speed, of the force on the outer ring (2,) by the cage's speed, and
    of its own speed by its centre (2,) while both grooves stand."""

    speed: Number
    by_line: Vector
    by_cage: Number
    force_by_cage: Vector
    by_centre: Vector


def driven(ball: HeavyBall, here: Balance, line: Vector, of: Functions = PLAIN) -> Driven:
    """Of a ball settled at `here` with its cage's speed, for the outer groove's centre at `line`; its centre follows both."""
    (cr, cz), gap = here.centre, (line[0] - here.centre[0], line[1] - here.centre[1])
    inner_length, outer_length = of.hypot(cr, cz), of.hypot(*gap)
    (ir, iz), cosine, sine = (cr / inner_length, cz / inner_length), -gap[0] / outer_length, gap[1] / outer_length
    own, loads = rolling(ball.inertia, here.centre, line, of), ball.inertia.loads((cosine, sine), (-ir, iz), of)
    friction = 2 / ball.inertia.diameter * (here.outer > 0) * loads.moment_by_speed
    on_outer = -friction * sine, -friction * cosine
    s, g, j = here.by_inner, here.by_line, here.by_outer
    inverse = inverted((s[0] + g[0], s[1] + g[1], s[2] + g[2], s[3] + g[3]))
    moved_r, moved_z = times(inverse, (on_outer[0] + loads.centrifugal_by_speed, on_outer[1]))  # of the centre, by the cage's speed
    follows = _product(inverse, g)  # and by the line
    pushed_r, pushed_z = times(j, (moved_r, moved_z))
    by_gap = own.by_outer * sine / outer_length, own.by_outer * cosine / outer_length
    by_centre = own.by_inner * iz / inner_length - by_gap[0], -own.by_inner * ir / inner_length - by_gap[1]
    return Driven(
        own.speed,
        (by_gap[0] + by_centre[0] * follows[0] + by_centre[1] * follows[2], by_gap[1] + by_centre[0] * follows[1] + by_centre[1] * follows[3]),
        by_centre[0] * moved_r + by_centre[1] * moved_z,
        (on_outer[0] - pushed_r, on_outer[1] - pushed_z),
        by_centre,
    )


def thicker(ball: HeavyBall, here: Balance, rolls: Driven, line: Vector, of: Functions = PLAIN) -> tuple[tuple[Number, Number, Number], tuple[Number, Number, Number]]:
    """What a ball, settled as in `driven`, does that is thicker at its inner, and at its outer contact, while its cage keeps its speed: derivatives
    of the force on the outer ring, r and z (N/m), and of its own speed by rolling (rad/s m). The contact that is pressed
    pushes the ball, whose centre gives way by (S + G)^-1 of that."""
    s, g, (cr, cz), gap = here.by_inner, here.by_line, here.centre, (line[0] - here.centre[0], line[1] - here.centre[1])
    inverse = inverted((s[0] + g[0], s[1] + g[1], s[2] + g[2], s[3] + g[3]))
    inner = -1.5 * ball.inner_constant ** (2 / 3) * here.inner ** (1 / 3) / of.hypot(cr, cz)
    outer = 1.5 * ball.outer_constant ** (2 / 3) * here.outer ** (1 / 3) / of.hypot(*gap)
    towards = outer * gap[0], outer * gap[1]
    found = []
    for push, direct in (((inner * cr, inner * cz), (0.0, 0.0)), (towards, towards)):
        moved = times(inverse, push)
        held = times(here.by_outer, moved)
        found.append((direct[0] - held[0], direct[1] - held[1], rolls.by_centre[0] * moved[0] + rolls.by_centre[1] * moved[1]))
    return found[0], found[1]


def _contact(vector: Vector, unloaded: float, constant: float, of: Functions) -> tuple[Number, Vector, Number, Number]:
    """Length (m) and direction of a line between centres, contact force K d^1.5 (N) and its slope (N/m)."""
    length = of.hypot(*vector)
    pressed = of.larger(length - unloaded, 0.0)
    root = constant * of.sqrt(pressed)
    return length, (vector[0] / length, vector[1] / length), root * pressed, 1.5 * root


def spring(e: Vector, along: Number, across: Number) -> Matrix:
    """along e e^T + across (1 - e e^T)."""
    rr, rz, zz = e[0] * e[0], e[0] * e[1], e[1] * e[1]
    more = along - across
    return across + more * rr, more * rz, more * rz, across + more * zz


def inverted(m: Matrix) -> Matrix:
    determinant = m[0] * m[3] - m[1] * m[2]
    if not (determinant if isinstance(determinant, float) else determinant.all()):
        raise NoEquilibrium("a ball touches neither race and nothing holds it")
    return m[3] / determinant, -m[1] / determinant, -m[2] / determinant, m[0] / determinant


def times(m: Matrix, v: Vector) -> Vector:
    return m[0] * v[0] + m[1] * v[1], m[2] * v[0] + m[3] * v[1]


def _product(a: Matrix, b: Matrix) -> Matrix:
    return a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]
