"""Derivatives of the campaign's model against differences of its residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import eye_array

from tests.conftest import ROOT
from tests.diagnosis.forward.made import CONDITIONS, KINDS, NOISELESS, SCENES, differences, made, worst_by_kind
from tests.virtual_campaign import drawn, effect, mode_campaign, model_of, truth, virtual_campaign
from thermospindle.diagnosis.data.window import Alike, Window
from thermospindle.diagnosis.forward.derivatives import column, nuisance_jacobian
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.points import otherwise
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.ladder.left_out import LeftOut, unseen
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.operating import operating_point


@pytest.mark.parametrize(("quantity", "decay"), [("mobility", 0.0), ("accelerance", 15.0), ("receptance", 15.0)])
def test_derivatives_of_lines(scene, quantity, decay):
    """Every nuisance parameter, at speed and warm: build, rings and temperature to the error of
    one-sided steps of matrices, the rest exactly."""
    model, x = made(scene, quantity=quantity, window_decay=decay)
    worst = worst_by_kind(model, 1, x)
    assert set(worst) == set(KINDS) - {kinds_of.FLUNG, kinds_of.ORBITS}  # these scenes' balls have none
    for kind in (kinds_of.LAW, kinds_of.GAIN, kinds_of.DRIFT, kinds_of.HAMMER, kinds_of.HAMMER_DRIFT, kinds_of.MISS, kinds_of.MISS_DRIFT, kinds_of.PLACE, kinds_of.ASKEW, kinds_of.LATE, kinds_of.STIFFNESS, kinds_of.DAMPING, kinds_of.MASSES, kinds_of.RECORD):
        assert worst[kind] < 1e-4, kind
    for kind in (kinds_of.BUILD, kinds_of.EXPANSION, kinds_of.COEFFICIENT, *kinds_of.APART, kinds_of.BALLS, kinds_of.CHANGE, kinds_of.TEMPERATURE):
        assert worst[kind] < 5e-3, kind


def test_derivatives_of_lines_beside_loss_factors(scene):
    """Of what is lost alike at all frequencies, tolerances of damping and stiffness change as much."""
    joints = tuple(replace(j, damping_ratio=0.0, loss_factor=0.04) for j in scene.structure.joints)
    model, x = made(replace(scene, structure=replace(scene.structure, joints=joints)))
    x[model.numbers.law[0]] = 0.5, -0.4
    assert 0.1 < model.by_factors < 0.9
    worst = worst_by_kind(model, 1, x)
    assert worst[kinds_of.LAW] < 1e-4
    assert worst[kinds_of.DAMPING] < 1e-4
    assert worst[kinds_of.BUILD] < 5e-3


def windowed(data):
    """A test of lines whose noise a window makes alike."""
    number = np.rint(data.frequency * 0.1).astype(int)
    share = np.linspace(0.6, 1.0, data.value.size).reshape(data.value.shape)
    return replace(data, alike=Alike(eye_array(len(number), format="csr"), number, Window(20.0, 0.1, 0.002), share))


def test_derivatives_of_lines_whose_errors_go_together(scene):
    model, x = made(scene)
    model = replace(model, tests=tuple(windowed(d) for d in model.tests))
    plain = replace(model, tests=tuple(replace(d, alike=None) for d in model.tests))
    rates = [rates_of(m, x, [[], []]) for m in (model, plain)]
    for t, data in enumerate(model.tests):
        r, by = nuisance_jacobian(model, t, x, [], rates[0])
        assert r == pytest.approx(model.residual(t, x, []))
        assert np.allclose(data.alone(by.rows) * np.sqrt(data.smooth), nuisance_jacobian(plain, t, x, [], rates[1])[1].rows, rtol=1e-6, atol=1e-6)  # of a million numbers pytest.approx takes half a minute
        expected = differences(model, t, x, by.numbers).T
        assert np.linalg.norm(by.whole - expected, axis=1) == pytest.approx(np.zeros(len(by.numbers)), abs=5e-3 * np.linalg.norm(expected, axis=1).max())


def test_what_a_bearing_may_change_by_otherwise():
    """With temperature in all tests alike, a third of that in each by itself, and there a share of
    what speed does; nothing where nothing changes."""
    rows, still = ["upper", "lower"], np.zeros(2)
    found = kinds_of.changes_of(["cold", "warm", "fast"], [0.0, 1.0, 0.5], rows, [still, still, np.array([-0.15, -0.05])])
    assert [p.test for p in found] == [None, 1, 1, 2, 2, 2, 2, 2, 2]
    assert [p.sd for p in found] == pytest.approx([1e-3, 3e-4, 3e-4, *[1.5e-4 + 3e-3] * 4, 0.3 * 4.5e-3, 0.3 * 1.5e-3])
    assert [p.name for p in found[3:5]] == [f"change of the balls' stiffness {way} in fast" for way in ("across the axis", "along it and in tilt")]
    assert [p.name for p in found[7:]] == ["change of the balls' stiffness of upper in fast", "change of the balls' stiffness of lower in fast"]
    assert kinds_of.changes_of(["cold"], [0.0], rows, [still]) == []


def test_a_row_that_speed_changes_otherwise_is_alone_in_it(scene):
    """Of two rows: the nuisance of one changes its stiffness and damping by that share, in all directions, and nothing of the other's."""
    effect, values = otherwise({}, rows={1: 0.01})
    state = operating_point(scene, Condition(20.0)).state
    lower, upper = effect.pair(scene, Condition(20.0), values, state).bearings
    assert lower.stiffness == pytest.approx(state.bearings[0].stiffness, rel=1e-12)
    assert upper.stiffness == pytest.approx(1.01 * state.bearings[1].stiffness, rel=1e-12)
    assert upper.damping == pytest.approx(1.01 * state.bearings[1].damping, rel=1e-12)


