"""A virtual runout campaign: the spindle runs in MuJoCo at several temperatures and speeds, and noisy probes look at it.

Between two tests a real spindle stops: its ball sets come to stand elsewhere, and every ball has turned about its own axis. `set_down`
does the same to imperfections: ring waves keep their place on their rings, and the size of each ball and the cage stay together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Campaign, Test, on_parts
from thermospindle.sim.campaign.runout_record import RunoutRecord
from thermospindle.sim.operating import OperatingPoint, operating_point
from thermospindle.sim.running.probes import hub_probes, second_plane
from thermospindle.sim.running.run import run_spindle
from thermospindle.sim.running.runout import linear, sampling_rate

NOISE = 1e-9  # m rms in the band of the record: a capacitive probe
SECONDS = 0.6


def set_down(imperfections: Imperfections, balls: Mapping[str, int], random: np.random.Generator) -> Imperfections:
    """The same imperfections with every ball set at another azimuth, and every ball turned; `balls` of each row of the bearings."""
    rows = {name: _set_down(row, balls[name], random) for name, row in imperfections.bearings.items()}
    return replace(imperfections, bearings=rows)


def _set_down(row: RowImperfections, balls: int, random: np.random.Generator) -> RowImperfections:
    further, turned = int(random.integers(balls)), float(random.uniform(0, 2 * np.pi))
    spins = random.uniform(0, 2 * np.pi, len(row.ball_waves) or balls)

    def seen(waves: tuple[Wave, ...]) -> tuple[Wave, ...]:
        """A row `turned` / Z on meets the waves it feels, of order k Z or k Z +- 1, so much of k Z
        later; their own place on the ring stays."""
        return tuple(replace(w, phase=w.phase + round(w.order / balls) * turned) for w in waves)

    def onward(each: tuple[Any, ...]) -> tuple[Any, ...]:
        """What belongs to each element, row by row."""
        rows = [each[k : k + balls] for k in range(0, len(each), balls)]
        return tuple(of_it for row in rows for of_it in (row[-further:] + row[:-further]))

    of_ball = tuple(
        tuple(replace(w, phase=w.phase + w.order * spin) for w in waves) for waves, spin in zip(row.ball_waves, spins, strict=False)
    )
    return replace(
        row,
        inner_radial=seen(row.inner_radial),
        inner_axial=seen(row.inner_axial),
        outer_radial=seen(row.outer_radial),
        outer_axial=seen(row.outer_axial),
        ball_diameter=onward(row.ball_diameter),
        ball_waves=onward(of_ball),
        cage_phase=row.cage_phase + 2 * np.pi * further / balls,
    )


def excited(point: OperatingPoint, imperfections: Imperfections) -> OperatingPoint:
    """The same operating point with other imperfections than its own."""
    quiet = tuple((replace(effect, imperfections=None), values) for effect, values in point.effects)
    return replace(point, spindle=replace(point.spindle, imperfections=imperfections), effects=quiet)


def hub_points(spindle: Spindle) -> tuple[Point, ...]:
    """Five probes on the hub as points of a campaign, with nodes above the scene's own: across the axis in two planes, and along it.

    One plane alone cannot tell the bearings from each other (ISO 230-7:2015 measures a spindle's
    error motions, tilt among them, with five sensors).
    """
    top = hub_probes(spindle)
    below = second_plane(spindle)
    first = max((p.node for p in spindle.points), default=0) + 1
    return tuple(Point(first + i, p.name.replace(" ", "_"), p.body, p.position, p.direction) for i, p in enumerate([*top, *below]))


def runout_campaign(
    spindle: Spindle,
    conditions: Sequence[Condition],
    seconds: float = SECONDS,
    element: str = "linear",
    seed: int = 0,
    noise: float = NOISE,
    path: str = "simulated",
    progress: Callable[[str], None] = lambda done: None,
) -> Campaign:
    """A record of five probes on the hub at every condition, with white noise of `noise` (m rms); the same seed gives the same campaign.

    `path` is simulated (MuJoCo) or linear (the exact harmonic answer).
    """
    random = np.random.default_rng(seed)
    points, balls = hub_points(spindle), {b.name: b.balls for b in spindle.rolling}
    made = []
    for condition in conditions:
        if condition.speed == 0.0:
            raise BadInput("--speeds 0: a spindle at rest has no runout; give speeds in rpm")
        point = operating_point(spindle, condition)
        made.append(excited(point, set_down(point.imperfections, balls, random)))
    rate = max(sampling_rate(point) for point in made)
    time = np.arange(round(seconds * rate)) / rate
    if path == "linear":
        motions = [linear(point, hub_probes(spindle), time).motion for point in made]
    else:
        motions = [record.displacement for record in run_spindle(made, seconds, rate, element, progress=progress)]
    tests: list[Test] = []
    for point, motion in zip(made, motions, strict=True):
        condition = point.condition
        value = np.array([_row(point, p) for p in points]) @ motion.T
        value = value + noise * random.standard_normal(value.shape)
        seen = RunoutRecord(tuple(p.node for p in points), "time", time, value)
        repeat = 1 + sum((t.temperature, t.speed) == (condition.temperature, condition.speed) for t in tests)
        name = f"T{condition.temperature:g}_n{condition.speed / RPM:.0f}" + (f"_{repeat}" if repeat > 1 else "")
        tests.append(Test(name, condition.temperature, condition.speed, repeat=repeat, runout=seen))
    return Campaign(f"virtual runout of {spindle.title}"[:80], spindle.name, "displacement", on_parts(spindle, points), tuple(tests))


def _row(point: OperatingPoint, probe: Point) -> np.ndarray:
    return np.asarray(np.array(probe.direction) @ motion_rows(point.chain, probe.body, probe.position)[:3])
