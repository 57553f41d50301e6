"""What `spindle report` adds to the report of a run: the turning spindle's runout, warm-up and resonance map, and a ladder for every
measured campaign."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html import escape

import numpy as np

from thermospindle.diagnosis.ladder.ladder import ladder
from thermospindle.diagnosis.runout.lines import modal_tests
from thermospindle.model.built.drawn import drawn
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.report.page import ladder as ladder_report
from thermospindle.report.page.report import Section
from thermospindle.report.text.resonance import map_section
from thermospindle.report.text.runout import runout_json, runout_section
from thermospindle.report.text.warmup import warmup_section
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.map import SEED, resonance_map, stages
from thermospindle.sim.run import Run
from thermospindle.sim.running.runout import runout, with_imperfections
from thermospindle.sim.warmup import STAGES, warm_up

STEPS = 3  # of progress, beside those of the warm-up, of the map and of the ladders
LADDER_STEPS = 13  # of each ladder, beside three a test: it reads modes, and the diagnosis reads lines
OVER_TEMPERATURE, OVER_SPEED = 13, 31  # grid of the map


def climbed(run: Run) -> list[Campaign]:
    """The measured campaigns that hold modes, for which there is a ladder, without tests that hold none."""
    return [modal for c in run.measured if (modal := modal_tests(c)).tests]


def steps(run: Run) -> int:
    """About how often the functions here report progress."""
    return STEPS + STAGES + stages(run.spindle, OVER_TEMPERATURE) + sum(LADDER_STEPS + 3 * len(c.tests) for c in climbed(run))


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
