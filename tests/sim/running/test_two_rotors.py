"""Two rotors that turn at different ratios of the spindle's speed: a shaft, and a drum about it that turns against it, 1.4 times as fast."""

import json
from dataclasses import replace

import numpy as np
import pytest

from thermospindle.cli import main
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import OutsideRange
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.mjcf import linearise
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.excitation import harmonics
from thermospindle.sim.running.run import run_spindle
from thermospindle.sim.running.runout import runout
from thermospindle.sim.running.waterfall import STEPS, run_up, waterfall

TEXT = """
format = 2
title = "two rotors"
reference_temperature_C = 20.0
nominal_speed_rpm = 6000.0
materials.steel = { origin = "assumed", source = "test", youngs_modulus_GPa = 208.0, poisson_ratio = 0.3, thermal_expansion_um_per_m_K = 11.5, density_kg_per_m3 = 7850.0, conductivity_W_per_m_K = 46.0, heat_capacity_J_per_kg_K = 460.0 }
[[shafts]]
origin = "assumed"
source = "test"
name = "inner"
material = "steel"
turns = true
outer_mm = [[30, 400]]
longest_element_mm = 100.0
damping_ratio = 0.005
[bearings.front]
origin = "assumed"
source = "test"
z_mm = 0.0
numbers = { radial_stiffness_N_per_um = 40.0, axial_stiffness_N_per_um = 20.0, damping_ratio = 0.05 }
[bearings.between]
origin = "assumed"
source = "test"
z_mm = 300.0
outer_body = "drum"
numbers = { radial_stiffness_N_per_um = 5.0, damping_ratio = 0.05 }
[bearings.rear]
origin = "assumed"
source = "test"
z_mm = 400.0
numbers = { table = "rear.csv", damping_ratio = 0.05 }
[bearings.drum]
origin = "assumed"
source = "test"
z_mm = 150.0
inner_body = "drum"
numbers = { radial_stiffness_N_per_um = 10.0, axial_stiffness_N_per_um = 30.0, tilt_stiffness_N_m_per_rad = 2.0e4, damping_ratio = 0.05 }
[structure]
origin = "assumed"
source = "test"
inner_body = "inner"
outer_body = "ground"
damping_frequency_Hz = 300.0
[[structure.bodies]]
name = "drum"
mass_kg = 20.0
tilt_inertia_kg_m2 = [0.05, 0.05]
polar_inertia_kg_m2 = 0.03
z_mm = 230.0
moves = ["x", "y", "z", "tilt_x", "tilt_y"]
turns = true
speed_ratio = -1.4
[measuring]
origin = "assumed"
source = "test"
points = [{ node = 1, name = "tip", body = "inner", position_mm = [0.0, 0.0, 0.0], direction = "+X" }, { node = 2, name = "drum", body = "drum", position_mm = [50.0, 0.0, 230.0], direction = "+X" }]
[hammer_test]
origin = "assumed"
source = "test"
sample_rate_Hz = 6000.0
band_Hz = [50.0, 2000.0]
[imperfections]
origin = "assumed"
source = "test"
unbalance_g_mm = 8.0
unbalance_z_mm = 230.0
"""


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two")
    (folder / "spindle.toml").write_text(TEXT, encoding="utf-8")
    rows = [f"{t},{n},{4e7 * (1 - 1e-5 * n)}" for t in (20, 60) for n in (0, 7000)]
    (folder / "rear.csv").write_text("temperature_C,speed_rpm,radial_stiffness_N_per_m\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return load(folder)


@pytest.fixture(scope="module")
def point(two):
    return operating_point(two, Condition(20.0, 6000 * RPM))


def test_mujoco_turns_each_at_its_own_ratio(point):
    """Gyroscopic terms of the time simulation are those of the matrices."""
    ours, theirs = point.linear, linearise(point.model)
    for a, b in ((ours.mass, theirs.mass), (ours.damping, theirs.damping), (ours.stiffness, theirs.stiffness)):
        assert b == pytest.approx(a, abs=1e-8 * np.abs(a).max())


def test_an_unbalance_goes_round_with_what_carries_it(point):
    """On the drum, 140 times a second against the shaft, as the force U omega^2; on the shaft's end with the shaft."""
    [line], [force] = harmonics(point).line, harmonics(point).force
    assert (line.frequency, line.cause) == (pytest.approx(140.0), "unbalance")
    assert np.abs(force).max() == pytest.approx(8e-6 * (2 * np.pi * 140) ** 2)
    other = replace(point.spindle, imperfections=Imperfections(unbalance=8e-6, unbalance_z=0.4))
    [line] = harmonics(operating_point(other, point.condition)).line
    assert line.frequency == pytest.approx(100.0)


SMALL = {
    "0.4 um off the axis": Imperfections(unbalance=8e-6, unbalance_z=0.23),
    "0.5 urad off it": Imperfections(couple_unbalance=1e-8, unbalance_z=0.23),
}


@pytest.mark.parametrize("name", list(SMALL))
def test_the_simulated_run_agrees_with_the_linear_answer(point, name):
    """Of a heavy rotor the offset is below 1 um and 1 urad, which MuJoCo's compiler takes for none."""
    point = operating_point(replace(point.spindle, imperfections=SMALL[name]), point.condition)
    [record] = run_spindle([point], 0.05, 6000.0)
    assert record.speed == pytest.approx(6000 * RPM, rel=1e-6)
    assert record.angle[-1] - record.angle[0] == pytest.approx(6000 * RPM * (record.time[-1] - record.time[0]), rel=1e-6)
    simulated, linear = (runout(point, seconds=0.5, path=path).lines[0] for path in ("simulated", "linear"))
    for found in (simulated, linear):
        assert (found.frequency, found.order) == (pytest.approx(140.0), pytest.approx(1.4))
        assert found.backward > 0.9 * found.amplitude
    assert simulated.amplitude == pytest.approx(linear.amplitude, rel=1e-3)


def test_a_map_goes_as_far_as_tables_do_and_has_the_drums_unbalance(two, capsys):
    assert main(["map", str(two.file), "--temperatures", "20", "40", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    own = [c for c in answer["coincidences"] if c["cause"] == "unbalance"]
    assert own
    for c in own:
        assert c["speed_rpm"] <= 7000
        assert c["frequency_Hz"] == pytest.approx(1.4 * c["speed_rpm"] / 60, rel=1e-6)


def test_beyond_a_table_the_speed_is_told_in_rpm(two):
    with pytest.raises(OutsideRange, match=r"spindle.toml: bearings.rear.numbers.table: spans speed 0 to 7000 rpm and was asked at 8000 rpm"):
        operating_point(two, Condition(20.0, 8000 * RPM))


def test_a_waterfall_goes_as_far_as_tables_do(two):
    """A record at the last speed of a table has its run-up drawn up to there."""
    found = waterfall(two, 20.0, run_up(7000 * RPM))
    assert len(found) == STEPS / 1.25
    assert found[-1].speed == pytest.approx(7000 * RPM)
