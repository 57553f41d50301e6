"""Why a verdict is what it is, in sentences."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.explanations import Names, beyond_limits, likeliest, named_part
from thermospindle.diagnosis.decision.loss import NEGLIGIBLE, in_all
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.hypothesis import LITTLE, SAME, STRAIN, Hypothesis
from thermospindle.diagnosis.inference.prior import wider_tolerances
from thermospindle.diagnosis.inference.remainder import ALIKE, Overlap
from thermospindle.diagnosis.inference.resonance import moving, shown
from thermospindle.diagnosis.inference.search import Search
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.nuisance import Nuisance, Resonance
from thermospindle.model.built.tolerance import LEAST, MOST
from thermospindle.model.errors import listed

UNTOLD = "nothing tried"  # what explains data that are missed grossly
UNBUILT = "the drawing"  # which nothing that is built so explains
HARDLY = 0.8  # of what is left of conditions left out, from which that is no less
MOVING = "a light resonance"  # whose frequency changes with temperature
LEFT = "what is left"  # that changes, and tells of something else
OFF, NAMED = 2.0, 4  # stated standard deviations from which a tolerance is said to be off, and how many of these are named
LITTLE_OF_THE_WAY = 0.1  # of which nothing is said
CONVENTIONS = {
    (kinds_of.LAW, 0): "loss factors act as hysteretic damping (a complex stiffness, the same loss at all frequencies), where the model has viscous dampers",
    (kinds_of.LAW, 1): "damping ratios act as hysteretic damping does, nearly the same at all frequencies",
    (kinds_of.ORBITS, 0): "every ball orbits at its own speed, where the model has one cage speed for a row",
}
NUMERICS = (1e-4, 0.01)  # drift of frequencies and of damping that two honest programs may differ by


def of_verdict(found: Search, word: str, effects: Names, candidates, free, none: float, before: float, after: float, gain: float) -> str:
    n, chi2 = found.base.fit.count, found.base.evidence.chi2
    if word == "none":
        best = f"; the best effect, {' + '.join(candidates[0].names)}, has a probability of {candidates[0].probability:.1%}" if candidates else ""
        sizes = found.base.evidence.learned.sizes
        wrong, change, misjudged = (sizes.get(kind, 0.0) for kind in (kinds_of.STIFFNESS, kinds_of.CHANGE, kinds_of.OF_CONDITIONS))
        which = "; one condition cannot tell that from a missing effect" if len(conditions_of(found.model.spindle, found.model.tests)) == 1 else ""
        constant = f", the model's frequencies being constantly wrong by about {100 * wrong:.1g} % of each{which}" if wrong > NUMERICS[0] else ""
        otherwise = f", what speed does to the balls' stiffness being wrong by about {change:.0%} of it, and what temperature does by a little" if change else ""
        otherwise += f", what temperature and speed do to each mode being wrong by about {misjudged:.0%} of it" if misjudged else ""
        return f"Tolerances and measuring errors explain the data: reduced chi-square {chi2 / n:.2f} of {n} data{constant}{otherwise}{best}."
    lead = candidates[0] if candidates else None
    if word == "unexplained":
        place = "nothing tried explains them, nor do tolerances and measuring errors: units, points, and noise that the files do not tell come first"
        if free and free[0].names == (LEFT,):
            left = likeliest(found).fit
            leaves, alone = f"{np.sqrt(left.chi2 / left.count):.1f}", f"{np.sqrt(found.base.fit.chi2 / n):.1f}"  # where fits have ended, not what their quadratics promise
            beside = f" where {alone} are left without it" if leaves != alone else ", as many as without it"
            of = beside if left.mechanisms else ""
            apart = ", and not the same in every test" if len(found.model.tests) > 1 else ""
            place = f"the best leaves {leaves} standard errors{of}{apart}"
        elif free and free[0].names == (MOVING,):
            moves = [f"a light resonance that the drawing lacks would have to move {_moves(found.model, r)}" for r in moving(found.model, found.base)]
            place = " and ".join(moves)
        elif free and free[0].hypothesis.mechanisms:
            h = free[0].hypothesis
            forms = [f"what {m.name} does" if m.beyond else m.name for m in h.mechanisms if m.free]
            beyond = ", beyond its physical limits" if any(m.beyond for m in h.mechanisms) else ""
            drift = "differ from the drawing, by as much in every test" if h.same_in_all else "drift"
            beside = f" beside {' and '.join(named_part(free[0]))}" if named_part(free[0]) else ""
            place = f"{' and '.join(forms)} would have to {drift}{beyond}{beside} ({free[0].delta_evidence:.0f} in ln evidence)"
            place += _impossible(found, free[0].names)
        elif free and free[0].names == (UNBUILT,):
            off = [f"{name} by {value:+.0%}" for name, value in unbuilt(found.model, found.base)[:NAMED]]
            place = f"tolerances and measuring errors would, with {listed(off)}, but nothing is built so: the sense of rotation, units, points and the drawing come first"
        elif free and free[0].names != (UNTOLD,):
            by = " and ".join(f"by {size:.1g} of its {what}" for size, what in drifts(found.model, found.base))
            place = f"every mode drifts from test to test, {by}, more than numerical differences between programs"
        if not free or free[0].names in ((UNTOLD,), (UNBUILT,)):
            return f"No effect of the catalogue explains the data: {place} (reduced chi-square without effects: {chi2 / n:.2f})."
        rival = f"; the best of the catalogue, {' + '.join(lead.names)}, gains {lead.delta_evidence:z.0f} in ln evidence" if lead else ""
        no_better = not lead or free[0].delta_evidence >= lead.delta_evidence
        says = "No effect of the catalogue explains the data as well as free drift does" if no_better else "No effect of the catalogue is probable enough beside free drift"
        return f"{says}: {place}{rival} (reduced chi-square without effects: {chi2 / n:.2f})."
    named = " + ".join(effects)
    checked = ""
    if np.isfinite(after):
        how = "" if after < HARDLY * before else ", but missed nearly as far: its law hardly holds there" if after < before else ", for it is less sure of them"
        checked = f"; conditions left out (cross-validation) are predicted to {after:.2f} instead of {before:.2f} standard errors, {gain:+z.0f} in ln predictive density{how}"
    if word == "ambiguous":
        rows = [c for c in candidates if set(c.names) <= set(effects)]
        share = sum(c.probability for c in rows)
        if always := in_all(effects, [(c.names, c.probability) for c in rows]):
            others = [name for name in effects if name not in always]
            more = sum(c.probability for c in rows if set(c.names) - set(always)) / share
            which = f"with a probability of {more:.0%} {' or '.join(others)} acts beside {'it' if len(always) == 1 else 'them'}, and which, if any, cannot be told"
            return f"{' and '.join(always)} {'is' if len(always) == 1 else 'are'} in all that explains the data (together {share:.0%} probable); {which}{checked}."
        several = ", or several of them together," if any(len(c.names) > 1 and c.probability > NEGLIGIBLE for c in rows) else ""
        return f"One of {', '.join(effects)}{several} explains the data (together {share:.0%} probable); no one of them is probable enough to be named{checked}."
    told = [c for c in (*candidates, *free) if set(named_part(c)) == set(effects)]
    chosen = max(told, key=lambda c: c.probability)
    without, within = (h.evidence.learned.sizes.get(kinds_of.STIFFNESS, 0.0) for h in (found.base, chosen.hypothesis))
    instead = f"; without, the model's frequencies would have to be constantly wrong by about {100 * without:.1g} % of each" if without > 10 * within else ""
    rest = 1 - sum(c.probability for c in told)
    word_of = "is the explanation" if len(effects) == 1 else "are both needed" if len(effects) == 2 else "are all needed"
    drifting = [m.name for m in chosen.hypothesis.mechanisms if m.free]
    beside = f"; beside {'it' if len(effects) == 1 else 'them'} {' and '.join(drifting)} drifts a little" if drifting else ""
    own = chosen.own_laws
    checked = "" if own else checked  # a law that is read off the data says nothing of others
    disagreement = ", which does not confirm it" if checked and gain < LITTLE else ""
    before_own = f", {chosen.by_law.evidence.ln - found.base.evidence.ln:.0f} with the law assumed" if chosen.by_law else ""
    whose = f" of {' and '.join(own)}" if len(effects) > 1 else ""
    law = f" with a law that is fitted freely{whose}{before_own}" if own else ""
    return f"{named} {word_of}: {chosen.delta_evidence:.0f} in ln evidence over the model without effects{law}, all else together has a probability of {rest:z.1%}{beside}{instead}{checked}{disagreement}."


def _impossible(found: Search, drifting: Names) -> str:
    """The effects that change what drifts, but would need sizes that they cannot have."""
    same = set().union(*(found.alike.get(name, ()) for name in drifting))
    cannot = sorted({h.names[0] for h in found.hypotheses if len(h.names) == 1 and h.names[0] in same and beyond_limits(h)})
    return f", which {' or '.join(cannot)} would do at a size beyond its physical limits" if cannot else ""


def of_resonances(model: CampaignModel, best: Hypothesis) -> str:
    """The light resonances that the data show in every test; one beyond the band stands for what modes up there lend to it."""
    resonances = shown(model, best)
    if not resonances:
        return ""
    highest = max(float(d.frequency.max()) for d in model.tests)
    moves = moving(model, best)
    told = ", ".join(
        f"{r.frequency:.0f} Hz ({f'damping ratio {r.damping:.2g}' if r.frequency <= highest else 'beyond the band'}{f', moving {_moves(model, r)}' if r in moves else ''})"
        for r in resonances
    )
    one = "a light resonance" if len(resonances) == 1 else "light resonances"
    return f" Taken into account: {one} at {told} that the drawing lacks and every test shows, of a table, a fixture or a cable."


def _moves(model: CampaignModel, r: Resonance) -> str:
    """From where to where the frequency of a light resonance moves over the tests."""
    rows = sorted((d.condition.temperature, r.frequency_at(model.far(t))) for t, d in enumerate(model.tests))
    (cold, first), (warm, last) = rows[0], rows[-1]
    return f"from {first:.0f} Hz at {cold:g} C to {last:.0f} Hz at {warm:g} C"


def of_tolerances(model: CampaignModel, best: Hypothesis, explained: bool = True) -> str:
    """What of the drawing is off by more than the scene's tolerances, where these are taken wider
    than stated; where the data are not `explained`, that may be something else."""
    times = wider_tolerances(best.evidence.learned)
    if not times:
        return ""
    build = [(float(m), q) for m, q in zip(best.evidence.mean, model.parameters, strict=False) if q.kind == kinds_of.BUILD]
    off = [f"{q.name} by {q.at(m):+.0%}" for m, q in sorted(build, key=lambda row: -abs(row[0])) if abs(m) > OFF and {q.name, kinds_of.BUILD} & set(times)][:NAMED]
    which = f": {', '.join(off)}" if off else ""
    as_wide = f", which are taken {times[kinds_of.BUILD]:g} times as wide as stated" if kinds_of.BUILD in times else ""
    if not explained:
        return f" Beside that, the drawing is off by more than its tolerances{as_wide}{which}; that may stand in for what is not explained."
    return f" The drawing is off by more than its tolerances{as_wide}{which}."


def unbuilt(model: CampaignModel, h: Hypothesis) -> list[tuple[str, float]]:
    """What an explanation has at the least or the most that is taken for possible, a tenth or
    eleven times of what is drawn: names and relative deviations."""
    build = [(q.name, q.at(float(m))) for m, q in zip(h.evidence.mean, model.parameters, strict=False) if q.kind == kinds_of.BUILD]
    return [(name, value) for name, value in build if not LEAST < value < MOST]


def of_motions(model: CampaignModel, best: Hypothesis) -> str:
    """How far thermal motions of the rings are off, where that is more than what two programs differ by."""
    if best.evidence.learned.sizes.get(kinds_of.EXPANSION, 1.0) == 1.0:
        return ""
    errors = np.sqrt(np.diag(best.evidence.covariance))
    rows = [(i, q) for i, q in enumerate(model.parameters) if q.kind == kinds_of.EXPANSION]
    off = [f"{q.name} {100 * q.at(best.evidence.mean[i]):+.2g} +- {100 * q.sd * errors[i]:.1g} %" for i, q in rows if abs(best.evidence.mean[i]) > max(OFF, errors[i])]
    return f" Thermal motions differ from what temperature and the scene's coefficients of expansion give: {', '.join(off)}." if off else ""


def of_conventions(model: CampaignModel, best: Hypothesis) -> str:
    """What honest programs do otherwise than this one, and the data do as far as can be told."""
    rows = [(CONVENTIONS[q.kind, max(q.index, 0)], value, sd) for q, value, sd in conventions(model, best)]
    told = [f"{what} ({value:.2f} +- {sd:.1g} of the way from one to the other)" for what, value, sd in rows if value > max(SAME * sd, LITTLE_OF_THE_WAY)]
    return f" Taken into account: {'; '.join(told)}." if told else ""


def drifts(model: CampaignModel, h: Hypothesis) -> list[tuple[float, str]]:
    """By how much of what modes drift from test to test, where that is more than two honest
    programs differ by. What is off by as much in every test does not drift: a constant error is one
    of every two modes too, and that of one or two modes alone is had for less as drift of these."""
    found = []
    for kind, least, what in ((kinds_of.STIFFNESS_DRIFT, NUMERICS[0], "frequency"), (kinds_of.DAMPING_DRIFT, NUMERICS[1], "damping")):
        size = h.evidence.learned.sizes.get(kind, 0.0)
        if size > least and (own := model.numbers.of_kind.get(kind)) is not None:
            test, _, mode = (place[own] for place in model.numbers.places)
            value, variance = np.zeros((2, test.max() + 1, mode.max() + 1))
            value[test, mode] = h.evidence.mean[own] * model.numbers.sd[own]
            variance[test, mode] = np.diag(h.evidence.covariance)[own] * model.numbers.sd[own] ** 2
            told = np.sum(np.clip(1 - variance / size**2, 0.0, 1.0)) * (1 - 1 / len(value))  # as many as the data tell
            size = float(np.sqrt(np.sum((value - value.mean(axis=0)) ** 2) / max(told, 1.0)))
        if size > least:
            found.append((size, what))
    return found


def conventions(model: CampaignModel, best: Hypothesis) -> list[tuple[Nuisance, float, float]]:
    """How far the data have it otherwise than this program where honest ones differ, with errors: 0 as this one, 1 as the others."""
    errors = np.sqrt(np.maximum(np.diag(best.evidence.covariance), 0.0))
    return [(q, float(m) * q.sd, float(s) * q.sd) for q, m, s in zip(model.parameters, best.evidence.mean, errors, strict=False) if q.kind in (kinds_of.LAW, kinds_of.ORBITS)]


def of_what_is_left(best: Hypothesis, same: Overlap) -> str:
    """What is left where the best explanation still misses the data and misses them alike in all tests."""
    if best.evidence.learned.errors <= STRAIN or same.tests < ALIKE:
        return ""
    return (
        f" What is left even so is {best.evidence.learned.errors:.1f} times the errors, and much the same in every test (correlation {same.tests:.2f}): "
        "something constant that the model lacks, such as a resonance of the table or the fixture, not a change over the conditions."
    )
