"""Warm-up: coupled and converged, balanced in heat, steady in the end; a chamber soak against Newton's law of a lumped body."""

import re
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.conftest import ROOT, coarse_warmups
from tests.mounting import told_preload
from tests.sim.conftest import SPEED
from thermospindle.model.bearing.pair import solve
from thermospindle.model.drawing.heating import Friction
from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.material import Law
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.log.turning.warmup import summary
from thermospindle.report.text.warmup import show_warmup, warmup_json, warmup_section
from thermospindle.sim import warmup as module
from thermospindle.sim.operating import operating_point
from thermospindle.sim.warmup import energy, warm_up
from thermospindle.thermal import conduction, friction, heat
from thermospindle.thermal.expansion import expand, influence
from thermospindle.thermal.readout import reading

SCENE = Path(__file__).parents[2] / "scenes" / "hdd_2003"


@pytest.fixture
def coarse():
    with coarse_warmups():
        yield


@pytest.fixture(scope="module")
def model(spindle):
    return conduction.model(spindle, influence(spindle).sections)


# ------------------------------------------------------------------ reading many fields


def test_reading_is_expand(spindle, model):
    """Ring motions and region means as the front of `thermal` gives them, of a field that is uneven everywhere."""
    field = heat.steady(model, heat.running(spindle, 35.0, 2 * SPEED))
    read = reading(model)
    assert read.region_means(model.nodal(field)) == pytest.approx(field.region_means(), rel=1e-12)
    for name, motion in expand(spindle, field).items():
        found = read.motions(spindle, model.nodal(field))[name]
        assert np.array(list(vars(found).values())) == pytest.approx(np.array(list(vars(motion).values())), rel=1e-9, abs=1e-18)


def test_reading_with_an_expansion_law(spindle, model):
    """Laws that vary with temperature are integrated at every point, as `expand` does."""
    aluminium = replace(spindle.materials["aluminium"], thermal_expansion=Law((0.0, 30.0, 100.0), (22e-6, 23e-6, 25e-6)))
    changed = replace(spindle, materials={**spindle.materials, "aluminium": aluminium})
    field = heat.steady(model, heat.running(spindle, 35.0, 2 * SPEED))
    found, expected = reading(model).motions(changed, model.nodal(field)), expand(changed, field)
    assert [m.outer_r for m in found.values()] == pytest.approx([m.outer_r for m in expected.values()], rel=1e-9)
    assert [m.outer_r for m in found.values()] != pytest.approx([m.outer_r for m in expand(spindle, field).values()], rel=1e-3)


def test_reading_where_the_modulus_falls(spindle, model, monkeypatch):
    """The influence at the field's own temperatures, as `expand` takes it, and no points of another mesh looked for."""
    law = Law((0.0, 20.0, 100.0), (71e9, 70e9, 64e9))
    softer = replace(spindle, materials={**spindle.materials, "aluminium": replace(spindle.materials["aluminium"], youngs_modulus=law)})
    field = heat.steady(model, heat.running(spindle, 35.0, 2 * SPEED))
    own = conduction.model(softer, influence(softer).sections)
    expected, hard = expand(softer, field), expand(spindle, field)
    monkeypatch.setattr("thermospindle.thermal.readout.expand", lambda *_: pytest.fail("the finite elements are asked again"))
    found = reading(own).motions(softer, own.nodal(field))
    for name, motion in expected.items():
        assert np.array(list(vars(found[name]).values())) == pytest.approx(np.array(list(vars(motion).values())), rel=1e-9, abs=1e-18)
    assert found["upper"].outer_z != pytest.approx(hard["upper"].outer_z, rel=1e-4)


def test_a_law_that_begins_where_the_warm_up_does(spindle, coarse):
    """Steel given from 20 to 100 C: the steady state is sought from the start, not from 0 C, and what rounding puts below 20 C is 20 C."""
    found = []
    for low in (20.0, 0.0):
        steel = replace(spindle.materials["steel"], thermal_expansion=Law((low, 100.0), (11.5e-6, 11.5e-6)))
        found.append(warm_up(replace(spindle, materials={**spindle.materials, "steel": steel}), SPEED, 20.0, duration=20.0))
    for a, b in zip(*(w.frequencies for w in found), strict=True):
        assert a == pytest.approx(b, rel=1e-9)


