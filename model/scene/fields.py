"""Tables of a file that people write: number types, units, laws over temperature, and what is said of the first thing wrong."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin
from unicodedata import category

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, Strict, ValidationError, model_validator

from thermospindle.model.errors import BadInput, absent
from thermospindle.model.files.formats import CURRENT, migrated
from thermospindle.model.material import Law

LARGEST, SMALLEST = 1e15, 1e-15  # of any number of a file: products of a few stay within what can be computed with


def _within_reach(value: float) -> float:
    if not (value == 0 or SMALLEST <= abs(value) <= LARGEST):
        raise ValueError(f"the size of a number must lie between {SMALLEST:g} and {LARGEST:g}")
    return value


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), AfterValidator(_within_reach)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(_within_reach)]
Finite = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_within_reach)]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Place = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
"""mm: a spindle fits into ten metres."""
Radius = Annotated[float, Field(ge=0, le=1e4, allow_inf_nan=False)]
"""mm."""
Temperature = Annotated[float, Field(gt=-273.15, le=5000, allow_inf_nan=False)]
"""C."""


def _one_line(name: str) -> str:
    if any(category(letter) in ("Cc", "Zl", "Zp") for letter in name):
        raise ValueError("a name stands on one line, without control characters")
    return name


OneLine = AfterValidator(_one_line)
"""MJCF and the lines of UFF files know no line breaks."""
Name = Annotated[str, Field(min_length=1, max_length=200), OneLine]


def _printed(title: str) -> str:
    _one_line(title.replace("\n", " "))
    return title


Title = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_printed)]
"""May have line breaks."""


def _rising(span: tuple[float, float]) -> tuple[float, float]:
    if not span[0] < span[1]:
        raise ValueError("the first number must be smaller than the second")
    return span


def _each_once(entries: list[Any]) -> list[Any]:
    for entry in entries:
        if entries.count(entry) > 1:
            raise ValueError(f"{entry!r} stands twice; each may stand once")
    return entries


Once = AfterValidator(_each_once)
"""Of a list in which nothing may stand twice."""


# tables are strict, so that a number in quotes is none; only a TOML array may stand for a tuple of numbers
Span = Annotated[tuple[Place, Place], Strict(False), AfterValidator(_rising)]
Radii = Annotated[tuple[Radius, Place], Strict(False), AfterValidator(_rising)]
Band = Annotated[tuple[NotNegative, Positive], Strict(False), AfterValidator(_rising)]
"""Hz."""
Accel = Annotated[float, Field(ge=-20.0, le=20.0)]  # m/s2, to twice the earth's: a larger one is of another unit
TemperatureSpan = Annotated[tuple[Temperature, Temperature], Strict(False), AfterValidator(_rising)]
Both = Annotated[tuple[NotNegative, NotNegative], Strict(False)]
Pair = Annotated[tuple[Finite, Finite], Strict(False)]
Gravity = Annotated[tuple[Accel, Accel], Strict(False)]
Position = Annotated[tuple[Place, Place, Place], Strict(False)]
TwoNames = Annotated[tuple[str, str], Strict(False)]


class Table(BaseModel):
    """A table of the file: unknown keys are refused; `origin`, `source` and `origins` say where its numbers come from."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    origin: Literal["printed", "assumed", "calibrated"] | None = None
    source: str = ""
    origins: dict[str, Literal["printed", "assumed", "calibrated"]] = {}


class LawTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
    temperature_C: list[Temperature] = Field(min_length=1, max_length=1000)
    value: list[Positive] = Field(min_length=1, max_length=1000)

    @model_validator(mode="after")
    def _one_value_a_temperature(self) -> LawTable:
        if len(self.temperature_C) != len(self.value) or np.any(np.diff(self.temperature_C) <= 0):
            raise ValueError("temperature_C must rise and have as many entries as value")
        return self

    def law(self, unit: float, key: str) -> Law:
        return Law(tuple(self.temperature_C), tuple(unit * v for v in self.value), key)


def _constant(value: Any) -> Any:
    return value if isinstance(value, dict | LawTable) else {"temperature_C": [0.0], "value": [value]}


def one_damping(damping_ratio: float | None, loss_factor: float | None) -> None:
    """Refuses a shaft or joint that tells none or both of its two dampings."""
    if (damping_ratio is None) == (loss_factor is None):
        raise ValueError(
            f"damping_ratio {'and loss_factor are both told' if loss_factor is not None else 'is missing'}; one of damping_ratio (viscous, at structure.damping_frequency_Hz) "
            "and loss_factor (the same at all frequencies) is allowed"
        )


