"""Linear toys, whose integrals are known: a campaign of three tests without any spindle."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from scipy.stats import multivariate_normal

from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.diagnosis.inference.prior import AGEING
from thermospindle.diagnosis.parameters.mechanism import REFERENCE_DEPARTURE, REFERENCE_WIDTH, Mechanism, size_covariance
from thermospindle.diagnosis.parameters.nuisance import (
    BUILD,
    DAMPING,
    DAMPING_SD,
    DRIFT,
    DRIFT_SD,
    STIFFNESS,
    STIFFNESS_SD,
    TEMPERATURE,
    Nuisance,
)
from thermospindle.diagnosis.parameters.numbers import Numbers
from thermospindle.model.machine import Condition
from thermospindle.sim.effects.effect import Effect, Parameter

CONDITIONS = [Condition(20.0), Condition(40.0), Condition(60.0)]


@dataclass(frozen=True)
class Toy:
    """y_t = J_t p + errors of unit variance, in `rows` numbers a test; p = [nuisances, whitened sizes]."""

    model: SimpleNamespace
    fit: Fit
    jacobians: list[np.ndarray]
    y: list[np.ndarray]
    mechanisms: tuple[Mechanism, ...]

    def prior(self, stiffness: float, damping: float, drift: float, own=()) -> np.ndarray:
        size = {STIFFNESS: stiffness / STIFFNESS_SD, DAMPING: damping / DAMPING_SD, DRIFT: drift / DRIFT_SD}
        n = len(self.model.parameters)
        whole = np.zeros((len(self.fit.point), len(self.fit.point)))
        whole[:n, :n] = np.diag([size.get(p.kind, 1.0) ** 2 for p in self.model.parameters])
        ages = np.array([size[DRIFT] * AGEING * (p.test - 1) if p.kind == DRIFT else 0.0 for p in self.model.parameters])  # -1, 0, 1 in three tests
        whole[:n, :n] += np.outer(ages, ages)
        for m, root, (width, departure, _) in zip(self.mechanisms, self.fit.roots, own, strict=True):
            inverse = np.linalg.inv(root)
            whole[n:, n:] = inverse @ size_covariance(CONDITIONS, width * m.size.prior_sd, departure) @ inverse.T
        return whole

    def ln(self, prior: np.ndarray, errors: float = 1.0) -> float:
        """ln of the integral of likelihood times prior; the evidence leaves out (2 pi)^(-n/2)."""
        jacobian, y = np.concatenate(self.jacobians), np.concatenate(self.y)
        covariance = errors**2 * np.eye(len(y)) + jacobian @ prior @ jacobian.T
        return float(multivariate_normal(np.zeros(len(y)), covariance).logpdf(y) + len(y) / 2 * np.log(2 * np.pi))


def toy(
    seed: int,
    stiffness: float,
    hidden: float | tuple[float, ...] | None = None,
    limits=(-50.0, 50.0),
    rows: int = 40,
    errors: float = 1.0,
    confused: tuple[float, ...] = (0.0, 0.0, 0.0),
    build: float | tuple[float, ...] = 1.0,
    drawing: str = BUILD,
    reference: Condition | None = None,
) -> Toy:
    """Data drawn with a discrepancy of the size `stiffness`, build tolerances (or other nuisances of that kind, the `drawing`)
    `build` times those stated, three or as many as are told, and, with a mechanism in the fit, a `hidden` size in every test, of which the first tolerance
    cannot be told from `confused` times its change; with a `reference` its law is the data's own and grows from there."""
    random = np.random.default_rng(seed)
    times = dict(enumerate(np.broadcast_to(build, 3) if isinstance(build, float) else build))
    parameters = [Nuisance(drawing, f"b{i}", 0.01) for i in times] + [
        Nuisance(STIFFNESS, f"k{i}", STIFFNESS_SD, modes=(i, i)) for i in range(8)
    ]
    parameters += [Nuisance(DAMPING, f"c{i}", DAMPING_SD, modes=(i, i)) for i in range(2)]
    parameters += [Nuisance(TEMPERATURE, f"t{t}", 0.2, test=t) for t in range(3)] + [
        Nuisance(DRIFT, f"g{t}", DRIFT_SD, test=t) for t in range(3)
    ]
    mechanisms, roots = (), ()
    if hidden is not None:
        size = Parameter("size", "1", 1.0, 1.5, 0.4, limits, "", "")
        mechanisms = (Mechanism(Effect("toy", "", "", (size,), "", (), ""), {}, (), own_law=reference is not None, reference=reference),)
        offset = 1.0 if reference is None else 0.0
        roots = (np.linalg.cholesky(size_covariance(CONDITIONS, REFERENCE_WIDTH * size.prior_sd, REFERENCE_DEPARTURE, offset, reference)),)
    n = len(parameters)
    sizes = {STIFFNESS: stiffness / STIFFNESS_SD, TEMPERATURE: 1.0}
    p = np.array([*times.values(), *(sizes.get(q.kind, 0.0) for q in parameters[len(times) :])])
    p = np.concatenate([p * random.standard_normal(n), *([np.linalg.solve(r, np.full(3, np.array(hidden) - 1.0)) for r in roots])])
    own_of_test = np.array([q.test is None for q in parameters])
    jacobians, y = [], []
    for t in range(3):
        j = random.standard_normal((rows, n)) * np.where(own_of_test | np.array([q.test == t for q in parameters]), 1.0, 0.0)
        j[:, [q.kind == STIFFNESS for q in parameters]] *= 5  # the smallest size shows by about five standard errors
        by_size = 2 * random.standard_normal((rows, 1))
        if any(confused):
            j[:, :1] = confused[t] * by_size
        j = np.concatenate([j, *[by_size * r[t][None, :] for r in roots]], axis=1)
        jacobians.append(j)
        y.append(j @ p + errors * random.standard_normal(rows))
    point = p + 0.3 * random.standard_normal(len(p))  # the quadratic is the same about any point
    by_test = tuple((float((j @ point - v) @ (j @ point - v)), j.T @ (j @ point - v), j.T @ j) for j, v in zip(jacobians, y, strict=True))
    tests = tuple(SimpleNamespace(condition=c, count=rows) for c in CONDITIONS)
    fit = Fit(
        mechanisms, point, np.zeros((len(mechanisms), 3)), ((),) * len(mechanisms), roots, sum(b[0] for b in by_test),
        np.sum([b[1] for b in by_test], axis=0), np.sum([b[2] for b in by_test], axis=0), by_test, 3 * rows, None, 1.0,
    )  # fmt: skip
    return Toy(SimpleNamespace(parameters=tuple(parameters), tests=tests, numbers=Numbers(parameters, tests, None)), fit, jacobians, y, mechanisms)
