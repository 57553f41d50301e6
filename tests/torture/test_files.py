"""Damaged files: what is read of them is used, or refused by a named error; nothing else, and never for ever."""

import json
import os
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from tests.conftest import DATA, ROOT, SCENE
from tests.torture.conftest import EXAMPLES, FEW, outcome
from tests.torture.damage import damaged, damages
from tests.torture.machines import FILES
from thermospindle.cli import main
from thermospindle.diagnosis.add import read_answer
from thermospindle.diagnosis.draft import draft
from thermospindle.diagnosis.prediction.outcomes import outcomes
from thermospindle.model.bearing.pair import reference_motion, solve
from thermospindle.model.bearing.stiffness_table import read_table, tabulate, write_table
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.importing.assemble import campaign_of, read
from thermospindle.sim.importing.files.arrays import read_arrays
from thermospindle.sim.importing.mapping import MappingForm, read_mapping
from thermospindle.sim.study.form import read_study
from thermospindle.sim.study.parts import opened

STUDIES = (
    b'title = "t"\nkind = "sweep"\nscene = "hdd_2003"\ntemperatures_C = [20, 60]\nspeeds_rpm = [0.0, 7200]\nhighest_Hz = 3000\nchunk = 4\n'
    b'[vary]\n"bearing_pair.preload_N" = { from = 10, to = 20, steps = 6 }\n"effects.bond_softening.hot_compliance" = [0, 12.5]\n',
    b'title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ndraws = 100\nseed = 3\n',
    b'title = "t"\nkind = "fleet"\nscene = "hdd_2003"\ncampaigns = ["*", "../*"]\nwork = "compare"\n',
)
MAPPING = b"""title = "t"
spindle = "hdd_2003"
quantity = "mobility"
band_Hz = [100.0, 3000.0]
[[files]]
file = "*.csv"
test = "T20"
unit = "m/s/N"
columns = { "f" = "frequency", "H(3,1) real" = "H(3,1) real" }
leave_out = ["H(6,6)"]
[[tests]]
id = "T20"
temperature_C = 20.5
speed_rpm = 0.0
averages = 5
[[points]]
node = 1
name = "a"
body = "hub"
position_mm = [0.0, 0.0, 20.0]
direction = "+Z"
called = ["3"]
[records]
estimator = "H1"
exponential_end = 0.05
overload = { force = 5.0 }
[[points]]
node = 2
name = "b"
body = "hub"
position_mm = [12.0, 0.0, 15.0]
direction = "+X"
called = ["1", 1]
"""
UFFS = sorted(p for folder in ("uff_files_jl", "pyuff") for p in (DATA / folder).rglob("*") if p.suffix in (".uff", ".unv", ".ufb") and p.stat().st_size < 300_000)
TABLE = b"frequency [Hz],H(3,1) real [m/s/N],H(3,1) imag [m/s/N],coherence(3,1)\n" + b"".join(b"%g,%g,%g,%g\n" % (f, 1e-3 * f, -2e-4 * f, 0.98) for f in range(100, 180, 2))
SELDOM = 100_000
"""Bytes from which a file is damaged in its first and last parts alone, where headers are."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


@cache
def small_uff() -> bytes:
    """One set of a campaign's own."""
    data = (SCENE / "virtual" / "soak_20_60" / "T20_n0.uff").read_bytes()
    return data[: data.index(b"    -1\n    -1\n") + 7]


@cache
def diagnosis() -> bytes:
    """What `diagnose --json` answers, by the keys that are read back."""
    candidate = {"effects": ["bond_softening"], "delta_evidence": 12.0, "probability": 0.9, "parameters": {"bond_softening.hot_compliance": {"value": 12.1, "sd": 0.3, "unit": "nm/N"}}}
    place = {"element": "upper", "unit": "%", "change": [{"temperature_C": t, "speed_rpm": 0.0, "relative": -1e-5 * (t - 20) ** 2, "sd": 0.001} for t in (20, 30, 40, 50, 60)]}
    return json.dumps({
        "verdict": "identified", "effects": ["bond_softening"], "reason": "so", "probability": {"none": 0.0, "unknown": 0.1}, "candidates": [candidate],
        "tolerances": {"preload": {"value": 0.01, "sd": 0.02, "prior_sd": 0.03}, "temperature of T20": {"value": 0.1, "sd": 0.1, "prior_sd": 0.2}}, "where": [place],
        "next_test": [{"condition": {"temperature_C": 20.0, "speed_rpm": 0.0}, "predicted": {"bond_softening": [{"frequency_Hz": 1002.0, "sd_Hz": 1.0}]}}], "scene_hash": "0123",
    }).encode()  # fmt: skip


