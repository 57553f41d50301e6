"""Whole files of every kind that is read, as the damage is done to them: others' and our own, some written here."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
import pytest
from scipy.io import savemat

from tests.conftest import DATA, ROOT, SCENE
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.files import kept as store
from thermospindle.model.files.stiffness_table import tabulate, write_table
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.uff import write_frf
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
columns = { "frequency [Hz]" = "frequency [Hz]", "H(3,1) real [m/s/N]" = "H(3,1) real [m/s/N]" }
leave_out = []
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


PEAKS = b"""# picked by hand
test;mode;kind;frequency [Hz];sd_Hz;damping %
T20;1;axial;1002,5;0,5;0,5
T20;2;axial;1545;;
T20;3;rocking;1795,2;0,3;2,1
"""
OF_PEAKS = b'spindle = "hdd_2003"\nfrequency_sd_Hz = 0.5\n[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n'


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
def small_uff() -> bytes:
    """Four FRFs of it on 30 lines: less than the fuzzer's longest input."""
    frf, points = (test := read_campaign(SCENE / "virtual" / "soak_20_60")).tests[0].frf, test.points
    assert frf is not None
    few = replace(
        frf, frequency=frf.frequency[:30], value=frf.value[:2, :, :30], response_nodes=frf.response_nodes[:2], coherence=None,
        sd=None if frf.sd is None else frf.sd[:2, :, :30],
    )
    with TemporaryDirectory() as place:
        write_frf(Path(place) / "T20_n0.uff", few, points, "t", "T20_n0")
        return (Path(place) / "T20_n0.uff").read_bytes()


@cache
def modes(name: str) -> bytes:
    """A file of the campaign that is a table of modes."""
    return (SCENE / "measured" / "jang_2003" / name).read_bytes()


@cache
def shapes(name: str) -> bytes:
    """A file of the campaign whose modes have shapes."""
    return (ROOT / "scenes" / "free_shaft" / "measured" / "modelab" / name).read_bytes()


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
    spindle = load(SCENE)
    rings = {b.name: reference_motion(20.0) for b in spindle.bearings}
    with TemporaryDirectory() as place:
        grid = (20.0, 40.0, 60.0), (0.0, 700.0)
        write_table(tabulate(*grid, [[solve(spindle, Condition(t, w), rings) for w in grid[1]] for t in grid[0]], {}, {}), Path(place) / "table.csv")
        return (Path(place) / "table.csv").read_bytes()


@cache
def log() -> bytes:
    with TemporaryDirectory() as place:
        command = [sys.executable, "-m", "thermospindle", "runout", str(SCENE), "--speed", "7200", "--seconds", "0.3", "--out", place]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)  # Rerun has threads, and who reads its logs forks
        return next(Path(place).rglob("*.rrd")).read_bytes()


def one_array(array: np.ndarray) -> bytes:
    buffer = BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


@cache
def study_key() -> bytes:
    with TemporaryDirectory() as place:
        with opened(Path(place) / "s", {"study": "a"}, 10, 2, pa.schema({})):
            pass
        return (Path(place) / "s" / "study.json").read_bytes()


KEPT = {"a": np.arange(30.0), "notes": np.asarray(json.dumps({"question": "q"}))}


@cache
def kept() -> bytes:
    buffer = BytesIO()
    np.savez(buffer, digest=store.digest(KEPT), **KEPT)
    return buffer.getvalue()
