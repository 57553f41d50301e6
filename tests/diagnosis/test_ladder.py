"""The ladder on campaigns whose truth is known."""

import json
import re
from dataclasses import replace
from html import unescape
from types import SimpleNamespace

import numpy as np
import pytest
from rerun.chunk import RrdReader

from tests.conftest import ROOT, SCENE
from tests.diagnosis.mode_tables import SD, tables
from thermospindle.cli import main
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.ladder.forms import FORMS
from thermospindle.diagnosis.ladder.ladder import CLEAR, DISCREPANCY, TOLERANCES, ladder, named_by
from thermospindle.diagnosis.ladder.step import fitted
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.prediction.next_test import ModePrediction, NextTest
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.figures.ladder import figure, residual_map
from thermospindle.report.log.ladder_content import response, shown
from thermospindle.report.log.read import read_log
from thermospindle.report.page.ladder import section, write_ladder
from thermospindle.report.text.ladder import sentences
from thermospindle.report.text.ladder_table import COLUMNS, LEGEND, ladder_json
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point

VIRTUAL = SCENE / "virtual" / "soak_20_60"


@pytest.fixture(scope="module")
def lagging(spindle):
    """Tables of a hub that follows the chamber by 80 %, climbed with the right effect and then a wrong one."""
    soak = by_name("soak_lag")
    campaign = tables(spindle, [(soak, soak.neutral() | {"hub_share": 0.2})])
    seen = []
    found = ladder(spindle, campaign, [soak, by_name("constant_force_preload")], seen=lambda s: seen.append(s.name))
    assert seen == [r.name for r in found.steps]
    return found


def test_the_form_with_axial_equilibrium_leads_in_its_own_data(lagging):
    """With all tolerances free, though an effect is hidden too."""
    assert [form[0] for form in lagging.forms] == [form.name for form in FORMS]
    assert lagging.forms[2][3] > max(form[3] for form in lagging.forms[:2]) + CLEAR


def test_the_error_falls_with_the_right_effect(lagging):
    below, right = lagging.step(DISCREPANCY), lagging.step("+ soak_lag")
    assert right.effects == ("soak_lag",)
    assert right.evidence > below.evidence + CLEAR
    assert right.error < 1.2
    assert right.held_out < below.held_out / 3
    value, sd = right.values["soak_lag"]["hub_share"]
    assert value == pytest.approx(0.2, abs=max(5 * sd, 0.02))
    assert abs(right.stretch) < 1.0


def test_the_error_does_not_fall_with_a_wrong_effect(lagging):
    right, wrong = lagging.step("+ soak_lag"), lagging.step("+ constant_force_preload")
    assert wrong.above == "+ soak_lag"
    assert wrong.effects == ("soak_lag", "constant_force_preload")
    assert wrong.evidence < right.evidence + CLEAR / 2
    assert wrong.error > 0.7 * right.error
    assert any("constant_force_preload is not" in s for s in sentences(lagging))


def test_steps_as_drawn_are_what_mujoco_says(spindle, lagging):
    """Errors in Hz against the modes of MuJoCo's linearised models, which the ladder does not use."""
    for name, form in zip(("fixed stiffness", "axial equilibrium"), FORMS[::2], strict=True):
        off, shifts, relative = [], [], []
        for test in lagging.campaign.tests:
            own = [
                m.frequency for m in operating_point(spindle, Condition(test.temperature), form.applied).modes if 400 < m.frequency < 6000
            ]
            off.append(np.array(own) - [r.frequency for r in test.modes])
            relative.append(off[-1] / [r.frequency for r in test.modes])
            shifts.append(off[-1] - off[0])
        step = lagging.step(name)
        assert step.rms_Hz == pytest.approx(np.sqrt(np.mean(np.square(off))), rel=1e-5)
        assert step.rms_percent == pytest.approx(100 * np.sqrt(np.mean(np.square(relative))), rel=1e-5)
        assert step.rms_shift_Hz == pytest.approx(np.sqrt(np.mean(np.square(shifts[1:]))), rel=1e-4)
        assert step.held_out == step.error
        assert step.evidence == pytest.approx(-0.5 * step.error**2 * len(lagging.measured.test))


def test_residuals_are_errors_over_standard_errors(lagging):
    step = lagging.steps[0]
    shown = residual_map(lagging, step)
    assert shown.damping is None
    assert shown.frequency.shape == (8, 2)
    own = lagging.measured.test == 0
    assert shown.frequency[:, 0] == pytest.approx(((step.frequency - lagging.measured.frequency) / SD)[own], rel=1e-9)
    assert np.sqrt(np.mean(shown.frequency**2)) == pytest.approx(step.error, rel=0.02)  # of logarithms there


