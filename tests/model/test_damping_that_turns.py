"""Dampers that turn with their rotor, against the eigenvalues of the whole problem and the closed form of Jeffcott's rotor."""

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import RotorBase, matrices
from thermospindle.model.rotor.modes import modes
from thermospindle.model.scene.reading import load
from thermospindle.model.sense import of_damping, turned_dampings
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point


def rotor(tmp_path, rpm, loss=False) -> RotorBase:
    """The template's shaft and disc; all its damping a loss factor of the shaft and the disc's seat where asked."""
    text = (ROOT / "scenes" / "templates" / "rotor.toml").read_text(encoding="utf-8")
    (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
    chain = operating_point(load(tmp_path / "spindle.toml"), Condition(20.0, rpm * RPM)).chain
    turning = {b.name for b in chain.bodies if b.turns}
    lossy = [replace(e, damping=0 * e.damping, loss_factor=0.02) if e.b in turning and e.a in turning else e for e in chain.elements]
    return replace(chain, elements=tuple(lossy)) if loss else chain


def exact(chain: RotorBase, near: complex) -> float:
    """Damping ratio of the pole nearest one, of the problem with the circulatory matrix of every
    damper between turning bodies, turned as a whole."""
    turning = {b.name for b in chain.bodies if b.turns}
    linear = matrices(chain)
    still = matrices(replace(chain, elements=tuple(e if e.a in turning and e.b in turning else replace(e, damping=0 * e.damping, loss_factor=0.0) for e in chain.elements), speed=0.0)).damping
    turn = np.zeros_like(still)
    at = {dof: k for k, dof in enumerate(linear.dofs)}
    for (body, move), k in at.items():
        if move in ("x", "tilt_x"):
            other = at[body, move.replace("x", "y")]
            turn[k, other], turn[other, k] = -1.0, 1.0
    n, inverse = len(still), np.linalg.inv(linear.mass)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ (linear.stiffness - chain.speed * still @ turn), -inverse @ linear.damping]])
    poles = np.linalg.eigvals(state)
    pole = poles[np.argmin(np.abs(poles - near))]
    return float(-pole.real / abs(pole))


@pytest.mark.parametrize("loss", [False, True], ids=["dampers", "loss factors"])
@pytest.mark.parametrize("rpm", [0.0, 6000.0, 12000.0, 20000.0])
def test_damping_ratio_of_what_turns(tmp_path, rpm, loss):
    chain = rotor(tmp_path, rpm, loss)
    for mode in modes(chain, highest=650.0):
        turned = turned_dampings(chain, [mode])[0]
        assert turned == pytest.approx(exact(chain, mode.pole), abs=2e-5 + 0.01 * mode.damping_ratio)
        if rpm == 0.0 or mode.kind == "axial":
            assert turned == pytest.approx(mode.damping_ratio, rel=1e-12)


def test_above_the_critical_speed_the_forward_mode_is_fed(tmp_path):
    """Jeffcott's rotor: its bearings' share of the damping stays, and what turns is felt as 1 - w /
    p by the forward mode and as 1 + w / p by the backward one."""
    chain = rotor(tmp_path, 12000.0)
    found = modes(chain, highest=650.0)
    backward, forward = found[:2]
    assert (backward.whirl, forward.whirl) == ("backward", "forward")
    bearings = replace(chain, elements=tuple(e if e.group == "bearings" else replace(e, damping=0 * e.damping) for e in chain.elements))
    for mode, sense in ((forward, 1), (backward, -1)):
        stays = next(m for m in modes(bearings, highest=650.0) if m.whirl == mode.whirl).damping_ratio
        expected = stays + (mode.damping_ratio - stays) * (1 - sense * chain.speed / abs(mode.pole))
        assert turned_dampings(chain, [mode])[0] == pytest.approx(expected, abs=5e-5)
    [said] = of_damping(chain, found)
    assert f"feed the lateral forward mode at {forward.frequency:.1f} Hz: -0.055 % of critical where 0.85 % is computed, which is unstable" in said


def test_of_the_reference_nothing_is_said(spindle):
    point = operating_point(spindle, Condition(20.0, spindle.nominal_speed))
    assert of_damping(point.chain, point.modes) == []
