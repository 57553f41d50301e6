"""Campaigns: what is written reads back bit for bit, other programs' files read correctly, bad files are refused by name."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from model.machine import Point
from model.scene import BadInput
from sim.campaign import Campaign, Limits, ModeRow, Noise, Test, read_campaign, write_campaign
from sim.campaign_file import in_unit
from sim.frf import Frf, check_frf
from sim.uff import read_frf, read_uff, write_frf

MAIN = Path(__file__).parents[2]
SHARED = MAIN.parent / "shared"
PRACTICE = ("practice_a", "practice_b", "practice_c")
RPM = 2 * np.pi / 60

POINTS = (
    Point(1, "hub_top0", "hub", (0.012, 0.0, 0.02), (0.0, 0.0, 1.0)),
    Point(3, "hub_side0", "hub", (0.0125, 0.0, 0.015), (-1.0, 0.0, 0.0)),
    Point(6, "seat90", "seat", (0.0, 0.02, 0.0), (0.0, 0.0, 1.0)),
)
SHAPES = np.array([[0.9, 0.4, -0.7], [0.6, -1.1, 0.8]])  # two modes at the three points, kg^-1/2
FREQUENCY = 400.0 + np.arange(301)


def shared(*parts: str) -> Path:
    path = SHARED.joinpath(*parts)
    if not path.exists():
        pytest.skip("../shared is not here")
    return path


def rotor_frf(frequency: np.ndarray = FREQUENCY, quantity: str = "mobility", gyroscopic: float = 0.0, noise: float = 0.002) -> Frf:
    """FRFs from hammers 1 and 6 of two modes at 480 and 600 Hz, 1 % damped, coupled by `gyroscopic` (rad/s)."""
    s = 2j * np.pi * frequency[:, None, None]
    w = np.diag(2 * np.pi * np.array([480.0, 600.0]))
    dynamic = s**2 * np.eye(2) + s * (0.02 * w + gyroscopic * np.array([[0, 1], [-1, 0]])) + w**2
    value = np.einsum("mr,nmk,kq->rqn", SHAPES, np.linalg.inv(dynamic), SHAPES[:, [0, 2]])
    value = value * (2j * np.pi * frequency) ** ("receptance", "mobility", "accelerance").index(quantity)
    random = np.random.default_rng(1)
    error = noise * np.abs(value).max() * (random.standard_normal((2, *value.shape)) / np.sqrt(2))
    sd = np.full(value.shape, noise * np.abs(value).max()) if noise else None
    return Frf(frequency, value + error[0] + 1j * error[1], (1, 3, 6), (1, 6), quantity, 1 - 0.02 * random.random(value.shape), sd)


def campaign(**changes: object) -> Campaign:
    tests = (
        Test("T20_n0", 20.0, 0.0, frf=rotor_frf()),
        Test(
            "T20.5_n7200", 20.5, 7200 * RPM, 3.3, 1234.5, 2,
            {"air": "dry; Ω é", "humidity": 0.1, "open": True, "list": [1, 2.5], "sub table": {"a": -3}},
            rotor_frf(gyroscopic=150.0),
            (ModeRow("T20.5_n7200", 1, "axial", 1 / 3, 0.01), ModeRow("T20.5_n7200", 2, "rocking", 1738.1, 0.1, 0.011, 1e-4 / 3)),
        ),
    )  # fmt: skip
    return replace(Campaign('Zwei "Tests"\nin °C', "hdd_2003", "mobility", POINTS, tests, Noise(0.004, 0.0002), "a note"), **changes)  # type: ignore[arg-type]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_campaign(campaign(), tmp_path / "c")
    return tmp_path / "c"


# ---------------------------------------------------------------- what is written reads back


def test_campaign_reads_back_bit_for_bit(folder: Path) -> None:
    assert read_campaign(folder) == campaign()
    assert sorted(p.name for p in folder.iterdir()) == ["T20.5_n7200.uff", "T20_n0.uff", "campaign.toml", "modes.csv"]


def test_written_bytes_do_not_depend_on_when(folder: Path) -> None:
    write_campaign(read_campaign(folder), folder.with_name("d"))
    for file in folder.iterdir():
        assert file.read_bytes() == (folder.with_name("d") / file.name).read_bytes()


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize(
    "frequency",
    [400.0 + np.arange(101), np.fft.rfftfreq(4096, 1 / 51200)[20:200], 400.05 + 0.1 * np.arange(99), np.linspace(1, 2, 77)],
    ids=["whole", "fft", "tenths", "sevenths"],
)
def test_frf_reads_back_bit_for_bit(tmp_path: Path, frequency: np.ndarray, quantity: str) -> None:
    frf = rotor_frf(frequency, quantity)
    corners = frf.value.copy()
    corners[0, 0, 5:8] = [complex(-0.0, 1e-300), complex(-0.0, -0.0), complex(5e-324, -1e308)]  # of double precision
    frf = replace(frf, value=corners)
    write_frf(tmp_path / "a.uff", frf, POINTS, "title", "test")
    assert read_frf(tmp_path / "a.uff", quantity, POINTS) == frf


def test_frf_equality_sees_the_last_bit() -> None:
    frf = rotor_frf()
    value = frf.value.copy()
    value[2, 1, 300] = complex(value[2, 1, 300].real, np.nextafter(value[2, 1, 300].imag, 1))
    assert frf == rotor_frf()
    assert frf != replace(frf, value=value)
    assert frf != replace(frf, sd=None)
    assert frf != replace(frf, reference_nodes=(6, 1))


def test_header_counts_the_bytes_of_the_data(folder: Path) -> None:
    """UC-SDRL: field 5 of the 58b line is the number of binary bytes; pyuff reads without it, other programs do not."""
    line = (folder / "T20_n0.uff").read_bytes().splitlines()[1]
    assert line.split() == [b"58b", b"1", b"2", b"11", str(301 * 16).encode(), b"0", b"0", b"0", b"0"]


@pytest.mark.parametrize("rpm", [0.0, 7200.0, 5400.1, -333.3, 10000 / 3])
def test_speeds_born_in_rpm_come_back(rpm: float) -> None:
    assert in_unit(rpm * RPM, RPM) * RPM == rpm * RPM


def test_existing_folder_is_kept(folder: Path) -> None:
    before = {f.name: f.read_bytes() for f in folder.iterdir()}
    with pytest.raises(BadInput, match="is not empty"):
        write_campaign(campaign(title="other"), folder)
    bad = campaign(tests=(Test("T", 20.0, 0.0, frf=replace(rotor_frf(), value=rotor_frf().value.conj())),))
    with pytest.raises(BadInput, match=re.escape(f"{folder}/T.uff: H(1,1)")):
        write_campaign(bad, folder, replace=True)
    assert {f.name: f.read_bytes() for f in folder.iterdir()} == before
    assert [f.name for f in folder.parent.iterdir()] == ["c"]


def test_replace_takes_only_a_campaign(folder: Path, tmp_path: Path) -> None:
    write_campaign(campaign(title="other", tests=campaign().tests[:1]), folder, replace=True)
    assert read_campaign(folder).title == "other"
    assert sorted(p.name for p in folder.iterdir()) == ["T20_n0.uff", "campaign.toml"]
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.txt").write_text("dear")
    with pytest.raises(BadInput, match="is not empty"):
        write_campaign(campaign(), tmp_path / "home", replace=True)


def changed(**changes: object) -> Campaign:
    test = campaign().tests[0]
    assert test.frf is not None
    return campaign(tests=(replace(test, frf=replace(test.frf, **changes)),))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (campaign(points=(replace(POINTS[0], name="hub_top_left"), *POINTS[1:])), "points.1.name = 'hub_top_left'.*10"),
        (
            campaign(points=(replace(POINTS[0], name="Nabenspäß"), *POINTS[1:])),
            "T20_n0.uff: points.1.name = 'Nabenspäß'.*ten bytes",
        ),
        (campaign(points=POINTS[:2]), r"T20_n0.uff: node 6 is no point.*\[1, 3\]"),
        (campaign(points=(replace(POINTS[0], direction=(0.6, 0.0, 0.8)), *POINTS[1:])), "directions along an axis"),
        (campaign(tests=(Test("a/b", 20.0, 0.0, frf=rotor_frf()),)), "tests.a/b.id = 'a/b': must be letters"),
        (campaign(tests=(Test("a", 20.0, 0.0),)), "tests.a: has neither frf nor rows"),
        (campaign(tests=(Test("a", 20.0, 0.0, conditions={"x": object()}, frf=rotor_frf()),)), "conditions: <object"),
        (campaign(quantity="receptance"), "tests.T20_n0: FRFs of mobility in a campaign of receptance"),
        (changed(value=np.full((3, 2, 301), np.nan + 0j)), "T20_n0.uff: FRF: needs finite numbers"),
        (changed(frequency=FREQUENCY[:-1]), r"FRF: needs finite numbers of shape \(3, 2, 300\)"),
        (changed(value=rotor_frf().value.astype(np.complex64)), "would not read back bit for bit"),
    ],
    ids=["name", "bytes", "node", "oblique", "id", "empty", "object", "quantity", "nan", "shape", "single"],
)
def test_writing_refuses(tmp_path: Path, bad: Campaign, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        write_campaign(bad, tmp_path / "c")
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------- other programs' files


def sets_of(file: Path) -> list[bytes]:
    """The sets of a 58b file, each from its opening line to its closing one."""
    return [b"    -1\n" + s for s in re.split(rb"(?<=    -1\n)    -1\n", file.read_bytes().removeprefix(b"    -1\n"))]


def big_endian(block: bytes) -> bytes:
    lines = block.split(b"\n", 13)
    data = np.frombuffer(lines[13][: -len(b"    -1\n")], "<f8").astype(">f8").tobytes()
    return b"\n".join([lines[0], lines[1].replace(b"58b     1", b"58b     2"), *lines[2:13], data + b"    -1\n"])


def ascii_58(frequency: np.ndarray, value: np.ndarray, precision: int, even: bool) -> bytes:
    """An ASCII dataset 58 of H(1,1), mobility, by the published formats (precision 5 single, 6 double complex)."""
    head = "model\nNONE\n17-Oct-17 13:50:13\nNONE\nNONE\n    4         0    0         0 NONE               1   3 NONE               1   3\n"
    step = frequency[1] - frequency[0]
    head += f"{precision:10d}{len(frequency):10d}{even:10d}{even * frequency[0]:13.5E}{even * step:13.5E}{0:13.5E}\n"
    units = ((18, "Hz"), (11, "mm/s"), (13, "lbf"), (0, "NONE"))
    head += "".join(f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {unit:20}\n" for kind, unit in units)
    width = "13.5E" if precision == 5 else "20.12E"
    cells = []
    for f, z in zip(frequency, value, strict=True):
        cells += ([] if even else [f"{f:13.5E}"]) + [f"{z.real:{width}}", f"{z.imag:{width}}"]
    a_line = 6 if precision == 5 else (4 if even else 3)
    body = "".join("".join(cells[i : i + a_line]) + "\n" for i in range(0, len(cells), a_line))
    return f"    -1\n    58\n{head}{body}    -1\n".encode()


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


@pytest.mark.parametrize("name", PRACTICE)
def test_practice_campaigns_read(name: str) -> None:
    read = read_campaign(shared("practice", name))
    assert (read.title, read.spindle, read.quantity, len(read.points)) == (name, "hdd_2003", "mobility", 7)
    assert [t.id for t in read.tests][:5] == ["T20_n0", "T30_n0", "T40_n0", "T50_n0", "T60_n0"]
    assert read.points[2] == Point(3, "hub_side0", "hub", (0.0125, 0.0, 0.015), (1.0, 0.0, 0.0))
    for test in read.tests:
        assert test.id == f"T{test.temperature:g}_n{test.speed / RPM:.0f}"
        assert test.frf is not None
        assert test.frf.value.shape == (7, 2, 2601)
        np.testing.assert_array_equal(test.frf.frequency, np.arange(400.0, 3001.0))


def test_practice_values_are_those_of_the_file() -> None:
    """The second set of practice_a at 20 C: its last line, decoded here from the file's bytes."""
    file = shared("practice", "practice_a", "T20_n0.uff")
    expected = np.frombuffer(sets_of(file)[1].split(b"\n", 13)[13][-7 - 16 : -7], "<c16")[0]
    assert read_campaign(file.parent).tests[0].frf.value[1, 0, -1] == expected  # type: ignore[union-attr]


