"""`make growth`: what it costs as the work grows, each beside a peer on the same work where there is one.

    python -m tests.bench_growth [--picture FILE.png]

Processor time of one core, the least of a few calls after one to warm up (a diagnosis: one call), so that other
programs on the machine hardly count. Peers: MuJoCo's own stepping; its system identification where what that
needs is installed (`bench_sysid`); CalculiX where `ccx` is on the path; ROSS where `ROSS_PYTHON`, sdypy-EMA
where `EMA_PYTHON` names a Python that has it (`pip install sdypy-EMA`, in an environment of its own).
"""

from __future__ import annotations

import os

os.environ.update(OPENBLAS_NUM_THREADS="1", LOKY_MAX_CPU_COUNT="1")  # all of the work in this process, so that its time is all of the time

import argparse
import json
import resource
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from tests import bench_sysid
from tests.bench_beams import FULL, OF_ROWS, best, condition, for_ross, meshed, rowed
from tests.bench_study import small_study
from tests.conftest import DATA, SCENE
from tests.literature.calculix import deck, solved
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.machine import Addition, Condition, Spindle
from thermospindle.model.rotor.modes import modes
from thermospindle.model.scene.reading import load
from thermospindle.model.shaft import Segment
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.effects import CATALOGUE, by_name, resolved
from thermospindle.sim.effects.effect import fitted_to, refusal
from thermospindle.sim.hammer.test import impact_tests, sampling
from thermospindle.sim.identification.modal import extract
from thermospindle.sim.operating import OperatingPoint, operating_point

Line = tuple[str, Sequence[float], Sequence[float]]
"""Whose, how much, and seconds."""


@dataclass(frozen=True)
class Curve:
    """What grows, what is done with it, and a line for each program or kind of work; `note` says how well."""

    what: str
    work: str
    lines: tuple[Line, ...]
    note: str = ""


def least(work: Callable[[], object], repeat: int = 2, warm: bool = True) -> float:
    """Least processor time (s), after one call to warm up where asked."""
    if warm:
        return best(work, repeat, time.process_time)
    start = time.process_time()
    work()
    return time.process_time() - start


def of_beams(folder: Path) -> Curve:
    own, lines = [meshed(folder / str(n), n) for n in (10, 20, 40, 80, 160)], []
    sizes = [len(s.structure.shafts[0].elements) for s in own]
    chains = [operating_point(s, Condition(30.0, FULL)) for s in own]
    lines.append(("here", sizes, [least(lambda p=p: modes(p.chain, p.linear, 4000.0)) for p in chains]))
    if python := os.environ.get("ROSS_PYTHON"):
        lines.append(("ROSS", *ross(python)))
    if ccx := shutil.which("ccx"):
        lines.append(("CalculiX, solid, at rest", *calculix(ccx, folder)))
    return Curve("elements along the shaft", "natural frequencies at one speed", tuple(lines))


def calculix(ccx: str, folder: Path) -> tuple[list[float], list[float]]:
    """The free shaft as a solid of bricks, four bending modes."""
    [shaft], steel = load("mk7702").structure.shafts, load("mk7702").materials["steel"]
    sizes, seconds = [], []
    for longest in (60e-3, 30e-3, 15e-3):
        text = deck(shaft.segments, steel.youngs_modulus(20.0), steel.poisson_ratio, steel.density, longest)
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        solved(ccx, folder, text)
        seconds.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
        sizes.append(float(along(shaft.segments, longest)))
    return sizes, seconds


def along(segments: Sequence[Segment], longest: float) -> int:
    """Elements of a deck from one end of the shaft to the other."""
    return sum(max(1, int(np.ceil((s.z[1] - s.z[0]) / longest - 1e-9))) for s in segments)


def ross(python: str) -> tuple[list[float], list[float]]:
    """The same shaft in rated bearings, its elements divided."""
    asked, sizes, seconds = for_ross("mk7702"), [], []
    for k in (1, 2, 4):
        finer = {key: np.repeat(asked[key], k).tolist() for key in ("outer", "bore", "lengths")}
        finer["lengths"] = [x / k for x in finer["lengths"]]
        told = asked | finer | {"bearings": [[k * node, stiffness] for node, stiffness in asked["bearings"]]}
        done = subprocess.run([python, str(Path(__file__).with_name("ross_side.py"))], input=json.dumps(told), capture_output=True, text=True, check=True)
        sizes.append(float(len(finer["lengths"])))
        seconds.append(json.loads(done.stdout[done.stdout.index('{"import_s"') :])["modes_cpu_s"] / len(asked["speeds"]))
    return sizes, seconds


