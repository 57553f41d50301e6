"""The workbench without a browser: what it computes is what `compare` tells, its page does what a user asks, and it saves what can be run again."""

import json
import re
import runpy
import subprocess
import sys
import time
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.server.callbacks import PeriodicCallback

from tests.conftest import DATA, ROOT, SCENE
from thermospindle.diagnosis.add import scene_with
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.workbench import bench as benches
from thermospindle.report.workbench import explanations as told
from thermospindle.report.workbench import page as pages
from thermospindle.report.workbench import state, words
from thermospindle.report.workbench.page import Page
from thermospindle.report.workbench.save import save, script
from thermospindle.report.workbench.section import LARGEST, moving, pieces
from thermospindle.report.workbench.state import Setting
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.simulated import runout_campaign
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point

CAMPAIGN = SCENE / "virtual" / "soak_20_60"


@pytest.fixture(scope="module")
def bench():
    return benches.open_bench(SCENE, CAMPAIGN)


@pytest.fixture(scope="module")
def alone():
    return benches.open_bench(SCENE)


@pytest.fixture
def page(bench, tmp_path):
    return Page(bench, Document(), tmp_path / "saved")


@pytest.fixture(scope="module")
def changed(bench):
    """A setting off in an effect and a tolerance, with one test left out."""
    s = state.add_effect(Setting(), bench.effect("preload_loss"), {"loss": 0.1})
    return state.leave_out(state.set_deviation(s, "hub mass", 0.004), ["T60_n0"])


def turn(page):
    """What the server's loop would do next."""
    for callback in list(page.document.session_callbacks):
        if isinstance(callback, PeriodicCallback):
            continue
        page.document.callbacks.remove_session_callback(callback)
        callback.callback()


def finish(page, seconds=60):
    end = time.monotonic() + seconds
    while page.work.name:
        assert time.monotonic() < end, page.message.text
        turn(page)
        time.sleep(0.01)


# ---------------------------------------------------------------- what is computed


def test_errors_are_those_of_compare(bench, changed):
    found = benches.errors(bench, changed)
    spindle = benches.built(bench, changed)
    by_hand = compare(spindle, bench.campaign, bench.observations)
    assert found.fitted == by_hand.rms_of(["T20_n0"])
    assert found.left_out == by_hand.rms_of(["T60_n0"])
    assert {(c.test, c.frequency) for c in found.cells} == {(t.test.id, m.residual) for t in by_hand.tests for m in t.modes}
    assert benches.errors(bench, Setting()).fitted < 1.5 < found.fitted


def test_frfs_are_those_of_compare(bench, changed):
    shown = bench.show("T60_n0")
    found = benches.curves(bench, changed, shown, 3, 2)
    correlation = compare(benches.built(bench, changed), bench.campaign, bench.observations).tests[1].correlation
    place = correlation.pairs[3, 2]
    np.testing.assert_array_equal(found.computed, correlation.computed[place])
    np.testing.assert_array_equal(found.measured, correlation.measured[place])


def test_without_tests_the_model_stands_beside_itself(alone):
    assert {c.frequency for c in benches.errors(alone, Setting()).cells} == {0.0}
    s = state.add_effect(Setting(), alone.effect("preload_loss"), {"loss": 0.3})
    cell = next(c for c in benches.errors(alone, s).cells if c.test == "20 °C" and c.mode == "5 axial")
    before, after = (operating_point(x, alone.show("20 °C").condition).modes[4].frequency for x in (alone.spindle, benches.built(alone, s)))
    assert cell.frequency == pytest.approx(100 * (after / before - 1))
    assert cell.frequency < -0.2
    assert benches.curves(alone, s, alone.shown[0], 3, 1).measured is None


def test_runout_tests_are_said_not_to_be_on_the_bench(spindle, tmp_path):
    """Beside tests of modes: named on the page with what shows them; alone they are refused in a sentence."""
    modal = read_campaign(SCENE / "measured" / "jang_2003")
    turned = runout_campaign(spindle, [Condition(20.0, rpm * RPM) for rpm in (3600, 7200)], 0.3, path="linear")
    mixed = benches.open_bench(SCENE, replace(modal, points=turned.points, tests=(*modal.tests, *turned.tests)))
    assert mixed.of_runout == ("T20_n3600", "T20_n7200")
    assert [s.id for s in mixed.shown] == [t.id for t in modal.tests]
    said = "Tests T20_n3600, T20_n7200 are of runout, and not on the bench: spindle compare and spindle diagnose show runout"
    assert said in Page(mixed, Document(), tmp_path).status.text
    assert words.not_shown(replace(mixed, of_runout=tuple("abcdef"))).startswith("Tests a, b, c, d and 2 more are of runout")
    assert words.not_shown(benches.open_bench(SCENE, modal)) == ""
    with pytest.raises(BadInput, match="holds runout tests alone; the workbench needs tests of modes"):
        benches.open_bench(SCENE, turned)


