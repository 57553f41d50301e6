"""UFF/UNV files of any laboratory: FRFs and time records (58, 58b), geometry (15, 2411), modes (55, 2414), units (164)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.sim.campaign.uff import AXIS, FORCE, KINDS, STANDARD_ERROR, factor, read_uff
from thermospindle.sim.importing import units
from thermospindle.sim.importing.files.labels import Role, end, role_of, told_of_end
from thermospindle.sim.importing.files.uff_axes import frequencies, in_unit, label, nameless, time_step
from thermospindle.sim.importing.files.uff_modes import Found, mode, modes_of
from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import NOWHERE, Content, Curve, End, Motion, Question

FRF, COHERENCE, RECORD = 4, 6, 1
AXES = {0: "", 1: "+X", 2: "+Y", 3: "+Z", -1: "-X", -2: "-Y", -3: "-Z"}
LEFT = {2: "auto spectrum", 3: "cross spectrum", 9: "power spectral density", 12: "spectrum", 0: "unnamed function"}


def from_uff(file: Path, settings: FileForm) -> Content:
    """What a UFF file holds. Raises `BadInput` for one that is damaged."""
    try:
        return _from_uff(file, settings)
    except BadInput:
        raise
    except (ValueError, KeyError, IndexError, TypeError, ArithmeticError, AttributeError) as error:  # sets whose numbers do not go together
        raise BadInput(f"{file}: is damaged: its sets cannot be put together ({type(error).__name__}: {error})") from None


def _from_uff(file: Path, settings: FileForm) -> Content:
    """The content of a UFF file. Raises `BadInput` for what is damaged; sets that are of no use here are named in the notes."""
    sets = read_uff(file, padded=True)
    system = next((s for s in sets if s["type"] == 164), None)
    curves: list[Curve] = []
    motions: list[Motion] = []
    modes: list[Found] = []
    questions: list[Question] = []
    coherence: list[Curve] = []
    errors: dict[tuple[End, End], np.ndarray] = {}
    axis: np.ndarray | None = None
    places: dict[int, tuple[float, float, float]] = {}
    unscaled: dict[int, tuple[float, float, float]] = {}
    left: dict[str, int] = {}
    taken_as_SI = 0
    names: list[str] = []
    told = _told(file, sets, settings)
    for number, record in enumerate(sets, 1):
        where = f"set {number}"
        if where in settings.leave_out:
            continue
        kind = int(record["type"])
        if kind == 58:
            function = record["func_type"]
            taken_as_SI += function in (FRF, COHERENCE, RECORD) and nameless(record)
            ends = _end(record, "rsp", settings.response), _end(record, "ref", settings.reference)
            if max(abs(int(record["rsp_dir"])), abs(int(record["ref_dir"]))) > 3:
                left["function in rotation"] = left.get("function in rotation", 0) + 1
            elif function == FRF:
                curve, asked = _curve(file, where, record, ends, system, settings)
                curves.append(curve)
                questions += asked
            elif function == COHERENCE:
                coherence.append(Curve(file, where, *ends, frequencies(file, where, record, settings), np.asarray(np.real(record["data"]), float)))
            elif function == RECORD:
                names.append(where)
                own = told.get(_channel(record))
                if own is None or own.kind != "ignore":
                    motions.append(_motion(file, where, record, system, settings, own))
            elif record["id2"].strip() == STANDARD_ERROR:  # of our own files, in the unit of the FRF
                errors[ends] = np.asarray(np.real(record["data"]), float)
            elif record["id2"].strip() == AXIS:
                axis = np.asarray(np.real(record["data"]), float)
            else:
                name = LEFT.get(function, f"function of type {function}")
                left[name] = left.get(name, 0) + 1
        elif kind in (15, 2411):
            scale = 1 / factor(file, system, "length") if system else 1.0
            nodes, xyz = _nodes(record)
            xyz_of = {int(n): (float(x) * scale, float(y) * scale, float(z) * scale) for n, (x, y, z) in zip(nodes, xyz, strict=True)}
            (places if system else unscaled).update(xyz_of)
        elif kind in (55, 2414) and (found := mode(where, record)) is not None:
            modes.append(found)
        elif kind not in (151, 164, 18, 82, 2412):
            left[f"dataset {kind}"] = left.get(f"dataset {kind}", 0) + 1
    lines, asked, said = modes_of(file, modes, settings)
    coherence = [c if axis is None else replace(c, frequency=axis) for c in coherence]
    curves = [replace(c, sd=errors.get((c.response, c.reference)), frequency=c.frequency if axis is None else axis) for c in curves]
    notes = [f"{file.name}: {count} x {name} left out: not used by a campaign" for name, count in left.items()]
    notes += said
    if taken_as_SI:
        notes.append(f"{file.name}: functions that do not say what their abscissa is ({taken_as_SI}) are taken in Hz, time records in s")
    return Content(file, tuple(curves), _joined(motions), lines, places, unscaled, tuple(coherence), tuple(notes), (*questions, *asked), tuple(names))


def _end(record: Mapping[str, Any], side: str, told: str | int | None) -> End:
    node, direction, name = int(record[f"{side}_node"]), AXES.get(int(record[f"{side}_dir"]), ""), record[f"{side}_ent_name"].strip()
    if node == 0 and told is not None:
        return end(str(told))
    return told_of_end(End(0, direction, name) if node == 0 and name not in ("", "NONE") else End(node, direction), told)


def _curve(
    file: Path, where: str, record: Mapping[str, Any], ends: tuple[End, End], system: Mapping[str, Any] | None, settings: FileForm
) -> tuple[Curve, list[Question]]:
    """One FRF, and what its units and its quantity leave open or say against each other."""
    number, below = record["ordinate_spec_data_type"], record["orddenom_spec_data_type"]
    word = record["ordinate_axis_lab"].strip()
    typed = units.OF_TYPE.get(number, "") if below in (FORCE, 0) else ""
    top, above = in_unit(file, record, "ordinate", number if typed else 0, system)
    bottom, under = in_unit(file, record, "orddenom", FORCE if below == FORCE or (below == 0 and not label(record, "ordinate")) else 0, system)
    joined = f"({top})/{bottom}" if top and bottom else top
    unit, scale = (settings.unit, 1.0) if settings.unit else (joined, above / under)
    questions: list[Question] = []
    said = {"type": typed, "unit": (units.of_frf(joined) or ("",))[0], "label": units.named(word)}
    heard = {q for q in said.values() if q}
    if not settings.quantity and len(heard) > 1:
        words = f"its header says {KINDS[number].name}, " if typed else ""
        words += f"its label {word!r} is that of {units.with_article(said['label'])}, " if said["label"] else ""
        words += f"its unit {joined!r} that of {units.with_article(said['unit'])}" if said["unit"] else "its unit says nothing"
        questions.append(Question(file.name, "quantity", f"which quantity its FRFs are: {words}"))
    quantity = settings.quantity or (heard.pop() if len(heard) == 1 else "")
    value = np.asarray(record["data"]) if scale == 1 else np.asarray(record["data"]) * scale
    return Curve(file, where, *ends, frequencies(file, where, record, settings), value, quantity, unit), questions


def _motion(
    file: Path, where: str, record: Mapping[str, Any], system: Mapping[str, Any] | None, settings: FileForm, told: Role | None
) -> Motion:
    """One record, as the file says or as it is `told`: what it is of, its unit, its point."""
    kind = record["ordinate_spec_data_type"]
    unit, scale = in_unit(file, record, "ordinate", kind if kind in units.OF_TYPE or kind == FORCE else 0, system)
    if told is not None and told.unit:
        unit, scale = told.unit, 1.0
    force = kind == FORCE or units.of_force(unit) is not None or "force" in record["ordinate_axis_lab"].lower()
    if told is not None:
        force = told.kind == "force"
    value = np.asarray(np.real(record["data"]), float)[None] * scale
    hit = _end(record, "ref", settings.reference)
    at = _end(record, "rsp", settings.reference if force else settings.response)
    if told is not None and (own := told.reference if force else told.response).label:
        at = own
    return Motion(file, where, at, force, time_step(file, where, record, settings), value, unit, NOWHERE if force else hit)


CHANNEL = ("rsp_node", "rsp_dir", "rsp_ent_name", "ref_node", "ref_dir", "ref_ent_name", "ordinate_spec_data_type")
"""What the records of one channel to one hammer point have alike."""


def _told(file: Path, sets: Sequence[Mapping[str, Any]], settings: FileForm) -> dict[tuple[Any, ...], Role]:
    """The roles that the mapping's `columns` tell of channels, each by one of its sets. `BadInput` for one that no record can have."""
    found = {}
    for number, record in enumerate(sets, 1):
        said = settings.columns.get(f"set {number}")
        if said is not None and record["type"] == 58 and record["func_type"] == RECORD:
            role = role_of(said)
            if role is None or role.kind not in ("force", "response", "ignore"):
                raise BadInput(f'{file}: set {number}: columns = {{ "set {number}" = {said!r} }}; allowed for a record are force, response 3, ignore, with the unit in brackets behind it')
            found[_channel(record)] = role
    return found


def _channel(record: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(record[key] for key in CHANNEL)


def _joined(motions: list[Motion]) -> tuple[Motion, ...]:
    """Records of one channel that follow each other in a file are its hits; those of one response to several hammer points are apart."""
    found: dict[tuple[End, bool, End], Motion] = {}
    for m in motions:
        key = (m.end, m.force, m.reference)
        first = found.setdefault(key, m)
        if first is m:
            continue
        kinds = [f"{x.value.shape[-1]} samples every {x.step:.6g} s in {x.unit or 'no unit'}" for x in (m, first)]
        if kinds[0] != kinds[1]:
            raise BadInput(f"{m.file}: {m.where}: has {kinds[0]}, {first.where} of the same channel {kinds[1]}; hits of one channel must be alike, or leave_out = [\"{m.where}\"]")
        found[key] = replace(first, value=np.concatenate([first.value, m.value]))
    return tuple(found.values())


def _nodes(record: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(record["node_nums"], int), np.stack([np.asarray(record[k], float) for k in "xyz"], axis=-1)
