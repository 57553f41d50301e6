"""Pictures of a run as plain arrays: colours, moving bodies, the deformed section, small charts. Lengths are millimetres.

Nothing here knows Rerun.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from model.ball_row import Array
from model.look import RegionMesh, plate_meshes, region_meshes
from model.machine import MOVES, Spindle
from model.modes import ComplexArray, Mode, frf, point_rows
from sim.operating import OperatingPoint
from thermal.expansion import DeformedSection

Colours = NDArray[np.uint8]
MM = 1e3
SEEN = 0.16  # largest displacement of an animated mode, of the section's largest radius
CYCLE = 20  # frames of one cycle of an animation
HEAT = np.array([(70, 120, 255), (60, 200, 255), (235, 235, 120), (255, 160, 50), (255, 60, 60)], float)  # cold to hot


def reach(spindle: Spindle) -> float:
    """Largest radius of the section (m)."""
    return max(g.r[1] for g in spindle.regions)


def heat(temperature: float, temperatures: Sequence[float]) -> Colours:
    """Colour (3,) of a temperature, from blue for the lowest to red for the highest."""
    low, high = min(temperatures), max(temperatures)
    place = (temperature - low) / (high - low) if high > low else 0.0
    return np.array([np.interp(place, np.linspace(0, 1, len(HEAT)), channel) for channel in HEAT.T]).astype(np.uint8)


# ---------------------------------------------------------------- moving bodies


def body_meshes(spindle: Spindle) -> dict[str, list[RegionMesh]]:
    """The cut-away meshes by the body they move with."""
    meshes = [*region_meshes(spindle), *plate_meshes(spindle)]
    return {b.name: own for b in spindle.structure.bodies if (own := [m for m in meshes if m.body == b.name])}


def largest_displacement(point: OperatingPoint, shapes: ComplexArray) -> Array:
    """Largest displacement (k,) of any drawn vertex under motions `shapes` (n, k) of the chain."""
    largest = np.zeros(shapes.shape[1])
    for name, meshes in body_meshes(point.spindle).items():
        arm = np.concatenate([m.vertices for m in meshes]) - [0.0, 0.0, point.chain.body(name).z]
        rows = {move: i for i, (body, move) in enumerate(point.linear.dofs) if body == name}
        u = np.array([shapes[rows[m]] if m in rows else 0 * shapes[0] for m in MOVES])  # (5, k)
        x, y, z = (a[:, None] for a in arm.T)
        moved = np.stack([u[0] + u[4] * z, u[1] - u[3] * z, u[2] + u[3] * y - u[4] * x])
        largest = np.maximum(largest, np.sqrt((np.abs(moved) ** 2).sum(axis=0)).max(axis=0))
    return largest


def mode_motion(point: OperatingPoint, mode: Mode, frames: int) -> ComplexArray:
    """Motion (n, frames) of a mode shape turning through one cycle every `CYCLE` frames, scaled to be seen."""
    shape = mode.shape[:, None]
    return _visible(point) / largest_displacement(point, shape) * shape * _turning(frames)


def sweep_motion(point: OperatingPoint, node: int, frequency: Array) -> ComplexArray:
    """Motion (n, frames) under a force at `node` that sweeps `frequency` (frames,) Hz.

    Its size is drawn as the square root, so that the motion between resonances can be seen.
    """
    row = point_rows(point.spindle, point.chain, (node,))
    response = frf(point.linear, np.eye(len(point.linear.mass)), row, frequency, "mobility")[:, 0]
    size = largest_displacement(point, response)
    return response * _visible(point) / np.sqrt(size * size.max()) * _turning(len(frequency))


def _visible(point: OperatingPoint) -> float:
    return SEEN * reach(point.spindle)


def _turning(frames: int) -> ComplexArray:
    return np.exp(2j * np.pi * np.arange(frames) / CYCLE)


def poses(point: OperatingPoint, motion: ComplexArray) -> dict[str, tuple[Array, Array]]:
    """How every body moves from rest when the MuJoCo model takes the real part of `motion` (n, frames).

    Translations (frames, 3) mm and quaternions (frames, 4) x, y, z, w, for points in world coordinates at rest.
    """
    model = point.model
    data = mujoco.MjData(model)
    address = [model.joint(f"{body}.{move}").qposadr[0] for body, move in point.linear.dofs]
    mujoco.mj_kinematics(model, data)
    rest = data.xpos.copy()
    translations, turns = [], []
    for frame in motion.real.T:
        data.qpos[address] = frame
        mujoco.mj_kinematics(model, data)
        turned = np.einsum("bij,bj->bi", data.xmat.reshape(-1, 3, 3), rest)
        translations.append(MM * (data.xpos - turned))
        turns.append(np.roll(data.xquat, -1, axis=1))
    translation, turn = np.array(translations), np.array(turns)
    return {b.name: (translation[:, i], turn[:, i]) for b in point.chain.bodies for i in [model.body(b.name).id]}


# ---------------------------------------------------------------- the deformed section


def exaggeration(sections: Sequence[dict[str, DeformedSection]], radius: float) -> float:
    """A round factor that makes the largest displacement of all at most a tenth of `radius` (m)."""
    largest = max(float(np.abs(part.displacement).max()) for section in sections for part in section.values())
    if largest == 0:
        return 1.0
    wanted = 0.1 * radius / largest
    step = 10.0 ** np.floor(np.log10(wanted))
    return float(max((s for s in (1, 2, 5) if s * step <= wanted), default=1) * step)


def section_mesh(
    spindle: Spindle, part: DeformedSection, shift: float, factor: float, colour: Colours
) -> tuple[Array, NDArray[np.int64], Colours]:
    """Vertices (v, 3) mm in the plane y = 0, triangles (t, 3), colours (v, 3): materials as shades of `colour`.

    `shift` (m) is the rigid axial movement of the part, displaced by `factor` times like the rest.
    """
    materials = sorted({g.material for g in spindle.regions})
    nodes = part.nodes + factor * (part.displacement + np.array([0.0, shift]))
    corners, triangles = np.unique(part.region_of[:, None] * len(nodes) + part.triangles, return_inverse=True)
    r, z = MM * nodes[corners % len(nodes)].T
    shade = np.array([0.95 - 0.55 * materials.index(spindle.region(name).material) / len(materials) for name in part.regions])
    return (
        np.stack([r, np.zeros_like(r), z], axis=1),
        triangles.reshape(-1, 3),
        (shade[corners // len(nodes)][:, None] * colour).astype(np.uint8),
    )


def outlines(spindle: Spindle) -> list[Array]:
    """Closed polygons (k, 3) mm of the undeformed regions and balls, right half."""
    drawn = []
    for g in spindle.regions:
        (r0, r1), (z0, z1) = g.r, g.z
        drawn.append(MM * np.array([(r, -2e-4, z) for r, z in ((r0, z0), (r1, z0), (r1, z1), (r0, z1), (r0, z0))]))
    turn = np.linspace(0, 2 * np.pi, 33)
    for b in spindle.bearings:
        circle = b.ball_diameter / 2 * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
        drawn.append(MM * (circle + np.array([b.pitch_diameter / 2, -2e-4, b.z])))
    return drawn


# ---------------------------------------------------------------- charts


@dataclass
class Drawing:
    """Line strips and labels of a chart; y points down, one unit is about one pixel."""

    strips: list[Array] = field(default_factory=list)
    strip_colours: list[Colours] = field(default_factory=list)
    points: list[tuple[float, float]] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    label_colours: list[Colours] = field(default_factory=list)

    def label(self, x: float, y: float, text: str, colour: Sequence[int] | Colours = (200, 200, 200)) -> None:
        """Text centred at (x, y)."""
        self.points.append((x, y - 13.0))
        self.labels.append(text)
        self.label_colours.append(np.array(colour, np.uint8))

    def line(self, strip: Array, colour: Sequence[int] | Colours) -> None:
        """A line through the points (n, 2)."""
        self.strips.append(strip)
        self.strip_colours.append(np.array(colour, np.uint8))


@dataclass(frozen=True, eq=False)
class Curve:
    x: Array  # (n,)
    y: Array  # (n,)
    colour: Colours


def charts(panels: Sequence[tuple[str, str, Sequence[Curve]]], columns: int, width: float, height: float) -> Drawing:
    """Small charts in rows of `columns`, each of `width` and `height`: title, unit of x, curves.

    Axes end at round numbers, the only ones written.
    """
    drawing = Drawing()
    for k, (title, unit, curves) in enumerate(panels):
        left, top = (k % columns) * width, (k // columns) * height
        box = (left + 42.0, top + 25.0, left + width - 12.0, top + height - 24.0)
        x, y = (round_ticks(np.concatenate([getattr(c, axis) for c in curves])) for axis in ("x", "y"))
        drawing.label((box[0] + box[2]) / 2, top + 12.0, title, (255, 255, 255))
        for tick in y:
            level = _place(tick, y, box[3], box[1])
            drawing.line(np.array([(box[0], level), (box[2], level)]), (60, 60, 66))
        for tick in x:
            place = _place(tick, x, box[0], box[2])
            drawing.line(np.array([(place, box[1]), (place, box[3])]), (60, 60, 66))
        drawing.label(left + 20.0, box[3] - 5.0, f"{y[0]:g}")
        drawing.label(left + 20.0, box[1] + 5.0, f"{y[-1]:g}")
        drawing.label(box[0], box[3] + 12.0, f"{x[0]:g}")
        drawing.label(box[2] - 12.0, box[3] + 12.0, f"{x[-1]:g} {unit}")
        for c in curves:
            strip = np.stack([_place(c.x, x, box[0], box[2]), _place(c.y, y, box[3], box[1])], axis=1)
            drawing.line(strip if len(strip) > 1 else strip + np.array([(-3.0, 0.0), (3.0, 0.0)]), c.colour)
    return drawing


def key(words: Sequence[tuple[str, Sequence[int] | Colours]], peaks: Sequence[float], width: float) -> Drawing:
    """A row of coloured words, and below it the numbers of `peaks`, from 1, at their places (0 to 1) in a plot of `width`."""
    drawing, left = Drawing(), 8.0
    for text, colour in words:
        half = 3.7 * len(text)
        drawing.label(left + half, 15.0, text, colour)
        left += 2 * half + 15
    gutter, apart = 34.0, 24.0
    groups: list[tuple[float, str]] = []
    for i, peak in enumerate(peaks, 1):
        x = gutter + peak * (width - gutter)
        if groups and x - groups[-1][0] < apart:
            groups[-1] = ((groups[-1][0] + x) / 2, f"{groups[-1][1]} {i}")
        else:
            groups.append((x, f"mode {i}" if i == 1 else f"{i}"))
    for x, numbers in groups:
        drawing.label(x, 45.0, numbers)
    return drawing


def _place(value: Array | float, ticks: Array, start: float, end: float) -> Array:
    return start + (np.asarray(value) - ticks[0]) / (ticks[-1] - ticks[0]) * (end - start)


def round_ticks(values: Array) -> Array:
    """Two to four round numbers that span `values`."""
    low, high = float(values.min()), float(values.max())
    if high - low < 1e-3 * max(abs(high), abs(low)) or high == low:
        around = 0.05 * max(abs(high), abs(low)) or 1.0
        low, high = low - around, high + around
    span = high - low
    for step in _round_steps(span / 3):
        first, last = np.floor(low / step + 1e-9), np.ceil(high / step - 1e-9)
        last = max(last, first + 1)
        if last - first <= 3:
            return np.round(np.arange(first, last + 1) * step, 12)
    raise AssertionError("steps of ever larger size end the search")


def _round_steps(least: float) -> Iterator[float]:
    start = 10.0 ** np.floor(np.log10(least) - 1)
    while True:
        yield from (s * start for s in (1.0, 2.0, 5.0))
        start *= 10.0
