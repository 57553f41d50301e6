"""What `spindle report` adds to the report of a run: the turning spindle's runout, warm-up and resonance map, and a ladder for every
measured campaign."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html import escape

import numpy as np

from diagnosis import ladder_report
from diagnosis.ladder import ladder
from diagnosis.runout_lines import modal_tests
from model.imperfections import Imperfections, drawn
from model.machine import Condition, OutsideRange, Spindle
from model.pair import NoEquilibrium
from model.scene import BadInput
from sim.campaign import Campaign
from sim.effect import Effect
from sim.operating import operating_point
from sim.report import Section
from sim.resonance import SEED, resonance_map
from sim.resonance_output import map_section
from sim.run import Run
from sim.runout import runout, with_imperfections
from sim.runout_output import runout_json, runout_section
from sim.warmup import warm_up
from sim.warmup_output import warmup_section

STEPS = 7  # of progress, without those of the ladders
LADDER_STEPS = 13  # of each ladder, beside one a test
OVER_TEMPERATURE, OVER_SPEED = 13, 31  # grid of the map


def climbed(run: Run) -> list[Campaign]:
    """The measured campaigns that hold modes, for which there is a ladder, without tests that hold none."""
    return [modal for c in run.measured if (modal := modal_tests(c)).tests]


def steps(run: Run) -> int:
    """About how often the functions here report progress."""
    return STEPS + sum(LADDER_STEPS + len(c.tests) for c in climbed(run))


def more_sections(run: Run, speed: float, catalogue: tuple[Effect, ...], progress: Callable[[str], None]) -> Iterator[Section]:
    """Sections of the spindle turning at `speed` (rad/s, positive) over the temperatures of the run, then the ladders."""
    temperatures = sorted({s.point.condition.temperature for s in run.steps})
    yield from turning(run.spindle, temperatures, speed, progress)
    for campaign in climbed(run):
        yield ladder_report.section(ladder(run.spindle, campaign, catalogue=catalogue, progress=progress))


def turning(spindle: Spindle, temperatures: Sequence[float], speed: float, progress: Callable[[str], None]) -> Iterator[Section]:
    """Runout and resonance map from the coldest of the temperatures, warm-up from the spindle's reference temperature."""
    condition = Condition(temperatures[0], speed)
    point = operating_point(spindle, condition)
    seed = None
    if point.imperfections == Imperfections():
        seed, spindle = SEED, with_imperfections(spindle, drawn(spindle, SEED))
        point = operating_point(spindle, condition)
    progress("simulating the turning spindle")
    found = runout(point)
    yield runout_section(found, runout_json(found, "simulated", "linear", seed))
    progress("warming up")
    try:
        yield warmup_section(warm_up(spindle, speed, spindle.reference_temperature, progress=progress))
    except (BadInput, OutsideRange, NoEquilibrium) as error:  # a scene need not say how it is cooled
        yield "Warm-up", f"<p>Not computed: {escape(str(error))}.</p>"
    low, high = temperatures[0], temperatures[-1]
    if high > low:
        progress("mapping resonances")
        grid = np.linspace(low, high, OVER_TEMPERATURE).tolist(), np.linspace(0, 2 * speed, OVER_SPEED).tolist()
        yield map_section(resonance_map(spindle, *grid, condition, progress=progress))
