"""What pages and files are made of: numbers with true minus signs and standard errors to their own digit, tables, figures, CSV files."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from thermospindle.model.files.cells import cells

LINEAR, SMALLEST = 3.0, 30.0
"""Standard errors: up to the first the colours of residuals are linear, and they span at least the second."""
UNITS = {"receptance": "m/N", "mobility": "(m/s)/N", "accelerance": "(m/s²)/N"}
"""Of FRFs, by their quantity."""


def minus(text: str) -> str:
    """A true minus before digits, and units kept on the line of their number."""
    return re.sub(r"(?<=\d) (?=(%|Hz|N|°C)\b|%)", "\u00a0", re.sub(r"(?<![\w-])-(?=\d)", "−", text))


def micro(text: str) -> str:
    """The letter of micrometres and microseconds, after a number or a slash."""
    return re.sub(r"(?<=\d[ \u00a0])u(?=[ms]\b)|(?<=/)u(?=m\b)", "µ", text)


def prose(text: str) -> str:
    """Plain words of the terminal as HTML: escaped, with true minus, plus-minus, arrow, degrees and
    micro; what stands in backticks is code, and stays as it is typed."""
    typed = [str(escape(part)) for part in re.split(r"`([^`]+)`", text)]  # words, code, words, ...
    words = [minus(micro(re.sub(r"(?<=\d) C\b", " °C", part))).replace("+-", "±").replace("-&gt;", "→") for part in typed[::2]]
    return words[0] + "".join(f"<code>{code}</code>{after}" for code, after in zip(typed[1::2], words[1:], strict=True))


def unit_word(unit: str, before: str = "") -> str:
    """A unit with what stands before it; nothing of a plain number."""
    return "" if unit == "1" else before + unit


def unit_cell(unit: str) -> str:
    """A unit as a cell of a page has it: escaped, with the signs of degrees and micro, nothing of a plain number."""
    return re.sub(r"(?<![a-z])u(?=(?:m|s|rad|N)\b)", "µ", str(escape(unit_word("°C" if unit == "C" else unit))))


def known(values: Any) -> Any:
    """A number for JSON, or an array as nested lists of them: None where there is none."""
    return [known(v) for v in values] if np.ndim(values) else float(values) if np.isfinite(values) else None


def signed(value: float, digits: int = 1) -> str:
    return minus(f"{round(value, digits) + 0.0:+.{digits}f}")  # + 0.0: never -0.0


def with_error(pair: tuple[float, float] | None, sign: bool = False, digits: int = 1) -> Markup:
    """A number with its standard error, to the error's first digit (two, if that is a one); an en dash for no number."""
    if pair is None:
        return Markup("–")
    value, error = pair
    of_error = ""
    if 0 < error < np.inf:
        digits = int(np.clip(-np.floor(np.log10(error / 2)), 0, 9))
        of_error = f" <small>± {error:.{digits}f}</small>"
    return Markup(minus(f"{round(value, digits) + 0.0:{'+' if sign else ''}.{digits}f}") + of_error)


def plain(value: float, digits: int = 3) -> str:
    """A number of so many digits without powers of ten: odds of 440, not of 4.4e+02."""
    return f"{float(f'{value:.{digits}g}'):.15g}"


def signed_short(value: float) -> str:
    """A signed number in few characters, with a true minus: one digit after the point below ten, powers of ten from 10,000."""
    if abs(value) < 0.05:
        return "0.0"
    text = f"{value:+z.1f}" if abs(value) < 9.95 else f"{value:+z.0f}" if abs(value) < 9999.5 else f"{value:+.0e}".replace("e+0", "e")
    return text.replace("-", "−")


def power(watts: float) -> tuple[str, float]:
    """The unit for powers up to so many `watts`, and how many of it a watt is: a disk drive's
    friction takes milliwatts, a machine tool's watts."""
    return ("mW", 1e3) if watts < 10 else ("W", 1.0)


def plain_error(value: float, error: float) -> str:
    """A number with its standard error as the terminal has them, both to the error's second digit; the number alone where it has none."""
    if not 0 < error < np.inf:
        return f"{value:.4g}"
    digits = int(np.clip(1 - np.floor(np.log10(error)), 0, 9))
    return f"{round(value, digits) + 0.0:.{digits}f} +- {error:.{digits}f}"


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = (0,), caption: str = "", name: str = "", ruled: bool = False
) -> str:
    """A table of a page: cells are HTML, columns `words` stand to the left, numbers to the right;
    `ruled`: a line above each row that has a first cell. `name` is its id."""

    def row(kind: str, cells: Sequence[str], look: str = "") -> str:
        return f"<tr{look}>" + "".join(f"<{kind}{' class=left' if k in words else ''}>{c}</{kind}>" for k, c in enumerate(cells)) + "</tr>"

    top = row("th", [str(escape(h)).replace("\n", "<br>") for h in head])
    body = "".join(row("td", cells, ' class="rule"' if ruled and k and cells[0] else "") for k, cells in enumerate(rows))
    about = f"<caption>{caption}</caption>" if caption else ""
    return f'<div class="scroll"><table{f" id={name!r}" if name else ""}>{about}<thead>{top}</thead><tbody>{body}</tbody></table></div>'


def figure(drawn: str, caption: str = "") -> str:
    """A picture of a page, with its caption in HTML."""
    return f'<figure class="chart wide">{drawn}' + (f"<figcaption>{caption}</figcaption>" if caption else "") + "</figure>"


def write_csv(path: Path, head: Sequence[str], rows: Iterable[Iterable[Any]], about: str = "") -> None:
    """A CSV file with a header, and before it `about` as a comment; names in it are no formulas to a spreadsheet."""
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {about}\n" if about else "")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(cells(head))
        writer.writerows(cells(row) for row in rows)
