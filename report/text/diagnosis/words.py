"""A diagnosis in sentences, and in the terminal."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.diagnosis.decision.explanations import beyond_limits
from thermospindle.diagnosis.decision.loss import in_all
from thermospindle.diagnosis.inference.gaussian import apart_by
from thermospindle.diagnosis.inference.hypothesis import DEPARTS
from thermospindle.diagnosis.prediction.next_test import NextTest
from thermospindle.diagnosis.verdict import Diagnosis, Drift
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.typeset import plain, plain_error, unit_word

ODD, AGREE = 5.0, 3.0  # errors by which one test differs from all others, and within which these agree
ALIKE = 0.9  # of the evidence of what the verdict names, from which a free drift does as well


OFF = "No effect is needed, but the drawing is off by more than its tolerances: where that cannot be so, something else is wrong."
SENTENCES = {
    "none": "No effect is missing.",
    "identified": "Missing: {}.",
    "two effects": "Missing: {}.",
    "ambiguous": "Missing is one of: {}.",
    "unexplained": "Something is missing that the catalogue does not hold.",
}


def condition(c: Condition) -> dict[str, Any]:
    """A condition as answers have it, with units in the keys."""
    found: dict[str, Any] = {"temperature_C": c.temperature, "speed_rpm": round(c.speed / RPM, 6)}
    if c.level:
        found["level_N"] = c.level
    if np.isfinite(c.soak_time):
        found["soak_time_min"] = c.soak_time / 60
    return found


def drift_words(d: Diagnosis) -> list[str]:
    """What would have to drift, in sentences."""
    if d.verdict.word == "none":
        return ["No element has to drift: tolerances and measuring errors explain the data."]
    return [f"{_drift_words(p)} ({p.gain:.0f} in ln evidence)." for p in d.drifts[:3]] or ["No single element explains the misfit by drifting."]


def _drift_words(p: Drift) -> str:
    return f"{p.element}: {_change_words(p)}"


def _change_words(p: Drift) -> str:
    if len(p.change) == 1:
        ((change, sd),) = p.told
        return f"{_signed(change, sd)}{unit_word(p.unit, ' ')} {_where(p.conditions[0])}"
    if (odd := _odd_one(p)) is not None:
        unit, others = unit_word(p.unit, " "), [row for i, row in enumerate(p.told) if i != odd]
        rest = [_signed(*row) for row in (min(others), max(others))]
        return f"{_signed(*p.told[odd])}{unit} {_where(p.conditions[odd])} alone, and {' to '.join(rest)}{unit} in all other tests"
    low, high = int(np.argmin(p.change)), int(np.argmax(p.change))
    goes = f", {p.pattern.shape.name}" if p.pattern and p.pattern.shape.name != "constant" else ""
    (least, its_sd), (most, sd) = p.told[low], p.told[high]
    return (
        f"from {_signed(least, its_sd)}{unit_word(p.unit, ' ')} {_where(p.conditions[low])} to {_signed(most, sd)}{unit_word(p.unit, ' ')} "
        f"{_where(p.conditions[high])}{goes}"
    )


def _odd_one(p: Drift) -> int | None:
    """The one test that differs from each of the others, by `ODD` of its errors, where these agree
    among themselves; None where there is none."""
    if len(p.change) < 4:
        return None
    by = apart_by(p.change, p.covariance)
    odd = int(np.argmax(by.sum(axis=1)))
    rest = np.delete(np.arange(len(by)), odd)
    return odd if by[odd, rest].min() > ODD and by[np.ix_(rest, rest)].max() < AGREE else None


def _signed(change: float, sd: float) -> str:
    return "+" * (change > 0) + plain_error(change, sd)


def law_words(d: Diagnosis) -> list[str]:
    """Of every effect that the verdict names and whose law the data do not have: that, and what they have instead."""
    v, found = d.verdict, []
    gain = v.accepted.evidence.ln - d.search.base.evidence.ln
    for m, departure in zip(v.accepted.mechanisms, v.accepted.evidence.learned.departures, strict=True):
        if m.free:
            continue
        own = next((p for p in d.own_laws if p.element == m.name), None)
        theirs = f"its {m.size.name} {_change_words(own)}" if own else ""
        drafts = f"`spindle draft` with --element {m.name} writes an effect with that law"
        if own and m.own_law:
            found.append(f"The data do not have the law that {m.name} assumes, but one of their own: {theirs}. {drafts}.")
        elif own or departure >= DEPARTS:
            same = [p for p in d.drifts if p.pattern and p.gain > ALIKE * gain]
            instead = f"; {_drift_words(same[0])}, does as well without any law" if same else ""
            sizes = f": {theirs}" if own else ""
            found.append(f"The data do not have the law that {m.name} assumes{sizes}{instead}.{f' {drafts}.' if own else ''}")
    return found


def _where(c: Condition) -> str:
    return f"at {c.temperature:g} C, {c.speed / RPM:.0f} rpm"


def would_change(d: Diagnosis) -> str:
    """What would make this verdict another one, in a sentence or two."""
    v = d.verdict
    test = f" {_told_apart(d.tests[0])}" if d.tests else ""
    if v.word == "none":
        return "An effect larger than these data could have hidden would change that; how large that is, is listed for each."
    if v.word == "unexplained":
        told = next((p.element for p in d.drifts if v.free and p.element in v.free[0].names), None)  # of what the verdict says drifts
        place = f"; `spindle draft` writes one from the drift of {told}" if told else ""
        return f"An effect that the catalogue does not hold would change that{place}.{test}"
    rivals = [c for c in v.candidates if set(c.names) - set(v.effects)]
    if rivals and beyond_limits(rivals[0].hypothesis):
        test += f" {' + '.join(rivals[0].names)} would need a size that it cannot have."
    elif rivals and not d.tests:
        test = f" No other temperature or speed tells {' + '.join(v.candidates[0].names)} from {' + '.join(rivals[0].names)}."
    if not rivals:
        return f"Data that another explanation predicts better would change that: none of the catalogue comes near.{test}"
    rival = f"{' + '.join(rivals[0].names)}, {behind(v.candidates[0].delta_evidence - rivals[0].delta_evidence)}"
    return f"Data that the next best explanation ({rival}) predicts better would change that.{test}"


def _told_apart(test: NextTest) -> str:
    beyond = ", beyond the temperatures that the scene states and the campaign had" if test.beyond else ""
    return f"A test {plan_words(condition(test.condition))} would tell {test.separates[0]} from {test.separates[1]} with odds of {odds_words(test.odds)} to 1{beyond}."


def odds_words(odds: float) -> str:
    return "more than a million" if odds >= 1e6 * (1 - 1e-9) else plain(odds)


def behind(gap: float) -> str:
    """In words by how much less ln evidence an explanation has than the best."""
    if abs(gap) < 0.5:
        return "level with it in ln evidence"
    return f"{gap:.0f} behind it in ln evidence" if gap > 0 else f"{-gap:.0f} ahead of it in ln evidence, but less likely beforehand"


def hidden_words(names: list[str]) -> str:
    """What may act beside what the verdict names, unseen."""
    they = "its" if len(names) == 1 else "their"
    return f"Not to be told apart from it here: {', '.join(names)}; at {they} typical size beside it nothing of these data would show."


def plan_words(condition: dict[str, Any]) -> str:
    words = f"at {condition['temperature_C']:g} C, {condition['speed_rpm']:.0f} rpm"
    words += f", hit with {condition['level_N']:g} N" if "level_N" in condition else ""
    return words + (f", after {condition['soak_time_min']:g} min in the chamber" if "soak_time_min" in condition else "")


def _sentence(answer: dict[str, Any]) -> str:
    """The verdict; of a set what all of its explanations hold comes first."""
    word, effects = answer["verdict"], answer["effects"]
    sure = in_all(effects, [(c["effects"], c["probability"]) for c in answer["candidates"]]) if word == "ambiguous" else ()
    if sure:
        return f"Missing: {' and '.join(sure)}, and perhaps one more: {', '.join(e for e in effects if e not in sure)}."
    if word == "none" and answer["learned"]["build_tolerances_times"] > 1.0:
        return OFF
    return SENTENCES[word].format((" and " if word == "two effects" else ", ").join(effects))


def show_diagnosis(console: Console, answer: dict[str, Any], verbose: bool = True) -> None:
    """The verdict in one sentence and why; with `verbose` every explanation, drift and next test, and what would have been seen."""
    console.print(f"{answer['verdict']}: {_sentence(answer)}", style="bold")
    console.print(answer["reason"])
    if answer["granted"]:
        console.print(answer["granted"])
    for sentence in (*answer["law_departs"], *answer["doubts"]):
        console.print(sentence)
    console.print(answer["would_change"])
    if answer["may_hide"]:
        console.print(hidden_words(answer["may_hide"]))
    error = answer["error"]
    console.print(f"Error of the data (FRF lines, modes of tables), rms in standard errors: {error_words(error, bool(answer['effects']))}")
    if not verbose:
        _show_little(console, answer)
        return
    if answer["candidates"]:
        console.print("\nExplanations, ln evidence over the model without effects and posterior probability:")
    for c in answer["candidates"][:5]:
        console.print(f"  {' + '.join(c['effects'])}: {c['delta_evidence']:+z.1f}, {_percent(c['probability'])}{'' if c['arrived'] else ', its fit has not arrived'}; {_values(c)}")
    best = answer["candidates"][0] if answer["candidates"] else None
    if best and answer["effects"]:
        for name, rows in best["law"].items():
            if best["departure_from_law"][name]:
                law = "its law is the data's own" if name in best["own_law"] else "one size would be its own law"
                console.print(f"\nThe size of {name} as the data have it, test by test ({law}):")
                console.print("  " + ", ".join(f"{r['test']} {plain_error(r['size'], r['sd'])}" for r in rows))
    if answer["verdict"] != "none":
        console.print("\nWithout any catalogue, what would have to drift:")
        for sentence in answer["misfit"]["words"]:
            console.print(f"  {sentence}")
    for t in answer["next_test"]:
        console.print(f"\n{next_words(t, plan_words(t['condition']))}")
    for o in answer.get("predictions", []):
        console.print(
            f"\nPredicted earlier by {o['explanation']} for {o['test']}: {o['verdict']}, {o['rms']:.2g} standard errors rms over {o['modes']} modes"
        )
    if answer["verdict"] == "none":
        small = sorted(answer["detectable_in"].items())
        console.print("\nSmallest size these data would have shown, of each effect acting where and when it shows most:")
        for name, row in small:
            acting = f" ({row['acting_words']})" if row["acting_words"] else ""
            console.print(f"  {name}: {row['parameter']} {row['size']:.2g}{unit_word(row['unit'], ' ')}{acting}")
        console.print(f"Not visible in these data at a typical size: {', '.join(answer['invisible']) or 'nothing'}")


def error_words(error: dict[str, Any], named: bool) -> str:
    """As drawn, with tolerances and what a model may be constantly off by fitted, and where effects are `named` with these."""
    def of(which: str) -> str:
        return f"{error[which + 'before']:.2f}" + (f", with what is named {error[which + 'after']:.2f}" if named else "")

    unseen = f"; conditions left out {of('held_out_')}" if error["held_out_after"] is not None else ""
    return f"as drawn {error['drawn']:.2f}, with tolerances and the model's constant errors fitted {of('')}{unseen}"


def _show_little(console: Console, answer: dict[str, Any]) -> None:
    """The explanations that the verdict names with their values, the test to make next, and where the rest is."""
    for c in answer["candidates"]:
        if set(c["effects"]) <= set(answer["effects"]) and answer["effects"]:
            console.print(f"  {' + '.join(c['effects'])}, {_percent(c['probability'])}: {_values(c)}")
    for t in answer["next_test"][:1]:
        console.print(next_words(t, plan_words(t["condition"])))
    for o in answer.get("predictions", []):
        console.print(f"Predicted earlier by {o['explanation']} for {o['test']}: {o['verdict']}, {o['rms']:.2g} standard errors rms")
    console.print("--verbose shows every explanation, what would drift, and what these data could have shown.", style="dim")


def value_words(v: dict[str, Any]) -> str:
    """A parameter's value with error and unit, or the name of what it stands for; and what it may be as well."""
    value = v.get("called") or plain_error(v["value"], v["sd"]) + unit_word(v["unit"], " ")
    others = "".join(f" or {o.get('called') or plain(o['value'])} ({_percent(o['probability'])})" for o in v.get("others", ()))
    return f"{value} ({_percent(v['probability'])}){others}" if others else value


