"""Campaigns and files of other programs read correctly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import SCENE
from tests.made_campaign import FREQUENCY, POINTS, ascii_58, rotor_frf, sets_of
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import read_campaign, write_campaign
from thermospindle.sim.campaign.uff import read_frf, read_uff, write_frf
from thermospindle.sim.identification.frf import check_frf

DATA = Path(__file__).parents[2] / "data"
FOREIGN = ("foreign_bond", "foreign_none")


def big_endian(block: bytes) -> bytes:
    lines = block.split(b"\n", 13)
    data = np.frombuffer(lines[13][: -len(b"    -1\n")], "<f8").astype(">f8").tobytes()
    return b"\n".join([lines[0], lines[1].replace(b"58b     1", b"58b     2"), *lines[2:13], data + b"    -1\n"])


def test_big_endian_reads(tmp_path: Path) -> None:
    frf = rotor_frf()
    write_frf(tmp_path / "a.uff", frf, POINTS, "title", "test")
    (tmp_path / "b.uff").write_bytes(b"".join(map(big_endian, sets_of(tmp_path / "a.uff"))))
    assert (tmp_path / "b.uff").read_bytes() != (tmp_path / "a.uff").read_bytes()
    assert read_frf(tmp_path / "b.uff", "mobility", POINTS) == frf


@pytest.mark.parametrize(("precision", "rtol"), [(5, 1e-5), (6, 1e-12)], ids=["single", "double"])
@pytest.mark.parametrize("even", [True, False], ids=["even", "uneven"])
def test_ascii_and_units_read(tmp_path: Path, precision: int, rtol: float, even: bool) -> None:
    """(mm/s)/lbf = 1e-3 / 4.4482216152605 (m/s)/N."""
    value = rotor_frf().value[0, 0]
    (tmp_path / "a.uff").write_bytes(ascii_58(FREQUENCY, value, precision, even))
    frf = read_frf(tmp_path / "a.uff", "mobility", POINTS)
    np.testing.assert_array_equal(frf.frequency, FREQUENCY)
    np.testing.assert_allclose(frf.value[0, 0].real, 1e-3 / 4.4482216152605 * value.real, rtol=rtol)
    np.testing.assert_allclose(frf.value[0, 0].imag, 1e-3 / 4.4482216152605 * value.imag, rtol=rtol)


@pytest.mark.parametrize(
    ("quantity", "old", "new", "factor"),
    [
        ("receptance", b" m   ", b" um  ", 1e-6),
        ("accelerance", b" m/s^2 ", b" g     ", 9.80665),
        ("mobility", b" N    ", b" kN   ", 1e-3),
    ],
    ids=["um", "g", "kN"],
)
def test_unit_labels_convert(tmp_path: Path, quantity: str, old: bytes, new: bytes, factor: float) -> None:
    frf = rotor_frf(quantity=quantity)
    write_frf(tmp_path / "a.uff", frf, POINTS, "title", "test")
    (tmp_path / "a.uff").write_bytes((tmp_path / "a.uff").read_bytes().replace(old, new))
    read = read_frf(tmp_path / "a.uff", quantity, POINTS)
    np.testing.assert_allclose(read.value, factor * frf.value, rtol=1e-14)
    np.testing.assert_allclose(read.sd, factor * np.asarray(frf.sd), rtol=1e-14)
    np.testing.assert_array_equal(read.coherence, frf.coherence)


def test_without_labels_dataset_164_gives_the_unit(tmp_path: Path) -> None:
    """Its factors turn SI into the file's units: 1000 for mm, so (mm/s)/N is divided by 1000."""
    units = b"    -1\n   164\n         5mm (milli-newton)            2\n" + b"  1.00000000000000000D+03  1.00000000000000000D+00"
    units += b"  1.00000000000000000D+00\n  2.73149999999999980D+02\n    -1\n"
    block = ascii_58(FREQUENCY, rotor_frf().value[0, 0], 6, True).replace(b"mm/s", b"NONE").replace(b"lbf ", b"NONE")
    (tmp_path / "a.uff").write_bytes(units + block)
    np.testing.assert_allclose(read_frf(tmp_path / "a.uff", "mobility", POINTS).value[0, 0], 1e-3 * rotor_frf().value[0, 0], rtol=1e-11)
    (tmp_path / "a.uff").write_bytes(block)
    with pytest.raises(BadInput, match="numerator unit 'NONE'; allowed for velocity are m/s"):
        read_frf(tmp_path / "a.uff", "mobility", POINTS)