def test_practice_campaign_goes_through_writing(tmp_path: Path) -> None:
    read = read_campaign(shared("practice", "practice_c"))
    write_campaign(read, tmp_path / "c")
    assert read_campaign(tmp_path / "c") == read


@pytest.mark.parametrize("name", PRACTICE)
def test_every_conjugated_practice_test_is_refused(name: str) -> None:
    for test in read_campaign(shared("practice", name)).tests:
        assert test.frf is not None
        with pytest.raises(BadInput, match="conjugated"):
            check_frf("file", replace(test.frf, value=test.frf.value.conj()), test.speed)
        one = test.frf.value.copy()
        one[4, 1] = one[4, 1].conj()
        with pytest.raises(BadInput, match=r"H\(5,6\).*conjugated"):
            check_frf("file", replace(test.frf, value=one), test.speed)


def test_public_file_artemis_geometry() -> None:
    sets = read_uff(shared("reference", "uff_files", "Artemis export - Geometry RPBC_setup_05_14102016_105117.uff"))
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
    sets = read_uff(shared("reference", "uff_files", "TestLab 161 164 18 15 82.uff"))
    assert [s["type"] for s in sets] == [151, 164, 18, 15, 82, 82, 82]
    assert (sets[0]["model_name"], sets[0]["db_app"]) == ("AME_Test", "LMS Test.Lab Rev project-15A")
    assert (sets[1]["units_code"], sets[1]["length"], sets[1]["temp_offset"]) == (9, 1.0, -273.15)
    assert sets[3]["node_nums"].tolist() == list(range(1, 37))
    assert (sets[3]["x"][0], sets[3]["y"][34], sets[3]["z"][10]) == (-2.4, 8.4, 2.35)
    assert (sets[4]["id"], sets[4]["nodes"].tolist()) == ("Massif", [2, 5, 6, 3, 4, 1, 2, 3, 0])
    assert (sets[6]["id"], sets[6]["nodes"].tolist()) == ("Dalle", [34, 33, 36, 35, 32, 31, 34, 0, 33, 32, 0])


