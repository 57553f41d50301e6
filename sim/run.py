"""The whole chain at several temperatures: operating points, impact tests, identified modes, and the measured ones beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Campaign, Test, on_parts, read_campaign
from thermospindle.sim.hammer.pulse import check_band, middle_of_hit
from thermospindle.sim.hammer.test import ImpactTest, impact_tests
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.identification.modal import Modes, extract
from thermospindle.sim.operating import OperatingPoint, operating_point


@dataclass(frozen=True, eq=False)
class Step:
    """Everything at one temperature."""

    point: OperatingPoint
    test: ImpactTest
    identified: Modes


@dataclass(frozen=True, eq=False)
class Run:
    """A run of the whole chain; `measured` are the campaigns that come with the scene."""

    spindle: Spindle
    steps: tuple[Step, ...]
    measured: tuple[Campaign, ...]


def run(
    spindle: Spindle,
    temperatures: Sequence[float],
    speed: float = 0.0,
    element: str | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda done: None,
) -> Run:
    """Run the chain at every temperature (C), with the `usual` element (`sim.hammer.test`) where
    none is asked for; `progress` is told in words what has been done."""
    check_band(spindle.hammer, str(spindle.file or spindle.name))
    points = []
    for temperature in temperatures:
        points.append(operating_point(spindle, Condition(temperature, speed, spindle.hammer.level)))
        progress(f"{temperature:g} C: {points[-1].state.words}")
    tests = impact_tests(points, element=element, seed=seed, progress=progress)
    steps = []
    for test in tests:
        steps.append(Step(test.point, test, identify(test)))
        progress(f"{test.point.condition.temperature:g} C: {len(steps[-1].identified.frequency)} modes identified")
    return Run(spindle, tuple(steps), measured_campaigns(spindle))


def identify(test: ImpactTest, highest: float = np.inf) -> Modes:
    """Modes of an impact test up to `highest` Hz, with the damping of its exponential window taken out."""
    frf = _as_measured(test.estimate.h1)
    return extract(frf.frequency, frf.value, frf.sd, band=(0.0, highest), kind=frf.quantity, window_decay=test.estimate.window_decay)


def measured_campaigns(spindle: Spindle) -> tuple[Campaign, ...]:
    """The campaigns in the `measured` folder beside the scene file, by name."""
    folder = spindle.file.parent / "measured" if spindle.file else Path("does not exist")
    return tuple(read_campaign(path.parent) for path in sorted(folder.glob("*/campaign.toml")))


def as_campaign(run: Run, title: str) -> Campaign:
    """The run's virtual tests in the form of a measured campaign."""
    tests = tuple(
        Test(
            id=f"T{step.point.condition.temperature:g}_n{step.point.condition.speed / RPM:.0f}",
            temperature=step.point.condition.temperature,
            speed=step.point.condition.speed,
            level=run.spindle.hammer.level,
            window_decay=step.test.estimate.window_decay,
            pretrigger=middle_of_hit(run.spindle.hammer),
            frf=replace(_as_measured(step.test.estimate.h1), names={p.node: p.name for p in step.point.spindle.points}),
        )
        for step in run.steps
    )
    return Campaign(title, run.spindle.name, "mobility", on_parts(run.spindle, run.spindle.points), tests, lumped_shafts=bool(run.spindle.structure.shafts))


def _as_measured(frf: Frf) -> Frf:
    """A campaign holds no standard errors where a single hit has no scatter, and then says that there are none."""
    return frf if frf.sd is None or np.all(np.isfinite(frf.sd)) else replace(frf, sd=None)
