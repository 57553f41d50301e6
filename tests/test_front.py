"""`import thermospindle as ts`: the same numbers and objects as the command line, named nodes, nothing loaded before it is used."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

import thermospindle as ts
from tests.conftest import DATA, ROOT, SCENE
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.operating import operating_point

GALLERY = sorted((ROOT / "docs" / "gallery").glob("*.py"))
SLOW = ("05_hammer_test", "10_diagnose")


def test_importing_loads_nothing():
    code = "import sys, time; a = time.process_time(); import thermospindle; b = time.process_time(); print(b - a, 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    seconds, numpy_there = done.stdout.split()
    assert float(seconds) < 0.1
    assert numpy_there == "False"


def test_every_name_is_there_and_documented():
    for name in ts.__all__:
        assert getattr(ts, name).__doc__
        assert name in dir(ts)
    with pytest.raises(AttributeError, match="there are BadInput, NoEquilibrium, OutsideRange, add"):
        _ = ts.lode


def test_modes_are_those_of_the_model():
    point = ts.point("hdd_2003", 60, speed_rpm=7200)
    own = operating_point(load(SCENE), Condition(60.0, 7200 * 2 * np.pi / 60)).modes
    assert [m.frequency for m in ts.modes(point)] == [m.frequency for m in own]
    assert len(ts.modes(point, highest_Hz=3000)) == 5


@pytest.mark.parametrize("lines", [None, np.linspace(400.0, 3000.0, 2601)], ids=["default", "every 1 Hz"])
def test_the_models_own_frfs_have_its_modes(lines):
    """Without any noise, and no word of it: taken for exact to rounding they had five modes of
    eight, and others that are none; what symmetry forbids, rounding too, spoilt shapes."""
    point = ts.point("hdd_2003", 20)
    found = ts.modes(ts.frf(point, lines))
    own = np.array([m.frequency for m in ts.modes(point, highest_Hz=6000 if lines is None else 3000)])
    assert found.frequency == pytest.approx(own, abs=0.01)
    assert np.all(np.abs(found.frequency - own) < 3 * found.frequency_sd)
    assert found.rank_one
    assert ts.modes(ts.frf(point, lines), highest_Hz=1600).frequency == pytest.approx(own[:2], abs=0.01)


def test_modes_of_an_impact_test_end_where_they_are_told():
    found = ts.modes(ts.impact(ts.point("hdd_2003", 20), hits=1), highest_Hz=1600)
    assert found.frequency == pytest.approx([1002.0, 1545.0], abs=0.5)


def test_values_stand_in_for_those_of_the_file():
    """Preload with what follows from it, of a scene whose rows are shipped ones, too; and an effect's parameter."""
    assert ts.point(ts.load("hdd_2003", values={"bearing_pair.preload_N": 20}), 20).state.bearing("upper").preload == pytest.approx(20.0)
    told = ts.load("five_bearing").sets[0]
    stiffer = ts.load("five_bearing", values={f"sets.{told.name}.preload_N": 2 * told.preload})
    assert stiffer.sets[0].preload == 2 * told.preload
    softer = ts.load("hdd_2003", values={"effects.bond_softening.hot_compliance": 12.5})
    assert softer.effects[0].values == ts.add("hdd_2003", "bond_softening", hot_compliance=12.5).effects[0].values


@pytest.mark.parametrize("scene", ["hdd_2003", "mk7702", "tailstock"])
def test_mjcf_opens_as_it_is_told(scene):
    """MuJoCo's own text has six digits, and a slender shaft's inertia is none in them."""
    point = ts.point(scene, 20)
    assert mujoco.MjModel.from_xml_string(point.xml()).body_mass == pytest.approx(point.model.body_mass, rel=1e-12)


