"""What is left of every test in standard errors of its data: as drawn, fitted to all tests, and
predicted from all other conditions; and whether a fit has arrived."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.evidence import amplitudes_apart, at_one_size, left_out, turned
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.model.types import Array

STILL_OWED = 0.1  # of chi2, up to which a fit that promises so much less has arrived


def arrived(h: Hypothesis) -> bool:
    """Whether an explanation stands where its fit has ended: no step promised much that none found, nor is its
    evidence more than data without any misfit give, which only the rounding of a quadratic far from its minimum makes."""
    return h.evidence.ln <= 0.0 and h.fit.owed <= max(STILL_OWED * h.fit.chi2, float(h.fit.count))


def as_drawn(model: CampaignModel) -> Array:
    """Rms residual (tests,) of the scene with nothing fitted, and without light resonances, which no drawing has."""
    drawn = replace(model, parameters=tuple(p for p in model.parameters if p.kind != kinds_of.RESONANCE), resonances=())
    nothing = np.zeros(len(drawn.parameters))
    return np.array([np.sqrt(np.mean(drawn.residual(t, nothing, ()) ** 2)) for t in range(len(drawn.tests))])


def fitted(model: CampaignModel, h: Hypothesis) -> Array:
    """Rms residual (tests,) at the posterior mean of an explanation, whose squares add up to chi2 of its evidence."""
    turn, point = amplitudes_apart(h.fit), h.fit.point
    mean = point + np.linalg.solve(turn.toarray(), h.evidence.mean - point)
    squares = np.array([turned(turn, *b, point).at(mean) for b in at_one_size(h.fit)])
    return np.sqrt(np.maximum(squares, 0.0) / [d.count for d in model.tests])


def predicted(model: CampaignModel, h: Hypothesis) -> Array:
    """Rms residual (tests,) of every condition predicted from all others, that of a condition for
    each of its tests; not a number of a single condition."""
    found = np.full(len(model.tests), np.nan)
    for group in conditions_of(model.spindle, model.tests):
        found[list(group)] = left_out(model, h.fit, h.evidence, [group])[0]
    return found


def whole(rms: Array, model: CampaignModel) -> float:
    """Rms of all tests from that of each (tests,)."""
    counts = np.array([d.count for d in model.tests])
    return float(np.sqrt(counts @ rms**2 / counts.sum()))
