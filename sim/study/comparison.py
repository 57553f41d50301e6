"""Designs side by side: the same conditions, figures that every machine has, and where spindles are
drawn the probability that one built to a design is better.

Every scene is a design, drawn by its own tolerances and independently of the others. The figures do not go by the
numbers of modes, which mean something else in every machine: the lowest natural frequency, of all and of every kind
that all designs have, its damping ratio, static stiffnesses at the hub where runout is seen, and the runout. That a
spindle of design A is better than one of B is told over all pairs of draws (Mann, Whitney, *Ann. Math. Statist.* 18
(1947) 50; equal ones count half), its standard error by DeLong, DeLong, Clarke-Pearson, *Biometrics* 44 (1988) 837.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
import pyarrow as pa

from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import SCENE
from thermospindle.model.machine import Spindle
from thermospindle.model.scene.fields import read_file
from thermospindle.model.scene.reading import scene_path
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.running.probes import AXIAL, X, Y
from thermospindle.sim.study.form import MONTE_CARLO, MOST, SWEEP, Study
from thermospindle.sim.study.rows import OF_RUNOUT, STIFFNESS, Cases, Row, cases
from thermospindle.sim.study.sensitivity import spread
from thermospindle.sim.study.summary import at_conditions, numbers

LOWEST, DAMPING = "lowest_Hz", "lowest_damping_ratio"
KEPT = ("temperature_C", "speed_rpm", "error")
Told = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Designs:
    """The cases of a comparison: those of the first design, then of the second, and so on; `own` as a study of each alone."""

    study: Study
    own: tuple[Cases, ...]

    @property
    def count(self) -> int:
        return sum(of.count for of in self.own)

    @property
    def kinds(self) -> list[str]:
        """Of modes, that every design has at every condition."""
        found = [{m.kind for m in modes} for of in self.own for _, modes in of.own.values()]
        return sorted(set.intersection(*found))

    @property
    def figures(self) -> dict[str, bool]:
        """By column whether higher is better."""
        probes = [p.removeprefix("hub ") for p in (X, Y, AXIAL)]
        found = {LOWEST: True} | {f"{LOWEST}.{kind}": True for kind in self.kinds} | {DAMPING: True} | {f"{STIFFNESS}.{p}": True for p in probes}
        return found | ({f"{key}.{p}": False for key in OF_RUNOUT for p in probes} if self.study.runout else {})

    def rows(self, case: int) -> list[Row]:
        """The rows of a case, a condition each."""
        each = self.own[0].count
        design, k = divmod(case, each)
        return [self._row(case, design, k, row) for row in self.own[design].rows(k)]

    def _row(self, case: int, design: int, k: int, row: Row) -> Row:
        told = {"case": case, "design": self.study.designs[design], "draw": k if self.study.draws else 0} | {key: row.get(key) for key in KEPT}
        if row["error"] and "frequency_Hz" not in row:
            return told
        told |= {name: row.get(name) for name in self.figures}
        told["in_contact"] = all(row.get(f"in_contact.{b.name}", True) for b in self.own[design].spindle.bearings)
        modes = list(zip(row["frequency_Hz"], row["kind"], row["damping_ratio"], strict=True))
        for kind in self.kinds:
            told[f"{LOWEST}.{kind}"] = min((f for f, own, _ in modes if own == kind), default=None)
        lowest = min(modes, default=(None, None, None))
        return told | {LOWEST: lowest[0], DAMPING: lowest[2]}

    def schema(self) -> pa.Schema:
        """Columns of the rows, in order."""
        fields = {"case": pa.int64(), "design": pa.string(), "draw": pa.int64(), "temperature_C": pa.float64(), "speed_rpm": pa.float64(), "error": pa.string()}
        return pa.schema(fields | {name: pa.float64() for name in self.figures} | {"in_contact": pa.bool_()})


def designs(study: Study, spindles: Sequence[Spindle], catalogue: tuple[Effect, ...]) -> Designs:
    """The designs of a comparison. Raises the named errors where one as it stands has no state at
    one of the conditions, and `BadInput` for too many cases."""
    if (count := study.draws * len(spindles)) > MOST:
        raise BadInput(f"{study.file}: draws = {study.draws}: {count} cases of {len(spindles)} scenes; at most {MOST} are allowed")
    found = []
    for k, (scene, spindle) in enumerate(zip(study.scenes, spindles, strict=True)):
        seed = int(np.random.default_rng([study.seed, k]).integers(2**62))  # else spindles of one tolerance would be off by the same in two designs
        own = replace(study, kind=MONTE_CARLO if study.draws else SWEEP, scene=scene, seed=seed)
        file = scene_path(scene)
        found.append(replace(cases(own, read_file(SCENE, file), file, spindle, catalogue), stiffness=True))
    return Designs(study, tuple(found))


# ---------------------------------------------------------------- what it says


@dataclass(frozen=True)
class Better:
    """Probability that one is better than another, and its standard error."""

    probability: float
    sd: float


def better(a: Array, b: Array, higher: bool) -> Better | None:
    """That a value of a (n,) is better than one of b (m,), over the finite ones; None where fewer than two are."""
    a, b = (v[np.isfinite(v)] * (1.0 if higher else -1.0) for v in (a, b))
    if min(len(a), len(b)) < 2:
        return None
    of_a, of_b = _below(a, b), 1 - _below(b, a)
    alike = (len(a) + len(b) + 1) / (12 * len(a) * len(b))  # its variance if neither is better (Mann & Whitney, Ann. Math. Stat. 18 (1947) 50): of samples that lie apart the other is nothing
    return Better(float(of_a.mean()), float(np.sqrt(max(of_a.var(ddof=1) / len(a) + of_b.var(ddof=1) / len(b), alike))))


def _below(values: Array, others: Array) -> Array:
    """Share of the others below each value, equal ones half."""
    rising = np.sort(others)
    return np.asarray((np.searchsorted(rising, values, "left") + np.searchsorted(rising, values, "right")) / (2 * len(others)))


def comparison(of: Designs, table: pa.Table) -> Told:
    """Counts, and by condition every figure of every design, and of drawn ones the probability for every pair."""
    errors = [e for e in table["error"].to_pylist() if e]
    names = of.study.designs
    told: Told = {"rows": len(table), "errors": len(errors), "first_error": errors[0] if errors else None, "designs": []}
    for name, design in zip(names, of.own, strict=True):
        rows = _of(table, name)
        known = [v for v in rows["in_contact"].to_pylist() if v is not None]
        lost = sum(e is not None for e in rows["error"].to_pylist())
        told["designs"].append({"design": name, "scene": design.spindle.name, "errors": lost, "in_contact": sum(known) / len(known) if known else None})
    told["conditions"] = []
    scene = {name: {condition: _nominal(of, k, condition) for condition in of.own[k].own} for k, name in enumerate(names)}
    for condition, (here, rows) in zip(of.own[0].conditions, at_conditions(of.own[0], table), strict=True):
        figures: Told = {}
        for figure, higher in of.figures.items():
            values = {name: numbers(_of(rows, name), figure) for name in names}
            if not any(np.isfinite(v).any() for v in values.values()):
                continue  # runout at rest
            by_design: Told = {name: {"nominal": scene[name][condition].get(figure), **_spread(values[name], of.study.draws)} for name in names}
            own: Told = {"better": "higher" if higher else "lower", "designs": by_design}
            if of.study.draws:
                pairs = [(a, b, better(values[a], values[b], higher)) for a, b in combinations(names, 2)]
                own["pairs"] = [{"design": a, "than": b, **asdict(p)} for a, b, p in pairs if p]
            figures[figure] = own
        told["conditions"].append(here | {"figures": figures})
    return told


def _nominal(of: Designs, design: int, condition: Any) -> Mapping[str, Any]:
    """The figures of a design as it stands."""
    own = of.own[design]
    row = own.row({}, own.spindle, condition)[0]
    return of._row(0, design, 0, row)


def _of(table: pa.Table, design: str) -> pa.Table:
    return table.filter(pa.array([d == design for d in table["design"].to_pylist()]))


def _spread(values: Array, draws: int) -> Told:
    if not draws:
        return {}
    found = spread(values)
    return {"spread": asdict(found) if found else None}
