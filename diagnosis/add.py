"""A new scene: an old one with more effects, their values typical, fitted by a diagnosis, or set by hand.

From a diagnosis come the build tolerances too that were fitted beside those effects: the scene's `build` table. Temperature errors and
channel gains belong to the tests they were fitted to and not to the spindle, so they stay behind; `compare` has them in its errors.
"""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.scene.reading import content_hash, load, scene_path
from thermospindle.sim.campaign.form import toml
from thermospindle.sim.effects import CATALOGUE, by_name, checked, resolved
from thermospindle.sim.effects.effect import Effect, called, fitted_to, refusal
from thermospindle.sim.effects.own import OwnEffect

if TYPE_CHECKING:
    from thermospindle.diagnosis.answer import Answer, Offered

REJECTED = 1e-3  # probability, below which an answer takes an explanation for false


@dataclass(frozen=True)
class Added:
    """An effect the scene was given; `origin` and `source` are what its table in the new file says."""

    effect: str
    values: dict[str, float]
    units: dict[str, str]
    origin: str
    source: str
    called: dict[str, str] = field(default_factory=dict)  # of values that number a bearing or a set

    def words(self) -> str:
        said = ", ".join(f"{name} = {self.called.get(name) or f'{value:g} {self.units[name]}'}".removesuffix(" 1") for name, value in self.values.items())
        return f"{self.effect} added ({self.origin}): {said}"


@dataclass(frozen=True)
class NewScene:
    """What was written: the effects, the relative build deviations (empty: the drawing's own), and a word on these."""

    added: tuple[Added, ...]
    build: dict[str, float]
    note: str

    def words(self) -> str:
        return "\n".join([*(a.words() for a in self.added), *([self.note] if self.note else [])])


def check_place(target: Path, out: Path) -> None:
    """Refuse (`BadInput`) a new scene that would be, hold or lie inside the folder of the old one."""
    file = scene_path(target)
    here, there = file.parent.resolve(), out.resolve()
    if here == there or here in there.parents or there in here.parents:
        raise BadInput(f"--out {out}: the new scene may neither be, hold nor lie inside the folder of {file}")


def new_scene(
    target: Path,
    names: Sequence[str],
    by_hand: Sequence[tuple[str, float]],
    diagnosis: Path | None,
    folder: Path,
    out: Path,
    catalogue: Sequence[Effect] = CATALOGUE,
) -> NewScene:
    """Write the scene of `target` with the effects `names` into `folder`, which will stand at `out`; `BadInput` for what cannot be.

    Values are typical, unless fitted in the file `diagnosis`, unless set `by_hand`. The new scene is loaded before it is accepted.
    """
    file = scene_path(target)
    old = load(file)
    if twice := [name for name in names if names.count(name) > 1]:
        raise BadInput(f"{twice[0]}: is named twice; an effect is added once")
    effects = [fitted_to(by_name(name, catalogue), old) for name in names]
    for effect in effects:
        if why := refusal(effect, old):
            raise BadInput(f"{file}: effect {effect.name}: {why}")
        if any(a.effect == effect.name for a in old.effects):
            raise BadInput(f"{file}: effects.{effect.name}: is there already; change its values there, or add to the scene it was added to")
    fitted: dict[str, dict[str, float]] = {}
    build: dict[str, float] = {}
    note = ""
    answer = None
    if diagnosis:
        from thermospindle.diagnosis.answer import fitted_values, offered_for, read_answer  # what diagnoses takes its time to load

        answer = read_answer(diagnosis)
        offered = offered_for(effects, answer, diagnosis)
        fitted = fitted_values(effects, offered, diagnosis)
        build, note = _build_of(effects, answer, offered, diagnosis, old, file)
        note = "\n".join([*_rejected(offered, answer, diagnosis), *_with_others(effects, answer, offered, diagnosis), *([note] if note else []), *(_lawless(e, answer, diagnosis) for e in effects if e.name in offered.lawless)])
    hand = _by_effect(effects, by_hand)
    added = tuple(_added(e, old, fitted.get(e.name, {}), hand[e.name], diagnosis) for e in effects)
    _write(file, effects, added, build, answer.tests if answer else (), f"fitted, from {diagnosis}", folder, out, catalogue)
    return NewScene(added, build, note)


def scene_with(
    target: Path,
    values: Mapping[str, Mapping[str, float]],
    deviations: Mapping[str, float],
    tests: Sequence[str],
    source: str,
    folder: Path,
    out: Path,
    catalogue: Sequence[Effect] = CATALOGUE,
) -> NewScene:
    """Write the scene of `target` with effects at given `values` and its toleranced parameters off
    by `deviations` from what they are there.

    `tests` are those it was fitted to, and `source` says by whom; the rest is as in `new_scene`.
    """
    file = scene_path(target)
    old = load(file)
    effects = [fitted_to(by_name(name, catalogue), old) for name in values]
    added = tuple(_row(e, old, checked(e, values[e.name]), "calibrated", source) for e in effects)
    build = _further(old, deviations) if deviations else {}
    _write(file, effects, added, build, tests, source, folder, out, catalogue)
    return NewScene(added, build, f"{len(build)} build tolerances" if build else "")


