"""The verbs `run`, `impact`, `simulate` and `report`: virtual tests in time, and everything built on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from thermospindle.model import sense
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.elements import ELEMENTS, LINEAR, REDUCED, check_element
from thermospindle.model.scene.reading import load
from thermospindle.model.units import NM, RPM
from thermospindle.report.folder import mark, whole_folder
from thermospindle.report.progress import hint, progress_bar
from thermospindle.report.text import run as text
from thermospindle.report.verbs.answer import (
    Answer,
    answered,
    check_out,
    temperature_or_reference,
    temperatures_or_range,
    with_effects,
    with_hammer,
)
from thermospindle.sim.campaign.campaign import write_campaign
from thermospindle.sim.campaign.simulated import runout_campaign
from thermospindle.sim.effects import of_scene
from thermospindle.sim.hammer.test import stages, takes_long
from thermospindle.sim.operating import doubts_of_modes, operating_point
from thermospindle.sim.run import Run
from thermospindle.sim.run import run as whole_chain

RECORD = 0.05  # s of a runout record between two steps of the progress bar


def run(
    scene: Path,
    temperatures: Sequence[float] | None = None,
    speed_rpm: float = 0.0,
    element: str | None = None,
    hits: int | None = None,
    level: float | None = None,
    seed: int = 0,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """The whole chain at every temperature (C, five over the scene's range by default): tables,
    models, virtual tests, modal peaks, report and Rerun log, in a folder always."""
    asked = dict(locals())
    out = Path("out") / load(scene).name if out is None else out
    spindle = with_hammer(with_effects(scene, effect_files)[0], hits, level)
    steps = temperatures_or_range(temperatures, spindle)
    _hint(spindle, steps, element)
    with whole_folder(out) as folder, progress_bar(2 * len(steps) + stages(spindle.hammer, len(steps)) + 4) as progress:
        result = whole_chain(spindle, steps, speed_rpm * RPM, element, seed, progress)
        text.write_run(result, folder, progress)
        values = text.run_json(result) | {"out": str(out), "warnings": _doubts(result, element)}
        mark(folder, {"verb": "run"} | asked, values)
    return Answer(values, lambda console: text.show_run(console, result, out))


def impact(
    scene: Path,
    temperature: float | None = None,
    speed_rpm: float = 0.0,
    element: str | None = None,
    hits: int | None = None,
    level: float | None = None,
    seed: int = 0,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """A virtual impact-hammer test and the modes it shows; a folder holds it as a campaign and a
    Rerun log of every hit, the FRFs and the peaks."""
    asked = dict(locals())
    check_out(out)
    spindle = with_hammer(with_effects(scene, effect_files)[0], hits, level)
    result = _virtual_tests(spindle, [temperature_or_reference(temperature, spindle)], speed_rpm, element, seed)
    return answered(
        text.impact_json(result.steps[0]),
        lambda console: text.show_impact(console, result.steps[0]),
        out,
        {"verb": "impact"} | asked,
        lambda folder, _: _write_impact(result, folder),
        _doubts(result, element),
    )


def simulate(
    scene: Path,
    temperatures: Sequence[float] | None = None,
    speed_rpm: float = 0.0,
    element: str | None = None,
    hits: int | None = None,
    level: float | None = None,
    seed: int = 0,
    runout: bool = False,
    speeds_rpm: Sequence[float] | None = None,
    seconds: float = 0.6,
    noise_nm: float = 1.0,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Virtual tests as the campaign folder `out`; with `runout` the turning spindle seen by probes instead of hammer tests."""
    if out is None:
        raise BadInput("--out: simulate needs the campaign folder to write")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise BadInput(f"--out {out}: is not empty; a campaign is written to a new or empty folder")
    if runout and (element or LINEAR) not in ELEMENTS:
        raise BadInput(f"--element {element}: is for hammer tests; a turning spindle is stepped with {' or '.join(ELEMENTS)}")
    if speeds_rpm is not None and not runout:
        raise BadInput("--speeds: is for --runout; hammer tests take one --speed")
    for option, value in (("--seconds", seconds), ("--noise-nm", noise_nm)):
        if value <= 0:
            raise BadInput(f"{option} {value:g}: must be positive")
    spindle = with_hammer(with_effects(scene, effect_files)[0], hits, level)
    check_element(spindle, element)
    steps, nominal = temperatures_or_range(temperatures, spindle), spindle.nominal_speed / RPM
    if runout:
        speeds = speeds_rpm or ([speed_rpm] if speed_rpm else [nominal / 2, 0.75 * nominal, nominal])
        conditions = [Condition(t, s * RPM) for t in steps for s in speeds]
        with progress_bar(int(seconds / RECORD) + 2) as progress:
            campaign = runout_campaign(spindle, conditions, seconds, element or LINEAR, seed, NM * noise_nm, progress=progress)
        odd, kind = sense.of_conditions(spindle, conditions), "runout tests"
    else:
        _refuse_rattling(spindle, [Condition(t, speed_rpm * RPM) for t in steps])
        result = _virtual_tests(spindle, steps, speed_rpm, element, seed)
        campaign, odd, kind = text.campaign_of(result), _doubts(result, element), "tests"
    write_campaign(campaign, out)
    tests = [t.id for t in campaign.tests]
    values = {"campaign": str(out), "tests": tests, "warnings": odd}
    return Answer(values, _line(f"{out}: {len(tests)} {kind}: {', '.join(tests)}"))


def report(
    scene: Path,
    temperatures: Sequence[float] | None = None,
    speed_rpm: float = 0.0,
    element: str | None = None,
    hits: int | None = None,
    level: float | None = None,
    seed: int = 0,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """The HTML report: the whole chain, the turning spindle, warm-up, resonances, and a ladder on what was measured."""
    from thermospindle.report.page import whole_report
    from thermospindle.report.page.report import write_report

    asked = dict(locals()) | {"verb": "report"}
    out = Path("out") / f"{load(scene).name}_report" if out is None else out  # a run's folder is left alone
    spindle, catalogue = with_effects(scene, effect_files)
    turning = abs(speed_rpm) * RPM or spindle.nominal_speed
    with whole_folder(out) as folder:
        steps = temperatures_or_range(temperatures, spindle)
        result = _virtual_tests(with_hammer(spindle, hits, level), steps, speed_rpm, element, seed)
        with progress_bar(whole_report.steps(result)) as progress:
            more = list(whole_report.more_sections(result, turning, catalogue, progress))
            write_report(result, folder / "report.html", more)
        page = out / "report.html"
        values: dict[str, Any] = {"report": str(page), "added": [title for title, _ in more], "warnings": _doubts(result, element)}
        mark(folder, asked, values)
    return Answer(values, _line(f"{page}: one page that needs no network; open it in a browser: {page.resolve().as_uri()}"))


def _virtual_tests(spindle: Spindle, temperatures: Sequence[float], speed_rpm: float, element: str | None, seed: int) -> Run:
    _hint(spindle, temperatures, element)
    with progress_bar(2 * len(temperatures) + stages(spindle.hammer, len(temperatures))) as progress:
        return whole_chain(spindle, temperatures, speed_rpm * RPM, element, seed, progress)


def _hint(spindle: Spindle, temperatures: Sequence[float], element: str | None) -> None:
    check_element(spindle, element)
    if words := takes_long(spindle, element, len(temperatures)):
        hint(words)


def _refuse_rattling(spindle: Spindle, conditions: Sequence[Condition]) -> None:
    """BadInput where no bearing is left in contact: what flies free and rattles has no FRFs that a campaign may hold."""
    for c in conditions:
        state = operating_point(spindle, c, of_scene(spindle)).state
        if state.bearings and not state.linear and not any(b.in_contact for b in state.bearings):
            raise BadInput(f"--temperatures {c.temperature:g}: {state.status} at {c.temperature:g} C: a spindle that rattles has no FRFs; allowed is where a bearing is in contact, as `spindle table` tells")


def _write_impact(result: Run, folder: Path) -> None:
    from thermospindle.report.log.impact import write_impact_log  # rerun takes its time to load

    text.write_campaign_of(result, folder / "campaign")
    write_impact_log(result, folder / "impact.rrd")


def _doubts(result: Run, asked: str | None) -> list[str]:
    """What is odd at the operating points; and that the reduced model was taken, where nobody asked for an element."""
    found = doubts_of_modes(result.spindle, [s.point for s in result.steps])
    if asked is None and any(s.test.element == REDUCED for s in result.steps):
        step = 1e6 * result.spindle.hammer.step
        found.append(f"the stiffest mode asks for steps of {step:.3g} us, too many for a record: it is that of the reduced model, as with --element {REDUCED}, without MuJoCo")
    return found


def _line(sentence: str) -> Callable[[Console], None]:
    return lambda console: console.print(sentence, markup=False, highlight=False, soft_wrap=True)
