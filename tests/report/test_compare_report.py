"""Pictures, report and folder of a comparison, read back."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib import rc_context
from rich.console import Console

from tests.conftest import SCENE
from thermospindle.cli import main
from thermospindle.diagnosis.compare.before_after import BeforeAfter
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.compare.constant import constant_errors
from thermospindle.diagnosis.data.observe import observe
from thermospindle.model.machine import Condition
from thermospindle.report.figures.common import STYLE, label, svg
from thermospindle.report.figures.compare import figures, shown_pairs
from thermospindle.report.log.compare import FrfsBeside, write_comparison_log
from thermospindle.report.log.read import read_log
from thermospindle.report.page.compare import sections, write_comparison
from thermospindle.report.text.compare import comparison_json, constant_words, show_comparison, verdict
from thermospindle.report.typeset import with_error
from thermospindle.report.verbs.compare import _beyond
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point

LINES = np.arange(400.0, 6000.0, 4.0)


@pytest.fixture(scope="module")
def campaign(spindle):
    """The model's own FRFs with every frequency 1 % low, cold and hot."""
    tests = []
    for t, speed in ((20.0, 0.0), (60.0, 754.0)):
        value = operating_point(spindle, Condition(t, speed)).frf(LINES * 1.01)
        sd = 0.003 * np.abs(value) + 2e-4 * np.abs(value).max()
        error = sd * np.random.default_rng(1).standard_normal((2, *value.shape)) / np.sqrt(2)
        frf = Frf(LINES, value + error[0] + 1j * error[1], tuple(p.node for p in spindle.points), (1, 2), "mobility", sd=sd)
        tests.append(Test(f"T{t:g}", t, speed, frf=frf))
    return Campaign("1 % low & <slow>", spindle.name, "mobility", spindle.points, tuple(tests), Noise(0.003, 2e-4))


@pytest.fixture(scope="module")
def found(spindle, campaign):
    return compare(spindle, campaign)


@pytest.fixture(scope="module")
def folder(spindle, found, tmp_path_factory):
    path = tmp_path_factory.mktemp("comparison")
    write_comparison(found, spindle, path, name="campA")
    return path


class Cells(HTMLParser):
    """The cells of the table of modes; fails where tags do not close in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.cells: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in {"meta", "br", "img", "path", "use", "rect", "image"}:
            self.open.append(tag)
        if tag == "td":
            self.cells.append("")

    def handle_endtag(self, tag):
        if tag not in {"path", "use", "rect", "image"}:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if "td" in self.open:
            self.cells[-1] += data


def test_the_whole_is_one_percent_low(found):
    for test in found.tests:
        assert [100 * m.error / m.measured for m in test.modes] == pytest.approx([1.0] * len(test.modes), abs=0.15)
        assert len(test.modes) >= 7
        assert test.correlation.whole.shift == pytest.approx(0.01, abs=5e-4)
        assert test.missing == test.extra == ()


def test_what_is_the_same_at_all_conditions_is_said_with_its_figures(found, folder, capsys):
    """A scene that add had made of a diagnosis was 25 standard errors off where diagnose had told 1.9: constant errors of modes are free there, and nothing said so."""
    constant = constant_errors(found.tests)
    assert list(constant.frequency.values()) == pytest.approx([0.01] * len(constant.frequency), abs=1e-3)
    assert constant.share > 0.99
    assert constant.without < 0.1 * found.rms_residual
    said = constant_words(found)
    assert f"{constant.without:.3g} standard errors would be left: build tolerances and constant errors of modes do that" in said
    assert "build tolerances are fitted in this scene; diagnose leaves free, too, what no scene holds: constant errors of modes" in constant_words(replace(found, built=True))
    show_comparison(Console(width=2000), found)
    assert said in capsys.readouterr().out
    assert "of the squared errors are the same at all conditions" in (folder / "report.html").read_text()
    assert comparison_json(found)["constant_errors"]["rms_pull"] == constant.without
    cold, hot = found.tests
    moving = replace(found, tests=(cold, replace(hot, residuals=-hot.residuals)))
    assert constant_errors(moving.tests).share < 0.5
    assert constant_words(moving) == ""
    drifting = replace(found, tests=(cold, replace(hot, residuals=0.5 * hot.residuals)))
    assert constant_errors(drifting.tests).share > 0.5
    assert constant_words(drifting) == ""  # half of it gone when hot: an effect may do that
    assert constant_errors([cold]) is None


def test_errors_that_hang_together_are_told(found):
    """Where every mode by itself is within what its test's temperature may do, and all of them at once are not, no mode is called the worst."""
    largest = max(abs(m.residual) for t in found.tests for m in t.modes)
    together = replace(found, tests=tuple(replace(t, missing=(), residuals=np.full_like(t.residuals, 100 * largest)) for t in found.tests))
    words = f"no mode alone is off by more than {largest:.1f}, but their errors hang together"
    assert words in verdict(together)
    assert "furthest off" not in verdict(together)
    assert words not in verdict(found)
    assert any("but their errors hang together" in str(section) for section in sections(together))


