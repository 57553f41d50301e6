"""Lines of known frequency in a record: their phasors by least squares, which causes they have, and what no cause explains.

A least-squares fit of sines and cosines at the frequencies that theory names has none of the leakage that the bins of a Fourier transform
have, and parts lines much closer than a bin. Lines nearer than half a bin are fitted as one, at the middle of the record, where their sum
is well known whatever their shares; the shares then come from the linear prediction. Across the axis a line is an ellipse, the sum of a
forward and a backward circle: z = x + i y = F exp(i w t) + conj(B) exp(-i w t) with F = (X + i Y) / 2 and B = (X - i Y) / 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.types import Array, ComplexArray

SNAP = 0.02  # of a bin: nearer than this to another frequency, a record cannot tell the two apart and one is fitted
HIGHEST = 0.45  # of the sample rate: the highest line looked for, below half of it with room for the filter
TOGETHER = 0.5  # of a bin: lines nearer than this are fitted as one
CUTOFF = 1e-12  # of the largest eigenvalue of the normal equations
LEAST = 0.01  # of the strongest line, and
ABOVE_FLOOR = 6.0  # times the median of the residual's spectrum: smallest peak that is called an unexplained line
ROUNDING = 1e-6  # of the strongest line of all: below it a line is rounding
MOST = 20  # unexplained lines looked for
SLICE = 2_000_000  # numbers held at a time of what is worked out for every sample
MOST_WHOLE = 300  # multiples looked for where what is seen turns more slowly than the spindle, beyond those of the spindle and of theory


@dataclass(frozen=True, eq=False)
class Fit:
    """Phasors (probes, k) m at `frequency` (k,) Hz, referred to time zero, value = Re(phasor exp(2 pi i f t)); mean (probes,) m; and what
    is left of the record, `residual` (probes, n) m."""

    frequency: Array
    phasor: ComplexArray
    mean: Array
    residual: Array


@dataclass(frozen=True)
class FoundLine:
    """A line of a record. `amplitude` (m, zero to peak) along the axis or the largest semi-axis of the ellipse across it,
    `forward` and `backward` the radii of its circles (0 along the axis); `order`: frequency in turning frequencies of the spindle,
    also where the part that is seen has another, whose revolutions alone `repeatable` goes by; `causes` strongest first by linear
    theory, with the `shares` (m) it gives them; none for an unexplained line; `predicted` (m): amplitude in linear theory."""

    frequency: float  # Hz
    order: float
    direction: str  # radial | axial
    amplitude: float
    forward: float
    backward: float
    repeatable: bool
    causes: tuple[Line, ...]
    shares: tuple[float, ...]
    predicted: float

    @property
    def whirl(self) -> str:
        """forward, backward, or - for axial lines."""
        if self.direction == "axial":
            return "-"
        return "forward" if self.forward >= self.backward else "backward"


def fit(time: Array, value: Array, frequency: Array) -> Fit:
    """Least squares of a record (probes, n) at evenly spaced time (n,) s on the mean and lines at `frequency` (k,) Hz, by normal equations.

    About the middle of the record sums of products of cosines and sines are Dirichlet's kernel, and those of one with the other nothing;
    exp(i w t) is what it is at the start of each piece of sqrt(n) samples times what it is within one. ValueError when the frequencies are
    more than the samples can tell. Directions in which the data say nothing (two frequencies almost the same) are left out: the phasors
    with the smallest norm.
    """
    k, n = len(frequency), len(time)
    if 2 * k + 1 > n:
        raise ValueError(f"{k} lines cannot be estimated from {n} samples")
    step, middle = float(time[-1] - time[0]) / max(n - 1, 1), (time[0] + time[-1]) / 2
    turns = np.asarray(frequency) * step
    piece = math.isqrt(n - 1) + 1
    starts = np.exp(2j * np.pi * np.outer(np.arange(0, n, piece) - (n - 1) / 2, turns))  # (pieces, k)
    within = np.exp(2j * np.pi * np.outer(np.arange(piece), turns)).view(float).reshape(piece, k, 2)  # cosines and sines
    cut = np.zeros((len(value), len(starts), piece))
    cut.reshape(len(value), -1)[:, :n] = value

    def summed(turn: Array) -> Array:
        return n * np.sinc(n * turn) / np.sinc(turn)

    apart, both = summed(turns[:, None] - turns), summed(turns[:, None] + turns)
    cosines = np.block([[(apart + both) / 2, summed(turns)[:, None]], [summed(turns), np.float64(n)]])
    seen = np.sum((cut @ within.reshape(piece, -1)).view(complex) * starts, axis=1)  # (probes, k)
    real = _solved(cosines, np.vstack([seen.real.T, value.sum(axis=1)]))
    phasor = real[:, :k] - 1j * _solved((apart - both) / 2, seen.imag.T)
    shown = np.ascontiguousarray((phasor[:, None] * starts).conj()).view(float) @ within.reshape(piece, -1).T
    residual = value - shown.reshape(len(value), -1)[:, :n] - real[:, k:]
    return Fit(np.asarray(frequency), phasor * np.exp(-2j * np.pi * frequency * middle), real[:, k], residual)


def _solved(square: Array, projected: Array) -> Array:
    """The solution (probes, m) of normal equations (m, m) for a right side (m, probes), without what `square` says nothing of."""
    scale = 1 / np.sqrt(np.diag(square))
    eigen, vectors = np.linalg.eigh(square * np.outer(scale, scale))
    kept = eigen > CUTOFF * eigen.max(initial=0.0)
    found = (vectors[:, kept] / eigen[kept]) @ (vectors[:, kept].T @ (scale[:, None] * projected))
    return np.asarray((found * scale[:, None]).T)


def slices(samples: int, each: int) -> list[slice]:
    """A record in slices, of each of whose samples so many numbers are worked out at a time."""
    length = max(1, SLICE // max(each, 1))
    return [slice(first, first + length) for first in range(0, samples, length)]


def distinct(frequency: Array, length: float) -> Array:
    """The frequencies (Hz) in order, those a record of `length` (s) cannot tell from the one below left out."""
    kept: list[float] = []
    for f in np.sort(frequency):
        if not kept or f - kept[-1] > SNAP / length:
            kept.append(float(f))
    return np.array(kept)


def groups(frequency: Sequence[float] | Array, near: float) -> list[list[int]]:
    """Indices of rising frequencies (Hz), those within `near` (Hz) of the one before together."""
    found: list[list[int]] = []
    for i, f in enumerate(frequency):
        if found and f - frequency[found[-1][-1]] <= near:
            found[-1].append(i)
        else:
            found.append([i])
    return found


def amplitude_of(phasor: ComplexArray, sense: float) -> tuple[float, float, float]:
    """Amplitude, forward and backward radius: of phasors (2,) along x and y the largest semi-axis and
    the circles' radii, `sense` of turning +-1; of one (1,) along the axis its size, and no radii."""
    if len(phasor) == 1:
        return float(abs(phasor[0])), 0.0, 0.0
    forward, backward = abs(phasor[0] + 1j * sense * phasor[1]) / 2, abs(phasor[0] - 1j * sense * phasor[1]) / 2
    return float(forward + backward), float(forward), float(backward)


