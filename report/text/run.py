"""What `run` and `impact` say: the JSON objects, the terminal tables, and the files of a run's folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.model.errors import listed
from thermospindle.model.files.stiffness_table import write_table
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.modes import Mode, group_energy
from thermospindle.model.units import RPM, in_rpm
from thermospindle.report.text.grid import show_grid
from thermospindle.report.text.states import modes_json, show_table, write_modes_csv
from thermospindle.sim.campaign.campaign import Campaign, write_campaign
from thermospindle.sim.identification.numbering import identified, measured_rows, numbered
from thermospindle.sim.operating import provenance, stiffness_table
from thermospindle.sim.run import Run, Step, as_campaign

MOST_DECIMALS = 12
MUCH = 0.1  # of what a hammer moves and sensors see of one mode, from which another near it has a part in its peak

# ---------------------------------------------------------------- JSON


def impact_json(step: Step) -> dict[str, Any]:
    m = step.identified
    rows = zip(m.frequency, m.frequency_sd, m.damping, m.damping_sd, strict=True)
    keys = ("frequency_Hz", "frequency_sd_Hz", "damping_ratio", "damping_ratio_sd")
    return {
        "temperature_C": step.point.condition.temperature,
        "speed_rpm": in_rpm(step.point.condition.speed),
        "modes": [dict(zip(keys, map(float, row), strict=True)) for row in rows],
    }


def run_json(run: Run) -> dict[str, Any]:
    highest = run.spindle.hammer.band[1]
    return {
        "provenance": provenance(run.spindle),
        "conditions": [modes_json(s.point, highest) | {"identified": impact_json(s)["modes"]} for s in run.steps],
    }


# ---------------------------------------------------------------- files


def campaign_of(run: Run) -> Campaign:
    return as_campaign(run, f"virtual tests of {run.spindle.title}"[:80])


def write_campaign_of(run: Run, folder: Path) -> None:
    write_campaign(campaign_of(run), folder)


def write_run(run: Run, folder: Path, progress: Callable[[str], None]) -> None:
    """Everything a run leaves behind: tables, model, campaign, report, Rerun log."""
    from thermospindle.report.log.run import write_log  # matplotlib and rerun take their time to load
    from thermospindle.report.page.report import write_report

    temperatures = [s.point.condition.temperature for s in run.steps]
    write_table(stiffness_table(run.spindle, temperatures, [run.steps[0].point.condition.speed]), folder / "table.csv")
    points = [s.point for s in run.steps]
    write_modes_csv(points, folder / "modes.csv")
    for point in points:
        name = f"spindle_{point.condition.temperature:g}C.xml"
        (folder / name).write_text(point.xml(looks=True), encoding="utf-8")
    progress("tables and MuJoCo models written")
    write_campaign_of(run, folder / "campaign")
    progress("campaign written")
    write_report(run, folder / "report.html")
    progress("report written")
    write_log(run, folder / "run.rrd")
    progress("Rerun log written")


# ---------------------------------------------------------------- terminal


def show_impact(console: Console, step: Step) -> None:
    condition = step.point.condition
    title = f"Impact test at {condition.temperature:g} C, {condition.speed / RPM:g} rpm: identified modes beside the model's own"
    rows = []
    m = step.identified
    seen = identified(step)
    computed, shared = {k: step.point.modes[i] for i, k in seen.items()}, _shared(step, seen)
    for i, (f, sf, z, sz) in enumerate(zip(m.frequency, m.frequency_sd, m.damping, m.damping_sd, strict=True)):
        exact = computed.get(i)
        digits = _decimals(sf, 2), _decimals(100 * sz, 3)
        own = ("-", "-") if exact is None else (f"{exact.frequency:.{digits[0]}f}", f"{100 * exact.damping_ratio:z.{digits[1]}f}")
        rows.append([f"{f:.{digits[0]}f}", f"{sf:.{digits[0]}f}", f"{100 * z:.{digits[1]}f}", f"{100 * sz:.{digits[1]}f}", *own])
    console.print(f"{_found(step, computed, set(shared.values()))}\n", highlight=False, markup=False)
    show_grid(console, title, ("f\nHz", "+-", "damping\n%", "+-", "model f\nHz", "model damping\n%"), rows)
    low, high = step.point.spindle.hammer.band
    for i, k in shared.items():
        one, other = sorted(mode.frequency for mode in (computed[k], step.point.modes[i]))
        width = 2 * computed[k].damping_ratio * computed[k].frequency
        console.print(f"The peak at {m.frequency[k]:.2f} Hz stands for {one:.2f} and {other:.2f} Hz ({computed[k].kind}), which at a width of {width:.3g} Hz this test does not part.", highlight=False)
    unseen = [mode for i, mode in enumerate(step.point.modes) if low <= mode.frequency <= high and i not in seen and i not in shared]
    twins = [mode for mode in unseen if any(abs(mode.frequency / c.frequency - 1) < TWIN and mode.kind == c.kind for c in computed.values())]
    if twins:
        these = listed([f"{mode.frequency:.2f}" for mode in twins])
        console.print(f"At {these} Hz the model has a second mode of the same frequency, which moves across the first one: one peak stands for both.", highlight=False)
    if unseen := [mode for mode in unseen if not any(mode is twin for twin in twins)]:
        console.print(f"No peak was found of {', '.join(f'{m.frequency:.2f} Hz ({m.kind})' for m in unseen)}. {_struck(step.point.spindle)}")


TWIN = 1e-6
"""Relative, within which two modes of one kind have one frequency, as a rotor's in two planes that are alike."""


