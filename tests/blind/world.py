"""Campaigns by a structurally different program: another mesh, another solver of the bearings, other physics where a model is free to differ.

`World` says in what; its defaults are the fitted program's own choices, and then `answer` is the same FRF by another way. Nothing of `sim.effects`
or `sim.operating` is used: rings from `thermal.expand`, ball rows and their tangent from `model.bearing`, the axial balance solved here, matrices
from the chain, and hidden physics (`hidden`) at each step. A campaign is a spindle off its drawing, thermometers and channels a little wrong, and
noise either on every line or in time, where decaying records are cut, windowed and transformed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tests.blind.hidden import REFERENCE, Hidden, Place, excited, on_spring
from thermospindle.model.bearing.ball_row import BallRow, centred_axial_force
from thermospindle.model.bearing.pair import PairState, bearing_state, contact_status, reference_motion, row_at
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.model.rotor.chain import Matrices, RotorBase, matrices, motion_rows, rotor_base
from thermospindle.model.rotor.modes import Poles, poles
from thermospindle.model.tolerance import toleranced
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test
from thermospindle.sim.identification.frf import Frf
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

    def frf(self, frequency: Array, window: float = 0.0) -> ComplexArray:
        """Mobility (n_resp, n_ref, n) at `frequency` (Hz), by the dynamic stiffness line by line, of a flexible shaft by all its poles; the window
        is in it."""
        s = 2j * np.pi * frequency + self.decay + window
        if len(self.linear.mass) > LARGE:
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

    def _solved(self, s: ComplexArray, forces: Array) -> ComplexArray:
        """Displacements (lines, n, k) under `forces` (n, k)."""
        m, c, k = self.linear.mass, self.linear.damping, self.linear.stiffness
        dynamic = s[:, None, None] ** 2 * m + s[:, None, None] * c + k
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


def answer(spindle: Spindle, condition: Condition, world: World, hidden: Sequence[Hidden] = (), place: Place | None = None) -> Answer:
    """A spindle at a condition, in a world, with hidden physics; `place` is where their laws are asked, by default the condition."""
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
    motions = changed("motions", dict(motions))
    state = balanced(
        spindle, condition, {b: _grooves(spindle, b, m, world.grooves_follow_faces) for b, m in motions.items()}, world.constant_kept
    )
    chain = rotor_base(spindle, replace(state, bearings=changed("bearings", state.bearings)))
    chain = changed("chain", chain)
    if world.weak_mode is not None:
        chain = on_spring(chain, lowest(spindle), "weak", *world.weak_mode, excited(spindle))
    linear = matrices(chain)
    if world.stiffness_error or world.damping_error:
        linear = perturbed(linear, drawing, world)
    n = len(spindle.points)
    hammers = np.array([spindle.point(node).position for node in spindle.hammer.hammer_nodes])
    gain, delay = changed("gain", np.ones(n)), changed("delay", np.zeros(n))
    references = [
        row_of(chain, spindle.point(node).body, at, spindle.point(node).direction)
        for node, at in zip(spindle.hammer.hammer_nodes, changed("hammer", hammers), strict=True)
    ]
    responses = [row_of(chain, p.body, p.position, p.direction) for p in spindle.points]
    return Answer(linear, np.array(responses), np.array(references), gain, delay, changed("decay", 0.0), state.status)


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


def perturbed(linear: Matrices, spindle: Spindle, world: World) -> Matrices:
    """K and C with a random symmetric matrix in the modes of the drawing at 20 C and rest, the same in every test. A weak mode is none of these: it
    stays an oscillator on its body, which modal errors of the spindle do not couple to anything else."""
    reference = answer(spindle, Condition(REFERENCE), replace(world, stiffness_error=0.0, damping_error=0.0, weak_mode=None)).linear
    root = np.sqrt(np.diag(reference.mass))
    square, vectors = np.linalg.eigh(reference.stiffness / root[:, None] / root[None, :])
    omega = np.sqrt(np.maximum(square, 0.0))
    back = root[:, None] * vectors  # M phi: takes modal matrices to the dofs'
    own = vectors.T @ (reference.damping / root[:, None] / root[None, :]) @ vectors
    loss = np.sqrt(np.maximum(np.diag(own), 0.0))
    random = np.random.default_rng([world.seed, 51])

    def symmetric() -> Array:
        g = random.standard_normal((len(root), len(root)))
        return np.tril(g) + np.tril(g, -1).T

    of_k, of_c = symmetric(), symmetric()
    in_band = omega < 2 * np.pi * 2 * spindle.hammer.band[1]
    of_k, of_c = (g * in_band[:, None] * in_band[None, :] for g in (of_k, of_c))
    more_k = world.stiffness_error * 2 * omega[:, None] * omega[None, :] * of_k  # a mode's frequency is wrong by half of that
    more_c = world.damping_error * loss[:, None] * loss[None, :] * of_c
    n = len(root)  # what is hidden, and a weak mode, may have added bodies, after these
    stiffness, damping = linear.stiffness.copy(), linear.damping.copy()
    stiffness[:n, :n] += back @ more_k @ back.T
    damping[:n, :n] += back @ more_c @ back.T
    return replace(linear, stiffness=stiffness, damping=damping)


# ---------------------------------------------------------------- a campaign


@dataclass(frozen=True, eq=False)
class Made:
    """A campaign, and what it was made of: the built spindle, and every test's true condition."""

    campaign: Campaign
    built: Spindle
    world: World
    record: Record
    plans: tuple[Plan, ...]
    hidden: tuple[Hidden, ...]


