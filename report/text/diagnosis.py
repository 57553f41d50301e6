"""`spindle diagnose`: the diagnosis of a campaign, as JSON and for people."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.diagnosis.inference import nuisance as kinds_of
from thermospindle.diagnosis.inference.evidence import Evidence
from thermospindle.diagnosis.inference.mechanism import Mechanism
from thermospindle.diagnosis.inference.verdict import DEPARTS, Candidate
from thermospindle.diagnosis.verdict import Diagnosis, Drift
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array
from thermospindle.model.units import RPM

SHOWN = 12  # candidates
ALIKE = 0.9  # of the evidence of what the verdict names, from which a free drift does as well


def diagnosis_json(d: Diagnosis) -> dict[str, Any]:
    """Everything as one object; keys carry units where values have them."""
    v, base = d.verdict, d.search.base
    n = base.fit.count
    accepted = v.accepted
    before, after = (float(np.sqrt(h.evidence.chi2 / n)) for h in (base, accepted))
    return {
        "verdict": v.word,
        "effects": list(v.effects),
        "reason": v.reason,
        "would_change": would_change(d),
        "law_departs": law_words(d),
        "probability": {"none": v.probability_none, "unknown": v.probability_unknown},
        "expected_loss": dict(v.losses),
        "candidates": [_candidate(c, d) for c in v.candidates[:SHOWN]],
        "invisible": _invisible(d),
        "detectable": {name: size for name, (_, size) in d.detectable.items()},
        "detectable_in": {name: {"parameter": m.size.name, "unit": m.size.unit, "size": size} for name, (m, size) in d.detectable.items()},
        "error": {"before": before, "after": after, "held_out_before": v.held_out_before, "held_out_after": v.held_out_after},
        "where": [_place(p, d) for p in d.drifts],
        "next_test": [
            {
                "condition": _condition(t.condition),
                "separates": list(t.separates),
                "odds": t.odds,
                "repeats": t.repeats,
                "tells": t.tells,
                "predicted": {
                    name: [{"frequency_Hz": m.frequency, "sd_Hz": m.sd} for m in rows]
                    for name, rows in zip(t.separates, t.predictions, strict=True)
                },
            }
            for t in d.tests
        ],
        "misfit": _misfit(d),
        "tolerances": {
            p.name: {"value": float(m * p.sd), "sd": float(s * p.sd), "prior_sd": p.sd}
            for p, m, s in zip(d.search.model.parameters, accepted.evidence.mean, _sd(accepted.evidence), strict=False)
            if p.kind in (kinds_of.BUILD, kinds_of.TEMPERATURE, kinds_of.GAIN)
        },
        "learned": _learned(accepted.evidence),
        "noise": {data.test.id: getattr(data, "noise_from", "the table of modes") for data in d.search.model.tests},
    }


def _sd(evidence: Evidence) -> Array:
    return np.sqrt(np.maximum(np.diag(evidence.covariance), 0.0))


def _learned(evidence: Evidence) -> dict[str, float]:
    """Sizes of the model's own constant discrepancy (relative, of frequencies and damping), of gain drift, and the factor on stated errors."""
    s = evidence.learned
    return {
        **{LEARNED[kind]: size for kind, size in s.sizes.items()},
        "errors_times": s.errors,
    }


def _candidate(c: Candidate, d: Diagnosis) -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    laws = {}
    for k, m in enumerate(c.hypothesis.mechanisms):
        for name, row in parameters_of(c, k).items():
            parameters[f"{m.name}.{name}"] = row
        laws[m.name] = _law(c, k, d)
    own = c.hypothesis.evidence
    n = d.search.base.fit.count
    return {
        "effects": list(c.names),
        "delta_evidence": c.delta_evidence,
        "probability": c.probability,
        "held_out_error_ratio": d.verdict.held_out_after / d.verdict.held_out_before
        if c.hypothesis is d.verdict.accepted and d.verdict.held_out_before
        else float(np.sqrt(own.chi2 / max(d.search.base.evidence.chi2, 1e-300))),
        "parameters": parameters,
        "law": laws,
        "departure_from_law": {m.name: v for m, v in zip(c.hypothesis.mechanisms, own.learned.departures, strict=True)},
        "chi2_per_number": own.chi2 / n,
        "believable": _believable(c),
    }


