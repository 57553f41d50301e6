"""The functions of `import thermospindle as ts`: one line each from a scene to its modes, FRFs, tests, comparison and diagnosis.

Arguments carry the units people write in their names (C, rpm, Hz, N); what comes back is SI, with the units at its
fields. Everything raises `BadInput`, one sentence that names file, key or argument, value and what is allowed, for
what cannot be used; what can be asked and has no answer is `NoEquilibrium`, of bearings that find no balance or of heat
that finds none, and `OutsideRange`, of a law or table that does not reach.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does, before numpy loads

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from operator import methodcaller
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from thermospindle.arguments import an, number, of_kind, several, whole
from thermospindle.model.built.tolerance import LEAST, MOST, deviated
from thermospindle.model.errors import BadInput, instead
from thermospindle.model.machine import Addition, Condition, Spindle
from thermospindle.model.rotor.elements import HAMMER
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.scene.reading import load as load_scene
from thermospindle.model.units import RPM
from thermospindle.options import FASTEST, HITS, HOTTEST, NEWTONS
from thermospindle.sim.campaign.beside import POWER
from thermospindle.sim.campaign.campaign import Campaign, read_campaign
from thermospindle.sim.effects import CATALOGUE, by_name, checked
from thermospindle.sim.effects.effect import fitted_to, refusal
from thermospindle.sim.effects.known import equipped, of_file
from thermospindle.sim.effects.own import installed
from thermospindle.sim.hammer.test import ImpactTest, impact_tests
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.identification.modal import Modes, extract
from thermospindle.sim.operating import OperatingPoint, doubts, lines_of, operating_point
from thermospindle.sim.run import identify
from thermospindle.sim.study.variants import with_values

if TYPE_CHECKING:
    from thermospindle.diagnosis.compare.compare import Comparison
    from thermospindle.diagnosis.verdict import Diagnosis
    from thermospindle.model.files.stiffness_table import StiffnessTable
    from thermospindle.report.log.read import Log
    from thermospindle.sim.resonance.found import ResonanceMap
    from thermospindle.sim.warmup import Warmup

__tracebackhide__ = methodcaller("errisinstance", BadInput)  # pytest shows where it was asked
LINES = 2000  # of an FRF over the scene's band, where no frequencies are given


def load(scene: str | Path, effect_files: Sequence[str | Path] = (), *, values: Mapping[str, Any] | None = None) -> Spindle:
    """The spindle of a scene: its folder, its `spindle.toml`, or the name of a shipped one like "hdd_2003".

    `effect_files` hold effects of your own that the scene has. `values` stand in for those of the file, in its units, by dotted key with
    entries of lists by their name: {"sets.main.preload_N": 200, "effects.bond_softening.hot_compliance": 10}, as in `[vary]` of a study.
    """
    of_kind("scene", scene, (str, Path), "a scene's folder or the name of a shipped one")
    files = [Path(f) for f in several("effect_files", effect_files, "paths of files")]
    spindle, catalogue = equipped(load_scene(scene), files)
    if values is None:
        return spindle
    of_kind("values", values, (Mapping,), "a mapping of values by their keys")
    return with_values(spindle, catalogue, values)


def point(spindle: Spindle | str | Path, temperature_C: float, *, speed_rpm: float = 0.0) -> OperatingPoint:
    """The spindle soaked at a temperature (C) and turning (rpm): bearing states in `.state`, the compiled MuJoCo model in `.model`.

    Raises `NoEquilibrium` where the bearings find no balance; warns (`UserWarning`) of a condition
    that no real spindle bears and of what is odd about its bearings.
    """
    found = soaked(drawing_of(spindle), temperature_C, speed_rpm)
    for doubt in odd(found):
        warnings.warn(doubt, stacklevel=2)
    return found


def soaked(spindle: Spindle, temperature_C: float, speed_rpm: float) -> OperatingPoint:
    """The same without a word of what is `odd` there."""
    temperature = number("temperature_C", temperature_C, -273.15, HOTTEST)
    return operating_point(spindle, Condition(temperature, number("speed_rpm", speed_rpm, -FASTEST, FASTEST) * RPM))


def odd(point: OperatingPoint) -> list[str]:
    """Lost contact, and what else is odd about a condition and the bearings there, a sentence each."""
    lost = [] if point.state.status == "in contact" or not point.state.bearings else [f"{point.condition.temperature:g} C: {point.state.status}"]
    return [*lost, *doubts(point.spindle, [point])]


@overload
def modes(source: OperatingPoint, *, highest_Hz: float = ...) -> list[Mode]: ...
@overload
def modes(source: ImpactTest | Frf, *, highest_Hz: float = ..., window_decay: float = ...) -> Modes: ...
def modes(source: OperatingPoint | ImpactTest | Frf, *, highest_Hz: float = np.inf, window_decay: float = 0.0) -> list[Mode] | Modes:
    """Natural modes up to `highest_Hz`.

    Of an operating point the model's own, a list in order of frequency: `.frequency` Hz, `.damping_ratio`, `.kind`,
    `.whirl`, `.energy` (share of the strain energy by element), `.shape` (n,). Of an impact test or measured FRFs those
    identified by maximum likelihood: `Modes` with `.frequency` (m,) Hz, `.damping` (m,), `.shape` (m, responses), and
    `.frequency_sd` (m,) and so on, their standard errors. FRFs of records under an exponential window exp(-d t) have its
    damping in them, d / (2 pi f) more of every mode: `window_decay` (1/s) takes it out; of an impact test it is known.
    """
    of_kind("source", source, (OperatingPoint, ImpactTest, Frf), "an operating point (ts.point), a virtual test (ts.impact) or FRFs (ts.frf)")
    if highest_Hz != np.inf:
        number("highest_Hz", highest_Hz, 0.0, np.inf)
    if window_decay != 0.0:
        number("window_decay", window_decay, 0.0, np.inf)
        if not isinstance(source, Frf):
            raise BadInput("window_decay: is of measured FRFs; an operating point has none, and of an impact test it is known")
    if isinstance(source, OperatingPoint):
        return source.modes_below(highest_Hz)
    try:
        if isinstance(source, Frf):
            return extract(source.frequency, source.value, source.sd, band=(0.0, highest_Hz), kind=source.quantity, window_decay=window_decay)
        return identify(source, highest_Hz)
    except ValueError as error:
        raise BadInput(f"source: no modes can be found in its FRFs: {error}") from None


def frf(source: OperatingPoint | ImpactTest, frequency_Hz: ArrayLike | None = None, *, quantity: Literal["receptance", "mobility", "accelerance"] = "mobility") -> Frf:
    """FRFs between the scene's measuring points: `frf["hub_top0", "hub_top90"]` is one of them, (n,) complex, SI.

    Of an operating point exact at `frequency_Hz` (n,), by default 2000 lines over the scene's band; of an
    impact test the H1 estimate with coherence and standard errors at its own lines, with the damping of its
    exponential window in it (`test.estimate.window_decay`, 1/s, which `modes` takes out). `quantity`:
    receptance m/N, mobility (m/s)/N, accelerance (m/s2)/N; responses are all points, references the hammer's.
    """
    of_kind("source", source, (OperatingPoint, ImpactTest), "an operating point (ts.point) or a virtual test (ts.impact)")
    if not isinstance(quantity, str) or quantity not in POWER:
        raise BadInput(f"quantity = {quantity!r}; allowed are {', '.join(POWER)}")
    spindle = source.spindle if isinstance(source, OperatingPoint) else source.point.spindle
    names = {p.node: p.name for p in spindle.points}
    if isinstance(source, ImpactTest):
        if frequency_Hz is not None:
            raise BadInput("frequency_Hz: an impact test has its own lines; frf(test) takes none")
        found = source.estimate.h1
        factor = (2j * np.pi * found.frequency) ** POWER[quantity]
        sd = None if found.sd is None or not np.all(np.isfinite(found.sd)) else found.sd * np.abs(factor)
        return replace(found, value=found.value * factor, sd=sd, quantity=quantity, names=names)
    lines = np.linspace(*spindle.hammer.band, LINES) if frequency_Hz is None else lines_of("frequency_Hz", frequency_Hz)
    value = source.frf(lines) * (2j * np.pi * lines) ** POWER[quantity]
    return Frf(lines, value, tuple(names), spindle.hammer.hammer_nodes, quantity, names=names)


def impact(
    point: OperatingPoint,
    *,
    hits: int | None = None,
    level_N: float | None = None,
    element: Literal["linear", "ball-by-ball", "reduced"] = "linear",
    seed: int = 0,
    noise: bool = True,
) -> ImpactTest:
    """A virtual impact-hammer test in MuJoCo's time domain, half a second to some seconds of computing a hit.

    `hits` on each hammer point and their peak force `level_N` are the scene's by default; `element`
    "ball-by-ball" takes contact laws instead of linear bearings, "reduced" is computed with the modes
    alone. `.record` is what the analyser sampled; `ts.frf(test)` and `ts.modes(test)` follow from it.
    """
    of_kind("point", point, (OperatingPoint,), "an operating point (ts.point)")
    if hits is not None:
        whole("hits", hits, 1, HITS)
    if level_N is not None:
        number("level_N", level_N, 0.0, NEWTONS)
    if element not in HAMMER:
        raise BadInput(f"element = {element!r}: {instead(str(element), HAMMER)}")
    whole("seed", seed, 0, 10**18 - 1)
    of_kind("noise", noise, (bool,), "True or False")
    changes = {key: value for key, value in (("hits", hits), ("level", level_N)) if value is not None}
    settings = replace(point.spindle.hammer, **changes)  # type: ignore[arg-type]
    return impact_tests([point], settings, element, seed, noise)[0]


def campaign(folder: str | Path) -> Campaign:
    """A campaign of tests, measured or virtual; `spindle import` makes one of your own files.
    `.tests[0].frf` and `.modes` hold what was measured."""
    of_kind("folder", folder, (str, Path), "the folder of a campaign")
    return read_campaign(Path(folder))


def compare(spindle: Spindle | str | Path, tests: Campaign | str | Path) -> Comparison:
    """A campaign beside the scene: modes paired through all conditions with errors and standard
    errors; `.rms_residual` is one number for the whole."""
    from thermospindle.diagnosis.compare.compare import compare as beside
    from thermospindle.diagnosis.runout.lines import modal_tests

    return beside(drawing_of(spindle), modal_tests(_campaign(tests)))


def diagnose(
    spindle: Spindle | str | Path,
    tests: Campaign | str | Path,
    effects: Sequence[str] | None = None,
    progress: Callable[[str], None] = lambda done: None,
) -> Diagnosis:
    """Which physics the scene lacks to explain a campaign: ten seconds to some minutes. `effects`
    names those of the catalogue to ask (all by default).

    `.verdict.word` is none, identified, ambiguous, two effects or unexplained.
    """
    from thermospindle.diagnosis.runout.lines import modal_tests
    from thermospindle.diagnosis.verdict import diagnose as search

    catalogue = CATALOGUE if effects is None else tuple(by_name(name) for name in several("effects", effects, "names"))
    return search(drawing_of(spindle), modal_tests(_campaign(tests)), catalogue, progress)


def answer(found: Diagnosis | Comparison | StiffnessTable | Warmup | ResonanceMap) -> dict[str, Any]:
    """All that the command line tells with `--json`, as plain dicts, lists and numbers with units in their keys: of a diagnosis
    `verdict`, `effects`, `probability`, and `candidates` with the sizes that each effect has, in every test too, and their standard
    errors; of a comparison, a table, a warm-up and a map likewise. docs/site/answers.toml, and the site, say what every key holds.
    """
    for module, kind, told, function in ANSWERED:
        if type(found).__name__ == kind and isinstance(found, getattr(import_module(f"thermospindle.{module}"), kind)):
            return cast(dict[str, Any], getattr(import_module(f"thermospindle.report.text.{told}"), function)(found))
    names = "a diagnosis (ts.diagnose), a comparison (ts.compare), a table (ts.table), a warm-up (ts.warmup) or a map (ts.resonances)"
    raise BadInput(f"found: must be {names}, not {an(found)}")


ANSWERED = (
    ("diagnosis.compare.compare", "Comparison", "compare", "comparison_json"),
    ("diagnosis.verdict", "Diagnosis", "diagnosis.answer", "diagnosis_json"),
    ("model.files.stiffness_table", "StiffnessTable", "states", "table_json"),
    ("sim.warmup", "Warmup", "warmup", "warmup_json"),
    ("sim.resonance.found", "ResonanceMap", "resonance", "map_json"),
)
"""What `answer` tells: module and class of what was found, module and function that tell it; loaded when asked for."""


def add(spindle: Spindle | str | Path, effect: str | Path, **values: float) -> Spindle:
    """The spindle with an effect more, by its name in the catalogue or the `Path` of a file of your
    own; parameters that `values` do not name are typical ones (`spindle effects NAME`).

    Nothing is written; `spindle add` writes a scene.
    """
    drawing = drawing_of(spindle)
    of_kind("effect", effect, (str, Path), "the name of an effect, or the path of a file of your own")
    found = fitted_to(of_file(effect, drawing) if isinstance(effect, Path) else by_name(effect, (*CATALOGUE, *installed())), drawing)
    if why := refusal(found, drawing):
        raise BadInput(f"effect {found.name}: {why}")
    if any(a.effect == found.name for a in drawing.effects):
        raise BadInput(f"effect {found.name}: {drawing.name} has it already")
    for name, value in values.items():
        number(name, value)
    own = checked(found, found.typical() | values)
    return replace(drawing, effects=(*drawing.effects, Addition(found.name, own, found)))


def deviate(spindle: Spindle | str | Path, deviations: Mapping[str, float]) -> Spindle:
    """The spindle as it would be built with relative deviations of toleranced parameters, by name: {"preload": -0.05} is 5 % less.

    The names are those of `[build.deviations]` of a scene; nothing is written.
    """
    of_kind("deviations", deviations, (Mapping,), "a mapping of relative deviations by name")
    for name, value in deviations.items():
        if not LEAST <= number(name, value) <= MOST:
            raise BadInput(f"{name} = {value:g}: must be a relative deviation from {LEAST:g} to {MOST:g}")
    return deviated(drawing_of(spindle), deviations)


def read_log(file: str | Path) -> Log:
    """Everything in a Rerun log (`.rrd`) of this program, FRFs back as numbers in `.frfs`."""
    from thermospindle.report.log.read import read_log as read

    of_kind("file", file, (str, Path), "a Rerun log")
    return read(Path(file))


def drawing_of(spindle: Spindle | str | Path) -> Spindle:
    """A spindle, or that of a scene named."""
    of_kind("spindle", spindle, (Spindle, str, Path), "a spindle (ts.load), a scene's folder or the name of a shipped one")
    return spindle if isinstance(spindle, Spindle) else load(spindle)


def _campaign(tests: Campaign | str | Path) -> Campaign:
    of_kind("tests", tests, (Campaign, str, Path), "a campaign (ts.campaign) or its folder")
    return tests if isinstance(tests, Campaign) else campaign(tests)
