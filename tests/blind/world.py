"""Campaigns by a structurally different program: another mesh, another solver of the bearings,
other physics where a model is free to differ.

`World` says in what; its defaults are the fitted program's own choices, and then `answer` is the same FRF by another
way. Nothing of `sim.effects` or `sim.operating` is used: rings from `thermal.expand`, ball rows and their tangent from
`model.bearing`, the axial balance solved here, matrices from the chain, and hidden physics (`hidden`) at each step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tests.blind.departures import distributed, perturbed
from tests.blind.hidden import Hidden
from tests.blind.hidden_structure import excited, on_spring
from tests.blind.laws import REFERENCE, Place
from thermospindle.model.bearing.ball_row import BallRow, by_own_orbits
from thermospindle.model.bearing.centred import centred_axial_force
from thermospindle.model.bearing.pair import BearingState, PairState, bearing_state, contact_status
from thermospindle.model.bearing.row import reference_motion, row_at
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.model.rotor.chain import Matrices, RotorBase, matrices, motion_rows, rotor_base
from thermospindle.model.rotor.poles import Poles, poles
from thermospindle.model.types import Array, ComplexArray
from thermospindle.thermal.expansion import expand
from thermospindle.thermal.influence import TOLERANCE

STEPS = ("spindle", "temperatures", "motions", "bearings", "chain", "gain", "delay", "decay", "hammer")
LARGE = 60  # degrees of freedom from which FRFs come from all poles instead of line by line


@dataclass(frozen=True)
class World:
    """In what this program differs; nothing by default."""

    mesh: float = TOLERANCE  # of the ring motions: coarser or finer than the model's
    constant_kept: bool = False  # Hertz constants as at 20 C
    grooves_follow_faces: float = 0.0  # share in which a groove grows as its ring's face does, not by its own free strain
    weak_mode: tuple[float, float, float] | None = None  # mass (kg), frequency (Hz), damping ratio: on the lowest standing body
    stiffness_error: float = 0.0  # of each mode, constant: rms of a random symmetric modal matrix
    damping_error: float = 0.0  # of the modal damping matrix, alike: not proportional
    seed: int = 0  # of the modal matrices
    gain_drift: float = 0.0  # from test to test, each channel
    motions: tuple[float, float] = (1.0, 1.0)  # thermal motions of the rings in radius and along the axis, over the model's: other coefficients of expansion
    hammer_gain: float = 0.0  # of each hammer's force, in all tests
    hammer_drift: float = 0.0  # of it from test to test
    miss: float = 0.0  # m, of each hammer beside its point, on either way, in all tests
    miss_drift: float = 0.0  # m, of it from test to test
    place: float = 0.0  # m, of each sensor beside its point, on either way, in all tests
    askew: float = 0.0  # rad, of each sensor out of its direction, alike
    late: float = 0.0  # s, of each channel behind the force
    own_orbits: bool = False  # each ball as fast as it rolls by itself, and not with its cage
    hysteretic: float = 0.0  # share of what is lost that does not grow with frequency: of a complex stiffness, of FRFs that come line by line
    masses: tuple[float, ...] = ()  # by what shares bodies and shafts have their mass otherwise (`distributed`)
    off: tuple[tuple[str, float], ...] = ()  # build parameters, and how many times what the scene says they are


@dataclass(frozen=True)
class Plan:
    """One test as its record tells it."""

    temperature: float  # C
    speed: float  # rad/s

    def place(self, spindle: Spindle) -> Place:
        return self.temperature, abs(self.speed) / spindle.nominal_speed


@dataclass(frozen=True)
class Record:
    """How FRFs are made from hits: `kind` line, exponential or rectangular; times in s, `end` the window's value there."""

    kind: str = "line"
    length: float = 0.3
    end: float = 1.0
    hits: int = 1
    told: str = "nothing"  # nothing, sd (from repeats) or noise (from the data sheet)
    times: float = 1.0  # noise over the data sheet's

    @property
    def decay(self) -> float:
        return float(-np.log(self.end) / self.length)


