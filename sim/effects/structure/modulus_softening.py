"""Every material's elastic modulus falls as it warms: joints and Hertz contacts soften.

Young's modulus of metals falls in proportion to their own expansion: the Anderson-Grueneisen parameter, -d ln K / d ln V, is 4 to 7
for most of them, and shear moduli fall a little faster. One number and the scene's expansion data give every material's slope.

The contacts get softened copies of the ball and ring materials. The section's own stay as they are, which spares finite elements at every
temperature; ring motions depend only on ratios of moduli (aluminium softens by 1 % against steel over 40 K), and get
their change by every region's modulus, which the influence holds, in proportion.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from thermospindle.model.machine import Condition, Material, RingMotion, Spindle
from thermospindle.model.material import Law
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect, Parameter, Values, scale_parameter
from thermospindle.sim.effects.roles import with_stiffness

if TYPE_CHECKING:
    from thermospindle.thermal.elastic import Race

SLOPE = 22.0
"""-d ln E / d(thermal strain)."""

RANGE = (-100.0, 250.0)
"""Temperatures (C) between which a constant modulus is replaced by a falling one."""


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    scale = values["scale"]
    if scale == 0.0:
        return spindle
    materials = dict(spindle.materials)
    own = {n for b in spindle.bearings for n in (b.ball_material, b.ring_material)} | {n for b in spindle.roller_bearings for n in (b.roller_material, b.ring_material)}
    for name in own:
        copy = softened(spindle.materials[name], spindle.reference_temperature, scale)
        materials[copy.name] = copy
    bearings = tuple(
        replace(b, ball_material=_copy(spindle.materials[b.ball_material]), ring_material=_copy(spindle.materials[b.ring_material]))
        for b in spindle.bearings
    )
    rollers = tuple(
        replace(b, roller_material=_copy(spindle.materials[b.roller_material]), ring_material=_copy(spindle.materials[b.ring_material])) for b in spindle.roller_bearings
    )
    share = scale * values["joint_share"]
    factor = {
        j.name: softening(spindle.materials[j.material], condition.temperature, spindle.reference_temperature, scale if j.role == "beam" else share)
        for j in spindle.structure.joints
        if j.material
    }
    structure = with_stiffness(spindle, factor).structure
    return replace(spindle, materials=materials, bearings=bearings, roller_bearings=rollers, structure=structure)


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Ring motions by the chamber's temperature as softer materials change them, to first order in the softening."""
    from thermospindle.thermal.influence import at_reference, every_race  # finite elements, which the catalogue is read without

    scale = values["scale"]
    if scale == 0.0 or condition.temperature == spindle.reference_temperature:
        return by_bearing
    change: dict[Race, Array] = {}
    for response in at_reference(spindle):
        made_of = (spindle.materials[spindle.region(name).material] for name in response.section.regions)
        strain = np.array([m.thermal_strain(condition.temperature, spindle.reference_temperature) for m in made_of])
        moved = -scale * SLOPE * response.stiffening @ strain @ strain
        change |= dict(zip(response.races, moved.reshape(-1, 2), strict=True))
    changed = {}
    for b in spindle.ringed:
        motion, (inner, outer) = by_bearing[b.name], (change[race] for race in every_race(spindle)[b.name])
        changed[b.name] = replace(
            motion,
            inner_r=motion.inner_r + float(inner[0]),
            inner_z=motion.inner_z + float(inner[1]),
            outer_r=motion.outer_r + float(outer[0]),
            outer_z=motion.outer_z + float(outer[1]),
        )
    return by_bearing | changed


def softening(material: Material, temperature: float, reference: float, scale: float = 1.0) -> float:
    """E(temperature) / E(reference), beyond what the material's own law holds."""
    return 1 - scale * SLOPE * material.thermal_strain(temperature, reference)


def softened(material: Material, reference: float, scale: float) -> Material:
    """A copy of the material, under a name of its own, with a falling modulus."""
    own, expansion = material.youngs_modulus, material.thermal_expansion
    tables = [law.temperature for law in (own, expansion) if len(law.value) > 1]
    low, high = max((t[0] for t in tables), default=RANGE[0]), min((t[-1] for t in tables), default=RANGE[1])
    knots = tuple(sorted({low, high, *(t for table in tables for t in table if low < t < high)}))
    law = Law(knots, tuple(own(t) * softening(material, t, reference, scale) for t in knots))
    return replace(material, name=_copy(material), youngs_modulus=law)


def _copy(material: Material) -> str:
    return f"{material.name} in contact"


EFFECT = Effect(
    name="modulus_softening",
    title="Elastic moduli fall with temperature",
    equation=(
        "E(T) = E (1 - scale 22 eps(T)), eps the material's own thermal strain: d ln E / dT = -22 alpha, aluminium -5.1e-4/K, steel "
        "-2.5e-4/K (Anderson, Phys. Rev. 144, 1966: on -d ln K / d ln V); shafts ~ E of theirs, joint stiffness ~ E of the joint's own material (joint_share of its fall; none where the scene names none), Hertz "
        "K ~ 2 / ((1 - nu_b^2)/E_b + (1 - nu_r^2)/E_r); ring motions by thermo-elastic influence of the softened section"
    ),
    parameters=(
        scale_parameter(
            typical=1.0,
            prior_sd=0.4,
            limits=(-1.0, 3.0),
            meaning="fall of the moduli in units of the typical one of metals",
            source=(
                "handbook slopes about room temperature: aluminium alloys -4.5 to -6e-4/K, steels -2.3 to -3.3e-4/K (carbon steel "
                "203.4 GPa at 21 C, 198.6 at 93 C: Roark, Formulas for Stress and Strain)"
            ),
        ),
        Parameter(
            "joint_share",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=0.3,
            limits=(0.0, 2.0),
            meaning="softening of the structure's joints over that of their material; a shaft's beams have all of theirs",
            source="1 for parts bending; half for steel screws in aluminium, 0 where contact pressure, not modulus, makes the stiffness",
        ),
    ),
    sees=(
        "all modes fall together in proportion to temperature: base modes by half the support's slope (1 % over 40 K), bearing "
        "modes by less; nothing at the reference"
    ),
    resembles=("flange_fit_loosening", "mount_compliance", "plate_prestress", "preload_loss"),
    valid=(
        "metals without Invar anomaly, scenes whose moduli are constant; -100 to 250 C; ring motions to first order in the softening "
        "and for a uniform temperature (against finite elements with softened moduli: within 0.2 nm of the 8 nm they change by over 40 K)"
    ),
    spindle=spindle,
    motions=motions,
)
