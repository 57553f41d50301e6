"""Modes at the speed of what turns, which its unbalance drives, and how strongly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.model.carrier import turning_parts, unbalance_carrier
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.rotor.poles import Poles
from thermospindle.model.types import Array
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.resonance.point import UNIT_UNBALANCE, orbit
from thermospindle.sim.running.whirl import whirling

SENSE = 0.01
"""Least share of the modal force that the sense of whirl of a line must have; a forward line finds no backward mode of an isotropic rotor."""


@dataclass(frozen=True)
class Critical:
    """A mode near the speed (rad/s, with its sign) of parts that turn together.

    `sense`: share of the modal forces of unbalances all along the parts that their own sense of whirl has, |psi
    f|^2 of |psi f|^2 + |psi f*|^2 (1: a mode that whirls with them, 1/2: a standing one); `moved` (m, long half
    axis): how far `unbalance` (kg m) at the height `z` (m) moves its place in that mode alone, at resonance,
    inf of an undamped one; `of_scene`: the unbalance is the scene's, else `UNIT_UNBALANCE` where it does most.
    """

    parts: tuple[str, ...]
    speed: float
    mode: Mode
    sense: float
    moved: float
    unbalance: float
    z: float
    of_scene: bool


def criticals(point: OperatingPoint, near: float) -> list[Critical]:
    """Modes within `near` (relative) of the speed of a part that unbalance on it drives, in order of speed and frequency; none at rest."""
    structure = point.spindle.structure
    of_speed: dict[float, list[str]] = {}
    for part in turning_parts(point.spindle):
        ratio = next(b.speed_ratio for b in structure.bodies if structure.carrier(b.name) == part)
        of_speed.setdefault(point.condition.speed * ratio, []).append(part)
    met = [
        (tuple(parts), speed, mode)
        for speed, parts in sorted(of_speed.items(), key=lambda item: abs(item[0]))
        for mode in point.modes
        if speed and mode.kind != "axial" and abs(2 * np.pi * mode.frequency / abs(speed) - 1) < near
    ]
    if not met:
        return []
    p = point.poles
    return [found for each in met if (found := _driven(point, p, *each)) is not None]


def _driven(point: OperatingPoint, p: Poles, parts: tuple[str, ...], speed: float, mode: Mode) -> Critical | None:
    """The mode as the unbalance of parts drives it, or None where none can."""
    structure, own = point.spindle.structure, point.imperfections
    at = int(np.argmin(np.abs(p.value - mode.pole)))

    def rows(body: str, z: float) -> Array:
        return motion_rows(point.chain, body, (0.0, 0.0, z))[:2]

    places = [(b.name, b.z) for b in structure.bodies if structure.carrier(b.name) in parts]
    felt = np.array([p.left[at] @ (whirling(1.0, speed) @ rows(*place)) for place in places])
    against = np.array([p.left[at] @ (whirling(1.0, -speed) @ rows(*place)) for place in places])
    with_it, against_it = float(np.sum(np.abs(felt) ** 2)), float(np.sum(np.abs(against) ** 2))
    if with_it < SENSE * (with_it + against_it) or with_it == 0.0:
        return None
    carrier = unbalance_carrier(point.spindle, own) if own.unbalance else None
    of_scene = carrier is not None and structure.carrier(carrier.name) in parts
    if carrier is not None and of_scene:
        body, z, amount = carrier.name, own.unbalance_z, own.unbalance
    else:
        (body, z), amount = places[int(np.argmax(np.abs(felt)))], UNIT_UNBALANCE
    modal = complex(p.left[at] @ (whirling(amount, speed) @ rows(body, z))) * speed**2
    away = abs(2j * np.pi * mode.frequency - p.value[at])
    moved = orbit(*(rows(body, z) @ p.right[:, at] * modal / away)) if away else np.inf
    return Critical(parts, speed, mode, with_it / (with_it + against_it), moved, amount, z, of_scene)
