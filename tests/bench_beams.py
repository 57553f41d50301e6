"""`make bench`, flexible shafts: cost over elements and rows, and the same rotors beside ROSS where
`ROSS_PYTHON` names a Python that has it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from tests.virtual_campaign import model_of, virtual_campaign
from thermospindle.diagnosis.forward.rates import rates_of
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase, matrices, motion_rows
from thermospindle.model.rotor.frf import frf
from thermospindle.model.rotor.modes import modes
from thermospindle.model.rotor.static import rated_chain
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

SCENES = Path(__file__).parents[1] / "scenes"
ELEMENTS = (10, 20, 40, 80)
FULL = 12000 * RPM
FREQUENCIES = (100.0, 400.0, 900.0, 1300.0, 2000.0)


def best(work: Callable[[], object], repeat: int = 5, clock: Callable[[], float] = time.perf_counter) -> float:
    """Least time (s) by a clock of so many calls after one to warm up: what the machine can do, whoever else is on it."""
    work()
    found = []
    for _ in range(repeat):
        start = clock()
        work()
        found.append(clock() - start)
    return min(found)


def meshed(folder: Path, elements: int) -> Spindle:
    """mk7702 with about so many beam elements."""
    text = (SCENES / "mk7702" / "spindle.toml").read_text(encoding="utf-8")
    for longest in np.geomspace(400.0, 4.0, 60):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "spindle.toml").write_text(text.replace("longest_element_mm = 20.0", f"longest_element_mm = {longest:.3f}"), encoding="utf-8")
        spindle = load(folder)
        if len(spindle.structure.shafts[0].elements) >= elements:
            return spindle
    raise ValueError(f"no mesh of {elements} elements")


OF_ROWS = {2: ("rear1", "rear2"), 3: ("front1", "front2", "front3"), 4: ("front2", "front3", "rear1", "rear2"), 5: None, 6: None}


def rowed(rows: int) -> Spindle:
    """five_bearing with some of its rows, or with a sixth beside the first in the same ring."""
    spindle = load(SCENES / "five_bearing")
    kept = OF_ROWS[rows] or tuple(b.name for b in spindle.bearings)
    made = [b for b in spindle.bearings if b.name in kept]
    sets = [replace(s, bearings=tuple(n for n in s.bearings if n in kept)) for s in spindle.sets if any(n in kept for n in s.bearings)]
    if rows == 6:
        first = made[0]
        made = [replace(first, z=first.z - 0.005), replace(first, name="front0", z=first.z + 0.005), *made[1:]]
        sets[0] = replace(sets[0], bearings=("front0", *sets[0].bearings))
    return replace(spindle, bearings=tuple(made), sets=tuple(sets))


def condition(spindle: Spindle, speed: float) -> None:
    chain = operating_point(spindle, Condition(30.0, speed)).chain
    modes(chain, matrices(chain), highest=spindle.hammer.band[1])


def over_elements(table: Table, folder: Path) -> None:
    import mujoco

    for count in ELEMENTS:
        spindle = meshed(folder / str(count), count)
        point = operating_point(spindle, Condition(30.0, FULL))
        data = mujoco.MjData(point.model)
        mujoco.mj_resetDataKeyframe(point.model, data, 0)
        stepping = best(lambda data=data, model=point.model: mujoco.mj_step(model, data, nstep=200), 3) / 200
        table.add_row(
            f"{len(spindle.structure.shafts[0].elements)} elements, 4 bearings given by numbers",
            str(len(point.chain.dofs)),
            f"{1e3 * best(lambda s=spindle: condition(s, 0.0)):.1f} / {1e3 * best(lambda s=spindle: condition(s, FULL)):.1f}",
            f"{1e3 * best(lambda p=point: modes(p.chain, p.linear), 3):.0f}",
            f"{1e6 * stepping:.0f} ({1e6 * spindle.hammer.step:.2f})",
            diagnosis_setup(spindle),
        )


def over_rows(table: Table) -> None:
    for count in OF_ROWS:
        spindle = rowed(count)
        point = operating_point(spindle, Condition(30.0, FULL))
        table.add_row(
            f"{len(spindle.structure.shafts[0].elements)} elements, {count} ball rows",
            str(len(point.chain.dofs)),
            f"{1e3 * best(lambda s=spindle: condition(s, 0.0)):.1f} / {1e3 * best(lambda s=spindle: condition(s, FULL)):.1f}",
            f"{1e3 * best(lambda p=point: modes(p.chain, p.linear), 3):.0f}",
            "",
            diagnosis_setup(spindle),
        )


def diagnosis_setup(spindle: Spindle) -> str:
    """ms a test: residuals, and their derivatives by all nuisance parameters."""
    band = spindle.hammer.band
    campaign = virtual_campaign(spindle, [Condition(20.0), Condition(40.0, FULL / 2)], 1, frequency=np.arange(band[0], band[1], 4.0))
    model = model_of(spindle, campaign)
    problem, place = Problem(model, ()), [0.0]
    rates = rates_of(model, np.zeros(problem.length), [[], []])

    def residuals() -> None:
        place[0] += 1e-6
        problem.residuals(np.full(problem.length, place[0]))

    def derivatives() -> None:
        place[0] += 1e-6
        problem.linearisation(np.full(problem.length, place[0]), rates)

    return f"{500 * best(residuals, 3):.0f} / {500 * best(derivatives, 2):.0f}"


# ---------------------------------------------------------------- ROSS


def rated(name: str, speed: float) -> tuple[Spindle, RotorBase]:
    """A scene's shaft, without damping, in its rated bearings to rigid ground."""
    spindle = load(SCENES / name)
    chain = rated_chain(spindle, operating_point(spindle, Condition(spindle.reference_temperature, 0.0)).chain)
    kept = [e for e in chain.elements if e.b != "housing" and e.a != "housing"]
    bodies = tuple(b for b in chain.bodies if b.name != "housing")
    return spindle, replace(chain, bodies=bodies, elements=tuple(replace(e, damping=0 * e.damping) for e in kept), speed=speed)


