"""The picture of a scene: the half section with bearings and their load lines above the axis, what moves as a chain below it.

The axis lies across the picture, z to the right. Above: regions of the section (or the shafts' outlines where there
is none), turning bodies that are in neither as cylinders of their mass and inertia, balls and load lines, springs of
bearings given by numbers, measuring points. Below: beams with their nodes, centres of mass of rigid bodies, joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon, Rectangle

from thermospindle.model.machine import Bearing, LinearBearing, RollerBearing, Spindle
from thermospindle.model.shaft import Shaft
from thermospindle.model.structure import Body
from thermospindle.model.units import MM
from thermospindle.report.check.understood import apex
from thermospindle.report.figures.common import INK, PALE, STYLE
from thermospindle.sim.operating import OperatingPoint

TURNING, STANDING, LOAD, HIT, JOINT = "#cfdcea", "#dcdad5", "#a0741a", "#c9371c", "#2e7d6b"
WIDTH, TALLEST = 10.3, 5.2  # inches, of the picture and of the machine in it
TURNED = "#4f77a8"
LEAST = 0.12  # inches, of the box of a body without inertia
LETTER = 0.062  # inches, of a small letter's width


@dataclass(frozen=True)
class Frame:
    """What the picture spans, mm: along the axis, and across it above and below."""

    low: float
    high: float
    top: float
    bottom: float

    @property
    def per_inch(self) -> float:
        """mm of the machine to an inch of the picture."""
        return max((self.high - self.low) / (WIDTH - 0.9), (self.top + self.bottom) / TALLEST)

    @property
    def across(self) -> tuple[float, float]:
        """What the picture shows along the axis, mm: more than the machine where that is taller than long."""
        middle, half = (self.low + self.high) / 2, self.per_inch * (WIDTH - 0.9) / 2
        return middle - half, middle + half


@rc_context(STYLE)
def drawing(point: OperatingPoint) -> Figure:
    """The picture at an operating point, whose contact angles are those of the load lines."""
    spindle = point.spindle
    frame = _frame(spindle)
    labels = _labels(spindle, frame)
    above, below = (1 + max((level for *_, level in group), default=-1) for group in labels)
    step = 0.19 * frame.per_inch
    ceiling, floor = frame.top + step * (above + 1.9), -frame.bottom - step * (below + 1.2)
    inner, height = WIDTH - 0.9, (ceiling - floor) / frame.per_inch
    figure = Figure(figsize=(WIDTH, height + 1.1))
    figure.set_layout_engine("none")  # the axes' place is known to the millimetre
    axes = figure.add_axes((0.45 / WIDTH, 0.5 / (height + 1.1), inner / WIDTH, height / (height + 1.1)))
    _bodies(axes, spindle, frame)
    for b in spindle.all_bearings:
        if isinstance(b, Bearing):
            _row(axes, b, point.state.bearing(b.name).contact_angle, frame)
        elif isinstance(b, RollerBearing):
            _rollers(axes, b)
        else:
            _spring(axes, b, spindle, frame)
    _beams(axes, spindle, frame)
    _centres_and_joints(axes, spindle, frame)
    _points(axes, spindle, frame)
    for group, edge, sign in ((labels[0], frame.top + 0.7 * step, 1), (labels[1], -frame.bottom, -1)):
        rows = [edge + sign * step * (level + 0.9) for *_, level in group]
        words = [(place, at, _half(text, frame)) for (text, *_, place, _), at in zip(group, rows, strict=True)]
        for (text, z, r, colour, place, _), at in zip(group, rows, strict=True):
            axes.plot(*_leader((z, r), (place, at), words, 0.42 * step), color=colour, lw=0.5, alpha=0.7)
            axes.text(place, at, text, ha="center", va="center", fontsize=8, color=colour)
    axes.axhline(0, color=INK, lw=0.7, ls=(0, (9, 3, 2, 3)))
    axes.set(xlim=frame.across, ylim=(floor, ceiling), xlabel="z, mm", yticks=[])
    axes.spines["left"].set_visible(False)
    axes.grid(False)
    figure.legend(handles=_legend(spindle), loc="upper center", ncols=5, handlelength=1.4, columnspacing=1.3)
    return figure


def _frame(spindle: Spindle) -> Frame:
    ends = [z for s in spindle.structure.shafts for z in (s.nodes[0], s.nodes[-1])] + [z for g in spindle.regions for z in g.z]
    ends += [b.z for b in spindle.structure.bodies] + [p.position[2] for p in spindle.points] + [b.z for b in spindle.all_bearings]
    radii = [r for s in spindle.structure.shafts for g in s.segments for r in (*g.outer, *g.mass_outer)] + [g.r[1] for g in spindle.regions]
    radii += [float(np.hypot(*p.position[:2])) for p in spindle.points]
    for b in _undrawn(spindle):
        radius, length = cylinder(b)
        ends += [b.z - length / 2, b.z + length / 2]
        radii.append(radius)
    shafts = [r for s in spindle.structure.shafts for g in s.segments for r in (*g.outer, *g.mass_outer)]
    low, high, top = min(ends) / MM, max(ends) / MM, max([*radii, 0.02 * (max(ends) - min(ends))]) / MM
    room = 0.03 * (high - low)
    lifted = max(1.35 * top, top + 0.5 * (high - low) / (WIDTH - 0.9)) if spindle.linear_bearings else top
    below = 1.15 * max(shafts) / MM if shafts else 0.0
    frame = Frame(low - room, high + room, lifted, below)
    return replace(frame, bottom=max(below, 0.5 * frame.per_inch))


# ---------------------------------------------------------------- above the axis


def _bodies(axes: Axes, spindle: Spindle, frame: Frame) -> None:
    """The regions of the section, the outlines of shafts that are not in it, and turning bodies
    that are in neither as the solid cylinders of their mass and inertia."""
    for b in _undrawn(spindle):
        (radius, length), least = cylinder(b), LEAST * frame.per_inch
        wide, high = max(length / MM, least), max(radius / MM, least)
        axes.add_patch(Rectangle((b.z / MM - wide / 2, 0), wide, high, fc="none", ec=TURNED, lw=1.1, ls=(0, (4, 2)), zorder=2))
    for g in spindle.regions:
        (r0, r1), (z0, z1) = (np.array(side) / MM for side in (g.r, g.z))
        axes.add_patch(Rectangle((z0, r0), z1 - z0, r1 - r0, fc=TURNING if g.part == "rotating" else STANDING, ec=INK, lw=0.5))
    for s in spindle.structure.shafts:
        middle = (s.nodes[0] + s.nodes[-1]) / 2
        if not any(g.z[0] <= middle <= g.z[1] and (g.part == "rotating") == s.turns for g in spindle.regions):
            _outline(axes, s, 1)


def _undrawn(spindle: Spindle) -> list[Body]:
    """Turning rigid bodies, as a chuck or a motor's rotor, that neither section nor shafts show.
    What stands has its housing there, and seldom a polar inertia that is its own."""
    return [b for b in spindle.structure.rigid_bodies if b.turns and b.mass > 0 and not b.regions]


def cylinder(b: Body) -> tuple[float, float]:
    """Radius and length (m) of the solid cylinder of a body's mass and inertia: I_z = m r^2 / 2,
    I_x = m (3 r^2 + l^2) / 12; 0 for what it has no inertia for."""
    radius = np.sqrt(2 * b.inertia[2] / b.mass)
    return float(radius), float(np.sqrt(max(12 * min(b.inertia[:2]) / b.mass - 3 * radius**2, 0.0)))


def _outline(axes: Axes, s: Shaft, sign: int) -> None:
    colour = TURNING if s.turns else STANDING
    for g in s.segments:
        z, outer, bore, heavy = (np.array(v) / MM for v in (g.z, g.outer, g.bore, g.mass_outer))
        if np.any(heavy != outer):
            corners = [(z[0], sign * heavy[0]), (z[1], sign * heavy[1]), (z[1], sign * outer[1]), (z[0], sign * outer[0])]
            axes.add_patch(Polygon(corners, fc="none", ec=PALE, lw=0.6, hatch="////"))
        corners = [(z[0], sign * bore[0]), (z[0], sign * outer[0]), (z[1], sign * outer[1]), (z[1], sign * bore[1])]
        axes.add_patch(Polygon(corners, fc=colour, ec=INK, lw=0.5))


def _row(axes: Axes, b: Bearing, angle: float, frame: Frame) -> None:
    """A ball and its load line, from its outer race to where it meets the axis."""
    z, r, ball = b.z / MM, b.pitch_diameter / MM / 2, b.ball_diameter / MM / 2
    end = apex(b, angle) / MM
    out = ball * 1.6
    axes.plot([z - b.sense * out * np.sin(angle), end], [r + out * np.cos(angle), 0], color=LOAD, lw=0.9, ls=(0, (5, 2)), zorder=4)
    if frame.low < end < frame.high:
        axes.plot(end, 0, "o", color=LOAD, ms=3, zorder=5)
    axes.add_patch(Circle((z, r), ball, fc="#fdfdfb", ec=INK, lw=0.8, zorder=3))


def _rollers(axes: Axes, b: RollerBearing) -> None:
    """A rectangle a row, with its load line across the axis."""
    length, half = b.roller_length / MM, b.roller_diameter / MM / 2
    for offset in b.offsets:
        z, r = (b.z + offset) / MM, b.pitch_diameter / MM / 2
        axes.add_patch(Rectangle((z - length / 2, r - half), length, 2 * half, fc="#fdfdfb", ec=INK, lw=0.8, zorder=3))
        axes.plot([z, z], [r + 1.4 * half, 0], color=LOAD, lw=0.9, ls=(0, (5, 2)), zorder=4)


def _spring(axes: Axes, b: LinearBearing, spindle: Spindle, frame: Frame) -> None:
    """A spring from what is inside to a line that stands for what is outside."""
    z = b.z / MM
    start = max((max(g.outer) / MM for s in spindle.structure.shafts for g in s.segments if g.z[0] <= b.z <= g.z[1]), default=0.3 * frame.top)
    turns = np.linspace(start, frame.top * 0.97, 9)
    swing = 0.07 * frame.per_inch * np.array([0, 0, 1, -1, 1, -1, 1, 0, 0])
    axes.plot(z + swing, turns, color=LOAD, lw=1.1, zorder=4)
    half = 0.09 * frame.per_inch
    axes.plot([z - half, z + half], [frame.top * 0.97] * 2, color=INK, lw=1.4, zorder=4)
    for k in range(4):
        x = z - half + 2 * half * k / 3
        axes.plot([x, x + 0.03 * frame.per_inch], [frame.top * 0.97, frame.top * 0.97 + 0.06 * frame.per_inch], color=INK, lw=0.6, zorder=4)


def _points(axes: Axes, spindle: Spindle, frame: Frame) -> None:
    """An arrow a point, the way it looks: across the axis up or down, along it to the sides, a dotted ring for y, out of the picture."""
    length = 0.2 * frame.per_inch
    for p in spindle.points:
        z, r = p.position[2] / MM, float(np.hypot(*p.position[:2])) / MM
        colour = HIT if p.node in spindle.hammer.hammer_nodes else INK
        x, y, along = p.direction
        if y:
            axes.plot(z, r, "o", mfc="none", mec=colour, ms=6, mew=1.0, zorder=6)
            axes.plot(z, r, ".", color=colour, ms=3, zorder=6)
        else:
            tip = (z + length * along, r + length * x)
            axes.annotate("", tip, (z, r), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.1, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}, zorder=6)


# ---------------------------------------------------------------- below the axis


def _beams(axes: Axes, spindle: Spindle, frame: Frame) -> None:
    for s in spindle.structure.shafts:
        _outline(axes, s, -1)
        z = np.array(s.nodes) / MM
        axes.plot(z, np.zeros_like(z), "|", color=INK, ms=7, mew=0.8, zorder=5)


def _centres_and_joints(axes: Axes, spindle: Spindle, frame: Frame) -> None:
    for b in spindle.structure.rigid_bodies:
        z, size = b.z / MM, 0.075 * frame.per_inch
        axes.add_patch(Circle((z, -0.5 * frame.bottom), size, fc="white", ec=INK, lw=0.8, zorder=5))
        for quarter in (0, 180):  # as drawings mark a centre of mass
            arc = np.radians(np.linspace(quarter, quarter + 90, 12))
            corners = [(z, -0.5 * frame.bottom), *zip(z + size * np.cos(arc), -0.5 * frame.bottom + size * np.sin(arc), strict=True)]
            axes.add_patch(Polygon(corners, fc=INK, ec="none", zorder=6))
    for z in {j.z for j in spindle.structure.own_joints}:
        axes.plot(z / MM, -0.82 * frame.bottom, "D", mfc="white", mec=JOINT, ms=5, mew=1.3, zorder=6)


# ---------------------------------------------------------------- words


Label = tuple[str, float, float, str, float, int]
"""Text, what it points at (z, r in mm), colour, its own place along z, and how far out it stands."""


def _labels(spindle: Spindle, frame: Frame) -> tuple[list[Label], list[Label]]:
    """Names above (bearings, points) and below (shafts, bodies, joints), staggered so that none covers another."""
    structure = spindle.structure
    top = [(b.name, b.z / MM, frame.top if isinstance(b, LinearBearing) else b.pitch_diameter / MM / 2, LOAD) for b in spindle.all_bearings]
    top += [(f"{b.name}, {b.mass:.3g} kg", b.z / MM, max(cylinder(b)[0] / MM, LEAST * frame.per_inch), TURNED) for b in _undrawn(spindle)]
    at: dict[tuple[float, float], list[str]] = {}
    hit: dict[tuple[float, float], bool] = {}
    for p in spindle.points:
        where = round(p.position[2] / MM, 3), round(float(np.hypot(*p.position[:2])) / MM, 3)
        at.setdefault(where, []).append(p.name)
        hit[where] = hit.get(where, False) or p.node in spindle.hammer.hammer_nodes
    top += [(", ".join(names), z, r, HIT if hit[z, r] else INK) for (z, r), names in at.items()]
    low = []
    for s in structure.shafts:
        middle = (s.nodes[0] + s.nodes[-1]) / 2
        low.append((s.name, middle / MM, -min(max(*g.outer, *g.mass_outer) for g in s.segments if g.z[0] <= middle <= g.z[1]) / MM, INK))
    low += [(b.name, b.z / MM, -0.5 * frame.bottom, INK) for b in structure.rigid_bodies]
    low += [(f"{j.name} ({' - '.join(structure.carrier(n) for n in j.bodies)})", j.z / MM, -0.82 * frame.bottom, JOINT) for j in structure.own_joints]
    return _staggered(top, frame), _staggered(low, frame)


def _staggered(labels: Sequence[tuple[str, float, float, str]], frame: Frame) -> list[Label]:
    """Each label as near as no word covers another, nor, where that can be helped, another's line."""
    found: list[Label] = []
    taken: list[tuple[float, float, float, int]] = []  # span, line, level
    (first, last), apart = frame.across, 0.05 * frame.per_inch
    for text, z, r, colour in sorted(labels, key=lambda entry: entry[1]):
        half = _half(text, frame)
        place = min(max(z, first + half), last - half)
        low, high = place - half, place + half

        def crossings(level: int, low: float = low, high: float = high, place: float = place) -> int:
            through = [a - apart < place < b + apart if own < level else low - apart < line < high + apart for a, b, line, own in taken if own != level]
            return sum(through)

        levels = [k for k in range(len(labels) + 1) if all(own != k or high < a or b < low for a, b, _, own in taken)]
        level = min(levels, key=lambda k: (crossings(k), k))
        taken.append((low, high, place, level))
        found.append((text, z, r, colour, place, level))
    return found


