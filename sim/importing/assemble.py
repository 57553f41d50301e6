"""From files and a mapping to a campaign, or to everything that is still open, at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.units import MINUTE, RPM
from thermospindle.sim.campaign.campaign import Campaign, Test, on_parts
from thermospindle.sim.importing.asked import open_conditions, open_ends, open_parts, open_units, scaled, spoken, together, unanswered
from thermospindle.sim.importing.checks import check_columns, check_content, check_ends, check_files, check_left_out, check_tests, names_of
from thermospindle.sim.importing.files.reading import content
from thermospindle.sim.importing.frfs.coherence import with_coherence
from thermospindle.sim.importing.frfs.one_test import Placed, frf_of
from thermospindle.sim.importing.frfs.peaks import from_peaks
from thermospindle.sim.importing.mapping import FileForm, MappingForm, TestForm, settings_of, told_of
from thermospindle.sim.importing.measured import Content, Curve, End, ModeLine, Question, Read, listed
from thermospindle.sim.importing.modes import rows_of
from thermospindle.sim.importing.names import plain
from thermospindle.sim.importing.places import place, points_of, unplaced
from thermospindle.sim.importing.records.grouped import grouped
from thermospindle.sim.importing.records.spectra import of_records, open_channels

SHORT = 1e-4  # s, to which the length that all hits have is told


def read(
    files: Sequence[Path], form: MappingForm, scene: Spindle | None, mapping: Path | None = None, progress: Callable[[str], None] = lambda done: None
) -> Read:
    """Read every file as the mapping (`form`, of the file `mapping`) says; what it does not say is
    among the questions. Raises `BadInput` for damaged files."""
    check_files(files, form, mapping)
    settings = {f: settings_of(form, f) for f in files}
    contents = []
    for f in files:
        contents.append(content(f, settings[f]))
        progress(f.name)
    check_columns(form, contents, mapping)
    check_ends(form, contents, settings, mapping)
    points, questions = points_of(form, scene)
    notes = [n for c in contents for n in c.notes]
    questions += [q for c in contents for q in (*c.questions, *open_channels(c.file.name, c.motions))]
    curves: dict[str, list[Curve]] = {}
    modes: dict[str, list[ModeLine]] = {}
    window: dict[str, float] = {}
    pretrigger: dict[str, float] = {}
    coherence: dict[str, list[Curve]] = {}
    for c in contents:
        own = settings[c.file].test or plain(c.file.stem)
        check_content(c)
        if c.curves or c.motions or (c.questions and not c.modes):
            curves.setdefault(own, []).extend(_turned(x, settings[c.file]) for x in c.curves)
        coherence.setdefault(own, []).extend(c.coherence)
        for m in c.modes:
            modes.setdefault(m.test or own, []).append(m)
    for test, found_of in coherence.items():
        with_, said = with_coherence(curves.get(test, []), found_of)
        if with_:
            curves[test] = with_
        notes += said
    groups, open_records = grouped(contents, settings)
    questions += open_records
    measured = scene.hammer.band if scene is not None and form.band_Hz is None and form.records.band_Hz is None else None
    if groups and scene is not None and measured:
        notes.append(f"time records: kept from {measured[0]:g} to {measured[1]:g} Hz, where the hammer test of {scene.name} is; band_Hz under [records] keeps another band")
    lengths: dict[str, list[float]] = {}
    uneven: list[str] = []  # tests whose hits are not of one length
    for (test, _), made in of_records(groups, form.records, measured).items():
        notes += made.notes
        questions += made.questions
        curves.setdefault(test, []).extend(made.curves)
        if made.curves:
            pretrigger[test] = made.pretrigger
            lengths.setdefault(test, []).append(made.length)
        if made.window_decay > 0 and abs(window.setdefault(test, made.window_decay) / made.window_decay - 1) > 1e-9:
            uneven.append(test)
    uneven += [test for test, of_it in lengths.items() if max(of_it) > (1 + 1e-9) * min(of_it)]
    longest = np.floor(min((length for of_it in lengths.values() for length in of_it), default=0.0) / SHORT) * SHORT
    questions += [Question(f"test {t}", "hit_length_s", f"one length for all hits, so that one window, and the same lines, fit all its FRFs; at most {longest:g}, which all of them have") for t in dict.fromkeys(uneven)]
    questions += open_parts(curves)
    own_curves = [(x.file.name, x) for every in curves.values() for x in every if not x.magnitude_only]
    told = _ends(own_curves, contents)
    questions += open_ends(told)
    ends = tuple((name, end) for name, _, end in told if place(end, form, points) is None)
    questions += unplaced(ends, points, scene)
    questions += open_units(own_curves, settings)
    found = Read(tuple(contents), curves, modes, window, pretrigger, ends, points, tuple(notes), ())
    questions += open_conditions(found, form, scene, mapping)
    return Read(tuple(contents), curves, modes, window, pretrigger, ends, points, tuple(notes), together(questions))


def _ends(curves: Sequence[tuple[str, Curve]], contents: Sequence[Content]) -> list[tuple[str, str, End]]:
    """Every end of a curve or channel: its file, whether it is "response" or "reference", and what the file says of it."""
    told = [(name, key, getattr(x, key)) for name, x in curves for key in ("response", "reference")]
    return told + [(c.file.name, "reference" if m.force else "response", m.end) for c in contents for m in c.motions]  # asked at once, whatever else is open of them


def _turned(curve: Curve, settings: FileForm) -> Curve:
    return replace(curve, value=curve.value.conj()) if settings.conjugate else curve


def campaign_of(found: Read, form: MappingForm, scene: Spindle | None, files: Sequence[Path], mapping: Path | None) -> tuple[Campaign, list[str]]:
    """The campaign of all files, and what was done to them. Raises `Unanswered` with all that is
    open, `BadInput` for FRFs that no structure has."""
    check_tests(found, files)
    if found.questions:
        raise unanswered(spoken(found, files), f"answer them in {mapping}" if mapping else "--mapping NEW.toml writes a form to answer them in")
    settings = {c.file: settings_of(form, c.file) for c in found.contents}
    notes = list(found.notes)
    placed = {t: [p for c in curves if (p := _placed(c, form, found.points, settings[c.file])) is not None] for t, curves in found.curves.items()}
    check_left_out(found, form, settings, mapping)
    said = [p.quantity for every in placed.values() for p in every]
    quantity: str = form.quantity or (max(said, key=said.count) if said else "mobility")
    tests = tuple(_test(t, told_of(form, t), found, placed.get(t, []), quantity, form, notes) for t in found.tests)
    used = {n for t in tests if t.frf for n in (*t.frf.response_nodes, *t.frf.reference_nodes)} | {n for t in tests for n in t.shape_nodes}
    points = tuple(p for node, p in sorted(found.points.items()) if node in used)
    title = form.title or f"imported from {listed((f.name for f in files), 3)}"
    note = "\n".join(x for x in (form.note, *notes) if x)
    spindle = form.spindle or (scene.name if scene else "")
    return Campaign(title, spindle, quantity, on_parts(scene, points) if scene else points, tests, None, note), notes


def _placed(curve: Curve, form: MappingForm, points: dict[int, Point], settings: FileForm) -> Placed | None:
    """A complex curve between points; None for a magnitude, which makes modes, and for what the mapping leaves out."""
    if curve.magnitude_only:
        return None
    (response, a), (reference, b) = (place(e, form, points) or (0, 1) for e in (curve.response, curve.reference))
    told = scaled(curve, settings)
    assert not isinstance(told, str)
    if names_of(curve, response, reference) & {n.replace(" ", "") for n in settings.leave_out}:
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
    before = found.pretrigger.get(id_) if told.pretrigger_s is None else told.pretrigger_s
    return Test(
        id_, told.temperature_C, speed, told.hammer_level_N, soak, told.repeat, told.conditions, frf, rows, decay, pretrigger=before
    )
