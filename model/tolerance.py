"""The spindle's toleranced parameters: what a built spindle may differ in from its drawing, each with one standard deviation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from thermospindle.model.bearing.hertz import in_series
from thermospindle.model.bearing.pair import contact_constants, reference_deformation, reference_motion
from thermospindle.model.machine import MOVES, Body, Joint, Spindle


@dataclass(frozen=True)
class Toleranced:
    """One parameter: `apply(spindle, x)` returns the spindle with it at (1 + x) times its nominal value; `sd` is that of x."""

    name: str
    sd: float
    apply: Callable[[Spindle, float], Spindle]


def toleranced(spindle: Spindle) -> list[Toleranced]:
    """Every toleranced build parameter of a spindle: stiffnesses, masses, inertias, preload, damping ratios."""
    t = spindle.tolerances
    found = []
    for j, joint in enumerate(spindle.structure.joints):
        for name, moves in (("axial", (2,)), ("lateral", (0, 1)), ("tilt", (3, 4))):
            equal = len({joint.stiffness[m] for m in moves}) == 1
            for group in [moves] if equal else [(m,) for m in moves]:
                if joint.stiffness[group[0]] > 0:
                    label = name if equal else MOVES[group[0]].replace("_", " ")
                    found.append(Toleranced(f"{joint.name} {label} stiffness", t.structure, _scale_stiffness(j, group)))
        found.append(Toleranced(f"{joint.name} damping", t.damping, _scale_joint_damping(j)))
    for b, body in enumerate(spindle.structure.bodies):
        sd = t.hub if body.turns else t.structure
        if not body.regions or body.turns:
            found.append(Toleranced(f"{body.name} mass", sd, _scale_mass(b)))
            if body.turns:
                found.append(Toleranced(f"{body.name} inertia", sd, _scale_inertia(b, (0, 1, 2))))
            else:
                tilts = [i for i, move in enumerate(("tilt_x", "tilt_y")) if move in body.moves]
                found += [Toleranced(f"{body.name} tilt {'xy'[i]} inertia", sd, _scale_inertia(b, (i,))) for i in tilts]
    found.append(Toleranced("preload", t.preload, lambda s, x: with_preload(s, s.pair.preload * (1 + x))))
    found.append(Toleranced("bearing damping", t.damping, _scale_bearing_damping))
    return found


def with_preload(spindle: Spindle, preload: float) -> Spindle:
    """The same parts mounted with another preload: the radial distance of the groove centres stays, the loaded angle follows.

    Solves n K deformation^1.5 sin(angle) = preload with (A + deformation) cos(angle) unchanged, bearing by bearing.
    """
    bearings = []
    for b in spindle.bearings:
        k = in_series(*contact_constants(spindle, b, reference_motion(spindle.reference_temperature), b.contact_angle))
        radial = (b.unloaded_distance + reference_deformation(spindle, b)) * np.cos(b.contact_angle)

        def excess(angle: float, b=b, k=k, radial=radial) -> float:
            deformation = max(radial / np.cos(angle) - b.unloaded_distance, 0.0)
            return float(b.balls * k * deformation**1.5 * np.sin(angle) - preload)

        free = float(np.arccos(min(radial / b.unloaded_distance, 1.0)))
        bearings.append(replace(b, contact_angle=float(brentq(excess, free, 0.99 * np.pi / 2, xtol=1e-13))))
    return replace(spindle, bearings=tuple(bearings), pair=replace(spindle.pair, preload=preload))


def _with_joint(spindle: Spindle, index: int, joint: Joint) -> Spindle:
    joints = list(spindle.structure.joints)
    joints[index] = joint
    return replace(spindle, structure=replace(spindle.structure, joints=tuple(joints)))


def _with_body(spindle: Spindle, index: int, body: Body) -> Spindle:
    bodies = list(spindle.structure.bodies)
    bodies[index] = body
    return replace(spindle, structure=replace(spindle.structure, bodies=tuple(bodies)))


def _scale_stiffness(index: int, moves: tuple[int, ...]) -> Callable[[Spindle, float], Spindle]:
    def apply(spindle: Spindle, x: float) -> Spindle:
        joint = spindle.structure.joints[index]
        k = [v * (1 + x) if m in moves else v for m, v in enumerate(joint.stiffness)]
        return _with_joint(spindle, index, replace(joint, stiffness=(k[0], k[1], k[2], k[3], k[4])))

    return apply


def _scale_joint_damping(index: int) -> Callable[[Spindle, float], Spindle]:
    def apply(spindle: Spindle, x: float) -> Spindle:
        joint = spindle.structure.joints[index]
        return _with_joint(spindle, index, replace(joint, damping_ratio=joint.damping_ratio * (1 + x)))

    return apply


def _scale_mass(index: int) -> Callable[[Spindle, float], Spindle]:
    def apply(spindle: Spindle, x: float) -> Spindle:
        body = spindle.structure.bodies[index]
        return _with_body(spindle, index, replace(body, mass=body.mass * (1 + x)))

    return apply


def _scale_inertia(index: int, axes: tuple[int, ...]) -> Callable[[Spindle, float], Spindle]:
    def apply(spindle: Spindle, x: float) -> Spindle:
        body = spindle.structure.bodies[index]
        i = [v * (1 + x) if a in axes else v for a, v in enumerate(body.inertia)]
        return _with_body(spindle, index, replace(body, inertia=(i[0], i[1], i[2])))

    return apply


def _scale_bearing_damping(spindle: Spindle, x: float) -> Spindle:
    return replace(spindle, bearings=tuple(replace(b, damping_ratio=b.damping_ratio * (1 + x)) for b in spindle.bearings))
