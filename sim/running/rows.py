"""What a bearing's waves and element sizes do: free displacements of its rings, one phasor for each line.

An imperfection is met by every element as Re(amplitude exp(i rate t)), the rate in the frame of the cage. With the pulls of `sim.running.pulls` the sum
over the elements is, of harmonic m, pull_m times the sum of amplitude_j exp(2 pi i j m / Z), at rate + m cage: orders that cancel are found to
cancel, not said to. A free displacement is that sum times the row's compliance: displaced by it, the rings feel what they felt before.

Of rows with displaced rings lines weaker than `WEAK` of the strongest that their imperfections make are left out: there are thousands.
Loose elements carry nothing and excite nothing. Waves of a roller bearing's race run straight along it and meet all rows alike,
sizes and waves of rollers stand row by row; the rows' rollers stand at the same azimuths.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from thermospindle.model.bearing import ball_row, roller
from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.bearing.kinematics import SMALLEST, Kinematics, Line, ball_line, cage_line, race_line, varying_line
from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.bearing.roller import RollerRow, RollerState
from thermospindle.model.built.imperfections import RowImperfections, Wave
from thermospindle.model.types import ComplexArray
from thermospindle.sim.running.pulls import pulls_of

CANCELLED = 1e-11
"""Share of the largest possible sum over the elements below which an order has cancelled; rounding leaves some 1e-15."""
WEAK = 1e-4
DIRECTIONS = (("radial", np.array([True, True, False, True, True])), ("axial", np.array([False, False, True, False, False])))


@dataclass(frozen=True)
class Met:
    """What elements meet: "inner" or "outer" waves of an `order`, waves of a "ball", or its "size"."""

    what: str
    order: int = 0

    def rate(self, kin: Kinematics) -> float:
        """At which it comes by (rad/s), in the frame of the cage."""
        if self.what == "size":
            return 0.0
        return self.order * (kin.spin * np.sign(kin.turning) if self.what == "ball" else kin.cage - kin.ring(self.what))

    def line(self, name: str, kin: Kinematics, m: int, direction: str) -> Line:
        """What comes of harmonic m in a direction."""
        if self.what == "size":
            return cage_line(name, kin, "ball size", abs(m), direction)
        if self.what == "ball":
            return ball_line(name, kin, self.order, direction, m)
        return race_line(name, kin, self.what, self.order, direction, self.order + m)


def free_displacements(state: BearingState | RollerState, kin: Kinematics, own: RowImperfections) -> list[tuple[Line, ComplexArray]]:
    """Free displacements (5,) m, rad of the outer ring against the inner one: phasors, read only, with the line of each."""
    carries = state.load > 0.0 if isinstance(state, RollerState) else state.in_contact
    return list(_found(state.name, state.row, state.displacement if any(state.displacement) else (), kin, own).items()) if carries else []


def cage_spread(state: BearingState | RollerState) -> float:
    """By how much of itself a row's radial stiffness changes, at most, as its elements pass where displaced rings press them; 0 between centred ones."""
    if not any(state.displacement):
        return 0.0
    q = np.array(state.displacement)
    return ball_row.cage_spread(state.row, q) if isinstance(state.row, BallRow) else roller.cage_spread(state.row, q)