@pytest.mark.parametrize("rows", [None, 0])
def test_a_test_that_is_left_out_has_no_derivatives(scene, rows):
    """Neither lines nor, of a table of modes, responses: what `spindle ladder` holds out. Every
    ladder over two temperatures once ended here."""
    model, x = made(scene)
    left = unseen(model, LeftOut((1,)))
    if rows == 0:
        left = replace(left, tests=(left.tests[0], replace(left.tests[1], value=left.tests[1].value[:0], sd=left.tests[1].sd[:0])))
    has_none(left, x)


def test_a_test_of_a_flexible_shaft_that_is_left_out_has_none_either():
    """Its reduced model asks for the highest line: no ladder of such a shaft had an end."""
    model, x = made(load(ROOT / "scenes" / "five_bearing"), frequency=np.arange(500.0, 4000.1, 500.0))
    has_none(unseen(model, LeftOut((1,))), x)


def has_none(model, x):
    r, by = nuisance_jacobian(model, 1, x, [], rates_of(model, x, [[], []]))
    assert r.shape == (0,)
    assert by.whole.shape == (len(by.numbers), 0)


@pytest.mark.slow
def test_derivatives_of_a_flexible_shaft():
    """Of its reduced model, at speed and warm, against differences of residuals that have a basis
    of their own on either side: what moves the basis is off by half a per cent."""
    model, x = made(load(ROOT / "scenes" / "five_bearing"), frequency=np.arange(300.0, 4000.1, 50.0))
    worst = worst_by_kind(model, 1, x)
    for kind in (kinds_of.GAIN, kinds_of.DRIFT, kinds_of.HAMMER, kinds_of.HAMMER_DRIFT, kinds_of.RECORD, kinds_of.LAW):
        assert worst[kind] < 1e-8, kind
    for kind in (kinds_of.MISS, kinds_of.MISS_DRIFT, kinds_of.BUILD, kinds_of.EXPANSION, kinds_of.COEFFICIENT, *kinds_of.APART, kinds_of.BALLS, kinds_of.CHANGE, kinds_of.FLUNG, kinds_of.ORBITS, kinds_of.MASSES, kinds_of.TEMPERATURE, kinds_of.STIFFNESS, kinds_of.DAMPING):
        assert worst[kind] < 1e-2, kind


def test_parameters_of_other_tests_do_not_move_a_test(scene):
    """What the derivatives leave out moves nothing: temperature and drift of the other test."""
    model, x = made(scene)
    rates = rates_of(model, x, [[], []])
    for t in (0, 1):
        numbers = nuisance_jacobian(model, t, x, [], rates)[1].numbers
        others = [i for i in range(len(x)) if i not in set(numbers)]
        assert others
        assert {model.parameters[i].test for i in others} == {1 - t}
        assert not differences(model, t, x, others).any()


