"""Every material's elastic modulus falls as it warms: joints and Hertz contacts soften.

Young's modulus of metals falls in proportion to their own expansion: the Anderson-Grueneisen parameter, -d ln K / d ln V, is 4 to 7
for most of them, and shear moduli fall a little faster. One number and the scene's expansion data give every material's slope.

The contacts get softened copies of the ball and ring materials. The section's own stay as they are, which spares finite elements at every
temperature; ring motions depend only on ratios of moduli (aluminium softens by 1 % against steel over 40 K), and get
their change by every material's modulus, solved once and kept, in proportion.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
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

STEP = 0.02
"""Relative fall of one modulus for the sensitivity of ring motions: far above rounding, still linear."""


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
        j.name: softening(spindle.materials[j.material], condition.temperature, spindle.reference_temperature, share)
        for j in spindle.structure.joints
        if j.material
    }
    structure = with_stiffness(spindle, factor).structure
    return replace(spindle, materials=materials, bearings=bearings, roller_bearings=rollers, structure=structure)


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Ring motions by the chamber's temperature as softer materials change them, to first order in the softening."""
    from thermospindle.thermal.influence import every_race  # finite elements, which the catalogue is read without

    scale = values["scale"]
    if scale == 0.0 or condition.temperature == spindle.reference_temperature:
        return by_bearing
    used = {name: spindle.materials[name] for name in dict.fromkeys(g.material for g in spindle.regions)}
    strain = {name: m.thermal_strain(condition.temperature, spindle.reference_temperature) for name, m in used.items()}
    change: dict[Race, Array] = {}
    for found in sensitivity(spindle):
        softer = found.gain @ np.array([strain[name] for name in found.strained])
        moved = scale * SLOPE * np.array([strain[name] for name in found.materials]) @ softer
        change |= dict(zip(found.races, moved.reshape(-1, 2), strict=True))
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


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """How softer materials change the thermal motion of one part's rings.

    `gain` (materials, 2 rings, regions): r and z motion (m) by the thermal strain of each region and the relative fall of one
    material's modulus; `strained` names the material of each region.
    """

    races: tuple[Race, ...]
    materials: tuple[str, ...]
    strained: tuple[str, ...]
    gain: Array


@dataclass(frozen=True)
class Section:
    """A spindle as its elastic section sees it: equal `key`, equal sensitivity."""

    key: tuple
    spindle: Spindle = field(compare=False, repr=False)


def sensitivity(spindle: Spindle) -> tuple[Sensitivity, ...]:
    """Solved once for each section and set of moduli, part by part."""
    from thermospindle.thermal.influence import every_race

    moduli = tuple(
        (m.youngs_modulus(spindle.reference_temperature), m.poisson_ratio) for m in (spindle.materials[g.material] for g in spindle.regions)
    )
    faces = tuple(every_race(spindle).values())
    return _sensitivity(Section((spindle.regions, moduli, faces), spindle))


@lru_cache(maxsize=8)
def _sensitivity(section: Section) -> tuple[Sensitivity, ...]:
    from thermospindle.thermal.influence import influence, on_its_mesh

    spindle = section.spindle
    found = []
    for part, hard in influence(spindle).responses.items():
        strained = tuple(spindle.region(name).material for name in hard.section.regions)
        used = tuple(dict.fromkeys(strained))
        gains = [on_its_mesh(spindle, _softer(spindle, name), part).gain if len(used) > 1 else hard.gain for name in used]
        found.append(Sensitivity(hard.races, used, strained, (np.array(gains) - hard.gain) / STEP))
    return tuple(found)


def _softer(spindle: Spindle, name: str) -> Spindle:
    """The spindle with the modulus of one material lower by `STEP`."""
    material = spindle.materials[name]
    law = Law(material.youngs_modulus.temperature, tuple((1 - STEP) * e for e in material.youngs_modulus.value))
    return replace(spindle, materials={**spindle.materials, name: replace(material, youngs_modulus=law)})


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
        "-2.5e-4/K (Anderson, Phys. Rev. 144, 1966: on -d ln K / d ln V); joint stiffness ~ E of the joint's own material (joint_share of its fall; none where the scene names none), Hertz "
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
            meaning="softening of the structure's joints over that of the support's material",
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
