"""Constant loss factors: what modes lose by their strain energy, beside FRFs of complex stiffness, and as MuJoCo has it."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.literature.test_rotors import chain, rotor
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import Matrices, RotorBase, matrices
from thermospindle.model.rotor.frf import frf
from thermospindle.model.rotor.modes import modes
from thermospindle.model.scene.reading import build
from thermospindle.model.units import RPM
from thermospindle.sim.hammer.test import impact_tests
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.run import run_spindle

ETA = 0.02


def bar(**damping: float):
    """The free shaft of the shipped scene, with other damping keys."""
    path = ROOT / "scenes" / "free_shaft" / "spindle.toml"
    raw = tomllib.loads(path.read_text())
    del raw["shafts"][0]["damping_ratio"]
    raw["shafts"][0] |= damping
    return build(raw, path)


def on_springs(speed: float = 0.0) -> RotorBase:
    """A lossy shaft with discs on lossless bearings that differ in x and y."""
    spindle = rotor((211.0, 0.3, 7810.0), [(50, 1500)], [], [(500, 15.0, 0.1, 0.2), (1000, 25.0, 0.3, 0.6)], [(0, 3e7, 2e7), (1500, 3e7, 2e7)], longest=75.0)
    made = chain(spindle, speed)
    beams = spindle.structure.shafts[0].elements
    return replace(made, elements=tuple(replace(e, loss_factor=ETA) if e.name in beams else e for e in made.elements))


def test_every_mode_of_a_free_bar_is_damped_alike():
    """Half of the loss factor, whatever the frequency; viscous damping of the stiffness rises in proportion to it."""
    found = [m.damping_ratio for m in modes(chain(bar(loss_factor=ETA)))[:8]]
    assert found == pytest.approx([ETA / 2] * 8, rel=1e-6)
    viscous = modes(chain(bar(damping_ratio=ETA / 2)))[:4]
    assert viscous[3].damping_ratio / viscous[0].damping_ratio == pytest.approx(viscous[3].frequency / viscous[0].frequency, rel=1e-3)


def test_a_mode_loses_by_the_strain_energy_of_what_is_lossy():
    """At rest to the square of the damping ratio; turning, a whirl has the damper of the mode at rest, so that frequencies come in."""
    for m in modes(on_springs())[:12]:
        share = sum(v for name, v in m.energy.items() if name.startswith("shaft "))
        assert m.damping_ratio == pytest.approx(ETA / 2 * share, rel=2e-4, abs=1e-12)
    assert all(m.damping_ratio > -1e-12 for m in modes(on_springs(3000 * RPM)))


def test_peaks_are_those_of_complex_stiffness():
    """|H| of (1 + i eta) K_e at the first four natural frequencies across, 1 %: the rest is what other modes add there."""
    made = on_springs()
    linear, own = matrices(made), [e for e in made.elements if e.loss_factor]
    lossless = matrices(replace(made, elements=tuple(replace(e, loss_factor=0.0) for e in made.elements)))
    lossy = matrices(replace(made, elements=tuple(own))).stiffness
    row = np.zeros(len(linear.dofs))
    row[linear.dofs.index(("disc 0", "x"))] = 1.0
    peaks = [m.frequency for m in modes(made) if abs(m.shape @ row) > 0.1][:4]
    viscous = frf(linear, row, row, np.array(peaks))[0, 0]
    for f, value in zip(peaks, viscous, strict=True):
        s = 2j * np.pi * f
        dynamic = lossless.stiffness + 1j * ETA * lossy + s * lossless.damping + s**2 * lossless.mass
        assert value == pytest.approx(row @ np.linalg.solve(dynamic, row), rel=1e-2)


@pytest.mark.parametrize("speed", [0.0, 3000 * RPM], ids=["rest", "3000rpm"])
def test_mujoco_has_the_same_dampers(speed):
    made = on_springs(speed)
    own, linear = matrices(made), mjcf.linearise(mjcf.chain_spec(made, 1e-6).compile())
    assert np.abs(linear.damping - own.damping).max() < 1e-9 * np.abs(own.damping).max()
    assert np.linalg.eigvalsh((own.damping + own.damping.T) / 2)[0] > -1e-12 * np.abs(own.damping).max()


def test_a_shaft_is_hit_without_mujoco_or_refused():
    """Dampers between all nodes: the reduced model's record has the peaks of the exact FRFs;
    MuJoCo's steps are refused, with what is allowed."""
    path = ROOT / "scenes" / "mk7702" / "spindle.toml"
    raw = tomllib.loads(path.read_text())
    del raw["shafts"][0]["damping_ratio"], raw["shafts"][0]["origins"]["damping_ratio"]
    raw["shafts"][0]["loss_factor"] = 0.05
    point = operating_point(build(raw, path), Condition(20.0, 0.0))
    with pytest.raises(BadInput, match=r"loss_factor of \w+: makes dampers between all \d+ degrees of freedom.*--element reduced.*damping_ratio"):
        impact_tests([point])
    with pytest.raises(BadInput, match=r"loss_factor of \w+: .*; allowed are runout --path linear \(the exact harmonic answer\), or damping_ratio in its place$"):
        run_spindle([operating_point(point.spindle, Condition(20.0, 3000 * RPM))], 0.1, 12500.0)
    found = impact_tests([point], element="reduced", noise=False)[0].estimate
    exact = point.frf(found.h1.frequency, found.window_decay)
    assert np.abs(found.h1.value - exact).max() < 5e-3 * np.abs(exact).max()


def test_planes_stay_apart():
    """Equal modes of two planes: nothing of one is felt in the other."""
    found: Matrices = matrices(on_springs())
    of = [[i for i, (_, move) in enumerate(found.dofs) if move in plane] for plane in (("x", "tilt_y"), ("y", "tilt_x"))]
    assert not found.damping[np.ix_(*of)].any()


@pytest.mark.parametrize(
    ("damping", "said"),
    [
        ({}, "damping_ratio is missing; one of damping_ratio .* and loss_factor .* is allowed"),
        ({"damping_ratio": 0.01, "loss_factor": 0.02}, "damping_ratio and loss_factor are both told"),
        ({"loss_factor": 1.2}, "loss_factor.* = 1.2.*less than 1"),
    ],
    ids=["none", "both", "too large"],
)
def test_refused(damping, said):
    with pytest.raises(BadInput, match=said):
        bar(**damping)
