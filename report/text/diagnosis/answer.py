"""`spindle diagnose`: the diagnosis of a campaign as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.decision.errors import arrived, as_drawn, whole
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.decision.loss import NAMING
from thermospindle.diagnosis.decision.reason import conventions
from thermospindle.diagnosis.inference.evidence import Evidence, left_out
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.inference.prior import wider_tolerances
from thermospindle.diagnosis.inference.resonance import shown
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import Mechanism, one_size
from thermospindle.diagnosis.parameters.nuisance import Nuisance
from thermospindle.diagnosis.verdict import Diagnosis, Drift
from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.report.text.diagnosis.doubts import doubt_words
from thermospindle.report.text.diagnosis.granted import granted_words
from thermospindle.report.text.diagnosis.words import condition, drift_words, law_words, would_change
from thermospindle.report.typeset import known
from thermospindle.sim.effects.effect import Effect, called

SHOWN = 12  # candidates
NOTHING = 0.01  # probability of a way to act that is not told


def diagnosis_json(d: Diagnosis) -> dict[str, Any]:
    """Everything as one object; keys carry units where values have them."""
    v, base = d.verdict, d.search.base
    n = base.fit.count
    before, after = (float(np.sqrt(h.evidence.chi2 / n)) for h in (base, v.accepted))
    drawn = whole(as_drawn(d.search.model), d.search.model)
    return {
        "verdict": v.word,
        "effects": list(v.effects),
        "reason": v.reason,
        "granted": granted_words(d, drawn),
        "would_change": would_change(d),
        "law_departs": law_words(d),
        "doubts": doubt_words(d),
        "probability": {"none": v.probability_none, "unknown": v.probability_unknown},
        "expected_loss": dict(v.losses),
        "candidates": [_candidate(c, d) for c in v.candidates[:SHOWN]],
        "may_hide": list(d.may_hide),
        "invisible": _invisible(d),
        "detectable": {name: size for name, (_, size) in d.detectable.items()},
        "detectable_in": {
            name: {"parameter": m.size.name, "unit": m.size.unit, "size": size, "acting": _acting(m), "acting_words": _acting_words(m, d.spindle)}
            for name, (m, size) in d.detectable.items()
        },
        "error": {"drawn": drawn, "before": before, "after": after}
        | {key: known(getattr(v, key)) for key in ("held_out_before", "held_out_after", "held_out_gain")},
        "reference_temperature_C": d.spindle.reference_temperature,
        "where": [_place(p, d) for p in _places(d)],
        "next_test": [
            {
                "condition": condition(t.condition),
                "separates": list(t.separates),
                "odds": t.odds,
                "repeats": t.repeats,
                "tells": t.tells,
                "beyond": t.beyond,
                "predicted": {
                    name: [{"frequency_Hz": m.frequency, "sd_Hz": m.sd, "common_Hz": list(m.common)} for m in rows]
                    for name, rows in zip(t.separates, t.predictions, strict=True)
                },
            }
            for t in d.tests
        ],
        "misfit": _misfit(d),
        "tolerances": {
            p.name: {"value": p.at(m), "sd": float(s * p.sd), "prior_sd": p.sd, "kind": p.kind}
            | ({"in_scene": p.at(own)} if p.kind == kinds_of.BUILD else {})
            | ({"test": d.search.model.tests[p.test].test.id} if p.kind == kinds_of.TEMPERATURE and p.test is not None else {})
            for p, m, s, own in zip(d.search.model.parameters, v.told.evidence.mean, _sd(v.told.evidence), in_scene(d.search.model.parameters, v.told.evidence), strict=False)
            if p.kind in (kinds_of.BUILD, kinds_of.TEMPERATURE, kinds_of.GAIN)
        },
        "tolerances_beside": list(v.told.names),
        "learned": _learned(v.told.evidence),
        "conventions": {p.name: {"value": value, "sd": sd} for p, value, sd in conventions(d.search.model, v.told)},
        "light_resonances": [{"frequency_Hz": r.frequency, "damping_ratio": r.damping} for r in shown(d.search.model, d.search.hypotheses[0])],
        "noise": {data.test.id: getattr(data, "noise_from", "the table of modes") for data in d.search.model.tests},
    }


def in_scene(parameters: Sequence[Nuisance], evidence: Evidence) -> Array:
    """Mean (P,) of the nuisances, in their reference widths, where `kinds_of.UNWRITTEN` are nothing: those no scene holds, and a
    tolerance that was fitted beside them would leave half of the two behind. The conditional mean of the Gaussian, m - C_bu C_uu^-1 m_u.
    """
    mean, covariance = evidence.mean[: len(parameters)], evidence.covariance
    wide = np.diag(covariance)[: len(parameters)] > 0
    other = np.flatnonzero([w and p.kind in kinds_of.UNWRITTEN for p, w in zip(parameters, wide, strict=True)])
    return np.asarray(mean - covariance[: len(parameters), other] @ np.linalg.pinv(covariance[np.ix_(other, other)], hermitian=True) @ mean[other])


def _sd(evidence: Evidence) -> Array:
    return np.sqrt(np.maximum(np.diag(evidence.covariance), 0.0))


def _learned(evidence: Evidence) -> dict[str, Any]:
    """Sizes of the model's own constant discrepancy (relative, of frequencies and damping), of gain drift, and the factor on stated errors."""
    s = evidence.learned
    wider = wider_tolerances(s)
    return {
        **{LEARNED[kind]: size for kind, size in s.sizes.items() if kind in LEARNED},
        "build_tolerances_times": max(wider.values(), default=1.0),
        "wider_by_themselves": {name: times for name, times in wider.items() if name != kinds_of.BUILD},
        "hammer_gains_times": s.sizes.get(kinds_of.HAMMER, 1.0),
        "thermal_motions_times": s.sizes.get(kinds_of.EXPANSION, 1.0),
        "errors_times": s.errors,
    }


