"""What the page says in words and tables, as HTML; whatever comes from files is escaped."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from thermospindle.model.units import RPM
from thermospindle.report.text.compare import AGREES, ALMOST
from thermospindle.report.workbench.bench import Bench, Errors, Shown
from thermospindle.report.workbench.state import Session, Setting

NAMED = 4  # tests told by name
NOTHING = 5e-4  # percent, up to which a mode has not changed


def of_test(shown: Shown) -> str:
    """A test in a line, as plain text."""
    c, t = shown.condition, shown.test
    if t is None:
        return shown.id
    speed = f"{c.speed / RPM:.0f} rpm" if c.speed else "at rest"
    return f"{t.id}: {c.temperature:g} °C, {speed}" + (f", {t.level:g} N" if t.level else "")


def signed(value: float) -> str:
    """With its sign, three digits, a true minus."""
    return f"{value:+.3g}".replace("-", "−")


def short(bench: Bench, found: Errors) -> str:
    """The same in few words, for where the rest is out of sight."""
    if bench.campaign is None:
        furthest = max(found.cells, key=lambda c: abs(c.frequency), default=None)
        return str(Markup("<p>{}: <b>{} %</b></p>").format(furthest.mode, signed(furthest.frequency))) if furthest and abs(furthest.frequency) > NOTHING else "<p>no change</p>"
    said = [f"{which} <b>{value:.3g}</b>" for which, value in (("fitted", found.fitted), ("left out", found.left_out)) if value is not None]
    return f"<p>{', '.join(said)} s.e.</p>"


def status(bench: Bench, s: Setting, found: Errors) -> str:
    """How well it agrees on fitted and left-out tests, and where least; without tests what has changed most."""
    furthest = max(found.cells, key=lambda c: abs(c.frequency), default=None)
    if bench.campaign is None:
        if furthest is None or abs(furthest.frequency) < NOTHING:
            return "<p>No natural frequency has changed from the scene as it was opened.</p>"
        return str(Markup("<p>Changed most: mode {} at {}, <b>{} %</b>, {}.</p>").format(furthest.mode, furthest.test, signed(furthest.frequency), furthest.says))
    said = []
    for value, count, which in ((found.fitted, len(bench.shown) - len(s.left_out), "fitted"), (found.left_out, len(s.left_out), "left-out")):
        if value is not None:
            good = "agrees" if value < AGREES else "nearly agrees" if value < ALMOST else "does not agree"
            said.append(Markup("<b>{:.3g}</b> standard errors over {} {} test{} ({})").format(value, count, which, "s" * (count > 1), good))
    if furthest:
        said.append(Markup("furthest off: mode {} in {}, {} standard errors").format(furthest.mode, furthest.test, signed(furthest.frequency)))
    return str(Markup("<p>{}.</p>").format(Markup("; ").join(said)))


def not_shown(bench: Bench) -> str:
    """Which tests of the campaign the bench cannot show, and what does, as plain text; empty where there are none."""
    if not bench.of_runout:
        return ""
    several = len(bench.of_runout) > 1
    names = ", ".join(bench.of_runout[:NAMED]) + (f" and {len(bench.of_runout) - NAMED} more" if len(bench.of_runout) > NAMED else "")
    tests = f"Tests {names} are" if several else f"Test {names} is"
    return f"{tests} of runout, and not on the bench: spindle compare and spindle diagnose show runout, with --out on pages of its own."


def aside(bench: Bench) -> str:
    """The same on the page."""
    said = not_shown(bench)
    return str(Markup("<p>{}</p>").format(said)) if said else ""


def timing(seconds: float, drag: str) -> str:
    return f"<p class=soft>{1e3 * seconds:.0f} ms for all; while a slider moves, this computes {drag}.</p>"


def remarks(found: Errors) -> str:
    if not found.remarks:
        return ""
    rows = Markup("").join(Markup("<li>{}</li>").format(r) for r in found.remarks)
    return str(Markup("<details><summary>Modes without a partner</summary><ul>{}</ul></details>").format(rows))


def numbers(found: Errors, tests: Sequence[str], damping: bool) -> str:
    """The map as a table: modes by tests."""
    values = {(c.mode, c.test): c.damping if damping else c.frequency for c in found.cells}
    modes = sorted({c.mode for c in found.cells}, key=lambda m: int(m.split()[0]))
    head = Markup("").join(Markup("<th scope=col>{}</th>").format(t) for t in tests)
    rows = Markup("").join(
        Markup("<tr><th scope=row>{}</th>{}</tr>").format(
            m, Markup("").join(Markup("<td>{}</td>").format("–" if (v := values.get((m, t))) is None else f"{v:+z.2f}".replace("-", "−")) for t in tests)
        )
        for m in modes
    )
    return str(Markup("<table><thead><tr><th scope=col>mode</th>{}</tr></thead><tbody>{}</tbody></table>").format(head, rows))


def ladder(session: Session) -> str:
    """The steps that were kept, with their errors."""
    if not session.ladder:
        return "<p class=soft>Nothing kept yet.</p>"
    rows = Markup("").join(
        Markup("<tr><th scope=row>{}{}</th><td>{}</td><td>{}</td></tr>").format(
            r.name, " (now)" if r.setting == session.now else "", *("–" if v is None else f"{v:.3g}" for v in (r.fitted, r.left_out))
        )
        for r in session.ladder
    )
    head = Markup("<table><thead><tr><th scope=col>step: what was set</th><th scope=col>fitted, s.e.</th><th scope=col>left out, s.e.</th></tr></thead><tbody>")
    return str(head + rows + Markup("</tbody></table>"))
