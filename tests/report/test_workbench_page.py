"""The page of the workbench without a browser: it does what a user asks, undoes it, and takes explanations in."""

import json
import re
import time
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from bokeh.document import Document

from tests.conftest import DATA, SCENE
from tests.report.workbench_session import click, finish, turn
from thermospindle.diagnosis.add import scene_with
from thermospindle.model.errors import BadInput
from thermospindle.report.workbench import bench as benches
from thermospindle.report.workbench import explanations as told
from thermospindle.report.workbench import page as pages
from thermospindle.report.workbench import state
from thermospindle.report.workbench.page import Page
from thermospindle.report.workbench.plots import _columns
from thermospindle.report.workbench.state import Setting
from thermospindle.sim.effects import by_name

# ---------------------------------------------------------------- the page


def test_the_page_begins_with_the_scene_as_it_is(page, bench):
    assert page.undo.disabled
    assert page.redo.disabled
    assert page.found == benches.errors(bench, Setting())
    assert len(page.frf.measured.data["f"]) == len(bench.shown[0].test.frf.frequency)
    assert list(page.map.figure.x_range.factors) == [("fitted", "T20_n0"), ("fitted", "T60_n0")]
    assert "agrees" in page.status.text


def test_noise_about_180_degrees_draws_no_strokes():
    """Three degrees of it about a sign that is turned round; the values are what they were."""
    noise = 0.05 * np.random.default_rng(2).standard_normal(200)
    data = _columns(np.arange(200.0), np.exp(1j * (np.pi + noise)))
    assert np.abs(np.diff(data["phase"])).max() < 20
    np.testing.assert_allclose(np.exp(1j * np.radians(data["phase"])), np.exp(1j * (np.pi + noise)))
    assert _columns(np.arange(2.0), np.array([1j, -1j]))["phase"].tolist() == [90.0, -90.0]


def test_adding_dragging_undoing(page):
    page.controls.add.value = "preload_loss"
    assert page.session.now.effects["preload_loss"]["loss"] == 0.15
    slider = page.controls.sliders["preload_loss.loss"]
    before, at_start = page.frf.computed.data["size"], page.found.fitted
    page.costs["all"].append(0.0)  # on a busy machine the map waits for the end of a drag
    for value in (0.2, 0.25, 0.3):
        slider.value = value
    assert page.found.fitted == at_start, "nothing is computed before the loop's next turn"
    turn(page)
    assert page.found.fitted > at_start
    assert not np.array_equal(page.frf.computed.data["size"], before)
    assert page.session.now.effects["preload_loss"]["loss"] == 0.15, "a drag is no step yet"
    slider.trigger("value_throttled", 0.15, 0.3)
    assert page.session.now.effects["preload_loss"]["loss"] == 0.3
    assert len(page.session.past) == 2
    page.undo._trigger_event(click(page.undo))
    assert slider.value == 0.15
    page.undo._trigger_event(click(page.undo))
    assert page.controls.effects.children == []
    page.redo._trigger_event(click(page.redo))
    assert page.controls.sliders["preload_loss.loss"].value == 0.15


def test_a_value_can_be_typed(page):
    page.controls.add.value = "preload_loss"
    number, slider = page.controls.numbers["preload_loss.loss"][0], page.controls.sliders["preload_loss.loss"]
    number.value = 0.123456
    assert page.session.now.effects["preload_loss"]["loss"] == slider.value == 0.123456
    number.value = 5.0
    assert page.session.now.effects["preload_loss"]["loss"] == 0.8, "no further than the limit"
    mass = page.controls.numbers["hub mass"][0]
    mass.value = 0.5
    assert page.session.now.deviations == {"hub mass": 0.005}
    page.undo._trigger_event(click(page.undo))
    assert mass.value == 0.0
    page.become(state.do(page.session, state.set_deviation(page.session.now, "hub mass", 0.00123456789)))
    assert page.session.now.deviations["hub mass"] == 0.00123456789, "showing a rounded number changes nothing"
    assert mass.value == 0.12346


def test_a_slider_moved_by_keys_is_one_step_to_undo(page, monkeypatch):
    page.controls.add.value = "preload_loss"
    slider = page.controls.sliders["preload_loss.loss"]
    for value in (0.16, 0.17, 0.18):
        slider.trigger("value_throttled", slider.value, value)
    assert len(page.session.past) == 2
    monkeypatch.setattr(pages, "AGAIN", 0.0)
    slider.trigger("value_throttled", slider.value, 0.19)
    assert len(page.session.past) == 3
    page.undo._trigger_event(click(page.undo))
    page.undo._trigger_event(click(page.undo))
    assert page.session.now.effects["preload_loss"]["loss"] == 0.15


