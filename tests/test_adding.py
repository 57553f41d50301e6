"""The catalogue at the command line: effects listed, explained, and added to a scene."""

import json

import pytest

from tests.command_line import answer, refused
from tests.conftest import SCENE
from thermospindle.cli import main
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import load
from thermospindle.report.folder import MARK
from thermospindle.sim.effects import CATALOGUE


def test_effects_are_listed(capsys):
    found = answer(capsys, "effects", "--json")["effects"]
    assert [e["name"] for e in found] == [e.name for e in CATALOGUE]
    assert all(set(e) == {"name", "title", "parameter", "unit", "neutral", "typical"} for e in found)
    assert main(["effects"]) == 0
    text = capsys.readouterr().out
    assert all(e.name in text for e in CATALOGUE)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_effects_are_explained(capsys, effect):
    found = answer(capsys, "effects", effect.name, "--json")
    assert {"equation", "parameters", "sees", "resembles", "valid"} < set(found)
    keys = {"name", "unit", "neutral", "typical", "prior_sd", "limits", "meaning", "source", "choices", "counts"}
    assert all(set(p) == keys for p in found["parameters"])
    assert main(["effects", effect.name]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for told in (effect.equation, effect.sees, effect.valid, *(p.source for p in effect.parameters)):
        assert " ".join(told.split()) in text


def frequencies(capsys, scene):
    return [m["frequency_Hz"] for m in answer(capsys, "modes", scene, "--temperature", 60, "--json")["modes"]]


def test_add_writes_a_scene_whose_modes_move(capsys, tmp_path):
    new = tmp_path / "bonded"
    found = answer(capsys, "add", SCENE, "bond_softening", "--out", new, "--json")
    assert found["added"][0]["values"]["hot_compliance"] == 12.5
    assert {p.name for p in new.iterdir()} == {"spindle.toml", "measured", "published", MARK}
    for name in ("measured/jang_2003/modes.csv", "published/jang_2003_analysis.csv"):
        assert (new / name).read_bytes() == (SCENE / name).read_bytes()
    assert (new / "spindle.toml").read_text().startswith((SCENE / "spindle.toml").read_text().rstrip())
    assert load(new).provenance["effects.bond_softening.values.transition"].origin == "assumed"
    pair = []
    for scene in (SCENE, new):
        modes = answer(capsys, "modes", scene, "--temperature", 60, "--json")["modes"]
        pair.append(min(m["frequency_Hz"] for m in modes if m["kind"] == "lateral"))
    assert pair[0] == pytest.approx(4120.0, abs=0.5)
    assert pair[1] == pytest.approx(3859, rel=0.01)  # tests/data/foreign_bond at 60 C: another program, this bond, tolerances of 1.5 %


def test_tables_that_a_scene_names_come_along(capsys, tmp_path):
    """Within its folder; of one outside the sentence says what to do."""
    old, table = tmp_path / "old", "tables/left.csv"
    (old / "tables").mkdir(parents=True)
    text = (SCENE.parent / "templates" / "rotor.toml").read_text(encoding="utf-8")
    text = text.replace("radial_stiffness_N_per_um = 20.0", f'table = "{table}"', 1)
    (old / "spindle.toml").write_text(text, encoding="utf-8")
    (old / table).write_text("temperature_C,speed_rpm,radial_stiffness_N_per_m,axial_stiffness_N_per_m\n20,0,2e7,1e6\n60,0,1.8e7,1e6\n", encoding="utf-8")
    answer(capsys, "add", old, "sensor_mass", "--out", tmp_path / "new", "--json")
    assert (tmp_path / "new" / table).read_bytes() == (old / table).read_bytes()
    (old / table).rename(tmp_path / "left.csv")
    (old / "spindle.toml").write_text(text.replace(table, "../left.csv"), encoding="utf-8")
    said = refused(capsys, "add", old, "sensor_mass", "--out", tmp_path / "more")
    assert "bearings.left.numbers.table = '../left.csv': lies outside the scene's folder; allowed is one within it" in said
    assert not (tmp_path / "more").exists()


def test_added_at_its_neutral_value_an_effect_moves_nothing(capsys, tmp_path):
    answer(capsys, "add", SCENE, "preload_loss", "--set", "loss=0", "--out", tmp_path / "n", "--json")
    assert frequencies(capsys, tmp_path / "n") == frequencies(capsys, SCENE)


def test_effects_add_up(capsys, tmp_path):
    answer(capsys, "add", SCENE, "preload_loss", "--out", tmp_path / "one", "--json")
    answer(capsys, "add", tmp_path / "one", "added_disk", "--set", "mass=2.5", "height=1", "--out", tmp_path / "two", "--json")
    assert [e.effect for e in load(tmp_path / "two").effects] == ["preload_loss", "added_disk"]
    assert load(tmp_path / "two").effects[1].values == {"mass": 2.5, "outer_radius": 12.5, "height": 1.0}
    both = [frequencies(capsys, tmp_path / name)[5] for name in ("one", "two")]
    assert both[1] < both[0] < frequencies(capsys, SCENE)[5]


DIAGNOSIS = {
    "verdict": "two effects",
    "candidates": [
        {"effects": ["soak_lag"], "parameters": {"hub_share": {"value": 0.1, "sd": 0.01, "unit": "1"}}},
        {
            "effects": ["preload_loss", "bond_softening"],
            "parameters": {
                "preload_loss.loss": {"value": 0.2, "sd": 0.01, "unit": "1"},
                "bond_softening.hot_compliance": {"value": 11.0, "sd": 0.5, "unit": "nm/N"},
                "bond_softening.transition": {"value": 47.0, "sd": 1.0, "unit": "C"},
            },
        },
        {"effects": ["bond_softening"], "parameters": {"hot_compliance": {"value": 99.0, "sd": 0.5, "unit": "nm/N"}}},
    ],
}


@pytest.fixture
def diagnosis(tmp_path):
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps(DIAGNOSIS))
    return file


