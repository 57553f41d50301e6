"""The diagnosis of runout as JSON with the keys of `diagnosis.verdict`, and in the terminal."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.diagnosis.runout.explanation import Explanation
from thermospindle.diagnosis.runout.lines import key_of
from thermospindle.diagnosis.runout.moved import MovedLine, leading, moved_lines
from thermospindle.diagnosis.runout.next_test import NextRunout
from thermospindle.diagnosis.runout.sources import SourceKey
from thermospindle.diagnosis.runout.verdict import CLEAR, RunoutDiagnosis
from thermospindle.model.bearing.kinematics import VARYING
from thermospindle.model.machine import Spindle
from thermospindle.model.units import RPM, TO_UM, in_rpm
from thermospindle.report.text.diagnosis.answer import named
from thermospindle.report.text.diagnosis.words import behind, next_words, value_words
from thermospindle.report.typeset import known
from thermospindle.sim.effects.effect import Effect

SHOWN = 12  # candidates
LARGE = 3.0  # likely sizes from which a source is named
UNITS = {"unbalance": ("g mm", 1e6), "cage unbalance": ("g mm", 1e6), VARYING: ("times", 1.0)}
"""Unit of a source and its size in SI's; nm for all others."""


def runout_diagnosis_json(d: RunoutDiagnosis, catalogue: tuple[Effect, ...], spindle: Spindle) -> dict[str, Any]:
    accepted = leading(d)
    before = float(np.sqrt(d.chi2 / d.count))
    by_name = {e.name: e for e in catalogue}
    unseen = [n for n, e in by_name.items() if n not in d.smallest or d.smallest[n] > max(abs(v) for v in e.parameters[0].limits)]
    return {
        "verdict": d.verdict,
        "effects": list(d.effects),
        "reason": d.reason,
        "would_change": would_change(d),
        "candidates": [_candidate(e, spindle) for e in d.explanations[:SHOWN]],
        "invisible": sorted(unseen),
        "detectable": {name: size for name, size in d.smallest.items() if np.isfinite(size)},
        "detectable_in": {
            name: {"parameter": p.name, "unit": p.unit, "size": size}
            for name, size in d.smallest.items()
            if np.isfinite(size) and (p := by_name[name].parameters[0])
        },
        "error": {
            "before": before,
            "after": float(np.sqrt(accepted.chi2 / d.count)) if accepted else before,
            "held_out_before": known(d.held_out_before),
            "held_out_after": known(d.held_out_after if accepted else d.held_out_before),
        },
        "where": where(d),
        "moved_lines": [_moved_json(m) for m in moved_lines(d, accepted)] if accepted else [],
        "next_test": [_next_json(t) for t in d.next],
        "no_next_test": d.no_next,
        "unexplained_lines": [
            {"test": g.test, "frequency_Hz": g.frequency, "order": g.order, "amplitude_um": TO_UM * g.amplitude, "node": g.node}
            for g in d.unexplained
        ],
        "tests": [
            {
                "id": s.test.id,
                "temperature_C": s.condition.temperature,
                "speed_rpm": in_rpm(s.condition.speed),
                "lines": len(s.seen),
                "slip": s.slip,
            }
            for s in d.seen
        ],
    }


def _moved_json(m: MovedLine) -> dict[str, Any]:
    return {
        "test": m.test, "frequency_Hz": m.frequency, "order": m.order, "name": m.name, "cause": m.cause, "node": m.node,
        "measured_um": TO_UM * m.measured, "sd_um": TO_UM * m.measured_sd, "scene_um": TO_UM * m.scene, "with_effect_um": TO_UM * m.with_effect,
    }  # fmt: skip


def _next_json(t: NextRunout) -> dict[str, Any]:
    at = t.plan.condition
    return {
        "condition": {
            "temperature_C": at.temperature, "speed_rpm": round(at.speed / RPM, 6), "seconds": round(t.plan.seconds, 6), "nodes": list(t.plan.nodes),
        },
        "changed": t.plan.changed,
        "separates": list(t.separates),
        "odds": t.odds,
        "tells": t.tells,
        "predicted": {
            name: [
                {"frequency_Hz": p.frequency, "name": p.name, "node": p.node, "amplitude_um": TO_UM * p.amplitude[k], "scene_um": TO_UM * p.scene}
                for p in t.predicted
            ]
            for k, name in enumerate(t.separates)
        },
    }  # fmt: skip


def _candidate(e: Explanation, spindle: Spindle) -> dict[str, Any]:
    parameters = {}
    for v, size, sd in zip(e.variants, e.size, e.size_sd, strict=True):
        main, *others = v.effect.parameters
        parameters[f"{v.effect.name}.{main.name}"] = {"value": float(size), "sd": float(sd), "unit": main.unit}
        for p in others:
            # choices were compared; what runout from an unknown start does not determine keeps its typical value and its prior
            parameters[f"{v.effect.name}.{p.name}"] = {"value": v.values[p.name], "sd": 0.0 if p.choices else p.prior_sd, "unit": p.unit}
            parameters[f"{v.effect.name}.{p.name}"] |= named(v.effect, p.name, v.values[p.name], spindle)
    return {
        "effects": list(e.effects),
        "delta_evidence": e.delta_evidence,
        "probability": e.probability,
        "held_out_error_ratio": known(e.held_out_ratio),
        "parameters": parameters,
        "believable": e.believable,
    }


