"""The variants' own physics against closed forms, and the campaigns made of them."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

from model.ball_row import kinematics
from model.machine import Condition, Spindle
from model.modes import frf
from model.rotor_base import Element, matrices, rotor_base
from model.scene import load
from sim.effect import HOOKS
from sim.effects import CATALOGUE
from sim.operating import OperatingPoint, operating_point
from tests.blind_score import outcome
from tests.blind_variants import FREQUENCY, SCENE, Job, campaign, left_out
from tests.variants import PLAN, VARIANTS, by_name
from tests.variants.structure import EI, cantilever
from tests.variants.variant import in_series

LINES = np.arange(400.0, 3000.0, 20.0)
HOT = Condition(57.0, 754.0, 4.0, 1800.0)
SLOW = {"modulus_softening/materials_only", "modulus_softening/joints_and_contacts", "loose_inserts/soft_motor"}  # new finite elements


@cache
def spindle() -> Spindle:
    return load(SCENE)


@cache
def undisturbed() -> OperatingPoint:
    return operating_point(spindle(), HOT)


def test_every_effect_of_the_catalogue_has_a_variant_and_there_are_eight_outside():
    named = {name for v in VARIANTS for name in v.truth}
    assert named == {
        e.name for e in CATALOGUE if any(getattr(e, hook) for hook in HOOKS if hook != "imperfections")
    }  # those of runout have no modes
    assert len({v.name for v in VARIANTS}) == len(VARIANTS)
    assert sum(not v.truth for v in VARIANTS) >= 8


@pytest.mark.parametrize("v", [v for v in VARIANTS if v.name not in SLOW], ids=lambda v: v.name)
def test_absent_at_zero_and_there_when_visible(v):
    """Nothing at all at size 0, and little near it; just visible, more than five times the noise of the lines taken together."""

    hot = replace(HOT, speed=max(rpm for _, rpm, _, _ in v.plan) * np.pi / 30 or HOT.speed)

    def seen(size: float) -> np.ndarray:
        value = operating_point(spindle(), hot, [(v.effect, {"size": size})]).frf(LINES)
        return value if v.record is None else v.record(size, hot.temperature, LINES, value)

    plain = operating_point(spindle(), hot, []).frf(LINES)
    assert np.abs(seen(0.0) - plain).max() < 1e-9 * np.abs(plain).max()
    noise = spindle().hammer.noise_of_value * np.linalg.norm(plain) / np.sqrt(plain.size)
    there = np.linalg.norm(seen(v.visible) - plain)
    assert there > 5 * noise
    assert np.linalg.norm(seen(v.visible / 20) - plain) < 0.1 * there


def test_chains_with_more_bodies_are_the_same_in_MuJoCo_and_in_matrices():
    for name in ("hub_flexibility/rim", "magnetic_pull/up", "outside/table", "outside/cable"):
        v = by_name(name)
        point = operating_point(spindle(), HOT, [(v.effect, {"size": v.large})])
        m = point.measurement
        assembled = frf(matrices(point.chain), m.response_rows, m.reference_rows, LINES, "mobility")
        assert point.frf(LINES) == pytest.approx(assembled, rel=1e-6, abs=1e-8 * np.abs(assembled).max())


def test_a_cantilever_bends_by_its_closed_forms():
    """Force at the tip: F L^3 / 3 EI and F L^2 / 2 EI there; moment: M L^2 / 2 EI and M L / EI."""
    length = 0.01
    arm = np.eye(5)  # from motions at the root's height to those of the tip
    arm[0, 4], arm[1, 3] = length, -length
    tip = arm @ cantilever(length) @ arm.T
    assert tip[0, 0] == pytest.approx(length**3 / 3 / EI)
    assert tip[1, 1] == pytest.approx(length**3 / 3 / EI)
    assert tip[0, 4] == pytest.approx(length**2 / 2 / EI)
    assert tip[1, 3] == pytest.approx(-(length**2) / 2 / EI)
    assert tip[4, 4] == pytest.approx(length / EI)


def test_springs_in_series_add_their_compliances_and_losses():
    omega = 2 * np.pi * 1800.0
    one = Element("e", "bearings", "a", "b", 0.0, 4e6 * np.eye(5), 4e6 * 0.03 / omega * np.eye(5))
    both = in_series(one, np.eye(5) / 6e6, 0.2)
    k = 1 / (1 / (4e6 * (1 + 0.03j)) + 1 / (6e6 * (1 + 0.2j)))
    assert both.stiffness == pytest.approx(k.real * np.eye(5))
    assert both.damping * omega == pytest.approx(k.imag * np.eye(5))
    assert in_series(one, np.zeros((5, 5)), 0.2) is one


def test_ten_balls_taken_one_by_one_leave_nothing_of_the_stiffness():
    """The stiffness of a missing ball, turned to the place of every ball, adds up to the row's."""
    v = by_name("outside/missing_ball")
    state = undisturbed().state
    assert v.effect.pair is not None
    gone = v.effect.pair(spindle(), HOT, {"size": 1.0}, state).bearing("upper")
    whole = state.bearing("upper")
    n = whole.row.balls
    first = whole.stiffness - gone.stiffness / (n / (n - 1)) ** (1 / 3)
    b = kinematics(whole.row)
    local = np.linalg.pinv(b[0].T) @ first @ np.linalg.pinv(b[0])
    every = np.einsum("jik,il,jlm->km", b, local, b)
    assert every == pytest.approx(whole.stiffness, rel=1e-6, abs=1e-6 * np.abs(whole.stiffness).max())
    assert gone.stiffness[0, 0] < gone.stiffness[1, 1]  # ball 0 stood on x


