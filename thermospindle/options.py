"""What the command line takes: verbs, their options, and the numbers that a computation can bear."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from math import inf, isfinite
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from thermospindle.model.errors import instead
from thermospindle.model.files.cells import plain_number
from thermospindle.model.rotor.elements import ELEMENTS, HAMMER
from thermospindle.model.shaft import THEORIES

Number = TypeVar("Number", int, float)
HOTTEST, FASTEST = 1e4, 1e8  # C and rpm, up to which numbers are computed with; what no bearing bears only warns
NEWTONS, SECONDS, MINUTES, NANOMETRES = 1e6, 100.0, 1e5, 1e6  # of a hammer, a record, a warm-up and a probe's noise
HITS, MULTIPLES = 1000, 100


# ---------------------------------------------------------------- numbers of options


class _Parser(argparse.ArgumentParser):
    def __init__(self, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.IGNORECASE)  # argparse's own knows no exponents

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        if action.option_strings and "--" in arg_strings:  # `--speed=--`, of which Python 3.11 makes an empty list
            raise argparse.ArgumentError(action, "'--' is no value")
        return super()._get_values(action, arg_strings)  # type: ignore[misc]

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, f"{value!r} is unknown; {instead(str(value), map(str, action.choices))}")

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"spindle: {message}; see {self.prog} --help\n")


class _Completion(argparse.Action):
    """Prints what `eval "$(spindle --completion bash)"` needs: verbs, options, and files where files are asked for."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, values: Any, option_string: str | None = None) -> NoReturn:
        import shtab

        pending = [parser]
        while pending:
            for action in pending.pop()._actions:
                if isinstance(action.choices, dict):
                    pending += action.choices.values()
                elif action.type is Path:
                    action.complete = shtab.FILE  # type: ignore[attr-defined]
        print(shtab.complete(parser, shell=values))
        parser.exit()


def _number(text: str) -> float:
    try:
        value = float(plain_number(text))
    except ValueError:
        apart = "; several stand apart by spaces" if "," in text else ""
        raise argparse.ArgumentTypeError(f"{text!r} is not a number{apart}") from None
    if not isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def _up_to(largest: float, smallest: float = -inf, unit: str = "") -> Callable[[str], float]:
    """A number whose size a computation can bear."""

    def number(text: str) -> float:
        value = _number(text)
        if not abs(value) <= largest:
            raise argparse.ArgumentTypeError(f"{text}: at most {largest:g}{unit} can be computed with")
        if value and abs(value) < smallest:
            raise argparse.ArgumentTypeError(f"{text}: at least {smallest:g}{unit}, or 0, can be computed with")
        return value

    return _bounded(number, f"up to {largest:g}{unit}")


def _bounded(read: Callable[[str], Number], limits: str) -> Callable[[str], Number]:
    """What reads an option's number, with `limits` that its help tells."""
    read.limits = limits  # type: ignore[attr-defined]
    return read


def _temperature(text: str) -> float:
    value = _up_to(HOTTEST, unit=" C")(text)
    if value <= -273.15:
        raise argparse.ArgumentTypeError(f"{text} C is below absolute zero")
    return value


def _whole(least: int, most: int, what: str) -> Callable[[str], int]:
    def whole(text: str) -> int:
        if not (text.isascii() and text.isdigit()) or len(text) > 18 or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"{text} is not {what}")
        return int(text)

    return whole


def _count(most: int) -> Callable[[str], int]:
    return _bounded(_whole(1, most, f"a count of one or more, up to {most}"), f"1 to {most}")


_bounded(_temperature, f"above -273.15 C, up to {HOTTEST:g}")
_port = _bounded(_whole(1, 65535, "a port, 1 to 65535"), "1 to 65535")
_seed = _bounded(_whole(0, 10**18 - 1, "a whole number from 0 to 18 digits"), "a whole number up to 18 digits")


