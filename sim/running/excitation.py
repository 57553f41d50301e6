"""What excites a running spindle: unbalance, waviness, ball sizes and the cage, as steady harmonic forces on the rotor-base chain.

Every imperfection of a row is turned into the displacement u of the outer ring against the inner one that leaves the loads on the
rings as they were, the *free displacement*. With e from the inner to the outer groove centre of a ball, k = k_n e e^T + F/L (1 - e e^T)
its exact 2x2 stiffness, B its kinematics and K the row's 5x5 stiffness (`model.bearing.ball_row`),

    K u = - sum over balls of B^T (k w + k_n e p),

w the displacement of the outer race less that of the inner one at the ball (m; r, z) and p what the ball is too thick by at its two
contacts. The bearing then pulls with K (q - u) + C (q' - u') instead of K q + C q', so that a race displaced as a whole (a radial wave of
order 1) moves its ring by exactly that, whatever stands in series with the row. On the outer body act K u + C u', on the inner one
the opposite. Sums over balls are taken in numbers: orders that cancel are found to cancel, not said to.

Roller bearings do the same with line contacts (`sim.running.rollers`).

Unbalance U at its height gives U omega^2, a couple unbalance W the moment W omega^2. An unbalanced cage is taken as guided by the outer
ring: U omega_cage^2 acts on the outer body at the bearing.

Sources: Wardle 1988 (parts 1 and 2); Jang & Jeong 2002, 2003; Harris, *Rolling Bearing Analysis*, 3rd ed., ch. 25; Lynagh et al. 2000.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from thermospindle.model.bearing.ball_row import BallRow, respond, with_cage_held
from thermospindle.model.bearing.kinematics import (
    SMALLEST,
    Kinematics,
    Line,
    ball_line,
    cage_line,
    race_line,
    row_kinematics,
    unbalance_line,
)
from thermospindle.model.bearing.pair import BearingState, check_centred
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.carrier import unbalance_carrier
from thermospindle.model.rotor.chain import RotorBase, element_rows, matrices, motion_rows
from thermospindle.model.rotor.poles import LARGE, Poles, poles
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.rollers import free_displacements as rollers_displaced
from thermospindle.sim.running.whirl import whirling

CANCELLED = 1e-11
"""Share of the largest possible sum over the balls below which an order has cancelled; rounding leaves some 1e-15."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """Forces (n, dofs) on the chain's degrees of freedom, one row a line, as functions of the line's phase s(t).

    f = Re[(stiffness + i s' damping + (s'^2 - i s'') mass) exp(i s)] summed over the lines; at constant speed s = 2 pi frequency t.
    """

    line: tuple[Line, ...]
    stiffness: ComplexArray  # N, N m
    damping: ComplexArray  # N s, N m s
    mass: ComplexArray  # kg m, kg m2

    def without(self, cause: str) -> Excitation:
        """The same without the lines of one cause."""
        kept = [n for n, line in enumerate(self.line) if line.cause != cause]
        return Excitation(tuple(self.line[n] for n in kept), self.stiffness[kept], self.damping[kept], self.mass[kept])


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Steady forces at one operating point: f(t) = Re(sum of force exp(2 pi i frequency t)), one entry a line.

    Lines of the same frequency and different causes stay separate entries.
    """

    line: tuple[Line, ...]
    frequency: Array  # (n,) Hz
    force: ComplexArray  # (n, dofs) N, N m


def harmonics(point: OperatingPoint) -> Harmonics:
    """The steady forces of a running spindle's imperfections at its own speed; none at rest."""
    return at_speed(excitation(point), 1.0)


def at_speed(found: Excitation, ratio: float) -> Harmonics:
    """The steady forces at `ratio` times the speed the excitation was worked out for; its contact angles stay."""
    frequency = ratio * np.array([line.frequency for line in found.line])
    omega = 2 * np.pi * frequency[:, None]
    force = found.stiffness + 1j * omega * found.damping + omega**2 * found.mass
    return Harmonics(found.line, frequency, force)


def response(point: OperatingPoint, forces: Harmonics, known: Callable[[], Poles] | None = None) -> ComplexArray:
    """Displacement phasors (n, dofs) of the chain under the forces, by the exact linear model at
    the point's speed, whose poles may be `known`.

    q(t) = Re(sum of response exp(2 pi i frequency t)).
    """
    return chain_response(point.chain, forces, known)


def chain_response(chain: RotorBase, forces: Harmonics, known: Callable[[], Poles] | None = None) -> ComplexArray:
    """As `response`, of a chain."""
    linear = matrices(chain)
    if len(linear.mass) > LARGE:  # one eigenproblem for all lines
        p = known() if known else poles(linear)
        modal = forces.force @ p.left.T / (2j * np.pi * forces.frequency[:, None] - p.value)
        return np.asarray(modal @ p.right.T)
    omega = 2 * np.pi * forces.frequency[:, None, None]
    dynamic = linear.stiffness - omega**2 * linear.mass + 1j * omega * linear.damping
    found = np.linalg.solve(dynamic, forces.force[:, :, None])[:, :, 0].astype(np.complex128)
    return found


