"""What all verbs share: the answer, the scene with its effects, the output folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.model.drawing.measuring import FAINTEST
from thermospindle.model.errors import BadInput
from thermospindle.model.files.stiffness_table import STEPS
from thermospindle.model.machine import Spindle
from thermospindle.report.folder import check_folder, mark, whole_folder
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.effects.known import equipped


@dataclass(frozen=True)
class Answer:
    """What a verb found: `values` for a script, with a list `warnings` of sentences, and `show`,
    which prints the same for a person; what it does `then`, when that has been printed."""

    values: dict[str, Any]
    show: Callable[[Console], None]
    then: Callable[[], None] = lambda: None


def answered(
    values: Mapping[str, Any],
    show: Callable[[Console], None],
    out: Path | None,
    asked: Mapping[str, Any],
    write: Callable[[Path, dict[str, Any]], None] = lambda folder, values: None,
    warnings: Sequence[str] = (),
) -> Answer:
    """The answer with its warnings; where `out` is given, the folder that `write` fills, marked with what was `asked`."""
    answer = {**values, "warnings": list(dict.fromkeys(warnings))}
    if out is not None:
        with whole_folder(Path(out)) as folder:
            write(folder, answer)
            mark(folder, asked, answer)
    return Answer(answer, show)


def check_out(out: Path | None) -> None:
    """`BadInput`, before anything is worked out for it, where no folder `out` can be written."""
    if out is not None:
        check_folder(Path(out))


def with_effects(scene: Path, effect_files: Sequence[Path]) -> tuple[Spindle, tuple[Effect, ...]]:
    """The spindle of a scene with its effects found, a user's own among them; and every effect there is."""
    from thermospindle.model.scene.reading import load  # the forms of scenes take their time to load: not where none is read

    return equipped(load(scene), effect_files)


def temperatures_or_range(temperatures: Sequence[float] | None, spindle: Spindle, steps: int = STEPS) -> list[float]:
    """The temperatures (C) asked for; where none are, so many over the range of the scene."""
    if temperatures is None:
        return np.linspace(*spindle.temperatures, steps).tolist()
    asked = list(temperatures)
    for t in asked:
        if asked.count(t) > 1:
            raise BadInput(f"--temperatures: {t:g} stands twice; each is allowed once")
    return asked


def temperature_or_reference(temperature: float | None, spindle: Spindle) -> float:
    """The temperature (C) asked for, or the reference temperature of the scene."""
    return spindle.reference_temperature if temperature is None else temperature


def with_hammer(spindle: Spindle, hits: int | None, level: float | None) -> Spindle:
    """The spindle with another number of hits and another peak force (N) of its hammer test, where given."""
    if level is not None and not level >= FAINTEST:
        raise BadInput(f"--level {level:g}: the hammer's peak force must be positive, {FAINTEST:g} N or more")
    changes = {key: value for key, value in (("hits", hits), ("level", level)) if value is not None}
    return replace(spindle, hammer=replace(spindle.hammer, **changes))  # type: ignore[arg-type]


def write_json(name: str, more: Callable[[Path], None] = lambda folder: None) -> Callable[[Path, dict[str, Any]], None]:
    """What fills an output folder with the answer as the file `name`, and with what `more` writes."""

    def write(folder: Path, values: dict[str, Any]) -> None:
        (folder / name).write_text(json.dumps(values, indent=1), encoding="utf-8")
        more(folder)

    return write
