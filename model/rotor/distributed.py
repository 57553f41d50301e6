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
from thermospindle.model.types import Array, Integers

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
        levers = np.tile(np.eye(4), (len(shaft.elements), 1, 1))  # from the motion of the nodes' centres of mass to that of the nodes
        off = np.array([node - centres[name] for name, node in zip(shaft.bodies, shaft.nodes, strict=True)])
        levers[:, 0, 1], levers[:, 2, 3] = off[:-1], off[1:]
        numbers: list[tuple[Integers, Array]] = []
        flat = any(segment.sides for segment in shaft.segments)
        for plane, (shift, tilt, sign) in enumerate(PLANES):
            if plane == 0 or flat:  # a round one is the same in both
                *across, drawn, drawn_more = _elements(shaft, used, temperature, plane)
                bent, turned, more = (levers.swapaxes(1, 2) @ own @ levers for own in across)
            if shift in shaft.moves:
                at = np.array([[place[name, move] for name in pair for move in (shift, tilt)] for pair in pairwise(shaft.bodies)])
                signs = np.array([1.0, sign, 1.0, sign])
                numbers.append((at, signs))
                _add(mass, at, at, (bent + turned) * np.outer(signs, signs))
                _add(quartic, at, at, more * np.outer(signs, signs))
        if "z" in shaft.moves:
            at = np.array([[place[name, "z"] for name in pair] for pair in pairwise(shaft.bodies)])
            _add(mass, at, at, drawn)
            _add(quartic, at, at, drawn_more)
        if shaft.turns:  # the moment about x that a tilt about y makes, and the other way round
            (x, of_x), (y, of_y) = numbers
            felt = -2 * shaft.speed_ratio * turned * np.outer(of_y, of_x)
            _add(gyroscopic, y, x, felt)
            _add(gyroscopic, x, y, -felt.swapaxes(1, 2))
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


def _add(matrix: Array, rows: Integers, columns: Integers, own: Array) -> None:
    """Adds what elements (m, k, k) have to a matrix, at their rows and columns (m, k)."""
    np.add.at(matrix, (rows[:, :, None], columns[:, None, :]), own)


def _elements(shaft: Shaft, materials: Mapping[str, Material], temperature: float, plane: int) -> tuple[Array, ...]:
    """Of all m elements of a shaft: consistent mass (m, 4, 4) of the deflections and slopes (w, w', ...) of both ends in one
    of `PLANES`, rotary inertia alike, and N of both; mass (m, 2, 2) along the axis, and N of it."""
    bounds, pieces, element = np.array(list(pairwise(shaft.nodes))), [], []
    for segment in shaft.segments:
        a, b = np.maximum(bounds[:, 0], segment.z[0]), np.minimum(bounds[:, 1], segment.z[1])
        inside = np.flatnonzero(b - a > 1e-12)
        dz = np.repeat((b - a)[inside] / PIECES, PIECES)
        z = np.repeat(a[inside], PIECES) + dz * np.tile(np.arange(PIECES) + 0.5, len(inside))
        material = materials[segment.material]
        modulus, poisson, density = material.youngs_modulus(temperature), material.poisson_ratio, material.density
        area, moments = second_moments(segment, segment.outer, z)
        heavy, rotary = second_moments(segment, segment.mass_outer, z)
        sheared = shaft.shear / (shear_factors(segment, z, poisson) * modulus / (2 * (1 + poisson)) * area)
        x = z - np.repeat(bounds[inside, 0], PIECES)
        given = np.array([x, dz, 1 / (modulus * moments[plane]), sheared, 1 / (modulus * area), density * heavy, shaft.rotary * density * rotary[plane]])
        pieces.append(given.reshape(len(given), len(inside), PIECES))
        element.append(inside)
    order = np.argsort(np.concatenate(element), kind="stable")
    cells, element_of = np.concatenate(pieces, axis=1)[:, order], np.concatenate(element)[order]
    count = np.bincount(element_of, minlength=len(bounds))
    found = tuple(np.zeros((len(bounds), k, k)) for k in (4, 4, 4, 2, 2))
    for parts in np.unique(count):  # elements with as many cells side by side
        alike = np.flatnonzero(count == parts)
        own = cells[:, np.isin(element_of, alike)].reshape(len(cells), len(alike), parts * PIECES)
        for whole, part in zip(found, _integrated(own, bounds[alike, 1] - bounds[alike, 0]), strict=True):
            whole[alike] = part
    return found


def _integrated(cells: Array, length: Array) -> tuple[Array, ...]:
    """The same of elements (k,) from the heights, widths, flexibilities and masses (7, k, cells) of pieces of each.

    Between its ends a beam without load has the shear force Q and the moment M - Q x, and EI slope'
    is the moment, w' = slope + shear force / (kappa G A).
    """
    x, dz, bent, sheared, drawn, line, rotary = cells[:, :, None]  # (k, 1, cells) each

    def up_to(f: Array) -> Array:
        return np.asarray(np.cumsum(f * dz, axis=-1) - f * dz / 2)

    slope = np.concatenate([up_to(bent), -up_to(x * bent)], axis=1)  # for a unit of M and of Q
    grown = slope + np.concatenate([0 * sheared, sheared], axis=1)
    shape = up_to(grown)
    ends = np.stack([(grown * dz).sum(axis=-1), (np.concatenate([bent, -x * bent], axis=1) * dz).sum(axis=-1)], axis=1)
    moved = np.tile([[-1.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]], (len(length), 1, 1))
    moved[:, 0, 1] = -length
    forces = np.linalg.solve(ends, moved)
    one, none = np.ones_like(x), np.zeros_like(x)
    deflection = np.concatenate([one, x, none, none], axis=1) + forces.swapaxes(1, 2) @ shape
    turning = np.concatenate([none, one, none, none], axis=1) + forces.swapaxes(1, 2) @ slope
    push = -up_to(deflection * line)  # shear force and moment of the inertia of each shape
    moment = -up_to(push) - up_to(turning * rotary)
    tilted = up_to(moment * bent)
    leaning = tilted + push * sheared
    held = np.linalg.solve(ends, -np.stack([(leaning * dz).sum(axis=-1), (moment * bent * dz).sum(axis=-1)], axis=1)).swapaxes(1, 2)
    between, tilted = up_to(leaning) + held @ shape, tilted + held @ slope
    along = up_to(drawn) / (drawn * dz).sum(axis=-1, keepdims=True)
    stretch = np.concatenate([1 - along, along], axis=1)
    pushed = up_to(up_to(stretch * line) * drawn)
    crept = along * (up_to(stretch * line) * drawn * dz).sum(axis=-1, keepdims=True) - pushed
    mass, inertia = line * dz, rotary * dz

    def over(f: Array, g: Array) -> Array:
        return f @ g.swapaxes(1, 2)

    turned = over(turning * inertia, turning)
    more = over(deflection * mass, between) + over(turning * inertia, tilted)
    return over(deflection * mass, deflection), turned, more, over(stretch * mass, stretch), over(stretch * mass, crept)
