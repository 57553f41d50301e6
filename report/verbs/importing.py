"""The verb `import`: a campaign from a laboratory's own files, or one list of what they do not tell."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from thermospindle.model.errors import BadInput
from thermospindle.model.files.whole import whole
from thermospindle.model.machine import Spindle
from thermospindle.model.units import RPM, in_rpm
from thermospindle.report.progress import progress_bar
from thermospindle.report.verbs.answer import Answer, with_effects
from thermospindle.sim.campaign.campaign import Campaign, write_campaign
from thermospindle.sim.importing.asked import spoken, unanswered
from thermospindle.sim.importing.assemble import campaign_of, read
from thermospindle.sim.importing.checks import check_tests
from thermospindle.sim.importing.mapping import MappingForm, read_mapping
from thermospindle.sim.importing.measured import listed
from thermospindle.sim.importing.places import misfits, shared
from thermospindle.sim.importing.template import OF_RECORDS, template


def bring(
    files: Sequence[Path],
    mapping: Path | None = None,
    scene: Path | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """The campaign folder `out` from measured files; a `mapping` that is not there is written as a form to fill in.

    Raises `Unanswered` with everything that the files and the mapping leave open.
    """
    files = [file for given in files for file in _named(Path(given))]
    fresh = mapping is not None and not Path(mapping).exists()
    if out is None and not fresh:
        raise BadInput("--out: import needs the campaign folder to write, or --mapping with a new file")
    if out is not None and Path(out).exists() and (not Path(out).is_dir() or any(Path(out).iterdir())):
        raise BadInput(f"--out {out}: is not empty; a campaign is written to a new or empty folder")
    spindle = with_effects(scene, effect_files)[0] if scene is not None else None
    form = read_mapping(None if fresh else mapping)
    form, renamed = _for_scene(form, mapping, spindle, scene)
    steps = len(files) * (2 if fresh else 1)
    mapping = None if mapping is None else Path(mapping)
    with progress_bar(steps) as done:
        found = read(files, form, spindle, mapping, done)
        check_tests(found, files)
        if fresh and mapping is not None:
            _write_form(mapping, template(found, files, spindle))
            filled = read_mapping(mapping)
            again = read(files, filled, spindle, mapping, done)
            if of_records := tuple(q for q in again.questions if q.key in OF_RECORDS):  # what files that the form makes one test do not share
                _write_form(mapping, template(replace(found, questions=(*found.questions, *of_records)), files, spindle))
            left, proposed = spoken(again, files), _proposed(filled)
            if out is None:
                return _form_written(mapping, spoken(found, files), left, proposed)
            if left:
                raise unanswered(left, f"answer them in {mapping}, which is written")
            if found.questions:
                raise BadInput(f"{mapping} is written, and nothing is open in it: {'; '.join(proposed)}, read off the names of the files, to be checked in it; then the same command makes the campaign")
    campaign, notes = campaign_of(found, form, spindle, files, mapping)
    assert out is not None  # a fresh form has been returned
    write_campaign(campaign, Path(out))
    return _written(campaign, Path(out), notes, None if scene is None else Path(scene), [*renamed, *([] if spindle is None else _doubts(campaign, spindle))])


def _write_form(mapping: Path, text: str) -> None:
    with whole(mapping) as file:
        file.write_text(text, encoding="utf-8")


def _for_scene(form: MappingForm, mapping: Path | None, spindle: Spindle | None, scene: Path | None) -> tuple[MappingForm, list[str]]:
    """The mapping for the scene given; where it names another one, as a copy with another name, with a sentence
    that says so: points that it tells are the scene's, and nothing it names is another. Else `BadInput`."""
    if spindle is None or form.spindle in (None, spindle.name):
        return form, []
    if wrong := misfits(form, spindle):
        has = f"and of what the mapping names {spindle.name} has {listed(wrong, 3)}"
        raise BadInput(f"{mapping}: spindle = {form.spindle!r}: --scene {scene} is {spindle.name!r}, {has}; a campaign is of one scene, so change one of the two or leave it out")
    if not (same := shared(form, spindle)):
        raise BadInput(
            f"{mapping}: spindle = {form.spindle!r}: --scene {scene} is {spindle.name!r}, and no [[points]] of the mapping tells with node, body and position_mm that they are one machine; "
            "change one of the two names or leave it out"
        )
    nodes = f"node{'s' * (len(same) > 1)} {listed(same)} on the same bod{'ies' if len(same) > 1 else 'y'} in the same place{'s' * (len(same) > 1)}"
    said = f"{mapping}: spindle = {form.spindle!r}, and --scene {scene} is {spindle.name!r}, which has {nodes}: it is taken for that under another name"
    return form.model_copy(update={"spindle": spindle.name}), [said]


def _named(path: Path) -> list[Path]:
    """The files that a name means: itself, or those of a pattern that no shell has expanded."""
    if path.is_dir():
        raise BadInput(f"{path}: is a folder; name its files, as in {path}/*.csv")
    if path.exists() or not set("*?[") & set(path.name):
        return [path]
    found = sorted(path.parent.glob(path.name))
    if not found:
        raise BadInput(f"{path}: no file is called so")
    return found


def _proposed(form: MappingForm) -> list[str]:
    """What a fresh form answers from the names of files alone."""
    said = []
    for t in form.tests:
        of = [f.file for f in form.files if f.test == t.id]
        told = [f"{t.temperature_C:g} C" if t.temperature_C is not None else "", f"{t.speed_rpm:g} rpm" if t.speed_rpm is not None else ""]
        hit = [f"hit at {f.reference} in {f.file}" for f in form.files if f.test == t.id and f.reference is not None]
        if any(told) or len(of) > 1 or hit:
            said.append(f"{t.id}: {', '.join(x for x in (*told, f'{len(of)} files' if len(of) > 1 else '', *hit) if x)}")
    told = [f.test for f in form.files if f.test is not None]
    if len(told) > 2 and len(set(told)) == len(told) and all(t.temperature_C is None for t in form.tests):
        said.append(f"{len(told)} files, a test each: where hammer or sensor roved and they are one test, give them the same test")
    return said


