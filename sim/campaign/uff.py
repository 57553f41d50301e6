"""UFF files: the FRFs of one modal test as dataset 58 in, and out as binary double precision (58b).

`read_uff` returns whatever a file holds; `read_frf` and `write_frf` know the sets of a campaign:

=================  ==================================================================================================
function type 4    FRF, complex; numerator displacement (8), velocity (11) or acceleration (12), denominator force (13)
function type 6    coherence, real, of the FRF with the same nodes
function type 0    with ID line 2 'standard error': real, unit of the FRF with the same nodes; see `Frf.sd`
function type 0    with ID line 2 'frequency axis': the frequencies in double precision, for every set of the file; written
                   only where the header, which holds six digits, would round them
=================  ==================================================================================================

`read_motion` knows those of a runout test: function type 1, time response, and 12, spectrum, of displacement.

Frequencies in uneven steps, as of a logarithmic sweep, stand beside the values in every set (abscissa spacing 0).

UFF has no official type for the last two of the table. Other datasets and function types are left alone. The format is described by UC-SDRL
(www.ceas3.uc.edu/sdrluff). A unit is what its label says; without a label, SI over the factors of the file's dataset 164.
pyuff 2.5.8 turns NaN into zero on writing, halves the byte count of complex sets, and drops a set without end: seen to here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyuff

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput, absent
from thermospindle.model.scene.fields import SMALLEST
from thermospindle.model.types import Integers
from thermospindle.sim.campaign.uff_frame import check_frame
from thermospindle.sim.identification.frf import Frf, even, gap

STANDARD_ERROR, AXIS = "standard error", "frequency axis"
LARGEST = 1e15  # of any value in any unit; sums of squares of larger ones would overflow
A_LINE = 6  # numbers on a line of an ASCII set
NODES = {"response": ("rsp_node", "rsp_dir"), "reference": ("ref_node", "ref_dir")}


class Kind(NamedTuple):
    """A specific data type of dataset 58: its unit exponents (length, force, temperature) and factors of labels to SI."""

    name: str
    exponents: tuple[int, int, int]
    units: Mapping[str, float]


_STANDARD_GRAVITY, _POUND_FORCE, _INCH = 9.80665, 4.4482216152605, 0.0254
FORCE = 13
KINDS = {
    8: Kind("displacement", (1, 0, 0), {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9, "in": _INCH, "mil": 1e-3 * _INCH, "mils": 1e-3 * _INCH, "thou": 1e-3 * _INCH}),
    11: Kind("velocity", (1, 0, 0), {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6, "in/s": _INCH, "ips": _INCH, "mil/s": 1e-3 * _INCH, "mils/s": 1e-3 * _INCH}),
    12: Kind(
        "acceleration",
        (1, 0, 0),
        {"m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0, "mm/s^2": 1e-3, "mm/s2": 1e-3, "mm/s²": 1e-3, "in/s^2": _INCH, "g": _STANDARD_GRAVITY},
    ),
    FORCE: Kind("excitation force", (0, 1, 0), {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": _POUND_FORCE}),
}
QUANTITIES = {"receptance": 8, "mobility": 11, "accelerance": 12}
"""The specific data type of an FRF's numerator."""


