"""Which turning part an unbalance or a radial load acts on: the one that a scene names, or the one that turns at its height.

Decided by what is drawn, never by where a mesh has its nodes: a shaft is at the heights between its ends, a body
made of regions at those of its regions, and a body given by its mass, which has no length, at that of its centre
of mass alone. A plane at the very height of such a centre is that body's, whatever shaft passes through it. Where
nothing turns, it is the nearest part. Several parts at one height cannot be told apart, and one must be named.
"""

from __future__ import annotations

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.errors import BadInput, instead, listed
from thermospindle.model.machine import RadialLoad, Spindle
from thermospindle.model.shaft import SAME_HEIGHT
from thermospindle.model.structure import Body

UNBALANCE = "imperfections.unbalance_"
"""How the keys of a scene begin that tell the height (`z_mm`) and the part (`body`) of an
unbalance; those of radial loads begin as `RadialLoad.key` says."""

Spans = tuple[tuple[float, float], ...]


def unbalance_carrier(spindle: Spindle, own: Imperfections) -> Body:
    """The body that an unbalance is on: of a flexible shaft its node there. BadInput where several parts turn there, or none at all."""
    return carrier(spindle, own.unbalance_z, own.unbalance_body, UNBALANCE)


def unbalanced(spindle: Spindle) -> Body:
    """The body that the scene's unbalance is on; without one, what turns, where one would be."""
    own = spindle.imperfections
    return unbalance_carrier(spindle, own) if own.unbalance or own.couple_unbalance else spindle.turning


def permissible_unbalance(spindle: Spindle, body: Body, grade: float) -> float:
    """Unbalance (kg m) that a balance `grade` G (m/s) permits what turns together with a body: its mass
    times G over its own speed where the spindle turns at its nominal one (ISO 21940-11:2016, e = G / speed)."""
    mass = sum(b.mass for b in spindle.structure.bodies if b.turns and b.speed_ratio == body.speed_ratio)
    return mass * grade / (spindle.nominal_speed * abs(body.speed_ratio or 1.0))


def load_carrier(spindle: Spindle, load: RadialLoad) -> Body:
    """The same of a radial load of the scene."""
    return carrier(spindle, load.z, load.body, load.key)


def carrier(spindle: Spindle, z: float, part: str, key: str) -> Body:
    """The body on which `key` acts at a height (m): of the `part` named, or, with none named, of the one that turns there."""
    part = part or only_part(spindle, z, key)
    own = [b for b in spindle.structure.bodies if spindle.structure.carrier(b.name) == part]
    return min(own, key=lambda b: abs(b.z - z))


def only_part(spindle: Spindle, z: float, key: str) -> str:
    """Name of the one part that turns at a height (m); BadInput, by `key`, where there are several."""
    spans = turning_parts(spindle)
    if not spans:
        raise BadInput(f"{spindle.file or spindle.name}: structure: nothing turns, so there is nothing to spin; a body or shaft needs turns = true")
    found = _at(spindle, spans, z)
    if len(found) > 1:
        told = f"{spindle.file or spindle.name}: {key}z_mm = {z * 1e3:.6g}: {listed(found)} turn there"
        raise BadInput(f"{told}; {key}body must name the one it acts on: allowed are {', '.join(found)}")
    return found[0]


def turning_parts(spindle: Spindle) -> dict[str, Spans]:
    """Between which heights (m) every turning part is, by name of the body or shaft."""
    structure = spindle.structure
    rigid = {b.name: tuple(spindle.region(name).z for name in b.regions) or ((b.z, b.z),) for b in structure.rigid_bodies if b.turns}
    return rigid | {s.name: ((s.nodes[0], s.nodes[-1]),) for s in structure.shafts if s.turns}


def _at(spindle: Spindle, spans: dict[str, Spans], z: float) -> list[str]:
    """The parts that are at a height (m), or nearest to it; of several those given by a mass whose centre is there."""
    away = {name: min(max(low - z, z - high, 0.0) for low, high in own) for name, own in spans.items()}
    found = [name for name, distance in away.items() if distance <= min(away.values()) + SAME_HEIGHT]
    centred = [b.name for b in spindle.structure.rigid_bodies if b.name in found and not b.regions and abs(b.z - z) <= SAME_HEIGHT]
    return centred or found


def named(spindle: Spindle, body: Body) -> str:
    """What must be named so that something at the height of a `body` acts on it: its part, or nothing where the height tells it."""
    part = spindle.structure.carrier(body.name)
    return "" if _at(spindle, turning_parts(spindle), body.z) == [part] else part


def check_carriers(spindle: Spindle) -> None:
    """Refuses an unbalance and radial loads whose part does not turn, is not at their height, or cannot be told."""
    own = spindle.imperfections
    for key, z, part, present in (
        (UNBALANCE, own.unbalance_z, own.unbalance_body, bool(own.unbalance or own.couple_unbalance)),
        *((load.key, load.z, load.body, True) for load in spindle.radial_loads),
    ):
        spans = turning_parts(spindle)
        if part and part not in spans:
            raise BadInput(f"{spindle.file}: {key}body = {part!r}: names nothing that turns; {instead(part, spans)}")
        shaft = next((s for s in spindle.structure.shafts if s.name == part), None)
        if present and shaft and not shaft.nodes[0] - SAME_HEIGHT <= z <= shaft.nodes[-1] + SAME_HEIGHT:
            raise BadInput(f"{spindle.file}: {key}z_mm = {z * 1e3:.6g}: beyond the shaft {part!r}, which spans {shaft.nodes[0] * 1e3:g} to {shaft.nodes[-1] * 1e3:g}")
        if present and spans and not part:
            only_part(spindle, z, key)