# ------------------------------------------------------------------ steps in time


def test_error_estimate_is_third_order_and_holds(spindle, model):
    """The estimate falls by eight for half a step; and it bounds the true error of the step (against sixteen short ones) within a factor."""
    drive = heat.running(spindle, 20.0, SPEED)
    smooth = heat.transient(model, drive, 20.0, np.linspace(0, 120, 31)).nodal[-1]
    steps = [heat.step(model, lambda *_: drive, 0.0, length, smooth) for length in (8.0, 4.0)]
    assert steps[0].error / steps[1].error == pytest.approx(8.0, rel=0.2)
    fine = heat.transient(model, drive, model.field(smooth), np.linspace(0, 8, 17)).nodal[-1]
    true = np.abs(steps[0].end - fine).max()
    assert 0.3 * true < steps[0].error < 10 * true


@pytest.mark.slow
def test_slowest_decay(spindle, model):
    """The time constant of the linearised equation is that of the transient's tail, friction's fall by temperature included."""
    drive = heat.running(spindle, 20.0, SPEED)
    field = heat.steady(model, drive)
    found, end = heat.slowest(model, field, drive), model.nodal(field)
    near = model.field(end + (model.nodal(heat.steady(model, heat.running(spindle, 21.0, SPEED))) - end))
    tail = heat.transient(model, drive, near, np.linspace(0, 8 * found, 81)).nodal - end
    rate = np.log(np.abs(tail[70]).max() / np.abs(tail[80]).max()) / found
    assert 1 / rate == pytest.approx(found, rel=1e-3)
    still = heat.slowest(model, model.field(np.full(end.size, 20.0)), heat.running(spindle, 20.0, 0.0))
    assert found < 0.95 * still  # friction that falls as it warms shortens it


# ------------------------------------------------------------------ the whole warm-up


def _followed_kinds(found):
    """Kinds of the modes at the start and of what became of each in the steady state."""
    kinds = {m.frequency: m.kind for m in found.steady.point.modes}
    return [(m.kind, kinds[f]) for m, f in zip(found.modes, found.steady_frequencies.tolist(), strict=True) if f == f]


def test_steady_modes_of_a_warm_up_that_ends_early(stiffly_mounted, coarse):
    """From its end to the steady state is nearly all the way: an axial mode that two lateral ones pass was told as one of them."""
    found = warm_up(stiffly_mounted, SPEED, 20.0, 90.0, duration=1.0)
    assert found.steady_frequencies[4] == pytest.approx(found.frequencies[-1, 4], abs=1.0)
    assert [(a == "axial") == (b == "axial") for a, b in _followed_kinds(found)] == [True] * 8


def test_modes_of_bearings_that_lose_contact_end(spindle, coarse):
    """Rigid rings of little preload lose contact in hot air; the axial mode of 939 Hz went on as
    163 Hz of a hub that rocks on what is left."""
    found = warm_up(told_preload(spindle, 8.0), SPEED, 20.0, 100.0)
    assert not found.steady.point.state.bearings[0].in_contact
    kinds = _followed_kinds(found)
    assert 0 < len(kinds) < len(found.modes)
    assert all((a == "axial") == (b == "axial") for a, b in kinds)
    _, told = warmup_section(found)
    assert "and no mode there has the shape of modes 1 (axial), " in told.replace("\u00a0", " ")
    assert "nan" not in told.partition("<figure")[0]


def test_energy_is_conserved_at_every_step(warm):
    """Motor loss and friction less convection is what the metal stores, in every step and in the whole."""
    stored = np.diff(warm.history.nodal @ warm.history.model.lumped_capacity)
    assert [h.stored for h in warm.history.heat] == pytest.approx(stored, abs=1e-9 * stored.max())
    total = energy(warm)
    assert total["motor"] == pytest.approx(0.5 * warm.times[-1], rel=1e-9)
    assert total["motor"] + total["friction"] - total["convection"] == pytest.approx(total["stored"], rel=1e-8)
    made = np.array([sum(m.friction.values()) for m in warm.moments])
    assert np.trapezoid(made, warm.times) == pytest.approx(total["friction"], rel=1e-3)


