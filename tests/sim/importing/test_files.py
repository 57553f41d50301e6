"""The same FRFs in every form that laboratories export come back as the same campaign."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY, POINTS, ascii_58, rotor_frf
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.uff import write_frf
from thermospindle.sim.identification.frf import out_of
from thermospindle.sim.importing import units
from thermospindle.sim.importing.files.labels import role_of
from thermospindle.sim.importing.names import conditions_of, plain

FRF = rotor_frf(noise=0.0005)
SPINDLE = 'spindle = "hdd_2003"\n'
HEAD = """
[[tests]]
id = "T20"
temperature_C = 20.0
speed_rpm = 0.0
[[points]]
node = 1
name = "hub_top0"
body = "hub"
position_mm = [12.0, 0.0, 20.0]
direction = "+Z"
[[points]]
node = 3
name = "hub_side0"
body = "hub"
position_mm = [12.5, 0.0, 15.0]
direction = "-X"
[[points]]
node = 6
name = "seat90"
body = "seat"
position_mm = [0.0, 20.0, 0.0]
direction = "+Z"
"""
PAIRS = [(r, q) for r in FRF.response_nodes for q in FRF.reference_nodes]


def imported(folder: Path, mapping: str, *files: Path):
    (folder / "mapping.toml").write_text(SPINDLE + mapping + HEAD)
    bring(files, mapping=folder / "mapping.toml", out=folder / "campaign")
    return read_campaign(folder / "campaign").tests[0].frf


def table(file: Path, heads: list[str], columns: list[np.ndarray], separator: str = ",", comma: bool = False, above: str = "") -> Path:
    rows = [separator.join(f"{v:.12g}".replace(".", ",") if comma else f"{v:.12g}" for v in row) for row in np.array(columns).T]
    file.write_text(above + separator.join(heads) + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return file


def columns(form: str, unit: str, value=FRF.value):
    heads, found = [], []
    for (r, q), h in zip(PAIRS, value.reshape(len(PAIRS), -1), strict=True):
        parts = {
            "real": lambda h: [("real", h.real), ("imag", h.imag)],
            "phase": lambda h: [("mag", np.abs(h)), ("phase [deg]", np.degrees(np.angle(h)))],
            "decibel": lambda h: [("dB", 20 * np.log10(np.abs(h))), ("phase [rad]", np.angle(h))],
        }[form](h)
        for name, v in parts:
            heads.append(f"H({r},{q}) {name}" + ("" if "[" in name else f" [{unit}]"))
            found.append(v)
    return heads, found


@pytest.mark.parametrize("form", ["real", "phase", "decibel"])
@pytest.mark.parametrize(("separator", "comma"), [(",", False), (";", True), ("\t", True), (";", False)], ids=["comma", "german", "tab", "semicolon"])
def test_text_tables(tmp_path, form, separator, comma):
    """Real and imaginary, magnitude and phase, decibel; comma, semicolon and tab; decimal comma."""
    heads, found = columns(form, "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", *heads], [FREQUENCY, *found], separator, comma)
    frf = imported(tmp_path, "", file)
    assert frf.response_nodes == FRF.response_nodes
    assert frf.reference_nodes == FRF.reference_nodes
    np.testing.assert_allclose(frf.frequency, FREQUENCY)
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [("g/N", "accelerance", 9.80665), ("(mm/s²)/N", "accelerance", 1e-3), ("um/N", "receptance", 1e-6), ("(mm/s)/lbf", "mobility", 1e-3 / 4.4482216152605)],
)
def test_units_and_quantities(tmp_path, unit, quantity, factor):
    """The same structure in another quantity and unit: V = i w X, and units by their definitions."""
    power = {"receptance": -1, "mobility": 0, "accelerance": 1}[quantity]
    value = FRF.value * (2j * np.pi * FREQUENCY) ** power / factor
    heads, found = columns("real", unit, value)
    frf = imported(tmp_path, 'quantity = "mobility"\n', table(tmp_path / "T20.csv", ["f (Hz)", *heads], [FREQUENCY, *found]))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8, atol=1e-12)


def test_arrays_of_numpy_and_matlab(tmp_path):
    """.npz, .mat of version 5 with a structure, and HDF5 as MATLAB 7.3 writes it, its axes reversed."""
    import h5py
    from scipy.io import savemat

    lists = {"response_nodes": FRF.response_nodes, "reference_nodes": FRF.reference_nodes}
    np.savez(tmp_path / "T20.npz", frequency=FREQUENCY, H=FRF.value, **lists)
    savemat(tmp_path / "T20.mat", {"lab": {"frequency": FREQUENCY, "FRF": np.moveaxis(FRF.value, 2, 0), **{k: np.array(v) for k, v in lists.items()}}})
    (tmp_path / "73").mkdir()
    with h5py.File(tmp_path / "73" / "T20.mat", "w") as file:
        file["frequency"] = FREQUENCY[:, None]
        stored = np.zeros(FRF.value.T.shape, [("real", "f8"), ("imag", "f8")])
        stored["real"], stored["imag"] = FRF.value.T.real, FRF.value.T.imag
        file["H"] = stored
        for key, nodes in lists.items():
            file[key] = np.array(nodes, float)[:, None]
    for k, file in enumerate((tmp_path / "T20.npz", tmp_path / "T20.mat", tmp_path / "73" / "T20.mat")):
        (tmp_path / str(k)).mkdir()
        frf = imported(tmp_path / str(k), '[[files]]\nfile = "T20.*"\nunit = "(m/s)/N"\n', file)
        np.testing.assert_array_equal(frf.value, FRF.value)


def test_values_and_frequencies_of_different_number_are_refused(tmp_path):
    np.savez(tmp_path / "T20.npz", frequency=FREQUENCY[:-1], H11=FRF.value[0, 0])
    with pytest.raises(BadInput, match="301 values at 300 frequencies"):
        bring([tmp_path / "T20.npz"], out=tmp_path / "c")


@pytest.mark.parametrize("seed", range(3))
def test_damaged_bytes_end_in_one_sentence(tmp_path, seed):
    """A byte changed, cut out or doubled anywhere: a campaign or a refusal, and nothing else."""
    heads, found = columns("real", "(m/s)/N")
    table(tmp_path / "a.csv", ["Frequency [Hz]", *heads], [FREQUENCY[:40], *(f[:40] for f in found)])
    np.savez(tmp_path / "b.npz", frequency=FREQUENCY[:40], H=FRF.value[..., :40], response_nodes=FRF.response_nodes, reference_nodes=FRF.reference_nodes)
    (tmp_path / "c.unv").write_bytes(ascii_58(FREQUENCY, FRF.value[0, 0], 6, True))
    (tmp_path / "m.toml").write_text(SPINDLE + '[[files]]\nfile = "*"\ntest = "T20"\nunit = "(m/s)/N"\n' + HEAD)
    random = np.random.default_rng(seed)
    whole = {f: f.read_bytes() for f in sorted(tmp_path.glob("?.*")) if f.suffix != ".toml"}
    for k in range(25):
        for file, data in whole.items():
            at = int(random.integers(len(data)))
            file.write_bytes(data[:at] + [b"", b"nan", bytes([random.integers(256)])][k % 3] + data[at + int(random.integers(3)) :])
            with suppress(BadInput):
                bring([file], mapping=tmp_path / "m.toml", out=tmp_path / f"{file.stem}{k}")
            assert not (tmp_path / f"{file.stem}{k}").exists() or (tmp_path / f"{file.stem}{k}" / "campaign.toml").is_file()


def test_a_matlab_file_without_h5py_says_what_to_install(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "h5py", None)
    (tmp_path / "a.mat").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600))
    with pytest.raises(BadInput, match=r"thermospindle\[hdf5\]"):
        bring([tmp_path / "a.mat"], out=tmp_path / "c")


def test_uff_binary_and_ascii(tmp_path):
    """Our own 58b, and another program's ASCII in (mm/s)/lbf, where each FRF has a file of its own."""
    write_frf(tmp_path / "T20.uff", FRF, POINTS, "title", "test")
    frf = imported(tmp_path, "", tmp_path / "T20.uff")
    np.testing.assert_array_equal(frf.value, FRF.value)
    np.testing.assert_array_equal(frf.sd, FRF.sd)
    np.testing.assert_array_equal(frf.coherence, FRF.coherence)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "a.unv").write_bytes(ascii_58(FREQUENCY, FRF.value[0, 0], 6, True))
    frf = imported(tmp_path / "b", '[[files]]\nfile = "a.unv"\ntest = "T20"\n', tmp_path / "b" / "a.unv")
    np.testing.assert_allclose(frf.value[0, 0], FRF.value[0, 0] * 1e-3 / 4.4482216152605, rtol=1e-10)


