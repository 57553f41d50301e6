"""Tables of numbers in text files: any usual separator, decimal point or comma, complex cells, headings and units above the numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from thermospindle.model.errors import BadInput

SEPARATORS = ("\t", ";", ",", None)  # None: any white space
COMMENT = re.compile(r"^\s*(#|%|//|!)+\s?")
FORTRAN = re.compile(r"^([-+]?(?:\d+\.?\d*|\.\d+))[dD]([-+]?\d+)$")  # 1.5D-03, as Fortran writes double precision
NUMBER_LIKE = re.compile(r"[-+]?\d[\d.,' ]*([eE][-+]?\d+)?")
THOUSANDS = re.compile(r"[-+]?\d{1,3}([.,' ]\d{3})+([.,]\d+)?")
LONGEST_HEADING = 200
FEW = 3  # rows above a line that is none, which tell that it stands among them
LARGEST_FILE = 400e6  # bytes


@dataclass(frozen=True, eq=False)
class TextTable:
    """`heading` and `unit` of each column ("" where there is none), `values` (rows, columns), real or complex."""

    file: Path
    heading: tuple[str, ...]
    unit: tuple[str, ...]
    values: np.ndarray


def text_of(file: Path) -> str:
    """The text of a file in UTF-8, UTF-16 or, where it is neither, Latin 1."""
    if file.stat().st_size > LARGEST_FILE:
        raise BadInput(f"{file}: {file.stat().st_size / 1e6:.0f} MB of text; at most {LARGEST_FILE / 1e6:.0f} are read: export it as .npz or UFF 58b")
    data = file.read_bytes()
    if b"\0" in data[:4000] and not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise BadInput(f"{file}: is no text; UFF, CSV and other text tables, .npz and .mat are read; a sheet is saved as CSV first")
    for encoding in ("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig", "latin-1"):
        try:
            return data.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise BadInput(f"{file}: is no text")


def read_table(file: Path) -> TextTable:
    """The one table of numbers of a text file. Raises `BadInput` where there is none, or where a line among the numbers has other cells."""
    lines = [(number, line) for number, line in enumerate(text_of(file).splitlines(), 1) if line.strip(" \t;,")]
    separator, comma = _manner(file, [line for _, line in lines])
    lines = _with_values(lines, separator, comma)
    rows, first = _numbers(file, lines, separator, comma)
    width = len(rows[0])
    above = [COMMENT.sub("", line) for _, line in lines[:first]]
    _refuse_commas(file, above, separator, lines[first][1])
    told = [cells for line in above if len(cells := _headings(line, separator)) == width or _fits(cells, width)]
    rows_above = [(*cells, *[""] * width)[:width] for cells in told]
    unit: tuple[str, ...] = ("",) * width
    heading = tuple(c.strip() for c in rows_above[-1]) if rows_above else unit
    if len(rows_above) > 1 and _are_units(rows_above[-1]):
        heading, unit = tuple(c.strip() for c in rows_above[-2]), heading
    if (longest := max(map(len, (*heading, *unit)), default=0)) > LONGEST_HEADING:
        raise BadInput(f"{file}: a heading of {longest} letters; at most {LONGEST_HEADING} are allowed")
    dtype = complex if any(isinstance(c, complex) for c in rows[0]) or any(isinstance(c, complex) for c in rows[-1]) else float
    try:
        values = np.array(rows, dtype)
    except (TypeError, ValueError):
        values = np.array(rows, complex)
    return TextTable(file, heading, unit, values)


def _with_values(lines: list[tuple[int, str]], separator: str | None, comma: bool) -> list[tuple[int, str]]:
    """Without the lines at either end of the numbers that have a first cell alone: of an analyser's band where it has no values."""

    def alone(line: str) -> bool:
        first, *others = (c.strip().strip('"') for c in line.split(separator))
        return bool(others) and NUMBER_LIKE.fullmatch(first) is not None and {*map(str.lower, others)} <= {"", "nan"}

    while lines and alone(lines[-1][1]):
        lines = lines[:-1]
    start = next((k for k, (_, line) in enumerate(lines) if alone(line) or len(_parse(_cells(line, separator), comma) or ()) > 1), 0)
    end = next((k for k in range(start, len(lines)) if not alone(lines[k][1])), start)
    return [*lines[:start], *lines[end:]]