# ---------------------------------------------------------------- a whole record


def find_lines(
    time: Array, value: Array, turning: float, known: Sequence[Line], predicted: ComplexArray, seen: Array | None = None
) -> tuple[tuple[FoundLine, ...], Fit]:
    """The lines of a record (probes, n) m at time (n,) s, whose first three probes look along x, y
    and the axis; strongest first, with the fit.

    `turning` is the turning frequency of the spindle (Hz, signed), `seen` those (Hz) of what probes see, that
    of the three first, left out the spindle's: its multiples are always looked for, and lines at multiples of
    the others have exactly that frequency. `known` are the lines of theory, `predicted` their phasors (known,
    3) m by linear theory. Lines below a thousandth of the strongest in their direction are left out.
    """
    length, rate = float(time[-1] - time[0]) * len(time) / (len(time) - 1), abs(turning)
    seen = np.array([rate]) if seen is None else np.abs(seen)
    below = HIGHEST * len(time) / length
    far = [line for line in known if line.frequency > below]
    if far:
        raise ValueError(f"the record is sampled too slowly for the line {far[-1].name} at {far[-1].frequency:.0f} Hz")
    highest = max((line.frequency for line in known), default=rate)
    whole = float(seen[0]) * np.arange(1, _multiples(float(seen[0]), rate, highest, below) + 1)
    of_known = (_on_multiple(line.frequency, seen, SNAP / length) for line in known)
    others = [f for f in of_known if np.abs(whole - f).min(initial=np.inf) > SNAP / length]
    candidates = distinct(np.concatenate([whole, others]), length)
    best = fit(time, value, candidates)
    extra = _unexplained(time, best, length, below)
    if len(extra):
        candidates = np.sort(np.concatenate([candidates, extra]))
        best = fit(time, value, candidates)
    middle, sense = float(time[0] + time[-1]) / 2, float(np.sign(turning))
    at_middle = [
        best.phasor[:3] * np.exp(2j * np.pi * candidates * middle),
        predicted.T * np.exp(2j * np.pi * _frequencies(known) * middle),
    ]
    found = []
    for members in groups(candidates, TOGETHER / length):
        ends = candidates[members[0]] - SNAP / length, candidates[members[-1]] + SNAP / length
        near = [i for i, line in enumerate(known) if ends[0] <= line.frequency <= ends[1]]
        for direction in ("radial", "axial"):
            own = [a[:2] if direction == "radial" else a[2:] for a in (at_middle[0][:, members], at_middle[1][:, near])]
            found.append(_told(direction, candidates[members], own[0], [known[i] for i in near], own[1], (rate, float(seen[0])), sense))
    strongest = {d: max((g.amplitude for g in found if g.direction == d), default=0.0) for d in ("radial", "axial")}
    floor = ROUNDING * max(strongest.values())
    least = {d: (max(1e-3 * s, floor), max(LEAST * s, floor)) for d, s in strongest.items()}
    kept = [g for g in found if g.amplitude > least[g.direction][not g.causes]]
    return tuple(sorted(kept, key=lambda g: -g.amplitude)), best


