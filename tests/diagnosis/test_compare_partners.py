"""Tables of modes beside the model: partners through large misfits and crossings, missing and extra modes, false poles."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from tests.conftest import DATA, SCENE
from tests.diagnosis.exact_campaign import table
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import DAMPING_FLOOR, observe
from thermospindle.diagnosis.prediction.modes import Predicted, predict
from thermospindle.diagnosis.prediction.partners import BELIEVABLE, numbered, partners
from thermospindle.report.text.compare import comparison_json, show_comparison
from thermospindle.sim.campaign.campaign import Campaign, Test, read_campaign

# at 60 C the third mode of the paper's own analysis is at 1771 Hz, 61 above the measured, and the scene's at 1775
JANG = [("T20", (-21, -7, 57, 33, -58)), ("T60", (-26, -8, 65, 39, -53))]


@pytest.mark.parametrize(("test", "errors"), JANG, ids=[t for t, _ in JANG])
def test_the_papers_measured_table(certain, test, errors):
    """Computed - measured of Jang et al. (2003), Table 2, in whole Hz; one standard error is 1 Hz there."""
    campaign = read_campaign(SCENE / "measured" / "jang_2003")
    found = {t.test.id: t for t in compare(certain, campaign).tests}[test]
    assert [round(m.error) for m in found.modes] == list(errors)
    # 0.2 K of the test's temperature adds up to 0.26 Hz to that: the rocking modes fall by 1.3 Hz/K at 60 C
    assert [m.residual for m in found.modes] == pytest.approx([m.error for m in found.modes], rel=4e-2)
    assert all(m.damping_residual is None and m.mac is None for m in found.modes)
    assert found.missing == ()
    assert len(found.extra) == 3  # the lateral pair and the upper rocking mode, which the paper does not print


def test_missing_and_extra_modes(spindle):
    found = compare(spindle, table(spindle, 20.0, ("axial", 1002.0), ("axial", 1300.0), ("rocking", 1795.0), ("rocking", 1821.0))).tests[0]
    assert [round(m.computed) for m in found.modes] == [1002, 1795, 1821]
    assert found.missing == (1300.0,)
    assert found.extra == pytest.approx([1545.0, 2010.0, 4496.5, 4498.9, 5551.5], abs=0.1)


def test_a_missing_mode_counts_as_the_largest_believable_error(spindle):
    near = compare(spindle, table(spindle, 20.0, ("axial", 1002.07 / 1.079)))
    lost = compare(spindle, table(spindle, 20.0, ("axial", 1002.07 / 1.2)))
    assert near.tests[0].missing == ()
    assert lost.tests[0].missing == (1002.07 / 1.2,)
    assert lost.tests[0].modes == ()
    assert lost.rms_residual == pytest.approx(BELIEVABLE * 1002.07 / 1.2, rel=2e-3)  # in standard errors of 1 Hz


def test_damping_error_in_standard_errors(spindle):
    mode = compare(spindle, table(spindle, 20.0, ("axial", 1002.07))).tests[0].modes[0]
    assert mode.damping_residual == pytest.approx((mode.damping_computed - 0.01) / np.hypot(0.001, DAMPING_FLOOR * 0.01))
    assert mode.damping_computed == pytest.approx(0.00539, abs=1e-5)


@pytest.mark.parametrize("verbose", [True, False])
def test_damping_whose_error_nobody_told_is_compared_in_per_cent(spindle, verbose):
    """It was blank, as if nothing had been measured; in no other number does it count."""
    told, bare = table(spindle, 20.0, ("axial", 1002.07)), table(spindle, 20.0, ("axial", 1002.07))
    [test] = bare.tests
    bare = replace(bare, tests=tuple(replace(test, id=f"T{k}", modes=tuple(replace(r, test=f"T{k}", damping_ratio_sd=None) for r in test.modes)) for k in range(1 if verbose else 22)))
    found = compare(spindle, bare)
    mode, sure = found.tests[0].modes[0], compare(spindle, told).tests[0].modes[0]
    assert (mode.damping_residual, mode.damping_measured) == (None, 0.01)
    assert mode.damping_error == sure.damping_error == pytest.approx(mode.damping_computed / 0.01 - 1)
    assert found.tests[0].count == 1
    own = comparison_json(found)["tests"][0]["modes"][0]
    assert (own["damping_error_percent"], own["damping_pull"], own["damping_sd"]) == (pytest.approx(100 * mode.damping_error), None, None)
    show_comparison(Console(file=(text := StringIO()), width=200), found, verbose)
    assert f" {100 * mode.damping_error:+.0f} %" in text.getvalue()
    assert "compared in per cent" in text.getvalue()


def at(*frequency):
    """Poles of one percent damping at frequencies (Hz)."""
    return 2 * np.pi * np.array(frequency) * (-0.01 + 1j * np.sqrt(1 - 0.01**2))


def nothing(spindle, test):
    """An observation of no modes."""
    return observe(Campaign("nothing", spindle.name, "mobility", (), (test,)), spindle)[0]


def computed(spindle, o, pole, shape, kind) -> Predicted:
    """Modes as if the model had these."""
    return replace(predict(spindle, o, ()), pole=pole, shape=shape, participation=np.ones((len(pole), 1)), kind=kind)


def test_where_nothing_is_computed_nothing_has_a_partner(spindle):
    """A model without a mode that low ended in an IndexError."""
    o = replace(nothing(spindle, Test("t", 20.0, 0.0)), frequency=np.array([1840.0]), damping=np.full(1, 0.01), kind=None)
    assert partners(o, computed(spindle, o, at(), np.zeros((0, 4), complex), ())).tolist() == [-1]


def test_partners_cross_where_shapes_do(spindle):
    """The axial mode keeps its partner while rocking modes 10 % off pass it."""
    shape = np.array([[1, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], complex)
    test = Test("t", 20.0, 0.0)
    o = replace(
        nothing(spindle, test), frequency=np.array([1840.0, 1855.0, 2000.0]), damping=np.full(3, 0.01), shape=shape[[1, 2, 0]], kind=None
    )
    p = computed(spindle, o, at(1998.0, 2050.0, 2060.0), shape, ("axial", "rocking", "rocking"))
    assert partners(o, p).tolist() == [-1, -1, 0]
    nearer = replace(p, pole=at(1998.0, 1900.0, 1890.0))
    assert partners(o, nearer).tolist() == [1, 2, 0]  # by their shapes, which tell them apart
    turned = replace(o, shape=np.vstack([o.shape[0] + o.shape[1], o.shape[0] - o.shape[1], o.shape[2]]))
    assert partners(turned, nearer).tolist() == [2, 1, 0]  # in order of frequency: these have turned in their plane


def test_numbers_follow_shapes_through_a_crossing(spindle):
    shape = np.eye(2, dtype=complex)
    kinds = (("axial", "rocking"), ("rocking", "axial"))
    observed = [nothing(spindle, Test("t", t, 0.0)) for t in (20.0, 30.0)]
    predicted = [computed(spindle, o, at(990.0, 1000.0 + 5 * k), shape[[k, 1 - k]], kinds[k]) for k, o in enumerate(observed)]
    assert numbered(observed, predicted) == [{0: 1, 1: 2}, {0: 2, 1: 1}]


def without(o, i):
    """An observation that missed a mode."""
    keep = np.delete(np.arange(len(o.frequency)), i)
    both = np.concatenate([keep, keep + len(o.frequency)])
    rows = {k: None if (v := getattr(o, k)) is None else v[keep] for k in ("shape", "shape_sd", "residue", "residue_sd")}
    return replace(o, frequency=o.frequency[keep], damping=o.damping[keep], covariance=o.covariance[np.ix_(both, both)], **rows)


def with_false(o, frequency):
    """An observation with a pole more: noise, that is a random shape, where no mode is."""
    random = np.random.default_rng(3)
    m, at = len(o.frequency), int(np.searchsorted(o.frequency, frequency))
    shape = random.standard_normal(o.shape.shape[1]) + 1j * random.standard_normal(o.shape.shape[1])
    order = np.insert(np.arange(m), at, m)
    both = np.concatenate([order, order + m + 1])
    covariance = np.diag(np.full(2 * m + 2, 1e-6))
    old = np.concatenate([np.arange(m), np.arange(m) + m + 1])
    covariance[np.ix_(old, old)] = o.covariance
    rows = {"shape": [*o.shape, shape / abs(shape).max()], "shape_sd": [*o.shape_sd, o.shape_sd[0]]}
    rows |= {"residue": [*o.residue, o.residue[0]], "residue_sd": [*o.residue_sd, o.residue_sd[0]]}
    return replace(
        o,
        frequency=np.append(o.frequency, frequency)[order],
        damping=np.append(o.damping, 0.002)[order],
        covariance=covariance[np.ix_(both, both)],
        **{k: np.array(v)[order] for k, v in rows.items()},
    )


@pytest.mark.parametrize("mode", range(8))
def test_a_mode_that_was_missed_is_extra_and_moves_no_other(spindle, clean, itself, mode):
    campaign, observed = clean
    found = compare(spindle, campaign, [without(observed[0], mode), observed[1]]).tests[0]
    lost = itself.tests[0].modes[mode]
    assert found.missing == ()
    assert found.extra == (pytest.approx(lost.computed),)
    assert [m.number for m in found.modes] == [n for n in range(1, 9) if n != lost.number]


@pytest.mark.parametrize("frequency", [700.0, 1270.0, 2180.0, 2700.0])
def test_a_false_pole_is_told_and_moves_no_other(spindle, clean, itself, frequency):
    campaign, observed = clean
    found = compare(spindle, campaign, [with_false(observed[0], frequency), observed[1]])
    assert found.tests[0].missing == (frequency,)
    assert found.tests[0].extra == ()
    assert [m.number for m in found.tests[0].modes] == list(range(1, 9))
    assert [m.error for m in found.tests[0].modes] == pytest.approx([m.error for m in itself.tests[0].modes])
    assert comparison_json(found)["tests"][0]["missing_Hz"] == [frequency]


def test_a_false_pole_beside_a_mode_takes_no_partner_from_it(spindle, clean, itself):
    """Eight computed modes for nine poles: the one with the random shape is left over, or further modes are told as its partners."""
    campaign, observed = clean
    found = compare(spindle, campaign, [with_false(observed[0], 1010.0), observed[1]]).tests[0]
    assert found.modes[0].measured == itself.tests[0].modes[0].measured
    assert 1010.0 in found.missing


def test_a_test_without_any_mode(spindle, clean):
    campaign, observed = clean
    empty = observed[0]
    while len(empty.frequency):
        empty = without(empty, 0)
    found = compare(spindle, campaign, [empty, observed[1]])
    assert found.tests[0].modes == found.tests[0].missing == ()
    assert len(found.tests[0].extra) == 8
    assert 0.1 < found.rms_residual < 1.3
    nothing_at_all = compare(spindle, replace(campaign, tests=campaign.tests[:1]), [empty])
    assert nothing_at_all.rms_residual == np.inf
    assert comparison_json(nothing_at_all)["rms_pull"] is None


def test_more_modes_measured_than_computed(spindle):
    rows = [("axial", 1002.0 + 10 * k) for k in range(30)]
    found = compare(spindle, table(spindle, 20.0, *rows)).tests[0]
    assert len(found.modes) + len(found.missing) == 30
    assert len(found.missing) >= 27  # three axial modes are computed


def roved(frf, sensor=None):
    """FRFs of one hammer point as of a hammer that went to every sensor's, by reciprocity; or of the one sensor alone."""
    of = slice(None) if sensor is None else [sensor]
    turn = (lambda v: None if v is None else v[of, :1].transpose(1, 0, 2)) if sensor is None else (lambda v: None if v is None else v[of, :1])
    nodes = frf.reference_nodes[:1], tuple(np.array(frf.response_nodes)[of].tolist())
    return replace(frf, value=turn(frf.value), sd=turn(frf.sd), coherence=turn(frf.coherence), response_nodes=nodes[sensor is not None], reference_nodes=nodes[sensor is None])