def test_effects_of_runout_alone_are_not_offered(bench):
    names = {e.name for e in bench.effects}
    assert "bond_softening" in names
    assert not names & {"unbalance", "ball_size"}


def test_a_campaign_of_modes_alone_is_shown_too():
    found = benches.open_bench(SCENE, SCENE / "measured" / "jang_2003")
    page = Page(found, Document(), SCENE)
    assert len(page.frf.measured.data["f"]) == 0
    assert len(page.frf.computed.data["f"]) == benches.LINES
    assert len(page.frf.peaks.data["f"]) > 2
    assert benches.errors(found, Setting()).fitted > 0


def test_a_fit_finds_what_was_turned_away(bench):
    """The virtual tests are of the scene itself: loss and deviation go back to none, within their errors."""
    s = state.add_effect(Setting(), bench.effect("preload_loss"), {"loss": 0.25})
    s = state.set_free(state.set_deviation(s, "hub mass", 0.01), "hub mass", True)
    before, found = benches.errors(bench, s).fitted, benches.fitted(bench, s)
    after = benches.errors(bench, state.set_named(s, found.value)).fitted
    assert after < 1.5 < 10 < before
    for name, value in found.value.items():
        assert abs(value) < 5 * found.sd[name]
    assert found.sd["preload_loss.loss"] < 0.01


def test_a_fit_does_not_look_at_what_is_left_out(bench):
    s = state.leave_out(state.add_effect(Setting(), bench.effect("bond_softening")), ["T60_n0"])
    found = benches.fitted(bench, s)
    blind = replace(bench, observations=(bench.observations[0], replace(bench.observations[1], frequency=1.001 * bench.observations[1].frequency)))
    assert benches.fitted(blind, s).value == pytest.approx(found.value, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda s: s, "tick fit"),
        (lambda s: state.leave_out(state.set_free(s, "preload", True), ["T20_n0", "T60_n0"]), "every test is left out"),
    ],
)
def test_what_cannot_be_fitted_is_said(bench, make, said):
    with pytest.raises(BadInput, match=said):
        benches.fitted(bench, make(Setting()))


# ---------------------------------------------------------------- the section


def test_a_rigid_body_moves_rigidly(bench):
    point, modes = benches.modes_of(bench, Setting(), bench.shown[0])
    drawn = pieces(bench.spindle)
    assert {p.body for p in drawn} <= {b.name for b in point.chain.bodies}
    for mode in modes[:5]:
        moved = moving(drawn, point.chain, mode)
        for p, (x, z) in zip(drawn, moved, strict=True):
            a, b = np.array([p.x, p.z]), np.array([x, z])
            edge, change = a - np.roll(a, 1, axis=1), b - np.roll(b, 1, axis=1)
            np.testing.assert_allclose(np.sum(edge * change, axis=0), 0.0, atol=1e-9)  # to first order no edge grows
        largest = max(float(np.abs(v).max()) for pair in moved for v in pair)
        assert largest == pytest.approx(LARGEST * 2 * max(np.abs(p.x).max() for p in drawn))
    axial = moving(drawn, point.chain, modes[0])
    assert max(float(np.abs(x).max()) for x, _ in axial) < 1e-6 * max(float(np.abs(z).max()) for _, z in axial)


# ---------------------------------------------------------------- the page


def test_the_page_begins_with_the_scene_as_it_is(page, bench):
    assert page.undo.disabled
    assert page.redo.disabled
    assert page.found == benches.errors(bench, Setting())
    assert len(page.frf.measured.data["f"]) == len(bench.shown[0].test.frf.frequency)
    assert list(page.map.figure.x_range.factors) == [("fitted", "T20_n0"), ("fitted", "T60_n0")]
    assert "agrees" in page.status.text


def test_adding_dragging_undoing(page):
    page.controls.add.value = "preload_loss"
    assert page.session.now.effects["preload_loss"]["loss"] == 0.15
    slider = page.controls.sliders["preload_loss.loss"]
    before, at_start = page.frf.computed.data["size"], page.found.fitted
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


