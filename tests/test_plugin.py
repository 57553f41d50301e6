"""The pytest plugin and its assertions, by pytest's own tool for plugins."""

import os
import re
import subprocess
import sys
import warnings
from importlib.metadata import entry_points

import numpy as np
import pytest

import thermospindle.front  # noqa: F401 - before pytest's own tool runs tests in this process, and takes away what they import
from tests.conftest import DATA, ROOT, SCENE
from thermospindle.model.errors import BadInput
from thermospindle.testing import (
    Spindles,
    assert_agreement,
    assert_damping,
    assert_frequency,
    assert_frequency_shift,
    assert_margin,
    assert_peak_level,
    assert_split,
)

pytest_plugins = ["pytester"]
THERE = "thermospindle" in {e.name for e in entry_points(group="pytest11")}
PLUGIN = () if THERE else ("-p", "thermospindle.plugin")


def test_a_users_tests(pytester):
    """What holds passes; what does not is told with what moved, by how much, and where the energy is."""
    pytester.makepyfile(
        """
        from thermospindle.testing import assert_frequency_shift

        def test_holds():
            assert_frequency_shift("hdd_2003", mode="rocking 1", from_C=20, to_C=60, shift_Hz=-20, within=2)

        def test_fails():
            assert_frequency_shift("hdd_2003", mode="axial 3", from_C=20, to_C=60, shift_Hz=-20, within=2)

        def test_is_loaded_once(spindle):
            assert spindle("hdd_2003") is spindle("hdd_2003")
            assert spindle.point("hdd_2003", 20) is spindle.point("hdd_2003", 20.0)

        def test_names_no_mode():
            assert_frequency_shift("hdd_2003", mode="rockin 1", from_C=20, to_C=60, shift_Hz=-20, within=2)
        """
    )
    result = pytester.runpytest_inprocess(*PLUGIN, "-p", "no:cacheprovider")
    result.assert_outcomes(passed=2, failed=2)
    result.stdout.fnmatch_lines(
        [
            "*hdd_2003: axial 3 moves by -13.92 Hz from 20 to 60 C; wanted -20 +- 2 Hz",
            "*> axial 3 *2009.98 *1996.06* *-13.92",
            "*strain energy of axial at 2010.0 Hz: flange 58%, plate 30%, * all others *%",
            "*moved by the stiffness of: *",
        ]
    )
    result.stdout.fnmatch_lines(["*mode = 'rockin 1': did you mean rocking 1? hdd_2003 has axial 1 to *"])
    assert "_pair(scene" not in result.stdout.str()
    assert "get_close_matches" not in result.stdout.str()  # nothing of the package's own lines


def test_a_failure_shows_the_mode_and_its_neighbours():
    """Of a flexible shaft's dozens of modes the one asked for, numbered among its kind, and two on each side."""
    with pytest.raises(AssertionError) as failed:
        assert_frequency_shift("mk7702", mode="lateral 6", from_C=20, to_C=30, shift_Hz=-1000, within=1)
    rows = [line for line in str(failed.value).splitlines() if re.match(r"  [> ] (axial|rocking|lateral) \d+ ", line)]
    assert len(rows) == 5
    assert rows[2].startswith("  > lateral 6 ")


def test_the_parts_of_a_shift_make_it_up():
    """Of all that moves a mode by 14 Hz next to nothing is left to other things; a first order about one end left a sixth."""
    with pytest.raises(AssertionError) as failed:
        assert_frequency_shift("hdd_2003", mode="axial 3", from_C=20, to_C=60, shift_Hz=0, within=1)
    parts = [float(v) for v in re.findall(r"([+-][0-9.]+) Hz", str(failed.value).rpartition("moved by the stiffness of:")[2])]
    assert sum(parts) == pytest.approx(-13.92, abs=0.02)
    assert abs(parts[-1]) < 0.2


def test_a_mode_that_others_pass_keeps_its_shape(stiffly_mounted):
    with warnings.catch_warnings(action="ignore"):
        assert_frequency_shift(stiffly_mounted, mode="axial 3", from_C=20, to_C=100, shift_Hz=0, within=1)


