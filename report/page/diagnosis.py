"""The diagnosis as sections of an HTML page, and the files of its folder: page, pictures as SVG and PNG."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from thermospindle.diagnosis.parameters.nuisance import TEMPERATURE
from thermospindle.diagnosis.runout.verdict import RunoutDiagnosis
from thermospindle.diagnosis.verdict import Diagnosis
from thermospindle.model.machine import Spindle
from thermospindle.report.figures.common import pictures, save
from thermospindle.report.figures.diagnosis import figures
from thermospindle.report.figures.runout_campaign import diagnosis_figures
from thermospindle.report.page import runout_diagnosis
from thermospindle.report.page.report import Section, write_page
from thermospindle.report.text.diagnosis.words import beyond_words, hidden_words, plan_words, spread_words, value_words
from thermospindle.report.typeset import minus, plain, prose, signed, table, unit_cell, with_error

CAPTIONS = {
    "errors": "Rms residuals of every test in standard errors of its data: one is noise alone. Fitted to all tests, tolerances and what a model may be constantly off by "
    "can hide what is missing; a condition that is predicted from all others shows it.",
    "explanations": "Green: what the verdict names. Amber: free forms, which drift without a law. Hatched: a fit that has not arrived at its least error, whose number says nothing yet. An arrow: the bar goes on beyond the axis. All tolerances are fitted anew with each.",
    "law": "The size of the effect as each test has it, with one standard error: where it departs from a level line, this is the law that the data have. A line with a "
    "band is one number that was fitted to all tests together, since no departure from the law was likeliest: no measurement in every test.",
    "drift": "What would have to change in every test, with one standard error, where no effect is named.",
}
UNSEEN = 0.9  # standard error over that of the tolerance, from which the data say nothing of a parameter


def sections(d: Diagnosis, answer: dict[str, Any], drawn: dict[str, Figure] | None = None) -> list[Section]:
    """Titles and HTML; `answer` is the JSON answer of the diagnosis."""
    drawn = figures(d) if drawn is None else drawn
    shown = pictures(drawn, CAPTIONS, "diagnosis-")
    found = [("Verdict", _verdict(answer) + shown["errors"])]
    found.append(("Explanations", shown.get("explanations", "") + _candidates(answer)))
    if "law" in shown:
        found.append(("The law that the data have", shown["law"]))
    words = "<ul>" + "".join(f"<li>{prose(w)}</li>" for w in answer["misfit"]["words"]) + "</ul>"
    found.append(("Without any catalogue", words + shown.get("drift", "")))
    if answer["next_test"]:
        found.append(("Which test would decide", _tests(answer)))
    found.append(("What these data pin down", _tolerances(answer)))
    found.append(("What these data could have shown", _detectable(answer)))
    return found


def write_diagnosis(
    d: Diagnosis | None, answer: dict[str, Any], spindle: Spindle, folder: Path, turning: RunoutDiagnosis | None = None, told: dict[str, Any] | None = None, *, name: str = ""
) -> None:
    """`report.html`, and every picture as SVG and PNG, into a folder that exists; `turning` is the
    diagnosis of runout, `told` its answer; `name` is that of the campaign's folder."""
    modal = figures(d) if d else {}
    runout = diagnosis_figures(turning, spindle) if turning else {}
    every = sections(d, answer, modal) if d else []
    if told:
        every += runout_diagnosis.sections(told, runout)
    count = (len(d.search.model.tests) if d else 0) + (len(turning.seen) if turning else 0)
    write_page(folder, spindle, count, answer["campaign"], every, "Diagnosis", name)
    for called, one in (modal | runout).items():
        save(one, folder, called, 130)


def _verdict(answer: dict[str, Any]) -> str:
    named = f": {', '.join(answer['effects'])}" if answer["effects"] else ""
    error = answer["error"]
    kinds = [("all tests", ""), ("temperatures left out one after the other", "held_out_")]
    whens = ("before", "after") if answer["effects"] else ("before",)
    drawn = {"": f"{error['drawn']:.2f}", "held_out_": "–"}
    rows = [[name, drawn[which], *(f"{error[which + when]:.2f}" for when in whens)] for name, which in kinds if error[which + "after"] is not None]
    head = ["", "as drawn", "tolerances and constant errors fitted", *(["with what is named"] if answer["effects"] else [])]
    grid = table(head, rows, caption="Error of the data (FRF lines, modes of tables), rms in standard errors. Constant errors: what a model may be off by at all conditions alike, which the ladder's step \"tolerances fitted\" does not grant.")
    card = f'<div class="cards"><div class="card"><span>verdict</span><b>{escape(answer["verdict"] + named)}</b></div></div>'
    said = "".join(f"<p>{prose(answer[key])}</p>" for key in ("reason", "granted", "would_change") if answer[key]) + "".join(f"<p>{prose(s)}</p>" for s in (*answer["law_departs"], *answer["doubts"]))
    said += f"<p>{prose(hidden_words(answer['may_hide']))}</p>" if answer["may_hide"] else ""
    free = f"<p>Without any catalogue: {prose(answer['misfit']['words'][0])}</p>" if answer["misfit"]["rejected"] else ""
    return card + said + free + grid


CANDIDATES = (
    "ln evidence is against the model without effects, and so is the error on conditions left out; probability is that of no effect, one, "
    "two, and something unknown: free drift, or what was not tried. Two effects at once are believed less beforehand; and no evidence makes "
    "an answer surer than such answers have come true, nine times in ten where the truth was known."
)