def test_opposite_directions_turn_the_sign(tmp_path: Path) -> None:
    """A response read along +X at the point that looks along -X, and a hammer along -Z at one along +Z."""
    frf = rotor_frf()
    write_frf(tmp_path / "a.uff", frf, POINTS, "title", "test")
    data = (tmp_path / "a.uff").read_bytes().replace(b"3  -1   hub_top0         1   3", b"3   1   hub_top0         1   3")
    (tmp_path / "a.uff").write_bytes(data.replace(b"seat90         6   3\n", b"seat90         6  -3\n"))
    sign = np.array([[1, -1], [-1, -1], [1, -1]])
    np.testing.assert_array_equal(read_frf(tmp_path / "a.uff", "mobility", POINTS).value, sign[..., None] * frf.value)


@pytest.mark.parametrize("name", FOREIGN)
def test_campaigns_of_another_program_read(name: str) -> None:
    read = read_campaign(DATA / name)
    assert (read.title, read.spindle, read.quantity, len(read.points)) == (name, "hdd_2003", "mobility", 7)
    assert {"T20_n0", "T40_n0", "T60_n0", "T20_n7200", "T60_n7200"} <= {t.id for t in read.tests}
    assert read.points[2] == Point(3, "hub_side0", "hub", (0.0125, 0.0, 0.015), (1.0, 0.0, 0.0))
    for test in read.tests:
        assert test.id == f"T{test.temperature:g}_n{test.speed / RPM:.0f}"
        assert test.frf is not None
        assert test.frf.value.shape == (7, 2, len(test.frf.frequency))
        np.testing.assert_array_equal(test.frf.frequency, np.arange(test.frf.frequency[0], 6001.0, 4.0))
        assert test.frf.frequency[0] in (400.0, 402.0)


def test_values_are_those_of_the_file() -> None:
    """The second set of the test at 20 C: its last line, single precision, decoded here from the file's bytes."""
    file = DATA / "foreign_bond" / "T20_n0.uff"
    expected = np.frombuffer(sets_of(file)[1].split(b"\n", 13)[13][-7 - 8 : -7], "<c8")[0]
    assert read_campaign(file.parent).tests[0].frf.value[1, 0, -1] == expected  # type: ignore[union-attr]


def test_campaign_of_another_program_goes_through_writing(tmp_path: Path) -> None:
    read = read_campaign(DATA / "foreign_none")
    write_campaign(read, tmp_path / "c")
    assert read_campaign(tmp_path / "c") == read


@pytest.mark.parametrize("name", FOREIGN)
def test_every_conjugated_test_is_refused(name: str) -> None:
    for test in read_campaign(DATA / name).tests:
        assert test.frf is not None
        with pytest.raises(BadInput, match="conjugated"):
            check_frf("file", replace(test.frf, value=test.frf.value.conj()), test.speed)
        one = test.frf.value.copy()
        one[4, 1] = one[4, 1].conj()
        with pytest.raises(BadInput, match=r"H\(5,2\).*conjugated"):
            check_frf("file", replace(test.frf, value=one), test.speed)


def test_public_file_artemis_geometry() -> None:
    sets = read_uff(DATA / "pyuff" / "uff_files" / "Artemis export - Geometry RPBC_setup_05_14102016_105117.uff")
    assert [s["type"] for s in sets] == [15, 82, 82, 2412]
    assert sets[0]["node_nums"][:3].tolist() == [16, 17, 18]
    assert (sets[0]["x"][1], sets[0]["y"][2], sets[0]["z"][-1], len(sets[0]["x"])) == (1.53, 3.84, 1.665, 74)
    assert (sets[1]["id"], len(sets[1]["nodes"]), sets[1]["nodes"][:5].tolist()) == (
        "Global Trace Lines",
        249,
        [0, 16, 17, 0, 16],
    )
    assert (len(sets[2]["nodes"]), sets[2]["nodes"][-2:].tolist()) == (75, [139, 140])
    triangles = sets[3][91]
    assert (len(triangles), triangles[0]["nodes_nums"], triangles[-1]["nodes_nums"]) == (108, [16, 17, 20], [140, 138, 139])


