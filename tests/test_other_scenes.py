"""The whole chain on machines that are not the reference: every verb ends with an answer, and what is identified is what the model has.

Here at the settings a user has, two of them whole scenes of their own; `test_matrix.py` has short ones, and the physics.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import ROOT, SCENE
from thermospindle.cli import main

SCENES = Path(__file__).parent / "scenes"
SAME = 'arrangement = "back-to-back"       # moving the outer rings apart loads them'
EDITED = {  # the reference with its pair mounted otherwise
    "face_to_face": [(SAME, 'arrangement = "face-to-face"')],
    "tandem": [(SAME, 'arrangement = "tandem"'), ('preload_kind = "rigid"', 'preload_kind = "spring"')],
}
NAMES = ["symmetric", "inner_turning_spring", *EDITED]


@pytest.fixture(scope="module", params=NAMES)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a scene."""
    if request.param not in EDITED:
        return SCENES / request.param
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    for old, new in EDITED[request.param]:
        assert text.count(old) == 1
        text = text.replace(old, new)
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "spindle.toml").write_text(text, encoding="utf-8")
    return folder


VERBS = {
    "table": "--temperatures 20 30 --speeds 0 7200",
    "modes": "--temperature 30 --speed 7200",
    "runout": "--speed 7200 --path linear --seconds 0.3",
    "warmup": "--speed 7200 --minutes 1",
    "map": "--temperatures 20 30 --speeds 3000 6000",
}


@pytest.mark.parametrize("verb", ["table", "modes", *(pytest.param(v, marks=pytest.mark.slow) for v in ("runout", "map", "warmup"))])
def test_every_verb_answers(scene: Path, verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([verb, str(scene), *VERBS[verb].split(), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["symmetric", *(pytest.param(n, marks=pytest.mark.slow) for n in NAMES[1:])], indirect=True)
def test_identified_modes_are_the_models(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As many as the model has in the band, members of coincident pairs too, each within five standard errors and 0.1 %."""
    assert main(["impact", str(scene), "--temperature", "30", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert main(["modes", str(scene), "--temperature", "30", "--json"]) == 0
    own = [m["frequency_Hz"] for m in json.loads(capsys.readouterr().out)["modes"]]
    found = answer["modes"]
    assert len(found) == len(own)
    for seen, frequency in zip(found, own, strict=True):
        assert seen["frequency_Hz"] == pytest.approx(frequency, abs=5 * seen["frequency_sd_Hz"] + 1e-5 * frequency)


@pytest.mark.slow
def test_a_scene_stands_beside_its_own_tests(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`simulate` and `compare` on pairs, close and coincident: no traceback, and nothing missing where nothing is."""
    campaign = str(tmp_path / "campaign")
    assert main(["simulate", str(scene), "--temperatures", "20", "40", "--out", campaign]) == 0
    capsys.readouterr()
    assert main(["compare", str(scene), campaign, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rms_pull"] < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["run", "report", "diagnose", "ladder"])
def test_long_verbs_answer(scene: Path, verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    campaign = str(tmp_path / "campaign")
    assert main(["simulate", str(scene), "--temperatures", "20", "30", "40", "--out", campaign]) == 0
    given = [campaign] if verb in ("diagnose", "ladder") else ["--temperatures", "20", "40", "--out", str(tmp_path / "out")]
    assert main([verb, str(scene), *given]) == 0
    assert capsys.readouterr().out


def test_nothing_outside_the_repository_is_read() -> None:
    """No test names the folder beside the repository that other people's files once came from."""
    name = "sha" + "red"
    for file in (ROOT / "tests").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        assert f'"{name}"' not in text, file
        assert f"../{name}" not in text, file
