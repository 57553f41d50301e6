"""What rollers excite: every roller put where it stands at a moment, pressed by the waves that it
meets there, and the ring let go where it balances."""

import numpy as np
import pytest
from scipy.optimize import fsolve

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing.kinematics import row_kinematics
from thermospindle.model.bearing.roller import roller_state
from thermospindle.model.built.imperfections import RowImperfections, Wave
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.excitation import harmonics
from thermospindle.sim.running.rows import free_displacements
from thermospindle.sim.running.runout import runout

SPEED = 1500 * RPM
ROLLERS = 26
NANO = 1e-9
PITCH = 91.0  # mm
EVERY = RowImperfections(
    inner_radial=(Wave(1, 3 * NANO, 0.2), Wave(25, 5 * NANO, 0.4), Wave(12, 9 * NANO, 0.1)),
    outer_radial=(Wave(27, 4 * NANO, 1.0), Wave(53, 2 * NANO, -0.7)),
    ball_diameter=tuple(NANO * x for x in np.random.default_rng(1).normal(size=52)),
    ball_waves=tuple((Wave(2, NANO * (1 + k % 3), 0.3 * k), Wave(3, 5 * NANO, 0.1)) for k in range(52)),
)
ALONE = {
    "inner race": RowImperfections(inner_radial=EVERY.inner_radial),
    "outer race": RowImperfections(outer_radial=EVERY.outer_radial),
    "sizes": RowImperfections(ball_diameter=EVERY.ball_diameter),
    "roller waves": RowImperfections(ball_waves=EVERY.ball_waves),
    "all": EVERY,
}


@pytest.fixture(scope="module")
def tail():
    return load("tailstock")


@pytest.fixture(scope="module")
def state(tail):
    return roller_state(tail, tail.roller_bearings[0], None, 20.0)


@pytest.fixture(scope="module")
def running(tail):
    return operating_point(tail, Condition(20.0, SPEED))


def balanced(state, own: RowImperfections, time: float) -> np.ndarray:
    """Where (x, y, tilt_x, tilt_y) the outer ring pulls with nothing at a moment: rollers of 9 mm roll
    without slip on a pitch circle of 91 mm; two rows, each roller in 15 slices."""
    ratio = 9.0 / PITCH
    cage, spin = SPEED * (1 - ratio) / 2, SPEED * (1 - ratio**2) / (2 * ratio)
    azimuth = 2 * np.pi * np.arange(ROLLERS) / ROLLERS + cage * time
    heights = state.row.length / 2 * np.polynomial.legendre.leggauss(15)[0]
    weights = np.polynomial.legendre.leggauss(15)[1] / 2

    def wave(waves, angle):
        return sum((w.amplitude * np.cos(w.order * angle + w.phase) for w in waves), np.zeros_like(angle))

    def pull(u: np.ndarray) -> np.ndarray:
        total = np.zeros(4)
        for k, offset in enumerate(state.row.offsets):
            sizes = np.array(own.ball_diameter)[k * ROLLERS : (k + 1) * ROLLERS] - np.mean(own.ball_diameter) if own.ball_diameter else 0.0
            bumps = [wave(w, np.array([spin * time, spin * time + np.pi])).sum() for w in own.ball_waves[k * ROLLERS : (k + 1) * ROLLERS]] or 0.0
            more = wave(own.inner_radial, azimuth - SPEED * time) - wave(own.outer_radial, azimuth) + sizes + np.array(bumps)
            for h, share in zip(offset + heights, weights, strict=True):
                outward = np.array([np.cos(azimuth), np.sin(azimuth), -h * np.sin(azimuth), h * np.cos(azimuth)])
                total += share * outward @ np.maximum(-state.row.clearance / 2 + more - u @ outward, 0.0) ** (10 / 9)
        return total / (-state.row.clearance / 2) ** (10 / 9)

    return np.asarray(fsolve(lambda u: pull(u * np.array([1, 1, 100, 100]) * NANO), np.zeros(4), xtol=1e-12)) * np.array([1, 1, 100, 100]) * NANO


@pytest.mark.parametrize("name", list(ALONE))
def test_the_ring_floats_where_its_rollers_balance(tail, state, running, name):
    kin = row_kinematics(tail, running.state)["front1"]
    small = ALONE[name]
    found = free_displacements(state, kin, small)
    assert found
    for time in (0.0, 1.7e-3, 23e-3):
        linear = sum(np.real(free * np.exp(2j * np.pi * line.frequency * time)) for line, free in found)
        expected = balanced(state, small, time)
        assert linear[2] == 0.0
        assert linear[[0, 1, 3, 4]] == pytest.approx(expected, rel=0.02, abs=0.01 * np.abs(expected[:2]).max())


def test_what_cancels_makes_no_line(tail, state, running):
    kin = row_kinematics(tail, running.state)["front1"]
    assert free_displacements(state, kin, RowImperfections(inner_radial=(Wave(12, NANO, 0.0),), ball_diameter=(NANO,) * 52)) == []
    assert free_displacements(state, kin, RowImperfections(ball_waves=((Wave(3, NANO, 0.0),),) * 52)) == []


@pytest.mark.slow
def test_a_run_of_the_tailstock_has_the_lines_of_its_rollers(running):
    """25 turns a second: the cage at (1 - 9/91) / 2 of them, rollers past the inner race (1 + 9/91)
    / 2 times 26; nothing of theirs along the axis."""
    cage = 25 * (1 - 9 / 91) / 2
    own = [line for line in harmonics(running).line if line.bearing == "front1"]
    assert {line.cause for line in own} == {"inner waviness", "outer waviness", "ball waviness", "ball size"}
    assert {line.direction for line in own} == {"radial"}
    expected = {"fc": cage, "26 fc": 26 * cage, "26 (fi-fc) + fi": 26 * (25 - cage) + 25, "2 fb + fc": 2 * 25 * (91 / 9 - 9 / 91) / 2 + cage}
    for name, frequency in expected.items():
        assert next(line.frequency for line in own if line.name == name) == pytest.approx(frequency, rel=1e-9)
    found = {(g.bearing, g.name) for line in runout(running, seconds=1.0, path="linear").lines for g in line.causes[:1]}
    assert ("front1", "26 fc") in found


def test_a_scene_tells_rollers_their_waves(tmp_path, capsys):
    text = (ROOT / "scenes" / "tailstock" / "spindle.toml").read_text(encoding="utf-8")
    head = text[: text.index("[imperfections]")] + '[imperfections]\norigin = "assumed"\nsource = "test"\n[imperfections.bearings.front1]\n'
    wave = "outer_radial = { order = [27], amplitude_nm = [100.0], phase_deg = [0.0] }\n"
    file = tmp_path / "spindle.toml"
    file.write_text(head + wave, encoding="utf-8")
    [line] = harmonics(operating_point(load(tmp_path), Condition(20.0, SPEED))).line
    assert (line.name, line.cause) == ("26 fc", "outer waviness")
    for wrong, said in {
        wave.replace("radial", "axial"): "outer_axial: cylindrical rollers do not feel it",
        "ball_diameter_nm = [1.0, -1.0]\n": "ball_diameter_nm: has 2 values; allowed is one for each of the 52 rollers, row by row",
    }.items():
        file.write_text(head + wrong, encoding="utf-8")
        assert main(["check", str(tmp_path)]) == 2
        assert f"imperfections.bearings.front1.{said}" in " ".join(capsys.readouterr().err.split())