def test_furthest_off_says_in_what(found):
    """The largest error in standard errors need not be that in Hz, and a mode of another shape is neither."""
    modes = list(found.tests[0].modes)
    modes[0], modes[1], modes[2] = replace(modes[0], sd=1e-4), replace(modes[1], computed=1.05 * modes[1].measured), replace(modes[2], sd=1e-5, mac=0.0)
    told = verdict(replace(found, tests=(replace(found.tests[0], modes=tuple(modes)),)))
    assert f"furthest off in standard errors is the {modes[0].kind} mode at {modes[0].measured:.0f} Hz of T20" in told
    assert f"({abs(modes[0].residual):.3g} standard errors); in Hz it is the {modes[1].kind} mode at {modes[1].measured:.0f} Hz of T20" in told
    agreeing = [replace(t, missing=(), residuals=0 * t.residuals) for t in found.tests]
    assert verdict(replace(found, tests=tuple(agreeing))).endswith("0 standard errors.")
    agreeing[0] = replace(agreeing[0], modes=tuple(replace(m, mac=0.03 if k == 2 else m.mac) for k, m in enumerate(agreeing[0].modes)))
    said = verdict(replace(found, tests=tuple(agreeing)))
    assert f"; but the shape measured at {modes[2].measured:.0f} Hz of T20 has nothing of the computed one (MAC below 0.1)." in said
    lost = verdict(replace(found, tests=(replace(found.tests[0], missing=(3000.0,)),)))
    assert "no computed mode is within 8% of the measured one at 3000 Hz of T20, which counts as that much; of the others furthest off in standard errors is" in lost
    strange = tuple(replace(m, mac=0.0) for m in modes)
    assert "no computed mode near a measured one has its shape" in verdict(replace(found, tests=(replace(found.tests[0], modes=strange),)))


def test_kelvin_for_celsius_is_told_and_warns_of_no_overflow(spindle, campaign):
    """At 293 C both bearings lose contact: the hub moves freely, and its FRFs are not compared."""
    kelvin = replace(campaign, tests=(replace(campaign.tests[0], temperature=293.0),))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        other = compare(spindle, kelvin)
    assert other.tests[0].correlation is None
    (told,) = _beyond(other)
    assert "at 293 C and 0 rpm the lower and upper bearing lost contact" in told


