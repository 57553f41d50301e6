"""A test's measured FRFs and the model's on one axis: the same points, quantity, lines and window."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Point, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.identification.frf import Frf, out_of, without
from thermospindle.sim.operating import OperatingPoint, operating_point

POWER = {"receptance": -1, "mobility": 0, "accelerance": 1}
"""Power of i omega that turns a mobility into each quantity."""


@dataclass(frozen=True, eq=False)
class Beside:
    """One test: `measured` FRFs at the lines above 0 Hz without those of the running speed, and `point`, the model at the test's condition with the test's points."""

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


def check_points(spindle: Spindle, campaign: Campaign) -> None:
    """Raises `BadInput` for a campaign with a point on a body that the scene has not."""
    bodies = {b.name for b in spindle.structure.bodies}
    for point in campaign.points:
        if point.body not in bodies:
            shafts = spindle.structure.shafts
            whole = sorted(bodies - {name for s in shafts for name in s.bodies})
            allowed = [*whole, *(f"{s.bodies[0]} to {len(s.bodies) - 1}" for s in shafts)]
            raise BadInput(
                f"{campaign.folder or campaign.title}: points.{point.node}.body = {point.body!r}: "
                f"no body of scene {spindle.name}; allowed are {', '.join(allowed)}"
            )


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
    measured = without(test.frf, out_of(test.frf, test.speed).out | (test.frf.frequency <= 0))
    return Beside(test, measured, operating_point(measured_at(spindle, points, test.frf), condition))


def left_out(campaign: Campaign) -> list[str]:
    """A sentence for every test in whose FRFs lines of the running speed stand: those are compared with nothing."""
    where = f"{campaign.folder / 'campaign.toml'}: " if campaign.folder else ""
    found = [(t.id, out_of(t.frf, t.speed)) for t in campaign.tests if t.frf is not None]
    return [f"{where}tests.{id_}: {lines.words()}" for id_, lines in found if lines.multiples]
