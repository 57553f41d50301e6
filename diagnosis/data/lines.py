"""FRF lines of a test as the inference takes them: compressed without loss, with noise that their own scatter confirms.

A measured FRF is smooth over a few lines wherever no pole is near, so that k neighbouring lines hold p < k numbers and noise. A block of
lines is replaced by the values of its least-squares polynomial of degree p - 1 at the p Gauss nodes of the block's own discrete measure.
By discrete orthogonality (Gautschi, *Orthogonal Polynomials*, 2004, Theorem 1.31 and 1.4.1) these values have independent errors of
variance sd^2 / weight, the weights adding up to k: nothing is lost, and the model is evaluated at p frequencies instead of k. A block is
divided until what its polynomial leaves is noise; where poles are sharp, single lines remain. What blocks leave also tells the noise.
Polynomials are in the lines' numbers: a sweep whose steps grow evenly (a logarithmic one) is as smooth in these as one of even steps.
Under an exponential window the noise of neighbouring lines is correlated, which `window` takes into account where the lines show it, and so is that of values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import nnls
from scipy.sparse import block_diag, csr_array

from thermospindle.diagnosis.data.window import NONE, Alike, Window, left_by, neighbours, windowed
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Noise, Test
from thermospindle.sim.identification.frf import Frf, even, out_of, record_length
from thermospindle.sim.identification.modal import noise_model, scatter
from thermospindle.sim.identification.padding import own_lines

NODES = 5  # of a block: polynomials of degree 4
LONGEST = 160  # lines in a block
OPEN = 1.0  # standard errors of the noise of value, told between peaks, by which it may be more at them
BEYOND = 4  # polynomials of the next degrees, where what a block lacks shows first
LEFT_OUT, SCATTERING = 2, 3  # polynomials of the next degrees left out where a block tells the noise, and lines at least beyond them
LACK_OF_FIT = 4.0  # standard deviations of a block's chi2, and of that of the next degrees alone, from which it is divided
LINES_THAT_SCATTER = 50  # of an FRF at least, from whose neighbours its noise can be told
RISES = (0, 2, 4)  # powers of frequency in which the variance of noise of largest is told: a hammer's force falls, and noise over it rises; a displacement's differentiated twice is the last, from the first line on
CHANGED = 1.5  # times the step before, from which lines are another piece
FALLS = (2, 4)  # powers of 1/frequency in which the variance of an accelerometer's noise falls, as a velocity's and a displacement's
USUAL, WIDE = (1e-3, 1e-6), (1e-12, 1e-14)  # of the mean square, that count as such: of noise that is much the same over the band, and of one that falls
LOW = (0.1, 40)  # share of the band from its first line, and lines in it at least, where such noise shows
ENOUGH = 200  # degrees of freedom from which the scatter within blocks tells the noise
REPEATS, CAMPAIGN, SCATTER = "repeats", "the campaign", "scatter of neighbouring lines"
KNOWN = (REPEATS, CAMPAIGN)
SILENT = 1e-7  # of the largest value of a test: the least noise that is believed
TRUSTED = 9.0  # times less than a block showed: the least noise by which it is weighed
CONFIRMED, PARTS = 1.1, 4  # of a known noise, up to which the scatter of neighbouring lines does not contradict it in any of so many parts of the band


@dataclass(frozen=True, eq=False)
class LineData:
    """One test: `value` (n_resp, n_ref, L) at `frequency` (L,) Hz in `quantity`; `sd` alike, the standard deviation sqrt(E |error|^2).

    `noise_from` says in words where the noise was taken from, `raw` how many lines the test had; errors that go together are `alike`.
    """

    test: Test
    condition: Condition
    frequency: Array
    value: ComplexArray
    sd: Array
    quantity: str
    noise_from: str
    raw: int
    alike: Alike | None = None

    @cached_property
    def duration(self) -> float:
        """Length (s) of the record that lines so far apart are the transform of."""
        return np.inf if self.test.frf is None else record_length(self.test.frf)

    @cached_property
    def whitening(self) -> ComplexArray | None:
        """W (n_resp, n_ref, L, L) by which values, each in its standard errors, become independent; None where they are."""
        return None if self.alike is None else self.alike.hit(self.test.pretrigger or self.alike.window.pretrigger).whitening()

    def in_errors(self, value: ComplexArray) -> ComplexArray:
        """Differences (n_resp, n_ref, L) of FRFs as independent numbers, whose real and imaginary parts have unit variance."""
        return self.independent(value * (np.sqrt(2) / self.sd))

    def independent(self, scaled: ComplexArray) -> ComplexArray:
        """Values (..., n_resp, n_ref, L) in their standard errors as independent ones."""
        return scaled if self.whitening is None else _each(scaled, self.whitening)

    @property
    def smooth(self) -> float:
        """Variance of what is smooth over lines, over that of lines that are independent."""
        return 1.0 if self.alike is None else self.alike.window.smooth

    def alone(self, rows: Array) -> Array:
        """Rows (k, N) of independent numbers, the real and the imaginary part of one after the other, as numbers of every line by itself, taken for independent, with errors as large as those of what is smooth."""
        if self.whitening is None:
            return rows
        values = np.ascontiguousarray(rows).view(complex).reshape(len(rows), *self.value.shape)
        found = _each(values, np.asarray(np.linalg.inv(self.whitening), complex)) / np.sqrt(self.smooth)
        return np.ascontiguousarray(found).reshape(len(rows), -1).view(float)

    @property
    def sensors(self) -> tuple[int, ...]:
        """Nodes of the rows: what a channel is, in whatever order a test has them."""
        return () if self.test.frf is None else self.test.frf.response_nodes

    @property
    def hammers(self) -> tuple[int, ...]:
        """Nodes of the columns."""
        return () if self.test.frf is None else self.test.frf.reference_nodes

    @property
    def count(self) -> int:
        """Real numbers in the likelihood."""
        return 2 * self.value.size


def _each(value: ComplexArray, by: ComplexArray) -> ComplexArray:
    """Values (..., n_resp, n_ref, L) of every FRF times its own matrix (n_resp, n_ref, L, L)."""
    return np.ascontiguousarray((value[..., None, :] @ by)[..., 0, :] if value.ndim == 3 else np.moveaxis(np.moveaxis(value, 0, -2) @ by, -2, 0), complex)


def line_data(test: Test, condition: Condition, stated: Noise | None, expected: Noise) -> LineData:
    """The lines of a test's FRFs above 0 Hz, without those of the running speed, and without those between the lines of a record that was filled up with zeros. Noise is that of the file (repeats, coherence), or `stated` by the campaign, or found in the
    scatter of neighbouring lines, starting from what the scene's measuring chain is `expected` to have."""
    assert test.frf is not None
    frf, closer = own_lines(test.frf)
    test = replace(test, frf=frf)
    use = (frf.frequency > 0) & ~out_of(frf, test.speed).out
    frequency, value = frf.frequency[use], frf.value[:, :, use]
    steps = np.diff(frequency)
    change = np.abs(np.log(steps[1:] / steps[:-1])) > np.log(CHANGED)  # lines left out, and where another part of a sweep begins
    gaps = sorted({*(np.flatnonzero(np.diff(np.flatnonzero(use)) > 1) + 1).tolist(), *((np.flatnonzero(change) + 1).tolist() if not even(frf.frequency) else ())})
    length = record_length(frf)
    window = windowed(value, Window(test.window_decay, length, test.pretrigger)) if np.isfinite(length) else NONE
    sd, noise_from = _noise(frf, value, use, stated, expected, window)
    least = SILENT * float(np.abs(value).max())  # where symmetry forbids an answer there is rounding alone, or nothing
    sd = np.maximum(sd, least)
    falling = _falls(value, sd, window, frequency)
    if falling is not None:
        sd = np.maximum(sd, _smooth_sd(value, _scatter(value, window), frequency, falling))
    known, blocks = sd if noise_from in KNOWN else None, _blocks(value, sd, window, gaps)
    seen = _within_blocks(value, blocks, window, frequency, falling)
    if seen is None and len(frequency) > LINES_THAT_SCATTER:  # noise stated too small divides every block to single lines
        blocks = _blocks(value, np.maximum(sd, _smooth_sd(value, _scatter(value, window), frequency, falling)), window, gaps)
        seen = _within_blocks(value, blocks, window, frequency, falling)
    for _ in range(2):
        if seen is None:
            break
        sd_seen = np.maximum(np.sqrt(seen), least)
        if known is not None and _confirmed(known, sd_seen):
            sd, blocks = known, _blocks(value, known, window, gaps)
            break
        sd = sd_seen if known is None else np.maximum(known, sd_seen)
        noise_from = SCATTER if known is None else noise_from
        blocks = _blocks(value, sd, window, gaps)
        seen = _within_blocks(value, blocks, window, frequency, falling)
    at, kept, error, alike = _compressed(frequency, value, sd, blocks, window, falling)
    said = noise_from if closer == 1 else f"{noise_from}, of every {closer}{'nd' if closer == 2 else 'rd' if closer == 3 else 'th'} line: records are filled up with zeros"
    return LineData(test, condition, at, kept, error, frf.quantity, said, len(frequency), alike)


