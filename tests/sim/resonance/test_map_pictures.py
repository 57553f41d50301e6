"""Pictures of resonance maps."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.colors import to_rgb
from matplotlib.text import Text

from tests.sim.resonance.conftest import NOMINAL
from thermospindle.model.units import RPM
from thermospindle.report.figures.common import STYLE
from thermospindle.report.figures.resonance import CAUSES, WHIRL, both, campbell, drawn_lines, figures, over_temperature, runout
from thermospindle.report.figures.warmup import MODES
from thermospindle.report.text.resonance import map_section, told
from thermospindle.sim.resonance.found import nearest
from thermospindle.sim.resonance.map import _on_curve, resonance_map
from thermospindle.sim.resonance.point import key


def test_the_key_of_a_figure_names_the_causes_of_its_lines(found):
    """And of no others: its colours are those that are drawn."""
    for figure in (campbell(found), over_temperature(found)):
        [axes], [key_below] = figure.axes, figure.legends
        entries = zip(key_below.get_lines(), (t.get_text() for t in key_below.get_texts()), strict=True)
        told = {name: line.get_color() for line, name in entries if name in CAUSES}
        drawn = {line.get_color() for line in axes.lines if line.get_linewidth() == 0.9}
        assert told == {cause: paint for cause, paint in CAUSES.items() if paint in drawn}
        assert len(told) > 1


def test_static_and_couple_unbalance_are_one_line_of_a_figure(found):
    unbalance = [t for t in found.lines if t.line.cause == "unbalance"]
    [axes] = campbell(replace(found, lines=(*found.lines, *unbalance))).axes
    assert [t.get_text() for t in axes.texts].count("1x") == 1


def test_unbalance_is_named_once_where_it_meets_modes(found):
    """Among the lines of the strongest coincidences it stood a second time."""
    c = found.coincidences[0]
    line = next(t.line for t in found.lines if t.line.cause == "unbalance")
    [axes] = campbell(replace(found, coincidences=(replace(c, line=line, strength=1.0), *found.coincidences))).axes
    assert [t.get_text() for t in axes.texts].count("1x") == 1


def test_runout_shows_where_it_was_computed_and_the_peaks_of_the_table(met):
    """A dot for each value, a ring for each coincidence at its NRRO, none for a line that NRRO leaves out."""
    left, _ = runout(met).axes
    curves = [line for line in left.lines if line.get_marker() == "."]
    assert [len(line.get_xdata()) for line in curves] == [len(met.nrro_temperature)] * 2
    rings = {(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in left.lines if line.get_marker() == "o"}
    c = next(c for c in met.coincidences if c.at_nominal_speed)
    assert (c.condition.temperature, pytest.approx(1e9 * c.nrro)) in [*rings]
    repeating = replace(c, line=replace(c.line, frequency=c.condition.speed / (2 * np.pi)))
    left, _ = runout(replace(met, coincidences=(repeating,))).axes
    assert not [line for line in left.lines if line.get_marker() == "o"]


def test_modes_of_the_coincidences_differ_in_colour(found):
    """However many modes lie below those that lines meet."""

    def far(mode):
        return replace(mode, number=len(MODES) * mode.number)

    moved = replace(
        found,
        modes=tuple(far(m) for m in found.modes),
        curves=tuple(replace(c, mode=far(c.mode)) for c in found.curves),
        coincidences=tuple(replace(c, mode=far(c.mode)) for c in found.coincidences),
    )
    [key_below] = both(moved).legends
    paints = [line.get_color() for line in key_below.get_lines() if line.get_linestyle() == "-"]
    assert len(paints) > 1
    assert len(set(paints)) == len(paints)


@pytest.mark.parametrize("size", [(9.6, 6.2), (6.5, 3.1), (6.5, 1.5)])
def test_names_of_lines_do_not_lie_over_each_other(found, met, size):
    """Those of what meets come first where there is no room for all; a figure for a view that has a title has none of its own."""
    for of in (found, met):
        figure = over_temperature(of, size, bare=True)
        with rc_context(STYLE):
            figure.draw_without_rendering()
        boxes = sorted((Text.get_window_extent(t) for t in figure.axes[0].texts), key=lambda b: b.y0)  # without the arrow
        assert len(boxes) > 5
        assert all(b.y0 >= a.y1 for a, b in pairwise(boxes))
        assert figure.get_suptitle() == ""
        assert not figure.legends
    assert any("30 (fo-fc) + fo (31) upper" in t.get_text() for t in figure.axes[0].texts), "it meets a mode at the nominal speed"


def test_the_axis_of_coincidences_holds_them_and_little_else(found):
    [axes] = both(found).axes
    low, high = axes.get_xlim()
    speeds = np.concatenate([line.get_xdata() for line in axes.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 2])
    assert low <= speeds.min() < low + 0.1 * (high - low)
    assert high - 0.1 * (high - low) < speeds.max() <= high


def test_where_no_line_meets_a_mode_the_picture_says_so(spindle):
    """Of a map as wide as the axis, which one speed alone does not give."""
    near = replace(resonance_map(spindle, [20.0, 22.0], [7000 * RPM, 7300 * RPM], NOMINAL), coincidences=(), curves=())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        [axes] = both(near).axes
    assert axes.get_xlim() == pytest.approx((7000.0, 7300.0))
    assert [t.get_text() for t in axes.texts] == ["no line meets a mode here"]


def test_where_all_runout_repeats_a_sentence_stands_for_its_figure(met):
    """Bearings by numbers have unbalance alone: two empty panels with a curve of zeros over another."""
    along = {name: getattr(met, name) * [1.0, 0.0, 0.0] for name in ("nrro_speed", "nrro_temperature")}
    still = replace(met, **along)
    assert (met.repeats, still.repeats) == (False, True)
    assert set(figures(met)) - set(figures(still)) == {"nrro"}
    for known, numbers in ((still, ""), (replace(still, spindle=replace(met.spindle, bearings=())), " (bearings given by numbers roll no balls)")):
        assert told(known)[-1] == f"All runout of this map repeats every revolution{numbers}, so there is no figure of nonrepeatable runout (NRRO)."
    html = map_section(still)[1]
    assert html.count("<svg") == 3
    assert "All runout of this map repeats" in html
    assert "All runout" not in map_section(met)[1]


def test_runout_over_speed_begins_where_the_spindle_turns(found):
    """At rest there is none, and at the slowest speed it is that of balls that pass waves: a ramp
    was drawn from 0 to it, which is not there."""
    assert found.nrro_speed[0].tolist() == [0.0, 0.0, 0.0]
    drawn = figures(found)["nrro"].axes[1].lines[0].get_xydata()
    assert drawn[0] == pytest.approx(found.nrro_speed[1, :2] * [1 / RPM, 1e9])


def test_every_coincidence_of_the_table_is_a_point_of_the_runout_curve(found, met):
    """Between places of the grid the curve passed 21 nm where the table said 35.8 nm: only the six strongest were among its places."""
    for of in (found, met):
        along_speed = [c for c in of.coincidences if not c.repeats and c.condition.temperature == NOMINAL.temperature]
        along_temperature = [c for c in of.coincidences if not c.repeats and c.at_nominal_speed]
        for curve, listed in ((of.nrro_speed, [(c, c.condition.speed) for c in along_speed]), (of.nrro_temperature, [(c, c.condition.temperature) for c in along_temperature])):
            for c, place in listed:
                [row] = curve[curve[:, 0] == place]
                assert row[2 if c.line.direction == "axial" else 1] == pytest.approx(c.nrro, rel=1e-9)
    assert len(along_temperature) >= 1
    assert len([c for c in found.coincidences if c.condition.temperature == NOMINAL.temperature]) > 20


def test_runout_rings_the_coincidence_nearest_to_the_nominal_condition(found):
    """It is the one that the first sentence names, however weak."""
    c = nearest(found.coincidences)
    right = runout(found).axes[-1]
    rings = [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in right.lines if line.get_marker() == "o"]
    assert c.condition.temperature == NOMINAL.temperature
    assert (pytest.approx(c.condition.speed / RPM), pytest.approx(1e9 * c.nrro)) in rings


def test_the_lines_that_the_first_sentences_name_are_drawn(found, met):
    """However many are stronger: the nearest was left out, and nothing said where the nominal speed is."""
    for of in (found, met):
        named = [c for c in of.coincidences if c.at_nominal_speed] or [nearest(of.coincidences)]
        crowd = replace(of, coincidences=tuple(replace(c, strength=1e-15) if c in named else c for c in of.coincidences))
        for c in named:
            assert key(c.line)[1:] in {key(t.line)[1:] for t in drawn_lines(crowd)}  # of two bearings one
        [key_below] = campbell(crowd).legends
        assert "nominal speed, 7200 rpm" in [t.get_text() for t in key_below.get_texts()]
    assert key(nearest(found.coincidences).line) in {key(t.line) for t in drawn_lines(found)}


def test_rings_are_whole_and_their_size_has_a_key(found):
    figure = campbell(found)
    [rings] = figure.axes[0].collections
    assert not rings.get_clip_on()
    assert any(t.get_text().startswith("coincidence, larger if stronger: at most ") and t.get_text().endswith(" nm") for t in figure.legends[0].get_texts())


SEEN = {
    "all colours": np.eye(3),
    "no green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "no red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
}
"""Linear RGB as it is seen (Machado et al., IEEE Trans. Vis. Comput. Graph. 15, 2009, 1291, severity 1)."""


@pytest.mark.parametrize("seen", SEEN)
def test_modes_and_causes_differ_in_colour(seen):
    """By 15 in CIE Lab, where 2 can just be seen; the green of axial modes was that of ball
    waviness, the purple of mixed whirl that of outer waviness."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) / np.array([[0.9505], [1.0], [1.089]])

    def lab(paint):
        c = np.array(to_rgb(paint))
        linear = np.clip(SEEN[seen] @ np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4), 0, 1)
        xyz = to_xyz @ linear
        x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
        return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])

    for a, b in combinations([*WHIRL.values(), *CAUSES.values()], 2):
        assert np.linalg.norm(lab(a) - lab(b)) > 15, (a, b)


def test_an_interpolated_coincidence_has_the_runout_of_the_curve_where_it_passes(met):
    """On a coarse grid of temperatures its ring stood beside the curve, by a tenth of its value."""
    c = next(c for c in met.coincidences if c.at_nominal_speed)
    rough = replace(c, interpolated=True, nrro=1.0)
    assert _on_curve(rough, met.nrro_speed, met.nrro_temperature, met.nominal).nrro == pytest.approx(c.nrro, rel=1e-9)
    assert _on_curve(replace(rough, interpolated=False), met.nrro_speed, met.nrro_temperature, met.nominal).nrro == 1.0
    elsewhere = replace(rough, condition=replace(c.condition, temperature=33.3333))
    assert _on_curve(elsewhere, met.nrro_speed, met.nrro_temperature, met.nominal).nrro == 1.0
