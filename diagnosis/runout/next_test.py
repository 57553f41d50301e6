"""Which runout test would tell explanations apart that the tests so far do not, and what each predicts of its lines.

Two explanations differ at a plan - another speed or temperature, a further probe, a longer record - by D in the phasors of its lines. With
S the covariance of the record's errors, of what the scene likely has besides of the same sources, of the build, and of the sizes of both,
the expected ln odds if either is true are D^H S^-1 D (Box & Hill, *Technometrics* 9 (1967) 57, for complex data), at the phases at which
they differ least: nothing predicts where the balls will stand. Repeats would not help, since the scene's own scatter is the same in each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.runout.explanation import Explanation
from thermospindle.diagnosis.runout.fit import Family, families
from thermospindle.diagnosis.runout.held_out import amplitude_of, by_group, each_line, scattered, squares
from thermospindle.diagnosis.runout.lines import FORM, Seen, expected
from thermospindle.diagnosis.runout.sources import sources
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import NoEquilibrium, NotConverged, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM, small_length
from thermospindle.sim.effects.effect import called

FAILED = (NoEquilibrium, NotConverged, OutsideRange)
SPEEDS = (0.5, 0.75, 1.0, 1.25)  # of the spindle's nominal speed
LONGER = 4.0  # times the length of the record
CERTAIN = np.log(1e6)  # ln odds beyond which nothing is gained, and models are not to be trusted
WORTH = np.log(3.0)  # ln odds from which a test is worth its while
MOST = 3  # rivals of the leading explanation
SHOWN = 6  # lines whose predictions are told
TOLD = 0.01  # of all that tells, from which a line is


@dataclass(frozen=True)
class Plan:
    """A runout test that could be made: probes at `nodes`, a record of `seconds`; `changed` is how
    it differs from the tests so far, in words; `phased` whether phases between probes are kept."""

    condition: Condition
    nodes: tuple[int, ...]
    seconds: float
    changed: str
    phased: bool = True


@dataclass(frozen=True)
class LinePrediction:
    """One line (Hz) at one probe as each of two explanations has it (m, zero to peak), what the
    scene alone likely shows there, and its share of the ln odds."""

    frequency: float
    name: str
    node: int
    amplitude: tuple[float, float]
    scene: float
    share: float


@dataclass(frozen=True)
class NextRunout:
    """How far apart a test puts two explanations, as odds if either is true (no more than a
    million), by which line most, and what each predicts."""

    plan: Plan
    separates: tuple[str, str]
    odds: float
    tells: str
    predicted: tuple[LinePrediction, ...]


def next_runout(
    spindle: Spindle, seen: Sequence[Seen], points: Sequence[Point], rivals: Sequence[Explanation], progress: Callable[[str], None]
) -> tuple[tuple[NextRunout, ...], str]:
    """The best test for the first of `rivals` and each other; and, where one has none, a sentence that says so."""
    lead, others = rivals[0], rivals[1 : MOST + 1]
    base = min(seen, key=lambda s: abs(abs(s.condition.speed) - spindle.nominal_speed))
    options = plans(spindle, seen, base)
    here = [*points, *(p for p in spindle.points if p.node not in {q.node for q in points})]
    found: dict[int, list[NextRunout]] = {k: [] for k in range(len(others))}
    for plan in options:
        try:
            parts = _families(spindle, plan, base, here)
        except FAILED:
            continue  # the spindle cannot run so: contact is lost, say
        for k, other in enumerate(others):
            found[k].append(_weighed(spindle, plan, parts, lead, other))
    progress(f"{len(options)} further tests weighed")
    tests, words = [], []
    for k, other in enumerate(others):
        best = max(found[k], key=lambda t: t.odds, default=None)  # the first of equals: the nearest to what was measured
        if best is not None and np.log(best.odds) >= WORTH:
            tests.append(best)
        else:
            odds = f"at best odds of {best.odds:.2g} to 1" if best else "none of them can be computed"
            first, second = named(spindle, lead, other)
            words.append(f"No test of those tried (other speeds and temperatures, a further probe, a longer record) tells {first} from {second}: {odds}.")
    return tuple(tests), " ".join(words)


def plans(spindle: Spindle, seen: Sequence[Seen], base: Seen) -> list[Plan]:
    """Tests that differ in one thing from one of those made, `base`, least effort first."""
    at, record = base.condition, base.test.runout
    assert record is not None
    made = {(round(s.condition.temperature, 1), round(s.condition.speed, 1)) for s in seen}
    turning = float(np.sign(at.speed))
    speeds = [turning * share * spindle.nominal_speed for share in SPEEDS]
    low, high = spindle.temperatures
    conditions = [replace(at, speed=s) for s in sorted(speeds, key=lambda s: abs(s - at.speed))]
    conditions += [replace(at, temperature=t) for t in sorted({low, (low + high) / 2, high}, key=lambda t: abs(t - at.temperature))]
    found = []
    for c in conditions:
        if (round(c.temperature, 1), round(c.speed, 1)) not in made:
            words = f"at {abs(c.speed) / RPM:.0f} rpm" if c.speed != at.speed else f"at {c.temperature:g} C"
            found.append(Plan(c, record.nodes, record.length, words, base.phased))
    found.append(Plan(at, record.nodes, LONGER * record.length, f"with records {LONGER:g} times as long", base.phased))
    if not base.phased:
        found.append(Plan(at, record.nodes, record.length, "with the phases of all probes"))
    further = [p for p in spindle.points if p.node not in record.nodes]
    return found + [Plan(at, (*record.nodes, p.node), record.length, f"with a probe at node {p.node} too", base.phased) for p in further]


def named(spindle: Spindle, first: Explanation, second: Explanation) -> tuple[str, str]:
    """What the two are called; of the same effects, with the choices in which they differ."""
    names = [" + ".join(e.effects) for e in (first, second)]
    if names[0] != names[1]:
        return names[0], names[1]
    told = []
    for e, other in ((first, second), (second, first)):
        words = []
        for v, w in zip(e.variants, other.variants, strict=True):
            apart = [(p, v.values[p.name]) for p in v.effect.parameters[1:] if v.values[p.name] != w.values[p.name]]
            own = ", ".join(f"{p.name} {called(p, value, spindle) or f'{value:g}'}" for p, value in apart)
            words.append(v.effect.name + (f" ({own})" if own else ""))
        told.append(" + ".join(words))
    return told[0], told[1]


def _families(spindle: Spindle, plan: Plan, like: Seen, points: Sequence[Point]) -> list[Family]:
    """The lines of a planned test with probes as good as those of an earlier one."""
    seen = replace(expected(spindle, plan.condition, plan.nodes, plan.seconds, like), phased=plan.phased)
    return families([seen], sources(spindle, [seen], points))


def _weighed(spindle: Spindle, plan: Plan, parts: Sequence[Family], lead: Explanation, rival: Explanation) -> NextRunout:
    lines = [(f, own) for f in parts for own in each_line(f)]
    weights, told = [], []
    for _, own in lines:
        both = [amplitude_of(own, e) for e in (lead, rival)]
        weights.append(_apart(own, lead, rival))
        size = np.abs([own.shown @ b for b in both])
        node = int(size.max(axis=0).argmax())
        scene = float(np.linalg.norm(own.shown[node] * own.likely))
        told.append((own, node, (float(size[0, node]), float(size[1, node])), scene))
    total = sum(weights)
    names = named(spindle, lead, rival)
    order = np.argsort(weights)[::-1][:SHOWN]
    predicted = []
    for i in order:
        own, node, size, scene = told[i]
        if weights[i] > TOLD * total:
            predicted.append(
                LinePrediction(float(own.frequency[node]), _name(own, lead, rival), int(own.node[node]), size, scene, weights[i] / total)
            )
    tells = "no line"
    if predicted:
        best = predicted[0]
        tells = f"the line at {best.frequency:.1f} Hz ({best.name}), {small_length(best.amplitude[0])} by {names[0]}, {small_length(best.amplitude[1])} by {names[1]}"
    return NextRunout(plan, names, float(np.exp(min(total, CERTAIN))), tells, tuple(predicted))


def _name(own: Family, lead: Explanation, rival: Explanation) -> str:
    """The name of a line by the largest of its sources that the explanations have."""
    size = np.abs(amplitude_of(own, lead)) * np.abs(own.shown).max(axis=0), np.abs(amplitude_of(own, rival)) * np.abs(own.shown).max(axis=0)
    source = own.source[int(np.maximum(*size).argmax())][0]
    return source[0][3]


def _apart(own: Family, lead: Explanation, rival: Explanation) -> float:
    """Expected ln odds from one line."""
    cover = scattered(own)
    groups = []
    for e in (lead, rival):
        b = amplitude_of(own, e)
        groups.append(by_group(own, b))
        for v, sd in zip(e.variants, e.size_sd, strict=True):
            for shown in by_group(own, sd * own.of_effect(v.amplitudes)):
                cover = cover + np.outer(shown, shown.conj())
        for k, sd in enumerate(own.tolerance_sd):
            moved: Array = sd * (own.by_tolerance[k] @ b)
            cover = cover + np.outer(moved, moved.conj())
        cover = cover + np.diag(np.abs(own.shown @ b) ** 2) * FORM**2
    value = np.sum(groups[0], axis=0)
    return squares(cover, value, groups[1])
