"""The whole chain over scenes that differ from the reference in one thing each: every verb answers, and physics that every spindle keeps.

Settings are short: one hit, two temperatures near each other (face to face, the preload is gone at 45 C).
"""

import json
from functools import cache

import numpy as np
import pytest

from tests.scene_matrix import SCENES, write_scene
from thermospindle.cli import main
from thermospindle.model.machine import Condition
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

WARM = 26.0
SPEED = 7200 * RPM
EVERY = pytest.mark.parametrize("name", SCENES)
SPEEDS = pytest.mark.parametrize("speed", [0.0, SPEED], ids=["at rest", "turning"])


@pytest.fixture(scope="session")
def scene(tmp_path_factory):
    """The folder of a scene of the matrix, by its name."""
    return cache(lambda name: write_scene(name, tmp_path_factory.mktemp("matrix")))


@pytest.fixture(scope="session")
def at(scene):
    """The operating point of a scene of the matrix at a temperature (C) and a speed (rad/s)."""
    return cache(lambda name, celsius=WARM, speed=0.0: operating_point(load(scene(name)), Condition(celsius, speed)))


# ---------------------------------------------------------------- physics


@EVERY
def test_scenes_are_what_their_names_say(name, at):
    """A scene that were the reference again would make the matrix smaller without a word."""
    point, reference = at(name), at("reference")
    turning = [b.name for b in point.spindle.structure.bodies if b.turns]
    assert turning == (["shaft"] if name == "inner ring turning" else ["hub"])
    same = np.allclose([m.frequency for m in point.modes], [m.frequency for m in reference.modes], rtol=1e-6)
    assert same == (name == "reference")


@EVERY
@SPEEDS
def test_modes_are_positive_sorted_and_damped(name, speed, at):
    modes = at(name, WARM, speed).modes
    frequency = np.array([m.frequency for m in modes])
    assert len(modes) == 14  # of 14 degrees of freedom, none loose
    assert frequency[0] > 10.0
    assert np.all(np.diff(frequency) >= 0)
    assert all(0 < m.damping_ratio < 0.5 for m in modes)


def test_modes_of_the_symmetric_scene_at_rest_are_exact_pairs(at):
    """All that are not axial; turning, the gyroscopic moment takes the pairs apart."""
    rest, turning = (
        np.array([m.frequency for m in at("symmetric", WARM, speed).modes if m.kind != "axial"]).reshape(-1, 2) for speed in (0.0, SPEED)
    )
    assert rest[:, 1] == pytest.approx(rest[:, 0], rel=1e-8)
    assert np.all(turning[:, 1] / turning[:, 0] > 1 + 1e-6)
    assert turning.mean(axis=1) == pytest.approx(rest.mean(axis=1), rel=5e-3)
    reference = np.array([m.frequency for m in at("reference").modes])
    assert np.all(reference[1:] / reference[:-1] > 1 + 1e-7)


@EVERY
@SPEEDS
def test_reciprocity(name, speed, at):
    """H is symmetric at rest; turning, exchanging hammer and sensor turns the spindle the other way round (Genta 2005, sect. 3.4)."""
    point, back = at(name, WARM, speed), at(name, WARM, -speed)
    nodes = [p.node for p in point.spindle.points]
    hammers = [nodes.index(n) for n in point.spindle.hammer.hammer_nodes]
    frequency = np.linspace(500.0, 2900.0, 49)
    there, other = point.frf(frequency)[hammers], back.frf(frequency)[hammers]
    assert np.abs(there - other.transpose(1, 0, 2)).max() < 1e-6 * np.abs(there).max()
    assert np.abs(there[0, 1]).max() > 1e-4 * np.abs(there[0, 0]).max()


@EVERY
@SPEEDS
@pytest.mark.parametrize("element", mjcf.ELEMENTS)
def test_mujoco_agrees_with_the_matrices(name, speed, element, at):
    point = at(name, WARM, speed)
    own, found = matrices(point.chain), mjcf.linearise(point.spec(element).compile())
    assert found.dofs == own.dofs
    scale = np.sqrt(np.outer(np.diag(own.stiffness), np.diag(own.stiffness)))
    assert np.abs(found.mass - own.mass).max() < 1e-9 * own.mass.max()
    assert np.abs((found.stiffness - own.stiffness) / scale).max() < 1e-6
    assert np.abs(found.damping - own.damping).max() < 1e-9 * np.abs(own.damping).max()


@EVERY
def test_bearing_stiffness_is_symmetric_and_positive(name, at):
    for bearing in at(name).state.bearings:
        assert bearing.in_contact
        scale = np.sqrt(np.outer(np.diag(bearing.stiffness), np.diag(bearing.stiffness)))
        assert bearing.stiffness / scale == pytest.approx((bearing.stiffness / scale).T, abs=1e-9)
        assert np.all(np.linalg.eigvalsh(bearing.stiffness / scale) > 0)


@EVERY
def test_axial_forces_balance(name, at):
    """Each loads the other; a spring keeps its force, whatever the temperature, and in tandem both rows share it."""
    cold, warm = (np.array([b.preload for b in at(name, t).state.bearings]) for t in (20.0, WARM))
    assert cold == pytest.approx([16.0, 16.0], rel=1e-6)
    if name == "tandem":
        assert warm.sum() == pytest.approx(cold.sum(), rel=1e-6)
        assert abs(warm[1] - warm[0]) > 0.1  # the rows no longer share alike
    else:
        assert warm[0] == pytest.approx(warm[1], rel=1e-6)
        assert (warm[0] == pytest.approx(16.0, rel=1e-6)) == (name == "spring preload")


