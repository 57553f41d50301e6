"""The noise of a test's lines: that of the file, that which the campaign states, or what their own scatter tells.

What the polynomials of blocks leave tells it (`blocks`), as shares of every value and of the
largest. Under an exponential window neighbouring lines scatter less than all of it (`window`).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from thermospindle.diagnosis.data.blocks import NODES, basis
from thermospindle.diagnosis.data.window import Window, left_by, neighbours
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Noise
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.identification.modal import noise_model, scatter

OPEN = 1.0  # standard errors of the noise of value, told between peaks, by which it may be more at them
LEFT_OUT, SCATTERING = 2, 3  # polynomials of the next degrees left out where a block tells the noise, and lines at least beyond them
LINES_THAT_SCATTER = 50  # of an FRF at least, from whose neighbours its noise can be told
RISES = (0, 2, 4)  # powers of frequency in which the variance of noise of largest is told: a hammer's force falls, and noise over it rises; a displacement's differentiated twice is the last, from the first line on
FALLS = (2, 4)  # powers of 1/frequency in which the variance of an accelerometer's noise falls, as a velocity's and a displacement's
USUAL, WIDE = (1e-3, 1e-6), (1e-12, 1e-14)  # of the mean square, that count as such: of noise that is much the same over the band, and of one that falls
LOW = (0.1, 40)  # share of the band from its first line, and lines in it at least, where such noise shows
ENOUGH = 200  # degrees of freedom from which the scatter within blocks tells the noise
REPEATS, CAMPAIGN, SCATTER = "repeats", "the campaign", "scatter of neighbouring lines"
KNOWN = (REPEATS, CAMPAIGN)
SILENT = 1e-7  # of the largest value of a test: the least noise that is believed
TRUSTED = 9.0  # times less than a block showed: the least noise by which it is weighed
CONFIRMED, PARTS = 1.1, 4  # of a known noise, up to which the scatter of neighbouring lines does not contradict it in any of so many parts of the band


def told(frf: Frf, value: ComplexArray, use, stated: Noise | None, expected: Noise, window: Window) -> tuple[Array, str]:
    """Standard errors (n_resp, n_ref, n) of the lines in `use` that are known, or else a first
    guess by what is known, and where they are from."""
    if frf.sd is not None and np.all(np.isfinite(frf.sd)):
        return smooth_sd(value, frf.sd[:, :, use], frf.frequency[use]), REPEATS
    if stated is not None:
        return noise_model(value, stated.of_value, stated.of_largest), CAMPAIGN
    if value.shape[-1] <= LINES_THAT_SCATTER:
        return noise_model(value, expected.of_value, expected.of_largest), "the scene's measuring accuracy"
    return smooth_sd(value, of_neighbours(value, window), frf.frequency[use]), SCATTER


def of_neighbours(value: ComplexArray, window: Window) -> Array:
    """Standard errors (n_resp, n_ref, n) of single lines by their neighbours', whose noise a window makes alike."""
    return np.asarray(scatter(value) / np.sqrt(neighbours(window)))


def falls(value: ComplexArray, sd: Array, window: Window, frequency: Array) -> Array | None:
    """Shapes (shapes, n) over frequency of a noise that falls with it, where lines at the lowest
    `LOW`, measured by `sd`, scatter more than twice as much as the others: that of an accelerometer
    does, whose motion was integrated to a velocity or a displacement; None where it does not."""
    low = frequency <= (1 - LOW[0]) * frequency[0] + LOW[0] * frequency[-1]
    if low.sum() < LOW[1]:
        return None
    seen = of_neighbours(value, window) / sd
    steep = np.median(seen[..., low]) > 2 * np.median(seen[..., ~low])
    return np.array([(frequency[0] / frequency) ** power for power in FALLS]) if steep else None


def smooth_sd(value: ComplexArray, sd: Array, frequency: Array, falling: Array | None = None) -> Array:
    """The noise of value and of largest, rising with frequency and, where given, of the shapes
    `falling`, that the standard errors `sd` of single lines follow, FRF by FRF; few hits scatter them."""
    return np.asarray(np.sqrt(np.sum(parts_of(value, sd, frequency, falling), axis=0)))


def parts_of(value: ComplexArray, sd: Array, frequency: Array, falling: Array | None) -> Array:
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


def confirmed(known: Array, seen: Array) -> bool:
    """Whether the noise that lines themselves have, in each `PARTS`-th of the band, is no more than what is known."""
    parts = np.array_split(seen**2 / known**2, PARTS, axis=-1)
    return bool(max(np.sqrt(np.mean(part)) for part in parts) < CONFIRMED)


def _shapes(frequency: Array, falling: Array | None) -> Array:
    """Shapes (shapes, n) over the lines of a noise of largest: level, rising, and `falling` where given."""
    rising = (frequency / frequency[-1]) ** np.array(RISES)[:, None]
    return rising if falling is None else np.concatenate([rising, falling])


def within_blocks(value: ComplexArray, blocks: list[tuple[int, int]], window: Window, frequency: Array, falling: Array | None = None) -> Array | None:
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
            q, _, _ = basis(k, p)
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
    """Shares (c,) >= 0 with `seen` (n,) about columns (n, c) @ shares: squares have errors in
    proportion to themselves, weighted anew. None of anything where nothing was seen.

    Weights are those of `least` of the mean at least, in the first step and later, and of `TRUSTED` times
    less than was seen: a step that leaves a block next to nothing would make it rule the following one.
    """
    if not seen.any():
        return np.zeros(columns.shape[1])
    mean = seen + least[0] * seen.mean()
    for _ in range(6):
        weight = np.sqrt(freedom) / mean
        share, _ = nnls(columns * weight[:, None], seen * weight)
        mean = np.maximum(columns @ share, np.maximum(least[1] * seen.mean(), seen / TRUSTED))
    return share