def _noise(frf: Frf, value: ComplexArray, use, stated: Noise | None, expected: Noise, window: Window) -> tuple[Array, str]:
    if frf.sd is not None and np.all(np.isfinite(frf.sd)):
        return _smooth_sd(value, frf.sd[:, :, use], frf.frequency[use]), REPEATS
    if stated is not None:
        return noise_model(value, stated.of_value, stated.of_largest), CAMPAIGN
    if value.shape[-1] <= LINES_THAT_SCATTER:
        return noise_model(value, expected.of_value, expected.of_largest), "the scene's measuring accuracy"
    return _smooth_sd(value, _scatter(value, window), frf.frequency[use]), SCATTER


def _scatter(value: ComplexArray, window: Window) -> Array:
    """Standard errors (n_resp, n_ref, n) of single lines by their neighbours', whose noise a window makes alike."""
    return np.asarray(scatter(value) / np.sqrt(neighbours(window)))


def _falls(value: ComplexArray, sd: Array, window: Window, frequency: Array) -> Array | None:
    """Shapes (shapes, n) over frequency of a noise that falls with it, where lines at the lowest `LOW`, measured by `sd`, scatter more than twice as much as the others: that
    of an accelerometer does, whose motion was integrated to a velocity or a displacement; None where it does not."""
    low = frequency <= (1 - LOW[0]) * frequency[0] + LOW[0] * frequency[-1]
    if low.sum() < LOW[1]:
        return None
    seen = _scatter(value, window) / sd
    steep = np.median(seen[..., low]) > 2 * np.median(seen[..., ~low])
    return np.array([(frequency[0] / frequency) ** power for power in FALLS]) if steep else None


