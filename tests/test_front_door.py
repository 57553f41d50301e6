"""The front door: whatever is wrong is one sentence and exit code 2, and a verb is a function that Python calls as the command line does."""

import inspect
import json
import os
import shutil
import subprocess
import sys
from functools import partial
from importlib import import_module
from pathlib import Path

import pytest

from tests.command_line import changed_scene, refused
from tests.conftest import SCENE
from thermospindle import cli
from thermospindle.cli import main
from thermospindle.options import parsers
from thermospindle.report.verbs import running
from thermospindle.report.verbs.states import modes, table

ROOT = Path(__file__).parents[1]
HERE = os.environ | {"PYTHONPATH": str(ROOT)}


@pytest.fixture
def scene(tmp_path):
    return partial(changed_scene, tmp_path)


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


def test_a_scene_is_begun_without_what_computes(tmp_path):
    """`new` took a second of processor time, nearly all of it for libraries that it does not ask."""
    script = (
        "import sys; from thermospindle.cli import main\n"
        f"assert main(['new', 'mine', '--like', 'hdd', '--out', {str(tmp_path / 'mine')!r}]) == 0\n"
        "print(*({'scipy.optimize', 'mujoco', 'skfem', 'matplotlib'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, env=HERE, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == ""
    assert (tmp_path / "mine" / "spindle.toml").is_file()


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
        (["table", SCENE, "--temperatures", "20", "--out", "/proc/x"], "--out /proc/x: No such file or directory; name a place where you may write"),
        (["simulate", SCENE, "--temperatures", "20", "150", "--out", "nowhere"], "--temperatures 150: lower and upper bearing lost contact at 150 C: a spindle that rattles has no FRFs"),
        (["inspect", "nowhere.rrd"], "no such file"),
    ],
    ids=lambda a: " ".join(map(str, a))[-40:] if isinstance(a, list) else None,
)
def test_refused_in_one_sentence(capsys, arguments, said):
    assert said in refused(capsys, *arguments)


def test_what_cannot_be_written_is_refused_before_anything_is_worked_out(capsys, monkeypatch):
    """A simulation of a minute came first."""
    monkeypatch.setattr("thermospindle.report.verbs.chain.simulate", lambda **asked: pytest.fail("computed"))
    said = refused(capsys, "simulate", SCENE, "--out", "/proc/x")
    assert "--out /proc/x: No such file or directory; name a place where you may write" in said


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


def test_runout_of_a_scene_without_imperfections_draws_those_of_the_map(capsys, scene):
    bare = scene((r"(?s)\n\[imperfections\].*\Z", "\n"))
    assert main(["runout", str(bare), "--speed", "7200", "--path", "linear"]) == 0
    captured = capsys.readouterr()
    assert "plausible ones are drawn, of seed 0 as map and report have them" in captured.err
    assert "Strongest lines" in captured.out
    assert main(["runout", str(bare), "--speed", "7200", "--path", "linear", "--seed", "0"]) == 0
    again = capsys.readouterr()
    assert (again.out, "seed 0" in again.err) == (captured.out, False)


def test_a_long_record_of_a_flexible_shaft_says_what_is_quicker(capsys, monkeypatch):
    """A simulated record of a million steps took ten minutes on a busy machine, where the linear answer takes seconds."""
    monkeypatch.setattr(running, "LONG", 1000)
    monkeypatch.setattr(running, "simulated_runout", stopped)
    assert main(["runout", "five_bearing", "--speed", "8000", "--seconds", "0.05"]) == 130
    assert "hint: --path linear" in capsys.readouterr().err
    assert main(["runout", str(SCENE), "--speed", "7200", "--seconds", "0.05"]) == 130
    assert "hint" not in capsys.readouterr().err


def stopped(*asked):
    raise KeyboardInterrupt


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


def test_a_terminal_obeys_nothing_of_a_file(capsys, tmp_path, scene):
    """Escape sequences in a key, a campaign's title, the kind of a mode: written out, not obeyed."""
    assert main(["modes", str(scene((r"\A", '"a\\\\u001b[31mkey" = 1\n')))]) == 2
    assert r"a\x1b[31mkey: unknown key" in capsys.readouterr().err
    shutil.copytree(SCENE / "measured" / "jang_2003", tmp_path / "c")
    for name, old, new in (("campaign.toml", 'title = "', 'title = "\\u001b]0;x\\u0007'), ("modes.csv", "axial", "ax\x1b[31mial")):
        file = tmp_path / "c" / name
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new), encoding="utf-8")
    code = main(["compare", str(SCENE), str(tmp_path / "c"), "--verbose"])
    told = capsys.readouterr()
    assert code in (0, 2), told
    assert "\x1b" not in told.out + told.err
    assert "\x07" not in told.out + told.err
    assert r"\x1b" in told.out + told.err


def test_a_campaign_folder_may_look_like_markup(capsys, tmp_path, scene):
    small = scene((r"record_length_s = .*", "record_length_s = 0.10"), (r"hits = .*", "hits = 1"))
    out = tmp_path / "x[" / "b]y"
    assert main(["simulate", str(small), "--temperatures", "20", "--out", str(out)]) == 0
    assert f"{out}: 1 tests: T20_n0" in capsys.readouterr().out