def test_slow_machines_compute_less_while_dragging(page, monkeypatch):
    page.controls.add.value = "preload_loss"
    slider, computed = page.controls.sliders["preload_loss.loss"], []
    monkeypatch.setattr(pages, "errors", lambda b, s: computed.append("all") or page.found)
    monkeypatch.setattr(pages, "curves", lambda b, s, *which: computed.append("shown") or benches.curves(b, s, *which))
    for cost, expected, says in (
        ({"all": 0.1, "shown": 0.01}, ["all", "shown"], "all tests"),
        ({"all": 0.3, "shown": 0.01}, ["shown"], "the shown test"),
        ({"all": 0.9, "shown": 0.3}, [], "nothing until you let go"),
    ):
        page.costs = {what: deque([1.0, seconds]) for what, seconds in cost.items()}
        page.show_status(page.session.now)
        assert f"this computes {says}" in page.status.text
        computed.clear()
        slider.value += 0.01
        turn(page)
        assert computed == expected
    slider.trigger("value_throttled", 0.15, slider.value)
    assert computed == ["all", "shown"], "let go, everything is computed"


def test_left_out_tests_stand_apart(page):
    page.left_out.active = [0]
    assert list(page.map.figure.x_range.factors) == [("fitted", "T60_n0"), ("left out", "T20_n0")]
    hatched = {x[1]: h for x, h in zip(page.map.source.data["x"], page.map.source.data["hatch"], strict=True)}
    assert hatched == {"T20_n0": "right_diagonal_line", "T60_n0": "blank"}
    assert "1 left-out test" in page.status.text


def test_the_map_is_there_as_a_table_of_the_same_numbers(page):
    told_ = {c.frequency for c in page.found.cells if c.test == "T60_n0"}
    assert page.numbers.text.count("<th scope=row>") == len(told_)
    assert all(f"<td>{v:+.2f}</td>".replace("-", "−") in page.numbers.text for v in told_)
    page.quantity.active = 1
    damping = next(c.damping for c in page.found.cells)
    assert f"<td>{damping:+.2f}</td>".replace("-", "−") in page.numbers.text
    assert f"{damping:+.1f}".replace("-", "−") in page.map.source.data["text"]


def test_tests_that_a_scene_was_not_fitted_to_are_left_out_at_first(bench, tmp_path):
    s = state.leave_out(state.set_deviation(Setting(), "hub mass", 0.001), ["T60_n0"])
    tests = [x.id for x in bench.shown if x.id not in s.left_out]
    (tmp_path / "scene").mkdir()
    scene_with(SCENE, {}, s.deviations, tests, "a test", tmp_path / "scene", tmp_path / "scene")
    again = benches.open_bench(tmp_path / "scene", SCENE / "measured" / "jang_2003")
    assert again.left_out == ("T20", "T60")
    assert Page(again, Document(), tmp_path).session.now.left_out == {"T20", "T60"}
    with pytest.raises(BadInput, match="--held-out T99: is no test"):
        benches.open_bench(SCENE, SCENE / "measured" / "jang_2003", left_out=["T99"])
    with pytest.raises(BadInput, match="without a campaign there is no test"):
        benches.open_bench(SCENE, left_out=["T20"])


def test_where_no_spindle_can_be_built_the_page_says_so(page, monkeypatch):
    page.controls.add.value = "preload_loss"
    shown = page.frf.computed.data

    def refuses(bench, s):
        raise BadInput("preload: no equilibrium")

    monkeypatch.setattr(pages, "errors", refuses)
    page.controls.sliders["preload_loss.loss"].trigger("value_throttled", 0.15, 0.3)
    assert "No spindle can be built there: preload: no equilibrium" in page.message.text
    assert page.frf.computed.data is shown


def test_fitting_keeping_and_taking_up(page):
    page.keep._trigger_event(click(page.keep))
    page.controls.add.value = "preload_loss"
    page.keep._trigger_event(click(page.keep))
    page.fit._trigger_event(click(page.fit))
    finish(page)
    assert "Fitted in" in page.message.text
    assert abs(page.session.now.effects["preload_loss"]["loss"]) < 0.02
    page.keep._trigger_event(click(page.keep))
    errors = [r.fitted for r in page.session.ladder]
    assert errors[2] < errors[1]
    assert page.ladder.text.count("<tr>") == 4
    page.step.value = "1"
    page.take_up._trigger_event(click(page.take_up))
    assert page.session.now.effects["preload_loss"]["loss"] == 0.15