def test_one_frf_a_file(tmp_path):
    """Roving hammer, a file for each position, told by response and reference."""
    files, mapping = [], ""
    for j, q in enumerate(FRF.reference_nodes):
        files.append(table(tmp_path / f"pos{q}.txt", ["Frequency", "Real", "Imaginary"], [FREQUENCY, FRF.value[0, j].real, FRF.value[0, j].imag], "\t"))
        mapping += f'[[files]]\nfile = "pos{q}.txt"\nresponse = 1\nreference = "{dict((p.node, p.name) for p in POINTS)[q]}"\nunit = "(m/s)/N"\ntest = "T20"\n'
    frf = imported(tmp_path, mapping, *files)
    assert frf.value.shape == (1, 2, len(FREQUENCY))
    np.testing.assert_allclose(frf.value, FRF.value[:1], rtol=1e-8, atol=1e-12)


def test_direction_turned(tmp_path):
    """A sensor that looks along +X, at a point along -X: the sign is turned."""
    heads, found = columns("real", "(m/s)/N", FRF.value * np.array([1, -1, 1])[:, None, None])
    heads = [h.replace("H(3,", "H(3:+X,") for h in heads]
    frf = imported(tmp_path, "", table(tmp_path / "T20.csv", ["Hz", *heads], [FREQUENCY, *found]))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8, atol=1e-12)


