"""How alike measured and computed FRFs are: by FRF, by band, line by line, and after a shift in frequency.

With x measured and a computed, x^H a = sum of conj(x) a:

=====  =========================================  ===================================================================
FRAC   |x^H a|^2 / (x^H x  a^H a)                 shape of one FRF over its lines; blind to a scale
CSAC   |x^H a|^2 / (x^H x  a^H a)                 shape at one line, over all FRFs of a test; blind to a scale
CSF    2 |x^H a| / (x^H x + a^H a)                amplitude and shape, over the same; one only where x = a but for a phase
FDAC   |x(f)^H a(g)|^2 / (x(f)^H x(f) a(g)^H a(g))  shape at two different lines: where it is largest, g / f - 1 is the model's shift
=====  =========================================  ===================================================================

Sources: FRAC: Heylen, Lammens 1996. CSAC, CSF (cross signature assurance criterion and scale factor): Dascotte, Strobbe, *Updating
finite element models using FRF correlation functions*, IMAC XVII 1999, which are the global shape and amplitude criteria of Grafe,
*Model updating of large structural dynamics models using measured response functions*, Imperial College 1998. FDAC: Pascual,
Golinval, Razeto, *A frequency domain correlation technique for model correlation and updating*, IMAC XV 1997, here squared like MAC, and
over all FRFs of a test at once. Bands are thirds of an octave, IEC 61260-1: base ten about 1000 Hz.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from thermospindle.diagnosis.prediction.partners import BELIEVABLE
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.beside import Beside

SILENT = 1e-6  # of the largest FRF of the test; smaller computed ones are forbidden by symmetry and have no shape to compare
FEWEST = 8  # lines of a band that is worth a number
LOUDER, NEARLY = 3.0, 0.25  # dB, from which a factor that all FRFs share is told; within which, or within this part of it, they share it
CERTAIN = 3.0  # times the median second difference of its lines, 2.4 times their noise, by which an FRF stands clear of noise
OFF, CLEAR, FEWEST_SENSORS = 0.06, 2.5, 2  # ln, and times the scatter of all else, by which FRFs of one sensor stand off from those of so many others: calibrations are known to 2 or 3 %
SHIFT_STEP = 5e-4  # relative, between the shifts tried
DISTINCT = 0.05  # by how much FDAC must vary over the shifts tried for one of them to be the best
THIRD = 10**0.1  # ratio of neighbouring third-octave band centres

Pair = tuple[int, int]  # response node, reference node


def assurance(a: ComplexArray, b: ComplexArray) -> float | None:
    """|a^H b|^2 / (|a|^2 |b|^2): the MAC of two shapes, the FRAC of two FRFs; None where one of them is zero."""
    size = float(np.vdot(a, a).real * np.vdot(b, b).real)
    return min(1.0, float(abs(np.vdot(a, b)) ** 2) / size) if size > 0 else None


def scale_factor(a: ComplexArray, b: ComplexArray) -> float:
    """2 |a^H b| / (|a|^2 + |b|^2), the CSF; zero where one of them is zero, NaN where both are."""
    size = float(np.vdot(a, a).real + np.vdot(b, b).real)
    return 2 * float(abs(np.vdot(a, b))) / size if size > 0 else float("nan")


def bands(low: float, high: float) -> list[tuple[float, float]]:
    """Third-octave bands (Hz) that meet [low, high], the outer ones cut there."""
    first, last = (int(np.floor(10 * np.log10(f / 1000) + 0.5)) for f in (low, high))
    edges = [1000 * THIRD ** (k - 0.5) for k in range(first, last + 2)]
    cut = np.clip(edges, low, high)
    return [(float(a), float(b)) for a, b in pairwise(cut) if b > a]


@dataclass(frozen=True)
class Shape:
    """Correlation of one FRF over some lines; None where symmetry forbids an answer."""

    frac: float | None
    csf: float | None


@dataclass(frozen=True)
class Band:
    """Correlation in one band (Hz): means of CSAC and CSF over its lines, the largest mean of FDAC over shifts, and each FRF.

    `shift` is that of the largest mean FDAC, computed over measured frequency - 1; None where FDAC does not separate shifts up to
    `BELIEVABLE` apart or is still rising at the end of them. Without a shift the mean FDAC is `csac`.
    """

    low: float
    high: float
    lines: int
    csac: float
    csf: float
    fdac: float
    shift: float | None
    by_frf: Mapping[Pair, Shape]


@dataclass(frozen=True, eq=False)
class Correlation:
    """Measured and computed FRFs of one test: `measured`, `computed` (responses, references, n) at `frequency` (n,) Hz.

    `csac`, `csf` (n,) line by line; `whole` and `bands` sum up.
    """

    beside: Beside
    computed: ComplexArray
    csac: Array
    csf: Array
    whole: Band
    bands: tuple[Band, ...]

    @property
    def frequency(self) -> Array:
        return self.beside.measured.frequency

    @property
    def measured(self) -> ComplexArray:
        return self.beside.measured.value

    @cached_property
    def pairs(self) -> dict[Pair, tuple[int, int]]:
        """Indices of every (response node, reference node)."""
        frf = self.beside.measured
        return {(r, h): (i, j) for i, r in enumerate(frf.response_nodes) for j, h in enumerate(frf.reference_nodes)}

    def responds(self, pair: Pair) -> bool:
        """Whether the model answers at all at this pair; symmetry forbids some."""
        size = np.linalg.norm(self.computed, axis=-1)
        return bool(size[self.pairs[pair]] > SILENT * size.max())

    def fdac(self, measured_lines: Sequence[int], computed_lines: Sequence[int]) -> Array:
        """FDAC (computed lines, measured lines)."""
        x, a = (_unit(_stacked(v)[:, list(k)]) for v, k in ((self.measured, measured_lines), (self.computed, computed_lines)))
        return np.abs(a.conj().T @ x) ** 2


def correlate(beside: Beside) -> Correlation | None:
    """All correlations of one test; None where no bearing is in contact at its condition."""
    if not beside.held:
        return None
    frequency, measured = beside.measured.frequency, beside.measured.value
    computed = beside.computed(frequency)
    x, a = _stacked(measured), _stacked(computed)
    inner = np.abs(np.sum(x.conj() * a, axis=0))
    sizes = np.array([np.sum(np.abs(v) ** 2, axis=0) for v in (x, a)])
    csac = np.minimum(1.0, inner**2 / np.maximum(sizes[0] * sizes[1], 1e-300))
    csf = 2 * inner / np.maximum(sizes[0] + sizes[1], 1e-300)
    shifts, shifted = _shifted_fdac(beside, frequency, x)
    found = Correlation(beside, computed, csac, csf, _nothing(frequency), ())

    def band(low: float, high: float, last: bool) -> Band | None:
        inside = (frequency >= low) & ((frequency <= high) if last else (frequency < high))
        if inside.sum() < FEWEST:
            return None
        by_shift = shifted[:, inside].mean(axis=1)
        by_frf = {}
        for pair, (i, j) in found.pairs.items():
            one = (measured[i, j, inside], computed[i, j, inside])
            by_frf[pair] = Shape(assurance(*one), scale_factor(*one)) if found.responds(pair) else Shape(None, None)
        means = (float(csac[inside].mean()), float(csf[inside].mean()), float(by_shift.max()))
        return Band(low, high, int(inside.sum()), *means, _best(shifts, by_shift), by_frf)

    parts = bands(float(frequency[0]), float(frequency[-1]))
    every = [b for low, high in parts if (b := band(low, high, high == parts[-1][1])) is not None]
    whole = band(float(frequency[0]), float(frequency[-1]), True)
    return Correlation(beside, computed, csac, csf, whole or _nothing(frequency), tuple(every))


def of_sensors(tests: Sequence[Correlation]) -> dict[int, Array]:
    """By response node, in ln, by how much measured FRFs are larger than computed ones: the median
    over the louder half of the lines of each FRF that the model answers, in any test, as far as
    they stand clear of what they scatter by from line to line: noise makes small ones larger."""
    found: dict[int, list[float]] = {}
    for c in tests:
        for (response, reference), (i, j) in c.pairs.items():
            measured, computed = np.abs(c.measured[i, j]), np.abs(c.computed[i, j])
            noise = np.median(np.abs(np.diff(c.measured[i, j], n=2))) if measured.size > 2 else 0.0
            loud = (computed >= np.median(computed)) & (measured > CERTAIN * noise)
            if c.responds((response, reference)) and loud.any():
                found.setdefault(response, []).append(float(np.median(np.log(measured[loud] / computed[loud]))))
    return {node: np.array(ratios) for node, ratios in found.items()}


def off_alone(tests: Sequence[Correlation]) -> dict[int, tuple[float, float]]:
    """Response nodes of which all FRFs are larger or smaller than computed by a factor, and by how much
    (relative) those of all others are at most: that stand off from the others by `OFF` and by `CLEAR`
    times as far as all else differs. A shape (MAC), COMAC and FRAC are blind to a factor of a sensor."""
    every = of_sensors(tests)
    whole = {node: float(np.median(ratios)) for node, ratios in every.items()}
    found = {}
    for node, own in whole.items():
        others = np.array([ratio for other, ratio in whole.items() if other != node])
        if len(others) >= FEWEST_SENSORS:
            middle = float(np.median(others))
            scatter = max(np.abs(others - middle).max(), np.abs(every[node] - own).max())
            if abs(own - middle) > max(OFF, CLEAR * scatter):
                found[node] = float(np.expm1(own - middle)), float(np.expm1(np.abs(others - middle).max()))
    return found


def in_common(tests: Sequence[Correlation]) -> float | None:
    """dB by which measured FRFs are larger than computed ones, where that is much and alike in all of them: no
    mode tells of it, but a unit, a sensitivity or a mass would make it. None where it is little, or they differ."""
    ratios = [
        np.median(20 * np.log10(np.abs(c.measured[i, j]) / np.abs(c.computed[i, j]), where=np.abs(c.measured[i, j]) > 0, out=np.zeros(len(c.frequency))))
        for c in tests
        for pair, (i, j) in c.pairs.items()
        if c.responds(pair)
    ]
    whole = float(np.median(ratios)) if ratios else 0.0
    return whole if abs(whole) > LOUDER and np.abs(np.array(ratios) - whole).max() < max(LOUDER, NEARLY * abs(whole)) else None


def _nothing(frequency: Array) -> Band:
    """The band of a test with too few lines to say anything."""
    return Band(float(frequency[0]), float(frequency[-1]), len(frequency), np.nan, np.nan, np.nan, None, {})


def _stacked(value: ComplexArray) -> ComplexArray:
    """All FRFs (responses x references, n) as one vector a line."""
    return value.reshape(-1, value.shape[-1])


def _unit(vectors: ComplexArray) -> ComplexArray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=0), 1e-300)


def _shifted_fdac(beside: Beside, frequency: Array, x: ComplexArray) -> tuple[Array, Array]:
    """Relative shifts (k,), and the FDAC (k, n) of the measured lines with the computed ones shifted by each.

    Computed FRFs are taken on a logarithmic axis with steps of `SHIFT_STEP`, so that a shift is a number of places.
    """
    reach = int(np.ceil(np.log1p(BELIEVABLE) / SHIFT_STEP))
    first = np.log(frequency[0]) - reach * SHIFT_STEP
    place = np.round((np.log(frequency) - first) / SHIFT_STEP).astype(int)
    grid = np.exp(first + SHIFT_STEP * np.arange(place[-1] + reach + 1))
    a, unit = _unit(_stacked(beside.computed(grid))), _unit(x).conj()
    steps = np.arange(-reach, reach + 1)
    return np.expm1(steps * SHIFT_STEP), np.array([np.abs(np.sum(unit * a[:, place + k], axis=0)) ** 2 for k in steps])


def _best(shifts: Array, by_shift: Array) -> float | None:
    """The shift with the largest mean FDAC, between the steps by a parabola."""
    k = int(np.argmax(by_shift))
    if np.ptp(by_shift) < DISTINCT or k in (0, len(shifts) - 1):
        return None
    left, here, right = by_shift[k - 1 : k + 2]
    bend = left - 2 * here + right
    return float(shifts[k] + (0.5 * (left - right) / bend if bend < 0 else 0.0) * (shifts[k + 1] - shifts[k]))


def frac(found: Correlation) -> dict[Pair, float | None]:
    """FRAC of every response and reference over all lines."""
    return {p: assurance(found.measured[ij], found.computed[ij]) if found.responds(p) else None for p, ij in found.pairs.items()}


def comac(nodes: Sequence[int], pairs: Sequence[tuple[ComplexArray, ComplexArray]]) -> dict[int, float | None]:
    """COMAC of every point over pairs of shapes: (sum |a b|)^2 / (sum |a|^2 sum |b|^2), shapes of unit length; Lieven, Ewins 1988."""
    units = [(np.abs(a) / np.linalg.norm(a), np.abs(b) / np.linalg.norm(b)) for a, b in pairs if b.any()]
    if not units:
        return {}
    a, b = (np.array([u[k] for u in units]) for k in (0, 1))
    size = np.sum(a**2, axis=0) * np.sum(b**2, axis=0)
    value = np.sum(a * b, axis=0) ** 2
    return {node: float(v / s) if s > 0 else None for node, v, s in zip(nodes, value, size, strict=True)}
