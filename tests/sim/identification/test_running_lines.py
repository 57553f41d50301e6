"""Lines of the running speed in FRFs of a turning spindle: found, named, left out; and not found where there are none."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import SCENE
from thermospindle.cli import main
from thermospindle.diagnosis.data.lines import line_data
from thermospindle.diagnosis.data.observe import observe
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.beside import left_out
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test, condition_of, write_campaign
from thermospindle.sim.identification.frf import Frf, out_of, without
from thermospindle.sim.identification.modal import noise_model
from thermospindle.sim.identification.running_lines import RunningLines
from thermospindle.sim.operating import operating_point

LINES = np.arange(400.0, 3000.0, 2.0)
SPEED = 2 * np.pi * 119.5  # of the shaft; harmonics fall between lines
NOISE = Noise(0.003, 2e-4)


def measured(spindle, seed: int, speed: float = SPEED) -> Frf:
    """FRFs of the turning scene with noise."""
    value = operating_point(spindle, Condition(20.0, speed)).frf(LINES)
    sd = NOISE.of_value * np.abs(value) + NOISE.of_largest * np.abs(value).max()
    error = sd * np.random.default_rng(seed).standard_normal((2, *value.shape)) / np.sqrt(2)
    return Frf(LINES, value + error[0] + 1j * error[1], tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility")


def with_spikes(frf: Frf, multiples: list[int], size: float) -> Frf:
    """The same with spikes of `size` times the largest value at multiples of the running speed, on
    the line and its neighbour, of random phase."""
    random, value = np.random.default_rng(0), frf.value.copy()
    for k in multiples:
        i = round((k * SPEED / (2 * np.pi) - LINES[0]) / 2.0)
        for at, share in ((i, 1.0), (i + 1, 0.5)):
            value[:, :, at] += share * size * np.abs(value).max() * np.exp(2j * np.pi * random.random(value.shape[:2]))
    return replace(frf, value=value)


def campaign(spindle, *frfs: Frf) -> Campaign:
    tests = tuple(Test(f"t{k}", 20.0, SPEED, frf=f) for k, f in enumerate(frfs, 1))
    return Campaign("turning", spindle.name, "mobility", spindle.points, tests, NOISE)


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_found_where_nothing_stands(spindle, seed):
    found = out_of(measured(spindle, seed), SPEED)
    assert found.multiples == ()
    assert not found.out.any()


def test_resonances_without_noise_are_no_spikes(spindle):
    """The sharpest modes of the scene, with a speed whose multiples fall on each of them in turn."""
    for mode in operating_point(spindle, Condition(20.0, SPEED)).modes_below(2900.0):
        if mode.frequency > 450.0:
            speed = 2 * np.pi * mode.frequency / 6
            value = operating_point(spindle, Condition(20.0, SPEED)).frf(LINES)
            found = out_of(Frf(LINES, value, tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility"), speed)
            assert found.multiples == (), mode.frequency


@pytest.mark.parametrize("noise", [Noise(0.0, 0.0), Noise(5e-4, 5e-5), NOISE], ids=["none", "little", "usual"])
@pytest.mark.parametrize("step", [4.0, 8.0])
def test_resonances_of_few_lines_are_no_spikes_and_spikes_on_them_are_seen(spindle, step, noise):
    """Lines so far apart that the sharpest peak has three within its half power, with a multiple on each of the modes in turn."""
    lines, random = np.arange(400.0, 6000.0, step), np.random.default_rng(0)
    for mode in operating_point(spindle, Condition(60.0, SPEED)).modes_below(2900.0):
        if mode.frequency > 450.0:
            speed = 2 * np.pi * mode.frequency / 13
            exact = operating_point(spindle, Condition(60.0, speed)).frf(lines)
            sd = noise_model(exact, noise.of_value, noise.of_largest) / np.sqrt(2)
            error = random.standard_normal((2, *exact.shape))
            frf = Frf(lines, exact + sd * (error[0] + 1j * error[1]), tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility")
            assert out_of(frf, speed).multiples == (), mode.frequency
            value = frf.value.copy()
            value[:, :, int(np.argmin(np.abs(lines - mode.frequency)))] += 0.03 * np.abs(value).max()
            assert 13 in out_of(replace(frf, value=value), speed).multiples, mode.frequency


def test_spikes_are_found_and_named_and_nothing_else_is_left_out(spindle):
    frf = with_spikes(measured(spindle, 3), [5, 6, 13], 0.05)
    found = out_of(frf, SPEED)
    assert found.multiples == (5, 6, 13)
    assert found.frequency == pytest.approx([k * SPEED / (2 * np.pi) for k in (5, 6, 13)], abs=2.0)
    assert 6 <= found.out.sum() <= 12
    assert found.words().startswith("lines of the running speed stand in the FRFs, at 59")
    assert out_of(frf, 0.0).multiples == ()  # at rest there is no running speed
    assert without(frf, found.out).value.shape[-1] == len(LINES) - found.out.sum()


def test_many_lines_are_named_in_a_line():
    many = RunningLines(np.ones(40, bool), tuple(range(1, 21)), tuple(50.0 * k for k in range(1, 21)))
    assert "350.0 Hz (7x) and 13 more up to 1000.0 Hz (20x): 40 lines are left out" in many.words()


def test_modes_and_data_are_as_without_spikes(spindle):
    clean = measured(spindle, 3)
    spiked = with_spikes(clean, [5, 6, 13], 0.2)
    left = out_of(spiked, SPEED).out
    one, other, same = observe(campaign(spindle, clean, spiked, without(clean, left)), spindle)
    assert len(other.frequency) == len(one.frequency)
    sd = np.sqrt(np.diag(one.covariance)[: len(one.frequency)])
    assert np.all(np.abs(np.log(other.frequency / one.frequency)) < sd)
    assert other.frequency == pytest.approx(same.frequency, rel=1e-9)  # exactly as if these lines had never been
    a, b = (line_data(t, condition_of(t), NOISE, NOISE) for t in campaign(spindle, clean, spiked).tests)
    assert b.raw == a.raw - left.sum()
    assert np.mean(np.abs(b.sd)) == pytest.approx(np.mean(np.abs(a.sd)), rel=0.05)
    exact = operating_point(spindle, Condition(20.0, SPEED)).frf(b.frequency)
    assert np.mean(np.abs((b.value - exact) / b.sd) ** 2) == pytest.approx(1.0, abs=0.15)
    raw = without(spiked, np.zeros(len(LINES), bool)).value
    assert np.abs(raw - operating_point(spindle, Condition(20.0, SPEED)).frf(LINES)).max() > 0.15 * np.abs(raw).max()  # they were there


def test_compare_warns_and_names_them(spindle, tmp_path, capsys):
    write_campaign(campaign(spindle, with_spikes(measured(spindle, 3), [6], 0.2)), tmp_path / "c")
    assert main(["compare", str(SCENE), str(tmp_path / "c"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    (warning,) = answer["warnings"]
    assert "campaign.toml: tests.t1: a line of the running speed stands in the FRFs, at 71" in warning
    assert "(6x)" in warning
    assert answer["rms_pull"] < 2.0


def test_lines_of_several_tests_are_said_in_one_sentence(spindle):
    frf = measured(spindle, 3)
    several = campaign(spindle, with_spikes(frf, [5, 6, 13], 0.2), with_spikes(frf, [6], 0.2), frf)
    [said] = left_out(several)
    assert re.fullmatch(r"tests: lines of the running speed stand in the FRFs of 2 tests, t1 \(5x to 13x, \d+ lines\), t2 \(6x, \d+ lines\), and are left out", said)


def test_multiples_on_the_ends_of_the_band_go_with_the_others(spindle):
    """On the first and last lines nothing on one side tells a spike; they are left out where others are seen, and stay where none is."""
    frf, turning = measured(spindle, 3), SPEED / (2 * np.pi)
    first, last = np.searchsorted(LINES, 4 * turning - 0.1), np.searchsorted(LINES, 20 * turning + 0.1)
    cut = Frf(LINES[first:last], frf.value[:, :, first:last], frf.response_nodes, frf.reference_nodes, "mobility")
    assert not out_of(cut, SPEED).out.any()
    value = cut.value.copy()
    ends = [0, len(cut.frequency) - 1]
    value[:, :, [*ends, int(np.argmin(np.abs(cut.frequency - 6 * turning)))]] += 0.3 * np.abs(value).max()
    found = out_of(replace(cut, value=value), SPEED)
    assert found.multiples == (6,)
    assert found.out[ends].all()
    assert found.out.sum() < 20


def test_multiples_closer_than_lines_are_not_looked_for(spindle, monkeypatch):
    """At 1 rpm every line is a multiple's: nobody tells them apart, and 180,000 multiples are not tried."""
    monkeypatch.setattr("thermospindle.sim.identification.running_lines._chance", lambda *asked: pytest.fail("asked"))
    found = out_of(measured(spindle, 0), 2 * np.pi / 60)
    assert found.multiples == ()
    assert not found.out.any()