def click(button):
    from bokeh.events import ButtonClick

    return ButtonClick(button)


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
    page.controls.add.value = "bond_softening"
    page.weigh._trigger_event(click(page.weigh))
    finish(page, 600)
    assert page.message.text.startswith("<p>Fitted to the lines, as spindle diagnose does. bond_softening.hot_compliance 12.")
    gain = float(re.search(r"ln evidence \+(\d+)", page.message.text)[1])
    asked = told.find(bench, Setting(), lambda done: None)
    assert asked.rows[0].delta_evidence == pytest.approx(gain, rel=0.02)
    for name, value in asked.rows[0].values["bond_softening"].items():
        assert page.session.now.effects["bond_softening"][name] == pytest.approx(value, rel=0.02)
    assert page.found.fitted < 2


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


# ---------------------------------------------------------------- saving


@pytest.mark.parametrize("campaign", [SCENE / "measured" / "jang_2003", pytest.param(CAMPAIGN, marks=pytest.mark.slow)], ids=lambda c: c.name)
def test_the_script_gives_the_same_numbers(campaign, changed, tmp_path):
    bench = benches.open_bench(SCENE, campaign)
    s = state.leave_out(changed, [bench.shown[1].id])
    (tmp_path / "script.py").write_text(script(bench, s), encoding="utf-8")
    done = subprocess.run([sys.executable, tmp_path / "script.py"], capture_output=True, text=True, check=True)
    found = benches.errors(bench, s)
    assert [float(line.split()[4]) for line in done.stdout.splitlines()] == pytest.approx([found.fitted, found.left_out], rel=1e-8)


def test_saved_scene_and_script_of_the_model_alone(alone, tmp_path):
    s = state.set_deviation(state.add_effect(Setting(), alone.effect("ball_material")), "preload", 0.04)
    assert save(alone, s, benches.errors(alone, s), (), tmp_path / "mine") == ["scene", "workbench.py"]
    scene = benches.open_bench(tmp_path / "mine" / "scene")
    here = operating_point(benches.built(alone, s), alone.shown[0].condition).modes
    there = operating_point(scene.spindle, alone.shown[0].condition).modes
    np.testing.assert_allclose([m.frequency for m in there], [m.frequency for m in here], rtol=1e-12)


def test_the_script_takes_an_effect_of_ones_own(tmp_path, capsys):
    own = ROOT / "docs" / "air_film.py"
    bench = benches.open_bench(SCENE, effect_files=[own])
    s = state.add_effect(Setting(), bench.effect("air_film"))
    (tmp_path / "script.py").write_text(script(bench, s), encoding="utf-8")
    runpy.run_path(str(tmp_path / "script.py"))
    printed = [float(line.split()[-2]) for line in capsys.readouterr().out.splitlines() if line.startswith("60 C")]
    point = operating_point(benches.built(bench, s), bench.show("60 °C").condition)
    assert printed == pytest.approx([m.frequency for m in point.modes if m.frequency <= bench.spindle.hammer.band[1]], abs=1e-6)
    assert max(abs(c.frequency) for c in benches.errors(bench, s).cells) > 1e-3


@pytest.mark.slow
def test_scene_and_report_are_saved_whole(bench, changed, tmp_path):
    errors = benches.errors(bench, changed)
    assert save(bench, changed, errors, (), tmp_path / "mine") == ["scene", "workbench.py", "report"]
    again = benches.open_bench(tmp_path / "mine" / "scene", CAMPAIGN)
    assert again.spindle.build.tests == ("T20_n0",)
    assert benches.errors(again, state.leave_out(Setting(), ["T60_n0"])).fitted == pytest.approx(errors.fitted, rel=1e-9)
    assert "Measured beside computed" in (tmp_path / "mine" / "report" / "report.html").read_text(encoding="utf-8")
    save(bench, changed, errors, (), tmp_path / "mine")  # what spindle wrote, it replaces


def test_what_cannot_be_saved_is_said(bench, changed, page, tmp_path):
    errors = benches.errors(bench, Setting())
    with pytest.raises(BadInput, match="nothing was changed yet"):
        save(bench, Setting(), errors, (), tmp_path / "mine")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("mine")
    with pytest.raises(BadInput, match="did not write"):
        save(bench, changed, errors, (), tmp_path / "other")
    page.name.value = "../elsewhere"
    page.save._trigger_event(click(page.save))
    assert "no name of a folder" in page.message.text
