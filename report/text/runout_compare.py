"""Measured runout beside the scene's, as JSON and in terminal tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.diagnosis.runout.compare import LineBeside, PartBeside, RunoutBeside, rms_residual
from thermospindle.model.units import RPM, TO_UM
from thermospindle.report.text.grid import grid

SHOWN = 12  # lines of a test
WORDS = ("test", "line", "cause")


def runout_comparison_json(found: Sequence[RunoutBeside]) -> dict[str, Any]:
    return {
        "rms_pull": rms_residual(found),
        "tests": [
            {
                "id": t.test.id,
                "temperature_C": t.test.temperature,
                "speed_rpm": t.test.speed / RPM,
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


def show_runout_comparison(console: Console, found: Sequence[RunoutBeside]) -> None:
    """One table of lines a test, strongest first, one of RRO and NRRO."""
    console.print(f"Runout: rms residual of all lines {rms_residual(found) or np.nan:.3g} standard errors", highlight=False)
    parts = grid("Runout parts, rms, nm", ("test", "node", "RRO", "computed", "NRRO", "computed"), WORDS)
    for t in found:
        columns = ("Hz", "orders", "node", "line", "cause", "measured", "+-", "computed", "+- ", "error\ns.d.")
        lines = grid(f"{t.test.id}: lines, nm zero to peak", columns, WORDS)
        for g in t.lines[:SHOWN]:
            cause = f"{g.causes[0].bearing} {g.causes[0].cause}".strip() + (f" {g.causes[0].order}" if g.causes[0].order else "")
            sizes = (*(f"{1e9 * v:.2f}" for v in (g.measured, g.measured_sd, g.computed, g.scatter)), f"{g.residual:+.1f}")
            lines.add_row(f"{g.frequency:.2f}", f"{g.order:.3f}", str(g.node), g.causes[0].name, cause, *sizes)
        console.print(lines)
        for s in t.unexplained:
            console.print(
                f"{t.test.id}: unexplained line at {s.frequency:.1f} Hz, {1e9 * s.amplitude:.3g} nm at node {s.node}", highlight=False
            )
        for r, n in zip(t.rro, t.nrro, strict=True):
            cells = (f"{1e9 * v:.2f}" for v in (r.measured_rms, r.computed_rms, n.measured_rms, n.computed_rms))
            parts.add_row(t.test.id if r is t.rro[0] else "", str(r.node), *cells)
        parts.add_section()
    console.print(parts)


def show_errors(console: Console, errors: dict[str, float | None]) -> None:
    """One line each for all, fitted and held-out tests: the errors before and after."""
    for which in ("", "fitted_", "held_out_"):
        one, other = errors[f"{which}before"], errors[f"{which}after"]
        if one is not None and other is not None:
            tests = (which or "all_")[:-1].replace("_", " ")
            console.print(f"Runout, {tests} tests: rms residual {one:.3g} -> {other:.3g} standard errors", highlight=False)
