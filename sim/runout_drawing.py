"""Pictures of runout as plain arrays for a log: how the turning model moves, the waterfall, and the polar plot.

Nothing here knows Rerun. Charts have y pointing down, one unit about one pixel; bodies are in millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.ball_row import Array
from model.kinematics import row_kinematics
from sim.log_drawing import Colours, Drawing, heat, largest_displacement, poses, reach
from sim.revolutions import once_per_revolution
from sim.runout import Runout
from sim.waterfall import LineSpectrum, on_grid

FRAMES = 16  # of the moving model, a revolution
MOVED = 0.04  # largest displacement of the drawn model, of the section's largest radius
SEGMENTS = 8  # of a revolution: pieces in which the orbit grows
RANGE = 50.0  # dB below the strongest line that the waterfall shows
BAND, MEAN, GREY, LIGHT = np.array([(90, 200, 255), (255, 120, 90), (70, 70, 78), (220, 220, 220)], np.uint8)


def frame_indices(runout: Runout) -> Array:
    """Samples (frames,) at which the model is drawn."""
    time = runout.signals.time
    wanted = np.arange(0.0, time[-1], 1 / (FRAMES * abs(runout.turning)))
    return np.round((wanted - time[0]) / (time[1] - time[0])).astype(int)


def turning_poses(runout: Runout, share: float = MOVED) -> tuple[dict[str, tuple[Array, Array]], float]:
    """Translations (frames, 3) mm and quaternions (frames, 4) x, y, z, w of every body, turning ones with their spin, and by what factor
    displacements are enlarged, so that the largest is about `share` of the section's radius."""
    point, frames = runout.point, frame_indices(runout)
    motion = runout.signals.motion[frames].T
    largest = float(largest_displacement(point, motion.astype(complex)).max())
    factor = _round_down(share * reach(point.spindle) / largest) if largest > 0 else 1.0
    moved = poses(point, (factor * motion).astype(complex))
    spin = quaternions(runout.signals.angle[frames])
    for body in point.chain.bodies:
        if body.turns:
            translation, turn = moved[body.name]
            moved[body.name] = translation, product(turn, spin)
    return moved, factor


def cage_turns(runout: Runout) -> dict[str, Array]:
    """Quaternions (frames, 4) of every ball set about the axis."""
    time = runout.signals.time[frame_indices(runout)]
    return {name: quaternions(kin.cage * time) for name, kin in row_kinematics(runout.point.spindle, runout.point.state).items()}


def quaternions(angle: Array) -> Array:
    """Turns (n, 4) x, y, z, w about the z axis by `angle` (n,) rad."""
    return np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)


def product(a: Array, b: Array) -> Array:
    """Quaternions (n, 4) x, y, z, w that turn by `b` first, then by `a`."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a.T, b.T
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=1,
    )


def _round_down(value: float) -> float:
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(m for m in (1, 2, 5) if m * power <= value * (1 + 1e-12)))


# ---------------------------------------------------------------- orbit and polar plot


def orbit_pieces(x: Array, y: Array, samples: int) -> tuple[list[Array], Array]:
    """Strips (k, 2) nm of an orbit (n,) m, y pointing down, that begin where the one before ends, and the sample at which each ends."""
    ends = np.unique(np.append(np.arange(max(samples // SEGMENTS, 1), len(x), max(samples // SEGMENTS, 1)), len(x) - 1))
    track = 1e9 * np.stack([x, -y], axis=1)
    starts = np.concatenate([[0], ends[:-1]])
    return [track[a : b + 1] for a, b in zip(starts, ends, strict=True)], ends


def polar(runout: Runout, probe: int, radius: float) -> Drawing:
    """Error motion of a radial probe about its least-squares circle, drawn at 0.62 `radius` from the middle of a square of twice that."""
    cut = runout.by_lines
    once = once_per_revolution(cut.angle, cut.repeatable[probe])
    base = cut.repeatable[probe].mean() + (once * np.exp(1j * cut.angle)).real
    mean, every = 1e9 * (cut.repeatable[probe] - base), 1e9 * (cut.value[probe] - base)
    largest = float(np.abs(every).max()) or 1.0
    scale, circle = 0.34 * radius / largest, 0.62 * radius
    drawing = Drawing()

    def around(values: Array, colour: Colours) -> None:
        angle = np.append(cut.angle, cut.angle[0] + 2 * np.pi)
        r = circle + scale * np.append(values, values[0])
        drawing.strips.append(np.stack([radius + r * np.cos(angle), radius - r * np.sin(angle)], axis=1))
        drawing.strip_colours.append(colour)

    for values in every[:: max(1, len(every) // 12)]:
        around(values, GREY)
    around(every.max(axis=0), BAND)
    around(every.min(axis=0), BAND)
    around(mean, MEAN)
    told = runout.values()[runout.signals.probes[probe].name]
    for k, (name, value) in enumerate(
        (("total", told.total_error), ("synchronous", told.synchronous_error), ("asynchronous", told.asynchronous_error))
    ):
        drawing.label(radius, radius - 2 + 17 * k, f"{name} {1e9 * value:.1f} nm", LIGHT)
    return drawing


# ---------------------------------------------------------------- waterfall


def waterfall_chart(spectra: Sequence[LineSpectrum], direction: str, width: float, height: float) -> Drawing:
    """Spectra one above the other, the fastest uppermost, each rising by its level; dots are natural frequencies."""
    drawing = Drawing()
    left, right, top, bottom = 52.0, 14.0, 80.0, 40.0
    highest = 500 * np.ceil(max(float(s.frequency.max(initial=1.0)) for s in spectra) / 500)
    grid = np.linspace(0, highest, round(width - left - right) + 1)
    amplitude = np.array([on_grid(s, grid, direction) for s in spectra])
    level = 20 * np.log10(np.maximum(amplitude, 1e-300) / (amplitude.max() or 1.0))
    apart = (height - top - bottom) / max(len(spectra) - 1, 1)
    rise = top * 0.85 / RANGE
    x = left + (width - left - right) * grid / highest
    speeds = [abs(s.speed) * 30 / np.pi for s in spectra]
    for k, s in enumerate(spectra):
        base = height - bottom - k * apart
        y = base - rise * np.maximum(level[k] + RANGE, 0.0)
        drawing.strips.append(np.stack([x, y], axis=1))
        drawing.strip_colours.append(heat(speeds[k], speeds))
        for f in s.natural[s.natural < highest]:
            place = left + (width - left - right) * f / highest
            drawing.strips.append(np.array([(place, base - 1.5), (place, base + 1.5)]))
            drawing.strip_colours.append(LIGHT)
    for k in range(len(spectra) - 1, -1, -max(1, round(len(spectra) / 5))):
        drawing.label(left - 28, height - bottom - k * apart + 2, f"{speeds[k]:.0f}")
    drawing.label(left - 28, top - 26, "rpm")
    step = 500 * max(1, round(highest / 2500))
    for f in np.arange(0, highest + 1, step):
        place = left + (width - left - right) * f / highest
        drawing.strips.append(np.array([(place, height - bottom), (place, height - bottom + 5)]))
        drawing.strip_colours.append(LIGHT)
        drawing.label(place - (16 if f == highest else 0), height - bottom + 26, f"{f:g}" + (" Hz" if f == highest else ""))
    return drawing
