"""Figures of runout: orbit and polar plots with the repeatable part in a heavy line, and the spectrum with its lines named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from thermospindle.model.types import Array
from thermospindle.model.units import RPM, TO_NM, small_length
from thermospindle.report.figures.common import INK, PALE, STYLE, colour, spread
from thermospindle.sim.posing import round_down
from thermospindle.sim.running.lines import FoundLine
from thermospindle.sim.running.probes import AXIAL, X, Y, looked_at
from thermospindle.sim.running.revolutions import ErrorMotion, Revolutions, once_per_revolution
from thermospindle.sim.running.runout import Runout
from thermospindle.sim.running.waterfall import LineSpectrum, on_grid

REPEATS, BAND = "#c9371c", "#2166ac"
NAMED = {"radial": 9, "axial": 7}  # lines with labels, at most
NOTHING = 1e-6  # of the strongest line: a direction with no stronger one does not move
LEAST = 1e-3  # nm that a plot reaches at least: what moves by less stands still
LINE = 12  # revolutions that are drawn one after the other beside the band of all
DECADES = 3.0  # of the spectrum below its strongest line
ROOM = 250.0  # for labels, times the strongest line
BEND, FOOT = 1.5, 3.5  # times the strongest line: where leaders leave the upright, and where they meet their labels
RANGE = 50.0  # dB below the strongest line that the waterfall shows


def motion_figure(runout: Runout) -> Figure:
    """Orbit, and polar plots of the radial probes along x and y and of the axial one."""
    with rc_context(STYLE):
        figure = Figure(figsize=(8.8, 8.4))
        whole = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.05))
        where = looked_at(runout.point.spindle)
        cut, values, names = runout.by_lines, runout.values(), [p.name for p in runout.signals.probes]
        _orbit(figure.add_subplot(whole[0]), cut, names.index(X), names.index(Y), where)
        for place, name, title in ((1, X, f"Radial error motion ({where} x)"), (2, Y, f"Radial error motion ({where} y)"), (3, AXIAL, "Axial error motion")):
            axes = figure.add_subplot(whole[place], projection="polar")
            assert isinstance(axes, PolarAxes)
            _polar(axes, cut, names.index(name), values[name], title, name != AXIAL, bool(runout.point.spindle.rolling))
        handles, labels = figure.axes[1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def figures(runout: Runout) -> dict[str, Figure]:
    """By the names of their files."""
    return {"motion": motion_figure(runout), "spectrum": spectrum_figure(runout)}


def _orbit(axes: Axes, cut: Revolutions, x: int, y: int, where: str) -> None:
    every = TO_NM * cut.value[[x, y]].reshape(2, -1)
    axes.plot(*every, color=BAND, lw=0.35, alpha=0.45, rasterized=True)
    mean = TO_NM * cut.repeatable[[x, y]]
    axes.plot(*np.concatenate([mean, mean[:, :1]], axis=1), color=REPEATS, lw=2.0)
    reach = 1.08 * max(float(np.abs(every - every.mean(axis=1, keepdims=True)).max()), LEAST)
    for axis, middle in zip(("x", "y"), every.mean(axis=1), strict=True):
        axes.set(**{f"{axis}lim": (middle - reach, middle + reach), f"{axis}label": f"{where} {axis}, nm"})
    axes.set_aspect("equal")
    axes.set_title(f"Orbit, {cut.count} revolutions")


def _polar(axes: PolarAxes, cut: Revolutions, probe: int, quoted: ErrorMotion, title: str, radial: bool, rolls: bool) -> None:
    """Displacement over angle on a base circle; a radial plot about its least-squares circle, which is drawn.

    Revolutions are one line that goes on from each to the next: a motion that does not repeat does not end where it began.
    """
    mean, value = cut.repeatable[probe], cut.value[probe]
    base = mean.mean()
    if radial:
        base = base + (once_per_revolution(cut.angle, mean) * np.exp(1j * cut.angle)).real
    mean, value = TO_NM * (mean - base), TO_NM * (value - base)
    angle = np.append(cut.angle, cut.angle[0] + 2 * np.pi)
    low, high = _closed(value.min(axis=0)), _closed(value.max(axis=0))
    reach = max(float(abs(low.min())), float(abs(high.max())), LEAST)
    axes.fill_between(angle, low, high, color=BAND, alpha=0.2, lw=0, label="band of all revolutions (NRRO)")
    turns = value[:LINE]
    axes.plot((cut.angle + 2 * np.pi * np.arange(len(turns))[:, None]).ravel(), turns.ravel(), color=BAND, lw=0.3, alpha=0.5, label=f"the first {len(turns)} of them")
    axes.plot(angle, _closed(mean), color=REPEATS, lw=2.0, label="repeatable part (RRO)")
    axes.plot(np.linspace(0, 2 * np.pi, 181), np.zeros(181), color=INK, lw=0.9, ls="--", zorder=5, label="least-squares circle (axial: mean)")
    axes.set_rlim(-2.6 * reach, 1.15 * reach)
    step = round_down(reach / 1.5)
    axes.set_yticks([-step, 0.0, step], [f"−{step:g}", "0", f"{step:g} nm"])
    axes.set_rlabel_position(100)
    axes.tick_params(axis="y", labelsize=7)
    axes.set_title(title, pad=10)
    errors = {"total": quoted.total_error, "synchronous": quoted.synchronous_error} | ({"asynchronous": quoted.asynchronous_error} if rolls else {})
    text = "\n".join(f"{name} {small_length(value)}" if TO_NM * value > 1e-3 else f"{name} 0 nm" for name, value in errors.items()) + ("" if rolls else "\nasynchronous unknown")
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=7.5, linespacing=1.35)


def _closed(values: Array) -> Array:
    return np.append(values, values[0])


def polar_figure(runout: Runout, size: tuple[float, float]) -> Figure:
    """The polar plot of the radial probe alone."""
    with rc_context(STYLE):
        figure = Figure(figsize=size)
        axes = figure.add_subplot(projection="polar")
        assert isinstance(axes, PolarAxes)
        index = [p.name for p in runout.signals.probes].index(X)
        _polar(axes, runout.by_lines, index, runout.values()[X], "", True, bool(runout.point.spindle.rolling))
    return figure


# ---------------------------------------------------------------- spectrum


def spectra(runout: Runout) -> tuple[Array, Array, Array]:
    """Frequency (k,) Hz, and amplitudes (k,) m, zero to peak, across the axis (largest semi-axis) and along it; Hann window, for the eye:
    the heights of its bins are up to 1.4 dB low."""
    time = runout.signals.time
    value = runout.signals.value[:3] - runout.signals.value[:3].mean(axis=1, keepdims=True)
    window = np.hanning(len(time) + 1)[:-1]
    spectrum = 2 * np.fft.rfft(value * window) / window.sum()
    x, y, z = spectrum
    radial = (np.abs(x + 1j * y) + np.abs(x - 1j * y)) / 2
    return np.asarray(np.fft.rfftfreq(len(time), float(time[1] - time[0])), float), np.asarray(radial, float), np.asarray(np.abs(z), float)


def spectrum_figure(runout: Runout) -> Figure:
    """Amplitude over frequency and orders, across and along the axis, with the strongest lines named."""
    rate = abs(runout.turning)
    frequency, *amplitudes = spectra(runout)
    highest = 1.06 * max((g.frequency for g in _large(runout.lines)), default=10 * rate)
    with rc_context(STYLE | {"figure.constrained_layout.w_pad": 0.15}):  # the last number of an axis is wider than its end
        figure = Figure(figsize=(11.0, 7.6))
        panels = figure.subplots(2, 1, sharex=True)
        most = TO_NM * max([*(float(a.max()) for a in amplitudes), *(g.amplitude for g in runout.lines)])
        for axes, direction, amplitude in zip(panels, ("radial", "axial"), amplitudes, strict=True):
            own = [g for g in runout.lines if g.direction == direction and g.frequency < highest]
            largest = TO_NM * max([float(amplitude.max()), *(g.amplitude for g in own)])
            top = max(largest, NOTHING * most) or 1.0
            if largest <= NOTHING * most:  # its rounding is no spectrum
                axes.text(0.5, 0.5, "nothing moves this way", transform=axes.transAxes, ha="center", va="center", color=PALE)
                own, amplitude = [], np.zeros_like(amplitude)
            shown_part = frequency < highest
            axes.semilogy(frequency[shown_part], np.maximum(TO_NM * amplitude[shown_part], 1e-3 * top * 10**-DECADES), color=PALE, lw=0.7)
            _marks(axes, own)
            axes.set_ylim(top * 10**-DECADES, top * ROOM)
            axes.set_yticks([t for t in 10.0 ** np.arange(-6, 7) if top * 10**-DECADES <= t <= 2 * top])
            axes.minorticks_off()
            axes.set_ylabel(f"{direction}, nm zero to peak")
            axes.set_xlim(0, highest)
            _labels(axes, _named(own, NAMED[direction], 0.01 * highest, len(runout.point.spindle.rolling)), highest, top)
        panels[1].set_xlabel("frequency, Hz")
        orders = panels[0].secondary_xaxis("top", functions=(lambda f: f / rate, lambda o: o * rate))
        orders.set_xlabel(f"orders of the turning frequency{'' if abs(runout.ratios[0]) == 1 else ' of the spindle'}, {rate:.5g} Hz")
        handles, labels = panels[0].get_legend_handles_labels()
        more = dict(zip(*panels[1].get_legend_handles_labels()[::-1], strict=True))
        shown = dict(zip(labels, handles, strict=True)) | more
        figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=len(shown))
    return figure


def _large(every: Sequence[FoundLine]) -> list[FoundLine]:
    """Lines that a spectrum must hold: of each direction those above a hundredth of its strongest,
    unless that is nothing beside the strongest of all."""
    most = max((g.amplitude for g in every), default=0.0)
    own = {d: max((g.amplitude for g in every if g.direction == d), default=0.0) for d in NAMED}
    return [g for g in every if g.amplitude > 1e-2 * own[g.direction] and own[g.direction] > NOTHING * most]


def waterfall_figure(spectra: Sequence[LineSpectrum], direction: str, size: tuple[float, float]) -> Figure:
    """Spectra over frequency, one above the other in rpm, each rising by its level above `RANGE` dB
    below the strongest line of all, which the title tells; dots are natural frequencies."""
    highest = 500 * np.ceil(max(float(s.frequency.max(initial=1.0)) for s in spectra) / 500)
    grid = np.linspace(0, highest, 1201)
    amplitude = np.array([on_grid(s, grid, direction) for s in spectra])
    level = 20 * np.log10(np.maximum(amplitude, 1e-300) / (amplitude.max() or 1.0))
    speeds = np.array([abs(s.speed) / RPM for s in spectra])
    rise = 0.17 * float(np.ptp(speeds) or 1.0) / RANGE
    with rc_context(STYLE):
        figure = Figure(figsize=size)
        axes = figure.subplots()
        for k in np.argsort(-speeds):  # the slowest in front
            curve = speeds[k] + rise * np.maximum(level[k] + RANGE, 0.0)
            axes.plot(grid, curve, color=colour(speeds[k], speeds.tolist()), lw=0.8)
            natural = spectra[k].natural[spectra[k].natural < highest]
            axes.plot(natural, np.full(len(natural), speeds[k]), ".", color=INK, ms=2.5)
        axes.set(xlabel="frequency, Hz", ylabel="speed, rpm", xlim=(0, highest))
        title = f"A line at its speed: {RANGE:g} dB below the strongest of all, {small_length(float(amplitude.max()))} zero to peak.\nPeaks rise above it on a scale of dB. Dots: natural frequencies"
        axes.set_title(title, fontsize=7.5, fontweight="normal")
        axes.grid(visible=False)
    return figure


def _marks(axes: Axes, own: Sequence[FoundLine]) -> None:
    kinds: dict[str, tuple[str, str, Any]] = {
        "repeatable line": (REPEATS, "D", lambda g: g.repeatable),
        "nonrepeatable line": (BAND, "o", lambda g: not g.repeatable and g.causes),
        "unexplained line": (INK, "x", lambda g: not g.repeatable and not g.causes),
    }
    for label, (paint, marker, chosen) in kinds.items():
        some = [g for g in own if chosen(g)]
        if some:
            axes.plot([g.frequency for g in some], [TO_NM * g.amplitude for g in some], marker, color=paint, ms=4, ls="none", label=label)


def line_label(line: FoundLine, bearings: Sequence[str], every: int) -> str:
    """What a line is called in a figure: its name in the field's words and what causes it, and
    below in which of a spindle's bearings, of which there are `every` many."""
    if not line.causes:
        return f"{line.order:.4g}x\nunexplained"
    named = [b for b in bearings if b]
    where = ("both bearings" if every == 2 else f"all {every} bearings") if len(named) == every else ", ".join(named)
    return f"{line.causes[0].name}\n{line.causes[0].cause}" + f"\n{where}" * (every > 1 and bool(where))


