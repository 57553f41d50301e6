"""The hub's material, or that of the bearing rings or the shaft, expands more or less than its data sheet says."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Material, Spindle
from thermospindle.model.material import Law
from thermospindle.sim.effects.effect import SECTION, Effect, Parameter, Values
from thermospindle.sim.effects.roles import lacking, materials


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    hub = values["hub_expansion"]
    rings = dict.fromkeys(b.ring_material for b in spindle.rolling)
    errors = [(name, hub) for name in carrying(spindle)] + [(name, values["ring_share"] * hub) for name in rings]
    for name, error in errors:
        if error != 0.0:
            spindle = with_material(spindle, expanding(spindle.materials[name], error))
    return spindle if values["shaft_share"] * hub == 0.0 else with_shaft(spindle, values["shaft_share"] * hub)


def carrying(spindle: Spindle) -> tuple[str, ...]:
    """Materials of what holds the outer rings: the hub, or in a spindle without one the housing."""
    return materials(spindle, "hub") or materials(spindle, "support")


def expanding(material: Material, error: float) -> Material:
    law = material.thermal_expansion
    return replace(material, thermal_expansion=Law(law.temperature, tuple(v * (1 + error) for v in law.value)))


def with_material(spindle: Spindle, material: Material) -> Spindle:
    return replace(spindle, materials={**spindle.materials, material.name: material})


def with_shaft(spindle: Spindle, error: float) -> Spindle:
    """The shaft's regions, of a steel of their own."""
    for name in materials(spindle, "shaft"):
        spindle = with_material(spindle, replace(expanding(spindle.materials[name], error), name=f"{name} of the shaft"))
    changed = tuple(replace(g, material=f"{g.material} of the shaft") if g.role == "shaft" else g for g in spindle.regions)
    return replace(spindle, regions=changed)


def idle(spindle: Spindle) -> str | None:
    return None if carrying(spindle) else lacking("region", "hub", "support")


EFFECT = Effect(
    name="expansion_mismatch",
    title="Thermal expansion of hub, housing, rings or shaft differs from its data sheet",
    equation=(
        "alpha_hub = (1 + hub_expansion) alpha_data sheet, for the materials of the regions with role hub (without one support, the housing), wherever they "
        "are used, and alpha_rings = (1 + ring_share hub_expansion) alpha_data sheet for the rings' material, of which shaft and balls may be too, the shaft's further by shaft_share hub_expansion; ring motions follow by thermo-elastic influence: u = gain . strain"
    ),
    parameters=(
        Parameter(
            "hub_expansion",
            "1",
            neutral=0.0,
            typical=0.05,
            prior_sd=0.04,
            limits=(-0.3, 0.3),
            meaning="relative error of the expansion coefficient of the hub's main material; of the housing's in a spindle without hub",
            source="spread of wrought and cast aluminium alloys, 21 to 24.5e-6/K (ASM Handbook vol. 2, 1990)",
        ),
        Parameter(
            "ring_share",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.7,
            limits=(-5.0, 5.0),
            meaning="relative error of the expansion coefficient of the rings' material over that of the hub's",
            source="bearing steel 11.5 to 12.5e-6/K by its makers and its retained austenite; stainless shafts 10 to 11e-6/K",
        ),
        Parameter(
            "shaft_share",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.7,
            limits=(-5.0, 5.0),
            meaning="further relative error of the shaft's expansion coefficient, over that of the hub's",
            source="the shaft's steel is another than the rings', by as much",
        ),
    ),
    sees="bearing modes fall more with temperature (less for a negative error), in proportion to the rise; nothing at the reference",
    resembles=("loose_inserts", "soak_lag", "clearance_opening", "preload_loss", "constant_force_preload"),
    valid=(
        "small errors; a material that the stationary part uses too changes there as well, which moves the rings little where "
        "they sit on a shaft of another material"
    ),
    spindle=spindle,
    idle=idle,
    acts_on=(SECTION,),
    exact=True,
)
