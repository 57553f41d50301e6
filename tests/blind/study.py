"""`python -m tests.blind.study --seeds A B [--out FILE.jsonl] [--cluster ADDRESS]`: campaigns A to
B - 1, made and diagnosed, a line of JSON each.

A seed is a campaign, wherever and whenever it is run: scene, tests, world, hidden physics and noise follow from it. Seeds that are in the
file already are passed over, so that the study can be stopped and goes on where it was. On a Dask cluster a campaign is a task: its
workers are started in this repository (`PYTHONPATH=. dask worker ...`), at the same commit; rows come in the order in which they are done.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import subprocess
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tests.blind.alike import right
from tests.blind.campaigns import Made, campaign, described, plans
from tests.blind.hidden import Hidden, Mechanism
from tests.blind.mechanisms import mechanisms
from tests.blind.visible import seen, visibility, visibility_beside
from tests.blind.world import Plan, World
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.explanations import ASTRAY, coarsening, likeliest
from thermospindle.diagnosis.draft.draft import draft
from thermospindle.diagnosis.inference.evidence import evidence, left_out
from thermospindle.diagnosis.inference.fit import TEMPERS, fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.inference.prior import steady, wider_tolerances
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.inference.remainder import overlap
from thermospindle.diagnosis.inference.search import search
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.verdict import Diagnosis, campaign_data, diagnose
from thermospindle.model.machine import Spindle
from thermospindle.model.scene.reading import load
from thermospindle.report.text.diagnosis.answer import diagnosis_json
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.effects import CATALOGUE, usable
from thermospindle.sim.effects.own import effect_of
from thermospindle.sim.study.executors import on_cluster
from thermospindle.sim.study.parts import versions

ROOT = Path(__file__).parents[2]
SCENES = ("scenes/hdd_2003", "tests/scenes/symmetric", "tests/scenes/inner_turning_spring")
FURTHER, FURTHER_FROM, FURTHER_SHARE = "scenes/five_bearing", 1000, 0.25
"""A machine-tool spindle: a flexible shaft on five bearings in two sets, one campaign in four from
this seed on; seeds before it were judged without."""
RESULTS = ROOT / "out" / "blind" / "results.jsonl"
KINDS = ("nothing", "one", "two", "outside")
SHARES = (1 / 3, 1 - 1 / 3 - 2 / 5, 1 / 5, 1 / 5)


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a seed stands for."""

    seed: int
    kind: str
    scene: str
    spindle: Spindle
    tests: tuple[Plan, ...]
    hidden: tuple[Hidden, ...]

    def made(self, without: Sequence[str] = ()) -> Made:
        """The campaign, or one that is the same but for differences of the world left out (fields of `World`)."""
        made = campaign(self.spindle, self.tests, self.hidden, self.seed)
        if not without:
            return made
        plain = {name: getattr(World(), name) for name in without}
        return campaign(self.spindle, self.tests, self.hidden, self.seed, replace(made.world, **plain), made.record)


def draw(seed: int) -> Drawn:
    random = np.random.default_rng([seed, 67])
    kind, scene = str(random.choice(KINDS, p=SHARES)), str(random.choice(SCENES))
    if seed >= FURTHER_FROM and np.random.default_rng([seed, 71]).random() < FURTHER_SHARE:
        scene = FURTHER
    spindle = load(ROOT / scene)
    tests = plans(random, spindle)
    every = mechanisms(spindle, [e.name for e in usable(spindle, CATALOGUE)])
    named, unnamed = [m for m in every if m.names], [m for m in every if not m.names]
    chosen: list[Mechanism] = []
    if kind == "outside":
        chosen = [unnamed[random.integers(len(unnamed))]]
    elif kind != "nothing":
        chosen = [named[random.integers(len(named))]]
        while len(chosen) < (2 if kind == "two" else 1):
            other = named[random.integers(len(named))]
            if set(other.names).isdisjoint(chosen[0].names):
                chosen.append(other)
    places = [p.place(spindle) for p in tests]
    return Drawn(seed, kind, scene, spindle, tests, tuple(m.drawn(random, places) for m in chosen))


def judge(seed: int, without: Sequence[str] = ()) -> dict[str, Any]:
    """Make and diagnose one campaign; an exception of the diagnosis is an outcome too, the verdict `error`."""
    drawn = draw(seed)
    made = drawn.made(without)
    row: dict[str, Any] = {
        "seed": seed,
        "without": list(without),
        "kind": drawn.kind,
        "scene": drawn.scene,
        "tests": [[p.temperature, round(p.speed * 30 / np.pi)] for p in drawn.tests],
        "hidden": [h.mechanism for h in made.hidden],
        "sizes": [h.size for h in made.hidden],
        "units": [h.unit for h in made.hidden],
        "laws": [h.law.kind for h in made.hidden],
        "amounts": [[h.amount(p.place(drawn.spindle)) for p in drawn.tests] for h in made.hidden],
        "truth": [list(h.names) for h in made.hidden],
        "elements": [h.element for h in made.hidden],
    }
    of = seen(made, drawn.spindle) if made.hidden else None
    row |= described(made, drawn.spindle) | {"visibility": visibility(made, drawn.spindle, of) if of else []}
    row |= {"visibility_beside": visibility_beside(made, drawn.spindle, of) if of and len(made.hidden) > 1 else []}
    row |= {"right": right(made, drawn.spindle, of) if of else []}
    start = time.perf_counter()
    try:
        found = diagnose(drawn.spindle, made.campaign)
        told = diagnosis_json(found)
    except Exception as error:
        row |= {"verdict": "error", "effects": [], "error": f"{type(error).__name__}: {error}", "trace": traceback.format_exc()[-800:]}
        return row | {"probability": {"none": 0.0, "unknown": 0.0}, "candidates": [], "drifts": [], "seconds": time.perf_counter() - start}
    seconds = time.perf_counter() - start
    return row | {
        "verdict": told["verdict"],
        "effects": told["effects"],
        "reason": told["reason"],
        "probability": told["probability"],
        "candidates": [{k: c[k] for k in ("effects", "probability", "delta_evidence", "chi2_per_number")} for c in told["candidates"]],
        "drifts": [[p["element"], p["delta_evidence"]] for p in told["where"]],
        "weighed": weighed(found),
        "rms": [told["error"]["before"], told["error"]["after"]],
        "held_out": [told["error"][f"held_out_{which}"] for which in ("before", "after", "gain")],
        "learned": told["learned"],
        "noise": sorted(set(told["noise"].values())),
        "seconds": seconds,
        "drafted": drafted(found, told, without_hidden(drawn, made)) if told["verdict"] == "unexplained" and told["where"] else None,
    }


