"""Bearings given by numbers: what a table over temperature and speed may hold."""

import re
import tomllib

import numpy as np
import pytest
from pydantic import ValidationError

from tests.conftest import ROOT
from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.machine import Condition
from thermospindle.model.scene.bearing_numbers import Numbers
from thermospindle.model.scene.reading import build, load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

HEADER = "temperature_C,speed_rpm,radial_stiffness_N_per_m,axial_stiffness_N_per_m"


def grid(folder, header=HEADER, row="20,0,2e7,0"):
    (folder / "bearing.csv").write_text(f"{header}\n{row}\n", encoding="utf-8")
    return Numbers(table="bearing.csv", damping_ratio=0.05).grid(folder / "spindle.toml", "table")


def test_a_table(tmp_path):
    """Also as spreadsheets write it: with a byte-order mark, and columns without anything."""
    *_, stiffness = grid(tmp_path, "\ufeff" + HEADER + ",", "20,0,2e7,0,")
    assert stiffness[0] == 2e7


def test_columns_between_directions_are_optional(tmp_path):
    """One alone, on both sides of the diagonal; one that would push the shaft away is refused."""
    header = HEADER + ",axial_stiffness_xz_N_per_m"
    *_, stiffness = grid(tmp_path, header, "20,0,2e7,1e7,-3e6")
    k = np.reshape(stiffness, (5, 5))
    assert k[0, 2] == k[2, 0] == -3e6
    assert np.count_nonzero(k) == 5
    with pytest.raises(BadInput, match="line 2: its stiffness has the negative eigenvalue"):
        grid(tmp_path, header, "20,0,2e7,1e7,2e7")


@pytest.mark.parametrize(
    ("header", "row", "told"),
    [
        (HEADER.replace("stiffness", "stifness", 1), "20,0,2e7,0", ["column 'radial_stifness_N_per_m'", "temperature_C, speed_rpm", "did you mean radial_stiffness_N_per_m?"]),
        (HEADER.replace("N_per_m", "N_per_um", 1), "20,0,20,0", ["column 'radial_stiffness_N_per_um'", "did you mean radial_stiffness_N_per_m?"]),
        (HEADER + ",tilt_stifness_Nm_per_rad", "20,0,2e7,0,1e4", ["did you mean tilt_stiffness_N_m_per_rad?"]),
        (HEADER + ",", "20,0,2e7,0,1e4", ["column ''"]),
        (HEADER, "20,0,2e7,0,5", ["line 2: has more cells than the header"]),
        (HEADER, "# rig 2\n\n20,0,2e7,0\n60,0,2O7,0", ["line 5: radial_stiffness_N_per_m = '2O7': must be a finite number"]),
        (HEADER, "20,0,2e7,0\n60,0,nan,0", ["line 3: radial_stiffness_N_per_m = 'nan'"]),
        (HEADER, "20,0,2e7,0\n60,0,2e7", ["line 3: axial_stiffness_N_per_m = ''"]),
        (HEADER, "20,0,2e7,0\n20,3000,2e7,0\n60,0,2e7,0", ["has no row of 60 C and 3000 rpm", "2 temperatures", "2 speeds"]),
        (HEADER.replace(",", ";"), "20;0;2e7;0", ["separated by ';'; allowed are commas"]),
        (HEADER, "20,0,0,0", ["radial_stiffness_N_per_m, axial_stiffness_N_per_m: all are zero"]),
    ],
)
def test_refused_tables(tmp_path, header, row, told):
    with pytest.raises(BadInput) as error:
        grid(tmp_path, header, row)
    for words in (f"{tmp_path / 'bearing.csv'}: ", *told):
        assert words in str(error.value)


def test_a_cross_coupled_bearing_is_refused_with_its_entries():
    matrix = np.diag([2e7, 2e7, 0.0, 0.0, 0.0])
    matrix[0, 1], matrix[1, 0] = 3e6, -3e6
    with pytest.raises(ValidationError, match=r"row x, column y is 3e\+06, row y, column x -3e\+06; .* cross-coupled bearings \(journals, seals\) are out of scope"):
        Numbers(matrix_SI=matrix.tolist(), damping_ratio=0.05)


def test_lines_of_a_table_of_several_bearings_are_the_file_s(tmp_path):
    (tmp_path / "both.csv").write_text(f"# made by hand\nbearing,{HEADER}\nA,20,0,2e7,0\nB,20,0,2e7,0\nB,60,0,x,0\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"both\.csv: line 5: radial_stiffness_N_per_m = 'x'"):
        Numbers(table="both.csv", bearing="B", damping_ratio=0.05).grid(tmp_path / "spindle.toml", "table")


def test_a_matrix_of_zeros_is_refused_as_a_table_of_zeros_is():
    with pytest.raises(ValidationError, match="matrix_SI: all entries are zero"):
        Numbers(matrix_SI=np.zeros((5, 5)).tolist(), damping_ratio=0.05)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("gone.csv", "{}: no such file; allowed is a CSV file, told from the folder of the scene"),
        ("", "{}: it is a folder; allowed is a CSV file"),
        ("empty.csv", "{}: has no rows; allowed is a table with columns temperature_C, speed_rpm and stiffness"),
    ],
)
def test_a_table_that_is_none_is_told_with_the_scene_and_its_key(tmp_path, table, said):
    """The table's name alone did not say which file asks for it."""
    scene = ROOT / "scenes" / "templates" / "rotor.toml"
    text = re.sub(r"radial_stiffness_N_per_um = 20.0 .*\n.*\n", f'table = "{table}"\n', scene.read_text(encoding="utf-8"), count=1)
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    (tmp_path / "empty.csv").write_text(f"{HEADER}\n", encoding="utf-8")
    with pytest.raises(BadInput) as error:
        load(tmp_path)
    assert str(error.value).startswith(f"{tmp_path / 'spindle.toml'}: bearings.left.numbers.table = {table!r}: {said.format(tmp_path / table)}")


def test_a_table_of_turning_the_other_way_is_that_of_its_speeds(tmp_path):
    _, speeds, stiffness = grid(tmp_path, row="20,-1500,3e7,0\n20,0,2e7,0")
    assert speeds == pytest.approx((0.0, 50 * np.pi))
    assert [k[0] for k in np.reshape(stiffness, (2, 25))] == [2e7, 3e7]
    with pytest.raises(BadInput, match="line 3: 20 C and 1500 rpm stand twice"):
        grid(tmp_path, row="20,-1500,3e7,0\n20,1500,2e7,0")


def test_a_table_that_begins_above_rest_serves_its_own_speeds(tmp_path):
    """The integration step, which nobody told, was asked for at rest: neither modes at 3000 rpm nor `check` could be had."""
    file = ROOT / "scenes" / "templates" / "rotor.toml"
    raw = tomllib.loads(file.read_text(encoding="utf-8"))
    (tmp_path / "b.csv").write_text(f"{HEADER}\n25,1000,2e7,0\n60,1000,2e7,0\n25,6000,1e7,0\n60,6000,1e7,0\n", encoding="utf-8")
    raw["bearings"]["right"]["numbers"] = {"table": "b.csv", "damping_ratio": 0.02}
    spindle = build(raw, tmp_path / "spindle.toml")
    with pytest.raises(OutsideRange, match="was asked at 0 rpm"):
        operating_point(spindle, Condition(40.0))
    assert operating_point(spindle, Condition(40.0, 3000 * RPM)).modes
