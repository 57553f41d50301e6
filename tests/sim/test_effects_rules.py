"""The rules every effect of the catalogue keeps: those of `sim.effect_rules`, which hold for a user's effects too, and its tests."""

import ast
import importlib
from functools import cache
from pathlib import Path

import pytest

from model.scene import load
from sim.effect_rules import DONE, SAID
from sim.effect_trial import trial
from sim.effects import CATALOGUE, by_name

ROOT = Path(__file__).parents[2]

EFFECTS = pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)


@cache
def reference():
    return load(ROOT / "scenes" / "hdd_2003")


@cache
def on_trial(name):
    return trial(by_name(name), reference())


def test_names_are_unique():
    assert len({e.name for e in CATALOGUE}) == len(CATALOGUE)


def test_every_file_of_the_folder_is_in_the_catalogue():
    files = {f.stem for f in (ROOT / "sim" / "effects").glob("*.py")} - {"__init__"}
    assert {e.name for e in CATALOGUE} == files


@EFFECTS
def test_module_has_the_effects_name(effect):
    assert importlib.import_module(f"sim.effects.{effect.name}").EFFECT is effect
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


@cache
def words_of_tests() -> tuple[str, ...]:
    """For every effect test but those of this file: its name, the strings of its parametrisation, and its identifiers."""
    found = []
    for file in sorted(Path(__file__).parent.glob("test_effects_*.py")):
        if file.name == Path(__file__).name:
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                words = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
                words |= {
                    n.value for d in node.decorator_list for n in ast.walk(d) if isinstance(n, ast.Constant) and isinstance(n.value, str)
                }
                found.append(" ".join([node.name, *words]))
    return tuple(found)


@EFFECTS
def test_effect_has_a_verification_test(effect):
    assert any(effect.name in words for words in words_of_tests())
