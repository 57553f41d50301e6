"""Every verb's answer to `--json` has the keys that docs/site/answers.toml tells, no more and no less."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import pytest

from tests.conftest import DATA, ROOT, SCENE, coarse_warmups
from thermospindle.cli import main
from thermospindle.options import parsers

ANSWERS = tomllib.loads((ROOT / "docs" / "site" / "answers.toml").read_text(encoding="utf-8"))
MEASURED = SCENE / "measured" / "jang_2003"
SERVED = {"workbench"}  # goes on until it is stopped: tests/report/test_workbench_served.py compares its answer


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A folder with a scene of short hammer tests, a campaign of one runout record, and files of the other kinds that are read."""
    folder = tmp_path_factory.mktemp("answers")
    (folder / "short").mkdir()
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    (folder / "short" / "spindle.toml").write_text(re.sub(r"record_length_s = .*", "record_length_s = 0.10", text), encoding="utf-8")
    say("simulate", SCENE, "--runout", "--temperatures", 20, "--speeds", 7200, "--seconds", 0.1, "--out", folder / "runout")
    (folder / "mapping.toml").write_text('spindle = "rig"\n[[tests]]\nid = "at_rest"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
    (folder / "study.toml").write_text('title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20]\ndraws = 12\n')
    shutil.copytree(MEASURED, folder / "fleet" / "one")
    shutil.copytree(MEASURED, folder / "fleet" / "two")
    (folder / "fleet.toml").write_text('title = "t"\nkind = "fleet"\nscene = "hdd_2003"\ncampaigns = ["fleet/*"]\n')
    (folder / "designs.toml").write_text('title = "t"\nkind = "comparison"\nscenes = ["hdd_2003", "mk7702"]\ntemperatures_C = [20]\n')
    drift = [{"temperature_C": t, "speed_rpm": 0.0, "relative": -0.001 * (t - 20), "sd": 0.001} for t in (20.0, 30.0, 40.0, 50.0, 60.0)]
    (folder / "drift.json").write_text(json.dumps({"where": [{"element": "mount axial stiffness", "unit": "%", "change": drift}]}))
    return folder


def say(*arguments: object) -> None:
    assert main([*map(str, arguments)]) == 0


QUICK: dict[str, tuple[list[object], list[str]]] = {
    "table": (["table", SCENE, "--temperatures", 20], ["table"]),
    "table of several speeds": (["table", SCENE, "--temperatures", 20, "--speeds", 0, 7200], ["table", "table, and with several speeds"]),
    "modes": (["modes", SCENE], ["modes"]),
    "static": (["static", SCENE], ["static"]),
    "check": (["check", SCENE], ["check"]),
    "effects": (["effects"], ["effects"]),
    "effects of a scene": (["effects", "--scene", SCENE], ["effects", "effects, and with --scene"]),
    "an effect": (["effects", "unbalance"], ["effects, of one effect"]),
    "an effect in a scene": (["effects", "unbalance", "--scene", SCENE], ["effects, of one effect", "effects, of one effect with --scene"]),
    "impact": (["impact", "MADE/short", "--hits", 1], ["impact"]),
    "simulate": (["simulate", "MADE/short", "--temperatures", 20, "--hits", 1, "--element", "reduced", "--out", "OUT"], ["simulate"]),
    "runout": (["runout", SCENE, "--path", "linear", "--seconds", 0.2], ["runout"]),
    "map": (["map", SCENE, "--temperatures", 20, 26, "--speeds", 3600, 7200], ["map"]),
    "new": (["new", "mine", "--like", "hdd", "--out", "OUT"], ["new"]),
    "add": (["add", SCENE, "unbalance", "--out", "OUT"], ["add"]),
    "import": (["import", DATA / "amh_isma" / "at_rest.csv", "--mapping", "MADE/mapping.toml", "--out", "OUT"], ["import"]),
    "import, a form": (["import", DATA / "amh_isma" / "at_rest.csv", "--mapping", "OUT.toml"], ["import, of a form to fill in"]),
    "compare": (["compare", SCENE, MEASURED], ["compare"]),
    "compare twice": (["compare", SCENE, MEASURED, "--before", SCENE], ["compare", "compare, and with --before"]),
    "compare runout": (["compare", SCENE, "MADE/runout"], ["compare, of runout alone"]),
    "draft": (["draft", "MADE/drift.json", "--out", "OUT.py"], ["draft"]),
    "study": (["study", "MADE/study.toml", "--out", "OUT"], ["study"]),
    "study of designs": (["study", "MADE/designs.toml", "--out", "OUT"], ["study, of a comparison"]),
    "study of a fleet": (["study", "MADE/fleet.toml", "--out", "OUT"], ["study, of a fleet"]),
    "diagnose runout": (["diagnose", SCENE, "MADE/runout"], ["diagnose, of runout alone"]),
}
LONG: dict[str, tuple[list[object], list[str]]] = {
    "run": (["run", SCENE, "--temperatures", 20, 26, "--hits", 1, "--out", "OUT"], ["run"]),
    "report": (["report", SCENE, "--temperatures", 20, 26, "--hits", 1, "--out", "OUT"], ["report"]),
    "ladder": (["ladder", SCENE, MEASURED, "--effects", "bond_softening"], ["ladder"]),
    "diagnose": (["diagnose", SCENE, MEASURED], ["diagnose"]),
}


@pytest.mark.parametrize("case", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in LONG)])
def test_answers_have_the_keys_that_are_told(case, made, tmp_path, capsys) -> None:
    words, forms = (QUICK | LONG)[case]
    arguments = [str(w).replace("MADE", str(made)).replace("OUT", str(tmp_path / "out")) for w in words]
    assert keys_of(capsys, *arguments) == {"warnings"}.union(*(ANSWERS[form] for form in forms))


def keys_of(capsys, *arguments: str) -> set[str]:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return set(json.loads(capsys.readouterr().out))


@pytest.mark.parametrize(
    ("words", "log", "form"),
    [
        pytest.param(["run", "MADE/short", "--temperatures", 20, "--hits", 1], "run.rrd", "inspect", marks=pytest.mark.slow),
        pytest.param(["map", SCENE, "--temperatures", 20, 26, "--speeds", 3600, 7200], "map.rrd", "inspect, of a resonance map", marks=pytest.mark.slow),
        pytest.param(["runout", SCENE, "--path", "linear", "--seconds", 0.2], "runout.rrd", "inspect, of runout", marks=pytest.mark.slow),
        pytest.param(["impact", "MADE/short", "--hits", 1], "impact.rrd", "inspect", marks=pytest.mark.slow),
        (["warmup", SCENE, "--speed", 3600, "--minutes", 1], "warmup.rrd", "inspect, of a warm-up"),
    ],
    ids=["run", "map", "runout", "impact", "warm-up"],
)
def test_verbs_that_write_logs_answer_and_inspect_by_what_a_log_holds(words, log, form, made, tmp_path, capsys) -> None:
    with coarse_warmups():
        assert keys_of(capsys, *(str(w).replace("MADE", str(made)) for w in words), "--out", str(tmp_path / "out")) == {"warnings", *ANSWERS[words[0]]}
    assert keys_of(capsys, "inspect", str(tmp_path / "out" / log)) == {"warnings", *ANSWERS[form]}


def test_every_verb_is_told_and_tried() -> None:
    _, verbs = parsers()
    assert {form.partition(",")[0] for form in ANSWERS} == set(verbs)
    tried = {str(words[0]) for words, _ in (QUICK | LONG).values()} | {"inspect", "warmup"}
    assert tried | SERVED == set(verbs)