def _multiples(seen: float, rate: float, highest: float, below: float) -> int:
    """How many multiples of a turning frequency `seen` (Hz) to look for, up to one above the `highest` line and `below` (Hz)."""
    every, of_spindle = (int(min(highest + f, below) / f) for f in (seen, rate))
    return every if seen >= rate else min(every, max(of_spindle, MOST_WHOLE))


def _on_multiple(frequency: float, seen: Array, near: float) -> float:
    """A frequency (Hz), or the multiple of one `seen` that is `near` it (Hz): the same line, but for rounding of the speed."""
    multiples = seen * np.maximum(np.round(frequency / seen), 1)
    closest = int(np.abs(multiples - frequency).argmin())
    return float(multiples[closest]) if abs(multiples[closest] - frequency) <= near else frequency


def _frequencies(known: Sequence[Line]) -> Array:
    return np.array([line.frequency for line in known])


def _told(
    direction: str, frequency: Array, phasor: ComplexArray, near: list[Line], expected: ComplexArray, rates: tuple[float, float], sense: float
) -> FoundLine:
    """One line out of fitted `frequency` (k,) with `phasor` (1 or 2, k), and lines of theory `near` with `expected` (1 or 2, near);
    `rates` (Hz) of the spindle, which orders are told in, and of the part that is seen, in whose revolutions a line repeats or not."""
    size, forward, backward = amplitude_of(phasor.sum(axis=1), sense)
    main = float(frequency[int(np.abs(phasor).sum(axis=0).argmax())])
    rate, seen = rates
    repeatable = abs(main / seen - round(main / seen)) < 1e-9
    shares = [amplitude_of(expected[:, i], sense)[0] if line.direction == direction else 0.0 for i, line in enumerate(near)]
    largest = max(shares, default=0.0)
    order = [i for i in np.argsort(shares)[::-1] if near[i].direction == direction and shares[i] >= 1e-9 * largest]
    if largest > 0 and not repeatable:
        main = near[order[0]].frequency
    return FoundLine(
        frequency=main,
        order=main / rate,
        direction=direction,
        amplitude=size,
        forward=forward,
        backward=backward,
        repeatable=repeatable,
        causes=tuple(near[i] for i in order),
        shares=tuple(shares[i] for i in order),
        predicted=amplitude_of(expected.sum(axis=1), sense)[0],
    )


def _unexplained(time: Array, best: Fit, length: float, below: float) -> Array:
    """Frequencies (Hz) of peaks in the residual of a fit that stand out of its floor and are not small beside the lines found."""
    step = float(time[1] - time[0])
    window = np.hanning(len(time) + 1)[:-1]
    weight = 2 * window / window.sum()
    strongest = np.abs(best.phasor[:3]).max(axis=1, initial=0.0)
    strongest[:2] = strongest[:2].max()
    residual, extra = best.residual[:3], np.zeros(0)
    if not np.all(strongest > 0):  # nothing moves, nothing to explain
        return extra

    def level(frequency: float) -> float:
        return float(np.abs((residual * weight) @ np.exp(-2j * np.pi * frequency * time) / strongest).max())

    while len(extra) < MOST:
        spectrum = np.abs(np.fft.rfft(residual * weight)) / strongest[:, None]
        frequency = np.fft.rfftfreq(len(time), step)
        spectrum = spectrum[:, (frequency > 2 / length) & (frequency < below)]
        frequency = frequency[(frequency > 2 / length) & (frequency < below)]
        probe, peak = np.unravel_index(int(spectrum.argmax()), spectrum.shape)
        if spectrum[probe, peak] < max(LEAST, ABOVE_FLOOR * float(np.median(spectrum[probe]))):
            break
        bracket = (frequency[peak] - 1 / length, frequency[peak] + 1 / length)
        refined = minimize_scalar(lambda f: -level(f), bounds=bracket, method="bounded", options={"xatol": 1e-4 / length}).x
        if np.abs(np.concatenate([best.frequency, extra]) - refined).min() < SNAP / length:
            break  # what is left beside a line that was fitted is its change in time, not another line
        extra = np.append(extra, refined)
        residual = fit(time, best.residual[:3], extra).residual
    return extra
