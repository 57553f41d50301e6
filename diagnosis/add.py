"""A new scene: an old one with one more effect, its values typical, fitted by a diagnosis, or set by hand."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from model.scene import BadInput, load, scene_path
from sim.campaign_file import toml
from sim.effect import Effect
from sim.effects import by_name, checked


@dataclass(frozen=True)
class Added:
    """The effect a scene was given; `origin` and `source` are what its table in the new file says."""

    effect: str
    values: dict[str, float]
    origin: str
    source: str

    def words(self) -> str:
        units = {p.name: p.unit for p in by_name(self.effect).parameters}
        said = ", ".join(f"{name} = {value:g} {units[name]}".removesuffix(" 1") for name, value in self.values.items())
        return f"{self.effect} added ({self.origin}): {said}"


def check_place(target: Path, out: Path) -> None:
    """Refuse (`BadInput`) a new scene that would be, hold or lie inside the folder of the old one."""
    file = scene_path(target)
    here, there = file.parent.resolve(), out.resolve()
    if here == there or here in there.parents or there in here.parents:
        raise BadInput(f"--out {out}: the new scene may neither be, hold nor lie inside the folder of {file}")


def new_scene(target: Path, name: str, by_hand: Sequence[tuple[str, float]], diagnosis: Path | None, folder: Path, out: Path) -> Added:
    """Write the scene of `target` with effect `name` into `folder`, which will stand at `out`; `BadInput` for what cannot be.

    Values are typical, unless fitted in the file `diagnosis`, unless set `by_hand`. The new scene is loaded before it is accepted.
    """
    effect, file = by_name(name), scene_path(target)
    if any(a.effect == effect.name for a in load(file).effects):
        raise BadInput(f"{file}: effects.{effect.name}: is there already; change its values there, or add to the scene it was added to")
    fitted = fitted_values(effect, diagnosis) if diagnosis else {}
    values = checked(effect, effect.typical() | fitted | dict(by_hand))
    told = {"typical of the catalogue": [n for n in values if n not in fitted], f"fitted, from {diagnosis}": list(fitted)}
    hand = [name for name, _ in by_hand]
    told = {what: [n for n in names if n not in hand] for what, names in told.items()} | {"set by hand": list(dict.fromkeys(hand))}
    source = "; ".join(f"{what}: {', '.join(names)}" for what, names in told.items() if names)
    origin = "calibrated" if fitted else "assumed"
    text = file.read_text(encoding="utf-8").rstrip("\n") + "\n\n" + _effect_table(effect, values, origin, source)
    (folder / "spindle.toml").write_text(text, encoding="utf-8")
    for part in ("measured", "published"):
        if (file.parent / part).is_dir():
            shutil.copytree(file.parent / part, folder / part)
    try:
        load(folder)
    except BadInput as error:
        raise BadInput(str(error).replace(str(folder), str(out))) from None
    return Added(effect.name, values, origin, source)


def _effect_table(effect: Effect, values: dict[str, float], origin: str, source: str) -> str:
    head = {"name": effect.name, "origin": origin, "source": source}
    lines = [f"# {effect.title}", "[[effects]]", *(f"{k} = {toml(v)}" for k, v in head.items()), "", "[effects.values]"]
    lines += [f"{p.name} = {toml(float(values[p.name]))}  # {'' if p.unit == '1' else p.unit + ': '}{p.meaning}" for p in effect.parameters]
    return "\n".join(lines) + "\n"


def fitted_values(effect: Effect, file: Path) -> dict[str, float]:
    """Values of an effect in the first candidate of a diagnosis that has it, from `<effect>.<parameter>` or `<parameter>`."""
    try:
        diagnosis = json.loads(file.read_text(encoding="utf-8"))
        candidates = [(list(c["effects"]), dict(c["parameters"])) for c in diagnosis["candidates"]]
    except OSError as error:
        raise BadInput(f"--from {file}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise BadInput(f"--from {file}: is not an answer of spindle diagnose --json, with candidates of effects and parameters") from None
    parameters = next((p for effects, p in candidates if effect.name in effects), None)
    if parameters is None:
        named = ", ".join(dict.fromkeys(str(e) for effects, _ in candidates for e in effects)) or "none"
        raise BadInput(f"--from {file}: no candidate has effect {effect.name}; its candidates are {named}")
    found = {}
    for name in effect.neutral():
        row = parameters.get(f"{effect.name}.{name}", parameters.get(name))
        if row is not None:
            value = row.get("value") if isinstance(row, dict) else row
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise BadInput(f"--from {file}: {effect.name}.{name}.value = {value!r}: must be a number")
            found[name] = float(value)
    if not found:
        raise BadInput(f"--from {file}: its candidate has no value for {effect.name}; its parameters are {', '.join(effect.neutral())}")
    return found