def _named(own: Sequence[FoundLine], most: int, near: float, every: int) -> list[tuple[FoundLine, str]]:
    """The `most` strongest lines, and the strongest repeatable one, with their labels; lines of one
    kind in several of `every` bearings less than `near` (Hz) apart share one."""
    found: list[tuple[FoundLine, list[str]]] = []
    for line in sorted(own, key=lambda g: g is not next((h for h in own if h.repeatable), None)):
        first = line.causes[0] if line.causes else None
        bearings = list(dict.fromkeys(c.bearing for c in line.causes if first and c.cause == first.cause))
        for other, shared in found:
            kind = other.causes[0] if other.causes else None
            alike = first and kind and (kind.cause, kind.name) == (first.cause, first.name)
            if alike and abs(other.frequency - line.frequency) < near:
                shared += [b for b in bearings if b not in shared]
                break
        else:
            found.append((line, bearings))
    return [(line, line_label(line, sorted(bearings), every)) for line, bearings in found[:most]]


def _labels(axes: Axes, named: Sequence[tuple[FoundLine, str]], highest: float, top: float) -> None:
    """Upright labels above the lines, side by side, with leaders that stand over their lines and
    bend above all of them: none crosses another."""
    rising = sorted(named, key=lambda g: g[0].frequency)
    rows = max((label.count("\n") + 1 for _, label in rising), default=1)
    places = spread(np.array([line.frequency for line, _ in rising]), (0.012 + 0.011 * rows) * highest, 0.006 * rows * highest, (1 - 0.006 * rows) * highest)
    for (line, label), x in zip(rising, places, strict=True):
        axes.plot([line.frequency, line.frequency, x], [TO_NM * line.amplitude, BEND * top, FOOT * top], color=PALE, lw=0.6, zorder=1)
        axes.text(x, 1.15 * FOOT * top, label, rotation=90, ha="center", va="bottom", ma="left", fontsize=7, linespacing=1.1)
