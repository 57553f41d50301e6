"""What the functions of `import thermospindle as ts` check of their arguments: `BadInput`, one
sentence that names argument, value and what is allowed."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.errors import BadInput

FARTHEST = 1e300  # a whole number may be larger than any other


def of_kind(name: str, value: object, kinds: tuple[type, ...], told: str) -> None:
    """`BadInput` for an argument of another kind than it is told to be."""
    if not isinstance(value, kinds):
        raise BadInput(f"{name}: must be {told}, not {an(value)}")


def an(value: object) -> str:
    """The kind of a value, with its article."""
    kind = type(value).__name__
    return "None" if value is None else f"an {kind}" if kind[0].lower() in "aeio" else f"a {kind}"


def several(name: str, value: Sequence[Any], told: str) -> Sequence[Any]:
    """A list, which a single text is not."""
    if isinstance(value, str | Path):
        raise BadInput(f"{name} = {value!r}: must be a list of {told}, as [{value!r}]")
    of_kind(name, value, (Sequence,), f"a list of {told}")
    return value


def number(name: str, value: float, above: float = -np.inf, most: float = np.inf) -> float:
    """The number that an argument is, above `above` and up to `most`; `BadInput` for any other."""
    if isinstance(value, bool) or not isinstance(value, Real) or abs(value) > FARTHEST or not isfinite(value) or not above < value <= most:
        bounds = [f"above {above:g}"] * bool(isfinite(above)) + [f"up to {most:g}"] * bool(isfinite(most))
        raise BadInput(f"{name} = {value!r}: must be a finite number {' and '.join(bounds)}".rstrip())
    return float(value)


def whole(name: str, value: int, least: int, most: int) -> None:
    """`BadInput` for an argument that is no whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        raise BadInput(f"{name} = {value!r}: must be a whole number from {least} to {most}")