def test_a_spring_between_the_rings_holds_its_force():
    """P = P0 - h / compliance: soft, the preload stays; stiff, it is that of fixed positions."""
    v = by_name("constant_force_preload/spring_rate")

    def preload(size: float) -> float:
        return operating_point(spindle(), replace(HOT, speed=0.0), [(v.effect, {"size": size})]).state.bearing("upper").preload

    fixed = preload(0.0)
    assert preload(1e-4) == pytest.approx(fixed, rel=1e-2)
    assert preload(100.0) == pytest.approx(spindle().pair.preload, rel=1e-2)
    assert fixed < preload(0.1) < preload(1.0)


def test_added_masses_are_what_was_added():
    chain = rotor_base(spindle(), undisturbed().state)
    v = by_name("sensor_mass/everywhere")
    assert v.effect.chain is not None
    more = v.effect.chain(spindle(), HOT, {"size": 1.0}, chain)
    total = sum(b.mass for b in more.bodies) - sum(b.mass for b in chain.bodies)
    assert total == pytest.approx(1e-3 * len(spindle().points))


def test_a_campaign_is_drawn_by_its_seed_and_noisy_as_told():
    small = replace(spindle(), tolerances=replace(spindle().tolerances, structure=0, hub=0, preload=0, damping=0, temperature=0, gain=0))
    one, again, other = (campaign(small, [], seed) for seed in (3, 3, 4))
    assert [t.frf for t in one.tests] == [t.frf for t in again.tests]
    assert [t.frf for t in one.tests] != [t.frf for t in other.tests]
    test = one.tests[0]
    assert test.frf is not None
    assert test.frf.sd is None
    exact = operating_point(small, Condition(test.temperature, test.speed), []).frf(FREQUENCY)
    size = np.abs(exact)
    sd = np.hypot(0.004 * size, 0.0002 * size.max(axis=(0, 2), keepdims=True))
    assert np.mean(np.abs(test.frf.value - exact) ** 2 / sd**2) == pytest.approx(1.0, abs=0.02)


def test_a_third_of_the_campaigns_lack_one_to_three_tests():
    lack = [len(left_out(seed, len(PLAN))) for seed in range(300)]
    assert sum(n > 0 for n in lack) == pytest.approx(100, abs=4 * np.sqrt(300 / 3 * 2 / 3))
    assert set(lack) == {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("truth", "verdict", "named", "expected"),
    [
        ([], "none", [], "right"),
        ([], "identified", ["a"], "false alarm"),
        ([], "unexplained", [], "false alarm"),
        ([["a"]], "identified", ["a"], "identified"),
        ([["a", "b"]], "identified", ["b"], "identified"),
        ([["a"]], "ambiguous", ["a", "c"], "in the set"),
        ([["a"]], "two effects", ["a", "c"], "wrong"),  # one too many
        ([["a"]], "ambiguous", ["b", "c"], "wrong"),
        ([["a"]], "identified", ["c"], "wrong"),
        ([["a"]], "none", [], "missed"),
        ([["a"]], "unexplained", [], "missed"),
        ([["a"], ["b"]], "two effects", ["a", "b"], "identified"),
        ([["a"], ["b"]], "identified", ["a"], "half"),
        ([["a"], ["b"]], "two effects", ["a", "c"], "wrong"),
        ([[]], "unexplained", [], "right"),
        ([[]], "identified", ["a"], "wrong"),
        ([[]], "none", [], "missed"),
    ],
)
def test_outcomes(truth, verdict, named, expected):
    assert outcome({"variants": truth, "truth": truth, "verdict": verdict, "effects": named}) == expected


def test_jobs_are_known_again_from_a_line_of_results():
    job = Job(("soak_lag/hub",), (0.25,), 7)
    line = json.loads(json.dumps(asdict(job)))
    assert Job(tuple(line["variants"]), tuple(line["shares"]), line["seed"]).key == job.key
    assert replace(job, seed=8).key != job.key
