"""The spindles that a Monte Carlo study draws: what each is off by, what imperfections it has, and mixtures of two sets of them.

Draw k follows from the seed and k alone. For variance-based sensitivities (`sim.study.indices`) a second set is drawn beside the
first, and the first once more for every input with that input alone taken from the second: (2 + inputs) n cases of n draws, the first
set first. Inputs are independent: every toleranced parameter, and with a grade the unbalance, the races and the balls of each bearing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thermospindle.model.built.drawn import GRADES, drawn
from thermospindle.model.built.imperfections import Imperfections, RowImperfections
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.sim.study.form import Study

IMPERFECT, SECOND = 1, 2  # of the seeds of a draw: imperfections, and the second set, beside the deviations
FIRST_SET, SECOND_SET = "", "all"
"""What a case has from the second set: nothing, everything, or the input that is named."""
UNBALANCE = "unbalance"
G_MM, G_MM2, NM = 1e6, 1e9, 1e9  # of kg m, kg m2, m


@dataclass(frozen=True)
class Draw:
    """Number `k` of a set, `taken` from the second set; relative deviations (p,) and imperfections, None those of the scene."""

    k: int
    taken: str
    deviations: Array
    imperfections: Imperfections | None


def inputs(study: Study, spindle: Spindle) -> list[str]:
    """Names of what is drawn, each by itself."""
    names = [p.name for p in toleranced(spindle)]
    if study.grade is None:
        return names
    return names + [UNBALANCE] + [f"{b.name} {part}" for b in spindle.rolling for part in ("races", "balls")]


def count(study: Study, spindle: Spindle) -> int:
    """Of cases."""
    return study.draws * (2 + len(inputs(study, spindle)) if study.sobol else 1)


def draw(study: Study, spindle: Spindle, case: int) -> Draw:
    """The draw of a case."""
    block, k = divmod(case, study.draws)
    names = inputs(study, spindle)
    taken = FIRST_SET if block == 0 else SECOND_SET if block == 1 else names[block - 2]
    if block == 0:
        return Draw(k, taken, *_one(study, spindle, [study.seed, k]))
    other, other_built = _one(study, spindle, [study.seed, k, SECOND])
    if block == 1:
        return Draw(k, taken, other, other_built)
    own, built = _one(study, spindle, [study.seed, k])
    if block - 2 < len(own):
        own[block - 2] = other[block - 2]
    elif built is not None and other_built is not None:
        built = _with(built, other_built, taken)
    return Draw(k, taken, own, built)


def _one(study: Study, spindle: Spindle, seed: Sequence[int]) -> tuple[Array, Imperfections | None]:
    off = np.random.default_rng(seed).normal(0.0, [p.sd for p in toleranced(spindle)])
    if study.grade is None:
        return off, None
    own = int(np.random.default_rng([*seed, IMPERFECT]).integers(2**62))
    return off, drawn(spindle, own, GRADES[study.grade])


def _with(built: Imperfections, other: Imperfections, taken: str) -> Imperfections:
    """Imperfections with the input `taken` from others."""
    if taken == UNBALANCE:
        return replace(other, bearings=built.bearings)
    bearing, _, part = taken.rpartition(" ")
    a, b = built.row(bearing), other.row(bearing)
    races, balls = (b, a) if part == "races" else (a, b)
    return replace(built, bearings={**built.bearings, bearing: replace(races, ball_diameter=balls.ball_diameter, ball_waves=balls.ball_waves)})


# ---------------------------------------------------------------- in numbers


def imperfection_columns(spindle: Spindle) -> dict[str, str]:
    """Columns of a table of cases that tell the drawn imperfections in numbers, and what each is called among the inputs of a regression."""
    found = {"unbalance_g_mm": "unbalance", "couple_unbalance_g_mm2": "couple unbalance"}
    for b in spindle.rolling:
        found |= {f"race_waviness_nm.{b.name}": f"{b.name} race waviness", f"ball_waviness_nm.{b.name}": f"{b.name} ball waviness"}
        found[f"ball_difference_nm.{b.name}"] = f"{b.name} ball difference"
    return found


def imperfection_values(spindle: Spindle, built: Imperfections) -> dict[str, float]:
    """The columns' values: unbalances; root mean squares of all waves of the races and of the
    balls, standard deviation of the balls' diameters."""
    found = {"unbalance_g_mm": G_MM * built.unbalance, "couple_unbalance_g_mm2": G_MM2 * built.couple_unbalance}
    for b in spindle.rolling:
        row: RowImperfections = built.row(b.name)
        races = [w.amplitude for ring in (row.inner_radial, row.inner_axial, row.outer_radial, row.outer_axial) for w in ring]
        balls = [w.amplitude for ball in row.ball_waves for w in ball]
        found |= {f"race_waviness_nm.{b.name}": NM * _rms(races, 4), f"ball_waviness_nm.{b.name}": NM * _rms(balls, len(row.ball_waves))}
        found[f"ball_difference_nm.{b.name}"] = NM * float(np.std(row.ball_diameter)) if row.ball_diameter else 0.0
    return found


def _rms(amplitudes: Sequence[float], surfaces: int) -> float:
    """Root mean square over the circumferences of so many surfaces."""
    return float(np.sqrt(np.sum(np.square(amplitudes)) / 2 / max(surfaces, 1)))


def known_of(spindle: Spindle, own: Draw) -> Mapping[str, Any]:
    """What a row says of its draw."""
    names = [p.name for p in toleranced(spindle)]
    told: dict[str, Any] = {f"deviation.{name}": float(x) for name, x in zip(names, own.deviations, strict=True)}
    return told | (imperfection_values(spindle, own.imperfections) if own.imperfections is not None else {})