def _smooth_sd(value: ComplexArray, sd: Array, frequency: Array, falling: Array | None = None) -> Array:
    """The noise of value and of largest, rising with frequency and, where given, of the shapes `falling`, that the standard errors `sd` of single lines
    follow, FRF by FRF; few hits scatter them."""
    return np.asarray(np.sqrt(np.sum(_parts(value, sd, frequency, falling), axis=0)))


def _parts(value: ComplexArray, sd: Array, frequency: Array, falling: Array | None) -> Array:
    """Variances (2, n_resp, n_ref, n) of the noise of value, and of largest."""
    size, shapes = np.abs(value), _shapes(frequency, falling)
    largest = size.max(axis=(0, 2))
    parts = np.empty((2, *sd.shape))
    for i, j in np.ndindex(*sd.shape[:2]):
        columns = np.stack([size[i, j] ** 2, *(max(largest[j], 1e-300) ** 2 * shapes)], axis=1)
        share = _gamma_fit(columns, sd[i, j] ** 2, np.ones(sd.shape[2]), WIDE if falling is not None else USUAL)
        parts[0, i, j] = share[0] * columns[:, 0]
        parts[1, i, j] = np.maximum(columns[:, 1:] @ share[1:], 1e-14 * largest[j] ** 2 - parts[0, i, j])
    return parts


def _confirmed(known: Array, seen: Array) -> bool:
    """Whether the noise that lines themselves have, in each `PARTS`-th of the band, is no more than what is known."""
    parts = np.array_split(seen**2 / known**2, PARTS, axis=-1)
    return bool(max(np.sqrt(np.mean(part)) for part in parts) < CONFIRMED)


def _shapes(frequency: Array, falling: Array | None) -> Array:
    """Shapes (shapes, n) over the lines of a noise of largest: level, rising, and `falling` where given."""
    rising = (frequency / frequency[-1]) ** np.array(RISES)[:, None]
    return rising if falling is None else np.concatenate([rising, falling])


