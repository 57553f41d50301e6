"""The spindle of the machine tool MK7702 against the answers printed with it, and against a rotor code.

Printed: vshabanov/spindlecad, `src/MK7702Spindle.lhs` at 530f201e (Euler-Bernoulli, radial springs to rigid ground). With
shear and at speed: ROSS 3.1 (Timoshenko, rotary inertia, gyroscopic terms, 57 nodes, same springs), run beside this project.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.beam import with_theory
from thermospindle.model.rotor.chain import matrices, motion_rows
from thermospindle.model.rotor.poles import poles_below
from thermospindle.model.rotor.static import rated_chain
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import mass_between, operating_point

SCENE = ROOT / "scenes" / "mk7702"


@pytest.fixture(scope="module")
def mk7702():
    return load(SCENE)


def asked(capsys, *words: str) -> dict:
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_static_answers_are_the_printed_ones(capsys):
    nose = asked(capsys, "static", str(SCENE), "--beam", "euler-bernoulli")["points"]["nose"]
    assert nose["direction"] == "+X"
    assert nose["stiffness_N_per_m"] == pytest.approx(260.9192641748797e6, rel=1e-8)
    assert list(nose["reactions_N"]) == ["front1", "front2", "front3", "rear1"]
    assert list(nose["reactions_N"].values()) == pytest.approx([-0.517, -0.441, -0.340, 0.298], abs=5e-4)
    assert sum(nose["reactions_N"].values()) == pytest.approx(-1.0, rel=1e-9)
    shares = nose["compliance_shares"]
    assert [shares[k] for k in ("spindle", "front1", "front2", "front3", "rear1")] == pytest.approx(
        [0.3236, 0.3087, 0.2240, 0.1330, 0.0107], abs=6e-5
    )


def test_the_nose_with_shear(capsys):
    assert asked(capsys, "static", str(SCENE))["points"]["nose"]["stiffness_N_per_m"] == pytest.approx(235.60e6, abs=5e3)


@pytest.mark.parametrize(("console", "printed"), [(0.1, 105.32109), (0.2, 53.548479), (0.3, 31.875272), (0.4, 21.013870)])
def test_a_rigid_console_in_front(mk7702, console, printed):
    """A force at its tip. In the source it acts at the nose and its moment 1 mm behind, and the tip follows the tilt of the nose."""
    k = matrices(rated_chain(mk7702, bent_only(mk7702))).stiffness
    nose = motion_rows(bent_only(mk7702), "spindle 0", (0.0, 0.0, 0.0))
    force, moment = nose[0], -nose[4]  # a force at z = -console tilts about -y
    by_force, by_moment = np.linalg.solve(k, np.array([force, moment]).T).T
    first = 1e-3 / (210e9 * np.pi / 64 * (0.106**4 - 0.081**4))  # bending of the first millimetre, which the moment does not reach
    tip = force @ by_force + console * (moment @ by_force + force @ by_moment - 0.5e-3 * first) + console**2 * (moment @ by_moment - first)
    assert 1e-6 / tip == pytest.approx(printed, rel=2e-7)


def bent_only(spindle):
    """The chain at the reference with Euler-Bernoulli beams."""
    structure = with_theory(spindle.structure, spindle.materials, 20.0, (0.0, 0.0))
    return operating_point(replace(spindle, structure=structure), Condition(20.0)).chain


ROSS = {  # rpm: Hz, lateral in both planes; at 6000 rpm ROSS 2.3, by `make bench`
    0: [706.83, 706.83, 1058.64, 1058.64, 1558.53, 1558.53, 3101.92, 3101.92],
    6000: [703.57, 710.12, 1054.29, 1062.88, 1549.19, 1568.21, 3090.28, 3115.22],
    12000: [700.29, 713.39, 1049.77, 1066.96, 1539.70, 1577.71],
}


def undamped(spindle):
    structure = replace(spindle.structure, joints=tuple(replace(j, damping_ratio=0.0) for j in spindle.structure.joints))
    return replace(spindle, structure=structure, linear_bearings=tuple(replace(b, damping_ratio=0.0) for b in spindle.linear_bearings))


LATERAL = [706.8, 1058.6, 1558.3, 3100.7]
"""Hz, of the undamped spindle at rest by another beam code, its masses spread along the elements."""


def test_four_modes_at_rest(mk7702):
    """Without the assumed damping: off by 2.6e-4 at most with masses at nodes, as MuJoCo has them, and equal to the
    digits given where they are spread. What `modes` prints is within 3e-4 as well: bearings of a damping ratio of
    0.015 at 1 kHz hold the shaft by their dampers too, by which |pole| rises as much as masses at nodes lower it."""
    at_nodes = operating_point(undamped(mk7702), Condition(20.0))
    lumped = [m.frequency for m in at_nodes.modes_below(4000.0) if m.kind != "axial"]
    assert lumped[::2] == pytest.approx(LATERAL, rel=3e-4)
    assert lumped[1::2] == pytest.approx(lumped[::2], rel=1e-9)
    pole, _ = poles_below(matrices(at_nodes.chain), 4000.0, mass_between(at_nodes, mk7702))
    spread = np.abs(pole) / (2 * np.pi)
    assert [float(f) for f in LATERAL for f in [spread[np.argmin(abs(spread - f))]]] == pytest.approx(LATERAL, rel=3e-5)
    damped = [m.frequency for m in operating_point(mk7702, Condition(20.0)).modes_below(4000.0) if m.kind != "axial"]
    assert damped[::2] == pytest.approx(LATERAL, rel=3e-4)
    assert 2e-4 < damped[6] / lumped[6] - 1 < 5e-4


def test_what_modes_prints_tends_to_the_printed_frequencies(mk7702, tmp_path):
    """1058.87 Hz for 1058.6: masses at nodes 20 mm apart, of which halving leaves a quarter, and
    0.03 Hz of the bearings' dampers. Spread along the elements they are right on any mesh."""
    text = mk7702.file.read_text(encoding="utf-8")
    at_nodes, spread = [], []
    for element in (20.0, 10.0, 5.0):
        (tmp_path / "spindle.toml").write_text(text.replace("longest_element_mm = 20.0", f"longest_element_mm = {element}"), encoding="utf-8")
        bare = undamped(load(tmp_path))
        point = operating_point(bare, Condition(20.0))
        at_nodes.append([m.frequency for m in point.modes_below(1300.0) if m.kind != "axial"][2])
        pole, _ = poles_below(point.linear, 1300.0, mass_between(point, bare))
        spread.append(np.sort(np.abs(pole) / (2 * np.pi))[-1])
    assert spread == pytest.approx([1058.59] * 3, abs=0.005)
    errors = np.array(at_nodes) - spread
    assert errors[0] == pytest.approx(0.257, abs=0.01)
    assert errors[1] < errors[0] / 3.5
    assert errors[2] < errors[1] / 3.5
    damped = [m.frequency for m in operating_point(mk7702, Condition(20.0)).modes_below(1300.0) if m.kind != "axial"][2]
    assert damped == pytest.approx(1058.87, abs=0.005)
    assert damped - at_nodes[0] == pytest.approx(0.028, abs=0.005)


@pytest.mark.parametrize("rpm", ROSS)
def test_lateral_modes_are_those_of_a_rotor_code(mk7702, rpm):
    found = [m.frequency for m in operating_point(undamped(mk7702), Condition(20.0, rpm * RPM)).modes if m.kind != "axial"]
    assert found[: len(ROSS[rpm])] == pytest.approx(ROSS[rpm], rel=1e-3)
