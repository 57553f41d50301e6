"""Every reader of files that come from others: whole files to begin with, and what it does with one. The property tests, the fuzzer (`tests/fuzz`)
and `tests/faults` share them.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from tests.conftest import DATA, SCENE
from tests.torture.machines import FILES
from thermospindle.cli import main
from thermospindle.diagnosis.add import read_answer
from thermospindle.diagnosis.draft import draft
from thermospindle.diagnosis.prediction.outcomes import outcomes
from thermospindle.model.bearing.pair import reference_motion, solve
from thermospindle.model.bearing.stiffness_table import read_table, tabulate, write_table
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.report.log.read import check_readable, describe, read_log
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.importing.assemble import campaign_of, read
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
TABLE = b"frequency [Hz],H(3,1) real [m/s/N],H(3,1) imag [m/s/N],coherence(3,1)\n" + b"".join(b"%g,%g,%g,%g\n" % (f, 1e-3 * f, -2e-4 * f, 0.98) for f in range(100, 180, 2))


@cache
def uffs(most: int = 300_000) -> tuple[bytes, ...]:
    """UFF files of others, up to so many bytes each."""
    every = sorted(p for folder in ("uff_files_jl", "pyuff") for p in (DATA / folder).rglob("*") if p.suffix in (".uff", ".unv", ".ufb"))
    return tuple(p.read_bytes() for p in every if p.stat().st_size < most)


@cache
def own_uff() -> bytes:
    """A campaign's own, whole."""
    return (SCENE / "virtual" / "soak_20_60" / "T20_n0.uff").read_bytes()


@cache
def modes(name: str) -> bytes:
    """A file of the campaign that is a table of modes."""
    return (SCENE / "measured" / "jang_2003" / name).read_bytes()


@cache
def arrays() -> bytes:
    buffer = BytesIO()
    np.savez(buffer, frequency=np.arange(100.0, 200.0), H_3_1=np.ones(100) * (1 + 1j))
    return buffer.getvalue()


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


@cache
def matlab(kind: str) -> bytes:
    """A small .mat file of FRFs."""
    buffer = BytesIO()
    own = {"frequency": np.arange(100.0, 200.0), "H_3_1": np.ones(100) * (1 + 1j)}
    if kind == "hdf5":
        h5py = pytest.importorskip("h5py")
        with h5py.File(buffer, "w") as stored:
            for name, value in own.items():
                stored[name] = value
    else:
        savemat(buffer, own, do_compression=kind == "packed")
    return buffer.getvalue()


@cache
def stiffness() -> bytes:
    """A table of stiffness at six conditions."""
    from tempfile import TemporaryDirectory

    spindle = load(SCENE)
    rings = {b.name: reference_motion(20.0) for b in spindle.bearings}
    with TemporaryDirectory() as place:
        write_table(tabulate([[solve(spindle, Condition(t, w), rings) for w in (0.0, 700.0)] for t in (20.0, 40.0, 60.0)], {}, {}), Path(place) / "table.csv")
        return (Path(place) / "table.csv").read_bytes()


@cache
def log() -> bytes:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as place:
        assert main(["runout", str(SCENE), "--speed", "7200", "--seconds", "0.3", "--out", place]) == 0
        return next(Path(place).rglob("*.rrd")).read_bytes()


# ---------------------------------------------------------------- what is done with a file


def _campaign_of_modes(file: Path) -> None:
    for name in {"campaign.toml", "modes.csv"} - {file.name}:
        (file.parent / name).write_bytes(modes(name))
    for test in read_campaign(file.parent).tests:
        assert all(np.isfinite([r.frequency, r.frequency_sd]).all() and r.frequency > 0 for r in test.modes or ())


def _campaign_of_frfs(file: Path) -> None:
    text = (SCENE / "virtual" / "soak_20_60" / "campaign.toml").read_text(encoding="utf-8")
    (file.parent / "campaign.toml").write_text(text[: text.index("[[tests]]", text.index("[[tests]]") + 5)], encoding="utf-8")
    for test in read_campaign(file.parent).tests:
        assert test.frf is None or np.all(np.isfinite(test.frf.value))


def _to_import(file: Path) -> None:
    read([file], MappingForm(), None)


