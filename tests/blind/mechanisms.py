"""Everything that may be hidden in a scene, by place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tests.blind.hidden import Mechanism
from tests.blind.hidden_bearings import of_bearings, of_rings
from tests.blind.hidden_measuring import of_measuring
from tests.blind.hidden_structure import of_structure
from thermospindle.model.machine import Spindle


def mechanisms(spindle: Spindle, usable: Sequence[str]) -> tuple[Mechanism, ...]:
    """Every mechanism of a scene; of the right answers those that are `usable` there."""
    found = [*of_rings(spindle), *of_bearings(spindle), *of_structure(spindle), *of_measuring(spindle)]
    return tuple(replace(m, names=tuple(n for n in m.names if n in usable)) for m in found)
