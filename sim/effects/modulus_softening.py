"""Every material's elastic modulus falls as it warms: joints and Hertz contacts soften.

Young's modulus of metals falls in proportion to their own expansion: the Anderson-Grueneisen parameter, -d ln K / d ln V, is 5 to 7
for almost all of them, and shear moduli fall a little faster. One number and the scene's expansion data give every material's slope.

The contacts get softened copies of the ball and ring materials. The section's own materials stay as they are, which spares finite elements
at every temperature; ring motions depend only on ratios of moduli (aluminium softens by 1 % against steel over 40 K), and get
the change of one softened state, solved once and kept, in proportion.
"""

from __future__ import annotations

from dataclasses import replace

from model.machine import Condition, Law, Material, RingMotion, Spindle
from sim.effect import Effect, Parameter, Values
from sim.effects.expansion_mismatch import ring_volume
from sim.effects.mount_compliance import with_stiffness
from thermal.expansion import expand

SLOPE = 22.0
"""-d ln E / d(thermal strain)."""

RANGE = (-100.0, 250.0)
"""Temperatures (C) between which a constant modulus is replaced by a falling one."""

RISE = 40.0
"""Temperature rise (K) of the softened state for ring motions."""

MOVED = ("inner_r", "inner_z", "outer_r", "outer_z")


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    scale = values["scale"]
    if scale == 0.0:
        return spindle
    materials = dict(spindle.materials)
    for name in {n for b in spindle.bearings for n in (b.ball_material, b.ring_material)}:
        copy = softened(spindle.materials[name], spindle.reference_temperature, scale)
        materials[copy.name] = copy
    bearings = tuple(
        replace(b, ball_material=_copy(spindle.materials[b.ball_material]), ring_material=_copy(spindle.materials[b.ring_material]))
        for b in spindle.bearings
    )
    support = spindle.materials[support_material(spindle)]
    factor = softening(support, condition.temperature, spindle.reference_temperature, scale)
    structure = with_stiffness(spindle, {j.name: factor for j in spindle.structure.joints}).structure
    return replace(spindle, materials=materials, bearings=bearings, structure=structure)


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Ring motions by the chamber's temperature as softer materials change them, to first order in the softening."""
    share = values["scale"] * (condition.temperature - spindle.reference_temperature) / RISE
    if share == 0.0:
        return by_bearing
    hard, soft = expand(spindle, condition.temperature), expand(_softened_section(spindle), condition.temperature)
    return {
        name: replace(m, **{k: getattr(m, k) + share * (getattr(soft[name], k) - getattr(hard[name], k)) for k in MOVED})
        for name, m in by_bearing.items()
    }


def _softened_section(spindle: Spindle) -> Spindle:
    """The spindle with every modulus as it is `RISE` above the reference temperature, at all temperatures."""
    materials = {}
    for name, material in spindle.materials.items():
        fall = 1 - SLOPE * material.thermal_expansion(spindle.reference_temperature) * RISE
        own = material.youngs_modulus
        materials[name] = replace(material, youngs_modulus=Law(own.temperature, tuple(fall * e for e in own.value)))
    return replace(spindle, materials=materials)


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


def support_material(spindle: Spindle) -> str:
    """The material every structure joint follows: the one that fills most of what belongs to no body of the chain.

    That is base plate and flange; in a scene that draws neither, most of the stationary part.
    """
    made_of = {name for b in spindle.structure.bodies for name in b.regions}
    standing = [g for g in spindle.regions if g.part == "stationary"]
    volume: dict[str, float] = {}
    for g in [g for g in standing if g.name not in made_of] or standing or spindle.regions:
        volume[g.material] = volume.get(g.material, 0.0) + ring_volume(g)
    return max(volume, key=lambda name: volume[name])


EFFECT = Effect(
    name="modulus_softening",
    title="Elastic moduli fall with temperature",
    equation=(
        "E(T) = E (1 - scale 22 eps(T)), eps the material's own thermal strain: d ln E / dT = -22 alpha, aluminium -5.1e-4/K, steel "
        "-2.5e-4/K (Anderson, Phys. Rev. 144 (1966) 553: -d ln K / d ln V = 5 to 7); joint stiffness ~ E of the support, Hertz "
        "K ~ 2 / ((1 - nu_b^2)/E_b + (1 - nu_r^2)/E_r); ring motions by thermo-elastic influence of the softened section"
    ),
    parameters=(
        Parameter(
            "scale",
            "1",
            neutral=0.0,
            typical=1.0,
            prior_sd=0.4,
            limits=(-1.0, 3.0),
            meaning="fall of the moduli in units of the typical one of metals",
            source=(
                "handbook slopes about room temperature: aluminium alloys -4.5 to -6e-4/K, steels -2.3 to -3e-4/K "
                "(ASM Handbook vols. 1 and 2, 1990)"
            ),
        ),
    ),
    sees=(
        "all modes fall together in proportion to temperature: base modes by half the support's slope (1 % over 40 K), bearing "
        "modes by less; nothing at the reference"
    ),
    resembles=("flange_fit_loosening", "mount_compliance", "plate_prestress", "preload_loss"),
    valid=(
        "metals without Invar anomaly, scenes whose moduli are constant; -100 to 250 C; ring motions to first order in the softening "
        "and for a uniform temperature (against finite elements with softened moduli: within 0.1 nm of the 8 nm they change by)"
    ),
    spindle=spindle,
    motions=motions,
)