def test_public_file_with_a_header_that_is_not_ascii() -> None:
    (content,) = read_uff(shared("reference", "uff_files", "non_ascii_header.uff"))
    assert (content["id1"], content["func_type"], content["abscissa_inc"]) == ("ref6_23_Mar", 4, 0.195313)
    assert content["ordinate_axis_units_lab"] == "(1/N)*(m/s\ufffd)"
    assert content["data"][[0, 1, 5]].tolist() == [0.407994, -0.0599924 - 0.055326j, 3.75037 + 2.93363j]


def test_public_file_psd() -> None:
    (content,) = read_uff(shared("reference", "uff_files", "sample_dataset58_psd.uff"))
    assert (content["func_type"], content["rsp_ent_name"], content["num_pts"]) == (9, "Pilot 1", 3201)
    assert content["x"][[0, 1, 200]].tolist() == [0.0, 1.0, 200.0]
    assert content["data"][[1, 2, 200, 3200]].tolist() == [1.255863e-06, 4.311770e-07, 1.483761e-04, 2.634827e-10]


def test_papers_measured_modes_read() -> None:
    read = read_campaign(MAIN / "scenes" / "hdd_2003" / "measured" / "jang_2003")
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


# ---------------------------------------------------------------- refusals


def edit(file: str, old: str, new: str, count: int = 1) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        data = (folder / file).read_bytes()
        assert old.encode() in data
        (folder / file).write_bytes(data.replace(old.encode(), new.encode(), count))

    return change


