"""Figures of a resonance map: Campbell diagram, the same over temperature, coincidences over both, and runout along both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from thermospindle.model.bearing.kinematics import Line
from thermospindle.model.units import RPM
from thermospindle.report.figures.common import INK, PALE, STYLE, spread
from thermospindle.report.figures.warmup import LETTERS, MODES, name_ends
from thermospindle.sim.resonance.found import ALIKE, Coincidence, LineTrack, ResonanceMap, Track, nearest, strongest
from thermospindle.sim.resonance.point import key
from thermospindle.sim.running.probes import looked_at

WHIRL = {"forward": "#c9371c", "backward": "#2166ac", "mixed": PALE, "none": INK}
"""Colours of modes. They and those of lines differ from each other, also for eyes that do not tell red from green."""
WHIRLS = {"forward": "whirls forward", "backward": "whirls backward", "mixed": "mixed whirl", "none": "axial or standing"}
CAUSES = {
    "unbalance": "#2aa7c9",
    "inner waviness": "#c98a00",
    "outer waviness": "#a0307a",
    "ball waviness": "#1b7a4b",
    "ball size": "#3b0a6e",
    "cage unbalance": "#5c3a1e",
    "varying compliance": "#3d42cc",
}
HEAVY, THIN = 2.2, 0.9  # points, of modes and of lines
SIZE = (9.6, 6.2)  # inches
LINES = 9  # drawn in a diagram, more where more meet a mode at the nominal speed
MARKED = 6  # coincidences along an axis of the runout, and the nearest
CURVES = 14  # drawn in the map
DASHES = ("-", "--", ":")  # of modes that share a colour


@rc_context(STYLE)
def figures(found: ResonanceMap) -> dict[str, Figure]:
    """By the names of their files; `nrro` only where something does not repeat, and what goes over
    temperature only where the map has several."""
    several = {"temperature": over_temperature(found), "coincidences": both(found)} if len(found.temperatures) > 1 else {}
    return {"campbell": campbell(found)} | several | ({} if found.repeats else {"nrro": runout(found)})


def drawn_lines(found: ResonanceMap) -> list[LineTrack]:
    """The unbalance, the lines that meet modes at the nominal speed and the one nearest to a mode
    there, and those of the strongest coincidences up to `LINES`; one bearing for each."""
    tracks = {key(t.line): t for t in found.lines}
    chosen: dict[tuple, LineTrack] = {}
    near = nearest(found.coincidences)
    always = [*strongest([c for c in found.coincidences if c.at_nominal_speed]), *([near] if near else [])]
    for c in [*always, *strongest(found.coincidences)]:
        if c.line.cause != "unbalance" and (c in always or len(chosen) < LINES):
            chosen.setdefault(_kind(c.line), tracks[key(c.line)])
    first = {(t.line.name, t.line.whirl): t for t in found.lines if t.line.cause == "unbalance"}  # static and couple unbalance are one line
    return [*first.values(), *chosen.values()]


def campbell(found: ResonanceMap, at: int | None = None, size: tuple[float, float] = SIZE) -> Figure:
    """Natural frequencies and the strongest lines over speed, at the nominal temperature or at that of index `at`; axes are the same
    at all temperatures."""
    figure = Figure(figsize=size)
    axes = figure.subplots()
    t0 = found.nominal_index[0] if at is None else at
    speed = found.speeds / RPM
    top = 1.12 * np.nanmax([m.frequency for m in found.modes])
    axes.set(xlim=(0, speed[-1]), ylim=(0, top))
    for mode in found.modes:
        _draw_mode(axes, speed, mode.frequency[t0], mode)
    leaving: list[tuple[float, str, str]] = []
    ends, names, paints = [], [], []
    for track in drawn_lines(found):
        values, paint = track.frequency[t0], CAUSES[track.line.cause]
        axes.plot(speed, values, color=paint, lw=THIN, ls="--" if track.line.whirl < 0 else "-")
        if values[-1] > top:
            leaving.append((float(np.interp(top, values, speed)), _named(track.line), paint))
        else:
            ends.append(float(values[-1]))
            names.append(_named(track.line))
            paints.append(paint)
    ends += [float(m.frequency[t0, -1]) for m in found.modes]
    names += [f"mode {m.number} {m.kind}" for m in found.modes]
    paints += [WHIRL[m.whirl] for m in found.modes]
    name_ends(axes, np.array(ends), names, paints)
    _name_tops(axes, leaving)
    tracks = {key(t.line) for t in drawn_lines(found)}
    strength: dict[tuple, float] = {}
    for c in found.coincidences:
        if key(c.line) in tracks:
            pair = key(c.line), c.mode.number
            strength[pair] = max(c.strength, strength.get(pair, 0.0))
    marked = [
        (s / RPM, float(np.interp(s, found.speeds, curve.mode.frequency[t0])), strength[key(curve.line), curve.mode.number])
        for curve in found.curves
        if (key(curve.line), curve.mode.number) in strength
        for s in curve.speed[curve.temperature == found.temperatures[t0]]
    ]
    _mark(axes, marked)
    axes.axvline(found.nominal.speed / RPM, color=PALE, lw=1.0, ls=":")
    axes.set(xlabel="speed, rpm", ylabel="frequency, Hz")
    figure.suptitle(f"Campbell diagram at {found.temperatures[t0]:.4g} °C", x=0.01, ha="left", fontweight="bold", fontsize=9.5)
    handles = [*_key(found, drawn_lines(found), [s for *_, s in marked]), _at_nominal(f"nominal speed, {found.nominal.speed / RPM:g} rpm")]
    figure.legend(handles=handles, loc="outside lower center", ncols=int(size[0] / 2.3), fontsize=7.5)
    return figure


def over_temperature(found: ResonanceMap, size: tuple[float, float] = SIZE, bare: bool = False) -> Figure:
    """Natural frequencies and the strongest lines among them over temperature, at the nominal speed; `bare`
    without title and key. Where there are more names than room, those of what meets there come first."""
    figure = Figure(figsize=size)
    axes = figure.subplots()
    _, s0 = found.nominal_index
    values = np.array([m.frequency[:, s0] for m in found.modes])
    low, high = 0.93 * np.nanmin(values), 1.05 * np.nanmax(values)
    axes.set(xlim=(found.temperatures[0], found.temperatures[-1]), ylim=(low, high))
    crossing = strongest([c for c in found.coincidences if c.at_nominal_speed])
    shown = _among(found, crossing, low, high)
    crossing = [c for c in crossing if key(c.line) in {key(t.line) for t in shown}]
    for mode in found.modes:
        _draw_mode(axes, found.temperatures, mode.frequency[:, s0], mode)
    for t in shown:
        axes.plot(found.temperatures, t.frequency[:, s0], color=CAUSES[t.line.cause], lw=THIN, ls="--" if t.line.whirl < 0 else "-")
    named = [(float(m.frequency[-1, s0]), f"mode {m.number} {m.kind}", WHIRL[m.whirl], any(c.mode.number == m.number for c in crossing)) for m in found.modes]
    named += [(float(t.frequency[-1, s0]), f"{_named(t.line)} {t.line.bearing}", CAUSES[t.line.cause], any(key(c.line) == key(t.line) for c in crossing)) for t in shown]
    ends, names, paints, _ = zip(*sorted(named, key=lambda row: not row[-1]), strict=True)  # what meets first: the names that there is room for
    name_ends(axes, np.array(ends), names, paints)
    _mark(axes, [(c.condition.temperature, c.frequency, c.strength) for c in crossing])
    axes.set(xlabel="temperature, °C", ylabel="frequency, Hz")
    if not bare:
        title = f"Natural frequencies and the strongest lines among them at {found.nominal.speed / RPM:.0f} rpm"
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold", fontsize=9.5)
        figure.legend(handles=_key(found, shown, [c.strength for c in crossing]), loc="outside lower center", ncols=int(size[0] / 2.3), fontsize=7.5)
    return figure


def _among(found: ResonanceMap, crossing: Sequence[Coincidence], low: float, high: float) -> list[LineTrack]:
    """At most `LINES` lines to draw over temperature: those that meet a mode at the nominal speed,
    then the largest between `low` and `high` (Hz), one bearing for each."""
    tracks, (_, s0) = {key(t.line): t for t in found.lines}, found.nominal_index
    chosen = {key(c.line): tracks[key(c.line)] for c in crossing}
    kinds = {_kind(t.line) for t in chosen.values()}
    for t in sorted(found.lines, key=lambda t: -t.amplitude):
        if _kind(t.line) not in kinds and np.nanmin(t.frequency[:, s0]) > low and np.nanmax(t.frequency[:, s0]) < high:
            kinds.add(_kind(t.line))
            chosen[key(t.line)] = t
    return list(chosen.values())[:LINES]


def both(found: ResonanceMap, size: tuple[float, float] = SIZE, bare: bool = False) -> Figure:
    """Where the strongest lines meet a mode, as curves over speed and temperature, over the speeds
    where they do; `bare` without title and key."""
    figure = Figure(figsize=size)
    axes = figure.subplots()
    axes.set_ylim(found.temperatures[0], found.temperatures[-1])
    named: list[tuple[float, str, str]] = []
    chosen = strongest([c for c in found.coincidences if c.at_nominal_speed])
    chosen += [c for c in strongest(found.coincidences) if all(_pair(c) != _pair(k) for k in chosen)]
    used = sorted({c.mode.number for c in chosen[:CURVES]})
    paints = {number: MODES[i % len(MODES)] for i, number in enumerate(used)}
    dashes = {number: DASHES[i // len(MODES) % len(DASHES)] for i, number in enumerate(used)}  # of modes of one colour
    curves = [next(k for k in found.curves if key(k.line) == key(c.line) and k.mode.number == c.mode.number) for c in chosen[:CURVES]]
    axes.set_xlim(*_around([found.nominal.speed, *(s for k in curves for s in k.speed)], found.speeds))
    for c, curve in zip(chosen, curves, strict=False):
        order = np.argsort(curve.temperature)
        paint = paints[c.mode.number]
        axes.plot(curve.speed[order] / RPM, curve.temperature[order], color=paint, ls=dashes[c.mode.number], lw=1.2)
        if curve.temperature.max() > found.temperatures[-1] - 1e-9:
            named.append((float(curve.speed[order][-1] / RPM), f"{c.line.name}, {c.mode.number}", paint))
        else:
            end = (curve.speed[order][-1] / RPM, curve.temperature[order][-1])
            axes.annotate(f"{c.line.name}, {c.mode.number}", end, (4, 2), textcoords="offset points", fontsize=7.5, color=paint)
    _name_tops(axes, named)
    if not curves:
        axes.text(0.5, 0.5, "no line meets a mode here", transform=axes.transAxes, ha="center", va="center", color=PALE)
    meeting = [(c.condition.speed / RPM, c.condition.temperature, c.strength) for c in chosen[:CURVES] if c.at_nominal_speed]
    _mark(axes, meeting)
    axes.axvline(found.nominal.speed / RPM, color=PALE, lw=1.0, ls=":")
    axes.axhline(found.nominal.temperature, color=PALE, lw=1.0, ls=":")
    axes.plot(found.nominal.speed / RPM, found.nominal.temperature, "s", color=INK, ms=5, clip_on=False)
    axes.set(xlabel="speed, rpm", ylabel="temperature, °C")
    if not bare:
        figure.suptitle("Where the strongest lines meet a mode (line, mode number)", x=0.01, ha="left", fontweight="bold", fontsize=9.5)
        handles = [Line2D([], [], color=paints[m.number], ls=dashes[m.number], label=f"mode {m.number} {m.kind}") for m in found.modes if m.number in paints]
        handles += [Line2D([], [], color=INK, marker="s", ls="", ms=5, label="nominal condition"), _at_nominal("nominal speed and temperature"), *_circle([s for *_, s in meeting])]
        figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=7.5)
    return figure


def runout(found: ResonanceMap) -> Figure:
    """Nonrepeatable runout of the linear response along temperature and along speed, with the strongest coincidences passed
    on the way and the one nearest to the nominal condition; not at rest, where there is none, for it does not grow from 0."""
    t_nominal, n_nominal = found.nominal.temperature, found.nominal.speed / RPM
    at_speed = [c for c in found.coincidences if c.at_nominal_speed]
    at_temperature = [c for c in found.coincidences if abs(c.condition.temperature - t_nominal) < ALIKE]
    panels = (
        (found.nrro_temperature, 1.0, at_speed, lambda c: c.condition.temperature, f"temperature at {n_nominal:.0f} rpm, °C"),
        (found.nrro_speed[found.nrro_speed[:, 0] > 0], 1 / RPM, at_temperature, lambda c: c.condition.speed / RPM, f"speed at {t_nominal:g} °C, rpm"),
    )
    names, paints = ("radial", "axial"), ("#7a3d8f", "#a0741a")
    shown = [panel for panel in panels if len(panel[0]) > 1]
    figure, ringed = Figure(figsize=(9.6, 4.6)), False
    for axes, (along, unit, crossed, place, label) in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        x, values = unit * along[:, 0], along[:, 1:]
        for series, name, paint in zip(values.T, names, paints, strict=True):
            axes.plot(x, 1e9 * series, color=paint, marker=".", ms=3, lw=1.0, label=f"{name}, dots: computed")
        every = [c for c in strongest(crossed) if not c.repeats]
        marked = [*every[:MARKED], *(c for c in every[MARKED:] if c is nearest(found.coincidences))]
        for c in marked:
            axes.axvline(place(c), color=PALE, lw=0.8, ls=":")
            axes.plot(place(c), 1e9 * c.nrro, "o", mfc="none", mec=paints[names.index(c.line.direction)], ms=8, mew=1.2, clip_on=False)
        axes.set(xlabel=label, ylabel=f"nonrepeatable runout (NRRO) of the {looked_at(found.spindle)}, nm rms", xlim=(x[0], x[-1]))
        axes.set_ylim(0, 1.25e9 * max(values.max(), *(c.nrro for c in marked), 0.0) or 1.0)
        _name_tops(axes, [(place(c), f"{c.line.name}, {c.mode.number}", PALE) for c in marked])
        ringed = ringed or bool(marked)
    figure.legend(handles=[*axes.get_legend_handles_labels()[0], *[_ring("coincidence (line, mode number)")] * ringed], loc="outside lower center", ncols=3)
    return figure


def _named(line: Line) -> str:
    """A line's name, with the order of a race wave."""
    return f"{line.name} ({line.order})" if line.cause in ("inner waviness", "outer waviness") else line.name


