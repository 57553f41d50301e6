"""Free bending of the shipped stepped shafts against solid finite elements: numbers of CalculiX 2.20 (Debian bookworm's
calculix-ccx 2.20-1), whose input `tests.literature.calculix` writes; where `ccx` is on the path, it is run again.

A beam is in doubt where a shaft steps: a short collar does not bend as wide as it is. Timoshenko's beam is right to 1 % up to 4 kHz on
mk7702, whose steps are shallow, and 1 to 6 % too stiff on five_bearing, whose nose has a collar of 133 mm on a shaft of 75 to 82 mm.
"""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.literature.calculix import deck, solved
from thermospindle.model.rotor.beam import with_shafts
from thermospindle.model.rotor.chain import RotorBase, joint_element, matrices
from thermospindle.model.scene.reading import load
from thermospindle.model.shaft import THEORIES
from thermospindle.model.structure import Structure

CCX = shutil.which("ccx")
FINE = {  # Hz, elements of 15 and 12 mm along the shaft
    "mk7702": (994.134, 2360.464, 3960.279, 5562.331),
    "five_bearing": (1526.911, 3612.741, 5871.086, 8116.787),
}
COARSE = {"mk7702": (994.068, 2360.066, 3958.359, 5555.214), "five_bearing": (1526.982, 3613.179, 5873.538, 8120.423)}  # of 25 and 20 mm
MESH = {"mk7702": 25e-3, "five_bearing": 20e-3}
TOO_STIFF = {"mk7702": (0.002, 0.007, 0.009, 0.02), "five_bearing": (0.015, 0.03, 0.06, 0.05)}  # at most, Timoshenko over solid


def of_beam(name: str, theory: str) -> np.ndarray:
    """First four free bending frequencies (Hz) of a scene's shaft alone."""
    spindle = load(name)
    shear, rotary = THEORIES[theory]
    shaft = replace(spindle.structure.shafts[0], shear=shear, rotary=rotary)
    structure = with_shafts(Structure((), (), 100.0, shafts=(shaft,)), spindle.materials, 20.0)
    linear = matrices(RotorBase(structure.bodies, tuple(joint_element(structure, i) for i in range(len(structure.joints))), 0.0))
    own = [i for i, (_, move) in enumerate(linear.dofs) if move in ("x", "tilt_y")]
    value = eigh(linear.stiffness[np.ix_(own, own)], linear.mass[np.ix_(own, own)], eigvals_only=True)
    return np.sqrt(value[2:6]) / (2 * np.pi)


@pytest.mark.parametrize("name", FINE)
def test_the_solid_has_converged(name):
    assert COARSE[name] == pytest.approx(FINE[name], rel=1.5e-3)


@pytest.mark.parametrize("name", FINE)
def test_timoshenkos_beam_is_a_little_stiffer_than_the_solid(name):
    over = of_beam(name, "timoshenko") / FINE[name] - 1
    assert (over > 0).all()
    assert (over < TOO_STIFF[name]).all(), over


@pytest.mark.parametrize("name", FINE)
def test_without_shear_a_beam_is_far_off(name):
    by_theory = {theory: of_beam(name, theory) / FINE[name] - 1 for theory in THEORIES}
    assert (by_theory["euler-bernoulli"] > by_theory["rayleigh"]).all()
    assert (by_theory["rayleigh"] > 3 * by_theory["timoshenko"]).all()
    assert by_theory["euler-bernoulli"][0] > 0.1


def test_the_input_is_the_shaft():
    """Every node once, every element between nodes that are there, and the quarter's volume within
    what edges of arcs of 22.5 degrees leave."""
    shaft = load("mk7702").structure.shafts[0]
    text = deck(shaft.segments, 210e9, 0.3, 7850.0, 40e-3)
    before, after = text.split("*ELEMENT, TYPE=C3D20R, ELSET=SHAFT\n")
    nodes = {int(row.split(",")[0]): [float(v) for v in row.split(",")[1:]] for row in before.splitlines()[1:]}
    rows = after.split("*BOUNDARY")[0].replace(",\n", ",").splitlines()
    corners = [[nodes[int(n)] for n in row.split(",")[1:9]] for row in rows]
    volume = sum(abs(_quad(c[:4])) * (c[4][2] - c[0][2]) for c in corners)
    exact = sum(np.pi / 4 * (s.outer[0] ** 2 - s.bore[0] ** 2) * (s.z[1] - s.z[0]) for s in shaft.segments)
    assert volume == pytest.approx(exact, rel=0.03)
    assert volume < exact


def _quad(corners) -> float:
    """Area of a face in a plane z = constant, by Gauss's shoelace."""
    x, y = np.array(corners)[:, 0], np.array(corners)[:, 1]
    return float((x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


@pytest.mark.slow
@pytest.mark.skipif(CCX is None, reason="CalculiX's ccx is not on the path")
@pytest.mark.parametrize("name", FINE)
def test_ccx_finds_them_again(tmp_path, name):
    spindle = load(name)
    steel = spindle.materials["steel"]
    text = deck(spindle.structure.shafts[0].segments, steel.youngs_modulus(20.0), steel.poisson_ratio, steel.density, MESH[name])
    assert solved(CCX, tmp_path, text)[:4] == pytest.approx(COARSE[name], rel=1e-5)
