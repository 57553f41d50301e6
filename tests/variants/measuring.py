"""Variants of effects of the measuring chain. Channels are counted from 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.machine import Condition, Spindle
from model.rotor_base import RotorBase, motion_rows
from sim.effect import Measurement
from tests.variants.variant import variant


def gains(m: Measurement, change: float, channels: list[int]) -> Measurement:
    gain = m.gain.copy()
    gain[channels] *= 1 + change
    return replace(m, gain=gain)


def delays(m: Measurement, delay: float, channels: list[int]) -> Measurement:
    moved = m.delay.copy()
    moved[channels] += delay
    return replace(m, delay=moved)


def on(spindle: Spindle, body: str) -> list[int]:
    return [i for i, p in enumerate(spindle.points) if p.body == body]


def everywhere(spindle: Spindle) -> list[int]:
    return list(range(len(spindle.points)))


def gain_of_all(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return gains(m, size, everywhere(spindle))


def gain_of_one(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return gains(m, size, [4])


def gain_on_hub(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return gains(m, -size, on(spindle, "hub"))


def delay_of_all(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return delays(m, 1e-6 * size, everywhere(spindle))


def delay_of_one(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return delays(m, 1e-6 * size, [1])


def window(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return replace(m, decay=m.decay + size)


def window_when_turning(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    return replace(m, decay=m.decay + size * (condition.speed != 0))


def hit_at(spindle: Spindle, chain: RotorBase, m: Measurement, offsets: dict[int, tuple[float, float, float]]) -> Measurement:
    """References struck beside their nodes by `offsets` (m)."""
    rows = []
    for node in spindle.hammer.hammer_nodes:
        p = spindle.point(node)
        x, y, z = np.array(p.position) + np.array(offsets.get(node, (0.0, 0.0, 0.0)))
        rows.append(np.array(p.direction) @ motion_rows(chain, p.body, (float(x), float(y), float(z)))[:3])
    return replace(m, reference_rows=np.array(rows))


def hit_outside(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    """Both hits `size` mm too far out."""
    return hit_at(spindle, chain, m, {1: (1e-3 * size, 0, 0), 6: (0, 1e-3 * size, 0)})


def hit_aside(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    """The hit on the hub `size` mm aside and in."""
    return hit_at(spindle, chain, m, {1: (-0.7e-3 * size, 0.7e-3 * size, 0)})


MEASURING = (
    variant("sensor_gain/all", "all channels too sensitive", "1", 0.03, 0.2, measurement=gain_of_all),
    variant("sensor_gain/one", "the channel of seat0 too sensitive", "1", 0.04, 0.3, measurement=gain_of_one),
    variant("sensor_gain/hub", "the channels on the hub too insensitive", "1", 0.03, 0.2, measurement=gain_on_hub),
    variant("channel_delay/all", "all channels late", "us", 1.0, 40.0, measurement=delay_of_all),
    variant("channel_delay/one", "the channel of hub_top90 late", "us", 1.0, 40.0, measurement=delay_of_one),
    variant("window_damping/all", "the window's damping was not taken out", "1/s", 1.0, 25.0, measurement=window),
    variant("window_damping/turning", "a window in running tests only", "1/s", 1.0, 25.0, measurement=window_when_turning),
    variant("hammer_position/outside", "both hits too far out", "mm", 0.5, 3.0, measurement=hit_outside),
    variant("hammer_position/aside", "the hit on the hub aside", "mm", 1.0, 4.0, measurement=hit_aside),
)