def _kind(line: Line) -> tuple[object, ...]:
    """What lines of several bearings have in common."""
    return key(line)[1:]


def _pair(c: Coincidence) -> tuple[tuple[object, ...], int]:
    return _kind(c.line), c.mode.number


def _around(speeds: Sequence[float], every: np.ndarray) -> tuple[float, float]:
    """Ends (rpm) of an axis that holds some `speeds` (rad/s), with a margin within `every` one of
    the map; of the whole map where these are one."""
    low, high = (min(speeds), max(speeds)) if min(speeds) < max(speeds) else (every[0], every[-1])
    margin = 0.06 * (high - low)
    return max(low - margin, every[0]) / RPM, min(high + margin, every[-1]) / RPM


def _draw_mode(axes: Axes, x: np.ndarray, values: np.ndarray, mode: Track) -> None:
    axes.plot(x, values, color=WHIRL[mode.whirl], lw=HEAVY)


def _mark(axes: Axes, marked: Sequence[tuple[float, float, float]]) -> None:
    """A ring at every coincidence (x, y, strength), larger for a stronger one."""
    if marked:
        x, y, strength = np.array(marked).T
        size = 14 + 90 * np.sqrt(strength / (strength.max() or 1.0))
        axes.scatter(x, y, s=size, facecolors="none", edgecolors=INK, lw=1.0, zorder=5, clip_on=False)


