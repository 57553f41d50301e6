"""From named columns or arrays to FRFs and time records: the same for text tables, `.npz` and `.mat`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array
from thermospindle.sim.identification.frf import even
from thermospindle.sim.importing import units
from thermospindle.sim.importing.files.labels import ROLES, Role, end, role_of, told_of_end
from thermospindle.sim.importing.files.text import TextTable
from thermospindle.sim.importing.mapping import REST, FileForm
from thermospindle.sim.importing.measured import FORCE_NEEDED, Content, Curve, End, Motion, Question, listed

FULL_TURN = 2 * np.pi + 0.01
MATRIX = ("h", "frf", "frfs", "h1", "h2", "hv", "g", "transfer", "fft.h")
LISTS = {
    **dict.fromkeys(("response_nodes", "responses", "resp", "resp_nodes", "output_nodes", "outputs"), "response"),
    **dict.fromkeys(("reference_nodes", "references", "ref", "refs", "ref_nodes", "input_nodes", "inputs"), "reference"),
}
"""What lists of nodes are called."""
RATES = ("fs", "sample_rate", "samplerate", "sample_rate_hz", "fs_hz")


@dataclass(frozen=True, eq=False)
class Column:
    """One column: how messages name it, its role (None: not known), its values (n,) or (hits, n)."""

    name: str
    role: Role | None
    values: np.ndarray


def from_table(table: TextTable, settings: FileForm) -> Content:
    """The content of a text table."""
    columns = []
    for k in range(table.values.shape[1]):
        heading, unit = table.heading[k], table.unit[k].strip("[]")
        name = heading or f"column {k + 1}"
        told = settings.columns.get(heading) or settings.columns.get(f"column {k + 1}") or settings.columns.get(str(k + 1))
        role = role_of(told or heading)
        if role is None and not told and unit in ("Hz", "s") and k == 0:
            role = Role("frequency" if unit == "Hz" else "time")
        role = role or _rest(settings)
        if role and not role.unit and unit:
            role = replace(role, unit=unit)
        columns.append(Column(name, role, table.values[:, k]))
    unnamed = not any(table.heading)
    if table.values.shape[1] == 1 and (unnamed or columns[0].role is None) and np.iscomplexobj(table.values):
        columns = [Column(columns[0].name, Role("H", "complex"), table.values[:, 0])]
    names = (*table.heading, *(f"column {k + 1}" for k in range(len(columns))), *(str(k + 1) for k in range(len(columns))))
    return replace(_content(table.file, columns, settings, {}), names=tuple(filter(None, names)))


def _rest(settings: FileForm) -> Role | None:
    """The role of a column that nothing tells: none, unless the mapping has the rest ignored."""
    return Role("ignore") if REST in settings.columns else None


def from_arrays(file: Path, arrays: Mapping[str, Any], settings: FileForm) -> Content:
    """The content of named arrays: matrices of FRFs (responses, references, lines in any order), single FRFs, time records."""
    lists: dict[str, list[End]] = {}
    columns: list[Column] = []
    rate = settings.sample_rate_Hz
    axes = {kind: [len(v) for n, v in arrays.items() if _is_axis(n, v, kind, settings)] for kind in ("time", "frequency")}
    axis_length = max(axes["frequency"] or axes["time"], default=0)
    for name, value in arrays.items():
        short = name.rsplit(".", 1)[-1]
        told = settings.columns.get(name) or settings.columns.get(short)
        if short.lower() in LISTS and not told and np.ndim(value) < 2:
            lists[LISTS[short.lower()]] = [end(f"{v:g}" if isinstance(v, float) else str(v)) for v in np.atleast_1d(value).tolist()]
        elif short.lower() in RATES and np.size(value) == 1 and not told:
            rate = rate or float(value)
        elif isinstance(value, str | list) or np.size(value) == 1:
            continue
        else:
            role = role_of(told or short)
            matrix = short.lower() in MATRIX or (role is not None and role.kind in ("H", "coherence", "sd") and np.ndim(value) > 1)
            if matrix and np.ndim(value) > 1 and not told:
                role = role if role and role.kind in ("coherence", "sd") else Role("H", "complex" if np.iscomplexobj(value) else "magnitude")
            role = role or _rest(settings)
            columns.append(Column(name, role, np.asarray(value)))
    widest = {kind: lists.get(kind) for kind in ("response", "reference")}
    force = next((c.values for c in columns if c.role and c.role.kind == "force"), None)
    hits = 0 if force is None else 1 if force.ndim == 1 else min(force.shape)
    columns = [piece for column in columns for piece in _pieces(column, widest, axis_length, hits)]
    own = settings if rate is None else settings.model_copy(update={"sample_rate_Hz": rate})
    return replace(_content(file, columns, own, arrays), names=tuple(arrays))


def _is_axis(name: str, value: Any, kind: str, settings: FileForm) -> bool:
    short = name.rsplit(".", 1)[-1]
    role = role_of(settings.columns.get(name) or settings.columns.get(short) or short)
    return role is not None and role.kind == kind and np.ndim(value) == 1 and not isinstance(value, str | list)


def _pieces(column: Column, lists: Mapping[str, list[End] | None], length: int, hits: int) -> list[Column]:
    """A matrix of FRFs as single ones, its last axis that of the lines; responses over time by
    channel, as many `hits` as their force has; what is no matrix as it is."""
    value, role = column.values, column.role
    if role is None or role.kind not in ("H", "coherence", "sd") or value.ndim == 1:
        if role is not None and role.kind == "response" and value.ndim > 1:
            value = np.moveaxis(value, int(np.argmax(value.shape)), -1)
            if value.ndim == 2 and hits == 1 < len(value):  # channels of one hit
                value = value[None]
            if value.ndim == 3 and value.shape[0] != hits == value.shape[1]:  # (responses, hits, n)
                value = value.swapaxes(0, 1)
        if role is not None and role.kind == "response" and value.ndim == 3:  # (hits, responses, n)
            ends = lists["response"] or [End(name=f"response {k + 1}") for k in range(value.shape[1])]
            return [replace(column, role=replace(role, response=e), values=value[:, k]) for k, e in enumerate(ends)]
        return [column]
    axes = [k for k in range(value.ndim) if value.shape[k] == length] or [int(np.argmax(value.shape))]
    value = np.moveaxis(value, axes[-1], -1)
    responses, references = lists["response"], lists["reference"]
    if value.ndim == 2:
        value = value[None] if responses is not None and len(responses) == 1 else value[:, None]
    if responses and references and value.shape[:2] == (len(references), len(responses)) != (len(responses), len(references)):
        value = value.swapaxes(0, 1)
    found = []
    for i, j in np.ndindex(*value.shape[:2]):
        response = responses[i] if responses and i < len(responses) else End(name=f"response {i + 1}")
        reference = references[j] if references and j < len(references) else End(name=f"reference {j + 1}")
        found.append(Column(f"{column.name}[{i},{j}]", replace(role, response=response, reference=reference), value[i, j]))
    return found


def _content(file: Path, columns: Sequence[Column], settings: FileForm, arrays: Mapping[str, Any]) -> Content:
    questions: list[Question] = []
    unknown = [c.name for c in columns if c.role is None]
    if unknown and not all(len(c.values) < 3 for c in columns if c.role is None):
        questions.append(
            Question(file.name, "columns", f"what {listed(unknown)} {'is' if len(unknown) == 1 else 'are'}: columns = {{ {unknown[0]!r} = \"...\" }}; allowed are {ROLES}", tuple(unknown))
        )
    known = [c for c in columns if c.role is not None]
    moving = [c for c in known if c.role and c.role.kind in ("force", "response")]
    if moving and not any(c.role and c.role.kind == "H" for c in known):
        motions, more = _motions(file, known, moving, settings)
        return Content(file, motions=motions, questions=(*questions, *more))
    curves, more = _curves(file, known, settings)
    if not curves and not questions and not more:
        more = [Question(file.name, "columns", f"what its columns are: {listed(c.name for c in columns)}; allowed are {ROLES}")]
    return Content(file, tuple(curves), questions=(*questions, *more))


def _curves(file: Path, columns: Sequence[Column], settings: FileForm) -> tuple[list[Curve], list[Question]]:
    own = [c for c in columns if c.role and c.role.kind in ("H", "coherence", "sd")]
    if not own:
        return [], []
    questions: list[Question] = []
    axis = next((c for c in columns if c.role and c.role.kind == "frequency"), None)
    n = len(own[0].values)
    if axis is not None:
        frequency: Array = np.asarray(axis.values.real, float) * _to_si(file, axis)
    elif settings.step_Hz is not None:
        frequency = (settings.start_Hz or 0.0) + settings.step_Hz * np.arange(float(n))
    else:
        questions.append(Question(file.name, "step_Hz", f"the frequencies of its {n} lines: step_Hz, and start_Hz where the first is not at 0 Hz"))
        frequency = np.arange(float(n))
    if not questions and len(frequency) == n and not np.all(above := frequency > 0):  # at 0 Hz is no motion, and below it the conjugate of what is above
        frequency, n = frequency[above], int(np.count_nonzero(above))
        own = [replace(c, values=c.values[above]) if len(c.values) == len(above) else c for c in own]
    groups: dict[tuple[End, End], dict[str, Column]] = {}
    for c in own:
        assert c.role is not None
        parts, part = groups.setdefault((c.role.response, c.role.reference), {}), c.role.kind if c.role.kind != "H" else c.role.part
        if part in parts:
            raise BadInput(f"{file}: {parts[part].name!r} and {c.name!r}: two columns for the {part} of the same FRF; each may stand once")
        parts[part] = c
    blank = groups.pop((End(), End()), {})
    if blank and len(groups) == 1:  # a coherence column without a pair beside the one FRF
        next(iter(groups.values())).update({k: v for k, v in blank.items() if k in ("coherence", "sd")})
        blank = {k: v for k, v in blank.items() if k not in ("coherence", "sd")}
    if blank:
        groups[(End(), End())] = blank
    curves = []
    for (response, reference), parts in groups.items():
        value, open_ = _value(file, parts, settings)
        questions += open_
        if value is None:
            if not open_:
                continue
            value = np.zeros(n, complex)  # never used: stands for the FRF, so that what else is open of it is asked at once
        response, reference = told_of_end(response, settings.response), told_of_end(reference, settings.reference)
        told = next((c for k, c in parts.items() if k not in ("coherence", "sd", "phase")), None)
        unit = settings.unit or (told.role.unit if told and told.role else "")
        coherence, sd = (np.asarray(parts[k].values.real, float) if k in parts else None for k in ("coherence", "sd"))
        where = listed(c.name for c in parts.values())
        curves.append(Curve(file, where, response, reference, frequency, value, settings.quantity or "", unit, coherence, sd))
    return curves, questions


def _to_si(file: Path, axis: Column) -> float:
    """Factor of an axis to Hz or s. `BadInput` for a unit that is not known."""
    assert axis.role is not None
    time = axis.role.kind == "time"
    factor = (units.of_time if time else units.of_frequency)(axis.role.unit or ("s" if time else "Hz"))
    if factor is None:
        allowed = units.TIMES if time else units.FREQUENCIES
        raise BadInput(f'{file}: {axis.name}: its unit {axis.role.unit!r} is none of {axis.role.kind} that is known; allowed are {allowed}; columns tells it, as in "{axis.role.kind} [{allowed.split(",")[0]}]"')
    return factor


def _value(file: Path, parts: Mapping[str, Column], settings: FileForm) -> tuple[np.ndarray | None, list[Question]]:
    """The values of one FRF from its columns, real where they are a magnitude alone."""
    found = {k: c.values for k, c in parts.items()}
    name = listed(c.name for c in parts.values())
    if "complex" in found:
        return np.asarray(found["complex"], complex), []
    if "real" in found and "imaginary" in found:
        said = {c.role.unit for k in ("real", "imaginary") if (c := parts[k]).role and c.role.unit}
        if len(said) > 1 and settings.unit is None:
            return None, [Question(file.name, "unit", f"the unit of {name}: their headings say {listed(sorted(said))}")]
        return found["real"].real + 1j * found["imaginary"].real, []
    if "real" in found or "imaginary" in found:
        missing = "imaginary" if "real" in found else "real"
        return None, [Question(file.name, "columns", f"which column is the {missing} part beside {name}")]
    size = found["magnitude"].real if "magnitude" in found else 10 ** (found["decibel"].real / 20) * _level(parts) if "decibel" in found else None
    if size is None:
        return None, ([Question(file.name, "columns", f"which column is the magnitude beside {name}")] if "phase" in found else [])
    if "phase" not in found:
        return np.asarray(size, float), []
    phase, role = found["phase"].real, parts["phase"].role
    unit = settings.phase_unit or {"deg": "deg", "°": "deg", "rad": "rad"}.get(role.unit if role else "")
    if unit is None and np.abs(phase).max() > FULL_TURN:
        unit = "deg"
    if unit is None:
        return None, [Question(file.name, "phase_unit", f"whether the phase in {name} is in deg or rad")]
    if unit == "deg" and settings.phase_unit is None and 0.9 * np.pi < np.abs(phase).max() <= np.pi * (1 + 1e-6):
        return None, [Question(file.name, "phase_unit", "whether its phases are in deg, as their headings say, or in rad: they stay within +-3.14")]
    if unit == "rad" and settings.phase_unit is None and np.abs(phase).max() > FULL_TURN:
        return None, [Question(file.name, "phase_unit", "whether its phases are in rad, as their headings say, or in deg: they go beyond a turn, 6.28")]
    return size * np.exp(1j * phase * (np.pi / 180 if unit == "deg" else 1.0)), []


def _level(parts: Mapping[str, Column]) -> float:
    role = parts["decibel"].role
    return role.level if role else 1.0


def _motions(file: Path, columns: Sequence[Column], moving: Sequence[Column], settings: FileForm) -> tuple[tuple[Motion, ...], list[Question]]:
    axis = next((c for c in columns if c.role and c.role.kind == "time"), None)
    step, questions = 0.0, []
    if axis is not None:
        scale = _to_si(file, axis)
        time = np.asarray(axis.values.real, float)
        step = even(time[0] if time.ndim > 1 else time) * scale
        if step == 0:
            questions.append(Question(file.name, "sample_rate_Hz", f"its time in {axis.name} does not rise evenly; the rate it was sampled at"))
    elif settings.sample_rate_Hz is not None:
        step = 1 / settings.sample_rate_Hz
    else:
        questions.append(Question(file.name, "sample_rate_Hz", "the rate its time records were sampled at; it has no column of time"))
    found = []
    for c in moving:
        assert c.role is not None
        force = c.role.kind == "force"
        place = c.role.reference if force else c.role.response
        if place.label or force or sum(not (m.role and m.role.kind == "force") for m in moving) == 1:
            place = told_of_end(place, settings.reference if force else settings.response)
        value = np.atleast_2d(np.asarray(c.values.real, float))
        value = value if value.shape[-1] >= value.shape[0] else value.T
        found.append(Motion(file, c.name, place if place.label else End(name="" if force else c.name), force, step or 1.0, value, c.role.unit))
    if not any(m.force for m in found):
        questions.append(Question(file.name, "columns", f"which column is the hammer's force; {FORCE_NEEDED}"))
    elif all(m.force for m in found):
        questions.append(Question(file.name, "columns", "which column is a response"))
    return tuple(found), questions