def parameters_of(c: Candidate, k: int) -> dict[str, dict[str, Any]]:
    """Values with errors of mechanism `k` of a candidate: one size for all tests, its choices and its shape parameters."""
    m, own = c.hypothesis.mechanisms[k], c.hypothesis.evidence
    size, sd = one_size(m, own.sizes[k], own.size_covariance[k])
    rows: dict[str, dict[str, Any]] = {m.size.name: {"value": size, "sd": sd, "unit": m.size.unit}}
    units = {p.name: p.unit for p in m.effect.parameters}
    rows |= {name: {"value": value, "sd": 0.0, "unit": units[name]} for name, value in m.choices.items()}
    at = len(d_parameters(c)) + sum(len(r) + len(o.shape) for r, o in list(zip(c.hypothesis.fit.roots, c.hypothesis.mechanisms, strict=True))[:k])
    at += len(c.hypothesis.fit.roots[k])
    errors = _sd(own)[at : at + len(m.shape)]
    for p, value, error in zip(m.shape, c.hypothesis.fit.shapes[k], errors, strict=True):
        rows[p.name] = {"value": value, "sd": float(error * p.prior_sd), "unit": p.unit}
    return rows


def d_parameters(c: Candidate) -> Array:
    """The nuisance parameters of a candidate's fit."""
    return c.hypothesis.fit.nuisance


def one_size(m: Mechanism, sizes: Array, covariance: Array) -> tuple[float, float]:
    """The size in the tests that tell it, weighted by what they tell; within its limits."""
    variance = np.maximum(np.diag(covariance), 1e-300)
    weight = 1 / variance / np.sum(1 / variance)
    return float(np.clip(weight @ sizes, *m.size.limits)), float(np.sqrt(weight @ covariance @ weight))


def _law(c: Candidate, k: int, d: Diagnosis) -> list[dict[str, Any]]:
    """The size in every test as the data have it: constant where the effect's law holds."""
    own = c.hypothesis.evidence
    errors = np.sqrt(np.maximum(np.diag(own.size_covariance[k]), 0.0))
    return [
        {"test": data.test.id, **_condition(data.condition), "size": float(a), "sd": float(s)}
        for data, a, s in zip(d.search.model.tests, own.sizes[k], errors, strict=True)
    ]


def _believable(c: Candidate) -> bool:
    """No size at its limit, and none five prior widths away."""
    for k, m in enumerate(c.hypothesis.mechanisms):
        size = parameters_of(c, k)[m.size.name]["value"]
        if size in m.size.limits or abs(size - m.size.neutral) > 5 * max(m.size.prior_sd, abs(m.size.typical - m.size.neutral)):
            return False
    return True


def _invisible(d: Diagnosis) -> list[str]:
    """Effects whose typical size these data do not show by one standard error, whatever variant."""
    best: dict[str, float] = {}
    for s in d.search.screened:
        if not s.mechanism.free:
            best[s.mechanism.name] = max(best.get(s.mechanism.name, 0.0), s.visibility)
    return sorted(name for name, seen in best.items() if seen < 1.0)


def _place(p: Drift, d: Diagnosis) -> dict[str, Any]:
    best = max((c.delta_evidence for c in (*d.verdict.candidates, *d.verdict.free)), default=0.0)
    return {
        "element": p.element,
        "unit": p.unit,
        "change": [
            {**_condition(c), ("relative" if p.unit == "%" else f"change_{p.unit}"): _scaled(a, p.unit), "sd": _scaled(s, p.unit)}
            for c, (a, s) in zip(p.conditions, p.told, strict=True)
        ],
        "with": p.pattern.shape.name if p.pattern else "",
        "removes": float(np.clip(p.gain / best, 0.0, 1.0)) if best > 0 else 0.0,
        "delta_evidence": p.gain,
    }


def _scaled(value: float, unit: str) -> float:
    return float(value / 100 if unit == "%" else value)


