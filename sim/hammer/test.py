"""The virtual impact-hammer test: MuJoCo in time, acquisition as a laboratory does it, and FRFs with standard errors.

Every hit is a full time simulation (RK4); all hits run side by side in C (`sim.side_by_side`), no Python between steps. Forces are
controls held over a step, and a held force has images about the rate of integration. Velocity read once a step folds them back,
for a mass, whose velocity falls as 1/f, as a part (pi f step)^2 / 3 of the FRF; and it is the mass of a node alone that answers so
fast: at the nose of `five_bearing` 3e-3 of the FRF at 3.9 kHz, half of its noise. So velocity is read as its mean over a step, the
way made in it, which lets nothing through at the images' centres: (pi f step)^4 / 15 are left, 6e-6 at 6 kHz and 5 us.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice, pairwise
from math import ceil
from typing import TypeVar

import mujoco
import numpy as np

from thermospindle.model.drawing.measuring import HammerTest
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.parallel import cores
from thermospindle.model.rotor.chain import Element
from thermospindle.model.rotor.elements import LINEAR, REDUCED
from thermospindle.model.rotor.poles import LARGE
from thermospindle.model.structure import Joint
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Measurement
from thermospindle.sim.hammer.estimate import Estimate, Windows, estimate
from thermospindle.sim.hammer.pulse import Hit, check_band, draw_hits, force, pulse_duration
from thermospindle.sim.hammer.reduced import MARGIN, PIECES, simulate_reduced, with_long_step
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.side_by_side import SideBySide

T = TypeVar("T")

MOST_STEPS = 5_000_000  # of one record: a minute of a large model
LONG = 1.5e8  # steps times degrees of freedom, of all hits together: a minute of one core
TERMS = 32  # of the anti-alias filter, a sampling interval: closed from 0.6 of the sampling rate on, whose alias is the highest line of a band


@dataclass(frozen=True, eq=False)
class Record:
    """What the analyser sampled, noise included: time (n,) s, force (references, hits, n) N, velocity
    (references, hits, responses, n) m/s."""

    time: Array
    force: Array
    velocity: Array


@dataclass(frozen=True, eq=False)
class ImpactTest:
    """A virtual impact test at one operating point."""

    point: OperatingPoint
    settings: HammerTest
    element: str
    record: Record
    estimate: Estimate

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.point!r}: {self.estimate.h1!r}>"


def impact_tests(
    points: Sequence[OperatingPoint],
    settings: HammerTest | None = None,
    element: str | None = None,
    seed: int = 0,
    noise: bool = True,
    progress: Callable[[str], None] = lambda done: None,
) -> list[ImpactTest]:
    """Impact tests at several operating points of one spindle, with as many hits side by side as there are cores.

    `settings` default to the scene's. `element` is one of `model.rotor.elements.HAMMER`, by default the `usual` one. The same
    seed gives the same test. `progress` is told of every piece of the records and of every point, `stages` times in all.
    """
    test = settings or points[0].spindle.hammer
    check_band(test, str(points[0].spindle.file or points[0].spindle.name))
    element = element or usual(test)
    if element == REDUCED:
        test = with_long_step(test)
    every, steps = sampling(test)
    if steps > MOST_STEPS:
        raise BadInput(
            f"{points[0].spindle.file or points[0].spindle.name}: the stiffest mode of the model asks for steps of {test.step * 1e6:.3g} us, {steps:.2g} of them a "
            "record; shafts with beam = timoshenko or rayleigh, longer elements or a shorter record_length_s take fewer, and --element reduced (in Python element='reduced') needs none"
        )
    if element != REDUCED:
        for point in points:
            check_step(point, test.step, "--element reduced (in Python element='reduced': a hammer test without MuJoCo)")
    results = []
    for batch in batched(enumerate(points), _at_once(test)):
        hits = [[draw_hits(test, np.random.default_rng([seed, i, node])) for node in test.hammer_nodes] for i, _ in batch]
        named = ", ".join(f"{p.condition.temperature:g} C" for _, p in batch)
        simulated = _simulated([p for _, p in batch], test, element, hits, steps, partial(_told, progress, named))
        for (i, point), (held, velocity) in zip(batch, simulated, strict=True):
            random = np.random.default_rng([seed, i]) if noise else None
            record = acquire(test, held, velocity, every, random, point.measurement)
            results.append(ImpactTest(point, test, element, record, estimate_of(test, point, record)))
            progress(f"{point.condition.temperature:g} C: {held.shape[0] * held.shape[1]} hits simulated")
    return results


def usual(test: HammerTest) -> str:
    """The element of a hammer test for which none is asked: linear; reduced where the steps of a
    record are more than can be computed, of beams whose stiffest mode is far above the band."""
    return LINEAR if sampling(test)[1] <= MOST_STEPS else REDUCED


def takes_long(spindle: Spindle, element: str | None, temperatures: int) -> str:
    """What is said before hammer tests at so many temperatures whose linear model takes MuJoCo more
    than a minute, as those of many beam elements do; empty where it does not, and of other elements."""
    test = spindle.hammer
    _, steps = sampling(test)
    dofs, hits = sum(len(b.moves) for b in spindle.structure.bodies), test.hits * len(test.hammer_nodes) * temperatures
    if (element or usual(test)) != LINEAR or damped_throughout(spindle.structure.joints, dofs) or steps * dofs * hits < LONG:
        return ""
    return f"MuJoCo takes {steps} steps of {dofs} degrees of freedom for each of {hits} hits, which is minutes of work; --element {REDUCED} computes records of the same linear model without it, in seconds"


def batched(items: Iterable[T], size: int) -> Iterator[list[T]]:
    """Lists of up to `size` items, in order."""
    iterator = iter(items)
    while batch := list(islice(iterator, size)):
        yield batch


def _told(progress: Callable[[str], None], where: str, done: str) -> None:
    progress(f"{where}: {done}")


def _simulated(
    points: Sequence[OperatingPoint], test: HammerTest, element: str, hits: Sequence[Sequence[Sequence[Hit]]], steps: int, progress: Callable[[str], None]
) -> list[tuple[Array, Array]]:
    if element == REDUCED:
        found = [simulate_reduced(point, test, own, steps) for point, own in zip(points[:-1], hits[:-1], strict=True)]
        return [*found, simulate_reduced(points[-1], test, hits[-1], steps, progress)]
    models = [p.model if element == LINEAR else p.spec(element).compile() for p in points]
    return simulate([_with_step(model, test.step) for model in models], test, hits, steps, progress)


def stages(test: HammerTest, points: int) -> int:
    """How often `impact_tests` tells of its progress."""
    return points + PIECES * ceil(points / _at_once(test))


def _at_once(test: HammerTest) -> int:
    """Points whose hits are simulated side by side."""
    return max(1, cores() // (test.hits * len(test.hammer_nodes)))


def sampling(test: HammerTest) -> tuple[int, int]:
    """Integration steps a sample, and steps of a whole record with its margin."""
    every = round(1 / (test.sample_rate * test.step))
    if abs(every * test.sample_rate * test.step - 1) > 1e-6:
        raise BadInput(
            f"hammer_test.step_us = {test.step * 1e6:g}: must divide the sampling interval of {1e6 / test.sample_rate:g} us into whole steps"
        )
    return every, (round(test.record_length * test.sample_rate) + MARGIN) * every


def damped_throughout(elements: Iterable[Element | Joint], freedom: int) -> list[str]:
    """Groups of elements, or joints, whose loss factors make more dampers between all degrees of
    freedom than MuJoCo steps: `check_step` says why."""
    return list(dict.fromkeys(e.group for e in elements if e.loss_factor)) if freedom > LARGE else []


def check_step(point: OperatingPoint, step: float, stepless: str) -> None:
    """Refuse a step at which Runge-Kutta 4 would be unstable: |pole| step < 2.78 on the imaginary axis (Hairer & Wanner, IV.2);
    and loss factors of a flexible shaft, whose dampers lie between all its nodes (`model.rotor.loss`): 48,000 places of tendons
    for 220 degrees of freedom, with which a step takes MuJoCo 78 ms in place of 0.2. `stepless` is the option that takes no steps."""
    freedom = len(point.chain.dofs)
    if lossy := damped_throughout(point.chain.elements, freedom):
        raise BadInput(
            f"{point.spindle.file or point.spindle.name}: loss_factor of {' and '.join(lossy)}: makes dampers between all {freedom} degrees of freedom, which MuJoCo steps for {LARGE} or "
            f"fewer; allowed are {stepless}, or damping_ratio in its place"
        )
    limit = 2.7 / max(abs(m.pole) for m in point.modes)
    if step > limit:
        raise BadInput(
            f"{point.spindle.file or point.spindle.name}: hammer_test.step_us = {step * 1e6:g}: too long for the stiffest mode; "
            f"at most {limit * 1e6:.2f} us is stable"
        )


def simulate(
    models: Sequence[mujoco.MjModel],
    test: HammerTest,
    hits: Sequence[Sequence[Sequence[Hit]]],
    steps: int,
    progress: Callable[[str], None] = lambda done: None,
) -> list[tuple[Array, Array]]:
    """Held force (references, hits, steps) and mean velocity over the same steps (references, hits,
    responses, steps) of every model's hits, all at once in C.

    `hits[model][reference]` are the hits on one hammer node. Records are made in `PIECES`, each
    from where the last one ended: what is between needs no memory, and `progress` is told.
    """
    held = np.array([[[force(hit, test.step, steps) for hit in row] for row in own] for own in hits])
    count, references, repeats = held.shape[:3]
    many = [model for model in models for _ in range(references * repeats)]
    state = np.repeat(np.array([loaded_state(model) for model in models]), references * repeats, axis=0)
    actuators = [models[0].actuator(f"hammer{node}").id for node in test.hammer_nodes]
    looks = np.array([looking(model) for model in many])
    last = _seen(looks, state[:, None])
    velocity = np.empty((len(many), looks.shape[1], steps))
    edges = np.linspace(0, steps, PIECES + 1).astype(int)
    with SideBySide(many) as pool:
        for k, (first, after) in enumerate(pairwise(edges.tolist()), 1):
            control = np.zeros((count, references, repeats, after - first, models[0].nu))
            for r, actuator in enumerate(actuators):
                control[:, r, :, :, actuator] = held[:, r, :, first:after]
            states, _ = pool.step(state, control.reshape(len(many), after - first, -1))
            places = _seen(looks, states)
            velocity[:, :, first:after] = np.diff(places, prepend=last) / test.step
            state, last = np.ascontiguousarray(states[:, -1]), places[:, :, -1:]
            progress(f"{len(many)} hits, {k * 100 // PIECES} % of the records simulated")
    return list(zip(held, velocity.reshape(count, references, repeats, -1, steps), strict=True))


def looking(model: mujoco.MjModel) -> Array:
    """Rows (sensors, nq) of the motion that each vibrometer sees, of its fixed tendon."""
    rows = np.zeros((model.nsensor, model.nq))
    for row, tendon in zip(rows, model.sensor_objid, strict=True):
        own = slice(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
        row[model.jnt_qposadr[model.wrap_objid[own]]] = model.wrap_prm[own]
    return rows


def _seen(looks: Array, states: Array) -> Array:
    """What vibrometers see (models, sensors, steps) along `looks` (models, sensors, nq) of states (models, steps, nstate), whose
    coordinates stand behind the time; of each step the same to the last bit whatever others there are, as a BLAS does not have it."""
    return np.asarray(np.einsum("mrq,msq->mrs", looks, states[:, :, 1 : 1 + looks.shape[2]]))


def _with_step(model: mujoco.MjModel, step: float) -> mujoco.MjModel:
    """The model with the integration step of the test's settings, which need not be the scene's."""
    own = copy.copy(model)
    own.opt.timestep = step
    return own


def loaded_state(model: mujoco.MjModel) -> Array:
    """MuJoCo's full physics state of the keyframe "loaded"."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("loaded").id)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    return state


