"""The shaft bends: a Timoshenko beam from its flange past one bearing to the other, instead of a rigid body.

The beam's own modes lie far above the tests (a free 11.5 mm span of the reference shaft: 13 kHz across, 100 kHz along the axis, too stiff
for the step of a simulation in time). So its compliance is put in series with what it carries, and its mass stays in one piece at the
bearing next to the flange: the flange joint is moved there through the first span, and the other bearing's stiffness is met
through the second. Nothing becomes stiff as the compliance goes to zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.beam import shear_factor
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.rotor.section import cells
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect, Values, scale_parameter
from thermospindle.sim.effects.roles import in_series, lacking, regions


@dataclass(frozen=True)
class Piece:
    """A piece of the beam, between two heights (m): EI (N m2), shear stiffness kappa G A (N) and EA (N)."""

    z: tuple[float, float]
    bending: float
    shear: float
    tension: float


def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
    scale = values["scale"]
    if scale == 0.0:
        return chain
    if idle(spindle) is not None or outside(spindle) is not None:
        return chain
    inner = spindle.all_bearings[0].inner_body
    bearings, joints = {b.name for b in spindle.all_bearings}, {j.name for j in spindle.structure.joints if inner in j.bodies}
    root = next((e.z for e in chain.elements if e.name in joints), chain.body(inner).z)
    node, *others = sorted((b.z for b in spindle.all_bearings), key=lambda z: abs(z - root))
    beam = pieces(spindle, condition.temperature)
    changed = []
    for e in chain.elements:
        if e.name in bearings and e.z in others:
            e = in_series(e, scale * flexibility(beam, node, e.z))
        elif e.name in joints and (e.z - node) * (root - node) > 0:
            e = in_series(moved(e, node), scale * flexibility(beam, e.z, node))
        changed.append(e)
    return replace(chain, elements=tuple(changed))


def idle(spindle: Spindle) -> str | None:
    structure = spindle.structure
    if structure.shafts and all(structure.carrier(b.inner_body) != b.inner_body for b in spindle.all_bearings):
        return "its flexible shafts bend already"
    if not regions(spindle, "shaft"):
        return lacking("region", "shaft")
    return None if len({b.z for b in spindle.all_bearings}) > 1 else "its bearings stand at one height"


def outside(spindle: Spindle) -> str | None:
    """A shaft that only its bearings hold is no cantilever."""
    inner = {b.inner_body for b in spindle.all_bearings}
    if len(inner) > 1:
        return "its inner rings sit on several bodies, of which none is the rigid shaft whose bending this puts in series"
    held = any(inner & set(j.bodies) for j in spindle.structure.joints)
    return None if held else f"the shaft {min(inner)!r} turns free between its bearings and is not held at one end"


def moved(element: Element, z: float) -> Element:
    """The same element told by the relative motion at another height: r(z_e) = B r(z), K -> B^T K B."""
    back = np.eye(5)
    back[0, 4], back[1, 3] = element.z - z, z - element.z
    return replace(element.told_by(back), z=z)


def flexibility(beam: Sequence[Piece], start: float, stop: float) -> Array:
    """Motion (5,) of a beam's free end at height `stop` by unit forces and moments there, clamped at `start`; order of MOVES."""
    along = np.sign(stop - start)
    found = np.zeros((5, 5))
    for piece in beam:
        a, b = max(piece.z[0], min(start, stop)), min(piece.z[1], max(start, stop))
        if b <= a:
            continue
        far, near = sorted((abs(stop - a), abs(stop - b)), reverse=True)  # distances from the free end
        lateral = (far**3 - near**3) / (3 * piece.bending) + (b - a) / piece.shear
        cross = along * (far**2 - near**2) / (2 * piece.bending)
        tilt = (b - a) / piece.bending
        found += np.diag([lateral, lateral, (b - a) / piece.tension, tilt, tilt])
        found[0, 4] += cross
        found[4, 0] += cross
        found[1, 3] -= cross
        found[3, 1] -= cross
    return found


def pieces(spindle: Spindle, temperature: float) -> list[Piece]:
    """The beam: the regions with role shaft."""
    own = regions(spindle, "shaft")
    owner = {g.name: spindle.materials[g.material] for g in own}
    slices: dict[tuple[float, float], list] = {}
    for cell in cells(own):
        slices.setdefault(cell.z, []).append(cell)
    found = []
    for z, tiles in slices.items():
        moduli = [owner[t.region].youngs_modulus(temperature) for t in tiles]
        areas = [np.pi * (t.r[1] ** 2 - t.r[0] ** 2) for t in tiles]
        tension = sum(e * a for e, a in zip(moduli, areas, strict=True))
        bending = sum(e * np.pi / 4 * (t.r[1] ** 4 - t.r[0] ** 4) for e, t in zip(moduli, tiles, strict=True))
        poisson = sum(e * a * owner[t.region].poisson_ratio for e, a, t in zip(moduli, areas, tiles, strict=True)) / tension
        factor = shear_factor(min(t.r[0] for t in tiles) / max(t.r[1] for t in tiles), poisson)
        found.append(Piece(z, bending, factor * tension / (2 * (1 + poisson)), tension))
    return found


EFFECT = Effect(
    name="shaft_bending",
    title="The shaft bends between flange and bearings",
    equation=(
        "F = scale [L^3 / 3EI + L / kappa G A, L^2 / 2EI; L^2 / 2EI, L / EI], axial L / EA, summed over the pieces of each span; "
        "far bearing K_s = (1 + K F)^-1 K; flange K_s = (1 + K F)^-1 K with K told at the near bearing "
        "(Timoshenko beam, shear factor of Cowper 1966)"
    ),
    parameters=(
        scale_parameter(
            typical=0.3,
            prior_sd=0.3,
            limits=(0.0, 5.0),
            meaning="the shaft's compliance in units of that of its drawn section without the rings on it",
            source=(
                "1 from section and handbook modulus, less up to a third by the rings bonded on it; assumed 0.3 where joints fitted to "
                "measured frequencies hold most of it already"
            ),
        ),
    ),
    sees="rocking modes lower at every temperature, and falling less with it, as part of the strain energy is no longer in the bearings",
    resembles=("hub_flexibility", "added_disk", "bond_softening", "flange_fit_loosening"),
    valid=(
        "shaft held at one end, far below its own bending modes (10 kHz here), light beside the hub: its mass at one height takes 4 % of "
        "the shifts at scale 0.3, 6 % at 1 (against a shaft in twelve slices); the bearings' equilibrium under axial load is not changed; "
        "measuring points on the shaft move with its part at the near bearing"
    ),
    chain=chain,
    idle=idle,
    outside=outside,
)