@pytest.mark.parametrize(("quantity", "power"), [("receptance", -1), ("mobility", 0), ("accelerance", 1)])
def test_frfs_know_their_nodes(quantity, power):
    point, lines = ts.point("hdd_2003", 20), np.array([900.0, 1002.0, 1500.0])
    found = ts.frf(point, lines, quantity=quantity)
    expected = point.frf(lines) * (2j * np.pi * lines) ** power
    np.testing.assert_allclose(found["seat90", "hub_top90"], expected[5, 1])
    np.testing.assert_array_equal(found["seat90", "hub_top90"], found[6, 2])
    with pytest.raises(ts.BadInput, match="'hub' is no response of these FRFs; there are 1 hub_top0, 2 hub_top90"):
        _ = found["hub", "hub_top0"]


def test_frfs_of_a_campaign_know_their_nodes():
    frf = ts.campaign(DATA / "foreign_bond").tests[0].frf
    np.testing.assert_array_equal(frf["hub_side0", "hub_top90"], frf.value[2, 1])


def test_add_is_the_effect_of_the_catalogue():
    worn = ts.add("hdd_2003", "preload_loss", loss=0.3)
    assert worn.effects[0].values["loss"] == 0.3
    assert ts.modes(ts.point(worn, 20))[4].frequency < ts.modes(ts.point("hdd_2003", 20))[4].frequency
    with pytest.raises(ts.BadInput, match="did you mean loss"):
        ts.add("hdd_2003", "preload_loss", los=0.3)
    with pytest.raises(ts.BadInput, match="has it already"):
        ts.add(worn, "preload_loss")


def test_compare_takes_folders_and_campaigns():
    folder = SCENE / "measured" / "jang_2003"
    assert ts.compare(SCENE, folder).rms_residual == ts.compare(ts.load("hdd_2003"), read_campaign(folder)).rms_residual


def test_answers_in_plain_numbers():
    """As `spindle compare --json`, with nothing in it that JSON cannot hold."""
    found = ts.compare("hdd_2003", DATA / "foreign_bond" / "campaign.toml")
    told = json.loads(json.dumps(ts.answer(found)))
    assert told["rms_pull"] == found.rms_residual
    assert told["tests"][0]["modes"][0]["measured_Hz"] == found.tests[0].modes[0].measured
    with pytest.raises(ts.BadInput, match="found: must be a diagnosis"):
        ts.answer(found.tests)


def test_what_is_shown_of_an_object_is_a_line(tmp_path):
    """In a session, a notebook or a failed assertion: a diagnosis whose every number was shown filled megabytes."""
    point = ts.point("hdd_2003", 60, speed_rpm=7200)
    tests = ts.campaign(DATA / "foreign_bond")
    compared = ts.compare("hdd_2003", tests)
    shown = [repr(x) for x in (ts.load("hdd_2003"), point, ts.modes(point)[1], ts.frf(point), tests, tests.tests[0], compared, compared.tests[0])]
    assert all(len(words) < 200 for words in shown)
    assert shown[0] == "<Spindle hdd_2003: 2 bearings, 4 bodies, 7 points>"
    assert shown[1] == "<OperatingPoint hdd_2003 at 60 C, 7200 rpm, in contact, preload 8.00 N>"
    assert shown[2].startswith("<Mode axial, 1542.1")
    assert shown[3].startswith("<Frf mobility: 7 responses, 2 references, 2000 lines from 400 to 6000 Hz")
    assert "7 tests" in shown[4]
    assert shown[5].startswith("<Test T20_n0: 20 C, 0 rpm, <Frf")
    assert "rms error 98" in shown[6]


