"""Names in CSV files: no spreadsheet computes them, and they read back as they were."""

import csv
from dataclasses import replace

import pytest

from thermospindle.model.files.cells import FORMULA, cell, cells, name_of
from thermospindle.model.files.stiffness_table import read_table, write_table
from thermospindle.sim.operating import stiffness_table

NAMES = ["upper", "=1+1", "+x", "-x", "@SUM(A1)", "\t=1", "\r=1", "'upper", "'=1+1", "''@x", "a=b", "", "'"]


@pytest.mark.parametrize("name", NAMES)
def test_no_cell_is_a_formula_and_every_name_comes_back(name):
    assert not cell(name).startswith(FORMULA)
    assert name_of(cell(name)) == name
    assert (cell(name) == name) == (name.lstrip("'")[:1] not in FORMULA or name in ("", "'"))


def test_a_dash_for_nothing_stays():
    assert cell("-") == name_of("-") == "-"


def test_numbers_stay():
    assert cells(["=x", -1.0, 3]) == ["'=x", -1.0, 3]


def test_a_bearing_may_be_named_like_a_formula(spindle, tmp_path):
    table = stiffness_table(spindle, [20.0, 60.0])
    named = replace(table, values={"=HYPERLINK(A1)": table.values["upper"]}, unloads={"=HYPERLINK(A1)": None})
    write_table(named, tmp_path / "table.csv")
    rows = list(csv.reader((tmp_path / "table.csv").read_text(encoding="utf-8").splitlines()))
    assert not any(text.startswith(("=", "@")) for row in rows for text in row)
    assert set(read_table(tmp_path / "table.csv").values) == {"=HYPERLINK(A1)"}
