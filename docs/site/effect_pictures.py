"""A picture of every effect of the catalogue: what it does to natural frequencies, to the lines of a turning spindle, or to a measured FRF."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
from matplotlib.figure import Figure

import thermospindle as ts
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.units import RPM
from thermospindle.sim.effects.effect import Effect, refusal
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.runout import runout

BLUE, RED, BLACK = "#56b4e9", "#d55e00", "#1b1c1d"
SEEN = 1e-3  # per cent, from which a change of frequency is drawn
HARD = 10.0  # times the scene's level, at which an effect of the level is drawn
SHOWN = 12  # modes
SCENES = ("hdd_2003", "free_shaft", "five_bearing")


@cache
def _scenes() -> tuple[tuple[str, Spindle], ...]:
    """Spindles that effects can be in: the shipped ones, and that of `spindle new --like machine-tool`, which has a tool holder."""
    from thermospindle.report.verbs.starting import new

    with TemporaryDirectory() as folder:
        place = Path(folder) / "scene"
        new("scene", like="machine-tool", out=place)
        return *((name, ts.load(name)) for name in SCENES), ("the spindle of `spindle new --like machine-tool`", ts.load(place))


def picture(effect: Effect, folder: Path) -> tuple[str, str]:
    """Name of the file and what it shows. Raises `ValueError` for an effect that shows in none of the spindles."""
    matplotlib.use("Agg")
    draw = _lines if effect.imperfections else _frf if effect.measurement else _frequencies
    for name, spindle in _scenes():
        if refusal(effect, spindle) is None and (drawn := draw(effect, spindle)) is not None:
            figure, caption = drawn
            figure.savefig(folder / f"{effect.name}.svg", metadata={"Date": None})
            return f"{effect.name}.svg", f"{caption.format(name=name)}, {_sizes(effect, ts.add(spindle, effect.name))}"
    raise ValueError(f"{effect.name}: shows in none of the spindles")


def _sizes(effect: Effect, changed: Spindle) -> str:
    """The values of the effect that was added."""
    units = {p.name: "" if p.unit == "1" else f" {p.unit}" for p in effect.parameters}
    return "with " + ", ".join(f"{name} = {value:.4g}{units[name]}" for name, value in changed.effects[-1].values.items())


def _axes(rows: int = 1):
    figure = Figure(figsize=(7, 2.4 if rows == 1 else 3.6), layout="constrained")
    return figure, figure.subplots(rows, 1, sharex=True)


def _frequencies(effect: Effect, spindle: Spindle) -> tuple[Figure, str] | None:
    """Relative changes (per cent) by mode; None where there are none."""
    changed = ts.add(spindle, effect.name)
    low, high = spindle.temperatures
    turns = any(b.turns for b in spindle.structure.bodies)
    conditions = [Condition(low), Condition(high), *([Condition(high, spindle.nominal_speed)] if turns else [])]
    rows = [_change(spindle, changed, c) for c in conditions]
    struck = ""
    if np.nanmax(np.abs(rows)) < SEEN:
        level = HARD * spindle.hammer.level
        rows, struck = [_change(spindle, changed, replace(c, level=level)) for c in conditions], f" struck with {level:g} N"
    if np.nanmax(np.abs(rows)) < SEEN:
        return None
    figure, axes = _axes()
    for k, (row, c) in enumerate(zip(rows, conditions, strict=True)):
        label = f"{c.temperature:g} °C" + (f", {c.speed / RPM:.0f} rpm" if c.speed else "")
        axes.bar(np.arange(1, len(row) + 1) + 0.25 * (k - 1), row, 0.25, label=label, color=(BLUE, RED, BLACK)[k])
    axes.axhline(0, color="#5d6268", linewidth=0.8)
    axes.set(xlabel="mode, in order of frequency", ylabel="change, %", xticks=range(1, len(rows[0]) + 1))
    figure.legend(frameon=False, ncols=3, fontsize="small", loc="outside upper right")
    return figure, f"Change of the natural frequencies of {{name}}{struck}"


def _change(spindle: Spindle, changed: Spindle, condition: Condition) -> list[float]:
    before, after = operating_point(spindle, condition), operating_point(changed, condition)
    first, then = [m for m in before.modes if m.frequency <= spindle.hammer.band[1]][:SHOWN], after.modes
    mass = matrices(before.chain).mass
    partner = follow(mass, first, then) if len(mass) == len(matrices(after.chain).mass) else range(len(first))
    return [100 * (then[j].frequency / m.frequency - 1) if j >= 0 else np.nan for m, j in zip(first, partner, strict=False)]


def _lines(effect: Effect, spindle: Spindle) -> tuple[Figure, str] | None:
    """Lines of the runout that the effect alone makes."""
    condition = Condition(spindle.reference_temperature, spindle.nominal_speed)
    alone = replace(ts.add(spindle, effect.name), imperfections=Imperfections())
    found = runout(operating_point(alone, condition), path="linear")
    if not found.lines:
        return None
    figure, axes = _axes()
    largest = max(line.amplitude for line in found.lines)
    for line in found.lines:
        axes.plot([line.frequency] * 2, [0, 1e9 * line.amplitude], color=RED, linewidth=2)
        if line.amplitude > 0.05 * largest and line.causes:
            axes.annotate(line.causes[0].name, (line.frequency, 1e9 * line.amplitude), xytext=(0, 3), textcoords="offset points", fontsize="small", ha="center")
    axes.set(xlabel="frequency, Hz", ylabel="amplitude, nm", xlim=(0, 1.4 * max(line.frequency for line in found.lines)), ylim=(0, 1.3e9 * largest))
    return figure, f"Lines of the runout of {{name}} at {condition.speed / RPM:.0f} rpm that it alone makes"


def _frf(effect: Effect, spindle: Spindle) -> tuple[Figure, str] | None:
    """Change of the FRF that it changes most, as a ratio and an angle."""
    frequency = np.linspace(*spindle.hammer.band, 1500)
    before, after = (ts.frf(ts.point(s, spindle.reference_temperature), frequency).value for s in (spindle, ts.add(spindle, effect.name)))
    i, j = np.unravel_index(int(np.argmax(np.abs(after / before - 1).max(axis=-1))), before.shape[:2])
    ratio = after[i, j] / before[i, j]
    figure, (upper, lower) = _axes(2)
    upper.plot(frequency, 20 * np.log10(np.abs(ratio)), color=RED)
    lower.plot(frequency, np.degrees(np.angle(ratio)), color=RED)
    upper.set_ylabel("change, dB")
    for axes, least in ((upper, 1.0), (lower, 5.0)):
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -least), max(high, least))
    lower.set(ylabel="change, degrees", xlabel="frequency, Hz")
    points, hit = spindle.points, spindle.hammer.hammer_nodes[j]
    return figure, f"Change of the FRF of {points[i].name} over {next(p.name for p in points if p.node == hit)} of {{name}} as measured"
