"""The command line: `spindle VERB SCENE [options]`. It parses, calls the packages, prints, and nothing else."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait for each other; set before numpy loads

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from diagnosis.catalogue import show_effect, show_effects, summary
from model.ball_row import NoEquilibrium
from model.machine import Condition, HammerTest, OutsideRange, Spindle
from model.mjcf import ELEMENTS
from model.scene import BadInput, content_hash, load
from sim import output
from sim.campaign import Campaign
from sim.effect import Effect
from sim.effects import by_name
from sim.folder import MARK, whole_folder

RPM = 2 * np.pi / 60
WIDTH = 110  # columns that the tables need; a narrower terminal wraps lines rather than lose digits
TEMPERATURES = [20.0, 30.0, 40.0, 50.0, 60.0]
NOMINAL_RPM = 7200.0  # of running verbs, unless they are told another speed

Answer = tuple[dict[str, Any], Callable[[Console], None]]
"""What a verb returns: its JSON object, and a function that prints the same for a person."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns 0, 2 for input that cannot be used, 130 when stopped."""
    options = _parser().parse_args(arguments)
    try:
        answer, show = options.verb(options)
        if options.json:
            print(json.dumps(answer))
        else:
            console = Console()
            console.width = max(console.width, WIDTH)
            show(console)
    except (BadInput, OutsideRange, NoEquilibrium) as error:
        print(f"spindle: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("spindle: stopped; nothing was left half written", file=sys.stderr)
        return 130
    return 0


# ---------------------------------------------------------------- options


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"spindle: {message}; see {self.prog} --help\n")


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not np.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def _temperature(text: str) -> float:
    value = _number(text)
    if value <= -273.15:
        raise argparse.ArgumentTypeError(f"{text} C is below absolute zero")
    return value


