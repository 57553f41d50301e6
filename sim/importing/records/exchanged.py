"""Force and response of a hammer test in each other's place: a hammer pushes for a moment, and what was hit rings on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from thermospindle.model.types import Array
from thermospindle.sim.importing.measured import Motion, Question

TOUCHING = 0.05  # of a channel's largest value, above which it is not at rest
PULLS = 0.3  # of its largest value, which no hammer reaches the other way; what rings does
LONGER = 3.0  # times as long as a pulse lasts what rings


def exchanged(file: Path, motions: Sequence[Motion]) -> Question | None:
    """The question whether the force of a file is a response, and which response its force; None where the force may be one."""
    force = next(m for m in motions if m.force)
    lasts, pulls = _shape(force.value)
    if pulls < PULLS:
        return None
    for m in motions:
        of, back = _shape(m.value)
        if not m.force and 0 < LONGER * of < lasts and back < PULLS:
            what = f"whether force and response are exchanged: its force {force.where!r} rings on, and its response {m.where!r} is a pulse, as a hammer makes it"
            return Question(file.name, "columns", what, (force.where, m.where))
    return None


def _shape(value: Array) -> tuple[int, float]:
    """For how many samples a channel (hits, n) is not at rest, and how far it goes the other way, as a share of its largest value."""
    still = value - np.median(value, axis=-1, keepdims=True)
    low, high = sorted((abs(float(still.min())), abs(float(still.max()))))
    return int(np.count_nonzero(np.abs(still) > TOUCHING * high)), low / high if high > 0 else 0.0
