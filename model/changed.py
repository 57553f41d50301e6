"""Frozen dataclasses that are made anew at every operating point, with some of their fields otherwise."""

from __future__ import annotations

from typing import Any, TypeVar

T = TypeVar("T")


def changed(thing: T, **fields: Any) -> T:
    """`dataclasses.replace` of one that checks nothing when it is made: its other fields are taken
    over as they stand, in a third of the time."""
    other, held = object.__new__(type(thing)), thing.__dict__
    other.__dict__.update({name: held[name] for name in thing.__dataclass_fields__}, **fields)  # type: ignore[attr-defined]
    return other
