"""The hub's material, or that of the bearing rings or the shaft, expands more or less than its data sheet says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.machine import Condition, Law, Material, Region, Spindle
from sim.effect import Effect, Parameter, Values


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    hub = values["hub_expansion"]
    for name, error in ((main_material(spindle), hub), (spindle.bearings[0].ring_material, values["ring_share"] * hub)):
        if error != 0.0:
            spindle = with_material(spindle, expanding(spindle.materials[name], error))
    return spindle if values["shaft_share"] * hub == 0.0 else with_shaft(spindle, values["shaft_share"] * hub)


def expanding(material: Material, error: float) -> Material:
    law = material.thermal_expansion
    return replace(material, thermal_expansion=Law(law.temperature, tuple(v * (1 + error) for v in law.value)))


def with_material(spindle: Spindle, material: Material) -> Spindle:
    return replace(spindle, materials={**spindle.materials, material.name: material})


def with_shaft(spindle: Spindle, error: float) -> Spindle:
    """The standing body's parts but its bearing rings, of a steel of their own."""
    rings = {name for b in spindle.bearings for name in (b.inner_ring, b.outer_ring)}
    shaft = [g for g in spindle.regions if g.name in spindle.standing.regions and g.name not in rings]
    for name in {g.material for g in shaft}:
        spindle = with_material(spindle, replace(expanding(spindle.materials[name], error), name=f"{name} of the shaft"))
    regions = tuple(replace(g, material=f"{g.material} of the shaft") if g in shaft else g for g in spindle.regions)
    return replace(spindle, regions=regions)


def main_material(spindle: Spindle) -> str:
    """The material that fills most of the rotating part (overlaps counted for every region)."""
    volume: dict[str, float] = {}
    for g in spindle.regions:
        if g.part == "rotating":
            volume[g.material] = volume.get(g.material, 0.0) + ring_volume(g)
    return max(volume, key=lambda name: volume[name])


def ring_volume(region: Region) -> float:
    """Volume (m3) of a region's ring."""
    (r0, r1), (z0, z1) = region.r, region.z
    return float(np.pi * (r1**2 - r0**2) * (z1 - z0))


EFFECT = Effect(
    name="expansion_mismatch",
    title="Thermal expansion of hub, rings or shaft differs from its data sheet",
    equation=(
        "alpha_hub = (1 + hub_expansion) alpha_data sheet, for the material that fills most of the rotating part, wherever it is "
        "used, and alpha_rings = (1 + ring_share hub_expansion) alpha_data sheet for the rings' material, of which shaft and balls may be too, the shaft's further by shaft_share hub_expansion; ring motions follow by thermo-elastic influence: u = gain . strain"
    ),
    parameters=(
        Parameter(
            "hub_expansion",
            "1",
            neutral=0.0,
            typical=0.05,
            prior_sd=0.04,
            limits=(-0.3, 0.3),
            meaning="relative error of the expansion coefficient of the hub's main material",
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
)
