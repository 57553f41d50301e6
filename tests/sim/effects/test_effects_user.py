"""A user's own effect, from a file or an installed package: the example of the documentation, and every way to get one wrong."""

import json
import pickle
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT, SCENE
from tests.diagnosis.test_diagnose import tables
from thermospindle.cli import main
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Addition, Condition
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.scene.reading import load
from thermospindle.report.text.diagnosis.answer import diagnosis_json
from thermospindle.sim.effects import CATALOGUE, by_name, of_scene, own_effects, resolved
from thermospindle.sim.effects import own as effect_file
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.effects.known import catalogue, equipped
from thermospindle.sim.effects.rules import check
from thermospindle.sim.operating import operating_point

FILE = ROOT / "docs" / "air_film.py"
TEXT = FILE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def film():
    return effect_file.effect_of(FILE)


# ---------------------------------------------------------------- the example


def test_the_documentation_shows_the_file_whole_and_it_is_under_40_lines():
    page = (ROOT / "docs" / "site" / "own_effect.md").read_text(encoding="utf-8")
    assert "{literalinclude} ../air_film.py" in page
    assert len(TEXT.splitlines()) < 40


@pytest.mark.parametrize(
    ("matrices", "said"),
    [
        ("np.zeros((6, 6)), damping", "gives element 'air film' a stiffness of shape (6, 6), float64; it must be (5, 5) real numbers"),
        ("np.zeros((5, 5)), 1j * damping", "gives element 'air film' a damping of shape (5, 5), complex128; it must be (5, 5) real numbers"),
        ("[[1.0], [1.0, 2.0]], damping", "gives element 'air film' a stiffness that is no matrix"),
        ("exit(3), damping", "raises SystemExit: 3"),
    ],
)
def test_matrices_that_no_chain_has_are_one_sentence(tmp_path, capsys, matrices, said):
    file = tmp_path / "film.py"
    file.write_text(TEXT.replace("np.zeros((5, 5)), damping", matrices), encoding="utf-8")
    assert main(["add", str(SCENE), "air_film", "--effect", str(file), "--out", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert re.search(r"film.py:\d+: effect air_film: its chain ", error)
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "new").exists()


def test_what_an_effect_prints_is_no_part_of_the_answer(tmp_path):
    """By itself, by what it starts, and in the processes that work for a verb: with --json standard output is one object."""
    file = tmp_path / "film.py"
    file.write_text(TEXT.replace("    c = values", "    print('in chain')\n    c = values") + "\nimport os\nprint('hello')\nos.system('echo sub')\n", encoding="utf-8")
    command = [sys.executable, str(ROOT / "spindle.py"), "add", str(SCENE), "air_film", "--effect", str(file), "--out", str(tmp_path / "new"), "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert json.loads(done.stdout)["added"][0]["effect"] == "air_film"
    assert {"hello", "sub", "in chain"} <= {*done.stderr.splitlines()}


def test_damping_of_the_film_from_reynolds_equation(film):
    """h^3 / (12 mu) p'' = velocity across a strip of width b, p = 0 at its edges, summed by finite differences."""
    mu, gap, width, radius = 1.81e-5, 14.2e-6, 1.5e-3, 15e-3
    n = 400
    _, step = np.linspace(0, width, n + 1, retstep=True)
    second = (np.diag(np.full(n - 1, -2.0)) + np.diag(np.ones(n - 2), 1) + np.diag(np.ones(n - 2), -1)) / step**2
    pressure = np.linalg.solve(second, np.full(n - 1, -12 * mu / gap**3))
    force = pressure.sum() * step * 2 * np.pi * radius  # of the whole ring at 1 m/s
    assert force == pytest.approx(2 * np.pi * radius * mu * width**3 / gap**3, rel=1e-4)
    assert force == pytest.approx(2.0, rel=0.02)  # N s/m, what the file's source says
    azimuth = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    assert np.mean((radius * np.cos(azimuth)) ** 2) == pytest.approx(radius**2 / 2)  # tilt at 1 rad/s


@pytest.mark.parametrize(("temperature", "viscosity"), [(20.0, 1.0), (60.0, 19.99 / 18.13)])
def test_the_film_in_the_matrices(spindle, film, temperature, viscosity):
    """Viscosity of air 18.13 and 19.99 uPa s at 20 and 60 C: Lemmon, Jacobsen, Int. J. Thermophysics 25 (2004) 21-69."""
    values = {"damping": 2.0, "radius": 12.0}
    chains = [operating_point(spindle, Condition(temperature), e).chain for e in ([], [(film, values)])]
    before, after = (matrices(c) for c in chains)
    change = after.damping - before.damping
    hub = [after.dofs.index(("hub", move)) for move in ("x", "y", "z", "tilt_x", "tilt_y")]
    axial, tilt = 2.0 * viscosity, 2.0 * viscosity * 12e-3**2 / 2
    assert np.diag(change)[hub] == pytest.approx([0, 0, axial, tilt, tilt], rel=5e-3)
    free = np.zeros(len(after.dofs))
    free[[i for i, (_, move) in enumerate(after.dofs) if move == "z"]] = 1.0
    assert np.abs(change @ free).max() < 1e-9 * axial  # moving all together squeezes nothing
    assert np.array_equal(after.stiffness, before.stiffness)


def test_the_film_keeps_the_rules(spindle, film):
    check(film, spindle, catalogue([FILE]), film.where)


@pytest.mark.slow
def test_a_hidden_film_is_named(spindle, film):
    """On mode tables with errors, beside catalogue effects on damping."""
    made = tables(spindle, [(film, film.typical() | {"damping": 4.0})], 6000.0, 11)
    found = diagnose(spindle, made, (film, *(by_name(n) for n in ("grease_damping", "window_damping"))))
    assert (found.verdict.word, found.verdict.effects) == ("identified", ("air_film",))
    fitted = diagnosis_json(found)["candidates"][0]["parameters"]["air_film.damping"]
    assert fitted["value"] == pytest.approx(4.0, abs=max(0.4, 4 * fitted["sd"]))
    assert found.verdict.candidates[0].hypothesis.mechanisms[0].effect == film


# ---------------------------------------------------------------- found, and sent to other processes


def _damping_of(effect):
    return effect.chain.function.__module__, effect.typical(), effect


def test_a_file_is_run_once_and_travels(film):
    """To a process that has never seen the file, and back as what was sent."""
    assert effect_file.effect_of(FILE) is film
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        module, values, again = pool.submit(_damping_of, film).result()
    assert module.startswith("effect_")
    assert values == film.typical()
    assert again is film


def test_a_scene_finds_the_users_effect_and_says_when_it_cannot(spindle, film):
    with_film = replace(spindle, effects=(Addition("air_film", {"damping": 2.0}),))
    with pytest.raises(BadInput, match=r"spindle\.toml: effects\.air_film: is not in the catalogue.*--effect FILE\.py"):
        of_scene(with_film)
    with pytest.raises(BadInput, match=r"effects\.air_film: is not in the catalogue"):
        resolved(with_film, CATALOGUE)
    found, known = equipped(with_film, [FILE])
    assert known == (*CATALOGUE, film)
    assert of_scene(found) == [(film, {"damping": 2.0, "radius": 15.0})]
    assert of_scene(pickle.loads(pickle.dumps(found))) == of_scene(found)
    alone, damped = (operating_point(s, Condition(20.0)).modes[4].damping_ratio for s in (spindle, found))
    assert damped > 1.1 * alone


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A function that installs a package with an effect, as pip would leave it."""

    def install(text):
        (tmp_path / "airy_spindles.py").write_text(text)
        info = tmp_path / "airy_spindles-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: airy-spindles\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text("[thermospindle.effects]\nfilm = airy_spindles:EFFECT\n")
        monkeypatch.syspath_prepend(tmp_path)
        effect_file.installed.cache_clear()

    yield install
    sys.modules.pop("airy_spindles", None)
    effect_file.installed.cache_clear()


def test_an_installed_effect_needs_no_file(spindle, installed):
    assert own_effects() == ()
    installed(TEXT)
    assert [e.name for e in own_effects()] == ["air_film"]
    with_film = replace(spindle, effects=(Addition("air_film", {}),))
    assert of_scene(with_film)[0][0].where == "entry point film = airy_spindles:EFFECT of airy-spindles"
    assert of_scene(equipped(with_film)[0])[0][0].name == "air_film"
    with pytest.raises(BadInput, match=r"air_film\.py: effect 'air_film': the name is taken by entry point film"):
        own_effects([FILE])


def test_a_broken_installed_effect_is_named(spindle, installed):
    installed("import nonsense\n")
    with pytest.raises(BadInput, match="entry point film = airy_spindles:EFFECT of airy-spindles: raises ModuleNotFoundError"):
        own_effects()


def test_an_installed_effect_names_its_line(spindle, installed, tmp_path):
    text = TEXT.replace("    if c == 0.0:", "    c = 1 / 0\n    if c == 0.0:")
    installed(text)
    with pytest.raises(
        BadInput, match=rf"^entry point film .*{tmp_path / 'airy_spindles.py'}:{line_of(text, '1 / 0')}: effect air_film: its chain"
    ):
        equipped(spindle)


# ---------------------------------------------------------------- what is wrong with a file


def line_of(text, part):
    return next(i for i, line in enumerate(text.splitlines(), 1) if part in line)


@pytest.fixture
def refused(tmp_path):
    """A function that writes a file and gives the sentence with which it is refused."""

    def sentence(text):
        file = tmp_path / "mine.py"
        file.write_text(text)
        with pytest.raises(BadInput) as error:
            equipped(load(SCENE), [file])
        said = str(error.value)
        assert said.startswith((str(file), f"--effect {file}"))
        assert "\n" not in said
        return said.removeprefix(str(file))

    return sentence


FAILS = [
    ("syntax", "def chain(", "def chain((", "raises SyntaxError"),
    ("import", "import numpy as np", "import nonsense", "raises ModuleNotFoundError: No module named 'nonsense'"),
    ("misspelt-key", "valid=", "valids=", "raises TypeError"),
    ("exit", "import numpy as np", "import numpy as np; raise SystemExit(3)", "raises SystemExit: 3"),
]


@pytest.mark.parametrize(("old", "new", "said"), [f[1:] for f in FAILS], ids=[f[0] for f in FAILS])
def test_a_file_that_does_not_run_names_its_line(refused, old, new, said):
    text = TEXT.replace(old, new, 1)
    assert text != TEXT
    first = {"valid=": "EFFECT = Effect("}.get(old, new)
    assert re.match(rf":{line_of(text, first)}: {re.escape(said)}", refused(text))


def test_no_effect_in_a_file(refused, tmp_path):
    assert "defines no EFFECT" in refused("x = 1\n")
    with pytest.raises(BadInput, match="it is a folder; it must be a Python file that defines EFFECT"):
        own_effects([tmp_path])
    with pytest.raises(BadInput, match=r"--effect nowhere\.py: no such file"):
        own_effects([Path("nowhere.py")])
    other = tmp_path / "other.py"
    other.write_text("EFFECT = ()\n")
    with pytest.raises(BadInput, match="EFFECT is a tuple"):
        own_effects([other])


HOOKED = [
    ("raises", '    if c == 0.0:', '    c = c / values["dampling"]\n    if c == 0.0:', "c / values", "its chain raises KeyError: 'dampling'"),
    ("arguments", "def chain(spindle, condition, values, chain):", "def chain(spindle, values, chain):", "def chain", "raises TypeError"),
    ("returns", "replace(chain, elements=(*chain.elements, film))", "(chain, film)", "def chain", "its chain returned tuple; it must return RotorBase"),
    ("body", "*ends, magnet", '"ground", "lid", magnet', None, "the element 'air film' ends at 'lid'; allowed are ground, base"),
    ("not-finite", "    if c == 0.0:", "    c = c * float('nan') if c else c\n    if c == 0.0:", None, "are not finite"),
    ("not-neutral", "    if c == 0.0:", "    if c < 0.0:", None, "chain must return the object it was given when every parameter is neutral"),
    ("almost-neutral", "    if c == 0.0:", '    c += 1e-9 * (values["radius"] > 14.0)\n    if c == 0.0:', None, "(damping = 0, radius = 15)"),
    ("idle", 'values["radius"] * 1e-3', "15e-3", None, "parameter radius: from 15 to 16 mm it moves"),
    ("not-symmetric", "np.zeros((5, 5)), damping", "np.diag([0, 0, 0, 1e3], 1) * bool(c), damping", None, "MuJoCo's model of it"),
    ("changes-its-input", "    if c == 0.0:", "    if c:\n        spindle.materials['air'] = spindle.materials['steel']\n    if c == 0.0:", None, "changes the spindle it is given"),
    ("no-hook", "chain=chain,", "", None, "has no function; it needs one of condition, spindle, temperatures"),
    ("name", 'name="air_film"', 'name="air film"', None, "its name must be one word"),
    ("taken", 'name="air_film"', 'name="soak_lag"', None, "the name is taken by the catalogue"),
    ("title", 'title="Squeezed air in the gap under the hub"', 'title=""', None, "title = '': must say it in words"),
    ("resembles", '("grease_damping", "window_damping")', '("greas_damping",)', None, "resembles: 'greas_damping': must name other effects"),
    ("alone", '("grease_damping", "window_damping")', "()", None, "resembles = (): must be a tuple of names"),
    ("unit", '"N s/m"', '""', None, "parameter damping: unit = ''"),
    ("source", '"the rim of the reference spindle\'s hub"', '"me"', None, "parameter radius: source = 'me'"),
    ("beyond", "15.0, 15.0, 1.0, (1.0, 100.0)", "15.0, 15.0, 1.0, (16.0, 100.0)", None, "parameter radius: neutral = 15: must lie within its limits, 16 to 100"),
    ("number", "15.0, 15.0, 1.0, (1.0", "15.0, '15', 1.0, (1.0", None, "parameter radius: neutral, typical, prior_sd and the two limits must be finite"),
    ("no-room", "15.0, 15.0, 1.0, (1.0", "15.0, 15.0, 0.0, (1.0", None, "parameter radius: prior_sd = 0"),
    ("size", "0.0, 2.0, 2.0, (0.0, 50.0)", "2.0, 2.0, 2.0, (0.0, 50.0)", None, "parameter damping: typical = 2: the size of an effect"),
    ("twice", 'Parameter("radius"', 'Parameter("damping"', None, "parameter 'damping': names of parameters must differ"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "said"), [h[1:] for h in HOOKED], ids=[h[0] for h in HOOKED])
def test_every_rule_refuses(refused, request, old, new, line, said):
    text = TEXT.replace(old, new, 1)
    assert text != TEXT
    if request.node.callspec.id == "almost-neutral":  # at neutral values it is what it should be
        text = text.replace("15.0, 15.0, 1.0,", "14.0, 15.0, 1.0,")
    sentence = refused(text)
    assert said in sentence
    if line:
        assert sentence.startswith(f":{line_of(text, line)}: effect air_film")


def test_a_function_that_fails_in_the_middle_of_a_fit_names_its_line(spindle, tmp_path):
    """The rules see three conditions; what fails at a fourth is still one sentence."""
    file = tmp_path / "late.py"
    file.write_text(TEXT.replace("    if c == 0.0:", "    if condition.temperature == 33.0:\n        c = 1 / 0\n    if c == 0.0:"))
    (effect,) = own_effects([file])
    check(effect, spindle, (*CATALOGUE, effect), effect.where)
    with pytest.raises(
        BadInput, match=rf"late\.py:{line_of(file.read_text(), '1 / 0')}: effect air_film: its chain raises ZeroDivisionError"
    ):
        _ = operating_point(spindle, Condition(33.0), [(effect, effect.typical())]).chain


def test_a_dict_keeps_its_keys(spindle):
    broken = Effect(**{f: getattr(by_name("soak_lag"), f) for f in Effect.__dataclass_fields__} | {"temperatures": lambda s, c, v, t: {}})
    with pytest.raises(BadInput, match="temperatures returned the keys ; it must return those it was given, base disc"):
        operating_point(spindle, Condition(40.0), [(effect_file.guarded(broken, "x.py"), broken.typical())])


# ---------------------------------------------------------------- from the command line


def run(capsys, *arguments):
    code = main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return code, json.loads(captured.out) if code == 0 else captured.err


def test_the_command_line_takes_the_file(capsys, tmp_path):
    own = ("--effect", FILE, "--json")
    assert "air_film" in [e["name"] for e in run(capsys, "effects", *own)[1]["effects"]]
    assert run(capsys, "effects", "air_film", *own)[1]["parameters"][0]["unit"] == "N s/m"
    code, said = run(capsys, "add", SCENE, "air_film", "--out", tmp_path / "no")
    assert (code, "effect 'air_film' is unknown" in said) == (2, True)
    code, found = run(capsys, "add", SCENE, "air_film", "--set", "damping=2", "--out", tmp_path / "film", *own)
    assert code == 0
    assert found["added"][0]["values"] == {"damping": 2.0, "radius": 15.0}
    assert "of " + str(FILE) in found["added"][0]["source"]
    for arguments in (("modes",), ("table", "--temperatures", 20)):
        code, said = run(capsys, arguments[0], tmp_path / "film", *arguments[1:], "--json")
        assert code == 2
        assert f"{tmp_path / 'film' / 'spindle.toml'}: effects.air_film: is not in the catalogue" in said
        assert run(capsys, arguments[0], tmp_path / "film", *arguments[1:], *own)[0] == 0
    modes = [run(capsys, "modes", s, *own)[1]["modes"][4]["damping_ratio"] for s in (SCENE, tmp_path / "film")]
    assert modes[1] > 1.1 * modes[0]
