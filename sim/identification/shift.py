"""The shift of a natural frequency from one condition to another, with its standard error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from thermospindle.model.built.tolerance import Toleranced, toleranced
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import modes
from thermospindle.model.scene.reading import load
from thermospindle.model.span import inside
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import operating_point

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

    Raises `BadInput` for a number that no mode has, and for a mode whose shape is lost on the way.

    The mode is followed by its shape. The standard error propagates the scene's tolerances (stiffness, mass, inertia, preload,
    temperature of each test) to first order, and the numerical floor of both frequencies.
    """
    spindle = scene if isinstance(scene, Spindle) else load(scene)
    speed = speed_rpm * RPM
    own = modes(operating_point(spindle, Condition(from_C, speed)).chain)
    if not 1 <= mode <= len(own):
        raise BadInput(f"mode {mode}: {spindle.name} has modes 1 to {len(own)} at {from_C:g} C; they are counted from 1")

    def frequencies(s: Spindle, cold: float = from_C, hot: float = to_C) -> Array:
        chains = [operating_point(s, Condition(t, speed)).chain for t in (cold, hot)]
        ends, mass = [modes(chain) for chain in chains], matrices(chains[0]).mass
        first = follow(mass, own, ends[0])[mode - 1]  # not the same number where a deviation moves it past another mode
        partner = follow(mass, ends[0], ends[1])[first] if first >= 0 else -1
        if partner < 0:
            raise BadInput(f"mode {mode}: {s.name} has it at {from_C:g} C and no mode of its shape at {hot:g} C, so it has no shift")
        return np.array([ends[0][first].frequency, ends[1][partner].frequency])

    start, end = frequencies(spindle)

    def spread(sd: float, change: Callable[[float], Array]) -> Array:
        """Change of both frequencies for one standard deviation, by a central difference over half of it each way."""
        return change(0.5 * sd) - change(-0.5 * sd)

    changes = [spread(p.sd, partial(_built, frequencies, spindle, p)) for p in toleranced(spindle)]
    kelvin = spindle.tolerances.temperature
    # one standard deviation of temperature about each end, to one side of it where a law of the scene ends
    (low, high), (cool, warm) = (inside(t, kelvin, spindle) for t in (from_C, to_C))
    changes.append(frequencies(spindle, cold=high) - frequencies(spindle, cold=low))
    changes.append(frequencies(spindle, hot=warm) - frequencies(spindle, hot=cool))
    variance = sum((c[1] - c[0]) ** 2 for c in changes) + 2 * FREQUENCY_FLOOR**2
    return Shift(float(end - start), float(np.sqrt(variance)), float(start), float(end))


def _built(frequencies: Callable[[Spindle], Array], spindle: Spindle, parameter: Toleranced, x: float) -> Array:
    return frequencies(parameter.apply(spindle, x))