def format_of(kind: str) -> Any:
    """The type of the key `format` of a kind of file, once it is migrated."""
    return Annotated[int, Field(ge=1, le=CURRENT[kind])]


LawValue = Annotated[LawTable, BeforeValidator(_constant)]
"""A number, or a table of `temperature_C` and `value`."""


def values_within(low: float, high: float) -> AfterValidator:
    """Every value of a law between two numbers, in the unit of its key."""

    def check(law: LawTable) -> LawTable:
        for value in law.value:
            if not low <= value <= high:
                raise ValueError(f"{value:g}: must lie between {low:g} and {high:g}")
        return law

    return AfterValidator(check)


def named(file: Path, key: str, name: str, kind: str, owner: str) -> Path:
    """The file of a `kind` that a key of an `owner`'s file names, from its folder. Raises `BadInput` where there is none."""
    there = file.parent / name
    if not there.is_file():  # a pipe would be waited for, a device has no end
        raise BadInput(f"{file}: {key} = {name!r}: {there}: {absent(there)}; allowed is a {kind}, told from the folder of the {owner}")
    return there


def read_toml(file: Path) -> dict[str, Any]:
    """The tables of a TOML file; `BadInput` for what is none, or is written so that it cannot be read."""
    if not file.is_file():  # a pipe would be waited for
        raise BadInput(f"{file}: {absent(file)}")
    text = ""
    try:
        text = file.read_text(encoding="utf-8-sig")  # a byte order mark is what some editors begin a file with
        tables = tomllib.loads(text)
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise BadInput(f"{file}: line {line} has a byte that is no UTF-8 ({error.object[error.start]:#04x}), as of another encoding: save the file as UTF-8") from None
    except RecursionError:
        raise BadInput(f"{file}: its tables are nested too deep to be read") from None
    except ValueError as error:  # of TOML, of UTF-8, of numbers with thousands of digits
        raise BadInput(f"{file}: not a TOML file: {error}{_by_comma(text, str(error))}{_twice(text, str(error))}") from None
    if not tables:
        raise BadInput(f"{file}: has no keys: it is empty, or all of it is comment")
    return tables


def _by_comma(text: str, error: str) -> str:
    """What to do about a decimal comma, where one stands at the place that an error of the parser tells; empty where none does."""
    if (told := re.search(r"at line (\d+), column (\d+)", error)) is None:
        return ""
    line, column = (int(number) - 1 for number in told.groups())
    written = next((w for w in re.finditer(r"[-+]?\d+,\d+", text.split("\n")[line]) if w.start() <= column <= w.end()), None)
    return f": {written[0]} has a decimal comma; write {written[0].replace(',', '.')}" if written else ""


def _twice(text: str, error: str) -> str:
    """The key, or table, that stands twice, where an error of the parser tells of one, at the end of its value; empty where none does."""
    told = re.search(r"(?:overwrite|twice|already|[Dd]uplicate).*at (?:line (\d+)|end of document)", error)
    if told is None:
        return ""
    before = text.rstrip().split("\n")[: int(told[1]) if told[1] else None]
    at = next((line.strip() for line in reversed(before) if re.match(r"\s*(?:\[|[\w.\"'-]+\s*=)", line) and line.strip() not in "[]"), "")
    return f": {at} stands already" if at.startswith("[") else f": {at.split('=')[0].strip()!r} has a value already, and was given another" if at else ""


def read_file(kind: str, file: Path) -> dict[str, Any]:
    """The same in today's format of its kind (`model.files.formats`)."""
    tables: dict[str, Any] = migrated(kind, read_toml(file), file)
    return tables