@pytest.mark.parametrize("wrong", [[-1.0], [[1.0]], [np.nan]])
def test_frequencies_that_are_none_are_refused(wrong):
    with pytest.raises(ts.BadInput, match="frequency_Hz"):
        ts.frf(ts.point("hdd_2003", 20), wrong)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda p: ts.point("hdd_2003", float("nan")), "temperature_C = nan: must be a finite number above -273.15 and up to 10000"),
        (lambda p: ts.point("hdd_2003", "hot"), "temperature_C = 'hot': must be a finite number above -273.15 and up to 10000"),
        (lambda p: ts.point("hdd_2003", -300.0), "temperature_C = -300.0: must be a finite number above -273.15 and up to 10000"),
        (lambda p: ts.point("hdd_2003", 20.0, speed_rpm=float("nan")), "speed_rpm = nan: must be a finite number above -1e+08 and up to 1e+08"),
        (lambda p: ts.modes(p, highest_Hz=float("nan")), "highest_Hz = nan: must be a finite number above 0"),
        (lambda p: ts.modes(p, highest_Hz="x"), "highest_Hz = 'x': must be a finite number above 0"),
        (lambda p: ts.frf(p, ["x"]), "frequency_Hz = ['x']: must be one row of positive numbers"),
        (lambda p: ts.impact(p, hits=0), "hits = 0: must be a whole number from 1 to 1000"),
        (lambda p: ts.impact(p, hits=1.5), "hits = 1.5: must be a whole number from 1 to 1000"),
        (lambda p: ts.impact(p, level_N=-1), "level_N = -1: must be a finite number above 0 and up to 1e+06"),
        (lambda p: ts.impact(p, element="x"), "element = 'x': allowed are linear, ball-by-ball, reduced"),
        (lambda p: ts.impact(p, element="ball"), "element = 'ball': did you mean ball-by-ball?"),
        (lambda p: ts.impact(p, seed=-1), "seed = -1: must be a whole number from 0 to 999999999999999999"),
        (lambda p: ts.modes(p.spindle), "source: must be an operating point (ts.point), a virtual test (ts.impact) or FRFs (ts.frf), not a Spindle"),
        (lambda p: ts.frf(p.spindle), "source: must be an operating point (ts.point) or a virtual test (ts.impact), not a Spindle"),
        (lambda p: ts.impact(p.spindle), "point: must be an operating point (ts.point), not a Spindle"),
        (lambda p: ts.load(None), "scene: must be a scene's folder or the name of a shipped one, not None"),
        (lambda p: ts.compare(p.spindle, [1]), "tests: must be a campaign (ts.campaign) or its folder, not a list"),
        (lambda p: ts.diagnose(p.spindle, DATA / "foreign_none", effects="preload_loss"), "effects = 'preload_loss': must be a list of names, as ['preload_loss']"),
        (lambda p: p.state.bearing("uper"), "no ball bearing is called 'uper'; did you mean upper?"),
        (lambda p: ts.frf(p, [900.0])["hub_top0"], "'hub_top0': one of the FRFs is asked for by two nodes, response and reference, as frf[\"hub_top0\", \"hub_top90\"]"),
        (lambda p: ts.add("hdd_2003", "preload_loss", loss="x"), "loss = 'x': must be a finite number"),
        (lambda p: ts.deviate("hdd_2003", {"preload": -1.5}), "preload = -1.5: must be a relative deviation from -0.9 to 10"),
        (lambda p: ts.deviate("hdd_2003", {"preload": float("nan")}), "preload = nan: must be a finite number"),
        (lambda p: ts.deviate("hdd_2003", []), "deviations: must be a mapping of relative deviations by name, not a list"),
        (lambda p: ts.add("hdd_2003", 3), "effect: must be the name of an effect, or the path of a file of your own, not an int"),
        (lambda p: ts.campaign(None), "folder: must be the folder of a campaign, not None"),
        (lambda p: ts.read_log(None), "file: must be a Rerun log, not None"),
        (lambda p: ts.load("hdd_2003", "own.py"), "effect_files = 'own.py': must be a list of paths of files, as ['own.py']"),
        (lambda p: ts.load("hdd_2003", 3), "effect_files: must be a list of paths of files, not an int"),
        (lambda p: ts.load("hdd_2003", values=[3]), "values: must be a mapping of values by their keys, not a list"),
        (lambda p: ts.load("five_bearing", values={"sets.mid.preload_N": 3}), "values['sets.mid.preload_N']: sets.mid is not in the scene; allowed are front, rear"),
        (lambda p: ts.load("hdd_2003", values={"effects.bond.hot_compliance": 3}), "values['effects.bond.hot_compliance']: no effect is called 'bond'; did you mean bond_softening?"),
        (lambda p: ts.frf(p, []), "frequency_Hz = []: must be one row of positive numbers"),
        (lambda p: ts.frf(p, ["1", "2"]), "frequency_Hz = ['1', '2']: must be one row of positive numbers"),
        (lambda p: ts.frf(p, quantity=["mobility"]), "quantity = ['mobility']; allowed are receptance, mobility, accelerance"),
        (lambda p: ts.impact(p, noise="no"), "noise: must be True or False, not a str"),
        (lambda p: ts.modes(ts.frf(p, [900.0, 950.0])), "source: no modes can be found in its FRFs: 2 lines above 0 Hz in the band: at least 12 in rising order are needed"),
        (lambda p: ts.modes(ts.frf(p, [900.0, 950.0, 800.0] * 9)), "source: no modes can be found in its FRFs: 27 lines above 0 Hz in the band: at least 12 in rising order are needed"),
        (lambda p: ts.modes(ts.frf(p), highest_Hz=10), "source: no modes can be found in its FRFs: 0 lines above 0 Hz in the band: at least 12 in rising order are needed"),
        (lambda p: p.spindle.bearing("mid"), "no ball row is called 'mid'; allowed are lower, upper"),
        (
            lambda p: p.spindle.point(99),
            "no point has the node 99; allowed are 1 (hub_top0), 2 (hub_top90), 3 (hub_side0), 4 (hub_side90), 5 (seat0), 6 (seat90), 7 (base)",
        ),
    ],
)
def test_an_argument_that_is_none_is_told_in_one_sentence(call, sentence):
    with pytest.raises(ts.BadInput) as error:
        call(ts.point("hdd_2003", 20))
    assert str(error.value) == sentence