def test_errors_of_fitted_steps_are_rms_too(lagging):
    """Of frequencies alone, in standard errors; logarithms there. Of squares that are nine a number, three."""
    m = lagging.measured
    for step in (lagging.step(TOLERANCES), lagging.step(DISCREPANCY), lagging.top):
        assert step.error == pytest.approx(np.sqrt(np.mean(((step.frequency - m.frequency) / SD) ** 2)), rel=0.02)
    own = lagging.step(TOLERANCES).fitted
    assert fitted(replace(own, fit=replace(own.fit, chi2=9.0 * len(m.test))), m, "far", (0.0, 0.0), "").error == pytest.approx(3.0)


def test_dampings_whose_errors_nobody_told_are_shown_in_per_cent(lagging):
    """They stood in the picture as errors of 0.0, as if the model had met every one of them."""
    step, m = lagging.top, lagging.measured
    told = replace(m, damping=step.damping / 1.1, damping_sd=np.full(len(m.test), np.inf))
    shown = residual_map(replace(lagging, measured=told), step)
    assert shown.damping is None
    assert shown.damping_percent == pytest.approx(np.full((8, 2), 10.0))
    with_errors = replace(told, damping_sd=np.where(m.test == 0, 0.05 * told.damping, np.inf))
    shown = residual_map(replace(lagging, measured=with_errors), step)
    assert shown.damping_percent is None
    assert shown.damping[:, 0] == pytest.approx(2.0)
    assert np.isnan(shown.damping[:, 1]).all()
    drawn = figure(replace(lagging, measured=told))
    [axes] = [a for a in drawn.get_axes() if a.get_title(loc="left") == f"{lagging.top.name}: damping ratios, % (no errors told)"]
    assert {text.get_text() for text in axes.texts} == {"+10"}


def test_data_decide_no_more_than_there_are_of_them(lagging):
    assert 1 < lagging.top.fitted.determined() <= 16


def candidate(evidence, *names):
    mechanisms = tuple(variants(by_name(n))[0] for n in names)
    return Candidate(SimpleNamespace(mechanisms=mechanisms), names, False, evidence, 0.5)


VERDICTS = [
    ("none", (), [candidate(3, "soak_lag")], []),
    ("identified", ("soak_lag",), [candidate(90, "soak_lag"), candidate(20, "preload_loss")], [("+ soak_lag", DISCREPANCY)]),
    (
        "two effects",
        ("soak_lag", "added_disk"),
        [candidate(90, "soak_lag", "added_disk"), candidate(50, "added_disk"), candidate(20, "soak_lag")],
        [("+ added_disk", DISCREPANCY), ("+ soak_lag", "+ added_disk")],
    ),
    (
        "ambiguous",
        ("soak_lag", "preload_loss"),
        [candidate(90, "soak_lag"), candidate(88, "preload_loss"), candidate(20, "added_disk")],
        [("or soak_lag", DISCREPANCY), ("or preload_loss", DISCREPANCY)],
    ),
    (
        "ambiguous",
        ("soak_lag", "preload_loss", "added_disk"),
        [candidate(90, "soak_lag"), candidate(88, "preload_loss", "added_disk"), candidate(80, "added_disk")],
        [("or soak_lag", DISCREPANCY), ("or preload_loss + added_disk", DISCREPANCY)],
    ),
    (
        "unexplained",
        (),
        [candidate(9, "soak_lag"), candidate(1, "added_disk"), candidate(0, "preload_loss"), candidate(-1, "plate_prestress")],
        [("nearest: soak_lag", DISCREPANCY), ("nearest: added_disk", DISCREPANCY), ("nearest: preload_loss", DISCREPANCY)],
    ),
]


@pytest.mark.parametrize(("word", "effects", "candidates", "expected"), VERDICTS, ids=["none", "one", "two", "or", "or two", "unexplained"])
def test_steps_that_a_diagnosis_asks_for(word, effects, candidates, expected):
    steps = named_by(SimpleNamespace(word=word, effects=effects, candidates=tuple(candidates)))
    assert [(name, on) for name, _, on in steps] == expected
    assert all(name.split(" ", 1)[1] == " + ".join(e.name for e in own) for name, own, _ in steps)


