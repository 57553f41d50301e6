"""Which body a region of the section moves with, and which colour it has."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from itertools import combinations
from zlib import crc32

import numpy as np

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.look.shafts import host

COLOURS = {
    "aluminium": (0.79, 0.80, 0.80),
    "steel": (0.46, 0.53, 0.61),
    "yoke": (0.46, 0.34, 0.25),
    "magnet": (0.15, 0.20, 0.36),
    "cast iron": (0.43, 0.44, 0.46),
}
SHADES = (1.0, 0.84, 0.70, 0.58)  # of touching regions of one material
PLATE, STRIPE, BALL, LOOSE_BALL = (0.33, 0.36, 0.40), (0.95, 0.62, 0.10), (0.74, 0.75, 0.77), (0.85, 0.30, 0.15)


def region_bodies(spindle: Spindle) -> dict[str, str]:
    """The body each region moves with.

    A region that makes up no body touches, at once or through others like it, a body that has regions: it is part of the body
    without regions which that one is joined to (the seat of a shaft), or of that body itself if there is none.
    """
    structure, touching = spindle.structure, _touching(spindle.regions)
    made_of = {region: b.name for b in structure.bodies for region in b.regions}
    without = [b.name for b in structure.bodies if not b.regions]

    def seat(body: str) -> str:
        joined = (other for joint in structure.joints if body in joint.bodies for other in joint.bodies if other in without)
        return next(joined, body)

    hosts = dict(made_of)
    while found := {
        name: seat(made_of[first]) if (first := min(near)) in made_of else hosts[first]
        for name, all_near in touching.items()
        if name not in hosts and (near := all_near & hosts.keys())
    }:
        hosts |= found
    on_shafts = {g.name: node for g in spindle.regions if g.name not in made_of and (node := host(spindle, g))}
    turning = spindle.turning.name if structure.turns else ""
    still = next((name for b in spindle.bearings for name in (b.inner_body, b.outer_body) if name != "ground" and not structure.body(name).turns), "")
    still = still or next((b.name for b in structure.bodies if not b.turns), turning)
    return {g.name: on_shafts.get(g.name) or hosts.get(g.name, turning if g.part == "rotating" else still) for g in spindle.regions}


def _touching(regions: Sequence[Region]) -> dict[str, set[str]]:
    """The regions of the same part that each region shares a side or an area with."""
    near: dict[str, set[str]] = {g.name: set() for g in regions}
    for a, b in combinations(regions, 2):
        overlap = [min(p[1], q[1]) - max(p[0], q[0]) for p, q in ((a.r, b.r), (a.z, b.z))]
        if a.part == b.part and min(overlap) >= 0 and max(overlap) > 0:
            near[a.name].add(b.name)
            near[b.name].add(a.name)
    return near


def colour(material: str) -> tuple[float, float, float]:
    """The colour of a material; a name without one gets a muted colour that depends on the name alone."""
    return COLOURS.get(material) or colorsys.hsv_to_rgb(crc32(material.encode()) % 360 / 360, 0.35, 0.70)


def region_colours(spindle: Spindle) -> dict[str, tuple[float, float, float]]:
    """The material's colour, bearing rings lighter; of two touching regions alike the larger has the lighter shade."""
    rings, touching = ring_regions(spindle), _touching(spindle.regions)
    kind = {g.name: (g.material, g.name in rings) for g in spindle.regions}
    shade: dict[str, int] = {}
    for region in sorted(spindle.regions, key=_bulk, reverse=True):
        alike = {near for near in touching[region.name] if kind[near] == kind[region.name]}
        free = set(range(len(SHADES))) - {shade[near] for near in alike & shade.keys()}
        shade[region.name] = min(free, default=0)
    tones = {name: np.array(colour(material)) * SHADES[shade[name]] for name, (material, _) in kind.items()}
    tones |= {name: 0.75 * tones[name] + 0.25 for name in rings}
    return {name: (float(red), float(green), float(blue)) for name, (red, green, blue) in tones.items()}


def ring_regions(spindle: Spindle) -> set[str]:
    return {ring for b in spindle.bearings for ring in (b.inner_ring, b.outer_ring)}


def _bulk(region: Region) -> float:
    return (region.r[1] ** 2 - region.r[0] ** 2) * (region.z[1] - region.z[0])
