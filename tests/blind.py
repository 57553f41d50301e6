"""`make blind`: hidden effects, made by another path than the one that fits, and a scorecard of what the diagnosis says of them.

Every campaign is measured like a real test: a spindle drawn from its tolerances, on a finer mesh, ball-by-ball bearings in MuJoCo's time
domain at another step, noise, hits, modal extraction. Results are kept in out/blind/results.jsonl, a line a campaign, so that the study can
be stopped and goes on where it was; `python -m tests.blind --none 50 --seeds 3 --sizes 0.1 0.3 1` sets its size.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from diagnosis.data import data_of
from diagnosis.explain import explain
from diagnosis.observe import observe
from diagnosis.theory import theory
from model.machine import Condition, Spindle
from model.scene import load
from model.tolerance import toleranced
from sim.campaign import Campaign, Test
from sim.effect import Effect
from sim.effects import CATALOGUE, by_name
from sim.impact import impact_tests
from sim.operating import operating_point
from tests.blind_score import outcome as score
from thermal.expansion import expand

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "out" / "blind" / "results.jsonl"
FINER = 1e-5  # relative error of the thermal expansion, a tenth of the model's that fits
STEP = 5e-6  # s, of the integration in time: another one than the scene's
CONDITIONS = [(20.0, 0.0), (40.0, 0.0), (60.0, 0.0), (20.0, 7200.0), (60.0, 7200.0)]


def shows(effect: Effect) -> bool:
    """Whether an effect is simulated in an impact test: hits land on their nodes there, and the runout of a turning spindle is not looked at."""
    hooks = (effect.spindle, effect.temperatures, effect.motions, effect.pair, effect.chain, effect.measurement)
    return effect.name != "hammer_position" and any(hooks)


def campaign(spindle: Spindle, effect: str | None, size: float, seed: int) -> Campaign:
    """A campaign with a hidden effect of `size` times its typical one (none if `effect` is None)."""
    random = np.random.default_rng([seed, 17])
    built = spindle
    for parameter in toleranced(spindle):
        built = parameter.apply(built, parameter.sd * random.standard_normal())
    built = replace(built, hammer=replace(built.hammer, step=STEP))
    hidden = []
    if effect is not None:
        found = by_name(effect)
        main = found.parameters[0]
        value = float(np.clip(main.neutral + size * (main.typical - main.neutral), *main.limits))
        hidden = [(found, found.typical() | {main.name: value})]
    gain = 1 + spindle.tolerances.gain * random.standard_normal(len(spindle.points))
    tests = []
    for k, (temperature, rpm) in enumerate(CONDITIONS):
        warmer = spindle.tolerances.temperature * random.standard_normal()
        condition = Condition(temperature + warmer, rpm * np.pi / 30, spindle.hammer.level)
        prescribed = any(e.temperatures for e, _ in hidden)  # such effects take the mesh of every day
        finer = None if prescribed else lambda s, warm=condition.temperature: expand(s, warm, FINER)
        point = operating_point(built, condition, hidden, finer)
        frf = impact_tests([point], element="ball-by-ball", seed=1000 * seed + k)[0].estimate.h1
        frf = replace(frf, value=frf.value * gain[:, None, None], sd=frf.sd * gain[:, None, None])
        tests.append(Test(f"T{temperature:g}_n{rpm:g}", temperature, rpm * np.pi / 30, spindle.hammer.level, frf=frf))
    return Campaign(f"blind {seed}", spindle.name, "mobility", spindle.points, tuple(tests))


def judge(spindle: Spindle, effect: str | None, size: float, seed: int) -> dict:
    start = time.perf_counter()
    about = theory(spindle, data_of(observe(campaign(spindle, effect, size, seed), spindle)))
    found = explain(about, CATALOGUE, os.cpu_count() or 1)
    best = found.best
    main = by_name(effect).parameters[0] if effect else None
    smallest = next((s.smallest for s in found.signatures if s.effect.name == effect), None)
    return {
        "effect": effect,
        "size": size,
        "seed": seed,
        "verdict": found.verdict,
        "effects": list(found.effects),
        "probability": best.probability if best else None,
        "over_smallest": size * abs(main.typical - main.neutral) / smallest if main and smallest else None,
        "held_out": [found.held_out_before, found.held_out_after],
        "seconds": time.perf_counter() - start,
    }


def outcome(row: dict) -> str:
    """As `tests.blind_score` has it: one effect too many is wrong here too."""
    hidden = [row["effect"]] if row["effect"] else []
    return score({"variants": hidden, "truth": [hidden] if hidden else [], "verdict": row["verdict"], "effects": row["effects"]})


def show(console: Console, rows: list[dict]) -> None:
    kinds = ("right", "identified", "in the set", "wrong", "missed", "false alarm")
    grid = Table("hidden effect", "size", *kinds)
    for key in sorted({(r["effect"] or "none", r["size"]) for r in rows}):
        count = Counter(outcome(r) for r in rows if (r["effect"] or "none", r["size"]) == key)
        grid.add_row(key[0], f"{key[1]:g}", *(str(count[k] or "") for k in kinds))
    console.print(grid)
    visible = [r for r in rows if r["effect"] and (r["over_smallest"] or 0) >= 2]
    alarms = [r for r in rows if r["effect"] is None]
    if alarms:
        console.print(f"false alarms: {sum(outcome(r) == 'false alarm' for r in alarms)} of {len(alarms)} campaigns with nothing hidden")
    if visible:
        named = sum(outcome(r) in ("identified", "in the set") for r in visible)
        console.print(f"truth in the verdict at twice the smallest detectable size or more: {named} of {len(visible)}")
        wrong = sum(outcome(r) == "wrong" for r in visible)
        console.print(f"wrong identifications: {wrong} of {len(visible)}")
    table = Table("stated probability", "campaigns", "came true")
    for low, high in ((0, 0.5), (0.5, 0.9), (0.9, 0.99), (0.99, 1.01)):
        said = [
            r for r in rows if r["effect"] and r["probability"] is not None and low <= r["probability"] < high and r["verdict"] != "none"
        ]
        if said:
            true = sum(r["effect"] in r["effects"] for r in said)
            table.add_row(f"{low:g} to {min(high, 1):g}", str(len(said)), f"{true / len(said):.2f}")
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--none", type=int, default=50)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--sizes", type=float, nargs="+", default=[0.1, 1.0])
    parser.add_argument("--effects", nargs="+", default=[e.name for e in CATALOGUE if shows(e)])
    options = parser.parse_args()
    spindle = load(ROOT / "scenes" / "hdd_2003")
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.exists() else []
    done = {(r["effect"], r["size"], r["seed"]) for r in rows}
    wanted: list[tuple[str | None, float, int]] = [(None, 0.0, seed) for seed in range(options.none)]
    wanted += [(e, size, 100 + seed) for seed in range(options.seeds) for size in options.sizes for e in options.effects]
    console = Console(stderr=True)
    for effect, size, seed in wanted:
        if (effect, size, seed) in done:
            continue
        row = judge(spindle, effect, size, seed)
        rows.append(row)
        with RESULTS.open("a") as file:
            file.write(json.dumps(row) + "\n")
        console.print(
            f"{effect or 'nothing'} x {size:g}, seed {seed}: {row['verdict']} {' '.join(row['effects'])} ({row['seconds']:.0f} s)"
        )
    show(Console(), rows)


if __name__ == "__main__":
    main()