def test_lost_contact_and_a_temperature_in_kelvin_are_told():
    """A spindle without its bearings moves by nothing, and that passed without a word."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert_frequency_shift("hdd_2003", mode="axial 2", from_C=293, to_C=333, shift_Hz=0, within=1)
    words = "; ".join(str(w.message) for w in said)
    assert "293 C: lower and upper bearing lost contact" in words
    assert "293 C lies outside -40 to 120 C" in words
    with warnings.catch_warnings(action="ignore"), pytest.raises(AssertionError, match=r"(?s)moved too far for the elements.*150 C: lower and upper bearing lost contact"):
        assert_frequency_shift("hdd_2003", mode="axial 2", from_C=20, to_C=150, shift_Hz=0, within=1)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: assert_frequency(SCENE, mode="axial 2", at_C=20, frequency_Hz=1, within=-1), "within = -1: must be a finite number above 0"),
        (lambda: assert_frequency(SCENE, mode="axial 2", at_C=20, frequency_Hz=float("nan"), within=1), "frequency_Hz = nan: must be a finite number"),
        (lambda: assert_frequency(SCENE, mode="axial 2", at_C="20", frequency_Hz=1, within=1), "temperature_C = '20': must be a finite number"),
        (lambda: assert_damping(SCENE, mode="axial 2", at_C=20, percent="1", within=1), "percent = '1': must be a finite number"),
        (lambda: assert_margin(SCENE, mode="axial 2", speed_rpm=0, at_least_percent=1), "speed_rpm = 0: nothing turns"),
        (lambda: assert_margin(SCENE, mode="axial 2", speed_rpm=7200, at_least_percent=1, multiples=0), "multiples = 0: of the number of balls, up to which waviness counts; must be a whole number of 1 or more"),
        (lambda: assert_margin(SCENE, mode="axial 2", speed_rpm=7200, at_least_percent=1, temperatures_C=20), "temperatures_C = 20: must be a list of temperatures"),
        (lambda: assert_margin(SCENE, mode="axial 2", speed_rpm=7200, at_least_percent=1, temperatures_C=[]), "temperatures_C = []: must be a list of temperatures in C, one at least"),
        (lambda: assert_frequency(None, mode=1, at_C=20, frequency_Hz=1, within=1), "scene: must be a spindle (ts.load), a scene's folder or the name of a shipped one, not None"),
        (lambda: assert_split(SCENE, modes=3, at_C=20, split_Hz=1, within=1), "modes = 3: must be two modes"),
        (lambda: assert_margin(SCENE, mode="axial 2", speed_rpm=7200, at_least_percent=-1), "at_least_percent = -1: must be a finite number above 0"),
        (lambda: assert_split(SCENE, modes=("lateral 1",), at_C=20, split_Hz=1, within=1), "modes = ('lateral 1',): must be two modes"),
        (lambda: assert_agreement(SCENE, DATA / "foreign_bond", rms=float("inf")), "rms = inf: must be a finite number above 0"),
    ],
)
def test_what_an_assertion_cannot_be_asked_with(call, said):
    with pytest.raises(BadInput, match=re.escape(said)):
        call()


def test_the_plugin_loads_nothing_that_computes():
    code = "import sys, pytest; before = set(sys.modules); import thermospindle.plugin; print(sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['thermospindle', 'thermospindle.plugin']"


def test_modes_by_kind_and_number():
    own = Spindles()
    assert own.mode(SCENE, "rocking 1", 20).frequency == pytest.approx(1795.0, abs=0.5)
    assert own.mode(SCENE, "rocking 2", 20).frequency == pytest.approx(1821.0, abs=0.5)
    assert own.mode(SCENE, 5, 20) is own.mode(SCENE, "axial 3", 20)
    for wrong in ("rocking", "rocking 9", "tumbling 1", 0, "3"):
        with pytest.raises(BadInput, match="hdd_2003 has axial 1 to 4, rocking 1 to"):
            own.mode(SCENE, wrong, 20)


HOLDS = [
    (assert_frequency, {"mode": "axial 1", "at_C": 20, "frequency_Hz": 1002, "within": 0.5}, {"frequency_Hz": 1010}, "axial 1 lies at 1002.0"),
    (assert_damping, {"mode": "axial 1", "at_C": 20, "percent": 0.54, "within": 0.01}, {"percent": 0.6}, "0.53"),
    (assert_split, {"modes": ("rocking 1", "rocking 2"), "at_C": 20, "speed_rpm": 7200, "split_Hz": 94.7, "within": 0.5}, {"speed_rpm": 0.0}, "lie 26.0"),
    (assert_frequency_shift, {"mode": 3, "from_C": 20, "to_C": 60, "shift_Hz": -19.9, "within": 0.2}, {"shift_Hz": 0}, "moves by -19.87 Hz"),
    (
        assert_peak_level,
        {"mode": "axial 1", "at_C": 20, "response": "base", "reference": "hub_top0", "level": 0.0200, "within": 0.0002},
        {"level": 1.0},
        "is 0.0",
    ),
    (assert_margin, {"mode": "axial 1", "speed_rpm": 7200, "at_least_percent": 0.5}, {"at_least_percent": 1.0}, r"20 \(fo-fc\)"),
    (assert_agreement, {"campaign": SCENE / "measured" / "jang_2003", "rms": 42}, {"rms": 2}, "is 41.5. standard errors"),
]


@pytest.mark.parametrize(("check", "told", "change", "said"), HOLDS, ids=lambda a: getattr(a, "__name__", ""))
def test_every_assertion_holds_and_bites(check, told, change, said):
    check(SCENE, **told)
    with pytest.raises(AssertionError, match=said):
        check(SCENE, **(told | change))


def test_a_line_that_crosses_between_two_temperatures_is_near():
    """At 20 C some are 6 % below the mode, at 60 C 3 % above, and of each end alone nothing is to be said: at 50 C one is 0.01 % from it."""
    told = {"mode": "lateral 1", "speed_rpm": 14400, "at_least_percent": 1.0}
    with pytest.raises(AssertionError, match=r"6 lines come nearer") as error:
        assert_margin(SCENE, **told)
    assert "between 20 and 60 C: 30 fc (inner waviness of order 29 of bearing lower, forward) crosses it, from -5.92 to +2.73 %" in str(error.value)
    for t in (20, 60):
        assert_margin(SCENE, **told, temperatures_C=np.array([t]))
    with pytest.raises(AssertionError, match=r"50 C: 30 fc .* -0.01 % from"):
        assert_margin(SCENE, **told, temperatures_C=[50])


def test_a_scene_that_changed_is_read_again(tmp_path):
    own, file = Spindles(), tmp_path / "spindle.toml"
    file.write_text((SCENE / "spindle.toml").read_text(encoding="utf-8"), encoding="utf-8")
    first = own.mode(tmp_path, "axial 3", 20).frequency
    file.write_text(file.read_text(encoding="utf-8").replace("preload_N = 16.0", "preload_N = 12.0"), encoding="utf-8")
    os.utime(file, ns=(1, 1))
    assert own.mode(tmp_path, "axial 3", 20).frequency < first - 1


@pytest.mark.slow
def test_agreement_with_frfs_of_another_program():
    with pytest.raises(AssertionError, match="the worst are"):
        assert_agreement(SCENE, DATA / "foreign_bond", rms=1.0)


def test_a_shaft_is_named_and_not_its_mesh():
    """The energy of all its elements together."""
    with pytest.raises(AssertionError) as failed:
        assert_frequency("mk7702", mode="lateral 1", at_C=20, frequency_Hz=1.0, within=1)
    said = str(failed.value)
    point = Spindles().point("mk7702", 20.0)
    mode = next(m for m in point.modes if m.kind == "lateral")
    [shaft] = point.spindle.structure.shafts
    share = sum(mode.energy[name] for name in shaft.elements)
    assert f"strain energy of lateral at {mode.frequency:.1f} Hz: {shaft.name} {share:.0%}, " in said
    assert not any(name in said for name in shaft.elements)
