"""The model with a light resonance more, where the data of every test ask for one: of a table, a fixture
or a cable that the drawing lacks, or of something that softens with temperature and whose resonance moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit
from thermospindle.diagnosis.inference.hypothesis import EARLY, PLENTY, STRAIN, Hypothesis, settled
from thermospindle.diagnosis.inference.prior import DRIFTING
from thermospindle.diagnosis.inference.remainder import DRIFTS, LOOKED, light_resonance, overlap
from thermospindle.diagnosis.parameters.mechanism import Mechanism
from thermospindle.diagnosis.parameters.nuisance import Resonance
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array

RESONANCES, CLEARED = 2, 0.1  # light resonances at most, and the share of what was left that one may leave
CHANCE = 3.0  # standard deviations of chi2 by chance, of which nothing is said to be left
SLIGHT = 0.5  # squares of the errors, of which it cannot be told whether they are alike in all tests
RESONANT = 0.2  # damping ratio up to which it is a resonance
BEYOND = 1.15  # times the highest line, up to which it is one: far above them a resonance is a mass that moves along, and far below the lowest a spring to the ground
FAR = 3.0  # times what a resonance may leave, from which counting its parameters anew will not help
MOVES, SURELY = 0.01, 5.0  # relative change of its frequency over the tests, and standard errors of it, from which it moves
CENTRED = 2  # times that a light resonance's parameters are counted anew from where they were fitted


def with_resonance(model: CampaignModel, h: Hypothesis, workers: int | None = None, moves: bool = False) -> tuple[CampaignModel, Hypothesis] | None:
    """The model with the light resonance that an explanation leaves unexplained in every test, and the explanation fitted in it;
    None where it leaves none, or it clears too little. Where discrepancies stand in for it, no misfit is left, and its evidence
    tells; without effects not even that where modes still drift beside it, for what changes from test to test is no resonance, and
    one that is taken for it then stands in the effect's way. With `moves` one whose frequency may be another at another temperature."""
    if len(model.resonances) >= RESONANCES + moves:
        return None
    resonance = _left_by(model, h, moves)
    if resonance is None:
        return None
    hidden, n = h.evidence.learned.errors <= STRAIN, len(model.parameters)
    wider, more = model.with_resonance(resonance), len(resonance.nuisances)
    fitted = with_more(h.fit.point, n, more)
    afresh = np.concatenate([np.zeros(n + more), h.fit.point[n:]])
    clear = max(CLEARED * h.excess, CHANCE * np.sqrt(2 / h.fit.count))

    def asked(found: Hypothesis, gain: float, left: float) -> bool:
        """Whether it gains so much ln evidence, and leaves no more than that beyond noise."""
        drift = any(found.evidence.learned.sizes.get(kind, 0.0) > 0 for kind in DRIFTING)
        return found.evidence.ln > h.evidence.ln + gain and (found.excess < left if not hidden else bool(h.mechanisms) or not drift)

    try:
        tried = in_parallel(partial(_from, wider, h.mechanisms), ((fitted, TEMPERS[EARLY:]), (afresh, TEMPERS)), workers)
        best = replace(min(tried, key=lambda f: f.cost), mechanisms=h.mechanisms)
        sd, learned = np.array([q.sd for q in resonance.nuisances]), None
        if not asked(Hypothesis(best, evidence(wider, best, wide=h.widens)), 0.0, FAR * clear) or not _resonates(model, resonance.at(sd * best.point[n : n + more])):
            return None  # smooth over the band, it would stand in for something else
        for _ in range(CENTRED):  # so that all explanations start about it as it is
            resonance, left = _centred(resonance, best.point[n : n + more], moves)
            wider, there = model.with_resonance(resonance), np.concatenate([best.point[:n], left, best.point[n + more :]])
            again = fit(wider, h.mechanisms, there, best.rates, TEMPERS[-1:], learned, best.moved)
            found = settled(wider, Hypothesis(again, evidence(wider, again, wide=h.widens)))
            best, learned = found.fit, found.evidence.learned
    except FAILED:
        return None
    return (wider, found) if asked(found, PLENTY, clear) and not found.evidence.rounded else None


def beside(model: CampaignModel, h: Hypothesis, workers: int | None = None) -> tuple[CampaignModel, Hypothesis]:
    """The model with the light resonance that an explanation leaves, and the explanation in it, as `with_resonance`; or both as
    they are. It is settled before that is told where there seems to be one, for what fitting on would explain is no resonance."""
    if not h.mechanisms or len(model.resonances) >= RESONANCES or _left_by(model, h) is None:
        return model, h
    h = settled(model, h)
    return with_resonance(model, h, workers) or (model, h.light)