def test_everything_open_is_asked_at_once(tmp_path):
    file = table(tmp_path / "lab.csv", ["Frequency", "H(7,8) mag", "H(7,8) phase"], [FREQUENCY, np.abs(FRF.value[0, 0]), np.angle(FRF.value[0, 0])])
    with pytest.raises(Unanswered) as caught:
        bring([file], out=tmp_path / "c")
    text = "\n".join(caught.value.items)
    for word in ("phase_unit", "temperature_C", "speed_rpm", "spindle"):
        assert word in text
    assert not (tmp_path / "c").exists()


def test_the_form_is_written_and_filled_in(tmp_path, capsys):
    """The form of an unknown file, its open answers filled in by search and replace, makes the campaign."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    mapping = tmp_path / "lab.toml"
    answer = bring([file], mapping=mapping)
    assert len(answer.values["open"]) == 4
    text = mapping.read_text()
    assert "temperature_C = 20 " in text
    for old, new in (('spindle = "?"', 'spindle = "hdd_2003"'), ('speed_rpm = "?"', "speed_rpm = 0.0"), ('body = "?"', 'body = "hub"'),
                     ('["?", "?", "?"]', "[1.0, 2.0, 3.0]"), ('direction = "?"', 'direction = "+Z"')):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    mapping.write_text(text)
    bring([file], mapping=mapping, out=tmp_path / "c")
    assert [p.node for p in read_campaign(tmp_path / "c").points] == [1, 3, 6]


def test_points_of_a_scene(tmp_path):
    from tests.conftest import SCENE

    heads, found = columns("real", "(m/s)/N", FRF.value)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text('[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
    values = bring([file], mapping=tmp_path / "m.toml", scene=SCENE, out=tmp_path / "c").values
    assert values["points"] == [{"node": 1, "name": "hub_top0"}, {"node": 3, "name": "hub_side0"}, {"node": 6, "name": "seat90"}]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda v: v.conj(), r"T20.csv .*conjugated.*conjugate = true"),
        (lambda v: -v, r"negative real part.*as in 3:-Z"),
        (lambda v: v * np.where(np.arange(301) == 150, 0, 1), r"zero on 1 lines.*band_Hz"),
        (lambda v: v * np.array([[1, 3], [1, 1], [1, 1]])[:, :, None], r"reciprocity.*another unit, sign or node"),
    ],
    ids=["conjugated", "sign", "gap", "reciprocity"],
)
def test_what_no_structure_does_is_told_with_the_users_file(tmp_path, change, said):
    heads, found = columns("real", "(m/s)/N", change(FRF.value))
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    with pytest.raises(BadInput, match=said):
        imported(tmp_path, "", file)


def test_a_conjugated_export_is_turned_by_one_key(tmp_path):
    heads, found = columns("real", "(m/s)/N", FRF.value.conj())
    frf = imported(tmp_path, '[[files]]\nfile = "*.csv"\nconjugate = true\n', table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found]))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8, atol=1e-12)


def test_missing_pairs_leave_the_largest_rectangle(tmp_path):
    heads, found = columns("real", "(m/s)/N")
    (tmp_path / "mapping.toml").write_text(SPINDLE + HEAD)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads[:-2]], [FREQUENCY, *found[:-2]])
    notes = bring([file], mapping=tmp_path / "mapping.toml", out=tmp_path / "c").values["notes"]
    assert read_campaign(tmp_path / "c").tests[0].frf.value.shape[:2] == (2, 2)
    assert any("H(6,1) left out" in n for n in notes)


def test_lines_of_the_running_speed_are_said_and_left_as_measured(tmp_path):
    """1440 rpm = 24 Hz: a spike at every multiple is named, kept in the file, and left out where the test is compared."""
    frf = rotor_frf(noise=0.0002)
    spoiled = frf.value.copy()
    hit = FREQUENCY % 24 == 0
    spoiled[:, :, hit] += 0.3 * np.abs(frf.value).max()
    heads, found = columns("real", "(m/s)/N", spoiled)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "mapping.toml").write_text(SPINDLE + HEAD.replace("speed_rpm = 0.0", "speed_rpm = 1440.0"))
    (warning,) = bring([file], mapping=tmp_path / "mapping.toml", out=tmp_path / "c").values["warnings"]
    assert "lines of the running speed stand in the FRFs, at" in warning
    test = read_campaign(tmp_path / "c").tests[0]
    np.testing.assert_allclose(test.frf.value, spoiled, rtol=1e-8, atol=1e-12)
    out = out_of(test.frf, test.speed).out
    assert out[hit][1:-1].all()
    assert not out[np.abs((FREQUENCY + 12) % 24 - 12) > 2.5].any()


def test_modes_picked_by_hand(tmp_path):
    """The easiest start: a frequency a row, damping in percent, a decimal comma."""
    (tmp_path / "peaks.csv").write_text("test;mode;frequency [Hz];damping %\nT20;1;1002,5;0,5\nT20;2;1545;\n")
    (tmp_path / "m.toml").write_text('spindle = "hdd_2003"\nfrequency_sd_Hz = 0.5\n[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
    bring([tmp_path / "peaks.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    rows = read_campaign(tmp_path / "c").tests[0].modes
    assert [(r.mode, r.frequency, r.frequency_sd, r.damping_ratio) for r in rows] == [(1, 1002.5, 0.5, 0.005), (2, 1545.0, 0.5, None)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("nothing\nhere\n", "no table of numbers"),
        ("f,H(1,1) real\n1,2\n2,nan\n3,4\n", "line 3: NaN or infinite"),
        ("f;H(1,1) real\n1;2\n2\n3;4;5\n4;5\n", "numbers"),
        ("f,H(1,1) real\n1,2\n2,3\n3,4\nend of data\n", "line 5: 'end of data' stands below the numbers"),
        ("frequency,mode\n1000,1\nabc,2\n", "line 3: frequency = 'abc': is no number"),
        ("frequency,mode\n1_000,1\n", "line 2: frequency = '1_000': is no number"),
        ("frequency,mode\n1000,1\ninf,2\n", "line 3: frequency = 'inf': a positive number in Hz is needed"),
        *((f"frequency,mode,sd\n1000,1,{sd}\n", f"line 2: sd = '{sd}': a positive number in Hz is needed") for sd in ("0", "-1", "nan", "1e400")),
        ("frequency,mode,kind\n1000,1," + 200_000 * "a", "cannot be read as a table of modes"),
    ],
)
def test_damaged_text_is_one_sentence(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(BadInput, match=said):
        bring([tmp_path / "a.csv"], out=tmp_path / "c")
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    ("text", "found"),
    [("m/s^2/N", ("accelerance", 1.0)), ("(1/N)*(m/s²)", ("accelerance", 1.0)), ("(m/s²)(N)", ("accelerance", 1.0)), ("1/kg", ("accelerance", 1.0)),
     ("mm/s/N", ("mobility", 1e-3)), ("µm/kN", ("receptance", 1e-9)), ("N/m", None), ("V/N", None), ("m/s�/N", ("accelerance", 1.0))],
)  # fmt: skip
def test_units_of_frfs(text, found):
    assert units.of_frf(text) == (found if found is None else (found[0], pytest.approx(found[1])))


@pytest.mark.parametrize(
    ("heading", "kind", "part", "ends", "unit"),
    [
        ("H(3,1) real [g/N]", "H", "real", ("3", "1"), "g/N"), ("Re H(3:+X, 1)", "H", "real", ("3:+X", "1"), ""), ("FRF(hub, seat) dB", "H", "decibel", ("hub", "seat"), ""),
        ("Magnitude", "H", "magnitude", ("", ""), ""), ("Coherence(3,1)", "coherence", "", ("3", "1"), ""), ("Frequency (Hz)", "frequency", "", ("", ""), "Hz"),
        ("force [N]", "force", "", ("", ""), "N"), ("acceleration 3 [g]", "response", "", ("3", ""), "g"), ("Time [s]", "time", "", ("", ""), "s"),
        ("hub/seat mag [um/N]", "H", "magnitude", ("hub", "seat"), "um/N"), ("3+Z/1+Z Phase (deg)", "H", "phase", ("3:+Z", "1:+Z"), "deg"),
        ("Acceleration/Force Magnitude [g/N]", "H", "magnitude", ("", ""), "g/N"), ("H(3,1) mag [dB]", "H", "decibel", ("3", "1"), ""),
        ("H(3,1) [dB re 1 µm/N]", "H", "decibel", ("3", "1"), "µm/N"), ("H(3,1) dB (dB ref 1e-6 m/N)", "H", "decibel", ("3", "1"), "m/N"),
        ("FRF-2 real", "H", "real", ("FRF-2", ""), ""), ("H21", "H", "complex", ("2", "1"), ""), ("H_12_3 imag [g/N]", "H", "imaginary", ("12", "3"), "g/N"),
    ],
)  # fmt: skip
def test_headings(heading, kind, part, ends, unit):
    role = role_of(heading)
    assert role is not None
    assert (role.kind, role.part, role.unit) == (kind, part, unit)
    assert (role.response.label, role.reference.label) == ends


def test_what_0_dB_are_of_a_unit_counts():
    assert (role_of("H(3,1) [dB re 1e-6 m/N]").level, role_of("H(3,1) [dB re 1 µm/N]").level) == (1e-6, 1.0)


@pytest.mark.parametrize(
    ("name", "told"),
    [("Spindel_20C_0rpm", (20, 0)), ("T60_n7200", (60, 7200)), ("warm 41.5deg 3600 rpm", (41.5, 3600)), ("20_C_standstill", (20, 0)), ("test_4", (None, None)),
     ("run_20_0", (None, None))],
)  # fmt: skip
def test_what_names_tell(name, told):
    found = conditions_of(plain(name))
    assert (found.get("temperature_C"), found.get("speed_rpm")) == told


def test_files_of_one_test_are_put_together_in_the_form(tmp_path):
    """A file a hammer point, in decibels over micrometres, decimal comma, UTF-16 with its mark: nothing is left to be asked."""
    force = FRF.value / (2j * np.pi * FREQUENCY) * 1e6
    for j, q in enumerate(FRF.reference_nodes):
        heads = [f"H({r},{q}) {part}" for r in FRF.response_nodes for part in ("dB [dB re 1 µm/N]", "Phase [°]")]
        found = [v for h in force[:, j] for v in (20 * np.log10(np.abs(h)), np.degrees(np.angle(h)))]
        file = table(tmp_path / f"Spindel_20C_0rpm_Hammer{q}.csv", ["Frequenz [Hz]", *heads], [FREQUENCY, *found], ";", comma=True, above="Prüfer: K. Müller\n\n")
        file.write_bytes(file.read_text(encoding="utf-8").encode("utf-16"))
    mapping = tmp_path / "lab.toml"
    values = bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003").values
    assert values["proposed"] == ["Spindel_20C_0rpm: 20 C, 0 rpm, 2 files"]
    bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003", out=tmp_path / "c")
    (test,) = read_campaign(tmp_path / "c").tests
    assert test.frf.quantity == "receptance"
    np.testing.assert_allclose(test.frf["hub_side0", "seat90"], force[1, 1] * 1e-6, rtol=1e-8)


def test_a_question_about_all_files_is_answered_once(tmp_path):
    """What every file lacks stands once in the form, column by column; a point that two files would hold twice keeps them apart."""
    for name in ("T20_hit1", "T20_hit2", "T60_hit1"):
        table(tmp_path / f"{name}.csv", ["Frequency [Hz]", "left", "right"], [FREQUENCY, *np.abs(FRF.value[:2, 0])])
    mapping = tmp_path / "lab.toml"
    bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003")
    text = mapping.read_text()
    assert (text.count('"left" = "?"'), text.count('file = "*.csv"')) == (1, 1)
    mapping.write_text(text.replace('"left" = "?"', '"left" = "H(1,1) mag"').replace('"right" = "?"', '"right" = "H(3,1) mag"').replace('speed_rpm = "?"', "speed_rpm = 0"))
    values = bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003", out=tmp_path / "c").values
    assert [t["id"] for t in values["tests"]] == ["T20", "T60_hit1"]


def test_a_sweep_in_uneven_steps(tmp_path):
    """Lines of a logarithmic sweep are kept as they are, through the campaign's file too; a conjugated one is refused as any other."""
    lines = np.geomspace(400.0, 700.0, 400)
    frf = rotor_frf(lines, noise=0.0005)
    heads, found = columns("real", "(m/s)/N", frf.value)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [lines, *found])
    back = imported(tmp_path, "", file)
    np.testing.assert_allclose(back.frequency, lines, rtol=1e-11)
    np.testing.assert_allclose(back.value[0], frf.value[0], rtol=1e-8)
    heads, found = columns("real", "(m/s)/N", frf.value.conj())
    table(file, ["Frequency", *heads], [lines, *found])
    with pytest.raises(BadInput, match="is conjugated"):
        bring([file], mapping=tmp_path / "mapping.toml", out=tmp_path / "d")
    heads, found = columns("real", "(m/s)/N")
    table(file, ["Frequency", *heads], [np.delete(c, 100) for c in (FREQUENCY, *found)])
    with pytest.raises(BadInput, match=r"T20.csv.*from 499 to 501 Hz among steps of 1 Hz; no line may be missing"):
        bring([file], mapping=tmp_path / "mapping.toml", out=tmp_path / "d")


