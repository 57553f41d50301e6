"""Hammer records of two points by a model whose FRFs are known exactly, and a mapping of them."""

from __future__ import annotations

import numpy as np

RATE, LENGTH = 8192.0, 1.0
POLES = 2 * np.pi * np.array([210.0, 640.0]), np.array([0.01, 0.008])
SHAPES = np.array([[1.0, 0.6], [0.7, -0.9]])  # (points, modes), kg^-1/2
MAPPING = """
spindle = "rig"
[[files]]
file = "hammer*"
test = "T20"
[[tests]]
id = "T20"
temperature_C = 20.0
speed_rpm = 0.0
[[points]]
node = 1
name = "a"
body = "b"
position_mm = [0.0, 0.0, 0.0]
direction = "+Z"
[[points]]
node = 2
name = "c"
body = "b"
position_mm = [1.0, 0.0, 0.0]
direction = "+Z"
"""


def exact(frequency, decay=0.0):
    """Mobility (2, 2, n) at i w + decay."""
    s = 2j * np.pi * frequency + decay
    w, z = POLES
    return np.einsum("rm,qm,mn->rqn", SHAPES, SHAPES, s / (s**2 + 2 * (z * w)[:, None] * s + w[:, None] ** 2))


def hit(random, doubled=False, power=0):
    """Force (n,) of one hit of 0.6 ms at 50 ms, and the velocities (2, n) it makes, by discrete
    convolution with the exact impulse response; accelerations for `power` 1."""
    n, start = round(RATE * LENGTH), round(0.05 * RATE)
    t = np.arange(n) / RATE
    width = 6e-4 * random.uniform(0.9, 1.1)
    peak = random.uniform(60, 100)
    force = peak * np.where((t > t[start]) & (t < t[start] + width), np.sin(np.pi * (t - t[start]) / width), 0.0)
    if doubled:
        force += 0.4 * np.roll(force, round(0.01 * RATE))
    padded = np.fft.rfftfreq(4 * n, 1 / RATE)
    shift = 12.0  # evaluated off the axis, so that the answer has died away within the padded record
    answer = np.fft.irfft(np.fft.rfft(force * np.exp(-shift * t), 4 * n) * exact(padded, shift) * (2j * np.pi * padded + shift) ** power, 4 * n)[..., :n] * np.exp(shift * t)
    return force, answer  # (n,), (2 responses, 2 references, n)
