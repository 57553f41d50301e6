"""Which tests were made at one condition."""

from __future__ import annotations

from collections.abc import Sequence

from thermospindle.diagnosis.data.mode_table import TestData
from thermospindle.model.machine import Condition, Spindle

SPREAD = 3.0  # temperatures within so many tolerances of each other are one condition


def conditions_of(spindle: Spindle, tests: Sequence[TestData]) -> list[list[int]]:
    """Numbers of the tests of every temperature, those within the thermometer's own scatter of the
    lowest together; where all are of one, of every speed, level and soak time."""
    at = [d.condition for d in tests]
    near = SPREAD * spindle.tolerances.temperature
    groups: list[list[int]] = []
    for t in sorted(range(len(at)), key=lambda t: at[t].temperature):
        if groups and at[t].temperature - at[groups[-1][0]].temperature <= near:
            groups[-1].append(t)
        else:
            groups.append([t])
    if len(groups) != 1:
        return groups
    others: dict[tuple[float, ...], list[int]] = {}
    for t in groups[0]:
        others.setdefault(_beside_temperature(at[t]), []).append(t)
    return list(others.values())


def _beside_temperature(c: Condition) -> tuple[float, ...]:
    return c.speed, c.level, c.soak_time
