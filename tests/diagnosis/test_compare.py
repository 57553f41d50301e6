"""Measurement beside model: errors with their signs and sizes, MAC, FRAC, COMAC; which mode is which is in `test_compare_partners`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import DATA
from tests.diagnosis.exact_campaign import LINES, exact, table
from tests.mounting import told_preload
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import DAMPING_FLOOR, FREQUENCY_FLOOR, observe
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Addition, Condition
from thermospindle.report.text.compare import comparison_json
from thermospindle.sim.campaign.campaign import Campaign, Test, read_campaign
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import as_campaign, run


@pytest.mark.slow
def test_a_scene_beside_its_own_virtual_tests(spindle):
    """In MuJoCo's time domain; the floors hold more than the estimator errs, so the pull is below one but not nothing."""
    short = replace(spindle, hammer=replace(spindle.hammer, record_length=0.1, hits=2))
    found = compare(short, as_campaign(run(short, [60.0]), "virtual tests"))
    assert 0.1 < found.rms_residual < 1.3
    for test in found.tests:
        assert len(test.modes) == 8
        assert test.missing == test.extra == ()


def test_a_scene_beside_its_own_frfs(itself):
    assert 0.1 < itself.rms_residual < 1.3
    assert itself.crossings == ()
    for test in itself.tests:
        assert [m.number for m in test.modes] == list(range(1, 9))
        assert min(m.mac for m in test.modes[:5]) > 0.999
        assert min(m.mac for m in test.modes) > 0.995  # those above 4 kHz, of 3 to 5 % damping, part less well from noise
        assert min(v for v in test.frac.values() if v is not None) > 0.999
    assert min(itself.comac.values()) > 0.994


def test_standard_errors_are_never_below_the_floor(itself):
    for mode in (m for t in itself.tests for m in t.modes):
        assert mode.sd >= FREQUENCY_FLOOR * mode.measured
        assert mode.damping_sd >= DAMPING_FLOOR * mode.damping_measured


def test_standard_errors_grow_with_those_of_the_lines(spindle, clean):
    """Lines said to be twice as uncertain (at ten times one lateral mode is lost): the estimator's
    variance is fourfold, beside a floor that stays."""
    campaign, observed = clean
    tests = tuple(replace(t, frf=replace(t.frf, sd=2 * t.frf.sd)) for t in campaign.tests[:1])
    (rough,) = observe(replace(campaign, tests=tests), spindle)
    floor = np.repeat([FREQUENCY_FLOOR**2, DAMPING_FLOOR**2], 8)
    ratio = (np.diag(rough.covariance) - floor) / (np.diag(observed[0].covariance) - floor)
    assert ratio == pytest.approx(np.full(16, 4.0), rel=0.1)


def test_symmetry_leaves_silent_channels_without_frac(itself):
    """The hub's sides do not answer to a blow in the plane across: noise against zero is no likeness."""
    assert [k for k, v in itself.tests[0].frac.items() if v is None] == [(3, 2), (4, 1)]


@pytest.mark.parametrize("quantity", ["receptance", pytest.param("accelerance", marks=pytest.mark.slow)])
def test_frac_converts_the_quantity(spindle, quantity):
    found = compare(spindle, exact(spindle, (40.0,), quantity))
    assert min(v for v in found.tests[0].frac.values() if v is not None) > 0.999
    assert found.rms_residual < 1.3


def test_a_window_left_in_the_frfs_is_no_misfit(spindle):
    """An exponential window of 60 1/s nearly triples the first mode's decay; both the modes and FRAC must know."""
    campaign = exact(spindle, (20.0,))
    point, (test,) = operating_point(spindle, Condition(20.0)), campaign.tests
    shift = point.frf(LINES, 60.0) - point.frf(LINES)
    windowed = replace(test, window_decay=60.0, frf=replace(test.frf, value=test.frf.value + shift))
    found = compare(spindle, replace(campaign, tests=(windowed,)))
    assert min(v for v in found.tests[0].frac.values() if v is not None) > 0.998  # noise as before, on smaller peaks
    assert found.rms_residual < 1.5
    untold = compare(spindle, replace(campaign, tests=(replace(windowed, window_decay=0.0),)))
    assert min(v for v in untold.tests[0].frac.values() if v is not None) < 0.99


