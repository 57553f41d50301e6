"""What a laboratory's files hold, before anything is decided about it: curves, time records, modes, places, and open questions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.types import Array

FORCE_NEEDED = "answers alone, without the force that was hit with, are no measurement that can be used"


@dataclass(frozen=True)
class End:
    """Where a file says that a channel sat: a node (0: not told), a direction like "+Z" ("": not told), a name ("": none)."""

    node: int = 0
    direction: str = ""
    name: str = ""

    @property
    def label(self) -> str:
        """What a mapping calls it: its name, or node and direction like "5:+Z"; "" where nothing is told."""
        return self.name or self.full

    @property
    def full(self) -> str:
        """The same with the direction beside a name, too: "hub:+X"."""
        return ":".join(filter(None, (self.name or str(self.node or ""), self.direction)))


NOWHERE = End()


@dataclass(frozen=True, eq=False)
class Curve:
    """One FRF as a file has it: `value` (n,) complex, or real where it is a magnitude alone; `unit` and `quantity` "" where not told."""

    file: Path
    where: str  # "set 3", "columns 2 and 3": for messages
    response: End
    reference: End
    frequency: Array  # (n,) Hz
    value: np.ndarray
    quantity: str = ""
    unit: str = ""
    coherence: Array | None = None
    sd: Array | None = None  # unit of the value

    @property
    def magnitude_only(self) -> bool:
        return not np.iscomplexobj(self.value)


@dataclass(frozen=True, eq=False)
class Motion:
    """One channel over time: hammer force or response; `value` (hits, n), one row where the record was not divided yet."""

    file: Path
    where: str
    end: End
    force: bool
    step: float  # s
    value: Array
    unit: str = ""
    reference: End = NOWHERE  # of a response: the point whose force it answers, where the file tells


@dataclass(frozen=True)
class ModeLine:
    """One mode of a table that somebody made; None and "" where it does not say."""

    test: str
    kind: str
    frequency: float  # Hz
    frequency_sd: float | None = None
    damping_ratio: float | None = None
    damping_ratio_sd: float | None = None
    shape: tuple[tuple[End, complex], ...] = ()


@dataclass(frozen=True)
class Question:
    """What a file does not tell: `key` of which table of the mapping answers it, and a sentence why."""

    about: str  # files, tests or points, with ", " between them
    key: str
    text: str
    names: tuple[str, ...] = ()  # of columns that are asked about


@dataclass(frozen=True, eq=False)
class Content:
    """All that was found in one file."""

    file: Path
    curves: tuple[Curve, ...] = ()
    motions: tuple[Motion, ...] = ()
    modes: tuple[ModeLine, ...] = ()
    places: dict[int, tuple[float, float, float]] = field(default_factory=dict)  # m, by node
    unscaled: dict[int, tuple[float, float, float]] = field(default_factory=dict)  # by node, of a file that names no unit of length
    coherence: tuple[Curve, ...] = ()  # of FRFs that may be in another file of the test
    notes: tuple[str, ...] = ()
    questions: tuple[Question, ...] = ()
    names: tuple[str, ...] = ()  # of the columns or arrays that a mapping's `columns` may tell


@dataclass(frozen=True, eq=False)
class Read:
    """All files as read: `tests` by id with the curves, modes, window and time before the hit of each, `notes`, and what is open."""

    contents: tuple[Content, ...]
    curves: dict[str, list[Curve]]
    modes: dict[str, list[ModeLine]]
    window: dict[str, float]
    pretrigger: dict[str, float]
    ends: tuple[tuple[str, End], ...]  # of what file, every end that is not placed
    points: dict[int, Point]
    notes: tuple[str, ...]
    questions: tuple[Question, ...]

    @property
    def tests(self) -> list[str]:
        return list(dict.fromkeys([*self.curves, *self.modes]))


def words_of(question: Question, every: Mapping[str, Sequence[str]]) -> str:
    """A question as a person reads it; `every` file and test there is stand as such."""
    about = question.about.split(", ")
    all_ = next((f"all {len(about)} {what}" for what, names in every.items() if len(about) > 2 and {*about} == {*names}), None)
    return f"{all_ or listed(about, 3)}: {question.key}: {question.text}"


def listed(words: Iterable[object], most: int = 8) -> str:
    """Words with commas between them; the first of many."""
    every = [str(w) for w in words]
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")