def _count(text: str) -> int:
    if not text.isdigit() or (value := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a count of one or more")
    return value


def _setting(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form name=value")
    try:
        return name, _number(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: {value!r} is not a number") from None


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="spindle", description="From temperature to modal peaks of a ball-bearing spindle.")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=_Parser)

    def verb(name: str, run: Callable[[argparse.Namespace], Answer], text: str, what: str = "SCENE") -> argparse.ArgumentParser:
        added = verbs.add_parser(name, help=text, description=text)
        added.set_defaults(verb=run)
        if what:
            added.add_argument("target", metavar=what, type=Path)
        added.add_argument("--json", action="store_true", help="one JSON object on standard output, nothing else")
        added.add_argument("--out", type=Path, metavar="DIR", help="folder to write, whole or not at all")
        if what != "FILE.rrd":
            added.add_argument(
                "--effect", dest="effect_files", type=Path, action="append", default=[], metavar="FILE.py",
                help="a file with an effect of your own, beside those of the catalogue; may be given again",
            )  # fmt: skip
        return added

    def several(added: argparse.ArgumentParser) -> None:
        added.add_argument("--temperatures", type=_temperature, nargs="+", default=TEMPERATURES, metavar="C")

    def one(added: argparse.ArgumentParser) -> None:
        added.add_argument("--temperature", type=_temperature, default=20.0, metavar="C")

    def speed(added: argparse.ArgumentParser) -> None:
        added.add_argument("--speed", type=_number, default=0.0, metavar="RPM")

    def hammer(added: argparse.ArgumentParser) -> None:
        speed(added)
        added.add_argument("--element", choices=ELEMENTS, default="linear", help="bearing element of the time simulation")
        added.add_argument("--hits", type=_count, help="hits on each hammer point (the scene's by default)")
        added.add_argument("--level", type=_number, metavar="N", help="peak force of the hammer (the scene's by default)")
        added.add_argument("--seed", type=int, default=0, help="of hammer scatter and sensor noise")

    def held_out(added: argparse.ArgumentParser, text: str) -> None:
        added.add_argument("--held-out", nargs="+", action="extend", default=[], metavar="TEST", help=text)

    chain = verb("run", _run, "the whole chain: tables, model, virtual tests, modal peaks, report and Rerun log")
    several(chain)
    hammer(chain)
    table = verb("table", _table, "bearing stiffness over temperature and speed")
    several(table)
    table.add_argument("--speeds", type=_number, nargs="+", default=[0.0], metavar="RPM")
    modes = verb("modes", _modes, "modes of the linearised rotor-base model")
    one(modes)
    speed(modes)
    modes.add_argument("--highest", type=_number, default=None, metavar="HZ", help="upper end (the scene's band by default)")
    impact = verb("impact", _impact, "a virtual impact-hammer test in MuJoCo's time domain, and the modes it shows")
    one(impact)
    hammer(impact)
    simulate = verb("simulate", _simulate, "virtual tests as a campaign folder, in the same form as measured ones")
    several(simulate)
    hammer(simulate)
    simulate.add_argument("--runout", action="store_true", help="the turning spindle seen by probes on its hub, instead of hammer tests")
    simulate.add_argument(
        "--speeds", type=_number, nargs="+", metavar="RPM", help="of runout tests, each at every temperature (three up to 7200 by default)"
    )
    simulate.add_argument("--seconds", type=_number, default=0.6, metavar="S", help="length of a runout record")
    simulate.add_argument("--noise-nm", type=_number, default=1.0, metavar="NM", help="rms noise of a runout probe")
    report = verb(
        "report", _report, "the HTML report: the whole chain, the turning spindle, warm-up, resonances, and a ladder on what was measured"
    )
    several(report)
    hammer(report)
    against = verb("compare", _compare, "a campaign beside the scene: modes, dampings, shapes and FRFs, and one number for the whole")
    against.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    against.add_argument("--before", type=Path, metavar="SCENE", help="the scene as it was, to see whether the error fell")
    held_out(against, "tests that the scene was not fitted to (by default those that its build table does not list)")
    missing = verb("diagnose", _diagnose, "which physics the scene lacks to explain a campaign")
    missing.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    held_out(missing, "tests to leave out, so that `compare` can show what is predicted of them")
    missing.add_argument(
        "--predictions", type=Path, metavar="DIAGNOSIS.json", help="an earlier diagnosis: did what it predicted come true?"
    )
    rungs = verb("ladder", _ladder, "model forms, tolerances and effects taken in one after the other, and the error at every step")
    rungs.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    rungs.add_argument("--effects", nargs="+", metavar="NAME", help="effects to add, in this order (those that diagnose names by default)")
    effects = verb("effects", _effects, "the catalogue of physical effects, or one of them explained", what="")
    effects.add_argument("name", metavar="NAME", nargs="?")
    add = verb("add", _add, "a new scene with one more effect, or with several that were fitted together")
    add.add_argument("effect", metavar="EFFECT", nargs="+")
    add.add_argument(
        "--set",
        type=_setting,
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME=VALUE",
        help="parameter values (typical ones by default); EFFECT.NAME where several effects have one of that name",
    )
    add.add_argument(
        "--from",
        dest="diagnosis",
        type=Path,
        metavar="DIAGNOSIS.json",
        help="take fitted values and build tolerances from the answer of diagnose --json",
    )
    running = verb("runout", _runout, "repeatable and nonrepeatable runout of the turning spindle, and the lines it is made of")
    one(running)
    running.add_argument("--speed", type=_number, required=True, metavar="RPM")
    running.add_argument("--seconds", type=_number, metavar="S", help="length of the record (by default half a second to a second)")
    running.add_argument("--seed", type=int, help="draw plausible imperfections instead of the scene's")
    running.add_argument("--element", choices=ELEMENTS, default="linear", help="bearing element of the time simulation")
    running.add_argument(
        "--path",
        choices=("simulated", "linear"),
        default="simulated",
        help="a run in MuJoCo, or the exact harmonic answer of the linear model",
    )
    warmup = verb("warmup", _warmup, "from cold start (or into a chamber soak): temperatures, preload, friction and frequencies over time")
    one(warmup)
    warmup.add_argument("--speed", type=_number, metavar="RPM", help="7200 by default, 0 for a soak")
    warmup.add_argument("--minutes", type=_number, metavar="M", help="eight time constants by default")
    warmup.add_argument("--soak", type=_temperature, metavar="C", help="chamber at another temperature than the spindle's at the start")
    resonance = verb("map", _map, "natural frequencies against every bearing and unbalance line, over temperature and speed")
    one(resonance)
    resonance.add_argument("--speed", type=_number, default=NOMINAL_RPM, metavar="RPM", help="the nominal speed")
    resonance.add_argument("--temperatures", type=_temperature, nargs="+", metavar="C", help="20 to 60 C in 21 steps by default")
    resonance.add_argument("--speeds", type=_number, nargs="+", metavar="RPM", help="0 to twice the nominal speed in 41 steps by default")
    resonance.add_argument("--multiples", type=_count, default=3, metavar="K", help="of the number of balls, and even ball orders")
    verb("inspect", _inspect, "what a Rerun log of spindle holds, and its FRFs as numbers", "FILE.rrd")
    return parser


def _hammer_settings(spindle: Spindle, options: argparse.Namespace) -> Spindle:
    changes = {key: getattr(options, key) for key in ("hits", "level") if getattr(options, key) is not None}
    if changes.get("level", 1.0) <= 0:
        raise BadInput(f"--level {options.level:g}: the hammer's peak force must be positive")
    test: HammerTest = replace(spindle.hammer, **changes)
    return replace(spindle, hammer=test)


# ---------------------------------------------------------------- verbs


def _equipped(options: argparse.Namespace, scene: Path | None = None) -> tuple[Spindle, tuple[Effect, ...]]:
    """The scene of a verb with its effects found, a user's own (--effect) among them; and every effect there is."""
    from sim.effect_rules import equipped

    return equipped(load(scene or options.target), options.effect_files)


def _scene(options: argparse.Namespace) -> Spindle:
    return _equipped(options)[0]


@contextmanager
def _progress(steps: int) -> Iterator[Callable[[str], None]]:
    """A function that takes what has been done, and moves a bar of so many steps on standard error."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("starting", total=steps)
        yield lambda done: bar.update(task, advance=1, description=done)


def _whole_chain(options: argparse.Namespace, extra: int):
    """The run that `run`, `report` and `simulate` share, with a progress bar on standard error."""
    from sim.run import run

    spindle = _hammer_settings(_scene(options), options)
    with _progress(3 * len(options.temperatures) + extra) as progress:
        result = run(spindle, options.temperatures, options.speed * RPM, options.element, options.seed, progress)
        yield result, progress


def _run(options: argparse.Namespace) -> Answer:
    out = options.out or Path("out") / load(options.target).name
    with whole_folder(out) as folder:
        for result, progress in _whole_chain(options, extra=4):
            output.write_run(result, folder, progress)
            answer = output.run_json(result)
            _mark(folder, options, answer)
    return answer | {"out": str(out)}, lambda console: output.show_run(console, result, out)


def _table(options: argparse.Namespace) -> Answer:
    from model.table import write_table
    from sim.operating import stiffness_table

    table = stiffness_table(_scene(options), options.temperatures, [s * RPM for s in options.speeds])
    answer = output.table_json(table)
    if options.out:
        with whole_folder(options.out) as folder:
            write_table(table, folder / "table.csv")
            _mark(folder, options, answer)
    return answer, lambda console: output.show_table(console, table)


def _modes(options: argparse.Namespace) -> Answer:
    from sim.operating import operating_point

    spindle = _scene(options)
    point = operating_point(spindle, Condition(options.temperature, options.speed * RPM))
    answer = output.modes_json(point, options.highest or spindle.hammer.band[1])
    if options.out:
        with whole_folder(options.out) as folder:
            output.write_modes(point, folder)
            _mark(folder, options, answer)
    return answer, lambda console: output.show_modes(console, answer, point)


def _impact(options: argparse.Namespace) -> Answer:
    options.temperatures = [options.temperature]
    for result, _ in _whole_chain(options, extra=0):
        answer = output.impact_json(result.steps[0])
        if options.out:
            with whole_folder(options.out) as folder:
                output.write_campaign_of(result, folder / "campaign")
                _mark(folder, options, answer)
    return answer, lambda console: output.show_impact(console, result.steps[0])


def _simulate(options: argparse.Namespace) -> Answer:
    if options.out is None:
        raise BadInput("--out: simulate needs the campaign folder to write")
    if options.out.exists() and (not options.out.is_dir() or any(options.out.iterdir())):
        raise BadInput(f"--out {options.out}: is not empty; a campaign is written to a new or empty folder")
    if options.runout:
        return _simulate_runout(options)
    if options.speeds is not None:
        raise BadInput("--speeds: is for --runout; hammer tests take one --speed")
    for result, _ in _whole_chain(options, extra=0):
        output.write_campaign_of(result, options.out)
        tests = [t.id for t in output.campaign_of(result).tests]
    answer = {"campaign": str(options.out), "tests": tests}
    return answer, lambda console: console.print(f"{options.out}: {len(tests)} tests: {', '.join(tests)}")


def _simulate_runout(options: argparse.Namespace) -> Answer:
    from sim.campaign import write_campaign
    from sim.campaign_simulated import runout_campaign

    for name in ("seconds", "noise_nm"):
        if getattr(options, name) <= 0:
            raise BadInput(f"--{name.replace('_', '-')} {getattr(options, name):g}: must be positive")
    speeds = options.speeds or ([options.speed] if options.speed else [NOMINAL_RPM / 2, 0.75 * NOMINAL_RPM, NOMINAL_RPM])
    conditions = [Condition(t, s * RPM) for t in options.temperatures for s in speeds]
    with _progress(int(options.seconds / 0.05) + 2) as progress:
        campaign = runout_campaign(
            _scene(options), conditions, options.seconds, options.element, options.seed, 1e-9 * options.noise_nm, progress=progress
        )
    write_campaign(campaign, options.out)
    tests = [t.id for t in campaign.tests]
    answer = {"campaign": str(options.out), "tests": tests}
    return answer, lambda console: console.print(f"{options.out}: {len(tests)} runout tests: {', '.join(tests)}")


def _report(options: argparse.Namespace) -> Answer:
    from diagnosis import whole_report
    from sim.report import write_report

    out = options.out or Path("out") / f"{load(options.target).name}_report"  # a run's folder is left alone
    turning, catalogue = abs(options.speed or NOMINAL_RPM) * RPM, _equipped(options)[1]
    with whole_folder(out) as folder:
        [(result, _)] = _whole_chain(options, extra=0)
        with _progress(whole_report.steps(result)) as progress:
            more = list(whole_report.more_sections(result, turning, catalogue, progress))
            write_report(result, folder / "report.html", more)
        answer = {"report": str(out / "report.html"), "added": [title for title, _ in more]}
        _mark(folder, options, answer)
    return answer, lambda console: console.print(f"{out / 'report.html'}")


def _inspect(options: argparse.Namespace) -> Answer:
    from sim import log_map_read as resonance
    from sim import log_runout_read as turning
    from sim.log_read import contents_of, describe, open_log

    opened = open_log(options.target)
    if resonance.is_map(opened):
        grid = resonance.map_contents(opened)
        answer = resonance.map_contents_json(grid)
        _write_answer(options, answer, "contents.json")
        return answer, lambda console: console.print(resonance.describe_map(grid), markup=False, highlight=False)
    if turning.is_runout(opened):
        record = turning.runout_contents(opened)
        answer = turning.runout_contents_json(record)
        _write_answer(options, answer, "contents.json")
        return answer, lambda console: console.print(turning.describe_runout(record), markup=False, highlight=False)
    contents = contents_of(opened)
    answer = output.log_json(contents)
    if options.out:
        with whole_folder(options.out) as folder:
            output.write_frf_tables(contents, folder)
            _mark(folder, options, {"log": str(options.target)})
    return answer, lambda console: console.print(describe(contents), markup=False, highlight=False)


def _compare(options: argparse.Namespace) -> Answer:
    from diagnosis.before_after import BeforeAfter, held_out, show_before_after
    from diagnosis.compare import compare
    from diagnosis.compare_report import write_comparison
    from diagnosis.compare_words import comparison_json, show_comparison
    from diagnosis.observe import observe
    from diagnosis.runout_lines import modal_tests
    from sim.campaign import read_campaign

    spindle, whole = _scene(options), read_campaign(options.campaign)
    before = _equipped(options, options.before)[0] if options.before else None
    unseen = held_out(spindle, whole, options.held_out)
    turning = _compare_runout(spindle, before, whole, unseen)
    campaign = modal_tests(whole)
    if turning and not campaign.tests:
        told = {"spindle": spindle.name, "campaign": whole.title, **turning[0]}
        _write_answer(options, told, "comparison.json")
        return told, turning[1]
    with _progress((3 if before else 2) * len(campaign.tests)) as progress:
        observed = observe(campaign, spindle, progress)
        comparison = compare(spindle, campaign, observed, progress)
        both = BeforeAfter(compare(before, campaign, observed, progress) if before else comparison, comparison, unseen)
    answer = comparison_json(comparison)
    if before:
        answer |= {"error": both.errors(), "held_out": list(unseen)}
    answer |= {"runout": turning[0]} if turning else {}
    _write_answer(options, answer, "comparison.json", lambda folder: write_comparison(comparison, spindle, folder))

    def show(console: Console) -> None:
        show_comparison(console, comparison)
        if before:
            show_before_after(console, both)
        if turning:
            turning[1](console)

    return answer, show


def _compare_runout(spindle: Spindle, before: Spindle | None, campaign: Campaign, unseen: Sequence[str]) -> Answer | None:
    """The runout tests of a campaign beside the scene, None where it has none; with `before` the errors of both scenes."""
    from diagnosis.runout_compare import compare_runout, errors_of, runout_comparison_json, show_errors, show_runout_comparison

    if not any(test.runout for test in campaign.tests):
        return None
    with _progress(len(campaign.tests) * (2 if before else 1)) as progress:
        found = compare_runout(spindle, campaign, progress)
        earlier = compare_runout(before, campaign, progress) if before else None
    answer = runout_comparison_json(found)
    errors = errors_of(earlier, found, unseen) if earlier else None
    if errors:
        answer |= {"error": errors, "held_out": list(unseen)}

    def show(console: Console) -> None:
        show_runout_comparison(console, found)
        if errors:
            show_errors(console, errors)

    return answer, show


def _diagnose(options: argparse.Namespace) -> Answer:
    from diagnosis.before_after import without
    from diagnosis.diagnosis_report import write_diagnosis
    from diagnosis.prediction import outcomes
    from diagnosis.runout_lines import modal_tests
    from diagnosis.verdict import diagnose, diagnosis_json, show_diagnosis
    from sim.campaign import read_campaign

    (spindle, catalogue), whole = _equipped(options), without(read_campaign(options.campaign), options.held_out)
    turning = _diagnose_runout(spindle, catalogue, whole)
    campaign = modal_tests(whole)
    if turning and not campaign.tests:
        told = turning[0] | {"campaign": whole.title, "scene_hash": content_hash(spindle)}
        _write_answer(options, told, "diagnosis.json")
        return told, turning[1]
    with _progress(len(campaign.tests) + 5) as progress:
        found, about, places, tests, m = diagnose(spindle, campaign, catalogue, progress)
    came = outcomes(options.predictions, about.data.observations) if options.predictions else []
    answer = diagnosis_json(found, about, places, tests, m) | {"campaign": campaign.title, "scene_hash": content_hash(spindle)}
    answer |= {"predictions": [asdict(o) for o in came]} if options.predictions else {}
    answer |= {"runout": turning[0]} if turning else {}
    _write_answer(options, answer, "diagnosis.json", lambda folder: write_diagnosis(found, about, m, answer, folder))

    def show(console: Console) -> None:
        show_diagnosis(console, answer)
        if turning:
            turning[1](console)

    return answer, show


def _diagnose_runout(spindle: Spindle, catalogue: tuple[Effect, ...], campaign: Campaign) -> Answer | None:
    """The diagnosis of the runout tests of a campaign; None where it has none."""
    from diagnosis.runout import diagnose_runout
    from diagnosis.runout_words import runout_diagnosis_json, show_runout_diagnosis

    tests = sum(test.runout is not None for test in campaign.tests)
    if not tests:
        return None
    with _progress(tests + 2) as progress:
        answer = runout_diagnosis_json(diagnose_runout(spindle, campaign, catalogue, progress), catalogue)
    return answer, lambda console: show_runout_diagnosis(console, answer)


def _runout(options: argparse.Namespace) -> Answer:
    from model.imperfections import drawn
    from sim.operating import operating_point
    from sim.runout import runout, with_imperfections
    from sim.runout_output import runout_json, show_runout, write_runout

    spindle = _scene(options)
    if options.seed is not None:
        spindle = with_imperfections(spindle, drawn(spindle, options.seed))
    with _progress(5) as progress:
        point = operating_point(spindle, Condition(options.temperature, options.speed * RPM))
        found = runout(point, options.seconds, options.element, options.path)
        progress("record analysed")
        answer = runout_json(found, options.path, options.element, options.seed)
        if options.out:
            with whole_folder(options.out) as folder:
                write_runout(found, spindle, answer, folder, progress)
                _mark(folder, options, answer)
    return answer, lambda console: show_runout(console, answer)


# ---------------------------------------------------------------- running: heat and resonance


def _warmup(options: argparse.Namespace) -> Answer:
    from sim.warmup import warm_up
    from sim.warmup_output import show_warmup, warmup_json, write_warmup

    if options.minutes is not None and options.minutes <= 0:
        raise BadInput(f"--minutes {options.minutes:g}: a warm-up lasts longer than nothing; name a positive number")
    spindle = _scene(options)
    speed = (0.0 if options.soak is not None else NOMINAL_RPM) if options.speed is None else options.speed
    duration = None if options.minutes is None else 60 * options.minutes
    with _progress(3) as progress:
        warmup = warm_up(spindle, speed * RPM, options.temperature, options.soak, duration, progress=progress)
    answer = warmup_json(warmup)
    if options.out:
        with whole_folder(options.out) as folder:
            write_warmup(warmup, folder)
            _mark(folder, options, answer)
    return answer, lambda console: show_warmup(console, warmup)


def _ladder(options: argparse.Namespace) -> Answer:
    from diagnosis.ladder import ladder
    from diagnosis.ladder_report import growing, ladder_json, show_ladder, write_ladder
    from sim.campaign import read_campaign

    (spindle, catalogue), campaign = _equipped(options), read_campaign(options.campaign)
    chosen = None if options.effects is None else [by_name(name, catalogue) for name in options.effects]
    with growing(Console(stderr=True, width=WIDTH)) as live:
        found = ladder(spindle, campaign, chosen, catalogue, live.rung, live.progress)
    answer = ladder_json(found)
    _write_answer(options, answer, "ladder.json", lambda folder: write_ladder(found, folder))
    return answer, lambda console: show_ladder(console, found)


def _map(options: argparse.Namespace) -> Answer:
    from sim.log_map import write_map_log
    from sim.resonance import resonance_map
    from sim.resonance_output import map_json, show_map, write_map

    spindle, nominal = _scene(options), Condition(options.temperature, options.speed * RPM)
    if options.speed <= 0:
        raise BadInput(f"--speed {options.speed:g}: the nominal speed of a map must be positive")
    temperatures = options.temperatures or np.linspace(TEMPERATURES[0], TEMPERATURES[-1], 21).tolist()
    speeds = np.array(options.speeds or np.linspace(0, 2 * options.speed, 41)) * RPM
    with _progress(3) as progress:
        found = resonance_map(spindle, temperatures, speeds.tolist(), nominal, options.multiples, progress=progress)
    answer = map_json(found)
    if options.out:
        with whole_folder(options.out) as folder:
            write_map(found, folder)
            write_map_log(found, folder / "map.rrd")
            _mark(folder, options, answer)
    return answer, lambda console: show_map(console, found)


# ---------------------------------------------------------------- effects


def _effects(options: argparse.Namespace) -> Answer:
    from sim.effect_rules import catalogue

    known = catalogue(options.effect_files)
    if options.name is None:
        answer: dict[str, Any] = {"effects": [summary(e) for e in known]}
        _write_answer(options, answer, "effects.json")
        return answer, lambda console: show_effects(console, known)
    effect = by_name(options.name, known)
    keys = ("name", "title", "equation", "sees", "valid")
    answer = {k: getattr(effect, k) for k in keys} | {
        "resembles": list(effect.resembles),
        "parameters": [asdict(p) for p in effect.parameters],
    }
    _write_answer(options, answer, "effect.json")
    return answer, lambda console: show_effect(console, effect)


def _add(options: argparse.Namespace) -> Answer:
    from diagnosis.add import check_place, new_scene

    if options.out is None:
        raise BadInput("--out: add needs the folder of the new scene")
    check_place(options.target, options.out)
    catalogue = _equipped(options)[1]
    with whole_folder(options.out) as folder:
        added = new_scene(options.target, options.effect, options.set, options.diagnosis, folder, options.out, catalogue)
        answer = {"scene": str(options.out), **asdict(added)}
        _mark(folder, options, answer)
    return answer, lambda console: console.print(f"{options.out}: {added.words()}", highlight=False, markup=False)


# ---------------------------------------------------------------- output folders


def _write_answer(
    options: argparse.Namespace, answer: dict[str, Any], name: str, more: Callable[[Path], None] = lambda folder: None
) -> None:
    """The JSON answer as a file of the output folder, if one is wanted, beside what `more` writes there."""
    if options.out:
        with whole_folder(options.out) as folder:
            (folder / name).write_text(json.dumps(answer, indent=1), encoding="utf-8")
            more(folder)
            _mark(folder, options, answer)


def _mark(folder: Path, options: argparse.Namespace, answer: dict[str, Any]) -> None:
    told = {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items() if k != "verb"}
    (folder / MARK).write_text(json.dumps({"options": told, "answer": answer}, indent=1, default=str), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
