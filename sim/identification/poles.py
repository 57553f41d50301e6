"""Poles of a matrix of frequency response functions by maximum likelihood, and where to start looking for them.

The model is linear in everything but the poles l (m,), so the rest is eliminated (variable projection: Golub & Pereyra, SIAM J. Numer.
Anal. 10 (1973) 413; Inverse Problems 19 (2003) R1, in Kaufman's form, BIT 15 (1975) 49). For each response and reference

    H(s) = s^k ( sum_r [ R_r / (s - l_r) + conj(R_r) / (s - conj(l_r)) ]  +  u_-2 / s^2 + u_-1 / s + u_0 + ... + u_4 s^4 ),   s = i w,

k = 0, 1, 2 for receptance, mobility, accelerance; u are real and stand for what lies far outside the band. ComplexArray noise e of
every line is independent with E|e|^2 = sd^2; under an exponential window neighbouring lines share theirs, so that what noise alone
takes off chi-square is up to `alike` times as much. Within the matrix, R_r = shape_r participation_r^T where this is imposed (any mode
of a linear system that is not a multiple root, gyroscopic or not: Peeters et al., Shock and Vibration 11 (2004) 395), otherwise free.

Poles are added and dropped by the Bayesian information criterion (Schwarz, Ann. Stat. 6 (1978) 461). Candidates come from the residual
itself (matching pursuit). A polynomial fit of high order (pLSCF, Peeters et al. 2004) or AAA (Nakatsukasa et al., SIAM J. Sci. Comput. 40
(2018) A1494) would be other starts; they have not been compared here.
Lines are scaled, s = i w / scale, by the caller; poles here are in that unit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.types import Array, ComplexArray

SMOOTH = np.arange(-2, 5)
"""Powers of s, in receptance, that stand for the modes below and above the band."""
REACH = 2.0
"""Poles are looked for from the lowest line divided by this to the highest times this; those out of the band only clean the fit."""
DAMPING = (1e-5, 0.7)
"""Limits of the damping ratio inside the fit."""
BELIEVED = (5e-5, 0.15)
"""Damping ratios of a mode; poles with others only clean the fit."""

ROUNDING = 1e-9
"""Part of its own weight by which a column must differ from the others to count: the square of what normal equations resolve."""
TRIAL = 0.02
"""Damping ratio of trial poles and their distance as a fraction of their frequency."""
ALIKE = 0.05
"""Of the width of a trial pole, within which lines tell it the same."""
MOST_STEPS = 40
"""Of a refinement."""
APART = 5
"""Trial poles put at once are further apart than this many distances, not to fit the same peak."""


@dataclass(frozen=True, eq=False)
class Lines:
    """A measured matrix: s (n,) = i w (plus an exponential window's decay), `frf` (n_resp, n_ref,
    n), `weight` sqrt(2)/sd, `power` k; `alike` as many lines as share the noise of one."""

    s: ComplexArray
    frf: ComplexArray
    weight: Array
    power: int
    alike: float = 1.0

    @property
    def count(self) -> int:
        """Array numbers measured."""
        return 2 * self.frf.size


@dataclass(frozen=True, eq=False)
class Fit:
    """The best linear unknowns for given poles.

    `shape` (a, n_resp) and `participation` (a, n_ref) belong to the first a poles, whose residues are imposed;
    `residues` (m, F), F the n_resp x n_ref functions in a row; `residual` (F, n) divided by its standard deviation;
    `gram` (F, q, q) weighted products of the q basis functions [Re R, Im R, smooth, and the derivatives to the poles];
    `inverse` that of its free part. The last `faint` ones of those imposed are there for the sake of the others alone.
    """

    poles: ComplexArray
    shape: ComplexArray
    participation: ComplexArray
    residues: ComplexArray
    residual: ComplexArray
    basis: ComplexArray
    gram: Array
    inverse: Array
    faint: int = 0

    @property
    def chi2(self) -> float:
        """Sum of the squared weighted residuals."""
        return float(np.vdot(self.residual, self.residual).real)

    @property
    def unknowns(self) -> int:
        """Array unknowns fitted; a rank-one product has one complex factor too many."""
        functions, imposed = len(self.residual), len(self.shape)
        product = self.shape.size + self.participation.size - imposed
        return 2 * (len(self.poles) + product + functions * (len(self.poles) - imposed)) + functions * len(SMOOTH)

    def scale(self) -> float:
        """Chi-square per degree of freedom, at least 1."""
        return max(1.0, self.chi2 / max(1, 2 * self.residual.size - self.unknowns))


def project(lines: Lines, poles: ComplexArray, shape: ComplexArray | None = None, participation: ComplexArray | None = None) -> Fit:
    """Fit all that is linear: the residues that are not imposed and the smooth terms, every function on its own."""
    responses, references, n = lines.frf.shape
    shape = np.zeros((0, responses), complex) if shape is None else shape
    participation = np.zeros((0, references), complex) if participation is None else participation
    m, a = len(poles), len(shape)
    frf, weight = lines.frf.reshape(-1, n), lines.weight.reshape(-1, n)
    smooth = lines.s[:, None] ** (lines.power + SMOOTH)
    smooth = smooth @ np.linalg.inv(np.linalg.qr(np.vstack([smooth.real, smooth.imag]))[1])  # else parallel in a narrow band
    basis = np.hstack([terms(lines, poles, 1), smooth, terms(lines, poles, 2)])
    p = 2 * m + len(SMOOTH)
    parts = np.hstack([basis.real.T, basis.imag.T])
    gram = np.stack([weighted @ weighted.T for weighted in (parts * np.tile(w, 2) for w in weight)])  # of one array: half the products
    free = np.r_[a:m, m + a : p]
    inverse = inverted(gram[:, free[:, None], free])
    coefficients = np.zeros((len(frf), p))
    imposed = np.einsum("ri,rk->ikr", shape, participation).reshape(len(frf), a)
    coefficients[:, :a], coefficients[:, m : m + a] = imposed.real, imposed.imag
    for _ in range(2):  # the second pass removes the rounding of the normal equations
        misfit = weight * (frf - coefficients @ basis[:, :p].T)
        gradient = ((weight * misfit) @ basis[:, free].conj()).real
        coefficients[:, free] += (inverse @ gradient[..., None])[..., 0]
    residues = (coefficients[:, :m] + 1j * coefficients[:, m : 2 * m]).T
    residual = weight * (frf - coefficients @ basis[:, :p].T)
    return Fit(poles, shape, participation, residues, residual, basis, gram, inverse)


def information(lines: Lines, fit: Fit) -> tuple[Array, Array]:
    """Gauss-Newton matrix (2z, 2z) and gradient (2z,) in [Re z, Im z] with everything linear and free eliminated.

    z are the poles, then shape and participation of the imposed residues row by row, without the largest participation of each mode,
    which stays as it is. Coefficients of the basis depend on z holomorphically: d(R) and R d(pole).
    """
    m, a = len(fit.poles), len(fit.shape)
    responses, references, n = lines.frf.shape
    functions = np.arange(responses * references)
    i, k = np.divmod(functions, references)
    map_ = np.zeros((len(functions), a + m, m + a * (responses + references)), complex)
    for r in range(m):
        map_[:, a + r, r] = fit.residues[r]
    for r in range(a):
        map_[functions, r, m + r * responses + i] = fit.participation[r, k]
        map_[functions, r, m + a * responses + r * references + k] = fit.shape[r, i]
    map_ = map_[:, :, varied(fit)]
    tangent = np.block([[map_.real, -map_.imag], [map_.imag, map_.real]])
    p = 2 * m + len(SMOOTH)
    bound = np.r_[0:a, p : p + m, m : m + a, p + m : p + 2 * m]
    free = np.r_[a:m, m + a : p]
    cross = fit.gram[:, bound[:, None], free]
    own = fit.gram[:, bound[:, None], bound]
    schur = own - cross @ fit.inverse @ cross.transpose(0, 2, 1) + 100 * ROUNDING * own * np.eye(len(bound))
    gradient = ((lines.weight.reshape(-1, n) * fit.residual) @ fit.basis[:, bound].conj()).real
    transposed = tangent.transpose(0, 2, 1)
    return (transposed @ schur @ tangent).sum(0), (transposed @ gradient[..., None]).sum(0)[:, 0]


def varied(fit: Fit) -> NDArray[np.intp]:
    """Indices of the z that vary, among [poles, shapes, participations]."""
    before = len(fit.poles) + fit.shape.size
    held = before + np.arange(len(fit.shape)) * fit.participation.shape[1] + np.abs(fit.participation).argmax(1)
    return np.setdiff1d(np.arange(before + fit.participation.size), held)


def of_shape(fit: Fit, r: int) -> NDArray[np.intp]:
    """Indices (2 n_resp,) of the shape of imposed pole r, real parts and then imaginary ones, among the [Re z, Im z] of `information`."""
    varying, width = varied(fit), fit.shape.shape[1]
    real = np.searchsorted(varying, len(fit.poles) + r * width + np.arange(width))
    return np.append(real, len(varying) + real)


def refine(lines: Lines, fit: Fit, tolerance: float = 1.0) -> Fit:
    """Levenberg-Marquardt until the expected fall of chi-square is below `tolerance` (in units of `fit.scale()`)."""
    if not len(fit.poles):
        return fit
    relax, (matrix, gradient) = 1e-6, information(lines, fit)
    for _ in range(MOST_STEPS):
        size = np.sqrt(np.maximum(np.diag(matrix), 1e-20 * np.diag(matrix).max()))
        step = np.linalg.solve(matrix / size / size[:, None] + relax * np.eye(len(size)), gradient / size) / size
        if step @ gradient < tolerance * fit.scale():
            break
        trial = _moved(lines, fit, step)
        fall = fit.chi2 - trial.chi2
        if fall > 0:
            fit, relax = trial, max(relax / 10, 1e-9)
            if fall < tolerance * fit.scale():
                break
            matrix, gradient = information(lines, fit)
        elif (relax := relax * 30) > 1e6:
            break
    return fit


def believed(lines: Lines, poles: ComplexArray) -> NDArray[np.bool_]:
    """(m,) which poles lie in the band with a possible damping."""
    damping = -poles.real / np.abs(poles)
    inside = (np.abs(poles) >= lines.s[0].imag) & (np.abs(poles) <= lines.s[-1].imag)
    return inside & (damping >= BELIEVED[0]) & (damping <= BELIEVED[1])


def search(lines: Lines) -> Fit:
    """Find the poles from nothing, all residues free.

    Where one more pole would lower chi-square most, poles are put and refined together with all others; they stay if the information
    criterion falls. Damping of the trial poles (2 %) is only a start, the refinement finds it.
    """
    grid, fit = trial_poles(lines), project(lines, np.zeros(0, complex))
    for _ in range(40):
        curve = gain(lines, fit, grid)
        peaks = 1 + np.flatnonzero((curve[1:-1] >= curve[:-2]) & (curve[1:-1] > curve[2:]))
        peaks = peaks[np.argsort(-curve[peaks])]
        peaks = peaks[curve[peaks] > max(0.1 * curve.max(), 0.5 * price(lines) * fit.scale())]
        apart = grid[[p for i, p in enumerate(peaks) if i == 0 or np.abs(peaks[:i] - p).min() > APART]]
        for new in (apart, apart[:1])[: len(apart)]:
            trial = prune(lines, refine(lines, project(lines, np.append(fit.poles, new))))
            if better(lines, trial, fit):
                fit = trial
                break
        else:
            break
    return fit


def trial_poles(lines: Lines) -> ComplexArray:
    """A grid (c,) of poles over the band and `REACH` beyond it."""
    low, high = np.log(lines.s.imag[[0, -1]] * (1 / REACH, REACH))
    return np.exp(np.arange(low, high, TRIAL) + 1j * np.arccos(-TRIAL))


def prune(lines: Lines, fit: Fit) -> Fit:
    """Leave out, weakest first, the poles that the information criterion does not pay for."""
    while len(fit.poles):
        loss = removal(fit)
        weakest = int(loss.argmin())
        if loss[weakest] > price(lines) * fit.scale():
            break
        fit = refine(lines, project(lines, np.delete(fit.poles, weakest)))
    return fit


def gain(lines: Lines, fit: Fit, candidates: ComplexArray) -> Array:
    """(c,) fall of chi-square if one of the `candidates` (c,) joined with free residues, the other poles held.

    What candidates, damped as they are, do not tell apart is added up first: records of many seconds have tens of thousands of lines.
    """
    n, c, first = len(lines.s), len(candidates), _grouped(lines)
    weight = lines.weight.reshape(-1, n)
    square = np.add.reduceat(weight**2, first, axis=1)
    p = 2 * len(fit.poles) + len(SMOOTH)
    centre = lines.s.real[first] + 1j * np.add.reduceat(lines.s.imag, first) / np.diff(np.append(first, n))
    new = terms(replace(lines, s=centre), candidates, 1)
    slope = (np.add.reduceat(weight * fit.residual, first, axis=1) @ new.conj()).real.reshape(-1, 2, c).transpose(0, 2, 1)
    old = [np.add.reduceat(fit.basis[:, :p] * w[:, None] ** 2, first, axis=0) for w in weight]
    cross = np.stack([(new.conj().T @ own).real for own in old]).reshape(-1, 2, c, p).transpose(0, 2, 1, 3)
    parts = np.stack([new.real, new.imag]).reshape(2, len(first), 2, c)
    own = np.einsum("xnac,xnbc->nabc", parts, parts).reshape(len(first), -1)
    own = (square @ own).reshape(-1, 2, 2, c).transpose(0, 3, 1, 2)
    schur = own * (1 + ROUNDING * np.eye(2)) - cross @ fit.inverse[:, None] @ cross.transpose(0, 1, 3, 2)
    return (slope * np.linalg.solve(schur, slope[..., None])[..., 0]).sum((0, 2))


def _grouped(lines: Lines) -> NDArray[np.intp]:
    """The first of every group of lines nearer to each other than `ALIKE` of a trial pole's width."""
    place = np.floor(np.log(lines.s.imag) / (ALIKE * TRIAL))
    return np.flatnonzero(np.diff(place, prepend=-np.inf))