def test_add_takes_fitted_values_from_the_candidate_that_is_the_effect(capsys, tmp_path, diagnosis):
    arguments = ("add", SCENE, "bond_softening", "--from", diagnosis, "--set", "width=3", "--out", tmp_path / "b", "--json")
    found = answer(capsys, *arguments)
    chosen = {"hot_compliance": 99.0, "width": 3.0}  # the rest is typical
    assert found["added"][0]["values"] == {"transition": 50.0, "cold_ratio": 4.75, "loss_factor": 0.04, "bearing": -1.0} | chosen
    said = load(tmp_path / "b").provenance["effects.bond_softening.values.transition"]
    assert said.origin == "calibrated"
    assert "diagnosis.json: hot_compliance; set by hand: width" in said.source
    assert (
        answer(capsys, "add", SCENE, "soak_lag", "--from", diagnosis, "--out", tmp_path / "s", "--json")["added"][0]["values"]["hub_share"]
        == 0.1
    )


NOT_ADDED = [
    (["magic"], "'magic' is unknown; allowed are"),
    (["bond_softening", "--set", "warmth=3"], "warmth: unknown parameter; allowed are hot_compliance"),
    (["bond_softening", "--set", "transition=500"], "transition = 500 C: allowed is -40 to 200"),
    (["bond_softening", "--set", "bearing=2"], "bearing = 2: allowed is -1 to 1"),
    (["bond_softening", "--set", "bearing=0.5"], "bearing = 0.5: it counts or chooses; allowed are whole numbers from -1 to 1"),
    (["bond_softening", "--set", "transition"], "not of the form name=value"),
    (["bond_softening", "--set", "transition=hot"], "'hot' is not a number"),
    (["bond_softening", "--set", "transition=nan"], "nan"),
    (["bond_softening", "--set", "bearing=upper"], "bearing: 'upper' is not a number; a bearing, a set or a channel goes by its number"),
    (["bond_softening", "--set", "hot_compliance=200.0001"], "hot_compliance = 200.0001 nm/N: allowed is 0 to 200"),
    (["bond_softening", "--set", "width=1", "width=2"], "--set width=2: width of bond_softening is set twice; each may be once"),
    (["bond_softening", "bond_softening"], "bond_softening: is named twice; an effect is added once"),
    (["bond_softening", "--from", "nowhere.json"], "nowhere.json: cannot be read"),
    (["bond_softening", "--from", str(SCENE / "spindle.toml")], "is not an answer of spindle diagnose"),
    (
        ["ring_growth", "--from", "DIAGNOSIS"],
        "no candidate has effect ring_growth; its candidates are soak_lag, preload_loss, bond_softening",
    ),
]


@pytest.mark.parametrize(("arguments", "said"), NOT_ADDED, ids=[" ".join(a[:3])[-30:] for a, _ in NOT_ADDED])
def test_what_cannot_be_added_leaves_nothing(capsys, tmp_path, diagnosis, arguments, said):
    given = [str(diagnosis) if a == "DIAGNOSIS" else a for a in arguments]
    assert said in refused(capsys, "add", SCENE, *given, "--out", tmp_path / "new")
    assert [p.name for p in tmp_path.iterdir()] == ["diagnosis.json"]


def test_an_effect_is_added_once(capsys, tmp_path):
    answer(capsys, "add", SCENE, "ring_growth", "--out", tmp_path / "one", "--json")
    assert main(["add", str(tmp_path / "one"), "ring_growth", "--out", str(tmp_path / "two")]) == 2
    assert "effects.ring_growth: is there already" in capsys.readouterr().err
    assert not (tmp_path / "two").exists()


def test_nothing_is_left_of_a_scene_that_does_not_load(capsys, monkeypatch, tmp_path):
    """The new scene is read again before it is accepted; here something is wrong with it only then."""

    def refuse(spindle, catalogue):
        raise BadInput(f"{spindle.file}: effects.ring_growth: cannot be")

    monkeypatch.setattr("thermospindle.diagnosis.add.resolved", refuse)
    assert main(["add", str(SCENE), "ring_growth", "--out", str(tmp_path / "new")]) == 2
    assert f"{tmp_path / 'new' / 'spindle.toml'}: effects.ring_growth: cannot be" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
