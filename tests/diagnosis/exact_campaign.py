"""Campaigns of the model's exact FRFs with noise, and tables of modes."""

from __future__ import annotations

import numpy as np

from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point

LINES = np.arange(400.0, 6000.0, 4.0)
NOISE = Noise(0.004, 0.0002)


def exact(spindle, temperatures, quantity="mobility", seed=0, repeats=1, nodes=None):
    """A campaign of the model's exact FRFs with noise as `NOISE` states it."""
    random, tests = np.random.default_rng(seed), []
    power = ("receptance", "mobility", "accelerance").index(quantity) - 1
    points = spindle.points if nodes is None else tuple(spindle.point(n) for n in nodes)
    rows = [spindle.points.index(p) for p in points]
    for temperature in temperatures:
        point = operating_point(spindle, Condition(temperature, 0.0))
        value = point.frf(LINES)[rows] * (2j * np.pi * LINES) ** power
        sd = np.hypot(NOISE.of_value * np.abs(value), NOISE.of_largest * np.abs(value).max(axis=(0, 2), keepdims=True))
        for repeat in range(1, repeats + 1):
            error = sd * (random.standard_normal((2, *value.shape)) / np.sqrt(2))
            frf = Frf(LINES, value + error[0] + 1j * error[1], tuple(p.node for p in points), spindle.hammer.hammer_nodes, quantity, sd=sd)
            tests.append(Test(f"T{temperature:g}r{repeat}", temperature, 0.0, repeat=repeat, frf=frf))
    return Campaign("exact FRFs", spindle.name, quantity, spindle.points, tuple(tests), NOISE)


def table(spindle, temperature, *rows, sd=1.0):
    modes = tuple(ModeRow("t", i, kind, f, sd, 0.01, 0.001) for i, (kind, f) in enumerate(rows, 1))
    return Campaign("table", spindle.name, "mobility", spindle.points, (Test("t", temperature, 0.0, modes=modes),))