def _acting(m: Mechanism) -> dict[str, float]:
    """The other parameters of a mechanism: as chosen, and shapes where they are neutral."""
    return {**{q.name: q.neutral for q in m.shape}, **m.choices}


def _acting_words(m: Mechanism, spindle: Spindle) -> str:
    """Of these the ones that say where and when it acts: its choices, and shares between two ideal cases."""
    told = {q.name: q for q in m.effect.parameters if q.choices or q.limits == (0.0, 1.0)}
    return ", ".join(f"{name} {called(told[name], value, spindle) or f'{value:g}'}" for name, value in _acting(m).items() if name in told)


def _candidate(c: Candidate, d: Diagnosis) -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    laws = {}
    for k, m in enumerate(c.told.mechanisms):
        for name, row in told_values(c, k, d.search.model.spindle).items():
            parameters[f"{m.name}.{name}"] = row
    for k, m in enumerate(c.hypothesis.mechanisms):
        laws[m.name] = _law(c, k, d)
    own = c.hypothesis.evidence
    n = d.search.base.fit.count
    return {
        "effects": list(c.names),
        "delta_evidence": c.delta_evidence,
        "probability": c.probability,
        "held_out_error_ratio": _held_out(c, d),
        "parameters": parameters,
        "law": laws,
        "own_law": list(c.own_laws),
        "departure_from_law": {m.name: 1.0 if m.own_law else v for m, v in zip(c.hypothesis.mechanisms, own.learned.departures, strict=True)},
        "chi2_per_number": own.chi2 / n,
        "believable": _believable(c),
        "arrived": arrived(c.hypothesis),
    }


def _held_out(c: Candidate, d: Diagnosis) -> float | None:
    """Error on conditions predicted from all others, over that without effects; None where nothing can be left out."""
    model = d.search.model
    error, _ = left_out(model, c.hypothesis.fit, c.hypothesis.evidence, conditions_of(model.spindle, model.tests))
    return known(error / d.verdict.held_out_before) if d.verdict.held_out_before > 0 else None


def named(effect: Effect, name: str, value: float, spindle: Spindle) -> dict[str, str]:
    """`called`, where the value of a parameter stands for a bearing or a set: its name, or all of them."""
    word = next((called(p, value, spindle) for p in effect.parameters if p.name == name), None)
    return {"called": word} if word else {}


def told_values(c: Candidate, k: int, spindle: Spindle) -> dict[str, dict[str, Any]]:
    """Values of effect `k` of an explanation, with errors that hold whichever way it acts: about the value in the likeliest way,
    the mean square over all of them. What names something has its probability, and the `others` theirs, where they are not nothing."""
    effect = c.told.mechanisms[k].effect
    rows, numbers = parameters_of(c.told, k), {p.name for p in effect.parameters if p.choices}
    ways = [(parameters_of(h, k), share) for h, share in c.ways] or [(rows, 1.0)]
    for name, row in rows.items():
        if name in numbers:
            found: dict[float, float] = {}
            for way, share in ways:
                found[way[name]["value"]] = found.get(way[name]["value"], 0.0) + share
            others = [{"value": v, "probability": share} | named(effect, name, v, spindle) for v, share in found.items() if v != row["value"] and share > NOTHING]
            row |= named(effect, name, row["value"], spindle)
            row |= {"probability": found[row["value"]], "others": sorted(others, key=lambda o: -float(o["probability"]))} if others else {}
        else:
            row["sd"] = float(np.sqrt(sum(share * (way[name]["sd"] ** 2 + (way[name]["value"] - row["value"]) ** 2) for way, share in ways)))
    return rows


