"""Modes from poles with free residues: the residue matrix of a mode has rank one, two poles at one
place with one shape are one mode, and what is too weak to be worth free residues still counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.close_poles import PARTED, near, one_shape, second_moment
from thermospindle.sim.identification.pairing import mac
from thermospindle.sim.identification.poles import (
    Fit,
    Lines,
    believed,
    better,
    gain,
    information,
    inverted,
    of_shape,
    project,
    realise,
    refine,
    removal,
    split,
    trial_poles,
)

SURELY = 5.0
"""Standard deviations of what noise takes off chi-square, beyond which something is there."""
DOUBTED = 10.0
"""Times what is by noise, up to which what is told of a pole, to second order, is tried."""
MOST_FAINT, SOON = 10, 0.1
"""Poles that free residues had been too dear for, and the fall of chi-square at which one is
refined: overlapping ones give way along a flat valley."""


def accepted(lines: Lines, found: Fit) -> tuple[Lines, Fit, float, list[tuple[complex, complex]]]:
    """The poles found as modes: as they are where the data accept them so, else those at one place with one shape merged.

    The free residues of two modes nearly at one place are mixed, and look alike before rank one is imposed on them.
    """
    free, twice = merge(lines, found)
    if twice and min(lines.frf.shape[:2]) > 1:  # else any residues are of rank one
        as_found = impose_rank_one(lines, found)
        if as_found[2]:
            return *as_found, []
    return *impose_rank_one(lines, free), twice


def impose_rank_one(lines: Lines, free: Fit) -> tuple[Lines, Fit, float]:
    """The fit with R = shape participation^T for the believed poles in the band, and its strain: the rise of
    chi-square over what the constraints alone cost, one where they cost no more; zero where the data refuse them.

    They are taken as they are, and made `whole`, if chi-square rises by no more than five standard deviations over their number.
    If not, poles whose residues are far from rank one are tried as two modes at nearly one place each. What then still rises more
    may be what modes beyond the band leave: where the information criterion prefers rank one nevertheless it stands, strained, and
    errors are enlarged by the strain's root. Else residues stay free: every function is a response of its own to one reference.
    """
    responses, references, n = lines.frf.shape
    first = believed(lines, free.poles)
    if not first.any():
        return lines, free, 1.0
    strained: list[tuple[float, Fit]] = []
    if min(responses, references) > 1:
        for trial in (make() for make in (lambda: free, lambda: split(lines, free))):
            fit = _joined(lines, refine(lines, start_rank_one(lines, trial), 1e-3))
            if fit is None:
                continue
            constraints, rise = trial.unknowns - fit.unknowns, (fit.chi2 - trial.chi2) / trial.scale()
            if rise < by_noise(lines, constraints):
                return lines, whole(lines, fit), 1.0
            if not better(lines, trial, fit):
                strained.append((max(rise / constraints / lines.alike, 1.0), fit))
    if strained:
        strain, fit = min(strained, key=lambda found: found[0])
        return lines, whole(lines, fit), strain
    flat = replace(lines, frf=lines.frf.reshape(-1, 1, n), weight=lines.weight.reshape(-1, 1, n))
    free = refine(lines, free, 1e-3)
    poles = np.append(free.poles[first], free.poles[~first])
    return flat, project(flat, poles, free.residues[first], np.ones((first.sum(), 1), complex)), float(min(responses, references) == 1)


def _joined(lines: Lines, fit: Fit) -> Fit | None:
    """Two poles of rank one at one place with one shape as one, and all refined: free residues of
    overlapping modes are mixed, and one of them was split that is no two. None where two are there still."""
    for last in (False, True):
        pairs = np.argwhere(one_shape(lines, fit, same_mode(lines, fit.poles[: len(fit.shape)], fit.shape, 0.95)))
        if not len(pairs):
            return fit
        if last:
            break
        i, j = pairs[0]
        u, size, v = np.linalg.svd(np.einsum("ri,rk->ik", fit.shape[[i, j]], fit.participation[[i, j]]))
        poles, shape, participation = fit.poles.copy(), fit.shape.copy(), fit.participation.copy()
        poles[i], shape[i], participation[i] = poles[[i, j]].mean(), u[:, 0] * size[0], v[0]
        fit = refine(lines, project(lines, np.delete(poles, j), np.delete(shape, j, 0), np.delete(participation, j, 0)), 1e-3)
    return None


def merge(lines: Lines, free: Fit) -> tuple[Fit, list[tuple[complex, complex]]]:
    """One pole instead of two at one place with one shape; and for each such pair the pole kept and how far its place is spread.

    Such a pair is one mode that was not the same in all functions: it moved between the references, or is not linear.
    The spread is the standard deviation of two places that have the weights of their residues. Of one reference it is
    the root of what their second moment may be, to a standard error, where that is not `PARTED` from nothing. Where
    one pole, refined alone, does as well, the second was no more than a step of the search, and nothing is spread.

    Of one sensor and several hammers a mode that moved between these and two that each excites
    otherwise are the same numbers; they are taken for the first.
    """
    alone = lines.frf.shape[1] == 1  # any residues are of rank one, and shapes
    spread: list[tuple[complex, complex]] = []
    while True:
        inside = believed(lines, free.poles)
        alike = near(lines, free.poles) & inside & inside[:, None]
        if alone and alike.any():
            alike = one_shape(lines, project(lines, free.poles, free.residues, np.ones((len(free.poles), 1), complex)), alike)
        elif not alone:
            alike &= same_mode(lines, free.poles, np.linalg.svd(free.residues.reshape(-1, *lines.frf.shape[:2]))[0][:, :, 0], 0.8)
        pairs = np.argwhere(alike)
        if not len(pairs):
            return free, spread
        weaker, kept = sorted(pairs[0], key=lambda r: removal(free)[r])
        size = np.linalg.norm(free.residues[[weaker, kept]], axis=1) / np.linalg.norm(free.residues[[weaker, kept]], axis=1).sum()
        far = (free.poles[weaker] - free.poles[kept]) * np.sqrt(size.prod())
        if alone:
            second, error = second_moment(lines, free, kept, weaker)
            if abs(second) < PARTED * error:
                far = np.sqrt(abs(second) + error) * np.exp(0.5j * np.angle(second))
        both, free = free, refine(lines, project(lines, np.delete(free.poles, weaker)))
        if better(lines, both, free):
            spread.append((both.poles[kept], far))


def same_mode(lines: Lines, poles: ComplexArray, shape: ComplexArray, alike: float) -> NDArray[np.bool_]:
    """(m, m), upper triangle: pairs of poles `near` each other, with shapes (m, n_resp) that are `alike` by MAC."""
    return near(lines, poles) & (mac(shape, shape) > alike)


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


def whole(lines: Lines, fit: Fit) -> Fit:
    """`completed`, and without what only stood in for the faint modes."""
    return without_idle(lines, completed(lines, fit))


def completed(lines: Lines, fit: Fit) -> Fit:
    """With poles more that chi-square tells of, each with a residue of rank one, of which free
    residues had been too dear: left out, faint modes bend what overlapping ones tell of themselves.

    On a machine-tool spindle at 6000 rpm the three within 45 Hz were off by up to eleven of their
    standard errors for them. One stays where chi-square falls by more than is `by_noise`.
    """
    responses, references, _ = lines.frf.shape
    grid, told, least = trial_poles(lines), len(fit.shape), by_noise(lines, 2 * (responses + references))
    for _ in range(MOST_FAINT):
        new = grid[gain(lines, project(lines, fit.poles), grid).argmax()]
        beside = project(lines, np.append(fit.poles, new), fit.shape, fit.participation)
        u, size, v = np.linalg.svd(beside.residues[-1].reshape(responses, references))
        poles = np.insert(fit.poles, len(fit.shape), new)
        trial = refine(lines, project(lines, poles, np.vstack([fit.shape, u[:, 0] * size[0]]), np.vstack([fit.participation, v[0]])), SOON)
        twice = same_mode(lines, trial.poles[: len(trial.shape)], trial.shape, 0.95)[:, -1].any()  # a mode that is at two places is no other
        if twice or fit.chi2 - trial.chi2 < least * trial.scale():
            break
        fit = refine(lines, trial, 1e-3)
    return replace(fit, faint=len(fit.shape) - told)


def without_idle(lines: Lines, fit: Fit) -> Fit:
    """Without the poles of rank one that chi-square tells nothing of: what they had stood in for is
    told by those that complete the fit, which were asked already."""
    least = by_noise(lines, 2 * sum(lines.frf.shape[:2]))
    while len(fit.shape) > fit.faint + 1:
        told = _told_of(lines, fit)[: len(fit.shape) - fit.faint]
        if told.min() > DOUBTED * least * fit.scale():
            break
        others = np.arange(len(fit.poles)) != told.argmin()
        imposed = others[: len(fit.shape)]
        trial = refine(lines, project(lines, fit.poles[others], fit.shape[imposed], fit.participation[imposed]), SOON)
        if trial.chi2 - fit.chi2 > least * fit.scale():
            break
        fit = replace(refine(lines, trial, 1e-3), faint=fit.faint)
    return fit


def by_noise(lines: Lines, unknowns: int) -> float:
    """What noise alone lets so many unknowns take off chi-square at most: their number, and `SURELY` standard deviations of that."""
    return float(lines.alike * (unknowns + SURELY * np.sqrt(2 * unknowns)))


def _told_of(lines: Lines, fit: Fit) -> Array:
    """(a,) rise of chi-square without the shape of each pole of rank one, all else following, to second order (Wald's statistic)."""
    covariance, told = inverted(information(lines, fit)[0]), []
    for r, shape in enumerate(fit.shape):
        x, own = of_shape(fit, r), np.append(shape.real, shape.imag)
        told.append(own @ np.linalg.solve(covariance[np.ix_(x, x)], own))
    return np.array(told)