def excitation(point: OperatingPoint, imperfections: Imperfections | None = None) -> Excitation:
    """All lines that a point's imperfections, or others in their place, excite, in order of frequency."""
    check_centred(point.spindle, point.state, "what imperfections excite")
    present = point.imperfections if imperfections is None else imperfections
    n = len(point.chain.dofs)
    parts: dict[Line, ComplexArray] = {}

    def add(line: Line, kind: int, force: ComplexArray) -> None:
        if line.frequency > SMALLEST:
            parts.setdefault(line, np.zeros((3, n), complex))[kind] += force

    for line, force in _unbalance(point, present):
        add(line, 2, force)
    chain, elements = point.chain, {e.name: e for e in point.chain.elements}
    bearings = {b.name: b for b in point.spindle.rolling}
    for name, kin in row_kinematics(point.spindle, point.state).items():
        bearing, own, element = bearings[name], present.row(name), elements[name]
        if own.cage_unbalance:
            whirl = whirling(own.cage_unbalance * np.exp(1j * own.cage_phase), kin.cage)
            outer = motion_rows(chain, bearing.outer_body, (0.0, 0.0, bearing.z))
            add(cage_line(name, kin, "cage unbalance"), 2, whirl @ outer[:2])
        rows = element_rows(chain, element)
        to_element = np.eye(5)  # of a bending shaft, the element may stand at another height than its bearing
        to_element[0, 4], to_element[1, 3] = element.z - bearing.z, bearing.z - element.z
        rollers = point.state.rollers.get(name)
        displaced = free_displacements(point.state.bearing(name), kin, own) if rollers is None else rollers_displaced(rollers, kin, own)
        free = np.array([moved for _, moved in displaced]).reshape(-1, 5) @ to_element.T
        by_stiffness, by_damping = (free @ (matrix @ rows) for matrix in (element.stiffness, element.damping))
        for k, (line, _) in enumerate(displaced):
            add(line, 0, by_stiffness[k])
            add(line, 1, by_damping[k])
    found = sorted(parts, key=lambda line: line.frequency)
    forces = np.array([parts[line] for line in found]).reshape(len(found), 3, n)
    return Excitation(tuple(found), forces[:, 0], forces[:, 1], forces[:, 2])


def _unbalance(point: OperatingPoint, own: Imperfections) -> Iterator[tuple[Line, ComplexArray]]:
    if not (own.unbalance or own.couple_unbalance):
        return
    carrier = unbalance_carrier(point.spindle, own)
    speed = point.condition.speed * carrier.speed_ratio
    rows = motion_rows(point.chain, carrier.name, (0.0, 0.0, own.unbalance_z))
    if own.unbalance:
        yield unbalance_line(speed), whirling(own.unbalance * np.exp(1j * own.unbalance_phase), speed) @ rows[:2]
    if own.couple_unbalance:  # height times a force towards the phase turns about a quarter turn further
        yield unbalance_line(speed), whirling(1j * own.couple_unbalance * np.exp(1j * own.couple_phase), speed) @ rows[3:]


# ---------------------------------------------------------------- one row


@dataclass(frozen=True, eq=False)
class Felt:
    """What the balls of a row feel of one wave: each pulls the rings by `pull` (2,) N/m (r, z) times Re(amplitude exp(i rate t)).

    `amplitude` (balls,) m; `rate` (rad/s) in the frame of the cage; `line` names what comes of it (direction,
    and +1 or -1 for the sense of the rate in which it adds to the cage's). Where it does the same to all
    balls at once the cage's speed changes with them, and each pulls by `all_pull` along the axis.
    """

    amplitude: ComplexArray
    rate: float
    pull: Array
    all_pull: float
    line: Callable[[str, int], Line]


def free_displacements(bearing: BearingState, kin: Kinematics, own: RowImperfections) -> list[tuple[Line, ComplexArray]]:
    """Free displacements (5,) m, rad of the outer ring against the inner one: phasors, read only, with the line of each."""
    return _free_displacements(bearing.name, bearing.row, kin, own) if bearing.in_contact else []