def read_uff(path: Path, padded: bool = False) -> list[dict[str, Any]]:
    """Every set of a UFF file in its order, as pyuff's dictionaries; 'type' is the dataset, the only key of an unknown one.

    Node numbers are integers. Bytes of the headers that are not UTF-8 become U+FFFD. With `padded`, zeros that fill a last line of values
    beyond the number of the header, as some analysers write them, are left out.
    """
    if not path.is_file():
        raise BadInput(f"{path}: {absent(path)}")
    data = path.read_bytes()
    if not data.rstrip().endswith(b"-1"):
        raise BadInput(f"{path}: does not end with a line '    -1' as every UFF file does; it is cut off, or no UFF file")
    types = check_frame(path, data)
    reader = pyuff.UFF(str(path))
    if list(reader.get_set_types()) != types:
        raise BadInput(f"{path}: has a line that ends with '    -1' inside a dataset; datasets cannot be told apart")
    sets = []
    for index, dataset in enumerate(types):
        where = f"{path}: set {index + 1}"
        try:
            content = reader.read_sets(index)
        except Exception as error:
            _raise_hidden(error)
            raise BadInput(f"{where}: cannot be read as dataset {dataset}; it is damaged, or not in the published form") from None
        if dataset == 58 and padded and 0 < len(content["data"]) - content["num_pts"] < A_LINE and not content["data"][content["num_pts"] :].any():
            content |= {key: content[key][: content["num_pts"]] for key in ("data", "x")}
        if dataset == 58 and len(content["data"]) != content["num_pts"]:
            raise BadInput(f"{where}: holds {len(content['data'])} values, its header says {content['num_pts']}")
        if dataset == 58 and content.get("fp_format", 2) != 2:
            raise BadInput(f"{where}: floating point format {content['fp_format']}; only 2, IEEE 754, can be read")
        if dataset == 82:
            content["nodes"] = _whole_numbers(where, content["nodes"][: content["n_nodes"]])
        if dataset == 15:
            content |= {key: _whole_numbers(where, content[key]) for key in ("node_nums", "def_cs", "disp_cs", "color")}
        sets.append(content)
    return sets


def _whole_numbers(where: str, values: Any) -> Integers:
    numbers = np.asarray(values, float)
    if not np.all(np.abs(numbers) < 2**31):
        raise BadInput(f"{where}: a node, colour or coordinate system has a number beyond {2**31 - 1}, or none")
    return numbers.astype(np.intp)


def read_frf(path: Path, quantity: str, points: Sequence[Point]) -> Frf:
    """The FRFs of a UFF file in SI, along the points' directions; every response must have an FRF from every reference.

    Raises `BadInput` naming file and set for units that are not those of `quantity` or not known, nodes that are no points,
    directions off the point's axis, NaN, missing lines among even ones, differing frequencies, and missing or doubled sets.
    """
    sets = read_uff(path)
    system = next((s for s in sets if s["type"] == 164), None)
    exact = next((s["data"] for s in sets if s["type"] == 58 and _role(s) == AXIS), None)
    frequency: np.ndarray | None = None
    found: dict[str, dict[tuple[int, int], np.ndarray]] = {"FRF": {}, "coherence": {}, STANDARD_ERROR: {}}
    for number, record in enumerate(sets, 1):
        role = _role(record) if record["type"] == 58 else None
        if role not in found:
            continue
        pair = record["rsp_node"], record["ref_node"]
        where = f"{path}: set {number} ({role} of response {pair[0]}, reference {pair[1]})"
        sign = _sign(where, record, "response", points) * _sign(where, record, "reference", points)
        lines = _frequency(where, record, exact)
        frequency = lines if frequency is None else frequency
        if not np.array_equal(lines, frequency):
            spans = [f"{len(f)} from {f[0]:g} to {f[-1]:g} Hz" for f in (lines, frequency)]
            raise BadInput(f"{where}: its lines are {spans[0]}, but {spans[1]} in the sets before; they must be the same")
        value = record["data"]
        if not np.all(np.isfinite(value)):
            raise BadInput(f"{where}: NaN or infinite at {lines[~np.isfinite(value)][0]:g} Hz; only finite numbers are allowed")
        if np.iscomplexobj(value) != (role == "FRF"):
            raise BadInput(f"{where}: its values are {'real' if role == 'FRF' else 'complex'}; an FRF is complex, the others real")
        if role != "coherence":
            scale = _scale(where, record, "ordinate", QUANTITIES[quantity], system) / _scale(where, record, "orddenom", FORCE, system)
            value = value * (scale * sign if role == "FRF" else scale)
        if pair in found[role]:
            raise BadInput(f"{where}: stands twice in this file; one {role} is allowed for a pair of nodes")
        found[role][pair] = value
    if frequency is None or not found["FRF"]:
        raise BadInput(f"{path}: holds no FRF (dataset 58, function type 4)")
    responses, references = (tuple(dict.fromkeys(pair[k] for pair in found["FRF"])) for k in (0, 1))
    arrays = {role: _stack(path, role, pairs, responses, references) for role, pairs in found.items() if pairs}
    names = {p.node: p.name for p in points}
    return Frf(frequency, arrays["FRF"], responses, references, quantity, arrays.get("coherence"), arrays.get(STANDARD_ERROR), names)