def _setting(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form name=value")
    try:
        return name, _number(value)
    except argparse.ArgumentTypeError as error:
        named = "; a bearing, a set or a channel goes by its number, as spindle effects EFFECT --scene SCENE tells it" if value.strip().isidentifier() else ""
        raise argparse.ArgumentTypeError(f"{name}: {error}{named}") from None


# ---------------------------------------------------------------- verbs and their options


@cache
def parsers() -> tuple[_Parser, dict[str, argparse.ArgumentParser]]:
    """The parser, and those of the verbs: an option has the name (`dest`) of an argument of the verb's function, and its default."""
    parser = _Parser(prog="spindle", description="From temperature to modal peaks of a ball-bearing spindle.")
    parser.add_argument("--version", action="version", version=f"spindle {version('thermospindle')}")
    parser.add_argument("--completion", action=_Completion, default=argparse.SUPPRESS, choices=("bash", "zsh", "tcsh"), help="print the completion script of a shell and end")
    verbs = parser.add_subparsers(required=True, metavar="VERB", parser_class=_Parser)
    speed_number = _up_to(FASTEST, 1e-3, " rpm")

    def verb(name: str, function: tuple[str, str], text: str, what: str = "scene", out: tuple[str, str] = ("DIR", "folder to write, whole or not at all")) -> argparse.ArgumentParser:
        added = verbs.add_parser(name, help=text, description=text, argument_default=argparse.SUPPRESS)
        added.set_defaults(verb=function)
        if what:
            added.add_argument(what, metavar={"scene": "SCENE", "log": "FILE.rrd", "diagnosis": "DIAGNOSIS.json", "name": "NAME", "file": "STUDY.toml"}[what], type=str if what == "name" else Path)
        added.add_argument("--json", action="store_true", help="one JSON object on standard output, nothing else")
        added.add_argument("--out", type=Path, metavar=out[0], help=out[1])
        if what not in ("log", "diagnosis", "name"):
            added.add_argument(
                "--effect", dest="effect_files", type=Path, action="append", metavar="FILE.py",
                help="a file with an effect of your own, beside those of the catalogue; may be given again",
            )  # fmt: skip
        return added

    def several(added: argparse.ArgumentParser) -> None:
        added.add_argument("--temperatures", type=_temperature, nargs="+", metavar="C", help="five over the scene's range by default")

    def one(added: argparse.ArgumentParser) -> None:
        added.add_argument("--temperature", type=_temperature, metavar="C", help="the scene's reference temperature by default")

    def speed(added: argparse.ArgumentParser, text: str = "0, at rest, by default") -> None:
        added.add_argument("--speed", dest="speed_rpm", type=speed_number, metavar="RPM", help=text)

    def speeds(added: argparse.ArgumentParser, text: str = "0, at rest, by default") -> None:
        added.add_argument("--speeds", dest="speeds_rpm", type=speed_number, nargs="+", metavar="RPM", help=text)

    def element(added: argparse.ArgumentParser) -> None:
        added.add_argument("--element", choices=ELEMENTS, help="bearing element of the time simulation")

    def beam(added: argparse.ArgumentParser) -> None:
        added.add_argument("--beam", choices=tuple(THEORIES), help="theory of the flexible shafts (the scene's by default)")

    def hammer(added: argparse.ArgumentParser) -> None:
        speed(added)
        text = "bearing element of the time simulation; reduced computes the linear model's records without it, for long records and stiff beams (linear by default, reduced where that takes too many steps)"
        added.add_argument("--element", choices=HAMMER, help=text)
        added.add_argument("--hits", type=_count(HITS), help="hits on each hammer point (the scene's by default)")
        added.add_argument("--level", type=_up_to(NEWTONS, unit=" N"), metavar="N", help="peak force of the hammer (the scene's by default)")
        added.add_argument("--seed", type=_seed, help="of hammer scatter and sensor noise")

    def verbose(added: argparse.ArgumentParser) -> None:
        added.add_argument("--verbose", action="store_true", help="everything, not the verdict and what matters most alone")

    def held_out(added: argparse.ArgumentParser, text: str) -> None:
        added.add_argument("--held-out", dest="held_out_tests", nargs="+", action="extend", metavar="TEST", help=text)

    chain = verb("run", ("chain", "run"), "the whole chain: tables, model, virtual tests, modal peaks, report and Rerun log")
    several(chain)
    hammer(chain)
    table = verb("table", ("states", "table"), "bearing stiffness over temperature and speed")
    several(table)
    speeds(table)
    modes = verb("modes", ("states", "modes"), "modes of the linearised rotor-base model")
    one(modes)
    speed(modes)
    modes.add_argument("--highest", type=_number, metavar="HZ", help="upper end (the scene's band by default)")
    beam(modes)
    static = verb("static", ("states", "static"), "stiffness, bearing reactions and shares of the compliance for a unit force at every point")
    one(static)
    speed(static)
    beam(static)
    static.add_argument(
        "--bearings", choices=("rated", "computed"),
        help="as their catalogue rates them, to rigid ground (by default where all are rated), or as computed, in their housing",
    )  # fmt: skip
    impact = verb("impact", ("chain", "impact"), "a virtual impact-hammer test in MuJoCo's time domain, and the modes it shows")
    one(impact)
    hammer(impact)
    simulate = verb("simulate", ("chain", "simulate"), "virtual tests as a campaign folder, in the same form as measured ones")
    several(simulate)
    hammer(simulate)
    simulate.add_argument("--runout", action="store_true", help="the turning spindle seen by probes on its hub, instead of hammer tests")
    speeds(simulate, "of runout tests, each at every temperature (three up to the scene's nominal one by default)")
    simulate.add_argument("--seconds", type=_up_to(SECONDS, unit=" s"), metavar="S", help="length of a runout record")
    simulate.add_argument("--noise-nm", type=_up_to(NANOMETRES, unit=" nm"), metavar="NM", help="rms noise of a runout probe")
    report = verb(
        "report", ("chain", "report"),
        "the HTML report: the whole chain, the turning spindle, warm-up, resonances, and a ladder on what was measured",
    )  # fmt: skip
    several(report)
    hammer(report)
    bring = verb("import", ("importing", "bring"), "a campaign from your own files: UFF, CSV, .mat, .npz; FRFs, time records or tables of modes", what="")
    bring.add_argument("files", metavar="FILE", nargs="+", type=Path)
    bring.add_argument("--mapping", type=Path, metavar="FILE.toml", help="what the files do not tell; a new file is written as a form to fill in")
    bring.add_argument("--scene", type=Path, metavar="SCENE", help="the spindle that was tested; its measuring points are known by node and name")
    compare = verb("compare", ("compare", "compare"), "a campaign beside the scene: modes, dampings, shapes and FRFs, and one number for the whole")
    compare.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    compare.add_argument("--before", type=Path, metavar="SCENE", help="the scene as it was, to see whether the error fell")
    verbose(compare)
    held_out(compare, "tests that the scene was not fitted to (by default those that its build table does not list)")
    diagnose = verb("diagnose", ("diagnose", "diagnose"), "which physics the scene lacks to explain a campaign")
    diagnose.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    verbose(diagnose)
    held_out(diagnose, "tests to leave out, so that `compare` can show what is predicted of them")
    diagnose.add_argument(
        "--predictions", type=Path, metavar="DIAGNOSIS.json", help="an earlier diagnosis: did what it predicted come true?"
    )
    ladder = verb("ladder", ("ladder", "ladder"), "model forms, tolerances and effects taken in one after the other, and the error at every step")
    ladder.add_argument("campaign", metavar="CAMPAIGN", type=Path)
    ladder.add_argument("--effects", nargs="+", metavar="NAME", help="effects to add, in this order (those that diagnose names by default)")
    bench = verb("workbench", ("workbench", "workbench"), "a page in the browser, on this machine alone: move effects and parameters, see FRFs and errors change")
    bench.add_argument("campaign", metavar="CAMPAIGN", type=Path, nargs="?", default=None, help="tests to set the model beside; without them it is set beside itself")
    bench.add_argument("--diagnosis", type=Path, metavar="DIAGNOSIS.json", help="explanations to begin with: the answer of diagnose --json")
    held_out(bench, "tests to leave out of the fit at the beginning (by default those that the scene's build table does not list)")
    bench.add_argument("--port", type=_port, help="of this machine's loopback interface (a free one by default)")
    bench.add_argument("--no-browser", action="store_true", help="print the address, and open no browser")
    effects = verb("effects", ("catalogue", "effects"), "the catalogue of physical effects, or one of them explained", what="")
    effects.add_argument("name", metavar="NAME", nargs="?")
    effects.add_argument("--scene", type=Path, metavar="SCENE", help="typical sizes for this scene, and which effects cannot be in it")
    add = verb("add", ("catalogue", "add"), "a new scene with one more effect, or with several that were fitted together")
    add.add_argument("effect", metavar="EFFECT", nargs="+")
    add.add_argument(
        "--set", type=_setting, nargs="+", action="extend", metavar="NAME=VALUE",
        help="parameter values (typical ones by default); EFFECT.NAME where several effects have one of that name",
    )  # fmt: skip
    add.add_argument(
        "--from", dest="diagnosis", type=Path, metavar="DIAGNOSIS.json",
        help="take fitted values and build tolerances from the answer of diagnose --json",
    )  # fmt: skip
    written = "FILE.py", "effect file to write; nothing is overwritten"
    draft = verb("draft", ("diagnose", "draft"), "an effect file of one's own from what a diagnosis found to drift", "diagnosis", written)
    draft.add_argument("--element", metavar="NAME", help="the element that drifts (the first one of the diagnosis by default)")
    draft.add_argument("--name", metavar="NAME", help="name of the effect (the file's by default)")
    runout = verb("runout", ("running", "runout"), "repeatable and nonrepeatable runout of the turning spindle, and the lines it is made of")
    one(runout)
    speed(runout, "the scene's nominal speed by default")
    runout.add_argument("--seconds", type=_up_to(SECONDS, unit=" s"), metavar="S", help="length of the record (by default half a second to a second)")
    runout.add_argument("--seed", type=_seed, help="draw plausible imperfections instead of the scene's")
    element(runout)
    runout.add_argument(
        "--path", choices=("simulated", "linear"),
        help="a run in MuJoCo, or the exact harmonic answer of the linear model (simulated by default, linear where that takes too many steps)",
    )  # fmt: skip
    warmup = verb(
        "warmup", ("running", "warmup"), "from cold start (or into a chamber soak): temperatures, preload, friction and frequencies over time"
    )
    one(warmup)
    speed(warmup, "the scene's nominal speed by default, 0 for a soak")
    warmup.add_argument("--minutes", type=_up_to(MINUTES, unit=" min"), metavar="M", help="eight time constants by default")
    warmup.add_argument("--soak", type=_temperature, metavar="C", help="chamber at another temperature than the spindle's at the start")
    resonances = verb(
        "map", ("running", "resonances"), "natural frequencies against every bearing and unbalance line, over temperature and speed"
    )
    one(resonances)
    speed(resonances, "the nominal speed (the scene's by default)")
    resonances.add_argument("--temperatures", type=_temperature, nargs="+", metavar="C", help="every temperature to map, that of --temperature added; one alone makes a Campbell diagram (the scene's range in 21 steps by default)")
    speeds(resonances, "every speed to map, the nominal one added: one number is one speed and no end of a range (0 to twice the nominal speed in 41 steps by default)")
    resonances.add_argument("--multiples", type=_count(MULTIPLES), metavar="K", help="of the number of balls, and even ball orders")
    studies = verb("study", ("study", "study"), "a study from its file: a sweep, a Monte Carlo of build tolerances, a comparison of designs, or a fleet of campaigns; run again it goes on", what="file")
    studies.add_argument("--cluster", metavar="ADDRESS", help="of a Dask scheduler whose workers do the work, as in tcp://127.0.0.1:8786 (this machine's cores by default)")
    new = verb("new", ("starting", "new"), "a commented scene of your own to start from, which every verb takes", what="name")
    new.add_argument("--like", choices=("hdd", "machine-tool", "grinding", "rotor"), required=True, help="the machine it is like; --out is the new folder, ./NAME by default")
    verb("check", ("starting", "check"), "what the program understands of a scene, what it assumes and what it finds odd; --out draws it")
    verb("inspect", ("inspect", "inspect"), "what a Rerun log of spindle holds, and its FRFs as numbers", what="log")
    for added in verbs.choices.values():
        for action in added._actions:
            if limits := getattr(action.type, "limits", ""):
                action.help = f"{action.help}; {limits}"
    return parser, dict(verbs.choices)
