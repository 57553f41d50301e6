"""A damaged byte of a UFF file is noticed: nothing is dropped or shifted in silence."""

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY, POINTS, ascii_58, rotor_frf
from thermospindle.model.errors import BadInput
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.uff import read_frf, read_uff, write_frf


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("uff") / "a.uff"
    write_frf(path, rotor_frf(), POINTS, "title", "test")
    return path


def markers(data):
    found, at = [], data.find(b"    -1\n")
    while at >= 0:
        found.append(at)
        at = data.find(b"    -1\n", at + 1)
    return found


def test_every_damaged_marker_is_refused(file, tmp_path):
    """One byte of each of the 36 markers: pyuff alone reads fewer sets, and a full rectangle of what is left was taken for the file."""
    data = file.read_bytes()
    assert len(markers(data)) == 36
    for at in markers(data):
        for byte in (4, 5, 6):
            (tmp_path / "b.uff").write_bytes(data[: at + byte] + b"\xb9" + data[at + byte + 1 :])
            with pytest.raises(BadInput, match=r"b\.uff: (set|does not end)"):
                read_frf(tmp_path / "b.uff", "mobility", POINTS)


@pytest.mark.parametrize("more", [1, 2, 4, 7, 8, 16])
def test_inserted_bytes_are_refused(file, tmp_path, more):
    """Anywhere among the values of an FRF: all later doubles of the set are then others, up to 1e308."""
    data, random = file.read_bytes(), np.random.default_rng(more)
    ends = markers(data)[1::6]  # of the FRFs, every third set
    for _ in range(20):
        at = int(random.choice(ends)) - int(random.integers(1, 16 * len(FREQUENCY)))
        (tmp_path / "b.uff").write_bytes(data[:at] + bytes(random.integers(128, 255, more, dtype=np.uint8)) + data[at:])
        with pytest.raises(BadInput, match=r"b\.uff: "):
            read_frf(tmp_path / "b.uff", "mobility", POINTS)


def test_values_beyond_sense_are_refused(folder):
    """Sums of their squares overflow, and a NaN passes every check of the form `share > limit`."""
    (folder / "T20_n0.uff").write_bytes(ascii_58(FREQUENCY, 1e200 * rotor_frf().value[0, 0], 6, True))
    with pytest.raises(BadInput, match=r"T20_n0\.uff: holds .*no structure answers so"):
        read_campaign(folder)


def test_an_unknown_ordinate_type_is_refused(tmp_path):
    text = ascii_58(FREQUENCY, rotor_frf().value[0, 0], 6, True)
    (tmp_path / "a.uff").write_bytes(text.replace(b"\n         6       301", b"\n         3       301"))
    with pytest.raises(BadInput, match="set 1: ordinate data type 3; allowed are 2, 4, 5, 6"):
        read_uff(tmp_path / "a.uff")


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(28, "No space left on device"), MemoryError()], ids=lambda e: type(e).__name__)
def test_what_pyuff_hides_is_raised(file, tmp_path, monkeypatch, error):
    """Its bare `except` makes exceptions of its own out of Ctrl-C and a full disk."""

    def hidden(*_, **__):
        try:
            raise error
        except BaseException:
            raise Exception("Error writing data-set #58") from None

    monkeypatch.setattr("thermospindle.sim.campaign.uff.pyuff.UFF.write_sets", hidden)
    with pytest.raises(type(error)):
        write_frf(tmp_path / "b.uff", rotor_frf(), POINTS, "title", "test")
    monkeypatch.setattr("thermospindle.sim.campaign.uff.pyuff.UFF.read_sets", hidden)
    with pytest.raises(type(error)):
        read_uff(file)


def test_cells_are_plain_numbers(folder):
    """1_000 and digits of other scripts are numbers to Python alone."""
    text = (folder / "modes.csv").read_text()
    for other in ("1_738.1", "١٧٣٨.1"):
        (folder / "modes.csv").write_text(text.replace("1738.1", other))
        with pytest.raises(BadInput, match="must be a number in digits 0 to 9"):
            read_campaign(folder)


def test_an_underscore_is_no_digit(tmp_path):
    """Python reads 1_0 as ten; a damaged byte between two digits would shift a value by a place in silence."""
    text = ascii_58(FREQUENCY, rotor_frf().value[0, 0], 6, True)
    values = text.rindex(b"    -1")
    at = text.rindex(b"E", 0, values) - 3
    (tmp_path / "a.uff").write_bytes(text[:at] + b"_" + text[at + 1 :])
    with pytest.raises(BadInput, match="set 1: has '_' in its values"):
        read_uff(tmp_path / "a.uff")
    (tmp_path / "b.uff").write_bytes(text.replace(b"\n         6       301", b"\n         6       3_1"))
    with pytest.raises(BadInput, match="set 1: has '_' in the numbers of its header"):
        read_uff(tmp_path / "b.uff")