def test_public_file_testlab() -> None:
    sets = read_uff(DATA / "pyuff" / "uff_files" / "TestLab 161 164 18 15 82.uff")
    assert [s["type"] for s in sets] == [151, 164, 18, 15, 82, 82, 82]
    assert (sets[0]["model_name"], sets[0]["db_app"]) == ("AME_Test", "LMS Test.Lab Rev project-15A")
    assert (sets[1]["units_code"], sets[1]["length"], sets[1]["temp_offset"]) == (9, 1.0, -273.15)
    assert sets[3]["node_nums"].tolist() == list(range(1, 37))
    assert (sets[3]["x"][0], sets[3]["y"][34], sets[3]["z"][10]) == (-2.4, 8.4, 2.35)
    assert (sets[4]["id"], sets[4]["nodes"].tolist()) == ("Massif", [2, 5, 6, 3, 4, 1, 2, 3, 0])
    assert (sets[6]["id"], sets[6]["nodes"].tolist()) == ("Dalle", [34, 33, 36, 35, 32, 31, 34, 0, 33, 32, 0])


def test_public_file_with_a_header_that_is_not_ascii() -> None:
    (content,) = read_uff(DATA / "pyuff" / "uff_files" / "non_ascii_header.uff")
    assert (content["id1"], content["func_type"], content["abscissa_inc"]) == ("ref6_23_Mar", 4, 0.195313)
    assert content["ordinate_axis_units_lab"] == "(1/N)*(m/s\ufffd)"
    assert content["data"][[0, 1, 5]].tolist() == [0.407994, -0.0599924 - 0.055326j, 3.75037 + 2.93363j]


def test_public_file_psd() -> None:
    (content,) = read_uff(DATA / "pyuff" / "uff_files" / "sample_dataset58_psd.uff")
    assert (content["func_type"], content["rsp_ent_name"], content["num_pts"]) == (9, "Pilot 1", 3201)
    assert content["x"][[0, 1, 200]].tolist() == [0.0, 1.0, 200.0]
    assert content["data"][[1, 2, 200, 3200]].tolist() == [1.255863e-06, 4.311770e-07, 1.483761e-04, 2.634827e-10]


def test_papers_measured_modes_read() -> None:
    read = read_campaign(SCENE / "measured" / "jang_2003")
    cold, hot = read.tests
    assert (cold.id, cold.temperature, hot.id, hot.temperature, cold.speed) == ("T20", 20.0, "T60", 60.0, 0.0)
    assert [m.frequency for m in cold.modes] == [1023, 1552, 1738, 1788, 2068]
    assert [b.frequency - a.frequency for a, b in zip(cold.modes, hot.modes, strict=True)] == [
        3,
        -2,
        -28,
        -27,
        -19,
    ]  # printed shifts
    assert [m.kind for m in hot.modes] == ["axial", "axial", "rocking", "rocking", "axial"]
    assert {m.frequency_sd for t in read.tests for m in t.modes} == {1.0}
    assert {m.damping_ratio for t in read.tests for m in t.modes} == {None}
    assert "assumed" in read.note


def test_kinds_of_modes_may_be_written_with_capitals(tmp_path: Path) -> None:
    """Modes are paired by them: `Axial` was paired with a rocking mode."""
    for name in ("campaign.toml", "modes.csv"):
        (tmp_path / name).write_text((SCENE / "measured" / "jang_2003" / name).read_text(encoding="utf-8").replace(",axial,", ",Axial,"), encoding="utf-8")
    assert [m.kind for m in read_campaign(tmp_path).tests[0].modes] == ["axial", "axial", "rocking", "rocking", "axial"]