def _name_tops(axes: Axes, named: list[tuple[float, str, str]]) -> None:
    """Upright names above lines that leave through the top, moved apart along it."""
    if not named:
        return
    low, high = axes.get_xlim()
    figure = axes.figure
    assert isinstance(figure, Figure)
    spec = axes.get_subplotspec()
    columns = spec.get_geometry()[1] if spec else 1
    width = 0.75 * figure.get_size_inches()[0] / columns * 72
    wanted = np.array([(x - low) / (high - low) for x, _, _ in named])
    for start, place, (_, name, paint) in zip(wanted, spread(wanted, 1.35 * LETTERS / width), named, strict=True):
        axes.annotate(
            name,
            xy=(start, 1.0),
            xytext=(place, 1.03),
            xycoords="axes fraction",
            textcoords="axes fraction",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=LETTERS,
            color=INK if paint == PALE else paint,
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": paint, "lw": 0.5, "shrinkA": 0, "shrinkB": 0, "relpos": (0.5, 0.0)},
        )


def _key(found: ResonanceMap, lines: Sequence[LineTrack], strengths: Sequence[float]) -> list[Line2D]:
    """Modes by their whirl, lines by their cause, and the rings of coincidences so strong (m)."""
    handles = [
        Line2D([], [], color=WHIRL[w], lw=HEAVY, label=f"mode, {WHIRLS[w]}")
        for w in dict.fromkeys(m.whirl for m in found.modes)
    ]
    causes = dict.fromkeys(t.line.cause for t in lines)
    handles += [Line2D([], [], color=CAUSES[c], lw=THIN, label=c) for c in causes]
    if any(t.line.whirl < 0 for t in lines):
        handles.append(Line2D([], [], color=INK, lw=THIN, ls="--", label="line that whirls backward"))
    return [*handles, *_circle(strengths)]


def _circle(strengths: Sequence[float]) -> list[Line2D]:
    """Key to rings at coincidences so strong (m): their size, by the strongest; nothing where there are none."""
    if not strengths:
        return []
    most = 1e9 * max(strengths)
    return [_ring(f"coincidence, larger if stronger: at most {most:.{0 if most >= 10 else 2}f} nm" if most else "coincidence")]


def _ring(name: str) -> Line2D:
    return Line2D([], [], color=INK, marker="o", mfc="none", ls="", label=name)


def _at_nominal(name: str) -> Line2D:
    return Line2D([], [], color=PALE, lw=1.0, ls=":", label=name)
