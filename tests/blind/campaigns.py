"""A campaign of that world: its tests, thermometers and channels a little wrong, and noise either
on every line or in time, where decaying records are cut, windowed and transformed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from tests.blind.departures import ways_of_mass
from tests.blind.hidden import Hidden
from tests.blind.laws import REFERENCE
from tests.blind.world import Answer, Plan, Record, World, answer, lowest, points_read, points_struck
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.drawing.measuring import HammerTest
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test
from thermospindle.sim.identification.frf import Frf

HAMMERS_FROM = 2000
"""The first seed whose world has thermal motions that are off and hammers with gains of their own: seeds before it were judged without."""

MASSES_FROM = 2140
"""The first seed in whose world bodies have their mass otherwise than drawn."""

SENSORS_FROM = 2900
"""The first seed in whose world sensors sit beside their points and look askew."""

CONVENTIONS_FROM = 3200
"""The first seed in whose world channels may be a little late, balls on orbits of their own, and
losses of FRFs that are made line by line those of a complex stiffness."""

DRAWINGS_FROM = 3574
"""The first seed whose scene may be far off: in one campaign of four one to three joints or standing bodies of a spindle
are not what it says, by a tenth to six tenths, in all tests. A tolerance is a few per cent, so that this is no tolerance."""

BY_HAND = 2e-4
"""How far (m) from its point a hammer is known to hit before its misses are told from each other, of the two that worlds have."""


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


def further(world: World, seed: int, spindle: Spindle) -> World:
    """With what worlds have from seed `HAMMERS_FROM` on: thermal motions that are off by a per cent, hammers whose
    force is off and drifts and that hit beside their points, another way in each test; from `MASSES_FROM` on
    bodies that have their mass otherwise, by some thousandths; from `SENSORS_FROM` on sensors that are glued by
    hand; from `CONVENTIONS_FROM` on what honest programs do otherwise, and modules for sound and vibration; and from
    `DRAWINGS_FROM` on scenes that are wrong."""
    if seed < HAMMERS_FROM:
        return world
    if seed >= DRAWINGS_FROM:
        world = replace(world, off=far_off(np.random.default_rng([seed, 109]), spindle))
    if seed >= CONVENTIONS_FROM:
        other = np.random.default_rng([seed, 103])
        world = replace(world, late=float(other.choice([0.0, 1e-8, 3e-8])), own_orbits=bool(other.random() < 0.5), hysteretic=float(other.choice([0.0, 0.5, 1.0])))
    if seed >= SENSORS_FROM:
        glued = np.random.default_rng([seed, 97])
        world = replace(world, place=float(glued.choice([1e-4, 4e-4])), askew=float(glued.choice([5e-3, 0.02, 0.03])))
    if seed >= MASSES_FROM:
        own = np.random.default_rng([seed, 89])
        world = replace(world, masses=tuple((float(own.choice([1e-3, 3e-3, 6e-3])) * own.standard_normal(ways_of_mass(spindle))).tolist()))
    random = np.random.default_rng([seed, 73])
    radial, axial = (float(f) for f in 1 + random.choice([3e-3, 0.01, 0.02]) * random.standard_normal(2))
    misses = {"miss": float(random.choice([5e-5, BY_HAND])), "miss_drift": float(random.choice([0.0, 3e-5, 1e-4]))}
    return replace(world, motions=(radial, axial), hammer_gain=float(random.choice([1e-3, 5e-3, 0.02])), hammer_drift=float(random.choice([0.0, 1e-3, 4e-3])), **misses)


def far_off(random: np.random.Generator, spindle: Spindle) -> tuple[tuple[str, float], ...]:
    """Joints and masses of standing bodies that are not what the scene says, and how many times it they are; mostly none."""
    if random.random() >= 0.25:
        return ()
    joints = [j.name for j in spindle.structure.joints]
    standing = [b.name for b in spindle.structure.bodies if not b.turns]
    may = [p.name for p in toleranced(spindle) if _is_of(p.name, joints, "stiffness") or _is_of(p.name, standing, "mass")]
    chosen = random.choice(may, min(int(random.choice([1, 1, 2, 3])), len(may)), replace=False)
    return tuple((str(name), float(random.uniform(1.1, 1.6) ** random.choice([-1, 1]))) for name in chosen)


def _is_of(name: str, owners: Sequence[str], what: str) -> bool:
    return name.endswith(what) and any(name.startswith(f"{owner} ") for owner in owners)


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
    own = further(own, seed, spindle)
    world, record = world or own, record or rec
    if record.kind != "line":
        world = replace(world, hysteretic=0.0)  # what decays in time does not lose so
    built = spindle
    off = dict(world.off)
    for parameter in toleranced(spindle):
        deviation = parameter.sd * float(np.clip(random.standard_normal(), -3, 3))
        built = parameter.apply(built, (1 + deviation) * off.get(parameter.name, 1.0) - 1)
    gain = 1 + spindle.tolerances.gain * random.standard_normal(len(spindle.points))
    hits = np.random.default_rng([seed, 79])
    aimed, faces = points_struck(spindle), faces_struck(spindle)
    force = 1 + world.hammer_gain * hits.standard_normal(len(aimed))
    aimed = aimed + beside(faces, world.miss * hits.standard_normal((len(aimed), 2)))
    beside_them = np.random.default_rng([seed, 101]).standard_normal((2, len(spindle.points), 2))
    sensors = glued(spindle, world.place * beside_them[0], world.askew * beside_them[1])
    late = world.late * np.random.default_rng([seed, 107]).standard_normal(len(spindle.points))
    hidden = in_contact(built, tests, world, hidden)
    made = []
    for k, plan in enumerate(tests):
        true = plan.temperature + spindle.tolerances.temperature * random.standard_normal()
        struck = aimed + beside(faces, world.miss_drift * hits.standard_normal((len(aimed), 2)))
        at = answer(built, Condition(true, plan.speed), world, hidden, plan.place(spindle), struck, sensors)
        drift = 1 + world.gain_drift * random.standard_normal(len(gain))
        hit = force * (1 + world.hammer_drift * hits.standard_normal(len(force)))
        frf = measured(replace(at, gain=at.gain * gain * drift, delay=at.delay + late, references=hit[:, None] * at.references), spindle, record, random)
        name = f"T{plan.temperature:g}_n{plan.speed * 30 / np.pi:.0f}_{k}"
        made.append(Test(name, plan.temperature, plan.speed, frf=frf, window_decay=record.decay))
    stated = Noise(spindle.hammer.noise_of_value, spindle.hammer.noise_of_largest) if record.told == "noise" else None
    found = Campaign(f"blind {seed}", spindle.name, "mobility", spindle.points, tuple(made), stated, lumped_shafts=bool(spindle.structure.shafts))
    return Made(found, built, world, record, tuple(tests), tuple(hidden))


def faces_struck(spindle: Spindle) -> Array:
    """Two directions (hammers, 2, 3) on the face that each hammer strikes, across each other."""
    return faces(np.array([spindle.point(node).direction for node in spindle.hammer.hammer_nodes], float))


def faces(across: Array) -> Array:
    """Two directions (points, 2, 3) on the face `across` (points, 3) each point, across each other."""
    first = [np.eye(3)[int(np.argmin(np.abs(h)))] for h in across]
    return np.array([[a, np.cross(h, a)] for h, a in zip(across, first, strict=True)])


def glued(spindle: Spindle, off: Array, turned: Array) -> tuple[Array, Array]:
    """Positions and directions (points, 3) of sensors that are `off` (points, 2) in m and `turned` (points, 2) in rad on their faces."""
    position, direction = points_read(spindle)
    on = faces(direction)
    return position + beside(on, off), direction + beside(on, turned)


def beside(faces: Array, by: Array) -> Array:
    """Offsets (hammers, 3) on faces (hammers, 2, 3) `by` (hammers, 2) along their directions."""
    return np.einsum("hw,hwx->hx", by, faces)


def in_contact(spindle: Spindle, tests: Sequence[Plan], world: World, hidden: Sequence[Hidden]) -> Sequence[Hidden]:
    """What is hidden, halved until every bearing carries load in every test, whatever the
    thermometer's error: a spindle that rattles has no FRF."""
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
        force = force_of(frequency, hammer)
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


def error_of_hits(frequency: Array, hammer: HammerTest, record: Record) -> Array:
    """Standard error (n,) of lines of the mean of hits, over the largest value under the window, with
    that window undone. The force falls with frequency, so that noise over it rises; and white noise
    in time hides as much with a window as without, which takes as much of the answer (Parseval)."""
    window = np.exp(-record.decay / hammer.sample_rate * np.arange(round(record.length * hammer.sample_rate)))
    return np.asarray(record.times * hammer.noise_of_largest / np.sqrt(np.mean(window**2)) / force_of(frequency, hammer))


def force_of(frequency: Array, hammer: HammerTest) -> Array:
    """Magnitude of the spectrum of a hit over its value at 0 Hz."""
    return half_sine(frequency, np.pi * np.sqrt(hammer.hammer_mass / hammer.tip_stiffness))


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