def for_ross(name: str) -> dict:
    """The same rotor in plain elements between its nodes and the steps of its section."""
    spindle, chain = rated(name, 0.0)
    shaft = spindle.structure.shafts[0]
    material = spindle.materials[shaft.segments[0].material]
    edges = sorted({round(z, 9) for z in (*shaft.nodes, *(z for s in shaft.segments for z in s.z))})
    middles = [(a + b) / 2 for a, b in pairwise(edges)]
    own = [next(s for s in shaft.segments if s.z[0] <= m <= s.z[1]) for m in middles]
    springs = [(e.z, float(e.stiffness[0, 0])) for e in chain.elements if e.b == "ground" or e.a == "ground"]
    return {
        "lengths": [b - a for a, b in pairwise(edges)],
        "outer": [2 * s.outer[0] for s in own],
        "bore": [2 * s.bore[0] for s in own],
        "youngs_modulus": material.youngs_modulus(spindle.reference_temperature),
        "poisson": material.poisson_ratio,
        "density": material.density,
        "bearings": [[int(np.argmin(np.abs(np.array(edges) - z))), k] for z, k in springs],
        "speeds": [0.0, FULL / 2, FULL],
        "frequencies": FREQUENCIES,
    }


OURS = """
import time; start = time.perf_counter()
from tests.bench_beams import FULL, modes, rated
imported = time.perf_counter()
for speed in (0.0, FULL / 2, FULL):
    modes(rated({name!r}, speed)[1], highest=4000.0)
print(imported - start, time.perf_counter() - imported)
"""


def beside_ross(table: Table, python: str) -> None:
    for name in ("mk7702", "five_bearing"):
        asked = for_ross(name)
        start = time.perf_counter()
        answer = subprocess.run([python, str(Path(__file__).with_name("ross_side.py"))], input=json.dumps(asked), capture_output=True, text=True, check=True)
        theirs = time.perf_counter() - start
        told = json.loads(answer.stdout[answer.stdout.index('{"import_s"') :])
        start = time.perf_counter()
        own = subprocess.run([sys.executable, "-c", OURS.format(name=name)], capture_output=True, text=True, check=True)
        ours = time.perf_counter() - start
        _, apart = (float(v) for v in own.stdout.split())
        worst, worst_frf, compared = 0.0, 0.0, 0
        for i, speed in enumerate(asked["speeds"]):
            chain = rated(name, speed)[1]
            lateral = [m.frequency for m in modes(chain, highest=3300.0) if m.kind != "axial"]
            known = np.array(told["modes"][i])
            worst = max(worst, *(float(np.abs(known / f - 1).min()) for f in lateral))
            compared += len(lateral)
            row = motion_rows(chain, chain.bodies[0].name, (0.0, 0.0, 0.0))[:1]
            value = frf(matrices(chain), row, row, np.array(FREQUENCIES))[0, 0]
            other = np.array(told["frf"][i][0]) + 1j * np.array(told["frf"][i][1])
            worst_frf = max(worst_frf, float(np.abs(value / other - 1).max()))
        table.add_row(
            f"{name}: modes at 0, 6000 and 12,000 rpm",
            f"{ours:.2f} / {theirs:.2f} s = 1 / {theirs / ours:.1f}",
            f"{apart:.3f} / {told['build_s'] + told['modes_s']:.3f} s = 1 / {(told['build_s'] + told['modes_s']) / apart:.1f}",
            f"{worst:.1e} of {compared}",
            f"{worst_frf:.1e}",
            told["version"],
        )


def show(console: Console, folder: Path) -> None:
    table = Table(
        "flexible shaft", "degrees of\nfreedom", "a condition to its modes\nat rest / 12,000 rpm, ms", "all modes\nms", "a step (its length)\nus",
        "a test of a diagnosis, ms:\nresiduals / derivatives", show_edge=False,
    )  # fmt: skip
    over_elements(table, folder)
    over_rows(table)
    console.print(table)
    python = os.environ.get("ROSS_PYTHON")
    if python is None:
        console.print("Beside ROSS: not run; set ROSS_PYTHON to a Python that has it (pip install ross-rotordynamics 'plotly<6.1', in an environment of its own).")
        return
    beside = Table("the same rotor", "import included: ours / ROSS", "apart", "frequencies\ndiffer by", "FRF at the\nnose by", "ROSS", show_edge=False)
    beside_ross(beside, python)
    console.print(beside)
