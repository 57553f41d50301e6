"""Random machines at random conditions: a result that keeps the laws of mechanics, or a named error."""

import warnings
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from scipy.linalg import LinAlgWarning, lapack, lu_factor, lu_solve

from tests.torture.conftest import EXAMPLES, outcome
from tests.torture.machines import WITH_A_SECTION, Moved, conditions, expansions, fields, heated, moved, rotors, stub
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.modes import modes
from thermospindle.model.rotor.static import static
from thermospindle.model.scene.reading import build
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point
from thermospindle.thermal.expansion import expand

SOME, ROUGH = 60, 3e-3
LEAST = 1e-3  # N: a row that is not pressed has forces of rounding alone
HERE = Path("random") / "spindle.toml"  # serves messages only


def symmetric(matrix, within):
    size = np.sqrt(np.abs(np.outer(np.diag(matrix), np.diag(matrix)))).max()
    return np.abs(matrix - matrix.T).max() <= within * max(size, np.abs(matrix).max(), 1e-300)


def keeps_the_laws(point):
    """Invariants of any spindle at any condition."""
    spindle, state, linear = point.spindle, point.state, point.linear
    for matrix in (linear.mass, linear.damping, linear.stiffness):
        assert np.all(np.isfinite(matrix))
    assert symmetric(linear.mass, 1e-12), "mass"
    for b in state.all_bearings:
        assert np.all(np.isfinite(b.stiffness))
        assert symmetric(b.stiffness, 1e-6 if spindle.ball_inertia and point.condition.speed else 1e-9), "stiffness of a bearing"
    assert symmetric(linear.stiffness, 1e-6), "stiffness"
    for b in state.bearings:
        assert b.deformation >= 0 or not b.in_contact
        assert np.isfinite([b.preload, b.contact_angle, b.deformation, b.contact_force]).all()
    own = modes(point.chain, linear, 2 * spindle.hammer.band[1])
    for m in own:
        assert np.isfinite(m.frequency)
        assert m.frequency > 0
        assert np.isfinite(m.damping_ratio)
        assert abs(sum(m.energy.values()) - 1) < 1e-9, "energy"
        assert np.all(np.isfinite(m.shape))
    return own


def reciprocal(point, frequency):
    """H_ij at one sense of rotation is H_ji at the other; at rest, of one and the same matrix. Of
    up to `SOME` degrees of freedom: a fine mesh has thousands."""
    if any(np.any(b.damping != b.damping.T) for b in point.state.all_bearings):
        return
    w = 2 * np.pi * frequency
    linear = point.linear
    dynamic = linear.stiffness + 1j * w * linear.damping - w**2 * linear.mass
    back = linear.stiffness + 1j * w * linear.damping.T - w**2 * linear.mass
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)  # singular: is told by the condition
        factors = lu_factor(dynamic)
    condition, _ = lapack.zgecon(factors[0], np.linalg.norm(dynamic, 1))
    if condition > 1e-10:
        some = np.unique(np.linspace(0, len(dynamic) - 1, SOME).astype(int))
        forces = np.eye(len(dynamic))[:, some]
        a, b = lu_solve(factors, forces)[some], np.linalg.solve(back, forces)[some].T
        assert np.abs(a - b).max() <= 1e-4 * np.abs(a).max(), "reciprocity"


def balanced(point):
    """The axial forces of all ball rows on a rigid rotor, and the load on it, are in balance; springs bear what they bear."""
    spindle, state = point.spindle, point.state
    if len(spindle.bearings) < 2 or any(s.spring is not None for s in spindle.sets) or point.condition.speed:
        return
    senses = [b.sense for b in spindle.bearings]
    if len(set(senses)) < 2 or len({(b.inner_body, b.outer_body) for b in spindle.bearings}) > 1:
        return
    forces = np.array([s * b.preload for s, b in zip(senses, state.bearings, strict=True)])
    assert abs(abs(forces.sum()) - abs(spindle.axial_load)) <= 1e-6 * max(np.abs(forces).max(), abs(spindle.axial_load), LEAST), "axial balance"


def checked(raw, condition, expansion=None):
    spindle = build(raw, HERE)
    point = operating_point(spindle, Condition(condition[0], condition[1] * RPM), expansion=expansion)
    own = keeps_the_laws(point)
    reciprocal(point, 1.1 * own[0].frequency if own else 100.0)
    balanced(point)
    return spindle, point


def finite(motions) -> float:
    """The largest motion (m) of any ring, which all are finite."""
    every = np.array([astuple(motion)[:-1] for motion in motions.values()])
    assert np.all(np.isfinite(every)), "ring motions"
    return float(np.abs(every).max(initial=0.0))


def difference(one, other) -> float:
    return max((float(np.abs(np.subtract(astuple(one[b])[:-1], astuple(other[b])[:-1])).max()) for b in one), default=0.0)


NOTHING_HOLDS_A_TILT = Moved("grinding", ((("structure", "joints", 1, "tilt_stiffness_N_m_per_rad", 0), 0.0),))

COVERED = Moved("five_bearing", ((("section", "regions", 9, "z_mm", 0), 0.0), (("section", "regions", 9, "z_mm", 1), 0.97)))
"""A ring that reaches over three others, whose raceways it leaves no face."""

TOO_FINE = Moved("mk7702", ((("shafts", 0, "longest_element_mm"), 1e-6),))


@given(moved(), conditions, expansions())
@example(NOTHING_HOLDS_A_TILT, (20.0, 0.0), None)
@example(TOO_FINE, (20.0, 0.0), None)
@example(COVERED, (20.0, 0.0), None)
def test_a_machine_keeps_the_laws_or_is_refused(machine, condition, expansion):
    with outcome("machines"):
        spindle, point = checked(machine.raw(), condition, expansion)
        assert np.all(np.isfinite(point.frf(np.linspace(*spindle.hammer.band, 7)))), "FRF"


@pytest.mark.slow
@settings(max_examples=max(2, EXAMPLES // 4))
@given(heated, fields(), conditions)
def test_so_does_one_with_its_own_temperature_field(machine, temperatures, condition):
    """The finite elements to `ROUGH`, which is seven times quicker; what a field does must be what its regions do together."""
    with outcome("machines with a field"):
        spindle = build(machine.raw(), HERE)
        field = temperatures(spindle)
        motions = expand(spindle, field, ROUGH)
        size = finite(motions)
        if len(set(field.values())) == 1:
            soaked = expand(spindle, next(iter(field.values())), ROUGH)
            assert difference(soaked, motions) <= 1e-9 * size, "a soak is the field that is the same everywhere"
        checked(machine.raw(), (next(iter(field.values())), condition[1]), lambda spindle: motions)


@pytest.mark.slow
@settings(max_examples=max(2, EXAMPLES // 40))
@given(moved(WITH_A_SECTION), conditions)
def test_and_one_soaked_by_the_whole_chain(machine, condition):
    with outcome("machines soaked"):
        checked(machine.raw(), condition)


@given(rotors(), conditions)
@example(stub(), (20.0, 0.0))
def test_a_rotor_keeps_the_laws_or_is_refused(raw, condition):
    with outcome("rotors"):
        spindle, point = checked(raw, condition)
        for p in spindle.points[:2]:
            answer = static(spindle, point.chain, p)
            assert not answer.shares or abs(sum(answer.shares.values()) - 1) < 1e-9, "shares of the compliance"
