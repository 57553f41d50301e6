"""A ladder as JSON, and as the table that grows in the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table

from thermospindle.diagnosis.ladder.ladder import Ladder
from thermospindle.diagnosis.ladder.rung import Rung
from thermospindle.report.figures.ladder import PullMap, pull_map
from thermospindle.report.text.ladder import evidence, sentences

COLUMNS = ("rung", "error\ns.e.", "held out\ns.e.", "error\nHz", "error\n%", "of shifts\nHz", "tolerances\ns.d.", "ln evidence")
LEGEND = (
    "Errors are rms, computed - measured; s.e. are standard errors, of the data or, held out, of the prediction from the other "
    "temperatures. Tolerances: rms of the fitted build tolerances in their own standard deviations."
)


def ladder_json(found: Ladder) -> dict[str, Any]:
    first, top = pull_map(found, found.rungs[0]), pull_map(found, found.top)
    return {
        "scene": found.spindle.name,
        "campaign": found.campaign.title,
        "numbers": len(found.theory.data.value),
        "parameters": len(found.theory.sd),
        "verdict": None if found.diagnosis is None else found.diagnosis.verdict.word,
        "top": found.top.name,
        "rungs": [_rung_json(r) for r in found.rungs],
        "forms": [dict(zip(("name", "error", "held_out", "evidence"), f, strict=True)) for f in found.forms],
        "pulls": {"modes": first.modes, "tests": first.tests, "first": _lists(first), "top": _lists(top)},
        "words": sentences(found),
    }


def _rung_json(r: Rung) -> dict[str, Any]:
    units = {e.name: {p.name: p.unit for p in e.parameters} for e in (r.fitted.effects if r.fitted else ())}
    return {
        "name": r.name,
        "on": r.above,
        "effects": list(r.effects),
        "error": r.error,
        "held_out": r.held_out,
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


def _lists(pulls: PullMap) -> dict[str, Any]:
    def rows(a: np.ndarray | None) -> list[list[float | None]] | None:
        return None if a is None else [[None if np.isnan(v) else float(v) for v in row] for row in a]

    return {"frequency": rows(pulls.frequency), "damping": rows(pulls.damping)}


# ---------------------------------------------------------------- terminal


def table(rungs: Sequence[Rung]) -> Table:
    grid = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for column in COLUMNS:
        grid.add_column(column, justify="left" if column == "rung" else "right", no_wrap=column != "rung")
    for r in rungs:
        grid.add_row(*cells(r))
    return grid


def cells(r: Rung) -> tuple[str, ...]:
    shift = "-" if r.rms_shift_Hz is None else f"{r.rms_shift_Hz:.2f}"
    stretch = f"{r.stretch:.2f}" if r.fitted else "as drawn"
    return (r.name, f"{r.error:.2f}", f"{r.held_out:.2f}", f"{r.rms_Hz:.2f}", f"{r.rms_percent:.3f}", shift, stretch, evidence(r.evidence))


class Growing:
    """The table as it grows, with what is being done below it."""

    def __init__(self, live: Live) -> None:
        self.live, self.rungs, self.doing = live, list[Rung](), "reading the campaign"

    def rung(self, rung: Rung) -> None:
        self.rungs.append(rung)
        self._draw()

    def progress(self, doing: str) -> None:
        self.doing = doing
        self._draw()

    def _draw(self) -> None:
        self.live.update(Group(table(self.rungs), Spinner("line", self.doing)))


@contextmanager
def growing(console: Console) -> Iterator[Growing]:
    """A table that grows on the console and leaves it when it is done; on what is no terminal, nothing is written."""
    with Live(console=console, transient=True, refresh_per_second=8) as live:
        yield Growing(live)


def show_ladder(console: Console, found: Ladder) -> None:
    console.print(f"{found.campaign.title} against scene {found.spindle.name}", style="bold", markup=False, highlight=False)
    console.print(table(found.rungs))
    console.print(LEGEND, style="dim", highlight=False)
    for sentence in sentences(found):
        console.print(f"\n{sentence}", markup=False, highlight=False)


# ---------------------------------------------------------------- report and files
