"""Pictures of a run as plain arrays: colours of temperatures, and the deformed section in millimetres. Nothing here knows Rerun."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import TO_MM
from thermospindle.sim.posing import round_down
from thermospindle.thermal.expansion import DeformedSection

Colours = NDArray[np.uint8]
HEAT = np.array([(70, 120, 255), (60, 200, 255), (235, 235, 120), (255, 160, 50), (255, 60, 60)], float)  # cold to hot


def heat(temperature: float | Array, temperatures: Sequence[float]) -> Colours:
    """Colour (..., 3) of temperatures (...), from blue for the lowest of all to red for the highest."""
    low, high = min(temperatures), max(temperatures)
    place = (temperature - low) / (high - low) if high > low else 0.0 * temperature
    return np.stack([np.interp(place, np.linspace(0, 1, len(HEAT)), channel) for channel in HEAT.T], axis=-1).astype(np.uint8)


def light(paint: str | tuple[float, float, float], least: float = 0.35) -> tuple[int, int, int]:
    """A colour of the figures, light enough for a dark ground: no channel below `least`."""
    red, green, blue = (round(255 * (least + (1 - least) * c)) for c in to_rgb(paint))
    return red, green, blue


def exaggeration(sections: Sequence[dict[str, DeformedSection]], radius: float) -> float:
    """A round factor that makes the largest displacement of all at most a tenth of `radius` (m)."""
    largest = max(float(np.abs(part.displacement).max()) for section in sections for part in section.values())
    return round_down(0.1 * radius / largest) if largest else 1.0


def section_mesh(
    spindle: Spindle, part: DeformedSection, shift: float, factor: float, colour: Colours
) -> tuple[Array, NDArray[np.int64], Colours]:
    """Vertices (v, 3) mm in the plane y = 0, triangles (t, 3), colours (v, 3): materials as shades of `colour`.

    `shift` (m) is the rigid axial movement of the part, displaced by `factor` times like the rest.
    """
    materials = sorted({g.material for g in spindle.regions})
    nodes = part.nodes + factor * (part.displacement + np.array([0.0, shift]))
    corners, triangles = np.unique(part.region_of[:, None] * len(nodes) + part.triangles, return_inverse=True)
    r, z = TO_MM * nodes[corners % len(nodes)].T
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
        drawn.append(TO_MM * np.array([(r, -2e-4, z) for r, z in ((r0, z0), (r1, z0), (r1, z1), (r0, z1), (r0, z0))]))
    turn = np.linspace(0, 2 * np.pi, 33)
    for b in spindle.bearings:
        circle = b.ball_diameter / 2 * np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
        drawn.append(TO_MM * (circle + np.array([b.pitch_diameter / 2, -2e-4, b.z])))
    return drawn