def acquire(
    test: HammerTest,
    held: Array,
    velocity: Array,
    every: int,
    random: np.random.Generator | None,
    measurement: Measurement | None = None,
) -> Record:
    """Anti-alias filter, sampling, what the measuring chain does to the channels (gain, delay, a window nobody noted), sensor noise.

    `held` is the force over each step, `velocity` its mean over the same. With the hold's own sinc f step
    the force channel gets that of such a mean, which velocity has: none is left in the FRF. The same
    linear-phase filter runs over both, of an even number of terms: samples stand at the ends of steps.
    """
    from scipy.signal import firwin, resample_poly  # takes half a second to load, and most verbs strike nothing

    n = held.shape[-1]
    frequency = np.fft.rfftfreq(n, test.step)
    applied = np.fft.irfft(np.fft.rfft(held) * np.sinc(frequency * test.step) ** 2, n)
    samples = round(test.record_length * test.sample_rate)
    quiet = firwin(TERMS * every, min(1 / every, 0.9), window=("kaiser", 12.0))  # by 120 dB where it is closed
    sampled_force, sampled_velocity = (resample_poly(x, 1, every, axis=-1, window=quiet)[..., :samples] for x in (applied, velocity))
    if measurement is not None:
        spectrum = np.fft.rfft(sampled_velocity)
        late = np.exp(-2j * np.pi * np.fft.rfftfreq(samples, 1 / test.sample_rate) * measurement.delay[:, None])
        sampled_velocity = np.fft.irfft(spectrum * measurement.gain[:, None] * late, samples)
        window = np.exp(-measurement.decay * np.arange(samples) / test.sample_rate)
        sampled_force, sampled_velocity = sampled_force * window, sampled_velocity * window
    if random is not None:
        sampled_velocity = _with_noise(test, sampled_velocity, random)
    return Record(np.arange(samples) / test.sample_rate, sampled_force, sampled_velocity)