MOTIONS = {1: ("time", 17, "s"), 12: ("spectrum", 18, "Hz")}
"""Function types of displacement records: what they are, the type of their abscissa and its unit."""


def read_motion(path: Path, points: Sequence[Point]) -> tuple[str, tuple[int, ...], np.ndarray, np.ndarray]:
    """The displacements of a UFF file: time or spectrum, nodes, abscissa (n,) in s or Hz, values (nodes, n) m along the points' directions.

    Raises `BadInput` naming file and set for what is no displacement, units not known, nodes that are no points, NaN, and sets that differ.
    """
    sets = read_uff(path)
    system = next((s for s in sets if s["type"] == 164), None)
    kinds, values, axis = set(), {}, None
    for number, record in enumerate(sets, 1):
        if record["type"] != 58 or record["func_type"] not in MOTIONS:
            continue
        kind, abscissa, unit = MOTIONS[record["func_type"]]
        node = record["rsp_node"]
        where = f"{path}: set {number} ({kind} of node {node})"
        sign = _sign(where, record, "response", points)
        label = record["abscissa_axis_units_lab"].strip()
        if record["abscissa_spec_data_type"] not in (0, abscissa) or label not in (unit, "", "NONE"):
            raise BadInput(
                f"{where}: abscissa of type {record['abscissa_spec_data_type']} in {label!r}; allowed is type {abscissa} in {unit}"
            )
        scale = _scale(where, record, "ordinate", QUANTITIES["receptance"], system)
        value = record["data"] * (scale * sign)
        if not np.all(np.isfinite(value)):
            raise BadInput(f"{where}: NaN or infinite; only finite numbers are allowed")
        if np.abs(value).max() > LARGEST:
            raise BadInput(f"{where}: {np.abs(value).max():.3g} m: nothing moves so; its values are damaged")
        if np.iscomplexobj(value) != (kind == "spectrum"):
            raise BadInput(f"{where}: its values are {'real' if kind == 'spectrum' else 'complex'}; a spectrum is complex, a record real")
        axis = record["x"] if axis is None else axis
        kinds.add(kind)
        if len(kinds) > 1 or not np.array_equal(record["x"], axis):
            raise BadInput(f"{where}: differs in kind or abscissa from the sets before; they must be the same")
        if node in values:
            raise BadInput(f"{where}: stands twice in this file; one is allowed for a node")
        values[node] = value
    if axis is None:
        raise BadInput(f"{path}: holds no displacement (dataset 58, function type 1 or 12)")
    return kinds.pop(), tuple(values), np.asarray(axis, float), np.array(list(values.values()))


def _role(record: Mapping[str, Any]) -> str | None:
    """What a dataset 58 is to a campaign; None for what it has no use for."""
    label = record["id2"].strip()
    return {4: "FRF", 6: "coherence", 0: label if label in (STANDARD_ERROR, AXIS) else None}.get(record["func_type"])


def _stack(path: Path, role: str, pairs: Mapping[tuple[int, int], np.ndarray], responses: Sequence[int], references: Sequence[int]):
    """Array (responses, references, n) of the sets of one role; none may be missing, none too many."""
    for pair in (*((r, q) for r in responses for q in references), *pairs):
        if pair not in pairs or pair[0] not in responses or pair[1] not in references:
            fault = "has no FRF" if pair in pairs else "is missing"
            raise BadInput(f"{path}: {role} of response {pair[0]}, reference {pair[1]}: {fault}; every pair needs its set")
    return np.array([[pairs[r, q] for q in references] for r in responses])


