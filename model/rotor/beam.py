"""Beam elements of flexible shafts: nodes that are bodies, joined by elements that are joints.

Between two nodes a beam of any section that is its own mirror image in x and y is exactly a diagonal 5x5 stiffness at its elastic centre,
between rigid arms: with z_c = integral(z / EI) / integral(1 / EI) the two free-end flexibilities of bending no longer couple, and

    1 / k_tilt    = integral(dz / EI)
    1 / k_lateral = integral((z - z_c)^2 / EI dz) + shear integral(dz / kappa G A)
    1 / k_axial   = integral(dz / EA),

for a uniform Timoshenko beam 12 EI / (l^3 (1 + phi)), EI / l and EA / l at its middle
(Przemieniecki, *Theory of Matrix Structural Analysis*, 1968, 5.6), with an I of its own in each of
the two planes. Static answers are exact on any mesh, steps and tapers inside an element included.

The mass of an element goes to its nodes by its linear shape functions, each share with its centre of mass moved inward by
the first moment (l / 2) integral(rho A x (1 - x) dz), x from 0 to 1: for a uniform element half of m, moved by l / 6. This
is the Euler-Maclaurin correction of the trapezoidal rule, without which a free end is of second order only: what is left
there is the lump's own inertia about its node, m l^3 / 72 of it, of third. Inside a uniform beam the corrections of
neighbours cancel, and bending frequencies of k l = c are right to c^4 / 1440, the size of the consistent mass's error with
the other sign. Measured: the third bending frequency of a free shaft of 20 elements is 0.09 % low, of 40 elements 0.011 %
(`tests/model/test_beam.py`). Rotary inertia rho I (polar 2 rho I) is shared alike; none is added for the length of a lump.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import TypeVar

import numpy as np

from thermospindle.model.machine import Material
from thermospindle.model.shaft import Segment, Shaft
from thermospindle.model.structure import Body, Joint, Structure
from thermospindle.model.types import Array

T = TypeVar("T", float, Array)

PLACES, WEIGHTS = np.polynomial.legendre.leggauss(8)
SLIGHT = 1e-4
"""Rotary inertia left to a node where its theory has none, over mass times length squared: MuJoCo
wants some, bending frequencies move by half of it times (k l)^2."""


def shear_factor(bore: T, poisson: float) -> T:
    """Shear factor of a tube of radius ratio `bore` (a number or an array): Cowper, The shear
    coefficient in Timoshenko's beam theory, J. Appl. Mech., 1966."""
    m = (1 + bore**2) ** 2
    return 6 * (1 + poisson) * m / ((7 + 6 * poisson) * m + (20 + 12 * poisson) * bore**2)


def second_moments(segment: Segment, ends: tuple[float, float], z: Array) -> tuple[Array, Array]:
    """Area (m2), (m,), and the second moments of area (m4), (2, m), of x^2 and of y^2 at heights;
    `ends` are the outer radii at the segment's ends."""
    if segment.sides is not None:
        width, height = segment.sides
        return np.full(len(z), width * height), np.repeat([[height * width**3 / 12], [width * height**3 / 12]], len(z), axis=1)
    outer, bore = radii(segment, ends, z), radii(segment, segment.bore, z)
    moment = np.pi / 4 * (outer**4 - bore**4)
    return np.pi * (outer**2 - bore**2), np.stack([moment, moment])


def shear_factors(segment: Segment, z: Array, poisson: float) -> Array:
    """Shear factor (m,) at heights, of a rectangle 10 (1 + nu) / (12 + 11 nu) across both sides (Cowper 1966)."""
    if segment.sides is not None:
        return np.full(len(z), 10 * (1 + poisson) / (12 + 11 * poisson))
    return shear_factor(radii(segment, segment.bore, z) / radii(segment, segment.outer, z), poisson)


def with_shafts(structure: Structure, materials: Mapping[str, Material], temperature: float) -> Structure:
    """The structure with the nodes and elements of its shafts among its bodies and joints; moduli are those at `temperature` (C)."""
    bodies = [body for shaft in structure.shafts for body in nodes(shaft, materials)]
    joints = [joint for shaft in structure.shafts for joint in elements(shaft, materials, temperature)]
    return replace(structure, bodies=(*structure.bodies, *bodies), joints=(*structure.joints, *joints))