def _form_written(mapping: Path, open_: list[str], left: list[str], proposed: list[str]) -> Answer:
    values: dict[str, Any] = {"mapping": str(mapping), "open": open_, "proposed": proposed, "warnings": []}

    def show(console: Console) -> None:
        count = f"{len(left)} answer{'s are' if len(left) != 1 else ' is'} open in it" if left else "nothing is open in it"
        console.print(f"{mapping} is written: {count}.", highlight=False)
        for k, item in enumerate(left, 1):
            console.print(f"  {k}. {item}", highlight=False)
        if proposed:
            console.print("Read off the names of the files, to be checked in it:", highlight=False)
            for item in proposed:
                console.print(f"  {item}", highlight=False)
        console.print("Then the same command with --out CAMPAIGN makes the campaign.", highlight=False)

    return Answer(values, show)


FAR, FASTER = 100.0, 5.0
"""K beyond the temperatures that a scene is meant for, and times its nominal speed, at which another unit is likelier than such a test."""
OUTSIDE = 2.0
"""The factor by which every mode of a table lies beyond the ends of the scene's hammer test where another unit is likelier."""


def _doubts(campaign: Campaign, spindle: Spindle) -> list[str]:
    """What fits the scene so badly that it may be in another unit: kelvin for C, kHz for Hz, Hz for
    rpm; and where nothing does, what the FRFs tell beside the scene's own."""
    from thermospindle.sim.campaign.beside import the_same  # as below
    from thermospindle.sim.campaign.likeness import likenesses

    low, high = spindle.temperatures[0], spindle.temperatures[-1]
    first, last = spindle.hammer.band
    elsewhere = f", and the hammer test of {spindle.name} is from {first:g} to {last:g} Hz: are they in another unit?"
    found = []
    for t in campaign.tests:
        if not low - FAR <= t.temperature <= high + FAR:
            found.append(f"test {t.id}: temperature_C = {t.temperature:g}, and {spindle.name} is meant for {low:g} to {high:g} C: is it in another unit?")
        if abs(t.speed) > FASTER * spindle.nominal_speed:
            found.append(f"test {t.id}: speed_rpm = {t.speed / RPM:g}, and {spindle.name} is meant for {spindle.nominal_speed / RPM:g} rpm: is it in another unit?")
        if t.frf is not None and (t.frf.frequency[-1] < first or t.frf.frequency[0] > last):
            found.append(f"test {t.id}: lines from {t.frf.frequency[0]:g} to {t.frf.frequency[-1]:g} Hz{elsewhere}")
        if t.modes and not any(first / OUTSIDE <= m.frequency <= OUTSIDE * last for m in t.modes):
            found.append(f"test {t.id}: {len(t.modes)} mode{'s' * (len(t.modes) > 1)} from {t.modes[0].frequency:g} to {t.modes[-1].frequency:g} Hz{elsewhere}")
    return [*the_same(campaign), *(found or likenesses(spindle, campaign))]


def _written(campaign: Campaign, out: Path, notes: list[str], scene: Path | None, doubts: list[str]) -> Answer:
    from thermospindle.sim.campaign.beside import left_out  # what computes a model takes its time to load, and a form needs none

    values: dict[str, Any] = {
        "campaign": str(out),
        "spindle": campaign.spindle,
        "quantity": campaign.quantity,
        "points": [{"node": p.node, "name": p.name} for p in campaign.points],
        "tests": [
            {
                "id": t.id,
                "temperature_C": t.temperature,
                "speed_rpm": in_rpm(t.speed),
                "responses": [] if t.frf is None else [*t.frf.response_nodes],
                "references": [] if t.frf is None else [*t.frf.reference_nodes],
                "lines": 0 if t.frf is None else len(t.frf.frequency),
                "band_Hz": None if t.frf is None else [float(f) for f in t.frf.frequency[[0, -1]]],
                "modes": len(t.modes),
            }
            for t in campaign.tests
        ],
        "notes": notes,
        "warnings": [*doubts, *left_out(replace(campaign, folder=out))],
    }

    def show(console: Console) -> None:
        count = len(campaign.tests)
        console.print(f"{out}: a campaign of {count} test{'s' * (count != 1)} for {campaign.spindle}, checked and read back.", highlight=False)
        for t in values["tests"]:
            frfs = f"{len(t['responses'])} x {len(t['references'])} FRFs of {t['lines']} lines, {t['band_Hz'][0]:g} to {t['band_Hz'][1]:g} Hz" if t["lines"] else ""
            modes = f"{t['modes']} modes" if t["modes"] else ""
            console.print(f"  {t['id']}: {t['temperature_C']:g} C, {t['speed_rpm']:g} rpm: {', '.join(x for x in (frfs, modes) if x)}", highlight=False)
        for note in _alike(notes):
            console.print(f"  {note}", highlight=False)
        console.print(f"Next: {shlex.join(['spindle', 'compare', str(scene or 'SCENE'), str(out)])}", highlight=False)

    return Answer(values, show)


def _alike(notes: Sequence[str]) -> list[str]:
    """Notes that say the same of one file, or test, and of another as one of them all."""
    whose: dict[str, list[str]] = {}
    for note in notes:
        who, _, what = note.partition(": ")
        whose.setdefault(what or note, []).append(who)
    return [f"{listed(who, 3)}: {what}" if who != [what] else what for what, who in whose.items()]