def _write(
    file: Path,
    effects: Sequence[Effect],
    added: Sequence[Added],
    build: Mapping[str, float],
    tests: Sequence[str],
    source: str,
    folder: Path,
    out: Path,
    catalogue: Sequence[Effect],
) -> None:
    """The text of the old scene with its additions, into `folder`, and loaded once."""
    text = file.read_text(encoding="utf-8")
    if build:
        text = _without_build(text).rstrip("\n") + "\n\n" + _build_table(build, tests, source)
    for effect, row in zip(effects, added, strict=True):
        text = text.rstrip("\n") + "\n\n" + _effect_table(effect, row)
    (folder / "spindle.toml").write_text(text, encoding="utf-8")
    for part in ("measured", "published"):
        if (file.parent / part).is_dir():
            shutil.copytree(file.parent / part, folder / part)
    for name, table in _tables(text):
        if ".." in table.parts:
            raise BadInput(f"{file}: bearings.{name}.numbers.table = {str(table)!r}: lies outside the scene's folder; allowed is one within it, which a new scene gets a copy of, or an absolute path")
        if not table.is_absolute():
            (folder / table).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file.parent / table, folder / table)
    try:
        resolved(load(folder), catalogue)
    except BadInput as error:
        raise BadInput(str(error).replace(str(folder), str(out))) from None


def _tables(text: str) -> list[tuple[str, Path]]:
    """The tables of stiffness that a scene's text names, by bearing."""
    bearings = tomllib.loads(text).get("bearings", {})
    return [(name, Path(b["numbers"]["table"])) for name, b in bearings.items() if "table" in b.get("numbers", {})]


def _added(effect: Effect, spindle: Spindle, fitted: Mapping[str, float], by_hand: Mapping[str, float], diagnosis: Path | None) -> Added:
    values = checked(effect, effect.typical() | dict(fitted) | dict(by_hand))
    origins = {
        "as drafted" if effect.drifts else "typical of the catalogue": [n for n in values if n not in fitted and n not in by_hand],
        f"fitted, from {diagnosis}": [n for n in fitted if n not in by_hand],
        "set by hand": list(by_hand),
    }
    source = "; ".join(f"{what}: {', '.join(names)}" for what, names in origins.items() if names)
    return _row(effect, spindle, values, "calibrated" if fitted or effect.drifts else "assumed", source)


def _row(effect: Effect, spindle: Spindle, values: dict[str, float], origin: str, source: str) -> Added:
    units = {p.name: p.unit for p in effect.parameters}
    names = {p.name: word for p in effect.parameters if (word := called(p, values[p.name], spindle))}
    return Added(effect.name, values, units, origin, _of_own(effect, source), names)


def _of_own(effect: Effect, source: str) -> str:
    """The source of values, and where the effect is from that is not of the catalogue."""
    return f"{source}; the effect is not of the catalogue but of {effect.where}" if isinstance(effect, OwnEffect) else source


def _by_effect(effects: Sequence[Effect], by_hand: Sequence[tuple[str, float]]) -> dict[str, dict[str, float]]:
    """Values set by hand for each effect, from `<parameter>` or `<effect>.<parameter>`."""
    found: dict[str, dict[str, float]] = {e.name: {} for e in effects}
    for key, value in by_hand:
        effect, dot, name = key.rpartition(".")
        owners = [e.name for e in effects if e.name == effect] if dot else [e.name for e in effects if name in e.neutral()]
        if not owners and len(effects) == 1 and not dot:
            owners = [effects[0].name]  # `checked` says what is allowed
        if len(owners) != 1:
            allowed = ", ".join(f"{e.name}.{p}" for e in effects for p in e.neutral())
            raise BadInput(f"--set {key}={value:g}: names {'no' if not owners else 'more than one'} parameter; allowed are {allowed}")
        if name in found[owners[0]]:
            raise BadInput(f"--set {key}={value:g}: {name} of {owners[0]} is set twice; each may be once")
        found[owners[0]][name] = value
    return found


def _effect_table(effect: Effect, row: Added) -> str:
    head = {"name": effect.name, "origin": row.origin, "source": row.source}
    lines = [f"# {effect.title}", "[[effects]]", *(f"{k} = {toml(v)}" for k, v in head.items()), "", "[effects.values]"]
    for p in effect.parameters:
        kind = row.called.get(p.name) or ("" if p.unit == "1" else p.unit)
        lines.append(f"{p.name} = {toml(float(row.values[p.name]))}  # {kind + ': ' if kind else ''}{p.meaning}")
    return "\n".join(lines) + "\n"


