"""The workbench without its page: what it computes is what `compare` tells, the section moves as
its bodies do, and it saves what can be run again."""

import runpy
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from bokeh.document import Document

from tests.conftest import ROOT, SCENE
from tests.report.workbench_session import CAMPAIGN, click
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.workbench import bench as benches
from thermospindle.report.workbench import state, words
from thermospindle.report.workbench.page import Page
from thermospindle.report.workbench.save import save, script
from thermospindle.report.workbench.section import LARGEST, moving, pieces
from thermospindle.report.workbench.state import Setting
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.simulated import runout_campaign
from thermospindle.sim.operating import operating_point

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


def test_a_row_is_one_mode_at_all_conditions(stiffly_mounted, monkeypatch):
    """Numbered by frequency at each, the row of an axial mode held at 100 C one of the lateral ones
    that had passed it; and what a setting takes away is said."""
    monkeypatch.setattr(benches, "load", lambda file: replace(stiffly_mounted, temperatures=(20.0, 100.0)))
    crossing = benches.open_bench(SCENE)
    assert {m[5].kind for m in crossing.modes.values()} == {"axial"}
    assert crossing.modes["100 °C"][7].frequency == pytest.approx(3566.0, abs=1.0)
    assert {c.frequency for c in benches.errors(crossing, Setting()).cells} == {0.0}
    loose = state.add_effect(Setting(), crossing.effect("preload_loss"), {"loss": 0.9})
    found = benches.errors(crossing, loose)
    assert all(abs(c.frequency) < 1.0 for c in found.cells if c.mode == "5 axial")
    assert next(r for r in found.remarks if r.startswith("100 °C:")).startswith("100 °C: no mode has the shape of mode 2, 1736 Hz as opened; mode 3, ")


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
