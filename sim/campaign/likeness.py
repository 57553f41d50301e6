"""Imported FRFs beside those of the scene: lines in another unit, a channel that is larger by the
ratio of two units, one that is reversed, and two that are each other's.

A model is never right, and none of this is refused. A factor is told where every FRF of a channel has it in the median over
the louder half of its lines, the other sign where the phases of all are across from the computed ones there; two channels
where each fits the other's computed FRFs at least `BETTER` times as well as its own, in rms of ln magnitude about the median,
which no factor changes; lines in rad/s for Hz where the FRFs of all tests fit the computed ones so much better there; and the
other sense of rotation where the phases of all FRFs that depend on it are those of a spindle that turns so. What all tests
together do not tell, each may by itself: a sensor that was glued on again between two, or one export in another unit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange, listed
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.sim.campaign.beside import beside, check_points
from thermospindle.sim.campaign.campaign import Campaign, condition_of
from thermospindle.sim.campaign.compared import ACROSS, MOST_LINES, SILENT, Compared, compared, cosines
from thermospindle.sim.campaign.misread import misread

FACTORS = {
    1e3: "millimetres told as metres, or kilonewtons as newtons",
    1e-3: "metres told as millimetres, or newtons as kilonewtons",
    9.80665: "m/s2 told as g",
    1 / 9.80665: "g told as m/s2",
}
"""Measured over computed, and the mistake in a unit that makes it."""
LARGE, ENDLESS, ALIKE = float(np.log(10**0.5)), float(np.log(1e7)), 0.25
"""Of ln ratio, from which (10 dB) any other factor is told where all FRFs have it, no mass being drawn so wrong; from
which none is, for an FRF that symmetry forbids is computed as 1e-12; and within which part of it they have the same."""
WITHIN, SCATTER = 0.15, 1.0
"""Relative, of a factor; and of ln ratio over the lines of an FRF, its median deviation up to which it is one."""
BETTER = 2.0
AXES = {1 / (2 * np.pi): "rad/s told as Hz", 2 * np.pi: "Hz told as rad/s"}
"""Factors from the lines as told to those that they may be. Others take lines out of the band of the scene's hammer test."""


@dataclass(frozen=True, eq=False)
class Pair:
    """One FRF: ln of its measured and computed magnitude (n,), the mean cosine between their phases over
    the louder half of the lines (0 where one of the two passes no resonance: all lines may lie between
    two that are one), below what each magnitude is silence, and whether the model answers there at all."""

    response: int
    reference: int
    measured: Array
    computed: Array
    cosine: float
    silence: tuple[float, float]
    loud: bool

    @property
    def heard(self) -> tuple[Array, Array]:
        """Measured and computed, silence as loud as it may be."""
        return np.maximum(self.measured, self.silence[0]), np.maximum(self.computed, self.silence[1])


def likenesses(spindle: Spindle, campaign: Campaign) -> list[str]:
    """What tells of units, signs or channels mistaken, a sentence each."""
    if not any(t.frf is not None for t in campaign.tests):
        return []
    try:
        check_points(spindle, campaign)
        every = _compared(spindle, campaign)
        tests = {test: _pairs(own) for test, own in every.items()}
        if (axis := _axis(spindle, campaign, tests)) is not None:
            return [axis]
        for whole in (_turned(spindle, campaign), misread(spindle, campaign.quantity, list(every.values()))):
            if whole is not None:
                return [whole]
    except (BadInput, NoEquilibrium, OutsideRange) as error:
        return [f"the FRFs are not set beside those of {spindle.name}: {error}"]
    names = {p.node: f"{p.node} ({p.name})" for p in campaign.points}
    turning = {t.id for t in campaign.tests if t.speed}
    if said := _mistaken([*tests.values()], names, spindle.name, bool(turning)):
        return said
    of_one: dict[str, list[str]] = {}
    for test, pairs in tests.items():
        for sentence in _mistaken([pairs], names, spindle.name, test in turning):
            of_one.setdefault(sentence, []).append(test)
    return [f"test{'s' * (len(ids) > 1)} {listed(ids)}: {sentence}" for sentence, ids in of_one.items()]


def _mistaken(tests: Sequence[Sequence[Pair]], names: Mapping[int, str], scene: str, turns: bool) -> list[str]:
    """What some tests, all alike, tell of channels, units and signs; beside another channel's FRFs factors and signs say nothing."""
    return _swapped(tests, names, scene) or [*_factors(tests, names, scene), *_reversed(tests, names, scene, turns)]


def _compared(spindle: Spindle, campaign: Campaign, scale: float = 1.0) -> dict[str, Compared]:
    """The FRFs of every test that can be compared, its lines taken `scale` times as high as they are told."""
    return {t.id: own for t in campaign.tests if (own := compared(spindle, campaign, t, scale)) is not None}


