"""Hidden effects simulated by somebody else (`tests.variants`), and a scorecard of what the diagnosis says of them.

`tests.blind` asks whether the diagnosis survives another path of measuring; this asks whether it survives another engineer's physics, and
effects that are in no catalogue. Campaigns are like measured ones: build tolerances, temperatures 0.2 K off, channel gains 1 % off, noise on
every line of exact linear FRFs from 400 to 3000 Hz, no standard errors told. Each is made and diagnosed in a process of its own, and kept as a
line of out/blind/variants.jsonl, so that the study can be stopped and goes on where it was:

    python -m tests.blind_variants [--effects soak_lag outside/cable ..] [--none N] [--pairs N] [--seeds K] [--sizes 0 1] [--workers W]

`--score` prints the table of what is there; `--shifts` what every variant does to the modes, without any diagnosis.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
import traceback
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Column, Table
from scipy.optimize import brentq, linear_sum_assignment

from diagnosis.data import data_of
from diagnosis.decide import Candidate
from diagnosis.explain import explain
from diagnosis.fit import fit, linearise
from diagnosis.observe import observe
from diagnosis.screening import CLEAR
from diagnosis.theory import theory
from model.machine import Condition, Spindle
from model.modes import oscillating, poles
from model.pair import NoEquilibrium
from model.rotor_base import matrices
from model.scene import load
from model.tolerance import toleranced
from sim.campaign import Campaign, Test
from sim.effects import CATALOGUE
from sim.frf import Frf
from sim.operating import operating_point
from tests.blind_score import outcome, show
from tests.variants import PLAN, VARIANTS, Variant, by_name

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "scenes" / "hdd_2003"
RESULTS = ROOT / "out" / "blind" / "variants.jsonl"
FREQUENCY = np.arange(400.0, 3001.0)
RPM = np.pi / 30


def campaign(spindle: Spindle, hidden: Sequence[tuple[Variant, float]], seed: int) -> Campaign:
    """A campaign with hidden variants of the given sizes (their units); the seed draws tolerances, noise, and tests left out in a third."""
    random = np.random.default_rng([seed, 29])
    built = spindle
    for parameter in toleranced(spindle):
        built = parameter.apply(built, parameter.sd * random.standard_normal())
    effects = [(v.effect, {"size": size}) for v, size in hidden]
    gain = 1 + spindle.tolerances.gain * random.standard_normal(len(spindle.points))
    plan = next((v.plan for v, _ in hidden if v.plan is not PLAN), PLAN)
    dropped = left_out(seed, len(plan))
    tests = []
    for k, (temperature, rpm, level, soak) in enumerate(plan):
        if k in dropped:
            continue
        true = temperature + spindle.tolerances.temperature * random.standard_normal()
        condition = Condition(true, rpm * RPM, level or 0.0, np.inf if soak is None else soak)
        value = operating_point(built, condition, effects).frf(FREQUENCY)
        for v, size in hidden:
            if v.record is not None:
                value = v.record(size, true, FREQUENCY, value)
        measured = noisy(value, spindle, random) * gain[:, None, None]
        frf = Frf(FREQUENCY, measured, tuple(p.node for p in spindle.points), spindle.hammer.hammer_nodes, "mobility")
        tests.append(Test(f"T{temperature:g}_n{rpm:g}_{k}", temperature, rpm * RPM, level, soak, frf=frf))
    return Campaign(f"variant {seed}", spindle.name, "mobility", spindle.points, tuple(tests))


def left_out(seed: int, tests: int) -> set[int]:
    """Which tests of a plan were not made: one to three of them in a third of the campaigns."""
    random = np.random.default_rng([seed, 41])
    return set(random.choice(tests, random.integers(1, 4), replace=False).tolist()) if random.random() < 1 / 3 else set()


def noisy(value: np.ndarray, spindle: Spindle, random: np.random.Generator) -> np.ndarray:
    """Two independent complex errors on every line: relative to the value, and to the largest answer to that hammer; E |error|^2 = sd^2."""
    own, common = (random.standard_normal((2, *value.shape)) / np.sqrt(2) for _ in range(2))
    largest = np.abs(value).max(axis=(0, 2), keepdims=True)
    of_value = spindle.hammer.noise_of_value * np.abs(value) * (own[0] + 1j * own[1])
    return value + of_value + spindle.hammer.noise_of_largest * largest * (common[0] + 1j * common[1])


@dataclass(frozen=True)
class Job:
    """One campaign: variants by name, their shares between just visible (0) and large (1), and the seed."""

    variants: tuple[str, ...]
    shares: tuple[float, ...]
    seed: int

    @property
    def key(self) -> str:
        return json.dumps([self.variants, self.shares, self.seed])


def judge(job: Job) -> dict[str, Any]:
    """Make and diagnose one campaign."""
    start = time.perf_counter()
    spindle = load(SCENE)
    variants = [by_name(name) for name in job.variants]
    sizes = [v.size(share) for v, share in zip(variants, job.shares, strict=True)]
    made = campaign(spindle, list(zip(variants, sizes, strict=True)), job.seed)
    about = theory(spindle, data_of(observe(made, spindle)))
    found = explain(about, CATALOGUE, 1)
    best, n = found.best, len(about.data.value)
    told = smallest(spindle, variants, sizes, job.seed)
    return {
        **asdict(job),
        "truth": [list(v.truth) for v in variants],
        "size": sizes,
        # None where only the instruments' record shows the variant; as many sizes as these data could just have shown
        "over_smallest": [None if v.record else size / told.get(v.name, np.inf) for v, size in zip(variants, sizes, strict=True)],
        "tests": [t.id for t in made.tests],
        "verdict": found.verdict,
        "effects": list(found.effects),
        "reason": found.reason,
        "candidates": [_candidate(c) for c in found.candidates[:5]],
        "rms_pull": [float(np.sqrt(m / n)) for m in (found.base.misfit, best.fit.misfit if best else found.base.misfit)],
        "held_out": [found.held_out_before, found.held_out_after],
        "numbers": n,
        "seconds": time.perf_counter() - start,
    }


def smallest(spindle: Spindle, variants: Sequence[Variant], sizes: Sequence[float], seed: int) -> dict[str, float]:
    """The size of every variant that the same tests of the same spindle could just have shown, had nothing been hidden.

    There the best that tolerances can do about it is `CLEAR` in ln evidence worse than the truth, with no noise at all; looked for up to
    what its author calls large, or `sizes`.
    """
    if not variants:
        return {}
    about = theory(spindle, data_of(observe(campaign(spindle, [(v, 0.0) for v in variants], seed), spindle)))
    drawn, slopes = np.zeros(len(about.sd)), linearise(about)

    def excess(log_size: float, v: Variant) -> float:
        try:
            seen = about.features(drawn, [(v.effect, {"size": float(np.exp(log_size))})])
        except NoEquilibrium:
            return 10.0  # plain to see
        left = fit(replace(about, data=replace(about.data, value=seen)), slopes).chi2
        return float(np.log(max(left, 1e-9) / (2 * CLEAR)))

    found = {}
    for v, size in zip(variants, sizes, strict=True):
        low, high = np.log(v.visible / 100), np.log(max(v.large, size))
        hidden, shown = excess(high, v) < 0, excess(low, v) > 0
        found[v.name] = np.inf if hidden else v.visible / 100 if shown else float(np.exp(brentq(excess, low, high, (v,), xtol=0.1)))
    return found


def _candidate(c: Candidate) -> dict[str, Any]:
    return {
        "effects": list(c.effects),
        "delta_evidence": c.delta_evidence,
        "probability": c.probability,
        "held_out_ratio": c.held_out_ratio,
        "believable": c.believable,
        "values": c.fit.values,
    }


# ---------------------------------------------------------------- what variants do, without a diagnosis


def shifts(console: Console, spindle: Spindle, wanted: Sequence[Variant]) -> None:
    """Largest change of frequency, damping (percent) and FRF (share of its norm) by every variant, just visible and large."""
    grid = Table(Column("variant", no_wrap=True), "size", "unit", "frequency %", "damping %", "FRF %")
    lines = FREQUENCY[::10]
    for v in wanted:
        for size in (0.0, v.visible, v.large):
            largest = np.zeros(3)
            for temperature, rpm, level, soak in v.plan:
                condition = Condition(temperature, rpm * RPM, level or 0.0, np.inf if soak is None else soak)
                seen = []
                for applied in ([], [(v.effect, {"size": size})]):
                    point = operating_point(spindle, condition, applied)
                    found = poles(matrices(point.chain))
                    value = found.value[oscillating(found, 3000.0)]
                    frf = point.frf(lines)
                    if applied and v.record is not None:
                        frf = v.record(size, temperature, lines, frf)
                    seen.append((value, frf, point.measurement.decay))
                (a, frf_a, _), (b, frf_b, decay) = seen
                b = b[linear_sum_assignment(np.abs(a[:, None] - b))[1]] - decay
                zeta = [-p.real / np.abs(p) for p in (a, b)]
                change = [np.abs(b.imag / a.imag - 1).max(), np.abs(zeta[1] / zeta[0] - 1).max()]
                largest = np.maximum(largest, 100 * np.array([*change, np.linalg.norm(frf_b - frf_a) / np.linalg.norm(frf_a)]))
            if size == 0.0:
                if largest.max() > 1e-6:
                    raise ValueError(f"variant {v.name} changes something at size 0: {largest}")
            else:
                grid.add_row(v.name, f"{size:g}", v.effect.parameters[0].unit, *(f"{x:.3f}" for x in largest))
    console.print(grid)


# ---------------------------------------------------------------- the study


def jobs(options: argparse.Namespace, wanted: Sequence[Variant]) -> list[Job]:
    """Sizes not told are drawn by the seed, evenly between just visible and large."""
    found = [Job((), (), options.first + k) for k in range(options.none)]
    for k in range(options.first, options.first + options.seeds):
        for i, v in enumerate(VARIANTS):
            seed = 1000 * (k + 1) + i
            drawn = [round(float(np.random.default_rng([seed, 31]).random()), 3)]
            found += [Job((v.name,), (s,), seed) for s in options.sizes or drawn if v in wanted]
    named = [v for v in wanted if v.truth]
    for k in range(options.first, options.first + options.pairs):
        random = np.random.default_rng([k, 37])
        one, two = (named[i] for i in random.choice(len(named), 2, replace=False))
        if set(one.truth).isdisjoint(two.truth) and (one.plan is PLAN or two.plan is PLAN):
            found.append(Job((one.name, two.name), tuple(round(float(s), 3) for s in random.uniform(0.4, 1.0, 2)), 900_000 + k))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--effects", nargs="+", default=[], help="names of effects or variants, or outside; all by default")
    parser.add_argument("--none", type=int, default=6, help="campaigns with nothing hidden")
    parser.add_argument("--pairs", type=int, default=0, help="campaigns with two variants (some draws are left out)")
    parser.add_argument("--seeds", type=int, default=1, help="campaigns of every variant")
    parser.add_argument("--first", type=int, default=0, help="seed of the first campaign of each kind: another one, another study")
    parser.add_argument("--sizes", type=float, nargs="+", default=[], help="0 just visible to 1 large; drawn by default")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--limit", type=int, default=10**9, help="stop after so many new campaigns")
    parser.add_argument("--score", action="store_true")
    parser.add_argument("--shifts", action="store_true")
    options = parser.parse_args()
    console = Console(stderr=True)
    unknown = [e for e in options.effects if not any(e in (v.name, v.name.split("/")[0]) for v in VARIANTS)]
    if unknown:
        parser.error(f"--effects {' '.join(unknown)}: no such effect or variant")
    wanted = [v for v in VARIANTS if not options.effects or {v.name, v.name.split("/")[0]} & set(options.effects)]
    if options.shifts:
        shifts(Console(), load(SCENE), wanted)
        return 0
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.exists() else []
    done = {Job(tuple(r["variants"]), tuple(r["shares"]), r["seed"]).key for r in rows}
    open_jobs = [] if options.score else [j for j in jobs(options, wanted) if j.key not in done][: options.limit]
    failed = 0
    with ProcessPoolExecutor(options.workers, get_context("spawn"), max_tasks_per_child=1) as pool:
        running = {pool.submit(judge, job): job for job in open_jobs}
        try:
            for future in as_completed(running):
                try:
                    row = future.result()
                except Exception:
                    failed += 1
                    console.print(f"{running[future]}: failed\n{traceback.format_exc()}", markup=False)
                    continue
                rows.append(row)
                with RESULTS.open("a") as file:
                    file.write(json.dumps(row) + "\n")
                hidden = " + ".join(f"{v} {s:.3g}" for v, s in zip(row["variants"], row["size"], strict=True)) or "nothing"
                console.print(
                    f"{hidden}: {outcome(row)} ({row['verdict']} {' '.join(row['effects'])}; {row['seconds']:.0f} s)", highlight=False
                )
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)  # campaigns under way come to their end, but are not kept
            return 130
    if rows:
        show(Console(width=200), rows)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
