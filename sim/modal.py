"""Modes of a measured matrix of frequency response functions, with standard errors, and which mode is which across conditions.

Nobody clicks: `extract` starts from nothing, adds poles while the likelihood pays for them (`sim.poles`), imposes that the residue matrix
of a mode has rank one, and takes the errors from the information of everything fitted. All lines and references count, each with
its own noise. Conventions: H(w) ~ exp(i w t), poles in rad/s with positive imaginary part, R = shape participation^T in receptance,
standard deviation of a complex number: sd^2 = E|e|^2 (half of it in each of the two parts).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import median_filter
from scipy.optimize import linear_sum_assignment

from sim.poles import Complex, Fit, Lines, Real, believed, information, project, realise, refine, removal, search, split, varied

KINDS = {"receptance": 0, "mobility": 1, "accelerance": 2}
FAINT = 4.0
"""A mode is reported if its squared shape, weighted by its information, exceeds this many times what the information criterion asks."""

SPREAD = 0.3
"""Natural logarithm of a frequency change between two conditions that speaks against a pair as much as shapes without likeness."""
CLOSE = 0.03
"""Fraction of the frequency below which modes are near enough to mix their shapes."""
DEAR = 1.25
"""Cost of a pair above which both modes rather stay alone: unlike shapes in unlike spaces cost 1.5."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes in the order of frequency. m modes, n_resp responses, n_ref references.

    `chi2` is per degree of freedom; where it exceeds one the errors contain its root. `status` says in words how far they can be trusted.
    """

    frequency: Real  # (m,) Hz, undamped: |pole| / 2 pi
    damping: Real  # (m,) -Re pole / |pole|
    covariance: Real  # (2m, 2m) of [frequency, damping]
    shape: Complex  # (m, n_resp), the largest component is 1
    shape_sd: Real  # (m, n_resp)
    residues: Complex  # (m, n_resp, n_ref) R of the receptance: its unit times 1/s
    chi2: float
    chi2_function: Real  # (n_resp, n_ref) mean square of the weighted residual of each function
    lines: tuple[float, float, int]  # Hz, Hz, number of lines used
    rank_one: bool  # whether residues are shape x participation; else each is free
    status: str

    @property
    def frequency_sd(self) -> Real:
        """(m,) Hz."""
        return np.sqrt(np.diag(self.covariance)[: len(self.frequency)])

    @property
    def damping_sd(self) -> Real:
        """(m,)"""
        return np.sqrt(np.diag(self.covariance)[len(self.frequency) :])


def noise_model(frf: ArrayLike, relative: float, floor: float) -> Real:
    """Standard deviation (n_resp, n_ref, n) of `frf`: `relative` of the value and `floor` of the largest response to that reference.

    The two parts are independent, so they add as squares.
    """
    size = np.abs(np.asarray(frf))
    return np.hypot(relative * size, floor * size.max(axis=(0, 2), keepdims=True))


def scatter(frf: ArrayLike, window: int = 41) -> Real:
    """Standard deviation (n_resp, n_ref, n) seen in `frf` itself, without any model: from line to line.

    A line less the mean of its neighbours has the variance 3/2 sd^2, and the median of the modulus of complex noise is sd sqrt(ln 2). The
    median over `window` lines passes over resonances narrower than half of it; there, what was found relative to the value counts if it is
    larger, the value being cleared of noise first.
    """
    frf = np.asarray(frf)
    step = np.abs(frf[..., 1:-1] - (frf[..., :-2] + frf[..., 2:]) / 2) / np.sqrt(1.5 * np.log(2))
    size = np.abs(frf[..., 1:-1])
    absolute, relative = (median_filter(x, (1, 1, window), mode="nearest") for x in (step, step / size))
    larger = relative * np.sqrt(np.maximum(size**2 - 4 * absolute**2, 0))
    return np.pad(np.maximum(absolute, larger), ((0, 0), (0, 0), (1, 1)), mode="edge")


def extract(
    frequency: ArrayLike,
    frf: ArrayLike,
    frf_sd: ArrayLike | None = None,
    *,
    band: tuple[float, float] | None = None,
    kind: str = "mobility",
    window_decay: float = 0.0,
) -> Modes:
    """Modes within `band` (Hz, all lines if None) of `frf` (n_resp, n_ref, n) at `frequency` (n,) Hz, with noise `frf_sd` of that shape.

    Without `frf_sd` it is taken from the `scatter` of neighbouring lines, and the status says so. Lines at 0 Hz are left out. Records
    under an exponential window exp(-window_decay t), 1/s, give H at s = i w + window_decay, and are taken so. Not reported
    are modes out of the band or with a damping that is not `BELIEVED`, not known better than to their half-width, or `FAINT`.
    Raises ValueError if shapes do not agree or numbers are unusable.
    """
    frequency, frf = np.asarray(frequency, float), np.asarray(frf, complex)
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)}")
    if frf.ndim != 3 or frequency.shape != frf.shape[2:]:
        raise ValueError(f"frf {frf.shape} is not (responses, references, lines) for {frequency.shape} frequencies")
    low, high = band or (frequency[0], frequency[-1])
    used = (frequency >= low) & (frequency <= high) & (frequency > 0)
    given = frf_sd is not None
    sd = np.broadcast_to(np.asarray(frf_sd, float), frf.shape)[..., used] if given else scatter(frf[..., used])
    frequency, frf = frequency[used], frf[..., used]
    if len(frequency) < 12 or (np.diff(frequency) <= 0).any():
        raise ValueError(f"{len(frequency)} lines above 0 Hz in the band: at least 12 in rising order are needed")
    if not (np.isfinite(frf).all() and np.isfinite(sd).all() and (sd > 0).all()):
        raise ValueError("the FRF must be finite and its noise finite and positive at every line")
    unit = 2 * np.pi * np.sqrt(frequency[0] * frequency[-1])
    lines = Lines((window_decay + 2j * np.pi * frequency) / unit, frf, np.sqrt(2) / sd, KINDS[kind])

    return _modes(*_accepted(lines, search(lines)), unit, given, frf.shape[:2])


def _accepted(lines: Lines, found: Fit) -> tuple[Lines, Fit, bool, list[tuple[complex, complex]]]:
    """The poles found as modes: as they are where the data accept them so, else those at one place with one shape merged.

    The free residues of two modes nearly at one place are mixed, and look alike before rank one is imposed on them.
    """
    free, twice = merge(lines, found)
    if twice and min(lines.frf.shape[:2]) > 1:  # else any residues are of rank one
        as_found = impose_rank_one(lines, found)
        if as_found[2]:
            return *as_found, []
    return *impose_rank_one(lines, free), twice


def impose_rank_one(lines: Lines, free: Fit) -> tuple[Lines, Fit, bool]:
    """The fit with R = shape participation^T for the believed poles in the band, and whether the data accept it.

    It is refused if chi-square rises by more than five standard deviations over what the constraints alone cost. Then the pole whose
    residues are furthest from rank one is tried as two modes at nearly one place, and if that does not help, residues stay free:
    every function is a response of its own to one reference.
    """
    responses, references, n = lines.frf.shape
    first = believed(lines, free.poles)
    if not first.any():
        return lines, free, True
    if min(responses, references) > 1:
        for trial in (make() for make in (lambda: free, lambda: split(lines, free))):
            fit = refine(lines, start_rank_one(lines, trial), 1e-3)
            constraints = trial.unknowns - fit.unknowns
            accepted = (fit.chi2 - trial.chi2) / trial.scale() < constraints + 5 * np.sqrt(2 * constraints)
            if accepted and not same_mode(lines, fit.poles[: len(fit.shape)], fit.shape, 0.95).any():
                return lines, fit, True
    flat = Lines(lines.s, lines.frf.reshape(-1, 1, n), lines.weight.reshape(-1, 1, n), lines.power)
    free = refine(lines, free, 1e-3)
    poles = np.append(free.poles[first], free.poles[~first])
    return flat, project(flat, poles, free.residues[first], np.ones((first.sum(), 1), complex)), min(responses, references) == 1


def merge(lines: Lines, free: Fit) -> tuple[Fit, list[tuple[complex, complex]]]:
    """One pole instead of two at one place with one shape; and for each such pair the pole kept and how far its place is spread.

    Such a pair is one mode that was not the same in all functions: it moved between the references, or is not linear. The spread is
    the standard deviation of two places that have the weights of their residues.
    """
    spread: list[tuple[complex, complex]] = []
    while True:
        shape = np.linalg.svd(free.residues.reshape(-1, *lines.frf.shape[:2]))[0][:, :, 0]
        pairs = np.argwhere(same_mode(lines, free.poles, shape, 0.8) & believed(lines, free.poles))
        if not len(pairs):
            return free, spread
        weaker, kept = sorted(pairs[0], key=lambda r: removal(free)[r])
        size = np.linalg.norm(free.residues[[weaker, kept]], axis=1) / np.linalg.norm(free.residues[[weaker, kept]], axis=1).sum()
        spread.append((free.poles[kept], (free.poles[weaker] - free.poles[kept]) * np.sqrt(size.prod())))
        free = refine(lines, project(lines, np.delete(free.poles, weaker)))


def same_mode(lines: Lines, poles: Complex, shape: Complex, alike: float) -> NDArray[np.bool_]:
    """(m, m), upper triangle: pairs of poles closer than their half-width or a line, with shapes (m, n_resp) that are `alike` by MAC."""
    width = np.maximum((poles.real[:, None] + poles.real) / -2, np.diff(lines.s.imag).min())
    return np.triu((np.abs(poles[:, None] - poles) < width) & (mac(shape, shape) > alike), 1)


def start_rank_one(lines: Lines, free: Fit) -> Fit:
    """The believed modes as products of shape and participation, overlapping ones together, from a fit with free residues."""
    responses, references, _ = lines.frf.shape
    first = believed(lines, free.poles)
    rising = np.flatnonzero(first)[np.argsort(np.abs(free.poles[first]))]
    edge, width = np.abs(free.poles[rising]), -free.poles[rising].real
    apart = np.flatnonzero(edge[1:] - edge[:-1] > width[1:] + width[:-1]) + 1
    parts = [realise(free.poles[i], free.residues[i].reshape(-1, responses, references)) for i in np.split(rising, apart)]
    poles, shape, participation = (np.concatenate(part) for part in zip(*parts, strict=True))
    return project(lines, np.append(poles, free.poles[~first]), shape, participation)


def _modes(
    lines: Lines,
    fit: Fit,
    rank_one: bool,
    twice: list[tuple[complex, complex]],
    unit: float,
    given: bool,
    functions: tuple[int, int],
) -> Modes:
    """Physical units, standard errors, and the choice of what is reported."""
    responses, references = functions
    m, a, width = len(fit.poles), *fit.shape.shape
    matrix, _ = information(lines, fit)
    size = np.sqrt(np.abs(np.diag(matrix)))
    known, directions = np.linalg.eigh(matrix / size / size[:, None])
    directions = directions / size[:, None] / np.sqrt(np.maximum(known, 1e-12))  # what is not known at all gets a huge error
    covariance = directions @ directions.T * fit.scale()
    half = len(size) // 2

    poles = fit.poles[:a]
    radius, angle = np.abs(poles), np.exp(1j * np.angle(poles))
    to_frequency = np.hstack([np.diag(angle.real), np.diag(angle.imag)]) * unit / (2 * np.pi)
    to_damping = np.hstack([np.diag(-(angle.imag**2) / radius), np.diag(angle.real * angle.imag / radius)])
    jacobian = np.vstack([to_frequency, to_damping])
    both = np.r_[0:a, half : half + a]
    frequency, damping = radius * unit / (2 * np.pi), -angle.real
    spread = jacobian @ covariance[both[:, None], both] @ jacobian.T

    residues = np.einsum("ri,rk->rik", fit.shape, fit.participation).reshape(a, responses, references)
    shape, shape_sd, weight = np.zeros((a, responses), complex), np.zeros((a, responses)), np.zeros(a)
    for r in range(a):
        sight = np.linalg.svd(residues[r])[2][0].conj()
        gather = np.eye(width) if width == responses else np.kron(np.eye(responses), sight)
        raw = gather @ fit.shape[r]
        largest = np.abs(raw).argmax()
        shape[r] = raw / raw[largest]
        shape[r, largest] = 1
        relative = (gather - np.outer(shape[r], gather[largest])) / raw[largest]
        x = np.searchsorted(varied(fit), m + r * width + np.arange(width))
        real, imag = np.ix_(x, x), np.ix_(half + x, half + x)
        cross = covariance[np.ix_(half + x, x)]
        hermitian = covariance[real] + covariance[imag] + 1j * (cross - cross.T)
        shape_sd[r] = np.sqrt(np.einsum("ij,jk,ik->i", relative, hermitian, relative.conj()).real.clip(0))
        x, known = np.append(x, half + x), np.append(fit.shape[r].real, fit.shape[r].imag)
        weight[r] = known @ matrix[np.ix_(x, x)] @ known / fit.scale()

    sd = np.sqrt(np.diag(spread))
    cost = 2 * (fit.shape.shape[1] + fit.participation.shape[1]) * np.log(lines.count)
    sure = (sd[:a] < damping * frequency) & (sd[a:] < damping / 2) & (weight > FAINT * cost)
    moved = 0
    for pole, offset in twice:
        near = np.flatnonzero(np.abs(poles - pole) < -pole.real)
        if len(near) == 1:  # else the two turned out to be modes of different shape
            way = jacobian[:, [near[0], a + near[0]]] @ [offset.real, offset.imag]
            spread += np.outer(way, way)
            moved += 1
    keep = np.flatnonzero(sure)[np.argsort(frequency[sure])]
    kept = np.append(keep, a + keep)
    chi2 = fit.chi2 / (lines.count - fit.unknowns)
    words = ["noise as given" if given else "noise estimated from neighbouring lines"]
    words += [f"chi-square {chi2:.3g} per degree of freedom" + (", errors enlarged by its root" if chi2 > 1 else "")]
    words += [] if rank_one else ["residues of rank one refused by the data, left free"]
    words += [f"{moved} modes seen at two places with one shape, errors enlarged by their distance"] if moved else []
    words += [f"{np.sum(~sure)} faint or uncertain poles not reported"] if not sure.all() else []
    edges = np.round(lines.s.imag[[0, -1]] * unit / (2 * np.pi), 6)
    return Modes(
        frequency[keep],
        damping[keep],
        spread[kept[:, None], kept],
        shape[keep],
        shape_sd[keep],
        residues[keep] * unit ** (1 - lines.power),
        chi2,
        (np.abs(fit.residual) ** 2).mean(1).reshape(responses, references) / 2,
        (float(edges[0]), float(edges[1]), len(lines.s)),
        rank_one,
        "; ".join(words),
    )


def mac(a: ArrayLike, b: ArrayLike) -> Real:
    """Modal assurance criterion (ma, mb) of complex shapes (ma, n) and (mb, n): |a^H b|^2 / (a^H a b^H b).

    Allemang & Brown, Proc. 1st IMAC (1982) 110.
    """
    first, second = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in (np.asarray(a), np.asarray(b)))
    return np.abs(first.conj() @ second.T) ** 2


def pair(a: Modes, b: Modes) -> NDArray[np.intp]:
    """(p, 2) indices of the same mode in `a` and `b`, by shape and frequency, all pairs at once.

    See `match` for the cost; modes without a partner are left out.
    """
    return match(a.frequency, a.shape, b.frequency, b.shape)


def track(conditions: Sequence[Modes]) -> NDArray[np.intp]:
    """(conditions, tracks) index of each mode in each condition, -1 where it was not found.

    Every condition is paired with the last sight of each track, so neighbours in the list should be neighbours in nature.
    """
    table = np.zeros((0, 0), np.intp)
    frequency, shape = np.zeros(0), np.zeros((0, conditions[0].shape.shape[1]), complex)
    for modes in conditions:
        row = np.full(len(frequency), -1)
        pairs = match(frequency, shape, modes.frequency, modes.shape)
        row[pairs[:, 0]] = pairs[:, 1]
        new = np.setdiff1d(np.arange(len(modes.frequency)), pairs[:, 1])
        table = np.pad(table, ((0, 0), (0, len(new))), constant_values=-1)
        table = np.vstack([table.reshape(-1, len(row) + len(new)), np.append(row, new)])
        frequency, shape = np.append(frequency, modes.frequency[new]), np.vstack([shape, modes.shape[new]])
        seen = row >= 0
        frequency[: len(row)][seen], shape[: len(row)][seen] = modes.frequency[row[seen]], modes.shape[row[seen]]
    return table


def match(frequency_a: Real, shape_a: Complex, frequency_b: Real, shape_b: Complex) -> NDArray[np.intp]:
    """(p, 2) pairs of least total cost (1 - MAC) + (1 - S) / 2 + (ln(fb / fa) / SPREAD)^2, none dearer than `DEAR`.

    Shapes of modes that are `CLOSE` turn within the space they span with the least change, or become complex where
    the rotor splits them; S is therefore the larger of two MACs with such a space: of a mode b with the space of the neighbours of a, and
    the reverse. Within the space, the single MAC decides if it can, else the order of frequencies.
    """
    one = mac(shape_a, shape_b)
    space = np.maximum(_space_mac(frequency_a, shape_a, shape_b), _space_mac(frequency_b, shape_b, shape_a).T)
    cost = (1 - one) + (1 - space) / 2 + (np.log(frequency_b / frequency_a[:, None]) / SPREAD) ** 2
    na, nb = cost.shape
    alone = np.full((na + nb, na + nb), DEAR / 2)  # each of the two left alone
    alone[:na, :nb], alone[na:, nb:] = cost, 0
    rows, columns = linear_sum_assignment(alone)
    paired = (rows < na) & (columns < nb)
    return np.stack([rows[paired], columns[paired]], 1)


def _space_mac(frequency: Real, shape: Complex, others: Complex) -> Real:
    """(m, o) part of each of `others` (o, n) within the space of each mode's neighbours in frequency."""
    rows = []
    for f in frequency:
        basis = np.linalg.qr(shape[np.abs(frequency / f - 1) < CLOSE].T)[0]
        rows.append((np.abs(basis.conj().T @ others.T) ** 2).sum(0) / (np.abs(others) ** 2).sum(1))
    return np.reshape(rows, (len(frequency), len(others)))
