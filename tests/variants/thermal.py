"""Variants of effects of temperature and expansion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.machine import Condition, RingMotion, Spindle
from tests.variants.variant import REST, Told, falling_modulus, scaled_expansion, turning, variant, with_joint, with_material

INNER = ("lower inner ring", "upper inner ring")
OUTER = ("lower outer ring", "upper outer ring")
PER_KELVIN = {"aluminium": 4.8e-4, "steel": 2.6e-4, "yoke": 2.6e-4, "magnet": 3.0e-4}
"""Relative fall of Young's modulus, 1/K, about room temperature: slopes of handbook curves."""

Temperatures = dict[str, float]


def rotating(spindle: Spindle) -> list[str]:
    return [g.name for g in spindle.regions if g.part == "rotating"]


def moduli_of_joints_and_contacts(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """The aluminium of mount, plate and flange, and the steel of balls and races; the ratios of the section's moduli stay."""
    soft = 1 - size * PER_KELVIN["aluminium"] * (condition.temperature - 20)
    for joint in ("mount", "plate", "flange"):
        spindle = with_joint(spindle, joint, (soft,) * 5)
    contact = falling_modulus(spindle.materials["steel"], size * PER_KELVIN["steel"], "steel of the contacts")
    bearings = tuple(replace(b, ball_material=contact.name, ring_material=contact.name) for b in spindle.bearings)
    return replace(with_material(spindle, contact), bearings=bearings)


def moduli_of_materials(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """Every material of the section, so finite elements and Hertz contacts; the joints stay."""
    for name, slope in PER_KELVIN.items():
        spindle = with_material(spindle, falling_modulus(spindle.materials[name], size * slope, name))
    return spindle


def shaft_hotter(spindle: Spindle, condition: Condition, size: float, by_region: Temperatures) -> Temperatures:
    """Shaft and inner rings `size` K hotter at 7200 rpm, in proportion to speed."""
    return by_region | {name: by_region[name] + size * turning(condition.speed) for name in ("shaft", *INNER)}


def viscous_heat(spindle: Spindle, condition: Condition, size: float, by_region: Temperatures) -> Temperatures:
    """A viscous torque, speed^(2/3), thins as the grease warms, exp(-0.02 (T - 20)); `size` K on the inner rings at 7200 rpm and 20 C."""
    rise = size * turning(condition.speed) ** (5 / 3) * np.exp(-0.02 * (condition.temperature - 20))
    share = dict.fromkeys(INNER, 1.0) | {"shaft": 0.8, "flange boss": 0.3} | dict.fromkeys(OUTER, 0.35) | {"sleeve": 0.2}
    return {name: t + float(rise) * share.get(name, 0.0) for name, t in by_region.items()}


def hub_lags(spindle: Spindle, condition: Condition, size: float, by_region: Temperatures) -> Temperatures:
    return by_region | {name: 20 + (1 - size) * (by_region[name] - 20) for name in rotating(spindle)}


def hub_warms_with_time(spindle: Spindle, condition: Condition, size: float, by_region: Temperatures) -> Temperatures:
    """Newton's law with a time constant of `size` s for the hub; the balls and races follow by the mean of their rings."""
    return hub_lags(spindle, condition, float(np.exp(-condition.soak_time / size)) if size > 0 else 0.0, by_region)


def hub_alloy(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    alloy = scaled_expansion(spindle.materials["aluminium"], 1 + size, "hub alloy")
    ours = [g.name for g in spindle.regions if g.part == "rotating" and g.material == "aluminium"]
    regions = tuple(replace(g, material=alloy.name) if g.name in ours else g for g in spindle.regions)
    return replace(with_material(spindle, alloy), regions=regions)


def shaft_steel(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """A shaft that expands by `size` less than its data sheet says, in rings that follow theirs."""
    steel = scaled_expansion(spindle.materials["steel"], 1 - size, "shaft steel")
    regions = tuple(replace(g, material=steel.name) if g.name == "shaft" else g for g in spindle.regions)
    return replace(with_material(spindle, steel), regions=regions)


def soft_motor(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """Yoke and magnet restrain the hub with (1 - size) of their stiffness."""
    for name in ("yoke", "magnet"):
        m = spindle.materials[name]
        e = replace(m.youngs_modulus, value=tuple((1 - size) * v for v in m.youngs_modulus.value))
        spindle = with_material(spindle, replace(m, youngs_modulus=e))
    return spindle


def rings_grow(spindle: Spindle, condition: Condition, size: float, motions: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Thin steel ring, u = rho w^2 r^3 / E at its mean radius, `size` times."""
    steel = spindle.materials["steel"]
    grown = {}
    for b in spindle.bearings:
        r = float(np.mean(spindle.region(b.outer_ring).r))
        u = steel.density * condition.speed**2 * r**3 / steel.youngs_modulus(20.0)
        grown[b.name] = replace(motions[b.name], outer_r=motions[b.name].outer_r + size * u)
    return grown


def hub_pulls_rings(spindle: Spindle, condition: Condition, size: float, motions: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """The bore of a turning annulus of the hub's radii, u = rho w^2 a / (4 E) ((3 + nu) b^2 + (1 - nu) a^2) (Timoshenko), carries the rings."""
    al = spindle.materials["aluminium"]
    grown = {}
    for b in spindle.bearings:
        a, o = spindle.region(b.outer_ring).r[1], max(spindle.region(n).r[1] for n in ("hub body", "hub plate"))
        u = (
            al.density
            * condition.speed**2
            * a
            / (4 * al.youngs_modulus(20.0))
            * ((3 + al.poisson_ratio) * o**2 + (1 - al.poisson_ratio) * a**2)
        )
        grown[b.name] = replace(motions[b.name], outer_r=motions[b.name].outer_r + size * u)
    return grown


SOAKS: tuple[Told, ...] = (*tuple((float(t), 0.0, None, s) for t in (20, 40, 60) for s in (1200.0, 3600.0)), (50.0, 0.0, None, 2400.0))
FAST: tuple[Told, ...] = (*REST[::2], *((float(t), n, None, None) for n in (7200.0, 20000.0) for t in (20, 60)))

THERMAL = (
    variant("modulus_softening/joints_and_contacts", "E falls in joints and Hertz contacts", "1", 0.1, 1.5, spindle=moduli_of_joints_and_contacts),
    variant("modulus_softening/materials_only", "E falls in the section's materials and contacts", "1", 0.3, 1.5, spindle=moduli_of_materials),
    variant("thermal_gradient/in_proportion", "shaft and inner rings hotter with speed", "K", 0.3, 6.0, temperatures=shaft_hotter),
    variant("thermal_gradient/viscous", "viscous friction heats the bearings", "K", 0.4, 8.0, temperatures=viscous_heat),
    variant("soak_lag/hub", "the hub's rise falls short", "1", 0.005, 0.25, temperatures=hub_lags),
    variant("soak_lag/told_time", "the hub warms with a time constant", "s", 300.0, 1000.0, plan=SOAKS, temperatures=hub_warms_with_time),
    variant("expansion_mismatch/hub_alloy", "another aluminium in the hub", "1", 0.01, 0.1, spindle=hub_alloy),
    variant("expansion_mismatch/shaft_steel", "another steel in the shaft", "1", 0.02, 0.15, spindle=shaft_steel),
    variant(
        "loose_inserts/soft_motor", "yoke and magnet restrain the hub less", "1", 0.05, 0.8,
        truth=("loose_inserts", "expansion_mismatch"), spindle=soft_motor,
    ),
    variant("ring_growth/thin_ring", "the steel ring grows at speed", "1", 1.0, 5.0, plan=FAST, motions=rings_grow),
    variant("ring_growth/hub", "the hub grows at speed and takes the rings along", "1", 0.3, 1.0, plan=FAST, motions=hub_pulls_rings),
)  # fmt: skip