def test_heat_turns_a_face_to_face_pair_loose_first(at):
    """Rings that move apart unload it, and load a pair that stands back to back; the radial growth of both is the same."""
    cold, warm = (at("face to face", t).state.bearings[0].preload for t in (20.0, WARM))
    assert cold - warm > at("reference", 20.0).state.bearings[0].preload - at("reference").state.bearings[0].preload
    lost = at("face to face", 60.0)
    assert not any(b.in_contact for b in lost.state.bearings)
    assert all(m.frequency > 0 for m in lost.modes)


# ---------------------------------------------------------------- verbs


QUICK = {
    "table": ["--temperatures", 20, WARM, "--speeds", 0, 7200],
    "modes": ["--temperature", WARM, "--speed", 7200],
    "runout": ["--temperature", WARM, "--speed", 7200, "--path", "linear", "--seconds", 0.2],
    "map": ["--speed", 7200, "--temperatures", 20, WARM, "--speeds", 3600, 7200],
}
LONG = {
    "impact": ["--temperature", WARM, "--speed", 7200, "--element", "ball-by-ball"],
    "run": ["--temperatures", 20, WARM],
    "warmup": ["--speed", 3600, "--minutes", 2],
}
KEYS = {
    "table": {"temperature_C", "bearings", "unloads_C", "loose", "speeds", "provenance"},
    "modes": {"temperature_C", "speed_rpm", "status", "modes"},
    "runout": {"temperature_C", "speed_rpm", "status", "seconds", "rro_um", "nrro_um", "lines", "probes", "provenance"},
    "map": {"nominal", "sentences", "coincidences", "modes", "lines", "grid", "nrro_um", "provenance"},
    "impact": {"temperature_C", "speed_rpm", "modes"},
    "run": {"provenance", "conditions", "out"},
    "warmup": {"time_s", "temperature_C", "preload_N", "friction_W", "frequencies_Hz", "status", "steady", "energy_J"},
}


def finite(value) -> bool:
    """Whether no number anywhere in a JSON answer is NaN or infinite."""
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list):
        return all(map(finite, value))
    return not isinstance(value, float) or bool(np.isfinite(value))


def answer(capsys, *arguments):
    code, said = main([*map(str, arguments), "--json"]), capsys.readouterr()
    assert code == 0, said.err
    assert "Warning" not in said.err
    return json.loads(said.out)


@EVERY
@pytest.mark.parametrize("verb", [*QUICK, *(pytest.param(verb, marks=pytest.mark.slow) for verb in LONG)])
def test_verbs_answer(name, verb, scene, capsys, tmp_path):
    """With all their keys and finite numbers; `run` always writes its folder."""
    out = ["--out", tmp_path / "out"] if verb == "run" else []
    found = answer(capsys, verb, scene(name), *(QUICK | LONG)[verb], *out)
    assert KEYS[verb] <= set(found)
    assert finite(found)
    frequencies = [m["frequency_Hz"] for m in found["modes"]] if verb in ("modes", "impact") else []
    assert frequencies == sorted(frequencies)
    assert all(f > 0 for f in frequencies)


@EVERY
@pytest.mark.parametrize("verb", ["table", "modes", *(pytest.param(verb, marks=pytest.mark.slow) for verb in ("runout", "map", *LONG))])
def test_verbs_write_their_folders(name, verb, scene, capsys, tmp_path):
    """Pages, pictures, tables and logs: nothing is odd enough about a scene to stop one."""
    answer(capsys, verb, scene(name), *(QUICK | LONG)[verb], "--out", tmp_path / "out")
    files = [f for f in (tmp_path / "out").rglob("*") if f.is_file()]
    assert len(files) > 1
    assert all(f.stat().st_size for f in files)


OWN = [n if n == "inner ring turning" else pytest.param(n, marks=pytest.mark.slow) for n in SCENES]


@pytest.mark.parametrize("name", OWN)
def test_a_spindles_own_test_is_its_model_again(name, scene, capsys, tmp_path):
    """A virtual test, identified and set beside the model that made it: every mode found lies within its errors, or 0.1 %."""
    made = answer(capsys, "simulate", scene(name), "--temperatures", WARM, "--out", tmp_path / "campaign")
    assert made["tests"] == [f"T{WARM:g}_n0"]
    found = answer(capsys, "compare", scene(name), tmp_path / "campaign", "--out", tmp_path / "out")
    [test] = found["tests"]
    assert len(test["modes"]) >= 3
    assert all(abs(m["error_percent"]) < 0.1 or abs(m["pull"]) < 3 for m in test["modes"])
    assert found["rms_pull"] < 1.5


@EVERY
@pytest.mark.slow
def test_a_spindles_own_runout_is_its_model_again(name, scene, capsys, tmp_path):
    options = ["--runout", "--temperatures", WARM, "--speeds", 7200, "--seconds", 0.3]
    answer(capsys, "simulate", scene(name), *options, "--out", tmp_path / "campaign")
    assert answer(capsys, "compare", scene(name), tmp_path / "campaign")["rms_pull"] < 1.5
