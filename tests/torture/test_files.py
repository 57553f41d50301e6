"""Damaged files: what is read of them is used, or refused by a named error; nothing else, and never for ever."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from tests.conftest import DATA, ROOT, SCENE
from tests.torture.apart import tried_apart
from tests.torture.conftest import NAMED, outcome
from tests.torture.damage import Damage, damaged, damages
from tests.torture.readers import READERS
from tests.torture.wholes import MAPPING, STUDIES, TABLE, diagnosis, matlab, stiffness
from thermospindle.cli import main
from thermospindle.diagnosis.answer import read_answer
from thermospindle.diagnosis.draft.draft import draft
from thermospindle.model.errors import BadInput
from thermospindle.sim.importing.assemble import campaign_of, read
from thermospindle.sim.importing.files.arrays import read_arrays
from thermospindle.sim.importing.mapping import MappingForm, read_mapping

ANY = [pytest.param(name, marks=pytest.mark.slow) if name == "log" else name for name in READERS]
LONG, HEAD = 300_000, 100_000
"""Bytes from which a file is damaged in its first part alone, where its headers are, and of that part."""
APART = ("mat", "log")
"""What is read by another process first, since reading it may end one."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


@pytest.mark.parametrize("name", ANY)
def test_a_whole_file_is_read(folder, name):
    """So a refusal below is one of the damage."""
    read_it(folder / name, name, READERS[name].whole()[0])


def test_what_is_read_is_what_was_meant(folder):
    (folder / "m.toml").write_bytes(MAPPING)
    (folder / "right.csv").write_bytes(TABLE)
    form = read_mapping(folder / "m.toml")
    assert campaign_of(read([folder / "right.csv"], form, None, folder / "m.toml"), form, None, [folder / "right.csv"], None)[0].tests
    (folder / "d.json").write_bytes(diagnosis())
    assert "EFFECT" in draft(folder / "d.json", "own", None).text
    assert read_answer(folder / "d.json").best == ("bond_softening",)


@pytest.mark.parametrize("key", ["element", "unit"])
def test_nothing_of_a_diagnosis_becomes_code(tmp_path, key):
    raw = json.loads(diagnosis())
    raw["where"][0][key] = '"""; import os; os.abort(); """'
    raw["where"][0]["change"] = [row | {f"change_{raw['where'][0]['unit']}": 0.1} for row in raw["where"][0]["change"]]
    (tmp_path / "d.json").write_text(json.dumps(raw), encoding="utf-8")
    with pytest.raises(BadInput, match="cannot be written into an effect file"):
        draft(tmp_path / "d.json", "own", None)


def read_it(place: Path, name: str, data: bytes) -> None:
    if name in APART:
        tried_apart(lambda: READERS[name](place, data), NAMED)
    else:
        READERS[name](place, data)


def tried(folder: Path, name: str, which: int, every: list[Damage]) -> None:
    whole = READERS[name].whole()
    data = whole[which % len(whole)]
    head = HEAD if len(data) > LONG else len(data)
    with outcome(name):
        read_it(folder / name, name, damaged(data[:head], every) + data[head:])


@pytest.mark.parametrize("name", [n for n in READERS if n != "log"])
@given(st.integers(0, 999), damages)
def test_a_damaged_file_is_read_or_refused(folder, name, which, every):
    tried(folder, name, which, every)


@pytest.mark.slow
@given(damages)
def test_so_is_a_log(folder, every):
    tried(folder, "log", 0, every)


@pytest.mark.parametrize("length", ["0.", "1e400", "nan", "-1."])
def test_units_of_a_file_are_numbers(tmp_path, length):
    """Found by `make torture`: a factor of data set 164 that made all its FRFs infinite."""
    text = (DATA / "uff_files_jl" / "dataset151_164_58_55.unv").read_text(encoding="latin-1")
    lines = text.splitlines(keepends=True)
    at = next(k for k, line in enumerate(lines) if line.split() == ["164"]) + 2
    own = lines[at][:25]
    changed = "".join([*lines[:at], f"{length:>25}", lines[at][len(own):], *lines[at + 1 :]])
    assert changed != text
    (tmp_path / "lab.unv").write_text(changed, encoding="latin-1")
    with pytest.raises(BadInput, match="164"):
        read([tmp_path / "lab.unv"], MappingForm(), None)


def test_a_superscript_is_no_number_of_a_channel(tmp_path):
    """Found by `make torture`: "²" is a digit to Python, and no number."""
    (tmp_path / "lab.csv").write_bytes("r ² ".encode() + TABLE)
    with outcome("CSV to import"):
        assert read([tmp_path / "lab.csv"], MappingForm(), None)