def parameters_of(h: Hypothesis, k: int) -> dict[str, dict[str, Any]]:
    """Values with errors of mechanism `k` of an explanation: one size for all tests, its choices and
    its shape parameters. Beside shapes it is of the sizes at the fitted point, as they are: where the
    valley between both bends, the mean of the quadratic about that point is no size of these shapes."""
    m, own = h.mechanisms[k], h.evidence
    size, sd = one_size(m, h.fit.roots[k], h.fit.sizes[k] if m.shape else own.sizes[k], own.size_covariance[k])
    rows: dict[str, dict[str, Any]] = {m.size.name: {"value": size, "sd": sd, "unit": m.size.unit}}
    units = {p.name: p.unit for p in m.effect.parameters}
    rows |= {name: {"value": value, "sd": 0.0, "unit": units[name]} for name, value in m.choices.items()}
    at = len(h.fit.nuisance) + sum(len(r) + len(o.shape) for r, o in list(zip(h.fit.roots, h.mechanisms, strict=True))[:k])
    at += len(h.fit.roots[k])
    errors = _sd(own)[at : at + len(m.shape)]
    for p, value, error in zip(m.shape, h.fit.shapes[k], errors, strict=True):
        rows[p.name] = {"value": value, "sd": float(error * p.prior_sd), "unit": p.unit}
    return rows


def _law(c: Candidate, k: int, d: Diagnosis) -> list[dict[str, Any]]:
    """The size in every test as the data have it: constant where the effect's law holds."""
    own = c.hypothesis.evidence
    errors = np.sqrt(np.maximum(np.diag(own.size_covariance[k]), 0.0))
    return [
        {"test": data.test.id, **condition(data.condition), "size": float(a), "sd": float(s)}
        for data, a, s in zip(d.search.model.tests, own.sizes[k], errors, strict=True)
    ]


def _believable(c: Candidate) -> bool:
    """No size at its limit, and none five prior widths away."""
    for k, m in enumerate(c.told.mechanisms):
        size = parameters_of(c.told, k)[m.size.name]["value"]
        if size in m.size.limits or abs(size - m.size.neutral) > 5 * max(m.size.prior_sd, abs(m.size.typical - m.size.neutral)):
            return False
    return True


def _invisible(d: Diagnosis) -> list[str]:
    """Effects whose typical size these data do not show by one standard error, whatever variant."""
    best: dict[str, float] = {}
    for s in d.search.screened:
        if s.mechanism.kind == "law":
            best[s.mechanism.name] = max(best.get(s.mechanism.name, 0.0), s.visibility)
    return sorted(name for name, seen in best.items() if seen < 1.0)


def _places(d: Diagnosis) -> list[Drift]:
    """What changes, with what the verdict goes by first: effects that it names without their laws, or what drifts without any catalogue."""
    return [*d.own_laws, *d.drifts] if d.verdict.word in NAMING else [*d.drifts, *d.own_laws]


def _place(p: Drift, d: Diagnosis) -> dict[str, Any]:
    best = max((c.delta_evidence for c in (*d.verdict.candidates, *d.verdict.free)), default=0.0)
    share, key = (100, "relative") if p.relative else (1, f"change_{p.unit}")
    return {
        "element": p.element,
        "unit": p.unit,
        "change": [{**condition(c), key: float(a / share), "sd": float(s / share)} for c, (a, s) in zip(p.conditions, p.told, strict=True)],
        "change_covariance": (p.told_covariance / share**2).tolist(),
        **({"effect": ({"at": condition(p.at)} if p.at else {}) | {"values": dict(p.values)}} if p.values is not None else {}),
        "with": p.pattern.shape.name if p.pattern else "",
        "removes": float(np.clip(p.gain / best, 0.0, 1.0)) if best > 0 else 0.0,
        "delta_evidence": p.gain,
    }


def _misfit(d: Diagnosis) -> dict[str, Any]:
    base = d.search.base
    tests = d.search.model.tests
    chi2 = base.evidence.chi2
    by_test = [b[0] for b in base.fit.by_test]
    excess = np.maximum(np.array([c - t.count for c, t in zip(by_test, tests, strict=True)]), 0.0)
    total = float(excess.sum())
    return {
        "chi2": chi2,
        "count": base.fit.count,
        "rejected": d.verdict.word != "none",
        "shares": {
            "test": [
                {"name": t.test.id, "share": float(e / total) if total else 0.0, "chi2": c, "count": t.count}
                for t, c, e in zip(tests, by_test, excess, strict=True)
            ]
        },
        "growth": [],
        "drift": [_place(p, d) for p in d.drifts],
        "places": [_place(p, d) for p in d.drifts[:3]],
        "words": drift_words(d),
    }


LEARNED = {
    kinds_of.STIFFNESS: "frequency_discrepancy",
    kinds_of.DAMPING: "damping_discrepancy",
    kinds_of.STIFFNESS_DRIFT: "frequency_discrepancy_drift",
    kinds_of.DAMPING_DRIFT: "damping_discrepancy_drift",
    kinds_of.DRIFT: "gain_drift",
    kinds_of.HAMMER_DRIFT: "hammer_gain_drift",
    kinds_of.MISS_DRIFT: "hammer_miss_m",
    kinds_of.CHANGE: "bearing_change_discrepancy",
    kinds_of.ACTION: "action_of_effects",
    kinds_of.OF_CONDITIONS: "action_of_conditions",
}
