"""Variants of effects of the structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.ball_row import Array
from model.machine import Body, Condition, Spindle
from model.rotor_base import Element, RotorBase
from tests.variants.variant import each_element, in_series, step, variant, warm, with_joint, with_mass


def flange_tilts(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """Tilt stiffness of the flange falls by `size` from 20 to 60 C."""
    k = 1 - size * warm(condition.temperature)
    return with_joint(spindle, "flange", (1, 1, 1, k, k))


def flange_slips(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """From 35 C on the fit opens: all of the joint softens, to 1 / (1 + size) at 60 C, and rubs."""
    part = size * step(condition.temperature, 35, 60)
    return with_joint(spindle, "flange", (1 / (1 + part),) * 5, 1 + 5 * part)


def soft_feet(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return with_joint(spindle, "mount", (1 / (1 + size),) * 5)


def feet_soften(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return with_joint(spindle, "mount", (1 / (1 + size * warm(condition.temperature)),) * 5)


def plate_stiffens(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    return with_joint(spindle, "plate", (1 + size * warm(condition.temperature),) * 5)


def plate_nears_buckling(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """k (1 - N / N_cr) axially, N in proportion to T - 28 C, where the screws have no play left; half of it in tilt."""
    part = size * step(condition.temperature, 28, 60)
    return with_joint(spindle, "plate", (1, 1, 1 - part, 1 - part / 2, 1 - part / 2))


def plate_and_flange_split(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    for name in ("plate", "flange"):
        spindle = with_joint(spindle, name, (1, 1, 1, 1 + size / 2, 1 - size / 2))
    return spindle


def flange_slotted(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """A slot lets the flange tilt about y and slide along x more easily."""
    return with_joint(spindle, "flange", (1 - size, 1, 1, 1, 1 - size))


EI = 208e9 * np.pi / 4 * 2.5e-3**4  # N m2, of the shaft


def cantilever(length: float) -> Array:
    """Compliance (5, 5) at the root's height of a rigid arm on the tip of a cantilever along z (Euler-Bernoulli)."""
    u, mixed, tilt = length**3 / 3 / EI, length**2 / 2 / EI, length / EI
    c = np.diag([u, u, 0.0, tilt, tilt])
    c[0, 4] = c[4, 0] = -mixed
    c[1, 3] = c[3, 1] = mixed
    return c


def shaft_on_flange(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """A share of the shaft's bending from flange (z = 1 mm) to the middle of the bearings, in series with the flange joint."""
    return each_element(chain, ("flange",), lambda e: in_series(e, size * cantilever(9.75e-3)))


def shaft_at_bearings(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """Each bearing on a lateral spring, L^3 / (3 E I) of its own height."""

    def change(e: Element) -> Element:
        c = size * (e.z - 1e-3) ** 3 / (3 * EI)
        return in_series(e, np.diag([c, c, 0.0, 0.0, 0.0]))

    return each_element(chain, ("lower", "upper"), change)


def web_at_bearings(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """The hub tilts against each outer ring by `size` urad/(N m)."""
    compliance = np.diag([0.0, 0.0, 0.0, 1e-6 * size, 1e-6 * size])
    return each_element(chain, ("lower", "upper"), lambda e: in_series(e, compliance))


def rim(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """A rim, 3 tenths of the hub's mass and 5 of its inertia, that tilts on the rest by `size` urad/(N m)."""
    if size == 0:
        return chain
    hub = chain.body("hub")

    def share(mass: float, inertia: float) -> tuple[float, tuple[float, float, float]]:
        return mass * hub.mass, (inertia * hub.inertia[0], inertia * hub.inertia[1], inertia * hub.inertia[2])

    mass, inertia = share(0.7, 0.5)
    core = replace(hub, mass=mass, inertia=inertia)
    mass, inertia = share(0.3, 0.5)
    outside = Body("rim", mass, inertia, hub.z, hub.moves, True, ())
    k = np.diag([1e11, 1e11, 1e11, 1e6 / size, 1e6 / size])  # displacements go along
    web = Element("web", "hub", "hub", "rim", hub.z, k, 2 * 0.005 / (2 * np.pi * 1500) * k)
    bodies = tuple(core if b.name == "hub" else b for b in chain.bodies)
    return replace(chain, bodies=(*bodies, outside), elements=(*chain.elements, web))


def circle(radius: float, height: float) -> Array:
    angle = np.pi / 4 * np.arange(8)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(8, height)], axis=1)


def disk(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """`size` g on the hub plate; a thin annulus from 10 to 24 mm has its radius of gyration at 18.4 mm."""
    return with_mass(chain, "hub", 1e-3 * size / 8, circle(18.4e-3, 9e-3))


def clamp(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    return with_mass(chain, "hub", 1e-3 * size / 8, circle(9e-3, 21e-3))


def sensors(spindle: Spindle, chain: RotorBase, grams: float, nodes: tuple[int, ...]) -> RotorBase:
    for node in nodes:
        point = spindle.point(node)
        chain = with_mass(chain, point.body, 1e-3 * grams, np.array([point.position]))
    return chain


def sensors_everywhere(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    return sensors(spindle, chain, size, tuple(p.node for p in spindle.points))


def sensors_on_hub(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    return sensors(spindle, chain, size, (1, 2))


STRUCTURE = (
    variant("flange_fit_loosening/tilt", "the flange tilts more easily when warm", "1", 0.05, 0.5, spindle=flange_tilts),
    variant("flange_fit_loosening/slips", "the fit opens at 35 C", "1", 0.01, 0.3, spindle=flange_slips),
    variant("mount_compliance/constant", "a spring under the mount", "1", 0.05, 0.2, spindle=soft_feet),
    variant("mount_compliance/when_warm", "the mount softens", "1", 0.002, 0.1, spindle=feet_soften),
    variant("plate_prestress/stiffens", "thermal tension in the plate", "1", 0.002, 0.1, spindle=plate_stiffens),
    variant("plate_prestress/buckling", "the plate nears buckling", "1", 0.003, 0.15, spindle=plate_nears_buckling),
    variant("support_anisotropy/split", "plate and flange split", "1", 0.06, 0.25, spindle=plate_and_flange_split),
    variant("support_anisotropy/slot", "a slotted flange", "1", 0.12, 0.5, spindle=flange_slotted),
    variant("shaft_bending/series", "the shaft bends above the flange", "1", 0.005, 0.1, chain=shaft_on_flange),
    variant("shaft_bending/at_bearings", "the shaft gives way at the bearings", "1", 0.01, 0.1, chain=shaft_at_bearings),
    variant("hub_flexibility/web", "the hub tilts on its rings", "urad/(N m)", 20.0, 500.0, chain=web_at_bearings),
    variant("hub_flexibility/rim", "a rim on a web", "urad/(N m)", 50.0, 800.0, chain=rim),
    variant("added_disk/annulus", "a disk on the hub plate", "g", 0.2, 2.0, chain=disk),
    variant("added_disk/clamp", "a clamp ring on the hub", "g", 0.2, 2.0, chain=clamp),
    variant("sensor_mass/everywhere", "an accelerometer at every point", "g", 0.05, 0.8, chain=sensors_everywhere),
    variant("sensor_mass/on_hub", "two accelerometers on the hub", "g", 0.1, 1.0, chain=sensors_on_hub),
)