def test_what_breaks_its_library_off_is_refused(tmp_path):
    """Found by the fuzzer: a kind of numbers that there is not, on which SciPy's reader of .mat files ends the whole process (signal 11)."""
    savemat(tmp_path / "whole.mat", {"H": np.arange(3.0)})
    data = bytearray((tmp_path / "whole.mat").read_bytes())
    assert data[176] == 9, "numbers of eight bytes"
    data[176] = 255
    (tmp_path / "lab.mat").write_bytes(data)
    with pytest.raises(BadInput, match=r"lab\.mat: is damaged; the library that reads \.mat files breaks off on it"):
        read_arrays(tmp_path / "lab.mat")
    assert read_arrays(tmp_path / "whole.mat")["H"].tolist() == [0.0, 1.0, 2.0]


@pytest.mark.slow
def test_what_its_library_never_ends_on_is_refused(tmp_path, monkeypatch):
    """Found by `make torture`: 72 bytes twice in an HDF5 file, among whose groups h5py goes round for ever."""
    data = damaged(matlab("hdf5"), [Damage("twice", 0.0177, b"", 0.0177)])
    (tmp_path / "lab.mat").write_bytes(data)
    monkeypatch.setattr("thermospindle.model.files.apart.LONGEST", 4.0)
    with pytest.raises(BadInput, match=r"lab\.mat: is damaged; the library that reads \.mat files comes to no end on it within 4 s"):
        read_arrays(tmp_path / "lab.mat")


def test_values_that_overflow_are_refused(folder):
    """Found by `make torture`: two values of -1e308 in one FRF, whose squares are no numbers."""
    lines = TABLE.split(b"\n")
    lines[20] = b",".join([lines[20].split(b",")[0], b"-1e308", b"-1e308", b"0.9"])
    with pytest.raises(BadInput, match=r"a value of 1e\+308: none beyond 1e\+100 is a measurement"):
        READERS["csv"](folder / "overflow", b"\n".join(lines))


@pytest.mark.parametrize(("change", "said"), [(lambda row: row.rsplit(b",", 6)[0], "must be a finite number"), (lambda row: row.replace(b",20.0,", b",1e400,"), "temperature_C = '1e400': must be a finite number")])
def test_a_row_of_a_bearing_table_is_whole(folder, change, said):
    """A row that ends before its time ended in a traceback, a temperature beyond all numbers was taken where it stood alone."""
    head, *rows = stiffness().splitlines()[2:]
    row = next(r for r in rows if r.startswith(b"upper,20.0,"))
    READERS["bearing-table"](folder / "rows", head + b"\n" + row)
    with pytest.raises(BadInput, match=rf"line 2: .*{said}"):
        READERS["bearing-table"](folder / "rows", head + b"\n" + change(row))


