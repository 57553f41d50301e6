"""What files and a mapping leave open: points, units and quantities of FRFs, conditions of tests; each asked once, as a sentence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.model.machine import Spindle
from thermospindle.sim.importing import units
from thermospindle.sim.importing.mapping import FileForm, MappingForm, told_of
from thermospindle.sim.importing.measured import Curve, End, Question, Read, listed, words_of


def together(questions: Sequence[Question]) -> tuple[Question, ...]:
    """Each thing asked once, for all files at a time."""
    about: dict[tuple[str, str, tuple[str, ...]], list[str]] = {}
    for q in questions:
        about.setdefault((q.key, q.text, q.names), []).append(q.about)
    return tuple(Question(", ".join(dict.fromkeys(of)), *same) for same, of in about.items())


def open_parts(curves: Mapping[str, Sequence[Curve]]) -> list[Question]:
    """The imaginary parts that columns of real values lack, of which some are negative."""
    without = [x for every in curves.values() for x in every if x.magnitude_only and np.min(x.value) < 0]
    return [Question(x.file.name, "columns", f"the imaginary part beside {x.where}: its values are real and some negative, so they are no magnitude") for x in without]


def open_ends(told: Sequence[tuple[str, str, End]]) -> list[Question]:
    """The points that no heading names, of (file, "response" or "reference", end)."""
    blank = sorted({(name, key) for name, key, end in told if not end.label})
    of = {key: ", ".join(name for name, k in blank if k == key) for key in ("response", "reference")}
    return [Question(names, key, f"the point that {'answered' if key == 'response' else 'was hit'}: {key} = node or name") for key, names in of.items() if names]


def open_units(curves: list[tuple[str, Curve]], settings: dict[Path, FileForm]) -> list[Question]:
    """What units and quantities leave open, once a file."""
    open_: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, curve in curves:
        if isinstance(fault := scaled(curve, settings[curve.file]), str):
            key, _, text = fault.partition(": ")
            open_.setdefault((key, text), []).append((name, curve.where))
    every = Counter(name for name, _ in curves)
    questions = []
    for (key, text), of in open_.items():
        whole = all(every[name] == n for name, n in Counter(name for name, _ in of).items())
        which = "" if whole else f" (that is {listed(dict.fromkeys(where for _, where in of), 3)}; its other FRFs have units that are known)"
        questions.append(Question(", ".join(dict.fromkeys(name for name, _ in of)), key, text + which))
    return questions


def scaled(curve: Curve, settings: FileForm) -> tuple[str, float] | str:
    """(quantity, factor to SI) of a curve, or the key and the sentence of what is open."""
    told = units.of_frf(curve.unit) if curve.unit else None
    if curve.unit and told is None:
        return f'unit: a known unit of its FRFs, as in unit = "(m/s^2)/N"; {curve.unit!r} is none; known are {units.known()}'
    if told is None:
        said = f"; its header says {curve.quantity}" if curve.quantity else ""
        return f'unit: the unit of its FRFs, as in unit = "(m/s^2)/N", "m/N", "g/N", "(mm/s)/N"{said}'
    if not curve.quantity or curve.quantity == told[0]:
        return told
    if settings.unit and settings.quantity:
        return f"quantity: quantity = {settings.quantity!r} or unit = {settings.unit!r}, which is that of {units.with_article(told[0])}"
    if settings.quantity and units.length_factor(curve.unit) is None:
        return f"unit: the unit of its FRFs: quantity = {curve.quantity!r} is told, and {curve.unit!r} is that of {units.with_article(told[0])}"
    if settings.quantity and (factor := units.length_factor(curve.unit)) is not None:
        return curve.quantity, factor  # settled: the label's unit of time is wrong, its length and force are taken
    if settings.unit:
        return told
    return f"quantity: which quantity its FRFs are: called {curve.quantity}, with the unit {curve.unit!r} of {units.with_article(told[0])}"


def open_conditions(found: Read, form: MappingForm, scene: Spindle | None, mapping: Path | None) -> list[Question]:
    """What tests and the campaign as a whole leave open."""
    questions, tests = [], found.tests
    for id_ in (t.id for t in form.tests):
        if tests and not any(fnmatchcase(name, id_) for name in tests):
            raise BadInput(f"{mapping}: tests: id = {id_!r}: no file makes such a test; there are {listed(tests)}")
    for key, text in (("temperature_C", "the temperature of the spindle, C,"), ("speed_rpm", "the speed, rpm (0 at rest),")):
        missing = [t for t in tests if getattr(told_of(form, t), key) is None]
        if missing:
            questions.append(Question(", ".join(missing), key, f"{text} of the test{'s' * (len(missing) > 1)}"))
    if form.spindle is None and scene is None:
        questions.append(Question("the campaign", "spindle", "the name of its scene (or --scene SCENE)"))
    if any(m.frequency_sd is None for every in found.modes.values() for m in every) and form.frequency_sd_Hz is None:
        questions.append(
            Question("the campaign", "frequency_sd_Hz", "how sure the frequencies of its modes are, one standard deviation in Hz (a line's width at most)")
        )
    return questions


def spoken(found: Read, files: Sequence[Path]) -> list[str]:
    """The open questions as sentences."""
    return [words_of(q, {"files": [f.name for f in files], "tests": found.tests}) for q in found.questions]


def unanswered(sentences: Sequence[str], tail: str) -> Unanswered:
    """What is open, and in the `tail` where it is answered."""
    return Unanswered(f"{len(sentences)} thing{'s are' if len(sentences) > 1 else ' is'} not told by the files:", sentences, tail)
