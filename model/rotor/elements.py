"""The bearing elements of the time simulation, and what else a hammer test can be computed with."""

from __future__ import annotations

from typing import TYPE_CHECKING

from thermospindle.model.errors import BadInput

if TYPE_CHECKING:
    from thermospindle.model.machine import Spindle

LINEAR, BALLS = "linear", "ball-by-ball"
ELEMENTS = (LINEAR, BALLS)
"""The tangent stiffness at the operating point, or every ball by itself."""

REDUCED = "reduced"
HAMMER = (*ELEMENTS, REDUCED)
"""Of a hammer test: also the linear spindle by its reduced model, stepped exactly and without MuJoCo."""


def check_element(spindle: Spindle, element: str | None) -> None:
    """`BadInput` for balls by themselves where no bearing has any: it would be the linear element in silence."""
    if element == BALLS and not spindle.bearings:
        raise BadInput(f"--element {element}: no bearing of {spindle.name} has balls; allowed is {LINEAR}")