@pytest.mark.parametrize("rows", [(3, 1, 2), (2, 3)])
def test_gains_and_delays_go_with_sensors_and_not_with_rows(rows):
    """Sensors in another order in the second test, or one of them missing: at what was put in
    nothing is left, and derivatives are those of the residual."""
    scene, each, frequency = load(SCENES["symmetric"]), {1: 0.03, 2: -0.02, 3: 0.05}, np.arange(400.0, 3000.1, 200.0)
    late = {1: 1e-7, 2: 3e-7, 3: -2e-7}  # s
    tests = []
    for t, own in enumerate(((1, 2, 3), rows)):
        test = virtual_campaign(scene, CONDITIONS[:1], t, responses=own, references=(1,), frequency=frequency, noise=NOISELESS).tests[0]
        gain = np.exp(np.array([each[n] for n in own])[:, None] - 2j * np.pi * frequency * np.array([late[n] for n in own])[:, None])[:, None]
        tests.append(replace(test, id=f"t{t}", frf=replace(test.frf, value=test.frf.value * gain)))
    campaign = virtual_campaign(scene, CONDITIONS[:1], 0, references=(1,), frequency=frequency)
    model = model_of(scene, replace(campaign, tests=tuple(tests)))
    gains, delays = ([i for i, p in enumerate(model.parameters) if p.kind == kind] for kind in (kinds_of.GAIN, kinds_of.LATE))
    assert len(gains) == len(delays) == 3
    x = np.zeros(len(model.parameters))
    for own, put in ((gains, each), (delays, late)):
        x[own] = np.array(list(put.values())) / model.parameters[own[0]].sd
    assert np.abs(model.residual(1, x, [])).max() < 1e-6
    assert np.abs(model.residual(1, 0 * x, [])).max() > 1
    assert worst_by_kind(model, 1, x)[kinds_of.GAIN] < 1e-4
    assert worst_by_kind(model, 1, x)[kinds_of.LATE] < 1e-4


@pytest.mark.parametrize("columns", [(3, 1), (3,), (1, 3)])
def test_gains_of_hammers_go_with_their_points(columns):
    """Hammers in another order in the second test, or one of them missing: at what was put in
    nothing is left, and derivatives are those of the residual."""
    scene, each, frequency = load(SCENES["symmetric"]), {1: 0.01, 3: -0.006}, np.arange(400.0, 3000.1, 200.0)
    tests = []
    for t, own in enumerate(((1, 3), columns)):
        test = virtual_campaign(scene, CONDITIONS[:1], t, responses=(1, 2), references=own, frequency=frequency, noise=NOISELESS).tests[0]
        gain = np.exp([each[n] for n in own])
        tests.append(replace(test, id=f"t{t}", frf=replace(test.frf, value=test.frf.value * gain[:, None])))
    campaign = virtual_campaign(scene, CONDITIONS[:1], 0, references=(1,), frequency=frequency)
    model = model_of(scene, replace(campaign, tests=tuple(tests)))
    hammers = [i for i, p in enumerate(model.parameters) if p.kind == kinds_of.HAMMER]
    assert len(hammers) == 2
    x = np.zeros(len(model.parameters))
    x[hammers] = np.array(list(each.values())) / model.parameters[hammers[0]].sd
    assert np.abs(model.residual(1, x, [])).max() < 1e-6
    assert np.abs(model.residual(1, 0 * x, [])).max() > 1
    assert worst_by_kind(model, 1, x)[kinds_of.HAMMER] < 1e-4


@pytest.mark.parametrize(("name", "size", "values"), [("channel_delay", 30.0, {"skew": 0.1}), ("hammer_position", 1.5, {"axis": 0.0, "node": 0.0})])
def test_column_of_a_measuring_effect(scene, name, size, values):
    """What moves rows, gains or delays: against central differences of the residual itself."""
    model, x = made(scene)
    chosen = effect(name)
    first = chosen.parameters[0]
    whole = {p.name: p.neutral for p in chosen.parameters} | {k: v for k, v in values.items() if k in {p.name for p in chosen.parameters}}
    step = 1e-3 * first.prior_sd

    def at(value):
        return [(chosen, {**whole, first.name: value})]

    wanted = (model.residual(1, x, at(size + step)) - model.residual(1, x, at(size - step))) / (2 * step)
    found = column(model, 1, x, at(size), at(size + step), step)
    assert np.linalg.norm(wanted) > 0
    assert np.linalg.norm(found - wanted) < 2e-3 * np.linalg.norm(wanted)


def test_column_of_an_effect_on_matrices(scene):
    """The exact derivative of the FRF by a difference of matrices: with a step a hundred times as large it is as good."""
    model, x = made(scene)
    lost = effect("preload_loss")
    share = lost.parameters[1]

    def at(value):
        return [(lost, {"loss": value, share.name: share.neutral})]

    wanted = (model.residual(1, x, at(0.1 + 1e-4)) - model.residual(1, x, at(0.1 - 1e-4))) / 2e-4
    found = column(model, 1, x, at(0.1), at(0.1 + 2e-3), 2e-3)
    secant = (model.residual(1, x, at(0.1 + 2e-3)) - model.residual(1, x, at(0.1))) / 2e-3
    assert np.linalg.norm(found - wanted) < 5e-3 * np.linalg.norm(wanted)
    assert np.linalg.norm(found - wanted) < 0.5 * np.linalg.norm(secant - wanted)