def _shared(step: Step, seen: Mapping[int, int]) -> dict[int, int]:
    """By the number of a mode of the model without a peak of its own that of the identified one which stands for it, too: one nearer
    than a half-width, and farther than its error, of a mode that this test does not move and see more than ten times as much."""
    modes, chain, found = step.point.modes, step.point.measurement, dict[int, int]()
    moved = [np.linalg.norm(chain.reference_rows @ m.shape) * np.linalg.norm(chain.response_rows @ m.shape) for m in modes]
    for i in (i for i in range(len(modes)) if i not in seen):
        apart = {j: abs(modes[j].pole - modes[i].pole) for j in seen if moved[i] > MUCH * moved[j]}
        near = [j for j, far in apart.items() if 2 * np.pi * step.identified.frequency_sd[seen[j]] < far < -modes[j].pole.real]
        if near:
            found[i] = seen[min(near, key=lambda j: apart[j])]
    return found


def _found(step: Step, computed: Mapping[int, Mode], shared: Set[int]) -> str:
    """How many modes the test shows of those that the model has in the band, and where it is
    furthest off of those that have a peak of their own."""
    low, high = step.point.spindle.hammer.band
    count = sum(low <= mode.frequency <= high for mode in step.point.modes)
    found = f"{len(step.identified.frequency)} modes were found, {len(computed)} of the {count} that the model has from {low:g} to {high:g} Hz"
    alone = {k: mode for k, mode in computed.items() if k not in shared}
    if not alone:
        return f"{found}."
    k, mode = max(alone.items(), key=lambda row: abs(step.identified.frequency[row[0]] / row[1].frequency - 1))
    off, sd = step.identified.frequency[k] - mode.frequency, step.identified.frequency_sd[k]
    return f"{found}; furthest off is that at {mode.frequency:.2f} Hz, by {off:+.2g} Hz ({100 * off / mode.frequency:+.2g} %, {abs(off) / sd:.1f} of its standard errors)."


def _decimals(sd: float, least: int) -> int:
    """Of a number with a standard error: as many as the error's first digit takes."""
    return int(np.clip(np.ceil(-np.log10(sd)), least, MOST_DECIMALS)) if 0 < sd < np.inf else least


def show_run(console: Console, run: Run, out: Path) -> None:
    temperatures = [s.point.condition.temperature for s in run.steps]
    show_table(console, stiffness_table(run.spindle, temperatures, [run.steps[0].point.condition.speed]), run.spindle.loaded_across)
    console.print()
    highest = run.spindle.hammer.band[1]
    numbers, beside = numbered(run), measured_rows(run)
    identified_modes = [identified(step) for step in run.steps]
    measured = [t for c in run.measured for t in c.tests if t.id in beside]
    own, peaks = list[list[str]](), list[list[str]]()
    first = run.steps[0].point
    for number, mode in enumerate((m for m in first.modes if m.frequency <= highest), 1):
        followed = [next((i for i, n in of_step.items() if n == number), None) for of_step in numbers]
        found = [None if i is None else step.point.modes[i] for i, step in zip(followed, run.steps, strict=True)]
        frequency = ["-" if m is None else f"{m.frequency:.1f}" for m in found]
        shift = "-" if found[-1] is None else f"{found[-1].frequency - mode.frequency:+z.1f}"
        group = max(group_energy(first.chain, mode).items(), key=lambda item: item[1])[0]
        rows = [beside[t.id].get(number - 1) for t in measured]
        own.append([str(number), mode.kind, group, *frequency, shift, *(f"{row.frequency:.0f}" if row else "" for row in rows)])
        cells = []
        for i, step, pairs in zip(followed, run.steps, identified_modes, strict=True):
            k = pairs.get(i) if i is not None else None
            cells.append("-" if k is None else f"{step.identified.frequency[k]:.2f}\n+- {step.identified.frequency_sd[k]:.3f}")
        peaks.append([str(number), *cells])
    every = [f"{t:g} C" for t in temperatures]
    title = "Natural frequencies of the model, Hz" + (", and what was measured" if measured else "")
    columns = ("mode", "kind", "main\nflexibility", *every, "shift", *(f"measured\n{t.temperature:g} C" for t in measured))
    show_grid(console, title, columns, own, ("kind", "main\nflexibility"), keys=3)
    console.print()
    show_grid(console, "Modal peaks of the virtual hammer test, Hz +- standard error", ("mode", *every), peaks)
    if any("-" in row for row in peaks):
        console.print(f"-: no peak was found. {_struck(run.spindle)}")
    console.print(f"\n{out}: report.html, pictures/, run.rrd, table.csv, modes.csv, spindle_*.xml, campaign/", highlight=False, soft_wrap=True)
    console.print(f"Open in a browser: {(out / 'report.html').resolve().as_uri()}", highlight=False, soft_wrap=True)


def _struck(spindle: Spindle) -> str:
    """Why a mode may stay unseen: where and along which axes the hammer strikes."""
    points = [spindle.point(node) for node in spindle.hammer.hammer_nodes]
    places = ", ".join(f"node {p.node} along {p.axis[1].lower()}" for p in points)
    return f"The hammer strikes {places}: a mode that does not move there, or lies too near a stronger one, shows no peak of its own."
