"""The blind study's own world: nothing of its own switched on it is the product's model, every hidden mechanism is seen, seeds repeat."""


import numpy as np
import pytest

from tests.blind.campaigns import campaign, in_contact
from tests.blind.departures import ways_of_mass
from tests.blind.laws import law
from tests.blind.mechanisms import mechanisms
from tests.blind.study import FURTHER, FURTHER_FROM, FURTHER_SHARE, SCENES, draw
from tests.blind.world import Record, World, answer
from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.effects import CATALOGUE, usable
from thermospindle.sim.operating import operating_point

LINES = np.arange(400.0, 6000.0, 20.0)
WARM = 50.0


@pytest.mark.parametrize("scene", [*SCENES, FURTHER])
@pytest.mark.parametrize(("temperature", "share"), [(20.0, 0.0), (55.0, 0.0), (60.0, 1.0)])
def test_with_nothing_of_its_own_the_world_is_the_model(scene, temperature, share):
    """Another solver of the balance, matrices instead of MuJoCo, line by line instead of modes: the same FRF."""
    spindle = load(ROOT / scene)
    condition = Condition(temperature, share * spindle.nominal_speed)
    ours, theirs = answer(spindle, condition, World()).frf(LINES), operating_point(spindle, condition, ()).frf(LINES)
    assert np.abs(ours - theirs).max() < 1e-8 * np.abs(theirs).max()


@pytest.mark.parametrize("scene", [*SCENES, pytest.param(FURTHER, marks=pytest.mark.slow)])
def test_every_hidden_mechanism_changes_the_frf_and_none_at_size_zero(scene):
    spindle = load(ROOT / scene)
    condition = Condition(WARM, spindle.nominal_speed)
    plain = answer(spindle, condition, World()).frf(LINES)
    for m in mechanisms(spindle, ()):
        seen = np.abs(answer(spindle, condition, World(), [m.of_size(1.0)]).frf(LINES) - plain).max() / np.abs(plain).max()
        absent = np.abs(answer(spindle, condition, World(), [m.of_size(1.0, lambda place: 0.0)]).frf(LINES) - plain).max()
        assert seen > 1e-3, m.name
        full = answer(spindle, condition, World(stiffness_error=1e-3, damping_error=0.01), [m.of_size(0.5)]).frf(LINES)
        assert np.isfinite(full).all(), m.name
        assert absent < 1e-9 * np.abs(plain).max(), m.name


def test_every_difference_of_the_world_changes_the_frf():
    spindle = load(ROOT / SCENES[0])
    base = answer(spindle, Condition(WARM), World()).frf(LINES)
    differences = [
        World(mesh=1e-3),
        World(constant_kept=True),
        World(grooves_follow_faces=1.0),
        World(weak_mode=(1e-4, 1500.0, 0.02)),
        World(stiffness_error=3e-3),
        World(damping_error=0.03),
        World(motions=(1.02, 1.0)),
        World(motions=(1.0, 1.02)),
        *(World(masses=tuple(0.01 * row)) for row in np.eye(ways_of_mass(spindle))[[5, 6, 10, 14, 15, 16, 19]]),
    ]
    for world in differences:
        assert np.abs(answer(spindle, Condition(WARM), world).frf(LINES) - base).max() > 1e-5 * np.abs(base).max(), world
    polar, fast = World(masses=tuple(0.01 * np.eye(ways_of_mass(spindle))[18])), Condition(WARM, spindle.nominal_speed)
    base = answer(spindle, fast, World()).frf(LINES)
    for world in (polar, World(hysteretic=1.0)):
        assert np.abs(answer(spindle, fast, world).frf(LINES) - base).max() > 1e-4 * np.abs(base).max()


@pytest.mark.parametrize("scene", [SCENES[0], FURTHER])
def test_a_damper_and_a_complex_stiffness_lose_as_much_at_one_frequency(scene):
    """FRFs of either law are the same there, and of a complex stiffness another elsewhere; line by line, also where dampers go by poles."""
    spindle = load(ROOT / scene)
    at = np.array([spindle.structure.damping_frequency, 0.7 * spindle.structure.damping_frequency])
    condition = Condition(WARM, 0.5 * spindle.nominal_speed)
    dampers, alike = (answer(spindle, condition, World(hysteretic=share)).frf(at) for share in (0.0, 1.0))
    apart = np.abs(alike - dampers).max(axis=(0, 1)) / np.abs(dampers).max(axis=(0, 1))
    assert apart[0] < 1e-8
    assert apart[1] > 1e-4