def _values(candidate: dict[str, Any]) -> str:
    """Fitted parameters with their errors and units."""
    return ", ".join(f"{k.split('.', 1)[1]} {spread_words(candidate, k) or value_words(v)}" for k, v in candidate["parameters"].items())


def spread_words(candidate: dict[str, Any], name: str) -> str:
    """Of the size of an effect whose law the data do not have, by the `name` of its parameter: from
    which to which it goes over the tests, and its mean last, which says little then, and nothing where
    it is of the law assumed and the sizes of one of the data's own; empty of all other parameters."""
    effect = name.split(".", 1)[0]
    first = next(k for k in candidate["parameters"] if k.startswith(f"{effect}."))  # an effect's size comes first
    if name != first or candidate["departure_from_law"].get(effect, 0.0) < DEPARTS:
        return ""
    rows, mean = candidate["law"][effect], candidate["parameters"][name]
    told = len(rows) > 1 and effect not in candidate["own_law"]
    return _range(rows) + unit_word(mean["unit"], " ") + (f" (mean {plain_error(mean['value'], mean['sd'])})" if told else "")


def _range(rows: list[dict[str, Any]]) -> str:
    """From the least to the largest size that tests have."""
    if len(rows) == 1:
        return plain_error(rows[0]["size"], rows[0]["sd"])
    least, most = (choose(rows, key=lambda r: float(r["size"])) for choose in (min, max))
    return f"from {plain_error(least['size'], least['sd'])} in {least['test']} to {plain_error(most['size'], most['sd'])} in {most['test']}"


def next_words(test: dict[str, Any], which: str) -> str:
    """The test to make, in a sentence."""
    first, second = test["separates"]
    return f"A test {which} would tell {first} from {second} with odds of {odds_words(test['odds'])} to 1, most by {test['tells']}.{beyond_words(test)}"


def beyond_words(test: dict[str, Any]) -> str:
    """That a proposed test is beyond what the scene states, where it is."""
    return " None within the temperatures that the scene states and the campaign had is as sure." if test.get("beyond") else ""


def _percent(probability: float) -> str:
    return f"{probability:.1%}" if probability > 1e-3 else "less than 0.1 %"
