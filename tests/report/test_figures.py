"""Figures of the report: colours, scales, and names that no curve and no other name lies over."""

from __future__ import annotations

import re
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure

from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.report.figures import common, designs, warmup
from thermospindle.report.figures import report as plots
from thermospindle.report.figures import study as studies
from thermospindle.report.figures.common import colour
from thermospindle.report.figures.run import panels
from thermospindle.report.figures.study import looks_of
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run


def test_exaggeration_is_a_round_number_that_fits(run: Run):
    """The largest displacement is drawn as at most 6 % of the section, and not less than a third of that."""
    point = run.steps[-1].point
    _, scale = plots.section("key", point)
    mantissa = scale / 10 ** np.floor(np.log10(scale))
    assert mantissa == pytest.approx(round(mantissa))
    assert round(mantissa) in (1, 2, 5)
    _, still = plots.section("key", run.steps[0].point)
    assert still == 1.0  # nothing moves at the reference temperature


def test_the_section_of_a_slender_spindle_has_a_picture_of_its_shape(run: Run):
    """In the wide one of a flat spindle most of it would be empty, and its title cut off."""
    sizes = []
    for point in (run.steps[0].point, operating_point(load("five_bearing"), Condition(20.0))):
        drawn, _ = plots.section("key", point)
        found = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', drawn)
        assert found is not None
        sizes.append(float(found[1]) / float(found[2]))
    assert sizes[0] > 2
    assert sizes[1] < 1.4


def test_temperature_colours_go_from_cold_to_hot():
    assert common.colour(20, (20, 60)) == "#2166ac"
    assert common.colour(60, (20, 60)) == "#c9371c"
    assert common.colour(20, (20,)) == "#2166ac"


def test_lines_of_a_sweep_have_a_look_for_each_quantity():
    """Colours say the temperature alone, dashes the speed, marks what else is varied, which is
    named with what it is of; no two lines look the same."""
    others = ["vary.structure.joints.cone.lateral_stiffness_N_per_m", "temperature_C", "speed_rpm"]
    lines = list(product(["[200000000.0, 200000000.0]", "[300000000.0, 300000000.0]"], [20.0, 50.0], [0.0, 24000.0]))
    looks, key = looks_of(others, lines)
    assert len({str(look) for look in looks.values()}) == len(lines) == 8
    for of, what in ((1, ("color",)), (2, ("ls", "lw")), (0, ("marker", "ms", "mfc"))):
        by_value = {told[of]: {str([looks[t].get(w) for w in what]) for t in lines if t[of] == told[of]} for told in lines}
        assert all(len(own) == 1 for own in by_value.values())
        assert len(set.union(*by_value.values())) == 2
    stiffness = "cone lateral_stiffness_N_per_m"
    assert sorted(str(line.get_label()) for line in key) == ["0 rpm", "20 °C", "24000 rpm", "50 °C", f"{stiffness} 2e+08, 2e+08", f"{stiffness} 3e+08, 3e+08"]


def test_without_temperatures_no_colour_means_one():
    """Three keys varied at one temperature: dashes, marks, and colours that are not those from cold to hot; a fourth shares the last."""
    others = [f"vary.{name}" for name in ("a.x", "b.x", "c.x", "d.x")]
    lines = list(product((1.0, 2.0), repeat=4))
    looks, key = looks_of(others, lines)
    assert len({str(look) for look in looks.values()}) == 16
    assert not {look["color"] for look in looks.values()} & {colour(t, (0, 1)) for t in (0, 1)}
    assert [str(line.get_label()) for line in key][-1] == "c x 2, d x 2"