def _pairs(own: Compared) -> list[Pair]:
    """The FRFs of a test one by one."""
    x, a = (np.log(np.maximum(np.abs(value), 1e-300)) for value in (own.measured, own.computed))
    silence = tuple(float(np.log(SILENT) + np.median(value, axis=-1).max()) for value in (x, a))
    cosine = np.where(own.turning, cosines(own.measured, own.computed, own.computed), 0.0)
    ends = [(i, j, r, h) for i, r in enumerate(own.response_nodes) for j, h in enumerate(own.reference_nodes)]
    return [Pair(r, h, x[i, j], a[i, j], float(cosine[i, j]), (silence[0], silence[1]), bool(own.loud[i, j])) for i, j, r, h in ends]


# ---------------------------------------------------------------- lines in another unit


def _axis(spindle: Spindle, campaign: Campaign, tests: Mapping[str, Sequence[Pair]]) -> str | None:
    """What is said where the FRFs of all tests together fit the scene far better with their lines in another unit."""
    told = _misfit([p for pairs in tests.values() for p in pairs if p.loud])
    if not SCATTER < told < float("inf"):
        return None
    for scale, mistake in AXES.items():
        if BETTER * _misfit([p for own in _compared(spindle, campaign, scale).values() for p in _pairs(own) if p.loud]) < told:
            lines = next(t.frf.frequency for t in campaign.tests if t.frf is not None)
            return f"all FRFs fit those that {spindle.name} has far better with lines from {scale * lines[0]:.4g} to {scale * lines[-1]:.4g} Hz: is the unit of their axis another than is told, as {mistake}?"
    return None


def _misfit(pairs: Sequence[Pair]) -> float:
    """Rms of ln magnitude between measured and computed, each FRF about its own median; infinite
    without any, as where the model has no answer."""
    off = [p.heard[0] - p.heard[1] for p in pairs]
    return float(np.sqrt(np.mean(np.concatenate([x - np.median(x) for x in off]) ** 2))) if off else float("inf")


# ---------------------------------------------------------------- sense of rotation


