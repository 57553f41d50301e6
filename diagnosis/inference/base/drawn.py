"""The fit without effects, from the drawing or from afar, and the time of hits that no test tells."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from thermospindle.diagnosis.forward.hit import hit_found
from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.base.afar import from_envelopes, from_nearest_peaks
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit
from thermospindle.diagnosis.inference.hypothesis import PLENTY, Hypothesis, settled, widened
from thermospindle.model.parallel import in_parallel, tell

MISSED = 2.0  # times the errors that the model without effects leaves, from which it may have stalled
AFAR: tuple[tuple[Callable[[CampaignModel], Fit | None], ...], ...] = (
    tuple(partial(from_nearest_peaks, count=1, wider=wider) for wider in (3.0, 5.0)),
    tuple(partial(from_envelopes, share=share) for share in (0.008, 0.012, 0.016, 0.022)),
    tuple(partial(from_nearest_peaks, count=4, wider=wider) for wider in (3.0, 10.0)),
)  # ways side by side; what follows where it stalls still
FINER = 2  # times that hits which no test tells are sought, each with less else that is left


def hit_when_it_was(model: CampaignModel, workers: int | None = None) -> tuple[CampaignModel, Hypothesis]:
    """The model with its tests hit where their lines say, if they do not tell, and it fitted without effects. What a fit misses
    for that alone is explained by it, and needs no start from afar; and what it explains tells the times of hits the finer."""
    told, first = model, fit(model, done=tell)
    if _missed(first):
        hit = _hit(model, Hypothesis(first, evidence(model, first)))
        if hit is not None and not _missed(again := fit(hit, done=tell)):
            told, first = hit, again
    none = _reached(told, first, workers)
    for _ in range(FINER):
        hit = _hit(model, none)
        if hit is None or _times(hit) == _times(told):
            break
        told, none = hit, without_effects(hit, workers)
    return told, none


def _hit(model: CampaignModel, none: Hypothesis) -> CampaignModel | None:
    return hit_found(model, none.fit.nuisance, 2 * PLENTY * none.evidence.learned.errors**2)


def _times(model: CampaignModel) -> list[float | None]:
    return [d.test.pretrigger for d in model.tests]


def without_effects(model: CampaignModel, workers: int | None = None) -> Hypothesis:
    """The model without effects, with its evidence: fitted from the drawing, or from afar where it stalls there."""
    return _reached(model, fit(model, done=tell), workers)


def _reached(model: CampaignModel, first: Fit, workers: int | None) -> Hypothesis:
    for ways in AFAR:
        if _missed(first):
            found = in_parallel(partial(_by, model), ways, workers)
            first = min((first, *(f for f in found if f is not None)), key=lambda f: f.cost)
    h = settled(model, Hypothesis(first, evidence(model, first)))
    return _by_wider_tolerances(model, h) if _missed(h.fit) else h


def _by_wider_tolerances(model: CampaignModel, h: Hypothesis) -> Hypothesis:
    """From where tolerances as wide as the data have them lead, beside constant errors by which modes have moved: on the symmetric scene
    three joints 41 % softer than drawn, whose envelopes had not led there, left 53 times the errors before, and 1.01 from here."""
    there = widened(model, h)
    try:
        again = fit(model, (), there.fit.point, there.fit.rates, TEMPERS[-1:])
    except FAILED:
        return h
    return max(h, settled(model, Hypothesis(again, evidence(model, again))), key=lambda h: h.evidence.ln)


def _by(model: CampaignModel, way: Callable[[CampaignModel], Fit | None]) -> Fit | None:
    return way(model)


def _missed(first: Fit) -> bool:
    """Whether a fit without effects leaves so much that it may have stalled."""
    return first.chi2 > MISSED**2 * first.count
