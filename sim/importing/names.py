"""What the names of files seem to tell: temperature, speed, the point that was hit, and which files
are one test. Proposals, for a person to check."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from thermospindle.sim.importing.measured import Content

TEMPERATURE = re.compile(
    r"(?:^|[_\W])T?(-?\d+(?:\.\d+)?)\s*_?(?:(?:deg|grad)?_?C|deg|grad)(?=$|[_\W])|(?:^|[_\W])T(-?\d+(?:\.\d+)?)(?=$|[_\W])", re.IGNORECASE
)
# n3 numbers something: nobody hammers at 3 rpm
SPEED = re.compile(r"(?:^|[_\W])(\d+)\s*_?(?:rpm|min-1|U_?min)|(?:^|[_\W])n(0|\d\d+)(?=$|[_\W])|(?:^|[_\W])(at_?rest|standstill|stillstand)(?=$|[_\W])", re.IGNORECASE)
HAMMER = re.compile(r"[_\W]*(?<![A-Za-z])(?:hammer|excitation|exc|reference|ref|drive|driving|input|inp|impact)[_\W]*(\d+)[+-]?[XYZ]?[+-]?(?=$|[_\W])", re.IGNORECASE)
PART = re.compile(r"[_\W]*(?<![A-Za-z])(?:hit|shot|schlag|response|resp|rsp|dof|point|pt|channel|ch)[_\W]*\d+[+-]?[XYZ]?[+-]?(?=$|[_\W])", re.IGNORECASE)


def plain(stem: str) -> str:
    """The name of a test from that of a file."""
    return re.sub(r"[^A-Za-z0-9._+-]+", "_", stem).strip("._") or "test"


def conditions_of(test: str) -> dict[str, float]:
    """`temperature_C` and `speed_rpm`, as far as the name of a test seems to tell them: not where it seems to tell two."""
    found: dict[str, float] = {}
    for key, pattern in (("temperature_C", TEMPERATURE), ("speed_rpm", SPEED)):
        told = {float(text) if text[-1].isdigit() else 0.0 for match in pattern.finditer(test) for text in match.groups() if text}
        if len(told) == 1:
            found[key] = told.pop()
    return found


def hit_at(file: Path) -> int | None:
    """The node that the name of a file seems to say was hit."""
    match = HAMMER.search(file.stem)
    return int(match[1]) if match else None


def tests_of(contents: Sequence[Content]) -> dict[Path, str]:
    """The test that each file seems to be of: files whose names differ by the hammer's point, the
    response or the hit alone are one, unless they hold the same FRF twice."""
    groups: dict[str, list[Content]] = {}
    for c in contents:
        groups.setdefault(plain(PART.sub("", HAMMER.sub("", c.file.stem))), []).append(c)
    found: dict[Path, str] = {}
    for name, group in groups.items():
        pairs = [(x.response.label, x.reference.label) for c in group for x in c.curves if x.response.label and x.reference.label]
        whole = len(group) > 1 and len({*pairs}) == len(pairs) and not any(c.modes for c in group)
        found |= {c.file: name if whole else plain(c.file.stem) for c in group}
    return found
