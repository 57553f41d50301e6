"""The grid of a resonance map: conditions of one spindle with their modes followed from one to the
next, and the crossings of lines and modes between its places, and just beyond them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.bearing.kinematics import Line, lines, row_kinematics
from thermospindle.model.built.drawn import PLAUSIBLE, drawn
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import NoEquilibrium, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import Mode, modes
from thermospindle.model.rotor.poles import LARGE
from thermospindle.model.types import Array
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.between import Between, between, passes_zero, strengths
from thermospindle.sim.resonance.between import runout as between_runout
from thermospindle.sim.resonance.critical import SENSE
from thermospindle.sim.resonance.found import NEARBY, Coincidence, Curve, Interpolated, LineTrack, Track
from thermospindle.sim.resonance.point import Exact, key, line_amplitudes, nrro_rms, with_imperfections
from thermospindle.sim.running.probes import speed_ratio

CLOSE = 1e-3  # Hz, of line and mode at a crossing
BEYOND = 1.6  # times the highest mode at the nominal condition, up to which modes are looked for at others
EXACT = 60  # crossings of a flexible spindle that are found exactly
STRONGEST = 6  # of those beyond the grid that are
PARTS = 20  # of many crossings, after each of which progress is told


@dataclass(frozen=True, eq=False)
class Candidate:
    """A change of sign of line less mode between two neighbours of the grid, `ends` with that
    difference (Hz) at each; `between` is the crossing as interpolated."""

    line: LineTrack
    track: Track
    ends: tuple[tuple[tuple[float, float], float], tuple[tuple[float, float], float]]
    between: Between
    margin: float
    at_nominal_speed: bool


def same_direction(line: Line, track: Track) -> bool:
    """Whether a line moves along what a mode does: an axial line an axial mode, a radial one others."""
    return (line.direction == "axial") == (track.kind == "axial")


def _each(
    find: Callable[[Candidate], Coincidence | None], candidates: Sequence[Candidate], progress: Callable[[str], None]
) -> dict[int, Coincidence]:
    """What is found of all candidates, by their identity; `progress` is told `PARTS` times."""
    found = {}
    for k, candidate in enumerate(candidates, 1):
        answer = find(candidate)
        if answer is not None:
            found[id(candidate)] = answer
        if k * PARTS // len(candidates) > (k - 1) * PARTS // len(candidates):
            progress(f"{k} of {len(candidates)} crossings")
    return found


class Grid:
    """Evaluates conditions of one spindle and follows its modes; conditions found once are kept."""

    def __init__(self, spindle: Spindle, nominal: Condition, multiples: int, highest: float, imperfections: Imperfections | None):
        self.spindle, self.nominal, self.multiples = spindle, nominal, multiples
        first = operating_point(spindle, nominal)
        self.ratio = speed_ratio(spindle)
        self.given, self.drawn_from = imperfections, None
        if imperfections is None and first.imperfections == Imperfections():
            self.given, self.drawn_from = drawn(spindle, PLAUSIBLE), PLAUSIBLE
        start = modes(first.chain, highest=highest)
        self.first = dict(enumerate(start, 1))
        self.reach = BEYOND * highest
        self.kept: dict[tuple[float, float], Exact] = {}
        self.lit: dict[tuple[float, float], Exact] = {}  # the same with the map's imperfections
        self.every: dict[tuple[int, int], Exact] = {}  # by place on the grid

    def exact(self, condition: Condition, near: Mapping[int, Mode]) -> Exact:
        """A condition, its modes followed from those `near` it."""
        place = (condition.temperature, condition.speed)
        if place not in self.kept:
            point = operating_point(self.spindle, condition)
            linear = matrices(point.chain)
            found = modes(point.chain, linear, self.reach if len(linear.mass) > LARGE else np.inf)
            partners = follow(linear.mass, list(near.values()), found)
            own = {k: found[p] for k, p in zip(near, partners, strict=True) if p >= 0}
            kin = row_kinematics(point.spindle, point.state)
            here = {key(line): line for line in lines(point.spindle, kin, condition.speed, self.multiples)}
            self.kept[place] = Exact(point, own, here, self.multiples)
        return self.kept[place]

    def excited(self, found: Exact) -> Exact:
        """The same with the map's imperfections, where they are not the condition's own."""
        if self.given is None:
            return found
        place = (found.point.condition.temperature, found.point.condition.speed)
        if place not in self.lit:
            self.lit[place] = replace(found, point=with_imperfections(found.point, self.given))
        return self.lit[place]

    def follow(self, over_t: Array, over_s: Array, progress: Callable[[str], None]) -> tuple[tuple[Track, ...], tuple[LineTrack, ...]]:
        t0, s0 = (int(np.searchsorted(a, v)) for a, v in ((over_t, self.nominal.temperature), (over_s, self.nominal.speed)))

        def walk(i: int, j: int, near: Mapping[int, Mode]) -> Mapping[int, Mode]:
            self.every[i, j] = self.exact(Condition(float(over_t[i]), float(over_s[j])), near)
            return self.every[i, j].modes

        for way in (range(t0, len(over_t)), range(t0, -1, -1)):
            near: Mapping[int, Mode] = self.first
            for i in way:
                near = walk(i, s0, near)
        for i in range(len(over_t)):
            for way in (range(s0 + 1, len(over_s)), range(s0 - 1, -1, -1)):
                near = self.every[i, s0].modes
                for j in way:
                    near = walk(i, j, near)
            progress(f"modes at {over_t[i]:g} C over speed")
        shape = (len(over_t), len(over_s))
        tracks = {k: np.full(shape, np.nan) for k in self.first}
        keys = list(dict.fromkeys(k for e in self.every.values() for k in e.lines))
        along = {k: np.full(shape, np.nan) for k in keys}
        for place, found in self.every.items():
            for k, mode in found.modes.items():
                tracks[k][place] = mode.frequency
            for which, line in found.lines.items():
                along[which][place] = line.frequency
        for values in along.values():
            values[:, over_s == 0.0] = 0.0  # nothing turns, so every line stands at zero
        samples = {which: line for e in self.every.values() for which, line in e.lines.items()} | dict(self.every[t0, s0].lines)
        amplitude = line_amplitudes(self.excited(self.every[t0, s0]))
        return (
            tuple(Track(k, m.kind, m.whirl, tracks[k], m.damping_ratio) for k, m in self.first.items()),
            tuple(LineTrack(samples[which], along[which], amplitude.get(which, 0.0)) for which in keys),
        )

    # ------------------------------------------------------------ crossings

    def candidates(
        self, own: LineTrack, track: Track, gap: Array, curve: Curve, over_t: Array, over_s: Array, nominal: tuple[int, int]
    ) -> list[Candidate]:
        """Crossings at the nominal speed along temperature, and along speed at the temperature nearest to the nominal one that has any."""
        t0, s0 = nominal
        margin = float(gap[t0, s0] / track.frequency[t0, s0])
        found = []
        for i in np.flatnonzero(passes_zero(gap[:, s0])):
            low, high = (((float(over_t[k]), float(over_s[s0])), float(gap[k, s0])) for k in (i, i + 1))
            at = between(over_t, gap[:, s0], track.frequency[:, s0], int(i))
            found.append(Candidate(own, track, (low, high), at, margin, True))
        if len(curve.temperature):
            row = int(np.argmin(np.abs(over_t - curve.temperature[np.argmin(np.abs(curve.temperature - self.nominal.temperature))])))
            for j in np.flatnonzero(passes_zero(gap[row])):
                low, high = (((float(over_t[row]), float(over_s[k])), float(gap[row, k])) for k in (j, j + 1))
                at = between(over_s, gap[row], track.frequency[row], int(j))
                found.append(Candidate(own, track, (low, high), at, margin, False))
        return found

    def met(self, candidates: Sequence[Candidate], progress: Callable[[str], None]) -> tuple[dict[int, Coincidence], Interpolated | None]:
        """The coincidences, by the identity of their candidates. A spindle of rigid bodies has each found exactly; of a
        flexible one with more than `EXACT` candidates only so many strongest are, and the others stand as interpolated."""
        flexible = len(next(iter(self.kept.values())).point.chain.dofs) > LARGE
        rough: dict[int, Coincidence] = {}
        chosen = list(candidates)
        if flexible and len(candidates) > EXACT:
            rough = _each(self.interpolated, candidates, progress)
            chosen = sorted((c for c in candidates if id(c) in rough), key=lambda c: -rough[id(c)].strength)[:EXACT]
        exact = _each(self.crossing, chosen, progress)
        if not rough:
            return exact, None
        apart = [(rough[k], exact[k]) for k in exact]
        frequency = [abs(a.frequency / b.frequency - 1) for a, b in apart]
        strength = [abs(a.strength / b.strength - 1) for a, b in apart if b.strength > 0]
        rest = {k: c for k, c in rough.items() if k not in {id(c) for c in chosen}}
        worst = max(frequency, default=0.0), float(np.median(strength or [0.0])), max(strength, default=0.0)
        return exact | rest, Interpolated(len(rest), len(apart), *worst)

    def interpolated(self, c: Candidate) -> Coincidence | None:
        """The crossing between two neighbours of the grid by what is known at both, or None where the line cannot excite the mode."""
        which, number = key(c.line.line), c.track.number
        (a, _), (b, _) = c.ends
        ends = self.excited(self.kept[a]), self.excited(self.kept[b])
        share, frequency = c.between.share, c.between.frequency
        found = strengths(ends, share, number, which)
        if found is None or found[0] < SENSE:
            return None
        condition = Condition(a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
        line = next(e.lines[which] for e in (ends if share < 0.5 else ends[::-1]) if which in e.lines)
        nrro = between_runout(ends, share, number, which, frequency)[1 if c.line.line.direction == "axial" else 0]
        return Coincidence(
            replace(line, frequency=frequency), c.track, condition, frequency, frequency, *found, c.margin, nrro, c.at_nominal_speed, interpolated=True, ratio=self.ratio
        )

    def crossing(self, c: Candidate) -> Coincidence | None:
        """The crossing between two neighbours of the grid, or None where the line cannot excite the mode.

        False position with Illinois' correction on the exact operating point, to `CLOSE`.
        """
        own, track = c.line, c.track
        which = key(own.line)
        (a, low), (b, high) = c.ends
        near = self.kept[a].modes
        share_a, share_b, side = 0.0, 1.0, 0
        for _ in range(60):
            share = share_a + (share_b - share_a) * low / (low - high)
            condition = Condition(a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
            here = self.exact(condition, near)
            if track.number not in here.modes or which not in here.lines:
                return None
            line, mode = here.lines[which], here.modes[track.number]
            gap = line.frequency - mode.frequency
            if abs(gap) < CLOSE:
                break
            if gap * low < 0:
                share_b, high, low = share, gap, low / 2 if side == 1 else low
                side = 1
            else:
                share_a, low, high = share, gap, high / 2 if side == -1 else high
                side = -1
        else:
            return None  # a jump of the followed mode, not a crossing
        excited = self.excited(here)
        sense, strength, unit = excited.amplitudes(track.number, which)
        if sense < SENSE:
            return None
        nrro = float(nrro_rms(excited)[1 if own.line.direction == "axial" else 0])
        return Coincidence(line, track, condition, line.frequency, mode.frequency, sense, strength, unit, c.margin, nrro, c.at_nominal_speed, ratio=self.ratio)

    def beyond(self, tracks: Sequence[Track], of_lines: Sequence[LineTrack], over_s: Array, nominal: tuple[int, int]) -> tuple[Coincidence, ...]:
        """What is met within `NEARBY` outside the speeds at the nominal temperature, strongest
        first, of which the first few are found exactly; nothing where there is no such state."""
        candidates = [c for edge, step in ((len(over_s) - 1, 1), (0, -1)) for c in self._further(tracks, of_lines, over_s, nominal, edge, step)]
        rough = [(c, near) for c in candidates if (near := self.interpolated(c)) is not None]
        rough.sort(key=lambda pair: -pair[1].strength)
        found = [self.crossing(c) if k < STRONGEST else near for k, (c, near) in enumerate(rough)]
        return tuple(sorted((c for c in found if c is not None), key=lambda c: -c.strength))

    def _further(
        self, tracks: Sequence[Track], of_lines: Sequence[LineTrack], over_s: Array, nominal: tuple[int, int], edge: int, step: int
    ) -> Iterator[Candidate]:
        """Crossings between the speed of number `edge`, the grid's first or last, and `NEARBY` further on in the sense of `step`."""
        t0 = nominal[0]
        condition = Condition(self.nominal.temperature, float(over_s[edge]) * (1 + step * NEARBY))
        if not condition.speed:
            return
        try:
            out = self.exact(condition, self.every[t0, edge].modes)
        except (NoEquilibrium, OutsideRange):
            return
        at = len(over_s) if step > 0 else 0
        first, places = min(edge, at), np.insert(over_s, at, condition.speed)
        for own in of_lines:
            for track in tracks:
                line, mode = out.lines.get(key(own.line)), out.modes.get(track.number)
                if line is None or mode is None or not same_direction(own.line, track):
                    continue
                of_mode = np.insert(track.frequency[t0], at, mode.frequency)
                gap = np.insert(own.frequency[t0], at, line.frequency) - of_mode
                if gap[first] * gap[first + 1] < 0:
                    low, high = (((condition.temperature, float(places[k])), float(gap[k])) for k in (first, first + 1))
                    margin = float((own.frequency[nominal] - track.frequency[nominal]) / track.frequency[nominal])
                    yield Candidate(own, track, (low, high), between(places, gap, of_mode, first), margin, False)

    def nrro(self, condition: Condition, near: tuple[int, int]) -> tuple[float, float]:
        """Radial and axial NRRO (m rms) at a condition, given the place of its neighbour on the grid; nothing at rest."""
        return nrro_rms(self.excited(self.exact(condition, self.every[near].modes)))