def test_a_fork_tells_what_became_of_it():
    """What raises, what ends its process, what calls another interpreter."""
    import subprocess
    import sys

    with pytest.raises(BadInput, match="so it is"):
        tried_apart(lambda: (_ for _ in ()).throw(BadInput("so it is")), NAMED)
    with pytest.raises(AssertionError, match="ZeroDivisionError"):
        tried_apart(lambda: 1 // 0, NAMED)
    with pytest.raises(AssertionError, match="signal 6"):
        tried_apart(os.abort, NAMED)

    def asks() -> None:
        assert subprocess.run([sys.executable, "-P", "-c", "import os; os.abort()"]).returncode == -6
        assert subprocess.run([sys.executable, "-P", "-c", "import sys; print('no', file=sys.stderr); sys.exit(3)"]).stderr == "no\n"

    tried_apart(asks, NAMED)


# ---------------------------------------------------------------- what unpacks to more than there is room for


def bomb(file, kind: str) -> None:
    """Three megabytes of zeros in a few kilobytes."""
    zeros = np.zeros(3 << 17)
    match kind:
        case "npz":
            np.savez_compressed(file, frequency=zeros)
        case "mat":
            savemat(file, {"frequency": zeros}, do_compression=True)
        case "mat of structures":
            savemat(file, {"a": {"b": {"frequency": zeros}}}, do_compression=True)
        case "hdf5":
            h5py = pytest.importorskip("h5py")
            with h5py.File(file, "w") as stored:
                stored.create_dataset("frequency", shape=zeros.shape, dtype=float, chunks=(1 << 12,), compression="gzip")
    assert file.stat().st_size < 30_000


@pytest.mark.parametrize("kind", ["npz", "mat", "mat of structures", "hdf5"])
def test_what_unpacks_to_too_much_is_refused(tmp_path, monkeypatch, kind):
    file = tmp_path / ("lab.npz" if kind == "npz" else "lab.mat")
    bomb(file, kind)
    monkeypatch.setattr("thermospindle.sim.importing.files.arrays.LARGEST", 1 << 20)
    with pytest.raises(BadInput, match=r"unpacks to \d+ MB or more; at most 1 MB are read"):
        read_arrays(file)
    monkeypatch.setattr("thermospindle.sim.importing.files.arrays.LARGEST", 4 << 20)
    assert next(iter(read_arrays(file).values())).size == 3 << 17


# ---------------------------------------------------------------- what is no ordinary file


def strange(place: Path, what: str, outside: Path) -> None:
    """Something else where a file should be."""
    place.unlink(missing_ok=True)
    if what == "pipe":
        os.mkfifo(place)
    elif what == "folder":
        place.mkdir()
    elif what == "link to itself":
        place.symlink_to(place.name)
    elif what == "link to nothing":
        place.symlink_to("gone")
    elif what == "device":
        place.symlink_to("/dev/zero")
    elif what == "link out":
        place.symlink_to(outside)
    elif what == "empty":
        place.write_bytes(b"")


@pytest.mark.parametrize("what", ["pipe", *(pytest.param(w, marks=pytest.mark.slow) for w in ("folder", "link to itself", "link to nothing", "device", "empty"))])
@pytest.mark.parametrize("verb", ["modes", "compare", "compare modes", "compare frf", "import", "mapping", "study", "add", "draft"])
def test_what_is_no_file_is_refused(tmp_path, capsys, verb, what):
    outside = tmp_path / "outside.txt"
    outside.write_text("secret", encoding="utf-8")
    here = tmp_path / "here"
    shutil.copytree(SCENE / "measured" / "jang_2003", here)
    (here / "spindle.toml").write_bytes((SCENE / "spindle.toml").read_bytes())
    (here / "study.toml").write_bytes(STUDIES[1])
    file = here / {"modes": "spindle.toml", "compare": "campaign.toml", "compare modes": "modes.csv", "compare frf": "t.uff", "import": "lab.csv", "mapping": "m.toml", "study": "study.toml"}.get(verb, "d.json")  # fmt: skip
    if verb == "compare frf":
        (here / "campaign.toml").write_text('title = "t"\nspindle = "hdd_2003"\nquantity = "mobility"\n[[tests]]\nid = "a"\ntemperature_C = 20.0\nspeed_rpm = 0.0\nfrf = "t.uff"\n', encoding="utf-8")
    (here / "x.csv").write_bytes(TABLE)
    strange(file, what, outside)
    command = {
        "modes": ["modes", here],
        "import": ["import", file, "--out", tmp_path / "o"],
        "mapping": ["import", here / "x.csv", "--mapping", file, "--out", tmp_path / "o"],
        "study": ["study", file, "--out", tmp_path / "o"],
        "add": ["add", SCENE, "bond_softening", "--from", file, "--out", tmp_path / "o"],
        "draft": ["draft", file, "--out", tmp_path / "o.py"],
    }.get(verb, ["compare", SCENE, here])
    with outcome("no file at all"):
        code = main([str(a) for a in command])
    told = capsys.readouterr()
    assert code == 2, told
    assert "Traceback" not in told.err
    assert told.err.startswith("spindle: ")


@pytest.mark.parametrize("name", ["../outside.uff", "/etc/passwd", "a/../../outside.uff", ".hidden"])
def test_paths_that_leave_the_folder_are_refused(tmp_path, capsys, name):
    own = tmp_path / "c"
    own.mkdir()
    (own / "campaign.toml").write_text(f'title = "t"\nspindle = "hdd_2003"\nquantity = "mobility"\n[[tests]]\nid = "a"\ntemperature_C = 20.0\nspeed_rpm = 0.0\nfrf = "{name}"\n', encoding="utf-8")
    (tmp_path / "outside.uff").write_bytes((SCENE / "virtual" / "soak_20_60" / "T20_n0.uff").read_bytes()[:1000])
    with outcome("paths that leave"):
        assert main(["compare", str(SCENE), str(own)]) == 2
    assert "frf" in capsys.readouterr().err
    assert ROOT.is_dir()
