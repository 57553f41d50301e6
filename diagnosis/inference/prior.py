"""Priors of everything a fit moves, over p = [nuisances, whitened sizes and shape parameters of every mechanism], in reference widths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array

from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import REFERENCE_DEPARTURE, REFERENCE_WIDTH, Mechanism, size_covariance
from thermospindle.diagnosis.parameters.sizes import of_tolerances
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array

REFERENCE = {
    kinds_of.BUILD: 1.0,
    kinds_of.STIFFNESS: kinds_of.STIFFNESS_SD,
    kinds_of.DAMPING: kinds_of.DAMPING_SD,
    kinds_of.STIFFNESS_DRIFT: kinds_of.STIFFNESS_DRIFT_SD,
    kinds_of.DAMPING_DRIFT: kinds_of.DAMPING_DRIFT_SD,
    kinds_of.DRIFT: kinds_of.DRIFT_SD,
    kinds_of.HAMMER: 1.0,
    kinds_of.HAMMER_DRIFT: kinds_of.DRIFT_SD,
    kinds_of.MISS_DRIFT: kinds_of.MISS_DRIFT_SD,
    kinds_of.CHANGE: kinds_of.CHANGE_SD,
    kinds_of.EXPANSION: 1.0,
}
"""Widths in which nuisances of unknown size are counted; build tolerances and hammers' gains in
those that the scene states, thermal motions in `EXPANSION_SD`."""
ACTION = 3.0  # times the relative error of frequencies, by which what the model says of temperature and speed, and of an effect, may be wrong at least
AGEING = 2.0
"""What a gain that drifts is off by at the first and the last test, going straight with their order,
times what it scatters by: amplifiers warm up, calibrations age. Chosen on one campaign of another's
simulator with nothing hidden, in which a sensor lost 2 % over nine tests and scattered by 0.3 %."""
Own = tuple[float, float, float]
"""Width in a size's own prior standard deviations, departure and offset of one mechanism."""
UNMOVED = np.zeros((0, 0, 2, 0))
"""Of fits with errors enlarged, which are a place to start from."""
NOTHING = 1e-4  # of a reference width: what stands for a size of zero where a prior must be inverted


@dataclass(frozen=True)
class Learned:
    """What is likeliest: `sizes` of discrepancies, of gain drift and of build tolerances by kind of nuisance, and of single build tolerances
    by name (`parameters.sizes`); the factor of the stated errors; width, departure and offset of every mechanism (`size_covariance`)."""

    sizes: Mapping[str, float]
    errors: float
    widths: tuple[float, ...] = ()
    departures: tuple[float, ...] = ()
    offsets: tuple[float, ...] = ()

    @property
    def own(self) -> list[Own]:
        """Of every mechanism."""
        return list(zip(self.widths, self.departures, self.offsets, strict=True))


DRIFTING = (kinds_of.STIFFNESS_DRIFT, kinds_of.DAMPING_DRIFT)
AGES = (kinds_of.DRIFT, kinds_of.HAMMER_DRIFT)
CHANGING = (*DRIFTING, kinds_of.CHANGE)
"""What changes from test to test, of every mode, and of bearings."""


def steady(learned: Learned, mechanisms: Sequence[Mechanism] = ()) -> Learned:
    """What was learned of constant discrepancies, of gains and, where they were, of build tolerances, for a fit of `mechanisms`: how much modes
    drift, bearings change otherwise and thermal motions are off, is left as it is on paper, so that none takes what the mechanisms should explain."""
    on_paper = (*CHANGING, kinds_of.EXPANSION)
    sizes = {kind: REFERENCE[kind] if kind in on_paper else max(REFERENCE[kind], size) for kind, size in learned.sizes.items() if kind in REFERENCE}
    return as_stated(sizes | of_tolerances(learned.sizes), mechanisms)


def wider_tolerances(learned: Learned) -> dict[str, float]:
    """How many times as wide as stated build tolerances were learned to be that are wider: all of them, by their kind, and each by its name."""
    return {of: times for of, times in of_tolerances(learned.sizes).items() if times > 1.0}


def undrifted(learned: Learned) -> Learned:
    """What was learned, but for modes that drift and bearings that change otherwise."""
    return replace(learned, sizes={kind: 0.0 if kind in CHANGING else size for kind, size in learned.sizes.items()})


def as_stated(sizes: Mapping[str, float], mechanisms: Sequence[Mechanism] = ()) -> Learned:
    """Discrepancies of some sizes, errors as stated and mechanisms at their reference widths."""
    return Learned(sizes, 1.0, *zip(*[counted_in(m) for m in mechanisms], strict=True)) if mechanisms else Learned(sizes, 1.0)


