"""`ts.table`, `static`, `check`, `runout`, `warmup` and `resonances` say what the verbs of the command line say."""

import json
import subprocess
import sys

import numpy as np
import pytest

import thermospindle as ts
from tests.conftest import ROOT, SCENE


def told(*verb):
    """The answer of the command line."""
    done = subprocess.run([sys.executable, "-m", "thermospindle", *map(str, verb), "--json"], cwd=ROOT, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def without_warnings(answer):
    return {key: value for key, value in answer.items() if key != "warnings"}


def test_a_table_is_that_of_the_verb():
    found = ts.answer(ts.table("hdd_2003", [20, 60], speeds_rpm=[0, 7200]))
    assert found == without_warnings(told("table", "hdd_2003", "--temperatures", 20, 60, "--speeds", 0, 7200))


def test_a_check_is_that_of_the_verb():
    assert json.loads(json.dumps(ts.check("tailstock"))) == without_warnings(told("check", "tailstock"))


def test_a_check_tells_of_ones_own_effects_too():
    found = ts.check("hdd_2003", [ROOT / "docs" / "air_film.py"])
    assert "air_film" in found["effects"]["can_act"]


def test_static_answers_hold_a_unit_force():
    found = ts.static(ts.point("five_bearing", 20))["nose"]
    wanted = told("static", "five_bearing", "--bearings", "computed")["points"]["nose"]
    assert found.stiffness == wanted["stiffness_N_per_m"]
    assert sum(found.reactions.values()) == pytest.approx(-1.0, rel=1e-6) or sum(found.reactions.values()) == pytest.approx(1.0, rel=1e-6)
    assert sum(found.shares.values()) == pytest.approx(1.0)


def test_runout_is_that_of_the_verb():
    point = ts.point("hdd_2003", 20, speed_rpm=7200)
    wanted = told("runout", "hdd_2003", "--speed", 7200, "--temperature", 20, "--path", "linear", "--seed", 3)
    found = ts.runout(point, path="linear", seed=3)
    assert [1e6 * line.amplitude for line in found.lines] == pytest.approx([line["amplitude_um"] for line in wanted["lines"]], rel=1e-9)


def test_a_warm_up_is_that_of_the_verb():
    found = ts.answer(ts.warmup("hdd_2003", speed_rpm=7200, minutes=1))
    wanted = told("warmup", "hdd_2003", "--speed", 7200, "--minutes", 1)
    assert found["time_s"] == wanted["time_s"]
    assert found["frequencies_Hz"] == wanted["frequencies_Hz"]


def test_a_map_is_that_of_the_verb():
    found = ts.answer(ts.resonances("hdd_2003", temperatures_C=[20, 40], speeds_rpm=[3600, 7200]))
    wanted = told("map", "hdd_2003", "--temperatures", 20, 40, "--speeds", 3600, 7200)
    assert found["coincidences"] == wanted["coincidences"]
    assert found["sentences"] == wanted["sentences"]


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (lambda: ts.table("hdd_2003", []), r"temperatures_C = \[\]: must hold one number or more"),
        (lambda: ts.table("hdd_2003", ["20"]), "temperatures_C = '20': must be a finite number"),
        (lambda: ts.table("hdd_2003", 20), "temperatures_C: must be a list of numbers, not an int"),
        (lambda: ts.table("hdd_2003", speeds_rpm=[np.nan]), "speeds_rpm = nan: must be a finite number"),
        (lambda: ts.static("hdd_2003"), r"point: must be an operating point \(ts.point\), not a str"),
        (lambda: ts.runout(ts.point("hdd_2003", 20, speed_rpm=7200), path="exact"), "path = 'exact'"),
        (lambda: ts.runout(ts.point("hdd_2003", 20, speed_rpm=7200), element="reduced"), "element = 'reduced'"),
        (lambda: ts.warmup("hdd_2003", minutes=0), "minutes = 0: must be a finite number above 0"),
        (lambda: ts.resonances("hdd_2003", speed_rpm=-1), "speed_rpm = -1: must be a finite number above 0"),
        (lambda: ts.runout(ts.point("hdd_2003", 20, speed_rpm=7200), seconds=1e9), "seconds = 1000000000.0: must be a finite number above 0 and up to 100"),
        (lambda: ts.runout(ts.point("hdd_2003", 20, speed_rpm=7200), path="linear", element="ball-by-ball"), "the harmonic answer of linear bearings"),
        (lambda: ts.runout(ts.point("mk7702", 20, speed_rpm=1000), element="ball-by-ball"), "no bearing of mk7702 has balls"),
        (lambda: ts.warmup("hdd_2003", minutes=10**400), "minutes = 1000"),
        (lambda: ts.resonances("hdd_2003", multiples=0), "multiples = 0: must be a whole number from 1 to 100"),
        (lambda: ts.load("hdd_2003", values=[]), "values: must be a mapping of values by their keys, not a list"),
        (lambda: ts.answer(3), r"found: must be a diagnosis \(ts.diagnose\), .* not an int"),
        (lambda: ts.point("hdd_2003", 20).frf([1.0, np.nan]), r"frequency = \[1.0, nan\]: must be one row of positive numbers or zero"),
        (lambda: ts.point("hdd_2003", 20).frf(np.ones((2, 2))), "frequency = array.*: must be one row of positive numbers or zero"),
        (lambda: ts.point("hdd_2003", 20).modes_below("a"), "highest = 'a': must be a positive number"),
        (lambda: ts.point("hdd_2003", 20).modes_below(np.nan), "highest = nan: must be a positive number"),
    ],
)
def test_what_cannot_be_asked_is_one_sentence(asked, sentence):
    with pytest.raises(ts.BadInput, match=sentence):
        asked()