def test_an_effect_named_beside_something_that_drifts_is_a_step():
    """No candidate is of that effect alone: the ladder once ended in a traceback."""
    beside = replace(candidate(90, "soak_lag"), names=("soak_lag", "mount stiffness"), free=True)
    found = SimpleNamespace(word="identified", effects=("soak_lag",), candidates=(candidate(3, "added_disk"),), free=(beside,))
    assert [(name, [e.name for e in own], on) for name, own, on in named_by(found)] == [("+ soak_lag", ["soak_lag"], DISCREPANCY)]


def named(lagging, word, tests=()):
    """The climbed ladder as if a diagnosis had chosen its effects."""
    return replace(lagging, diagnosis=SimpleNamespace(verdict=SimpleNamespace(word=word, reason="Because.")), tests=tests)


@pytest.mark.parametrize(
    ("word", "top"),
    [("none", DISCREPANCY), ("unexplained", DISCREPANCY), ("ambiguous", "+ soak_lag"), ("two effects", "+ constant_force_preload")],
)
def test_where_the_ladder_leads(lagging, word, top):
    """With a verdict that names no effect to the fitted tolerances; among alternatives to the likeliest."""
    if word == "ambiguous":
        lagging = replace(lagging, steps=tuple(r if r.name != "+ soak_lag" else replace(r, evidence=1e9) for r in lagging.steps))
    assert named(lagging, word).top.name == top


def test_the_verdict_and_the_next_test_are_told(lagging):
    """The mode told is the one in which the two explanations differ most in standard errors, not in hertz."""
    one = (ModePrediction(1000.0, 0.5, 0.01), ModePrediction(2000.0, 30.0, 0.01))
    two = (ModePrediction(1010.0, 0.5, 0.01), ModePrediction(2060.0, 30.0, 0.01))
    test = NextTest(Condition(70.0, 7200 * RPM), ("soak_lag", "preload_loss"), 1e6, 1, "", (one, two))
    told = sentences(named(lagging, "ambiguous", (test,)))
    assert "Diagnosis: ambiguous. Because." in told
    assert told[-1] == (
        "A test at 70 C, 7200 rpm would separate soak_lag from preload_loss, at odds of more than 1000 to 1 if either is right: a mode would lie at "
        "1000.00 +- 0.50 Hz or at 1010.00 +- 0.50 Hz."
    )
    assert ladder_json(named(lagging, "ambiguous", (test,)))["verdict"] == "ambiguous"
    assert ladder_json(lagging)["verdict"] is None


# ---------------------------------------------------------------- telling it


@pytest.fixture(scope="module")
def virtual(spindle):
    """The scene's small virtual campaign (MuJoCo in the time domain, hammer tests), without an effect in it."""
    return ladder(spindle, read_campaign(VIRTUAL), [by_name("ring_growth")])


@pytest.mark.slow
def test_computed_responses_lie_on_those_of_the_time_domain(virtual):
    step = virtual.step("axial equilibrium")
    for t, o in enumerate(virtual.measured.observations):
        measured, computed = o.test.frf.value, response(step, t)
        band = (o.test.frf.frequency > 600) & (o.test.frf.frequency < 2800)
        off = np.abs(computed - measured)[:, :, band].mean(axis=2) / np.abs(measured)[:, :, band].mean(axis=2)
        assert np.max(off[[0, 5], [0, 1]]) < 0.02  # driving points
        fixed = response(virtual.steps[0], t)
        if o.condition.temperature > 50:
            assert np.mean(np.abs(fixed - measured)[0, 0, band]) > 10 * np.mean(np.abs(computed - measured)[0, 0, band])


@pytest.mark.slow
def test_log_moves_on_the_timeline_step(virtual, tmp_path):
    write_ladder(virtual, tmp_path)
    reader = RrdReader(tmp_path / "ladder.rrd")
    assert reader.blueprints()
    rows, series = {}, {}
    for c in reader.stream(store=reader.recordings()[0]):
        for timeline in c.timeline_names:
            rows[timeline, c.entity_path] = rows.get((timeline, c.entity_path), 0) + c.to_record_batch().num_rows
        batch = c.to_record_batch()
        if c.entity_path.startswith("/frf") and "Scalars:scalars" in batch.schema.names:
            series[c.entity_path] = batch.column("Scalars:scalars").flatten().to_numpy()
    n = len(virtual.steps)
    for entity in (
        "/charts/residuals",
        "/charts/responses",
        "/charts/error",
        "/step",
        r"/error/all\ data",
    ):
        assert rows["step", entity] == n
    contents = read_log(tmp_path / "ladder.rrd")
    assert contents.scene == "hdd_2003"
    peaks = [p.frequency for p in contents.peaks if (p.source, p.test) == ("measured", "T20_n0")]
    assert peaks == pytest.approx(virtual.measured.observations[0].frequency, rel=1e-12)
    level = shown(virtual).steps[0].levels[0]
    measured = series[r"/frf/T20_n0/H\(1\,1\)/measured"]
    assert np.array_equal(measured, level.measured)
    assert sum(k.startswith(r"/frf/T20_n0/H\(1\,1\)/") for k in series) == n + 1


