"""Tables of a file that people write: number types, units, laws over temperature, and what is said of the first thing wrong."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from model import machine as m

MM, RPM = 1e-3, 2 * np.pi / 60

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1)]


def _rising(span: tuple[float, float]) -> tuple[float, float]:
    if not span[0] < span[1]:
        raise ValueError("the first number must be smaller than the second")
    return span


Span = Annotated[tuple[Finite, Finite], AfterValidator(_rising)]
Radii = Annotated[tuple[NotNegative, Finite], AfterValidator(_rising)]


class Table(BaseModel):
    """A table of the file: unknown keys are refused; `origin`, `source` and `origins` say where its numbers come from."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    origin: Literal["printed", "assumed", "calibrated"] | None = None
    source: str = ""
    origins: dict[str, Literal["printed", "assumed", "calibrated"]] = {}


class LawTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    temperature_C: list[Finite] = Field(min_length=1)
    value: list[Positive] = Field(min_length=1)

    @model_validator(mode="after")
    def _one_value_a_temperature(self) -> LawTable:
        if len(self.temperature_C) != len(self.value) or np.any(np.diff(self.temperature_C) <= 0):
            raise ValueError("temperature_C must rise and have as many entries as value")
        return self

    def law(self, unit: float) -> m.Law:
        return m.Law(tuple(self.temperature_C), tuple(unit * v for v in self.value))


def _constant(value: Any) -> Any:
    return value if isinstance(value, dict | LawTable) else {"temperature_C": [0.0], "value": [value]}


LawValue = Annotated[LawTable, BeforeValidator(_constant)]
"""A number, or a table of `temperature_C` and `value`."""


def first_error(where: str | Path, raw: Any, form: type[BaseModel], error: ValidationError) -> str:
    """One sentence for the first thing pydantic found wrong in a file of `form`: a misspelt key before the one then missing.

    Entries of a list of tables go by their id, node or name.
    """
    problem = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
    location = problem["loc"]
    words, value = [], raw
    for part in location:
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            value = None
        entry = value if isinstance(part, int) and isinstance(value, Mapping) else {}
        words.append(str(next((entry[key] for key in ("id", "node", "name") if key in entry), part)))
    key = ".".join(words)
    match problem["type"]:
        case "extra_forbidden":
            return f"{where}: {key}: unknown key; allowed here: {', '.join(_allowed_keys(form, location[:-1]))}"
        case "missing":
            return f"{where}: {key}: missing, and has no default"
        case _:
            message = problem["msg"].removeprefix("Value error, ")
            given = "" if isinstance(problem["input"], Mapping) else f" = {problem['input']!r}"
            told = f"{key}{given}: {message[0].lower()}{message[1:]}".removeprefix(": ")
            return f"{where}: {told}"


def _allowed_keys(form: Any, path: tuple[str | int, ...]) -> list[str]:
    """Keys of the table at `path`, read off the models."""
    table = form
    for part in path:
        if isinstance(part, int):
            continue
        fields = getattr(table, "model_fields", None)
        table = _table_in(fields[part].annotation if fields and part in fields else get_args(table)[1])
    return list(table.model_fields)


def _table_in(annotation: Any) -> Any:
    """The pydantic model inside an annotation (a list's or union's member), or the annotation itself."""
    if get_origin(annotation) is list:
        return _table_in(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType, Annotated):
        inner = [_table_in(a) for a in get_args(annotation)]
        return next((a for a in inner if isinstance(a, type) and issubclass(a, BaseModel)), annotation)
    return annotation
