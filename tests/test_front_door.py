"""The front door: whatever is wrong is one sentence and exit code 2, and a verb is a function that Python calls as the command line does."""

import inspect
import json
import os
import re
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import SCENE
from thermospindle import cli
from thermospindle.cli import main
from thermospindle.model.scene.reading import load
from thermospindle.options import parsers
from thermospindle.report.verbs.states import modes, table

ROOT = Path(__file__).parents[1]
HERE = os.environ | {"PYTHONPATH": str(ROOT)}


def refused(capsys, *arguments):
    """The one sentence a refused call says."""
    try:
        code = main([str(a) for a in arguments])
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert len(captured.err.strip().splitlines()) == 1
    assert captured.err.startswith("spindle: ")
    return captured.err


@pytest.fixture
def scene(tmp_path):
    """A copy of the scene's file with some text replaced."""

    def changed(*pairs, count=1):
        text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
        for old, new in pairs:
            assert re.search(old, text)
            text = re.sub(old, new, text, count=count)
        (tmp_path / "s").mkdir(exist_ok=True)
        (tmp_path / "s" / "spindle.toml").write_text(text, encoding="utf-8")
        return tmp_path / "s"

    return changed


# ---------------------------------------------------------------- parsing


def test_every_option_is_an_argument_of_its_verb():
    _, verbs = parsers()
    assert len(verbs) == 22
    for parser in verbs.values():
        module, function = parser.get_default("verb")
        arguments = inspect.signature(getattr(import_module(f"thermospindle.report.verbs.{module}"), function)).parameters
        options = {a.dest: a for a in parser._actions if a.dest not in ("help", "json")}
        assert set(options) == set(arguments)
        for name, argument in arguments.items():
            assert options[name].required == (argument.default is inspect.Parameter.empty) or options[name].nargs == "?"


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion_knows_every_verb(capsys, shell):
    with pytest.raises(SystemExit) as ended:
        cli.main(["--completion", shell])
    assert ended.value.code == 0
    script = capsys.readouterr().out
    assert all(verb in script for verb in parsers()[1])
    assert "held-out" in script


def test_version_and_help_start_quickly():
    """They import nothing that computes: half a second on an idle machine, of processor time here."""
    for arguments in (["--version"], ["--help"], []):
        before = os.times()
        done = subprocess.run([sys.executable, "-m", "thermospindle.cli", *arguments], cwd=ROOT, env=HERE, capture_output=True, text=True)
        after = os.times()
        assert done.returncode == 0
        assert "spindle" in done.stdout
        assert after.children_user + after.children_system - before.children_user - before.children_system < 0.5
    script = "import sys, thermospindle.cli; print(*({'numpy', 'scipy', 'mujoco', 'rich'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", script], cwd=ROOT, env=HERE, capture_output=True, text=True).stdout == "\n"


def test_stopped_while_it_is_loaded():
    """Ctrl-C before the command line stands is no traceback either."""
    script = (
        "import sys\n"
        "class Stop:\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'thermospindle.cli': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Stop())\n"
        "from thermospindle.__main__ import main\n"
        "sys.exit(main())\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, env=HERE, capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr == "spindle: stopped; nothing was left half written\n"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["efects"], "verb 'efects' is unknown; did you mean effects?"),
        (["add", "hdd_2003", "drift.py", "--out", "nowhere"], "effect 'drift.py' is a file; --effect drift.py reads it, and the effect is named by its name"),
        (["effects", "bond"], "effect 'bond' is unknown; did you mean bond_softening?"),
        (["modes", SCENE, "--sped", "3"], "--sped is no option of modes; did you mean --speed?"),
        (["add", SCENE, "added_disk", "--set", "mas=3", "--out", "nowhere"], "unknown parameter; did you mean mass?"),
        (["modes", SCENE, "--speed", "1e300"], "at most 1e+08 rpm can be computed with"),
        (["modes", SCENE, "--speed", "-1e9"], "at most 1e+08 rpm"),
        (["modes", SCENE, "--temperature", "1e300"], "at most 10000 C can be computed with"),
        (["modes", SCENE, "scenes/mk7702"], "'scenes/mk7702' is one too many: modes takes SCENE"),
        (["table", SCENE, "--temperatures", "20,60"], "'20,60' is not a number; several stand apart by spaces"),
        (["modes", SCENE, "--highest", "-5"], "--highest -5: must be positive"),
        (["modes", SCENE, "--highest", "0"], "--highest 0: must be positive"),
        (["impact", SCENE, "--seed", "-1"], "-1 is not a whole number"),
        (["runout", SCENE, "--speed", "7200", "--seed", "-1"], "-1 is not a whole number"),
        (["impact", SCENE, "--level", "1e308"], "at most 1e+06 N"),
        (["impact", SCENE, "--hits", "10000000"], "count of one or more, up to 1000"),
        (["runout", SCENE, "--speed", "1e-9"], "at least 0.001 rpm, or 0"),
        (["runout", SCENE, "--speed", "7200", "--seconds", "1e9"], "at most 100 s"),
        (["runout", SCENE, "--speed", "1e6", "--seconds", "0.01"], "take a shorter step, or --path linear"),
        (["warmup", SCENE, "--minutes", "1e12"], "at most 100000 min"),
        (["map", SCENE, "--multiples", "100000"], "up to 100"),
        (["modes", "n" * 5000], "File name too long"),
        (["table", SCENE, "--temperatures", "20", "--out", "/proc/x"], "/proc"),
        (["inspect", "nowhere.rrd"], "no such file"),
    ],
    ids=lambda a: " ".join(map(str, a))[-40:] if isinstance(a, list) else None,
)
def test_refused_in_one_sentence(capsys, arguments, said):
    assert said in refused(capsys, *arguments)


