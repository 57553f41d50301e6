"""Runout of a spindle in its steady state from the lines alone, exactly and without a record: what a study of many spindles asks of each.

At constant speed every probe sees a sum of lines. Those at whole multiples of the speed of what it sees repeat in every
revolution and are the RRO; all others are the NRRO, whose root mean square follows from their amplitudes (Parseval). Six
times that is how drives are specified; a peak to valley value of the NRRO would be one of a record, and go with its length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.excitation import harmonics, response
from thermospindle.sim.running.probes import hub_probes, probe_rows, speed_ratio
from thermospindle.sim.running.revolutions import from_orders

SAME = 1e-9  # relative difference of frequencies that are one line
LEAST = 1e-15  # m: less is rounding
ANGLES = 64  # of a revolution, for each period of the highest order


@dataclass(frozen=True)
class SteadyRunout:
    """Of one probe (m): the repeatable part from peak to valley, and six standard deviations of the rest."""

    repeatable: float
    six_sigma: float


def steady_runout(point: OperatingPoint) -> dict[str, SteadyRunout]:
    """What the hub's probes see, by name. BadInput at rest."""
    rate = abs(point.condition.speed * speed_ratio(point.spindle)) / (2 * np.pi)
    if rate == 0:
        raise BadInput("a spindle at rest has no runout")
    probes = hub_probes(point.spindle)
    excited = harmonics(point)
    if not len(excited.frequency):
        return {p.name: SteadyRunout(0.0, 0.0) for p in probes}
    frequency, phasor = _together(excited.frequency, response(point, excited) @ probe_rows(point, probes).T)
    orders = np.round(frequency / rate)
    whole = np.abs(frequency - orders * rate) <= SAME * np.maximum(frequency, rate)
    rest = np.sqrt((np.abs(phasor[~whole]) ** 2).sum(axis=0) / 2)
    own = orders[whole].astype(int)
    angle = np.linspace(0, 2 * np.pi, ANGLES * max(int(own.max(initial=1)), 1), endpoint=False)
    mean = from_orders(angle, phasor[whole].T, own.tolist())
    values = np.stack([np.ptp(mean, axis=1), 6 * rest], axis=1)
    values[values < LEAST] = 0.0
    return {p.name: SteadyRunout(*row) for p, row in zip(probes, values.tolist(), strict=True)}


def _together(frequency: Array, phasor: ComplexArray) -> tuple[Array, ComplexArray]:
    """Lines (n,) Hz with phasors (n, probes), those of one frequency added up."""
    order = np.argsort(frequency)
    rising = frequency[order]
    first = np.append(0, np.flatnonzero(np.diff(rising) > SAME * rising[1:]) + 1)
    return rising[first], np.add.reduceat(phasor[order], first, axis=0)