def _refuse_commas(file: Path, above: list[str], separator: str | None, line: str) -> None:
    """`BadInput` where commas stand between columns and in numbers: as many headings as every two
    cells of whole numbers, none with a decimal point."""
    cells = _cells(line, ",")
    halves = {1: cells[::2], 0: cells[1::2]}  # of the first column whole numbers alone, maybe
    count = len(_headings(above[-1], ",")) if above and separator == "," else 0
    for first, parts in ((0, halves[0]), (1, halves[1][1:])):
        if count > 1 and len(cells) == 2 * count - first and "." not in line and all(part.isdigit() for part in parts):
            raise BadInput(
                f"{file}: {count} headings stand over {len(cells)} numbers: with commas between columns and in numbers nobody can tell which is which; "
                "export it with semicolons or tabs between columns, or with decimal points"
            )


def _headings(line: str, separator: str | None) -> list[str]:
    """The cells of a line of headings; a separator within brackets or quotes, as in H(3,1), is none."""
    if separator is None:
        return line.split()
    outside = re.findall(rf'(?:"[^"]*"|\([^()]*\)|\[[^\[\]]*\]|[^{separator}"])*(?:{separator}|$)', line)
    return [cell.removesuffix(separator).strip().strip('"') for cell in (outside[:-1] if outside and not outside[-1] else outside)] + (
        [""] if line.rstrip("\n").endswith(separator) else []
    )


def _fits(cells: list[str], width: int) -> bool:
    """Headings over columns that end in a separator, or with an empty last unit."""
    return len(cells) == width + 1 and not cells[-1].strip()


def _are_units(cells: tuple[str, ...]) -> bool:
    known = re.compile(r"^[\[(]*(Hz|kHz|s|sec|ms|N|lbf|kN|mN|g|V|deg|°|rad|dB.*|1|-|.*/.*|m|mm|um|µm)[\])]*(\(N\))?$", re.IGNORECASE)
    return all(known.match(c.strip()) or not c.strip() for c in cells) and any(c.strip() for c in cells)


def _manner(file: Path, lines: list[str]) -> tuple[str | None, bool]:
    """Separator and decimal comma by which most of the last lines are numbers, in most columns."""
    sample = lines[-60:]
    best, found = (0, 0), None
    for separator in SEPARATORS:
        for comma in (False, True):
            if comma and separator == ",":
                continue
            parsed = [_parse(_cells(line, separator), comma) for line in sample]
            counts = [len(p) for p in parsed if p]
            width = max(counts, key=counts.count) if counts else 0
            score = (sum(p is not None and len(p) == width for p in parsed), width)
            if width and score > best:
                best, found = score, (separator, comma)
    if found is None:
        for line in reversed(sample):
            for cells in (_cells(line, separator) for separator in ("\t", ";", None)):
                if len(cells) > 1 and all(NUMBER_LIKE.fullmatch(c) for c in cells) and (grouped := [c for c in cells if THOUSANDS.fullmatch(c)]):
                    raise BadInput(f"{file}: {grouped[0]!r}: thousands are written without a separator")
        raise BadInput(f"{file}: holds no table of numbers; columns separated by tabs, semicolons, commas or spaces are read. A log of the tests is none: leave it out of the files; what it tells stands in the mapping, at [[tests]]")
    return found


def _cells(line: str, separator: str | None) -> list[str]:
    cells = [c.strip().strip('"') for c in line.split(separator)]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _parse(cells: list[str], comma: bool) -> list[float | complex] | None:
    try:
        return [_number(c, comma) for c in cells]
    except ValueError:
        return None


