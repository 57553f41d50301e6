"""What was worked out last, for whoever asks for it again."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

T = TypeVar("T")


class Latest(Generic[T]):
    """The things asked for last, at `most` so many, by what tells them apart."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._known: dict[Hashable, T] = {}

    def of(self, key: Hashable, worked_out: Callable[[], T]) -> T:
        """What is known by a key, or is `worked_out`; what was not asked for the longest gives way to it."""
        found = self._known.pop(key, None)
        if found is None:
            found = worked_out()
        self._known[key] = found
        if len(self._known) > self._most:
            del self._known[next(iter(self._known))]
        return found
