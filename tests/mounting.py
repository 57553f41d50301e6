"""Spindles of the tests mounted otherwise: another preload told at the reference, a spring behind a
ring, the other ring turning, a hub with gears."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.bearing.definitions import PreloadSpring
from thermospindle.model.machine import Spindle


def told_preload(spindle: Spindle, preload: float) -> Spindle:
    """Another preload at the same contact angle: other rings, not the same ones mounted otherwise."""
    sets = tuple(replace(s, preload=preload) for s in spindle.sets)
    bearings = tuple(replace(b, preload=preload) for b in spindle.bearings)
    return replace(spindle, sets=sets, bearings=bearings)


def sprung(spindle: Spindle, ring_of: str = "upper", rate: float | None = None, mass: float = 0.0) -> Spindle:
    """The only set with a spring behind one ring."""
    return replace(spindle, sets=(replace(spindle.sets[0], spring=PreloadSpring((ring_of,), rate, mass)),))


def turning_inside(spindle: Spindle, turns: str = "shaft") -> Spindle:
    """The same with the body of the inner rings turning in standing outer ones."""
    bodies = tuple(replace(b, turns=b.name == turns) for b in spindle.structure.bodies)
    bearings = tuple(replace(b, turning_ring="inner") for b in spindle.bearings)
    return replace(spindle, bearings=bearings, structure=replace(spindle.structure, bodies=bodies))


def geared(spindle: Spindle, ratio: float) -> Spindle:
    """The same whose hub turns `ratio` times as fast as it says it does."""
    bodies = tuple(replace(b, speed_ratio=ratio) if b.turns else b for b in spindle.structure.bodies)
    return replace(spindle, structure=replace(spindle.structure, bodies=bodies))
