"""Text tables as laboratories write them: headings, units, axes, lines without values, and what is damaged."""

from __future__ import annotations

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY
from tests.sim.importing.exported import FRF, columns, imported, table
from thermospindle.model.errors import BadInput
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.importing.files.labels import role_of
from thermospindle.sim.importing.files.mode_tables import from_modes
from thermospindle.sim.importing.files.reading import content
from thermospindle.sim.importing.mapping import FileForm

NOT_AT_0_HZ = {"real": "nan", "imag": "nan", "mag": "0", "dB": "-inf", "phase": "nan"}


@pytest.mark.parametrize(("first", "last"), [("{},{}", "{},{}"), ("{},nan", "{},NaN")])
def test_lines_without_values_at_the_ends_are_left_out(tmp_path, first, last):
    """Also the first one below the headings, which was taken for them; one in between is refused (`test_damaged_text_is_one_sentence`)."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", *heads], [FREQUENCY, *found])
    head, *rows = file.read_text().splitlines()
    blank = ["," * (len(heads) - 1) if told == "{},{}" else ",".join(["nan"] * len(heads)) for told in (first, last)]
    rows[0], rows[-1] = (f"{row.split(',')[0]},{rest}" for row, rest in zip((rows[0], rows[-1]), blank, strict=True))
    file.write_text("\n".join([head, *rows]) + "\n")
    frf = imported(tmp_path, "", file)
    np.testing.assert_allclose(frf.frequency, FREQUENCY[1:-1])
    np.testing.assert_allclose(frf.value, FRF.value[:, :, 1:-1], rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("parts", [("real", "imag"), ("mag", "phase"), ("dB", "phase")])
def test_a_line_at_0_Hz_without_a_value_is_left_out(tmp_path, parts):
    """Where a motion is divided by omega^2 it is 0 / 0, and 20 log10(0); a coherence beside it has its value."""
    value = FRF.value[0, 0]
    cells = {"real": value.real, "imag": value.imag, "mag": np.abs(value), "dB": 20 * np.log10(np.abs(value)), "phase": np.degrees(np.angle(value))}
    heads = [f"H(1,1) {p} [{'deg' if p == 'phase' else '(m/s)/N'}]" for p in parts if p != "dB"] if "dB" not in parts else ["H(1,1) mag [dB re 1 (m/s)/N]", "H(1,1) phase [deg]"]
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", *heads, "coherence(1,1)"], [FREQUENCY, *(cells[p] for p in parts), 0.99 + 0 * FREQUENCY])
    head, *rows = file.read_text().splitlines()
    file.write_text("\n".join([head, ",".join(["0.0", *(NOT_AT_0_HZ[p] for p in parts), "1"]), *rows]) + "\n")
    frf = imported(tmp_path, "", file)
    np.testing.assert_allclose(frf.frequency, FREQUENCY)
    np.testing.assert_allclose(frf.value[0, 0], value, rtol=1e-7)


def test_the_mirrored_half_of_a_spectrum_is_left_out(tmp_path):
    """Negative frequencies, before the others or behind them as a Fourier transform has them; at 0 Hz there is no number."""
    step = FREQUENCY[1] - FREQUENCY[0]
    behind = np.concatenate([FREQUENCY, -FREQUENCY[::-1]])
    value = np.concatenate([FRF.value, FRF.value[..., ::-1].conj()], -1)
    before = np.argsort(behind)
    nodes = {"response_nodes": FRF.response_nodes, "reference_nodes": FRF.reference_nodes}
    for k, (axis, own) in enumerate(((behind, value), (behind[before], value[..., before]))):
        (tmp_path / str(k)).mkdir()
        np.savez(tmp_path / str(k) / "T20.npz", frequency=axis, H=own, **nodes)
        frf = imported(tmp_path / str(k), '[[files]]\nfile = "T20.npz"\nunit = "(m/s)/N"\n', tmp_path / str(k) / "T20.npz")
        np.testing.assert_allclose(np.diff(frf.frequency), step)
        np.testing.assert_array_equal(frf.value, FRF.value)


def test_headings_may_be_german(tmp_path):
    """With decimal commas, in the encoding of a German Windows."""
    value = FRF.value[0, 0]
    heads = ["Frequenz [Hz]", "H(1,1) Realteil [(m/s)/N]", "H(1,1) Imaginärteil [(m/s)/N]", "Kohärenz(1,1)"]
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", "a", "b", "c"], [FREQUENCY, value.real, value.imag, 0.99 + 0 * FREQUENCY])
    _, *rows = file.read_text().splitlines()
    file.write_text("\n".join([";".join(heads), *(row.replace(",", ";").replace(".", ",") for row in rows)]) + "\n", encoding="latin-1")
    frf = imported(tmp_path, "", file)
    np.testing.assert_allclose(frf.value[0, 0], value, rtol=1e-7)
    assert frf.coherence is not None
    told = {"Kraft 1 [N]": "force", "Anregung [N]": "force", "Beschleunigung 3:-X [g]": "response", "Schwinggeschwindigkeit 2 [mm/s]": "response", "Zeit [s]": "time", "H(1,1) Betrag": "H"}
    for heading, kind in told.items():
        assert (role := role_of(heading)) is not None, heading
        assert role.kind == kind


@pytest.mark.parametrize("name", ["omega", "ω"])
def test_an_axis_called_omega_is_in_rad_per_s(tmp_path, name):
    nodes = {"response_nodes": FRF.response_nodes, "reference_nodes": FRF.reference_nodes}
    np.savez(tmp_path / "T20.npz", **{name: 2 * np.pi * FREQUENCY}, H=FRF.value, **nodes)
    frf = imported(tmp_path, '[[files]]\nfile = "T20.npz"\nunit = "(m/s)/N"\n', tmp_path / "T20.npz")
    np.testing.assert_allclose(frf.frequency, FREQUENCY)


def test_a_value_that_is_no_number_is_named_by_its_line_where_no_axis_is_told(tmp_path):
    """It was told at so many Hz as it has lines before it."""
    value = FRF.value.copy()
    value[0, 0, 5] = np.nan
    np.savez(tmp_path / "T20.npz", H=value, response_nodes=FRF.response_nodes, reference_nodes=FRF.reference_nodes)
    with pytest.raises(BadInput, match=r"T20\.npz: H\[0,0\]: its value on line 6 is no number; take"):
        imported(tmp_path, '[[files]]\nfile = "T20.npz"\nunit = "(m/s)/N"\n', tmp_path / "T20.npz")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("nothing\nhere\n", "no table of numbers"),
        ("f,H(1,1) real\n1,2\n2,nan\n3,4\n", "line 3: column 2: NaN or infinite"),
        ("f,H(1,1) real,H(1,1) imag\n1,2,3\n2,,4\n3,4,5\n", "line 3: column 2: empty; every column of every line needs one"),
        ("f,H(1,1) real,H(1,1) imag\n1,overload,4\n3,4,5\n4,5,6\n", "line 2: column 2: 'overload' is no number"),
        ("f;H(1,1) real;H(1,1) imag\n900,5;2,1;3,2\n1.000,5;4,4;5,6\n900,7;5,2;6,1\n", "line 3: column 1: '1.000,5' is no number; .* thousands are written without a sep"),
        ("f;H(1,1) real\n1.000,5;4,4\n1.001,5;5,2\n", "'1.001,5': thousands are written without a separator"),
        ("f,H(1,1) real,H(1,1) imag,H(1,1) real\n1,2,3,4\n2,3,4,5\n", "'H\\(1,1\\) real' and 'H\\(1,1\\) real': two columns for the real of the same FRF"),
        ("test,mode,pitch,damping\ncold,1,935.5,0.01\n", "a table of modes without a heading for the frequency; found are test, mode, pitch, damping; allowed are frequency_Hz"),
        ("frequency,mode,kind\n1000,1,rockin\n", "line 2: kind = 'rockin': allowed are axial, rocking, lateral, unknown, or nothing"),
        ("f;H(1,1) real\n1;2\n2\n3;4;5\n4;5\n", "numbers"),
        ("f,H(1,1) real\n1,2\n2,3\n3,4\nend of data\n", "line 5: 'end of data' stands below the numbers"),
        ("f,H(1,1) real,H(1,1) imag\n1,2,3\n2,3,4\n3,4,5\n4,5", "line 5: has 2 numbers, the lines before it 3; each must have as many: is the file cut off there"),
        ("f,H(1,1) real,H(1,1) imag\n1,2,3\n2,3,4\n3,4,5\n4,5,1.2e-", "line 5: column 3: '1.2e-' is no number"),
        ("mode,frequency,frequency_kHz\n1,1000,1\n", "line 1: has frequencies in kHz and another column"),
        ("mode,frequency_kHz,sd\n1,1.2,0.01\n", "line 1: has frequencies in kHz and another column of them, or of their errors, in Hz; write all in Hz"),
        ("frequency,mode\n1000,1\nabc,2\n", "line 3: frequency = 'abc': is no number"),
        ("frequency,mode\n1_000,1\n", "line 2: frequency = '1_000': is no number"),
        ("frequency,mode\n1000,1\ninf,2\n", "line 3: frequency = 'inf': a positive number in Hz is needed"),
        *((f"frequency,mode,sd\n1000,1,{sd}\n", f"line 2: sd = '{sd}': a positive number in Hz is needed") for sd in ("0", "-1", "nan", "1e400")),
        ("test,mode,frequency,damping_%\nT20,1,1002.5,-0.54\n", "line 2: damping_% = '-0.54': a positive number is needed"),
        ("mode,frequency,frequency_sd_Hz\n1,1000,-0.2\n", "line 2: frequency_sd_Hz = '-0.2': a positive number in Hz is needed"),
        ("mode,frequency,zeta\n1,1000,1.2\n", "line 2: zeta = 1.2: a ratio above 0 and below 1 is allowed; in percent under the heading damping_%, or with damping_unit"),
        ("mode,frequency,damping_%\n1,1000,120\n", "line 2: damping_% = 120: below 100 per cent is allowed"),
        ("test,mode,frequency\nT20,1,1002.5\nT40,1,1000\nT20,1,1545\n", "line 4: mode = '1': stands in line 2 already, of test T20; each mode of a test may stand once"),
        ("No,frequency\n1,1002.5\n1,1545\n", "line 3: No = '1': stands in line 2 already; each mode of a test may stand once"),
        ("frequency,mode,kind\n1000,1," + 200_000 * "a", "cannot be read as a table of modes"),
    ],
)
def test_damaged_text_is_one_sentence(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(BadInput, match=said):
        bring([tmp_path / "a.csv"], out=tmp_path / "c")
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(("kind", "true", "told", "why"), [("decibel", "rad", "deg", "they stay within +-3.14"), ("phase", "deg", "rad", "they go beyond a turn, 6.28")])
def test_phases_that_look_like_another_unit_than_their_heading_are_asked(tmp_path, kind, true, told, why):
    """Once for all FRFs of a file, and settled by one key either way; also phases in radians that were unwrapped go beyond a turn."""
    heads, found = columns(kind, "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", *(h.replace(f"phase [{true}]", f"phase [{told}]") for h in heads)], [FREQUENCY, *found])
    with pytest.raises(BadInput, match="1 thing is not told") as said:
        imported(tmp_path, "", file)
    assert f"phase_unit: whether its phases are in {told}, as their headings say, or in {true}: {why}" in str(said.value)
    frf = imported(tmp_path, f'[[files]]\nfile = "T20.csv"\nphase_unit = "{true}"\n', file)
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8)


def test_parts_of_one_FRF_in_two_units_are_asked(tmp_path):
    """Settled by one key; before, the unit of the real part was taken for both."""
    heads, found = columns("real", "(m/s)/N")
    assert sum("imag" in h for h in heads) > 1
    file = table(tmp_path / "T20.csv", ["Frequency [Hz]", *(h.replace("(m/s)/N", "m/N") if "imag" in h else h for h in heads)], [FREQUENCY, *found])
    with pytest.raises(BadInput, match=r"unit: the unit of .*: their headings say \(m/s\)/N, m/N"):
        imported(tmp_path, "", file)
    np.testing.assert_allclose(imported(tmp_path, '[[files]]\nfile = "T20.csv"\nunit = "(m/s)/N"\n', file).value, FRF.value, rtol=1e-8)


def test_exponents_of_fortran_are_read(tmp_path):
    (tmp_path / "a.csv").write_text("Frequency [Hz],H(1,1) real [m/N],H(1,1) imag [m/N]\n" + "".join(f"{f:.1f},1.5D-06,-2.5d-07\n" for f in range(100, 160)))
    [curve] = content(tmp_path / "a.csv", FileForm(file="a.csv")).curves
    assert curve.value == pytest.approx(np.full(60, 1.5e-6 - 2.5e-7j))


@pytest.mark.parametrize("text", ["test,Natural frequency [Hz]\ncold,1002.5\n", "test;Eigenfrequenz [Hz]\ncold;1002,5\n", "mode\tFreq. (Hz)\n1\t1002.5\n", "mode,Hz\n1,1002.5\n"])
def test_frequencies_of_modes_have_many_names(tmp_path, text):
    (tmp_path / "peaks.csv").write_text(text)
    assert [m.frequency for m in content(tmp_path / "peaks.csv", FileForm(file="x")).modes] == [pytest.approx(1002.5)]


@pytest.mark.parametrize("text", ["test,mode,frequency_kHz\ncold,1,1.0025\n", "frequency_kHz\n1.0025\n", "test;f (kHz)\ncold;1,0025\n"])
def test_modes_may_be_told_in_kilohertz(tmp_path, text):
    (tmp_path / "peaks.csv").write_text(text)
    assert [m.frequency for m in from_modes(tmp_path / "peaks.csv", FileForm(file="x")).modes] == [pytest.approx(1002.5)]


@pytest.mark.parametrize(("line", "said"), [("400,1,2", "one line"), ("0,1,2", "no line above 0 Hz")])
def test_one_line_is_no_frf(tmp_path, line, said):
    """It was said not to rise from line to line, and one at 0 Hz ended in a traceback."""
    (tmp_path / "T20.csv").write_text(f"Frequency [Hz],H(1,1) real [m/s/N],H(1,1) imag [m/s/N]\n{line}\n")
    with pytest.raises(BadInput, match=rf"T20.csv: H\(1,1\) real.*: {said} is no FRF; at least 16 are needed"):
        imported(tmp_path, "", tmp_path / "T20.csv")


def test_lines_may_be_told_in_kilohertz(tmp_path):
    heads, found = columns("real", "(m/s)/N")
    frf = imported(tmp_path, "", table(tmp_path / "T20.csv", ["frequency_kHz", *heads], [FREQUENCY / 1e3, *found]))
    np.testing.assert_allclose(frf.frequency, FREQUENCY, rtol=1e-9)