@pytest.mark.parametrize("nodes", [(7, 6, 4, 3, 1), (7, 5, 4, 3, 2)], ids=["another order", "hammers apart from responses"])
def test_points_of_the_campaign(spindle, nodes):
    found = compare(spindle, exact(spindle, (20.0,), nodes=nodes))
    assert tuple(found.comac) == nodes
    assert set(found.tests[0].frac) == {(n, r) for n in nodes for r in (1, 2)}
    assert min(m.mac for m in found.tests[0].modes) > 0.998  # noise on the lateral pair, 2 Hz apart under 5 % damping
    assert min(v for v in found.tests[0].frac.values() if v is not None) > 0.999


def test_a_changed_scene_pulls(spindle, clean, itself):
    """5 % of preload moves the bearing modes, whose stiffness goes with its cube root, by some 0.8 %, and the base's by little."""
    lower = told_preload(spindle, 0.95 * spindle.sets[0].preload)
    found = compare(lower, *clean)
    assert found.rms_residual > 10 * itself.rms_residual  # the error of the temperature explains part of it
    errors = {m.number: 100 * m.error / m.measured for m in found.tests[0].modes}
    assert errors[6] == pytest.approx(-0.8, abs=0.3)
    assert abs(errors[1]) < 0.05


def test_the_scenes_own_effects_are_in_the_model(spindle, clean):
    bonded = replace(spindle, effects=(Addition("bond_softening", by_name("bond_softening").typical()),))
    campaign = exact(bonded, (60.0,))
    assert compare(bonded, campaign).rms_residual < 1.3
    assert compare(spindle, campaign).rms_residual > 25


def test_a_wrong_channel_shows_in_mac_and_comac(spindle, clean):
    campaign, _ = clean
    wrong = []
    for test in campaign.tests:
        value = test.frf.value.copy()
        value[6] *= 0.3  # node 7, the base, read with a wrong sensitivity
        wrong.append(replace(test, frf=replace(test.frf, value=value, sd=test.frf.sd)))
    found = compare(spindle, replace(campaign, tests=tuple(wrong)))
    assert min(m.mac for m in found.tests[0].modes) < 0.995
    assert found.rms_residual < 1.3  # frequencies and dampings do not care
    assert min(v for v in found.tests[0].frac.values() if v is not None) > 0.999  # nor does FRAC, blind to a scale


def test_repeats_that_scatter_widen_the_standard_errors(certain):
    rows = [(f"r{i}", 1002.0 + d) for i, d in enumerate((-3.0, 0.0, 3.0))]
    tests = tuple(Test(name, 20.0, 0.0, repeat=i, modes=(ModeRow(name, 1, "axial", f, 0.1),)) for i, (name, f) in enumerate(rows, 1))
    campaign = Campaign("repeats", certain.name, "mobility", certain.points, tests)
    found = [t.modes[0].sd for t in compare(certain, campaign).tests]
    assert found == pytest.approx([3.0] * 3, rel=0.01)  # standard deviation of -3, 0, 3
    alone = compare(certain, replace(campaign, tests=tests[:1])).tests[0].modes[0].sd
    assert alone == pytest.approx(np.hypot(0.1, FREQUENCY_FLOOR * 999.0))


def test_repeat_scatter_is_pooled_and_holds_for_tests_made_once(certain):
    """Pairs 2 and 4 Hz apart have variances of 2 and 8 Hz2, 5 Hz2 together, one degree of freedom each."""
    rows = [("a", 20.0, 1001.0), ("b", 20.0, 1003.0), ("c", 60.0, 998.0), ("d", 60.0, 1002.0), ("e", 40.0, 1001.0)]
    tests = tuple(Test(name, t, 0.0, modes=(ModeRow(name, 1, "axial", f, 0.1),)) for name, t, f in rows)
    campaign = Campaign("repeats", certain.name, "mobility", certain.points, tests)
    found = [t.modes[0].sd for t in compare(certain, campaign).tests]
    assert found == pytest.approx([np.sqrt(5.0)] * 5, rel=5e-3)