def weighed(found: Diagnosis) -> dict[str, Any]:
    """What a verdict is made of, for whoever asks what another weighing would have said: of every explanation
    its names, how many of them are free, ln evidence over the model without effects, the largest departure from
    a law and the names whose law is the data's own; the inflation of the evidence, whether it is coarsened, and how often it is said to be led astray."""
    search, base = found.search, found.search.base.evidence.ln
    best = likeliest(search)
    same = overlap(search.model, best.fit)
    return {
        "explanations": [
            [
                list(h.names),
                sum(m.free for m in h.mechanisms),
                round(h.evidence.ln - base, 2),
                max(h.evidence.learned.departures, default=0.0),
                [m.name for m in h.mechanisms if m.own_law],
            ]
            for h in search.hypotheses
        ],
        "inflation": same.inflation,
        "coarse": coarsening(best, same),
        "astray": ASTRAY,
        "screened": [
            len({s.mechanism.name for s in search.screened if s.mechanism.free == free and s.visibility > 0}) for free in (False, True)
        ],
    }


def without_hidden(drawn: Drawn, made: Made) -> Campaign:
    """The same tests of the same machine with the same errors and noise, and nothing hidden."""
    return campaign(drawn.spindle, drawn.tests, (), drawn.seed, made.world, made.record).campaign


def drafted(found: Diagnosis, told: dict[str, Any], plain: Campaign) -> list[float]:
    """Root mean square error, in standard errors, of conditions predicted from all others: without effects; with
    the effect of one's own that `spindle draft` writes of the first drift; and of the `plain` campaign without
    effects, of which thermometers, channels and hits that differ from test to test leave more than noise."""
    with TemporaryDirectory() as folder:
        answer, file = Path(folder) / "diagnosis.json", Path(folder) / "drafted.py"
        answer.write_text(json.dumps(told), encoding="utf-8")
        file.write_text(draft(answer, "drafted").text, encoding="utf-8")
        mechanisms = variants(effect_of(file))
    model, base, groups = found.search.model, found.search.base, conditions_of(found.search.model.spindle, found.search.model.tests)
    fits = []
    for m in mechanisms:
        prior = steady(base.evidence.learned, (m,))
        problem = Problem(model, (m,))
        starts = [problem.start({0: m.size.typical}), problem.start({})]
        own = fit(model, (m,), starts, tempers=TEMPERS[1:], learned=prior)
        fits.append(settled(model, Hypothesis(own, evidence(model, own, wide=bool(wider_tolerances(prior))))))
    best = max(fits, key=lambda h: h.evidence.ln)
    least = search(campaign_data(found.spindle, plain), [], [])
    return [left_out(m, h.fit, h.evidence, groups)[0] for m, h in ((model, base), (model, best), (least.model, least.base))]


def commit() -> str:
    """The commit the study is of, with a + where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()

    return git("rev-parse", "--short", "HEAD") + ("+" if git("status", "--porcelain", "--untracked-files=no") else "")


def read(files: Sequence[Path]) -> list[dict[str, Any]]:
    """All rows; a line that was cut off in writing is none."""
    rows = []
    for file in files:
        for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
            try:
                rows.append(json.loads(line))
            except json.JSONDecodeError:
                continue
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs=2, required=True, metavar=("A", "B"))
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument(
        "--without", nargs="+", default=[], choices=[f.name for f in fields(World) if f.name != "seed"], help="of the world"
    )
    parser.add_argument("--cluster", metavar="ADDRESS", help="of a Dask scheduler, as of `spindle study`")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    from tests.blind import study as own  # workers find it by this name, not as __main__

    at = commit()
    done = {(r["seed"], tuple(r["without"])) for r in read([options.out])}
    seeds = [seed for seed in range(*options.seeds) if (seed, tuple(options.without)) not in done]

    def take(seed: int, row: dict[str, Any]) -> None:
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row | {"commit": at}) + "\n")
        hidden = " + ".join(f"{h} {s:.3g} {u}" for h, s, u in zip(row["hidden"], row["sizes"], row["units"], strict=True)) or "nothing"
        print(
            f"{seed} {Path(row['scene']).name}: {hidden}: {row['verdict']} {' '.join(row['effects'])} ({row['seconds']:.0f} s)", flush=True
        )

    with on_cluster(options.cluster, own.versions_and_commit) if options.cluster else nullcontext(one_by_one) as run:
        run(partial(own.judge, without=options.without), seeds, take)


def one_by_one(function: Callable[[int], Any], numbers: Sequence[int], done: Callable[[int, Any], None]) -> None:
    """An executor of `sim.study` that does them here: a diagnosis takes all cores itself."""
    for k in numbers:
        done(k, function(k))


def versions_and_commit() -> dict[str, str]:
    return versions() | {"commit": commit()}


if __name__ == "__main__":
    main()
