"""Hammer pulses: force over time as controls known before the simulation starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.model.drawing.measuring import HammerTest
from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array

PRE_TRIGGER = 2e-3  # s of record before the hit
REBOUND = (2e-3, 6e-3, 0.3)  # earliest and latest time of a second hit, s, and its share of the first


@dataclass(frozen=True)
class Hit:
    """One hit: half-sine pulses (start s, peak N) of one duration (s)."""

    pulses: tuple[tuple[float, float], ...]
    duration: float


def pulse_duration(test: HammerTest) -> float:
    """Contact time (s) of a rigid hammer on a linear tip, pi sqrt(m / k): half a period of the mass on the spring."""
    return float(np.pi * np.sqrt(test.hammer_mass / test.tip_stiffness))


def middle_of_hit(test: HammerTest) -> float:
    """Time (s) from the start of a record, half a sample before its first one, to the middle of its hit."""
    return PRE_TRIGGER + pulse_duration(test) / 2 + 0.5 / test.sample_rate


def check_band(test: HammerTest, where: str) -> None:
    """Refuse a band beyond the first zero of the half-sine's spectrum, cos(pi f T) / (1 - (2 f T)^2): it lies at f = 1.5 / T."""
    reach = 1.5 / pulse_duration(test)
    if test.band[1] >= reach:
        raise BadInput(
            f"{where}: hammer_test.band_Hz: this hammer gives no force above {reach:.0f} Hz, band_Hz goes to {test.band[1]:g} Hz; "
            "a stiffer tip (tip_stiffness_N_per_m), a lighter hammer (hammer_mass_g) or a narrower band is needed"
        )


def draw_hits(test: HammerTest, random: np.random.Generator) -> list[Hit]:
    """The hits on one hammer node, with scattered level and, as often as the scene says, a rebound."""
    hits = []
    for _ in range(test.hits):
        peak = test.level * max(1 + test.level_scatter * random.standard_normal(), 0.1)
        pulses = [(PRE_TRIGGER, float(peak))]
        if random.random() < test.double_hit_probability:
            early, late, share = REBOUND
            pulses.append((PRE_TRIGGER + float(random.uniform(early, late)), share * float(peak)))
        hits.append(Hit(tuple(pulses), pulse_duration(test)))
    return hits


def force(hit: Hit, step: float, steps: int) -> Array:
    """Force (steps,) held over each integration step: the mean of the pulse over the step, so that its impulse is exact."""
    edges = np.arange(steps + 1) * step
    total = np.zeros(steps)
    for start, peak in hit.pulses:
        phase = np.pi * np.clip((edges - start) / hit.duration, 0, 1)
        total += peak * hit.duration / np.pi * np.diff(-np.cos(phase)) / step
    return total
