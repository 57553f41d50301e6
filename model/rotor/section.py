"""The axisymmetric section: which region owns which rectangle, and the mass and inertia that follow."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Material


@dataclass(frozen=True)
class Cell:
    """A rectangle of the section that belongs to one region, cut out by all region edges of its part (m)."""

    region: str
    r: tuple[float, float]
    z: tuple[float, float]


def cells(regions: Sequence[Region]) -> list[Cell]:
    """Rectangles that tile the union of `regions`; where regions overlap the later one owns the rectangle."""
    r_lines = sorted({r for region in regions for r in region.r})
    z_lines = sorted({z for region in regions for z in region.z})
    tiles = []
    for r, z in product(pairwise(r_lines), pairwise(z_lines)):
        owners = [g.name for g in regions if _inside(g.r, r) and _inside(g.z, z)]
        if owners:
            tiles.append(Cell(owners[-1], r, z))
    return tiles


def _inside(outer: tuple[float, float], inner: tuple[float, float]) -> bool:
    return outer[0] <= inner[0] and inner[1] <= outer[1]


@dataclass(frozen=True)
class MassProperties:
    mass: float  # kg
    z: float  # centre of mass, m
    transverse: float  # inertia about x or y through the centre of mass, kg m2
    polar: float  # inertia about the axis, kg m2


def mass_properties(tiles: Iterable[Cell], regions: Sequence[Region], materials: dict[str, Material]) -> MassProperties:
    """Mass, centre and inertia of rings of rectangular section (thick hollow cylinders)."""
    material = {g.name: materials[g.material] for g in regions}
    rows = []
    for tile in tiles:
        (r0, r1), (z0, z1) = tile.r, tile.z
        mass = material[tile.region].density * np.pi * (r1**2 - r0**2) * (z1 - z0)
        rows.append((mass, (z0 + z1) / 2, mass / 12 * (3 * (r0**2 + r1**2) + (z1 - z0) ** 2), mass / 2 * (r0**2 + r1**2)))
    mass, z, transverse, polar = np.array(rows).T
    centre = float(np.sum(mass * z) / np.sum(mass))
    return MassProperties(float(mass.sum()), centre, float(np.sum(transverse + mass * (z - centre) ** 2)), float(polar.sum()))
