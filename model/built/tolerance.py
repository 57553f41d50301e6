"""The spindle's toleranced parameters: what a built spindle may differ in from its drawing, each with one standard deviation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from thermospindle.model.bearing.hertz import in_series
from thermospindle.model.bearing.row import contact_constants, reference_deformation, reference_motion
from thermospindle.model.errors import BadInput, NoEquilibrium
from thermospindle.model.machine import Spindle
from thermospindle.model.shaft import Shaft
from thermospindle.model.structure import MOVES, Body, Joint

LEAST, MOST = -0.9, 10.0
"""Relative deviations that a built spindle can have."""


@dataclass(frozen=True)
class Toleranced:
    """One parameter: `apply(spindle, x)` returns the spindle with it at (1 + x) times its nominal value; `sd` is that of x."""

    name: str
    sd: float
    apply: Callable[[Spindle, float], Spindle]


def toleranced(spindle: Spindle) -> list[Toleranced]:
    """Every toleranced build parameter of a spindle: stiffnesses, masses, inertias, preload, clearance of rollers, damping ratios."""
    t = spindle.tolerances
    found = []
    beams = {name for s in spindle.structure.shafts for name in (*s.bodies, *s.elements)}
    for j, joint in enumerate(spindle.structure.joints):
        if joint.name in beams:
            continue
        for name, moves in (("axial", (2,)), ("lateral", (0, 1)), ("tilt", (3, 4))):
            equal = len({joint.stiffness[m] for m in moves}) == 1
            for group in [moves] if equal else [(m,) for m in moves]:
                if joint.stiffness[group[0]] > 0:
                    label = name if equal else MOVES[group[0]].replace("_", " ")
                    found.append(Toleranced(f"{joint.name} {label} stiffness", t.structure, _scale_stiffness(j, group)))
        found.append(Toleranced(f"{joint.name} damping", t.damping, _scale_joint_damping(j)))
    for b, body in enumerate(spindle.structure.bodies):
        if body.name in beams:
            continue
        sd = t.hub if body.turns else t.structure
        if not body.regions or body.turns:
            found.append(Toleranced(f"{body.name} mass", sd, _scale_mass(b)))
            if body.turns:
                found.append(Toleranced(f"{body.name} inertia", sd, _scale_inertia(b, (0, 1, 2))))
            else:
                tilts = [i for i, move in enumerate(("tilt_x", "tilt_y")) if move in body.moves]
                found += [Toleranced(f"{body.name} tilt {'xy'[i]} inertia", sd, _scale_inertia(b, (i,))) for i in tilts]
    for shaft in spindle.structure.shafts:
        found.append(Toleranced(f"{shaft.name} stiffness", t.structure, _scale_shaft(shaft, stiffness=True)))
        found.append(Toleranced(f"{shaft.name} mass", t.hub if shaft.turns else t.structure, _scale_shaft(shaft, mass=True)))
        found.append(Toleranced(f"{shaft.name} damping", t.damping, _scale_shaft(shaft, damping=True)))
    for s in spindle.sets:
        found.append(Toleranced("preload" if len(spindle.sets) == 1 else f"{s.name} preload", t.preload, _scale_preload(s.name)))
    for given in spindle.linear_bearings:
        found.append(Toleranced(f"{given.name} stiffness", t.structure, _scale_linear_bearing(given.name)))
    for rollers in spindle.roller_bearings:
        if rollers.clearance != 0.0:  # as mounted; pressed rollers are preloaded by it
            found.append(Toleranced(f"{rollers.name} clearance", t.preload, _scale_clearance(rollers.name)))
    if spindle.all_bearings:
        found.append(Toleranced("bearing damping", t.damping, _scale_bearing_damping))
    return found


def deviated(spindle: Spindle, deviations: Mapping[str, float]) -> Spindle:
    """The spindle with relative deviations of toleranced parameters, by name, from the numbers it has.

    Raises `BadInput` for a name that is none, and for a deviation that gives no spindle; what it says follows the scene's file.
    """
    parameters = {p.name: p for p in toleranced(spindle)}
    for name in deviations:
        if name not in parameters:
            raise BadInput(f"build.deviations.{name}: is no toleranced parameter; allowed are {', '.join(parameters)}")
    built = spindle
    for name, parameter in parameters.items():
        deviation = deviations.get(name, 0.0)
        if deviation != 0.0:
            try:
                built = parameter.apply(built, deviation)
            except (ValueError, NoEquilibrium) as error:
                raise BadInput(f"build.deviations.{name} = {deviation:g}: gives no spindle: {error}") from None
    return built


def scaled_preload(spindle: Spindle, factor: float, sets: Sequence[str] | None = None) -> Spindle:
    """The same parts mounted with `factor` times the preload, in the sets named (all by default): the radial distance of the groove
    centres stays, the loaded angle follows.

    Solves n K deformation^1.5 sin(angle) = preload with (A + deformation) cos(angle) unchanged, bearing by bearing.
    """
    bearings = []
    changed = [s for s in spindle.sets if sets is None or s.name in sets]
    for b in spindle.bearings:
        if not any(b.name in s.bearings for s in changed):
            bearings.append(b)
            continue
        preload = factor * b.preload
        k = in_series(*contact_constants(spindle, b, reference_motion(spindle.reference_temperature), b.contact_angle))
        radial = (b.unloaded_distance + reference_deformation(spindle, b)) * np.cos(b.contact_angle)

        def excess(angle: float, b=b, k=k, radial=radial, preload=preload) -> float:
            deformation = max(radial / np.cos(angle) - b.unloaded_distance, 0.0)
            return float(b.balls * k * deformation**1.5 * np.sin(angle) - preload)

        free = float(np.arccos(min(radial / b.unloaded_distance, 1.0)))
        bearings.append(replace(b, contact_angle=float(scipy.optimize.brentq(excess, free, 0.99 * np.pi / 2, xtol=1e-13)), preload=preload))
    scaled = tuple(replace(s, preload=factor * s.preload) if s in changed else s for s in spindle.sets)
    return replace(spindle, bearings=tuple(bearings), sets=scaled)


def _scale_preload(name: str) -> Callable[[Spindle, float], Spindle]:
    return lambda spindle, x: scaled_preload(spindle, 1 + x, [name])


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
        return _with_joint(spindle, index, replace(joint, damping_ratio=joint.damping_ratio * (1 + x), loss_factor=joint.loss_factor * (1 + x)))

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
    rows = tuple(replace(b, damping_ratio=b.damping_ratio * (1 + x)) for b in spindle.bearings)
    given = tuple(replace(b, damping_ratio=b.damping_ratio * (1 + x)) for b in spindle.linear_bearings)
    rollers = tuple(replace(b, damping_ratio=b.damping_ratio * (1 + x)) for b in spindle.roller_bearings)
    return replace(spindle, bearings=rows, linear_bearings=given, roller_bearings=rollers)


def _scale_clearance(name: str) -> Callable[[Spindle, float], Spindle]:
    def apply(spindle: Spindle, x: float) -> Spindle:
        scaled = (replace(b, clearance=(1 + x) * b.clearance) if b.name == name else b for b in spindle.roller_bearings)
        return replace(spindle, roller_bearings=tuple(scaled))

    return apply


def _scale_linear_bearing(name: str) -> Callable[[Spindle, float], Spindle]:
    def apply(spindle: Spindle, x: float) -> Spindle:
        scaled = (replace(b, stiffness=tuple((1 + x) * k for k in b.stiffness)) if b.name == name else b for b in spindle.linear_bearings)
        return replace(spindle, linear_bearings=tuple(scaled))

    return apply


def _scale_shaft(shaft: Shaft, stiffness: bool = False, mass: bool = False, damping: bool = False) -> Callable[[Spindle, float], Spindle]:
    """Every element or node of a shaft at once: its material's modulus or density, or its loss."""

    def apply(spindle: Spindle, x: float) -> Spindle:
        own, f = spindle.structure, 1 + x
        joints, bodies = list(own.joints), list(own.bodies)
        for j, joint in enumerate(joints):
            if joint.name in shaft.elements and stiffness:
                k = [f * v for v in joint.stiffness]
                joints[j] = replace(joint, stiffness=(k[0], k[1], k[2], k[3], k[4]))
            elif joint.name in shaft.elements and damping:
                joints[j] = replace(joint, damping_ratio=f * joint.damping_ratio, loss_factor=f * joint.loss_factor)
        for b, body in enumerate(bodies):
            if body.name in shaft.bodies and mass:
                bodies[b] = replace(body, mass=f * body.mass, inertia=(f * body.inertia[0], f * body.inertia[1], f * body.inertia[2]))
        return replace(spindle, structure=replace(own, joints=tuple(joints), bodies=tuple(bodies)))

    return apply
