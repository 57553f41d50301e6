"""Derivatives of the campaign's model against differences of its residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import eye_array

from tests.conftest import ROOT
from tests.virtual_campaign import drawn, effect, mode_campaign, model_of, truth, virtual_campaign
from thermospindle.diagnosis.data.window import Alike, Window
from thermospindle.diagnosis.forward.derivatives import column, nuisance_jacobian
from thermospindle.diagnosis.forward.linear import products, together
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.forward.response import Response
from thermospindle.diagnosis.ladder.left_out import LeftOut, unseen
from thermospindle.diagnosis.parameters.nuisance import (
    APART,
    BALLS,
    BUILD,
    CHANGE,
    COEFFICIENT,
    DAMPING,
    DRIFT,
    EXPANSION,
    FLUNG,
    GAIN,
    HAMMER,
    HAMMER_DRIFT,
    MASSES,
    MISS,
    MISS_DRIFT,
    RECORD,
    STIFFNESS,
    TEMPERATURE,
    changes_of,
)
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.modes import poles
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Noise

NOISELESS = Noise(0.0, 0.0)
CONDITIONS = (Condition(20.0), Condition(45.0, 7200 * RPM))
FREQUENCY = np.arange(400.0, 6000.1, 40.0)
KINDS = (BUILD, EXPANSION, COEFFICIENT, *APART, BALLS, CHANGE, FLUNG, MASSES, TEMPERATURE, GAIN, DRIFT, HAMMER, HAMMER_DRIFT, MISS, MISS_DRIFT, STIFFNESS, DAMPING, RECORD)
SCENES = {"reference": ROOT / "scenes" / "hdd_2003", "symmetric": ROOT / "tests" / "scenes" / "symmetric"}


@pytest.fixture(scope="module", params=SCENES)
def scene(request):
    return load(SCENES[request.param])


def made(scene, **changes):
    """A model of two tests, and nuisance values one to two standard deviations from the drawing."""
    errors = drawn(scene, 2, 3)
    model = model_of(scene, virtual_campaign(scene, CONDITIONS, 3, errors=errors, **{"frequency": FREQUENCY} | changes))
    x = truth(model, errors) + 0.7 * np.random.default_rng(11).standard_normal(len(model.parameters))
    x[[p.kind == RECORD for p in model.parameters]] = 0.0  # records are long enough
    return model, x


def differences(model, t, x, numbers, step=2e-3):
    """Central differences (N, k) of the residuals."""
    columns = []
    for i in numbers:
        up, down = x.copy(), x.copy()
        up[i] += step
        down[i] -= step
        columns.append((model.residual(t, up, []) - model.residual(t, down, [])) / (2 * step))
    return np.array(columns).T


def worst_by_kind(model, t, x):
    """Largest error of a derivative over the length of that derivative, for every kind of nuisance parameter."""
    rates = rates_of(model, x, [[] for _ in model.tests])
    r, by = nuisance_jacobian(model, t, x, [], rates)
    jacobian, numbers = by.whole, by.numbers
    assert len(by.rows) <= len(numbers)  # a gain and its drift do the same
    assert by.information == pytest.approx(jacobian @ jacobian.T, rel=1e-9, abs=1e-9 * np.abs(by.information).max())
    assert by.products(r) == pytest.approx(jacobian @ r, abs=1e-9 * np.abs(jacobian @ r).max())
    assert np.array_equal(r, model.residual(t, x, []))
    assert len(set(numbers)) == len(numbers)
    wanted = differences(model, t, x, numbers)
    length = np.linalg.norm(wanted, axis=0)
    error = np.linalg.norm(jacobian.T - wanted, axis=0) / np.maximum(length, 1e-3 * np.median(length))
    kinds = np.array([model.parameters[i].kind for i in numbers])
    return {k: error[kinds == k].max() for k in KINDS if k in kinds}


@pytest.mark.parametrize(("quantity", "decay"), [("mobility", 0.0), ("accelerance", 15.0), ("receptance", 15.0)])
def test_derivatives_of_lines(scene, quantity, decay):
    """Every nuisance parameter, at speed and warm: build, rings and temperature to the error of one-sided steps of matrices, the rest exactly."""
    model, x = made(scene, quantity=quantity, window_decay=decay)
    worst = worst_by_kind(model, 1, x)
    assert set(worst) == set(KINDS) - {FLUNG}  # these scenes' balls have none
    for kind in (GAIN, DRIFT, HAMMER, HAMMER_DRIFT, MISS, MISS_DRIFT, STIFFNESS, DAMPING, MASSES, RECORD):
        assert worst[kind] < 1e-4, kind
    for kind in (BUILD, EXPANSION, COEFFICIENT, *APART, BALLS, CHANGE, TEMPERATURE):
        assert worst[kind] < 5e-3, kind


def windowed(data):
    """A test of lines whose noise a window makes alike."""
    number = np.rint(data.frequency * 0.1).astype(int)
    share = np.linspace(0.6, 1.0, data.value.size).reshape(data.value.shape)
    return replace(data, alike=Alike(eye_array(len(number), format="csr"), number, Window(20.0, 0.1, 0.002), share))


def test_derivatives_of_lines_whose_errors_go_together(scene):
    model, x = made(scene)
    model = replace(model, tests=tuple(windowed(d) for d in model.tests))
    for t, data in enumerate(model.tests):
        r, by = nuisance_jacobian(model, t, x, [], rates_of(model, x, [[], []]))
        assert r == pytest.approx(model.residual(t, x, []))
        plain = replace(model, tests=tuple(replace(d, alike=None) for d in model.tests))
        assert data.alone(by.rows) * np.sqrt(data.smooth) == pytest.approx(nuisance_jacobian(plain, t, x, [], rates_of(plain, x, [[], []]))[1].rows, rel=1e-6, abs=1e-6)
        expected = differences(model, t, x, by.numbers).T
        assert np.linalg.norm(by.whole - expected, axis=1) == pytest.approx(np.zeros(len(by.numbers)), abs=5e-3 * np.linalg.norm(expected, axis=1).max())


def test_what_a_bearing_may_change_by_otherwise():
    """With temperature in all tests alike, a third of that in each by itself, and there a share of what speed does; nothing where nothing changes."""
    found = changes_of(["cold", "warm", "fast"], [0.0, 1.0, 0.5], [0.0, 0.0, -0.1])
    assert [p.test for p in found] == [None, 1, 1, 2, 2]
    assert [p.sd for p in found] == pytest.approx([1e-3, 3e-4, 3e-4, 1.5e-4 + 3e-3, 1.5e-4 + 3e-3])
    assert changes_of(["cold"], [0.0], [0.0]) == []


@pytest.mark.parametrize("rows", [None, 0])
def test_a_test_that_is_left_out_has_no_derivatives(scene, rows):
    """Neither lines nor, of a table of modes, responses: what `spindle ladder` holds out. Every ladder over two temperatures once ended here."""
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
    """Of its reduced model, at speed and warm, against differences of residuals that have a basis of their own on either side: what moves the basis is off by half a per cent."""
    model, x = made(load(ROOT / "scenes" / "five_bearing"), frequency=np.arange(300.0, 4000.1, 50.0))
    worst = worst_by_kind(model, 1, x)
    for kind in (GAIN, DRIFT, HAMMER, HAMMER_DRIFT, RECORD):
        assert worst[kind] < 1e-8, kind
    for kind in (MISS, MISS_DRIFT, BUILD, EXPANSION, COEFFICIENT, *APART, BALLS, CHANGE, FLUNG, MASSES, TEMPERATURE, STIFFNESS, DAMPING):
        assert worst[kind] < 1e-2, kind


@pytest.mark.parametrize("before", [0.0, 0.004])
def test_records_that_end_early(scene, before):
    """A record of T seconds and its discrete Fourier transform, mode by mode: p A e^(p t) from the hit, some time `before` which it began, to its end under the window."""
    decay = 15.0
    model, x = made(scene, window_decay=decay)
    x[[p.kind == RECORD for p in model.parameters]] = 1.0
    data, linear = model.tests[0], model.linear(0, x, [])
    p, rows = poles(linear.matrices), linear.chain
    duration = 1 / 40.0  # s, of lines 40 Hz apart
    lines = np.arange(10, 150) / duration
    away = 2j * np.pi * lines + decay + rows.decay - p.value[:, None]
    residue = (rows.response_rows @ p.right)[:, None, :] * (p.left @ rows.reference_rows.T).T[None] * p.value
    test = replace(data.test, pretrigger=before)
    at_lines = replace(data, test=test, frequency=lines, value=np.zeros((*data.value.shape[:2], len(lines)), complex))
    gain = np.ones(len(rows.gain))
    exact = residue @ ((1 - np.exp(-away * (duration - before))) / away) * rows.gain[:, None, None]
    cut, uncut = (Response(linear, at_lines, gain, share).value for share in (1.0, 0.0))
    assert np.abs(cut - exact).max() < 1e-9 * np.abs(exact).max()
    assert np.abs(uncut - exact).max() > 1e-3 * np.abs(exact).max()


def test_derivatives_of_records_that_end_early(scene):
    """By an element's mass, damping and stiffness, against central differences; without what they do to the end of the records they are wrong by parts
    in a hundred."""
    model, x = made(scene, window_decay=15.0)
    data, linear = replace(model.tests[0], test=replace(model.tests[0].test, pretrigger=0.004)), model.linear(0, x, [])
    m, gain, n = linear.matrices, np.ones(len(linear.chain.gain)), len(linear.matrices.mass)
    random = np.random.default_rng(4)
    for which in ("mass", "damping", "stiffness"):
        own = getattr(m, which)
        change = own * np.outer(*[random.uniform(0.5, 1.0, n)] * 2)  # of every element, and symmetrical
        rates = [change if k == which else np.zeros((n, n)) for k in ("mass", "damping", "stiffness")]

        def at(share, by):
            return Response(replace(linear, matrices=replace(m, **{which: own + by * change})), data, gain, share)  # noqa: B023

        for share, least, most in ((1.0, 0.0, 1e-3), (0.0, 1e-2, np.inf)):
            difference = (at(1.0, 1e-6).value - at(1.0, -1e-6).value) / 2e-6
            found = at(share, 0.0).moved(products(*rates))[0]
            assert least < np.abs(found - difference).max() / np.abs(difference).max() < most, (which, share)
        i, j = np.array([0, 1]), np.array([0, 3])
        vectors = random.standard_normal((n, 4))
        by_pair = [np.outer(vectors[:, a], vectors[:, b]) + np.outer(vectors[:, b], vectors[:, a]) for a, b in zip(i, j, strict=True)]
        zero = np.zeros((n, n))
        power = {"mass": 2, "damping": 1, "stiffness": 0}[which]
        at_once = np.concatenate(list(at(1.0, 0.0).moved_together(vectors, power, [(i, j)])))
        by_each = [products(*[pair if k == which else zero for k in ("mass", "damping", "stiffness")]) for pair in by_pair]
        apart = at(1.0, 0.0).moved(together(by_each))
        assert np.abs(at_once - apart).max() < 1e-9 * np.abs(apart).max()


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_change_of_more_products_than_degrees_of_freedom(scene, share):
    """Of all elements of all three matrices at once: the sum of what each does, beside one of few products."""
    model, x = made(scene, window_decay=15.0)
    data, linear = model.tests[0], model.linear(0, x, [])
    m, zero = linear.matrices, np.zeros_like(linear.matrices.mass)
    random = np.random.default_rng(4)
    changes = [own * np.outer(*[random.uniform(0.5, 1.0, len(own))] * 2) for own in (m.mass, m.damping, m.stiffness)]
    at = Response(linear, data, np.ones(len(linear.chain.gain)), share)
    few = products(zero, zero, np.diag(np.eye(len(zero))[0]) * m.stiffness[0, 0])
    every = products(*changes)
    assert len(every.power) > len(zero)
    apart = [products(*[change if k == which else zero for k in range(3)]) for which, change in enumerate(changes)]
    found, of_few = at.moved(together([every, few]))
    assert found == pytest.approx(sum(at.moved(by)[0] for by in apart), abs=1e-10 * np.abs(found).max())
    assert of_few == pytest.approx(at.moved(few)[0], abs=1e-10 * np.abs(of_few).max())


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
def test_gains_go_with_sensors_and_not_with_rows(rows):
    """Sensors in another order in the second test, or one of them missing: at what was put in nothing is left, and derivatives are those of the residual."""
    scene, each, frequency = load(SCENES["symmetric"]), {1: 0.03, 2: -0.02, 3: 0.05}, np.arange(400.0, 3000.1, 200.0)
    tests = []
    for t, own in enumerate(((1, 2, 3), rows)):
        test = virtual_campaign(scene, CONDITIONS[:1], t, responses=own, references=(1,), frequency=frequency, noise=NOISELESS).tests[0]
        gain = np.exp([each[n] for n in own])[:, None, None]
        tests.append(replace(test, id=f"t{t}", frf=replace(test.frf, value=test.frf.value * gain)))
    campaign = virtual_campaign(scene, CONDITIONS[:1], 0, references=(1,), frequency=frequency)
    model = model_of(scene, replace(campaign, tests=tuple(tests)))
    gains = [i for i, p in enumerate(model.parameters) if p.kind == GAIN]
    assert len(gains) == 3
    x = np.zeros(len(model.parameters))
    x[gains] = np.array(list(each.values())) / model.parameters[gains[0]].sd
    assert np.abs(model.residual(1, x, [])).max() < 1e-6
    assert np.abs(model.residual(1, 0 * x, [])).max() > 1
    assert worst_by_kind(model, 1, x)[GAIN] < 1e-4


@pytest.mark.parametrize("columns", [(3, 1), (3,), (1, 3)])
def test_gains_of_hammers_go_with_their_points(columns):
    """Hammers in another order in the second test, or one of them missing: at what was put in nothing is left, and derivatives are those of the residual."""
    scene, each, frequency = load(SCENES["symmetric"]), {1: 0.01, 3: -0.006}, np.arange(400.0, 3000.1, 200.0)
    tests = []
    for t, own in enumerate(((1, 3), columns)):
        test = virtual_campaign(scene, CONDITIONS[:1], t, responses=(1, 2), references=own, frequency=frequency, noise=NOISELESS).tests[0]
        gain = np.exp([each[n] for n in own])
        tests.append(replace(test, id=f"t{t}", frf=replace(test.frf, value=test.frf.value * gain[:, None])))
    campaign = virtual_campaign(scene, CONDITIONS[:1], 0, references=(1,), frequency=frequency)
    model = model_of(scene, replace(campaign, tests=tuple(tests)))
    hammers = [i for i, p in enumerate(model.parameters) if p.kind == HAMMER]
    assert len(hammers) == 2
    x = np.zeros(len(model.parameters))
    x[hammers] = np.array(list(each.values())) / model.parameters[hammers[0]].sd
    assert np.abs(model.residual(1, x, [])).max() < 1e-6
    assert np.abs(model.residual(1, 0 * x, [])).max() > 1
    assert worst_by_kind(model, 1, x)[HAMMER] < 1e-4


def test_derivatives_of_mode_tables():
    """ln frequency and ln damping, by perturbation of the poles; at rest, where members of a pair must not swap from one side to the other, and at speed."""
    scene = load(SCENES["reference"])
    for damping in (True, False):
        model = model_of(scene, mode_campaign(scene, CONDITIONS, 3, damping=damping))
        x = 0.3 * np.random.default_rng(2).standard_normal(len(model.parameters))
        for t in (0, 1):
            assert max(worst_by_kind(model, t, x).values()) < 5e-3


@pytest.mark.parametrize(("name", "real"), [("reference", False), ("reference", True), ("symmetric", False)])
def test_derivatives_of_shapes(name, real):
    """At rest, where two modes of a plane each coincide, and at speed, where whirls part."""
    scene = load(SCENES[name])
    model = model_of(scene, mode_campaign(scene, CONDITIONS, 3, shapes=[p.node for p in scene.points], real=real))
    data = model.tests[0]
    assert data.count == 2 * len(data.frequency) + len(data.frequency) * (len(scene.points) - 1) * (1 if real else 2)
    x = 0.1 * np.random.default_rng(2).standard_normal(len(model.parameters))
    for t in (0, 1):
        r, by = nuisance_jacobian(model, t, x, [], rates_of(model, x, [[] for _ in model.tests]))
        jacobian, numbers = by.whole, by.numbers
        assert len(r) == model.tests[t].count
        shapes = slice(2 * len(data.frequency), None)  # the others are a hundred times as sure
        wanted = differences(model, t, x, numbers)[shapes]
        error = np.abs(jacobian.T[shapes] - wanted).max(axis=0)
        assert np.all(error < 0.04 * np.abs(wanted).max(axis=0) + 2e-3 * np.abs(wanted).max())


@pytest.mark.parametrize("decay", [8.0, -3.0])
def test_derivatives_of_mode_tables_under_a_window(decay):
    """One that was not corrected, or corrected though there was none, at speed: damping ratios are those seen, a quarter more than the poles' own. Their
    derivatives were wrong by as much."""
    window = effect("window_damping")
    model = model_of(load(SCENES["symmetric"]), mode_campaign(load(SCENES["symmetric"]), CONDITIONS[1:], 3))
    model = replace(model, present=((window, {p.name: p.neutral for p in window.parameters} | {"decay": decay}),))
    x = 0.3 * np.random.default_rng(2).standard_normal(len(model.parameters))
    assert model.linear(0, x, []).chain.decay == decay
    assert max(worst_by_kind(model, 0, x).values()) < 5e-3


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
    """Of the drawing, to first order, against the poles where they are told apart: nothing at the reference, and 1.5 K above it to a twentieth of the most that a mode moves."""
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
