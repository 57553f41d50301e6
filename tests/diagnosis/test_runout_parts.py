"""Runout tests of machines whose parts turn at speeds of their own, and of one whose bearings are
numbers: lines, what repeats, and what is named."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.conftest import SCENE
from tests.mounting import geared
from thermospindle.diagnosis.runout import compare as runout_compare
from thermospindle.diagnosis.runout.compare import compare_runout
from thermospindle.diagnosis.runout.explanation import variants
from thermospindle.diagnosis.runout.fit import families, fit_family, merged
from thermospindle.diagnosis.runout.lines import look
from thermospindle.diagnosis.runout.sources import sources
from thermospindle.diagnosis.runout.verdict import _fitted, diagnose_runout
from thermospindle.model.bearing.kinematics import lines, row_kinematics
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.carrier import unbalanced
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.campaign import simulated
from thermospindle.sim.campaign.simulated import runout_campaign
from thermospindle.sim.effects import by_name, usable
from thermospindle.sim.operating import operating_point

SCENES = SCENE.parent
SPEED = 7200 * RPM


@pytest.fixture(scope="module")
def made(imperfect):
    """What the hub shows at `SPEED`, whatever turns it."""
    return runout_campaign(imperfect, [Condition(40.0, SPEED)], 0.5, path="linear")


@pytest.fixture
def known(imperfect, monkeypatch):
    """A spindle whose unbalance outdoes what its balls show, and its record without noise, with the balls where the scene has them."""
    spindle = replace(imperfect, imperfections=replace(imperfect.imperfections, unbalance=1e-5))
    monkeypatch.setattr(simulated, "set_down", lambda own, balls, random: own)
    return spindle, runout_campaign(spindle, [Condition(40.0, SPEED)], 0.5, path="linear", noise=0.0)


def spectrum(record):
    n = record.value.shape[1]
    return replace(record, kind="spectrum", axis=np.fft.rfftfreq(n, record.step), value=np.fft.rfft(record.value) * 2 / n)


def test_parts_and_lines_of_a_record_by_its_revolutions(known):
    """59 revolutions of 1 / 120 s: their mean, what it leaves, and the line once per revolution. The scene made the record: computed is as
    measured, but for the speed of the cage, which half a second does not tell exactly."""
    spindle, made = known
    record, [found] = made.tests[0].runout, compare_runout(spindle, made)
    value = record.value - record.value.mean(axis=1, keepdims=True)
    cut = CubicSpline(record.axis, value, axis=1)(np.arange(59 * 186) / (120 * 186)).reshape(len(value), 59, 186)
    repeats, rest = cut.mean(axis=1), (cut - cut.mean(axis=1, keepdims=True)).reshape(len(value), -1)
    for part, own in ((found.rro, repeats), (found.nrro, rest)):
        assert [p.measured_rms for p in part] == pytest.approx(own.std(axis=1), rel=1e-3)
        assert [p.measured for p in part] == pytest.approx(np.ptp(own, axis=1), rel=0.02)
        assert [p.computed_rms for p in part] == pytest.approx(own.std(axis=1), rel=0.03, abs=0.01 * own.std(axis=1).max())
        assert [p.computed for p in part] == pytest.approx(np.ptp(own, axis=1), rel=0.1, abs=0.01 * np.ptp(own, axis=1).max())
    once = dict(zip(record.nodes, 2 * np.abs(np.mean(cut * np.exp(-2j * np.pi * np.arange(186) / 186), axis=(1, 2))), strict=True))
    lines = [g for g in found.lines if g.order == pytest.approx(1.0) and once[g.node] > 1e-8]
    assert len(lines) == 4
    assert [g.measured for g in lines] == pytest.approx([once[g.node] for g in lines], rel=0.02)
    assert [g.computed for g in lines] == pytest.approx([once[g.node] for g in lines], rel=0.02)


def test_parts_of_a_spectrum_by_its_bins(known):
    """Mean squares of the lines at whole orders, and of all others."""
    spindle, made = known
    [test] = made.tests
    bins = spectrum(test.runout)
    [found] = compare_runout(spindle, replace(made, tests=(replace(test, runout=bins),)))
    squares = np.abs(bins.value[:, 1:]) ** 2 / 2
    whole = np.arange(1, bins.value.shape[1]) % 60 == 0
    for part, own, within in ((found.rro, squares[:, whole], 0.02), (found.nrro, squares[:, ~whole], 0.15)):  # lines of both bearings beat
        rms = np.sqrt(own.sum(axis=1))
        assert [p.measured_rms for p in part] == pytest.approx(rms, rel=within, abs=0.02 * rms.max())
        assert [p.computed_rms for p in part] == pytest.approx(rms, rel=within, abs=0.02 * rms.max())


def test_errors_of_an_amplitude_are_of_the_record_and_of_spindles_of_one_drawing(monkeypatch):
    """Half the square of a complex error is along its phasor: of white noise 4 / n of its variance, and of unbalance of the scene's size,
    static and couple. Nothing else scatters where no balls roll."""
    scene = load(SCENES / "mk7702")
    height, sizes, n, noise = unbalanced(scene).z, (50e-6, 2e-6), 6250, 1e-6
    at = [Condition(20.0, 2000 * RPM)]
    each = sizes, (sizes[0], 0.0), (0.0, sizes[1])
    every = [replace(scene, imperfections=Imperfections(unbalance=u, unbalance_z=height, couple_unbalance=c)) for u, c in each]
    made, *alone = (runout_campaign(s, at, 0.3, path="linear", noise=e) for s, e in zip(every, (noise, 0.0, 0.0), strict=True))
    assert made.tests[0].runout.value.shape[1] == n
    squares = sum(2 * campaign.tests[0].runout.value.var(axis=1) for campaign in alone)  # of amplitudes; ten whole revolutions
    monkeypatch.setattr(runout_compare, "STARTS", 1)
    [found] = compare_runout(every[0], made)
    nodes = made.tests[0].runout.nodes
    assert len(found.lines) == len(nodes)
    assert [g.scatter for g in found.lines] == pytest.approx([np.sqrt(squares[nodes.index(g.node)] / 2) for g in found.lines], rel=1e-3)
    assert [g.measured_sd for g in found.lines] == pytest.approx([noise * np.sqrt(2 / n)] * len(nodes), rel=0.4)
    assert np.sqrt(np.mean([g.measured_sd**2 for g in found.lines])) == pytest.approx(noise * np.sqrt(2 / n), rel=0.2)


def at_ratio(campaign, ratio):
    return replace(campaign, tests=tuple(replace(t, speed=t.speed / ratio) for t in campaign.tests))


@pytest.mark.parametrize("ratio", [0.5, 2.0, -0.5])
def test_a_geared_hub_has_the_lines_of_one_without_gears(imperfect, ratio):
    """Bearings and unbalance both turn with the hub: the unbalance has the ratio once, not twice."""

    def of(spindle, speed):
        point = operating_point(spindle, Condition(40.0, speed))
        return {(x.bearing, x.cause, x.order, x.name, x.direction): x.frequency for x in lines(spindle, row_kinematics(spindle, point.state), speed)}

    direct, turned = of(imperfect, SPEED), of(geared(imperfect, ratio), SPEED / ratio)
    assert turned == pytest.approx(direct)
    assert direct["", "unbalance", 0, "1x", "radial"] == pytest.approx(120.0)


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_geared_hub_compares_as_one_without_gears(imperfect, made, ratio):
    [direct], [found] = compare_runout(imperfect, made), compare_runout(geared(imperfect, ratio), at_ratio(made, ratio))
    assert [(g.frequency, g.node) for g in found.lines] == [(pytest.approx(g.frequency), g.node) for g in direct.lines]
    assert [g.computed for g in found.lines] == pytest.approx([g.computed for g in direct.lines], rel=1e-6, abs=1e-15)
    for part in ("rro", "nrro"):
        rows, expected = (np.array([(p.measured_rms, p.computed_rms, p.measured, p.computed) for p in getattr(x, part)]) for x in (found, direct))
        assert rows == pytest.approx(expected, rel=1e-6, abs=1e-14)


def test_a_spectrum_parts_what_repeats_by_what_is_seen(imperfect, made):
    """The once-per-revolution line of a hub at half the speed of the spindle is at half an order of it, and repeats."""
    [test] = made.tests
    spectra = replace(made, tests=(replace(test, runout=spectrum(test.runout)),))
    [direct], [found] = compare_runout(imperfect, spectra), compare_runout(geared(imperfect, 0.5), at_ratio(spectra, 0.5))
    assert direct.rro[0].computed_rms > 1e-10
    for part in ("rro", "nrro"):
        rows, expected = (np.array([(p.measured_rms, p.computed_rms) for p in getattr(x, part)]) for x in (found, direct))
        assert rows == pytest.approx(expected, rel=1e-6, abs=1e-14)


def test_a_record_of_few_revolutions_of_what_is_seen_is_refused(imperfect, made):
    with pytest.raises(BadInput, match=r"tests\.T40_n7200: runout: 3 revolutions of what node 8 sees, at 360 rpm; at least 4 whole ones are needed"):
        compare_runout(geared(imperfect, 0.05), made)


def test_only_the_unbalance_is_looked_for_where_bearings_are_numbers():
    """MK7702 rolls no balls: its one line is the unbalance's, and an effect of a ball row has nothing to act on."""
    spindle = load(SCENES / "mk7702")
    true = replace(spindle, imperfections=Imperfections(unbalance=50e-6, unbalance_z=0.1))
    made = runout_campaign(true, [Condition(20.0, 2000 * RPM)], 0.5, path="linear")
    seen = look(spindle, made.tests[0])
    assert [[g.name for g in line.lines] for line in seen.seen] == [["1x"]]
    assert seen.seen[0].frequency == pytest.approx(2000 / 60)
    [beside] = compare_runout(true, made)
    assert max(abs(g.residual) for g in beside.lines) < 1
    quiet = replace(spindle, imperfections=Imperfections(unbalance=5e-6, unbalance_z=0.1))
    d = diagnose_runout(quiet, made)
    assert (d.verdict, d.effects) == ("identified", ("unbalance",)), d.reason
    assert d.explanations[0].size[0] == pytest.approx(50.0, abs=4 * d.explanations[0].size_sd[0] + 5.0)


