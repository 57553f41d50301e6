"""The diagnosis told: its page says what its JSON says, the pictures show its numbers, and every file is there."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from rich.console import Console

from tests.report.browser import Browser, installed
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.errors import arrived, whole
from thermospindle.diagnosis.inference.evidence import left_out
from thermospindle.diagnosis.runout.verdict import diagnose_runout
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.figures.diagnosis import errors, evidence_bars, explanations, law
from thermospindle.report.page.diagnosis import sections, write_diagnosis
from thermospindle.report.page.report import write_page
from thermospindle.report.text.diagnosis.words import law_words, show_diagnosis
from thermospindle.report.text.runout_diagnosis import runout_diagnosis_json
from thermospindle.sim.campaign.simulated import runout_campaign
from thermospindle.sim.effects import CATALOGUE


def cells(section):
    """Rows of text of all tables of a section."""
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", section)
    return [[unescape(re.sub(r"<[^>]+>", "", c)) for c in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)] for row in rows]


def test_the_page_says_what_the_json_says(told):
    answer = told[1]
    by_title = dict(sections(*told))
    verdict = by_title["Verdict"]
    assert f"{answer['verdict']}: {answer['effects'][0]}" in verdict
    assert f"{answer['error']['before']:.2f}" in verdict
    assert f"{answer['error']['held_out_after']:.2f}" in verdict
    assert "soak_lag" in {row[0] for row in cells(by_title["Explanations"])}
    tolerances = {row[0]: row for row in cells(by_title["What these data pin down"])}
    for name, t in answer["tolerances"].items():
        unit = 1 if name.startswith("temperature of") else 100
        assert float(tolerances[name][4]) == pytest.approx(unit * t["prior_sd"], abs=0.006)
        assert (tolerances[name][6] == "cannot be seen") == (t["sd"] > 0.9 * t["prior_sd"])
    assert {row[0] for row in cells(by_title["What these data could have shown"])[1:]} == set(answer["detectable"])


def test_a_size_that_differs_from_test_to_test_is_told_as_a_range(told, capsys):
    """Of sizes from -0.113 to 0.033 the page told the mean alone, "0.000, at a limit", of an explanation that leads by 460."""
    found, answer = told
    [first, *rest] = answer["candidates"]
    name = first["effects"][0]
    law = [row | {"size": size, "sd": 0.008} for row, size in zip(first["law"][name], (0.011, 0.033, -0.113), strict=True)]
    tests = [row["test"] for row in law]
    for departure, spread in ((0.1, False), (0.3, True)):
        other = answer | {"candidates": [first | {"departure_from_law": {name: departure}, "law": {name: law}}, *rest]}
        row = next(row for row in cells(dict(sections(found, other))["Explanations"]) if row[0] == name)
        assert ("(test by test)" in row[4]) == spread
        assert row[5].startswith(f"from −0.1130 ± 0.0080 in {tests[2]} to 0.0330 ± 0.0080 in {tests[1]} (mean ") == spread
        show_diagnosis(Console(width=2000), other)
        assert (f"hub_share from -0.1130 +- 0.0080 in {tests[2]} to 0.0330 +- 0.0080 in {tests[1]} (mean " in capsys.readouterr().out) == spread


def test_one_value_for_all_tests_is_no_measurement_in_each(told):
    """Seven equal points with equal bars stood as evidence that a law holds."""
    found, _ = told
    [c] = found.verdict.candidates
    for departure, said in ((0.0, "one value, fitted to all tests together"), (0.3, "a level line is the law assumed")):
        evidence = replace(c.hypothesis.evidence, learned=replace(c.hypothesis.evidence.learned, departures=(departure,)))
        drawn = law(found, replace(c, hypothesis=replace(c.hypothesis, evidence=evidence)))
        assert drawn.axes[0].get_title(loc="left") == f"soak_lag: its size{' in every test' if departure else ''} ({said})"
        assert bool(drawn.axes[0].containers) == bool(departure)  # error bars of each test, or none


def test_the_law_that_departs_is_told_where_something_drifts_beside_it(told):
    """What is accepted then is no candidate of the catalogue alone, and nothing was said."""
    found, _ = told
    v = found.verdict
    accepted = replace(v.accepted, evidence=replace(v.accepted.evidence, learned=replace(v.accepted.evidence.learned, departures=(1.0,))))
    assert all(c.hypothesis is not accepted for c in v.candidates)
    [sentence] = law_words(replace(found, verdict=replace(v, accepted=accepted)))
    assert "The data do not have the law that soak_lag assumes" in sentence


def test_what_a_test_would_show(told):
    found, answer = told
    section = dict(sections(*told))["Which test would decide"]
    assert "more than a million" in section
    assert [row[1:] for row in cells(section)] == [["mode 1"], ["1000.0 ± 0.5"], ["1010.0 ± 0.5"]]
    assert cells(section)[2][0] == "<free>"
    assert "Which test would decide" not in dict(sections(found, answer | {"next_test": []}))


def test_bars_are_the_evidence(told):
    found, _ = told
    axes = explanations(found).axes[0]
    shown = (*found.verdict.candidates[:10], *found.verdict.free[:4])
    assert [bar.get_width() for bar in axes.patches] == sorted((c.delta_evidence for c in shown), reverse=True)[: len(axes.patches)]


def test_a_fit_that_has_not_arrived_does_not_lead(told):
    """One with a "+150103070226783" in ln evidence was drawn as the leader, beside which all else was a point at zero."""
    found, _ = told
    [best, *_] = found.verdict.candidates
    assert arrived(best.hypothesis)
    broken = replace(best.hypothesis, evidence=replace(best.hypothesis.evidence, ln=1.5e14))
    stalled = replace(best.hypothesis, fit=replace(best.hypothesis.fit, owed=2.0 * best.hypothesis.fit.count))
    others = [replace(best, hypothesis=h, names=(name,), delta_evidence=d) for h, name, d in ((broken, "broken", 1.5e14), (stalled, "stalled", 900.0))]
    assert not any(arrived(c.hypothesis) for c in others)
    verdict = replace(found.verdict, candidates=(others[0], replace(best, delta_evidence=500.0), others[1]))
    axes = explanations(replace(found, verdict=verdict)).axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names.index("soak_lag") == 0
    assert names.index("broken") > names.index("soak_lag")
    assert 500 < axes.get_xlim()[1] < 1000
    hatched = {name for name, bar in zip(names, axes.patches, strict=True) if bar.get_hatch()}
    assert {"broken", "stalled"} <= hatched
    words = [text.get_text() for text in axes.texts]
    assert words[names.index("broken")] == "+1.5e+14, beyond the axis, the fit has not arrived"


def test_bars_that_are_cut_say_so():
    """-1.7e6 and -1.1e7 were cut at -20000 and drawn of one length."""
    axes = evidence_bars(["a", "b", "c"], np.array([116651.0, -15000.0, -1695833.0]), ["#111111"] * 3).axes[0]
    assert [text.get_text() for text in axes.texts] == ["+116651", "−15000", "−1695833, beyond the axis"]
    arrows = [line for line in axes.lines if line.get_marker() == "<"]
    assert [line.get_ydata()[0] for line in arrows] == [2]


def test_errors_are_those_of_the_answer(told):
    """The page of the tutorial had two equal bars a test, "before 1.00, after 1.00", for an effect
    that takes `compare` from 98.6 to 0.7: fitted tolerances hide it."""
    found, answer = told
    model, error = found.search.model, answer["error"]
    fitted, unseen = errors(found).axes
    drawn, before, after, _ = (np.asarray(line.get_ydata(), float) for line in fitted.lines)
    held_out, held_out_after, _ = (np.asarray(line.get_ydata(), float) for line in unseen.lines)
    for value, name in zip((drawn, before, after, held_out), ("drawn", "before", "after", "held_out_before"), strict=True):
        assert whole(value, model) == pytest.approx(error[name], rel=1e-6), name
    accepted = found.verdict.accepted  # the answer's own is of the diagnosis that this one is made from
    assert whole(held_out_after, model) == pytest.approx(left_out(model, accepted.fit, accepted.evidence, conditions_of(model.spindle, model.tests))[0])
    residuals = [model.residual(t, np.zeros(len(model.parameters)), ()) for t in range(len(model.tests))]
    assert drawn == pytest.approx([np.sqrt(np.mean(r**2)) for r in residuals])
    assert error["drawn"] > 20 * error["before"]  # tolerances as small as they come
    rows = cells(dict(sections(*told))["Verdict"])
    assert rows[0] == ["", "as drawn", "tolerances and constant errors fitted", "with what is named"]
    assert rows[1][1:] == [f"{error[k]:.2f}" for k in ("drawn", "before", "after")]
    assert rows[2][2:] == [f"{error[k]:.2f}" for k in ("held_out_before", "held_out_after")]


def test_the_law_is_that_of_the_data(told):
    found, answer = told
    best, learned = found.verdict.candidates[0], found.verdict.candidates[0].hypothesis.evidence.learned
    best = replace(best, hypothesis=replace(best.hypothesis, evidence=replace(best.hypothesis.evidence, learned=replace(learned, departures=(0.3,)))))  # of sizes that may differ
    drawn = np.concatenate([line.get_ydata() for line in law(found, best).axes[0].lines if line.get_label() == "_nolegend_" or line.get_marker() in "os^"])
    for row in answer["candidates"][0]["law"]["soak_lag"]:
        assert np.min(np.abs(drawn - row["size"])) < 1e-12


def test_what_is_unknown_has_a_row_beside_the_explanations_and_no_effect_too(told):
    """By probability: something unknown with all of it stood nowhere in a table whose rows were all 0.000."""
    found, answer = told
    for none, unknown, order in ((0.0, 1.0, ["something unknown", "soak_lag", "no effect"]), (0.07, 0.03, ["soak_lag", "no effect", "something unknown"])):
        [first, *_] = answer["candidates"]
        told = answer | {"probability": {"none": none, "unknown": unknown}, "candidates": [first | {"probability": 1 - none - unknown}]}
        rows = [row for row in cells(dict(sections(found, told))["Explanations"])[1:] if row[0]]
        assert [row[0] for row in rows] == order
        assert {row[0]: row[2] for row in rows} == {"no effect": f"{none:.3f}", "something unknown": f"{unknown:.3f}", "soak_lag": f"{1 - none - unknown:.3f}"}


@pytest.mark.skipif(installed() is None, reason="no Chromium or Chrome is installed on this machine")
def test_the_table_of_explanations_is_seen_whole_on_a_wide_screen(told, tmp_path):
    """Of a pair whose sizes differ from test to test, in tests with long names, units were beyond the edge."""
    found, answer = told
    [first, *_] = answer["candidates"]
    effects = ["bond_softening", "constant_force_preload"]
    size = {"value": 26.2, "sd": 1.3, "unit": "nm/N"}
    law = [{"test": f"spindle_20C_{speed}rpm", "temperature_C": 20.0, "speed_rpm": speed, "size": speed / 250, "sd": 9.8} for speed in (0.0, 7200.0)]
    pair = first | {"effects": effects, "parameters": {f"{name}.hot_compliance": size for name in effects}, "law": dict.fromkeys(effects, law)}
    told = answer | {"candidates": [pair | {"departure_from_law": dict.fromkeys(effects, 1.0), "probability": 0.5}]}
    write_page(tmp_path, found.spindle, 2, "long", [("Explanations", dict(sections(found, told))["Explanations"])], "Diagnosis")
    browser = Browser(tmp_path / "profile")
    try:
        browser.open((tmp_path / "report.html").as_uri())
        browser.wait("document.querySelector('.scroll .spread') !== null")
        width, seen = browser.run("(e => [e.scrollWidth, e.clientWidth])(document.querySelector('.scroll'))")
    finally:
        browser.close()
    assert width <= seen


def test_files(told, tmp_path):
    write_diagnosis(*told, told[0].spindle, tmp_path, name="campA")
    pictures = {f.stem for f in tmp_path.iterdir()} - {"report"}
    assert {"errors", "explanations", "law"} <= pictures
    assert {p.name for p in tmp_path.iterdir()} == {"report.html"} | {f"{n}.{kind}" for n in pictures for kind in ("svg", "png")}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "lag &amp; &lt;haste&gt;" in page
    assert f"<title>Diagnosis: campA beside {told[0].spindle.name}: " in page
    assert "<haste>" not in page
    assert "<free>" not in page
    assert page.count("<svg") == len(pictures)
    identities = re.findall(r'id="([^"]+)"', page)
    assert len(identities) == len(set(identities))


def test_runout_stands_on_the_same_page(told, spindle, tmp_path):
    conditions = [Condition(20.0, 5400 * RPM), Condition(20.0, 7200 * RPM)]
    turning = diagnose_runout(spindle, runout_campaign(spindle, conditions, 0.3, seed=3, path="linear"))
    write_diagnosis(*told, told[0].spindle, tmp_path, turning, runout_diagnosis_json(turning, CATALOGUE, told[0].spindle))
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.index("<h2>Verdict") < page.index("<h2>Runout: verdict")
    assert "none" in page[page.index("<h2>Runout: verdict") :]
    identities = re.findall(r'id="([^"]+)"', page)
    assert len(identities) == len(set(identities))
    assert {"explanations.svg", "runout_explanations.svg"} <= {p.name for p in tmp_path.iterdir()}