def test_nothing_is_refused_undamaged(folder):
    """What is damaged below can be read as it is: a refusal is one of the damage."""
    (folder / "m.toml").write_bytes(MAPPING)
    (folder / "right.csv").write_bytes(TABLE)
    form = read_mapping(folder / "m.toml")
    assert campaign_of(read([folder / "right.csv"], form, None, folder / "m.toml"), form, None, [folder / "right.csv"], None)[0].tests
    (folder / "d.json").write_bytes(diagnosis())
    assert "EFFECT" in draft(folder / "d.json", "own", None)
    assert read_answer(folder / "d.json").best == ("bond_softening",)
    for text in STUDIES[:2]:
        (folder / "s.toml").write_bytes(text)
        assert read_study(folder / "s.toml").title == "t"


@pytest.mark.parametrize("key", ["element", "unit"])
def test_nothing_of_a_diagnosis_becomes_code(tmp_path, key):
    raw = json.loads(diagnosis())
    raw["where"][0][key] = '"""; import os; os.abort(); """'
    raw["where"][0]["change"] = [row | {f"change_{raw['where'][0]['unit']}": 0.1} for row in raw["where"][0]["change"]]
    (tmp_path / "d.json").write_text(json.dumps(raw), encoding="utf-8")
    with pytest.raises(BadInput, match="cannot be written into an effect file"):
        draft(tmp_path / "d.json", "own", None)


@given(st.sampled_from(sorted(FILES)), damages)
def test_scenes(folder, name, every):
    file = folder / "scene" / "spindle.toml"
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(damaged(FILES[name].read_bytes(), every))
    with outcome("spindle.toml"):
        load(file)


@given(st.sampled_from(["campaign.toml", "modes.csv"]), damages)
def test_campaigns_of_modes(folder, name, every):
    own = folder / "modes"
    shutil.copytree(SCENE / "measured" / "jang_2003", own, dirs_exist_ok=True)
    (own / name).write_bytes(damaged((own / name).read_bytes(), every))
    with outcome(name):
        for test in read_campaign(own).tests:
            assert all(np.isfinite([r.frequency, r.frequency_sd]).all() and r.frequency > 0 for r in test.modes or ())


@given(damages)
def test_campaigns_of_frfs(folder, every):
    own = folder / "frfs"
    own.mkdir(exist_ok=True)
    text = (SCENE / "virtual" / "soak_20_60" / "campaign.toml").read_text(encoding="utf-8")
    (own / "campaign.toml").write_text(text[: text.index("[[tests]]", text.index("[[tests]]") + 5)], encoding="utf-8")
    data = (SCENE / "virtual" / "soak_20_60" / "T20_n0.uff").read_bytes()
    head = damaged(data[:SELDOM], every)
    (own / "T20_n0.uff").write_bytes(head + data[SELDOM:])
    with outcome("UFF of a campaign"):
        for test in read_campaign(own).tests:
            assert test.frf is None or np.all(np.isfinite(test.frf.value))


@given(st.sampled_from(UFFS), damages)
def test_uff_of_others(folder, source, every):
    file = folder / f"lab{source.suffix}"
    file.write_bytes(damaged(source.read_bytes(), every))
    with outcome("UFF to import"):
        read([file], MappingForm(), None)


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


@given(damages)
def test_tables_of_others(folder, every):
    file = folder / "lab.csv"
    file.write_bytes(damaged(TABLE, every))
    with outcome("CSV to import"):
        found = read([file], MappingForm(), None)
        campaign_of(found, MappingForm(), None, [file], None)


@given(damages)
def test_arrays_of_others(folder, every):
    file = folder / "lab.npz"
    np.savez(file, frequency=np.arange(100.0, 200.0), H_3_1=np.ones(100) * (1 + 1j))
    file.write_bytes(damaged(file.read_bytes(), every))
    with outcome("npz to import"):
        read([file], MappingForm(), None)


