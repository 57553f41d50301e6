"""Files that other laboratories and programs wrote, with what their makers say of them."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tests.conftest import DATA, SCENE
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.importing.files.reading import content
from thermospindle.sim.importing.mapping import FileForm

UFF, AMH, PYUFF = DATA / "uff_files_jl", DATA / "amh_isma", DATA / "pyuff"
POINTS = '[[points]]\nnode = 1\nname = "hammer"\nbody = "plate"\nposition_mm = [0.0, 0.0, 0.0]\ndirection = "+Z"\ncalled = [".56.Z"]\n' + (
    '[[points]]\nnode = 2\nname = "sensor"\nbody = "plate"\nposition_mm = [10.0, 0.0, 0.0]\ndirection = "+Z"\ncalled = [".1.Z-"]\n'
)
TEST = '[[tests]]\nid = "lab"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n'


def questions(*files) -> str:
    with pytest.raises(Unanswered) as caught:
        bring(files, out=DATA / "nowhere")
    return "\n".join(caught.value.items)


def test_receptance_with_the_unit_of_a_mobility_is_said_and_settled_by_one_key(tmp_path):
    """Its label says Receptance, its unit (m/s)/N. Zeros fill its last line beyond the 1600 values
    of its header; coherence in a file beside it."""
    files = [UFF / "dataset58_FRF.unv", UFF / "dataset58_coh.unv"]
    asked = questions(*files)
    assert "'Receptance' is that of a receptance, its unit '(m/s)/N' that of a mobility" in asked
    settled = f'spindle = "plate"\n[[files]]\nfile = "*.unv"\nquantity = "mobility"\ntest = "lab"\n{TEST}{POINTS}'
    (tmp_path / "m.toml").write_text(settled)
    bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
    frf = read_campaign(tmp_path / "c").tests[0].frf
    assert (frf.quantity, frf.value.shape) == ("mobility", (1, 1, 1599))
    assert frf.frequency[0] == 0.5
    assert frf.value[0, 0, 0] == pytest.approx(-1.29302 - 0.927769j)
    np.testing.assert_allclose(frf.frequency[-1], 799.5)
    assert frf.coherence is not None
    assert frf.coherence[0, 0, 0] == pytest.approx(0.604751)


@pytest.mark.parametrize(
    ("file", "asked"),
    [
        ("dataset58_ufb.ufb", "its header says accelerance"),
        ("dataset58_time.unv", "the response record that goes with them"),
        ("dataset58_case1_ascii.unv", "the imaginary part"),
        ("dataset2414_node.unv", "frequency_sd_Hz"),
        ("dataset55.unv", "frequency_sd_Hz"),
        ("dataset151_164_58_55.unv", "temperature_C"),
    ],
)
def test_what_a_real_file_leaves_open(file, asked):
    assert asked in questions(UFF / file)


def test_a_file_of_spectra_alone_is_of_no_use():
    with pytest.raises(BadInput, match="holds no FRF"):
        bring([UFF / "dataset58_spectrum.unv"], out=DATA / "nowhere")


def test_modes_and_units_of_real_uff():
    """Dataset 55: eigenvalue -0.90604 + 25.080i rad/s; dataset 2414: 23383.2 Hz; dataset 164 in inches and pounds."""
    [mode] = content(UFF / "dataset55.unv", FileForm(file="x")).modes
    assert mode.frequency == pytest.approx(abs(complex(-0.90604, 25.080)) / (2 * np.pi))
    assert mode.damping_ratio == pytest.approx(0.90604 / abs(complex(-0.90604, 25.080)))
    [solid] = content(UFF / "dataset2414_node.unv", FileForm(file="x")).modes
    assert solid.frequency == pytest.approx(23383.2)
    assert len(solid.shape) == 3 * 18
    first = {end.direction: value for end, value in solid.shape if end.node == 3992}
    assert (first["+X"], first["+Y"]) == (pytest.approx(0.0195655), pytest.approx(13.0354))
    assert len(mode.shape) == 3 * 7
    [curve] = content(UFF / "dataset151_164_58_55.unv", FileForm(file="x")).curves
    assert curve.value[0].real == pytest.approx(1.73331e-4 * 0.224808943 / 39.3700787, rel=1e-6)
    geometry = content(UFF / "dataset15.unv", FileForm(file="x"))
    assert geometry.places == {}
    assert geometry.unscaled[4] == pytest.approx((5.0976e-15, 83.25, 50.0))


def test_geometry_without_a_unit_is_shown_and_not_taken(tmp_path):
    bring([UFF / "dataset15.unv", UFF / "dataset58_ufb.ufb"], mapping=tmp_path / "m.toml")
    text = (tmp_path / "m.toml").read_text()
    assert 'position_mm = ["?", "?", "?"]    # the file has 51.619, 51.619, 50 in a unit that it does not name' in text


def test_magnitudes_of_a_rotor_rig_make_modes_and_lines_of_its_speed_do_not(tmp_path):
    """EMA at rest and 8 synchronised hits at 20 Hz of the same rig: the same modes; one hit at 20 Hz has its third harmonic as a peak."""
    head = 'spindle = "rig"\n[[files]]\nfile = "at_rest.csv"\ntest = "rest"\n[[files]]\nfile = "20Hz*"\ntest = "turning"\n'
    head += '[[tests]]\nid = "rest"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n[[tests]]\nid = "turning"\ntemperature_C = 20.0\nspeed_rpm = 1200.0\n'
    (tmp_path / "m.toml").write_text(head)
    files = [AMH / "at_rest.csv", AMH / "20Hz_8_hits.csv"]
    notes = bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    rest, turning = read_campaign(tmp_path / "c").tests
    assert [r.frequency for r in rest.modes] == pytest.approx([11.8, 14.4, 24.4, 48.4], abs=0.3)
    assert [r.frequency for r in turning.modes][:2] == pytest.approx([11.6, 14.4], abs=0.3)
    assert any("is a multiple of the running speed" in n for n in notes)
    notes = bring([AMH / "20Hz_1_hit.csv"], mapping=_only(tmp_path, head), out=tmp_path / "d").values["notes"]
    assert [n.count(",") for n in notes if "Hz are multiples of the running speed, no modes" in n] == [2]  # two peaks in one sentence


def _only(folder, head):
    (folder / "turning.toml").write_text('spindle = "rig"\n' + "[[files]]" + head.split("[[files]]")[2].split("[[tests]]")[0] + "[[tests]]" + head.split("[[tests]]")[2])
    return folder / "turning.toml"


def test_a_lone_column_of_complex_numbers(tmp_path):
    """pyuff's beam: complex numbers in brackets and no frequencies; step and points are told. The
    sensor was at none of the first three points, as its FRFs show."""
    files = sorted((PYUFF / "beam_frf").glob("*.txt"))
    assert "step_Hz" in questions(*files)
    points = "".join(
        f'[[points]]\nnode = {k}\nname = "p{k}"\nbody = "beam"\nposition_mm = [{k}.0, 0.0, 0.0]\ndirection = "+Z"\n' for k in (1, 2, 3, 4)
    )
    told = "".join(f'[[files]]\nfile = "meas_point_{k}.txt"\nreference = {k}\n' for k in (1, 2, 3))
    common = '[[files]]\nfile = "*.txt"\ntest = "lab"\nstep_Hz = 1.0\nresponse = 4\nunit = "(m/s^2)/N"\n'
    (tmp_path / "m.toml").write_text(f'spindle = "beam"\n{common}{told}{TEST}{points}')
    bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
    frf = read_campaign(tmp_path / "c").tests[0].frf
    with files[0].open() as stream:
        rows = [complex(row[0]) for row in csv.reader(stream)]
    np.testing.assert_array_equal(frf.value[0, 0], rows[1:])


def test_the_tutorial_files_become_the_campaign_they_are_of(tmp_path):
    """Seven UFF files of another program, conditions read off their names into the form, which needs no more than to be looked at."""
    files = sorted((DATA / "foreign_bond").glob("*.uff"))
    answer = bring(files, mapping=tmp_path / "lab.toml", scene=SCENE)
    assert len(answer.values["open"]) == 2
    assert "?" not in (tmp_path / "lab.toml").read_text().split("# ------")[0].split("\n", 3)[3]
    bring(files, mapping=tmp_path / "lab.toml", scene=SCENE, out=tmp_path / "campaign")
    found, own = read_campaign(tmp_path / "campaign"), read_campaign(DATA / "foreign_bond")
    by_id = {t.id: t for t in own.tests}
    assert {t.id for t in found.tests} == set(by_id)
    for a in found.tests:
        b = by_id[a.id]
        assert (a.temperature, a.speed) == (b.temperature, b.speed)
        assert a.frf.response_nodes == b.frf.response_nodes
        np.testing.assert_array_equal(a.frf.value, b.frf.value)
        np.testing.assert_allclose(a.frf.frequency, b.frf.frequency, rtol=1e-6)
    assert [p.node for p in found.points] == [p.node for p in own.points]