def source_words(source: SourceKey, direction: str) -> tuple[str, str]:
    """Where a source is, and the line it shows, which moves in a `direction`."""
    (bearing, cause, order, name), _ = source
    place = f"{bearing} bearing, {cause}" if bearing else "turning part, unbalance"
    return place + (f" of order {order}" if order else ""), f"{name}, {direction}"


def where(d: RunoutDiagnosis) -> list[dict[str, Any]]:
    """Sources that have far more than the scene gives, without any effect: which, how large against its likely size, in which line."""
    found: dict[tuple[str, str], dict[str, Any]] = {}
    directions = {key_of(g): g.direction for s in d.seen for line in s.seen for g in line.lines}
    for family, fit in zip(d.families, d.base, strict=True):
        for (source, test), likely, z in zip(family.source, family.likely, np.abs(fit.amplitude), strict=True):
            if z > LARGE:
                place, line = source_words(source, directions[source[0]])
                unit, factor = UNITS.get(source[0][1], ("nm", 1e9))
                drift = found.setdefault((place, line), {"element": place, "change": [], "with": line, "relative": 0.0})
                at = {} if test is None else {"test": d.seen[test].test.id}
                drift["change"].append({**at, "amplitude": float(factor * likely * z), "likely": float(factor * likely), "unit": unit})
                drift["relative"] = max(drift["relative"], float(z))
    return sorted(found.values(), key=lambda w: -w["relative"])[:SHOWN]


def would_change(d: RunoutDiagnosis) -> str:
    """What would make this verdict another one, in a sentence."""
    if d.verdict == "none":
        return "An imperfection larger than these records could have hidden would change that; how large that is, is listed for each."
    if d.unexplained:
        return "An excitation that turns or sounds at these frequencies and is none of a bearing's or of an unbalance's would explain them; the catalogue has none."
    if d.verdict == "unexplained":
        return "Longer records, or probes in another plane, would show which lines are not as computed."
    if d.next:
        first, second = d.next[0].separates
        return f"A test {d.next[0].plan.changed} would tell {first} from {second}."
    rivals = [e for e in d.explanations if set(e.effects) - set(d.effects) and len(e.effects) <= len(d.effects)]
    if not rivals:
        return "Records that another explanation predicts better would change that: none of the catalogue comes near."
    rival = f"{' + '.join(rivals[0].effects)}, {behind(d.explanations[0].delta_evidence - rivals[0].delta_evidence)}"
    return f"Records that the next best explanation ({rival}) predicts better would change that."


def show_runout_diagnosis(console: Console, answer: dict[str, Any], verbose: bool = False) -> None:
    """The verdict, what leads to it and the next test; the rest of the explanations, what is larger
    than the scene gives and smallest sizes where `verbose`."""
    named = f": {', '.join(answer['effects'])}" if answer["effects"] else ""
    console.print(f"runout: {answer['verdict']}{named}", style="bold")
    console.print(answer["reason"], highlight=False)
    console.print(answer["would_change"], highlight=False)
    error = answer["error"]
    console.print(f"rms residual {error['before']:.2f} -> {error['after']:.2f}", highlight=False)
    if answer["verdict"] not in ("none",):
        console.print("\nBest explanations (ln evidence over the scene's own imperfections):")
        for c in answer["candidates"][: 5 if verbose else 2]:
            values = ", ".join(f"{k.split('.')[1]} {value_words(v)}" for k, v in c["parameters"].items())
            console.print(
                f"  {' + '.join(c['effects'])}: {c['delta_evidence']:+z.1f}, probability {c['probability']:.3f}; {values}", highlight=False
            )
        if answer["where"] and (verbose or answer["verdict"] == "unexplained"):
            console.print("\nWithout any catalogue, larger than the scene gives:")
            for w in answer["where"][:5]:
                c = w["change"][0]
                console.print(
                    f"  {w['element']} ({w['with']}): {c['amplitude']:.4g} {c['unit']}, {w['relative']:.1f} times its likely size",
                    highlight=False,
                )
    for t in answer["next_test"]:
        console.print(next_words(t, t["changed"]), highlight=False)
    if answer["no_next_test"] and answer["verdict"] not in ("none", "unexplained"):
        console.print(answer["no_next_test"], highlight=False)
    for g in answer["unexplained_lines"]:
        console.print(
            f"  {g['test']}: {g['frequency_Hz']:.1f} Hz, {g['order']:.3f} orders, {g['amplitude_um']:.3g} um at node {g['node']}",
            highlight=False,
        )
    if verbose or answer["verdict"] == "none":
        small = ", ".join(f"{name} {row['size']:.2g} {row['unit']}" for name, row in sorted(answer["detectable_in"].items()))
        console.print(f"\nSmallest size these records would have shown ({CLEAR:g} in ln evidence): {small}", highlight=False)
    if not verbose:
        console.print("--verbose shows every explanation, what would be larger than the scene gives, and what these records could have shown.", style="dim", highlight=False)