def test_end_is_the_fixed_point_of_the_steady_problem(spindle, warm, model):
    """The last moment is the steady state; and that one answers itself: friction at its preload makes its temperature, its temperature
    its preload, by solvers that know nothing of each other."""
    last, steady = warm.moments[-1], warm.steady
    for name, t in steady.temperatures.items():
        assert last.temperatures[name] == pytest.approx(t, abs=2e-3 * (t - 20.0) + 1e-3)
    assert warm.frequencies[-1] == pytest.approx(warm.steady_frequencies, abs=0.1)
    field = heat.steady(model, heat.running(spindle, 20.0, SPEED, friction.loads(spindle, steady.point.state)))
    assert field.region_means() == pytest.approx(dict(steady.temperatures), abs=1e-6)
    state = solve(spindle, Condition(20.0, SPEED), expand(spindle, field))
    assert [b.preload for b in state.bearings] == pytest.approx(list(steady.preload.values()), rel=1e-6)


def test_halving_the_steps_quarters_the_change(spindle, warm, model):
    """Second order in time of the coupled problem, from a smooth start, seen in the preload."""
    read = reading(model)
    effects = module._Machine(spindle, SPEED, (), read)

    def drive(_, nodal):
        return heat.Running(20.0, SPEED, {b.name: b.preload for b in effects.point(nodal).state.bearings})

    start = warm.history.nodal[np.searchsorted(warm.times, 20.0)]
    preload = []
    for count in (4, 8, 16):
        nodal = start
        for k in range(count):
            nodal = heat.step(model, drive, 160.0 * k / count, 160.0 / count, nodal).end
        preload.append(effects.point(nodal).state.bearings[0].preload)
    assert (preload[0] - preload[1]) / (preload[1] - preload[2]) == pytest.approx(4.0, abs=1.0)


def test_preload_drives_friction(spindle, coarse):
    """With friction from load alone, each moment's heat is f1 P1 d_m omega with P1 = 0.9 cot(alpha)
    times its own preload, and the preload moves by a tenth."""
    loaded = replace(spindle.thermal.friction, f0=0.0, f1=0.01)
    own = replace(spindle, thermal=replace(spindle.thermal, friction=loaded))
    warm = warm_up(own, SPEED, 20.0, duration=300.0, tolerance=0.2)
    for moment in warm.moments:
        for name, made in moment.friction.items():
            assert made == pytest.approx(0.01 * 0.9 / np.tan(np.radians(24.51)) * moment.preload[name] * 9.1e-3 * SPEED, rel=1e-7)
    assert min(m.preload["lower"] for m in warm.moments) < 0.9 * max(m.preload["lower"] for m in warm.moments)


def test_preload_falls_and_modes_with_it(warm):
    """The rings warm first and load the pair; then the aluminium hub outgrows the steel shaft and unloads it."""
    preload = np.array([m.preload["lower"] for m in warm.moments])
    assert preload[0] == pytest.approx(16.0, rel=1e-6)
    assert preload.max() > 16.2
    assert np.argmax(preload) < np.argmin(preload)
    assert preload[-1] < 15.0
    shift = warm.frequencies[-1] - warm.frequencies[0]
    on_bearings = [2, 3, 5, 6]  # the rocking pair and the hub's own; the seat's rocking mode hardly knows of the bearings
    assert np.all(shift[on_bearings] < -1.0)
    assert np.isfinite(warm.frequencies).all()


def test_soak_of_a_good_conductor_is_newtons_law(spindle, coarse):
    """Conductivity a million times higher and bearings that pass any heat: one lump, T = air + (T0 - air) exp(-hA t / C)."""
    materials = {name: replace(m, conductivity=1e6) for name, m in spindle.materials.items()}
    perfect = replace(spindle.thermal.friction, conductance=1e5)
    own = replace(spindle, materials=materials, thermal=replace(spindle.thermal, friction=perfect))
    warm = warm_up(own, 0.0, 20.0, air=60.0)
    model = warm.history.model
    rate = model.film.sum() / model.lumped_capacity.sum()
    assert warm.time_constant == pytest.approx(1 / rate, rel=1e-4)
    expected = 60.0 - 40.0 * np.exp(-rate * warm.times)
    for name in ("base disc", "shaft", "hub plate", "upper outer ring"):
        found = [m.temperatures[name] for m in warm.moments]
        assert found == pytest.approx(expected, abs=0.05)
    assert energy(warm)["friction"] == 0.0