@lru_cache(maxsize=128)
def _found(name: str, row: BallRow | RollerRow, displacement: tuple[float, ...], kin: Kinematics, own: RowImperfections) -> dict[Line, ComplexArray]:
    pulls = pulls_of(row, displacement)
    unit = ball_row.as_forces(pulls.lever)
    forces: dict[Line, ComplexArray] = {}

    def add(force: ComplexArray, speed: float, line: Callable[[str], Line]) -> None:
        for direction, along in DIRECTIONS:
            if force[along].any() and abs(speed) > 2 * np.pi * SMALLEST:
                which = line(direction)
                forces[which] = forces.get(which, 0) + np.where(along, force if speed > 0 else force.conj(), 0.0)

    every, amplitudes = _met(own, kin.balls, 0 if isinstance(row, BallRow) else len(row.offsets))
    harmonics, by = list(pulls.by), np.array(list(pulls.by.values()))
    if every:
        totals = amplitudes @ np.exp(2j * np.pi * np.outer(np.arange(kin.balls), harmonics) / kin.balls)  # (met, inputs, harmonics)
        totals[np.abs(totals) <= CANCELLED * np.abs(amplitudes).sum(axis=2)[:, :, None]] = 0.0
        made, largest = np.einsum("mki,nim->nmk", by, totals), np.einsum("mki,nim->nmk", np.abs(by), np.abs(totals))
        some = (np.abs(unit * made) > CANCELLED * (unit * largest).max(axis=2)[:, :, None]).any(axis=2)
        for n, k in np.argwhere(some).tolist():
            met, m = every[n], harmonics[k]
            add(made[n, k], met.rate(kin) + m * kin.cage, partial(met.line, name, kin, m))
    if displacement:
        size = {line: np.abs(unit * force).max() for line, force in forces.items()}
        least = WEAK * max(size.values(), default=0.0)
        forces = {line: force for line, force in forces.items() if size[line] >= least}
    for m, pull in pulls.perfect.items():
        if m % kin.balls == 0:
            add(kin.balls * pull, m * kin.cage, partial(varying_line, name, kin, abs(m)))
    found = {line: pulls.compliance @ force for line, force in forces.items()}
    for moved in found.values():
        moved.flags.writeable = False
    return found


@lru_cache(maxsize=128)
def _met(own: RowImperfections, elements: int, roller_rows: int) -> tuple[list[Met], ComplexArray]:
    """All that the elements of a row meet, and their amplitudes (met, inputs, elements) m by the inputs
    of `Pulls`: those of balls, or each of the `roller_rows` of rollers."""
    inputs, rows = roller_rows or 4, roller_rows or 1
    found: list[tuple[Met, ComplexArray]] = []
    place = np.exp(2j * np.pi * np.arange(elements) / elements)

    def add(what: Met, by_input: Mapping[int, ComplexArray]) -> None:
        amplitude = np.zeros((inputs, elements), complex)
        for which, one in by_input.items():
            amplitude[which] = one
        found.append((what, amplitude))

    for ring, sign, radial, axial in (("inner", -1, own.inner_radial, own.inner_axial), ("outer", 1, own.outer_radial, own.outer_axial)):
        for which, waves in enumerate((radial,) if roller_rows else (radial, axial)):
            for wave in waves:
                amplitude = sign * cmath.rect(wave.amplitude, wave.phase) * place[wave.order * np.arange(elements) % elements]
                add(Met(ring, wave.order), dict.fromkeys(range(rows), -amplitude) if roller_rows else {which: amplitude})
    if own.ball_diameter:  # half of it at either contact; a common deviation is a preload
        size = (np.array(own.ball_diameter) - np.mean(own.ball_diameter)).reshape(rows, -1)
        add(Met("size"), dict(enumerate(size)) if roller_rows else {2: size[0] / 2, 3: size[0] / 2})
    for order in sorted({wave.order for waves in own.ball_waves for wave in waves}):
        amplitude = np.array([_amplitude(waves, order) for waves in own.ball_waves]).reshape(rows, -1)
        opposite = (-1) ** order  # of the two contacts, which lie opposite each other
        add(Met("ball", order), dict(enumerate((1 + opposite) * amplitude)) if roller_rows else {2: amplitude[0], 3: opposite * amplitude[0]})
    return [met for met, _ in found], np.array([amplitude for _, amplitude in found])


def _amplitude(waves: tuple[Wave, ...], order: int) -> complex:
    return sum((cmath.rect(w.amplitude, w.phase) for w in waves if w.order == order), 0j)
