"""Scenes and files at the edge of what can be computed with: one sentence, exit code 2."""

import os
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.command_line import changed_scene, refused
from tests.conftest import ROOT, SCENE
from thermospindle.cli import main
from thermospindle.model.errors import BadInput
from thermospindle.model.files.stiffness_table import read_table
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import modes as modes_of
from thermospindle.model.scene.reading import load
from thermospindle.report.log import read
from thermospindle.report.verbs.states import table
from thermospindle.sim.operating import operating_point


@pytest.fixture
def scene(tmp_path):
    return partial(changed_scene, tmp_path)


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
    ("level_N = .*", "level_N = 5e-324", "level_N"),
    ("contact_angle_deg = .*", "contact_angle_deg = 5e-324", "greater than or equal to 0.001"),
    ('name = "hub_top0"', 'name = "hub\\\\n0"', "a name stands on one line"),
    (r"\[bearings.lower\]", '[bearings."lo\\\\u001bwer"]', "bearings.lo\\x1bwer = 'lo\\x1bwer': a name stands on one line"),
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
    (tmp_path / "a.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr(read, "TRIAL", "import os; os.abort()")
    assert "a.rrd: is damaged; the library that reads Rerun logs breaks off on it" in refused(capsys, "inspect", tmp_path / "a.rrd")


def test_the_stiffness_table_is_finite(tmp_path):
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
    chain = operating_point(load(SCENE), Condition(20.0)).chain
    loose = replace(chain, elements=tuple(replace(e, stiffness=0 * e.stiffness, damping=0 * e.damping) if e.group == "bearings" else e for e in chain.elements))
    assert matrices(loose).stiffness.shape == matrices(chain).stiffness.shape
    found = modes_of(loose)
    assert found
    assert all(m.frequency > 1 and np.isclose(sum(m.energy.values()), 1) for m in found)
    assert not recwarn.list


# ---------------------------------------------------------------- surroundings


def test_a_number_of_cores_that_is_none_is_refused(capsys, tmp_path, monkeypatch):
    monkeypatch.setenv("LOKY_MAX_CPU_COUNT", "abc")
    (tmp_path / "study.toml").write_text('title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20]\ndraws = 4\nchunk = 1\n', encoding="utf-8")
    assert "LOKY_MAX_CPU_COUNT = 'abc': must be a whole number" in refused(capsys, "study", tmp_path / "study.toml", "--out", tmp_path / "out")


def test_pictures_need_no_backend_of_the_surroundings():
    code = "import thermospindle.cli, matplotlib; print(matplotlib.get_backend())"
    done = subprocess.run([sys.executable, "-c", code], env=os.environ | {"MPLBACKEND": "nonsense"}, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == "agg", done.stderr


@pytest.mark.parametrize("verb", [("modes", SCENE), ("add", SCENE, "bond_softening"), ("new", "mine", "--like", "hdd")], ids=lambda v: v[0])
def test_an_output_folder_that_is_a_link_to_itself_is_refused(capsys, tmp_path, verb):
    (tmp_path / "loop").symlink_to("loop")
    assert "loop" in refused(capsys, *verb, "--out", tmp_path / "loop")
    assert [p.name for p in tmp_path.iterdir()] == ["loop"]