def counted_in(m: Mechanism) -> Own:
    """What a fit counts the sizes of a mechanism in: an offset may be found where one is conceivable."""
    return REFERENCE_WIDTH, REFERENCE_DEPARTURE, 1.0 if m.free or m.reference is None else 0.0


def roots_of(model: CampaignModel, mechanisms: Sequence[Mechanism]) -> tuple[Array, ...]:
    """Of every mechanism the root (tests, tests) of its sizes' covariance at the reference width: sizes = neutral + root z."""
    conditions = [d.condition for d in model.tests]
    own = [(m, *counted_in(m)) for m in mechanisms]
    return tuple(np.asarray(np.linalg.cholesky(size_covariance(conditions, w * m.size.prior_sd, d, o, m.reference)), float) for m, w, d, o in own)


def _width(kind: str, sizes: Mapping[str, float]) -> float:
    """Of the nuisances of one kind, in units of its reference width."""
    return sizes[kind] / REFERENCE[kind] if kind in sizes else 1.0


def nuisance_variances(model: CampaignModel, sizes: Mapping[str, float]) -> Array:
    """Prior variances (P,) of the nuisance parameters in units of their reference widths."""
    found = np.ones(len(model.parameters))
    for kind, own in model.numbers.of_kind.items():
        found[own] = _width(kind, sizes) ** 2
    for name, number in model.numbers.tolerances.items():
        found[number] *= sizes.get(name, 1.0) ** 2
    return found


def misjudged(model: CampaignModel, sizes: Mapping[str, float], moved: Array) -> Array:
    """Root (P, k) of the prior covariance that what is misjudged of conditions and effects adds to the drift of modes.

    A model whose frequencies are constantly wrong is wrong, too, in what temperature, speed and an effect do: of the relative
    change of frequency and of damping that conditions and each mechanism make of a mode, `moved` (1 + mechanisms, tests, 2, modes),
    a share is wrong, the same in all tests: `ACTION` times the relative error of the frequencies at least, or what was learned of
    either. Of a mechanism that is what it does beyond the least that it does in any test: what it does in all of them alike may be
    misjudged as the drawing is, by a constant error of modes, which every explanation has. Two effects of no use, as much in every
    test and each other's opposite, had 120 in ln evidence by letting the one mode that both move be off by what they may be.
    """
    least, kinds = ACTION * sizes.get(kinds_of.STIFFNESS, 0.0), (kinds_of.OF_CONDITIONS, *[kinds_of.ACTION] * (len(moved) - 1))
    shares = np.array([max(least, sizes.get(kind, 0.0)) for kind in kinds])
    if not (shares.any() and moved.any()):
        return np.zeros((len(model.parameters), 0))
    found = np.zeros((len(model.parameters), len(moved), *moved.shape[2:]))
    alike = np.take_along_axis(moved[1:], np.abs(moved[1:]).argmin(axis=1, keepdims=True), axis=1)
    changes = np.concatenate([moved[:1], moved[1:] - alike])
    test, _, mode = model.numbers.places
    for which, kind in enumerate(DRIFTING):
        if (own := model.numbers.of_kind.get(kind)) is not None:
            found[own, :, which, mode[own]] = (shares[:, None] * changes[:, test[own], which, mode[own]]).T / REFERENCE[kind]
    columns = found.reshape(len(found), int(np.prod(found.shape[1:])))
    return columns[:, columns.any(axis=0)]


def ageing(model: CampaignModel, sizes: Mapping[str, float]) -> Array:
    """Root (P, k) of the prior covariance of gains that go straight with the order in which the
    campaign lists its tests, in proportion to their drift from test to test."""
    order, found = np.linspace(-1.0, 1.0, len(model.tests)), [np.zeros((len(model.parameters), 0))]
    test, index, _ = model.numbers.places
    for kind in AGES:
        own = model.numbers.of_kind.get(kind)
        if own is not None and (scatter := _width(kind, sizes)):
            gains, of = np.unique(index[own], return_inverse=True)
            found.append(np.zeros((len(model.parameters), len(gains))))
            found[-1][own, of] = AGEING * scatter * order[test[own]]
    return np.hstack(found)


def correlated(model: CampaignModel, sizes: Mapping[str, float], moved: Array) -> Array:
    """Root (P, k) of what of the nuisances' prior covariance is not each by itself."""
    return np.hstack([misjudged(model, sizes, moved), ageing(model, sizes)])