def _condition(c: Condition) -> dict[str, Any]:
    found: dict[str, Any] = {"temperature_C": c.temperature, "speed_rpm": round(c.speed / RPM, 6)}
    if c.level:
        found["level_N"] = c.level
    if np.isfinite(c.soak_time):
        found["soak_time_min"] = c.soak_time / 60
    return found


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


def drift_words(d: Diagnosis) -> list[str]:
    """What would have to drift, in sentences."""
    if d.verdict.word == "none":
        return ["No element has to drift: tolerances and measuring errors explain the data."]
    return [f"{_drift_words(p)} ({p.gain:.0f} in ln evidence)." for p in d.drifts[:3]] or ["No single element explains the misfit by drifting."]


def _drift_words(p: Drift) -> str:
    low, high = int(np.argmin(p.change)), int(np.argmax(p.change))
    goes = f", {p.pattern.shape.name}" if p.pattern and p.pattern.shape.name != "constant" else ""
    (least, its_sd), (most, sd) = p.told[low], p.told[high]
    return (
        f"{p.element}: from {least:+.3g} +- {its_sd:.1g} {p.unit} {_where(p.conditions[low])} to {most:+.3g} +- "
        f"{sd:.1g} {p.unit} {_where(p.conditions[high])}{goes}"
    )


def law_words(d: Diagnosis) -> list[str]:
    """Of every effect that the verdict names and whose law the data do not have: that, and what they have instead."""
    v, found = d.verdict, []
    lead = next((c for c in v.candidates if c.hypothesis is v.accepted), None)
    for m, departure in zip(lead.hypothesis.mechanisms, v.accepted.evidence.learned.departures, strict=True) if lead else ():
        if departure >= DEPARTS:
            same = [p for p in d.drifts if p.pattern and lead and p.gain > ALIKE * lead.delta_evidence]
            instead = f"; {_drift_words(same[0])}, does as well without any law" if same else ""
            found.append(f"The data do not have the law that {m.name} assumes{instead}.")
    return found


def _where(c: Condition) -> str:
    return f"at {c.temperature:g} C, {c.speed / RPM:.0f} rpm"


def would_change(d: Diagnosis) -> str:
    """What would make this verdict another one, in a sentence or two."""
    v = d.verdict
    test = f" A test {plan_words(_condition(d.tests[0].condition))} tells {d.tests[0].separates[0]} from {d.tests[0].separates[1]}." if d.tests else ""
    if v.word == "none":
        return "An effect larger than these data could have hidden would change that; how large that is, is listed for each."
    if v.word == "unexplained":
        place = f"; `spindle draft` writes one from the drift of {d.drifts[0].element}" if d.drifts else ""
        return f"An effect that the catalogue does not hold would change that{place}.{test}"
    rivals = [c for c in v.candidates if set(c.names) - set(v.effects)]
    rival = f"{' + '.join(rivals[0].names)}, {rivals[0].delta_evidence - v.candidates[0].delta_evidence:.0f} in ln evidence" if rivals else "none"
    return f"Data that the next best explanation ({rival}) predicts better would change that.{test}"


def plan_words(condition: dict[str, Any]) -> str:
    words = f"at {condition['temperature_C']:g} C, {condition['speed_rpm']:.0f} rpm"
    words += f", hit with {condition['level_N']:g} N" if "level_N" in condition else ""
    return words + (f", after {condition['soak_time_min']:g} min in the chamber" if "soak_time_min" in condition else "")


LEARNED = {
    kinds_of.STIFFNESS: "frequency_discrepancy",
    kinds_of.DAMPING: "damping_discrepancy",
    kinds_of.STIFFNESS_DRIFT: "frequency_discrepancy_drift",
    kinds_of.DAMPING_DRIFT: "damping_discrepancy_drift",
    kinds_of.DRIFT: "gain_drift",
}
SENTENCES = {
    "none": "No effect is missing.",
    "identified": "Missing: {}.",
    "two effects": "Missing: {}.",
    "ambiguous": "Missing is one of: {}.",
    "unexplained": "Something is missing that the catalogue does not hold.",
}