def _basis(k: int, p: int = NODES) -> tuple[Array, Array, Array]:
    """Orthonormal polynomials (k, p) on k equally spaced lines; Gauss nodes (p,) in lines from the first, and their weights (p,)."""
    x = np.arange(float(k)) - (k - 1) / 2
    j = np.arange(1, p)
    off = np.sqrt(j**2 * (k**2 - j**2) / (4 * (4 * j**2 - 1.0)))  # Gram polynomials: Gautschi 2004, Table 1.2 (discrete Chebyshev)
    nodes, vectors = np.linalg.eigh(np.diag(off, 1) + np.diag(off, -1))
    weights = k * vectors[0] ** 2  # Golub & Welsch 1969
    return _at_nodes(x, k, p), nodes + (k - 1) / 2, weights


def _blocks(value: ComplexArray, sd: Array, window: Window, gaps: Sequence[int] = ()) -> list[tuple[int, int]]:
    """Ranges of lines [first, after) whose polynomial leaves nothing but noise, from the whole band down by halves; none reaches over `gaps`, the
    lines before which some were left out."""
    n, found = value.shape[-1], []
    parts = sorted({*np.linspace(0, n, n // LONGEST + 2).astype(int).tolist(), *gaps})
    open_ranges = list(pairwise(parts))
    while open_ranges:
        first, after = open_ranges.pop()
        k = after - first
        if k <= NODES + 1:
            found.append((first, after))
            continue
        q, _, _ = _basis(k, min(NODES + BEYOND, k))
        v, variance = value[:, :, first:after], sd[:, :, first:after] ** 2
        left = v - (v @ q[:, :NODES]) @ q[:, :NODES].T
        beyond = np.abs(v @ q[:, NODES:]) ** 2 / (variance @ q[:, NODES:] ** 2)
        _, rest, spread = left_by(q[:, :NODES], window)
        following, _, _ = left_by(q[:, NODES:], window)
        frfs = left.shape[0] * left.shape[1]
        whole = _lacking(np.abs(left) ** 2 / variance, frfs * rest, frfs * spread)
        if whole or _lacking(beyond, frfs * following.sum(), frfs * (following**2).sum()):
            middle = (first + after) // 2
            open_ranges += [(first, middle), (middle, after)]
        else:
            found.append((first, after))
    return sorted(found)


def _lacking(squares: Array, mean: float, variance: float) -> bool:
    return float(squares.sum()) > mean + LACK_OF_FIT * np.sqrt(variance)


def _within_blocks(value: ComplexArray, blocks: list[tuple[int, int]], window: Window, frequency: Array, falling: Array | None = None) -> Array | None:
    """Noise variances (n_resp, n_ref, n) from what the polynomials of all blocks leave, as shares of |H|^2 and of the largest |H|^2 to that
    hammer, reference by reference; none of an FRF that is silent. None where too few degrees of freedom are left."""
    size = np.abs(value) ** 2
    shapes = _shapes(frequency, falling)
    variance = np.zeros(size.shape)
    heard = size.max(axis=-1) > SILENT**2 * size.max()
    for j in np.flatnonzero(heard.any(axis=0)):
        of, strength = value[heard[:, j], j], size[heard[:, j], j]
        rows, seen, freedom, largest = [], [], [], float(strength.max())
        for first, after in blocks:
            k = after - first
            if k <= NODES + 1:
                continue
            p = min(NODES + LEFT_OUT, max(NODES, k - SCATTERING))
            q, _, _ = _basis(k, p)
            v = of[:, first:after]
            left = v - (v @ q) @ q.T
            seen.append(np.sum(np.abs(left) ** 2, axis=1) / left_by(q, window)[1])
            floor = [np.full(len(v), largest * r[first:after].mean()) for r in shapes]
            rows.append(np.stack([strength[:, first:after].mean(axis=1), *floor], axis=1))
            freedom.append(np.full(len(v), float(k - p)))
        if sum(f.sum() for f in freedom) < ENOUGH:
            return None
        a, y, w = np.concatenate(rows), np.concatenate(seen), np.concatenate(freedom)
        share = _gamma_fit(a, y, w, WIDE if falling is not None else USUAL)
        share[0] += OPEN * _error_of_first(share, a, w)
        floor_of = largest * np.sum([c * r for c, r in zip(share[1:], shapes, strict=True)], axis=0)
        variance[heard[:, j], j] = np.maximum(share[0] * strength + floor_of, 1e-14 * largest)
    return variance


def _error_of_first(share: Array, columns: Array, freedom: Array) -> float:
    """Standard error of the first of the shares, beside those that are not none."""
    used = share > 0
    used[0] = True
    scaled = columns[:, used] * (np.sqrt(freedom) / np.maximum(columns @ share, 1e-300))[:, None]
    triangle = np.asarray(np.linalg.qr(scaled[:, ::-1], mode="r"))  # the first last: its own part, that the others cannot take
    return float(1 / np.abs(triangle[-1, -1])) if triangle[-1, -1] else 0.0


def _gamma_fit(columns: Array, seen: Array, freedom: Array, least: tuple[float, float] = USUAL) -> Array:
    """Shares (c,) >= 0 with `seen` (n,) about columns (n, c) @ shares: squares have errors in proportion to themselves, weighted anew. None of anything
    where nothing was seen.

    Weights are those of `least` of the mean at least, in the first step and later, and of `TRUSTED` times less than was seen: a step that leaves a
    block next to nothing would make it rule the following one.
    """
    if not seen.any():
        return np.zeros(columns.shape[1])
    mean = seen + least[0] * seen.mean()
    for _ in range(6):
        weight = np.sqrt(freedom) / mean
        share, _ = nnls(columns * weight[:, None], seen * weight)
        mean = np.maximum(columns @ share, np.maximum(least[1] * seen.mean(), seen / TRUSTED))
    return share


def _compressed(
    frequency: Array, value: ComplexArray, sd: Array, blocks: list[tuple[int, int]], window: Window, falling: Array | None
) -> tuple[Array, ComplexArray, Array, Alike | None]:
    """Frequencies (L,), values and standard errors (n_resp, n_ref, L), and how these go together."""
    parts = _parts(value, sd, frequency, falling) if window.damped else sd[None] ** 2
    at, kept, mixing, variance = [], [], [], []
    for first, after in blocks:
        k, own = after - first, slice(first, after)
        if k <= NODES + 1:
            at.append(frequency[own])
            kept.append(value[:, :, own])
            mixing.append(np.eye(k))
            variance.append(parts[..., own])
            continue
        q, nodes, weights = _basis(k)
        polynomials = _at_nodes(nodes - (k - 1) / 2, k)  # (p nodes, p polynomials)
        at.append(_between(nodes, frequency[own]))
        kept.append((value[:, :, own] @ q) @ polynomials.T)
        mixing.append(polynomials @ q.T)
        of_nodes = (parts[..., own] @ q**2) @ (polynomials**2).T  # equal white noise gives sd^2 / weight
        variance.append(np.maximum(of_nodes, parts[..., own].min(axis=-1, keepdims=True) / weights))
    whole, alike = np.concatenate(variance, axis=-1), None
    if window.damped:
        number = np.rint(frequency * window.length).astype(int)
        alike = Alike(csr_array(block_diag(mixing)), number, window, np.zeros(0))
        whole[1] *= alike.times
        alike = replace(alike, share=whole[1] / whole.sum(axis=0))
    return np.concatenate(at), np.concatenate(kept, axis=-1), np.sqrt(whole.sum(axis=0)), alike


def _between(nodes: Array, frequency: Array) -> Array:
    """Frequencies at fractions of line numbers: straight between even lines, by a cubic spline between others, exact to 1e-9 on a logarithmic axis."""
    lines = np.arange(float(len(frequency)))
    return np.asarray(np.interp(nodes, lines, frequency) if even(frequency) else CubicSpline(lines, frequency)(nodes), float)


def _at_nodes(x: Array, k: int, p: int = NODES) -> Array:
    """The orthonormal polynomials (len(x), p) of `_basis` at positions `x` in lines from the middle."""
    j = np.arange(1, p)
    off = np.sqrt(j**2 * (k**2 - j**2) / (4 * (4 * j**2 - 1.0)))
    previous, current = np.zeros(len(x)), np.full(len(x), 1 / np.sqrt(k))
    columns = [current]
    for m in range(p - 1):
        following = (x * current - (off[m - 1] if m else 0.0) * previous) / off[m]
        previous, current = current, following
        columns.append(current)
    return np.stack(columns, axis=1)
