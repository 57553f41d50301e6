"""Measured runout beside the scene's: every line with its cause, and the repeatable and nonrepeatable parts.

The scene's imperfections are taken as they are, but where the balls stood when a record began nothing predicts: a line of both bearings, or
of several balls, is their sum by chance. Its computed amplitude is the rms over random starts. Residuals are in standard deviations of the
record, of that chance, and of how spindles of one drawing scatter about the scene's imperfections, which are one draw (`runout_sources`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermospindle.diagnosis.runout.lines import Seen, UnexplainedLine, key_of, look, runout_tests
from thermospindle.diagnosis.runout.sources import phasors, scatter
from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.beside import on_nodes
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.runout_record import check_revolutions
from thermospindle.sim.campaign.simulated import set_down
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.probes import speed_ratio
from thermospindle.sim.running.revolutions import revolutions

STARTS = 24  # random starts of the balls


@dataclass(frozen=True, eq=False)
class LineBeside:
    """One line at one probe (m, zero to peak): `causes` strongest first by the scene; `measured_sd` is
    the record's error, `scatter` that of the computed amplitude: chance of the start, and of the build."""

    frequency: float
    order: float
    node: int
    causes: tuple[Line, ...]
    measured: float
    measured_sd: float
    computed: float
    scatter: float

    @property
    def residual(self) -> float:
        """Computed less measured amplitude in standard errors."""
        return (self.computed - self.measured) / float(np.hypot(self.measured_sd, self.scatter))


@dataclass(frozen=True)
class PartBeside:
    """Peak to valley and rms (m) of the repeatable or the nonrepeatable part at one probe; peak to valley only for a time record."""

    node: int
    measured_rms: float
    computed_rms: float
    measured: float | None
    computed: float | None


@dataclass(frozen=True, eq=False)
class RunoutBeside:
    """A test: its lines, strongest first, RRO and NRRO of every probe, and lines that theory does not know."""

    test: Test
    lines: tuple[LineBeside, ...]
    rro: tuple[PartBeside, ...]
    nrro: tuple[PartBeside, ...]
    unexplained: tuple[UnexplainedLine, ...]


def compare_runout(spindle: Spindle, campaign: Campaign, progress: Callable[[str], None] = lambda done: None) -> list[RunoutBeside]:
    """Every runout test of a campaign beside the scene."""
    found = []
    for test in runout_tests(campaign).tests:
        found.append(_beside(spindle, look(spindle, test), campaign.points))
        progress(f"{test.id}: {len(found[-1].lines)} lines compared")
    return found


def rms_residual(found: Sequence[RunoutBeside]) -> float | None:
    """Rms residual of all lines of some tests in their standard errors; None without any."""
    residuals = [line.residual for test in found for line in test.lines]
    return float(np.sqrt(np.mean(np.square(residuals)))) if residuals else None


