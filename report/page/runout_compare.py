"""Measured runout beside the scene's as sections of an HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from markupsafe import escape
from matplotlib.figure import Figure

from thermospindle.diagnosis.runout.compare import RunoutBeside, rms_residual
from thermospindle.model.units import TO_NM, small_length
from thermospindle.report.figures.common import label, pictures
from thermospindle.report.figures.runout_campaign import PANELS, strongest_probe
from thermospindle.report.page.report import Section
from thermospindle.report.text.runout_compare import before_after
from thermospindle.report.typeset import minus, signed, table, with_error

LINES = 12  # of a test in the table
CAPTIONS = {
    "runout_lines": "Every line at the probe where it is largest. Blue: as computed, over what the chance of the balls' start and the build leave open; a "
    "line of several balls or bearings is their sum by chance.",
    "runout_pulls": "Computed less measured amplitude, at the probe where they differ most, in standard deviations of the record, of chance and of how "
    "spindles of one drawing scatter. Without a number: not a line of its own in that record.",
}


def sections(found: Sequence[RunoutBeside], drawn: Mapping[str, Figure], errors: Mapping[str, float | None] | None = None) -> list[Section]:
    """Lines with pictures and a table; repeatable and nonrepeatable parts; `errors` are those of
    before and after, where two scenes were compared."""
    few = f"<p>Drawn are the {PANELS} tests that agree least.</p>" if len(found) > PANELS else ""
    lines = _summary(found, errors) + few + "".join(pictures(drawn, CAPTIONS).values()) + _lines(found)
    return [("Runout, lines measured beside computed", lines), ("Runout, repeatable and nonrepeatable parts", _parts(found))]


def _summary(found: Sequence[RunoutBeside], errors: Mapping[str, float | None] | None) -> str:
    rms = rms_residual(found)
    words = [f"<p>Rms residual of all lines: <b>{rms:.3g} standard errors</b>." if rms is not None else "<p>No line could be compared."]
    worst = max(((g, t) for t in found for g in t.lines), key=lambda row: abs(row[0].residual), default=None)
    if worst:
        g, t = worst
        words.append(
            f" The largest: {signed(g.residual, 1)} standard errors at {g.frequency:.1f} Hz, node {g.node}, in {escape(t.test.id)}: "
            f"computed {small_length(g.computed)}, measured {small_length(g.measured)}."
        )
    words.append("</p>")
    for tests, one, other in before_after(errors or {}):
        words.append(f"<p>{tests.capitalize()} tests: {one:.3g} → {other:.3g} standard errors.</p>")
    unknown = [(t, u) for t in found for u in t.unexplained]
    items = [f"{escape(t.test.id)}: {u.frequency:.1f} Hz, {u.order:.3f} orders, {small_length(u.amplitude)} at node {u.node}" for t, u in unknown]
    return minus("".join(words)) + (f"<p>Lines that no theory of bearings explains:</p><ul>{''.join(f'<li>{minus(i)}</li>' for i in items)}</ul>" if items else "")


def _lines(found: Sequence[RunoutBeside]) -> str:
    rows = []
    for t in found:
        for k, g in enumerate(strongest_probe(t)[:LINES]):
            cause = g.causes[0]
            rows.append(
                [
                    f"{escape(t.test.id)}<br><small>{label(t.test, ', ')}</small>" if k == 0 else "", str(escape(cause.name)),
                    str(escape(f"{cause.bearing} {cause.cause}".strip())) + (f" {cause.order}" if cause.order else ""), f"{g.frequency:.2f}", f"{g.order:.3f}",
                    str(g.node), str(with_error((TO_NM * g.measured, TO_NM * g.measured_sd))), str(with_error((TO_NM * g.computed, TO_NM * g.scatter))), signed(g.residual, 1),
                ]
            )  # fmt: skip
    head = ["test", "line", "cause", "Hz", "orders", "node", "measured, nm", "computed, nm", "error, s.d."]
    caption = f"The {LINES} strongest lines of every test at the probe where each is largest, zero to peak."
    return table(head, rows, (0, 1, 2), caption, "runout-lines", ruled=True)


def _parts(found: Sequence[RunoutBeside]) -> str:
    rows = []
    for t in found:
        for r, n in zip(t.rro, t.nrro, strict=True):
            test = f"{escape(t.test.id)}<br><small>{label(t.test, ', ')}</small>" if r is t.rro[0] else ""
            valleys = [("–" if v is None else f"{TO_NM * v:.1f}") for p in (r, n) for v in (p.measured, p.computed)]
            rms = [f"{TO_NM * v:.2f}" for p in (r, n) for v in (p.measured_rms, p.computed_rms)]
            rows.append([test, str(r.node), rms[0], rms[1], valleys[0], valleys[1], rms[2], rms[3], valleys[2], valleys[3]])
    head = [
        "test", "node", "RRO rms,\nmeasured", "computed", "RRO peak to\nvalley, measured", "computed",
        "NRRO rms,\nmeasured", "computed", "NRRO peak to\nvalley, measured", "computed",
    ]  # fmt: skip
    caption = "Repeatable (RRO) and nonrepeatable (NRRO) runout at every probe, nm; peak to valley values are of time records alone."
    return table(head, rows, (0,), caption, "runout-parts", ruled=True)
