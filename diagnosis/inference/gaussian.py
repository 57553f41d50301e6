"""Integrals of a quadratic over Gaussian priors, of which evidence is made, and what limits do to
them: shape parameters between limits, or held at one, and sizes of one sign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear
from scipy.sparse import csr_array
from scipy.special import binom, chdtrc, log_ndtr, ndtr

from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.diagnosis.parameters.mechanism import Mechanism, grown, size_covariance
from thermospindle.model.types import Array

CANNOT = 3.0  # standard errors, from which a mechanism would need what it cannot have
TINY = 1e-6  # of the sum of variances, which one has at least; and of a prior's standard deviation, to which a size is known at best


@dataclass(frozen=True, eq=False)
class Quadratic:
    """chi2 = constant - 2 b p + p A p."""

    constant: float
    b: Array
    a: Array

    def at(self, p: Array) -> float:
        return float(self.constant - 2 * self.b @ p + p @ self.a @ p)


def quadratic(chi2: float, gradient: Array, information: Array, point: Array) -> Quadratic:
    b = information @ point - gradient
    return Quadratic(float(chi2 - 2 * gradient @ point + point @ information @ point), b, information)


@dataclass(frozen=True, eq=False)
class Marginal:
    """The quadratic of [z, u] with nuisances integrated over their priors: ln of the integral is `constant` + b p - p A p / 2."""

    constant: float
    b: Array
    a: Array

    def at(self, p: Array) -> float:
        """ln of the integral over the nuisances alone."""
        return float(self.constant + self.b @ p - p @ self.a @ p / 2)

    def integrated(self, roots: Sequence[Array]) -> Array:
        """ln of the integral (g_1 g_2 ...,) over the priors of all mechanisms, each with every one
        of its `roots` (g_k, m_k, m_k): one mechanism after the other, by Schur complements."""
        constant, b, a = np.array([self.constant]), self.b[None], self.a[None]
        for root in roots:
            m, turned = root.shape[-1], root.transpose(0, 2, 1)
            factor = _factor(turned @ a[:, None, :m, :m] @ root)  # (G, g, m, m)
            rest = turned @ np.concatenate([b[:, :m, None], a[:, :m, m:]], axis=2)[:, None]
            solved = np.linalg.solve(factor, rest)
            of_b, of_a = solved[..., 0], solved[..., 1:]
            logs = np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(axis=-1)
            constant = (constant[:, None] + 0.5 * np.sum(of_b**2, axis=-1) - logs).reshape(-1)
            left = of_a.swapaxes(-1, -2)
            b = (b[:, None, m:] - (left @ of_b[..., None])[..., 0]).reshape(len(constant), -1)
            a = (a[:, None, m:, m:] - left @ of_a).reshape(len(constant), *(b.shape[-1],) * 2)
        return np.asarray(constant, float)


def _factor(information: Array) -> Array:
    """Cholesky factors (..., m, m) of 1 + `information`, of which rounding may have made what is nothing less
    than nothing: where nuisances do all that a mechanism does, their difference is of the rounding of either."""
    one = np.eye(information.shape[-1])
    try:
        return np.asarray(np.linalg.cholesky(information + one))
    except np.linalg.LinAlgError:
        value, vector = np.linalg.eigh((information + information.swapaxes(-1, -2)) / 2)
        return np.asarray(np.linalg.cholesky((vector * np.maximum(value, 0.0)[..., None, :]) @ vector.swapaxes(-1, -2) + one))


@dataclass(frozen=True, eq=False)
class Nuisances:
    """The first parameters (p,) of a quadratic under their prior R R^T, of which R (p, r) is the `root`: what all
    mechanisms that stand beside them have in common. `factor` (r, r) is the lower Cholesky factor of 1 + R^T A R."""

    root: csr_array
    factor: Array

    def halved(self, matrix: Array) -> Array:
        """H (r, c) of a matrix B (p, c), whose H^T H is B^T (A + (R R^T)^-1)^-1 B."""
        return np.asarray(solve_triangular(self.factor, self.root.T @ matrix, lower=True, check_finite=False))

    def back(self, half: Array) -> Array:
        """(A + (R R^T)^-1)^-1 B of H (r, c); of ones a root of the covariance."""
        return np.asarray(self.root @ solve_triangular(self.factor, half, lower=True, trans="T"))

    @cached_property
    def half_ln_determinant(self) -> float:
        return float(np.log(np.diag(self.factor)).sum())

    @cached_property
    def covariance(self) -> Array:
        """(A + (R R^T)^-1)^-1, (p, p)."""
        root = self.back(np.eye(len(self.factor)))
        return root @ root.T


def under(root: csr_array, information: Array) -> Nuisances:
    """Nuisances of an information (p, p) under a prior of theirs alone, of which R (p, r) is the `root`."""
    turn = root.T
    inner = np.asarray(turn @ (turn @ information).T)
    np.fill_diagonal(inner, inner.diagonal() + 1.0)
    return Nuisances(root, np.asarray(cholesky(inner.T, lower=True, overwrite_a=True, check_finite=False)))


def marginal(q: Quadratic, nuisances: Nuisances) -> Marginal:
    """What is left of the quadratic without the nuisances."""
    return _apart(q, nuisances)[0]


def _apart(q: Quadratic, nuisances: Nuisances) -> tuple[Marginal, Array, Array]:
    """`marginal`, and `Nuisances.halved` of b (r,) and of what couples nuisances to mechanisms (r, m)."""
    p = nuisances.root.shape[0]
    halves = nuisances.halved(np.concatenate([q.b[:p, None], q.a[:p, p:]], axis=1))
    b, a = halves[:, 0], halves[:, 1:]
    constant = -0.5 * q.constant + 0.5 * float(b @ b) - nuisances.half_ln_determinant
    return Marginal(constant, q.b[p:] - a.T @ b, q.a[p:, p:] - a.T @ a), b, a


def posterior(q: Quadratic, nuisances: Nuisances, own: Array) -> tuple[Array, Array, Marginal]:
    """Mean (n,) and covariance (n, n), where the mechanisms have the prior `own` own^T (m, m), and the marginal of these."""
    left, b, a = _apart(q, nuisances)
    half = solve_triangular(_factor(own.T @ left.a @ own), own.T, lower=True)
    covariance = half.T @ half
    mean, beside = covariance @ left.b, nuisances.back(a)
    coupled = -beside @ covariance
    return (
        np.concatenate([nuisances.back(b[:, None])[:, 0] - beside @ mean, mean]),
        np.block([[nuisances.covariance - coupled @ beside.T, coupled], [coupled.T, covariance]]),
        left,
    )


def ln_integral(q: Quadratic, nuisances: Nuisances, own: Array) -> float:
    """ln of the integral of exp(-chi2 / 2) over all parameters, where the mechanisms have the prior `own` own^T (m, m)."""
    return float(marginal(q, nuisances).integrated([own[None]])[0])


def ln_within_limits(fit: Fit, mean: Array, spread: Array, errors: float) -> float:
    """ln of the posterior probability, to a quadratic, that shape parameters are within their limits, over the prior's; of
    one that is held at a limit, of the integral of what falls off from there, `errors` being so many times those stated."""
    found, at, held = 0.0, len(fit.nuisance), {h.number: h for h in fit.held}
    for m, root in zip(fit.mechanisms, fit.roots, strict=True):
        for number, q in enumerate(m.shape, at + len(root)):
            low, high = ((limit - q.neutral) / q.prior_sd for limit in q.limits)
            if number in held:
                h, far = held[number], abs(float(fit.point[number]))  # the prior, whose slope is that and whose curvature is one, knows of no errors
                slope, curvature = h.slope / errors**2 - far, max(h.curvature, 0.0) / errors**2 + 1.0
                scaled = slope / np.sqrt(curvature)
                inside = scaled**2 / 2 + log_ndtr(-scaled) - np.log(curvature) / 2 - far**2 / 2
            else:
                sd = max(float(np.sqrt(max(spread[number, number], 0.0))), 1e-12)
                inside = np.log(max(ndtr((high - mean[number]) / sd) - ndtr((low - mean[number]) / sd), 1e-300))
            found += float(inside - np.log(ndtr(high) - ndtr(low)))
        at += len(root) + len(m.shape)
    return found


def one_sided(model: CampaignModel, mechanism: Mechanism, own: tuple[float, float, float], mean: Array, covariance: Array) -> float:
    """ln of twice the posterior probability of the sign that limits allow: a size that may not be negative has half its prior.

    The sign is that of the size a which all tests share, about which `own` (width, departure, offset) lets them
    scatter: a_t = a (1 + r_t), of which the posterior `mean` (n,) and `covariance` (n, n) are given, that with
    shape parameters as they are (`opposite`); of what grows from a reference, of the sum of its slopes
    (conditional mean of jointly Gaussian quantities: Rasmussen & Williams, *Gaussian Processes*, 2006, Eq. A.6).
    """
    sign = mechanism.size.sign
    if not sign:
        return 0.0
    conditions, (width, departure, offset) = [d.condition for d in model.tests], own
    prior = size_covariance(conditions, 1.0, departure, offset, mechanism.reference)
    terms = np.ones((1, len(mean))) if mechanism.reference is None else grown(conditions, mechanism.reference)
    terms = terms[terms.any(axis=1)]
    together = terms.sum(axis=0)
    weight = np.linalg.solve(prior, together)
    variance = (width * mechanism.size.prior_sd) ** 2 * max(len(terms) - float(weight @ together), 0.0) + float(weight @ covariance @ weight)
    return float(np.log(2) + log_ndtr(sign * float(weight @ (mean - mechanism.size.neutral)) / np.sqrt(max(variance, 1e-300))))


def impossible(m: Mechanism, sizes: Array, covariance: Array) -> bool:
    """Whether a mechanism would need sizes (tests,) that it cannot have: whether those that it can lie farther from them, all
    tests taken together, than `CANNOT` standard errors of one are by chance, were the truth at the limit: chi-bar-squared, of
    as many independent tests as there are (Silvapulle & Sen, *Constrained Statistical Inference*, 2005, Eq. 3.5). What is alike
    in all tests may be a build tolerance's as well, and a size that is off by that is not told by one test's standard error."""
    if m.size.limits[0] <= sizes.min() and sizes.max() <= m.size.limits[1]:
        return False
    variance, along = np.linalg.eigh(covariance)
    known = (TINY * m.size.prior_sd) ** 2  # rounding may leave a variance below nothing
    whitened = along.T / np.sqrt(np.maximum(variance, max(TINY * float(variance.sum()), known)))[:, None]
    nearest = lsq_linear(whitened, whitened @ sizes, m.size.limits)
    return bool(2 * nearest.cost > CANNOT**2 and _by_chance(2 * nearest.cost, _independent(m, sizes, covariance)) < ndtr(-CANNOT))


def _independent(m: Mechanism, sizes: Array, covariance: Array) -> int:
    """How many independent sizes those are worth that are not well within their limits: (sum of the
    eigenvalues)^2 over the sum of their squares, of their correlations."""
    sd = np.sqrt(np.maximum(np.diag(covariance), (TINY * m.size.prior_sd) ** 2))
    low, high = m.size.limits
    near = np.minimum(sizes - low, high - sizes) < CANNOT * sd
    values = np.linalg.eigvalsh((covariance / sd / sd[:, None])[np.ix_(near, near)])
    return max(round(float(values.sum() ** 2 / max(values @ values, 1e-300))), 1)


def _by_chance(square: float, count: int) -> float:
    """Probability that so many independent errors beyond their limits, each as often as not, have squares of a larger sum."""
    beyond = np.arange(1, count + 1)
    return float(binom(count, beyond) @ chdtrc(beyond, square)) / 2.0**count


def apart_by(sizes: Array, covariance: Array) -> Array:
    """How far (n, n) every two of some sizes (n,) lie apart, in standard errors of their difference; of one from itself nothing."""
    variance = np.diag(covariance)
    sd = np.sqrt(np.maximum(variance[:, None] + variance - 2 * covariance, 1e-300))
    return np.asarray(np.abs(sizes[:, None] - sizes) / sd)


def opposite(m: Mechanism, sizes: Array, covariance: Array) -> bool:
    """Whether a mechanism would need the sign that it cannot have: in every test (tests,), by more than twice its standard error, or
    by more than `CANNOT` in one and the sign that it can have in none; where its law does nothing any sign would do. The `covariance`
    (tests, tests) is that with shape parameters as they are: an amount times what they make of it may be told along a hyperbola, which
    never comes to the other sign, where a quadratic does (a flange that stiffened was named as one that loosens, by -0.0055 +- 0.004)."""
    sign, (low, high) = m.size.sign, m.size.limits
    beyond = sign * ((low if sign > 0 else high) - sizes) / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return bool(sign and (np.all(beyond > 2) or (beyond.max() > CANNOT and beyond.min() > -2)))
