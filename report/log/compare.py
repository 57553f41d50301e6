"""The Rerun log of a comparison: measured and computed FRFs of every test as two series on one axis, over the timeline `frequency`.

`frf/<test>/<hammer and response>/level` holds the two series, measured and computed, in decibels, with marks at their modes. Under
`numbers/` both stand in full, bit for bit, the computed ones as tests of their own, so that `report.log.read` reads them back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from thermospindle.model.machine import Spindle
from thermospindle.model.types import ComplexArray
from thermospindle.model.units import RPM
from thermospindle.report.log.columns import curve_look, log_curve, log_frf_numbers, log_peak_numbers, over_frequency, whole_log
from thermospindle.report.log.content import Pair, level_ends, one
from thermospindle.report.log.drawing import heat
from thermospindle.report.log.views import at, axis, window
from thermospindle.report.typeset import UNITS
from thermospindle.sim.campaign.campaign import Test
from thermospindle.sim.identification.frf import Frf, decibel
from thermospindle.sim.identification.peak import Peak
from thermospindle.sim.operating import provenance

COMPUTED = (170, 172, 178)
SHOWN = 4  # tests and FRFs a test in the overview: the coldest, the hottest and some between

PairedPeak = tuple[int, str, float, float, float]
"""Number and kind of a mode, its measured frequency with standard error, and the computed one, Hz."""


@dataclass(frozen=True, eq=False)
class FrfsBeside:
    """One test: `computed` (responses, references, n) on the lines and at the points of `measured`."""

    test: Test
    measured: Frf
    computed: ComplexArray


def write_comparison_log(
    spindle: Spindle, title: str, tests: Sequence[FrfsBeside], peaks: Mapping[str, Sequence[PairedPeak]], path: Path
) -> None:
    """Write the log, whole or not at all; `peaks` by test id. BadInput if its folder does not exist."""
    about = {"title": f"{spindle.title}: {title}", **provenance(spindle)}
    with whole_log(path, "run", f"{spindle.name} beside {title}", about, _blueprint(title, tests)) as recording:
        _log_numbers(recording, tests, peaks)
        _log_frfs(recording, tests, peaks)


def pairs_of(frf: Frf) -> list[Pair]:
    """(response, reference), driving points first."""
    every = [(r, h) for r in frf.response_nodes for h in frf.reference_nodes]
    return sorted(every, key=lambda p: p[0] != p[1])


def _place(test: Test, pair: Pair, name: str) -> str:
    return at("frf", test.id, f"hammer {pair[1]}, response {pair[0]}", name)


def _log_frfs(recording: rr.RecordingStream, tests: Sequence[FrfsBeside], peaks: Mapping[str, Sequence[PairedPeak]]) -> None:
    temperatures = [t.test.temperature for t in tests]
    for shown in tests:
        frf, colour = shown.measured, heat(shown.test.temperature, temperatures)
        lines = over_frequency(frf.frequency)
        for pair in pairs_of(frf):
            levels = {"measured": decibel(one(frf.value, frf, pair)), "computed": decibel(one(shown.computed, frf, pair))}
            # Rerun draws in the order of names: the computed curve is a broad band below the measured one, visible where both agree
            looks = {"measured": curve_look(colour, f"measured, {shown.test.id}", 1.2), "computed": curve_look(COMPUTED, "computed", 4.0)}
            for name, level in levels.items():
                log_curve(recording, f"{_place(shown.test, pair, 'level')}/{name}", lines, level, looks[name])
            for which, name in ((2, "measured"), (4, "computed")):
                own = np.array([p[which] for p in peaks.get(shown.test.id, ())])
                own = own[(own >= frf.frequency[0]) & (own <= frf.frequency[-1])]
                if len(own):
                    shape: Literal["up", "diamond"] = "up" if name == "measured" else "diamond"
                    paint = colour if name == "measured" else COMPUTED
                    look = rr.SeriesPoints(colors=[paint], markers=shape, marker_sizes=4, names=f"modes, {name}")
                    heights = np.interp(own, frf.frequency, levels[name])
                    log_curve(recording, f"{_place(shown.test, pair, 'level')}/modes_{name}", over_frequency(own), heights, look)


def _log_numbers(recording: rr.RecordingStream, tests: Sequence[FrfsBeside], peaks: Mapping[str, Sequence[PairedPeak]]) -> None:
    """FRFs in full, a row a line with the values of all (response, reference) pairs; the computed ones as `<test> computed`."""
    for order, (id, test, frf) in enumerate(_both(tests)):
        log_frf_numbers(recording, id, order, test.temperature, test.speed, frf)
    shown_peaks = [
        peak
        for t in tests
        for number, kind, measured, sd, computed in peaks.get(t.test.id, ())
        for peak in (
            Peak("measured", t.test.id, t.test.temperature, number, kind, measured, sd),
            Peak("computed", t.test.id, t.test.temperature, number, kind, computed),
        )
    ]
    log_peak_numbers(recording, shown_peaks)


def _both(tests: Sequence[FrfsBeside]) -> Iterator[tuple[str, Test, Frf]]:
    for t in tests:
        yield t.test.id, t.test, t.measured
        yield f"{t.test.id} computed", t.test, replace(t.measured, value=t.computed, coherence=None, sd=None)


# ---------------------------------------------------------------- what is shown


def _blueprint(title: str, tests: Sequence[FrfsBeside]) -> rrb.Blueprint:
    """An overview of some tests at the driving points, and a tab for every test with all its FRFs."""
    some = np.unique(np.linspace(0, len(tests) - 1, SHOWN).round().astype(int))
    frf = tests[0].measured
    driving = pairs_of(frf)[: max(1, min(2, sum(p[0] == p[1] for p in pairs_of(frf))))]
    overview = [_view(tests[k], pair) for k in some for pair in driving if pair in pairs_of(tests[k].measured)]
    every = [rrb.Grid(*(_view(t, p) for p in pairs_of(t.measured)), grid_columns=2, name=t.test.id) for t in tests]
    return window(rrb.Tabs(rrb.Grid(*overview, grid_columns=len(driving), name=f"Measured and computed: {title}"), *every), "frequency")


def _view(t: FrfsBeside, pair: Pair) -> rrb.View:
    frf = t.measured
    value = np.array([one(v, frf, pair) for v in (frf.value, t.computed)])
    level = decibel(value[value != 0]) if np.any(value) else np.zeros(1)  # one of the two may be nothing: by symmetry, or a channel that was off
    speed = f", {t.test.speed / RPM:.0f} rpm" if t.test.speed else ""
    unit = UNITS[frf.quantity]
    return rrb.TimeSeriesView(
        origin=_place(t.test, pair, "level"),
        name=f"{t.test.temperature:g} °C{speed}: H({pair[0]},{pair[1]}), computed grey, dB re 1 {unit} over Hz (#)",
        axis_x=axis("seq", round(frf.frequency[0]), round(frf.frequency[-1])),
        axis_y=rrb.ScalarAxis(range=level_ends(level)),
        plot_legend=rrb.PlotLegend(visible=False),
    )