def of_responses(point: OperatingPoint, folder: Path) -> Curve:
    """Modes from FRFs of one hammer with 0.1 % of noise."""
    frequency, known = np.arange(0.0, 3001.0), np.array([m.frequency for m in modes(point.chain, point.linear, 3000.0)])
    known = known[known > 400]
    full = np.zeros((7, 1, 3001), complex)
    full[..., 1:] = point.frf(frequency[1:])[:7, :1]
    sd = 1e-3 * np.sqrt(np.mean(np.abs(full) ** 2, axis=-1, keepdims=True)) * np.ones(3001)
    rng = np.random.default_rng(1)
    full += sd * (rng.standard_normal(full.shape) + 1j * rng.standard_normal(full.shape))
    ours, theirs, off, others = [], [], [], []
    many = (1, 2, 4, 7)
    for n in many:
        found = extract(frequency, full[:n], sd[:n], band=(400.0, 3000.0))
        off.append(worst(found.frequency, known))
        ours.append(least(lambda n=n: extract(frequency, full[:n], sd[:n], band=(400.0, 3000.0)), 1))
        if python := os.environ.get("EMA_PYTHON"):
            np.savez(folder / "frfs.npz", frequency=frequency, value=full[:n, 0], known=known)
            done = subprocess.run([python, str(Path(__file__).with_name("ema_side.py")), str(folder / "frfs.npz")], capture_output=True, text=True, check=True)
            told = json.loads(done.stdout.strip().splitlines()[-1])
            theirs.append(told["seconds"])
            others.append(worst(np.array(told["frequencies"]), known))
    lines: tuple[Line, ...] = (("here", many, ours), *([("sdypy-EMA", many, theirs)] if theirs else []))
    note = f"median error of frequencies, ppm\nhere {told_ppm(off)}" + (f"\nsdypy-EMA {told_ppm(others)}" if others else "")
    return Curve("responses", "modes from the FRFs of one hammer", lines, note)


def worst(found: np.ndarray, known: np.ndarray) -> float:
    """Median over the known modes of the relative distance to the nearest that was found."""
    return float(np.median([np.abs(found / f - 1).min() for f in known])) if len(found) else np.nan


def told_ppm(values: Sequence[float]) -> str:
    return " ".join(f"{1e6 * v:.3g}" for v in values)


def of_records(point: OperatingPoint) -> Curve:
    lengths, ours, own = (0.1, 0.2, 0.4), [], []
    for s in lengths:
        test = replace(point.spindle.hammer, record_length=s, hits=1, hammer_nodes=(1,))
        _, steps = sampling(test)
        data = mujoco.MjData(point.model)
        ours.append(least(lambda t=test: impact_tests([replace(point, spindle=replace(point.spindle, hammer=t))]), 1))
        own.append(least(lambda d=data, n=steps: mujoco.mj_step(point.model, d, nstep=n), 1))
    return Curve("record length, s", "one hit in the time domain", (("here", lengths, ours), ("MuJoCo's own stepping", lengths, own)))


def of_fits(spindle: Spindle) -> Curve:
    """The preload from one virtual test, by FRFs and by the toolbox of MuJoCo that simulates records with trial values."""
    lengths, ours, theirs, off, others = (0.1, 0.2, 0.4), [], [], [], []
    for s in lengths:
        own = replace(spindle, hammer=replace(spindle.hammer, record_length=s, hits=1, hammer_nodes=(1,)))
        test = bench_sysid.measured(own, "preload", 0)
        ours.append(least(lambda own=own, test=test: off.append(bench_sysid.ours(own, "preload", test).value - bench_sysid.TRUE)))
        if bench_sysid.available():
            theirs.append(least(lambda own=own, test=test: others.append(bench_sysid.toolbox(own, "preload", test).value - bench_sysid.TRUE), 1, warm=False))
    lines: tuple[Line, ...] = (("here, by FRFs", lengths, ours), *([("MuJoCo's sysid", lengths, theirs)] if theirs else []))
    note = f"errors of it, ppm\nhere {told_ppm(off[::3])}" + (f"\nsysid {told_ppm(others)}" if others else "")
    return Curve("record length, s", "the preload from one hit", lines, note)


def diagnosed(tests: int, effects: int) -> float:
    """Processor time (s) of the diagnosis of the first tests of another program's campaign, offered so many effects, the hidden one first."""
    spindle, campaign = load(SCENE), read_campaign(DATA / "foreign_bond")
    offered = [by_name("bond_softening"), *(e for e in CATALOGUE if e.name != "bond_softening" and refusal(e, spindle) is None)]
    start = time.process_time()
    diagnose(spindle, replace(campaign, tests=campaign.tests[:tests]), tuple(offered[:effects]))
    return time.process_time() - start


def of_tests(spindle: Spindle) -> Curve:
    short = replace(spindle.hammer, record_length=0.05, hits=1, hammer_nodes=(1,))
    several = [replace(operating_point(spindle, Condition(t)), spindle=replace(spindle, hammer=short)) for t in np.linspace(20, 60, 8)]
    many, campaign = (1, 2, 4, 8), (2, 4, 7)
    simulated = [least(lambda n=n: impact_tests(several[:n]), 1) for n in many]
    judged = [diagnosed(n, 2) for n in campaign]
    return Curve("tests", "hammer tests; diagnoses, 2 effects offered", (("simulated", many, simulated), ("diagnosed", campaign, judged)))