def _with_noise(test: HammerTest, velocity: Array, random: np.random.Generator) -> Array:
    """Vibrometer noise of a size that leaves the scene's noise on the FRF averaged over all hits, independent line by line.

    One part is white, relative to the largest line of a hammer; the other is proportional to the line itself (speckle, scatter of the
    hit), made by shaping random numbers with the spectrum of the record. The force channel is taken as quiet: behind its window a
    hammer's noise is far below both.
    """
    hits, n = velocity.shape[1], velocity.shape[-1]
    spectrum = np.abs(np.fft.rfft(velocity))
    frequency = np.fft.rfftfreq(n, 1 / test.sample_rate)
    band = (frequency >= test.band[0]) & (frequency <= test.band[1])
    largest = spectrum[..., band].max(axis=(1, 2, 3), keepdims=True)
    size = np.sqrt(test.noise_of_value**2 * spectrum**2 + test.noise_of_largest**2 * largest**2) * np.sqrt(hits / 2)
    noise = size * (random.standard_normal(spectrum.shape) + 1j * random.standard_normal(spectrum.shape))
    return velocity + np.fft.irfft(noise, n)


def estimate_of(test: HammerTest, point: OperatingPoint, record: Record) -> Estimate:
    """FRFs of a record with the scene's windows, in the scene's band."""
    decay = -np.log(test.exponential_end) / test.record_length
    windows = Windows(pulse_duration(test) + 1e-3, float(decay))
    nodes = tuple(p.node for p in point.spindle.points)
    return estimate(record.time, record.force, record.velocity, windows, test.band, nodes, test.hammer_nodes)
