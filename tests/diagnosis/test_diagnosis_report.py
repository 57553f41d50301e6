"""The diagnosis told: its page says what its JSON says, the pictures show the residuals of the fits, and every file is there."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from rich.console import Console

from diagnosis.diagnosis_plots import explanations, maps, pull_maps
from diagnosis.diagnosis_report import sections, write_diagnosis
from diagnosis.explain import explain
from diagnosis.locate import locate
from diagnosis.misfit import misfit
from diagnosis.next_test import ModePrediction, NextTest, Plan
from diagnosis.verdict import diagnosis_json, show_diagnosis
from model.machine import Condition
from sim.effects import by_name
from tests.diagnosis.test_explain import hidden, theory_of

LAG = by_name("soak_lag")


@pytest.fixture(scope="module")
def told(spindle):
    """Diagnosis, theory, misfit and answer of a campaign in which parts lag behind the chamber."""
    about = theory_of(spindle, hidden(spindle, [(LAG, LAG.typical() | {"hub_share": 0.2})], 1))
    found = explain(about, (LAG, by_name("grease_damping")), workers=1)
    places = locate(about)
    m = misfit(about, found.base, places)
    one, other, more = (
        ModePrediction(*row) for row in ((1000.0, 0.5, 0.01, 0.001), (1010.0, 0.5, 0.01, 0.001), (1500.0, 2.0, 0.02, np.nan))
    )
    separates = ("soak_lag", "<free>")
    test = NextTest(Plan(Condition(70.0)), separates, 3e22, 1, "the frequency of mode 1, +1 +- 0.05 % by <free>", ((one,), (other, more)))
    return found, about, m, diagnosis_json(found, about, places, [test], m) | {"campaign": "lag & <haste>"}


@pytest.fixture(scope="module")
def folder(told, tmp_path_factory):
    path = tmp_path_factory.mktemp("diagnosis")
    write_diagnosis(*told, path)
    return path


def cells(section):
    """Rows of text of all tables of a section."""
    rows = re.findall(r"<tr>(.*?)</tr>", section)
    return [[unescape(re.sub(r"<[^>]+>", "", c)) for c in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)] for row in rows]


def test_the_page_says_what_the_json_says(told):
    answer = told[3]
    by_title = dict(sections(*told))
    verdict = by_title["Verdict"]
    assert "identified: soak_lag" in verdict
    assert f"{answer['error']['before']:.2f}" in verdict
    assert f"{answer['error']['held_out_after']:.2f}" in verdict
    rows = cells(by_title["Explanations"])
    assert rows[1][0] == "soak_lag"
    shown = next(r for r in rows if r[4] == "hub_share")
    value, sd = (float(v) for v in shown[5].split("±"))
    fitted = answer["candidates"][0]["parameters"]["soak_lag.hub_share"]
    assert value == pytest.approx(fitted["value"], abs=fitted["sd"])
    assert sd == pytest.approx(fitted["sd"], rel=0.5)
    tolerances = {row[0]: row for row in cells(by_title["What these data pin down"])}
    for name, t in answer["tolerances"].items():
        unit = 1 if name.startswith("temperature of") else 100
        assert float(tolerances[name][4]) == pytest.approx(unit * t["prior_sd"], abs=0.006)
        assert (tolerances[name][6] == "cannot be seen") == (t["sd"] > 0.9 * t["prior_sd"])
    assert {row[0] for row in cells(by_title["What these data could have shown"])[1:]} == {"soak_lag", "grease_damping"}


def test_what_a_test_would_show(told):
    section = dict(sections(*told))["Which test would decide"]
    assert "10<sup>22</sup> or more" in section
    assert cells(section) == [["", "mode 1", "mode 2"], ["soak_lag", "1000.0 ± 0.5", ""], ["<free>", "1010.0 ± 0.5", "1500 ± 2"]]
    nothing = told[3] | {"next_test": []}
    assert "Which test would decide" not in dict(sections(*told[:3], nothing))


def test_the_pull_maps_are_the_residuals_of_the_fits(told):
    """Their squares add up to what the fits leave of frequencies and dampings; the second map is that of the best explanation."""
    found, about, _, _ = told
    (before, first), (after, second) = maps(found, about)
    assert (before, after) == ("tolerances fitted", "with soak_lag")
    poles = [i for i, f in enumerate(about.data.features) if f.what in ("frequency", "damping")]
    for grid, fit in ((first, found.base), (second, found.best.fit)):
        seen = np.nansum(grid.frequency**2) + np.nansum(grid.damping**2)
        assert seen == pytest.approx(np.sum((fit.residual / about.data.sd)[poles] ** 2))


def test_where_nothing_is_missing_there_is_one_map(told):
    found, about, _, _ = told
    assert [name for name, _ in maps(replace(found, verdict="none", effects=()), about)] == ["tolerances fitted"]
    assert maps(replace(found, verdict="unexplained", effects=()), about)[1][0] == "nearest: soak_lag"
    assert len(pull_maps(replace(found, verdict="none", effects=()), about).axes) == 3  # frequencies, dampings, colour bar


def test_bars_are_the_evidence(told):
    found = told[0]
    axes = explanations(found).axes[0]
    assert [bar.get_width() for bar in axes.patches] == [c.delta_evidence for c in found.candidates]
    paint = [bar.get_facecolor() for bar in axes.patches]
    assert paint[0] not in paint[1:]  # the one that is named


def test_files(told, folder):
    pictures = ("pulls", "explanations", "misfit_shares", "misfit_places", "misfit_drift")
    assert {p.name for p in folder.iterdir()} == {"report.html"} | {f"{n}.{kind}" for n in pictures for kind in ("svg", "png")}
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "lag &amp; &lt;haste&gt;" in page
    assert "<haste>" not in page
    assert "<free>" not in page
    assert page.count("<svg") == len(pictures)
    identities = re.findall(r'id="([^"]+)"', page)
    assert len(identities) == len(set(identities))


def test_the_terminal_tells_the_free_form_answer_first(told, capsys):
    console = Console(width=2000)
    show_diagnosis(console, told[3])
    text = capsys.readouterr().out
    assert text.index("Without any catalogue:") < text.index(told[3]["misfit"]["words"][0])
    quiet = told[3] | {"misfit": told[3]["misfit"] | {"rejected": False}}
    show_diagnosis(console, quiet)
    assert "Without any catalogue" not in capsys.readouterr().out
