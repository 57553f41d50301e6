"""The blind study's own world: nothing of its own switched on it is the product's model, every hidden mechanism is seen, seeds repeat."""

from dataclasses import replace

import numpy as np
import pytest

from tests.blind.alike import left, right, right_names
from tests.blind.campaigns import (
    CONVENTIONS_FROM,
    DRAWINGS_FROM,
    HAMMERS_FROM,
    MASSES_FROM,
    SENSORS_FROM,
    campaign,
    further,
    glued,
    in_contact,
    measured,
)
from tests.blind.departures import ways_of_mass
from tests.blind.laws import law
from tests.blind.mechanisms import mechanisms
from tests.blind.study import FURTHER, FURTHER_FROM, FURTHER_SHARE, SCENES, draw
from tests.blind.visible import change, seen, visibility, visibility_beside
from tests.blind.world import Record, World, answer
from tests.conftest import ROOT
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.report.text.diagnosis.answer import diagnosis_json
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


@pytest.mark.slow
def test_thermal_motions_off_by_two_per_cent_are_nothing():
    """Radial motions 2 % larger and axial ones 1.5 % smaller were a set of three effects on the rings, and none of them probable otherwise."""
    drawn = draw(948)
    made = campaign(drawn.spindle, drawn.tests, (), 948, replace(drawn.made().world, motions=(1.02, 0.985)), drawn.made().record)
    found = diagnose(drawn.spindle, made.campaign)
    assert diagnosis_json(found)["verdict"] == "none"


def test_scenes_of_later_worlds_are_far_off_one_in_four():
    """Joints and standing bodies are not what the scene says, in all tests, beside what tolerances leave."""
    spindle = load(ROOT / SCENES[0])
    worlds = [further(World(), seed, spindle) for seed in range(DRAWINGS_FROM, DRAWINGS_FROM + 200)]
    assert 35 <= sum(bool(w.off) for w in worlds) <= 65
    assert {len(w.off) for w in worlds} == {0, 1, 2, 3}
    assert all(0.05 < abs(np.log(times)) < 0.5 for w in worlds for _, times in w.off)
    assert not further(World(), DRAWINGS_FROM - 1, spindle).off
    drawn = draw(948)
    world, record = drawn.made().world, drawn.made().record
    stiffness = [
        next(j for j in campaign(drawn.spindle, drawn.tests, (), 948, w, record).built.structure.joints if j.name == "flange").stiffness
        for w in (world, replace(world, off=(("flange axial stiffness", 1.5),)))
    ]
    assert np.array(stiffness[1]) / np.array(stiffness[0]) == pytest.approx([1, 1, 1.5, 1, 1])


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


@pytest.mark.slow
def test_what_honest_programs_do_otherwise_is_in_later_worlds():
    """Channels that are late, balls on orbits of their own at speed alone, losses of a complex
    stiffness where lines are not from records in time; all among what may stand in."""
    drawn, record = draw(948), Record("line", told="noise", times=1e-9)
    worlds = [further(World(), seed, drawn.spindle) for seed in range(CONVENTIONS_FROM, CONVENTIONS_FROM + 20)]
    assert {w.late for w in worlds} == {0.0, 1e-8, 3e-8}
    assert {w.own_orbits for w in worlds} == {True, False}
    assert {w.hysteretic for w in worlds} == {0.0, 0.5, 1.0}
    before = further(World(), CONVENTIONS_FROM - 1, drawn.spindle)
    assert (before.late, before.own_orbits, before.hysteretic) == (0.0, False, 0.0)
    machine = load(ROOT / FURTHER)
    for speed, least, most in ((0.0, 0.0, 1e-12), (machine.nominal_speed, 1e-3, 1.0)):
        plain, own = (answer(machine, Condition(WARM, speed), World(own_orbits=w)).frf(LINES) for w in (False, True))
        assert least <= np.abs(own - plain).max() / np.abs(plain).max() <= most
    plain = campaign(drawn.spindle, drawn.tests, (), 948, World(), record)
    late = campaign(drawn.spindle, drawn.tests, (), 948, World(late=1e-7), record)
    for a, b in zip(plain.campaign.tests, late.campaign.tests, strict=True):
        turned = np.angle(b.frf.value / a.frf.value) / (2 * np.pi * a.frf.frequency)
        told = np.abs(a.frf.value) > 1e-6 * np.abs(a.frf.value).max()
        each = [own[here] for own, here in zip(turned, told, strict=True) if here.any()]
        assert max(map(np.ptp, each)) < 1e-10 < max(np.abs(own).max() for own in each) < 4e-7
    assert seen(late, drawn.spindle).columns.shape[1] == seen(plain, drawn.spindle).columns.shape[1] + len(drawn.spindle.points)
    in_time = campaign(drawn.spindle, drawn.tests, (), 948, World(hysteretic=1.0), Record("rectangular", 0.3, 1.0, 4, "nothing", 1.0))
    assert in_time.world.hysteretic == 0.0


