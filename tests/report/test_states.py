"""What titles say of a state of equilibrium."""

import io
import json
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.files.stiffness_table import StiffnessTable
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM, in_rpm, small_length
from thermospindle.report.text.states import _loose, show_modes, show_table, show_told_table
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize(
    ("scene", "temperature", "told"),
    [
        ("hdd_2003", 20.0, "bearings in contact"),
        ("hdd_2003", 293.0, "lower and upper bearing lost contact"),
        ("mk7702", 20.0, "bearings given by numbers"),
        ("free_shaft", 20.0, "no bearings"),
    ],
)
def test_a_title_names_bearings_once(scene, temperature, told):
    """A shaft that hangs free was said to have bearings in contact."""
    assert operating_point(load(ROOT / "scenes" / scene), Condition(temperature)).state.of_bearings == told


def said_of(values: list[list[float]], speeds: tuple[float, ...] = (0.0,)) -> str:
    """The first line of `table` for a bearing of so much radial stiffness (T, S) N/um at 20, 40 and 60 C."""
    table = StiffnessTable(np.array([20.0, 40.0, 60.0]), np.array(speeds) * RPM, {"front": {"radial_stiffness_N_per_m": 1e6 * np.array(values)}}, {}, {})
    console = Console(record=True, width=300, file=io.StringIO())
    show_told_table(console, table)
    return console.export_text().splitlines()[0]


def test_the_least_and_the_most_are_told_where_they_lie_between():
    assert said_of([[20.0], [25.0], [30.0]]) == "From 20 to 60 C at 0 rpm: front radial stiffness 20.00 to 30.00 N/um."
    assert said_of([[20.0], [31.0], [30.0]]) == "From 20 to 60 C at 0 rpm: front radial stiffness 20.00 to 30.00 N/um (most 31.00 at 40 C)."
    assert said_of([[30.0], [12.5], [30.0]]) == "From 20 to 60 C at 0 rpm: front radial stiffness 30.00 N/um (least 12.50 at 40 C)."
    both = said_of([[20.0, 10.0], [31.0, 22.0], [30.0, 25.0]], (0.0, 6000.0))
    assert both == "From 20 to 60 C and 0 to 6000 rpm: front radial stiffness 20.00 to 25.00 N/um (least 10.00 at 20 C and 6000 rpm, most 31.00 at 40 C and 0 rpm)."


def test_every_column_of_a_table_has_its_unit():
    """Angles, micrometres and newtons as they are, stiffness in N/um of N/m."""
    si = {
        "contact_angle_deg": 24.5, "deformation_um": 1.25, "contact_force_N": 7.5, "ball_stiffness_N_per_m": 12.3e6, "preload_N": 16.0,
        "radial_stiffness_N_per_m": 34.5e6, "axial_stiffness_N_per_m": 11.2e6,
    }  # fmt: skip
    console = Console(record=True, width=300, file=io.StringIO())
    show_table(console, StiffnessTable(np.array([20.0]), np.array([0.0]), {"front": {name: np.full((1, 1), value) for name, value in si.items()}}, {}, {}))
    [row] = [line.split() for line in console.export_text().splitlines() if "front" in line]
    assert row == ["20", "0", "front", "24.50", "1.250", "7.500", "12.300", "16.00", "34.50", "11.200"]


def test_an_undamped_mode_has_no_damping_less_than_nothing():
    """Rounding made -0.000 % of it."""
    mode = {"frequency_Hz": 286.23, "damping_ratio": -1e-16, "kind": "lateral", "whirl": "none", "energy": {"bar": 1.0}}
    console = Console(record=True, width=100, file=io.StringIO())
    show_modes(console, {"temperature_C": 20.0, "speed_rpm": 0.0, "modes": [mode]}, SimpleNamespace(state=SimpleNamespace(of_bearings="no bearings")), 5000.0)
    said = console.export_text()
    assert "0.000" in said
    assert "-0.000" not in said


@pytest.mark.parametrize("rpm", [24000.0, 5400.1, -333.3, 0.0])
def test_a_speed_is_told_as_it_was_given(rpm, capsys):
    """24000 rpm was 24000.000000000004."""
    assert in_rpm(rpm * RPM) == rpm
    assert main(["modes", "hdd_2003", "--speed", str(rpm), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["speed_rpm"] == rpm


@pytest.mark.parametrize(("length", "least", "told"), [(2.17e-6, "nm", "2.17 um"), (834e-9, "nm", "834 nm"), (999.6e-9, "nm", "1 um"), (2.5e-3, "nm", "2.5 mm"), (3e-7, "um", "0.3 um"), (1.2e-3, "um", "1.2 mm"), (-4e-9, "nm", "-4 nm")])
def test_a_small_length_is_told_in_words(length, least, told):
    """A runout of 2.17 um was "2.17e+03 nm" in its picture."""
    assert small_length(length, least) == told


def test_where_a_bearing_is_loose_is_told_with_its_side_and_its_speed():
    """Also where it has contact in the middle alone; of a bearing that is loose at all temperatures the lowest was told as where it lets go."""

    def told(*force, where=30.0, speeds=1):
        temperature = np.array([20.0, 40.0, 60.0])
        values = {"rear": {"contact_force_N": np.repeat(np.array(force, float)[:, None], speeds, axis=1)}}
        return _loose(StiffnessTable(temperature, np.arange(speeds) * 100 * RPM, values, {"rear": where}, {}), "rear")

    assert told(3, 0, 0) == "rear bearing loses contact at 30.00 C"
    assert told(3, 0, 3, speeds=2) == "rear bearing loses contact at 30.00 C at 0 rpm; at 60 C it has it again"
    assert told(0, 3, 3) == "rear bearing has no contact below 30.00 C"
    assert told(0, 3, 0) == "rear bearing has no contact below 30.00 C; at 60 C it has none either"
    assert told(0, 0, 0, where=20.0, speeds=2) == "rear bearing has no contact at any of 20 to 60 C at 0 rpm; where it has was not asked"
    assert told(3, 3, 3, where=None) == ""
