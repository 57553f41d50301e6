"""A comparison as JSON and in terminal tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console

from thermospindle.diagnosis.compare.before_after import BeforeAfter
from thermospindle.diagnosis.compare.compare import Comparison, PairedMode, TestComparison
from thermospindle.diagnosis.compare.constant import constant_errors
from thermospindle.diagnosis.compare.correlation import Band, of_sensors
from thermospindle.diagnosis.data.observe import FREQUENCY_FLOOR
from thermospindle.diagnosis.prediction.partners import BELIEVABLE
from thermospindle.model.errors import listed
from thermospindle.model.units import in_rpm
from thermospindle.report.text.grid import grid, show_grid
from thermospindle.report.typeset import known

FEW = 20  # modes of all tests, up to which each has a row of its own


def comparison_json(c: Comparison) -> dict[str, Any]:
    return {
        "spindle": c.spindle,
        "campaign": c.campaign,
        "tests": [_test_json(t) for t in c.tests],
        "measured_over_computed": {str(node): float(np.exp(np.median(ratios))) for node, ratios in of_sensors([t.correlation for t in c.tests if t.correlation]).items()},
        "comac": {str(node): value for node, value in c.comac.items()},
        "crossings": list(c.crossings),
        "rms_pull": known(c.rms_residual),
        "constant_errors": _constant_json(c),
    }


def _constant_json(c: Comparison) -> dict[str, Any] | None:
    found = constant_errors(c.tests)
    if found is None:
        return None
    return {"share": found.share, "rms_pull": found.without, "frequency_percent": {str(number): 100 * error for number, error in found.frequency.items()}}


def _test_json(t: TestComparison) -> dict[str, Any]:
    return {
        "id": t.test.id,
        "temperature_C": t.test.temperature,
        "speed_rpm": in_rpm(t.test.speed),
        "modes": [_mode_json(m) for m in t.modes],
        "missing_Hz": list(t.missing),
        "extra_Hz": list(t.extra),
        "hidden_Hz": list(t.hidden),
        "frac": {f"{response},{reference}": value for (response, reference), value in t.frac.items()},
        "correlation": None if t.correlation is None else _band_json(t.correlation.whole),
        "bands": [] if t.correlation is None else [_band_json(b) for b in t.correlation.bands],
    }


def _band_json(b: Band) -> dict[str, Any]:
    """Means over the lines of a band; the shift is by how much computed frequencies lie above measured ones."""
    return {
        "low_Hz": b.low,
        "high_Hz": b.high,
        "lines": b.lines,
        **{name: known(getattr(b, name)) for name in ("csac", "csf", "fdac")},
        "shift_percent": None if b.shift is None else 100 * b.shift,
        "frfs": {f"{response},{reference}": {"frac": s.frac, "csf": s.csf} for (response, reference), s in b.by_frf.items()},
    }


def _mode_json(m: PairedMode) -> dict[str, Any]:
    return {
        "mode": m.number,
        "kind": m.kind,
        "measured_Hz": m.measured,
        "sd_Hz": m.sd,
        "computed_Hz": m.computed,
        "error_Hz": m.error,
        "error_percent": 100 * m.error / m.measured,
        "pull": m.residual,
        "damping_measured": m.damping_measured,
        "damping_sd": m.damping_sd,
        "damping_computed": m.damping_computed,
        "damping_error_percent": None if m.damping_error is None else 100 * m.damping_error,
        "damping_pull": m.damping_residual,
        "mac": m.mac,
        "close": m.close,
    }


AGREES, ALMOST = 1.5, 3.0  # standard errors rms up to which a scene and a campaign agree, and nearly do

TOGETHER = "no mode alone is off by more than {:.1f}, but their errors hang together, above all by the temperature of the test, and do not explain all of them at once"
"""Where the modes' own errors are smaller than their rms residual, which knows what their errors have in common."""


UNLIKE = 0.1
"""MAC below which a measured mode has nothing of the computed one that stands near its frequency: its error says nothing."""


