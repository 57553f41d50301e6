"""Cells of a CSV file: names that no spreadsheet takes for formulas, numbers that every program reads alike.

A cell that begins with = + - or @, or with a tab or carriage return before them, is computed by spreadsheets when a file is opened (OWASP,
CSV Injection). Such a name is written with an apostrophe before it, the spreadsheets' own sign for text, and read without it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

FORMULA = ("=", "+", "-", "@", "\t", "\r")


def cell(name: str) -> str:
    """A name as a cell; a dash alone, for nothing, is none to compute."""
    return f"'{name}" if name.lstrip("'").startswith(FORMULA) and name != "-" else name


def cells(values: Iterable[Any]) -> list[Any]:
    """A row of names and numbers as cells; numbers stay."""
    return [cell(value) if isinstance(value, str) else value for value in values]


def name_of(text: str) -> str:
    """The name that `cell` made the `text` of."""
    return text[1:] if text.startswith("'") and text.lstrip("'").startswith(FORMULA) else text


def plain_number(text: str) -> str:
    """Text that every program reads as the same number: ValueError for 1_000 and digits of other scripts, which Python would take."""
    if not text.isascii() or "_" in text:
        raise ValueError("must be a number in digits 0 to 9")
    return text