def test_every_bearing_of_a_scene_is_looked_at():
    """Choices of an effect are those of the scene's five bearings, from Python as from the command line."""
    spindle = load(SCENES / "five_bearing")
    made = runout_campaign(spindle, [Condition(20.0, 8000 * RPM)], 0.3, path="linear")
    tried = {v.values["bearing"] for e in diagnose_runout(spindle, made).explanations for v in e.variants if "bearing" in v.values}
    assert max(tried) > 1.0


def test_what_leaks_from_lines_that_are_fitted_as_one_is_no_line_of_another():
    """Lines of several bearings stand half a bin apart: what their sum leaves at a line along the
    axis, seen across it, is within its error."""
    spindle = load(SCENES / "five_bearing")
    made = runout_campaign(spindle, [Condition(20.0, s * RPM) for s in (4000, 8000)], 0.6, path="linear")
    along = np.array([abs(p.direction[2]) > 0.5 for p in made.points])
    apart = []
    for test in made.tests:
        for line in look(spindle, test).seen:
            if len(directions := {g.direction for g in line.lines}) == 1:
                nothing = along != (directions == {"axial"})
                apart += list(np.abs(line.phasor[nothing]) / line.sd[nothing])
    assert len(apart) > 300
    assert max(apart) < 3.5  # exp(-3.5^2) of noise alone: 5e-6 a line
    assert np.sqrt(np.mean(np.square(apart))) > 0.6