def _of_either(cells: list[str]) -> list[float | complex] | None:
    """A row with decimal points, or commas."""
    return _parse(cells, False) or _parse(cells, True)


def _number(text: str, comma: bool) -> float | complex:
    if comma:
        if "." in text:
            raise ValueError(text)
        text = text.replace(",", ".")
    elif "_" in text:
        raise ValueError(text)
    try:
        return float(text)
    except ValueError:
        if double := FORTRAN.match(text):
            return float(f"{double[1]}e{double[2]}")
        plain = text.strip("()").replace(" ", "").replace("i", "j").replace("*", "")
        return complex(plain)


def _numbers(file: Path, lines: list[tuple[int, str]], separator: str | None, comma: bool) -> tuple[list[list[float | complex]], int]:
    """The rows of the last block of numbers, and the index of its first line. The first one may
    hold what is no number, where its axis begins at 0."""
    rows: list[list[float | complex]] = []
    for index in range(len(lines) - 1, -1, -1):
        number, line = lines[index]
        row = _parse(_cells(line, separator), comma)
        if row is None or (rows and len(row) != len(rows[-1])):
            above = _parse(_cells(lines[index - 1][1], separator), comma) if index else None
            if row is not None and len(rows) == 1 and above is not None and len(above) == len(row):
                last = lines[index + 1][0]
                raise BadInput(f"{file}: line {last}: has {len(rows[0])} numbers, the lines before it {len(row)}; each must have as many: is the file cut off there?")
            if row is not None and rows and len(row) > 1:
                raise BadInput(f"{file}: line {number}: has {len(row)} numbers, the lines after it {len(rows[-1])}; each must have as many")
            if not rows:
                _refuse_gap(file, number, _cells(line, separator), len(above or ()), comma)
                raise BadInput(f"{file}: line {number}: {line.strip()[:60]!r} stands below the numbers; nothing may follow them")
            if row is None:
                _refuse_gap(file, number, _cells(line, separator), len(rows[-1]), comma)
                _refuse_among(file, lines[: index + 1], [_of_either(_cells(text, separator)) for _, text in lines[max(index - FEW, 0) : index]], rows[-1])
            break
        rows.append(row)
    else:
        index = -1
    rows.reverse()
    for at, row in enumerate(rows):
        if not np.all(np.isfinite(row)) and not (at == 0 and row[0] == 0):  # an FRF at 0 Hz, where 20 log10(0) and 0 / 0 are none
            column = int(np.argmin(np.isfinite(row))) + 1
            raise BadInput(f"{file}: line {lines[index + 1 + at][0]}: column {column}: NaN or infinite; only finite numbers are allowed")
    return rows, index + 1


def _refuse_among(file: Path, until: Sequence[tuple[int, str]], before: Sequence[list[float | complex] | None], after: list[float | complex]) -> None:
    """`BadInput` where the last of some lines is no row, and the few rows `before` it go on in the
    one `after` it: as many numbers, the first of which rises."""
    first = [abs(row[0]) for row in before if row is not None and len(row) == len(after)]
    if len(first) == FEW and all(a < b for a, b in pairwise([*first, abs(after[0])])):
        number, line = until[-1]
        raise BadInput(f"{file}: line {number}: {line.strip()[:60]!r} stands among the numbers, and is no row of {len(after)} of them")


def _refuse_gap(file: Path, number: int, cells: list[str], width: int, comma: bool) -> None:
    """`BadInput` where a line above numbers is one of them with a cell that is none; headings begin with a word."""
    bad = [k for k, c in enumerate(cells) if _parse([c], comma) is None]
    if len(cells) in (width, width - 1) and NUMBER_LIKE.fullmatch(cells[0]) and len(cells) > 1 and 2 * len(bad) <= len(cells):
        cell = cells[bad[0]]
        why = "; thousands are written without a separator" if THOUSANDS.fullmatch(cell) else ""
        raise BadInput(f"{file}: line {number}: column {bad[0] + 1}: {f'{cell!r} is no number' if cell else 'empty'}; every column of every line needs one{why}")
