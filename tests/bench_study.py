"""What a study costs on many workers: measured parts, a model of the whole, and the model against a simulated cluster.

    python -m tests.bench_study [--picture FILE.png]
    python -m tests.bench_study --cores [--draws N]      # the same study by 1 and by 2 worker processes of this machine, and nothing else

The model. A study of N parts on n workers takes, with t the work of a part and s what the one
process that hands out and writes needs for it,

    T(n) = start + max(N s, ceil(N / n) t) + t_last,        speed-up N t / T(n),    at most t / s.

`s` is the sum of Dask's scheduler and client, and of writing a part whole (a Parquet file, its folder, a
rename). The simulated cluster is Dask itself, the real scheduler, client and writing, with threads that
sleep instead of computing: a sleeping thread needs no core, so hundreds of workers fit into this machine.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from tests.conftest import SCENE
from thermospindle.model import parallel
from thermospindle.model.scene.fields import read_file
from thermospindle.model.scene.reading import load
from thermospindle.sim.effects import CATALOGUE
from thermospindle.sim.study.executors import on_cluster
from thermospindle.sim.study.form import read_study
from thermospindle.sim.study.parts import versions, write_table
from thermospindle.sim.study.rows import Cases, cases

STUDY = 'title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20, 60]\ndraws = 1000\n'
WORKERS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000)
CHUNKS = (1, 64, 1000)
PER_PART = 64  # cases, as a study has by default
START = 3.0  # s: a worker process with its imports, measured 1.6 to 3.1 s


def small_study(folder: Path) -> Cases:
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    return cases(read_study(folder / "study.toml"), read_file("scene", SCENE / "spindle.toml"), SCENE / "spindle.toml", load(SCENE), CATALOGUE)


def of_a_case(of: Cases, count: int = 20) -> tuple[float, list[dict]]:
    """Processor time (s) of a case, and the rows."""
    rows = of.rows(0)
    start = time.process_time()
    for k in range(count):
        rows += of.rows(k)
    return (time.process_time() - start) / count, rows


def of_writing(of: Cases, rows: list[dict], folder: Path, chunk: int, count: int = 20) -> float:
    """Processor time (s) of writing a part of so many cases."""
    table = pa.Table.from_pylist((rows * (2 * chunk // len(rows) + 1))[: 2 * chunk], schema=of.schema())
    start = time.process_time()
    for k in range(count):
        write_table(table, folder / f"part-{chunk}-{k}.parquet")
    return (time.process_time() - start) / count


def sleeping(seconds: float, k: int) -> int:
    time.sleep(seconds)
    return k


def share_of_a_core(seconds: float = 0.5) -> float:
    """How much of a core this process gets just now: 1 on a quiet machine."""
    began, busy = time.perf_counter(), time.process_time()
    while time.perf_counter() - began < seconds:
        sum(range(1000))
    return (time.process_time() - busy) / (time.perf_counter() - began)


def simulated(workers: int, parts: int, seconds: float) -> tuple[float, float, float]:
    """Wall time (s) of so many parts that sleep, on so many workers of a real scheduler, the processor
    time (s) that handing one out took, and the share of a core that was to be had before and after."""
    share = share_of_a_core()
    from distributed import LocalCluster

    local = LocalCluster(n_workers=1, threads_per_worker=workers, processes=False, dashboard_address=None)
    with local as cluster, on_cluster(cluster.scheduler_address, versions) as run:
        run(partial(sleeping, 0.0), list(range(20)), lambda k, found: None)
        began, busy = time.perf_counter(), time.process_time()
        run(partial(sleeping, seconds), list(range(parts)), lambda k, found: None)
        wall, handing = time.perf_counter() - began, (time.process_time() - busy) / parts
    return wall, handing, (share + share_of_a_core()) / 2


def model(workers: int, parts: int, work: float, serial: float, start: float = 0.0) -> float:
    """Seconds."""
    return start + max(parts * serial, -(-parts // workers) * work) + min(serial, work)


def on_cores(workers: int, draws: int, folder: Path) -> tuple[float, float, float]:
    """Wall time (s) of a study by so many processes that have started and imported, the share of a core
    that one process got before and after, and the processor time (s) of its cases done here one by one."""
    of = small_study(folder)
    parts = range(draws // PER_PART)
    parallel.in_parallel(partial(part, of), range(2 * workers), workers)  # imports, and what is computed once
    share, began = share_of_a_core(), time.perf_counter()
    parallel.in_parallel(partial(part, of), parts, workers)
    wall = time.perf_counter() - began
    share = (share + share_of_a_core()) / 2
    busy = time.process_time()
    for k in parts:
        part(of, k)
    return wall, share, time.process_time() - busy


def part(of: Cases, k: int) -> int:
    return sum(len(of.rows(case)) for case in range(k * PER_PART, (k + 1) * PER_PART))


def cores_told(console: Console, draws: int) -> None:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    table = Table("processes", "wall, s", "speed-up", "share of a core for one process", "processor time of the cases, s", show_edge=False)
    first = None
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as place:
            wall, share, busy = on_cores(workers, draws, Path(place))
        first = first or wall
        table.add_row(str(workers), f"{wall:.1f}", f"{first / wall:.2f}", f"{share:.2f}", f"{busy:.1f}")
    console.print(f"{draws} draws of hdd_2003 at two conditions, {PER_PART} a part; {os.cpu_count()} cores, load {load:.1f} at the start (0 on a quiet machine)")
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--cores", action="store_true")
    parser.add_argument("--draws", type=int, default=8192)
    parser.add_argument("--picture", type=Path)
    asked, console = parser.parse_args(), Console()
    if asked.cores:
        cores_told(console, asked.draws)
        return
    with tempfile.TemporaryDirectory() as place:
        of = small_study(Path(place))
        case, rows = of_a_case(of)
        handing = [simulated(workers, 200, 0.2) for workers in (4, 16, 64)]
        serial = float(np.median([h for _, h, _ in handing]))
        writing = {chunk: of_writing(of, rows, Path(place), chunk) for chunk in CHUNKS}
    console.print(f"a case (two conditions) {1e3 * case:.1f} ms; handing out and taking back a part {1e3 * serial:.2f} ms; writing one of " + ", ".join(f"{c} cases {1e3 * w:.1f} ms" for c, w in writing.items()))
    table = Table("workers", "200 parts of 0.2 s: simulated, s", "model, s", "share of a core", "model with it, s", show_edge=False)
    for workers, (wall, _, share) in zip((4, 16, 64), handing, strict=True):
        table.add_row(str(workers), f"{wall:.2f}", f"{model(workers, 200, 0.2, serial):.2f}", f"{share:.2f}", f"{model(workers, 200, 0.2, serial / share):.2f}")
    console.print(table)
    speed: dict[int, list[float]] = {}
    table = Table("workers", *(f"speed-up, {c} cases a part" for c in CHUNKS), show_edge=False)
    for chunk in CHUNKS:
        parts = 10_000_000 // chunk
        speed[chunk] = [parts * chunk * case / model(n, parts, chunk * case, serial + writing[chunk], START) for n in WORKERS]
    for k, n in enumerate(WORKERS):
        table.add_row(str(n), *(f"{speed[c][k]:.1f}" for c in CHUNKS))
    console.print(table)
    if asked.picture:
        figure = Figure(figsize=(6, 4), layout="constrained")
        axes = figure.subplots()
        axes.plot(WORKERS, WORKERS, color="0.7", lw=1, label="all workers at work")
        for chunk in CHUNKS:
            axes.plot(WORKERS, speed[chunk], "o-", ms=3, label=f"{chunk} cases a part")
        axes.set(xscale="log", yscale="log", xlabel="workers", ylabel="speed-up of ten million cases", title="Studies on a cluster, by the model")
        axes.legend(frameon=False)
        axes.grid(alpha=0.3)
        figure.savefig(asked.picture, dpi=130)


if __name__ == "__main__":
    main()