@pytest.mark.parametrize(
    ("made", "sd"),
    [
        ([(1, {}), (1, {})], np.sqrt(2.0)),
        ([(1, {"grease": "old"}), (1, {"grease": "new"})], 0.1),
        ([(1, {"run": 1}), (2, {"run": 2})], np.sqrt(2.0)),
        ([(1, {"grease": "old"}), (1, {"grease": "new"}), (2, {"grease": "new"})], 2.0),
    ],
)
def test_tests_noted_to_differ_are_no_repeats(certain, made, sd):
    """1001, 1003 and 1005.83 Hz: of what was noted as another condition nothing is scatter, unless `repeat` counts it as one."""
    rows = zip(made, (1001.0, 1003.0, 1003.0 + 2 * np.sqrt(2.0)), strict=False)
    tests = tuple(
        Test(f"t{i}", 20.0, 0.0, repeat=repeat, conditions=noted, modes=(ModeRow(f"t{i}", 1, "axial", f, 0.1),)) for i, ((repeat, noted), f) in enumerate(rows)
    )
    found = [t.modes[0].sd for t in compare(certain, Campaign("noted", certain.name, "mobility", certain.points, tests)).tests]
    assert found == pytest.approx([np.hypot(sd, FREQUENCY_FLOOR * 1001.0)] * len(tests), rel=5e-3)


def test_the_error_of_the_temperature_is_in_the_standard_errors(spindle, certain):
    """At 60 C a bearing mode falls by some 0.3 % a kelvin: 0.2 K is more than its standard error; the base hardly moves."""
    campaign = table(spindle, 60.0, ("axial", 1000.3), ("rocking", 1775.1), ("rocking", 1800.2), ("lateral", 4120.0), sd=0.1)
    (some,), (none,) = (compare(s, campaign).tests for s in (spindle, certain))
    assert some.modes[0].sd == pytest.approx(none.modes[0].sd, rel=0.1)
    assert some.modes[3].sd > 10 * none.modes[3].sd


def test_unknown_bodies_are_refused(spindle):
    campaign = table(spindle, 20.0, ("axial", 1002.0))
    point = replace(spindle.points[0], body="lid")
    with pytest.raises(BadInput, match=r"points\.1\.body = 'lid'.*allowed are"):
        compare(spindle, replace(campaign, points=(point,)))


# ---------------------------------------------------------------- another program


def test_a_build_without_effects_is_within_tolerances(spindle):
    campaign = read_campaign(DATA / "foreign_none")
    found = compare(spindle, replace(campaign, tests=tuple(t for t in campaign.tests if t.id in ("T20_n0", "T60_n0", "T60_n7200"))))
    for test in found.tests:
        assert test.missing == test.extra == ()
        assert max(abs(m.error / m.measured) for m in test.modes) < 0.02
        assert min(m.mac for m in test.modes) > 0.97
    answer = comparison_json(found)
    assert answer["rms_pull"] > 10  # tolerances are not in the standard errors
    assert set(answer["tests"][0]) == {
        "id",
        "temperature_C",
        "speed_rpm",
        "modes",
        "missing_Hz",
        "extra_Hz",
        "hidden_Hz",
        "frac",
        "correlation",
        "bands",
    }


def test_modes_that_no_point_shows_are_not_missed(spindle):
    """The driving point of one plane shows no mode of the other: those were told as "computed, not
    measured", among which what is really missed is lost."""
    campaign = read_campaign(DATA / "foreign_bond")
    test = next(t for t in campaign.tests if t.id == "T20_n0")
    one = replace(test.frf, value=test.frf.value[:1, :1], coherence=None, sd=None, response_nodes=(1,), reference_nodes=(1,))
    whole, of_one = (compare(spindle, replace(campaign, tests=(t,))).tests[0] for t in (test, replace(test, frf=one)))
    assert whole.hidden == ()
    assert of_one.hidden == of_one.extra
    assert len(of_one.hidden) == 3
    assert [what for what, _ in of_one.unpaired] == ["computed, and not to be seen from these points"]
    assert comparison_json(replace(compare(spindle, replace(campaign, tests=(test,))), tests=(of_one,)))["tests"][0]["hidden_Hz"] == list(of_one.hidden)


def test_a_soft_bond_pulls_most_at_the_transition(spindle):
    """The pair of the hub on its bearings lies 2 % low at 20 C and 6 % at 60 C; the base knows nothing of it."""
    campaign = read_campaign(DATA / "foreign_bond")
    chosen = tuple(t for t in campaign.tests if t.id in ("T20_n0", "T60_n0"))
    cold, hot = compare(spindle, replace(campaign, tests=chosen)).tests
    assert cold.missing == hot.missing == ()
    for test, low in ((cold, 0.024), (hot, 0.067)):
        for mode in test.modes[5:7]:
            assert mode.error / mode.measured == pytest.approx(low, abs=0.01)
        assert abs(test.modes[0].error / test.modes[0].measured) < 0.01
