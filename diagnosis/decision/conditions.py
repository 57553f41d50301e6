"""Which tests were made at one condition."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.inference.search import Search

SPREAD = 3.0  # temperatures within so many tolerances of each other are one condition


def conditions_of(found: Search) -> list[list[int]]:
    """Numbers of the tests of every temperature, those within the thermometer's own scatter together."""
    temperature = np.array([d.condition.temperature for d in found.model.tests])
    order = np.argsort(temperature, kind="stable")
    near = SPREAD * found.model.spindle.tolerances.temperature
    groups: list[list[int]] = []
    for t in order:
        if groups and temperature[t] - temperature[groups[-1][-1]] <= near:
            groups[-1].append(int(t))
        else:
            groups.append([int(t)])
    return groups