def at_temperature(structure: Structure, materials: Mapping[str, Material], reference: float, temperature: float) -> Structure:
    """The structure, with moduli those at `reference` (C), at another temperature: the elements of shafts whose moduli change
    stiffer or softer by what their beam is, and joints in proportion to the modulus of their material; as it is where none does."""
    changed: dict[str, Joint] = {}
    joints = {j.name: j for j in structure.joints}
    for shaft in structure.shafts:
        laws = [materials[name].youngs_modulus for name in dict.fromkeys(s.material for s in shaft.segments)]
        if any(law(temperature) != law(reference) for law in laws):
            for before, after in zip(elements(shaft, materials, reference), elements(shaft, materials, temperature), strict=True):
                changed[before.name] = _scaled(joints[before.name], before, after)
    for joint in structure.joints:
        if joint.material and (ratio := materials[joint.material].youngs_modulus(temperature) / materials[joint.material].youngs_modulus(reference)) != 1.0:
            changed[joint.name] = joint.stiffer(ratio, ratio)
    return replace(structure, joints=tuple(changed.get(j.name, j) for j in structure.joints)) if changed else structure


def _scaled(joint: Joint, before: Joint, after: Joint) -> Joint:
    """The joint with its stiffness changed in the ratio of two others."""
    k = [own * b / a for own, a, b in zip(joint.stiffness, before.stiffness, after.stiffness, strict=True)]
    return replace(joint, stiffness=(k[0], k[1], k[2], k[3], k[4]))


def with_theory(
    structure: Structure, materials: Mapping[str, Material], temperature: float, shares: tuple[float, float] | Mapping[str, tuple[float, float]]
) -> Structure:
    """The structure with other shares of shear and rotary inertia in the beams of its shafts (of
    all, or by name), all else of them as it stands.

    What has been added to a node or scaled in an element stays: only the change that the shares make is applied.
    """
    changed_bodies: dict[str, Body] = {}
    changed_joints: dict[str, Joint] = {}
    told = {s.name: shares if isinstance(shares, tuple) else shares[s.name] for s in structure.shafts}
    bodies, joints = {b.name: b for b in structure.bodies}, {j.name: j for j in structure.joints}
    shafts = tuple(replace(s, shear=told[s.name][0], rotary=told[s.name][1]) for s in structure.shafts)
    for old, new in zip(structure.shafts, shafts, strict=True):
        if new.rotary != old.rotary:
            for a, b in zip(nodes(old, materials), nodes(new, materials), strict=True):
                own = bodies[a.name]
                x, y, z = (i + after - before for i, after, before in zip(own.inertia, b.inertia, a.inertia, strict=True))
                changed_bodies[a.name] = replace(own, inertia=(x, y, z))
        if new.shear != old.shear:
            for before, after in zip(elements(old, materials, temperature), elements(new, materials, temperature), strict=True):
                changed_joints[before.name] = _scaled(joints[before.name], before, after)
    return replace(
        structure,
        bodies=tuple(changed_bodies.get(b.name, b) for b in structure.bodies),
        joints=tuple(changed_joints.get(j.name, j) for j in structure.joints),
        shafts=shafts,
    )


def elements(shaft: Shaft, materials: Mapping[str, Material], temperature: float) -> list[Joint]:
    """The joints between neighbouring nodes of a shaft."""
    used = {segment.material: materials[segment.material] for segment in shaft.segments}
    elastic = tuple((name, m.youngs_modulus(temperature), m.poisson_ratio) for name, m in used.items())
    return [
        Joint(
            name=shaft.elements[i],
            group=shaft.name,
            bodies=(shaft.bodies[i], shaft.bodies[i + 1]),
            z=z,
            stiffness=(1 / (bending[0] + shear), 1 / (bending[1] + shear), 1 / drawn, 1 / bent[1], 1 / bent[0]),
            damping_ratio=shaft.damping_ratio,
            loss_factor=shaft.loss_factor,
            role="beam",
            material=material,
        )
        for i, (z, bending, sheared, drawn, bent, material) in enumerate(_flexibilities(shaft.segments, shaft.nodes, elastic))
        for shear in [shaft.shear * sheared]
    ]