def test_work_can_be_stopped(page):
    def long(progress):
        for k in range(10**6):
            time.sleep(0.001)
            progress(str(k))

    page.work.begin("Waiting", long, lambda found: None)
    assert page.halt.visible
    page.work.begin("Something else", long, lambda found: None)
    assert "still at work" in page.message.text
    page.work.stop.set()
    finish(page)
    assert "Waiting was stopped." in page.message.text
    assert not page.halt.visible


def test_work_that_goes_wrong_does_not_go_on_for_ever(page, capsys):
    def wrong(progress):
        raise AttributeError("a mistake of ours")

    page.work.begin("Work", wrong, lambda found: None)
    finish(page)
    assert "Work failed: AttributeError: a mistake of ours" in page.message.text
    assert "Traceback" in capsys.readouterr().err


# ---------------------------------------------------------------- explanations

ANSWER = {
    "verdict": "identified", "reason": "one <effect> explains it", "effects": ["bond_softening"], "probability": {"none": 0.0, "unknown": 0.1},
    "candidates": [
        {"effects": ["bond_softening"], "probability": 0.8, "delta_evidence": 300.0, "parameters": {"bond_softening.hot_compliance": {"value": 11.9}}},
        {"effects": ["preload_loss"], "probability": 0.1, "delta_evidence": 12.0, "parameters": {"preload_loss.loss": {"value": 0.2}}},
    ],
    "tolerances": {"hub mass": {"value": 0.002}, "temperature of T20_n0": {"value": 0.1}},
}  # fmt: skip


def test_an_explanation_is_taken_in_with_its_tolerances(bench, tmp_path):
    (tmp_path / "d.json").write_text(json.dumps(ANSWER))
    known = told.read_explanations(tmp_path / "d.json", bench)
    page = Page(bench, Document(), tmp_path, known)
    assert "one &lt;effect&gt; explains it" in page.reasons.text
    assert "80.0%" in page.reasons.text
    assert known.of_scene
    assert not told.explanations(ANSWER | {"scene_hash": "0" * 12}, bench, "x").of_scene
    page.take._trigger_event(click(page.take))
    assert page.session.now.effects["bond_softening"] == by_name("bond_softening").typical() | {"hot_compliance": 11.9}
    assert page.session.now.deviations == {"hub mass": 0.002}
    page.explanation.value = "1"
    page.take._trigger_event(click(page.take))
    assert page.session.now.deviations == {}, "tolerances go with the effects they were fitted beside"
    assert set(page.session.now.effects) == {"preload_loss"}


@pytest.mark.parametrize("text", ["[]", "{", '{"candidates": []}'])
def test_another_file_is_refused(bench, tmp_path, text):
    (tmp_path / "d.json").write_text(text)
    with pytest.raises(BadInput, match=r"--diagnosis .*d\.json: is not an answer"):
        told.read_explanations(tmp_path / "d.json", bench)


@pytest.mark.slow
def test_the_fit_to_the_lines_is_that_of_diagnose(tmp_path):
    """The size, its error and the evidence of the effect on the bench are those of `diagnose`, asked about it alone."""
    bench = benches.open_bench(SCENE, DATA / "foreign_bond")
    bench = replace(bench, effects=(by_name("bond_softening"),))
    page = Page(bench, Document(), tmp_path)
    before = page.found.fitted
    page.controls.add.value = "bond_softening"
    page.weigh._trigger_event(click(page.weigh))
    finish(page, 600)
    assert page.message.text.startswith("<p>Fitted to the lines, as spindle diagnose does. bond_softening.hot_compliance 11.")
    gain = float(re.search(r"ln evidence \+(\d+)", page.message.text)[1])
    asked = told.find(bench, Setting(), lambda done: None)
    assert asked.rows[0].delta_evidence == pytest.approx(gain, rel=0.02)
    for name, value in asked.rows[0].values["bond_softening"].items():
        assert page.session.now.effects["bond_softening"][name] == pytest.approx(value, rel=0.02)
    assert page.found.fitted < before / 5


@pytest.mark.slow
def test_a_diagnosis_is_made_in_the_background(tmp_path):
    bench = benches.open_bench(SCENE, DATA / "foreign_bond")
    page = Page(replace(bench, effects=tuple(by_name(n) for n in ("bond_softening", "soak_lag"))), Document(), tmp_path)
    page.diagnose._trigger_event(click(page.diagnose))
    finish(page, 600)
    assert page.known.rows[0].effects == ("bond_softening",)
    assert page.known.rows[0].probability > 0.9
    page.take._trigger_event(click(page.take))
    assert page.found.fitted < 2