def test_ways_to_act_that_list_their_values_in_another_order_are_not_taken_for_each_other(scene):
    """Each holds another parameter and lists it first: told by its values alone a way was answered with what another does, and where one core does
    all in one process a campaign had another answer than with two."""
    model, x = made(scene)
    m = effect("thermal_gradient")
    one, other = ({"scale": 2.0, "common_share": a, "level_share": b} for a, b in ((1.0, 0.4), (0.4, 1.0)))
    reordered = {name: other[name] for name in ("scale", "level_share", "common_share")}
    assert list(one.values()) == list(reordered.values())
    at, kept = model.residual(1, x, [(m, one)]), model.residual(1, x, [(m, reordered)])
    assert np.array_equal(kept, made(scene)[0].residual(1, x, [(m, other)]))
    assert np.abs(at - kept).max() > 0.1


def test_modes_beyond_the_band_may_be_wrong_too(scene):
    """By their stiffness, which lends the band a spring: as the lines of a dense model have it
    whose stiffness is off along one of them. Not by their damping."""
    model, _ = made(scene, frequency=np.arange(400.0, 2400.1, 20.0), noise=NOISELESS)
    seen, modes = model.reference.seen, len(model.reference.omega)
    assert 0 < seen < modes
    every = {(i, j) for i in range(modes) for j in range(i, modes)}
    own = {kind: {p.modes for p in model.parameters if p.kind == kind} for kind in (kinds_of.STIFFNESS, kinds_of.DAMPING)}
    assert own == {kinds_of.STIFFNESS: every, kinds_of.DAMPING: {pair for pair in every if pair[0] < seen}}

    drawn_as = np.zeros(len(model.parameters))
    i = next(i for i, p in enumerate(model.parameters) if p.kind == kinds_of.STIFFNESS and p.modes == (seen, seen))
    off = drawn_as + 10.0 * (np.arange(len(drawn_as)) == i)  # tenfold the width: a mode off by 1 %
    plain, softer = (model.linear(0, x, []).matrices for x in (drawn_as, off))
    along = model.reference.over(plain.dofs)[:, seen] * model.reference.omega[seen]
    wanted = plain.stiffness + 10.0 * 2 * kinds_of.STIFFNESS_SD * np.outer(along, along)
    assert softer.stiffness == pytest.approx(wanted, rel=1e-6, abs=1e-9 * np.abs(wanted).max())
    assert np.linalg.norm(model.residual(0, off, []) - model.residual(0, drawn_as, [])) > 1.0


def test_the_truth_leaves_noise(scene):
    """At what was drawn chi2 is 1 a number, for lines and for tables: model, window, quantity and gains are those of the virtual test."""
    errors = drawn(scene, 2, 5)
    for quantity, decay in (("mobility", 0.0), ("accelerance", 15.0)):
        model = model_of(scene, virtual_campaign(scene, CONDITIONS, 5, errors=errors, quantity=quantity, window_decay=decay))
        x = truth(model, errors)
        r = np.concatenate([model.residual(t, x, []) for t in (0, 1)])
        assert np.mean(r**2) == pytest.approx(1.0, abs=0.06)
        assert np.mean(np.concatenate([model.residual(t, 0 * x, []) for t in (0, 1)]) ** 2) > 10


def test_what_conditions_do_to_modes_is_what_their_frequencies_do(scene):
    """Of the drawing, to first order, against the poles where they are told apart: nothing at the
    reference, and 1.5 K above it to a twentieth of the most that a mode moves."""
    campaign = mode_campaign(scene, (Condition(20.0), Condition(21.5)), 3)
    model = model_of(scene, campaign)
    found = model.by_condition
    assert found.shape == (2, 2, model.reference.seen)
    assert np.abs(found[0]).max() < 1e-9
    linear = [model.linear(t, np.zeros(len(model.parameters)), []).matrices for t in (0, 1)]
    cold, warm = (np.sqrt(eigh(m.stiffness, m.mass, eigvals_only=True)) for m in linear)
    first = int(np.argmin(np.abs(cold - model.reference.omega[0])))
    wanted = np.log(warm / cold)[first : first + model.reference.seen]
    assert np.abs(wanted).max() > 1e-4
    for i, j in ((0, 1), (2, 3)):  # of a pair, which is in no order of its own, the sum
        assert found[1, 0, [i, j]].sum() == pytest.approx(wanted[[i, j]].sum(), abs=0.05 * np.abs(wanted).max())
    assert found[1, 0].sum() == pytest.approx(wanted.sum(), abs=0.05 * np.abs(wanted).max())


def test_a_test_that_cannot_be_worked_out_has_no_change_by_its_condition(scene, monkeypatch):
    model, _ = made(scene)
    assert model.by_condition[1].any()
    linear = CampaignModel.linear

    def unbuilt(self, t, x, effects):
        if t == 1:
            raise ValueError("no spindle")
        return linear(self, t, x, effects)

    monkeypatch.setattr(CampaignModel, "linear", unbuilt)
    assert not replace(model).by_condition[1].any()