def test_frequencies_may_be_a_list_and_begin_at_nothing():
    point = ts.point("hdd_2003", 20)
    assert np.array_equal(point.frf([0.0, 100.0]), point.frf(np.array([0.0, 100.0])))
    assert np.all(point.frf([0.0, 100.0])[..., 0] == 0)


# ---------------------------------------------------------------- values and effects


def test_values_that_need_each_other_are_taken_together():
    spindle = ts.load("five_bearing", values={"radial_load_N": [150.0, np.int64(0)], "radial_load_z_mm": 20.0, "radial_load_body": "spindle"})
    assert spindle.radial_loads[0].force == (150.0, 0.0)
    with pytest.raises(ts.BadInput, match=r"^values: .*radial_load_z_mm = '20': input should be a valid number"):
        ts.load("five_bearing", values={"radial_load_N": [150.0, 0.0], "radial_load_z_mm": "20", "radial_load_body": "spindle"})


@pytest.mark.parametrize("number", [np.int64(11), np.int32(11), np.arange(11, 12)[0]])
def test_whole_numbers_of_numpy_are_whole_numbers(number):
    assert ts.load("hdd_2003", values={"hammer_test.hits": number}).hammer.hits == 11


BROKEN = '''
import numpy as np
from dataclasses import replace
from thermospindle.sim.effects.effect import Effect, Parameter
def pair(spindle, condition, values, state):
    {body}
EFFECT = Effect(
    name="broken", title="Something that breaks a rule", equation="K = size K",
    parameters=(Parameter("size", "1", neutral=0.0, typical=0.5, prior_sd=0.5, limits=(0.0, 2.0), meaning="how much of it there is", source="assumed for this test alone"),),
    sees="bearing modes move", resembles=("preload_loss",), valid="nowhere", pair=pair,
)
'''


def test_an_effect_that_breaks_a_rule_is_refused_by_add_as_by_load(tmp_path):
    """A stiffness that is no number ended in an error of linear algebra, and one that is not symmetric in wrong modes."""
    file = tmp_path / "broken.py"
    body = "return replace(state, bearings=tuple(replace(b, stiffness=b.stiffness + values['size'] * {m}) for b in state.bearings))"
    for wrong in ("np.nan", "1e6 * np.triu(np.ones((5, 5)), 1)"):
        file.write_text(BROKEN.format(body=body.format(m=wrong)))
        with pytest.raises(ts.BadInput, match="broken") as by_load:
            ts.load(SCENE, [file])
        with pytest.raises(ts.BadInput) as by_add:
            ts.add(SCENE, file)
        assert str(by_add.value) == str(by_load.value)
