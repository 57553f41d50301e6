"""The virtual impact-hammer test: MuJoCo in time, acquisition as a laboratory does it, and FRFs with standard errors.

Every hit is a full time simulation (RK4); all hits run side by side in C (`mujoco.rollout`), no Python between steps. Forces are
controls held over a step: the force channel is that of the held force, so no half step of delay is left in the FRF.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.rollout import Rollout
from scipy.signal import resample_poly

from model.ball_row import Array
from model.machine import HammerTest
from model.scene import BadInput
from sim.estimate import Estimate, Windows, estimate
from sim.hammer import Hit, draw_hits, force, pulse_duration
from sim.operating import OperatingPoint

MARGIN = 64  # samples of quiet simulated past the record, so that the anti-alias filter ends outside it


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


def impact_tests(
    points: Sequence[OperatingPoint], settings: HammerTest | None = None, element: str = "linear", seed: int = 0, noise: bool = True
) -> list[ImpactTest]:
    """Impact tests at several operating points of one spindle, all hits of all of them side by side on all cores.

    `settings` default to the scene's. `element` is a bearing element of `model.mjcf`. The same seed gives the same test.
    """
    test = settings or points[0].spindle.hammer
    every, steps = sampling(test)
    for point in points:
        check_step(point, test.step)
    hits = [[draw_hits(test, np.random.default_rng([seed, i, node])) for node in test.hammer_nodes] for i in range(len(points))]
    models = [p.model if element == "linear" else p.spec(element).compile() for p in points]
    results = []
    for i, (point, model) in enumerate(zip(points, models, strict=True)):
        force_held, velocity = simulate(model, test, hits[i], steps)
        record = acquire(test, force_held, velocity, every, np.random.default_rng([seed, i]) if noise else None)
        results.append(ImpactTest(point, test, element, record, estimate_of(test, point, record)))
    return results


def sampling(test: HammerTest) -> tuple[int, int]:
    """Integration steps a sample, and steps of a whole record with its margin."""
    every = round(1 / (test.sample_rate * test.step))
    if abs(every * test.sample_rate * test.step - 1) > 1e-6:
        raise BadInput(
            f"hammer_test.step_us = {test.step * 1e6:g}: must divide the sampling interval of {1e6 / test.sample_rate:g} us into whole steps"
        )
    return every, (round(test.record_length * test.sample_rate) + MARGIN) * every


def check_step(point: OperatingPoint, step: float) -> None:
    """Refuse a step at which Runge-Kutta 4 would be unstable: |pole| step < 2.78 on the imaginary axis (Hairer & Wanner, IV.2)."""
    limit = 2.7 / max(abs(m.pole) for m in point.modes)
    if step > limit:
        raise BadInput(
            f"{point.spindle.file or point.spindle.name}: hammer_test.step_us = {step * 1e6:g}: too long for the stiffest mode; "
            f"at most {limit * 1e6:.2f} us is stable"
        )


def simulate(model: mujoco.MjModel, test: HammerTest, hits: Sequence[Sequence[Hit]], steps: int) -> tuple[Array, Array]:
    """Held force (references, hits, steps) and velocity (references, hits, responses, steps) of every hit, simulated in C."""
    held = np.array([[force(hit, test.step, steps) for hit in row] for row in hits])
    references, count = held.shape[:2]
    control = np.zeros((references * count, steps, model.nu))
    for r, node in enumerate(test.hammer_nodes):
        control[r * count : (r + 1) * count, :, model.actuator(f"hammer{node}").id] = held[r]
    threads = os.cpu_count() or 1
    data = [mujoco.MjData(model) for _ in range(threads)]
    start = data[0]
    mujoco.mj_resetDataKeyframe(model, start, model.key("loaded").id)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, start, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    with Rollout(nthread=threads) as pool:
        _, sensors = pool.rollout(model, data, state[None], control)
    return held, np.moveaxis(sensors.reshape(references, count, steps, -1), 3, 2)


def acquire(test: HammerTest, held: Array, velocity: Array, every: int, random: np.random.Generator | None) -> Record:
    """Anti-alias filter, sampling and sensor noise.

    Velocity sensors read at the start of a step, the force is held from there to the next: half a step apart, which an exact
    shift in frequency takes out. The same linear-phase filter runs over both channels.
    """
    n = held.shape[-1]
    frequency = np.fft.rfftfreq(n, test.step)
    hold = np.exp(-1j * np.pi * frequency * test.step) * np.sinc(frequency * test.step)
    applied = np.fft.irfft(np.fft.rfft(held) * hold, n)
    samples = round(test.record_length * test.sample_rate)
    sampled_force = resample_poly(applied, 1, every, axis=-1)[..., :samples]
    sampled_velocity = resample_poly(velocity, 1, every, axis=-1)[..., :samples]
    if random is not None:
        sampled_force, sampled_velocity = _with_noise(test, sampled_force, sampled_velocity, random)
    return Record(np.arange(samples) / test.sample_rate, sampled_force, sampled_velocity)


def _with_noise(test: HammerTest, force: Array, velocity: Array, random: np.random.Generator) -> tuple[Array, Array]:
    """White sensor noise of a size that leaves the scene's noise on the averaged FRF.

    Noise of the force channel moves every line in proportion to its value, noise of the vibrometer by the same amount
    everywhere; each is set so that the mean of all hits has the relative size asked for (at mid-band, and at the largest line).
    """
    hits, n = force.shape[1:]
    frequency = np.fft.rfftfreq(n, 1 / test.sample_rate)
    band = (frequency >= test.band[0]) & (frequency <= test.band[1])
    spectrum = np.abs(np.fft.rfft(force))[..., band].mean(axis=(1, 2), keepdims=True)
    largest = np.abs(np.fft.rfft(velocity))[..., band].max(axis=(1, 2, 3), keepdims=True)
    size = np.sqrt(hits / n)
    pulse = round((pulse_duration(test) + 1e-3) * test.sample_rate) + 1  # the force window leaves this much noise in
    noisy_force = force + test.noise_of_value * spectrum * np.sqrt(hits / pulse) * random.standard_normal(force.shape)
    return noisy_force, velocity + test.noise_of_largest * largest * size * random.standard_normal(velocity.shape)


def estimate_of(test: HammerTest, point: OperatingPoint, record: Record) -> Estimate:
    """FRFs of a record with the scene's windows, in the scene's band."""
    decay = -np.log(test.exponential_end) / test.record_length
    windows = Windows(pulse_duration(test) + 1e-3, float(decay))
    nodes = tuple(p.node for p in point.spindle.points)
    return estimate(record.time, record.force, record.velocity, windows, test.band, nodes, test.hammer_nodes)