def test_hammers_of_later_worlds_have_gains_of_their_own():
    """The same in all tests and another in each; FRFs of a seed from before have none, to the last bit."""
    drawn, record = draw(948), Record("line", told="noise", times=1e-9)

    def gains(seed: int, world: World) -> np.ndarray:
        plain, other = (campaign(drawn.spindle, drawn.tests, (), seed, w, record).campaign for w in (World(), world))
        return np.array([np.median(np.abs(b.frf.value / a.frf.value), axis=(0, 2)) for a, b in zip(plain.tests, other.tests, strict=True)])

    steady, drifting, missing = (gains(948, World(**{which: by})) for which, by in (("hammer_gain", 0.01), ("hammer_drift", 0.01), ("miss_drift", 1e-3)))
    assert np.ptp(missing, axis=0).min() > 1e-3
    assert np.ptp(steady, axis=0).max() < 1e-6 < np.ptp(steady, axis=1).min()
    assert np.ptp(drifting, axis=0).min() > 1e-3
    assert further(World(), HAMMERS_FROM, drawn.spindle).hammer_gain > 0
    assert not further(World(), MASSES_FROM - 1, drawn.spindle).masses
    assert len(further(World(), MASSES_FROM, drawn.spindle).masses) == ways_of_mass(drawn.spindle)
    assert drawn.made().world.motions == World().motions
    assert drawn.made().world.hammer_gain == 0.0


@pytest.mark.slow
def test_sensors_of_later_worlds_are_glued_by_hand():
    """The same in all tests, each channel by itself; of seeds from before to the last bit where
    they are drawn. Both are among what may stand in, where a world has them."""
    drawn, record = draw(948), Record("line", told="noise", times=1e-9)
    assert further(World(), SENSORS_FROM - 1, drawn.spindle).place == further(World(), SENSORS_FROM - 1, drawn.spindle).askew == 0.0
    assert min(further(World(), SENSORS_FROM, drawn.spindle).place, further(World(), SENSORS_FROM, drawn.spindle).askew) > 0
    plain = campaign(drawn.spindle, drawn.tests, (), 948, World(), record)
    for world in (World(place=4e-4), World(askew=0.02)):
        made = campaign(drawn.spindle, drawn.tests, (), 948, world, record)
        for a, b in zip(plain.campaign.tests, made.campaign.tests, strict=True):
            assert 1e-3 < np.linalg.norm(b.frf.value - a.frf.value) / np.linalg.norm(a.frf.value) < 0.1
        of = seen(made, drawn.spindle)
        assert of.columns.shape[1] == seen(plain, drawn.spindle).columns.shape[1] + 4 * len(drawn.spindle.points)
        off = np.random.default_rng(1).standard_normal((2, len(drawn.spindle.points), 2))
        sensors = glued(drawn.spindle, world.place * off[0], world.askew * off[1])
        ways = [[answer(made.built, Condition(p.temperature, p.speed), World(), (), p.place(drawn.spindle), None, s).frf(of.frequency) for p in drawn.tests] for s in (None, sensors)]
        aside = of.whitened([b - a for a, b in zip(*ways, strict=True)])
        assert of.beside(aside[:, None]).whole < 0.1 * np.linalg.norm(aside)


