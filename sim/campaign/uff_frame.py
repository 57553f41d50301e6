"""The frame of a UFF file, checked byte by byte: markers in pairs, nothing between sets, and as many values as headers say.

pyuff pairs whatever markers it finds and cuts values to whole numbers, so that a damaged byte makes it drop or shift FRFs in silence.
"""

from __future__ import annotations

import re
from pathlib import Path

from thermospindle.model.errors import BadInput

MARKER = re.compile(rb"(?m)^    -1 {0,74}\r?$\n?")
ANY_MARKER = re.compile(rb"    -1 {0,74}(\r\n?|\n|\Z)")  # in binary values, which have no lines
HEADER = 11  # lines of a dataset 58 between its number and its values
WORDS = {2: (1, 4), 4: (1, 8), 5: (2, 4), 6: (2, 8)}
"""Numbers in a value, and bytes in a number, by the ordinate's data type: real or complex, single or double precision."""


def check_frame(path: Path, data: bytes) -> list[int]:
    """The types of a file's datasets in their order; `BadInput` names the set whose frame is damaged."""
    types: list[int] = []
    at = 0
    while data[at:].strip():
        where = f"{path}: set {len(types) + 1}"
        begin = MARKER.search(data, at)
        if begin is None or data[at : begin.start()].strip():
            raise BadInput(f"{where}: does not begin with a line '    -1'; something stands between the sets, or a byte is damaged")
        line = data[begin.end() :].split(b"\n", 1)[0]
        number = line[:6].strip()
        if not number.isdigit() or int(number) == 0:
            raise BadInput(f"{where}: {line[:20].decode(errors='replace').strip()!r} is no number of a dataset; a byte is damaged")
        types.append(int(number))
        start = begin.end() + len(line) + 1
        if types[-1] == 58:
            _check_ordinate(where, data, start)
        if types[-1] == 58 and line[6:7].lower() == b"b":
            at = _end_of_binary(where, data, start, line)
            continue
        end = MARKER.search(data, begin.end())
        if end is None:
            raise BadInput(f"{where}: does not end with a line '    -1'; it is cut off, or a byte is damaged")
        if types[-1] == 58 and b"_" in data[_lines(data, start)[1] : end.start()]:
            raise BadInput(f"{where}: has '_' in its values; only numbers in digits 0 to 9 are allowed")
        at = end.end()
    return types


def _field(text: bytes, low: int, high: int) -> int:
    """A whole number of a header line; -1 where there is none."""
    digits = text[low:high].strip()
    return int(digits) if digits.isdigit() else -1


def _check_ordinate(where: str, data: bytes, start: int) -> None:
    lines = _lines(data, start)[0]
    numbers = lines[5][:30] + lines[5][41:55] + lines[5][66:80] + lines[6]  # without the names of the response and the reference
    if b"_" in numbers:
        raise BadInput(f"{where}: has '_' in the numbers of its header; only digits 0 to 9 are allowed")
    kind = _field(lines[6], 0, 10)
    if kind not in WORDS:
        raise BadInput(f"{where}: ordinate data type {kind if kind >= 0 else 'unreadable'}; allowed are {', '.join(map(str, WORDS))}")


def _lines(data: bytes, start: int) -> tuple[list[bytes], int]:
    """The header lines of a dataset 58, and where its values begin."""
    lines = []
    for _ in range(HEADER):
        stop = data.find(b"\n", start) + 1 or len(data)
        lines.append(data[start:stop])
        start = stop
    return lines, start


def _end_of_binary(where: str, data: bytes, start: int, line: bytes) -> int:
    """Where a binary dataset 58 has ended; its values must fill it, and be as many as its header says in two places."""
    lines, start = _lines(data, start)
    shape = lines[6]
    count, even = _field(shape, 10, 20), _field(shape, 20, 30)
    per_value, width = WORDS[_field(shape, 0, 10)]
    unit = (per_value + (even == 0)) * width
    end = ANY_MARKER.search(data, start)
    if end is None:
        raise BadInput(f"{where}: does not end with a line '    -1'; it is cut off, or a byte is damaged")
    held = end.start() - start
    if held != count * unit and data[start : end.start()][count * unit :].strip(b"\r\n"):
        whole = held % unit == 0
        amount = f"{held // unit} values" if whole else f"{held} bytes of values"
        raise BadInput(f"{where}: holds {amount}, its header says {count}{'' if whole else f' values of {unit} bytes'}")
    if held < count * unit:
        raise BadInput(f"{where}: holds {held // unit} values, its header says {count}")
    said = _field(line, 31, 43)
    if said not in (count * unit, count * unit // per_value):  # pyuff counts one number for a complex value
        raise BadInput(f"{where}: its header says {said} bytes of values, and {count} values of {unit} bytes")
    return end.end()