@dataclass(frozen=True, eq=False)
class Answer:
    """One test before noise: matrices, rows of points and hammers, and the measuring chain."""

    linear: Matrices
    responses: Array
    references: Array
    gain: Array
    delay: Array
    decay: float
    status: str  # "in contact", or which bearing lost contact
    hysteretic: tuple[float, float] = (0.0, 1.0)  # share, and rad/s at which it is as much as a damper's

    def frf(self, frequency: Array, window: float = 0.0) -> ComplexArray:
        """Mobility (n_resp, n_ref, n) at `frequency` (Hz), by the dynamic stiffness line by line,
        of a flexible shaft by all its poles; the window is in it."""
        s = 2j * np.pi * frequency + self.decay + window
        if len(self.linear.mass) > LARGE and not self.hysteretic[0]:
            p: Poles = poles(self.linear)
            residue = (self.responses @ p.right)[:, None, :] * (p.left @ self.references.T).T[None] * p.value
            return residue @ (1 / (s - p.value[:, None])) * self._channels(frequency)
        return np.einsum("ri,fij,f->rjf", self.responses, self._solved(s, self.references.T), s) * self._channels(frequency)

    def by_modes(self, frequency: Array, vectors: Array) -> tuple[ComplexArray, ComplexArray]:
        """Derivatives (m, n_resp, n_ref, n) of the mobility by K + x v v^T and by C + x v v^T, for every column v of `vectors` (n, m)."""
        s = 2j * np.pi * frequency + self.decay
        u = self._solved(s, np.hstack([self.references.T, vectors]))
        hammers = len(self.references)
        there = np.einsum("ri,fim->mrf", self.responses, u[:, :, hammers:])
        back = np.einsum("im,fij->mjf", vectors, u[:, :, :hammers])
        moved = -s * there[:, :, None] * back[:, None] * self._channels(frequency)
        return moved, s * moved

    def moved(self, frequency: Array, ways: tuple[ComplexArray, ComplexArray], to: Matrices) -> ComplexArray:
        """Derivative (n_resp, n_ref, n) of the mobility along what other matrices are more than these, by the `ways` of these."""
        s, (there, back) = 2j * np.pi * frequency + self.decay, ways
        total = np.zeros((len(self.responses), len(self.references), len(s)), complex)
        for power, name in enumerate(("stiffness", "damping", "mass")):
            more = getattr(to, name) - getattr(self.linear, name)
            own = np.flatnonzero(more.any(axis=0) | more.any(axis=1))
            total -= np.moveaxis(there[:, :, own] @ (more[np.ix_(own, own)] @ back[:, own]), 0, -1) * s ** (power + 1)
        return total * self._channels(frequency)

    def ways(self, frequency: Array) -> tuple[ComplexArray, ComplexArray]:
        """Displacements of the responses under forces anywhere (lines, n_resp, n), and of everything under the hammers (lines, n, n_ref)."""
        s = 2j * np.pi * frequency + self.decay
        if len(self.linear.mass) > LARGE:
            p = poles(self.linear)
            by_line = 1 / (s[:, None] - p.value)
            return (self.responses @ p.right * by_line[:, None]) @ p.left, p.right @ (by_line[:, :, None] * (p.left @ self.references.T))
        own = self.linear
        across = replace(self, linear=replace(own, mass=own.mass.T, damping=own.damping.T, stiffness=own.stiffness.T))
        return across._solved(s, self.responses.T).swapaxes(1, 2), self._solved(s, self.references.T)

    def _solved(self, s: ComplexArray, forces: Array) -> ComplexArray:
        """Displacements (lines, n, k) under `forces` (n, k)."""
        m, c, k = self.linear.mass, self.linear.damping, self.linear.stiffness
        (share, omega), lost = self.hysteretic, (c + c.T) / 2  # the rest is gyroscopic
        dynamic = s[:, None, None] ** 2 * m + s[:, None, None] * (c - share * lost) + (k + 1j * share * omega * lost)
        return np.linalg.solve(dynamic, np.broadcast_to(forces, (len(s), *forces.shape)))

    def transformed(self, frequency: Array, record: Record) -> ComplexArray:
        """Mobility as a record of finite length shows it: every mode's e^(pole t) under the window, cut at the record's end (leakage)."""
        p: Poles = poles(self.linear)
        residue = (self.responses @ p.right)[:, None, :] * (p.left @ self.references.T).T[None] * p.value
        away = 2j * np.pi * frequency[None, :] + self.decay + record.decay - p.value[:, None]
        return residue @ ((1 - np.exp(-away * record.length)) / away) * self._channels(frequency)

    def _channels(self, frequency: Array) -> ComplexArray:
        return (self.gain[:, None] * np.exp(-2j * np.pi * frequency * self.delay[:, None]))[:, None, :]


