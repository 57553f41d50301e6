"""Modes that somebody picked, or a modal analysis exported: how sure they are, and their shapes."""

from __future__ import annotations

import numpy as np
import pytest
import pyuff
from pyuff.datasets.dataset_55 import prepare_55

from tests.conftest import SCENE
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.model.scene.reading import load
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.importing.files import uff_modes


def test_frequencies_alone_are_modes(tmp_path):
    """A frequency a row is enough, the documentation says; a table with the one heading `frequency` was asked which FRF it was."""
    file = tmp_path / "picked.csv"
    file.write_text("frequency\n1002.5\n1545.0\n")
    told = tmp_path / "told.toml"
    told.write_text('frequency_sd_Hz = 0.5\nspindle = "hdd_2003"\n[[tests]]\nid = "picked"\ntemperature_C = 20\nspeed_rpm = 0\n')
    bring([file], mapping=told, out=tmp_path / "c")
    assert [m.frequency for m in read_campaign(tmp_path / "c").tests[0].modes] == [1002.5, 1545.0]


def test_how_sure_dampings_are_may_be_told_for_all_of_them(tmp_path):
    """The form offers it where a table tells none; it is no question, for without it dampings are compared in per cent."""
    file, form = tmp_path / "picked.csv", tmp_path / "form.toml"
    file.write_text("frequency,damping_%\n1002.5,0.5\n1545.0,\n")
    bring([file], mapping=form)
    assert "# damping_sd_percent = 10.0" in form.read_text()
    answers = 'frequency_sd_Hz = 0.5\nspindle = "hdd_2003"\n[[tests]]\nid = "picked"\ntemperature_C = 20\nspeed_rpm = 0\n'
    for name, told, expected in (("without", "", [None, None]), ("with", "damping_sd_percent = 10.0\n", [pytest.approx(0.0005), None])):
        mapping = tmp_path / f"{name}.toml"
        mapping.write_text(told + answers)
        bring([file], mapping=mapping, out=tmp_path / name)
        assert [m.damping_ratio_sd for m in read_campaign(tmp_path / name).tests[0].modes] == expected
    file.write_text("frequency,damping_%,damping_ratio_sd\n1002.5,0.5,0.001\n")
    bring([file], mapping=tmp_path / "sure.toml")
    assert "damping_sd_percent" not in (tmp_path / "sure.toml").read_text()


@pytest.mark.parametrize(("scale", "doubts"), [(1e-3, 1), (1.0, 0), (1e3, 1)])
def test_modes_far_from_where_the_scene_is_hit_are_doubted(tmp_path, scale, doubts):
    """In kHz where Hz are told: FRFs were doubted, tables were not."""
    (tmp_path / "T20.csv").write_text(f"frequency\n{1002.5 * scale}\n{1545 * scale}\n")
    (tmp_path / "m.toml").write_text('frequency_sd_Hz = 0.5\n[[tests]]\nid = "T20"\ntemperature_C = 20\nspeed_rpm = 0\n')
    said = bring([tmp_path / "T20.csv"], mapping=tmp_path / "m.toml", scene=SCENE, out=tmp_path / "c").values["warnings"]
    assert said == [f"test T20: 2 modes from {1002.5 * scale:g} to {1545 * scale:g} Hz, and the hammer test of hdd_2003 is from 400 to 6000 Hz: are they in another unit?"] * doubts