def test_low_frequencies_of_an_accelerometer_are_noise_and_no_wrong_sign(tmp_path):
    """Noise of an accelerance, equal at all lines, exceeds every resonance of the receptance at its lowest ones."""
    lines = np.arange(10.0, 701.0)
    frf = rotor_frf(lines, "accelerance", noise=0.002)
    heads, found = columns("real", "m/N", frf.value / (2j * np.pi * lines) ** 2)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [lines, *found])
    assert imported(tmp_path, "", file).quantity == "receptance"


def test_noise_of_a_magnitude_makes_no_modes(tmp_path):
    """Two modes, noise of 2 % of the largest: peaks of the noise are no modes."""
    from thermospindle.sim.importing.measured import Curve, End
    from thermospindle.sim.importing.peaks import from_peaks

    lines = np.arange(50.0, 2000.0)
    size = np.abs(rotor_frf(lines, noise=0.02).value[:, 0])
    modes, _ = from_peaks([Curve(tmp_path, "", End(k), End(1), lines, row) for k, row in enumerate(size, 1)], 0.0)
    assert [m.frequency for m in modes] == [pytest.approx(480, abs=0.5), pytest.approx(600, abs=0.5)]


def test_points_on_a_flexible_shaft_are_told_by_its_name(tmp_path):
    from thermospindle.model.scene.reading import load

    scene = load("mk7702")
    shaft = scene.structure.shafts[0]
    height = scene.points[0].position[2]
    point = f'[[points]]\nnode = 77\nname = "nose"\nbody = "{shaft.name}"\nposition_mm = [0.0, 0.0, {1e3 * height}]\ndirection = "+X"\n'
    (tmp_path / "m.toml").write_text('[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n' + point)
    h = FRF.value[0, 0]
    file = table(tmp_path / "T20.csv", ["Frequency", "H(77,77) real [(m/s)/N]", "H(77,77) imag"], [FREQUENCY, h.real, h.imag])
    bring([file], mapping=tmp_path / "m.toml", scene="mk7702", out=tmp_path / "c")
    assert read_campaign(tmp_path / "c").points[0].body == shaft.node_at(height)
    (tmp_path / "m.toml").write_text((tmp_path / "m.toml").read_text().replace(f'body = "{shaft.name}"', 'body = "nowhere"'))
    with pytest.raises(Unanswered, match=f"a body of the scene mk7702 .*{shaft.name}"):
        bring([file], mapping=tmp_path / "m.toml", scene="mk7702", out=tmp_path / "d")