def test_an_effect_that_does_nothing_gains_nothing_by_moving_several_families():
    """Lines of one effect are fitted together and share the build's tolerances, which they do
    without it too: 9 in ln evidence were counted for it."""
    spindle = load(SCENES / "five_bearing")
    made = runout_campaign(spindle, [Condition(20.0, s * RPM) for s in (4000, 6000, 8000)], 0.6, path="linear")
    seen = [look(spindle, t) for t in made.tests]
    known = sources(spindle, seen, made.points)
    parts = families(seen, known)
    waviness = next(e for e in usable(spindle) if e.name == "ball_waviness")
    variant = next(v for v in variants(waviness, known, parts) if v.values["half_order"] == 1 and v.values["bearing"] == 2)
    assert len(variant.parts) > 1
    own = [parts[i] for i in variant.parts]
    nothing = replace(variant, amplitudes={s: 1e-12 * a for s, a in variant.amplitudes.items()}, parts=tuple(range(len(own))))
    base = [fit_family(f) for f in own]
    assert fit_family(merged(own)).evidence > sum(f.evidence for f in base) + 1.0
    assert _fitted((nothing,), own, base, {}).delta_evidence < 0.5


@pytest.mark.slow
def test_no_second_effect_is_named_beside_a_wave_of_five_bearings():
    """Ball waviness as the scene has it was taken for a second effect, needed beside an inner race of 400 nm."""
    spindle = load(SCENES / "five_bearing")
    values = by_name("race_waviness").typical() | {"amplitude": 400.0, "multiple": 1.0, "offset": 1.0, "ring": 0.0, "bearing": 4.0}
    made = runout_campaign(replace(spindle, effects=(Addition("race_waviness", values),)), [Condition(20.0, s * RPM) for s in (4000, 6000, 8000)], 0.6)
    d = diagnose_runout(spindle, made)
    assert (d.verdict, d.effects) == ("identified", ("race_waviness",)), d.reason
    best = d.explanations[0]
    assert best.variants[0].values["bearing"] == 4.0
    assert best.size[0] == pytest.approx(400.0, abs=4 * best.size_sd[0])
