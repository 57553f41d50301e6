"""A line among the numbers that is none of them is named; what stands above it is not taken for headings."""

from __future__ import annotations

from pathlib import Path

import pytest

from thermospindle.model.errors import BadInput
from thermospindle.sim.importing.files.text import read_table

ROWS = [f"{f},{f / 7:.4f},{f / 9:.4f}" for f in range(100, 140, 2)]


def written(folder: Path, rows: list[str]) -> Path:
    (folder / "frf.csv").write_text("\n".join(["frequency,real,imag", *rows]) + "\n", encoding="utf-8")
    return folder / "frf.csv"


@pytest.mark.parametrize("line", ["overload", "--- trigger lost ---", "110;0,5;0,25"])
def test_a_line_among_the_numbers_is_named(line: str, tmp_path: Path) -> None:
    file = written(tmp_path, [*ROWS[:8], line, *ROWS[8:]])
    with pytest.raises(BadInput, match=rf"frf\.csv: line 10: '{line}' stands among the numbers, and is no row of 3 of them"):
        read_table(file)


def test_decimals_that_change_are_named_where_they_do(tmp_path: Path) -> None:
    rows = [row.replace(",", ";") for row in ROWS]
    file = written(tmp_path, [*rows[:8], *(row.replace(".", ",") for row in rows[8:])])
    with pytest.raises(BadInput, match=r"frf\.csv: line 9: .* stands among the numbers"):
        read_table(file)


def test_a_second_table_below_the_first_is_read_alone(tmp_path: Path) -> None:
    """Its axis begins anew: it is no damage."""
    file = written(tmp_path, [*ROWS, "frequency,real,imag", *ROWS[:12]])
    assert read_table(file).values.shape == (12, 3)
