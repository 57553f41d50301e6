"""What `spindle report` adds to the report of a run: the turning spindle's runout, warm-up and resonance map, and a ladder for every
measured campaign."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html import escape

import numpy as np

from thermospindle.diagnosis.ladder.ladder import ladder
from thermospindle.diagnosis.runout.lines import modal_tests
from thermospindle.model.built.drawn import PLAUSIBLE, drawn
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
from thermospindle.sim.resonance.map import resonance_map, speeds_about, stages
from thermospindle.sim.run import Run
from thermospindle.sim.running.runout import planned, runout, with_imperfections
from thermospindle.sim.warmup import STAGES, warm_up

STEPS = 3  # of progress, beside those of the warm-up, of the map and of the ladders
LADDER_STEPS = 14  # of each ladder, beside three a test: it reads modes, and the diagnosis reads lines
OVER_TEMPERATURE, OVER_SPEED = 13, 31  # grid of the map


def climbed(run: Run) -> list[Campaign]:
    """The measured campaigns that hold modes, for which there is a ladder, without tests that hold none."""
    return [modal for c in run.measured if (modal := modal_tests(c)).tests]


def steps(run: Run) -> int:
    """About how often the functions here report progress."""
    of_turning = STEPS + STAGES + stages(run.spindle, OVER_TEMPERATURE) if run.spindle.structure.turns else 0
    return of_turning + sum(LADDER_STEPS + 3 * len(c.tests) for c in climbed(run))


def more_sections(run: Run, speed: float, catalogue: tuple[Effect, ...], progress: Callable[[str], None]) -> Iterator[Section]:
    """Sections of the spindle turning at `speed` (rad/s, positive) over the temperatures of the run, then the ladders."""
    temperatures = sorted({s.point.condition.temperature for s in run.steps})
    yield from turning(run.spindle, temperatures, speed, progress)
    for campaign in climbed(run):
        yield ladder_report.section(ladder(run.spindle, campaign, catalogue=catalogue, progress=progress))


def turning(spindle: Spindle, temperatures: Sequence[float], speed: float, progress: Callable[[str], None]) -> Iterator[Section]:
    """Runout and resonance map from the coldest of the temperatures, warm-up from the spindle's
    reference temperature; of what is left out a sentence that says why."""
    if not spindle.structure.turns:
        yield "Runout, warm-up and resonance map", "<p>Left out, all three: nothing of this machine turns (no body or shaft has <code>turns = true</code>).</p>"
        return
    low, high = temperatures[0], temperatures[-1]
    condition = Condition(low, speed)

    def of_runout() -> Section:
        point, seed = operating_point(spindle, condition), None
        if point.imperfections == Imperfections():
            point, seed = operating_point(with_imperfections(spindle, drawn(spindle, PLAUSIBLE)), condition), PLAUSIBLE
        path = planned(point).path
        found = runout(point, path=path)
        return runout_section(found, runout_json(found, path, "linear", seed))

    progress("simulating the turning spindle")
    yield _computed("Runout", of_runout)
    progress("warming up")
    if not spindle.regions:
        yield "Warm-up", "<p>Left out: the scene has no section that heat could flow through.</p>"
    elif not spindle.ringed:
        yield "Warm-up", "<p>Left out: no ball or roller row runs between rings of the section, so no bearing makes heat.</p>"
    else:
        yield _computed("Warm-up", lambda: warmup_section(warm_up(spindle, speed, spindle.reference_temperature, progress=progress)))
    if high == low:
        yield "Resonance map", f"<p>Left out: a map goes over temperatures, and this report has {low:g} °C alone.</p>"
        return
    progress("mapping resonances")
    grid = np.linspace(low, high, OVER_TEMPERATURE).tolist(), speeds_about(spindle, speed, OVER_SPEED)
    yield _computed("Resonance map", lambda: map_section(resonance_map(spindle, *grid, condition, progress=progress)))


def _computed(title: str, section: Callable[[], Section]) -> Section:
    """The section, or in its place why there is none: a scene need not say how it is cooled, nor bear every speed."""
    try:
        return section()
    except (BadInput, OutsideRange, NoEquilibrium) as error:
        return title, f"<p>Not computed: {escape(str(error))}.</p>"
