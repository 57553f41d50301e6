"""The mass of flexible shafts where it is: what lumps at nodes leave out, for those who measure more finely than a mesh.

A chain's masses sit at its nodes (`beam`), which MuJoCo steps. Between nodes a beam moves by its static shapes, with
which the mass that is spread along an element makes the consistent matrix M (Archer, *AIAA J.* 3 (1965) 1910), and
by what its own inertia bends and shears it between them, which makes the next term of the dynamic stiffness K + s^2
M - s^4 N (Przemieniecki, *Theory of Matrix Structural Analysis*, 1968, 11.5). Lumps are right to the second order in
an element's length where forces act on a shaft that shears, as those of bearings do, and this to the fourth. Moduli
are those at one temperature: M knows only their ratios, and N, itself of the fourth order, goes with their inverse.

It is not what MuJoCo steps, and so not `OperatingPoint.linear`. M alone is no nearer than lumps: the frequencies of
`five_bearing` near 4.15 kHz are 1.3e-3 high with it, 6e-4 low with lumps and 6e-6 off with N, those of `mk7702` at 4.08
kHz 1.4e-3, 1.1e-3 and 6e-6. Nor could it be stepped: the armature of a tendon between bodies that hang on the world by
themselves comes onto the diagonal of MuJoCo's mass matrix alone, and its accelerations are then wrong (4.0.0).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise

import numpy as np

from thermospindle.model.machine import Material
from thermospindle.model.rotor.beam import nodes, second_moments, shear_factors
from thermospindle.model.rotor.chain import Layout
from thermospindle.model.shaft import Shaft
from thermospindle.model.structure import Structure
from thermospindle.model.types import Array

PIECES = 128  # of a segment within an element, over which shapes and masses are integrated by midpoints
PLANES = (("x", "tilt_y", 1.0), ("y", "tilt_x", -1.0))
"""Moves of each plane, and the sign by which its tilt is the slope of the deflection."""


def spread(structure: Structure, materials: Mapping[str, Material], temperature: float, layout: Layout) -> tuple[Array, Array, Array]:
    """What to add to a chain's mass matrix, the matrix N, and, for each rad/s of spindle speed, what to
    add to the damping matrix with gyroscopic terms, (n, n) each over the degrees of freedom of `layout`,
    for the masses of the shafts to be where they are; moduli are those at `temperature` (C). Read only."""
    used = {segment.material: materials[segment.material] for shaft in structure.shafts for segment in shaft.segments}
    return _spread(structure.shafts, tuple(used.items()), temperature, layout)


@lru_cache(maxsize=16)
def _spread(
    shafts: tuple[Shaft, ...], materials: tuple[tuple[str, Material], ...], temperature: float, layout: Layout
) -> tuple[Array, Array, Array]:
    place = {dof: i for i, dof in enumerate((name, move) for name, _, moves in layout for move in moves)}
    mass, quartic, gyroscopic = np.zeros((3, len(place), len(place)))
    centres = {name: z for name, z, _ in layout}
    used = dict(materials)
    for shaft in shafts:
        for (a, b), (low, high) in zip(pairwise(shaft.bodies), pairwise(shaft.nodes), strict=True):
            levers = np.eye(4)  # from the motion of the nodes' centres of mass to that of the nodes
            levers[0, 1], levers[2, 3] = low - centres[a], high - centres[b]
            numbers: list[tuple[list[int], Array]] = []
            flat = any(segment.sides for segment in shaft.segments)
            for plane, (shift, tilt, sign) in enumerate(PLANES):
                if plane == 0 or flat:  # a round one is the same in both
                    bent, turned, more, drawn, drawn_more = _element(shaft, low, high, used, temperature, plane)
                    turned = levers.T @ turned @ levers
                    across, more = levers.T @ bent @ levers + turned, levers.T @ more @ levers
                own = [(name, move) for name in (a, b) for move in (shift, tilt)]
                if shift in shaft.moves:
                    at, signs = [place[dof] for dof in own], np.array([1.0, sign, 1.0, sign])
                    numbers.append((at, signs))
                    mass[np.ix_(at, at)] += across * np.outer(signs, signs)
                    quartic[np.ix_(at, at)] += more * np.outer(signs, signs)
            if "z" in shaft.moves:
                at = [place[a, "z"], place[b, "z"]]
                mass[np.ix_(at, at)] += drawn
                quartic[np.ix_(at, at)] += drawn_more
            if shaft.turns:  # the moment about x that a tilt about y makes, and the other way round
                (x, of_x), (y, of_y) = numbers
                felt = -2 * shaft.speed_ratio * turned * np.outer(of_y, of_x)
                gyroscopic[np.ix_(y, x)] += felt
                gyroscopic[np.ix_(x, y)] -= felt.T
        for lump in nodes(shaft, used):
            for move in shaft.moves:
                i = place[lump.name, move]
                mass[i, i] -= {"tilt_x": lump.inertia[0], "tilt_y": lump.inertia[1]}.get(move, lump.mass)
            if shaft.turns:
                i, j = place[lump.name, "tilt_x"], place[lump.name, "tilt_y"]
                gyroscopic[i, j] -= lump.inertia[2] * shaft.speed_ratio
                gyroscopic[j, i] += lump.inertia[2] * shaft.speed_ratio
    for matrix in (mass, quartic, gyroscopic):
        matrix.flags.writeable = False
    return mass, quartic, gyroscopic


def _element(shaft: Shaft, low: float, high: float, materials: Mapping[str, Material], temperature: float, plane: int) -> tuple[Array, ...]:
    """Consistent mass (4, 4) of the deflections and slopes (w, w', ...) of both ends in one of
    `PLANES`, rotary inertia alike, and N of both; mass (2, 2) along the axis, and N of it.

    Between its ends a beam without load has the shear force Q and the moment M - Q x, and EI slope'
    is the moment, w' = slope + shear force / (kappa G A).
    """
    rows = []
    for segment in shaft.segments:
        a, b = max(low, segment.z[0]), min(high, segment.z[1])
        if b - a > 1e-12:
            z = a + (b - a) * (np.arange(PIECES) + 0.5) / PIECES
            material = materials[segment.material]
            modulus, poisson, density = material.youngs_modulus(temperature), material.poisson_ratio, material.density
            area, moments = second_moments(segment, segment.outer, z)
            heavy, rotary = second_moments(segment, segment.mass_outer, z)
            sheared = shaft.shear / (shear_factors(segment, z, poisson) * modulus / (2 * (1 + poisson)) * area)
            given = np.full(PIECES, (b - a) / PIECES), 1 / (modulus * moments[plane]), sheared, 1 / (modulus * area), density * heavy, shaft.rotary * density * rotary[plane]
            rows.append(np.array([z - low, *given]))
    x, dz, bent, sheared, drawn, line, rotary = np.concatenate(rows, axis=1)

    def up_to(f: Array) -> Array:
        return np.asarray(np.cumsum(f * dz, axis=-1) - f * dz / 2)

    slope = np.stack([up_to(bent), -up_to(x * bent)])  # for a unit of M and of Q
    shape = np.stack([up_to(slope[0]), up_to(slope[1] + sheared)])
    ends = np.array([[(slope[0] * dz).sum(), ((slope[1] + sheared) * dz).sum()], [(bent * dz).sum(), -(x * bent * dz).sum()]])
    length = high - low
    forces = np.linalg.solve(ends, np.array([[-1.0, -length, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]]))
    one, none = np.ones_like(x), np.zeros_like(x)
    deflection = np.stack([one, x, none, none]) + forces.T @ shape
    turning = np.stack([none, one, none, none]) + forces.T @ slope
    push = -up_to(deflection * line)  # shear force and moment of the inertia of each shape
    moment = -up_to(push) - up_to(turning * rotary)
    tilted = up_to(moment * bent)
    leaning = tilted + push * sheared
    held = np.linalg.solve(ends, -np.stack([(leaning * dz).sum(axis=1), (moment * bent * dz).sum(axis=1)]))
    between, tilted = up_to(leaning) + held.T @ shape, tilted + held.T @ slope
    along = up_to(drawn) / (drawn * dz).sum()
    stretch = np.stack([1 - along, along])
    pushed = up_to(up_to(stretch * line) * drawn)
    crept = along * (up_to(stretch * line) * drawn * dz).sum(axis=1)[:, None] - pushed
    mass, inertia = line * dz, rotary * dz
    bent_mass, turned = (deflection * mass) @ deflection.T, (turning * inertia) @ turning.T
    return bent_mass, turned, (deflection * mass) @ between.T + (turning * inertia) @ tilted.T, (stretch * mass) @ stretch.T, (stretch * mass) @ crept.T