def test_modes_picked_by_hand(tmp_path):
    """The easiest start: a frequency a row, damping in percent, a decimal comma."""
    (tmp_path / "peaks.csv").write_text("test;mode;frequency [Hz];damping %\nT20;1;1002,5;0,5\nT20;2;1545;\n")
    (tmp_path / "m.toml").write_text('spindle = "hdd_2003"\nfrequency_sd_Hz = 0.5\n[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
    bring([tmp_path / "peaks.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    rows = read_campaign(tmp_path / "c").tests[0].modes
    assert [(r.mode, r.frequency, r.frequency_sd, r.damping_ratio) for r in rows] == [(1, 1002.5, 0.5, 0.005), (2, 1545.0, 0.5, None)]


def told_by(folder, table, more=""):
    """The modes of a table, and what was said of it."""
    (folder / "T20.csv").write_text(table)
    (folder / "m.toml").write_text(f'frequency_sd_Hz = 0.5\n{more}[[tests]]\nid = "T20"\ntemperature_C = 20\nspeed_rpm = 0\n')
    notes = bring([folder / "T20.csv"], mapping=folder / "m.toml", scene=SCENE, out=folder / "c").values["notes"]
    return read_campaign(folder / "c").tests[0].modes, notes


def test_columns_that_are_not_known_are_said_to_be_left_out(tmp_path):
    """A loss factor was dropped without a word."""
    modes, notes = told_by(tmp_path, "mode,frequency_Hz,loss_factor,Q,\n1,1002.5,0.0108,93,\n2,1545,0.0146,70,\n")
    assert [m.damping_ratio for m in modes] == [None, None]
    assert any(n.startswith("T20.csv: columns that are none of a table of modes left out: loss_factor, Q; such columns are test, mode") for n in notes), notes


def test_errors_of_dampings_may_be_in_the_same_per_cent(tmp_path):
    modes, notes = told_by(tmp_path, "mode;frequency_Hz;frequency_sd_Hz;damping_%;damping_sd_%\n1;1002,5;0,2;0,54;0,02\n2;1545;0,4;;\n")
    assert [(m.frequency_sd, m.damping_ratio, m.damping_ratio_sd) for m in modes] == [(0.2, pytest.approx(0.0054), pytest.approx(0.0002)), (0.4, None, None)]
    assert notes == []


@pytest.mark.parametrize(("unit", "found"), [("percent", [0.0054, 0.0073]), ("ratio", [0.54, 0.73])])
def test_dampings_of_a_table_that_may_be_in_per_cent_are_asked_about(tmp_path, unit, found):
    """As those of a UFF file are; the tests that the table names are no other ones for that."""
    (tmp_path / "T20.csv").write_text(table := "test,mode,frequency_Hz,damping\nT20,1,1002.5,0.54\nT20,2,1545,0.73\n")
    answer = bring([tmp_path / "T20.csv"], mapping=tmp_path / "form.toml", scene=SCENE)
    asked = 'T20.csv: damping_unit: whether its dampings are "ratio" or "percent": 0.73, as that of 1545 Hz (line 3) is, would be 73 % or 0.73 %'
    assert [q for q in answer.values["open"] if "damping" in q] == [asked]
    assert 'damping_unit = "?"' in (tmp_path / "form.toml").read_text()
    assert (tmp_path / "form.toml").read_text().count("\n[[tests]]") == 1
    modes, _ = told_by(tmp_path, table, f'[[files]]\nfile = "T20.csv"\ndamping_unit = "{unit}"\n')
    assert [m.damping_ratio for m in modes] == pytest.approx(found)


def test_shapes_of_a_modal_analysis(tmp_path):
    """Two sets 55: a normal mode in real numbers and an eigenvalue with a complex shape, in all directions of
    all nodes; the scene's points take what is along theirs, and a node that is none of them is passed over."""
    scene = load(SCENE)
    nodes = np.array([*(p.node for p in scene.points), 99])
    random = np.random.default_rng(4)
    real, turned = random.standard_normal((3, len(nodes))), random.standard_normal((3, len(nodes))) + 1j * random.standard_normal((3, len(nodes)))
    common = {f"id{k}": "NONE" for k in range(1, 6)} | {"model_type": 1, "data_ch": 2, "spec_data_type": 8, "load_case": 1, "node_nums": nodes, "n_data_per_node": 3}
    normal = common | {"analysis_type": 2, "data_type": 2, "mode_n": 1, "freq": 1002.0, "modal_m": 1.0, "modal_damp_vis": 0.006, "modal_damp_his": 0.0}
    eigen = common | {"analysis_type": 3, "data_type": 5, "mode_n": 2, "eig": complex(-60.0, 9700.0), "modal_a": 1 + 0j, "modal_b": 1 + 0j}
    file, told = tmp_path / "analysis.uff", tmp_path / "told.toml"
    for first, shape, own in ((True, real, normal), (False, turned, eigen)):
        data = prepare_55(**own, **dict(zip(("r1", "r2", "r3"), shape, strict=True)))
        pyuff.UFF(str(file)).write_sets(data, "overwrite" if first else "add")
    answers = 'frequency_sd_Hz = 0.5\n{}[[tests]]\nid = "analysis"\ntemperature_C = 20\nspeed_rpm = 0\n'
    told.write_text(answers.format(""))
    notes = bring([file], scene=SCENE, mapping=told, out=tmp_path / "without").values["notes"]
    assert any("shapes of 2 modes left out; shape_sd_percent in the mapping" in n for n in notes)
    assert read_campaign(tmp_path / "without").tests[0].shape_nodes == ()
    told.write_text(answers.format("shape_sd_percent = 3.0\n"))
    notes = bring([file], scene=SCENE, mapping=told, out=tmp_path / "with").values["notes"]
    assert any("shapes of 2 modes at nodes 1, 2, 3" in n for n in notes)
    test = read_campaign(tmp_path / "with").tests[0]
    assert test.shape_nodes == tuple(p.node for p in scene.points)
    for mode, shape in zip(test.modes, (real, turned), strict=True):
        along = np.array([np.array(p.direction) @ shape[:, k] for k, p in enumerate(scene.points)])
        found = np.array([at.value for at in mode.shape])
        assert found == pytest.approx(along / np.abs(along).max(), abs=1e-5)
        assert {at.sd for at in mode.shape} == {0.03}
    bring([file], scene=SCENE, mapping=tmp_path / "form.toml")
    assert "# shape_sd_percent = 5.0" in (tmp_path / "form.toml").read_text()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_shape_that_is_no_number_is_refused_by_its_mode(tmp_path, value):
    """It was refused as line 2 of a file of the campaign that was being written, which nobody has;
    without shapes the file makes its campaign."""
    nodes = np.array([p.node for p in load(SCENE).points])
    ones = np.ones(len(nodes))
    wrong = np.where(nodes == 2, value, 1.0)
    common = {f"id{k}": "NONE" for k in range(1, 6)} | {"model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2, "n_data_per_node": 3}
    mode = {"load_case": 1, "mode_n": 1, "freq": 1002.0, "modal_m": 1.0, "modal_damp_vis": 0.006, "modal_damp_his": 0.0, "node_nums": nodes}
    pyuff.UFF(str(tmp_path / "lab.uff")).write_sets(prepare_55(**common, **mode, r1=ones, r2=ones, r3=wrong), "overwrite")
    told = tmp_path / "told.toml"
    answers = 'frequency_sd_Hz = 0.5\n{}[[tests]]\nid = "lab"\ntemperature_C = 20\nspeed_rpm = 0\n'
    told.write_text(answers.format("shape_sd_percent = 3.0\n"))
    with pytest.raises(BadInput, match="test lab: the shape of the mode of 1002 Hz is NaN or infinite at node 2; mend its file, or take shape_sd_percent out of the mapping"):
        bring([tmp_path / "lab.uff"], scene=SCENE, mapping=told, out=tmp_path / "c")
    assert not (tmp_path / "c").exists()
    told.write_text(answers.format(""))
    bring([tmp_path / "lab.uff"], scene=SCENE, mapping=told, out=tmp_path / "c")
    assert [m.frequency for m in read_campaign(tmp_path / "c").tests[0].modes] == [1002.0]


def modal_set(folder, dampings: list[tuple[float, float]], name="lab.uff"):
    """Normal modes of 1000, 1100, ... Hz in sets 55, each with its (viscous, hysteretic) damping."""
    for k, (viscous, hysteretic) in enumerate(dampings):
        common = {f"id{i}": "NONE" for i in range(1, 6)} | {"model_type": 1, "analysis_type": 2, "data_ch": 2, "spec_data_type": 8, "data_type": 2, "n_data_per_node": 3}
        mode = {"load_case": 1, "mode_n": k + 1, "freq": 1000.0 + 100 * k, "modal_m": 1.0, "modal_damp_vis": viscous, "modal_damp_his": hysteretic}
        pyuff.UFF(str(folder / name)).write_sets(prepare_55(**common, **mode, node_nums=np.array([1]), **{r: np.ones(1) for r in ("r1", "r2", "r3")}), "add" if k else "overwrite")
    return folder / name


def dampings(folder, file, told=""):
    (folder / "told.toml").write_text(f'frequency_sd_Hz = 0.5\n[[files]]\nfile = "lab.uff"\n{told}\n[[tests]]\nid = "lab"\ntemperature_C = 20\nspeed_rpm = 0\n')
    notes = bring([file], scene=SCENE, mapping=folder / "told.toml", out=folder / "c").values["notes"]
    return [m.damping_ratio for m in read_campaign(folder / "c").tests[0].modes], notes


def test_hysteretic_damping_is_twice_the_ratio(tmp_path):
    """Set 55, record 8, field 4; it was dropped. Beside a viscous one of its own that one is taken, and the other told to be left out."""
    found, notes = dampings(tmp_path, modal_set(tmp_path, [(0.0, 0.02), (0.006, 0.012), (0.006, 0.03), (-0.001, 0.0), (0.0, 0.0)]))
    assert found == [pytest.approx(0.01), pytest.approx(0.006), pytest.approx(0.006), None, None]
    assert "lab.uff: hysteretic damping beside another viscous one left out, of the modes of 1200 Hz" in notes
    assert "lab.uff: dampings that are not positive left out, of the modes of 1300 Hz" in notes


def test_hysteretic_damping_of_data_set_2414():
    """Record 12: frequency, viscous and hysteretic damping in fields 2, 5 and 6."""
    found = uff_modes.mode("set 1", {"type": 2414, "analysis_type": 2, "record12_field2": 1000.0, "record12_field5": 0.0, "record12_field6": 0.02})
    assert (found.line.frequency, found.told) == (1000.0, 0.01)


def test_dampings_that_may_be_in_per_cent_are_asked_about_once_and_read_alike(tmp_path):
    """Those below 1 were taken as ratios, and the others vanished."""
    file = modal_set(tmp_path, [(0.54, 0.0), (1.28, 0.0), (0.0, 4.0)])
    with pytest.raises(Unanswered, match=r'lab.uff: damping_unit: whether its dampings are "ratio" or "percent": 2, as that of 1200 Hz \(set 3\) is, would be 200 % or 2 %') as said:
        dampings(tmp_path, file)
    assert len(said.value.items) == 1
    with pytest.raises(BadInput, match=r"lab.uff: set 2: damping of the mode of 1100 Hz = 1.28: with damping_unit = 'ratio' it must be below 1"):
        dampings(tmp_path, file, 'damping_unit = "ratio"')
    found, _ = dampings(tmp_path, file, 'damping_unit = "percent"')
    assert found == [pytest.approx(0.0054), pytest.approx(0.0128), pytest.approx(0.02)]
    bring([file], scene=SCENE, mapping=tmp_path / "form.toml")
    assert 'damping_unit = "?"    # whether its dampings are' in (tmp_path / "form.toml").read_text()
