"""Which point of the campaign each end of a curve is: by the mapping, by the points of the scene, or asked for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from thermospindle.model.machine import Point, Spindle
from thermospindle.model.scene.measuring import axis_vector
from thermospindle.model.scene.shafts import resolved_body
from thermospindle.model.units import MM
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


def _point(made: MadePoint, base: Point | None) -> Point:
    position = tuple(v * MM for v in made.position_mm) if made.position_mm is not None else (base.position if base else (0.0, 0.0, 0.0))
    direction = axis_vector(made.direction) if made.direction else (base.direction if base else (0.0, 0.0, 1.0))
    name, body = made.name or (base.name if base else ""), made.body or (base.body if base else "")
    return Point(made.node, name, body, position, direction)  # type: ignore[arg-type]


def place(end: End, form: MappingForm, points: dict[int, Point]) -> tuple[int, int] | None:
    """(node, sign) of the campaign's point at an end; None where no point is called so.

    The sign is -1 where the file's direction is opposite to the point's.
    """
    for made in form.points:
        called = {str(c) for c in made.called}
        if called & {end.label, end.name, str(end.node) if end.node else ""} - {""} and made.node in points:
            return made.node, _sign(end, points[made.node])
    for point in points.values():
        if end.name and end.name == point.name:
            return point.node, 1
    if end.node in points:
        point = points[end.node]
        if not end.direction or end.direction[1] == point.axis[1]:
            return point.node, _sign(end, point)
    return None


def _sign(end: End, point: Point) -> int:
    own = point.axis
    return -1 if end.direction and end.direction[1] == own[1] and end.direction[0] != own[0] else 1


def unplaced(ends: Sequence[tuple[str, End]], points: dict[int, Point], scene: Spindle | None) -> list[Question]:
    """One question for all ends that no point is called by: `ends` are (file name, end)."""
    labels: dict[str, list[str]] = {}
    for file, end in ends:
        if end.label:
            labels.setdefault(end.label, []).append(file)
    if not labels:
        return []
    there = f"; points there are {listed(f'{p.node} {p.name} {p.axis}' for p in points.values())}" if points else ""
    hint = "" if scene else "; --scene takes those of a scene"
    counted = next((label for label in labels if COUNTED.fullmatch(label)), None)
    hint += f"; {counted!r} is counted along an array that names no nodes" if counted else ""
    return [Question("points", "called", f'which points {listed(repr(n) for n in labels)} are: a [[points]] with called = ["{next(iter(labels))}"]{there}{hint}')]
