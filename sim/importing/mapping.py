"""The form of a mapping file: what a laboratory's files do not tell, written by hand below what the program has found.

A value "?" is an open question, as if the key were not there.
"""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError

from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import CURRENT, MAPPING, migrated
from thermospindle.model.scene.fields import first_error, format_of, read_toml
from thermospindle.model.scene.form import Finite, Name, NotNegative, Positive
from thermospindle.model.scene.measuring import Point as PointForm
from thermospindle.sim.campaign.form import PlainName, Table, plain_name

OPEN = "?"
REST = "*"
"""In `columns`: all columns that nothing else tells; they can only be ignored."""
Quantity = Literal["receptance", "mobility", "accelerance"]
Temperature = Annotated[float, Field(gt=-273.15, le=5000, allow_inf_nan=False)]


def _low_first(ends: list[float]) -> list[float]:
    if not ends[0] < ends[1]:
        raise ValueError("its ends are the wrong way round; the lower one comes first, as in [50.0, 3000.0]")
    return ends


Band = Annotated[list[NotNegative], Field(min_length=2, max_length=2), AfterValidator(_low_first)]
"""Hz."""


class FileForm(Table):
    """How files are to be read; `file` is a name or a pattern like "*.csv"."""

    file: Name
    test: PlainName | None = None
    quantity: Quantity | None = None
    unit: Name | None = None
    response: str | int | None = None
    reference: str | int | None = None
    columns: dict[str, str] = Field(default_factory=dict)
    phase_unit: Literal["deg", "rad"] | None = None
    start_Hz: NotNegative | None = None
    step_Hz: Positive | None = None
    sample_rate_Hz: Positive | None = None
    damping_unit: Literal["ratio", "percent"] | None = None
    conjugate: bool = False
    leave_out: list[str] = Field(default_factory=list)


def _pattern(text: str) -> str:
    plain_name(re.sub(r"[*?]", "x", text))
    return text


class TestForm(Table):
    """What a test was done in; see the campaign's own form for the keys. `id` is a name or a pattern like "*"."""

    __test__ = False

    id: Annotated[str, AfterValidator(_pattern), Field(max_length=200)]
    temperature_C: Temperature | None = None
    speed_rpm: Finite | None = None
    hammer_level_N: Positive | None = None
    soak_time_min: NotNegative | None = None
    window_decay_1_per_s: NotNegative = 0.0
    pretrigger_s: NotNegative | None = None
    repeat: Annotated[int, Field(ge=1)] = 1
    averages: Annotated[int, Field(ge=1, le=100000)] | None = None
    conditions: dict[str, Any] = Field(default_factory=dict)


class MadePoint(Table):
    """A measuring point of the campaign; `called` is what files call it."""

    node: Annotated[int, Field(ge=1, le=999_999_999)]
    name: str | None = None
    body: str | None = None
    position_mm: list[Finite] | None = None
    direction: str | None = None
    sensor_mass_g: float | None = None
    called: list[str | int] = Field(default_factory=list)


class RecordForm(Table):
    """How time records become FRFs."""

    estimator: Literal["H1", "H2", "Hv"] = "H1"
    hit_length_s: Positive | None = None
    exponential_end: Annotated[float, Field(gt=0, le=1)] | None = None
    double_hit_share: Annotated[float, Field(gt=0, lt=1)] = 0.1
    apart_s: Positive = 0.1
    band_Hz: Band | None = None
    overload: dict[str, Positive] = Field(default_factory=dict)


class MappingForm(Table):
    format: format_of(MAPPING) = CURRENT[MAPPING]  # type: ignore[valid-type]
    title: Name | None = None
    spindle: Name | None = None
    quantity: Quantity | None = None
    note: str = ""
    band_Hz: Band | None = None
    frequency_sd_Hz: Positive | None = None
    damping_sd_percent: Positive | None = None
    shape_sd_percent: Positive | None = None
    files: list[FileForm] = Field(default_factory=list)
    tests: list[TestForm] = Field(default_factory=list)
    points: list[MadePoint] = Field(default_factory=list)
    records: RecordForm = RecordForm()


def read_mapping(path: Path | None) -> MappingForm:
    """The mapping of a file, open answers left out; an empty one without a file. Raises `BadInput`."""
    if path is None:
        return MappingForm()
    raw = migrated(MAPPING, _answered(read_toml(path)), path)
    try:
        form = MappingForm.model_validate(raw)
    except ValidationError as error:
        raise BadInput(first_error(path, raw, MappingForm, error)) from None
    once: dict[str, list[Any]] = {"tests: id": [t.id for t in form.tests], "points: node": [p.node for p in form.points]}
    for key, names in once.items():
        for name in names:
            if names.count(name) > 1:
                raise BadInput(f"{path}: {key} = {name!r} stands {names.count(name)} times; each must be different")
    for table in form.files:
        if table.columns.get(REST, "ignore") != "ignore":
            raise BadInput(f"{path}: files: columns: {REST!r} = {table.columns[REST]!r}: all columns that nothing else tells can only be \"ignore\"")
    for point in form.points:
        _check_point(path, point)
    return form


def _answered(node: Any) -> Any:
    """The parsed TOML without keys whose value is open."""
    if isinstance(node, dict):
        return {key: _answered(value) for key, value in node.items() if value != OPEN and value != [OPEN] * 3}
    return [_answered(value) for value in node] if isinstance(node, list) else node


def _check_point(path: Path, point: MadePoint) -> None:
    told = {key: value for key, value in point.model_dump(exclude={"called"}).items() if value is not None}
    full = {"name": "x", "body": "x", "position_mm": [0.0, 0.0, 0.0], "direction": "+Z"} | told
    try:
        PointForm.model_validate(full)
    except ValidationError as error:
        raise BadInput(first_error(f"{path}: points.{point.node}", full, PointForm, error)) from None


def fits(table: FileForm, file: Path) -> bool:
    """Whether a table of the mapping is about a file, by its name or its path."""
    return fnmatchcase(file.name, table.file) or fnmatchcase(str(file), table.file)


def settings_of(form: MappingForm, file: Path) -> FileForm:
    """What the mapping says of one file, all tables that fit it taken together, later ones first."""
    told: dict[str, Any] = {"file": file.name}
    for table in form.files:
        if fits(table, file):
            own = table.model_dump(exclude_unset=True)
            own["columns"] = {**told.get("columns", {}), **own.get("columns", {})}
            own["leave_out"] = [*told.get("leave_out", []), *own.get("leave_out", [])]
            told |= own | {"file": file.name}
    try:
        return FileForm.model_validate(told)
    except ValidationError as error:
        raise BadInput(first_error(str(file), told, FileForm, error)) from None


def told_of(form: MappingForm, name: str) -> TestForm:
    """What the mapping says of one test, all tables whose `id` fits it taken together, later ones first."""
    told: dict[str, Any] = {}
    for table in form.tests:
        if fnmatchcase(name, table.id):
            told |= table.model_dump(exclude_unset=True)
    return TestForm.model_validate(told | {"id": name})
