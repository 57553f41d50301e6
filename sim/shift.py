"""Following modes from one condition to another, and the shift of a natural frequency with its standard error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from model.ball_row import Array
from model.machine import Condition, Spindle
from model.modes import Mode, modes, point_rows
from model.rotor_base import matrices
from model.scene import load
from model.tolerance import Toleranced, toleranced
from sim.operating import operating_point
from sim.run import Step

FREQUENCY_FLOOR = 0.05  # Hz, numerical error of a computed frequency: the finite elements' share at 60 C


@dataclass(frozen=True)
class Shift:
    """Change of a natural frequency (Hz), and one standard deviation of it over the scene's build tolerances."""

    value: float
    sd: float
    start: float  # Hz, at the first temperature
    end: float


def frequency_shift(scene: str | Path | Spindle, mode: int, from_C: float, to_C: float, speed_rpm: float = 0.0) -> Shift:
    """Shift of mode number `mode` (counted from 1 at `from_C`) between two temperatures.

    The mode is followed by its shape. The standard error propagates the scene's tolerances (stiffness, mass, inertia, preload,
    temperature of each test) to first order, and the numerical floor of both frequencies.
    """
    spindle = scene if isinstance(scene, Spindle) else load(scene)
    speed = speed_rpm * np.pi / 30

    def frequencies(s: Spindle, cold: float = from_C, hot: float = to_C) -> Array:
        chains = [operating_point(s, Condition(t, speed)).chain for t in (cold, hot)]
        ends = [modes(chain) for chain in chains]
        partner = follow(matrices(chains[0]).mass, ends[0], ends[1])[mode - 1]
        return np.array([ends[0][mode - 1].frequency, ends[1][partner].frequency])

    start, end = frequencies(spindle)

    def spread(sd: float, change: Callable[[float], Array]) -> Array:
        """Change of both frequencies for one standard deviation, by a central difference over half of it each way."""
        return change(0.5 * sd) - change(-0.5 * sd)

    changes = [spread(p.sd, partial(_built, frequencies, spindle, p)) for p in toleranced(spindle)]
    kelvin = spindle.tolerances.temperature
    changes.append(spread(kelvin, lambda x: frequencies(spindle, cold=from_C + x)))
    changes.append(spread(kelvin, lambda x: frequencies(spindle, hot=to_C + x)))
    variance = sum((c[1] - c[0]) ** 2 for c in changes) + 2 * FREQUENCY_FLOOR**2
    return Shift(float(end - start), float(np.sqrt(variance)), float(start), float(end))


def _built(frequencies: Callable[[Spindle], Array], spindle: Spindle, parameter: Toleranced, x: float) -> Array:
    return frequencies(parameter.apply(spindle, x))


def follow(mass: Array, first: Sequence[Mode], then: Sequence[Mode], width: float = 0.1) -> list[int]:
    """Index into `then` of the partner of every mode of `first`, by an optimal assignment; -1 without one.

    Likeness is the MAC weighted with the mass matrix (n, n) and the frequency ratio, of which `width` counts like a fully different
    shape: modes that cross in frequency keep their shapes, close pairs that turn in their plane keep their order.
    """
    root = np.sqrt(np.diag(mass))
    a, b = (np.array([m.shape * root / np.linalg.norm(m.shape * root) for m in group]) for group in (first, then))
    mac = np.abs(a.conj() @ b.T) ** 2
    ratio = np.log([[m.frequency / n.frequency for n in then] for m in first]) / width
    partner = dict(zip(*(i.tolist() for i in linear_sum_assignment(1 - mac + ratio**2)), strict=True))
    return [partner.get(i, -1) for i in range(len(first))]


def match(step: Step) -> dict[int, Mode]:
    """The model's own mode behind each identified one, by index: likest in shape at the measuring points and in frequency."""
    identified, own = step.identified, [m for m in step.point.modes if m.frequency < 1.2 * step.point.spindle.hammer.band[1]]
    rows = point_rows(step.point.spindle, step.point.chain)
    computed = np.array([rows @ m.shape for m in own])
    a = identified.shape / np.linalg.norm(identified.shape, axis=1, keepdims=True)
    b = computed / np.linalg.norm(computed, axis=1, keepdims=True)
    mac = np.abs(a.conj() @ b.T) ** 2
    ratio = np.log(identified.frequency[:, None] / np.array([m.frequency for m in own])) / 0.02
    chosen = linear_sum_assignment(1 - mac + ratio**2)
    return {int(i): own[j] for i, j in zip(*chosen, strict=True) if abs(ratio[i, j]) < 1}