def edit_set(number: int, change: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    """Change set `number` (from 1; three sets a pair of nodes: FRF, coherence, standard error) of T20_n0.uff."""

    def apply(folder: Path) -> None:
        sets = sets_of(folder / "T20_n0.uff")
        sets[number - 1] = change(sets[number - 1])
        (folder / "T20_n0.uff").write_bytes(b"".join(sets))

    return apply


def put_nan(block: bytes) -> bytes:
    at = len(block) - len(b"    -1\n") - 16 * 301 + 16 * 50  # line 50, 450 Hz
    return block[:at] + np.float64(np.nan).tobytes() + block[at + 8 :]


def missing_line(folder: Path) -> None:
    keep = np.delete(np.arange(301), 120)
    (folder / "T20_n0.uff").write_bytes(ascii_58(FREQUENCY[keep], rotor_frf().value[0, 0, keep], 6, False))


TOML, UFF, CSV = "campaign.toml", "T20_n0.uff", "modes.csv"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (edit(TOML, "speed_rpm = 7200", "spead_rpm = 7200"), "campaign.toml: tests.T20.5_n7200.spead_rpm: unknown key; allowed.*speed_rpm"),
        (edit(TOML, "spindle =", "spindel ="), "campaign.toml: spindel: unknown key; allowed.*spindle"),
        (edit(TOML, "of_value =", "value ="), "campaign.toml: noise.value: unknown key; allowed here: of_value"),
        (edit(TOML, "position_mm", "position"), "campaign.toml: points.1.position: unknown key; allowed.*position_mm"),
        (edit(TOML, "quantity = \"mobility\"\n", ""), "campaign.toml: quantity: missing"),
        (edit(TOML, "temperature_C = 20.5\n", ""), "campaign.toml: tests.T20.5_n7200.temperature_C: missing"),
        (edit(TOML, "= 20.5\n", "= \"20.5\"\n"), "tests.T20.5_n7200.temperature_C = '20.5': .*number"),
        (edit(TOML, "= 20.5\n", "= -300.0\n"), "tests.T20.5_n7200.temperature_C = -300.0: .*greater than -273.15"),
        (edit(TOML, "= 20.5\n", "= nan\n"), "tests.T20.5_n7200.temperature_C = nan: .*finite"),
        (edit(TOML, "repeat = 2", "repeat = 0"), "tests.T20.5_n7200.repeat = 0: .*greater than or equal to 1"),
        (edit(TOML, "hammer_level_N = 3.3", "hammer_level_N = 0.0"), "hammer_level_N = 0.0: .*greater than 0"),
        (edit(TOML, "\"mobility\"", "\"impedance\""), "quantity = 'impedance': .*'receptance', 'mobility' or 'accelerance'"),
        (edit(TOML, "\"+Z\"", "\"up\""), r"points.1.direction = 'up': must be one of \+X"),
        (edit(TOML, "hub_top0", "hub_top_left"), "points.1.name = 'hub_top_left': .*10"),
        (edit(TOML, "node = 3", "node = 1"), "points: node = 1 stands 2 times"),
        (edit(TOML, "id = \"T20_n0\"", "id = \"T20.5_n7200\""), "tests: id = 'T20.5_n7200' stands 2 times"),
        (edit(TOML, "T20.5_n7200.uff", "T20_n0.uff"), "file = 'T20_n0.uff' stands 2 times"),
        (edit(TOML, "\"T20_n0.uff\"", "\"../T20_n0.uff\""), "tests.T20_n0.frf = '../T20_n0.uff': must be letters"),
        (edit(TOML, "\"T20_n0.uff\"", "\"T99.uff\""), "T99.uff: no such file"),
        (edit(TOML, "title =", "title"), "campaign.toml: not a TOML file"),
        (edit(TOML, "node = 6", "node = 7"), r"T20_n0.uff: set 7 .*response node 6 is no point of the campaign; allowed are \[1, 3, 7\]"),
        (edit(CSV, "rocking,1738.1", "rocking,-1738.1"), "modes.csv: line 3: frequency_Hz = '-1738.1': .*greater than 0"),
        (edit(CSV, "1738.1,0.1", "1738.1,"), "modes.csv: line 3: frequency_sd_Hz: missing"),
        (edit(CSV, "0.011", "1.1"), "modes.csv: line 3: damping_ratio = '1.1': .*less than 1"),
        (edit(CSV, "0.011", ""), "modes.csv: line 3: damping_ratio_sd = .*without a damping_ratio"),
        (edit(CSV, "T20.5_n7200,2", "T99,2"), "modes.csv: line 3: test = 'T99': no such test; allowed are T20_n0"),
        (edit(CSV, "T20.5_n7200,2", "T20.5_n7200,1"), "modes.csv: line 3: mode = 1: .*already"),
        (edit(CSV, "frequency_sd_Hz", "sd"), "modes.csv: line 1: the columns must be test,mode"),
        (edit(CSV, ",0.011", ""), "modes.csv: line 3: has 6 cells; 7 are needed"),
        (edit(UFF, " m/s  ", " knots"), "T20_n0.uff: set 1 .*numerator unit 'knots'; allowed for velocity are m/s, mm/s"),
        (edit(UFF, "        11    0", "        12    0"), r"set 1 .*numerator is acceleration \(type 12\); allowed is velocity \(type 11\)"),
        (edit(UFF, "        13    0", "         8    0"), r"set 1 .*denominator is displacement \(type 8\).*excitation force \(type 13\)"),
        (edit(UFF, "        11    0    0", "        11    1    1"), r"set 1 .*unit exponents \(1, 1, 0\)"),
        (edit(UFF, " N   ", " kgf "), "set 1 .*denominator unit 'kgf'; allowed for excitation force are N"),
        (edit(UFF, " Hz     ", " rad/s  "), "set 1 .*abscissa of type 18 in 'rad/s'"),
        (edit(UFF, "         6       301", "         6       305"), "T20_n0.uff: set 1: holds 301 values, its header says 305"),
        (edit(UFF, "58b     1     2", "58b     1     3"), "T20_n0.uff: set 1: floating point format 3"),
        (edit(UFF, "  -1   hub_top0", "   2   hub_top0"), r"set 4 .*response direction 2 is not along the point's; allowed are -1 and 1"),
        (edit_set(4, lambda b: b.replace(b"1.00000e+00", b"2.00000e+00")), "set 4 .*301 from 400 to 1000 Hz, but 301 from 400 to 700 Hz"),
        (edit_set(4, put_nan), r"T20_n0.uff: set 4 \(FRF of response 3, reference 1\): NaN or infinite at 450 Hz"),
        (edit_set(4, lambda b: b""), "T20_n0.uff: FRF of response 3, reference 1: is missing"),
        (edit_set(5, lambda b: b""), "T20_n0.uff: coherence of response 3, reference 1: is missing"),
        (edit_set(4, lambda b: b + b), "T20_n0.uff: set 5 .*stands twice"),
        (edit_set(18, lambda b: b[:-7]), "T20_n0.uff: does not end with a line"),
        (edit_set(18, lambda b: b[:-900]), "T20_n0.uff: does not end with a line"),
        (edit(UFF, "    4         0", "    2         0", 6), "T20_n0.uff: holds no FRF"),
        (missing_line, "T20_n0.uff: set 1 .*from 519 to 521 Hz among steps of 1 Hz"),
    ],
    ids=[
        "test-key", "top-key", "noise-key", "point-key", "no-quantity", "no-temperature", "text", "cold", "nan", "repeat", "level",
        "quantity", "direction", "long-name", "node-twice", "id-twice", "file-twice", "path", "no-file", "no-toml", "unknown-node",
        "csv-negative", "csv-no-sd", "csv-damping", "csv-sd-alone", "csv-test", "csv-mode-twice", "csv-columns", "csv-cells",
        "unit-label", "numerator", "denominator", "exponents", "force-label", "abscissa", "count", "float-format", "axis",
        "other-lines", "frf-nan", "frf-missing", "coherence-missing", "frf-twice", "no-end", "cut-off", "no-frf", "gap",
    ],
)  # fmt: skip
def test_reading_refuses(folder: Path, change: Callable[[Path], None], words: str) -> None:
    read_campaign(folder)
    change(folder)
    with pytest.raises(BadInput, match=words) as refusal:
        read_campaign(folder)
    assert str(folder) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="nowhere: no campaign there"):
        read_campaign(tmp_path / "nowhere")


