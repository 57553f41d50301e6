"""Modes of a measured matrix of frequency response functions, with standard errors.

Nobody clicks: `extract` starts from nothing, adds poles while the likelihood pays for them (`sim.identification.poles`), imposes
that the residue matrix of a mode has rank one, and takes the errors from the information of everything fitted. All lines and
references count, each with its own noise. Conventions: H(w) ~ exp(i w t), poles in rad/s with positive imaginary part, R = shape
participation^T in receptance, standard deviation of a complex number: sd^2 = E|e|^2 (half of it in each of the two parts).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.close_poles import beyond_first_order, near
from thermospindle.sim.identification.pairing import mac
from thermospindle.sim.identification.poles import Fit, Lines, believed, information, of_shape, search
from thermospindle.sim.identification.rank_one import accepted

KINDS = {"receptance": 0, "mobility": 1, "accelerance": 2}
MOST_LINES = 6400
"""Of an FRF: half a minute's record of a spindle has tens of thousands, which tell little more of where poles are."""
STEP, SURE = 0.3, 5.0
"""Of an FRF, from one line to the next, and of its standard errors, from which it changes much."""
LEAST, FLOOR = 1e-3, 1e-5
"""Of an FRF, and of the largest to its reference, the noise that it is taken to have at least where none is told: a model's own
FRFs have none at all, what modes beyond the band do is a polynomial within it to that, and what symmetry forbids is rounding."""
FAINT = 4.0
"""A mode is reported if its squared shape, weighted by its information, exceeds this many times what the information criterion asks."""

TOGETHER = 0.95
"""By MAC, of the participations of two modes that the references excite alike, so that these are as good as one in telling the two apart."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes in the order of frequency. m modes, n_resp responses, n_ref references.

    `chi2` is per degree of freedom; where it exceeds one the errors contain its root. `status` says in words how far they can be trusted.
    """

    frequency: Array  # (m,) Hz, undamped: |pole| / 2 pi
    damping: Array  # (m,) -Re pole / |pole|
    covariance: Array  # (2m, 2m) of [frequency, damping]
    shape: ComplexArray  # (m, n_resp), the largest component is 1
    shape_sd: Array  # (m, n_resp)
    residues: ComplexArray  # (m, n_resp, n_ref) R of the receptance: its unit times 1/s
    chi2: float
    chi2_function: Array  # (n_resp, n_ref) mean square of the weighted residual of each function
    lines: tuple[float, float, int]  # Hz, Hz, number of lines used
    rank_one: bool  # whether residues are shape x participation; else each is free
    status: str

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {', '.join(f'{f:.2f}' for f in self.frequency)} Hz: {self.status}>"

    @property
    def frequency_sd(self) -> Array:
        """(m,) Hz."""
        return np.sqrt(np.diag(self.covariance)[: len(self.frequency)])

    @property
    def damping_sd(self) -> Array:
        """(m,)"""
        return np.sqrt(np.diag(self.covariance)[len(self.frequency) :])


def noise_model(frf: ArrayLike, relative: float, floor: float) -> Array:
    """Standard deviation (n_resp, n_ref, n) of `frf`: `relative` of the value and `floor` of the largest response to that reference.

    The two parts are independent, so they add as squares.
    """
    size = np.abs(np.asarray(frf))
    return np.hypot(relative * size, floor * size.max(axis=(0, 2), keepdims=True))


def scatter(frf: ArrayLike, window: int = 41) -> Array:
    """Standard deviation (n_resp, n_ref, n) estimated from `frf` itself, without any model: from line to line.

    A line less the mean of its neighbours has the variance 3/2 sd^2, and the median of the modulus of complex noise is sd sqrt(ln 2). The
    median over `window` lines passes over resonances narrower than half of it; there, what was found relative to the value counts if it is
    larger, the value being cleared of noise first.
    """
    frf = np.asarray(frf)
    step = np.abs(frf[..., 1:-1] - (frf[..., :-2] + frf[..., 2:]) / 2) / np.sqrt(1.5 * np.log(2))
    size = np.abs(frf[..., 1:-1])
    absolute, relative = (scipy.ndimage.median_filter(x, (1, 1, window), mode="nearest") for x in (step, np.divide(step, size, out=np.zeros_like(step), where=size > 0)))
    larger = relative * np.sqrt(np.maximum(size**2 - 4 * absolute**2, 0))
    return np.pad(np.maximum(absolute, larger), ((0, 0), (0, 0), (1, 1)), mode="edge")


