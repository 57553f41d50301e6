"""Hidden faults of measuring: gains, delays, windows, the hammer."""

from __future__ import annotations

import numpy as np

from tests.blind.hidden import Mechanism
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array


def of_measuring(spindle: Spindle) -> list[Mechanism]:
    last = len(spindle.points) - 1
    return [
        Mechanism("sensor gain", "%", 1.0, 30.0, ("sensor_gain",), "sensor", {"gain": _channel(last, 1e-2)}, laws="any"),
        Mechanism("channel delay", "us", 0.5, 30.0, ("channel_delay",), "delay", {"delay": _channel(last, 1e-6)}, sign=1, laws="any"),
        Mechanism(
            "window left in", "1/s", 0.3, 20.0, ("window_damping",), "window", {"decay": lambda s, a, d: d + a}, sign=1, laws="constant"
        ),
        Mechanism("hammer beside its point", "mm", 0.05, 2.0, ("hammer_position",), "hammer", {"hammer": _beside}, laws="constant"),
    ]


def _channel(index: int, unit: float):
    """The last channel's gain (relative) or delay (s) more by the amount."""

    def change(spindle: Spindle, amount: float, before: Array) -> Array:
        after = before.copy()
        after[index] += unit * amount
        return after

    return change


def _beside(spindle: Spindle, amount: float, positions: Array) -> Array:
    """Hammer positions (references, 3): all moved outward along the axis across which they stand, toward or from it; those on it along it."""
    after = positions.copy()
    radial = positions.copy()
    radial[:, 2] = np.hypot(radial[:, 0], radial[:, 1]) == 0.0
    after += 1e-3 * amount * radial / np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-9)
    return after
