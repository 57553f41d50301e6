"""Measured runout beside the scene's: every line with its cause, and the repeatable and nonrepeatable parts.

The scene's imperfections are taken as they are, but where the balls stood when a record began nothing foretells: a line of both bearings, or of several
balls, is their sum by chance. Its computed amplitude is the rms over random starts. An error is told in standard deviations of the record, of that chance, and
of how spindles of one drawing scatter about the scene's imperfections, which are one draw (`runout_sources`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from thermospindle.diagnosis.runout.lines import Seen, StrangeLine, key_of, look, runout_tests
from thermospindle.diagnosis.runout.sources import phasors, scatter
from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.machine import Point, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, TO_UM
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.simulated import set_down
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.revolutions import revolutions

STARTS = 24  # random starts of the balls
SHOWN = 12  # lines of a test in the terminal


@dataclass(frozen=True, eq=False)
class LineBeside:
    """One line at one probe (m, zero to peak): `causes` strongest first by the scene; `measured_sd` is the record's error, `scatter` that of the
    computed amplitude: chance of the start, and of the build."""

    frequency: float
    order: float
    node: int
    causes: tuple[Line, ...]
    measured: float
    measured_sd: float
    computed: float
    scatter: float

    @property
    def pull(self) -> float:
        return (self.computed - self.measured) / float(np.hypot(self.measured_sd, self.scatter))


@dataclass(frozen=True)
class PartBeside:
    """Peak to valley and rms (m) of the repeatable or the nonrepeatable part at one probe; peak to valley only for a time record."""

    node: int
    measured_rms: float
    computed_rms: float
    measured: float | None
    computed: float | None


@dataclass(frozen=True, eq=False)
class RunoutBeside:
    """A test: its lines, strongest first, RRO and NRRO of every probe, and lines that theory does not know."""

    test: Test
    lines: tuple[LineBeside, ...]
    rro: tuple[PartBeside, ...]
    nrro: tuple[PartBeside, ...]
    strange: tuple[StrangeLine, ...]


def compare_runout(spindle: Spindle, campaign: Campaign, progress: Callable[[str], None] = lambda done: None) -> list[RunoutBeside]:
    """Every runout test of a campaign beside the scene."""
    found = []
    for test in runout_tests(campaign).tests:
        found.append(_beside(spindle, look(spindle, test), campaign.points))
        progress(f"{test.id}: {len(found[-1].lines)} lines compared")
    return found


def rms_pull(found: list[RunoutBeside]) -> float:
    """Rms of the pulls of all lines."""
    pulls = [line.pull for test in found for line in test.lines]
    return float(np.sqrt(np.mean(np.square(pulls)))) if pulls else float("nan")


def errors_of(before: list[RunoutBeside], after: list[RunoutBeside], held_out: Sequence[str]) -> dict[str, float | None]:
    """Rms pulls of all tests, of fitted and of held-out ones, by the scene before and after; None where there are no such tests."""
    found: dict[str, float | None] = {}
    for when, tests in (("before", before), ("after", after)):
        for which, wanted in (("", (True, False)), ("fitted_", (False,)), ("held_out_", (True,))):
            own = [t for t in tests if (t.test.id in held_out) in wanted]
            found[f"{which}{when}"] = rms_pull(own) if own else None
    return found


def show_errors(console: Console, errors: dict[str, float | None]) -> None:
    """One line: the errors before and after."""
    for which in ("", "fitted_", "held_out_"):
        one, other = errors[f"{which}before"], errors[f"{which}after"]
        if one is not None and other is not None:
            console.print(
                f"Runout, {(which or 'all_')[:-1].replace('_', ' ')} tests: rms pull {one:.3g} -> {other:.3g} standard errors",
                highlight=False,
            )


def _beside(spindle: Spindle, seen: Seen, points: tuple[Point, ...]) -> RunoutBeside:
    point = operating_point(spindle, seen.condition)
    by_node = {p.node: p for p in points}
    own = phasors(point, point.imperfections, [by_node[n] for n in seen.nodes])
    turning = abs(seen.condition.speed) / (2 * np.pi)
    balls = {b.name: b.balls for b in point.spindle.bearings}
    random = np.random.default_rng(0)
    starts = [phasors(point, set_down(point.imperfections, balls, random), [by_node[n] for n in seen.nodes]) for _ in range(STARTS)]
    builds = scatter(spindle, point, [by_node[n] for n in seen.nodes])
    nothing = np.zeros(len(seen.nodes), complex)
    found, waves = [], []
    for one in seen.seen:
        keys = [key_of(g) for g in one.lines]
        parts = {key: own[key] for key in keys if key in own}
        waves += [(g.frequency, own[key_of(g)]) for g in one.lines if key_of(g) in own]
        tried = np.abs([sum((start.get(key, nothing) for key in keys), nothing) for start in starts])
        for i, node in enumerate(seen.nodes):
            sizes = {key_of(g): float(abs(parts[key_of(g)][i])) if key_of(g) in parts else 0.0 for g in one.lines}
            strongest = max(sizes.values())
            causes = tuple(sorted((g for g in one.lines if sizes[key_of(g)] >= 1e-3 * strongest), key=lambda g: -sizes[key_of(g)]))
            computed, chance = float(np.sqrt(np.mean(tried[:, i] ** 2))), float(tried[:, i].std())
            build = float(np.sqrt(sum((builds[key][i] for key in keys if key in builds), 0.0) / 2))
            measured, sd = float(abs(one.phasor[i])), float(one.sd[i] / np.sqrt(2))
            found.append(
                LineBeside(one.frequency, one.frequency / turning, node, causes, measured, sd, computed, float(np.hypot(chance, build)))
            )
    rro, nrro = _parts(seen, waves, turning)
    return RunoutBeside(seen.test, tuple(sorted(found, key=lambda g: -max(g.measured, g.computed))), rro, nrro, seen.strange)


def _parts(seen: Seen, waves: list[tuple[float, Any]], turning: float) -> tuple[tuple[PartBeside, ...], tuple[PartBeside, ...]]:
    record = seen.test.runout
    assert record is not None
    n = len(seen.nodes)
    if record.kind == "time":
        made = np.zeros((n, len(record.axis)))
        for f, phasor in waves:
            turn = 2 * np.pi * f * record.axis
            made += np.outer(phasor.real, np.cos(turn)) - np.outer(phasor.imag, np.sin(turn))
        angle = seen.condition.speed * record.axis
        both = [revolutions(record.axis, angle, value - value.mean(axis=1, keepdims=True)) for value in (record.value, made)]
        told = []
        for what in ("repeatable", "nonrepeatable"):
            m, c = (getattr(cut, what).reshape(n, -1) for cut in both)
            told.append(
                tuple(
                    PartBeside(node, float(m[i].std()), float(c[i].std()), float(np.ptp(m[i])), float(np.ptp(c[i])))
                    for i, node in enumerate(seen.nodes)
                )
            )
        return told[0], told[1]
    power = np.zeros((2, 2, n))
    for s in seen.seen:
        power[int(_whole(s.frequency, turning)), 0] += np.abs(s.phasor) ** 2 / 2
    for f, phasor in waves:
        power[int(_whole(f, turning)), 1] += np.abs(phasor) ** 2 / 2
    rms: Array = np.sqrt(power)
    told = [
        tuple(PartBeside(node, float(rms[k, 0, i]), float(rms[k, 1, i]), None, None) for i, node in enumerate(seen.nodes)) for k in (1, 0)
    ]
    return told[0], told[1]


def _whole(frequency: float, turning: float) -> bool:
    return abs(frequency / turning - round(frequency / turning)) < 1e-6


# ---------------------------------------------------------------- told


def runout_comparison_json(found: list[RunoutBeside]) -> dict[str, Any]:
    return {
        "rms_pull": rms_pull(found),
        "tests": [
            {
                "id": t.test.id,
                "temperature_C": t.test.temperature,
                "speed_rpm": t.test.speed / RPM,
                "lines": [_line_json(g) for g in t.lines],
                "rro": [_part_json(p) for p in t.rro],
                "nrro": [_part_json(p) for p in t.nrro],
                "unexplained_lines": [
                    {"frequency_Hz": g.frequency, "order": g.order, "amplitude_um": TO_UM * g.amplitude, "node": g.node} for g in t.strange
                ],
            }
            for t in found
        ],
    }


def _line_json(g: LineBeside) -> dict[str, Any]:
    return {
        "frequency_Hz": g.frequency,
        "order": g.order,
        "node": g.node,
        "cause": g.causes[0].cause,
        "bearing": g.causes[0].bearing,
        "waviness_order": g.causes[0].order,
        "name": g.causes[0].name,
        "direction": g.causes[0].direction,
        "causes": [{"bearing": c.bearing, "cause": c.cause, "waviness_order": c.order, "name": c.name} for c in g.causes],
        "measured_um": TO_UM * g.measured,
        "sd_um": TO_UM * g.measured_sd,
        "computed_um": TO_UM * g.computed,
        "scatter_um": TO_UM * g.scatter,
        "pull": g.pull,
    }


def _part_json(p: PartBeside) -> dict[str, Any]:
    valley = {
        "measured_um": None if p.measured is None else TO_UM * p.measured,
        "computed_um": None if p.computed is None else TO_UM * p.computed,
    }
    return {"node": p.node, "measured_rms_um": TO_UM * p.measured_rms, "computed_rms_um": TO_UM * p.computed_rms} | valley


def show_runout_comparison(console: Console, found: list[RunoutBeside]) -> None:
    """One table of lines a test, strongest first, one of RRO and NRRO."""
    console.print(f"Runout: rms pull of all lines {rms_pull(found):.3g} standard errors", highlight=False)
    parts = _grid("Runout parts, rms, nm", "test", "node", "RRO", "computed", "NRRO", "computed")
    for t in found:
        columns = ("Hz", "orders", "node", "line", "cause", "measured", "+-", "computed", "+- ", "error\ns.d.")
        grid = _grid(f"{t.test.id}: lines, nm zero to peak", *columns)
        for g in t.lines[:SHOWN]:
            cause = f"{g.causes[0].bearing} {g.causes[0].cause}".strip() + (f" {g.causes[0].order}" if g.causes[0].order else "")
            sizes = (*(f"{1e9 * v:.2f}" for v in (g.measured, g.measured_sd, g.computed, g.scatter)), f"{g.pull:+.1f}")
            grid.add_row(f"{g.frequency:.2f}", f"{g.order:.3f}", str(g.node), g.causes[0].name, cause, *sizes)
        console.print(grid)
        for s in t.strange:
            console.print(
                f"{t.test.id}: unexplained line at {s.frequency:.1f} Hz, {1e9 * s.amplitude:.3g} nm at node {s.node}", highlight=False
            )
        for r, n in zip(t.rro, t.nrro, strict=True):
            cells = (f"{1e9 * v:.2f}" for v in (r.measured_rms, r.computed_rms, n.measured_rms, n.computed_rms))
            parts.add_row(t.test.id if r is t.rro[0] else "", str(r.node), *cells)
        parts.add_section()
    console.print(parts)


def _grid(title: str, *columns: str) -> Table:
    grid = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for column in columns:
        grid.add_column(column, justify="left" if column in ("test", "line", "cause") else "right", no_wrap=True)
    return grid
