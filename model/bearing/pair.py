"""The ball rows against each other: axial equilibrium of the hub at a temperature, and the bearing states that follow.

Jang, Kim, Han, Kim (2003): contact angle and deformation from ring motion, Eqs. (1)-(5); load-deflection and stiffness, Eqs. (6),
(7); the hub moves until the axial forces balance, Eq. (8) and Fig. 5. Besides the ball (Eq. 3) the grooves grow too, which makes
a uniform expansion of everything leave the contact angle alone. The secant method of Fig. 5 is replaced by a bracketing one:
every row's axial force rises monotonically with the hub's movement, so the root is unique and cannot be missed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from thermospindle.model.bearing.ball_row import BallInertia, BallRow, RowForce, centred_axial_force, respond
from thermospindle.model.bearing.hertz import in_series, race_contact
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Bearing, Condition, PreloadSpring, RingMotion, Spindle
from thermospindle.model.types import Array


@dataclass(frozen=True)
class BearingState:
    """One bearing at its operating point; forces in N, lengths in m, angles in rad.

    `stiffness`, `damping`: (5, 5) between the inner and the outer body at the ring centre, order x, y, z, tilt_x, tilt_y.
    `row` is the ball row at its loaded position. `movement` is the rigid axial
    movement of its outer ring against its inner one, beyond thermal expansion.
    """

    name: str
    z: float
    contact_angle: float
    outer_contact_angle: float
    deformation: float
    contact_force: float
    ball_stiffness: float
    preload: float
    stiffness: Array
    damping: Array
    row: BallRow
    in_contact: bool
    movement: float = 0.0

    @property
    def radial_stiffness(self) -> float:
        return float(self.stiffness[0, 0])

    @property
    def axial_stiffness(self) -> float:
        return float(self.stiffness[2, 2])

    @property
    def tilt_stiffness(self) -> float:
        return float(self.stiffness[3, 3])

    @property
    def coupling_stiffness(self) -> float:
        """Radial force per tilt, k_x,tilt_y (N/rad)."""
        return float(self.stiffness[0, 4])


@dataclass(frozen=True)
class PairState:
    """All bearings at one condition.

    `hub_movement` (m) is the rigid axial movement of the outer rings' body against that of the inner rings. Every bearing's ring makes it
    too, but one behind a spring, which slides in its seat (`BearingState.movement`).
    """

    condition: Condition
    bearings: tuple[BearingState, ...]  # in the order of Spindle.bearings
    hub_movement: float
    status: str  # "in contact", or which bearing lost contact

    def bearing(self, name: str) -> BearingState:
        return next(b for b in self.bearings if b.name == name)


def reference_motion(temperature: float) -> RingMotion:
    """Rings that have not moved: the reference state."""
    return RingMotion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, temperature)


def solve(spindle: Spindle, condition: Condition, motions: Mapping[str, RingMotion]) -> PairState:
    """Axial equilibrium of the pair under the thermal ring `motions` (by bearing name)."""
    pair = spindle.pair
    rows = {b.name: row_at(spindle, b, b.sense, motions[b.name], condition.speed) for b in spindle.bearings}
    if pair.spring is not None:
        hub, slid = _sprung(spindle, rows, pair.spring)
    else:
        # a tandem pair carries all shares together, from outside; opposed ones carry each other's
        hub = slid = _balance(list(rows.values()), sum(b.sense for b in spindle.bearings) * pair.preload + pair.axial_bias)
    states = []
    for b in spindle.bearings:
        movement = slid if pair.spring is not None and pair.spring.ring_of == b.name else hub
        states.append(replace(bearing_state(spindle, b, replace(rows[b.name], axial=rows[b.name].axial + movement)), movement=movement))
    return PairState(condition, tuple(states), hub, contact_status(tuple(states)))


def _sprung(spindle: Spindle, rows: Mapping[str, BallRow], spring: PreloadSpring) -> tuple[float, float]:
    """Movements (m) of the outer rings' body, and of the ring behind the spring.

    With H the body's movement, R the ring's and s its sense, the spring pushes the ring by s P - k (R - H), so the sprung row carries
    f(R) = s P - k (R - H), and the others, which locate the body, what is left of the axial bias: sum of all f = bias. The first gives
    R(H), rising with H, and the second is monotonic in H then. It is the same whether the inner or the outer ring slides.
    """
    pair, own = spindle.pair, rows[spring.ring_of]
    push = spindle.bearing(spring.ring_of).sense * pair.preload
    others = [row for name, row in rows.items() if name != spring.ring_of]
    if spring.rate is None:
        return _balance(others, pair.axial_bias - push), _movement_for(own, push)
    rate = spring.rate

    def slid(row: BallRow, hub: float) -> float:
        return _root([row], lambda rows, r: centred_axial_force(rows[0], r) + rate * (r - hub) - push)

    def imbalance(rows: list[BallRow], hub: float) -> float:
        first, *rest = rows
        return centred_axial_force(first, slid(first, hub)) + sum(centred_axial_force(row, hub) for row in rest) - pair.axial_bias

    hub = _root([own, *others], imbalance)
    return hub, slid(own, hub)


def contact_status(bearings: tuple[BearingState, ...]) -> str:
    """The status of a pair: that all bearings are in contact, or which of them is not."""
    loose = [b.name for b in bearings if not b.in_contact]
    return "in contact" if not loose else f"{' and '.join(loose)} bearing lost contact"


def row_at(spindle: Spindle, b: Bearing, sense: int, motion: RingMotion, speed: float) -> BallRow:
    """The ball row of bearing `b` with its rings moved by `motion` and the hub not yet moved.

    The groove curvature centres move with the rings, plus the growth of the groove radii and of their distance from the ring's
    middle: Jang et al. 2003, Eqs. (1)-(5).
    """
    loaded = b.unloaded_distance + reference_deformation(spindle, b)
    radial = loaded * np.cos(b.contact_angle)
    axial = loaded * np.sin(b.contact_angle)
    d, fi, fo = b.ball_diameter, b.inner_conformity, b.outer_conformity
    radial += motion.inner_r + fi * d * motion.inner_strain - (motion.outer_r - fo * d * motion.outer_strain)
    inner_share = (fi - 0.5) / (fi + fo - 1)  # the groove centres lie off the ring's middle by this share of their distance
    growth = inner_share * motion.inner_strain + (1 - inner_share) * motion.outer_strain
    axial += sense * (motion.outer_z - motion.inner_z) + growth * axial
    ball_radius = d / 2 * (1 + motion.ball_strain)
    inner_constant, outer_constant = contact_constants(spindle, b, motion, float(np.arctan2(axial, radial)))
    return BallRow(
        balls=b.balls,
        radial=float(radial),
        axial=float(sense * axial),
        inner_length=fi * d * (1 + motion.inner_strain) - ball_radius,
        outer_length=fo * d * (1 + motion.outer_strain) - ball_radius,
        inner_constant=inner_constant,
        outer_constant=outer_constant,
        arm=b.pitch_diameter / 2,
        inertia=_ball_inertia(spindle, b, speed),
    )


def reference_deformation(spindle: Spindle, b: Bearing) -> float:
    """Deformation (m) of each ball under the preload at the reference temperature, both contacts: Eq. (6) inverted."""
    constants = contact_constants(spindle, b, reference_motion(spindle.reference_temperature), b.contact_angle)
    return float((spindle.pair.preload / (b.balls * np.sin(b.contact_angle)) / in_series(*constants)) ** (2 / 3))


def contact_constants(spindle: Spindle, b: Bearing, motion: RingMotion, angle: float) -> tuple[float, float]:
    """Hertz constants (inner, outer) at the temperature of `motion`, with its grown ball and its elastic moduli."""
    ball, ring = (
        (spindle.materials[name].youngs_modulus(motion.temperature), spindle.materials[name].poisson_ratio)
        for name in (b.ball_material, b.ring_material)
    )
    d = b.ball_diameter * (1 + motion.ball_strain)
    inner, outer = (
        race_contact(d, f * b.ball_diameter * (1 + strain) / d, b.pitch_diameter * (1 + strain), angle, is_inner, ball, ring).stiffness
        for f, strain, is_inner in (
            (b.inner_conformity, motion.inner_strain, True),
            (b.outer_conformity, motion.outer_strain, False),
        )
    )
    return inner, outer


def _ball_inertia(spindle: Spindle, b: Bearing, speed: float) -> BallInertia | None:
    if speed == 0.0 or spindle.pair.ball_inertia == 0.0:
        return None
    inner, outer = (0.0, speed) if spindle.pair.turning_ring == "outer" else (speed, 0.0)
    density = spindle.materials[b.ball_material].density
    return BallInertia(b.ball_diameter, b.pitch_diameter, density, inner, outer, spindle.pair.ball_inertia)


def _balance(rows: list[BallRow], external: float) -> float:
    """Hub movement at which the axial forces of all rows add up to `external`: Jang et al. 2003, Eq. (8)."""
    return _root(rows, lambda rows, h: sum(centred_axial_force(row, h) for row in rows) - external)


def _movement_for(row: BallRow, force: float) -> float:
    """Movement of one outer ring under a constant axial force."""
    return _root([row], lambda rows, h: centred_axial_force(rows[0], h) - force)


def _root(rows: list[BallRow], imbalance: Callable[[list[BallRow], float], float]) -> float:
    """The movement without imbalance, by bracketing; balls with inertia are bracketed about the answer of balls without."""
    massless = [replace(row, inertia=None) for row in rows]
    start = _bracketed(lambda h: imbalance(massless, h), 0.0, 1e-6)
    if all(row.inertia is None for row in rows):
        return start
    return _bracketed(lambda h: imbalance(rows, h), start, 1e-9)


def _bracketed(imbalance: Callable[[float], float], start: float, reach: float) -> float:
    while reach < 5e-3:
        if imbalance(start - reach) <= 0 <= imbalance(start + reach):
            return float(brentq(imbalance, start - reach, start + reach, xtol=1e-17, rtol=1e-14))
        reach *= 4
    raise NoEquilibrium(f"the bearings find no axial equilibrium within {reach * 1e3:.1f} mm of hub movement")


def bearing_state(spindle: Spindle, b: Bearing, row: BallRow) -> BearingState:
    """What bearing `b` is with its balls as in `row`, centred rings at their loaded position."""
    answer: RowForce = respond(row)
    zeta, omega = b.damping_ratio, 2 * np.pi * spindle.structure.damping_frequency
    deformation = float(answer.deformation[0])
    return BearingState(
        name=b.name,
        z=b.z,
        contact_angle=float(answer.inner_angle[0]),
        outer_contact_angle=float(answer.outer_angle[0]),
        deformation=deformation,
        contact_force=float(answer.ball_force[0]),
        ball_stiffness=1.5 * row.constant * max(deformation, 0.0) ** 0.5,
        preload=abs(float(answer.force[2])),
        stiffness=answer.tangent,
        damping=2 * zeta / omega * answer.tangent,
        row=row,
        in_contact=bool(answer.in_contact.all()),
    )