def test_lines_faster_than_the_integration_step_show_by_the_linear_path(capsys, scene):
    """At a million rpm the balls' lines lie at 289 kHz; nothing is integrated there, so the step does not matter."""
    assert main(["runout", str(scene()), "--speed", "1e6", "--path", "linear", "--seconds", "0.001", "--json"]) == 0
    lines = json.loads(capsys.readouterr().out)["lines"]
    assert any(line["frequency_Hz"] == pytest.approx(1e6 / 60, rel=1e-3) for line in lines)


def test_a_misspelt_key_is_told_the_one_meant(capsys, scene):
    assert "did you mean preload_N?" in refused(capsys, "modes", scene(("preload_N =", "preload_n =")))


def test_a_closed_pipe_is_no_error():
    command = f"{sys.executable} spindle.py table {SCENE} --temperatures 20 --json | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, env=HERE, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("more", ["", "--json"])
def test_a_closed_output_is_no_error(more):
    done = subprocess.run(["bash", "-c", f"{sys.executable} spindle.py effects unbalance {more} >&-"], cwd=ROOT, env=HERE, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


def test_a_full_disk_is_one_sentence():
    with open("/dev/full", "w") as full:
        arguments = [sys.executable, "spindle.py", "effects", "--json"]
        done = subprocess.run(arguments, cwd=ROOT, env=HERE, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == "spindle: No space left on device\n"


def test_lack_of_memory_is_one_sentence(capsys, monkeypatch):
    def full(*_, **__):
        raise MemoryError("Unable to allocate 3 TiB")

    monkeypatch.setattr("thermospindle.report.verbs.states.operating_point", full)
    assert "not enough memory for what was asked (Unable to allocate 3 TiB)" in refused(capsys, "modes", SCENE)


# ---------------------------------------------------------------- verbs from Python, warnings


def test_a_verb_is_a_function(tmp_path):
    answer = modes(SCENE, temperature=20, out=tmp_path / "m")
    assert answer.values["warnings"] == []
    assert (tmp_path / "m" / "modes.csv").is_file()


def test_speeds_that_change_nothing_say_why(scene):
    assert "bearing_pair.ball_inertia = 1" in table(SCENE, [20.0], [0.0, 7200.0]).values["warnings"][0]
    assert table(SCENE, [20.0], [0.0]).values["warnings"] == []
    own = scene((r'(?m)^turning_ring = "outer"', 'turning_ring = "outer"\nball_inertia = 1.0'))
    assert table(own, [20.0], [0.0, 7200.0]).values["warnings"] == []


def test_limits_of_sense_warn(capsys, scene):
    said = modes(SCENE, temperature=500).values["warnings"]
    assert len(said) == 1
    assert said[0].startswith("500 C lies outside -40 to 120 C")
    [said] = modes(SCENE, speed_rpm=1e6).values["warnings"][:1]
    assert "speed factor n dm" in said
    pressed = scene((r"preload_N = [\d.]+", "preload_N = 16000.0"), (r"diametral_clearance_mm = .*", "diametral_clearance_mm = [-1, 1]"))
    assert any("pressed in by" in w for w in modes(pressed).values["warnings"])
    assert main(["modes", str(SCENE), "--temperature", "150", "--json"]) == 0
    assert capsys.readouterr().err.startswith("spindle: warning: 150 C lies outside")


def test_runout_of_nothing_hints(capsys, scene):
    bare = scene((r"(?s)\n\[imperfections\].*\Z", "\n"))
    assert main(["runout", str(bare), "--speed", "7200", "--path", "linear"]) == 0
    captured = capsys.readouterr()
    assert "--seed 1 draws plausible ones" in captured.err
    assert "Strongest lines" not in captured.out


# ---------------------------------------------------------------- terminal


LONG = [pytest.param([verb], marks=pytest.mark.slow, id=verb) for verb in ("warmup", "map")]
SHORT = [pytest.param(verb.split(), id=verb) for verb in ("table", "modes", "runout --speed 7200 --path linear")]


@pytest.mark.parametrize("verb", SHORT + LONG)
def test_names_are_no_markup_and_nothing_is_cut_off(capsys, scene, verb):
    """80 columns, a bearing called [/x]: MarkupError, or … in place of digits, before."""
    named = scene((r"bearings\.lower", 'bearings."[/x] [red]"'), count=0)
    assert main([verb[0], str(named), *verb[1:]]) == 0
    text = capsys.readouterr().out
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= 80
    assert verb[0] in ("modes",) or "[/x]" in text


def test_a_campaign_folder_may_look_like_markup(capsys, tmp_path, scene):
    small = scene((r"record_length_s = .*", "record_length_s = 0.10"), (r"hits = .*", "hits = 1"))
    out = tmp_path / "x[" / "b]y"
    assert main(["simulate", str(small), "--temperatures", "20", "--out", str(out)]) == 0
    assert f"{out}: 1 tests: T20_n0" in capsys.readouterr().out


# ---------------------------------------------------------------- scenes at the edge


def test_one_hit_is_enough(capsys, scene):
    """A single hit has no scatter, so no standard errors: FRFs go without them, and `run` no longer fails at the end."""
    small = scene((r"record_length_s = .*", "record_length_s = 0.10"))
    out = small.parent / "c"
    assert main(["simulate", str(small), "--temperatures", "20", "--hits", "1", "--out", str(out)]) == 0
    assert main(["compare", str(SCENE), str(out), "--json"]) == 0
    capsys.readouterr()


def test_a_hammer_without_force_in_the_band_is_refused_before_simulating(capsys, scene):
    """100 g on a tip of 6e6 N/m: the pulse's first zero lies at 3698 Hz, where FRFs were noise and the driving point 'negative'."""
    soft = scene((r"hammer_mass_g = .*", "hammer_mass_g = 100.0"), (r"band_Hz = .*", "band_Hz = [50, 4000]"))
    start = time.perf_counter()
    assert "this hammer gives no force above 3698 Hz, band_Hz goes to 4000 Hz" in refused(capsys, "impact", soft)
    assert time.perf_counter() - start < 20


EDGE = [
    ("reference_temperature_C = .*", "reference_temperature_C = 2e101", "reference_temperature_C"),
    ("youngs_modulus_GPa = .*", "youngs_modulus_GPa = 1e300", "youngs_modulus_GPa"),
    ("youngs_modulus_GPa = .*", "youngs_modulus_GPa = 1e-9", "must lie between 0.001 and 2000"),
    ("poisson_ratio = .*", "poisson_ratio = 0.4999999", "poisson_ratio"),
    ("thermal_expansion_um_per_m_K = .*", "thermal_expansion_um_per_m_K = 1.7e308", "thermal_expansion_um_per_m_K"),
    ("density_kg_per_m3 = .*", "density_kg_per_m3 = 1e300", "density_kg_per_m3"),
    ("balls = .*", "balls = 0x" + "f" * 4000, "balls = a int too long to be written"),
    ("balls = .*", "balls = 1" + 79 * "0", "less than or equal to 1000"),
    ("node = 1\n", "node = 0x" + "f" * 4000 + "\n", "node"),
    ("mass_kg = .*", "mass_kg = 1e-300", "mass_kg"),
    ("preload_N = .*", "preload_N = 1e9", "less than or equal to 10000000"),
    ("preload_N = .*", 'preload_N = "16"', "valid number"),
    ("record_length_s = .*", "record_length_s = 1e-4", "modes need 50 at least"),
    ("record_length_s = .*", "record_length_s = 1e6", "record_length_s"),
    ("band_Hz = .*", "band_Hz = [1000, 1000.5]", "modes need 50 at least"),
    ("step_us = .*", "step_us = 1e-9", "steps of integration"),
    ("hits = .*", "hits = 1000000", "less than or equal to 1000"),
    ("exponential_end = .*", "exponential_end = 1e-300", "exponential_end"),
    ("level_N = .*", "level_N = 1e9", "level_N"),
    ("position_mm = .*", "position_mm = [1e300, 0, 0]", "position_mm"),
    ("r_mm = .*", "r_mm = [0, 1e9]", "r_mm"),
    (r"\Z", "\nx = " + 2000 * "[" + 2000 * "]", "nested too deep"),
    (r"\Z", "\nx = " + 5000 * "1", "not a TOML file"),
]


@pytest.mark.parametrize(("old", "new", "said"), EDGE, ids=[f"{e[0][:12]} {e[1][-12:]}".strip() for e in EDGE])
def test_numbers_that_cannot_be_computed_with_are_refused(capsys, scene, old, new, said):
    message = refused(capsys, "modes", scene((old, new)))
    assert said in message
    assert len(message) < 600


def test_a_scene_has_a_limit_of_regions(capsys, scene):
    more = "".join(f'\n[[section.regions]]\nname = "g{i}"\npart = "rotating"\nmaterial = "steel"\nr_mm = [1, 2]\nz_mm = [1, 2]\n' for i in range(301))
    assert "at most 300" in refused(capsys, "modes", scene((r"\Z", more)))


@pytest.mark.parametrize("name", ["modes.csv", "campaign.toml"])
def test_a_pipe_is_no_file(capsys, tmp_path, name):
    (tmp_path / "c").mkdir()
    source = (SCENE / "measured" / "jang_2003" / "campaign.toml").read_text()
    (tmp_path / "c" / "campaign.toml").write_text(source)
    (tmp_path / "c" / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / "c" / name)
    assert "no such file" in (said := refused(capsys, "compare", SCENE, tmp_path / "c")) or "no campaign there" in said


# ---------------------------------------------------------------- other files


DAMAGED = [
    '{"candidates": [{"effects": [3], "parameters": {}}]}',
    '{"candidates": [{"effects": [["preload_loss"]], "parameters": {}}]}',
    '{"candidates": [], "tolerances": {"a": {"value": 1' + 400 * "0" + "}}}",
    '{"candidates": [], "tolerances": {"a": {"value": NaN}}}',
    '{"candidates": [{"effects": ["preload_loss"], "parameters": {"loss": {"value": 1' + 400 * "0" + "}}}]}",
    '{"candidates": [{"effects": ["preload_loss"], "parameters": {"loss": {"value": Infinity}}}]}',
    100000 * "[",
]


@pytest.mark.parametrize("text", DAMAGED, ids=lambda t: t[:60])
def test_answers_of_another_form_are_refused(capsys, tmp_path, text):
    (tmp_path / "d.json").write_text(text)
    said = refused(capsys, "add", SCENE, "preload_loss", "--from", tmp_path / "d.json", "--out", tmp_path / "n")
    assert "is not an answer of spindle diagnose" in said or "must be a finite number" in said


def test_a_log_that_aborts_its_reader_is_refused(capsys, tmp_path, monkeypatch):
    """The native library kills its process on some damaged logs; a child process dies in place of this one."""
    from thermospindle.report.log import read

    (tmp_path / "a.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr(read, "TRIAL", "import os; os.abort()")
    assert "a.rrd: is damaged; the library that reads Rerun logs breaks off on it" in refused(capsys, "inspect", tmp_path / "a.rrd")


def test_the_stiffness_table_is_finite(tmp_path):
    from thermospindle.model.bearing.stiffness_table import read_table
    from thermospindle.model.errors import BadInput

    table(SCENE, [20.0], out=tmp_path / "t")
    file = tmp_path / "t" / "table.csv"
    lines = file.read_text().splitlines()
    (tmp_path / "a.csv").write_text("\n".join([*lines[:3], lines[3].rsplit(",", 1)[0] + ",inf", *lines[4:]]))
    with pytest.raises(BadInput, match="infinite"):
        read_table(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text("\n".join(lines[:3]))
    with pytest.raises(BadInput, match="gaps"):
        read_table(tmp_path / "b.csv")


def test_a_loose_hub_has_no_nan(recwarn):
    """Bearings without contact hold nothing: a free body does not oscillate, and its share of strain energy was 0 / 0."""
    from dataclasses import replace

    from thermospindle.model.machine import Condition
    from thermospindle.model.rotor.chain import matrices
    from thermospindle.model.rotor.modes import modes as modes_of
    from thermospindle.sim.operating import operating_point

    chain = operating_point(load(SCENE), Condition(20.0)).chain
    loose = replace(chain, elements=tuple(replace(e, stiffness=0 * e.stiffness, damping=0 * e.damping) if e.group == "bearings" else e for e in chain.elements))
    assert matrices(loose).stiffness.shape == matrices(chain).stiffness.shape
    found = modes_of(loose)
    assert found
    assert all(m.frequency > 1 and np.isclose(sum(m.energy.values()), 1) for m in found)
    assert not recwarn.list
