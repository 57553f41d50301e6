"""Where in their records tests were hit, found where they do not tell and answers have not died away at the records' end.

What a record leaves out goes with e^(i omega t0) (`diagnosis.forward.record`): near its peak a mode hardly shows t0, far from it every
t0 that is wrong by a period is a valley of its own. It is therefore sought on a grid, with all else as it was fitted without effects.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.response import Response
from thermospindle.model.types import Array

REACH = 0.2  # of a record, up to which its hit is sought
FINE = 8  # points of the grid in the period of the band's upper end, and again in each of these
BEYOND = 2.0  # times its squares: what else was fitted without it is strained, and gives way
MOST = 4000  # points of the grid: of long records and wide bands it reaches less far


def hit_found(model: CampaignModel, fitted: Array, least: float) -> CampaignModel | None:
    """The model with its tests hit where that leaves least of the misfit of nuisance values `fitted` (P,): those that do not tell
    it, at one time of the record, and one that gains `least` by another at that. None where all tell, where records are long
    enough, or where chi2 does not fall by `least`; and by what the best of so many times gains by chance (ln of their number:
    chi2 of one number). Nor where it falls by far more than what is left out is in all, which then stands in for something else."""
    thin = model.thinned
    untold = [(t, d) for t, d in enumerate(thin.tests) if isinstance(d, LineData) and np.isfinite(d.duration) and d.test.pretrigger is None]
    if not untold or model.numbers.record is None:
        return None
    x, own_share = fitted.copy(), float(fitted[model.numbers.record])
    x[model.numbers.record] = 0.0
    whole = [(t, d, thin.answer(t, x, thin.linear(t, x, []))) for t, d in untold]
    ending = [(t, d, answer) for t, d, answer in whole if isinstance(answer, Response) and answer.cut_off_after(0.0).any()]
    if not ending:
        return None

    def chi2(before: float, share: float = 1.0) -> Array:
        left = [thin.whitened(t, answer.value + share * answer.cut_off_after(before), d.value) for t, d, answer in ending]
        return np.array([float(r @ r) for r in left])

    step = 1 / (FINE * max(d.frequency[-1] for _, d, _ in ending))
    grid = np.arange(0.0, REACH * min(d.duration for _, d, _ in ending), step)[:MOST]
    coarse = np.array([chi2(before) for before in grid])  # (grid, tests)
    least += 2 * float(np.log(len(grid)))
    none = chi2(0.0, 0.0)

    def can_be(before: Array, gained: Array) -> bool:
        """Whether tests, of which some gained so much by their times, have what is left out there, and not something larger."""
        cut = [np.ravel(thin.whitened(t, answer.value + answer.cut_off_after(b), answer.value)) for b, (t, _, answer) in zip(before, ending, strict=True)]
        square = sum(float(w @ w) for w in cut)
        return float(gained.sum()) < BEYOND * square

    def best(own: slice) -> tuple[float, Array]:
        """The time that leaves least of some tests, and what it leaves of every test."""
        start = float(grid[np.argmin(coarse[:, own].sum(axis=1))])
        near = np.clip(start + step * np.linspace(-1, 1, 2 * FINE + 1), 0.0, None)
        left = np.array([chi2(before) for before in near])
        k = int(np.argmin(left[:, own].sum(axis=1)))
        return float(near[k]), left[k]

    common, left = best(slice(None))
    at = {t: common for t, _ in untold}
    for k, (t, _, _) in enumerate(ending):
        own, left_by_own = best(slice(k, k + 1))
        if left[k] - left_by_own[k] > least:
            at[t], left[k] = own, left_by_own[k]
    if not any(at.values()) or chi2(0.0, own_share).sum() - left.sum() < least or not can_be(np.array([at[t] for t, *_ in ending]), none - left):
        return None
    return replace(model, tests=tuple(replace(d, test=replace(d.test, pretrigger=at[t])) if t in at else d for t, d in enumerate(model.tests)))