def verdict(c: Comparison) -> str:
    """One sentence: whether they agree, by how much they do not, and the modes that are furthest off, in standard errors and in Hz."""
    if without := without_modes(c):
        return f"{c.spindle}: {without}."
    words = "agrees with the tests within their errors" if c.rms_residual < AGREES else "nearly agrees with the tests" if c.rms_residual < ALMOST else "does not agree with the tests"
    sentence = f"{c.spindle} {words}: rms residual {c.rms_residual:.3g} standard errors"
    every = [(t, m) for t in c.tests for m in t.modes]
    if c.rms_residual < AGREES:
        turned = [f"{m.measured:.0f} Hz of {t.test.id}" for t, m in every if unlike(m)]
        return f"{sentence}; but the shape measured at {_first(turned)} has nothing of the computed one (MAC below {UNLIKE:g})." if turned else f"{sentence}{_alone(c)}."
    if every:
        share = float(np.sqrt(np.mean([(m.error / m.measured) ** 2 for _, m in every])))
        sentence += f" ({100 * share:.2g} % of the frequencies)"
    alone = max((abs(m.residual) for _, m in every), default=0.0)
    if alone < c.rms_residual and not any(t.missing for t in c.tests):
        t, m, off = max(((t, m, abs(m.damping_residual or 0.0)) for t, m in every), key=lambda row: row[2])
        if off > max(alone, ALMOST):
            return f"{sentence}; no frequency alone is off by more than {alone:.1f}, but dampings are, most that of {_mode(t, m)} by {off:.3g}."
        return f"{sentence}; {TOGETHER.format(alone)}."
    if not every:
        none = sum(len(t.missing) for t in c.tests)
        of = f"none of the {none} measured modes has" if none > 1 else "the one measured mode has no"
        return f"{sentence}; {of} {'a ' * (none > 1)}computed partner within {BELIEVABLE:.0%} of its frequency: are frequencies in another unit, or of another machine?"
    if lost := [f"{f:.5g} Hz of {t.test.id}" for t in c.tests for f in t.missing]:
        several = len(lost) > 1
        sentence += f"; no computed mode is within {BELIEVABLE:.0%} of the measured one{'s' * several} at {_first(lost)}, which count{'' if several else 's'} as that much"
    alike = [(t, m) for t, m in every if not unlike(m)]
    if not alike:
        return f"{sentence}; no computed mode near a measured one has its shape."
    t, m = max(alike, key=lambda row: abs(row[1].residual))
    _, largest = far = max(alike, key=lambda row: abs(row[1].error))
    in_hertz = "" if largest is m else f"; in Hz it is {_mode(*far)} {_off(largest)}"
    return f"{sentence}; {'of the others ' if lost else ''}furthest off in standard errors is {_mode(t, m)} {_off(m)} ({abs(m.residual):.3g} standard errors){in_hertz}."


def _alone(c: Comparison) -> str:
    """Where errors agree together, the mode that does not alone, in all its tests; else empty."""
    by_number: dict[int, list[PairedMode]] = {}
    for t in c.tests:
        for m in t.modes:
            by_number.setdefault(m.number, []).append(m)
    off = {number: float(np.sqrt(np.mean([m.residual**2 for m in modes]))) for number, modes in by_number.items()}
    worst = max(off, key=lambda number: off[number], default=None)
    if worst is None or off[worst] < AGREES:
        return ""
    modes = by_number[worst]
    mean = float(np.mean([m.error for m in modes]))
    return (
        f", taken together, for what errors of one test have in common, as its temperature, makes up for much; taken alone, frequencies of mode {worst} ({modes[0].kind}) "
        f"are off by {off[worst]:.1f} rms, in the mean by {mean:+.3g} Hz"
    )


def without_modes(c: Comparison) -> str:
    """Where no mode was measured: that there is none to compare, and how alike FRFs are at least; else empty."""
    if any(t.modes or t.missing for t in c.tests):
        return ""
    frfs = [t.correlation for t in c.tests if t.correlation is not None]
    if not frfs:
        return "no mode was measured, so there is none to compare"
    low, high = min(f.whole.low for f in frfs), max(f.whole.high for f in frfs)
    csac, csf = (float(np.mean([getattr(f.whole, name) for f in frfs])) for name in ("csac", "csf"))
    return f"no mode was found in the measured FRFs between {low:.0f} and {high:.0f} Hz, so there is none to compare; FRFs are alike by {csac:.3f} in shape (CSAC) and {csf:.3f} with their size (CSF)"


MOST = 0.5  # of the squares of all errors, from which what is the same at all conditions is most of them