# ---------------------------------------------------------------- one condition


def answer(
    spindle: Spindle,
    condition: Condition,
    world: World,
    hidden: Sequence[Hidden] = (),
    place: Place | None = None,
    hits: Array | None = None,
    sensors: tuple[Array, Array] | None = None,
) -> Answer:
    """A spindle at a condition, in a world, with hidden physics; `place` is where their laws are
    asked, by default the condition, `hits` (hammers, 3) where hammers are aimed at, by default their
    points, and `sensors` where these sit and what way they look (points, 3), by default theirs."""
    if place is None:
        place = condition.temperature, abs(condition.speed) / spindle.nominal_speed

    def changed(step: str, state: Any) -> Any:
        for h in hidden:
            if step in h.acts:
                state = h.acts[step](spindle, h.amount(place), state)
        return state

    drawing, spindle = spindle, changed("spindle", spindle)
    regions = {g.name: condition.temperature for g in spindle.regions}
    uniform = not any("temperatures" in h.acts for h in hidden)
    motions = expand(spindle, condition.temperature if uniform else changed("temperatures", regions), world.mesh)
    motions = {b: _otherwise(m, *world.motions) for b, m in motions.items()}
    motions = changed("motions", dict(motions))
    state = balanced(
        spindle, condition, {b: _grooves(spindle, b, m, world.grooves_follow_faces) for b, m in motions.items()}, world.constant_kept
    )
    if world.own_orbits:
        state = replace(state, bearings=tuple(_on_own_orbit(spindle, b) for b in state.bearings))
    chain = rotor_base(spindle, replace(state, bearings=changed("bearings", state.bearings)))
    chain = changed("chain", distributed(chain, spindle, world.masses))
    if world.weak_mode is not None:
        chain = on_spring(chain, lowest(spindle), "weak", *world.weak_mode, excited(spindle))
    linear = matrices(chain)
    if world.stiffness_error or world.damping_error:
        linear = perturbed(linear, drawn_matrices(drawing, world), drawing, (world.stiffness_error, world.damping_error), world.seed)
    n = len(spindle.points)
    hammers = points_struck(spindle) if hits is None else hits
    gain, delay = changed("gain", np.ones(n)), changed("delay", np.zeros(n))
    references = [
        row_of(chain, spindle.point(node).body, at, spindle.point(node).direction)
        for node, at in zip(spindle.hammer.hammer_nodes, changed("hammer", hammers), strict=True)
    ]
    responses = [row_of(chain, p.body, *own) for p, *own in zip(spindle.points, *(points_read(spindle) if sensors is None else sensors), strict=True)]
    lost = world.hysteretic, 2 * np.pi * spindle.structure.damping_frequency
    return Answer(linear, np.array(responses), np.array(references), gain, delay, changed("decay", 0.0), state.status, lost)


def points_struck(spindle: Spindle) -> Array:
    """Positions (hammers, 3) of the points that hammers strike."""
    return np.array([spindle.point(node).position for node in spindle.hammer.hammer_nodes], float)


def points_read(spindle: Spindle) -> tuple[Array, Array]:
    """Positions and directions (points, 3) of the measuring points."""
    return np.array([p.position for p in spindle.points], float), np.array([p.direction for p in spindle.points], float)


def lowest(spindle: Spindle) -> str:
    """The first body that neither turns nor is carried: the base."""
    return spindle.structure.bodies[0].name