def axis_number(direction: Sequence[float]) -> int:
    """Direction in UFF's count: 1, 2, 3 for +X, +Y, +Z, negative for the opposite."""
    axis = int(np.argmax(np.abs(direction)))
    return axis + 1 if direction[axis] > 0 else -(axis + 1)


def _sign(where: str, record: Mapping[str, Any], end: str, points: Sequence[Point]) -> int:
    """+1 or -1: the set's direction at its response or reference against the direction of the campaign's point."""
    node, number = (record[key] for key in NODES[end])
    point = next((p for p in points if p.node == node), None)
    if point is None:
        raise BadInput(f"{where}: {end} node {node} is no point of the campaign; allowed are {[p.node for p in points]}")
    own = axis_number(point.direction)
    if abs(number) != abs(own):
        raise BadInput(f"{where}: {end} direction {number} is not along the point's; allowed are {own} and {-own}")
    return 1 if number == own else -1


def _frequency(where: str, record: Mapping[str, Any], exact: np.ndarray | None) -> np.ndarray:
    """Frequencies (n,) in Hz of a set, rising; in even steps (the file's `exact` ones where it has
    them) unless the set says that they are not."""
    kind, label, lines = record["abscissa_spec_data_type"], record["abscissa_axis_units_lab"].strip(), record["x"]
    if kind not in (0, 18) or label not in ("Hz", "", "NONE") or (kind == 0 and label != "Hz"):
        raise BadInput(f"{where}: abscissa of type {kind} in {label!r}; only frequency (18) in Hz is allowed")
    if exact is not None:
        if exact.shape != lines.shape or not np.allclose(exact, lines, rtol=1e-5, atol=0):
            raise BadInput(f"{where}: its header contradicts the frequency axis stored in the file")
        lines = exact
    steps = np.diff(lines)
    step = np.median(steps) if len(steps) else 0.0
    if step <= 0 or lines[0] < 0 or steps.min() <= 0:
        raise BadInput(f"{where}: abscissa: at least two lines of rising frequency, from 0 Hz, are needed")
    if (at := gap(lines, sweep=record["abscissa_spacing"] == 0)) is not None:
        raise BadInput(f"{where}: from {lines[at]:g} to {lines[at + 1]:g} Hz among steps of {step:g} Hz; no line may be missing")
    return lines


def _scale(where: str, record: Mapping[str, Any], side: str, wanted: int, system: Mapping[str, Any] | None) -> float:
    """Factor to SI of the FRF's numerator ('ordinate') or denominator ('orddenom'); `system` is the file's dataset 164."""
    part = "denominator" if side == "orddenom" else "numerator"
    kind = KINDS[wanted]
    number, label = record[f"{side}_spec_data_type"], record[f"{side}_axis_units_lab"].strip()
    exponents = tuple(record[f"{side}_{unit}_unit_exp"] for unit in ("len", "force", "temp"))
    if number not in (wanted, 0, 1):
        name = KINDS[number].name if number in KINDS else "another quantity"
        raise BadInput(f"{where}: {part} is {name} (type {number}); allowed is {kind.name} (type {wanted})")
    if any(exponents) and exponents != kind.exponents:
        raise BadInput(f"{where}: {part}: unit exponents {exponents} are not those of {kind.name}, {kind.exponents}")
    if label in ("", "NONE") and number == wanted and system is not None:
        return 1.0 / factor(where, system, "force" if wanted == FORCE else "length")  # "to convert to SI divide by the factor"
    if label not in kind.units:
        raise BadInput(f"{where}: {part} unit {label!r}; allowed for {kind.name} are {', '.join(kind.units)}")
    return kind.units[label]


def factor(where: object, system: Mapping[str, Any], of: str) -> float:
    """What values in the file's unit of `of` ("length", "force") are divided by for SI, of its
    dataset 164. `BadInput` for what is no factor."""
    value = float(system[of])
    if not SMALLEST <= value <= LARGEST:
        raise BadInput(f"{where}: data set 164: the factor of {of} = {value:g}: must lie between {SMALLEST:g} and {LARGEST:g}")
    return value