def part(change: Callable[[np.ndarray], object], name: str = "value") -> Frf:
    frf = rotor_frf()
    array = getattr(frf, name).copy()
    change(array)
    return replace(frf, **{name: array})


def put(key: object, value: Callable[[np.ndarray], object]) -> Callable[[np.ndarray], None]:
    def change(array: np.ndarray) -> None:
        array[key] = value(array)  # type: ignore[index]

    return change


@pytest.mark.parametrize(
    ("frf", "words"),
    [
        (part(put((1, 0), lambda v: v[1, 0].conj())), r"file: H\(3,1\): .*before the blow: the FRF is conjugated; allowed is"),
        (part(put((0, 0), lambda v: -v[0, 0])), r"H\(1,1\): .*negative real part.*allowed is 1%"),
        (part(put((0, 0), lambda v: v[1, 0])), r"H\(1,1\): .*negative real part"),
        (part(put((0, 1), lambda v: 1.3 * v[0, 1])), r"H\(1,6\) and H\(6,1\) differ by 26% at rest; reciprocity allows 15%"),
        (part(put((0, 1), lambda v: -v[0, 1])), r"H\(1,6\) and H\(6,1\) differ by 200%"),
        (part(put((1, 0, slice(80, 90)), lambda v: 0)), r"H\(3,1\): zero on 10 lines, the first at 480 Hz"),
        (part(put((1, 0, slice(80, 90)), lambda v: v[1, 0, 80])), r"H\(3,1\): the same value on five lines from 480 Hz"),
        (part(put(1, lambda v: 0)), "response 3: zero on every line"),
        (part(put((1, 0), lambda c: 0.5), "coherence"), r"H\(3,1\): coherence = 0.5 .*at least 0.8"),
        (part(put((1, 0, 7), lambda c: 1.2), "coherence"), r"H\(3,1\): coherence from .* to 1.2; allowed is 0 to 1"),
        (part(put((1, 0, 7), lambda s: 0.0), "sd"), r"H\(3,1\): standard error = 0: must be positive"),
    ],
    ids=["conjugated", "polarity", "other-point", "gain", "sign", "zeros", "held", "dead", "coherence", "coherence-range", "sd"],
)  # fmt: skip
def test_physics_refuses(frf: Frf, words: str) -> None:
    check_frf("file", rotor_frf(), 0.0)
    with pytest.raises(BadInput, match=words):
        check_frf("file", frf, 0.0)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("gyroscopic", [0.0, 150.0], ids=["rest", "spinning"])