def row_of(chain: RotorBase, body: str, position: Sequence[float], direction: Sequence[float]) -> Array:
    at = [float(x) for x in position]
    return np.asarray(np.array(direction) @ motion_rows(chain, body, at)[:3])


def balanced(spindle: Spindle, condition: Condition, motions: Mapping[str, RingMotion], constant_kept: bool) -> PairState:
    """Axial equilibrium of two rows fixed in their seats, or of one behind a spring whose force is the preload wherever it slides."""
    pair, rows = spindle.sets[0], {}
    for b in spindle.bearings:
        row = row_at(spindle, b, b.sense, motions[b.name], condition.speed)
        if constant_kept:
            cold = row_at(spindle, b, b.sense, reference_motion(spindle.reference_temperature), 0.0)
            row = replace(row, inner_constant=cold.inner_constant, outer_constant=cold.outer_constant)
        rows[b.name] = row
    spring = pair.spring
    if spring is None:
        external = sum(b.sense * b.preload for b in spindle.bearings) + spindle.axial_load
        hub = moved(list(rows.values()), external)
        slid = hub
    elif spring.rate is None:
        push = spindle.bearing(spring.rings_of[0]).sense * pair.preload
        slid = moved([rows[spring.rings_of[0]]], push)
        hub = moved([row for name, row in rows.items() if name not in spring.rings_of], spindle.axial_load - push)
    else:
        raise NotImplementedError("a preload spring with a rate")
    found = []
    for b in spindle.bearings:
        movement = slid if spring is not None and b.name in spring.rings_of else hub
        loaded = replace(rows[b.name], axial=rows[b.name].axial + movement)
        found.append(replace(bearing_state(spindle, b, loaded), movement=movement))
    return PairState(condition, tuple(found), hub, contact_status(tuple(found)))


def moved(rows: Sequence[BallRow], external: float) -> float:
    """Movement (m) at which the rows carry `external` (N) together."""

    def left(h: float) -> float:
        return sum(centred_axial_force(row, h) for row in rows) - external

    start = 0.0
    if any(row.inertia is not None for row in rows):
        start = moved([replace(row, inertia=None) for row in rows], external)
    reach = 1e-9
    while left(start - reach) > 0 or left(start + reach) < 0:
        reach *= 3
        if reach > 5e-4:
            raise ValueError("the bearings find no axial equilibrium within 0.5 mm")
    return float(brentq(left, start - reach, start + reach, xtol=1e-17, rtol=1e-14))


def _on_own_orbit(spindle: Spindle, b: BearingState) -> BearingState:
    more = by_own_orbits(b.row)
    return replace(b, stiffness=b.stiffness + more, damping=b.damping + spindle.structure.damping_time(spindle.bearing(b.name).damping_ratio) * more)


def _otherwise(motion: RingMotion, radial: float, axial: float) -> RingMotion:
    """A motion whose material expands otherwise: grooves stay, which grow with their ring's steel."""
    return replace(
        motion,
        inner_r=radial * motion.inner_r,
        outer_r=radial * motion.outer_r,
        inner_z=axial * motion.inner_z,
        outer_z=axial * motion.outer_z,
    )


def _grooves(spindle: Spindle, name: str, motion: RingMotion, share: float) -> RingMotion:
    """Grooves that grow with their ring's face: its radial movement over its radius."""
    if not share:
        return motion
    b = spindle.bearing(name)
    inner, outer = motion.inner_r / spindle.region(b.inner_ring).r[1], motion.outer_r / spindle.region(b.outer_ring).r[0]
    return replace(
        motion,
        inner_strain=(1 - share) * motion.inner_strain + share * inner,
        outer_strain=(1 - share) * motion.outer_strain + share * outer,
    )


def drawn_matrices(spindle: Spindle, world: World) -> Matrices:
    """Those of the drawing at 20 C and rest in a world whose modes have no errors, which these are told in."""
    return answer(spindle, Condition(REFERENCE), replace(world, stiffness_error=0.0, damping_error=0.0, weak_mode=None)).linear