def test_what_no_spindle_bears_is_warned_of():
    with pytest.warns(UserWarning, match="293.15 C lies outside -40 to 120 C"), pytest.warns(UserWarning, match="lower and upper bearing lost contact"):
        ts.point("hdd_2003", 293.15)


def test_a_scene_that_is_none_is_told_the_nearest(tmp_path, monkeypatch):
    """Of the shipped scenes for a bare name, and of the folders beside; nothing where none is like it."""
    with pytest.raises(ts.BadInput, match=r"^hdd2003: no scene there; did you mean hdd_2003\?"):
        ts.load("hdd2003")
    (tmp_path / "my_motor").mkdir()
    (tmp_path / "my_motor" / "spindle.toml").touch()
    with pytest.raises(ts.BadInput, match=r"did you mean .*my_motor\?"):
        ts.load(tmp_path / "my_moter")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ts.BadInput, match=r"did you mean my_motor\?"):
        ts.load("mymotor")
    with pytest.raises(ts.BadInput, match=r"^zzz: no scene there; expected a folder"):
        ts.load("zzz")


def test_there_are_ten_in_the_gallery():
    assert len(GALLERY) == 10
    assert all(f.read_text(encoding="utf-8").startswith('"""') for f in GALLERY)


@pytest.mark.parametrize("script", [pytest.param(f, marks=[pytest.mark.slow] * (f.stem in SLOW), id=f.stem) for f in GALLERY])
def test_gallery(script: Path, capsys):
    runpy.run_path(str(script), run_name="__main__")
    assert capsys.readouterr().out.strip()


def test_the_code_of_the_readme_runs(capsys):
    """Its first block prints modes at both temperatures; its second is a test, and holds."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), names)
    for name, found in list(names.items()):
        if name.startswith("test_") and callable(found):
            found()
    out = capsys.readouterr().out
    assert out.count("rocking") == 4
    assert re.findall(r"^\d+ C: .*", out, re.M) == ["20 C: 16.0 N preload", "60 C: 8.0 N preload"]  # no digits that mean nothing
