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
from model.scene import BadInput, load
from sim import output
from sim.effects import CATALOGUE, by_name
from sim.folder import MARK, whole_folder

RPM = 2 * np.pi / 60
WIDTH = 110  # columns that the tables need; a narrower terminal wraps lines rather than lose digits
TEMPERATURES = [20.0, 30.0, 40.0, 50.0, 60.0]

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
    report = verb("report", _report, "the HTML report of the whole chain")
    several(report)
    hammer(report)
    against = verb("compare", _compare, "a campaign beside the scene: modes, dampings, shapes and FRFs, and one number for the whole")
    against.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    missing = verb("diagnose", _diagnose, "which physics the scene lacks to explain a campaign")
    missing.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    effects = verb("effects", _effects, "the catalogue of physical effects, or one of them explained", what="")
    effects.add_argument("name", metavar="NAME", nargs="?")
    add = verb("add", _add, "a new scene with one more effect")
    add.add_argument("effect", metavar="EFFECT")
    add.add_argument(
        "--set",
        type=_setting,
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME=VALUE",
        help="parameter values (typical ones by default)",
    )
    add.add_argument(
        "--from", dest="diagnosis", type=Path, metavar="DIAGNOSIS.json", help="take fitted values from the answer of diagnose --json"
    )
    verb("inspect", _inspect, "what a Rerun log of spindle holds, and its FRFs as numbers", "FILE.rrd")
    return parser


def _hammer_settings(spindle: Spindle, options: argparse.Namespace) -> Spindle:
    changes = {key: getattr(options, key) for key in ("hits", "level") if getattr(options, key) is not None}
    if changes.get("level", 1.0) <= 0:
        raise BadInput(f"--level {options.level:g}: the hammer's peak force must be positive")
    test: HammerTest = replace(spindle.hammer, **changes)
    return replace(spindle, hammer=test)


# ---------------------------------------------------------------- verbs


@contextmanager
def _progress(steps: int) -> Iterator[Callable[[str], None]]:
    """A function that takes what has been done, and moves a bar of so many steps on standard error."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=steps)
        yield lambda done: bar.update(task, advance=1, description=done)


def _whole_chain(options: argparse.Namespace, extra: int):
    """The run that `run`, `report` and `simulate` share, with a progress bar on standard error."""
    from sim.run import run

    spindle = _hammer_settings(load(options.target), options)
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

    table = stiffness_table(load(options.target), options.temperatures, [s * RPM for s in options.speeds])
    answer = output.table_json(table)
    if options.out:
        with whole_folder(options.out) as folder:
            write_table(table, folder / "table.csv")
            _mark(folder, options, answer)
    return answer, lambda console: output.show_table(console, table)


def _modes(options: argparse.Namespace) -> Answer:
    from sim.operating import operating_point

    spindle = load(options.target)
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
    for result, _ in _whole_chain(options, extra=0):
        output.write_campaign_of(result, options.out)
        tests = [t.id for t in output.campaign_of(result).tests]
    answer = {"campaign": str(options.out), "tests": tests}
    return answer, lambda console: console.print(f"{options.out}: {len(tests)} tests: {', '.join(tests)}")


def _report(options: argparse.Namespace) -> Answer:
    from sim.report import write_report

    out = options.out or Path("out") / load(options.target).name
    with whole_folder(out) as folder:
        for result, progress in _whole_chain(options, extra=1):
            write_report(result, folder / "report.html")
            progress("report written")
            answer = {"report": str(out / "report.html")}
            _mark(folder, options, answer)
    return answer, lambda console: console.print(f"{out / 'report.html'}")


def _inspect(options: argparse.Namespace) -> Answer:
    from sim.log import describe, read_log

    contents = read_log(options.target)
    answer = output.log_json(contents)
    if options.out:
        with whole_folder(options.out) as folder:
            output.write_frf_tables(contents, folder)
            _mark(folder, options, {"log": str(options.target)})
    return answer, lambda console: console.print(describe(contents), markup=False, highlight=False)


def _compare(options: argparse.Namespace) -> Answer:
    from diagnosis.compare import compare, comparison_json, show_comparison
    from sim.campaign import read_campaign

    spindle, campaign = load(options.target), read_campaign(options.campaign)
    with _progress(2 * len(campaign.tests)) as progress:
        comparison = compare(spindle, campaign, progress=progress)
    answer = comparison_json(comparison)
    _write_answer(options, answer, "comparison.json")
    return answer, lambda console: show_comparison(console, comparison)


def _diagnose(options: argparse.Namespace) -> Answer:
    from diagnosis.verdict import diagnose, diagnosis_json, show_diagnosis
    from sim.campaign import read_campaign

    spindle, campaign = load(options.target), read_campaign(options.campaign)
    with _progress(len(campaign.tests) + 5) as progress:
        found, about, places, tests = diagnose(spindle, campaign, progress=progress)
    answer = diagnosis_json(found, about, places, tests)
    _write_answer(options, answer, "diagnosis.json")
    return answer, lambda console: show_diagnosis(console, answer, places)


# ---------------------------------------------------------------- effects


def _effects(options: argparse.Namespace) -> Answer:
    if options.name is None:
        answer: dict[str, Any] = {"effects": [summary(e) for e in CATALOGUE]}
        _write_answer(options, answer, "effects.json")
        return answer, lambda console: show_effects(console)
    effect = by_name(options.name)
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
    with whole_folder(options.out) as folder:
        added = new_scene(options.target, options.effect, options.set, options.diagnosis, folder, options.out)
        answer = {"scene": str(options.out), **asdict(added)}
        _mark(folder, options, answer)
    return answer, lambda console: console.print(f"{options.out}: {added.words()}", highlight=False, markup=False)


# ---------------------------------------------------------------- output folders


def _write_answer(options: argparse.Namespace, answer: dict[str, Any], name: str) -> None:
    """The JSON answer as a file of the output folder, if one is wanted."""
    if options.out:
        with whole_folder(options.out) as folder:
            (folder / name).write_text(json.dumps(answer, indent=1), encoding="utf-8")
            _mark(folder, options, answer)


def _mark(folder: Path, options: argparse.Namespace, answer: dict[str, Any]) -> None:
    told = {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items() if k != "verb"}
    (folder / MARK).write_text(json.dumps({"options": told, "answer": answer}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
