"""The modes of one test as rows of a campaign: with the errors that the mapping tells of them, and their shapes at its points."""

from __future__ import annotations

import cmath
from collections.abc import Sequence

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput
from thermospindle.sim.campaign.modes import ModeRow, ShapeAt
from thermospindle.sim.importing.mapping import MappingForm
from thermospindle.sim.importing.measured import End, ModeLine, listed
from thermospindle.sim.importing.places import place


def rows_of(test: str, lines: Sequence[ModeLine], form: MappingForm, points: dict[int, Point]) -> tuple[tuple[ModeRow, ...], list[str]]:
    """Rows in order of frequency, and what became of the shapes in words."""
    lines = sorted(lines, key=lambda m: m.frequency)
    shapes, notes = _shapes(test, lines, form, points)
    rows = tuple(
        ModeRow(test, k, m.kind, m.frequency, m.frequency_sd or form.frequency_sd_Hz or 0.0, m.damping_ratio, m.damping_ratio_sd or _damping_sd(m, form), shape)
        for k, (m, shape) in enumerate(zip(lines, shapes, strict=True), 1)
    )
    return rows, notes


def _damping_sd(mode: ModeLine, form: MappingForm) -> float | None:
    return None if mode.damping_ratio is None or form.damping_sd_percent is None else mode.damping_ratio * form.damping_sd_percent / 100


def _shapes(test: str, lines: Sequence[ModeLine], form: MappingForm, points: dict[int, Point]) -> tuple[list[tuple[ShapeAt, ...]], list[str]]:
    """The shape of every mode of a test at the points that all of them tell, and what became of them in words."""
    none: list[tuple[ShapeAt, ...]] = [() for _ in lines]
    told = sum(bool(m.shape) for m in lines)
    if not told:
        return none, []
    if form.shape_sd_percent is None:
        return none, [f"test {test}: shapes of {told} modes left out; shape_sd_percent in the mapping tells how sure they are, and keeps them"]
    placed = [dict(p for end, v in m.shape if (p := _shape_at(end, v, form, points)) is not None) for m in lines]
    for m, seen in zip(lines, placed, strict=True):
        if bad := [node for node, value in seen.items() if not cmath.isfinite(value)]:
            raise BadInput(f"test {test}: the shape of the mode of {m.frequency:g} Hz is NaN or infinite at node {bad[0]}; mend its file, or take shape_sd_percent out of the mapping, which leaves shapes out")
    nodes = sorted(set.intersection(*(set(p) for p in placed)))
    if len(nodes) < 2:
        there = listed(sorted({end.node for m in lines for end, _ in m.shape}), 6)
        return none, [f"test {test}: shapes of {told} of {len(lines)} modes left out: they are told at nodes {there}, of which fewer than two are points of the campaign in all modes"]
    if still := [m.frequency for m, p in zip(lines, placed, strict=True) if not any(p[n] for n in nodes)]:
        return none, [f"test {test}: shapes left out: at the points of the campaign the mode of {still[0]:g} Hz does not move"]
    sizes = [max(abs(p[n]) for n in nodes) for p in placed]
    shapes = [tuple(ShapeAt(n, p[n] / size, form.shape_sd_percent / 100) for n in nodes) for p, size in zip(placed, sizes, strict=True)]
    return shapes, [f"test {test}: shapes of {len(lines)} modes at nodes {listed(nodes, 12)}, each divided by its largest, to {form.shape_sd_percent:g} % of that"]


def _shape_at(end: End, value: complex, form: MappingForm, points: dict[int, Point]) -> tuple[int, complex] | None:
    """Node and value along the direction of the campaign's point; None of what no point is, or moves across it."""
    at = place(end, form, points)
    return None if at is None or points[at[0]].axis[1] != end.direction[1] else (at[0], value * at[1])