def test_what_is_hidden_leaves_every_bearing_in_contact():
    """Balls that would lose all preload shrink half as much, or a quarter; what leaves some is as it was drawn."""
    drawn = draw(171)
    balls = next(h for h in drawn.hidden if h.mechanism == "balls grow")
    less = in_contact(drawn.spindle, drawn.tests, World(), [balls])[0]
    assert less.size / balls.size in (0.5, 0.25)
    assert in_contact(drawn.spindle, drawn.tests, World(), [less])[0] is less
    assert drawn.made().hidden[0].size == less.size


def test_a_long_record_leaks_nothing_and_a_short_one_does():
    at = answer(load(ROOT / SCENES[0]), Condition(20.0), World())
    exact = at.frf(LINES)
    errors = [np.abs(at.transformed(LINES, Record("rectangular", length)) - exact).max() / np.abs(exact).max() for length in (1.0, 0.05)]
    assert errors[0] < 1e-9
    assert errors[1] > 1e-3


def test_a_window_is_damping_and_repeats_tell_the_noise():
    """The mean of many campaigns' hits is the FRF under the window, and the standard errors come true."""
    spindle = load(ROOT / SCENES[0])
    tests = draw(0).tests[:1]
    record = Record("exponential", 0.3, 0.05, 8, "sd")
    made = campaign(spindle, tests, (), 3, World(), record)
    again = campaign(spindle, tests, (), 3, World(), Record("exponential", 0.3, 0.05, 8, "sd", times=1e-6))
    error = made.campaign.tests[0].frf.value - again.campaign.tests[0].frf.value
    sd = made.campaign.tests[0].frf.sd
    assert made.campaign.tests[0].window_decay == pytest.approx(np.log(20) / 0.3)
    assert np.sqrt(np.mean(np.abs(error) ** 2) / np.mean(sd**2)) == pytest.approx(1.0, abs=0.05)


def test_laws_are_one_at_their_largest_and_nothing_at_the_reference():
    places = [(20.0, 0.0), (35.0, 0.0), (60.0, 0.0), (60.0, 1.0)]
    for seed in range(100):
        own = law(np.random.default_rng(seed), places)
        values = [own(p) for p in places]
        assert max(map(abs, values)) == pytest.approx(1.0)
        assert values[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("seed", "another"), [(9, 20), pytest.param(4, 5, marks=pytest.mark.slow), pytest.param(1, 2, marks=pytest.mark.slow)])
def test_a_seed_is_a_campaign(seed, another):
    one, two = (draw(seed).made().campaign for _ in range(2))
    assert [t.id for t in one.tests] == [t.id for t in two.tests]
    assert all(a.frf == b.frf for a, b in zip(one.tests, two.tests, strict=True))
    other = draw(another).made().campaign
    assert one.tests[0].frf != other.tests[0].frf


def test_a_quarter_of_later_seeds_is_a_machine_tool_spindle():
    assert not any(draw(seed).scene == FURTHER for seed in (1, 30, 70))
    later = [np.random.default_rng([seed, 71]).random() < FURTHER_SHARE for seed in range(FURTHER_FROM, FURTHER_FROM + 300)]
    assert sum(later) >= 60
    assert draw(FURTHER_FROM + later.index(True)).scene == FURTHER
    assert draw(FURTHER_FROM + later.index(False)).scene in SCENES


def test_what_is_hidden_has_right_answers_of_the_catalogue_or_none():
    names = {e.name for e in CATALOGUE}
    for scene in (*SCENES, FURTHER):
        spindle = load(ROOT / scene)
        own = {e.name for e in usable(spindle, CATALOGUE)}
        every = mechanisms(spindle, sorted(names))
        assert {n for m in every for n in m.names} <= names
        assert any(not set(m.names) & own for m in every)
    kinds = [draw(seed).kind for seed in range(60)]
    assert set(kinds) == {"nothing", "one", "two", "outside"}
