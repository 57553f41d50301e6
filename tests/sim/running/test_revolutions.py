"""Closed forms of runout: revolutions cut by angle, what leaks from one part into the other, values of error motion, and lines of a record."""

from __future__ import annotations

import numpy as np
import pytest

from thermospindle.model.bearing.kinematics import Line
from thermospindle.sim.running.lines import find_lines, fit
from thermospindle.sim.running.revolutions import error_motion, leakage, revolutions, turning_frequency

RATE, TURNING = 20000.0, 120.0


def times(count: int, turning: float = TURNING) -> np.ndarray:
    return np.arange(int(count / turning * RATE) + 2) / RATE


def line(frequency: float, direction: str = "radial", whirl: int = 1, name: str = "") -> Line:
    return Line("upper", "ball waviness", 2, name or f"{frequency:g}", direction, whirl, frequency)


def made(lines: list[Line], phasor: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Record (probes, n) of lines with phasors (lines, probes)."""
    turned = np.exp(2j * np.pi * np.outer([g.frequency for g in lines], time))
    return np.asarray((phasor.T @ turned).real)


def circle(radius: complex, whirl: int) -> list[complex]:
    """Phasors along x, y and z of a circular motion counterclockwise (whirl +1) or clockwise."""
    return [radius, -1j * whirl * radius, 0.0]


# ---------------------------------------------------------------- revolutions


def test_resampling_by_angle_finds_the_signal_between_the_samples():
    time = times(20)
    angle = 2 * np.pi * TURNING * time
    cut = revolutions(time, angle, np.cos(2 * np.pi * 1900.0 * time + 0.3)[None])
    assert cut.count == 20
    assert cut.value.reshape(-1) == pytest.approx(np.cos(2 * np.pi * 1900.0 * cut.time + 0.3), abs=1e-4)  # ten samples a period
    place = (2 * np.pi * TURNING * cut.time).reshape(20, -1) - 2 * np.pi * np.arange(20)[:, None]
    assert place == pytest.approx(np.broadcast_to(cut.angle, place.shape), abs=1e-9)


def test_the_error_of_resampling_falls_with_the_sixth_power_of_the_step():
    errors = []
    for rate in (10e3, 20e3):
        time = np.arange(int(0.1 * rate)) / rate
        cut = revolutions(time, 2 * np.pi * TURNING * time, np.cos(2 * np.pi * 1500.0 * time)[None], 96)
        middle = slice(200, 900)  # splines are less exact at their ends
        errors.append(np.abs(cut.value.reshape(-1) - np.cos(2 * np.pi * 1500.0 * cut.time))[middle].max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(6, abs=0.7)


def test_a_record_that_speeds_up_is_cut_by_angle_and_refused_where_the_speed_must_be_constant():
    time = np.arange(4000) / RATE
    angle = 2 * np.pi * (100 * time + 200 * time**2)
    cut = revolutions(time, angle, np.cos(3 * angle)[None])
    assert cut.value[0] == pytest.approx(np.broadcast_to(np.cos(3 * cut.angle), cut.value[0].shape), abs=1e-6)
    with pytest.raises(ValueError, match="not constant"):
        turning_frequency(time, angle)
    with pytest.raises(ValueError, match="does not go one way"):
        revolutions(time, np.cos(angle), angle[None])
    with pytest.raises(ValueError, match="less than one revolution"):
        revolutions(time[:20], angle[:20], angle[None, :20])


def test_variances_of_both_parts_add_up_whatever_the_record():
    random = np.random.default_rng(1)
    time = times(13)
    value = random.standard_normal((2, len(time))) + np.cos(2 * np.pi * TURNING * time) + 5.0
    cut = revolutions(time, 2 * np.pi * TURNING * time, value)
    total = cut.value.var(axis=(1, 2))
    assert cut.repeatable.var(axis=1) + cut.nonrepeatable.var(axis=(1, 2)) == pytest.approx(total, rel=1e-12)
    assert np.abs(cut.nonrepeatable.mean(axis=1)).max() < 1e-12  # nothing of it repeats


@pytest.mark.parametrize("count", [7, 60])
@pytest.mark.parametrize("orders", [0.579, 4.207, 5.0098, 6.0, 7.0])
def test_leakage_is_the_mean_over_the_revolutions(orders, count):
    steps = np.arange(count) - (count - 1) / 2
    assert leakage(orders, count) == pytest.approx(np.exp(2j * np.pi * orders * steps).mean().real, abs=1e-12)


def test_the_averaged_part_is_the_true_one_and_what_leaks_into_it():
    count, time = 60, times(60)
    lines = [line(TURNING), line(2 * TURNING), line(69.4), line(601.2), line(504.7)]
    size = np.array([[1.0], [0.3j], [0.8], [0.5 + 0.2j], [0.4]])
    cut = revolutions(time, 2 * np.pi * TURNING * time, made(lines, size, time))
    orders = np.array([g.frequency for g in lines]) / TURNING
    gain = leakage(orders, count) * np.exp(1j * np.pi * orders * (count - 1))
    expected = ((size[:, 0] * gain)[:, None] * np.exp(1j * np.outer(orders, cut.angle))).real.sum(axis=0)
    assert cut.repeatable[0] == pytest.approx(expected, abs=1e-7)
    assert abs(gain[3]) > 0.5  # 2 fb - fc lies a hundredth of an order from 5, and sixty revolutions hardly tell


def test_error_motion_values_of_known_plots():
    angle = 2 * np.pi * TURNING * times(40)
    once, twice, half = 3.0 * np.cos(angle + 0.4), 2.0 * np.cos(2 * angle), 0.5 * np.cos(1.5 * angle)
    cut = revolutions(times(40), angle, np.array([once + twice + half, once]))
    radial, axial = error_motion(cut, 0, True), error_motion(cut, 1, False)
    assert radial.eccentricity == pytest.approx(3.0, rel=1e-6)
    assert radial.synchronous_error == pytest.approx(4.0, rel=2e-3)  # the 1x is taken away; sampled every 2 degrees
    assert radial.asynchronous_error == pytest.approx(1.0, rel=2e-3)  # +-0.5 in every other revolution
    assert radial.total_error == pytest.approx(np.ptp((twice + half)[: len(angle) // 2]), rel=2e-3)
    assert radial.repeatable_rms == pytest.approx(np.sqrt(3.0**2 / 2 + 2.0**2 / 2), rel=1e-6)
    assert radial.six_sigma == pytest.approx(6 * 0.5 / np.sqrt(2), rel=1e-6)
    assert axial.synchronous_error == pytest.approx(6.0, rel=2e-3)  # the axial 1x stays
    assert axial.nonrepeatable == pytest.approx(0.0, abs=1e-6)


# ---------------------------------------------------------------- lines


def test_lines_closer_than_a_bin_and_an_unknown_one_are_found():
    time = times(60)
    known = [line(TURNING, name="1x"), line(600.79, whirl=-1), line(602.4), line(670.32, "axial"), line(504.73)]
    size = np.array([circle(1.0, 1), circle(0.5j, -1), circle(0.3, 1), [0, 0, 0.7], circle(0.0, 1)])
    value = made(known, size, time) + made([line(931.37)], np.array([[0.05, -0.02j, 0.0]]), time)
    found, best = find_lines(time, value, TURNING, known, size)
    told = {round(g.frequency, 2): g for g in found}
    assert list(told) == [120.0, 670.32, 600.79, 602.4, 931.37]  # strongest first; the line without amplitude is not there
    for g, expected in zip(found, (1.0, 0.7, 0.5, 0.3, 0.05), strict=True):
        assert g.amplitude == pytest.approx(expected, rel=1e-4)
    assert [g.whirl for g in found] == ["forward", "-", "backward", "forward", "forward"]
    assert [g.repeatable for g in found] == [True, False, False, False, False]
    assert [[c.name for c in g.causes] for g in found] == [["1x"], ["670.32"], ["600.79"], ["602.4"], []]
    assert told[931.37].forward == pytest.approx(0.035, rel=1e-3)
    assert told[931.37].backward == pytest.approx(0.015, rel=1e-3)
    assert np.abs(best.residual).max() < 1e-5


def test_causes_at_one_frequency_are_told_together_with_their_shares():
    time = times(60)
    known = [line(600.79, name="lower"), line(600.85, name="upper"), line(600.79, name="absent")]
    size = np.array([circle(0.2, 1), circle(0.5j, 1), circle(0.0, 1)])
    [found], _ = find_lines(time, made(known, size, time), TURNING, known, size)
    assert [c.name for c in found.causes] == ["upper", "lower"]
    assert found.shares == pytest.approx((0.5, 0.2))
    assert found.amplitude == pytest.approx(found.predicted, rel=1e-6)


def test_noise_makes_no_lines():
    time = times(60)
    random = np.random.default_rng(2)
    value = made([line(TURNING)], np.array([circle(1.0, 1)]), time) + 0.3 * random.standard_normal((3, len(time)))
    value[2] += np.cos(2 * np.pi * 300.5 * time)
    found, best = find_lines(time, value, TURNING, [line(TURNING, name="1x")], np.array([circle(1.0, 1)]))
    assert {(round(g.frequency, 1), bool(g.causes)) for g in found if g.amplitude > 0.05} == {(120.0, True), (300.5, False)}
    assert best.residual.std() == pytest.approx(0.3, rel=0.02)


@pytest.mark.parametrize("n", [17, 1000, 1024])
def test_phasors_and_what_they_leave_are_least_squares(n):
    """Against NumPy's of cosines, sines and a mean, in a record that begins late, of a length that is a square and of one that is none."""
    random = np.random.default_rng(n)
    time, frequency = 0.7 + np.arange(n) / 5e3, np.sort(random.uniform(20.0, 2200.0, min(n // 4, 60)))
    value = random.standard_normal((3, n)) + 5.0
    turn = 2 * np.pi * np.outer(time, frequency)
    basis = np.hstack([np.cos(turn), -np.sin(turn), np.ones((n, 1))])
    expected = np.linalg.lstsq(basis, value.T)[0]
    found, k = fit(time, value, frequency), len(frequency)
    assert found.mean == pytest.approx(expected[-1], rel=1e-9)
    assert found.phasor == pytest.approx((expected[:k] + 1j * expected[k : 2 * k]).T, abs=1e-9 * np.abs(expected).max())
    assert found.residual == pytest.approx((value.T - basis @ expected).T, abs=1e-9 * np.abs(expected).max())


def test_more_lines_than_samples_and_too_slow_a_record_are_refused():
    time = times(1)
    with pytest.raises(ValueError, match="cannot be estimated"):
        fit(time, np.zeros((3, len(time))), np.arange(1.0, 100.0))
    with pytest.raises(ValueError, match="sampled too slowly"):
        find_lines(time, np.zeros((3, len(time))), TURNING, [line(9500.0)], np.zeros((1, 3), complex))