@given(damages)
def test_mappings(folder, every):
    file = folder / "mapping.toml"
    file.write_bytes(damaged(MAPPING, every))
    table = folder / "right.csv"
    table.write_bytes(TABLE)
    with outcome("mapping"):
        form = read_mapping(file)
        campaign_of(read([table], form, None, file), form, None, [table], file)


@given(st.sampled_from(STUDIES), damages)
def test_studies(folder, text, every):
    file = folder / "study.toml"
    file.write_bytes(damaged(text, every))
    with outcome("study file"):
        read_study(file)


@given(damages)
def test_keys_of_studies(folder, every):
    import pyarrow as pa

    place = folder / "begun"
    shutil.rmtree(place, ignore_errors=True)
    with opened(place, {"study": "a"}, 10, 2, pa.schema({})):
        pass
    (place / "study.json").write_bytes(damaged((place / "study.json").read_bytes(), every))
    with outcome("study.json"), opened(place, {"study": "a"}, 10, 2, pa.schema({})) as found:
        assert found.count == 5


@given(damages)
def test_diagnoses(folder, every):
    file = folder / "diagnosis.json"
    file.write_bytes(damaged(diagnosis(), every))
    with outcome("diagnosis.json --from"):
        read_answer(file)
    with outcome("diagnosis.json to draft"):
        draft(file, "own", None)
    with outcome("diagnosis.json predicted"):
        outcomes(file, [])


@given(damages)
def test_tables_of_stiffness(folder, every):
    whole = folder / "whole.csv"
    if not whole.exists():
        spindle = load(SCENE)
        rings = {b.name: reference_motion(20.0) for b in spindle.bearings}
        write_table(tabulate([[solve(spindle, Condition(t, w), rings) for w in (0.0, 700.0)] for t in (20.0, 40.0, 60.0)], {}, {}), whole)
    file = folder / "table.csv"
    file.write_bytes(damaged(whole.read_bytes(), every))
    with outcome("table of stiffness"):
        read_table(file)


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


@cache
def matlab(kind: str) -> bytes:
    """A small .mat file of FRFs."""
    from io import BytesIO

    buffer = BytesIO()
    arrays = {"frequency": np.arange(100.0, 200.0), "H_3_1": np.ones(100) * (1 + 1j)}
    if kind == "hdf5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(buffer, "w") as stored:
            for name, value in arrays.items():
                stored[name] = value
    else:
        savemat(buffer, arrays, do_compression=kind == "packed")
    return buffer.getvalue()


@given(st.sampled_from(["plain", "packed", "hdf5"]), damages)
def test_matlab_files_of_others(folder, kind, every):
    file = folder / "lab.mat"
    file.write_bytes(damaged(matlab(kind), every))
    with outcome(f".mat ({kind})"):
        read([file], MappingForm(), None)


@given(damages)
def test_caches(folder, every):
    """A kept answer that was damaged is computed again: never another number, never an error."""
    from thermospindle.thermal import store

    file = folder / "influence-0.npz"
    before, arrays = os.environ["THERMOSPINDLE_CACHE"], {"a": np.arange(30.0), "notes": np.asarray(json.dumps({"question": "q"}))}
    np.savez(file, digest=store._digest(arrays), **arrays)
    file.write_bytes(damaged(file.read_bytes(), every))
    place = store._file
    store._file = lambda question: file
    try:
        with outcome("cache"):
            found = store._read("q")
            assert found is None or np.array_equal(found[1]["a"], arrays["a"])
    finally:
        store._file = place
        os.environ["THERMOSPINDLE_CACHE"] = before


@pytest.mark.slow
@settings(max_examples=max(FEW, EXAMPLES // 100))
@given(damages)
def test_logs(folder, every):
    """A process is started for each, since what reads them may abort."""
    from thermospindle.report.log.read import check_readable, describe, read_log

    whole = folder / "whole.rrd"
    if not whole.exists():
        assert main(["compare", str(SCENE), str(SCENE / "measured" / "jang_2003"), "--out", str(folder / "compared")]) == 0
        shutil.copy(next((folder / "compared").rglob("*.rrd")), whole)
    file = folder / "log.rrd"
    file.write_bytes(damaged(whole.read_bytes(), every))
    with outcome("log"):
        check_readable(file)
        describe(read_log(file))


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
