"""Where natural frequencies meet the lines of bearings and unbalance, over temperature and speed: a Campbell diagram with two axes.

Modes are followed by shape over the grid from the nominal condition, along temperature at the nominal speed and from there along speed.
A line (`model.bearing.kinematics`) crosses a mode where their difference changes sign between neighbours of the grid; the crossing is then found
with the exact operating point. It counts only where the line can excite the mode:

- an axial line an axial mode, a radial line a rocking or lateral one;
- sense of whirl: of the modal force of a line, |psi f|^2, and of the same line whirling the other way, |psi f*|^2 (psi the left modal
  vector), the line must have a share of at least `SENSE`. A forward line finds no backward mode of an isotropic rotor, and both halves of
  a pair that anisotropy has split (Genta, *Dynamics of Rotating Systems*, 2005, sec. 2.4).

How strong a crossing is: amplitude of the mode's own part of the response, phi (psi f) / (i omega - pole), at the hub's probe
(`sim.running.runout.hub_probes`), under the imperfections of the scene, and per unit of the imperfection that makes the line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.bearing.kinematics import Line, lines, row_kinematics
from thermospindle.model.drawn import drawn
from thermospindle.model.errors import BadInput
from thermospindle.model.imperfections import Imperfections
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import Mode, modes
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import operating_point
from thermospindle.sim.resonance.point import Exact, key, line_amplitudes, nrro_rms, with_imperfections

SENSE = 0.01
MULTIPLES = 3  # of the number of balls, and even ball orders, whose lines are drawn
CLOSE = 1e-3  # Hz, of line and mode at a crossing
DENSER = 6  # coincidences about which runout is computed at more places
SEED = 0  # of the imperfections of a scene that names none


@dataclass(frozen=True, eq=False)
class Track:
    """A mode over the grid: its number, kind and whirl at the nominal condition, `frequency` (T, S) in Hz, NaN where it was lost."""

    number: int
    kind: str
    whirl: str
    frequency: Array


@dataclass(frozen=True, eq=False)
class LineTrack:
    """A line over the grid, as it is at the nominal condition; `frequency` (T, S) in Hz; `amplitude` (m) of the hub in it there."""

    line: Line
    frequency: Array
    amplitude: float


@dataclass(frozen=True, eq=False)
class Coincidence:
    """A line meets a mode at a condition.

    `sense`: share of the modal force that its sense of whirl has (1: all, 1/2: a standing mode); `strength` (m, zero to peak) at the
    hub's probe under the map's imperfections, zero where they do not make this line; `unit_strength` (m) for 1 um of wave or ball size or 1 g mm;
    `margin`: (line - mode) / mode at the nominal condition; `nrro` (m rms) of all nonrepeatable lines there, in the mode's direction;
    `at_nominal_speed`: found along temperature at the nominal speed, else along speed.
    """

    line: Line
    mode: Track
    condition: Condition
    frequency: float  # Hz, of the line
    mode_frequency: float
    sense: float
    strength: float
    unit_strength: float
    margin: float
    nrro: float
    at_nominal_speed: bool


@dataclass(frozen=True, eq=False)
class Curve:
    """All crossings of one line and one mode over the grid: speed (rad/s) by temperature (C), interpolated between grid speeds."""

    line: Line
    mode: Track
    temperature: Array
    speed: Array


@dataclass(frozen=True, eq=False)
class ResonanceMap:
    """Natural frequencies and lines on the grid `temperatures` (C) x `speeds` (rad/s), and where they meet.

    `nrro_speed`, `nrro_temperature` (n, 3): place (rad/s or C), radial and axial rms (m), along speed at the nominal temperature and along
    temperature at the nominal speed, denser about the strongest coincidences. `drawn_from` is the seed of imperfections that the scene does not name, None if it does.
    """

    spindle: Spindle
    nominal: Condition
    temperatures: Array
    speeds: Array
    modes: tuple[Track, ...]
    lines: tuple[LineTrack, ...]
    curves: tuple[Curve, ...]
    coincidences: tuple[Coincidence, ...]
    nrro_speed: Array
    nrro_temperature: Array
    drawn_from: int | None

    @property
    def nominal_index(self) -> tuple[int, int]:
        """Place of the nominal condition on the grid."""
        return int(np.argmin(np.abs(self.temperatures - self.nominal.temperature))), int(
            np.argmin(np.abs(self.speeds - self.nominal.speed))
        )


def resonance_map(
    spindle: Spindle,
    temperatures: Sequence[float],
    speeds: Sequence[float],
    nominal: Condition,
    multiples: int = MULTIPLES,
    highest: float | None = None,
    imperfections: Imperfections | None = None,
    progress: Callable[[str], None] = lambda done: None,
) -> ResonanceMap:
    """The map over `temperatures` (C) and `speeds` (rad/s, not negative), to which the nominal condition is added.

    Modes up to `highest` (Hz, the scene's band by default) at the nominal condition are followed. `imperfections` default to the
    scene's (with those of its effects), or to a plausible set where it names none. BadInput for a grid without extent.
    """
    over_t = np.unique(np.array([*temperatures, nominal.temperature], float))
    over_s = np.unique(np.array([*speeds, nominal.speed], float))
    if len(over_t) < 2 or len(over_s) < 2:
        raise BadInput("temperatures and speeds: a map needs at least two different ones of each, the nominal condition included")
    if over_s[0] < 0:
        raise BadInput(f"speeds: {over_s[0] / RPM:g} rpm; a map goes over speeds of one sense, so none may be negative")
    grid = _Grid(spindle, nominal, multiples, highest or spindle.hammer.band[1], imperfections)
    tracks, of_lines = grid.follow(over_t, over_s)
    progress(f"{len(over_t)} temperatures x {len(over_s)} speeds")
    t0, s0 = int(np.searchsorted(over_t, nominal.temperature)), int(np.searchsorted(over_s, nominal.speed))
    curves, found = [], []
    for own in of_lines:
        for track in tracks:
            if not _same_direction(own.line, track):
                continue
            gap = own.frequency - track.frequency
            curve = Curve(own.line, track, *_along_speed(gap, over_t, over_s))
            kept = grid.crossings(own, track, gap, curve, over_t, over_s, (t0, s0))
            if kept:
                curves.append(curve)
                found += kept
    progress(f"{len(found)} coincidences")
    found.sort(key=lambda c: (not c.at_nominal_speed, -c.strength, c.frequency))
    crossed = [c.condition.speed for c in strongest([c for c in found if c.condition.temperature == nominal.temperature])]
    met = [c.condition.temperature for c in strongest([c for c in found if c.at_nominal_speed])]
    along_s = np.array([(s, *grid.nrro(Condition(nominal.temperature, s), (t0, _nearest(over_s, s)))) for s in _dense(over_s, crossed)])
    along_t = np.array([(t, *grid.nrro(Condition(t, nominal.speed), (_nearest(over_t, t), s0))) for t in _dense(over_t, met)])
    progress("runout along both axes")
    return ResonanceMap(spindle, nominal, over_t, over_s, tracks, of_lines, tuple(curves), tuple(found), along_s, along_t, grid.drawn_from)


def _nearest(values: Array, value: float) -> int:
    return int(np.argmin(np.abs(values - value)))


def _dense(grid: Array, places: Sequence[float]) -> list[float]:
    """The grid with some values more about the first `DENSER` places, within one step of it."""
    step = float(np.diff(grid).max())
    more = [p + share * step for p in places[:DENSER] for share in (-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5)]
    return sorted({*grid.tolist(), *(p for p in more if grid[0] <= p <= grid[-1])})


def _same_direction(line: Line, track: Track) -> bool:
    return (line.direction == "axial") == (track.kind == "axial")


def _along_speed(gap: Array, over_t: Array, over_s: Array) -> tuple[Array, Array]:
    """Temperatures and speeds where `gap` (T, S) passes zero between neighbouring speeds, by linear interpolation."""
    before, after = gap[:, :-1], gap[:, 1:]
    i, j = np.nonzero(before * after < 0)
    share = before[i, j] / (before[i, j] - after[i, j])
    return over_t[i], over_s[j] + share * (over_s[j + 1] - over_s[j])


class _Grid:
    """Evaluates conditions of one spindle and follows its modes; conditions found once are kept."""

    def __init__(self, spindle: Spindle, nominal: Condition, multiples: int, highest: float, imperfections: Imperfections | None):
        self.spindle, self.nominal, self.multiples = spindle, nominal, multiples
        first = operating_point(spindle, nominal)
        self.given, self.drawn_from = imperfections, None
        if imperfections is None and first.imperfections == Imperfections():
            self.given, self.drawn_from = drawn(spindle, SEED), SEED
        start = [m for m in modes(first.chain) if m.frequency <= highest]
        self.first = dict(enumerate(start, 1))
        self.kept: dict[tuple[float, float], Exact] = {}
        self.every: dict[tuple[int, int], Exact] = {}  # by place on the grid

    def exact(self, condition: Condition, near: Mapping[int, Mode]) -> Exact:
        """A condition, its modes followed from those `near` it."""
        place = (condition.temperature, condition.speed)
        if place not in self.kept:
            point = operating_point(self.spindle, condition)
            linear = matrices(point.chain)
            found = modes(point.chain, linear)
            partners = follow(linear.mass, list(near.values()), found)
            own = {k: found[p] for k, p in zip(near, partners, strict=True) if p >= 0}
            kin = row_kinematics(point.spindle, point.state)
            here = {key(line): line for line in lines(point.spindle, kin, self.multiples, condition.speed)}
            self.kept[place] = Exact(point, own, here, self.multiples)
        return self.kept[place]

    def excited(self, found: Exact) -> Exact:
        """The same with the map's imperfections, where they are not the condition's own."""
        return found if self.given is None else replace(found, point=with_imperfections(found.point, self.given))

    def follow(self, over_t: Array, over_s: Array) -> tuple[tuple[Track, ...], tuple[LineTrack, ...]]:
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
            tuple(Track(k, m.kind, m.whirl, tracks[k]) for k, m in self.first.items()),
            tuple(LineTrack(samples[which], along[which], amplitude.get(which, 0.0)) for which in keys),
        )

    # ------------------------------------------------------------ crossings

    def crossings(
        self, own: LineTrack, track: Track, gap: Array, curve: Curve, over_t: Array, over_s: Array, nominal: tuple[int, int]
    ) -> list[Coincidence]:
        """Crossings at the nominal speed along temperature, and along speed at the temperature nearest to the nominal one that has any."""
        t0, s0 = nominal
        margin = float(gap[t0, s0] / track.frequency[t0, s0])
        found = []
        for i in np.flatnonzero(gap[:-1, s0] * gap[1:, s0] < 0):
            ends = [((float(over_t[k]), float(over_s[s0])), float(gap[k, s0])) for k in (i, i + 1)]
            found.append(self.crossing(own, track, ends, margin, True))
        if len(curve.temperature):
            row = int(np.argmin(np.abs(over_t - curve.temperature[np.argmin(np.abs(curve.temperature - self.nominal.temperature))])))
            for j in np.flatnonzero(gap[row, :-1] * gap[row, 1:] < 0):
                ends = [((float(over_t[row]), float(over_s[k])), float(gap[row, k])) for k in (j, j + 1)]
                found.append(self.crossing(own, track, ends, margin, False))
        return [c for c in found if c is not None]

    def crossing(
        self, own: LineTrack, track: Track, ends: list[tuple[tuple[float, float], float]], margin: float, at_nominal_speed: bool
    ) -> Coincidence | None:
        """The crossing between two neighbours of the grid, or None where the line cannot excite the mode.

        False position with Illinois' correction on the exact operating point, to `CLOSE`.
        """
        which = key(own.line)
        (a, low), (b, high) = ends
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
        return Coincidence(line, track, condition, line.frequency, mode.frequency, sense, strength, unit, margin, nrro, at_nominal_speed)

    def nrro(self, condition: Condition, near: tuple[int, int]) -> tuple[float, float]:
        """Radial and axial NRRO (m rms) at a condition, given the place of its neighbour on the grid; nothing at rest."""
        return nrro_rms(self.excited(self.exact(condition, self.every[near].modes)))


def strongest(coincidences: Sequence[Coincidence]) -> list[Coincidence]:
    """Strongest first, of each cause, order, sense and mode only the bearing in which it is strongest."""
    best: dict[tuple, Coincidence] = {}
    for c in sorted(coincidences, key=lambda c: -c.strength):
        best.setdefault((c.line.cause, c.line.order, c.line.direction, c.line.whirl, c.mode.number), c)
    return list(best.values())
