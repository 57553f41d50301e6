"""The lines that an explanation moves: measured, as the scene alone is likely to show them, and with the effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.runout.explanation import Explanation
from thermospindle.diagnosis.runout.fit import Family
from thermospindle.diagnosis.runout.held_out import amplitude_of, by_group, each_line
from thermospindle.diagnosis.runout.lines import key_of
from thermospindle.diagnosis.runout.verdict import RunoutDiagnosis

SHOWS = 0.3  # of what the scene alone is likely to show, from which an effect moves a line


@dataclass(frozen=True)
class MovedLine:
    """One line (Hz) of one test at the probe where the effect shows most; amplitudes in m, zero to
    peak: rms of what spindles of the scene show alone, and with the effect beside it."""

    test: str
    frequency: float
    order: float  # of the turning frequency
    name: str
    cause: str
    node: int
    measured: float
    measured_sd: float
    scene: float
    with_effect: float


def leading(d: RunoutDiagnosis) -> Explanation | None:
    """The explanation that the verdict holds, or the best of those it cannot tell apart; None where it names nothing."""
    if not d.effects:
        return None
    if d.verdict == "ambiguous":
        return d.rivals[0]
    return next(e for e in d.explanations if e.effects == d.effects)


def moved_lines(d: RunoutDiagnosis, explained: Explanation) -> list[MovedLine]:
    """Every line that the explanation raises above what the scene likely shows, those that it moves most first."""
    found = [m for family in d.families for own in each_line(family) if (m := _moved(d, own, explained)) is not None]
    return sorted(found, key=lambda m: -m.with_effect / max(m.scene, 1e-300))


def _moved(d: RunoutDiagnosis, own: Family, explained: Explanation) -> MovedLine | None:
    b = amplitude_of(own, explained)
    effect = np.sqrt(np.sum([np.abs(part) ** 2 for part in by_group(own, b)], axis=0))
    scene = np.sqrt((np.abs(own.shown * own.likely) ** 2).sum(axis=1))
    i = int(effect.argmax())
    if effect[i] < SHOWS * scene[i] or effect[i] == 0.0:
        return None
    seen = d.seen[int(own.test[i])]
    source = own.source[int((np.abs(b) * np.abs(own.shown[i])).argmax())][0]
    line = next(g for s in seen.seen for g in s.lines if key_of(g) == source[0])
    return MovedLine(
        seen.test.id, float(own.frequency[i]), float(own.frequency[i] * 2 * np.pi / abs(seen.condition.speed)), line.name,
        f"{line.bearing} {line.cause}".strip() + (f" {line.order}" if line.order else ""), int(own.node[i]), float(abs(own.value[i])),
        float(own.sd[i] / np.sqrt(2)), float(scene[i]), float(np.hypot(scene[i], effect[i])),
    )  # fmt: skip