def test_time_and_power_for_every_quantity(quantity: str, gyroscopic: float) -> None:
    frf = rotor_frf(quantity=quantity, gyroscopic=gyroscopic, noise=0.0)
    check_frf("file", frf, gyroscopic)
    with pytest.raises(BadInput, match="conjugated"):
        check_frf("file", replace(frf, value=frf.value.conj()), gyroscopic)
    with pytest.raises(BadInput, match="negative real part"):
        check_frf("file", replace(frf, value=-frf.value), gyroscopic)


def test_reciprocity_is_asked_at_rest_only() -> None:
    frf = rotor_frf(gyroscopic=150.0)
    check_frf("file", frf, 7200 * RPM)
    with pytest.raises(BadInput, match="reciprocity"):
        check_frf("file", frf, 0.0)


def test_noise_alone_is_no_conjugated_frf() -> None:
    """Where symmetry forbids an answer an FRF is noise; either time direction must pass, at any length (400 draws)."""
    random = np.random.default_rng(3)
    for n in (20, 50, 200, 2601):
        for _ in range(100):
            noise = random.standard_normal((1, 1, n)) + 1j * random.standard_normal((1, 1, n))
            check_frf("file", Frf(np.arange(1.0, n + 1), noise, (3,), (1,), "mobility"), 0.0)