def constant_words(c: Comparison) -> str:
    """Where a scene and a campaign disagree mostly by what is the same at all conditions, and nearly agree without
    it: a sentence with the figures, and what that may be; else empty, for what is left then may be an effect."""
    found = constant_errors(c.tests)
    if found is None or c.rms_residual < AGREES or found.share < MOST or found.without >= ALMOST or not found.frequency:
        return ""
    number = max(found.frequency, key=lambda n: abs(found.frequency[n]))
    what = (
        "build tolerances are fitted in this scene; diagnose leaves free, too, what no scene holds: constant errors of modes, and bearings, balls and joints that are not quite as drawn"
        if c.built
        else "build tolerances and constant errors of modes do that, which diagnose leaves free and compare does not"
    )
    return (
        f"{100 * found.share:.3g} % of the squared errors are the same at all conditions, a constant error of every mode (most {100 * found.frequency[number]:+.2g} % of the frequency of mode {number}), "
        f"without which {found.without:.3g} standard errors would be left: {what}."
    )


def unlike(m: PairedMode) -> bool:
    """Whether the measured shape of a paired mode has nothing of the computed one."""
    return m.mac is not None and m.mac < UNLIKE


def _first(places: Sequence[str]) -> str:
    """Where, the first of many."""
    return listed([*places[:4], *(["other places"] if len(places) > 4 else [])])


def _mode(t: TestComparison, m: PairedMode) -> str:
    return f"the {m.kind} mode at {m.measured:.0f} Hz of {t.test.id},"


def _off(m: PairedMode) -> str:
    return f"computed {abs(m.error):.3g} Hz too {'high' if m.error > 0 else 'low'}"


def show_comparison(console: Console, c: Comparison, verbose: bool = True) -> None:
    """The verdict, the table of modes, what has no partner; with `verbose` also the correlation of
    FRFs, crossings, FRAC and COMAC by point."""
    console.print(verdict(c), style="bold", highlight=False, markup=False)
    if constant := constant_words(c):
        console.print(constant, highlight=False, markup=False)
    console.print(f"Tests: {c.campaign}", highlight=False, markup=False)
    if verbose or sum(len(t.modes) for t in c.tests) <= FEW:
        _show_modes(console, c)
    else:
        _show_by_mode(console, c)
    for t in c.tests:
        for what, values in t.unpaired:
            console.print(f"{t.test.id}: {what}: {', '.join(f'{f:.1f}' for f in values)} Hz", highlight=False)
    if not verbose:
        console.print("--verbose shows every mode of every test, the likeness of FRFs, COMAC and crossings of modes.", style="dim", highlight=False)
        return
    for line in c.crossings:
        console.print(line, highlight=False)
    if any(t.correlation for t in c.tests):
        _show_frfs(console, c)
    if c.comac or any(t.frac for t in c.tests):
        scales = of_sensors([t.correlation for t in c.tests if t.correlation])
        references = sorted({reference for t in c.tests for _, reference in t.frac})
        rows = []
        for node in dict.fromkeys([*c.comac, *(response for t in c.tests for response, _ in t.frac)]):
            cells, comac = [], c.comac.get(node)
            for r in references:
                found = [v for t in c.tests if (v := t.frac.get((node, r))) is not None]
                cells.append(f"{min(found):.3f}" if found else "-")
            scale = f"{np.exp(np.median(scales[node])):.3f}" if node in scales else "-"
            rows.append([str(node), "-" if comac is None else f"{comac:.4f}", scale, *cells])
        title = "COMAC, size of FRFs, and smallest FRAC of all tests by hammer point"
        show_grid(console, title, ("node", "COMAC", "measured /\ncomputed", *(f"hammer {r}" for r in references)), rows)


def _show_modes(console: Console, c: Comparison) -> None:
    """A row for every mode of every test; nothing where there is none."""
    if not any(t.modes for t in c.tests):
        return
    columns = (
        "test", "mode", "kind", "measured\nHz", "+-", "computed\nHz", "error\nHz", "error\n%", "error\ns.e.",
        "damping\n%", "computed\n%", "error\ns.e.", "MAC",
    )  # fmt: skip
    rows = []
    for t in c.tests:
        for m in t.modes:
            damping = "" if m.damping_measured is None else f"{100 * m.damping_measured:.3f}"
            damping_error = f"{m.damping_residual:+z.1f}" if m.damping_residual is not None else _in_percent([m])
            mac = "" if m.mac is None else f"{m.mac:.3f}" + ("*" if m.close else "")
            error = (f"{m.error:+z.2f}", f"{100 * m.error / m.measured:+z.2f}", f"{m.residual:+z.1f}")
            name = t.test.id if m is t.modes[0] else ""
            frequencies = (f"{m.measured:.2f}", f"{m.sd:.2f}", f"{m.computed:.2f}")
            beside = (damping, f"{100 * m.damping_computed:z.3f}", damping_error, mac)
            rows.append([name, str(m.number), m.kind, *frequencies, *error, *beside])
    show_grid(console, "Modes, computed - measured", columns, rows, ("test", "kind"), keys=3)
    console.print(
        f"+-: standard error of the measured frequency, with what repeats scatter by beyond it, the test's temperature is uncertain by, and the model's numerical error of {1e6 * FREQUENCY_FLOOR:.0f} ppm", highlight=False
    )
    _show_unsure(console, c)
    if any(m.close and m.mac is not None for t in c.tests for m in t.modes):
        console.print("* close modes: share of the measured shape in the plane of the computed ones")