def _own_noise(frf: ComplexArray) -> Array:
    """The `scatter` of FRFs (n_resp, n_ref, n), or what they have at least."""
    return np.maximum(scatter(frf), noise_model(frf, LEAST, FLOOR))


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

    Without `frf_sd` it is taken from the `scatter` of neighbouring lines, as the status records, as `LEAST` of the FRF and `FLOOR` of
    the largest to its reference at least. Lines at 0 Hz are left out. Records under an exponential window exp(-window_decay t), 1/s,
    give H at s = i w + window_decay, and are taken so. Of more than `MOST_LINES` one in so many is taken where FRFs change little. Not
    reported are modes out of the band or with a damping that is not `BELIEVED`, `FAINT`, or not known better than to their half-width by
    the fit alone: what enlarges errors beyond that takes none away. Raises ValueError if shapes do not agree or numbers are unusable.
    """
    frequency, frf = np.asarray(frequency, float), np.asarray(frf, complex)
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)}")
    if frf.ndim != 3 or frequency.shape != frf.shape[2:]:
        raise ValueError(f"frf {frf.shape} is not (responses, references, lines) for {frequency.shape} frequencies")
    low, high = band or (-np.inf, np.inf)
    used = (frequency >= low) & (frequency <= high) & (frequency > 0)
    given = frf_sd is not None
    frequency, frf = frequency[used], frf[..., used]
    if len(frequency) < 12 or (np.diff(frequency) <= 0).any():
        raise ValueError(f"{len(frequency)} lines above 0 Hz in the band: at least 12 in rising order are needed")
    with np.errstate(over="ignore"):
        sd = np.broadcast_to(np.asarray(frf_sd, float), (*frf.shape[:2], len(used)))[..., used] if given else _own_noise(frf)
    if not (np.isfinite(frf).all() and np.isfinite(sd).all() and (sd > 0).all()):
        raise ValueError("the FRF must be finite and its noise finite and positive at every line")
    unit = 2 * np.pi * np.sqrt(frequency[0] * frequency[-1])
    told = _telling(frf, sd, -(-len(frequency) // MOST_LINES))
    alike = _alike(window_decay / np.median(np.diff(frequency)))
    lines = Lines((window_decay + 2j * np.pi * frequency[told]) / unit, frf[..., told], np.sqrt(2) / sd[..., told], KINDS[kind], alike)
    return _modes(*accepted(lines, search(lines)), unit, given, frf.shape[:2], len(frequency), window_decay)


def _alike(lost: float) -> float:
    """How many times the noise at the start of a record is, in variance, that of its mean, where an
    exponential window has fallen to exp(-`lost`) at its end: 2 d T / (1 - exp(-2 d T)).

    An answer that dies away at once meets the noise at the start alone, which the mean over all
    lines takes for so many times less than it is.
    """
    return float(2 * lost / -np.expm1(-2 * lost)) if lost > 0 else 1.0


def _telling(frf: ComplexArray, sd: Array, every: int) -> NDArray[np.intp]:
    """Of lines (n,) one in `every`, and as many as it takes where some FRF changes by more than
    `STEP` of itself, and by more than its noise, from one to the next."""
    if every == 1:
        return np.arange(frf.shape[-1])
    value, error = frf.reshape(-1, frf.shape[-1]).T, SURE * sd.reshape(-1, frf.shape[-1]).T
    size, kept = STEP * np.abs(value), [0]
    for i in range(1, len(value)):
        last = kept[-1]
        if i - last >= every or np.any(np.abs(value[i] - value[last]) > np.maximum(size[i], size[last]) + error[i]):
            kept.append(i)
    return np.array(kept)


def _modes(
    lines: Lines,
    fit: Fit,
    strain: float,
    twice: list[tuple[complex, complex]],
    unit: float,
    given: bool,
    functions: tuple[int, int],
    measured: int,
    window_decay: float,
) -> Modes:
    """Physical units, standard errors, and the choice of what is reported.

    Under an exponential window w the noise at a time goes with w, and the fit weighs it alike: of a mode that decays with a by itself
    and with b = a + d in the windowed record, an amplitude has `alike` b / (a + 2 d) times the variance that this fit tells, and a pole
    `alike` (b / (a + 2 d))^3 times, by least squares of exp(-b t), and of t exp(-b t) beside it, in noise that falls as exp(-d t).
    """
    responses, references = functions
    a, width = fit.shape.shape
    # inverse of the information matrix by its eigenvectors, scaled to a unit diagonal first: parameters differ by many powers of ten
    matrix, _ = information(lines, fit)
    size = np.sqrt(np.abs(np.diag(matrix)))
    known, directions = np.linalg.eigh(matrix / size / size[:, None])
    directions = directions / size[:, None] / np.sqrt(np.maximum(known, 1e-12))  # what is not known at all gets a huge error
    covariance = directions @ directions.T * fit.scale() * max(strain, 1.0)
    half = len(size) // 2  # unknowns are complex: real parts first, then imaginary ones

    poles = fit.poles[:a]
    radius, angle = np.abs(poles), np.exp(1j * np.angle(poles))
    # d|p| and d(-Re p / |p|) by Re p and Im p of the pole p = |p| exp(i angle)
    to_frequency = np.hstack([np.diag(angle.real), np.diag(angle.imag)]) * unit / (2 * np.pi)
    to_damping = np.hstack([np.diag(-(angle.imag**2) / radius), np.diag(angle.real * angle.imag / radius)])
    jacobian = np.vstack([to_frequency, to_damping])
    both = np.r_[0:a, half : half + a]
    frequency, damping = radius * unit / (2 * np.pi), -angle.real
    slower = (window_decay - poles.real * unit) / np.maximum(2 * window_decay - poles.real * unit, np.finfo(float).tiny)
    louder = np.sqrt(np.maximum(lines.alike * slower**3, 1.0))
    spread = jacobian @ covariance[both[:, None], both] @ jacobian.T * np.outer(np.tile(louder, 2), np.tile(louder, 2))

    residues = np.einsum("ri,rk->rik", fit.shape, fit.participation).reshape(a, responses, references)
    shape, shape_sd, weight = np.zeros((a, responses), complex), np.zeros((a, responses)), np.zeros(a)
    for r in range(a):
        # shape as the references excite it together: the leading right singular vector weighs them by their participation
        weights = np.linalg.svd(residues[r])[2][0].conj()
        gather = np.eye(width) if width == responses else np.kron(np.eye(responses), weights)
        raw = gather @ fit.shape[r]
        largest = np.abs(raw).argmax()
        shape[r] = raw / raw[largest]
        shape[r, largest] = 1
        # derivative of raw / raw[largest], so the standard errors are those of the normalised shape
        relative = (gather - np.outer(shape[r], gather[largest])) / raw[largest]
        x, own = of_shape(fit, r), np.append(fit.shape[r].real, fit.shape[r].imag)
        block = covariance[np.ix_(x, x)]
        cross = block[width:, :width]
        hermitian = block[:width, :width] + block[width:, width:] + 1j * (cross - cross.T)
        shape_sd[r] = np.sqrt(np.einsum("ij,jk,ik->i", relative, hermitian, relative.conj()).real.clip(0) * max(lines.alike * slower[r], 1.0))
        weight[r] = own @ matrix[np.ix_(x, x)] @ own / fit.scale()

    sd = np.sqrt(np.diag(spread))
    cost = 2 * (fit.shape.shape[1] + fit.participation.shape[1]) * np.log(lines.count) * lines.alike
    sure = believed(lines, poles) & (np.arange(a) < a - fit.faint) & (sd[:a] < damping * frequency) & (sd[a:] < damping / 2) & (weight > FAINT * cost)  # the last refinement may have led a pole out of the band
    moved = 0
    for pole, offset in twice:
        there = np.flatnonzero(np.abs(poles - pole) < -pole.real)
        if len(there) == 1:  # else the two turned out to be modes of different shape
            ways = jacobian[:, [there[0], a + there[0]]] @ [[offset.real, offset.imag], [offset.imag, 0.0]]  # two places side by side are a broader peak, too
            spread += ways @ ways.T
            moved += 1
    mixed = np.zeros(a, bool)
    for i, j in np.argwhere(near(lines, poles) & (mac(fit.participation, fit.participation) > TOGETHER)):
        if lacking := beyond_first_order(lines, fit, i, j):
            for r in (i, j):
                spread += lacking * jacobian[:, [r, a + r]] @ jacobian[:, [r, a + r]].T
                mixed[r] = True
    keep = np.flatnonzero(sure)[np.argsort(frequency[sure])]
    kept = np.append(keep, a + keep)
    chi2 = fit.chi2 / (lines.count - fit.unknowns)
    words = ["noise as given" if given else "noise estimated from neighbouring lines"]
    words += [f"{len(lines.s)} of {measured} lines, all of those where FRFs change much"] if measured > len(lines.s) else []
    words += [f"chi-square {chi2:.3g} per degree of freedom" + (", errors enlarged by its root" if chi2 > 1 else "")]
    words += [] if strain else ["residues of rank one refused by the data, left free"]
    words += [f"residues of rank one strained, errors enlarged by {np.sqrt(strain):.2g}"] if strain > 1 else []
    words += [f"{moved} mode{'s' * (moved > 1)} at two places with one shape, errors enlarged by their distance"] if moved else []
    words += [f"{mixed[sure].sum()} modes hardly apart from a neighbour, errors enlarged by how far they may be"] if mixed[sure].any() else []
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
        strain > 0,
        "; ".join(words),
    )
