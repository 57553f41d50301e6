"""A test's measured FRFs and the model's on one axis: the same points, quantity, lines and window."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.machine import Condition, Point, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Test
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import OperatingPoint, operating_point

POWER = {"receptance": -1, "mobility": 0, "accelerance": 1}
"""Power of i omega that turns a mobility into each quantity."""


@dataclass(frozen=True, eq=False)
class Beside:
    """One test: `measured` FRFs at the lines above 0 Hz, and `point`, the model at the test's condition with the test's points."""

    test: Test
    measured: Frf
    point: OperatingPoint

    def computed(self, frequency: Array) -> ComplexArray:
        """The model's FRFs (responses, references, n) at any `frequency` (n,) Hz, in the measured quantity.

        An exponential window exp(-decay t) left in the measured ones damps these as much: they are taken at i omega + decay.
        """
        s = 2j * np.pi * frequency + self.test.window_decay
        value = self.point.frf(frequency, self.test.window_decay) * s ** POWER[self.measured.quantity]
        return np.asarray(value[: len(self.measured.response_nodes)], complex)


def measured_at(spindle: Spindle, points: tuple[Point, ...], frf: Frf | None) -> Spindle:
    """The spindle with a test's response points first and its hammer points, or as it is for a table of modes."""
    if frf is None:
        return spindle
    nodes = (*frf.response_nodes, *(n for n in frf.reference_nodes if n not in frf.response_nodes))
    by_node = {p.node: p for p in points}
    hammer = replace(spindle.hammer, hammer_nodes=frf.reference_nodes)
    return replace(spindle, points=tuple(by_node[n] for n in nodes), hammer=hammer)


def beside(spindle: Spindle, points: tuple[Point, ...], test: Test, condition: Condition) -> Beside | None:
    """A test of a campaign with these points, and the scene at its condition; None for a table of modes."""
    if test.frf is None:
        return None
    lines = test.frf.frequency > 0
    coherence, sd = (None if v is None else v[:, :, lines] for v in (test.frf.coherence, test.frf.sd))
    measured = replace(test.frf, frequency=test.frf.frequency[lines], value=test.frf.value[:, :, lines], coherence=coherence, sd=sd)
    return Beside(test, measured, operating_point(measured_at(spindle, points, test.frf), condition))
