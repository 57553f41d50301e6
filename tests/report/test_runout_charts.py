"""Charts of a turning spindle: waterfall, polar plot, spectrum and motion hold what was computed, and can be read off."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import rerun.blueprint as rrb

from thermospindle.report.figures.runout import (
    LINE,
    RANGE,
    line_label,
    motion_figure,
    polar_figure,
    spectrum_figure,
    waterfall_figure,
)
from thermospindle.report.log.turning.blueprint import blueprint, reach
from thermospindle.sim.running.probes import X
from thermospindle.sim.running.waterfall import LineSpectrum, on_grid


def test_spectra_are_drawn_at_their_frequencies_and_levels():
    made = LineSpectrum(100.0, np.array([100.0, 400.0]), np.array([1.0, 1e-1]), np.array([0.0, 1.0]), np.array([250.0]))
    grid = np.linspace(0, 500, 501)
    assert np.flatnonzero(on_grid(made, grid, "radial")).tolist() == [100, 400]
    assert np.flatnonzero(on_grid(made, grid, "axial")).tolist() == [400]
    curve = waterfall_figure([made], "radial", (6.0, 4.0)).axes[0].lines[0]
    height = curve.get_ydata() - curve.get_ydata().min()
    peaks = np.flatnonzero(height > 0)
    assert curve.get_xdata()[peaks] == pytest.approx([100.0, 400.0], abs=0.5)
    assert height[peaks[0]] / height[peaks[1]] == pytest.approx(RANGE / (RANGE - 20))


def test_the_polar_plot_holds_the_band(record):
    lines = {line.get_label(): line.get_ydata() for line in polar_figure(record, (4.0, 3.0)).axes[0].lines}
    mean = lines["repeatable part (RRO)"]
    text = polar_figure(record, (4.0, 3.0)).axes[0].texts[0].get_text()
    quoted = record.values()[X]
    assert f"asynchronous {1e9 * quoted.asynchronous_error:.3g} nm" in text
    assert 1e-9 * np.ptp(mean) == pytest.approx(quoted.synchronous_error, rel=1e-6, abs=1e-15)


def test_the_spectrum_holds_the_strongest_lines_of_both_directions(record):
    """Axial lines far above a strong 1x, and small beside it: the axial panel was empty."""
    far = [replace(g, frequency=40 * record.turning, amplitude=1e-4 * record.lines[0].amplitude, direction="axial") for g in record.lines[:1]]
    few = replace(record, lines=(*(g for g in record.lines if g.direction == "radial"), *far))
    axial = spectrum_figure(few).axes[1]
    assert axial.get_xlim()[1] > 40 * record.turning
    assert len(axial.texts) == 1
    nothing = replace(few, lines=(*few.lines[:-1], replace(far[0], amplitude=1e-12 * record.lines[0].amplitude)))
    assert spectrum_figure(nothing).axes[1].get_xlim()[1] < 40 * record.turning


def test_the_least_squares_circle_lies_above_the_repeatable_part(record):
    """Where both are one circle the dashes are seen on it."""
    polar = motion_figure(record).axes[1]
    named = {line.get_label(): line.get_zorder() for line in polar.lines}
    assert named["least-squares circle (axial: mean)"] > named["repeatable part (RRO)"]


def test_revolutions_go_on_from_each_to_the_next(record):
    """Each was closed on itself: of a motion that does not repeat that drew spokes at 0 degrees."""
    cut = record.by_lines
    [line] = [line for line in motion_figure(record).axes[1].lines if str(line.get_label()).startswith("the first")]
    angle, value = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
    assert len(angle) == LINE * len(cut.angle)
    assert np.diff(angle) == pytest.approx(np.full(len(angle) - 1, 2 * np.pi / len(cut.angle)), rel=1e-6)
    jumps = np.abs(np.diff(value))
    assert jumps[len(cut.angle) - 1 :: len(cut.angle)].max() < 2 * np.delete(jumps, np.s_[len(cut.angle) - 1 :: len(cut.angle)]).max()


@pytest.mark.parametrize(("largest", "high"), [(82.9, 100.0), (100.0, 100.0), (101.0, 150.0), (2.2, 3.0), (0.061, 0.08), (0.0, 1.0)])
def test_panels_reach_to_a_round_number(largest, high):
    assert reach(largest) == pytest.approx(high)


def test_panels_of_runout_tell_their_range(record, monkeypatch):
    """Their only tick was 0, so that no amplitude could be read."""
    made = []
    monkeypatch.setattr(rrb, "TimeSeriesView", lambda **look: made.append(look) or rrb.Spatial2DView())
    blueprint(record, 100.0, True)
    cut = record.by_lines
    for look, part, values in zip(made, ("RRO", "NRRO"), (cut.repeatable[:3], cut.nonrepeatable[:3]), strict=True):
        high = reach(1e9 * float(np.abs(values).max()))
        assert look["name"].startswith(f"{part} ({'non' * (part == 'NRRO')}repeatable), panel ±{high:g} nm: hub x red, y blue, axial green")
        assert 1e9 * np.abs(values).max() <= high
        assert look["axis_y"].range.as_arrow_array().to_pylist() == [[-high, high]]


def test_the_waterfall_says_what_its_decibels_are_relative_to(spectra):
    title = waterfall_figure(spectra, "radial", (6.6, 4.8)).axes[0].get_title(loc="left")
    assert f"{RANGE:g} dB below the strongest of all, {1e9 * max(s.radial.max() for s in spectra if len(s.radial)):.3g} nm zero to peak" in title
    assert "Dots: natural frequencies" in title


def test_labels_of_a_spectrum_say_the_bearing_and_their_leaders_do_not_cross(record):
    """Twice '2 fb - fc, ball waviness' of bearings of two sizes stood side by side, and a leader went across another."""
    first = next(g for g in record.lines if g.causes and g.causes[0].bearing and not g.repeatable and g.direction == "radial")
    cause, far = first.causes[0], 40 * record.turning
    assert line_label(replace(first, causes=(cause,)), ["lower"], 2) == f"{cause.name}\n{cause.cause}\nlower"
    assert line_label(first, ["lower", "upper"], 2) == f"{cause.name}\n{cause.cause}\nboth bearings"
    assert line_label(first, ["lower", "upper"], 5) == f"{cause.name}\n{cause.cause}\nlower, upper"
    assert line_label(first, ["lower"], 1) == f"{cause.name}\n{cause.cause}"
    close = [replace(first, frequency=far + k, amplitude=a * first.amplitude, causes=(replace(cause, name=f"{k}"),)) for k, a in enumerate((0.02, 1.0, 0.1, 0.5))]
    axes = spectrum_figure(replace(record, lines=(*record.lines[:4], *close))).axes[0]
    leaders = [line.get_xydata() for line in axes.lines if len(line.get_xdata()) == 3]
    assert len(leaders) >= 5
    for one, other in combinations(leaders, 2):
        low, high = sorted((one, other), key=lambda line: line[0, 0])
        assert low[2, 0] < high[2, 0], "labels stand in the order of their lines, so neither upright nor slanted parts meet"
        assert low[1, 1] == high[1, 1] >= max(low[0, 1], high[0, 1])
        assert low[0, 0] == low[1, 0]