def _centred(resonance: Resonance, fitted: Array, moves: bool) -> tuple[Resonance, Array]:
    """The resonance about where its parameters (k + 4,) were fitted, and what is left of these: how
    its frequency drifts, unless it `moves`, for a table's stays narrow about none."""
    there = resonance.at(np.array([q.sd for q in resonance.nuisances]) * fitted)
    left = np.zeros(len(fitted))
    if moves:
        return there, left
    left[-2:] = fitted[-2:]
    return replace(there, drift=resonance.drift), left


def _resonates(model: CampaignModel, resonance: Resonance) -> bool:
    """Whether it shows as one in the lines that were measured."""
    lines = [d.frequency for d in model.tests if isinstance(d, LineData)]
    low, high = min(float(f.min()) for f in lines), max(float(f.max()) for f in lines)
    return resonance.damping <= RESONANT and low / BEYOND <= resonance.frequency <= BEYOND * high


def _left_by(model: CampaignModel, h: Hypothesis, moves: bool = False) -> Resonance | None:
    """The light resonance that an explanation leaves, where it is alike in all tests, or `moves`, and promises enough."""
    if not moves and h.excess > SLIGHT and overlap(model, h.fit).tests < LOOKED:
        return None
    seen = light_resonance(model.thinned, h.fit, h.evidence.learned, DRIFTS if moves else (0.0,))
    return seen[0] if seen is not None and seen[1] >= PLENTY else None


def shown(model: CampaignModel, h: Hypothesis) -> list[Resonance]:
    """The light resonances that an explanation needs, as it has them: where their shares in all
    modes may be nothing, what they were taken for is explained otherwise."""
    return [r for r, _ in _needed(model, h)]


def moving(model: CampaignModel, h: Hypothesis, discount: float = 1.0) -> list[Resonance]:
    """Those whose frequency is surely another at another temperature, where ln evidence counts by a `discount` less."""
    if not (needed := _needed(model, h)):
        return []
    by_drift = _apart(model)

    def moves(r: Resonance, covariance: Array) -> bool:
        change = by_drift @ np.array(r.drift)
        sd = np.sqrt(np.einsum("abi,ij,abj->ab", by_drift, covariance, by_drift))
        return bool(np.any(np.abs(change) > np.maximum(MOVES, SURELY * np.sqrt(discount) * sd)))

    return [r for r, covariance in needed if moves(r, covariance)]


def travelled(model: CampaignModel, h: Hypothesis) -> float:
    """How far the light resonance that an explanation needs, and that moves most, moves over the tests, of its frequency; nothing of none."""
    drifts = [np.array(r.drift) for r, _ in _needed(model, h)]
    return float(np.abs(_apart(model) @ np.transpose(drifts)).max()) if drifts else 0.0


def _apart(model: CampaignModel) -> Array:
    """What of a resonance's two parameters of drift every two tests (tests, tests, 2) have apart."""
    far = np.array([model.far(t) for t in range(len(model.tests))])
    by_drift = np.stack([far, far**2], axis=1)
    return np.asarray(by_drift[:, None] - by_drift[None])


def _needed(model: CampaignModel, h: Hypothesis) -> list[tuple[Resonance, Array]]:
    """Each with the covariance (2, 2) of its drift."""
    found, at = [], len(model.parameters) - sum(len(r.nuisances) for r in model.resonances)
    for r in model.resonances:
        own = slice(at, at + len(r.nuisances))
        sd = np.array([q.sd for q in r.nuisances])
        seen = r.at(sd * h.evidence.mean[own])
        shares = np.array(seen.shares) / sd[: len(r.shares)]
        whole = h.evidence.covariance[own, own]
        if shares @ np.linalg.solve(whole[: len(shares), : len(shares)], shares) > 2 * PLENTY:
            found.append((seen, sd[-2:, None] * whole[-2:, -2:] * sd[-2:]))
        at = own.stop
    return found


def _from(model: CampaignModel, mechanisms: Sequence[Mechanism], start: tuple[Array, Sequence[float]]) -> Fit:
    at, tempers = start
    return fit(model, mechanisms, at, tempers=tempers)


def with_more(point: Array, before: int, more: int) -> Array:
    """A parameter vector with so many nuisances more, at none, after those that were there `before`."""
    return np.insert(point, before, np.zeros(more))