def test_low_coherence_at_antiresonances_is_accepted() -> None:
    frf = rotor_frf()
    size = np.abs(frf.value)
    coherence = np.where(size < np.quantile(size, 0.6, axis=-1, keepdims=True), 0.1, 0.99)  # most of the lines are poor
    check_frf("file", replace(frf, coherence=coherence), 0.0)
    with pytest.raises(BadInput, match=r"coherence = 0\.99"):
        check_frf("file", replace(frf, coherence=coherence), 0.0, Limits(coherence=0.995))


def test_limits_reach_reading(folder: Path) -> None:
    read_campaign(folder, Limits(reciprocity=0.05))
    with pytest.raises(BadInput, match=r"T20_n0.uff: H\(1,6\) and H\(6,1\) differ by .*reciprocity allows 0%"):
        read_campaign(folder, Limits(reciprocity=1e-6))


def test_nothing_is_left_of_a_write_that_fails(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk fills after the first file: the old campaign stays, no partial one appears."""

    def full(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr("sim.campaign._write_modes", full)
    with pytest.raises(OSError, match="no space"):
        write_campaign(campaign(title="other"), folder, replace=True)
    assert read_campaign(folder) == campaign()
    assert [f.name for f in folder.parent.iterdir()] == ["c"]


def test_old_campaign_comes_back_when_the_new_one_cannot_be_moved(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = Path.rename

    def refuse_partial(path: Path, target: Path) -> Path:
        if path.name.endswith(".partial"):
            raise OSError("moving is refused")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", refuse_partial)
    with pytest.raises(OSError, match="moving"):
        write_campaign(campaign(title="other"), folder, replace=True)
    assert read_campaign(folder) == campaign()
    assert [f.name for f in folder.parent.iterdir()] == ["c"]