def numbers(text):
    """Words and numbers of a sentence, however its signs are set."""
    return re.findall(r"\w+", text)


def test_picture_and_report_section_name_every_step(lagging):
    title, html = section(lagging)
    assert title.startswith("The ladder")
    for r in lagging.steps:
        assert f"<td class=left>{r.name}</td>" in html
    words = re.findall(r"<p>(.*?)</p>", html)
    for s in sentences(lagging):
        assert numbers(s) == numbers(unescape(words.pop(0)))
    assert words == []
    assert html.count("<svg") == 1
    assert "as drawn" in html


def test_numbers_of_the_picture_stand_on_a_ground_of_their_own(lagging):
    """1.52 and 1.38 were struck through by the line of the data's errors."""
    axes = figure(lagging).get_axes()[0]
    numbers = [t for t in axes.texts if t.get_text()]
    assert len(numbers) >= len(lagging.steps)
    assert all(t.get_bbox_patch().get_facecolor()[:3] == (1.0, 1.0, 1.0) and t.get_zorder() > max(line.get_zorder() for line in axes.lines) for t in numbers)


def test_figure_table_and_page_say_left_out_and_tolerances(lagging):
    """Held out here and left out there, build here and tolerances there were one thing."""
    assert COLUMNS[2:6:3] == ("left out\ns.e.", "tolerances\ns.d.")
    said = " ".join([LEGEND, section(lagging)[1], *sentences(lagging)])
    assert "held out" not in said
    assert "build" not in LEGEND
    page = (ROOT / "docs" / "site" / "ladder.md").read_text()
    assert "left out, s.e. | tolerances, s.d." in page
    assert "held out" not in page


@pytest.mark.slow
def test_json_of_the_command(capsys, tmp_path):
    out = tmp_path / "climbed"
    campaign = str(SCENE / "measured" / "jang_2003")
    assert main(["ladder", str(SCENE), campaign, "--effects", "expansion_mismatch", "--json", "--out", str(out)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [r["name"] for r in answer["rungs"]] == [
        "fixed stiffness",
        "radial expansion only",
        "axial equilibrium",
        TOLERANCES,
        DISCREPANCY,
        "+ expansion_mismatch",
    ]
    assert answer["rungs"][-1]["effects"] == ["expansion_mismatch"]
    assert set(answer["rungs"][0]) >= {"name", "effects", "error", "held_out", "rms_Hz", "rms_percent", "evidence"}
    assert answer["rungs"][-1]["parameters"]["expansion_mismatch.hub_expansion"]["unit"] == "1"
    assert {f.name for f in out.iterdir()} >= {"ladder.json", "ladder.png", "ladder.svg", "ladder.rrd", "report.html"}
    assert json.loads((out / "ladder.json").read_text()) == answer


def test_frequencies_that_get_worse_are_said_to(lagging):
    """Granting a constant error took the error of a beam's FRFs from 89 to 51, and that of its
    frequencies from 1.72 to 18.73 Hz, without a word."""
    r = lagging.step(DISCREPANCY)
    learned = replace(r.fitted.learned, sizes={**r.fitted.learned.sizes, kinds_of.STIFFNESS: 1e-3})
    worse = replace(r, rms_Hz=18.73, error=0.5 * lagging.step(TOLERANCES).error, fitted=replace(r.fitted, learned=learned))
    steps = tuple(worse if s is r else s for s in lagging.steps)
    granted = replace(lagging, steps=steps)
    was = lagging.step(TOLERANCES).rms_Hz
    [said] = [s for s in sentences(granted) if "further off" in s]
    assert f"natural frequencies are further off, 18.73 instead of {was:.2f} Hz rms" in said
    assert not any("further off" in s for s in sentences(lagging))


def test_unknown_effect_is_refused_by_name(capsys):
    assert main(["ladder", str(SCENE), str(SCENE / "measured" / "jang_2003"), "--effects", "rust"]) == 2
    assert "rust" in capsys.readouterr().err


def test_same_answer_without_out_folder(lagging):
    assert json.loads(json.dumps(ladder_json(lagging)))["top"] == "+ constant_force_preload"