@lru_cache(maxsize=64)
def _flexibilities(
    segments: tuple[Segment, ...], heights: tuple[float, ...], elastic: tuple[tuple[str, float, float], ...]
) -> tuple[tuple[float, tuple[float, float], float, float, tuple[float, float], str], ...]:
    """Of every element its elastic centre (m), lateral flexibility in bending (in the planes of x and of y) and in
    shear, axial flexibility and that of tilt (in both planes), and its material where it has but one; `elastic`:
    name, modulus and Poisson's ratio of every material. They do not know the beam theory, so that another one
    costs nothing. The centre is the same in both planes: rectangular segments have a node at each end."""
    properties, found = {name: row for name, *row in elastic}, []
    for low, high in pairwise(heights):
        sheared, drawn = 0.0, 0.0  # integrals of 1/kappa G A and 1/EA
        bent, about, squares = np.zeros((3, 2))  # of 1/EI, z/EI and z^2/EI, z from the element's lower end, in both planes
        used: list[str] = []
        for segment, z, dz in _slices(segments, low, high):
            used += [segment.material] if segment.material not in used else []
            modulus, poisson = properties[segment.material]
            area, moments = second_moments(segment, segment.outer, z)
            factor = shear_factors(segment, z, poisson)
            bent += np.sum(dz / (modulus * moments), axis=1)
            about += np.sum((z - low) * dz / (modulus * moments), axis=1)
            squares += np.sum((z - low) ** 2 * dz / (modulus * moments), axis=1)
            sheared += float(np.sum(dz / (factor * modulus / (2 * (1 + poisson)) * area)))
            drawn += float(np.sum(dz / (modulus * area)))
        centre = about / bent
        (in_x, in_y), (tilt_y, tilt_x) = (squares - centre * about).tolist(), bent.tolist()
        found.append((low + float(centre[0]), (in_x, in_y), sheared, drawn, (tilt_y, tilt_x), used[0] if len(used) == 1 else ""))
    return tuple(found)


def nodes(shaft: Shaft, materials: Mapping[str, Material]) -> list[Body]:
    """The nodes of a shaft as bodies."""
    densities = tuple((name, materials[name].density) for name in dict.fromkeys(segment.material for segment in shaft.segments))
    found = []
    for name, (z, mass, rotary, least) in zip(shaft.bodies, _lumps(shaft.segments, shaft.nodes, densities), strict=True):
        about_y, about_x = (max(shaft.rotary * r, least) for r in rotary)
        found.append(Body(name, mass, (about_x, about_y, about_x + about_y), z, shaft.moves, shaft.turns, (), shaft.role, shaft.speed_ratio))
    return found


@lru_cache(maxsize=64)
def _lumps(
    segments: tuple[Segment, ...], heights: tuple[float, ...], densities: tuple[tuple[str, float], ...]
) -> tuple[tuple[float, float, tuple[float, float], float], ...]:
    """Of every node the height of its centre of mass (m), mass, rotary inertia of its sections in
    the planes of x and of y, and the least inertia that it is given."""
    mass, first, least = np.zeros((3, len(heights)))
    rotary = np.zeros((len(heights), 2))
    density = dict(densities)
    for i, (low, high) in enumerate(pairwise(heights)):
        length = high - low
        for segment, z, dz in _slices(segments, low, high):
            area, moments = second_moments(segment, segment.mass_outer, z)
            rho, x = density[segment.material], (z - low) / length
            line, inertia = rho * area * dz, rho * moments * dz
            inward = length / 2 * float(np.sum(line * x * (1 - x)))
            for node, share, sign in ((i, 1 - x, 1.0), (i + 1, x, -1.0)):
                mass[node] += float(np.sum(line * share))
                rotary[node] += np.sum(inertia * share, axis=1)
                least[node] += SLIGHT * float(np.sum(line * share)) * length**2
                first[node] += sign * inward
    rows = zip(heights, mass.tolist(), rotary.tolist(), least.tolist(), first.tolist(), strict=True)
    return tuple((z + s / m, m, (in_x, in_y), small) for z, m, (in_x, in_y), small, s in rows)


def _slices(segments: Sequence[Segment], low: float, high: float) -> Iterator[tuple[Segment, Array, Array]]:
    """The segments between two heights, each with places (m) and weights (m) of Gauss's rule on it."""
    for segment in segments:
        a, b = max(low, segment.z[0]), min(high, segment.z[1])
        if b - a > 1e-12:
            yield segment, (a + b) / 2 + (b - a) / 2 * PLACES, (b - a) / 2 * WEIGHTS


def radii(segment: Segment, ends: tuple[float, float], z: Array) -> Array:
    """Radii (m) of a segment at heights."""
    return ends[0] + (ends[1] - ends[0]) * (z - segment.z[0]) / (segment.z[1] - segment.z[0])