def _candidates(answer: dict[str, Any]) -> str:
    head = ["effects", "ln\nevidence", "probability", "left-out\nerror, %", "value", "", "unit", "believable"]
    rest = [("no effect", "0", answer["probability"]["none"]), ("something unknown", "", answer["probability"]["unknown"])]
    blocks = [(c["probability"], _candidate(c)) for c in answer["candidates"]] + [(p, [[name, gain, f"{p:.3f}", *[""] * 5]]) for name, gain, p in rest]
    return table(head, [row for _, rows in sorted(blocks, key=lambda block: -block[0]) for row in rows], (0, 4, 6, 7), CANDIDATES, ruled=True)


def _candidate(c: dict[str, Any]) -> list[list[str]]:
    """Rows of an explanation, one a parameter."""
    arrived = "no,<br>not arrived" if not c["arrived"] else "yes" if c["believable"] else "no,<br>at a limit"
    left_out = "–" if c["held_out_error_ratio"] is None else f"{100 * c['held_out_error_ratio']:.0f}"
    rows = []
    for k, (name, v) in enumerate(c["parameters"].items()):
        spread = spread_words(c | {"parameters": c["parameters"] | {name: v | {"unit": "1"}}}, name)  # units have a column of their own
        words = _spread(spread) if spread else escape(value_words(v)) if "called" in v or v.get("others") else ""
        value, _, sd = (words, "", "") if words else _with_error(v["value"], v["sd"]).partition(" <small>")
        parameter = escape(name.split(".", 1)[1] if len(c["effects"]) == 1 else name) + (" <br>(test by test)" if spread else "")
        head = ["", "", "", ""] if k else [escape(" + ".join(c["effects"])).replace(" + ", " +<br>"), minus(_evidence(c["delta_evidence"])), f"{c['probability']:.3f}", left_out]
        rows.append([*head, parameter, value + (f" <small>{sd}" if sd else ""), unit_cell(v["unit"]), "" if k else arrived])
    return rows


def _spread(words: str) -> str:
    """A range in a cell that may be narrower than its words are long: names of tests are as long as their files'."""
    lines = re.sub(r" (to [^ ]+ ±|\(mean )", r" <br>\1", prose(words))
    return f'<span class="spread">{lines}</span>'


def _tests(answer: dict[str, Any]) -> str:
    parts = []
    for t in answer["next_test"]:
        times = "" if t["repeats"] == 1 else f"; {t['repeats']} of them make it 100 to 1"
        first, second = (escape(s) for s in t["separates"])
        words = f"<h3>A test {prose(plan_words(t['condition']))}</h3><p>It separates {first} from {second} with odds of {_odds(t['odds'])} to 1{times}; most by {prose(t['tells'])}.{beyond_words(t)}</p>"
        most = max(len(rows) for rows in t["predicted"].values())
        rows = [
            [escape(name), *(_with_error(r["frequency_Hz"], r["sd_Hz"], 1) for r in predicted), *[""] * (most - len(predicted))]
            for name, predicted in t["predicted"].items()
        ]
        parts.append(words + table(["", *(f"mode {k}" for k in range(1, most + 1))], rows, caption="What each predicts of it, Hz."))
    return "".join(parts)


def _odds(odds: float) -> str:
    return plain(odds) if odds < 9.99e5 else "more than a million"


def _tolerances(answer: dict[str, Any]) -> str:
    rows = []
    for name, t in answer["tolerances"].items():
        share = t["sd"] / t["prior_sd"]
        scale, unit = (1.0, "K") if t["kind"] == TEMPERATURE else (100.0, "%")
        rows.append(
            [
                escape(name), signed(t["value"] / t["prior_sd"], 2), f"{share:.2f}" if share >= 0.01 else f"{share:.1g}", signed(scale * t["value"], 2), f"{scale * t['prior_sd']:.2f}", unit,
                "cannot be seen" if share > UNSEEN else "",
            ]
        )  # fmt: skip
    head = ["", "fitted, s.d.", "its error, s.d.", "fitted", "tolerance, s.d.", "unit", ""]
    return table(head, rows, (0, 5, 6), "Build tolerances and measuring errors, fitted with their standard deviations as prior.")


def _detectable(answer: dict[str, Any]) -> str:
    rows = [
        [
            escape(name), escape(row["parameter"]), f"{row['size']:.2g}", unit_cell(row["unit"]), escape(row["acting_words"]),
            "not visible at a typical size" if name in answer["invisible"] else "",
        ]
        for name, row in sorted(answer["detectable_in"].items())
    ]  # fmt: skip
    caption = (
        "Size from which each effect would have been separated from the tolerances, which are fitted anew beside it; its own lines are worked out at that size. "
        "It is that of an effect acting where and when it shows most; acting otherwise, as a preload lost before all tests, it may do what tolerances do."
    )
    return table(["effect", "parameter", "smallest", "unit", "acting", ""], rows, (0, 1, 3, 4, 5), caption)


def _evidence(value: float) -> str:
    return f"{value:+z.1f}" if abs(value) < 1000 else f"{value:+z.0f}"


def _with_error(value: float, sd: float, digits: int = 3) -> str:
    """A value with its error, very large and small ones as powers of ten; what was chosen, not fitted, has none."""
    if sd == 0.0:
        return minus(f"{value:g}")
    if 1e-5 <= max(abs(value), sd) < 1e5:
        return str(with_error((value, sd), digits=digits))
    return minus(f"{value:.3g}") + f" <small>± {sd:.1g}</small>"