def show_diagnosis(console: Console, answer: dict[str, Any], verbose: bool = True) -> None:
    """The verdict in one sentence and why; with `verbose` every explanation, drift and next test, and what would have been seen."""
    joined = (" and " if answer["verdict"] == "two effects" else ", ").join(answer["effects"])
    console.print(f"{answer['verdict']}: {SENTENCES[answer['verdict']].format(joined)}", style="bold")
    console.print(answer["reason"])
    for sentence in answer["law_departs"]:
        console.print(sentence)
    console.print(answer["would_change"])
    error = answer["error"]
    console.print(
        f"Error, rms in standard errors: {error['before']:.2f} -> {error['after']:.2f}; on conditions left out "
        f"{error['held_out_before']:.2f} -> {error['held_out_after']:.2f}"
    )
    if not verbose:
        _show_little(console, answer)
        return
    if answer["candidates"]:
        console.print("\nExplanations, ln evidence over the model without effects and posterior probability:")
    for c in answer["candidates"][:5]:
        console.print(f"  {' + '.join(c['effects'])}: {c['delta_evidence']:+.1f}, {_percent(c['probability'])}; {_values(c)}")
    best = answer["candidates"][0] if answer["candidates"] else None
    if best and answer["effects"]:
        for name, rows in best["law"].items():
            if best["departure_from_law"][name]:
                console.print(f"\nThe size of {name} as the data have it, test by test (one size would be its own law):")
                console.print("  " + ", ".join(f"{r['test']} {r['size']:.3g} +- {r['sd']:.1g}" for r in rows))
    if answer["verdict"] != "none":
        console.print("\nWithout any catalogue, what would have to drift:")
        for sentence in answer["misfit"]["words"]:
            console.print(f"  {sentence}")
    for t in answer["next_test"]:
        console.print(f"\n{_next(t)}")
    for o in answer.get("predictions", []):
        console.print(
            f"\nPredicted earlier by {o['explanation']} for {o['test']}: {o['verdict']}, {o['rms']:.2g} standard errors rms over {o['modes']} modes"
        )
    if answer["verdict"] == "none":
        small = sorted(answer["detectable_in"].items())
        console.print("\nSmallest size these data would have shown:")
        for name, row in small:
            console.print(f"  {name}: {row['parameter']} {row['size']:.2g}{_unit(row['unit'])}")
        console.print(f"Not visible in these data at a typical size: {', '.join(answer['invisible']) or 'nothing'}")


def _show_little(console: Console, answer: dict[str, Any]) -> None:
    """The explanations that the verdict names with their values, the test to make next, and where the rest is."""
    for c in answer["candidates"]:
        if set(c["effects"]) <= set(answer["effects"]) and answer["effects"]:
            console.print(f"  {' + '.join(c['effects'])}, {_percent(c['probability'])}: {_values(c)}")
    for t in answer["next_test"][:1]:
        console.print(_next(t))
    for o in answer.get("predictions", []):
        console.print(f"Predicted earlier by {o['explanation']} for {o['test']}: {o['verdict']}, {o['rms']:.2g} standard errors rms")
    console.print("--verbose shows every explanation, what would drift, and what these data could have shown.", style="dim")


def _values(candidate: dict[str, Any]) -> str:
    """Fitted parameters with their errors and units."""
    return ", ".join(f"{k.split('.', 1)[1]} {v['value']:.4g}{_error(v['sd'])}{_unit(v['unit'])}" for k, v in candidate["parameters"].items())


def _next(test: dict[str, Any]) -> str:
    first, second = test["separates"]
    odds = "more than a million" if test["odds"] >= 1e6 * (1 - 1e-9) else f"{test['odds']:.3g}"
    return f"A test {plan_words(test['condition'])} would tell {first} from {second} with odds of {odds} to 1, most by {test['tells']}."


def _percent(probability: float) -> str:
    return f"{probability:.1%}" if probability > 1e-3 else "less than 0.1 %"


def _error(sd: float) -> str:
    """What was chosen, not fitted, has none."""
    return f" +- {sd:.2g}" if sd else ""


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