def _half(text: str, frame: Frame) -> float:
    """Half the width of a label, mm of the machine."""
    return (LETTER * len(text) / 2 + 0.06) * frame.per_inch


def _leader(start: tuple[float, float], end: tuple[float, float], words: Sequence[tuple[float, float, float]], half: float) -> tuple[list[float], list[float]]:
    """The line from what a label names to the label, with gaps where it would run through `words`
    (place, height, half width), `half` their half height."""
    (z, r), (place, at) = start, end
    gaps = []
    for middle, height, wide in words:
        share = (height - r) / (at - r)
        if 0 < share <= 1 and abs(z + share * (place - z) - middle) < wide:
            gaps.append(((height - half - r) / (at - r), (height + half - r) / (at - r)))
    shares = [0.0]
    for low, high in sorted((min(g), max(g)) for g in gaps):
        shares += [low, float("nan"), high]
    shares += [] if shares[-1] >= 1 else [1.0]
    return [z + s * (place - z) for s in shares], [r + s * (at - r) for s in shares]


def _legend(spindle: Spindle) -> list[Line2D | Patch]:
    """What is in the picture, and nothing else."""
    structure = spindle.structure
    handles: list[Line2D | Patch] = [Patch(fc=TURNING, ec=INK, lw=0.5, label="turns")]
    if any(g.part != "rotating" for g in spindle.regions) or any(not s.turns for s in structure.shafts):
        handles.append(Patch(fc=STANDING, ec=INK, lw=0.5, label="stands"))
    if any(g.mass_outer != g.outer for s in structure.shafts for g in s.segments):
        handles.append(Patch(fc="none", ec=PALE, lw=0.6, hatch="////", label="mass that stiffens nothing"))
    if _undrawn(spindle):
        handles.append(Patch(fc="none", ec=TURNED, lw=1.1, ls=(0, (4, 2)), label="cylinder of a body's mass and inertia"))
    if spindle.bearings or spindle.roller_bearings:
        handles.append(Line2D([], [], color=LOAD, lw=0.9, ls=(0, (5, 2)), label="load line"))
    if spindle.linear_bearings:
        handles.append(Line2D([], [], color=LOAD, lw=1.1, label="bearing by numbers"))
    handles.append(Line2D([], [], color=INK, marker="$\u2191$", ls="none", ms=6, label="measured"))
    handles.append(Line2D([], [], color=HIT, marker="$\u2191$", ls="none", ms=6, label="measured and hit"))
    if any(p.direction[1] for p in spindle.points):
        handles.append(Line2D([], [], color=INK, marker="o", mfc="none", ls="none", ms=6, label="along y"))
    if spindle.structure.shafts:
        handles.append(Line2D([], [], color=INK, marker="|", ls="none", ms=7, label="beam node"))
    if structure.rigid_bodies:
        handles.append(Line2D([], [], color=INK, marker="o", ls="none", ms=6, label="centre of mass"))
    if structure.own_joints:
        handles.append(Line2D([], [], color=JOINT, marker="D", mfc="white", ls="none", ms=5, label="joint"))
    return handles
