"""The documentation's site: every key has a meaning, nothing told is stale, what `--json` answers
is what is told. It is built by `make docs`."""

import importlib.util
import json
import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.conftest import DATA, ROOT, SCENE
from thermospindle.cli import main

SITE = ROOT / "docs" / "site"
SPEC = importlib.util.spec_from_file_location("site_generated", SITE / "generated.py")
assert SPEC is not None
assert SPEC.loader is not None
generated = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(generated)
ANSWERS = generated.tomllib.loads((SITE / "answers.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("form", ["campaign", "mapping", "study"])
def test_every_key_of_a_file_is_explained(form):
    assert [f"{path} {key}" for path, key in generated.keys(form) if not generated.meaning(form, path, key)] == []


def test_most_keys_of_a_scene_are_explained():
    known = list(generated.keys("scene"))
    assert sum(bool(generated.meaning("scene", *k)) for k in known) > 0.9 * len(known)


@pytest.mark.parametrize("form", ["campaign", "mapping", "study"])
def test_nothing_explained_is_stale(form):
    assert {m.split(".")[-1] for m in generated.MEANINGS[form]} <= {key for _, key in generated.keys(form)}


def test_references_hold_every_key():
    for form in generated.FORMS:
        page = generated.reference(form, "title", "intro")
        assert all(f"| `{key}` |" in page for _, key in generated.keys(form))
        assert "{" not in page.replace("{ ", "")
    assert all(f"## spindle {verb}" in generated.command_line() for verb in ("run", "import", "diagnose"))


@pytest.mark.parametrize(
    ("verb", "arguments"),
    [
        ("table", [SCENE, "--temperatures", 20]),
        ("modes", [SCENE]),
        ("check", [SCENE]),
        ("effects", []),
        ("compare", [SCENE, SCENE / "measured" / "jang_2003"]),
        pytest.param("diagnose", [SCENE, SCENE / "measured" / "jang_2003"], marks=pytest.mark.slow),
    ],
    ids=lambda a: a if isinstance(a, str) else "",
)
def test_answers_have_the_keys_that_are_told(capsys, verb, arguments):
    assert main([verb, *map(str, arguments), "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) == {*ANSWERS[verb], "warnings"}


def test_import_answers_so_too(capsys, tmp_path):
    (tmp_path / "m.toml").write_text('spindle = "rig"\n[[tests]]\nid = "at_rest"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
    arguments = ["import", str(DATA / "amh_isma" / "at_rest.csv"), "--mapping", str(tmp_path / "m.toml"), "--out", str(tmp_path / "c"), "--json"]
    assert main(arguments) == 0
    assert set(json.loads(capsys.readouterr().out)) == {*ANSWERS["import"], "warnings"}


@pytest.mark.slow
def test_every_effect_has_a_picture_of_what_it_does(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(SITE)
    page = generated.effects(tmp_path)
    for effect in generated.CATALOGUE:
        drawn = (tmp_path / f"{effect.name}.svg").read_text(encoding="utf-8")
        assert drawn.count("<path") > 10, effect.name
        assert f"]({effect.name}.svg)" in page


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    pytest.importorskip("sphinx")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(SITE), str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "generated" / "mapping.html").is_file()
    assert dead_links(tmp_path) == []


@pytest.mark.slow
def test_the_tutorial_prints_what_the_program_says(tmp_path, capsys, monkeypatch):
    """Its third and fourth part, line by line; what three dots stand for is left out."""
    monkeypatch.chdir(tmp_path)
    page = (SITE / "tutorial.md").read_text(encoding="utf-8")
    answers = {typed: shown for typed, shown in re.findall(r"\$ (spindle [^\n]+)\n(.*?)(?=```|\n\$ )", page, re.DOTALL)}
    files = sorted(str(f) for f in (DATA / "foreign_bond").glob("*.uff"))
    assert main(["import", *files, "--scene", "hdd_2003", "--mapping", "lab.toml"]) == 0
    assert main(["import", *files, "--scene", "hdd_2003", "--mapping", "lab.toml", "--out", "campaign"]) == 0
    capsys.readouterr()
    for typed in (
        "compare hdd_2003 campaign --out compared",
        "diagnose hdd_2003 campaign --out found",
        "add hdd_2003 bond_softening --from found/diagnosis.json --out mine",
        "compare mine campaign --before hdd_2003",
    ):
        assert main(typed.split()) == 0
        said = " ".join(capsys.readouterr().out.split())
        for piece in re.split(r"\.\.\.", " ".join(answers[f"spindle {typed}"].split())):
            assert piece.strip(" ,") in said, (typed, piece)


def test_links_of_the_repository_lead_somewhere():
    """Pages are read there too: what `make docs` has yet to write is said to be so beside its link."""
    for page in [ROOT / "README.md", ROOT / "CHANGELOG.md", *SITE.glob("*.md")]:
        text = page.read_text(encoding="utf-8")
        for link in re.finditer(r"\]\((?!https?:)([^)#\s]+)", text):
            if link[1].startswith("generated/"):
                assert "`make docs`" in text[link.end() : link.end() + 60], f"{page}: {link[1]}"
            else:
                assert (page.parent / link[1]).exists(), f"{page}: {link[1]}"


def dead_links(site: Path) -> list[str]:
    """What pages link to within the site and is not there: a file, or a place in a page."""
    pages = {page: page.read_text(encoding="utf-8") for page in site.rglob("*.html")}
    places = {page: set(re.findall(r'\bid="([^"]+)"', text)) for page, text in pages.items()}
    dead = []
    for page, text in pages.items():
        for href in set(re.findall(r'<a [^>]*href="([^":]+)"', text)):
            path, _, place = unquote(unescape(href)).partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.is_file() or (place and target in places and place not in places[target]):
                dead.append(f"{page.relative_to(site)}: {href}")
    return dead
