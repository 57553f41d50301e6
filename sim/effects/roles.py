"""What a scene's parts are for, and the changes that several effects make to them.

A joint, body or region has a role where its scene gives it one; nothing is guessed from names, positions or volumes. An effect that finds
no part of its role has nothing to act on, and says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thermospindle.model.bearing.row import ring_speeds
from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Bearing, RollerBearing, Spindle
from thermospindle.model.rotor.chain import Element
from thermospindle.model.structure import Body
from thermospindle.model.types import Array


def joints(spindle: Spindle, role: str) -> list[str]:
    """Names of the joints with a role: mount (holds the base on the ground), plate (base against seat) or flange (holds the shaft)."""
    return [j.name for j in spindle.structure.joints if j.role == role]


def body(spindle: Spindle, role: str) -> Body | None:
    """The body with a role (base, seat, shaft, hub or housing); the first of several, None without one."""
    return next((b for b in spindle.structure.bodies if b.role == role), None)


def held(spindle: Spindle) -> set[str]:
    """The bearings one of whose rings is in a housing: in a body with that role, or in the ground, which then stands for a rigid one."""
    housings = {b.name for b in spindle.structure.bodies if b.role == "housing"} | {"ground"}
    return {b.name for b in spindle.all_bearings if b.inner_body in housings or b.outer_body in housings}


def turning_ring(spindle: Spindle, b: Bearing | RollerBearing) -> str:
    """Which ring of a bearing turns, inner or outer; inner where both do."""
    inner, outer = ring_speeds(spindle, b, 1.0)
    return "outer" if outer and not inner else "inner"


def regions(spindle: Spindle, role: str) -> list[Region]:
    """The section's regions with a role: shaft, hub, insert (bonded into the hub) or support (what holds the shaft)."""
    return [g for g in spindle.regions if g.role == role]


def materials(spindle: Spindle, role: str) -> tuple[str, ...]:
    """Names of the materials of the regions with a role, each once."""
    return tuple(dict.fromkeys(g.material for g in regions(spindle, role)))


def lacking(kind: str, *roles: str) -> str:
    """Why an effect has nothing to act on."""
    return f"the scene has no {kind} with role {' or '.join(map(repr, roles))}"


def with_stiffness(spindle: Spindle, factor: Mapping[str, float], tilt: Mapping[str, float] | None = None) -> Spindle:
    """The spindle with the stiffness of the joints named in `factor` multiplied, that against tilt by `tilt` (the same by default).

    The damping ratio stays, so that damping follows stiffness. The same spindle where `factor` is empty.
    """
    if not factor:
        return spindle
    tilt = factor if tilt is None else tilt
    changed = tuple(j.stiffer(factor[j.name], tilt[j.name]) if j.name in factor else j for j in spindle.structure.joints)
    return replace(spindle, structure=replace(spindle.structure, joints=changed))


def beyond(value: float, play: float) -> float:
    """What is left of a value, of either sign, after a play."""
    return float(np.sign(value) * max(abs(value) - play, 0.0))


def in_series(element: Element, flexibility: Array) -> Element:
    """The element with a lossless flexibility (5, 5) at its end.

    K_s = (1 + K F)^-1 K; its damping to first order of complex stiffness K + i omega D: (1 + K
    F)^-1 D (1 + F K)^-1. A loss factor is of K alone (`Element.lossy`).
    """
    pass_on = np.linalg.inv(np.eye(5) + element.stiffness @ flexibility)
    stiffness, damping = pass_on @ element.stiffness, pass_on @ element.damping @ pass_on.T
    lossless = flexibility if element.lossless is None else element.lossless + flexibility
    return replace(element, stiffness=(stiffness + stiffness.T) / 2, damping=(damping + damping.T) / 2, lossless=lossless)