def _lawless(effect: Effect, answer: Answer, diagnosis: Path) -> str:
    name, size = effect.name, effect.parameters[0].name
    drafts = f": spindle draft {diagnosis} --element {name} writes an effect with theirs" if name in answer.drafted else ""
    return f"the data have another law than {name} assumes, and {size} is one for all tests with the law assumed{drafts}"


def _rejected(offered: Offered, answer: Answer, diagnosis: Path) -> list[str]:
    """A sentence where the answer takes the explanation that values are of for false."""
    if offered.probability >= REJECTED or set(offered.effects) <= set(answer.best):
        return []
    return [f"{diagnosis} gives {' + '.join(offered.effects)} a probability of {offered.probability:.1g}: by these data it is not what is missing, and its values explain nothing"]


def _with_others(effects: Sequence[Effect], answer: Answer, offered: Offered, diagnosis: Path) -> list[str]:
    """A sentence where values are those of effects together with others, or where others together with them are more probable."""
    from thermospindle.diagnosis.answer import called_in

    names = {called_in(answer, e) for e in effects}
    what = " + ".join(n for n in offered.effects if n in names)
    if names < set(offered.effects):
        return [f"no explanation of {diagnosis} is {what} alone: values are those of {' + '.join(offered.effects)}, the most probable that has {'it' if len(names) == 1 else 'them'}"]
    first = next((c for c in answer.candidates if names <= set(c.effects)), offered)
    return [f"values are those of {what} alone; {' + '.join(first.effects)}, more probable in {diagnosis}, has others, for which add all of them at once"] if first is not offered else []


def _build_of(effects: Sequence[Effect], answer: Answer, offered: Offered, diagnosis: Path, old: Spindle, file: Path) -> tuple[dict[str, float], str]:
    """Deviations of the new scene, none where it keeps those it has, and a word on them.

    A diagnosis of a scene that has deviations already found more of them, relative to those; one of the scene before (the second
    effect of a pair, added after the first) found the same.
    """
    from thermospindle.diagnosis.answer import called_in

    names = {called_in(answer, e) for e in effects}
    if not answer.build:
        return {}, f"{diagnosis} holds no tolerances: the build is the drawing's"
    if not names <= set(answer.best) or (offered.parameters and set(offered.effects) != set(answer.best)):
        beside = " + ".join(answer.best) or "no effect"
        return {}, f"the tolerances of {diagnosis} were fitted beside {beside} and do not go with {' + '.join(sorted(names))}{' alone' * (names < set(answer.best))}: left out"
    missing = set(answer.best) - names - {a.effect for a in old.effects}
    note = f"{len(answer.build)} build tolerances as fitted beside {' + '.join(answer.best)}"
    if missing:
        note += f", of which {' + '.join(sorted(missing))} is not in the scene yet"
    if old.build is None:
        return dict(answer.build), note
    if old.build.deviations == answer.build:
        return {}, note
    if answer.scene_hash != content_hash(old):
        raise BadInput(f"{file}: build: holds the tolerances of another diagnosis than {diagnosis}; add to the scene that was diagnosed")
    return _further(old, answer.build), note


def _further(old: Spindle, deviations: Mapping[str, float]) -> dict[str, float]:
    """Deviations from the drawing of a spindle that is off by `deviations` from the old one."""
    before = old.build.deviations if old.build else {}
    return {n: (1 + before.get(n, 0.0)) * (1 + deviations.get(n, 0.0)) - 1 for n in {**before, **deviations}}


def _build_table(build: Mapping[str, float], tests: Sequence[str], source: str) -> str:
    lines = ["# How the built spindle differs from its drawing: relative deviations, already fitted", "[build]", 'origin = "calibrated"']
    lines += [f"source = {toml(source)}", f"tests = {toml(list(tests))}", "", "[build.deviations]"]
    return "\n".join([*lines, *(f"{toml(name)} = {toml(float(value))}" for name, value in build.items())]) + "\n"


def _without_build(text: str) -> str:
    """The text of a scene file without the table that `_build_table` wrote; `BadInput` for one written otherwise."""
    if "build" not in tomllib.loads(text):
        return text
    lines = text.splitlines()
    start = next((i for i, line in enumerate(lines) if line.strip() == "[build]"), None)
    stop = next((i for i, line in enumerate(lines) if line.strip() == "[build.deviations]"), None)
    if start is None or stop is None or start > stop:
        raise BadInput("build: is not written as the tables [build] and [build.deviations]; write it so, or take it out")
    while stop + 1 < len(lines) and not lines[stop + 1].lstrip().startswith(("[", "#")):
        stop += 1
    if start and lines[start - 1].startswith("# How the built spindle"):
        start -= 1
    return "\n".join([*lines[:start], *lines[stop + 1 :]]) + "\n"
