"""From files and a mapping to a campaign, or to everything that is still open, at once."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path

import numpy as np

from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.model.machine import Point, Spindle
from thermospindle.model.units import MINUTE, RPM
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.importing import units
from thermospindle.sim.importing.exchanged import exchanged
from thermospindle.sim.importing.files.labels import end, same_end
from thermospindle.sim.importing.files.reading import content
from thermospindle.sim.importing.frfs import Placed, frf_of
from thermospindle.sim.importing.mapping import REST, FileForm, MappingForm, TestForm, fits, settings_of, told_of
from thermospindle.sim.importing.measured import FORCE_NEEDED, Content, Curve, End, ModeLine, Motion, Question, listed, words_of
from thermospindle.sim.importing.modes import rows_of
from thermospindle.sim.importing.names import plain
from thermospindle.sim.importing.peaks import from_peaks
from thermospindle.sim.importing.places import place, points_of, unplaced
from thermospindle.sim.importing.records import frfs_of, open_units


@dataclass(frozen=True, eq=False)
class Read:
    """All files as read: `tests` by id with the curves, modes, window and time before the hit of each, `notes`, and what is open."""

    contents: tuple[Content, ...]
    curves: dict[str, list[Curve]]
    modes: dict[str, list[ModeLine]]
    window: dict[str, float]
    pretrigger: dict[str, float]
    ends: tuple[tuple[str, End], ...]  # of what file, every end that is not placed
    points: dict[int, Point]
    notes: tuple[str, ...]
    questions: tuple[Question, ...]

    @property
    def tests(self) -> list[str]:
        return list(dict.fromkeys([*self.curves, *self.modes]))


def read(
    files: Sequence[Path], form: MappingForm, scene: Spindle | None, mapping: Path | None = None, progress: Callable[[str], None] = lambda done: None
) -> Read:
    """Read every file as the mapping (`form`, of the file `mapping`) says; what it does not say is among the questions. Raises `BadInput` for damaged files."""
    for f in files:
        if not f.is_file():
            raise BadInput(f"{f}: no such file")
    if len({f.resolve() for f in files}) < len(files):
        raise BadInput(f"{listed(f.name for f in files)}: a file is named twice")
    unused = [t.file for t in form.files if not any(fits(t, f) for f in files)]
    if unused:
        raise BadInput(f"{mapping}: files: file = {unused[0]!r}: is none of {listed(f.name for f in files)}")
    settings = {f: settings_of(form, f) for f in files}
    contents = []
    for f in files:
        contents.append(content(f, settings[f]))
        progress(f.name)
    _check_columns(form, contents, mapping)
    _check_ends(form, contents, settings, mapping)
    points, questions = points_of(form, scene)
    notes = [n for c in contents for n in c.notes]
    questions += [q for c in contents for q in (*c.questions, *open_units(c.file.name, c.motions))]
    curves: dict[str, list[Curve]] = {}
    modes: dict[str, list[ModeLine]] = {}
    window: dict[str, float] = {}
    pretrigger: dict[str, float] = {}
    coherence: dict[str, dict[tuple[End, End], np.ndarray]] = {}
    for c in contents:
        own = settings[c.file].test or plain(c.file.stem)
        if not (c.curves or c.motions or c.modes or c.places or c.unscaled or c.coherence or c.questions):
            raise BadInput(f"{c.file}: holds no FRF of a motion, no time record, no modes and no geometry" + (f"; {'; '.join(c.notes)}" if c.notes else ""))
        for x in c.curves:
            if x.value.shape != x.frequency.shape:
                raise BadInput(f"{c.file}: {x.where}: {x.value.size} values at {x.frequency.size} frequencies; there must be as many")
            if not np.any(x.value) and x.magnitude_only:
                raise BadInput(f"{c.file}: {x.where}: zero on every line; a dead channel is not allowed: tell it as \"ignore\" in columns")
            if len(wrong := np.flatnonzero(~np.isfinite(x.value))):
                more = f", and {len(wrong) - 1} more lines are none either" if len(wrong) > 1 else ""
                raise BadInput(f"{c.file}: {x.where}: its value at {x.frequency[wrong[0]]:g} Hz is no number{more}; take the FRF out of the file, or export it again")
        if c.curves or c.questions or c.motions:
            curves.setdefault(own, []).extend(_turned(x, settings[c.file]) for x in c.curves)
        coherence.setdefault(own, {}).update(c.coherence)
        for m in c.modes:
            modes.setdefault(m.test or own, []).append(m)
    curves = {test: [_with(x, coherence.get(test, {})) for x in every] for test, every in curves.items()}
    groups, open_records = _records(contents, settings)
    questions += open_records
    measured = scene.hammer.band if scene is not None and form.band_Hz is None and form.records.band_Hz is None else None
    if groups and scene is not None and measured:
        notes.append(f"time records: kept from {measured[0]:g} to {measured[1]:g} Hz, where the hammer test of {scene.name} is; band_Hz under [records] keeps another band")
    for (test, label), group in groups.items():
        made = frfs_of(group, label, form.records, measured)
        notes += made.notes
        questions += made.questions
        curves.setdefault(test, []).extend(made.curves)
        if made.curves:
            pretrigger[test] = made.pretrigger
        if made.window_decay > 0 and abs(window.setdefault(test, made.window_decay) / made.window_decay - 1) > 1e-9:
            questions.append(Question(f"test {test}", "hit_length_s", "one length for all hits, so that one window fits all its FRFs"))
    for every in curves.values():
        for x in every:
            if x.magnitude_only and np.min(x.value) < 0:
                questions.append(Question(x.file.name, "columns", f"the imaginary part beside {x.where}: its values are real and some negative, so they are no magnitude"))
    own_curves = [(x.file.name, x) for every in curves.values() for x in every if not x.magnitude_only]
    told = [(name, key, getattr(x, key)) for name, x in own_curves for key in ("response", "reference")]
    told += [(c.file.name, "reference" if m.force else "response", m.end) for c in contents for m in c.motions]  # asked at once, whatever else is open of them
    blank = sorted({(name, key) for name, key, end in told if not end.label})
    for key in ("response", "reference"):
        if of := [name for name, k in blank if k == key]:
            questions.append(Question(", ".join(of), key, f"the point that {'answered' if key == 'response' else 'was hit'}: {key} = node or name"))
    ends = tuple((name, end) for name, _, end in told if place(end, form, points) is None)
    questions += unplaced(ends, points, scene)
    questions += _units(own_curves, settings)
    found = Read(tuple(contents), curves, modes, window, pretrigger, ends, points, tuple(notes), ())
    questions += _conditions(found, form, scene, mapping)
    return Read(tuple(contents), curves, modes, window, pretrigger, ends, points, tuple(notes), _together(questions))


def _check_columns(form: MappingForm, contents: Sequence[Content], mapping: Path | None) -> None:
    """`BadInput` for a column that the mapping tells and none of the files that it is about has."""
    for table in form.files:
        names = dict.fromkeys(n for c in contents if fits(table, c.file) for n in c.names)
        known = {REST, *names, *(n.rsplit(".", 1)[-1] for n in names)}
        if wrong := [name for name in table.columns if name not in known]:
            called = [n for n in names if not re.fullmatch(r"(column )?\d+", n)] or [n for n in names if not n.isdigit()]
            there = listed(called, 12) or "none, for UFF and tables of modes say themselves what they hold"
            raise BadInput(f"{mapping}: files: columns: {wrong[0]!r} is no column of {table.file}; there are {there}")


def _check_ends(form: MappingForm, contents: Sequence[Content], settings: dict[Path, FileForm], mapping: Path | None) -> None:
    """`BadInput` for a point that the mapping tells of files whose headings all tell others: which of the two is meant nobody knows."""
    for table, key in product(form.files, ("response", "reference")):
        own = [c for c in contents if fits(table, c.file) and getattr(settings[c.file], key) == getattr(table, key)]
        told = [getattr(x, key) for c in own for x in c.curves] + [m.end for c in own for m in c.motions if m.force == (key == "reference")]
        if getattr(table, key) is not None and told and not any(same_end(end(str(getattr(table, key))), e) for e in told):
            raise BadInput(
                f"{mapping}: files: {key} = {getattr(table, key)!r}: the headings of {table.file} say {listed(dict.fromkeys(e.label for e in told))}; allowed is what a heading leaves open, or "
                f'the way that it looks, as in "{told[0].label.partition(":")[0]}:-Z", and columns tells another heading'
            )


def _together(questions: Sequence[Question]) -> tuple[Question, ...]:
    """Each thing asked once, for all files at a time."""
    about: dict[tuple[str, str, tuple[str, ...]], list[str]] = {}
    for q in questions:
        about.setdefault((q.key, q.text, q.names), []).append(q.about)
    return tuple(Question(", ".join(dict.fromkeys(of)), *same) for same, of in about.items())


def _turned(curve: Curve, settings: FileForm) -> Curve:
    return replace(curve, value=curve.value.conj()) if settings.conjugate else curve


def _with(curve: Curve, coherence: dict[tuple[End, End], np.ndarray]) -> Curve:
    """The curve with the coherence of its ends, from whichever file of its test."""
    own = coherence.get((curve.response, curve.reference))
    return curve if own is None or own.shape != curve.value.shape else replace(curve, coherence=own)


Records = dict[tuple[str, End], list[tuple[Path, list[Motion]]]]


def _records(contents: Sequence[Content], settings: dict[Path, FileForm]) -> tuple[Records, list[Question]]:
    """Time records by test and hammer point; force and responses of one hit may be in files of their own, of the same test."""
    groups: Records = {}
    questions: list[Question] = []
    apart: dict[str, list[Content]] = {}
    for c in contents:
        if not c.motions or c.questions:
            continue
        test = settings[c.file].test or plain(c.file.stem)
        kinds = {m.force for m in c.motions}
        if len(kinds) == 1:
            apart.setdefault(test, []).append(c)
        elif sum(m.force for m in c.motions) > 1:
            questions.append(Question(c.file.name, "columns", "which one of its force channels is the hammer's"))
        else:
            _add(groups, test, c.file, list(c.motions))
    for test, own in apart.items():
        motions = [m for c in own for m in c.motions]
        names = listed(c.file.name for c in own)
        if sum(m.force for m in motions) == 1 and len(motions) > 1:
            _add(groups, test, own[0].file, motions)
        else:
            lacking = "response" if all(m.force for m in motions) else "force"
            alone = f"; {FORCE_NEEDED}" if lacking == "force" else ""
            questions.append(Question(names, "test", f"the {lacking} record that goes with them: files of one hit have the same test{alone}"))
    wrong = {key: [q for path, motions in group if (q := exchanged(path, motions)) is not None] for key, group in groups.items()}
    return {key: group for key, group in groups.items() if not wrong[key]}, [*questions, *(q for of in wrong.values() for q in of)]


def _add(groups: Records, test: str, file: Path, motions: list[Motion]) -> None:
    groups.setdefault((test, next(m.end for m in motions if m.force)), []).append((file, motions))


def _units(curves: list[tuple[str, Curve]], settings: dict[Path, FileForm]) -> list[Question]:
    """What units and quantities leave open, once a file."""
    open_: dict[tuple[str, str], list[str]] = {}
    for name, curve in curves:
        if isinstance(fault := scaled(curve, settings[curve.file]), str):
            key, _, text = fault.partition(": ")
            open_.setdefault((key, text), []).append(name)
    return [Question(", ".join(dict.fromkeys(names)), key, text) for (key, text), names in open_.items()]


def scaled(curve: Curve, settings: FileForm) -> tuple[str, float] | str:
    """(quantity, factor to SI) of a curve, or the key and the sentence of what is open."""
    told = units.of_frf(curve.unit) if curve.unit else None
    if curve.unit and told is None:
        return f'unit: a known unit of its FRFs, as in unit = "(m/s^2)/N"; {curve.unit!r} is none'
    if told is None:
        said = f"; its header says {curve.quantity}" if curve.quantity else ""
        return f'unit: the unit of its FRFs, as in unit = "(m/s^2)/N", "m/N", "g/N", "(mm/s)/N"{said}'
    if not curve.quantity or curve.quantity == told[0]:
        return told
    if settings.unit and settings.quantity:
        return f"quantity: quantity = {settings.quantity!r} or unit = {settings.unit!r}, which is that of {_a(told[0])}"
    if settings.quantity and units.length_factor(curve.unit) is None:
        return f"unit: the unit of its FRFs: quantity = {curve.quantity!r} is told, and {curve.unit!r} is that of an {told[0]}"
    if settings.quantity and (factor := units.length_factor(curve.unit)) is not None:
        return curve.quantity, factor  # settled: the label's unit of time is wrong, its length and force are taken
    if settings.unit:
        return told
    return f"quantity: which quantity its FRFs are: called {curve.quantity}, with the unit {curve.unit!r} of {_a(told[0])}"


def _a(quantity: str) -> str:
    return f"an {quantity}" if quantity == "accelerance" else f"a {quantity}"


def _conditions(found: Read, form: MappingForm, scene: Spindle | None, mapping: Path | None) -> list[Question]:
    """What tests and the campaign as a whole leave open."""
    questions = []
    for id_ in (t.id for t in form.tests):
        if found.tests and not any(fnmatchcase(name, id_) for name in found.tests):
            raise BadInput(f"{mapping}: tests: id = {id_!r}: no file makes such a test; there are {listed(found.tests)}")
    for key, text in (("temperature_C", "the temperature of the spindle, C,"), ("speed_rpm", "the speed, rpm (0 at rest),")):
        missing = [t for t in found.tests if getattr(told_of(form, t), key) is None]
        if missing:
            questions.append(Question(", ".join(missing), key, f"{text} of the test{'s' * (len(missing) > 1)}"))
    if form.spindle is None and scene is None:
        questions.append(Question("the campaign", "spindle", "the name of its scene (or --scene SCENE)"))
    rows = [m for every in found.modes.values() for m in every]
    if any(m.frequency_sd is None for m in rows) and form.frequency_sd_Hz is None:
        questions.append(
            Question("the campaign", "frequency_sd_Hz", "how sure the frequencies of its modes are, one standard deviation in Hz (a line's width at most)")
        )
    return questions


def check_tests(found: Read, files: Sequence[Path]) -> None:
    """`BadInput` for files that make no test, whatever is answered: there is nothing to ask of them."""
    if not found.tests:
        raise BadInput(f"{listed(f.name for f in files)}: no FRF, time record or mode in {'it' if len(files) == 1 else 'them'}; geometry, spectra or coherence alone are no campaign")


def spoken(found: Read, files: Sequence[Path]) -> list[str]:
    """The open questions as sentences."""
    return [words_of(q, {"files": [f.name for f in files], "tests": found.tests}) for q in found.questions]


def unanswered(sentences: Sequence[str], tail: str) -> Unanswered:
    """What is open, and in the `tail` where it is answered."""
    return Unanswered(f"{len(sentences)} thing{'s are' if len(sentences) > 1 else ' is'} not told by the files:", sentences, tail)


def campaign_of(found: Read, form: MappingForm, scene: Spindle | None, files: Sequence[Path], mapping: Path | None) -> tuple[Campaign, list[str]]:
    """The campaign of all files, and what was done to them. Raises `Unanswered` with all that is open, `BadInput` for FRFs that no structure has."""
    check_tests(found, files)
    if found.questions:
        raise unanswered(spoken(found, files), f"answer them in {mapping}" if mapping else "--mapping NEW.toml writes a form to answer them in")
    settings = {c.file: settings_of(form, c.file) for c in found.contents}
    notes = list(found.notes)
    placed = {t: [p for c in curves if (p := _placed(c, form, found.points, settings[c.file])) is not None] for t, curves in found.curves.items()}
    _check_left_out(found, form, settings, mapping)
    said = [p.quantity for every in placed.values() for p in every]
    quantity: str = form.quantity or (max(said, key=said.count) if said else "mobility")
    tests = tuple(_test(t, told_of(form, t), found, placed.get(t, []), quantity, form, notes) for t in found.tests)
    used = {n for t in tests if t.frf for n in (*t.frf.response_nodes, *t.frf.reference_nodes)} | {n for t in tests for n in t.shape_nodes}
    points = tuple(p for node, p in sorted(found.points.items()) if node in used)
    title = form.title or f"imported from {listed((f.name for f in files), 3)}"
    note = "\n".join(x for x in (form.note, *notes) if x)
    spindle = form.spindle or (scene.name if scene else "")
    return Campaign(title, spindle, quantity, points, tests, None, note), notes


def _names(curve: Curve, response: int | str, reference: int | str) -> set[str]:
    """What `leave_out` may call a curve between two nodes."""
    return {f"H({r},{q})" for r in (response, curve.response.label) for q in (reference, curve.reference.label)}


def _check_left_out(found: Read, form: MappingForm, settings: dict[Path, FileForm], mapping: Path | None) -> None:
    """`BadInput` for what `leave_out` names and no file holds; sets of UFF files are left out as they are read."""
    curves = [c for every in found.curves.values() for c in every if not c.magnitude_only]
    ends = [[(place(e, form, found.points) or (e.label,))[0] for e in (c.response, c.reference)] for c in curves]
    known = {n for c, (r, q) in zip(curves, ends, strict=True) for n in _names(c, r, q)}
    for own in settings.values():
        for name in own.leave_out:
            if not name.startswith("set ") and name.replace(" ", "") not in known:
                raise BadInput(f"{mapping}: files: leave_out: {name!r} is no FRF of the files; there are {listed(sorted(known), 6)}")


def _placed(curve: Curve, form: MappingForm, points: dict[int, Point], settings: FileForm) -> Placed | None:
    """A complex curve between points; None for a magnitude, which makes modes, and for what the mapping leaves out."""
    if curve.magnitude_only:
        return None
    (response, a), (reference, b) = (place(e, form, points) or (0, 1) for e in (curve.response, curve.reference))
    told = scaled(curve, settings)
    assert not isinstance(told, str)
    if _names(curve, response, reference) & {n.replace(" ", "") for n in settings.leave_out}:
        return None
    return Placed(curve, response, reference, told[0], told[1] * a * b)


def _test(id_: str, told: TestForm, found: Read, placed: list[Placed], quantity: str, form: MappingForm, notes: list[str]) -> Test:
    assert told.temperature_C is not None
    assert told.speed_rpm is not None
    speed = told.speed_rpm * RPM
    frf = None
    if placed:
        frf, more = frf_of(id_, placed, quantity, form.band_Hz, speed, told.averages)
        notes += more
        if not any(r in frf.reference_nodes for r in frf.response_nodes):
            notes.append(f"test {id_}: no response at a hammer point: signs and directions of its FRFs cannot be checked")
    lines = list(found.modes.get(id_, []))
    sizes = [c for c in found.curves.get(id_, []) if c.magnitude_only]
    if sizes:
        peaks, more = from_peaks(sizes, speed)
        files = listed(dict.fromkeys(c.file.name for c in sizes), 3)
        notes += [*more, f"{files}: magnitudes without phase: {len(peaks)} peaks become modes of unknown kind, no FRF is kept"]
        lines += peaks
        if not peaks and frf is None:
            raise BadInput(f"{files}: magnitudes without phase, and no peak in them that a mode explains; a table of modes by hand can be imported")
    rows, more = rows_of(id_, lines, form, found.points)
    notes += more
    soak = None if told.soak_time_min is None else told.soak_time_min * MINUTE
    decay = told.window_decay_1_per_s + found.window.get(id_, 0.0)
    before = told.pretrigger_s or found.pretrigger.get(id_, 0.0)
    return Test(
        id_, told.temperature_C, speed, told.hammer_level_N, soak, told.repeat, told.conditions, frf, rows, decay, pretrigger=before
    )