@pytest.mark.slow
def test_of_two_that_do_the_same_neither_shows_beside_the_other():
    """And one that does something else shows nearly as well as alone. What hammers are off by is
    among what may stand in, where a world has it."""
    drawn = draw(995)
    made = drawn.made()
    of = seen(made, drawn.spindle)
    alone, beside = (f(made, drawn.spindle, of) for f in (visibility, visibility_beside))
    assert all(0.5 * a < b <= a for a, b in zip(alone, beside, strict=True))
    twice = replace(made, hidden=(made.hidden[1], made.hidden[1]))
    assert max(visibility_beside(twice, drawn.spindle, of)) < np.sqrt(len(drawn.tests)) < visibility(twice, drawn.spindle, of)[0]
    gains = seen(replace(made, world=replace(made.world, hammer_gain=0.01)), drawn.spindle)
    assert gains.columns.shape[1] == of.columns.shape[1] + len(drawn.spindle.hammer.hammer_nodes) * (1 + len(drawn.tests)) * 3  # of force, and of either way


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


def _visible(drawn, hidden):
    made = campaign(drawn.spindle, drawn.tests, [hidden], 5)
    return visibility(made, drawn.spindle, seen(made, drawn.spindle, 40))[0]


def test_what_a_tolerance_does_is_not_visible():
    """A mount softer by one standard deviation of its tolerance in every test: the very change of one column,
    of 36,000 standard errors; not quite its length, for the tolerance is of a logarithm and has its own prior."""
    drawn = draw(2)
    softer = next(m for m in mechanisms(drawn.spindle, ()) if m.name == "mount softens").of_size(0.0, lambda place: 1.0)
    assert _visible(drawn, replace(softer, size=100 * drawn.spindle.tolerances.structure)) < 1.5


def test_visibility_beside_a_weak_mode_is_what_it_is_without():
    """An oscillator of 0.1 g on the base, which the modal errors of the drawing do not have."""
    drawn = draw(2)
    made = campaign(drawn.spindle, drawn.tests, [next(m for m in mechanisms(drawn.spindle, ()) if m.name == "bearing damping").of_size(1.0)], 5)
    seen_by = [
        visibility(of, drawn.spindle, seen(of, drawn.spindle, 40))[0]
        for of in (replace(made, world=replace(made.world, stiffness_error=1e-3, weak_mode=weak)) for weak in (None, (1e-4, 1500.0, 0.02)))
    ]
    assert seen_by[1] == pytest.approx(seen_by[0], rel=0.05)


@pytest.mark.parametrize("record", [Record(), Record("rectangular", 0.15, 1.0, 4), Record("exponential", 0.15, 0.1, 4, times=2.0)], ids=lambda r: r.kind)
def test_noise_by_which_changes_are_measured_is_the_noise_of_the_lines(record):
    """Of as many campaigns as are enough to tell it to some per cent; of a window that was undone
    as much more as the window takes of the noise."""
    drawn = draw(2)
    made = campaign(drawn.spindle, drawn.tests[:1], [], 5, World(), record)
    of = seen(made, drawn.spindle)
    at = answer(made.built, Condition(drawn.tests[0].temperature, drawn.tests[0].speed), World(), (), drawn.tests[0].place(drawn.spindle))
    frfs = [measured(at, drawn.spindle, record, np.random.default_rng(seed)) for seed in range(40)]
    scatter = np.std([f.value for f in frfs], axis=0, ddof=1)
    lines = [int(np.argmin(np.abs(frfs[0].frequency - f))) for f in of.frequency]
    window = np.exp(-record.decay * np.linspace(0.0, record.length, 10_000))
    stated = of.sd[0] * np.sqrt(len(frfs[0].frequency) / len(of.frequency)) * np.sqrt(np.mean(window**2))
    assert np.sqrt(np.mean((scatter[..., lines] / stated) ** 2)) == pytest.approx(1.0, abs=0.05)


