"""Measured runout beside the scene's, as JSON and in terminal tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.diagnosis.runout.compare import LineBeside, PartBeside, RunoutBeside, rms_residual
from thermospindle.model.units import TO_UM, in_rpm, small_length
from thermospindle.report.text.grid import grid, show_grid

SHOWN = 12  # lines of a table
WORDS = ("test", "line", "cause")


def runout_comparison_json(found: Sequence[RunoutBeside]) -> dict[str, Any]:
    return {
        "rms_pull": rms_residual(found),
        "tests": [
            {
                "id": t.test.id,
                "temperature_C": t.test.temperature,
                "speed_rpm": in_rpm(t.test.speed),
                "lines": [_line_json(g) for g in t.lines],
                "rro": [_part_json(p) for p in t.rro],
                "nrro": [_part_json(p) for p in t.nrro],
                "unexplained_lines": [
                    {"frequency_Hz": g.frequency, "order": g.order, "amplitude_um": TO_UM * g.amplitude, "node": g.node} for g in t.unexplained
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
        "pull": g.residual,
    }


def _part_json(p: PartBeside) -> dict[str, Any]:
    valley = {
        "measured_um": None if p.measured is None else TO_UM * p.measured,
        "computed_um": None if p.computed is None else TO_UM * p.computed,
    }
    return {"node": p.node, "measured_rms_um": TO_UM * p.measured_rms, "computed_rms_um": TO_UM * p.computed_rms} | valley


def show_runout_comparison(console: Console, found: Sequence[RunoutBeside], verbose: bool = False) -> None:
    """Of the `SHOWN` strongest lines of every test those farthest from their likely size, RRO and NRRO; with `verbose` these lines by test."""
    every = sorted(((t.test.id, g) for t in found for g in t.lines[:SHOWN]), key=lambda row: -abs(row[1].residual))
    console.print(f"Runout: rms residual of all lines {rms_residual(found) or np.nan:.3g} standard errors", highlight=False)
    rows = [[test, str(g.node), g.causes[0].name, cause_words(g), *_sizes(g)] for test, g in every[:SHOWN]]
    title = "Strong lines farthest from their likely size, nm zero to peak"
    show_grid(console, title, ("test", "node", "line", "cause", "measured", "computed", "error\ns.d."), rows, WORDS)
    for t in found if verbose else ():
        columns = ("Hz", "node", "line", "cause", "measured", "computed", "error\ns.d.", "orders", "measured\n+-", "computed\n+-")
        lines = [
            [f"{g.frequency:.2f}", str(g.node), g.causes[0].name, cause_words(g), *_sizes(g), f"{g.order:.3f}", _nm(g.measured_sd), _nm(g.scatter)]
            for g in t.lines[:SHOWN]
        ]
        show_grid(console, f"{t.test.id}: lines, nm zero to peak", columns, lines, WORDS, keys=4)
    for t in found:
        for s in t.unexplained:
            console.print(f"{t.test.id}: unexplained line at {s.frequency:.1f} Hz, {small_length(s.amplitude)} at node {s.node}", highlight=False)
    parts = grid("Runout parts, rms, nm", ("test", "node", "RRO", "computed", "NRRO", "computed"), WORDS)
    for t in found:
        for r, n in zip(t.rro, t.nrro, strict=True):
            cells = (_nm(v) for v in (r.measured_rms, r.computed_rms, n.measured_rms, n.computed_rms))
            parts.add_row(t.test.id if r is t.rro[0] else "", str(r.node), *cells)
        parts.add_section()
    console.print(parts)
    if not verbose:
        console.print("--verbose shows the strongest lines of every test.", highlight=False)


def cause_words(g: LineBeside) -> str:
    """What makes a line, in so few words that a table holds them: the bearing, and the ring or the balls with the order of the wave."""
    first = g.causes[0]
    return f"{first.bearing} {first.cause.replace('waviness', str(first.order)) if first.order else first.cause}".strip()


def _sizes(g: LineBeside) -> tuple[str, str, str]:
    return _nm(g.measured), _nm(g.computed), f"{g.residual:+z.1f}"


def _nm(value: float) -> str:
    return f"{1e9 * value:.2f}"


def before_after(errors: Mapping[str, float | None]) -> Iterator[tuple[str, float, float]]:
    """Of all, fitted and held-out tests, as far as there are such, the errors before and after."""
    for tests, which in (("all", ""), ("fitted", "fitted_"), ("held out", "held_out_")):
        one, other = errors.get(f"{which}before"), errors.get(f"{which}after")
        if one is not None and other is not None:
            yield tests, one, other


def show_errors(console: Console, errors: Mapping[str, float | None]) -> None:
    for tests, one, other in before_after(errors):
        console.print(f"Runout, {tests} tests: rms residual {one:.3g} -> {other:.3g} standard errors", highlight=False)
