"""`spindle diagnose`: the diagnosis of a campaign, as JSON and for people."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
from rich.console import Console

from diagnosis.data import data_of
from diagnosis.decide import Candidate, Diagnosis
from diagnosis.explain import explain
from diagnosis.locate import Change, locate
from diagnosis.misfit import Misfit, misfit
from diagnosis.misfit_words import misfit_json
from diagnosis.next_test import ModePrediction, NextTest, Plan, explanations, next_tests
from diagnosis.observe import observe
from diagnosis.theory import Theory, theory
from model.machine import Spindle
from sim.campaign import Campaign
from sim.effect import Effect
from sim.effects import CATALOGUE

RPM = 2 * np.pi / 60
SHOWN = 12  # candidates


def diagnose(
    spindle: Spindle, campaign: Campaign, catalogue: tuple[Effect, ...] = CATALOGUE, progress: Callable[[str], None] = lambda done: None
) -> tuple[Diagnosis, Theory, list[Change], list[NextTest], Misfit]:
    """The diagnosis of a campaign, where the model fails without any catalogue, the tests that would decide, and the misfit itself."""
    observations = observe(campaign, spindle, progress, os.cpu_count() or 1)
    about = theory(spindle, data_of(observations))
    found = explain(about, catalogue, os.cpu_count() or 1, progress)
    places = locate(about) if found.verdict != "none" else []
    tests = [] if found.verdict == "none" else next_tests(about, explanations(about, found, places))
    progress("next tests weighed")
    return found, about, places, tests, misfit(about, found.base, places)


def diagnosis_json(found: Diagnosis, about: Theory, places: list[Change], tests: list[NextTest], m: Misfit) -> dict[str, Any]:
    n = len(about.data.value)
    best = found.best
    accepted = best is not None and found.verdict not in ("none", "unexplained")
    before = float(np.sqrt(found.base.misfit / n))
    return {
        "verdict": found.verdict,
        "effects": list(found.effects),
        "reason": found.reason,
        "would_change": would_change(found, places, tests),
        "candidates": [_candidate(c) for c in found.candidates[:SHOWN]],
        "invisible": sorted(s.effect.name for s in found.signatures if s.visibility < 1.0),
        "detectable": {s.effect.name: s.smallest for s in found.signatures if np.isfinite(s.smallest)},
        "error": {
            "before": before,
            "after": float(np.sqrt(best.fit.misfit / n)) if accepted and best else before,
            "held_out_before": found.held_out_before,
            "held_out_after": found.held_out_after if accepted else found.held_out_before,
        },
        "where": [
            {
                "element": c.element,
                "change": [
                    {"temperature_C": t, "speed_rpm": s / RPM, "relative": v, "sd": e}
                    for (t, s), v, e in zip(c.conditions, c.change, c.sd, strict=True)
                ],
                "with": c.pattern,
                "removes": c.removes,
            }
            for c in places
        ],
        "next_test": [
            {
                "condition": _plan(t.plan),
                "separates": list(t.separates),
                "odds": t.odds,
                "repeats": t.repeats,
                "tells": t.tells,
                "predicted": {name: [_mode(m) for m in rows] for name, rows in zip(t.separates, t.predictions, strict=True)},
            }
            for t in tests
        ],
        "misfit": misfit_json(m),
        "tolerances": {name: {"value": float(v), "sd": float(s), "prior_sd": float(p)} for name, v, s, p in _tolerances(found, about)},
    }


def would_change(found: Diagnosis, places: list[Change], tests: list[NextTest]) -> str:
    """What would make this verdict another one, in a sentence or two."""
    test = ""
    if tests:
        told, (first, second) = plan_words(_plan(tests[0].plan)), tests[0].separates
        test = f" A test {told} tells {first} from {second}."
    if found.verdict == "none":
        return "An effect larger than these data could have hidden would change that; how large that is, is listed for each."
    if found.verdict == "unexplained":
        place = f", which would have to change the {places[0].element} ({places[0].pattern})" if places else ""
        return f"An effect that the catalogue does not hold would change that{place}.{test}"
    rivals = [c for c in found.candidates if set(c.effects) - set(found.effects)]
    rival = (
        f"{' + '.join(rivals[0].effects)}, {rivals[0].delta_evidence - found.candidates[0].delta_evidence:.0f} in ln evidence"
        if rivals
        else "none"
    )
    return f"Data that the next best explanation ({rival}) predicts better would change that.{test}"


def _plan(plan: Plan) -> dict[str, Any]:
    told: dict[str, Any] = {"temperature_C": plan.condition.temperature, "speed_rpm": round(plan.condition.speed / RPM, 6)}
    if plan.condition.level:
        told["level_N"] = plan.condition.level
    if np.isfinite(plan.condition.soak_time):
        told["soak_time_min"] = plan.condition.soak_time / 60
    if plan.mass:
        told |= {"added_mass_g": plan.mass, "on": plan.on}
    if plan.point is not None:
        told["point"] = {"body": plan.point.body, "position_mm": [1e3 * v for v in plan.point.position], "direction": plan.point.direction}
    return told


def plan_words(told: dict[str, Any]) -> str:
    words = f"at {told['temperature_C']:g} C, {told['speed_rpm']:.0f} rpm"
    words += f", hit with {told['level_N']:g} N" if "level_N" in told else ""
    words += f", after {told['soak_time_min']:g} min in the chamber" if "soak_time_min" in told else ""
    words += f", with {told['added_mass_g']:g} g on the {told['on']}" if "added_mass_g" in told else ""
    if "point" in told:
        x, y, z = told["point"]["position_mm"]
        words += f", looking along x at the {told['point']['body']} ({x:g}, {y:g}, {z:g}) mm too"
    return words


def _mode(m: ModePrediction) -> dict[str, float]:
    """Without damping where nobody can predict it."""
    damping = {"damping": m.damping, "damping_sd": m.damping_sd} if np.isfinite(m.damping_sd) else {}
    return {"frequency_Hz": m.frequency, "sd_Hz": m.sd, **damping}


def _candidate(c: Candidate) -> dict[str, Any]:
    units = {f"{e.name}.{p.name}": p.unit for e in c.fit.effects for p in e.parameters}
    return {
        "effects": list(c.effects),
        "delta_evidence": c.delta_evidence,
        "probability": c.probability,
        "held_out_error_ratio": c.held_out_ratio,
        "parameters": {
            f"{e}.{p}": {"value": v, "sd": c.fit.sd[e][p], "unit": units[f"{e}.{p}"]}
            for e, row in c.fit.values.items()
            for p, v in row.items()
        },
        "believable": c.believable,
    }


def _tolerances(found: Diagnosis, about: Theory):
    fit = found.best.fit if found.best and found.effects else found.base
    return zip(about.names, fit.nuisance, fit.nuisance_sd, about.sd, strict=True)


def show_diagnosis(console: Console, answer: dict[str, Any]) -> None:
    named = f": {', '.join(answer['effects'])}" if answer["effects"] else ""
    console.print(f"[bold]{answer['verdict']}{named}[/bold]")
    console.print(answer["reason"], highlight=False)
    console.print(answer["would_change"], highlight=False)
    error = answer["error"]
    console.print(
        f"rms pull {error['before']:.2f} -> {error['after']:.2f}; on left-out conditions {error['held_out_before']:.2f} -> {error['held_out_after']:.2f}"
    )
    console.print("\nBest explanations (ln evidence over the model without effects):")
    for c in answer["candidates"][:5]:
        values = ", ".join(f"{k.split('.')[1]} {v['value']:.4g}{_error(v['sd'])}{_unit(v['unit'])}" for k, v in c["parameters"].items())
        console.print(
            f"  {' + '.join(c['effects'])}: {c['delta_evidence']:+.1f}, probability {c['probability']:.3f}; {values}", highlight=False
        )
    if answer["misfit"]["rejected"]:
        console.print("\nWithout any catalogue:")
        for sentence in answer["misfit"]["words"]:
            console.print(f"  {sentence}", highlight=False, markup=False)
    for t in answer["next_test"]:
        first, second = t["separates"]
        times = "" if t["repeats"] == 1 else f", {t['repeats']} times for 100 to 1"
        console.print(
            f"\nA test {plan_words(t['condition'])} would separate {first} from {second} with odds of {t['odds']:.3g} to 1{times}, most by {t['tells']}; they predict:",
            highlight=False,
        )
        for name, rows in t["predicted"].items():
            console.print(f"  {name}: {_frequencies(rows)} Hz", highlight=False)
    for o in answer.get("predictions", []):
        console.print(
            f"\nPredicted earlier by {o['explanation']} for {o['test']}: {o['verdict']}, {o['rms']:.2g} standard errors rms over {o['modes']} modes",
            highlight=False,
        )
    if answer["verdict"] == "none":
        small = sorted(answer["detectable"].items())
        console.print("\nSmallest size these data would have shown: " + ", ".join(f"{k} {v:.2g}" for k, v in small), highlight=False)
        console.print(f"Not visible in these data at a typical size: {', '.join(answer['invisible']) or 'nothing'}")


def _error(sd: float) -> str:
    """What was chosen, not fitted, has none."""
    return f" +- {sd:.2g}" if sd else ""


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _frequencies(rows: list[dict[str, float]]) -> str:
    return ", ".join(f"{r['frequency_Hz']:.1f} +- {r['sd_Hz']:.1f}" for r in rows)