def write_frf(path: Path, frf: Frf, points: Sequence[Point], title: str, test: str) -> None:
    """Write a new file of 58b sets, references outermost; complex128 and float64 read back bit for bit."""
    if path.exists():
        raise BadInput(f"{path}: exists already; only a new file is written")
    shape = (len(frf.response_nodes), len(frf.reference_nodes), len(frf.frequency))
    arrays = {"FRF": frf.value, "coherence": frf.coherence, STANDARD_ERROR: frf.sd}
    for role, array in arrays.items():
        if array is not None and (array.shape != shape or not np.all(np.isfinite(array))):
            raise BadInput(f"{path}: {role}: needs finite numbers of shape {shape}, has shape {array.shape} or a NaN in it")
    start, step = frf.frequency[0], frf.frequency[1] - frf.frequency[0]
    header = float(f"{start:.5e}") + np.arange(shape[2]) * float(f"{step:.5e}")
    if even(frf.frequency) > 0 and not np.array_equal(header, frf.frequency):
        ends = {"rsp_node": 0, "rsp_dir": 0, "ref_node": 0, "ref_dir": 0}
        _append(
            path,
            {"func_type": 0, "id1": title, "id2": AXIS, "id4": test, **ends, **_unit("ordinate", 18, "Hz")},
            frf,
            frf.frequency,
        )
    kind = QUANTITIES[frf.quantity]
    units = _unit("ordinate", kind, next(iter(KINDS[kind].units))) | _unit("orddenom", FORCE, "N")
    forms = {"FRF": (4, units), "coherence": (6, {}), STANDARD_ERROR: (0, units)}
    for j, reference in enumerate(frf.reference_nodes):
        for i, response in enumerate(frf.response_nodes):
            ends = _end(path, "rsp", points, response) | _end(path, "ref", points, reference)
            for role, (number, unit) in forms.items():
                if (array := arrays[role]) is not None:
                    _append(path, {"func_type": number, "id1": title, "id2": role, "id4": test, **ends, **unit}, frf, array[i, j])


def _unit(side: str, kind: int, label: str) -> dict[str, Any]:
    return {f"{side}_spec_data_type": kind, f"{side}_axis_units_lab": label}


def _end(path: Path, end: str, points: Sequence[Point], node: int) -> dict[str, Any]:
    point = next((p for p in points if p.node == node), None)
    if point is None:
        raise BadInput(f"{path}: node {node} is no point of the campaign; allowed are {[p.node for p in points]}")
    if len(point.name.encode()) > 10:
        raise BadInput(f"{path}: points.{node}.name = {point.name!r}: longer than the ten bytes of a UFF 58 entity name")
    return {f"{end}_ent_name": point.name, f"{end}_node": node, f"{end}_dir": axis_number(point.direction)}


def _append(path: Path, header: dict[str, Any], frf: Frf, data: np.ndarray) -> None:
    """Append one 58b set with `data` (n,), its frequencies beside the values where their steps are not even."""
    lines = {key: " ".join(header[key].split()).encode("ascii", "replace").decode()[:80] or "NONE" for key in ("id1", "id2", "id4")}
    spaced = even(frf.frequency) > 0
    content = {"type": 58, "binary": 1, "abscissa_spacing": int(spaced), "x": frf.frequency, "data": data}
    content |= _unit("abscissa", 18, "Hz") | _unit("orddenom", 0, "NONE") | header | lines
    begin = path.stat().st_size if path.exists() else 0
    try:
        pyuff.UFF(str(path)).write_sets(content, mode="add")
    except Exception as error:
        _raise_hidden(error)
        raise
    with path.open("r+b") as file:  # pyuff counts 8 bytes for a complex value
        file.seek(begin + 38)
        file.write(b"%12d" % (data.nbytes + (0 if spaced else frf.frequency.nbytes)))


def _raise_hidden(error: BaseException | None) -> None:
    """Raise what pyuff's bare `except` has turned into an exception of its own: Ctrl-C, a full disk, too little memory."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt | OSError | MemoryError):
            raise error
        error = error.__context__
