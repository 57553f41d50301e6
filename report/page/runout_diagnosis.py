"""The diagnosis of runout as sections of an HTML page; `answer` is its JSON answer."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from matplotlib.figure import Figure

from thermospindle.model.units import small_length
from thermospindle.report.figures.common import pictures
from thermospindle.report.page.report import Section
from thermospindle.report.text.diagnosis.words import next_words
from thermospindle.report.text.runout_diagnosis import CLEAR
from thermospindle.report.typeset import minus, plain_error, prose, table, unit_cell

CAPTIONS = {
    "runout_explanations": "Green: what the verdict names. Every explanation is fitted to the lines that it can move, with the build's tolerances and what the "
    "scene likely has besides.",
    "runout_moved": "At the probe where the effect shows most. Open: rms of what spindles of the scene show there; filled: with the effect beside it.",
}


def sections(answer: dict[str, Any], drawn: Mapping[str, Figure]) -> list[Section]:
    """Verdict, explanations, lines that the effect moves, what is larger than the scene gives, the
    next test, and what could have been seen."""
    shown = pictures(drawn, CAPTIONS)
    found = [("Runout: verdict", _verdict(answer))]
    if answer["candidates"]:
        found.append(("Runout: explanations", shown.get("runout_explanations", "") + _candidates(answer)))
    if "runout_moved" in shown:
        found.append(("Runout: the lines that it moves", shown["runout_moved"]))
    found.append(("Runout: larger than the scene gives", _where(answer)))
    if answer["next_test"] or answer["verdict"] not in ("none", "unexplained"):
        found.append(("Runout: which test would decide", _next(answer)))
    found.append(("Runout: what these records could have shown", _detectable(answer)))
    return found


def _verdict(answer: dict[str, Any]) -> str:
    named = f": {', '.join(answer['effects'])}" if answer["effects"] else ""
    error = answer["error"]
    words = f"Error of all lines, rms: {error['before']:.2f} -> {error['after']:.2f} standard errors, by the scene alone and with what the verdict names"
    if error["held_out_before"] is not None:
        words += f"; of tests left out one after the other {error['held_out_before']:.2f} -> {error['held_out_after']:.2f}"
    card = f'<div class="cards"><div class="card"><span>verdict</span><b>{escape(answer["verdict"] + named)}</b></div></div>'
    said = "".join(f"<p>{prose(answer[key])}</p>" for key in ("reason", "would_change"))
    strange = [
        f"<li>{minus(escape(g['test']))}: {g['frequency_Hz']:.1f} Hz, {g['order']:.3f} orders, {small_length(1e-6 * g['amplitude_um'])} at node {g['node']}</li>"
        for g in answer["unexplained_lines"]
    ]
    unknown = f"<p>Lines that no imperfection has:</p><ul>{''.join(strange)}</ul>" if strange else ""
    return card + said + f"<p>{prose(words)}.</p>" + unknown


def _candidates(answer: dict[str, Any]) -> str:
    rows = []
    for c in answer["candidates"]:
        for k, (name, v) in enumerate(c["parameters"].items()):
            first = k == 0
            value, _, sd = minus(v.get("called") or plain_error(v["value"], v["sd"])).partition(" +- ")
            rows.append(
                [
                    escape(" + ".join(c["effects"])) if first else "", minus(f"{c['delta_evidence']:+z.1f}") if first else "",
                    f"{c['probability']:.3f}" if first else "", escape(name.split(".", 1)[1] if len(c["effects"]) == 1 else name),
                    escape(value) + (f" <small>± {sd}</small>" if sd else ""), unit_cell(v["unit"]),
                    ("yes" if c["believable"] else "no, at a limit") if first else "",
                ]
            )  # fmt: skip
    head = ["effects", "ln evidence", "probability", "value", "", "unit", "believable"]
    caption = "ln evidence is over the scene's own imperfections; what was chosen, not fitted (ring, order, bearing), has no error."
    return table(head, rows, (0, 3, 5, 6), caption, ruled=True)


def _where(answer: dict[str, Any]) -> str:
    if not answer["where"]:
        return "<p>Nothing: without any catalogue, no source has more than three times what the scene lets expect.</p>"
    rows = []
    for w in answer["where"]:
        for k, c in enumerate(w["change"]):
            rows.append(
                [
                    escape(w["element"]) if k == 0 else "", escape(w["with"]) if k == 0 else "", escape(c.get("test", "all tests")),
                    f"{c['amplitude']:.4g}", f"{c['likely']:.3g}", c["unit"], f"{c['amplitude'] / c['likely']:.1f}",
                ]
            )  # fmt: skip
    head = ["source", "its line", "in", "amplitude", "likely", "unit", "times"]
    return table(head, rows, (0, 1, 2, 5), "Without any catalogue: sources fitted to the lines, against their likely size by the scene.", ruled=True)


def _next(answer: dict[str, Any]) -> str:
    parts = []
    for t in answer["next_test"]:
        first, second = t["separates"]
        rows = [
            [f"{a['frequency_Hz']:.1f}", escape(a["name"]), str(a["node"]), *(f"{1e3 * p:.3g}" for p in (a["amplitude_um"], b["amplitude_um"], a["scene_um"]))]
            for a, b in zip(t["predicted"][first], t["predicted"][second], strict=True)
        ]
        at = t["condition"]
        words = f"<h3>A test {escape(t['changed'])}</h3><p>{prose(next_words(t, t['changed']))}</p>"
        head = ["Hz", "line", "node", escape(first), escape(second), "scene alone, likely"]
        caption = (
            f"What each predicts of it, nm zero to peak: at {at['temperature_C']:g} °C, {at['speed_rpm']:.0f} rpm, records of {at['seconds']:.3g} s at nodes "
            f"{', '.join(map(str, at['nodes']))}."
        )
        parts.append(words + table(head, rows, (1,), caption))
    return "".join(parts) + (f"<p>{prose(answer['no_next_test'])}</p>" if answer["no_next_test"] else "")


def _detectable(answer: dict[str, Any]) -> str:
    rows = [
        [escape(name), escape(row["parameter"]), f"{row['size']:.2g}", unit_cell(row["unit"])]
        for name, row in sorted(answer["detectable_in"].items())
    ]
    caption = f"Size from which each effect would have stood out by {CLEAR:g} in ln evidence of what the scene likely has of the same lines."
    return table(["effect", "parameter", "smallest", "unit"], rows, (0, 1, 3), caption)