def _to_campaign(file: Path) -> None:
    """With the mapping that answers what the file does not tell."""
    mapping = file.with_name("m.toml")
    mapping.write_bytes(MAPPING)
    form = read_mapping(mapping)
    found, _ = campaign_of(read([file], form, None, mapping), form, None, [file], mapping)
    assert all(test.frf is None or np.all(np.isfinite(test.frf.value)) for test in found.tests)


def _mapping(file: Path) -> None:
    table = file.with_name("right.csv")
    table.write_bytes(TABLE)
    form = read_mapping(file)
    campaign_of(read([table], form, None, file), form, None, [table], file)


def _study_key(file: Path) -> None:
    """The file by which a study is gone on with."""
    import pyarrow as pa

    data, place = file.read_bytes(), file.with_name("begun")
    shutil.rmtree(place, ignore_errors=True)
    with opened(place, {"study": "a"}, 10, 2, pa.schema({})):
        pass
    (place / "study.json").write_bytes(data)
    with opened(place, {"study": "a"}, 10, 2, pa.schema({})) as found:
        assert found.count == 5


@cache
def study_key() -> bytes:
    from tempfile import TemporaryDirectory

    import pyarrow as pa

    with TemporaryDirectory() as place:
        with opened(Path(place) / "s", {"study": "a"}, 10, 2, pa.schema({})):
            pass
        return (Path(place) / "s" / "study.json").read_bytes()


def _cache(file: Path) -> None:
    """A kept answer that was damaged is computed again: never another number, never an error."""
    from thermospindle.model.files import kept as files

    place = files._file
    files._file = lambda kind, question, code: file
    try:
        found = files.read("influence", "q", "")
        assert found is None or np.array_equal(found[1]["a"], KEPT["a"])
    finally:
        files._file = place


KEPT = {"a": np.arange(30.0), "notes": np.asarray(json.dumps({"question": "q"}))}


@cache
def kept() -> bytes:
    from thermospindle.model.files import kept as files

    buffer = BytesIO()
    np.savez(buffer, digest=files.digest(KEPT), **KEPT)
    return buffer.getvalue()


def _log(file: Path) -> None:
    """A process is started first, since what reads logs may abort."""
    check_readable(file)
    describe(read_log(file))


@dataclass(frozen=True)
class Reader:
    """`file` is the name a file of this kind has; `whole` gives some that are not damaged; `read` returns, or raises a named error."""

    file: str
    whole: Callable[[], tuple[bytes, ...]]
    read: Callable[[Path], object]

    def __call__(self, folder: Path, data: bytes) -> None:
        """Reads `data` as the only damaged file of a folder of its own."""
        folder.mkdir(exist_ok=True)
        (folder / self.file).write_bytes(data)
        self.read(folder / self.file)


READERS = {
    "scene": Reader("spindle.toml", lambda: tuple(f.read_bytes() for f in FILES.values()), load),
    "campaign": Reader("campaign.toml", lambda: (modes("campaign.toml"),), _campaign_of_modes),
    "modes": Reader("modes.csv", lambda: (modes("modes.csv"),), _campaign_of_modes),
    "campaign-uff": Reader("T20_n0.uff", lambda: (own_uff(),), _campaign_of_frfs),
    "uff": Reader("lab.uff", uffs, _to_import),
    "csv": Reader("lab.csv", lambda: (TABLE,), _to_campaign),
    "npz": Reader("lab.npz", lambda: (arrays(),), _to_import),
    "mat": Reader("lab.mat", lambda: tuple(matlab(kind) for kind in ("plain", "packed", "hdf5")), _to_import),
    "mapping": Reader("mapping.toml", lambda: (MAPPING,), _mapping),
    "study": Reader("study.toml", lambda: STUDIES, read_study),
    "study-key": Reader("study.json", lambda: (study_key(),), _study_key),
    "diagnosis": Reader("diagnosis.json", lambda: (diagnosis(),), read_answer),
    "diagnosis-draft": Reader("diagnosis.json", lambda: (diagnosis(),), lambda file: draft(file, "own", None)),
    "diagnosis-predicted": Reader("diagnosis.json", lambda: (diagnosis(),), lambda file: outcomes(file, [])),
    "stiffness": Reader("table.csv", lambda: (stiffness(),), read_table),
    "cache": Reader("influence-0.npz", lambda: (kept(),), _cache),
    "log": Reader("log.rrd", lambda: (log(),), _log),
}