def first_error(where: str | Path, raw: Any, form: type[BaseModel], error: ValidationError) -> str:
    """One sentence for the first thing pydantic found wrong in a file of `form`: a misspelt key before the one then missing.

    Entries of a list of tables go by their id, node or name; those of another list by their number, the first being 1.
    """
    problem = min(error.errors(), key=lambda e: (e["type"] != "extra_forbidden", e["type"] == "model_type"))  # of two forms that a value may have, the one that it has
    location = problem["loc"]
    words, value = [], raw
    for part in location:
        if part == "[key]" or (isinstance(part, str) and "[" in part and not (isinstance(value, Mapping) and part in value)):  # pydantic's words for a name that is itself wrong, and for a form
            continue
        if isinstance(value, int | float | str):
            break  # a number alone, which stands for a law of one
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            value = None
        entry = value if isinstance(part, int) and isinstance(value, Mapping) else {}
        called = next((entry[key] for key in ("id", "node", "name") if key in entry), part + 1 if isinstance(part, int) else part)
        words.append(called if isinstance(called, str) else _shown(called))
    key = ".".join(words)
    match problem["type"]:
        case "extra_forbidden":
            word, allowed = str(location[-1]), _allowed_keys(form, location[:-1])
            return f"{where}: {key}: unknown key; allowed here: {', '.join(allowed)}{meant(word, allowed) or _elsewhere(word, form)}"
        case "missing":
            return f"{where}: {key}: missing, and has no default"
        case _:
            message = _told(problem["type"], problem["msg"].removeprefix("Value error, "), problem["input"])
            given = "" if isinstance(problem["input"], Mapping | LawTable) else f" = {_shown(problem['input'])}"
            told = f"{key}{given}: {message[0].lower()}{message[1:]}".removeprefix(": ")
            return f"{where}: {told}"


def meant(word: str, allowed: Sequence[str]) -> str:
    """What to say after all that is allowed: the one that an unknown `word` is most like."""
    near = get_close_matches(word, allowed, n=1)
    return f"; did you mean {near[0]}?" if near else ""


def _elsewhere(word: str, form: type[BaseModel]) -> str:
    """What to say of an unknown `word` that is most like a key of another table of the file."""
    tables = dict(_tables("", form))
    near = get_close_matches(word, list(dict.fromkeys(key for keys in tables.values() for key in keys)), n=1, cutoff=0.7)
    places = [table for table, keys in tables.items() if near and near[0] in keys]
    at = [f"in {table}" if table else "at the top of the file" for table in places]
    return f"; {near[0]} stands {' or '.join(at)}" if at else ""


def _tables(name: str, form: Any) -> Iterator[tuple[str, list[str]]]:
    """The keys of a file's tables, by their names: those that have one, without what is in tables that are named freely."""
    yield name, _keys(form)
    for key, field in form.model_fields.items():
        inner = _table_in(field.annotation)
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            each = get_origin(field.annotation) is list
            called = ".".join(filter(None, (name.strip("[]"), field.alias or key)))
            yield from _tables(f"[[{called}]]" if each else f"[{called}]", inner)


def _told(kind: str, message: str, value: Any) -> str:
    """pydantic's words in those of a file: what it calls a tuple is a list in brackets, and neither a number in quotes nor nan is one."""
    if isinstance(value, float) and not np.isfinite(value):
        return "input should be a finite number"
    if kind == "model_type":
        return "input should be a table"
    if kind in ("tuple_type", "list_type"):
        return "input should be a list in brackets, as [1.0, 2.0]"
    if kind in ("float_type", "int_type") and isinstance(value, str) and value.replace(".", "", 1).strip().isdigit():
        return f"{message}, without quotes"
    return message.replace(" after validation", "") + (", in quotes" if kind == "string_type" else "")


def _shown(value: Any) -> str:
    """A value as a message quotes it: no numbers of thousands of digits, no endless text."""
    if isinstance(value, bool):
        return str(value).lower()
    try:
        text = repr(value)
    except (ValueError, RecursionError):
        return f"a {type(value).__name__} too long to be written"
    return text if len(text) <= 200 else f"{text[:200]}..."


def _allowed_keys(form: Any, path: tuple[str | int, ...]) -> list[str]:
    """Keys of the table at `path`, read off the models."""
    table = form
    for part in path:
        if isinstance(part, int):
            continue
        fields = getattr(table, "model_fields", None)
        if fields and part in fields:
            table = _table_in(fields[part].annotation)
        elif len(inner := get_args(table)) > 1:  # a table by name; else the name of one of several forms that an entry may have
            table = _table_in(inner[1])
    return _keys(table)


def _keys(table: Any) -> list[str]:
    """Keys as the file has them; none of what is no table."""
    return [field.alias or name for name, field in getattr(table, "model_fields", {}).items()]


def _table_in(annotation: Any) -> Any:
    """The pydantic model inside an annotation (a list's or union's member), or the annotation itself."""
    if get_origin(annotation) is list:
        return _table_in(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType, Annotated):
        inner = [_table_in(a) for a in get_args(annotation)]
        return next((a for a in inner if isinstance(a, type) and issubclass(a, BaseModel)), annotation)
    return annotation