def removal(fit: Fit) -> Array:
    """(m,) rise of chi-square without each pole, the other poles held (all residues free)."""
    m = len(fit.poles)
    pair = np.stack([np.arange(m), m + np.arange(m)], 1)
    block = fit.inverse[:, pair[:, :, None], pair[:, None, :]]
    residue = np.stack([fit.residues.T.real, fit.residues.T.imag], 2)
    return (residue * np.linalg.solve(block, residue[..., None])[..., 0]).sum((0, 2))


def price(lines: Lines) -> float:
    """What a pole with free residues must bring in chi-square."""
    return 2 * (1 + lines.frf[..., 0].size) * np.log(lines.count) * lines.alike


def realise(poles: ComplexArray, residues: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Poles (c,), shapes (c, n_resp) and participations (c, n_ref) with the same moments sum_r pole_r^k R_r, k = 0, 1, ...

    Residues of close poles are badly known one by one but well in these sums. Minimal realisation from a Hankel matrix of the moments,
    truncated to c states (Ho & Kalman 1966; Juang & Pappa, J. Guidance 8 (1985) 620).
    """
    c, responses, references = residues.shape
    centre = poles.mean()
    reach = np.abs(poles - centre).max() or 1.0
    blocks = -(-c // min(responses, references))
    moments = [np.tensordot(((poles - centre) / reach) ** k, residues, 1) for k in range(2 * blocks)]
    now, then = (np.block([[moments[i + j + d] for j in range(blocks)] for i in range(blocks)]) for d in (0, 1))
    u, size, v = np.linalg.svd(now, full_matrices=False)
    u, root, v = u[:, :c], np.sqrt(size[:c]), v[:c]
    offset, vectors = np.linalg.eig((u.conj().T @ then @ v.conj().T) / root / root[:, None])
    shape, participation = ((u * root) @ vectors)[:responses].T, np.linalg.solve(vectors, root[:, None] * v)[:, :references]
    largest = participation[np.arange(c), np.abs(participation).argmax(1)][:, None]
    return centre + reach * offset, shape * largest, participation / largest


def split(lines: Lines, free: Fit) -> Fit:
    """One more pole beside every believed one whose second singular residue matters as much as a pole costs, or matters most.

    Only linear unknowns are fitted: residues of two poles side by side give the first moment that `realise` needs to put them, while
    poles with free residues, one of which is enough here, would wander off to whatever else the data hold.
    """
    responses, references, _ = lines.frf.shape
    u, size, v = np.linalg.svd(free.residues.reshape(-1, responses, references), full_matrices=False)
    first = np.einsum("ri,rk->rik", u[:, :, 0] * size[:, :1], v[:, 0]).reshape(free.residues.shape)
    rest = np.where(believed(lines, free.poles), removal(replace(free, residues=free.residues - first)), 0)
    twice = free.poles[rest >= min(price(lines) * free.scale(), rest.max())]
    return project(lines, np.append(free.poles, twice + 0.2j * twice.real))


def better(lines: Lines, trial: Fit, fit: Fit) -> bool:
    """Whether the information criterion prefers `trial`, the noise taken from the smaller of the two residuals."""
    scale = min(trial.scale(), fit.scale())
    return (fit.chi2 - trial.chi2) / scale > (trial.unknowns - fit.unknowns) * np.log(lines.count) * lines.alike


def _moved(lines: Lines, fit: Fit, step: Array) -> Fit:
    """The fit after a `step` in [Re z, Im z]; a pole moves by a tenth at most and keeps a possible damping."""
    m, half = len(fit.poles), len(step) // 2
    index = varied(fit)
    z = np.concatenate([fit.poles, fit.shape.ravel(), fit.participation.ravel()])
    move = step[:half] + 1j * step[half:]
    z[index] += move * min(1, 0.1 / (np.abs(move[:m]) / np.abs(fit.poles)).max())
    frequency = np.abs(z[:m])
    damping = np.clip(-z[:m].real / frequency, *DAMPING)
    poles = frequency * (-damping + 1j * np.sqrt(1 - damping**2))
    shape, participation = np.split(z[m:], [fit.shape.size])
    return project(lines, poles, shape.reshape(fit.shape.shape), participation.reshape(fit.participation.shape))


def terms(lines: Lines, poles: ComplexArray, order: int) -> ComplexArray:
    """(n, 2m) functions of the real and of the imaginary part of a residue over (s - pole)^order, with its conjugate."""
    upper, lower = (lines.s[:, None] - poles) ** -order, (lines.s[:, None] - poles.conj()) ** -order
    return np.hstack([upper + lower, 1j * (upper - lower)]) * (lines.s**lines.power)[:, None]


def inverted(gram: Array) -> Array:
    """Inverses of positive matrices (..., p, p), scaled to unit diagonal first."""
    size = np.sqrt(np.einsum("...ii->...i", gram))
    scaled = gram / size[..., None] / size[..., None, :] + ROUNDING * np.eye(gram.shape[-1])
    return np.linalg.inv(scaled) / size[..., None] / size[..., None, :]
