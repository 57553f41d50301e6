"""The verbs `runout`, `warmup` and `map`: the turning spindle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from thermospindle.model import sense
from thermospindle.model.built.drawn import PLAUSIBLE, drawn
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.elements import check_element
from thermospindle.model.units import MINUTE, RPM
from thermospindle.report.progress import hint, progress_bar
from thermospindle.report.text.resonance import map_json, show_map, write_map
from thermospindle.report.text.runout import runout_json, show_runout, write_runout
from thermospindle.report.text.warmup import lost_contact, show_warmup, warmup_json, write_warmup
from thermospindle.report.verbs.answer import (
    Answer,
    answered,
    check_out,
    temperature_or_reference,
    temperatures_or_range,
    with_effects,
)
from thermospindle.sim.operating import doubts, operating_point
from thermospindle.sim.resonance.found import ResonanceMap
from thermospindle.sim.resonance.map import SPEEDS, TEMPERATURES, resonance_map, speeds_about, stages
from thermospindle.sim.running.run import record_steps
from thermospindle.sim.running.runout import planned, with_imperfections
from thermospindle.sim.running.runout import runout as simulated_runout
from thermospindle.sim.warmup import SHORTEST, STAGES, Warmup, warm_up

LONG = 500_000  # steps of a simulated record, from which it takes more than half a minute of a flexible shaft


def runout(
    scene: Path,
    speed_rpm: float | None = None,
    temperature: float | None = None,
    seconds: float | None = None,
    seed: int | None = None,
    element: str = "linear",
    path: str | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Repeatable and nonrepeatable runout of the turning spindle and its lines, at the scene's
    nominal speed unless told otherwise; `seed` draws imperfections instead of the scene's.

    A folder holds tables, figures and a Rerun log with a waterfall.
    """
    asked = dict(locals()) | {"verb": "runout"}
    check_out(out)
    spindle, _ = with_effects(scene, effect_files)
    if seed is not None:
        spindle = with_imperfections(spindle, drawn(spindle, seed))
    speed = spindle.nominal_speed if speed_rpm is None else speed_rpm * RPM
    _ = spindle.turning  # refused where nothing turns
    check_element(spindle, element)
    condition = Condition(temperature_or_reference(temperature, spindle), speed)
    point = operating_point(spindle, condition)
    names_none = seed is None and point.imperfections == Imperfections()
    if names_none:
        seed = PLAUSIBLE
        spindle = with_imperfections(spindle, drawn(spindle, seed))
        point = operating_point(spindle, condition)
    plan = planned(point, seconds, element, path)
    steps = record_steps(plan.samples, round(1 / (plan.rate * spindle.hammer.step))) if plan.path == "simulated" else 0
    if steps > LONG and element == "linear" and spindle.structure.shafts:
        hint(f"--path linear gives the exact harmonic answer of linear bearings in seconds; the record that is simulated takes {steps / 1e6:.1f} million steps")
    with progress_bar(plan.pieces + 5) as progress:
        found = simulated_runout(point, seconds, element, plan.path, progress)
        progress("record analysed")
        values = runout_json(found, plan.path, element, seed) | {"speed_from": "the scene's nominal speed" if speed_rpm is None else "--speed"}
        odd = doubts(spindle, [point])
        if path is None and plan.path == "linear":
            odd.append("the stiffest mode of the model takes more steps than a record can have: the exact harmonic answer is taken, as --path linear does")
        if names_none:
            odd.append(
                f"the scene names no imperfections: plausible ones are drawn, of seed {seed} as map and report have them; --seed draws others, and the table [imperfections] of the scene holds its own"
            )
        if not spindle.rolling:
            odd.append("the bearings are given by numbers and roll no balls: what does not repeat every revolution (NRRO, asynchronous error motion) is unknown, and not in the total")

        def write(folder: Path, answer: dict[str, Any]) -> None:
            write_runout(found, spindle, answer, folder, progress)

        return answered(values, lambda console: show_runout(console, values, spindle), out, asked, write, odd)


def warmup(
    scene: Path,
    temperature: float | None = None,
    speed_rpm: float | None = None,
    minutes: float | None = None,
    soak: float | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """From a uniform `temperature` (C) at a speed, the scene's nominal one or 0 for a `soak` in air
    of another temperature; a folder holds CSV, figure and a Rerun log."""
    asked = dict(locals()) | {"verb": "warmup"}
    check_out(out)
    if minutes is not None and minutes * MINUTE < SHORTEST:
        raise BadInput(f"--minutes {minutes:g}: a warm-up lasts longer than nothing; name a positive number, {SHORTEST / MINUTE:.1g} or more")
    spindle, _ = with_effects(scene, effect_files)
    speed = (0.0 if soak is not None else spindle.nominal_speed) if speed_rpm is None else speed_rpm * RPM
    duration = None if minutes is None else MINUTE * minutes
    with progress_bar(STAGES) as progress:
        found = warm_up(spindle, speed, temperature_or_reference(temperature, spindle), soak, duration, progress=progress)
    lost = lost_contact(found)
    return answered(
        warmup_json(found),
        lambda console: show_warmup(console, found),
        out,
        asked,
        lambda folder, _: _write_warmup(found, folder),
        [*([lost] if lost else []), *doubts(spindle, [m.point for m in found.every])],
    )


def resonances(
    scene: Path,
    temperature: float | None = None,
    speed_rpm: float | None = None,
    temperatures: Sequence[float] | None = None,
    speeds_rpm: Sequence[float] | None = None,
    multiples: int = 3,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """The verb `map`: natural frequencies against every bearing and unbalance line; a folder holds tables, figures and a Rerun log."""
    asked = dict(locals()) | {"verb": "map"}
    check_out(out)
    if speed_rpm is not None and speed_rpm <= 0:
        raise BadInput(f"--speed {speed_rpm:g}: the nominal speed of a map must be positive")
    spindle, _ = with_effects(scene, effect_files)
    speed = spindle.nominal_speed if speed_rpm is None else speed_rpm * RPM
    nominal = Condition(temperature_or_reference(temperature, spindle), speed)
    grid = temperatures_or_range(temperatures, spindle, TEMPERATURES)
    speeds = [s * RPM for s in speeds_rpm] if speeds_rpm else speeds_about(spindle, speed, SPEEDS)
    with progress_bar(stages(spindle, len(grid))) as progress:
        found = resonance_map(spindle, grid, speeds, nominal, multiples, progress=progress, nearby=bool(speeds_rpm))
    conditions = [nominal, *(Condition(t, s) for t in grid for s in speeds)]
    return answered(
        map_json(found),
        lambda console: show_map(console, found),
        out,
        asked,
        lambda folder, _: _write_map(found, folder),
        sense.of_conditions(spindle, conditions),
    )


def _write_warmup(found: Warmup, folder: Path) -> None:
    from thermospindle.report.log.turning.warmup import write_warmup_log  # rerun takes its time to load

    write_warmup(found, folder)
    write_warmup_log(found, folder / "warmup.rrd")


def _write_map(found: ResonanceMap, folder: Path) -> None:
    from thermospindle.report.log.turning.map import write_map_log

    write_map(found, folder)
    write_map_log(found, folder / "map.rrd")