def of_effects(spindle: Spindle) -> Curve:
    own = [fitted_to(e, spindle) for e in CATALOGUE if refusal(e, spindle) is None]
    many, offered = [n for n in (1, 4, 8, 16) if n <= len(own)], (1, 2, 4, 8, 16)
    added = [resolved(replace(spindle, effects=tuple(Addition(effect=e.name, values=e.neutral()) for e in own[:n])), CATALOGUE) for n in many]
    present = [least(lambda s=s: [operating_point(s, Condition(45.0)) for _ in range(20)]) / 20 for s in added]
    judged = [diagnosed(7, n) for n in offered]
    return Curve("effects", "in a scene; offered to a diagnosis of 7 tests", (("a condition", many, present), ("diagnosis", offered, judged)))


def curves(folder: Path) -> Iterator[Curve]:
    spindle = load(SCENE)
    point, others = operating_point(spindle, Condition(40.0)), count()
    yield of_beams(folder)
    rows = list(OF_ROWS)
    yield Curve("ball rows", "a condition to its modes", (("here", rows, [least(lambda s=s: condition(s, 1000.0)) for s in map(rowed, rows)]),))
    lines = (1000, 4000, 16000, 64000)
    yield Curve("lines", "exact FRFs, 7 x 2", (("here", lines, [least(lambda n=n: point.frf(np.linspace(400, 6000 + next(others), n)), 4) for n in lines]),))
    yield of_responses(point, folder)
    yield of_records(point)
    yield of_fits(spindle)
    yield of_tests(spindle)
    yield of_effects(spindle)
    (folder / "study").mkdir()
    of, runs = small_study(folder / "study"), (5, 10, 20, 40)
    yield Curve("runs of a study", "spindles at two conditions each", (("here", runs, [least(lambda n=n: [of.rows(k) for k in range(n)], 1) for n in runs]),))


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Power with which y grows over the last two."""
    return float(np.log(y[-1] / y[-2]) / np.log(x[-1] / x[-2]))


def drawn(found: Sequence[Curve], caption: str) -> Figure:
    figure = Figure(figsize=(12, 9), layout="constrained")
    for axes, curve in zip(figure.subplots(3, 3).flat, found, strict=True):
        for name, x, y in curve.lines:
            axes.loglog(x, y, "o-", ms=4, label=f"{name}, $n^{{{slope(x, y):.1f}}}$")
        axes.set_title(curve.work, fontsize=8.5)
        axes.text(0.04, 0.04, curve.note, transform=axes.transAxes, fontsize=7.5, va="bottom")
        axes.set_xlabel(curve.what, fontsize=8.5)
        axes.set_ylabel("processor time, s", fontsize=8.5)
        ticks = sorted({round(float(n), 3) for _, x, _ in curve.lines for n in x})
        told = [n for k, n in enumerate(ticks) if k in (0, len(ticks) - 1) or (n >= 1.3 * ticks[k - 1] and 1.3 * n <= ticks[-1])]
        axes.set_xticks(told, [f"{n:g}" for n in told], fontsize=7)
        axes.tick_params(axis="y", labelsize=7)
        axes.minorticks_off()
        low, high = (f(f(y) for _, _, y in curve.lines) for f in (min, max))
        top = 6 * high * (high / low) ** 0.15
        axes.set_ylim(bottom=low / (1.3 * (top / low) ** 0.4) if curve.note else 0.5 * low, top=top)
        axes.legend(frameon=False, fontsize=7.5, loc="upper left")
        axes.grid(alpha=0.3)
    figure.supxlabel(caption, fontsize=8)
    return figure


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", type=Path)
    asked, console, found = parser.parse_args(), Console(), []
    table = Table("what grows", "work", "program", "how many", "ms of one core", "grows at the end as", show_edge=False)
    with tempfile.TemporaryDirectory() as place:
        for curve in curves(Path(place)):
            found.append(curve)
            for name, x, y in curve.lines:
                cells = (curve.what, curve.work, name, " ".join(f"{n:g}" for n in x), " ".join(f"{1e3 * s:.3g}" for s in y), f"n^{slope(x, y):.1f}")
                console.print(" | ".join(cells))
                table.add_row(*cells)
    busy = f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    console.print(table, *(c.note for c in found if c.note), busy, sep="\n")
    if asked.picture:
        drawn(found, f"Processor time of one core, not wall time: other programs ran on the machine ({busy}). Exponents: of the last two points.").savefig(asked.picture, dpi=130)


if __name__ == "__main__":
    main()
