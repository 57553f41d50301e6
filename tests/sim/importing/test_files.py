"""The same FRFs in every form that laboratories export come back as the same campaign."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY, POINTS, ascii_58, rotor_frf
from tests.sim.importing.exported import FRF, HEAD, PAIRS, SPINDLE, columns, imported, table
from thermospindle.model.errors import BadInput
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.uff import write_frf
from thermospindle.sim.identification.frf import out_of
from thermospindle.sim.importing.files.reading import content
from thermospindle.sim.importing.mapping import FileForm


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


def test_points_may_be_told_by_a_cell_array_of_names(tmp_path):
    from scipy.io import savemat

    names = {1: "hub_top0", 3: "hub_side0", 6: "seat90"}
    cells = {key: np.array([names[n] for n in nodes], object) for key, nodes in (("resp", FRF.response_nodes), ("ref", FRF.reference_nodes))}
    savemat(tmp_path / "T20.mat", {"lab": {"freq": FREQUENCY, "H": FRF.value, **cells}})
    frf = imported(tmp_path, '[[files]]\nfile = "T20.*"\nunit = "(m/s)/N"\n', tmp_path / "T20.mat")
    assert (frf.response_nodes, frf.reference_nodes) == (FRF.response_nodes, FRF.reference_nodes)
    np.testing.assert_array_equal(frf.value, FRF.value)


def test_a_magnitude_without_values_is_a_dead_channel(tmp_path, recwarn):
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", "H(1,1) mag [g/N]", "H(3,1) mag [g/N]"], [FREQUENCY, np.abs(FRF.value[0, 0]), 0 * FREQUENCY])
    with pytest.raises(BadInput, match=r"T20.csv: H\(3,1\) mag \[g/N\]: zero on every line; a dead channel is not allowed"):
        imported(tmp_path, "", file)
    assert not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]


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


def test_a_uff_value_that_is_no_number_is_named(tmp_path):
    """By file, set and frequency; it was told of the folder that was to be written."""
    value = FRF.value[0, 0].copy()
    value[5:8] = np.nan
    (tmp_path / "a.unv").write_bytes(ascii_58(FREQUENCY, value, 6, True))
    with pytest.raises(BadInput, match=rf"a\.unv: .*set \d+.*: its value at {FREQUENCY[5]:g} Hz is no number, and 2 more lines"):
        imported(tmp_path, '[[files]]\nfile = "a.unv"\ntest = "T20"\n', tmp_path / "a.unv")


def test_an_array_value_that_is_no_number_is_named(tmp_path):
    """Of any file: it is asked where FRFs of all kinds of files come together."""
    value = FRF.value.copy()
    value[0, 0, 5] = np.inf
    np.savez(tmp_path / "T20.npz", frequency=FREQUENCY, H=value, response_nodes=FRF.response_nodes, reference_nodes=FRF.reference_nodes)
    with pytest.raises(BadInput, match=rf"T20\.npz: .*: its value at {FREQUENCY[5]:g} Hz is no number; take"):
        imported(tmp_path, '[[files]]\nfile = "T20.npz"\nunit = "(m/s)/N"\n', tmp_path / "T20.npz")


def test_one_frf_a_file(tmp_path):
    """Roving hammer, a file for each position, told by response and reference."""
    files, mapping = [], ""
    for j, q in enumerate(FRF.reference_nodes):
        files.append(table(tmp_path / f"pos{q}.txt", ["Frequency", "Real", "Imaginary"], [FREQUENCY, FRF.value[0, j].real, FRF.value[0, j].imag], "\t"))
        mapping += f'[[files]]\nfile = "pos{q}.txt"\nresponse = 1\nreference = "{dict((p.node, p.name) for p in POINTS)[q]}"\nunit = "(m/s)/N"\ntest = "T20"\n'
    frf = imported(tmp_path, mapping, *files)
    assert frf.value.shape == (1, 2, len(FREQUENCY))
    np.testing.assert_allclose(frf.value, FRF.value[:1], rtol=1e-8, atol=1e-12)


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
    from thermospindle.sim.importing.frfs.peaks import from_peaks
    from thermospindle.sim.importing.measured import Curve, End

    lines = np.arange(50.0, 2000.0)
    size = np.abs(rotor_frf(lines, noise=0.02).value[:, 0])
    modes, _ = from_peaks([Curve(tmp_path, "", End(k), End(1), lines, row) for k, row in enumerate(size, 1)], 0.0)
    assert [m.frequency for m in modes] == [pytest.approx(480, abs=0.5), pytest.approx(600, abs=0.5)]


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


def test_a_coherence_of_one_everywhere_is_that_of_a_single_hit(tmp_path):
    """It would make the FRFs free of noise."""
    heads, found = columns("real", "(m/s)/N")
    heads += [f"coherence({r},{q})" for r, q in PAIRS]
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found, *[np.ones(len(FREQUENCY))] * len(PAIRS)])
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD.replace('id = "T20"', 'id = "T20"\naverages = 1'))
    brought = bring([file], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert "test T20: its coherence left out: 1 on every line, as that of a single hit is whatever the noise" in brought.values["notes"]
    frf = read_campaign(tmp_path / "c").tests[0].frf
    assert frf.coherence is None
    assert frf.sd is None


UNITS_MM = """    -1
   164
         5SI - mm/milli-newton         2
  1.0000000000000000D+03  1.0000000000000000D+03  1.0000000000000000D+00
  2.7314999999999998D+02
    -1
"""
GEOMETRY_2411 = """    -1
  2411
         1         1         1        11
   1.2000000000000000D+01   0.0000000000000000D+00   2.0000000000000000D+01
       305         1         1        11
   0.0000000000000000D+00  -1.2500000000000000D+01   1.5000000000000000D+01
    -1
"""


def test_geometry_of_data_set_2411(tmp_path):
    """Nodes in double precision, as newer programs write them: in metres where data set 164 has told the unit, and untaken where none has."""
    (tmp_path / "mm.unv").write_text(UNITS_MM + GEOMETRY_2411)
    (tmp_path / "bare.unv").write_text(GEOMETRY_2411)
    told = content(tmp_path / "mm.unv", FileForm(file="x"))
    assert sorted(told.places) == [1, 305]
    assert told.places[1] == pytest.approx((0.012, 0.0, 0.020))
    assert told.places[305] == pytest.approx((0.0, -0.0125, 0.015))
    assert told.unscaled == {}
    bare = content(tmp_path / "bare.unv", FileForm(file="x"))
    assert bare.places == {}
    assert bare.unscaled[305] == pytest.approx((0.0, -12.5, 15.0))