def test_a_roving_hammers_shapes_are_those_at_its_points(spindle):
    """One sensor and seven hammer points: MAC and COMAC as of seven sensors and one hammer point.
    They were those of single numbers, 1 always."""
    tests = read_campaign(DATA / "foreign_bond")
    rest = [t for t in tests.tests if t.speed == 0 and t.frf is not None][:2]
    sensors = replace(tests, tests=tuple(replace(t, frf=replace(t.frf, value=t.frf.value[:, :1], sd=None, coherence=None, reference_nodes=t.frf.reference_nodes[:1])) for t in rest))
    hammer = replace(tests, tests=tuple(replace(t, frf=replace(roved(t.frf), sd=None, coherence=None)) for t in rest))
    one, other = compare(spindle, sensors, frfs=False), compare(spindle, hammer, frfs=False)
    for a, b in zip(one.tests, other.tests, strict=True):
        assert [m.number for m in a.modes] == [m.number for m in b.modes]
        assert [m.mac for m in b.modes] == pytest.approx([m.mac for m in a.modes], abs=1e-4)
    assert min(m.mac for t in one.tests for m in t.modes) < 0.9995
    assert list(other.comac) == list(one.comac)
    moving = [node for node, v in one.comac.items() if v > 0.9]  # noise is what the others show
    assert len(moving) == 6
    assert [other.comac[node] for node in moving] == pytest.approx([one.comac[node] for node in moving], abs=1e-3)


def test_one_sensor_and_one_hammer_show_no_shape(spindle):
    tests = read_campaign(DATA / "foreign_bond")
    alone = replace(tests, tests=tuple(replace(t, frf=roved(t.frf, 0)) for t in tests.tests[:1]))
    found = compare(spindle, alone, frfs=False)
    assert found.tests[0].modes
    assert all(m.mac is None for m in found.tests[0].modes)
    assert found.comac == {}
    console = Console(width=100, record=True, file=StringIO())
    show_comparison(console, compare(spindle, alone))
    assert "smallest FRAC of all tests" in console.export_text()  # lines are compared all the same