@lru_cache(maxsize=128)
def _free_displacements(name: str, row: BallRow, kin: Kinematics, own: RowImperfections) -> list[tuple[Line, ComplexArray]]:
    felt = list(_felt(name, row, kin, own))
    if not felt:
        return []
    place = np.exp(2j * np.pi * np.arange(kin.balls) / kin.balls)
    amplitude = np.array([f.amplitude for f in felt])
    limit = CANCELLED * np.abs(amplitude).sum(axis=1)
    along, plus, minus = amplitude.sum(axis=1), amplitude @ place / 2, amplitude.conj() @ place / 2
    found: list[tuple[Line, ComplexArray]] = []
    for n, f in enumerate(felt):
        if abs(along[n]) > limit[n] and f.rate != 0.0:
            size = along[n] if f.rate > 0 else along[n].conjugate()
            found.append((f.line("axial", 0), f.all_pull * size * np.array([0, 0, 1, 0, 0], complex)))
        for side, across in ((1, plus[n]), (-1, minus[n])):
            if abs(across) > limit[n]:
                speed = kin.cage + side * f.rate
                force, moment = whirling(f.pull[0] * across, speed), whirling(-1j * row.arm * f.pull[1] * across, speed)
                found.append((f.line("radial", side), np.array([*force, 0, *moment])))
    displaced = -np.array([force for _, force in found]).reshape(-1, 5) @ np.linalg.inv(respond(row).tangent).T
    displaced.flags.writeable = False
    return [(line, moved) for (line, _), moved in zip(found, displaced, strict=True)]


def _felt(name: str, row: BallRow, kin: Kinematics, own: RowImperfections) -> Iterator[Felt]:
    ball = np.arange(kin.balls)
    place = np.exp(2j * np.pi * ball / kin.balls)
    one = replace(row, balls=1)
    local, of_all = (respond(r).tangent[np.ix_([0, 2], [0, 2])] for r in (with_cage_held(one), one))
    for ring, sign, radial, axial in (("inner", -1, own.inner_radial, own.inner_axial), ("outer", 1, own.outer_radial, own.outer_axial)):
        for pull, all_pull, waves in zip(sign * local.T, sign * of_all[1], (radial, axial), strict=True):
            for wave in waves:
                amplitude = cmath.rect(wave.amplitude, wave.phase) * place[wave.order * ball % kin.balls]
                rate = wave.order * (kin.cage - kin.ring(ring))
                yield Felt(amplitude, rate, pull, float(all_pull), _race_namer(name, kin, ring, wave.order))
    if not own.ball_diameter and not own.ball_waves:
        return
    (inner_push, outer_push), (inner_all, outer_all) = contact_pushes(with_cage_held(row)), contact_pushes(row)
    if own.ball_diameter:  # half of it at either contact; a common deviation is a preload
        size = np.array(own.ball_diameter, complex)
        line = cage_line(name, kin, "ball size")
        yield Felt(size - size.mean(), 0.0, (inner_push + outer_push) / 2, 0.0, lambda direction, side: line)
    for order in sorted({wave.order for waves in own.ball_waves for wave in waves}):
        pull, all_pull = inner_push + (-1) ** order * outer_push, float(inner_all[1] + (-1) ** order * outer_all[1])  # the outer contact lies opposite the inner one
        if np.abs(pull).max() > CANCELLED * np.abs(inner_push).max():
            amplitude = np.array([_amplitude(waves, order) for waves in own.ball_waves])
            rate = order * kin.spin * np.sign(kin.turning)
            yield Felt(amplitude, float(rate), pull, all_pull, _ball_namer(name, kin, order))


@lru_cache(maxsize=256)
def contact_pushes(row: BallRow) -> tuple[Array, Array]:
    """Force (2,) N/m (r, z) on the outer ring's holder for a ball that is too thick at its inner, and at its outer contact; read only.

    k_n e for both where the ball has no inertia; else by central differences of the ball's equilibrium (1e-8).
    """
    if row.inertia is None or row.inertia.share == 0.0:
        line = np.array([-row.radial, row.axial])
        length = float(np.hypot(*line))
        push = 1.5 * row.constant * np.sqrt(max(length - row.unloaded_distance, 0.0)) * line / length
        return push, push
    one = replace(row, balls=1)
    h = 1e-4 * float(respond(one).deformation[0])

    def force(inner: float, outer: float) -> Array:
        return respond(replace(one, inner_length=row.inner_length - inner, outer_length=row.outer_length - outer)).force[[0, 2]]

    return (force(h, 0.0) - force(-h, 0.0)) / (2 * h), (force(0.0, h) - force(0.0, -h)) / (2 * h)


def _race_namer(bearing: str, kin: Kinematics, ring: str, order: int) -> Callable[[str, int], Line]:
    return lambda direction, side: race_line(bearing, kin, ring, order, direction)


def _ball_namer(bearing: str, kin: Kinematics, order: int) -> Callable[[str, int], Line]:
    return lambda direction, side: ball_line(bearing, kin, order, direction, side)


def _amplitude(waves: tuple[Wave, ...], order: int) -> complex:
    return sum((cmath.rect(w.amplitude, w.phase) for w in waves if w.order == order), 0j)