def _show_by_mode(console: Console, c: Comparison) -> None:
    """A row for every mode, over all tests that have it."""
    by_number: dict[tuple[int, str], list[tuple[str, PairedMode]]] = {}
    for t in c.tests:
        for m in t.modes:
            by_number.setdefault((m.number, m.kind), []).append((t.test.id, m))
    rows = []
    for (number, kind), found in sorted(by_number.items()):
        modes = [m for _, m in found]
        worst, m = max(found, key=lambda row: abs(row[1].residual))
        damping = [d for o in modes if (d := o.damping_residual) is not None]
        macs = [o.mac for o in modes if o.mac is not None]
        low, high = min(o.measured for o in modes), max(o.measured for o in modes)
        rows.append([
            str(number), kind, str(len(modes)), f"{low:.1f}-{high:.1f}", f"{np.mean([o.error for o in modes]):+z.2f}", f"{_rms([o.residual for o in modes]):.1f}",
            f"{m.error:+z.2f}", worst, f"{_rms(damping):.1f}" if damping else _in_percent(modes), f"{min(macs):.3f}" if macs else "",
        ])  # fmt: skip
    columns = ("mode", "kind", "tests", "measured\nHz", "error, Hz\nmean", "s.e.\nrms", "worst by s.e.\nHz", "in test", "damping\ns.e. rms", "MAC\nleast")
    show_grid(console, f"Modes of {len(c.tests)} tests, computed - measured", columns, rows, ("kind", "in test"), keys=2)
    _show_unsure(console, c)


def _show_unsure(console: Console, c: Comparison) -> None:
    if any(m.damping_measured is not None and m.damping_sd is None for t in c.tests for m in t.modes):
        console.print("dampings without a standard error are compared in per cent and count in no other number; damping_sd_percent in the mapping of import tells one", highlight=False)


def _in_percent(modes: Sequence[PairedMode]) -> str:
    """The mean error of dampings whose standard errors nobody told; empty where none were measured."""
    errors = [e for m in modes if (e := m.damping_error) is not None]
    return f"{100 * float(np.mean(errors)):+z.0f} %" if errors else ""


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _show_frfs(console: Console, c: Comparison) -> None:
    """One line a test: correlation of all FRFs, and the band that is least alike."""
    rows = []
    for t in c.tests:
        if t.correlation is not None:
            worst = min(t.correlation.bands, key=lambda b: b.csf, default=t.correlation.whole)
            w = t.correlation.whole
            cells = (f"{w.csac:.3f}", f"{w.csf:.3f}", f"{w.fdac:.3f}", _percent(w.shift), f"{worst.low:.0f}-{worst.high:.0f}")
            rows.append([t.test.id, *cells, f"{worst.csac:.3f}", f"{worst.csf:.3f}", _percent(worst.shift)])
    columns = ("test", "CSAC", "CSF", "FDAC", "shift\n%", "least alike\nHz", "CSAC", "CSF", "shift\n%")
    show_grid(console, "FRFs, means over lines", columns, rows, ("test",))


def _percent(shift: float | None) -> str:
    return "-" if shift is None else f"{100 * shift:+z.2f}"


def show_before_after(console: Console, both: BeforeAfter) -> None:
    errors = both.errors()
    table = grid("Error of modes, rms in standard errors", ("", f"before\n{both.before.spindle}", f"after\n{both.after.spindle}"), ("",))
    for label, which in (("all tests", ""), ("fitted tests", "fitted_"), ("held-out tests", "held_out_")):
        values = [errors[f"{which}{when}"] for when in ("before", "after")]
        if which == "" or (both.held_out and None not in values):
            table.add_row(label, *(f"{v:.3g}" for v in values if v is not None))
    console.print(table)
    if both.held_out:
        console.print(f"held out: {', '.join(both.held_out)}", highlight=False)
