"""A cut-away slice of a flexible shaft for every node, which moves with it, so that a bending shaft is seen to bend."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.section import Cell
from thermospindle.model.shaft import Segment, Shaft
from thermospindle.model.types import Array

STEPS = 3  # cylinders that draw a cone


def slices(shaft: Shaft) -> dict[str, list[Cell]]:
    """Rectangles of every node's slice, from half way to its neighbours on both sides, by the
    node's body; cones in `STEPS` cylinders, rectangular sections (`boxes`) by half their width."""
    middles = [(a + b) / 2 for a, b in zip(shaft.nodes, shaft.nodes[1:], strict=False)]
    edges = [shaft.nodes[0], *middles, shaft.nodes[-1]]
    found: dict[str, list[Cell]] = {}
    for name, low, high in zip(shaft.bodies, edges, edges[1:], strict=False):
        found[name] = [cell for segment in shaft.segments for cell in _cells(name, segment, low, high)]
    return found


def _cells(name: str, segment: Segment, low: float, high: float) -> list[Cell]:
    a, b = max(low, segment.z[0]), min(high, segment.z[1])
    if b - a < 1e-9:
        return []
    cone = segment.outer[0] != segment.outer[1] or segment.bore[0] != segment.bore[1]
    cuts = np.linspace(a, b, STEPS + 1 if cone else 2)
    found = []
    for z0, z1 in itertools.pairwise(cuts):
        share = ((z0 + z1) / 2 - segment.z[0]) / (segment.z[1] - segment.z[0])
        r0, r1 = (ends[0] + share * (ends[1] - ends[0]) for ends in (segment.bore, segment.outer))
        found.append(Cell(name, (float(r0), float(r1)), (float(z0), float(z1))))
    return found


def boxes(shaft: Shaft) -> dict[str, tuple[Array, NDArray[np.int64], NDArray[np.int64]]]:
    """Vertices (8 k, 3), triangles (12 k, 3) and patches (12 k,) of every node's slice of a rectangular section, by the node's body."""
    corners = np.array(list(itertools.product((-0.5, 0.5), (-0.5, 0.5), (0.0, 1.0))))  # x, y, z; number 4 x + 2 y + z
    faces = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    found = {}
    for name, tiles in slices(shaft).items():
        own = [(t.z, s.sides) for t in tiles for s in shaft.segments if s.sides and s.z[0] <= sum(t.z) / 2 <= s.z[1]]
        vertices = [corners * [w, h, z1 - z0] + [0.0, 0.0, z0] for (z0, z1), (w, h) in own]
        numbers = [triangles + 8 * k for k in range(len(own))]
        found[name] = np.concatenate(vertices), np.concatenate(numbers), np.concatenate([np.tile(np.arange(6), 2) + 6 * k for k in range(len(own))])
    return found


def drawn_by_shaft(spindle: Spindle, region: Region) -> bool:
    """Whether a region of the section is a flexible shaft itself, which its slices show."""
    return any(s.role == region.role == "shaft" and s.turns == (region.part == "rotating") for s in spindle.structure.shafts)


def host(spindle: Spindle, region: Region) -> str | None:
    """The node with which a region moves that sits on a flexible shaft of its part; None where its part has none."""
    own = [s for s in spindle.structure.shafts if s.turns == (region.part == "rotating")]
    if not own:
        return None
    middle = sum(region.z) / 2
    nearest = min(own, key=lambda s: max(s.nodes[0] - middle, middle - s.nodes[-1], 0.0))
    return nearest.node_at(middle)


def extent(spindle: Spindle) -> tuple[float, float, float]:
    """Largest radius, lowest and highest height (m) of section and shafts; of the bodies and points where neither is drawn."""
    radii = [g.r[1] for g in spindle.regions] + [max(g.outer) for s in spindle.structure.shafts for g in s.segments]
    heights = [z for g in spindle.regions for z in g.z] + [z for s in spindle.structure.shafts for z in (s.nodes[0], s.nodes[-1])]
    if not radii:
        radii = [max((float(np.hypot(*p.position[:2])) for p in spindle.points), default=0.0) or 0.05]
        heights = [b.z for b in spindle.structure.bodies]
    return max(radii), min(heights), max(heights)