@pytest.mark.slow
def test_long_soak_is_the_chamber_test(spindle):
    """At rest for ever in a chamber at 60 C: the operating point of a soaked spindle, modes included."""
    first = warm_up(spindle, 0.0, 20.0, air=60.0, duration=200.0, tolerance=0.2)
    soaked = operating_point(spindle, Condition(60.0))
    assert list(first.steady.preload.values()) == pytest.approx([b.preload for b in soaked.state.bearings], rel=1e-6)
    assert first.steady_frequencies == pytest.approx([m.frequency for m in soaked.modes[: len(first.modes)]], abs=0.05)
    middle = first.moments[int(np.searchsorted(first.times, first.time_constant))].temperatures
    assert middle["sleeve"] > middle["base disc"] + 2.0  # parts lag behind each other


def test_a_spindle_that_cannot_cool_is_refused(spindle):
    with pytest.raises(BadInput, match="convection"):
        warm_up(replace(spindle, thermal=replace(spindle.thermal, convections=())), SPEED, 20.0)
    for none in (0.0, 1e-300, 1e-12):
        with pytest.raises(BadInput, match="duration"):
            warm_up(spindle, SPEED, 20.0, duration=none)


def test_thermal_runaway_is_told(spindle, coarse):
    """A hub of steel under a load friction ten thousand times too high: warmer inner rings load the pair, which warms them."""
    hot = Friction(0.0, 0.3, Law((20.0,), (1e-5,)), spindle.thermal.friction.conductance)
    steel = {name: replace(m, thermal_expansion=spindle.materials["steel"].thermal_expansion) for name, m in spindle.materials.items()}
    own = replace(spindle, materials=steel, thermal=replace(spindle.thermal, friction=hot))
    with pytest.raises(heat.NotSettled, match="settle"):
        warm_up(own, SPEED, 20.0)


@pytest.mark.parametrize("start", [10.0, 50.0])
def test_a_start_beyond_a_law_is_told_with_scene_and_key(spindle, coarse, start):
    """The law alone was told, without what was asked of it."""
    thermal = spindle.thermal
    told = replace(thermal.friction.viscosity, temperature=(20.0, 40.0), value=(63.1e-6, 26e-6))
    narrow = replace(spindle, thermal=replace(thermal, friction=replace(thermal.friction, viscosity=told)))
    with pytest.raises(OutsideRange, match=rf"spindle.toml: from {start:g} C .* does not reach: thermal.friction.kinematic_viscosity_mm2_per_s: a law given from 20 to 40 C was asked"):
        warm_up(narrow, SPEED, start)


def test_rigid_rings_that_run_away_on_the_way_are_told(tmp_path):
    """Hot inner rings in a cold housing, rigidly preloaded: time, bearing, loads by their names,
    ring temperatures and what they do, instead of a law that ends."""
    scene = (ROOT / "scenes" / "templates" / "grinding.toml").read_text(encoding="utf-8").replace('preload_kind = "spring" ', 'preload_kind = "rigid" ')
    (tmp_path / "spindle.toml").write_text("".join(line for line in scene.splitlines(True) if not line.startswith(("sprung_", "preload_rate"))), encoding="utf-8")
    said = []
    with pytest.raises(OutsideRange) as told:
        warm_up(load(tmp_path), 120000 * RPM, 20.0, progress=said.append)
    assert said, "nothing was told of how far it had come"
    assert all(re.fullmatch(r"0\.[\d]+ of [\d.]+ min", words) for words in said)
    words = re.search(
        r"at 120000 rpm the bearings run away after 0\.\d+ min: rear has Palmgren's load of friction P1 = (\d+) N, [\d.]+ times its (\d+) N at the start \(axial load (\d+) N, at the start (\d+) N\), "
        r"with its inner ring at 1\d\d C and its outer one at \d\d C, a difference that has used up its radial clearance; the load heats it further .* a preload of springs, or less of it, which gives way to hot rings; the way there is computed all the same: --minutes 0\.\d+$",
        str(told.value),
    )
    assert words, told.value
    hot, cold, axial_hot, axial_cold = map(float, words.groups())
    assert hot / cold == pytest.approx(axial_hot / axial_cold, rel=0.01)  # both of the same contact angle
    assert cold > 2 * axial_cold