def _beside(spindle: Spindle, seen: Seen, points: tuple[Point, ...]) -> RunoutBeside:
    point = operating_point(spindle, seen.condition)
    by_node = {p.node: p for p in on_nodes(spindle, points)}
    turning, ratios, record = abs(seen.condition.speed) / (2 * np.pi), np.array([abs(speed_ratio(spindle, by_node[n])) for n in seen.nodes]), seen.test.runout
    assert record is not None
    slowest = int(ratios.argmin())
    check_revolutions(f"tests.{seen.test.id}: runout", record, turning * ratios[slowest], f" of what node {seen.nodes[slowest]} sees,")
    own = phasors(point, point.imperfections, [by_node[n] for n in seen.nodes], perfect=True)
    balls = {b.name: b.balls for b in point.spindle.rolling}
    random = np.random.default_rng(0)
    starts = [phasors(point, set_down(point.imperfections, balls, random), [by_node[n] for n in seen.nodes], perfect=True) for _ in range(STARTS)]
    builds = scatter(spindle, point, [by_node[n] for n in seen.nodes])
    nothing = np.zeros(len(seen.nodes), complex)
    found, waves = [], []
    for one in seen.seen:
        keys = [key_of(g) for g in one.lines]
        parts = {key: own[key] for key in keys if key in own}
        waves += [(g.frequency, own[key_of(g)]) for g in one.lines if key_of(g) in own]
        tried = np.abs([sum((start.get(key, nothing) for key in keys), nothing) for start in starts])
        for i, node in enumerate(seen.nodes):
            sizes = {key_of(g): float(abs(parts[key_of(g)][i])) if key_of(g) in parts else 0.0 for g in one.lines}
            strongest = max(sizes.values())
            causes = tuple(sorted((g for g in one.lines if sizes[key_of(g)] >= 1e-3 * strongest), key=lambda g: -sizes[key_of(g)]))
            computed, chance = float(np.sqrt(np.mean(tried[:, i] ** 2))), float(tried[:, i].std())
            build = float(np.sqrt(sum((builds[key][i] for key in keys if key in builds), 0.0) / 2))
            measured, sd = float(abs(one.phasor[i])), float(one.sd[i] / np.sqrt(2))
            found.append(
                LineBeside(one.frequency, one.frequency / turning, node, causes, measured, sd, computed, float(np.hypot(chance, build)))
            )
    rro, nrro = _parts(seen, waves, turning, ratios)
    return RunoutBeside(seen.test, tuple(sorted(found, key=lambda g: -max(g.measured, g.computed))), rro, nrro, seen.unexplained)


def _parts(
    seen: Seen, waves: list[tuple[float, ComplexArray]], turning: float, ratios: Array
) -> tuple[tuple[PartBeside, ...], tuple[PartBeside, ...]]:
    """The repeatable and the nonrepeatable part of every probe, in revolutions of what it sees:
    that turns `ratios` (probes,) times as fast as the spindle, at `turning` Hz."""
    record = seen.test.runout
    assert record is not None
    n = len(seen.nodes)
    if record.kind == "time":
        made = np.zeros((n, len(record.axis)))
        for f, phasor in waves:
            turn = 2 * np.pi * f * record.axis
            made += np.outer(phasor.real, np.cos(turn)) - np.outer(phasor.imag, np.sin(turn))
        parts: Array = np.zeros((2, n, 2, 2))  # repeatable or not; probe; rms or peak to valley; measured or computed
        for ratio in np.unique(ratios):
            own = np.flatnonzero(ratios == ratio)
            for k, value in enumerate((record.value[own], made[own])):
                cut = revolutions(record.axis, 2 * np.pi * turning * ratio * record.axis, value - value.mean(axis=1, keepdims=True))
                for what, part in enumerate((cut.repeatable, cut.nonrepeatable.reshape(len(own), -1))):
                    parts[what, own, 0, k], parts[what, own, 1, k] = part.std(axis=1), np.ptp(part, axis=1)
        repeatable, nonrepeatable = (tuple(PartBeside(node, *map(float, p[0]), *map(float, p[1])) for node, p in zip(seen.nodes, part, strict=True)) for part in parts)
        return repeatable, nonrepeatable
    power = np.zeros((2, 2, n))
    for k, lines in enumerate(([(s.frequency, s.phasor) for s in seen.seen], waves)):
        for f, phasor in lines:
            power[_whole(f, turning * ratios).astype(int), k, np.arange(n)] += np.abs(phasor) ** 2 / 2
    rms: Array = np.sqrt(power)
    nonrepeatable, repeatable = (
        tuple(PartBeside(node, float(m), float(c), None, None) for node, m, c in zip(seen.nodes, *own, strict=True)) for own in rms
    )
    return repeatable, nonrepeatable


def _whole(frequency: float, turning: Array) -> NDArray[np.bool_]:
    """Whether a frequency is a whole multiple of each of some turning frequencies (Hz)."""
    return np.asarray(np.abs(frequency / turning - np.round(frequency / turning)) < 1e-6)
