"""Which point of the campaign each end of a curve is: by the mapping, by the points of the scene, or asked for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle
from thermospindle.model.scene.measuring import axis_vector
from thermospindle.model.scene.shafts import resolved_body
from thermospindle.model.units import MM
from thermospindle.sim.importing.files.labels import end, role_of
from thermospindle.sim.importing.mapping import MadePoint, MappingForm
from thermospindle.sim.importing.measured import End, Question, listed

COUNTED = re.compile(r"(response|reference) \d+")
"""What ends of an array without lists of nodes are called."""
NEEDED = ("name", "body", "position_mm", "direction")


def points_of(form: MappingForm, scene: Spindle | None) -> tuple[dict[int, Point], list[Question]]:
    """The points there may be, by node: those of the mapping, filled from the scene's of the same node, and the scene's others."""
    found = {p.node: p for p in scene.points} if scene else {}
    questions = []
    shafts = {s.name: s for s in scene.structure.shafts} if scene else {}
    bodies = scene.structure.parts if scene else []
    for made in form.points:
        base = found.get(made.node)
        missing = [key for key in NEEDED if getattr(made, key) is None] if base is None else []
        if missing:
            questions.append(Question(f"point {made.node}", missing[0], f"its {', '.join(missing)}"))
            continue
        if scene and made.body is not None and made.body not in bodies:
            questions.append(Question(f"point {made.node}", "body", f"a body of the scene {scene.name} ({', '.join(bodies)}) in place of {made.body!r}"))
            continue
        point = _point(made, base)
        found[made.node] = replace(point, body=resolved_body(shafts, point.body, point.position[2]))
    return found, questions


APART = 1.0 * MM
"""Further off, a point of the mapping is another than the scene's of the same node."""


def shared(form: MappingForm, scene: Spindle) -> list[int]:
    """Nodes that a mapping tells with body and place, and the scene has too: where none of
    `misfits` is about them, it is of the same machine."""
    own = {p.node for p in scene.points}
    return [p.node for p in form.points if p.node in own and p.body is not None and p.position_mm is not None]


def misfits(form: MappingForm, scene: Spindle) -> list[str]:
    """What a mapping that was written for another scene names and this one has not, or has elsewhere, a clause each."""
    own = {p.node: p for p in scene.points}
    shafts = {s.name: s for s in scene.structure.shafts}
    made = {p.node for p in form.points}
    names = {p.name for p in scene.points} | {p.name for p in form.points} | {str(c) for p in form.points for c in p.called}
    found = []
    for point in form.points:
        base = own.get(point.node)
        if base is None and point.body is None:
            found.append(f"no point of node {point.node}")
        if point.body is not None and point.body not in scene.structure.parts:
            found.append(f"no body {point.body!r}")
        elif base is not None and point.body is not None and resolved_body(shafts, point.body, base.position[2]) != base.body:
            found.append(f"node {point.node} on {base.body}, not {point.body}")
        if base is not None and point.direction is not None and point.direction[1] != base.axis[1]:
            found.append(f"node {point.node} along {base.axis}, not {point.direction}")
        if base is not None and point.position_mm is not None and max(abs(a * MM - b) for a, b in zip(point.position_mm, base.position, strict=True)) > APART:
            found.append(f"node {point.node} at {', '.join(f'{v / MM:g}' for v in base.position)} mm, not {', '.join(f'{v:g}' for v in point.position_mm)}")
    told = [end(str(e)) for f in form.files for e in (f.response, f.reference) if e is not None]
    told += [e for f in form.files for column in f.columns.values() if (role := role_of(column)) for e in (role.response, role.reference)]
    for e in told:
        if e.label and not ({e.label, e.name} & names) and str(e.node) not in names and e.node not in made and e.node not in own:
            found.append(f"no point {e.label}")
        elif e.node in own and e.node not in made and e.direction and e.direction[1] != own[e.node].axis[1]:
            found.append(f"node {e.node} along {own[e.node].axis}, not {e.direction}")
    return list(dict.fromkeys(found))


def _point(made: MadePoint, base: Point | None) -> Point:
    position = tuple(v * MM for v in made.position_mm) if made.position_mm is not None else (base.position if base else (0.0, 0.0, 0.0))
    direction = axis_vector(made.direction) if made.direction else (base.direction if base else (0.0, 0.0, 1.0))
    name, body = made.name or (base.name if base else ""), made.body or (base.body if base else "")
    mass = made.sensor_mass_g * 1e-3 if made.sensor_mass_g is not None else (base.mass if base else 0.0)
    return Point(made.node, name, body, position, direction, mass)  # type: ignore[arg-type]


def place(end: End, form: MappingForm, points: dict[int, Point]) -> tuple[int, int] | None:
    """(node, sign) of the campaign's point at an end; None where no point is called so.

    The sign is -1 where the file's direction is opposite to the point's.
    """
    for made in form.points:
        called = {str(c) for c in made.called}
        if called & {end.full, end.label, str(end.node or "")} - {""} and made.node in points:
            return made.node, _sign(end, points[made.node])
    named = next((p for p in points.values() if end.name and end.name == p.name), None)
    point = named or points.get(end.node)
    if point is None or (end.direction and end.direction[1] != point.axis[1]):
        return None
    return point.node, _sign(end, point)


def _sign(end: End, point: Point) -> int:
    own = point.axis
    return -1 if end.direction and end.direction[1] == own[1] and end.direction[0] != own[0] else 1


def unplaced(ends: Sequence[tuple[str, End]], points: dict[int, Point], scene: Spindle | None) -> list[Question]:
    """One question for all ends that no point is called by: `ends` are (file name, end)."""
    labels: dict[str, list[str]] = {}
    for file, of in ends:
        if of.label:
            labels.setdefault(of.full, []).append(file)
    if not labels:
        return []
    there = f"; points there are {listed(f'{p.node} {p.name} {p.axis}' for p in points.values())}" if points else ""
    hint = "" if scene else "; --scene takes those of a scene"
    counted = next((label for label in labels if COUNTED.fullmatch(label)), None)
    hint += f"; {counted!r} is counted along an array that names no nodes" if counted else ""
    return [Question("points", "called", f'which points {listed(repr(n) for n in labels)} are: a [[points]] with called = ["{next(iter(labels))}"]{there}{hint}')]
