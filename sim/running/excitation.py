"""What excites a running spindle: unbalance, waviness, ball sizes and the cage, as steady harmonic forces on the rotor-base chain.

Every imperfection of a row is turned into the displacement u of the outer ring against the inner one that leaves the loads on the
rings as they were, the *free displacement*. With e from the inner to the outer groove centre of a ball, k = k_n e e^T + F/L (1 - e e^T)
its exact 2x2 stiffness, B its kinematics and K the row's 5x5 stiffness (`model.bearing.ball_row`),

    K u = - sum over balls of B^T (k w + k_n e p),

w the displacement of the outer race less that of the inner one at the ball (m; r, z) and p what the ball is too thick by at its two
contacts. The bearing then pulls with K (q - u) + C (q' - u') instead of K q + C q', so that a race displaced as a whole (a radial wave of
order 1) moves its ring by exactly that, whatever stands in series with the row. On the outer body act K u + C u', on the inner one
the opposite (`sim.running.rows`, of line contacts too).

Where a radial load or weight displaces rings, k and e are those of each azimuth (`sim.running.pulls`), displacements are from the mean
loaded place, and what a perfect row does as its balls pass is excited with the rest, with any imperfections or none. That stiffness changes meanwhile is left out,
and with it what imperfections do that is as small (`pulls`); `sim.running.moving_balls` has all of it.

Unbalance U at its height gives U omega^2, a couple unbalance W the moment W omega^2. An unbalanced cage is taken as guided by the outer
ring: U omega_cage^2 acts on the outer body at the bearing.

Sources: Wardle 1988 (parts 1 and 2); Jang & Jeong 2002, 2003; Harris, *Rolling Bearing Analysis*, 3rd ed., ch. 25; Lynagh et al. 2000.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from thermospindle.model.bearing.kinematics import SMALLEST, Line, cage_line, row_kinematics, unbalance_line
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.carrier import unbalance_carrier
from thermospindle.model.rotor.chain import Matrices, RotorBase, element_rows, matrices, motion_rows
from thermospindle.model.rotor.poles import LARGE, Poles, poles
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.rows import free_displacements
from thermospindle.sim.running.whirl import whirling


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


def response(point: OperatingPoint, forces: Harmonics) -> ComplexArray:
    """Displacement phasors (n, dofs) of the chain under the forces, by the exact linear model at the point's speed.

    q(t) = Re(sum of response exp(2 pi i frequency t)).
    """
    return _moved(point.linear, lambda: point.poles, forces)


def chain_response(chain: RotorBase, forces: Harmonics) -> ComplexArray:
    """As `response`, of a chain."""
    linear = matrices(chain)
    return _moved(linear, lambda: poles(linear), forces)


def _moved(linear: Matrices, known: Callable[[], Poles], forces: Harmonics) -> ComplexArray:
    if len(linear.mass) > LARGE:  # one eigenproblem for all lines
        p = known()
        modal = forces.force @ p.left.T / (2j * np.pi * forces.frequency[:, None] - p.value)
        return np.asarray(modal @ p.right.T)
    omega = 2 * np.pi * forces.frequency[:, None, None]
    dynamic = linear.stiffness - omega**2 * linear.mass + 1j * omega * linear.damping
    found = np.linalg.solve(dynamic, forces.force[:, :, None])[:, :, 0].astype(np.complex128)
    return found


def excitation(point: OperatingPoint, imperfections: Imperfections | None = None) -> Excitation:
    """All lines that a point's imperfections, or others in their place, excite, and those of perfect rows
    between displaced rings, in order of frequency."""
    present = point.imperfections if imperfections is None else imperfections
    n = len(point.chain.dofs)
    parts: dict[Line, ComplexArray] = {}

    def add(line: Line, kind: int, force: ComplexArray) -> None:
        if line.frequency > SMALLEST:
            parts.setdefault(line, np.zeros((3, n), complex))[kind] += force

    for line, force in _unbalance(point, present):
        add(line, 2, force)
    chain, elements = point.chain, {e.name: e for e in point.chain.elements}
    bearings, rolling = {b.name: b for b in point.spindle.rolling}, {b.name: b for b in point.state.rolling}
    for name, kin in row_kinematics(point.spindle, point.state).items():
        bearing, own, element = bearings[name], present.row(name), elements[name]
        if own.cage_unbalance:
            whirl = whirling(own.cage_unbalance * np.exp(1j * own.cage_phase), kin.cage)
            outer = motion_rows(chain, bearing.outer_body, (0.0, 0.0, bearing.z))
            add(cage_line(name, kin, "cage unbalance"), 2, whirl @ outer[:2])
        rows = element_rows(chain, element)
        to_element = np.eye(5)  # of a bending shaft, the element may stand at another height than its bearing
        to_element[0, 4], to_element[1, 3] = element.z - bearing.z, bearing.z - element.z
        displaced = free_displacements(rolling[name], kin, own)
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