def test_svg_for_a_page():
    """Ids are only those referred to, with the figure's own beginning; two figures of one page share none; text stays text."""
    drawn = []
    for key in ("a", "b"):
        with rc_context(common.STYLE):
            figure = Figure(figsize=(3, 2))
            axes = figure.subplots()
            axes.plot([0, 1], [0, 1], "o-", color="#c9371c", label="line")
            axes.legend()
            drawn.append(common.svg(figure, key, "a <figure>"))
    ids = [set(re.findall(r' id="([^"]+)"', text)) for text in drawn]
    references = [set(re.findall(r'(?:url\(|href=")#([^")]+)', text)) for text in drawn]
    assert ids[0]
    assert ids == references
    assert not ids[0] & ids[1]
    assert all(name.startswith("a-") for name in ids[0])
    assert re.sub(r'(["#])a-', r"\1b-", drawn[0]) == drawn[1]
    assert ">line</text>" in drawn[0]
    assert "stroke: #c9371c" in drawn[0]
    assert 'aria-label="a &lt;figure&gt;"' in drawn[0]
    assert "<metadata" not in drawn[0]


def test_what_is_written_in_a_figure_is_not_shortened():
    """Places are rounded to a hundredth of a point; ticks, names and the description keep every digit."""
    with rc_context(common.STYLE):
        figure = Figure(figsize=(3, 2))
        axes = figure.subplots()
        axes.plot([20, 35, 50], [0.00123456, 0.0034, 0.0048])
        axes.set_xlabel("beside 1001.9978 Hz")
        drawn = common.svg(figure, "a", "a loss of 0.0079")
    texts = re.findall(r"<text[^>]*>(.*?)</text>", drawn)
    assert {"0.002", "0.003", "0.004", "beside 1001.9978 Hz"} <= set(texts)
    assert 'aria-label="a loss of 0.0079"' in drawn
    assert not re.search(r"\d\.\d{3}", re.sub(r"<text[^>]*>.*?</text>|aria-label=\"[^\"]*\"", "", drawn))


@pytest.mark.parametrize(("long", "short"), [("1.236", "1.24"), ("-0.0004", "0"), ("12.999", "13"), ("1.5e-07", "1.5e-07"), ("9.9990e1", "99.99"), ("7.10", "7.10")])
def test_places_are_rounded_not_cut(long, short):
    assert common.LONG.sub(common._rounded, f"M {long} 2") == f"M {short} 2"


def test_a_level_curve_has_no_offset_axis():
    """A contact angle that stays 25 degrees but for its last digits: ticks are plain numbers around 25, not 0.00 and an offset."""
    text = plots.trend("k", [20.0, 60.0], {"": {"lower": [25.0, 25.00004], "upper": [25.0, 25.0]}}, "contact angle, degrees", False)
    ticks = [float(t.replace("−", "-")) for t in re.findall(r">([−+\d.e]+)</text>", text)]
    assert "e" not in "".join(re.findall(r">([−+\d.e]+)</text>", text))
    assert len([t for t in ticks if 24 < t < 26]) >= 3


def test_two_quantities_of_one_bearing_are_told_apart_by_their_marks(monkeypatch):
    """In `tailstock` the radial stiffness of one row begins where the axial one of three others does, and both were drawn alike."""
    drawn = []
    monkeypatch.setattr(plots, "svg", lambda figure, *_: drawn.append(figure) or "")
    plots.trend("stiffness", [20.0, 60.0], {"radial": {"a": [90.0, 95.0], "b": [128.6, 147.9]}, "axial": {"a": [128.4, 132.9], "b": [187.0, 213.7]}}, "stiffness, N/µm", True)
    axes = drawn[0].axes[0]
    assert [line.get_markerfacecolor() == line.get_color() for line in axes.get_lines()] == [True, True, False, False]
    assert [text.get_text() for text in axes.texts] == ["radial", "axial, open marks"]


@pytest.mark.parametrize(
    ("values", "least", "ends"),
    [
        ([180.0 - 1e-10, 180.0, 180.0 + 1e-10], None, (179.982, 180.018)),
        ([180.0, np.nan, 180.0], None, (179.982, 180.018)),
        ([-5.0, -5.0 - 1e-9], 0.1, (-5.1, -4.9)),
        ([180.0, 180.1], None, None),  # what changes fills the panel
        ([0.0, 0.0], None, None),
        ([np.nan], None, None),
    ],
)
def test_rounding_does_not_fill_a_panel(values, least, ends):
    figure = Figure()
    axes = figure.subplots()
    axes.plot(values)
    before = axes.get_ylim()
    common.least_span(axes, np.array(values), least)
    assert axes.get_ylim() == (before if ends is None else pytest.approx(ends, rel=1e-9))


