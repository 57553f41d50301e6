"""A new scene: an old one with more effects, their values typical, fitted by a diagnosis, or set by hand.

From a diagnosis come the build tolerances too that were fitted beside those effects: the scene's `build` table. Temperature errors and
channel gains belong to the tests they were fitted to and not to the spindle, so they stay behind; `compare` has them in its errors.
"""

from __future__ import annotations

import json
import math
import shutil
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from thermospindle.diagnosis.forward.nuisance import BUILD, GAIN, TEMPERATURE
from thermospindle.diagnosis.inference.hypothesis import DEPARTS
from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import DIAGNOSIS, migrated
from thermospindle.model.machine import Spindle
from thermospindle.model.scene.reading import content_hash, load, scene_path
from thermospindle.sim.campaign.form import toml
from thermospindle.sim.effects import CATALOGUE, by_name, checked, resolved
from thermospindle.sim.effects.effect import Effect, called, fitted_to, refusal
from thermospindle.sim.effects.own import OwnEffect

OF_TEST, OF_CHANNEL = "temperature of ", "gain of channel "  # not the spindle's own, in answers of before rows told their `kind`


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


@dataclass(frozen=True)
class Offered:
    """A candidate: its effects, their parameters, and those of which the data have another law than they assume."""

    effects: tuple[str, ...]
    parameters: Mapping[str, Any]
    lawless: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Answer:
    """What `add` takes of an answer of `diagnose --json`: candidates, the tolerances fitted beside `best` (effects, or where none is named what drifts), and the
    elements of which a law can be `drafted`."""

    candidates: tuple[Offered, ...]
    best: tuple[str, ...]  # empty: nothing was taken for true, and the tolerances are those fitted without any
    build: dict[str, float]
    tests: tuple[str, ...]
    scene_hash: str | None
    drafted: frozenset[str] = frozenset()


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
    effects = [fitted_to(by_name(name, catalogue), old) for name in dict.fromkeys(names)]
    for effect in effects:
        if why := refusal(effect, old):
            raise BadInput(f"{file}: effect {effect.name}: {why}")
        if any(a.effect == effect.name for a in old.effects):
            raise BadInput(f"{file}: effects.{effect.name}: is there already; change its values there, or add to the scene it was added to")
    fitted: dict[str, dict[str, float]] = {}
    build: dict[str, float] = {}
    note = ""
    answer = read_answer(diagnosis) if diagnosis else None
    if answer and diagnosis:
        offered = offered_for(effects, answer, diagnosis)
        fitted = fitted_values(effects, offered, diagnosis)
        build, note = _build_of(effects, answer, diagnosis, old, file)
        note = "\n".join([*([note] if note else []), *(_lawless(e, answer, diagnosis) for e in effects if e.name in offered.lawless)])
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
    """Write the scene of `target` with effects at given `values` and its toleranced parameters off by `deviations` from what they are there.

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
    try:
        resolved(load(folder), catalogue)
    except BadInput as error:
        raise BadInput(str(error).replace(str(folder), str(out))) from None


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
        found[owners[0]][name] = value
    return found


def _effect_table(effect: Effect, row: Added) -> str:
    head = {"name": effect.name, "origin": row.origin, "source": row.source}
    lines = [f"# {effect.title}", "[[effects]]", *(f"{k} = {toml(v)}" for k, v in head.items()), "", "[effects.values]"]
    for p in effect.parameters:
        kind = row.called.get(p.name) or ("" if p.unit == "1" else p.unit)
        lines.append(f"{p.name} = {toml(float(row.values[p.name]))}  # {kind + ': ' if kind else ''}{p.meaning}")
    return "\n".join(lines) + "\n"


# ---------------------------------------------------------------- what a diagnosis found


def read_answer(file: Path) -> Answer:
    """The file of an answer of `spindle diagnose --json`; `BadInput` for another."""
    if not file.is_file():
        raise BadInput(f"--from {file}: cannot be read: no such file")
    try:
        raw = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadInput(f"--from {file}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError):
        raise BadInput(f"--from {file}: {NO_ANSWER}") from None
    return answer_of(migrated(DIAGNOSIS, raw, f"--from {file}"), f"--from {file}")


NO_ANSWER = "is not an answer of spindle diagnose --json, with candidates of effects and parameters"


def _kind(name: str) -> str:
    """Of a fitted tolerance, in an answer of before rows told it."""
    return TEMPERATURE if name.startswith(OF_TEST) else GAIN if name.startswith(OF_CHANNEL) else BUILD


def answer_of(raw: Any, where: str) -> Answer:
    """The same from the object of such an answer; `where` it is from is what a refusal begins with."""
    try:
        candidates = tuple(_offered(c) for c in raw["candidates"])
        drafted = frozenset(_text(p["element"]) for p in raw.get("where", ()))
        tolerances = {name: _finite(row["value"]) for name, row in raw.get("tolerances", {}).items()}
        kinds = {name: row.get("kind", _kind(name)) for name, row in raw.get("tolerances", {}).items()}
        best = candidates[0].effects if candidates and raw.get("effects") else tuple(map(_text, raw.get("tolerances_beside", ())))
        scene_hash = raw.get("scene_hash")
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError):
        raise BadInput(f"{where}: {NO_ANSWER}") from None
    build = {name: float(f"{v:.8g}") for name, v in tolerances.items() if kinds[name] == BUILD}
    tests = tuple(str(raw["tolerances"][name].get("test", name.removeprefix(OF_TEST))) for name in tolerances if kinds[name] == TEMPERATURE)
    return Answer(candidates, best, build, tests, scene_hash, drafted)


def _offered(raw: Any) -> Offered:
    departing = {_text(name) for name, departure in raw.get("departure_from_law", {}).items() if _finite(departure) >= DEPARTS}
    return Offered(tuple(map(_text, raw["effects"])), dict(raw["parameters"]), frozenset(departing | set(map(_text, raw.get("own_law", ())))))


def _lawless(effect: Effect, answer: Answer, diagnosis: Path) -> str:
    name, size = effect.name, effect.parameters[0].name
    drafts = f": spindle draft {diagnosis} --element {name} writes an effect with theirs" if name in answer.drafted else ""
    return f"the data have another law than {name} assumes, and {size} is its mean over the tests{drafts}"


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _finite(value: Any) -> float:
    """A JSON number as float; TypeError, ValueError or OverflowError for anything else, NaN and infinity among them."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise TypeError
    if not math.isfinite(number := float(value)):
        raise ValueError
    return number


