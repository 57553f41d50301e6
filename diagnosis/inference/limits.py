"""What limits do to evidence: shape parameters between limits, or held at one, and sizes of one sign."""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtr

from thermospindle.diagnosis.forward.mechanism import Mechanism, size_covariance
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.model.types import Array


def within_limits(fit: Fit, mean: Array, spread: Array) -> float:
    """ln of the posterior probability, to a quadratic, that shape parameters are within their limits, over the prior's; of one that is held at a limit, of the
    integral of what falls off from there."""
    found, at, held = 0.0, len(fit.nuisance), {h.number: h for h in fit.held}
    for m, root in zip(fit.mechanisms, fit.roots, strict=True):
        for number, q in enumerate(m.shape, at + len(root)):
            low, high = ((limit - q.neutral) / q.prior_sd for limit in q.limits)
            if number in held:
                h = held[number]
                scaled = h.slope / np.sqrt(h.curvature)
                inside = scaled**2 / 2 + log_ndtr(-scaled) - np.log(h.curvature) / 2 - fit.point[number] ** 2 / 2
            else:
                sd = max(float(np.sqrt(max(spread[number, number], 0.0))), 1e-12)
                inside = np.log(max(ndtr((high - mean[number]) / sd) - ndtr((low - mean[number]) / sd), 1e-300))
            found += float(inside - np.log(ndtr(high) - ndtr(low)))
        at += len(root) + len(m.shape)
    return found


def one_sided(model: CampaignModel, mechanism: Mechanism, own: tuple[float, float], mean: Array, covariance: Array) -> float:
    """ln of twice the posterior probability of the sign that limits allow: a size that may not be negative has half its prior.

    The sign is that of the size a which all tests share, about which `own` (width, departure) lets them scatter: a_t = a (1 + r_t), of which the
    posterior `mean` (n,) and `covariance` (n, n) are given (conditional mean of jointly Gaussian quantities: Rasmussen & Williams, *Gaussian
    Processes*, 2006, Eq. A.6).
    """
    low, high = mechanism.size.limits
    sign = 1.0 if low >= mechanism.size.neutral else -1.0 if high <= mechanism.size.neutral else 0.0
    if not sign:
        return 0.0
    width, departure = own
    prior = size_covariance([d.condition for d in model.tests], 1.0, departure)
    weight = np.linalg.solve(prior, np.ones(len(mean)))
    variance = (width * mechanism.size.prior_sd) ** 2 * max(1.0 - float(weight.sum()), 0.0) + float(weight @ covariance @ weight)
    return float(np.log(2) + log_ndtr(sign * float(weight @ (mean - mechanism.size.neutral)) / np.sqrt(max(variance, 1e-300))))


def impossible(m: Mechanism, sizes: Array, covariance: Array) -> bool:
    """Whether a mechanism would need a size (tests,) that it cannot have, by more than twice its standard error."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return bool(np.any((sizes < m.size.limits[0] - 2 * sd) | (sizes > m.size.limits[1] + 2 * sd)))
