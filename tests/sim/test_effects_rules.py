"""The rules every effect of the catalogue keeps."""

import ast
import importlib
import pickle
from dataclasses import fields
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from model import mjcf
from model.machine import Condition
from model.modes import frf, modes
from model.rotor_base import matrices
from model.scene import BadInput, load
from sim.effect import Effect
from sim.effects import CATALOGUE, by_name, checked
from sim.operating import OperatingPoint, operating_point

ROOT = Path(__file__).parents[2]
RPM = np.pi / 30
CONDITIONS = (Condition(20.0), Condition(60.0, 7200 * RPM), Condition(50.0, 3600 * RPM, level=10.0, soak_time=1500.0))
LINES = np.arange(500.0, 3000.0, 25.0)
SEEN = 1e-6  # relative change of a frequency, damping ratio or FRF that counts; rounding of the eigenproblem is 1e-10

EFFECTS = pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
PARAMETERS = pytest.mark.parametrize(
    ("effect", "name"),
    [(e, p.name) for e in CATALOGUE for p in e.parameters],
    ids=[f"{e.name}-{p.name}" for e in CATALOGUE for p in e.parameters],
)


def points_of(effects) -> list[OperatingPoint]:
    spindle = reference()
    return [operating_point(spindle, c, effects) for c in CONDITIONS]


@cache
def reference():
    return load(ROOT / "scenes" / "hdd_2003")


def observables(point: OperatingPoint) -> dict[str, np.ndarray]:
    """Frequencies, damping ratios and FRFs of a point as the measuring chain shows them."""
    linear, chain = matrices(point.chain), point.measurement
    found = modes(point.chain, linear, highest=3000)
    value = frf(linear, chain.response_rows, chain.reference_rows, LINES - 1j * chain.decay / (2 * np.pi), "mobility")
    seen = chain.gain[:, None] * np.exp(-2j * np.pi * LINES * chain.delay[:, None])
    return {
        "frequency": np.array([m.frequency for m in found]),
        "damping": np.array([m.damping_ratio for m in found]),
        "frf": value * seen[:, None, :],
    }


def moved(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> float:
    """The largest relative change; a mode that comes or goes counts as one."""
    if len(one["frequency"]) != len(other["frequency"]):
        return 1.0
    return max(float(np.max(np.abs(one[k] - other[k])) / np.max(np.abs(one[k]))) for k in one)


@cache
def undisturbed() -> list[dict[str, np.ndarray]]:
    return [observables(p) for p in points_of(())]


# ---------------------------------------------------------------- what an effect says of itself


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
def test_effect_says_what_it_is(effect):
    for text in (effect.title, effect.equation, effect.sees, effect.valid):
        assert len(text) > 15
    assert effect.parameters
    assert any(getattr(effect, f.name) for f in fields(Effect) if "Callable" in str(f.type))


@PARAMETERS
def test_parameter_is_a_full_row(effect, name):
    p = next(p for p in effect.parameters if p.name == name)
    assert p.unit
    assert len(p.meaning) > 10
    assert len(p.source) > 10
    assert p.limits[0] <= p.neutral <= p.limits[1]
    assert p.limits[0] <= p.typical <= p.limits[1]
    assert 0 < p.prior_sd < np.inf
    if p is effect.parameters[0]:
        assert p.typical != p.neutral


@EFFECTS
def test_resembles_names_other_effects(effect):
    names = {e.name for e in CATALOGUE}
    assert effect.resembles
    assert set(effect.resembles) <= names - {effect.name}
    assert len(set(effect.resembles)) == len(effect.resembles)


@EFFECTS
def test_effect_travels_to_other_processes(effect):
    assert pickle.loads(pickle.dumps(effect)).typical() == effect.typical()


@PARAMETERS
def test_values_beyond_the_limits_are_refused(effect, name):
    high = next(p.limits[1] for p in effect.parameters if p.name == name)
    with pytest.raises(BadInput, match=name):
        checked(effect, {name: high + 1.0})


# ---------------------------------------------------------------- what an effect does


@EFFECTS
@pytest.mark.parametrize("shape", ["neutral", "typical"])
def test_neutral_changes_nothing(effect, shape):
    """Bit for bit, and with the size neutral whatever the other parameters are."""
    values = effect.neutral() if shape == "neutral" else effect.typical() | {effect.parameters[0].name: effect.parameters[0].neutral}
    for point, before in zip(points_of([(effect, values)]), undisturbed(), strict=True):
        after = observables(point)
        assert all(np.array_equal(before[k], after[k]) for k in before)


@EFFECTS
def test_neutral_returns_the_same_objects(effect):
    condition, values = CONDITIONS[-1], effect.neutral()
    point = operating_point(reference(), condition, ())
    regions, rings = {g.name: 60.0 for g in point.spindle.regions}, {b.name: object() for b in point.state.bearings}
    if effect.spindle:
        assert effect.spindle(point.spindle, condition, values) is point.spindle
    if effect.temperatures:
        assert effect.temperatures(point.spindle, condition, values, regions) is regions
    if effect.motions:
        assert effect.motions(point.spindle, condition, values, rings) is rings
    if effect.pair:
        assert effect.pair(point.spindle, condition, values, point.state) is point.state
    if effect.chain:
        assert effect.chain(point.spindle, condition, values, point.chain) is point.chain
    if effect.measurement:
        assert effect.measurement(point.spindle, condition, values, point.chain, point.measurement) is point.measurement


@PARAMETERS
def test_every_parameter_moves_an_observable(effect, name):
    """With the effect at its typical size: this parameter elsewhere than neutral against neutral, at some condition."""
    p = next(p for p in effect.parameters if p.name == name)
    elsewhere = p.typical if p.typical != p.neutral else p.neutral + p.prior_sd
    if elsewhere > p.limits[1]:
        elsewhere = p.neutral - p.prior_sd
    ends = [
        [observables(q) for q in points_of([(effect, effect.typical() | {name: x})])]
        for x in (p.neutral, checked(effect, {name: elsewhere})[name])
    ]
    assert max(moved(a, b) for a, b in zip(*ends, strict=True)) > SEEN


@EFFECTS
def test_effect_leaves_its_arguments_alone(effect):
    spindle = reference()
    before = repr(spindle)
    points_of([(effect, effect.typical())])
    assert repr(spindle) == before


@EFFECTS
@pytest.mark.parametrize("element", mjcf.ELEMENTS)
def test_mujoco_carries_the_effect(effect, element):
    """The MuJoCo model of a point with the effect, looks included, linearises to the chain's matrices; as in test_rotor."""
    point = operating_point(reference(), CONDITIONS[1], [(effect, effect.typical())])
    own, found = matrices(point.chain), mjcf.linearise(point.spec(element, looks=element == "linear").compile())
    assert found.dofs == own.dofs
    size = np.sqrt(np.outer(np.diag(own.stiffness), np.diag(own.stiffness)))
    assert np.abs(found.mass - own.mass).max() < 1e-9 * own.mass.max()
    assert np.abs((found.stiffness - own.stiffness) / size).max() < 1e-6
    assert np.abs(found.damping - own.damping).max() < 1e-9 * np.abs(own.damping).max()


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