def test_the_folder(folder):
    names = ("pulls", "frfs", "bands", "channels", "fdac")
    assert {p.name for p in folder.iterdir()} == {"report.html", "compare.rrd", *(f"{n}.{k}" for n in names for k in ("svg", "png"))}
    for name in names:
        assert (folder / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert "<svg" in (folder / f"{name}.svg").read_text(encoding="utf-8")


def test_the_report_tells_every_mode(found, folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    cells = Cells(text).cells
    for test in found.tests:
        for m in test.modes:
            assert f"{m.computed:.2f}" in cells
            assert str(with_error((m.measured, m.sd))).replace(" <small>", " ").removesuffix("</small>") in cells
    assert "1 % low &amp; &lt;slow&gt;" in text
    assert "<slow>" not in text
    assert not re.search(r'(?:src|href)="(?!#|data:)', text)  # needs no network
    ids = re.findall(r' id="([^"]+)"', text)
    assert len(ids) == len(set(ids))


def test_close_modes_are_starred(found, folder):
    """As in the terminal, with what the star means."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    close = [f"{m.mac:.3f}*" for t in found.tests for m in t.modes if m.close]
    assert close
    assert [cell for cell in Cells(text).cells if cell.endswith("*")] == close
    assert "* Close modes: share of the measured shape" in text
    assert f"<title>Comparison: campA beside {found.spindle}: " in text  # two of one spindle are told apart in their tabs


def test_sections_have_the_form_of_the_report(found):
    told = sections(found)
    assert [title for title, _ in told] == ["Measured beside computed", "FRFs, measured and computed"]
    assert all("<svg" in body for _, body in told)


def test_the_page_tells_the_error_before_and_after(found, tmp_path):
    """It was in the terminal and in the JSON alone."""
    cold, hot = found.tests
    worse = replace(found, spindle="<old>", tests=(replace(cold, residuals=10 * cold.residuals), hot))
    text = sections(found, BeforeAfter(worse, found, ("T60",)))[0][1]
    rows = dict(re.findall(r"<tr[^>]*><td class=left>([^<]* tests)</td>(.*?)</tr>", text))
    errors = BeforeAfter(worse, found, ("T60",)).errors()
    for name, which in (("all tests", ""), ("fitted tests", "fitted_"), ("held out tests", "held_out_")):
        assert rows[name] == "".join(f"<td>{errors[which + when]:.3g}</td>" for when in ("before", "after"))
    assert "Held out: T60." in text
    assert "&lt;old&gt;" in text
    assert "before-after" not in sections(found)[0][1]
    assert len(re.findall(" tests</td>", sections(found, BeforeAfter(worse, found, ()))[0][1])) == 1  # none is held out: all are fitted
    out = tmp_path / "out"
    assert main(["compare", str(SCENE), str(SCENE / "measured" / "jang_2003"), "--before", str(SCENE), "--out", str(out), "--json"]) == 0
    assert "rms in standard errors, before and after" in (out / "report.html").read_text()


def test_the_pull_map_shows_the_pulls(found):
    """Every number of the picture is a pull of the comparison, to its printed digits."""
    with rc_context(STYLE):
        text = svg(figures(found)["pulls"], "k", "pulls")
    for test in found.tests:
        for m in test.modes:
            shown = f"{m.residual:+.1f}" if abs(m.residual) < 9.95 else f"{m.residual:+.0f}"
            assert f">{shown.replace('-', '−')}<" in text


def test_the_log_reads_back(found, folder, campaign):
    contents = read_log(folder / "compare.rrd")
    assert list(contents.frfs) == ["T20", "T20 computed", "T60", "T60 computed"]
    for test, of in zip(campaign.tests, found.tests, strict=True):
        assert contents.frfs[test.id] == test.frf
        assert np.array_equal(contents.frfs[f"{test.id} computed"].value, of.correlation.computed)
    assert {p.source for p in contents.peaks} == {"measured", "computed"}
    told = sorted(p.frequency for p in contents.peaks if p.source == "measured" and p.test == "T20")
    assert told == [m.measured for m in found.tests[0].modes]
    assert contents.blueprint
    assert contents.timelines == ("frequency",)
    level = "/frf/T20/hammer\\ 1\\,\\ response\\ 1/level"
    assert {f"{level}/measured", f"{level}/computed", f"{level}/modes_measured"} <= set(contents.entities)


def test_what_symmetry_forbids_has_a_view_in_the_log_too(spindle, campaign, tmp_path):
    """Computed as nothing at all where noise alone was measured, measured as nothing, and neither: every curve is there, on an axis of its own."""
    test = campaign.tests[0]
    computed, measured = test.frf.value.copy(), test.frf.value.copy()
    computed[3, 0], measured[4, 0], computed[5, 1], measured[5, 1] = 0.0, 0.0, 0.0, 0.0
    frf = replace(test.frf, value=measured)
    write_comparison_log(spindle, "crossed", [FrfsBeside(test, frf, computed)], {}, tmp_path / "compare.rrd")
    contents = read_log(tmp_path / "compare.rrd")
    assert np.array_equal(contents.frfs[f"{test.id} computed"].value, computed)
    assert contents.frfs[test.id] == frf
    assert contents.blueprint


def test_a_table_of_modes_has_no_frfs_to_show(spindle, tmp_path):
    rows = (ModeRow("t", 1, "axial", 1002.0, 0.1), ModeRow("t", 2, "rocking", 1300.0, 0.1))
    campaign = Campaign("table", spindle.name, "mobility", spindle.points, (Test("t", 20.0, 0.0, modes=rows),))
    found = compare(spindle, campaign)
    assert set(figures(found)) == {"pulls"}
    write_comparison(found, spindle, tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"report.html", "pulls.svg", "pulls.png"}
    assert "1300.0 Hz" in (tmp_path / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")


@pytest.mark.parametrize(("frequencies", "said"), [((1.0025, 1.545), "none of the 2 measured modes has a computed partner"), ((1.545,), "the one measured mode has no computed partner")])
def test_no_scene_agrees_with_modes_of_which_none_is_paired(spindle, frequencies, said):
    """In kHz, to 0.3 Hz: each counted as 8 % of its frequency, a quarter of its standard error, and the scene was said to agree."""
    rows = tuple(ModeRow("t", k, "axial", f, 0.3) for k, f in enumerate(frequencies, 1))
    found = compare(spindle, Campaign("table", spindle.name, "mobility", spindle.points, (Test("t", 20.0, 0.0, modes=rows),)))
    assert found.tests[0].modes == ()
    told = verdict(found)
    assert "does not agree with the tests" in told
    assert f"{said} within 8% of its frequency: are frequencies in another unit" in told


def test_a_test_without_modes_is_shown(spindle, campaign):
    """Nothing found in the FRFs: they are still compared, and the pictures drawn."""
    empty = observe(Campaign("n", spindle.name, "mobility", (), (replace(campaign.tests[0], frf=None),)), spindle)[0]
    found = compare(spindle, replace(campaign, tests=campaign.tests[:1]), [replace(empty, test=campaign.tests[0])])
    assert found.tests[0].modes == ()
    assert "<svg" in dict(sections(found))["FRFs, measured and computed"]


def test_people_read_likeness_by_test(found):
    console = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show_comparison(console, found)
    text = console.export_text()
    assert "CSAC" in text
    assert "+1.00" in text


def test_many_tests_are_a_row_a_mode(found):
    """Three times the same tests: the mean error of a mode is that of one, its worst that of its worst test; --verbose shows every one."""
    many = replace(found, tests=found.tests * 3)
    console = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    show_comparison(console, many, verbose=False)
    text = console.export_text()
    every = [(m, t.test.id) for t in found.tests for m in t.modes if m.number == 1]
    worst, test = max(every, key=lambda row: abs(row[0].residual))
    (row,) = [line.split() for line in text.splitlines() if line.split()[:2] == ["1", worst.kind]]
    assert row[2] == str(3 * len(every))
    assert float(row[4]) == pytest.approx(np.mean([m.error for m, _ in every]), abs=0.006)
    assert (row[6], row[7]) == (f"{worst.error:+.2f}", test)
    show_comparison(console, many)
    assert console.export_text().count(f"{worst.measured:.2f}") == 3


def test_a_third_of_an_octave_is_one_column_wherever_lines_begin(found, spindle, campaign):
    """Records of other lengths have other first and last lines: their outer bands are cut elsewhere, and are the same bands."""
    frf = campaign.tests[1].frf
    cut = replace(campaign.tests[1], frf=replace(frf, frequency=frf.frequency[1:-4], value=frf.value[:, :, 1:-4], sd=frf.sd[:, :, 1:-4]))
    other = compare(spindle, replace(campaign, tests=(campaign.tests[0], cut)))
    axes = figures(other)["bands"].axes[0]
    told = [t.get_text() for t in axes.get_xticklabels()]
    assert told == [t.get_text() for t in figures(found)["bands"].axes[0].get_xticklabels()]
    assert not np.ma.getmaskarray(axes.images[0].get_array()).any()


def test_labels_and_pairs(found, campaign):
    assert [label(t.test, ", ") for t in found.tests] == ["20 °C", "60 °C, 7200 rpm"]
    driving = [(n, n) for n in campaign.tests[0].frf.reference_nodes]
    first = found.tests[0].correlation
    assert shown_pairs(first, len(driving)) == driving
    more = shown_pairs(first, len(driving) + 2)
    assert more[: len(driving)] == driving
    levels = [np.linalg.norm(first.measured[first.pairs[p]]) for p in more[len(driving) :]]
    assert levels == sorted(levels, reverse=True)


def test_numbers_can_be_read_and_one_test_shows_more_of_its_frfs(found):
    """Numbers on the maps of bands were 4 points high, and of a beam's three FRFs one was drawn."""
    alone = replace(found, tests=found.tests[:1])
    drawn = figures(alone)
    frfs = [axes.get_title(loc="left") for axes in drawn["frfs"].axes if axes.lines]
    assert len(frfs) == min(6, len(alone.tests[0].correlation.pairs))
    assert len([axes for axes in figures(found)["frfs"].axes if axes.lines]) == 3 * len(found.tests)
    for one in (drawn["bands"], figures(found)["bands"]):
        sizes = {text.get_fontsize() for axes in one.axes for text in axes.texts}
        assert min(sizes) >= 6.5


def test_labels_of_an_open_place_are_shown(found):
    below = figures(found)["frfs"].axes[-3:]  # of two tests the row of the last
    assert all(axes.xaxis.get_tick_params()["labelbottom"] for axes in below)
    numbers = {n for text in below[0].texts for n in text.get_text().split(",")}
    assert numbers == {str(m.number) for m in found.tests[-1].modes}
    assert all(axes.xaxis.get_tick_params()["labelbottom"] for axes in figures(replace(found, tests=found.tests[:1]))["frfs"].axes if axes.lines)


def test_a_damping_that_is_far_off_is_named(found):
    """No frequency is off by much and the dampings are: it was told as errors of the temperature that hang together."""
    largest = max(abs(m.residual) for t in found.tests for m in t.modes)
    far = [replace(t, missing=(), residuals=np.full_like(t.residuals, 100 * largest), modes=tuple(replace(m, damping_sd=1e-9) for m in t.modes)) for t in found.tests]
    said = verdict(replace(found, tests=tuple(far)))
    assert f"no frequency alone is off by more than {largest:.1f}, but dampings are, most that of " in said
    assert "hang together" not in said