NOISE = 180.0 + 1e-10 * np.array([0.0, 1.0, -1.0, 0.5])
"""The preload of a spring, as it is computed."""


def test_a_preload_that_stays_is_level_in_every_figure():
    """In that of a warm-up it went from 179.99999999985 to 180.00000000015 N."""
    figure = Figure()
    axes = figure.subplots()
    warmup._of_bearings(axes, np.arange(4.0), np.array([NOISE, NOISE]).T, ["front", "rear"], "Preload", "preload, N")
    own = {f"d{k}": {"nominal": v} for k, v in enumerate(NOISE)}
    told = {"designs": [{"design": d} for d in own], "conditions": [{"temperature_C": 20.0, "speed_rpm": 0.0, "figures": {"preload": {"designs": own}}}]}
    for each in (axes, designs.compared(told)["comparison"].axes[0], panels({"preload": [(np.arange(4.0), NOISE, "black")]}, 1, (3.0, 2.0), "s").axes[0]):
        assert np.ptp(each.get_ylim()) > 0.01


def test_residuals_have_one_scale():
    """Ticks are plain numbers; one standard error is pale on every page."""
    figure = Figure()
    norm = common.residual_norm(4.0)
    assert (norm.vmin, norm.vmax) == (-30.0, 30.0)
    assert abs(float(norm(1.0)) - 0.5) < 0.15
    common.residual_bar(figure, norm, figure.subplots())
    figure.canvas.draw()
    assert [t.get_text() for t in figure.axes[1].get_yticklabels()] == ["−10", "−3", "0", "3", "10"]


@pytest.mark.parametrize("count", [2, 5])
def test_names_of_many_bearings_stand_above_their_curves(count, monkeypatch):
    """Where there is no room among the curves no name lies over one."""
    drawn = []
    monkeypatch.setattr(plots, "svg", lambda figure, *more: drawn.append(figure) or "")
    names = [f"bearing {k}" for k in range(count)]
    plots.trend("force", [20.0, 40.0, 60.0], {"": {name: [30.0 + k, 35.0 + k, 40.0 + 9 * k] for k, name in enumerate(names)}}, "force, N", True)
    [figure] = drawn
    figure.draw_without_rendering()
    [axes] = figure.axes
    told = axes.get_legend() or figure.legends[0]
    assert [t.get_text() for t in told.get_texts()] == names[::-1]
    over = told.get_window_extent().overlaps(axes.get_window_extent())
    assert over == (count == 2)


@pytest.mark.parametrize(
    ("frequencies", "labels"),
    [
        ([1085.0, 1105.0, 1170.0, 2079.0], ["1, 2, 3", "4"]),  # 3 lies off 2, but not off where the two names stand
        ([1000.0, 1070.0, 3000.0], ["1", "2", "3"]),
        ([1000.0, 1050.0, 3000.0], ["1, 2", "3"]),
    ],
)
def test_numbers_of_close_modes_share_a_label(frequencies, labels):
    peaks = plots.Peaks("computed", "computed", 20.0, {k: (f, np.nan) for k, f in enumerate(frequencies, 1)})
    assert [name for name, _ in plots.grouped(peaks, 0.011 * 5600)] == labels


@pytest.mark.parametrize(("largest", "ends"), [(4.0, ("-10", "10")), (900.0, ("-100", "100")), (2e6, ("-1e+06", "1e+06"))])
def test_ticks_of_residuals_are_plain_numbers_on_both_sides(largest, ends):
    figure = Figure()
    axes = figure.add_subplot()
    common.residual_bar(figure, common.residual_norm(largest), axes)
    figure.canvas.draw()
    told = [t.get_text().replace("\N{MINUS SIGN}", "-") for t in figure.axes[1].get_yticklabels()]
    assert (told[0], told[-1]) == ends
    values = [float(t) for t in told]
    assert values == sorted(values) == [-v for v in reversed(values)]
    assert 0.0 in values