def test_without_a_steady_state_the_time_that_is_told_is_answered(tmp_path):
    """Nothing was, not even of the first minute; the same moments as of a spindle that has one, and
    what is said of the end is of the last moment."""
    scene = (ROOT / "scenes" / "templates" / "grinding.toml").read_text(encoding="utf-8").replace('preload_kind = "spring" ', 'preload_kind = "rigid" ')
    (tmp_path / "spindle.toml").write_text("".join(line for line in scene.splitlines(True) if not line.startswith(("sprung_", "preload_rate"))), encoding="utf-8")
    found = warm_up(load(tmp_path), 120000 * RPM, 20.0, duration=3.0)
    assert found.steady is None
    assert found.times[-1] == 3.0
    assert found.every == found.moments
    heat_in = energy(found)
    assert heat_in["motor"] + heat_in["friction"] - heat_in["convection"] == pytest.approx(heat_in["stored"], rel=1e-3)
    answer = warmup_json(found)
    assert answer["steady"] is None
    assert answer["unsteady"] == found.unsteady
    assert "does not reach" in found.unsteady
    out = StringIO()
    show_warmup(Console(file=out, width=200), found)
    assert f"No steady state was found: {found.unsteady}. After 0.05 min the bearings are at front" in " ".join(out.getvalue().split())
    assert "\nsteady" not in out.getvalue()
    assert "After 0.05 min the bearings are at" in warmup_section(found)[1]
    assert "| | start | 0.05 min |\n|---|---|---|\n" in summary(found)


def test_springs_are_no_advice_where_springs_are(tmp_path):
    """A preload of springs was advised to a set that has one."""
    (tmp_path / "spindle.toml").write_text((ROOT / "scenes" / "templates" / "grinding.toml").read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(OutsideRange, match=r"leave the range of a law after .*; what helps is a law that is told as far, or more cooling .* or less preload or more radial clearance; the way there is computed all the same: --minutes 0\.\d+$"):
        warm_up(load(tmp_path), 200000 * RPM, 20.0)


@pytest.mark.slow
def test_effects_act_but_for_those_that_prescribe_temperatures(spindle, warm):
    """The film loads the pair as at any operating point; a soak lag, which is a temperature told, is named and does nothing."""
    told = (Addition("soak_lag", {"hub_share": 0.2, "ball_share": 0.5, "nominal_soak": 3600.0}), Addition("lubricant_film", {"scale": 0.5}))
    both, film = (warm_up(replace(spindle, effects=effects), SPEED, 20.0, duration=1.0, tolerance=1.0) for effects in (told, told[1:]))
    assert both.left_out == ("soak_lag",)
    assert (warm.left_out, film.left_out) == ((), ())
    assert both.steady.preload == film.steady.preload
    assert film.steady.preload["lower"] > warm.steady.preload["lower"] + 1.0


@pytest.mark.parametrize(("load", "faster"), [(lambda t: 300 + 800 * t**3, True), (lambda t: 300 + 800 * t**0.5, False), (lambda t: 300 + 800 * t * (2.2 - t) - 500 * t**4, False)])
def test_a_load_that_grew_most_at_first_does_not_run_away(load, faster):
    """A router's rear pair had 3.7 times its load of friction after two minutes, falling from then on: a modulus that
    was told to 100 C alone ended its warm-up, and the bearings were said to run away."""
    course = {t: {"rear": load(t)} for t in np.linspace(0.0, 1.0, 40).tolist()}
    assert module._ever_faster(course, "rear") is faster
