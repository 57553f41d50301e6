"""Pages and pictures of runout tests of a campaign: alone and beside tests of modes, with the numbers of the JSON."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from rich.console import Console

from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.runout.compare import compare_runout
from thermospindle.diagnosis.runout.moved import leading, moved_lines
from thermospindle.diagnosis.runout.verdict import diagnose_runout
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.units import RPM
from thermospindle.report.figures.runout_campaign import explanations, lines_figure, moved_figure, pulls_figure, strongest_probe
from thermospindle.report.page.compare import write_comparison
from thermospindle.report.page.diagnosis import write_diagnosis
from thermospindle.report.text.runout_compare import SHOWN, cause_words, show_runout_comparison
from thermospindle.report.text.runout_diagnosis import runout_diagnosis_json
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.campaign.simulated import runout_campaign
from thermospindle.sim.effects import CATALOGUE, by_name
from thermospindle.sim.operating import operating_point


class Tags(HTMLParser):
    """Titles of sections; fails where tags do not close in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.titles: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in {"meta", "br", "img"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_data(self, data):
        if self.open and self.open[-1] == "h2":
            self.titles.append(data)


@pytest.fixture(scope="module")
def campaign(spindle):
    """One speed with a heavy cage, of a title that is no HTML."""
    true = replace(spindle, effects=(Addition("cage_unbalance", by_name("cage_unbalance").typical() | {"amount": 6.0, "bearing": 1}),))
    return replace(runout_campaign(true, [Condition(20.0, 7200 * RPM)], 0.5, seed=5, path="linear"), title="heavy & <cage>")


@pytest.fixture(scope="module")
def beside(spindle, campaign):
    return compare_runout(spindle, campaign)


@pytest.fixture(scope="module")
def diagnosed(spindle, campaign):
    return diagnose_runout(spindle, campaign)


def read(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    identities = re.findall(r'id="([^"]+)"', text)
    assert len(identities) == len(set(identities))
    assert "<cage>" not in text
    return text, Tags(text).titles


def test_a_comparison_of_runout_alone_has_its_page(spindle, campaign, beside, tmp_path):
    write_comparison(None, spindle, tmp_path, beside, campaign=campaign.title)
    text, titles = read(tmp_path)
    assert titles == ["Runout, lines measured beside computed", "Runout, repeatable and nonrepeatable parts"]
    assert "heavy &amp; &lt;cage&gt;" in text
    strongest = strongest_probe(beside[0])[0]
    assert f"{strongest.frequency:.2f}" in text
    assert {p.name for p in tmp_path.iterdir()} == {"report.html"} | {
        f"runout_{n}.{k}" for n in ("lines", "pulls") for k in ("svg", "png")
    }


@pytest.mark.parametrize("verbose", [False, True])
def test_people_read_the_worst_line_first_in_80_columns(beside, verbose):
    console = Console(width=80, file=io.StringIO())
    show_runout_comparison(console, beside, verbose)
    said = console.file.getvalue().splitlines()
    assert max(map(len, said)) <= 80
    assert said[0].startswith("Runout: rms residual of all lines")
    worst = max(beside[0].lines[:SHOWN], key=lambda g: abs(g.residual))
    first = next(line for line in said if line.startswith("T20_n7200"))
    assert first.split()[-3:] == [f"{1e9 * worst.measured:.2f}", f"{1e9 * worst.computed:.2f}", f"{worst.residual:+.1f}"]
    assert cause_words(worst) in first, "in one row, whole"
    assert any(line.startswith("T20_n7200: lines") for line in said) is verbose
    assert ("--verbose shows the strongest lines of every test." in said) is not verbose


def test_a_comparison_of_both_has_both(spindle, beside, tmp_path):
    modes = operating_point(spindle, Condition(20.0)).modes[:3]
    rows = tuple(ModeRow("cold", k, mode.kind, 1.001 * mode.frequency, 0.1) for k, mode in enumerate(modes, 1))
    modal = Campaign("table", spindle.name, "mobility", spindle.points, (Test("cold", 20.0, 0.0, modes=rows),))
    write_comparison(compare(spindle, modal), spindle, tmp_path, beside, {"before": 2.0, "after": 1.5} | dict.fromkeys(
        ("fitted_before", "fitted_after", "held_out_before", "held_out_after")))  # fmt: skip
    text, titles = read(tmp_path)
    assert titles == ["Measured beside computed", "Runout, lines measured beside computed", "Runout, repeatable and nonrepeatable parts"]
    assert "All tests: 2 → 1.5 standard errors" in text
    assert "the conditions of 2 tests" in text
    assert {"pulls.png", "runout_pulls.png"} <= {p.name for p in tmp_path.iterdir()}


def test_lines_are_drawn_where_they_were_measured(beside):
    axes = lines_figure(beside).axes[0]
    own = strongest_probe(beside[0])
    (measured,) = [line for line in axes.lines if line.get_marker() == "D"]
    assert measured.get_xdata() == pytest.approx([g.frequency for g in own])
    assert max(measured.get_ydata()) == pytest.approx(1e9 * max(g.measured for g in own))
    grid = pulls_figure(beside).axes[0].images[0].get_array()
    worst = max((g.residual for g in beside[0].lines), key=abs)
    assert np.ma.max(np.abs(grid)) == pytest.approx(abs(worst))


def test_a_diagnosis_of_runout_alone_has_its_page(spindle, campaign, diagnosed, tmp_path):
    answer = runout_diagnosis_json(diagnosed, CATALOGUE, spindle) | {"campaign": campaign.title}
    assert diagnosed.verdict == "ambiguous"
    write_diagnosis(None, answer, spindle, tmp_path, diagnosed, answer)
    text, titles = read(tmp_path)
    wanted = ["verdict", "explanations", "the lines that it moves", "larger than the scene gives", "which test would decide"]
    assert titles == [f"Runout: {w}" for w in [*wanted, "what these records could have shown"]]
    assert f"A test {answer['next_test'][0]['changed']}" in text
    assert {p.name for p in tmp_path.iterdir()} == {"report.html"} | {
        f"runout_{n}.{k}" for n in ("explanations", "moved") for k in ("svg", "png")
    }


def test_bars_are_the_evidence_and_marks_the_lines(diagnosed, spindle):
    widths = [bar.get_width() for bar in explanations(diagnosed, spindle).axes[0].patches]
    assert all("bearing upper" in text.get_text() or "bearing lower" in text.get_text() for text in explanations(diagnosed, spindle).axes[0].get_yticklabels() if "(" in text.get_text() and "bearing" in text.get_text())
    assert widths == sorted((e.delta_evidence for e in diagnosed.explanations), reverse=True)[: len(widths)]
    lead = leading(diagnosed)
    assert lead.effects == ("ball_size",)
    moved = moved_lines(diagnosed, lead)
    assert [m.name for m in moved] == ["fc"]
    assert moved[0].with_effect == pytest.approx(moved[0].measured, rel=0.1)  # it was fitted to that
    assert moved[0].scene < 0.2 * moved[0].measured
    marks = {line.get_marker(): line.get_xdata()[0] for line in moved_figure(moved, lead).axes[0].lines}
    assert marks["D"] == pytest.approx(1e9 * moved[0].measured)
