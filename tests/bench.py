"""`make bench`: what the program costs, measured side by side on this machine; prints, asserts nothing.

Ratios are the medians of alternating runs, so that a busy machine slows both sides alike.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

from tests import bench_beams, bench_sysid
from thermospindle.model.machine import Condition, RadialLoad, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.mjcf import linearise
from thermospindle.model.rotor.modes import modes
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.hammer.pulse import draw_hits
from thermospindle.sim.hammer.test import acquire, estimate_of, impact_tests, sampling, simulate
from thermospindle.sim.operating import operating_point, stiffness_table
from thermospindle.sim.resonance.map import resonance_map
from thermospindle.sim.run import identify
from thermospindle.sim.running.run import run_spindle, running_model
from thermospindle.sim.warmup import warm_up
from thermospindle.thermal.expansion import expand

SCENE = Path(__file__).parents[1] / "scenes" / "hdd_2003"


def seconds(work: Callable[[], object], repeat: int = 5) -> float:
    """Median wall time of `repeat` calls after one to warm up."""
    work()
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return median(times)


def cold_influence(spindle: Spindle) -> float:
    """Time of the finite elements with no cache of any kind (a new process would take as long)."""
    from thermospindle.thermal import influence

    kept = os.environ.get("THERMOSPINDLE_CACHE")
    with tempfile.TemporaryDirectory() as empty:
        os.environ["THERMOSPINDLE_CACHE"] = empty
        influence.forget()
        start = time.perf_counter()
        expand(spindle, 60.0)
        took = time.perf_counter() - start
    os.environ.pop("THERMOSPINDLE_CACHE")
    if kept is not None:
        os.environ["THERMOSPINDLE_CACHE"] = kept
    return took


def time_domain(spindle: Spindle, rounds: int = 5) -> tuple[float, float]:
    """Our whole impact test (simulation, acquisition, FRFs) and MuJoCo's own stepping of the same model and steps, seconds.

    MuJoCo's own: `mj_step` in C with `nstep`, hits one after the other on one core, against ours on one core.
    """
    point = operating_point(spindle, Condition(20.0))
    test = replace(spindle.hammer, hits=1, hammer_nodes=(1,))
    every, steps = sampling(test)
    hits = [draw_hits(test, np.random.default_rng(0))]
    data = mujoco.MjData(point.model)

    def own() -> None:
        mujoco.mj_resetDataKeyframe(point.model, data, 0)
        mujoco.mj_step(point.model, data, nstep=steps)

    def ours() -> None:
        [(held, velocity)] = simulate([point.model], test, [hits], steps)
        estimate_of(test, point, acquire(test, held, velocity, every, np.random.default_rng(0)))

    pairs = [(seconds(ours, 1), seconds(own, 1)) for _ in range(rounds)]
    return median(p[0] for p in pairs), median(p[1] for p in pairs)


def running(spindle: Spindle, rounds: int = 3) -> tuple[float, float]:
    """One second of the spindle running at 7200 rpm with all imperfections of the scene, start to record, and MuJoCo's own stepping of the
    same model through as many steps without any force but the unbalance that is in it, both on one core, seconds.
    """
    point = operating_point(spindle, Condition(40.0, 7200 * np.pi / 30))
    model, steps = running_model(point), round(1 / spindle.hammer.step)
    data = mujoco.MjData(model)

    def own() -> None:
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_step(model, data, nstep=steps)

    pairs = [(seconds(lambda: run_spindle([point], 1.0, 10000.0), 1), seconds(own, 1)) for _ in range(rounds)]
    return median(p[0] for p in pairs), median(p[1] for p in pairs)


def main() -> None:
    spindle = load(SCENE)
    grid = Table("what", "time", "asked", show_edge=False)
    console = Console()

    def row(what: str, value: str, asked: str = "") -> None:
        grid.add_row(what, value, asked)

    row("thermal finite elements from scratch, both parts", f"{cold_influence(spindle):.2f} s")
    row("ring motions at a temperature, warm", f"{1e3 * seconds(lambda: expand(spindle, 47.0)):.2f} ms")
    temperatures = [20.0, 30.0, 40.0, 50.0, 60.0]
    row("stiffness table of five temperatures", f"{1e3 * seconds(lambda: stiffness_table(spindle, temperatures)):.2f} ms")
    point = operating_point(spindle, Condition(40.0))
    lines = np.arange(400.0, 3001.0)
    linear = point.linear
    row("linearisation of the MuJoCo model (M, C, K)", f"{1e3 * seconds(lambda: linearise(point.model), 20):.2f} ms")
    row("assembly of M, C, K without MuJoCo", f"{1e3 * seconds(lambda: matrices(point.chain), 20):.2f} ms")
    row("modes", f"{1e3 * seconds(lambda: modes(point.chain, linear), 20):.2f} ms")
    row("exact FRFs, 14 x 2601 lines", f"{1e3 * seconds(lambda: point.frf(lines), 20):.2f} ms")

    def condition() -> None:
        found = operating_point(spindle, Condition(40.0))
        own = matrices(found.chain)
        modes(found.chain, own)

    row("one condition: temperature to modes, warm", f"{1e3 * seconds(condition, 20):.2f} ms", "3 ms")
    test = impact_tests([point])[0]
    row("modal extraction of one test", f"{seconds(lambda: identify(test), 3):.2f} s")
    ours, own = time_domain(spindle)
    row("time domain, one hit: ours / MuJoCo's own stepping", f"{ours:.3f} / {own:.3f} s = {ours / own:.3f}", "1.15")
    ours, own = running(spindle)
    row("1 s of running spindle, waviness: ours / MuJoCo's own stepping", f"{ours:.2f} / {own:.2f} s = {ours / own:.2f}", "3")
    grid_t, grid_s, nominal = np.linspace(20, 60, 20), np.linspace(0, 1508, 40), Condition(20.0, 754.0)
    row(
        "resonance map, 20 temperatures x 40 speeds", f"{seconds(lambda: resonance_map(spindle, grid_t, grid_s, nominal), 3):.2f} s", "10 s"
    )
    row("warm-up, coupled, to the steady state", f"{seconds(lambda: warm_up(spindle, 754.0, 20.0), 1):.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        command = [sys.executable, "-m", "spindle", "run", str(SCENE), "--out", f"{folder}/run", "--json"]
        subprocess.run(command, check=True, capture_output=True)
        row("spindle run: five temperatures, two hammer points, all outputs", f"{time.perf_counter() - start:.1f} s", "20 s")
    for cells in bench_sysid.rows(spindle):
        row(*cells)
    five = load(SCENE.parent / "five_bearing")
    for what, force in (("centred", 0.0), ("under 300 N across the axis", 300.0), ("under 3000 N, where balls are let go", 3000.0)):
        loaded = replace(five, radial_loads=(RadialLoad((force, 0.0), 0.0),)) if force else five
        took = seconds(partial(operating_point, loaded, Condition(40.0, 6000 * RPM)), 20)
        row(f"operating point of five_bearing at 6000 rpm, {what}", f"{1e3 * took:.1f} ms", "20 ms")
    short = replace(five, hammer=replace(five.hammer, record_length=0.05))
    ours, own = time_domain(short)
    row("five_bearing, one hit of 0.05 s: ours / MuJoCo's own stepping", f"{ours:.2f} / {own:.2f} s = {ours / own:.2f}", "1.2")
    for element in ("linear", "reduced"):
        start = time.perf_counter()
        command = [sys.executable, "-m", "spindle", "impact", str(SCENE.parent / "five_bearing"), "--element", element, "--json"]
        subprocess.run(command, check=True, capture_output=True)
        row(f"spindle impact five_bearing --element {element}", f"{time.perf_counter() - start:.1f} s", "30 s")
    console.print(grid)
    with tempfile.TemporaryDirectory() as folder:
        bench_beams.show(console, Path(folder))


if __name__ == "__main__":
    main()
