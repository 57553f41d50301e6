"""The form of a campaign's files: keys with their units, types and ranges, and `campaign.toml` as text."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping
from datetime import date, time
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from thermospindle.model.errors import BadInput
from thermospindle.model.files.cells import plain_number
from thermospindle.model.files.formats import CAMPAIGN, CURRENT
from thermospindle.model.scene.fields import format_of
from thermospindle.model.scene.form import Finite, Name, NotNegative, Positive, Title, first_error
from thermospindle.model.scene.form import Point as PointTable

MODE_COLUMNS = ("test", "mode", "kind", "frequency_Hz", "frequency_sd_Hz", "damping_ratio", "damping_ratio_sd")
SHAPE_COLUMNS = ("test", "mode", "node", "real", "imaginary", "sd")


def plain_name(text: str) -> str:
    if not text or not text.isascii() or not all(c.isalnum() or c in "._+-" for c in text) or text.startswith("."):
        raise ValueError("must be letters, digits, '.', '_', '+' or '-', as the name of a file in the campaign's folder")
    return text


PlainName = Annotated[str, AfterValidator(plain_name), Field(max_length=200)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class NoiseTable(Table):
    of_value: NotNegative
    of_largest: NotNegative


class TestTable(Table):
    id: PlainName
    temperature_C: Annotated[float, Field(gt=-273.15, le=5000, allow_inf_nan=False)]
    speed_rpm: Finite
    frf: PlainName | None = None
    runout: PlainName | None = None
    spectrum_window: Literal["none", "hann", "flattop"] | None = None
    hammer_level_N: Positive | None = None
    soak_time_min: NotNegative | None = None
    window_decay_1_per_s: NotNegative = 0.0
    pretrigger_s: NotNegative | None = None
    repeat: Annotated[int, Field(ge=1)] = 1
    conditions: dict[str, Any] = {}


class CampaignTable(Table):
    format: format_of(CAMPAIGN) = CURRENT[CAMPAIGN]  # type: ignore[valid-type]
    title: Title
    spindle: Name
    quantity: Literal["receptance", "mobility", "accelerance", "displacement"]
    note: str = ""
    lumped_shafts: bool = False
    modes: PlainName | None = None
    shapes: PlainName | None = None
    noise: NoiseTable | None = None
    points: list[PointTable] = []
    tests: list[TestTable] = Field(min_length=1)


CellPositive = Annotated[float, BeforeValidator(plain_number), Field(gt=0, le=1e15, allow_inf_nan=False)]


class ModeTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)  # not strict: a CSV file holds text
    test: str
    mode: Annotated[int, BeforeValidator(plain_number), Field(ge=1, le=1000)]
    kind: Annotated[Name, AfterValidator(str.lower)]  # modes are paired by it
    frequency_Hz: CellPositive
    frequency_sd_Hz: CellPositive
    damping_ratio: Annotated[float, BeforeValidator(plain_number), Field(gt=0, lt=1)] | None = None
    damping_ratio_sd: CellPositive | None = None


CellNumber = Annotated[float, BeforeValidator(plain_number), Field(ge=-1e15, le=1e15, allow_inf_nan=False)]


class ShapeTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    test: str
    mode: Annotated[int, BeforeValidator(plain_number), Field(ge=1, le=1000)]
    node: Annotated[int, BeforeValidator(plain_number)]
    real: CellNumber
    imaginary: CellNumber = 0.0
    sd: CellPositive


def checked(file: Path, raw: dict[str, Any]) -> CampaignTable:
    """The tables of the parsed `campaign.toml`; nodes, test ids and files stand once."""
    try:
        table = CampaignTable.model_validate(raw)
    except ValidationError as error:
        raise BadInput(first_error(file, raw, CampaignTable, error)) from None
    once: dict[str, list[Any]] = {
        "points: node": [p.node for p in table.points],
        "tests: id": [t.id for t in table.tests],
        "file": [name for name in (table.modes, table.shapes, *(t.frf for t in table.tests), *(t.runout for t in table.tests)) if name],
    }
    if table.shapes and not table.modes:
        raise BadInput(f"{file}: shapes = {table.shapes!r}: are those of modes, and modes are missing; a table of them is needed beside")
    for t in table.tests:
        if t.frf and table.quantity == "displacement":
            raise BadInput(
                f"{file}: tests.{t.id}: frf: a campaign of displacement holds runout; FRFs need receptance, mobility or accelerance"
            )
        if t.spectrum_window and not t.runout:
            raise BadInput(
                f"{file}: tests.{t.id}: spectrum_window = {t.spectrum_window!r}: is for a spectrum under runout, and there is none"
            )
    for key, values in once.items():
        for value, count in Counter(values).items():
            if count > 1:
                raise BadInput(f"{file}: {key} = {value!r} stands {count} times; each must be different")
    return table


def in_unit(value: float, unit: float) -> float:
    """The shortest number x for which x * unit is `value` bit for bit, or the nearest where none is."""
    near = value / unit
    candidates = [float(f"{near:.{digits}g}") for digits in range(1, 18)] + [math.nextafter(near, s * math.inf) for s in (-1, 1)]
    return next((x for x in candidates if x * unit == value), near)


def _quoted(text: str) -> str:
    """A string as TOML has it: as JSON does, but for DEL, which JSON takes as it is."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml(value: Any) -> str:
    """A TOML value on one line."""
    match value:
        case bool():
            return str(value).lower()
        case int():
            return str(value)
        case float():
            return float.__repr__(value)
        case str():
            return _quoted(value)
        case date() | time():
            return value.isoformat()
        case list() | tuple():
            return f"[{', '.join(map(toml, value))}]"
        case Mapping():
            return "{ " + ", ".join(f"{_quoted(k)} = {toml(v)}" for k, v in value.items()) + " }"
        case _:
            raise BadInput(f"conditions: {value!r}: a {type(value).__name__} cannot be written to campaign.toml")
