"""How much of what is hidden shows in a campaign of the blind study, and which effects of the catalogue are right answers."""

from dataclasses import replace

import numpy as np
import pytest

from tests.blind.alike import left, right, right_names
from tests.blind.campaigns import campaign, measured
from tests.blind.mechanisms import mechanisms
from tests.blind.study import FURTHER, SCENES, draw
from tests.blind.visible import change, seen, visibility, visibility_beside
from tests.blind.world import Record, World, answer
from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.effects import CATALOGUE


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