def test_patterns_and_folders(tmp_path):
    """A pattern that no shell expanded is expanded; a folder is told from a file."""
    (tmp_path / "a.csv").write_text("frequency,mode\n1000,1\n")
    (tmp_path / "b.csv").write_text("frequency,mode\n1001,1\n")
    assert len(bring([tmp_path / "*.csv"], mapping=tmp_path / "m.toml").values["open"]) == 4
    with pytest.raises(BadInput, match=r"is a folder; name its files"):
        bring([tmp_path], out=tmp_path / "c")
    with pytest.raises(BadInput, match=r"\*\.txt: no file is called so"):
        bring([tmp_path / "*.txt"], out=tmp_path / "c")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('[[files]]\nfile = "other.csv"\n', r"m.toml: files: file = 'other.csv': is none of T20.csv"),
        ('[[tests]]\nid = "T30"\n', r"m.toml: tests: id = 'T30': no file makes such a test; there are T20"),
        ('[[files]]\nfile = "*"\nunits = "g/N"\n', "did you mean unit"),
        ("[[points]]\nnode = 1\n[[points]]\nnode = 1\n", "points: node = 1 stands 2 times"),
        ('[[points]]\nnode = 1\nname = "much too long a name"\n', "points.1: name = 'much too long a name'"),
        ("[records]\nband_Hz = [1.0]\n", "records.band_Hz"),
    ],
)
def test_a_wrong_mapping_is_one_sentence(tmp_path, wrong, said):
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text(wrong)
    with pytest.raises(BadInput, match=said):
        bring([file], mapping=tmp_path / "m.toml", out=tmp_path / "c")


def test_standard_errors_of_coherence_and_averages(tmp_path):
    """|H| sqrt((1 - g2) / (g2 n)): a tenth of it with a hundred times the hits."""
    heads, found = columns("real", "(m/s)/N")
    g = np.full(len(FREQUENCY), 0.9)
    heads += [f"coherence({r},{q})" for r, q in PAIRS]
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found, *[g] * len(PAIRS)])
    sizes = []
    for n in (4, 400):
        (tmp_path / "m.toml").write_text(SPINDLE + HEAD.replace('id = "T20"', f'id = "T20"\naverages = {n}'))
        bring([file], mapping=tmp_path / "m.toml", out=tmp_path / f"c{n}")
        sizes.append(read_campaign(tmp_path / f"c{n}").tests[0].frf.sd)
    np.testing.assert_allclose(sizes[0], np.abs(FRF.value) * np.sqrt(0.1 / 0.9 / 4), rtol=1e-6)
    np.testing.assert_allclose(sizes[1], sizes[0] / 10, rtol=1e-6)