def plans(random: np.random.Generator, spindle: Spindle) -> tuple[Plan, ...]:
    """Four to eight tests between 15 and 65 C, some turning, or all at rest."""
    style = random.choice(["both", "both", "both", "rest", "grid"])
    count, top = int(random.integers(4, 9)), spindle.nominal_speed
    if style == "grid":
        temperatures = [20.0, 40.0, 60.0] if count > 5 else [20.0, 60.0]
        found = [Plan(t, n) for n in (0.0, top) for t in temperatures]
    else:
        rest = count if style == "rest" else int(random.integers(2, count - 1))
        cold = np.linspace(20.0, 60.0, rest).round()
        found = [Plan(float(t), 0.0) for t in cold]
        for _ in range(count - rest):
            found.append(Plan(float(random.choice([20.0, 30.0, 40.0, 50.0, 60.0])), float(random.choice([0.5, 1.0])) * top))
    return tuple(dict.fromkeys(found))


def drawn_world(random: np.random.Generator, spindle: Spindle) -> World:
    """Differences of every kind, each at a size of its own."""
    body = spindle.structure.body(lowest(spindle))

    def log(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    weak = (body.mass * log(1e-4, 2e-3), float(random.uniform(700.0, 5500.0)), log(0.01, 0.05)) if random.random() < 0.5 else None
    return World(
        mesh=float(random.choice([1e-3, 2e-5])),
        constant_kept=bool(random.random() < 0.5),
        grooves_follow_faces=float(random.choice([0.0, 0.0, random.uniform(0.0, 1.0)])),
        weak_mode=weak,
        stiffness_error=log(1e-3, 1e-2),
        damping_error=log(0.01, 0.1),
        seed=int(random.integers(2**31)),
        gain_drift=0.002,
    )


def drawn_record(random: np.random.Generator) -> Record:
    told, times = str(random.choice(["nothing", "sd", "noise"])), float(random.choice([0.5, 1.0, 2.0]))
    if random.random() < 0.5:
        return Record(told="noise" if told == "sd" else told, times=1.0 if told != "nothing" else times)
    hits, length = int(random.integers(3, 9)), float(random.choice([0.15, 0.3, 0.6]))
    told = "nothing" if told == "noise" else told
    if random.random() < 0.5:
        return Record("exponential", length, float(random.choice([0.3, 0.05])), hits, told, times)
    return Record("rectangular", length, 1.0, hits, told, times)


def campaign(
    spindle: Spindle, tests: Sequence[Plan], hidden: Sequence[Hidden], seed: int, world: World | None = None, record: Record | None = None
) -> Made:
    """One campaign; the seed draws the world and the record (unless given), tolerances, errors and noise."""
    random = np.random.default_rng([seed, 61])
    own, rec = drawn_world(random, spindle), drawn_record(random)
    world, record = world or own, record or rec
    built = spindle
    for parameter in toleranced(spindle):
        built = parameter.apply(built, parameter.sd * float(np.clip(random.standard_normal(), -3, 3)))
    gain = 1 + spindle.tolerances.gain * random.standard_normal(len(spindle.points))
    hidden = in_contact(built, tests, world, hidden)
    made = []
    for k, plan in enumerate(tests):
        true = plan.temperature + spindle.tolerances.temperature * random.standard_normal()
        at = answer(built, Condition(true, plan.speed), world, hidden, plan.place(spindle))
        drift = 1 + world.gain_drift * random.standard_normal(len(gain))
        frf = measured(replace(at, gain=at.gain * gain * drift), spindle, record, random)
        name = f"T{plan.temperature:g}_n{plan.speed * 30 / np.pi:.0f}_{k}"
        made.append(Test(name, plan.temperature, plan.speed, frf=frf, window_decay=record.decay))
    stated = Noise(spindle.hammer.noise_of_value, spindle.hammer.noise_of_largest) if record.told == "noise" else None
    found = Campaign(f"blind {seed}", spindle.name, "mobility", spindle.points, tuple(made), stated)
    return Made(found, built, world, record, tuple(tests), tuple(hidden))


def in_contact(spindle: Spindle, tests: Sequence[Plan], world: World, hidden: Sequence[Hidden]) -> Sequence[Hidden]:
    """What is hidden, halved until every bearing carries load in every test, whatever the thermometer's error: a spindle that rattles has no FRF."""
    off = 4 * spindle.tolerances.temperature
    places = [Condition(p.temperature + by, p.speed) for p in tests for by in (-off, off)]
    for _ in range(10):
        if all(answer(spindle, at, world, hidden).status == "in contact" for at in places):
            return hidden
        hidden = [replace(h, size=h.size / 2) for h in hidden]
    raise ValueError("the spindle as it is built rattles with nothing hidden")


def measured(at: Answer, spindle: Spindle, record: Record, random: np.random.Generator) -> Frf:
    """The FRFs of one test as the analyser writes them."""
    nodes, sd = tuple(p.node for p in spindle.points), None
    hammer = spindle.hammer
    if record.kind == "line":
        frequency = np.arange(hammer.band[0], hammer.band[1] + 1, 2.5)
        value = at.frf(frequency, record.decay)
        one, two = (random.standard_normal((2, *value.shape)) / np.sqrt(2) for _ in range(2))
        largest = np.abs(value).max(axis=(0, 2), keepdims=True)
        value = value + record.times * hammer.noise_of_value * np.abs(value) * (one[0] + 1j * one[1])
        value = value + record.times * hammer.noise_of_largest * largest * (two[0] + 1j * two[1])
    else:
        step = 1 / hammer.sample_rate
        samples = round(record.length * hammer.sample_rate)
        lines = np.fft.rfftfreq(samples, step)
        use = (lines >= hammer.band[0]) & (lines <= hammer.band[1])
        frequency, window = lines[use], np.exp(-record.decay * step * np.arange(samples))
        value = at.transformed(frequency, record)
        force = half_sine(frequency, np.pi * np.sqrt(hammer.hammer_mass / hammer.tip_stiffness))
        # white noise in time whose spectrum, averaged over the hits, has the data sheet's share of the largest answer where the force is whole
        largest = np.abs(value).max(axis=(0, 2), keepdims=True)
        level = record.times * hammer.noise_of_largest * largest * np.sqrt(record.hits) / np.sqrt(np.sum(window**2))
        seen = []
        for _ in range(record.hits):
            noise = level * random.standard_normal((*value.shape[:2], samples)) * window
            seen.append(value + np.fft.rfft(noise, axis=-1)[:, :, use] / force)
        hits = np.array(seen)
        value = hits.mean(axis=0)
        if record.told == "sd":
            sd = np.sqrt(np.sum(np.abs(hits - value) ** 2, axis=0) / (record.hits - 1) / record.hits)
    return Frf(frequency, value, nodes, hammer.hammer_nodes, "mobility", sd=sd)


def half_sine(frequency: Array, length: float) -> Array:
    """Magnitude of the spectrum of a half-sine pulse over its value at 0 Hz."""
    x = frequency * length
    return np.abs(np.cos(np.pi * x) / (1 - 4 * x**2 + 1e-12))


def described(made: Made, spindle: Spindle) -> dict[str, Any]:
    """What a row of the study says of a world; `leakage` is its largest error of a line at 20 C and rest, in standard deviations of noise."""
    leakage = 0.0
    if made.record.kind != "line":
        frequency, at = np.arange(*spindle.hammer.band, 10.0), answer(spindle, Condition(REFERENCE), World())
        exact = at.frf(frequency, made.record.decay)
        size = made.record.times * spindle.hammer.noise_of_largest * np.abs(exact).max(axis=(0, 2), keepdims=True)
        leakage = float((np.abs(at.transformed(frequency, made.record) - exact) / size).max())
    return {"world": asdict(made.world), "record": asdict(made.record), "leakage": leakage}


# ---------------------------------------------------------------- how visible what is hidden is


def visibility(made: Made, spindle: Spindle, lines: int = 160) -> list[float]:
    """Of every hidden piece: its change of the FRFs in standard errors, after all that build tolerances, temperatures, gains and each mode's
    constant error, and what couples any two, can take of it. Linear, about the built spindle; sqrt(10) is worth 5 in ln evidence. Of the piece itself and of a hundredth of it times a
    hundred the smaller: what moves peaks by many widths is no longer what small tolerances do, but a larger tolerance may do the same."""
    hammer = spindle.hammer
    frequency = np.linspace(*hammer.band, lines)
    plain = replace(made.world, stiffness_error=0.0, damping_error=0.0)

    def all_tests(s: Spindle, hidden: Sequence[Hidden] = (), warmer: float = 0.0) -> list[ComplexArray]:
        return [answer(s, Condition(p.temperature + warmer, p.speed), plain, hidden, p.place(spindle)).frf(frequency) for p in made.plans]

    base = all_tests(made.built)
    dense = made.campaign.tests[0].frf.frequency.size / lines  # type: ignore[union-attr]
    sd = []
    for v in base:
        largest = np.abs(v).max(axis=(0, 2), keepdims=True)
        of_value = hammer.noise_of_value * (made.record.kind == "line")
        sd.append(made.record.times * np.sqrt((of_value * np.abs(v)) ** 2 + (hammer.noise_of_largest * largest) ** 2) / np.sqrt(dense))

    def column(values: Sequence[ComplexArray]) -> Array:
        z = np.concatenate([((v - b) / s).ravel() for v, b, s in zip(values, base, sd, strict=True)])
        return np.concatenate([z.real, z.imag]) * np.sqrt(2)

    columns = []
    for parameter in toleranced(spindle):
        small = parameter.sd / 10
        columns.append(column(all_tests(parameter.apply(made.built, small))) * 10)
    warm = all_tests(made.built, (), 0.02)
    for k in range(len(base)):
        columns.append(
            column([w if i == k else b for i, (w, b) in enumerate(zip(warm, base, strict=True))]) * spindle.tolerances.temperature / 0.02
        )
    for i in range(len(spindle.points)):
        pick = (np.arange(len(spindle.points)) == i)[:, None, None]
        columns.append(column([b * (1 + spindle.tolerances.gain * pick) for b in base]))
        for k in range(len(base)):
            columns.append(column([b * (1 + made.world.gain_drift * pick * (j == k)) for j, b in enumerate(base)]))
    columns += _modal_columns(made, column, frequency, plain, spindle)
    a = np.array(columns).T
    lower = np.linalg.cholesky(np.eye(a.shape[1]) + a.T @ a)
    found = []
    for h in made.hidden:
        seen = []
        for share in (1.0, 0.01):
            d = column(all_tests(made.built, [replace(h, size=share * h.size)])) / share
            seen.append(float(np.sqrt(max(d @ d - np.sum(np.linalg.solve(lower, a.T @ d) ** 2), 0.0))))
        found.append(min(seen))
    return found


def _modal_columns(made: Made, column, frequency: Array, plain: World, spindle: Spindle) -> list[Array]:
    """Every mode's constant stiffness and damping error, and what couples every two of them, one at a time."""
    answers = [answer(made.built, Condition(p.temperature, p.speed), plain) for p in made.plans]
    reference = answer(made.built, Condition(REFERENCE), plain).linear
    root = np.sqrt(np.diag(reference.mass))
    square, vectors = np.linalg.eigh(reference.stiffness / root[:, None] / root[None, :])
    back = root[:, None] * vectors
    seen = np.flatnonzero((square > 1.0) & (square < (2 * np.pi * 1.2 * spindle.hammer.band[1]) ** 2))
    v = back[:, seen] * np.sqrt(square[seen])
    one, two = np.triu_indices(len(seen), 1)
    plainly = [at.frf(frequency) for at in answers]
    moved = []
    for at in answers:
        by_one = at.by_modes(frequency, v)
        by_sum = at.by_modes(frequency, v[:, one] + v[:, two])  # (v + w)(v + w)^T less v v^T and w w^T couples the two
        moved.append([np.concatenate([of_one, of_sum - of_one[one] - of_one[two]]) for of_one, of_sum in zip(by_one, by_sum, strict=True)])
    omega = np.sqrt(np.concatenate([square[seen], np.sqrt(square[seen][one] * square[seen][two])]))
    found = []
    for j, w in enumerate(omega):
        for kind, size in enumerate((2 * made.world.stiffness_error, made.world.damping_error * 0.02 / w)):
            if size:
                found.append(column([p + size * m[kind][j] for p, m in zip(plainly, moved, strict=True)]))
    return found
