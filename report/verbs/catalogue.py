"""The verbs `effects` and `add`: the catalogue of physical effects, and a scene with one more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from thermospindle.model.errors import BadInput
from thermospindle.report.folder import mark, whole_folder
from thermospindle.report.text.effects import show_effect, show_effects, summary
from thermospindle.report.verbs.answer import Answer, answered, with_effects, write_json
from thermospindle.sim.effects import by_name
from thermospindle.sim.effects.effect import called, refusal
from thermospindle.sim.effects.known import catalogue


def effects(
    name: str | None = None, scene: Path | None = None, effect_files: Sequence[Path] = (), out: Path | None = None
) -> Answer:
    """The catalogue of effects, or one of them explained; with a `scene`, in sizes typical for it, and which cannot be in it and why."""
    asked = dict(locals()) | {"verb": "effects"}
    known, refused = catalogue(effect_files), dict[str, str]()
    if scene is not None:
        spindle, known = with_effects(scene, effect_files)
        refused = {e.name: why for e in known if (why := refusal(e, spindle))}
    if name is None:
        values: dict[str, Any] = {"effects": [summary(e) for e in known]} | ({} if scene is None else {"refused": refused})
        return answered(values, lambda console: show_effects(console, known, refused), out, asked, write_json("effects.json"))
    if Path(name).is_dir() and name not in {e.name for e in known}:
        raise BadInput(f"effect {name!r} is unknown; of the scene in that folder: spindle effects --scene {name}")
    effect = by_name(name, known)
    values = {k: getattr(effect, k) for k in ("name", "title", "equation", "sees", "valid")}
    values |= {"resembles": list(effect.resembles), "parameters": [asdict(p) for p in effect.parameters]}
    why_not, here = refused.get(effect.name, ""), dict[str, dict[str, str]]()
    if scene is not None:
        here = {} if why_not else {p.name: {f"{c:g}": called(p, c, spindle) or "" for c in p.choices} for p in effect.parameters if p.counts}
        values |= {"refused": why_not or None, "called": here}
    return answered(values, lambda console: show_effect(console, effect, why_not, here), out, asked, write_json("effect.json"))


def add(
    scene: Path,
    effect: Sequence[str],
    set: Sequence[tuple[str, float]] = (),
    diagnosis: Path | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """A new scene `out` with more effects: typical values, those of a `diagnosis`, or those `set` by name."""
    from thermospindle.diagnosis.add import check_place, new_scene

    asked = dict(locals()) | {"verb": "add"}
    if out is None:
        raise BadInput("--out: add needs the folder of the new scene")
    check_place(scene, out)
    _, known = with_effects(scene, effect_files)
    with whole_folder(out, scene=True) as folder:
        added = new_scene(scene, effect, set, diagnosis, folder, out, known)
        values = {"scene": str(out), **asdict(added), "warnings": []}
        mark(folder, asked, values)

    def show(console: Console) -> None:
        console.print(f"{out}: {added.words()}", highlight=False, markup=False)

    return Answer(values, show)
