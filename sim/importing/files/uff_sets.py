"""UFF/UNV files of any laboratory: FRFs and time records (58, 58b), geometry (15, 2411), modes (55, 2414), units (164)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.scene.fields import LARGEST, SMALLEST
from thermospindle.sim.campaign.uff import AXIS, FORCE, KINDS, STANDARD_ERROR, read_uff
from thermospindle.sim.importing import units
from thermospindle.sim.importing.files.labels import end, told_of_end
from thermospindle.sim.importing.mapping import FileForm
from thermospindle.sim.importing.measured import Content, Curve, End, ModeLine, Motion, Question

FRF, COHERENCE, RECORD = 4, 6, 1
AXES = {0: "", 1: "+X", 2: "+Y", 3: "+Z", -1: "-X", -2: "-Y", -3: "-Z"}
LEFT = {2: "auto spectrum", 3: "cross spectrum", 9: "power spectral density", 12: "spectrum", 0: "unnamed function"}
COMPLEX = (5, 6)  # data types of sets 55 and 2414: in single and in double precision
RATIO = {8: "m/N", 11: "(m/s)/N", 12: "(m/s^2)/N"}


def from_uff(file: Path, settings: FileForm) -> Content:
    """What a UFF file holds. Raises `BadInput` for one that is damaged."""
    try:
        return _from_uff(file, settings)
    except BadInput:
        raise
    except (ValueError, KeyError, IndexError, TypeError, OverflowError, AttributeError) as error:  # sets whose numbers do not go together
        raise BadInput(f"{file}: is damaged: its sets cannot be put together ({type(error).__name__}: {error})") from None


def _from_uff(file: Path, settings: FileForm) -> Content:
    """The content of a UFF file. Raises `BadInput` for what is damaged; sets that are of no use here are named in the notes."""
    sets = read_uff(file, padded=True)
    system = next((s for s in sets if s["type"] == 164), None)
    curves: list[Curve] = []
    motions: list[Motion] = []
    modes: list[ModeLine] = []
    questions: list[Question] = []
    coherence: dict[tuple[End, End], np.ndarray] = {}
    errors: dict[tuple[End, End], np.ndarray] = {}
    axis: np.ndarray | None = None
    places: dict[int, tuple[float, float, float]] = {}
    unscaled: dict[int, tuple[float, float, float]] = {}
    left: dict[str, int] = {}
    for number, record in enumerate(sets, 1):
        where = f"set {number}"
        if where in settings.leave_out:
            continue
        kind = int(record["type"])
        if kind == 58:
            function = record["func_type"]
            ends = _end(record, "rsp", settings.response), _end(record, "ref", settings.reference)
            if max(abs(int(record["rsp_dir"])), abs(int(record["ref_dir"]))) > 3:
                left["function in rotation"] = left.get("function in rotation", 0) + 1
            elif function == FRF:
                curve, asked = _curve(file, where, record, ends, system, settings)
                curves.append(curve)
                questions += asked
            elif function == COHERENCE:
                coherence[ends] = np.asarray(np.real(record["data"]), float)
            elif function == RECORD:
                motions.append(_motion(file, where, record, ends))
            elif record["id2"].strip() == STANDARD_ERROR:  # of our own files, in the unit of the FRF
                errors[ends] = np.asarray(np.real(record["data"]), float)
            elif record["id2"].strip() == AXIS:
                axis = np.asarray(np.real(record["data"]), float)
            else:
                name = LEFT.get(function, f"function of type {function}")
                left[name] = left.get(name, 0) + 1
        elif kind in (15, 2411):
            scale = 1 / float(system["length"]) if system else 1.0
            nodes, xyz = _nodes(record)
            told = {int(n): (float(x) * scale, float(y) * scale, float(z) * scale) for n, (x, y, z) in zip(nodes, xyz, strict=True)}
            (places if system else unscaled).update(told)
        elif kind in (55, 2414) and (mode := _mode(record)) is not None:
            modes.append(mode)
        elif kind not in (151, 164, 18, 82, 2412):
            left[f"dataset {kind}"] = left.get(f"dataset {kind}", 0) + 1
    curves = [replace(c, sd=errors.get((c.response, c.reference)), frequency=c.frequency if axis is None else axis) for c in curves]
    notes = [f"{file.name}: {count} x {name} left out: not used by a campaign" for name, count in left.items()]
    return Content(file, tuple(curves), _joined(motions), tuple(modes), places, unscaled, coherence, tuple(notes), tuple(questions))


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
    top, bottom = (record[f"{side}_axis_units_lab"].strip() for side in ("ordinate", "orddenom"))
    word = record["ordinate_axis_lab"].strip()
    top, bottom = ("" if t == "NONE" else t for t in (top, bottom))
    joined = f"({top})/{bottom}" if top and bottom else top
    typed = units.OF_TYPE.get(number, "") if below in (FORCE, 0) else ""
    unit = settings.unit or joined
    questions: list[Question] = []
    if not unit and not joined and typed and system is not None:
        scale = _factor(file, system, "force") / _factor(file, system, "length")
        value = np.asarray(record["data"]) * scale
        return Curve(file, where, *ends, np.asarray(record["x"], float), value, settings.quantity or typed, RATIO[number]), []
    said = {"type": typed, "unit": (units.of_frf(joined) or ("",))[0], "label": units.named(word)}
    heard = {q for q in said.values() if q}
    if not settings.quantity and len(heard) > 1:
        words = f"its header says {KINDS[number].name}, " if typed else ""
        words += f"its label {word!r} is that of a {said['label']}, " if said["label"] else ""
        words += f"its unit {joined!r} that of a {said['unit']}" if said["unit"] else "its unit says nothing"
        questions.append(Question(file.name, "quantity", f"which quantity its FRFs are: {words}"))
    quantity = settings.quantity or (heard.pop() if len(heard) == 1 else "")
    return Curve(file, where, *ends, np.asarray(record["x"], float), np.asarray(record["data"]), quantity, unit), questions


def _factor(file: Path, system: Mapping[str, Any], of: str) -> float:
    """To SI, of a set of units (164). BadInput for what is no factor."""
    value = float(system[of])
    if not SMALLEST <= value <= LARGEST:
        raise BadInput(f"{file}: data set 164: the factor of {of} = {value:g}: must lie between {SMALLEST:g} and {LARGEST:g}")
    return value


def _motion(file: Path, where: str, record: Mapping[str, Any], ends: tuple[End, End]) -> Motion:
    label = record["ordinate_axis_units_lab"].strip()
    force = record["ordinate_spec_data_type"] == FORCE or units.of_force(label) is not None or "force" in record["ordinate_axis_lab"].lower()
    x = np.asarray(record["x"], float)
    step = float(record["abscissa_inc"]) if record.get("abscissa_inc") else float(x[1] - x[0])
    value = np.asarray(np.real(record["data"]), float)[None]
    return Motion(file, where, ends[0], force, step, value, "" if label == "NONE" else label)


def _joined(motions: list[Motion]) -> tuple[Motion, ...]:
    """Records of one channel that follow each other in a file are its hits."""
    found: dict[tuple[End, bool], Motion] = {}
    for m in motions:
        key = (m.end, m.force)
        if key in found and found[key].value.shape[-1] == m.value.shape[-1]:
            found[key] = replace(found[key], value=np.concatenate([found[key].value, m.value]))
        else:
            found[key] = m
    return tuple(found.values())


def _nodes(record: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(record["node_nums"], int), np.stack([np.asarray(record[k], float) for k in "xyz"], axis=-1)


def _mode(record: Mapping[str, Any]) -> ModeLine | None:
    """Frequency, viscous damping and shape of a set of modal data; None where it is a static shape or holds none."""
    if "eig" in record:
        pole = complex(record["eig"])
        if pole.imag > 0:
            return ModeLine("", "unknown", abs(pole) / (2 * np.pi), None, -pole.real / abs(pole) if pole.real < 0 else None, shape=_shape(record))
    normal = record.get("analysis_type") == 2
    frequency = float(record.get("freq", record.get("record12_field2", 0.0)) or 0.0) if normal else 0.0  # 2414: record 12 holds them
    damping = float(record.get("modal_damp_vis", record.get("record12_field5", 0.0)) or 0.0)
    return ModeLine("", "unknown", frequency, None, damping if 0 < damping < 1 else None, shape=_shape(record)) if frequency > 0 else None


def _shape(record: Mapping[str, Any]) -> tuple[tuple[End, complex], ...]:
    """What a set of modal data tells of how its nodes move, in displacement, velocity or acceleration alike."""
    nodes = np.asarray(record.get("node_nums", ()), int)
    if "data_at_node" in record:  # 2414: real and imaginary parts beside each other where values are complex
        values = np.asarray(record["data_at_node"], float)
        if values.ndim != 2 or len(values) != len(nodes) or (record.get("data_type") in COMPLEX and values.shape[1] % 2):
            return ()
        columns = list((values[:, ::2] + 1j * values[:, 1::2] if record.get("data_type") in COMPLEX else values + 0j).T)
    else:
        columns = [np.asarray(record[name], complex) for name in ("r1", "r2", "r3") if name in record]
    if len(columns) < 3 or any(len(column) != len(nodes) for column in columns):
        return ()
    return tuple((End(int(node), f"+{axis}"), complex(v)) for axis, column in zip("XYZ", columns, strict=False) for node, v in zip(nodes, column, strict=True))
