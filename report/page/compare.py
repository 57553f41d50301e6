"""The comparison as sections of the HTML report, and its own folder: report, pictures as SVG and PNG, Rerun log."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from markupsafe import Markup, escape

from thermospindle.diagnosis.compare.before_after import BeforeAfter
from thermospindle.diagnosis.compare.compare import Comparison
from thermospindle.diagnosis.data.observe import FREQUENCY_FLOOR
from thermospindle.diagnosis.runout.compare import RunoutBeside
from thermospindle.model.machine import Spindle
from thermospindle.report.figures.common import label, save, svg
from thermospindle.report.figures.compare import figures
from thermospindle.report.figures.runout_campaign import comparison_figures
from thermospindle.report.log.compare import FrfsBeside, write_comparison_log
from thermospindle.report.page import runout_compare as runout
from thermospindle.report.page.report import Section, write_page
from thermospindle.report.text.compare import AGREES, TOGETHER, constant_words, unlike, without_modes
from thermospindle.report.text.runout_compare import before_after
from thermospindle.report.typeset import figure, minus, prose, signed, table, with_error

WORDS = {
    "pulls": (
        "Residuals of every mode in every test",
        "Computed less measured, in standard errors of the measurement: estimator, repeats, temperature and the model's own "
        "numerical floor. Without a number: not paired with any mode within the believable error. Below: how many modes only one side has.",
    ),
    "shapes": (
        "Shapes, measured and computed",
        "Shapes that the table tells, real parts where what moves in phase is real, with one standard error, and the computed ones in their size; of the first test that tells any.",
    ),
    "frfs": ("FRFs over each other", "Measured FRFs (coloured) and those of the model (dashed) at the same points, lines and window: driving points first, then the loudest."),
    "bands": (
        "Correlation by band",
        "Means over the lines of third-octave bands. CSAC compares the shape of all FRFs at a line and is blind to a scale, CSF amplitude "
        "too. The shift by FDAC: by how much the computed frequencies must come down to be most like the measured ones (FDAC); grey where no shift "
        "is better than another.",
    ),
    "channels": ("Correlation by FRF", "Every FRF over all its lines. Without a number: symmetry forbids an answer, so there is nothing to compare."),
    "fdac": (
        "FDAC",
        "Correlation of the computed FRFs at one frequency with the measured ones at another, for the tests that agree best and worst. "
        "A ridge off the thin diagonal is a model whose frequencies are off; red: the shift found in each band.",
    ),
}


def sections(c: Comparison, both: BeforeAfter | None = None) -> list[Section]:
    """What the comparison adds to a report: the map of residuals and errors in a table, of `both`
    scenes those before and after, then what its FRFs say, where it has any."""
    found: list[Section] = []
    drawn = {name: svg(one, f"compare-{name}", WORDS[name][0]) for name, one in figures(c).items()}
    modal = "".join(figure(drawn[name], WORDS[name][1]) for name in ("pulls", "shapes") if name in drawn)
    found.append(("Measured beside computed", _summary(c) + (_before_after(both) if both else "") + modal + _table(c)))
    spectral = [name for name in ("frfs", "bands", "channels", "fdac") if name in drawn]
    if spectral:
        found.append(("FRFs, measured and computed", "".join(f"<h3>{WORDS[n][0]}</h3>{figure(drawn[n], WORDS[n][1])}" for n in spectral)))
    return found


def write_comparison(
    c: Comparison | None,
    spindle: Spindle,
    folder: Path,
    turning: Sequence[RunoutBeside] = (),
    errors: Mapping[str, float | None] | None = None,
    campaign: str = "",
    *,
    name: str = "",
    both: BeforeAfter | None = None,
    progress: Callable[[str], None] = lambda done: None,
) -> None:
    """`report.html`, a PNG and an SVG of every picture, and, where there are FRFs, `compare.rrd`, in a folder that exists.

    `c` are tests of modes, `turning` tests of runout with the `errors` of two scenes; either may be missing. `both` is
    `c` beside the scene before it. `campaign` is its title, where there is no `c`, and `name` what its folder is called.
    """
    drawn = comparison_figures(turning)
    every = [*(sections(c, both) if c else []), *(runout.sections(turning, drawn, errors) if turning else [])]
    ids = {t.test.id for t in (c.tests if c else ())} | {t.test.id for t in turning}
    write_page(folder, spindle, len(ids), c.campaign if c else campaign, every, "Comparison", name)
    progress("page written")
    for called, one in ((figures(c) if c else {}) | drawn).items():
        save(one, folder, called)
        progress(f"picture {called} written")
    shown = [FrfsBeside(t.test, found.beside.measured, found.computed) for t in c.tests if (found := t.correlation) is not None] if c else []
    if c and shown:
        peaks = {t.test.id: [(m.number, m.kind, m.measured, m.sd, m.computed) for m in t.modes] for t in c.tests}
        write_comparison_log(spindle, c.campaign, shown, peaks, folder / "compare.rrd")


def _summary(c: Comparison) -> str:
    modes = [m for t in c.tests for m in t.modes]
    said = without_modes(c) or Markup("rms residual <b>{:.3g} standard errors</b>").format(c.rms_residual)
    words = [f"<p>{Markup.escape(c.campaign)} beside the scene {Markup.escape(c.spindle)}: {said}"]
    if modes:
        alike = [m for m in modes if not unlike(m)] or modes
        residuals = [(m.residual, f"{signed(m.error, 2)} Hz", m) for m in alike]
        residuals += [
            (m.damping_residual, f"{signed(100 * (m.damping_computed - m.damping_measured), 3)} % of damping", m)
            for m in alike
            if m.damping_residual is not None and m.damping_measured is not None
        ]
        residual, error, worst = max(residuals, key=lambda row: abs(row[0]))
        if abs(residual) < c.rms_residual >= AGREES and not any(t.missing for t in c.tests):
            words.append(f"; {TOGETHER.format(abs(residual))}")
        words.append(f", the largest in standard errors that of mode {worst.number} ({worst.kind}), {signed(residual, 1)} standard errors or {error}")
    words.append(".</p>")
    words.append(f"<p>{prose(constant)}</p>" if (constant := constant_words(c)) else "")
    remarks = [f"{label(t.test, ', ')}: {what}: {', '.join(f'{f:.1f}' for f in values)} Hz" for t in c.tests for what, values in t.unpaired]
    remarks += list(c.crossings)
    return "".join(words) + ("<ul>" + "".join(f"<li>{minus(str(Markup.escape(x)))}</li>" for x in remarks) + "</ul>" if remarks else "")


def _before_after(both: BeforeAfter) -> str:
    """The errors of the scene before and of that after, of fitted and held-out tests apart where there are both."""
    found = [*before_after(both.errors())]
    if not found:
        return ""
    if len(found) < 3:  # all, fitted, held out: without one of these the other is all
        found = found[:1]
    rows = [[f"{tests} tests", f"{one:.3g}", f"{other:.3g}"] for tests, one, other in found]
    unseen = f" Held out: {escape(', '.join(both.held_out))}." if both.held_out else ""
    head = ("", f"before,\n{both.before.spindle}", f"after,\n{both.after.spindle}")
    return table(head, rows, (0,), f"Error of modes, rms in standard errors, before and after.{unseen}", "before-after")


def _table(c: Comparison) -> str:
    head = (
        "test", "mode", "kind", "measured, Hz", "computed, Hz", "error, Hz", "error, %", "error, s.e.",
        "damping, %", "computed, %", "error, %", "MAC",
    )  # fmt: skip
    rows = []
    for t in c.tests:
        for k, m in enumerate(t.modes):
            damping = "–" if m.damping_measured is None else f"{100 * m.damping_measured:.3f}"
            cells = [
                label(t.test, ", ") if k == 0 else "", str(m.number), m.kind, with_error((m.measured, m.sd), digits=2), f"{m.computed:.2f}",
                signed(m.error, 2), signed(100 * m.error / m.measured, 2), signed(m.residual, 1), damping, f"{100 * m.damping_computed:z.3f}",
                "–" if m.damping_error is None else signed(100 * m.damping_error, 1), "–" if m.mac is None else f"{m.mac:.3f}" + ("*" if m.close else ""),
            ]  # fmt: skip
            rows.append(cells)
    starred = any(m.close and m.mac is not None for t in c.tests for m in t.modes)
    note = " * Close modes: share of the measured shape in the plane of the computed ones." if starred else ""
    caption = f"Every mode of every test, with one standard error, the model's own numerical one of {1e6 * FREQUENCY_FLOOR:.0f} ppm in it. MAC: modal assurance criterion.{note}"
    return table(head, rows, (0, 2), caption, "compared", ruled=True) if rows else ""
