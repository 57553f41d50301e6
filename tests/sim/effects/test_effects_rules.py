"""The rules every effect of the catalogue keeps: those of `sim.effects.rules`, which hold for a user's effects too, and its tests."""

import ast
import importlib
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from tests import a_tenth_off
from tests.effect_points import with_tool
from thermospindle.model.rotor.beam import with_theory
from thermospindle.model.scene.reading import load
from thermospindle.sim.effects import CATALOGUE, by_name
from thermospindle.sim.effects.effect import refusal
from thermospindle.sim.effects.rules import DONE, SAID
from thermospindle.sim.effects.trial import trial

ROOT = Path(__file__).parents[3]

EFFECTS = pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)


@cache
def reference():
    return load(ROOT / "scenes" / "hdd_2003")


@cache
def machine_tool():
    spindle = load(ROOT / "scenes" / "five_bearing")
    structure = with_theory(spindle.structure, spindle.materials, spindle.reference_temperature, (0.0, 0.5))
    return replace(spindle, structure=structure)


@cache
def on_trial(name):
    """On the reference, or on a machine that has what the effect acts on: one with a flexible shaft
    in a housing, its beam short of shear and of half its rotary inertia; or one with a tool."""
    effect = by_name(name)
    return trial(effect, next(s for s in (made() for made in (reference, machine_tool, with_tool)) if refusal(effect, s) is None))


FILES = {
    f.stem: f"thermospindle.sim.effects.{f.parent.name}.{f.stem}"
    for f in (ROOT / "sim" / "effects").glob("*/*.py")
    if f.stem not in {"__init__", "roles"}
}


def test_names_are_unique():
    assert len({e.name for e in CATALOGUE}) == len(CATALOGUE)


def test_every_file_of_the_folder_is_in_the_catalogue():
    assert {e.name for e in CATALOGUE} == set(FILES)


@EFFECTS
def test_module_has_the_effects_name(effect):
    assert importlib.import_module(FILES[effect.name]).EFFECT is effect
    assert by_name(effect.name) is effect


@EFFECTS
@pytest.mark.parametrize("rule", SAID, ids=lambda r: r.__name__)
def test_what_an_effect_says_of_itself(effect, rule):
    """`tests/sim/test_effects_user.py` shows every rule refuse something."""
    rule(effect, [e.name for e in CATALOGUE])


@EFFECTS
@pytest.mark.parametrize("rule", DONE, ids=lambda r: r.__name__)
def test_what_an_effect_does(effect, rule):
    assert len(on_trial(effect.name).conditions) == 3
    rule(on_trial(effect.name))


# ---------------------------------------------------------------- verification


ELSEWHERE = (Path(__file__).name, "test_effects_user.py")  # rules and ways to fail, which verify no formula


@cache
def names_in_tests() -> dict[str, set[str]]:
    """For every test of an effect that asserts something: its identifiers and strings, and those of its parametrisation."""
    found = {}
    for file in sorted(Path(__file__).parent.glob("test_effects_*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body if file.name not in ELSEWHERE else ():
            inside = list(ast.walk(node))
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_") and any(isinstance(n, ast.Assert) for n in inside):
                words = {n.id for n in inside if isinstance(n, ast.Name)} | {n.attr for n in inside if isinstance(n, ast.Attribute)}
                found[f"{file.relative_to(ROOT).as_posix()}::{node.name}"] = words | {
                    n.value for n in inside if isinstance(n, ast.Constant) and isinstance(n.value, str)
                }
    return found


def verified_by(effect):
    """Tests that name the effect, whole: `cage_unbalance` says nothing of `unbalance`."""
    return [test for test, names in names_in_tests().items() if effect.name in names]


@EFFECTS
def test_effect_has_a_verification_test(effect):
    """`test_verification_bites` shows that they verify it."""
    assert verified_by(effect)


@pytest.mark.slow
@EFFECTS
def test_verification_bites(effect):
    """With all its sizes a tenth off, some test of the effect fails."""
    run = [sys.executable, "-m", "pytest", "-x", "-p", "tests.a_tenth_off", "-p", "no:cacheprovider", *verified_by(effect)]
    done = subprocess.run(run, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT), a_tenth_off.EFFECT: effect.name}, capture_output=True, text=True)
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout + done.stderr
