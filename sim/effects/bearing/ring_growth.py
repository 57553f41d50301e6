"""The turning ring and what is round it grow by their own centrifugal force.

Rotating discs in plane stress, one inside the other: Timoshenko & Goodier, *Theory of Elasticity*, 3rd ed. (1970). In
each layer u = A r + B / r - (1 - nu^2) rho omega^2 r^3 / (8 E); u and the radial force (stress times height) pass from layer to
layer, and the innermost and outermost faces are free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from thermospindle.model.bearing.row import ring_speeds
from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Bearing, Condition, Material, RingMotion, RollerBearing, Spindle
from thermospindle.model.rotor.section import cells
from thermospindle.sim.effects.effect import RINGS, Effect, Values, scale_parameter


@dataclass(frozen=True)
class Layer:
    """A ring of a stack: radii (m), E times mean height share (Pa), Poisson's ratio, density times that share (kg/m3)."""

    inner: float
    outer: float
    modulus: float
    poisson_ratio: float
    density: float


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    scale = values["scale"]
    if scale == 0.0 or condition.speed == 0.0:
        return by_bearing
    grown = {}
    for b in spindle.ringed:
        motion, (inner, outer) = by_bearing[b.name], ring_speeds(spindle, b, condition.speed)
        if outer:
            motion = replace(motion, outer_r=motion.outer_r + scale * outer**2 * unit_growth(spindle, b, b.outer_ring))
        if inner:
            motion = replace(motion, inner_r=motion.inner_r + scale * inner**2 * unit_growth(spindle, b, b.inner_ring))
        grown[b.name] = motion
    return by_bearing | grown


def unit_growth(spindle: Spindle, b: Bearing | RollerBearing, name: str) -> float:
    """Radial growth of the raceway of the ring `name` of a bearing that turns at 1 rad/s (m s2)."""
    ring = replace(spindle.region(name), z=spindle.raceway(name, b))  # of a tube that bearings share, what is about this one
    race = ring.r[0] if name == b.outer_ring else ring.r[1]
    regions = tuple(g for g in spindle.regions if g.part == ring.part)
    constants = tuple(
        (m.youngs_modulus(spindle.reference_temperature), m.poisson_ratio, m.density) for m in (_material(spindle, g) for g in regions)
    )
    return _growth(regions, constants, ring, race)


def _material(spindle: Spindle, region: Region) -> Material:
    return spindle.materials[region.material]


@lru_cache(maxsize=256)
def _growth(regions: tuple[Region, ...], constants: tuple[tuple[float, float, float], ...], ring: Region, race: float) -> float:
    return displacement(layers(regions, constants, ring, race), race)


def layers(regions: Sequence[Region], constants: Sequence[tuple[float, float, float]], ring: Region, race: float) -> tuple[Layer, ...]:
    """The stack that turns with `ring`: what of its part lies at the ring's height, without gaps, from inside to outside."""
    of = {g.name: c for g, c in zip(regions, constants, strict=True)}
    height = ring.z[1] - ring.z[0]
    shares: dict[tuple[float, float], list[tuple[float, tuple[float, float, float]]]] = {}
    for cell in cells(regions):
        overlap = min(cell.z[1], ring.z[1]) - max(cell.z[0], ring.z[0])
        if overlap > 1e-9 * height:
            shares.setdefault(cell.r, []).append((overlap / height, of[cell.region]))
    stack: list[Layer] = []
    for (r0, r1), parts in sorted(shares.items()):
        if stack and r0 > stack[-1].outer + 1e-12:  # a gap: the stack ends, or begins anew
            if stack[-1].outer >= race:
                break
            stack = []
        modulus = sum(s * e for s, (e, _, _) in parts)
        poisson = sum(s * e * nu for s, (e, nu, _) in parts) / modulus
        stack.append(Layer(r0, r1, modulus, poisson, sum(s * rho for s, (_, _, rho) in parts)))
    return tuple(stack)


def displacement(stack: Sequence[Layer], r: float) -> float:
    """Radial displacement (m) of the stack at radius `r` for 1 rad/s. ValueError for a radius outside the stack."""
    found = [i for i, layer in enumerate(stack) if layer.inner <= r <= layer.outer]
    if not found:
        raise ValueError(f"no turning layer holds the radius {r:g} m")
    unit = stack[-1].outer  # scales A r and B / r alike
    size = 2 * len(stack)
    matrix, known = np.zeros((size, size)), np.zeros(size)
    stiff = max(layer.modulus for layer in stack)

    def force(layer: Layer, at: float) -> tuple[float, float, float]:
        """Radial force per height and length at `at`, in units of `stiff`, by A and B and of the spinning alone."""
        e, nu = layer.modulus / stiff, layer.poisson_ratio
        b = -e / (1 + nu) * (unit / at) ** 2 if at > 0 else 0.0
        return e / (1 - nu), b, -(3 + nu) / 8 * layer.density / stiff * at**2

    def moved(layer: Layer, at: float) -> tuple[float, float, float]:
        """Displacement at `at` by A and B (times `unit`, in units of it) and of the spinning alone (m)."""
        nu = layer.poisson_ratio
        return at / unit, unit / at if at > 0 else 0.0, -(1 - nu**2) * layer.density * at**3 / (8 * layer.modulus) / unit

    first, last = stack[0], stack[-1]
    if first.inner > 0:
        matrix[0, 0], matrix[0, 1], spin = force(first, first.inner)
        known[0] = -spin
    else:
        matrix[0, 1] = 1.0  # a solid centre: no B / r
    for i, (one, two) in enumerate(pairwise(stack)):
        for row, law in ((2 * i + 1, moved), (2 * i + 2, force)):
            (a1, b1, s1), (a2, b2, s2) = law(one, one.outer), law(two, two.inner)
            matrix[row, 2 * i : 2 * i + 4] = a1, b1, -a2, -b2
            known[row] = s2 - s1
    matrix[-1, -2], matrix[-1, -1], spin = force(last, last.outer)
    known[-1] = -spin
    solution = np.linalg.solve(matrix, known)
    by_a, by_b, spin = moved(stack[found[0]], r)
    return float(unit * (solution[2 * found[0]] * by_a + solution[2 * found[0] + 1] * by_b + spin))


EFFECT = Effect(
    name="ring_growth",
    title="Centrifugal growth of the turning ring and hub",
    equation=(
        "u = A r + B / r - (1 - nu^2) rho omega^2 r^3 / (8 E) in each layer at the ring's height, u and radial force continuous, "
        "free inside and outside (Timoshenko & Goodier 1970); raceway radius grows by scale u(race); a single ring: "
        "u(a) = rho omega^2 a ((3 + nu) b^2 + (1 - nu) a^2) / (4 E)"
    ),
    parameters=(
        scale_parameter(
            typical=1.0,
            prior_sd=0.5,
            limits=(0.0, 5.0),
            meaning="growth in units of that of the ring with all that its part has round it at its height",
            source="1 from the section and handbook constants; parts above and below the ring change it by tens of percent",
        ),
    ),
    sees="only at speed, as its square: a turning outer ring unloads the bearings, a turning inner ring loads them",
    resembles=("ball_inertia", "thermal_gradient", "lubricant_film"),
    valid="plane stress, bonded layers, no support from or load on neighbouring heights; grooves keep their radii",
    motions=motions,
    acts_on=(RINGS,),
)