# ---------------------------------------------------------------- studies


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("lowest_Hz", "Lowest mode, Hz"),
        ("lowest_Hz.axial", "Lowest axial mode, Hz"),
        ("lowest_damping_ratio", "Damping of the lowest mode, %"),
        ("stiffness_N_per_um.axial", "Stiffness axial, N/µm"),
        ("rro_um.y", "RRO along y, µm"),
        ("nrro_six_sigma_um.x", "NRRO, six sigma, along x, µm"),
        ("another", "another"),
    ],
)
def test_figures_of_designs_have_words_and_units(key, words):
    """Raw keys stood above the panels."""
    assert designs.worded(key) == words


def test_a_design_without_a_number_is_unknown_and_no_mark_is_cut_off():
    """Bearings by numbers roll no balls: nothing stood where their NRRO would, and marks lay on the edge of the panel."""
    one, other = {"nominal": 0.146}, {"nominal": None}
    figures = {"nrro_six_sigma_um.x": {"designs": {"a": one, "b": other}}, "lowest_damping_ratio": {"designs": {"a": {"nominal": 0.005}, "b": {"nominal": 0.008}}}}
    told = {"designs": [{"design": "a"}, {"design": "b"}], "conditions": [{"temperature_C": t, "speed_rpm": 7200.0, "figures": figures} for t in (20.0, 40.0)]}
    runout, damping, *_ = designs.compared(told)["comparison"].axes
    [unknown] = runout.texts
    assert (unknown.get_text(), unknown.get_position()[0]) == ("unknown", 1)
    assert not damping.texts
    drawn = np.array([line.get_xydata()[0] for line in damping.lines])
    assert sorted(drawn[:, 1]) == pytest.approx([0.5, 0.5])
    low, high = damping.get_xlim()
    assert (low, high) == (-0.5, 1.5)


def test_pictures_of_a_study_say_of_which_study_and_scene():
    drawn = studies.headed({"sweep": Figure(figsize=(10, 4)), "narrow": Figure(figsize=(2, 2))}, "Preload of the drive", ["hdd_2003", *"abcde"])
    assert drawn["sweep"].get_suptitle() == "Preload of the drive: hdd_2003, a, b, c and 2 more"
    assert "\n" in drawn["narrow"].get_suptitle()


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("bearing_pair.preload_N", "bearing pair preload, N"),
        ("structure.joints.cone.lateral_stiffness_N_per_m", "cone lateral stiffness, N/m"),
        ("speed, rpm", "speed, rpm"),
        ("structure.bodies.hub.mass_kg", "hub mass, kg"),
        ("bearings.lower.balls", "lower balls"),
    ],
)
def test_axes_of_a_sweep_have_words_and_units(key, words):
    assert studies._worded(key) == words


def test_sensitivities_have_a_key_to_their_colours():
    """And their condition in the title."""
    own = [("1 axial", {"preload": 0.9, "mass": np.nan}), ("2 axial", {"preload": 0.01, "mass": -0.4})]
    drawn = studies._inputs_map(own, 1.0, "Coefficients", {"temperature_C": 60.0, "speed_rpm": 7200.0})
    axes, bar = drawn.axes
    assert "Coefficients, 60 °C, 7200 rpm" in axes.get_title().replace("\n", " ")
    assert bar.get_ylim() == (-1.0, 1.0)
    assert "blank" in bar.get_ylabel()
    assert {t.get_text() for t in axes.texts} == {"0.90", "−0.40"}


def test_panels_of_modes_name_their_kind():
    kinds = [SimpleNamespace(kind=k) for k in ("axial", "rocking")]
    assert studies.kinds_of(SimpleNamespace(own={"cold": (None, kinds[:1]), "warm": (None, kinds)})) == {1: "axial", 2: "rocking"}
