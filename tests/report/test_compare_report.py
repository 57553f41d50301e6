"""Pictures, report, log and folder of a comparison, read back."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib import rc_context

from tests.conftest import SCENE
from thermospindle.cli import main
from thermospindle.diagnosis.compare.before_after import BeforeAfter
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import observe
from thermospindle.report.figures.common import STYLE, label, svg
from thermospindle.report.figures.compare import figures, shown_pairs
from thermospindle.report.log.compare import FrfsBeside, write_comparison_log
from thermospindle.report.log.read import read_log
from thermospindle.report.page.compare import sections, write_comparison
from thermospindle.report.typeset import with_error
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow


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


def test_the_folder(compared_folder):
    names = ("pulls", "frfs", "bands", "channels", "fdac")
    assert {p.name for p in compared_folder.iterdir()} == {"report.html", "compare.rrd", *(f"{n}.{k}" for n in names for k in ("svg", "png"))}
    for name in names:
        assert (compared_folder / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
        assert "<svg" in (compared_folder / f"{name}.svg").read_text(encoding="utf-8")


def test_where_no_mode_was_found_the_folder_is_whole(spindle, quiet, tmp_path):
    """Rerun takes no list of nothing whose type it is not told, and the verb ended in its words."""
    write_comparison(quiet, spindle, tmp_path)
    assert {p.stem for p in tmp_path.iterdir()} == {"report", "compare", "frfs", "bands", "channels", "fdac"}
    log = read_log(tmp_path / "compare.rrd")
    assert log.kind == "run"
    assert log.peaks == ()
    assert list(log.frfs) == [f"{t.test.id}{which}" for t in quiet.tests for which in ("", " computed")]


def test_the_report_tells_every_mode(compared, compared_folder):
    text = (compared_folder / "report.html").read_text(encoding="utf-8")
    cells = Cells(text).cells
    for test in compared.tests:
        for m in test.modes:
            assert f"{m.computed:.2f}" in cells
            assert str(with_error((m.measured, m.sd))).replace(" <small>", " ").removesuffix("</small>") in cells
    assert "1 % low &amp; &lt;slow&gt;" in text
    assert "<slow>" not in text
    assert not re.search(r'(?:src|href)="(?!#|data:)', text)  # needs no network
    ids = re.findall(r' id="([^"]+)"', text)
    assert len(ids) == len(set(ids))


def test_close_modes_are_starred(compared, compared_folder):
    """As in the terminal, with what the star means."""
    text = (compared_folder / "report.html").read_text(encoding="utf-8")
    close = [f"{m.mac:.3f}*" for t in compared.tests for m in t.modes if m.close]
    assert close
    assert [cell for cell in Cells(text).cells if cell.endswith("*")] == close
    assert "* Close modes: share of the measured shape" in text
    assert f"<title>Comparison: campA beside {compared.spindle}: " in text  # two of one spindle are told apart in their tabs


def test_sections_have_the_form_of_the_report(compared):
    told = sections(compared)
    assert [title for title, _ in told] == ["Measured beside computed", "FRFs, measured and computed"]
    assert all("<svg" in body for _, body in told)


def test_the_page_tells_the_error_before_and_after(compared):
    """It was in the terminal and in the JSON alone."""
    cold, hot = compared.tests
    worse = replace(compared, spindle="<old>", tests=(replace(cold, residuals=10 * cold.residuals), hot))
    text = sections(compared, BeforeAfter(worse, compared, ("T60",)))[0][1]
    rows = dict(re.findall(r"<tr[^>]*><td class=left>([^<]* tests)</td>(.*?)</tr>", text))
    errors = BeforeAfter(worse, compared, ("T60",)).errors()
    for name, which in (("all tests", ""), ("fitted tests", "fitted_"), ("held out tests", "held_out_")):
        assert rows[name] == "".join(f"<td>{errors[which + when]:.3g}</td>" for when in ("before", "after"))
    assert "Held out: T60." in text
    assert "&lt;old&gt;" in text
    assert "before-after" not in sections(compared)[0][1]
    assert len(re.findall(" tests</td>", sections(compared, BeforeAfter(worse, compared, ()))[0][1])) == 1  # none is held out: all are fitted


@pytest.mark.slow
def test_the_page_of_the_verb_tells_it_too(tmp_path):
    out = tmp_path / "out"
    assert main(["compare", str(SCENE), str(SCENE / "measured" / "jang_2003"), "--before", str(SCENE), "--out", str(out), "--json"]) == 0
    assert "rms in standard errors, before and after" in (out / "report.html").read_text()


def test_the_pull_map_shows_the_pulls(compared):
    """Every number of the picture is a pull of the comparison, to its printed digits."""
    with rc_context(STYLE):
        text = svg(figures(compared)["pulls"], "k", "pulls")
    for test in compared.tests:
        for m in test.modes:
            shown = f"{m.residual:+.1f}" if abs(m.residual) < 9.95 else f"{m.residual:+.0f}"
            assert f">{shown.replace('-', '−')}<" in text


def test_the_log_reads_back(compared, compared_folder, low):
    contents = read_log(compared_folder / "compare.rrd")
    assert list(contents.frfs) == ["T20", "T20 computed", "T60", "T60 computed"]
    for test, of in zip(low.tests, compared.tests, strict=True):
        assert contents.frfs[test.id] == test.frf
        assert np.array_equal(contents.frfs[f"{test.id} computed"].value, of.correlation.computed)
    assert {p.source for p in contents.peaks} == {"measured", "computed"}
    told = sorted(p.frequency for p in contents.peaks if p.source == "measured" and p.test == "T20")
    assert told == [m.measured for m in compared.tests[0].modes]
    assert contents.blueprint
    assert contents.timelines == ("frequency",)
    level = "/frf/T20/hammer\\ 1\\,\\ response\\ 1/level"
    assert {f"{level}/measured", f"{level}/computed", f"{level}/modes_measured"} <= set(contents.entities)


def test_what_symmetry_forbids_has_a_view_in_the_log_too(spindle, low, tmp_path):
    """Computed as nothing at all where noise alone was measured, measured as nothing, and neither:
    every curve is there, on an axis of its own."""
    test = low.tests[0]
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
    low = Campaign("table", spindle.name, "mobility", spindle.points, (Test("t", 20.0, 0.0, modes=rows),))
    compared = compare(spindle, low)
    assert set(figures(compared)) == {"pulls"}
    write_comparison(compared, spindle, tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"report.html", "pulls.svg", "pulls.png"}
    assert "1300.0 Hz" in (tmp_path / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")


def test_a_test_without_modes_is_shown(spindle, low):
    """Nothing compared in the FRFs: they are still compared, and the pictures drawn."""
    empty = observe(Campaign("n", spindle.name, "mobility", (), (replace(low.tests[0], frf=None),)), spindle)[0]
    compared = compare(spindle, replace(low, tests=low.tests[:1]), [replace(empty, test=low.tests[0])])
    assert compared.tests[0].modes == ()
    assert "<svg" in dict(sections(compared))["FRFs, measured and computed"]


def test_a_third_of_an_octave_is_one_column_wherever_lines_begin(compared, spindle, low):
    """Records of other lengths have other first and last lines: their outer bands are cut elsewhere, and are the same bands."""
    frf = low.tests[1].frf
    cut = replace(low.tests[1], frf=replace(frf, frequency=frf.frequency[1:-4], value=frf.value[:, :, 1:-4], sd=frf.sd[:, :, 1:-4]))
    other = compare(spindle, replace(low, tests=(low.tests[0], cut)))
    axes = figures(other)["bands"].axes[0]
    told = [t.get_text() for t in axes.get_xticklabels()]
    assert told == [t.get_text() for t in figures(compared)["bands"].axes[0].get_xticklabels()]
    assert not np.ma.getmaskarray(axes.images[0].get_array()).any()


def test_labels_and_pairs(compared, low):
    assert [label(t.test, ", ") for t in compared.tests] == ["20 °C", "60 °C, 7200 rpm"]
    driving = [(n, n) for n in low.tests[0].frf.reference_nodes]
    first = compared.tests[0].correlation
    assert shown_pairs(first, len(driving)) == driving
    more = shown_pairs(first, len(driving) + 2)
    assert more[: len(driving)] == driving
    levels = [np.linalg.norm(first.measured[first.pairs[p]]) for p in more[len(driving) :]]
    assert levels == sorted(levels, reverse=True)


def test_numbers_can_be_read_and_one_test_shows_more_of_its_frfs(compared):
    """Numbers on the maps of bands were 4 points high, and of a beam's three FRFs one was drawn."""
    alone = replace(compared, tests=compared.tests[:1])
    drawn = figures(alone)
    frfs = [axes.get_title(loc="left") for axes in drawn["frfs"].axes if axes.lines]
    assert len(frfs) == min(6, len(alone.tests[0].correlation.pairs))
    assert len([axes for axes in figures(compared)["frfs"].axes if axes.lines]) == 3 * len(compared.tests)
    for one in (drawn["bands"], figures(compared)["bands"]):
        sizes = {text.get_fontsize() for axes in one.axes for text in axes.texts}
        assert min(sizes) >= 6.5


def test_labels_of_an_open_place_are_shown(compared):
    below = figures(compared)["frfs"].axes[-3:]  # of two tests the row of the last
    assert all(axes.xaxis.get_tick_params()["labelbottom"] for axes in below)
    numbers = {n for text in below[0].texts for n in text.get_text().split(",")}
    assert numbers == {str(m.number) for m in compared.tests[-1].modes}
    assert all(axes.xaxis.get_tick_params()["labelbottom"] for axes in figures(replace(compared, tests=compared.tests[:1]))["frfs"].axes if axes.lines)