def mechanism_covariance(model: CampaignModel, mechanisms: Sequence[Mechanism], own: Sequence[Own]) -> Array:
    """Prior covariance of [z, u] of all mechanisms, each with its width, departure and offset."""
    tests = len(model.tests)
    prior, at = np.eye(sum(tests + len(m.shape) for m in mechanisms)), 0
    conditions = tuple(d.condition for d in model.tests)
    for m, widths in zip(mechanisms, own, strict=True):
        prior[at : at + tests, at : at + tests] = whitened_covariance(conditions, m.reference, counted_in(m), widths)
        at += tests + len(m.shape)
    return prior


@lru_cache(maxsize=256)
def whitened_covariance(conditions: tuple[Condition, ...], reference: Condition | None, counted: Own, own: Own) -> Array:
    """Covariance (tests, tests) of z = root^-1 (sizes - neutral), where the root is that of what is `counted`
    in: the same for every mechanism of one reference, as widths are counted in its own standard deviation."""
    root = np.linalg.cholesky(size_covariance(conditions, *counted, reference))
    half = solve_triangular(root, size_covariance(conditions, *own, reference), lower=True)
    return np.asarray(solve_triangular(root, half.T, lower=True))


def together(scale: Array, beside: Array) -> csr_array:
    """R (P, r) of the covariance R R^T of parameters that have each a width of their own, `scale`
    (P,), and `beside` (P, k) what is not each by itself; those without either have no columns."""
    wide = np.flatnonzero(scale)
    rows, columns = beside.nonzero()
    by_row = np.argsort(np.concatenate([wide, rows]), kind="stable")
    terms, places = np.concatenate([scale[wide], beside[rows, columns]])[by_row], np.concatenate([np.arange(len(wide)), len(wide) + columns])[by_row]
    first = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=len(scale)) + (scale != 0))])
    return csr_array((terms, places, first), shape=(len(scale), len(wide) + beside.shape[1]))


def nuisance_root(model: CampaignModel, sizes: Mapping[str, float], moved: Array) -> csr_array:
    """R (P, r) of the nuisances' prior covariance R R^T, the mechanisms having `moved` the modes; singular where a size is zero."""
    return together(np.sqrt(nuisance_variances(model, sizes)), correlated(model, sizes, moved))


def mechanism_root(model: CampaignModel, mechanisms: Sequence[Mechanism], learned: Learned) -> Array:
    """Root (m, m) of the prior covariance of [z, u] of all mechanisms, with what was learned of each."""
    own = mechanism_covariance(model, mechanisms, learned.own)
    return np.asarray(np.linalg.cholesky(own + 1e-14 * np.eye(len(own))), float)


def precision_and_variances(
    model: CampaignModel, mechanisms: Sequence[Mechanism], learned: Learned | None, moved: Array = UNMOVED
) -> tuple[Array, Array]:
    """The inverse (n, n) of the prior covariance, with next to nothing for sizes of zero, and the
    diagonal (n,) of that covariance; of the reference widths, which are ones, without `learned`."""
    if learned is None:
        n = len(model.parameters) + sum(len(model.tests) + len(m.shape) for m in mechanisms)
        return np.eye(n), np.ones(n)
    own_variances, together, own = _floored(model, mechanisms, learned, moved)
    n = len(own_variances)
    found = np.zeros((n + len(own), n + len(own)))
    alone = 1 / own_variances
    beside = alone[:, None] * together
    inner = np.eye(beside.shape[1]) + beside.T @ (beside / alone[:, None])  # Woodbury's identity (Golub & Van Loan, 2.1.4)
    found[:n, :n] = np.diag(alone) - beside @ np.linalg.solve(inner, beside.T)
    found[n:, n:] = np.linalg.inv(own)
    return found, np.concatenate([own_variances + np.sum(together**2, axis=1), np.diag(own)])


def _floored(model: CampaignModel, mechanisms: Sequence[Mechanism], learned: Learned, moved: Array) -> tuple[Array, Array, Array]:
    """The parts of a prior covariance that can be inverted: variances (P,) of nuisances, the root
    (P, k) of what is correlated, and the covariance (m, m) of the mechanisms."""
    own = mechanism_covariance(model, mechanisms, learned.own)
    alone = np.maximum(nuisance_variances(model, learned.sizes), NOTHING**2)
    return alone, correlated(model, learned.sizes, moved), own + NOTHING**2 * np.eye(len(own))
