"""The verbs `diagnose` and `draft`: which physics a scene lacks, and an effect of one's own from what drifts."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from thermospindle.diagnosis import verdict
from thermospindle.diagnosis.compare.before_after import without
from thermospindle.diagnosis.data.observe import observe
from thermospindle.diagnosis.draft.draft import draft as drafted
from thermospindle.diagnosis.prediction.outcomes import outcomes
from thermospindle.diagnosis.runout.lines import modal_tests
from thermospindle.diagnosis.runout.verdict import RunoutDiagnosis, diagnose_runout
from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import CURRENT, DIAGNOSIS, KEY
from thermospindle.model.files.whole import whole
from thermospindle.model.machine import Spindle
from thermospindle.model.scene.reading import content_hash
from thermospindle.report.progress import going_on, progress_bar
from thermospindle.report.text.diagnosis.answer import diagnosis_json
from thermospindle.report.text.diagnosis.words import show_diagnosis
from thermospindle.report.text.runout_diagnosis import runout_diagnosis_json, show_runout_diagnosis
from thermospindle.report.verbs.answer import Answer, answered, check_out, with_effects, write_json
from thermospindle.sim.campaign.beside import doubtful
from thermospindle.sim.campaign.campaign import Campaign, read_campaign
from thermospindle.sim.campaign.likeness import likenesses
from thermospindle.sim.effects import CATALOGUE
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.effects.own import effect_of


def diagnose(
    scene: Path,
    campaign: Path,
    held_out_tests: Sequence[str] = (),
    predictions: Path | None = None,
    verbose: bool = False,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Which physics the scene lacks to explain a campaign; `predictions` is an earlier diagnosis: did what it predicted come true?"""
    asked = dict(locals()) | {"verb": "diagnose"}
    check_out(out)
    if predictions:
        outcomes(predictions, ())  # refused, where it is none, before anything is worked out
    (spindle, catalogue), whole = with_effects(scene, effect_files), without(read_campaign(campaign), held_out_tests)
    turning = _of_runout(spindle, catalogue, whole, verbose)
    tests = modal_tests(whole)
    where = {KEY: CURRENT[DIAGNOSIS], "campaign": tests.title, "scene_hash": content_hash(spindle)}
    if turning and not tests.tests:
        told, show_runout, of_runout = turning

        def alone(folder: Path, answer: dict[str, Any]) -> None:
            write_json("diagnosis.json")(folder, answer)
            _write(None, answer, spindle, folder, of_runout, answer, name=whole.name)

        return answered(told | where, show_runout, out, asked, alone, doubtful(spindle, whole))
    with going_on(asked, spindle, whole), progress_bar([*[1.0] * len(tests.tests), *verdict.STEPS]) as progress:
        found = verdict.diagnose(spindle, tests, catalogue, progress)
    values = diagnosis_json(found) | where
    if predictions:
        values |= {"predictions": [asdict(o) for o in outcomes(predictions, observe(tests, spindle))]}
    if turning:
        values |= {"runout": turning[0]}

    def show(console: Console) -> None:
        show_diagnosis(console, values, verbose)
        if turning:
            turning[1](console)

    def write(folder: Path, answer: dict[str, Any]) -> None:
        write_json("diagnosis.json")(folder, answer)
        _write(found, answer, spindle, folder, *((turning[2], turning[0]) if turning else ()), name=whole.name)

    return answered(values, show, out, asked, write, [*doubtful(spindle, whole), *likenesses(spindle, whole), *_found(found)])


def _found(found: verdict.Diagnosis) -> list[str]:
    """Warnings: of effects that cannot be worked out; where records end early, and where in them they were hit was not told but found."""
    unable = [f"{name} is no explanation of test {why}" for name, why in found.unable.items()]
    for told, seen in zip(found.campaign.tests, found.search.model.tests, strict=True):
        if seen.test.pretrigger is not None and seen.test.pretrigger != told.pretrigger:
            return [
                *unable,
                f"records end before answers have died away; that they were hit {1e3 * seen.test.pretrigger:.3g} ms after their start, which no test tells (pretrigger_s), "
                "was found from these data"
            ]
    return unable


def _write(*what: Any, name: str) -> None:
    from thermospindle.report.page.diagnosis import write_diagnosis  # matplotlib takes its time to load

    write_diagnosis(*what, name=name)


def draft(diagnosis: Path, name: str | None = None, element: str | None = None, out: Path | None = None) -> Answer:
    """An effect file from what a diagnosis found to drift, the simplest law that fits it; `out` is the file to write."""
    if out is None:
        raise BadInput("--out: draft needs the effect file to write, as in --out my_effect.py")
    out = Path(out)
    if out.suffix != ".py":
        raise BadInput(f"--out {out}: is no Python file; an effect file ends in .py")
    if out.exists():
        raise BadInput(f"--out {out}: is there already; a draft overwrites nothing")
    called = name or out.stem
    if not called.isidentifier():
        raise BadInput(f"--name {called}: is no name of an effect; letters, digits and underscores are allowed")
    written = drafted(Path(diagnosis), called, element)
    with whole(out) as file:
        file.write_text(written.text, encoding="utf-8")
    effect = effect_of(out)
    warnings = [written.fits] if written.doubt else []
    if written.named and element is None:
        names = " and ".join(written.named)
        shipped = {effect.name for effect in CATALOGUE}
        files = "".join(f" --effect {one}.py" for one in written.named if one not in shipped)  # of the user's own, wherever it is
        adding = f"spindle add SCENE {' '.join(written.named)}{files} --from {shlex.quote(str(diagnosis))} --out NEW_SCENE"
        warnings.append(f"{diagnosis} names {names}, and nothing has to be drafted: {adding}; this draft is of {written.element}, which would have to drift instead")
    fitted = f" --from {shlex.quote(str(diagnosis))}" if written.with_build else ""
    values = {"effect": called, "file": str(out), "equation": effect.equation, "parameters": effect.typical(), "warnings": warnings}

    def show(console: Console) -> None:
        console.print(f"{out}: {effect.title}; {effect.equation}" + ("" if written.doubt else f"; {written.fits}"))
        console.print(f"Read it, edit it, then: spindle add SCENE {called} --effect {shlex.quote(str(out))}{fitted} --out NEW_SCENE")

    return Answer(values, show)


def _of_runout(
    spindle: Spindle, catalogue: tuple[Effect, ...], campaign: Campaign, verbose: bool
) -> tuple[dict[str, Any], Callable[[Console], None], RunoutDiagnosis] | None:
    """The diagnosis of the runout tests of a campaign as JSON, how it is told, and itself; None where it has none."""
    tests = sum(test.runout is not None for test in campaign.tests)
    if not tests:
        return None
    with progress_bar(tests + 3) as progress:
        found = diagnose_runout(spindle, campaign, catalogue, progress)
    values = runout_diagnosis_json(found, catalogue, spindle)
    return values, lambda console: show_runout_diagnosis(console, values, verbose), found
