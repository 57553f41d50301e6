"""The scene with some of its keys and effect parameters changed: one point of a sweep."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput, instead
from thermospindle.model.files.formats import SCENE
from thermospindle.model.machine import Addition, Spindle
from thermospindle.model.scene.fields import read_file
from thermospindle.model.scene.reading import build, formed
from thermospindle.sim.effects import checked, resolved
from thermospindle.sim.effects.effect import Effect, fitted_to, refusal
from thermospindle.sim.study.form import Study

EFFECTS = "effects"
NAMED = ("materials", "ball_rows", "roller_rows", "bearings", "sets")  # tables of tables, by names that the scene gives
Varied = Sequence[tuple[str, tuple[Any, ...]]]


def combination(vary: Varied, index: int) -> dict[str, Any]:
    """The values of combination `index` of all varied keys, the last of them moving fastest."""
    chosen = {}
    for key, values in reversed(vary):
        index, at = divmod(index, len(values))
        chosen[key] = values[at]
    return {key: chosen[key] for key, _ in vary}


def variant(raw: Mapping[str, Any], file: Path, catalogue: Sequence[Effect], chosen: Mapping[str, Any]) -> Spindle:
    """The spindle of the parsed scene `raw` with keys and effect parameters at chosen values, checked as any scene is.

    A key is dotted as in the scene file, entries of a list of tables by name or node: `bearing_pair.preload_N`,
    `structure.joints.base.lateral_N_per_m`; `effects.NAME.PARAMETER` is one of an effect, which the scene takes in where it has it not,
    its other parameters typical.
    """
    of_effects: dict[str, dict[str, float]] = {}
    for key, value in chosen.items():
        if _of_effect(key):
            _, name, parameter = key.split(".")
            of_effects.setdefault(name, {})[parameter] = value
    spindle = build(_changed(raw, _of_scene(chosen)), file)
    return _with_effects(spindle, of_effects, catalogue)


def with_values(spindle: Spindle, catalogue: Sequence[Effect], values: Mapping[str, Any]) -> Spindle:
    """A spindle that was read from a file, with other values of its keys and of effects'
    parameters, all together; `BadInput` for what its file could not say."""
    assert spindle.file is not None
    raw, file = read_file(SCENE, spindle.file), spindle.file
    chosen = {str(key): _plain(value) for key, value in values.items()}

    def found(of: Mapping[str, Any]) -> Spindle:
        for key, value in of.items():
            if _of_effect(key):
                _check_effect(spindle, key.split("."), [value], catalogue)
        return variant(raw, file, catalogue, of)

    def refused(of: Mapping[str, Any]) -> BadInput | None:
        try:
            found(of)
        except BadInput as error:
            return error
        return None

    try:
        return found(chosen)
    except BadInput as error:
        alone = next((key for key in chosen if not refused({k: v for k, v in chosen.items() if k != key})), None)  # without which all is well
        raise BadInput(f"values{'' if alone is None else f'[{alone!r}]'}: {error}") from None


def _of_effect(key: str) -> bool:
    """Whether a dotted key is of an effect's parameter, and none of the scene."""
    return key.split(".")[0] == EFFECTS


def _of_scene(chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Of chosen values those of the scene's own keys."""
    return {key: value for key, value in chosen.items() if not _of_effect(key)}


def _plain(value: Any) -> Any:
    """A value as a file would have it: NumPy's numbers and arrays as Python's."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return {k: _plain(v) for k, v in value.items()} if isinstance(value, Mapping) else value


def check(study: Study, raw: Mapping[str, Any], file: Path, spindle: Spindle, catalogue: Sequence[Effect]) -> None:
    """Refuse (`BadInput`) keys that are none of the scene, and values that its form or an effect
    does not allow, by themselves or beside the others' first or last ones.

    Values that only together give no spindle are rows of the study with their error.
    """
    others = [_of_scene({key: values[at] for key, values in study.vary}) for at in (0, -1)]
    for key, values in study.vary:
        try:
            if _of_effect(key):
                _check_effect(spindle, key.split("."), values, catalogue)
            else:
                for value in values:
                    _check_value(raw, file, key, value, others)
        except BadInput as error:
            raise BadInput(f"{study.file}: vary.{key!r}: {error}") from None


def _check_effect(spindle: Spindle, parts: list[str], values: Sequence[Any], catalogue: Sequence[Effect]) -> None:
    if len(parts) != 3:
        raise BadInput("a parameter of an effect is named as in effects.bond_softening.compliance_hot")
    known = {e.name: e for e in catalogue}
    if parts[1] not in known:
        raise BadInput(f"no effect is called {parts[1]!r}; {instead(parts[1], known)}")
    effect = fitted_to(known[parts[1]], spindle)
    if why := refusal(effect, spindle):
        raise BadInput(f"effect {effect.name}: {why}")
    for value in values:
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise BadInput(f"{value!r} is no number")
        checked(effect, {parts[2]: value})


def _check_value(raw: Mapping[str, Any], file: Path, key: str, value: Any, others: Sequence[Mapping[str, Any]]) -> None:
    """`BadInput` where a value fits the form neither by itself nor with any of the `others`; what is wrong with it by itself is told."""
    refused = None
    for beside in ({}, *others):
        try:
            formed(_changed(raw, {**beside, key: value}), file)
            return
        except BadInput as error:
            refused = refused or error
    if refused:
        raise refused


def _changed(raw: Mapping[str, Any], chosen: Mapping[str, Any]) -> dict[str, Any]:
    """The parsed scene with keys at chosen values."""
    changed = copy.deepcopy(dict(raw))
    for key, value in chosen.items():
        *table, last = key.split(".")
        _table(changed, table, key)[last] = value
    return changed


def _table(raw: dict[str, Any], parts: Sequence[str], key: str) -> dict[str, Any]:
    """The table that a dotted key lies in; tables that a scene leaves to their defaults are made."""
    here: Any = raw
    for depth, part in enumerate(parts):
        if isinstance(here, list):
            called = {str(e[k]): e for e in here if isinstance(e, dict) for k in ("name", "node") if k in e}
            if part not in called:
                raise BadInput(f"{'.'.join(parts[: depth + 1])} is not in the scene; {instead(part, called)}")
            here = called[part]
        elif isinstance(here, dict):
            if depth == 1 and parts[0] in NAMED and part not in here:
                raise BadInput(f"{parts[0]}.{part} is not in the scene; {instead(part, here)}")
            here = here.setdefault(part, {"origin": "assumed"} if depth == 0 else {})  # every number of a scene has an origin
        else:
            raise BadInput(f"{'.'.join(parts[:depth])} is no table of the scene")
    if not isinstance(here, dict):
        raise BadInput(f"{key} names no single value; entries of a list go by their name")
    return here


def _with_effects(spindle: Spindle, of_effects: Mapping[str, Mapping[str, float]], catalogue: Sequence[Effect]) -> Spindle:
    known = {e.name: e for e in catalogue}
    additions = {a.effect: a for a in spindle.effects}
    for name, values in of_effects.items():
        before = additions[name].values if name in additions else fitted_to(known[name], spindle).typical()
        additions[name] = Addition(effect=name, values={**before, **values})
    return resolved(replace(spindle, effects=tuple(additions.values())), catalogue)
