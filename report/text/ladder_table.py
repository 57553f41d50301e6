"""A ladder as JSON, and as the table that grows in the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table

from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.ladder.ladder import Ladder
from thermospindle.diagnosis.ladder.step import Step
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.report.progress import plain_lines
from thermospindle.report.text.ladder import evidence, leading, sentences
from thermospindle.report.typeset import known

COLUMNS = ("step", "error\ns.e.", "left out\ns.e.", "error\nHz", "shifts\nHz", "tolerances\ns.d.", "ln\nevidence")
LEGEND = (
    "Errors are rms residuals; s.e. are standard errors of the data (of every FRF line, or of a table's numbers) or, left out, of the prediction "
    "by a fit that has not seen that temperature, or, at one condition, that mode. Hz: of natural frequencies. Tolerances: rms of the fitted ones in their own "
    "standard deviations. What `diagnose` calls fitted grants constant errors of the model beside the tolerances, as the step \"constant discrepancy\" does."
)


@dataclass(frozen=True, eq=False)
class ResidualMap:
    """(computed - measured) / standard error by mode (row) and test (column), NaN where not measured;
    `damping` None without any standard error, then `damping_percent` of the measured ones where there are."""

    modes: list[str]
    tests: list[str]
    frequency: Array
    damping: Array | None
    damping_percent: Array | None


def residual_map(found: Ladder, step: Step) -> ResidualMap:
    """The residuals of a step in all numbered modes, tests in order of speed and temperature."""
    measured, tests = found.measured, found.measured.observations
    order = sorted(range(len(tests)), key=lambda t: _place(tests[t]))
    column = {t: k for k, t in enumerate(order)}
    row = {number: k for k, number in enumerate(measured.kinds)}
    maps = np.full((3, len(row), len(order)), np.nan)
    rows = zip(measured.number, measured.test, *step.residual(measured), 100 * (step.damping / measured.damping - 1), strict=True)
    for number, t, *values in rows:
        if number:
            maps[:, row[int(number)], column[int(t)]] = values
    frequency, damping, percent = maps
    sure, told = np.isfinite(damping).any(), np.isfinite(percent).any()
    modes = [f"{n} {kind}" for n, kind in measured.kinds.items()]
    return ResidualMap(modes, _tests([tests[t] for t in order]), frequency, damping if sure else None, percent if told and not sure else None)


def _place(o: Observation) -> tuple[float, float, str]:
    return abs(o.condition.speed), o.condition.temperature, o.test.id


def _tests(observations: list[Observation]) -> list[str]:
    """Temperature, and speed where there are several; the id of the test where that says too little."""
    speeds = {o.condition.speed for o in observations}
    labels = [f"{o.condition.temperature:g} °C" + (f", {o.condition.speed / RPM:.0f} rpm" if len(speeds) > 1 else "") for o in observations]
    return labels if len(set(labels)) == len(labels) else [o.test.id for o in observations]


def ladder_json(found: Ladder) -> dict[str, Any]:
    first, top = residual_map(found, found.steps[0]), residual_map(found, found.top)
    return {
        "scene": found.spindle.name,
        "campaign": found.campaign.title,
        "numbers": sum(d.count for d in found.model.tests),
        "parameters": len(found.model.parameters),
        "verdict": None if found.diagnosis is None else found.diagnosis.verdict.word,
        "top": found.top.name,
        "left_out": found.left_out,
        "rungs": [_step_json(r) for r in found.steps],
        "forms": [{"name": f[0], "error": f[1], "held_out": known(f[2]), "evidence": f[3]} for f in found.forms],
        "pulls": {"modes": first.modes, "tests": first.tests, "first": _lists(first), "top": _lists(top)},  # residuals in standard errors
        "words": sentences(found),
    }


def _step_json(r: Step) -> dict[str, Any]:
    units = {m.name: {p.name: p.unit for p in m.effect.parameters} for m in (r.fitted.mechanisms if r.fitted else ())}
    return {
        "name": r.name,
        "on": r.above,
        "effects": list(r.effects),
        "error": r.error,
        "held_out": known(r.held_out),
        "held_out_percent": known(r.held_out_percent),
        "rms_Hz": r.rms_Hz,
        "rms_percent": r.rms_percent,
        "rms_shift_Hz": r.rms_shift_Hz,
        "tolerances_rms_sd": r.stretch,
        "evidence": r.evidence,
        "parameters": {
            f"{e}.{p}": {"value": v, "sd": sd, "unit": units[e][p]} for e, row in r.values.items() for p, (v, sd) in row.items()
        },
        "lost_contact": list(r.lost_contact),
    }


def _lists(residuals: ResidualMap) -> dict[str, Any]:
    dampings = {"damping": residuals.damping, "damping_percent": residuals.damping_percent}
    return {"frequency": known(residuals.frequency)} | {key: None if values is None else known(values) for key, values in dampings.items()}


# ---------------------------------------------------------------- terminal


def table(steps: Sequence[Step]) -> Table:
    grid = Table(box=SIMPLE_HEAD, show_edge=False, padding=(0, 1, 0, 0))
    grid.add_column(COLUMNS[0], min_width=22, overflow="fold")
    for column in COLUMNS[1:]:
        grid.add_column(column, justify="right", no_wrap=True)
    for r in steps:
        grid.add_row(*cells(r))
    return grid


def cells(r: Step) -> tuple[str, ...]:
    shift = "-" if r.rms_shift_Hz is None else f"{r.rms_shift_Hz:.2f}"
    stretch = f"{r.stretch:.2f}" if r.fitted else "as drawn"
    held_out = f"{r.held_out:.2f}" if np.isfinite(r.held_out) else "-"
    return (r.name, f"{r.error:.2f}", held_out, f"{r.rms_Hz:.2f}", shift, stretch, evidence(r.evidence))


class Growing:
    """The steps as they are climbed, and what is being done beside them: each time `draw` is given both."""

    def __init__(self, draw: Callable[[list[Step], str], object]) -> None:
        self.draw, self.steps, self.doing = draw, list[Step](), "reading the campaign"

    def step(self, step: Step) -> None:
        self.steps.append(step)
        self.draw(self.steps, self.doing)

    def progress(self, doing: str) -> None:
        self.doing = doing
        self.draw(self.steps, doing)


@contextmanager
def growing(console: Console) -> Iterator[Growing]:
    """A table that grows in a terminal and leaves it when it is done; elsewhere a plain line now and then, with the last step."""
    if not console.is_terminal:
        with plain_lines() as told:
            yield Growing(lambda steps, doing: told(_now(steps, doing)))
        return
    with Live(console=console, transient=True, refresh_per_second=8) as live:
        yield Growing(lambda steps, doing: live.update(Group(table(steps), Spinner("line", doing))))


def _now(steps: Sequence[Step], doing: str) -> str:
    return f"step {len(steps)} ({steps[-1].name}) done, error {steps[-1].error:.2f} s.e.; now: {doing}" if steps else doing


def show_ladder(console: Console, found: Ladder) -> None:
    console.print(f"{found.campaign.title} against scene {found.spindle.name}", style="bold", markup=False, highlight=False)
    console.print(f"{(lead := leading(found))}\n", markup=False, highlight=False)
    console.print(table(found.steps))
    console.print(LEGEND, style="dim", highlight=False)
    for sentence in sentences(found):
        if sentence != lead:
            console.print(f"\n{sentence}", markup=False, highlight=False)

