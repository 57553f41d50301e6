"""Answers of `spindle diagnose --json`, as they are read again; and what `add` and the workbench
take of one: its candidates with their values, and the tolerances fitted beside the best."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from thermospindle.diagnosis.inference.hypothesis import DEPARTS
from thermospindle.diagnosis.parameters.nuisance import BUILD, GAIN, TEMPERATURE
from thermospindle.model.errors import BadInput, absent
from thermospindle.model.files.formats import DIAGNOSIS, migrated
from thermospindle.sim.effects.effect import Effect

OF_TEST, OF_CHANNEL = "temperature of ", "gain of channel "  # not the spindle's own, in answers of before rows told their `kind`


@dataclass(frozen=True)
class Offered:
    """A candidate: its effects, their parameters, those of which the data have another law than
    they assume, and its probability (1 in an answer without any)."""

    effects: tuple[str, ...]
    parameters: Mapping[str, Any]
    lawless: frozenset[str] = frozenset()
    probability: float = 1.0


@dataclass(frozen=True)
class Answer:
    """What `add` takes of an answer of `diagnose --json`: candidates, the tolerances fitted beside `best`
    (effects, or where none is named what drifts), and the elements of which a law can be `drafted`."""

    candidates: tuple[Offered, ...]
    best: tuple[str, ...]  # empty: nothing was taken for true, and the tolerances are those fitted without any
    build: dict[str, float]
    tests: tuple[str, ...]
    scene_hash: str | None
    drafted: frozenset[str] = frozenset()


@contextmanager
def told_by(where: str, what: str) -> Iterator[None]:
    """Within it, whatever is not as an answer has it ends in a `BadInput`: `where` it is from is
    what that begins with, and `what` is looked for there what it ends with."""
    try:
        yield
    except BadInput:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise BadInput(f"{where}: is not an answer of spindle diagnose --json, with {what}") from None


CANDIDATES = "candidates of effects and parameters"


def read_raw(file: Path, where: str, what: str = CANDIDATES) -> Any:
    """The file of an answer as it was written, in today's format; `BadInput` as `told_by` has it."""
    if not file.is_file():
        raise BadInput(f"{where}: cannot be read: {absent(file)}")
    with told_by(where, what):
        try:
            raw = json.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            raise BadInput(f"{where}: cannot be read: {error.strerror}") from None
        return migrated(DIAGNOSIS, raw, where)


def read_answer(file: Path) -> Answer:
    """The file of an answer that is told by `--from`; `BadInput` for another."""
    return answer_of(read_raw(file, f"--from {file}"), f"--from {file}")


def _kind(name: str) -> str:
    """Of a fitted tolerance, in an answer of before rows told it."""
    return TEMPERATURE if name.startswith(OF_TEST) else GAIN if name.startswith(OF_CHANNEL) else BUILD


def answer_of(raw: Any, where: str) -> Answer:
    """The same from the object of such an answer; `where` it is from is what a refusal begins with."""
    with told_by(where, CANDIDATES):
        candidates = tuple(_offered(c) for c in raw["candidates"])
        drafted = frozenset(_text(p["element"]) for p in raw.get("where", ()))
        tolerances = {name: _finite(row["value"]) for name, row in raw.get("tolerances", {}).items()}
        built = {name: _finite(row.get("in_scene", row["value"])) for name, row in raw.get("tolerances", {}).items()}
        kinds = {name: row.get("kind", _kind(name)) for name, row in raw.get("tolerances", {}).items()}
        best = candidates[0].effects if candidates and raw.get("effects") else tuple(map(_text, raw.get("tolerances_beside", ())))
        scene_hash = raw.get("scene_hash")
    build = {name: float(f"{v:.8g}") for name, v in built.items() if kinds[name] == BUILD}
    tests = tuple(str(raw["tolerances"][name].get("test", name.removeprefix(OF_TEST))) for name in tolerances if kinds[name] == TEMPERATURE)
    return Answer(candidates, best, build, tests, scene_hash, drafted)


def _offered(raw: Any) -> Offered:
    departing = {_text(name) for name, departure in raw.get("departure_from_law", {}).items() if _finite(departure) >= DEPARTS}
    return Offered(tuple(map(_text, raw["effects"])), dict(raw["parameters"]), frozenset(departing | set(map(_text, raw.get("own_law", ())))), _finite(raw.get("probability", 1.0)))


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
    """The candidate of these effects, or what drafted ones are of, and no others, else the first that has them all:
    beside another effect one has another size; of elements that drift the answer has no other values than a draft."""
    names = [called_in(answer, e) for e in effects]
    having = [c for c in answer.candidates if set(names) <= set(c.effects)]
    found = next((c for c in having if set(names) == set(c.effects)), having[0] if having else None)
    if found is None and all(e.drifts for e in effects) and set(names) <= set(answer.best):
        return Offered(tuple(names), {})
    if found is None:
        offered = dict.fromkeys(" + ".join(c.effects) if len(names) > 1 else e for c in answer.candidates for e in c.effects)
        raise BadInput(
            f"--from {file}: no candidate has effect{'s' * (len(names) > 1)} {' and '.join(names)}; its candidates are "
            f"{', '.join(offered) or 'none'}" + ("; nor has it tolerances that were fitted beside what drifts: without --from the effect is added with the values of its own file" if all(e.drifts for e in effects) else "")
        )
    return found


def called_in(answer: Answer, effect: Effect) -> str:
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