def test_visibility_grows_with_size_and_gains_hide_a_gain():
    drawn = draw(2)
    m = next(m for m in mechanisms(drawn.spindle, ()) if m.name == "bearing damping")
    small, large = (_visible(drawn, m.of_size(s)) for s in (0.0, 1.0))
    assert 0 < small < large
    gain = next(m for m in mechanisms(drawn.spindle, ()) if m.name == "sensor gain").of_size(0.0)
    assert _visible(drawn, gain) < 2.0


@pytest.mark.slow
def test_right_answers_are_what_effects_do():
    """Rings apart are cleared by what opens the clearance, not by a film, which only brings them
    together; softer bearings by a bond; a whirl force by nothing."""
    drawn = draw(2)
    every = {m.name: m for m in mechanisms(drawn.spindle, ("clearance_opening", "lubricant_film", "bond_softening"))}
    pieces = [every["outer rings grow"].of_size(0.5), every["cross-coupled stiffness of the bearings"].of_size(1.0)]
    made = campaign(drawn.spindle, drawn.tests, pieces, 5)
    effects = [e for e in CATALOGUE if e.name in ("clearance_opening", "lubricant_film", "bond_softening", "plate_prestress")]
    rings, whirl = right(made, drawn.spindle, seen(made, drawn.spindle, 40), effects)
    assert rings == ["clearance_opening"]
    assert whirl == []


@pytest.mark.parametrize(("scene", "turns"), [(SCENES[0], 1.0), (FURTHER, 0.0), (FURTHER, 1.0)])
def test_a_small_change_of_the_frfs_is_what_other_matrices_do(scene, turns):
    """To the first order, by central differences of a mobility that is solved anew, where
    gyroscopic moments make matrices unsymmetric and where not."""
    spindle = load(ROOT / scene)
    at = answer(spindle, Condition(30.0, turns * spindle.nominal_speed), World())
    frequency = np.linspace(*spindle.hammer.band, 12)
    own, factor = at.linear, np.random.default_rng(3).normal(size=at.linear.mass.shape)
    low, high = (replace(own, stiffness=own.stiffness * (1 + by * factor), damping=own.damping * (1 + by * factor), mass=own.mass * (1 + by)) for by in (-1e-7, 1e-7))
    moved = at.moved(frequency, at.ways(frequency), high)
    assert moved == pytest.approx((replace(at, linear=high).frf(frequency) - replace(at, linear=low).frf(frequency)) / 2, abs=1e-4 * np.abs(moved).max())


def test_a_mass_is_a_disk_of_some_shape():
    """At the centre of the hub and without inertia, which a disk as its prior has it is not: its
    height and its radius of gyration are sought."""
    drawn = draw(736)
    made = campaign(drawn.spindle, drawn.tests[:3], [next(m for m in mechanisms(drawn.spindle, ("added_disk",)) if m.name == "mass added to hub").of_size(1.0)], 5)
    effects = [e for e in CATALOGUE if e.name == "added_disk"]
    of = seen(made, drawn.spindle, 40)
    d = change(made, drawn.spindle, of, made.hidden[0], 1e-4, World())
    rest = left(made, drawn.spindle, of, [d], effects)[0]["added_disk"]
    assert rest < 0.2 * of.beside(d[:, None]).whole


def test_right_names():
    """Of a change of 1000 standard errors; what its author had in mind may leave 300, what nobody
    had in mind nothing that could be told or a hundredth."""
    left_by = {"meant": 200.0, "nearer": 150.0, "further": 250.0, "nearly": 9.0, "same": 3.0, "off": 900.0}
    assert right_names(("meant", "off"), left_by, 1000.0) == ["meant", "nearer", "nearly", "same"]
    assert right_names((), left_by, 1000.0) == ["nearly", "same"]
    assert right_names((), left_by, 200.0) == ["same"]
    assert right_names((), left_by, 4.0) == []
    assert right_names(("off",), left_by, 2.0) == ["off"]  # too little to be told