def _turned(spindle: Spindle, campaign: Campaign) -> str | None:
    """What is said where, in every test that turns, all FRFs whose phase depends on the sense of rotation, as
    those from one plane to the other do, are across from the computed ones, and would not be were it the other."""
    found: list[str] = []
    for t in campaign.tests:
        if not t.speed or t.frf is None:
            continue
        told, other = (beside(spindle, campaign, t, replace(condition_of(t), speed=sign * t.speed)) for sign in (1, -1))
        if told is None or other is None or not told.held or not len(told.measured.frequency):
            continue
        step = -(-len(told.measured.frequency) // MOST_LINES)
        lines, measured = told.measured.frequency[::step], told.measured.value[..., ::step]
        own, turned = told.computed(lines), other.computed(lines)
        size, differ = np.sqrt(np.mean(np.abs(own) ** 2, axis=-1)), cosines(own, turned, own)
        loud = size > SILENT * size.max()
        depends, same = loud & (differ < ACROSS), loud & (differ > -ACROSS)
        if depends.sum() < 2 or not same.any():
            continue
        told_so, if_turned = cosines(measured, own, own), cosines(measured, turned, own)
        if not (np.all(told_so[depends] < ACROSS) and np.all(if_turned[depends] > -ACROSS) and np.median(told_so[same]) > 0):
            return None
        found.append(t.id)
    if not found:
        return None
    return (
        f"test{'s' * (len(found) > 1)} {listed(found)}: FRFs from one plane to the other are those that {spindle.name} has turning the other way: is the sense of rotation another than is told "
        "(speed_rpm is positive about +z), or does a direction point the other way, as -Y where +Y is?"
    )


# ---------------------------------------------------------------- factors of units, and signs


def _shared(tests: Sequence[Sequence[Pair]], names: Mapping[int, str], judged: Callable[[Pair], float | None]) -> Iterator[tuple[str, float]]:
    """Whose FRFs are all judged to be off by the same factor, and that: all there are, or else those of a response, or of a hammer's point."""
    told = [(p, judged(p)) for pairs in tests for p in pairs if p.loud]

    def shared(own: Sequence[tuple[Pair, float | None]]) -> float | None:
        found = {factor for _, factor in own}
        return found.pop() if len(found) == 1 else None

    if (factor := shared(told)) is not None:
        yield "all FRFs", factor
        return
    for what, key in (("the FRFs of response", "response"), ("the FRFs of the hammer at", "reference")):
        by_node: dict[int, list[tuple[Pair, float | None]]] = {}
        for p, factor in told:
            by_node.setdefault(getattr(p, key), []).append((p, factor))
        for node, own in by_node.items():
            if (factor := shared(own)) is not None:
                yield f"{what} {names[node]}", factor


def _factors(tests: Sequence[Sequence[Pair]], names: Mapping[int, str], scene: str) -> list[str]:
    return [_said(who, factor, scene) for who, factor in _shared(tests, names, _factor)] or _scaled(tests, scene)


def _scaled(tests: Sequence[Sequence[Pair]], scene: str) -> list[str]:
    """What is said where all FRFs are larger, or smaller, by one large factor that no two units have: a sensitivity that was left out."""
    ratios = np.array([r for pairs in tests for p in pairs if p.loud and (r := _ratio(p)) is not None])
    middle = float(np.median(ratios)) if len(ratios) > 1 else 0.0  # one alone may be so far from its drawing
    if not LARGE < abs(middle) < ENDLESS or np.abs(ratios - middle).max() > ALIKE * abs(middle):
        return []
    return [f"all FRFs are about {_times(np.exp(middle))} those that {scene} has: is a unit or a sensitivity another than is told?"]


def _reversed(tests: Sequence[Sequence[Pair]], names: Mapping[int, str], scene: str, turns: bool) -> list[str]:
    whose = _shared(tests, names, lambda p: -1.0 if p.cosine < ACROSS else None)
    other = " Or, of FRFs from one plane to the other, does the spindle turn the other way (speed_rpm is positive about +z)?" if turns else ""
    return [f"{who} have the other sign than those that {scene} has: does sensor or hammer look the other way than is told, as -X where +X is?{other}" for who, _ in whose]


def _ratio(pair: Pair) -> float | None:
    """ln of how many times as large as computed an FRF is, over the louder half of its lines; None where that scatters."""
    ratio = (pair.measured - pair.computed)[pair.computed >= np.median(pair.computed)]
    middle = float(np.median(ratio))
    return middle if float(np.median(np.abs(ratio - middle))) <= SCATTER else None


def _factor(pair: Pair) -> float | None:
    """The factor of `FACTORS` by which an FRF is larger than computed; None where it is none of them."""
    middle = _ratio(pair)
    return next((f for f in FACTORS if middle is not None and abs(np.exp(middle) / f - 1) <= WITHIN), None)


def _said(who: str, factor: float, scene: str) -> str:
    return f"{who} are about {_times(factor)} those that {scene} has: is a unit another than is told, as {FACTORS[factor]}?"


def _times(factor: float) -> str:
    return f"{factor:.4g} times" if factor > 1 else f"1/{1 / factor:.4g} of"


# ---------------------------------------------------------------- channels of each other


def _swapped(tests: Sequence[Sequence[Pair]], names: Mapping[int, str], scene: str) -> list[str]:
    """Two responses, or two hammer points, that are each other's in every test that has both; of
    the two kinds the one that is fewer, for one exchange looks like others."""
    found: list[list[str]] = []
    for what, key, other in (("responses", "response", "reference"), ("hammer points", "reference", "response")):
        nodes = sorted({getattr(p, key) for pairs in tests for p in pairs})
        said = []
        for a, b in combinations(nodes, 2):
            rows = [(row[a], row[b]) for pairs in tests if a in (row := _rows(pairs, key, other)) and b in row]
            if _each_others(rows):
                said.append(f"{what} {names[a]} and {names[b]}: each fits what {scene} has of the other far better than its own: are the two exchanged?")
        found += [said] if said else []
    return min(found, key=len, default=[])


Row = dict[int, Pair]
"""The FRFs of one channel by the node at their other end."""


def _rows(pairs: Sequence[Pair], key: str, other: str) -> dict[int, Row]:
    rows: dict[int, Row] = {}
    for p in pairs:
        rows.setdefault(getattr(p, key), {})[getattr(p, other)] = p
    return rows


def _each_others(rows: Sequence[tuple[Row, Row]]) -> bool:
    """Of two channels in some tests, whether the other's model fits both at least `BETTER` times as
    well as their own; by what the model moves at one of the two."""
    told = [(pair, n) for pair in rows for n in pair[0] if pair[0][n].loud or pair[1][n].loud]
    if not told:
        return False

    def misfit(measured: int, computed: int) -> float:
        off = np.concatenate([pair[measured][n].heard[0] - pair[computed][n].heard[1] for pair, n in told])
        return float(np.sqrt(np.mean((off - np.median(off)) ** 2)))

    return BETTER * max(misfit(0, 1), misfit(1, 0)) < min(misfit(0, 0), misfit(1, 1))