def offered_for(effects: Sequence[Effect], answer: Answer, file: Path) -> Offered:
    """The first candidate that has all these effects, or what drafted ones are of; of elements that drift the answer has no other values than a draft."""
    names = [_of(e, answer) for e in effects]
    found = next((c for c in answer.candidates if set(names) <= set(c.effects)), None)
    if found is None and all(e.drifts for e in effects) and set(names) <= set(answer.best):
        return Offered(tuple(names), {})
    if found is None:
        offered = dict.fromkeys(" + ".join(c.effects) if len(names) > 1 else e for c in answer.candidates for e in c.effects)
        raise BadInput(
            f"--from {file}: no candidate has effect{'s' * (len(names) > 1)} {' and '.join(names)}; its candidates are "
            f"{', '.join(offered) or 'none'}"
        )
    return found


def _of(effect: Effect, answer: Answer) -> str:
    """What an answer calls an effect: of one that was drafted the element, or effect, whose drift it is."""
    return effect.drifts if effect.drifts and not any(effect.name in c.effects for c in answer.candidates) else effect.name


def fitted_values(effects: Sequence[Effect], offered: Offered, file: Path) -> dict[str, dict[str, float]]:
    """Values of effects in a candidate, from `<effect>.<parameter>` or, alone, `<parameter>`; those that were drafted have theirs."""
    parameters = offered.parameters
    found: dict[str, dict[str, float]] = {}
    for effect in effects:
        found[effect.name] = {}
        if effect.drifts and effect.name not in offered.effects:
            continue
        for name in effect.neutral():
            row = parameters.get(f"{effect.name}.{name}", parameters.get(name) if len(effects) == 1 else None)
            if row is not None:
                value = row.get("value") if isinstance(row, dict) else row
                try:
                    found[effect.name][name] = _finite(value)
                except (TypeError, ValueError, OverflowError):
                    raise BadInput(f"--from {file}: {effect.name}.{name}.value = {str(value)[:80]!r}: must be a finite number") from None
        if not found[effect.name]:
            raise BadInput(f"--from {file}: its candidate has no value for {effect.name}; its parameters are {', '.join(effect.neutral())}")
    return found


def _build_of(effects: Sequence[Effect], answer: Answer, diagnosis: Path, old: Spindle, file: Path) -> tuple[dict[str, float], str]:
    """Deviations of the new scene, none where it keeps those it has, and a word on them.

    A diagnosis of a scene that has deviations already found more of them, relative to those; one of the scene before (the second
    effect of a pair, added after the first) found the same.
    """
    names = {_of(e, answer) for e in effects}
    if not answer.build:
        return {}, f"{diagnosis} holds no tolerances: the build is the drawing's"
    if not names <= set(answer.best):
        beside = " + ".join(answer.best) or "no effect"
        return {}, f"the tolerances of {diagnosis} were fitted beside {beside} and do not go with {' + '.join(sorted(names))}: left out"
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
