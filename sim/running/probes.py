"""Probes of a turning spindle, fixed in space, which look at a part of it: across the axis at the side
of the hub, and along the axis at its centre, near the top of it, besides the scene's own measuring
points. The looked-at surface is round and true, so that a probe shows the axis and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import RotorBase, motion_rows
from thermospindle.model.shaft import Shaft
from thermospindle.model.types import Array
from thermospindle.sim.operating import OperatingPoint

X, Y, AXIAL = "hub x", "hub y", "hub axial"
BELOW_TOP = 0.1  # of the height of the hub's highest region: where the radial probes look


@dataclass(frozen=True)
class Probe:
    """A displacement probe fixed in space: it looks along `direction` (unit vector) at `position` (m) of a body."""

    name: str
    body: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]

    @property
    def radial(self) -> bool:
        """Whether it looks across the axis."""
        return abs(self.direction[2]) < 0.5

    def row(self, chain: RotorBase) -> Array:
        """Row (n,) of the displacement it sees of the chain's motion."""
        return np.asarray(np.array(self.direction) @ motion_rows(chain, self.body, self.position)[:3])


def hub_probes(spindle: Spindle) -> tuple[Probe, Probe, Probe]:
    """Across the axis along x and y, at the side of the turning body's highest region a tenth of its
    height below the top, and along the axis, at the centre of its top face. Of a flexible shaft that turns
    at the scene's first measuring point across the axis on what turns, a tool say, or else its lower end."""
    shaft = next((s for s in spindle.structure.shafts if s.turns), None)
    if shaft is not None:
        body, radius, height = _first_place(spindle, shaft)
        end = height
    else:
        turning = next((b for b in spindle.structure.bodies if b.turns), None)
        if turning is None or not turning.regions:
            raise BadInput(
                f"{spindle.file or spindle.name}: structure.bodies: nothing turns that runout could be looked at: that takes a turning body made of section regions, or a turning shaft"
            )
        top = max((spindle.region(name) for name in turning.regions), key=lambda g: (g.z[1], g.r[1]))
        body, radius, height, end = turning.name, top.r[1], top.z[1] - BELOW_TOP * (top.z[1] - top.z[0]), top.z[1]
    return (
        Probe(X, body, (radius, 0.0, height), (1.0, 0.0, 0.0)),
        Probe(Y, body, (0.0, radius, height), (0.0, 1.0, 0.0)),
        Probe(AXIAL, body, (0.0, 0.0, end), (0.0, 0.0, 1.0)),
    )


def speed_ratio(spindle: Spindle, probe: Probe | Point | None = None) -> float:
    """Speed of what a probe, by default the hub's, sees over the spindle's: what repeats every
    revolution goes by it, at what stands by the hub's."""
    own = None if probe is None else spindle.structure.body(probe.body)
    if own is None or not own.turns:
        shaft = next((s for s in spindle.structure.shafts if s.turns), None)
        own = spindle.structure.body(_first_place(spindle, shaft)[0]) if shaft else next((b for b in spindle.structure.bodies if b.turns), spindle.turning)
    return own.speed_ratio or 1.0


def looked_at(spindle: Spindle) -> str:
    """What the first two probes look at, in a word: the turning body, or the measuring point of a flexible shaft."""
    shaft = next((s for s in spindle.structure.shafts if s.turns), None)
    if shaft is None:
        return hub_probes(spindle)[0].body
    first = _first_point(spindle)
    return f"end of {shaft.name}" if first is None else first.name


def _first_point(spindle: Spindle) -> Point | None:
    """The scene's first measuring point across the axis on what turns."""
    turning = {b.name for b in spindle.structure.bodies if b.turns}
    return next((p for p in spindle.points if p.body in turning and abs(p.direction[2]) < 0.5), None)


def _first_place(spindle: Spindle, shaft: Shaft) -> tuple[str, float, float]:
    """Body, radius (m) and height (m) of the first measuring point, or of the lower end of a shaft where there is none."""
    first = _first_point(spindle)
    if first is None:
        return _on_shaft(shaft, shaft.nodes[0])
    own = next((s for s in spindle.structure.shafts if first.body in s.bodies), None)
    return (first.body, float(np.hypot(*first.position[:2])), first.position[2]) if own is None else _on_shaft(own, first.position[2])


def _on_shaft(shaft: Shaft, height: float) -> tuple[str, float, float]:
    """Body, radius (m) and height (m) at which a probe looks at a shaft."""
    segment = next((g for g in shaft.segments if g.z[0] <= height <= g.z[1]), shaft.segments[-1])
    return shaft.node_at(height), segment.outer[0], height


def second_plane(spindle: Spindle) -> tuple[Probe, Probe]:
    """Two more probes across the axis, at the other end of what turns."""
    x, y, _ = hub_probes(spindle)
    shaft = next((s for s in spindle.structure.shafts if s.turns), None)
    if shaft is not None:
        ends = [(s, z) for s in spindle.structure.shafts if s.turns for z in (s.nodes[0], s.nodes[-1])]
        body, radius, height = _on_shaft(*max(ends, key=lambda end: abs(end[1] - x.position[2])))
    else:
        own = spindle.structure.body(x.body)
        low = min((spindle.region(name) for name in own.regions), key=lambda g: (g.z[0], -g.r[1]))
        body, radius, height = x.body, low.r[1], low.z[0] + BELOW_TOP * (low.z[1] - low.z[0])
    return (
        replace(x, name="low x", body=body, position=(radius, 0.0, height)),
        replace(y, name="low y", body=body, position=(0.0, radius, height)),
    )


def all_probes(spindle: Spindle) -> tuple[Probe, ...]:
    """The hub's three probes, then one at every measuring point of the scene."""

    def at(p: Point) -> Probe:
        return Probe(f"{p.node} {p.name}", p.body, p.position, p.direction)

    return (*hub_probes(spindle), *(at(p) for p in spindle.points))


def probe_rows(point: OperatingPoint, probes: Sequence[Probe]) -> Array:
    """Rows (probes, n) of what probes see of the chain's motion."""
    return np.array([p.row(point.chain) for p in probes])
