"""What a failed assertion of `thermospindle.testing` says: which mode, what moved, and which elements are behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from thermospindle.model.bearing.kinematics import Line
    from thermospindle.model.rotor.modes import Mode
    from thermospindle.sim.operating import OperatingPoint

MOST = 3  # elements named in a failure
HARDLY = 0.005  # of the energy, that is told as nothing
NEIGHBOURS = 2  # modes shown on each side of the one in question



def called(point: OperatingPoint, mode: str | int) -> str:
    return f"{point.spindle.name}: mode {mode}" if isinstance(mode, int) else f"{point.spindle.name}: {mode}"


def named(line: Line) -> str:
    order = f" of order {line.order}" if line.order else ""
    whirl = {1: ", forward", -1: ", backward"}.get(line.whirl, "")
    return f"{line.name} ({line.cause}{order}{f' of bearing {line.bearing}' if line.bearing else ''}{whirl})"


def at_speed(speed: float) -> str:
    return f" at {speed:g} rpm" if speed else ""


def table(first: OperatingPoint, then: OperatingPoint, partners: Sequence[int], a: str, b: str, index: int) -> list[str]:
    """The mode in question and two on each side of it, before and after: of a flexible shaft there are dozens below an upper one."""
    rows = [f"    {'':14}{a:>10}{b:>10}{'change':>10} Hz"]
    counts: dict[str, int] = {}
    for i, m in enumerate(first.modes[: index + NEIGHBOURS + 1]):
        counts[m.kind] = counts.get(m.kind, 0) + 1
        if i < index - NEIGHBOURS:
            continue
        after = then.modes[partners[i]].frequency if partners[i] >= 0 else None
        change = "lost" if after is None else f"{after - m.frequency:+.2f}"
        rows.append(f"  {'>' if i == index else ' '} {m.kind + ' ' + str(counts[m.kind]):14}{m.frequency:10.2f}{'' if after is None else f'{after:10.2f}':>10}{change:>10}")
    return rows


def energy(point: OperatingPoint, index: int) -> list[str]:
    mode = point.modes[index]
    parts = sorted(_by_part(point, mode.energy).items(), key=lambda e: -e[1])
    most = [f"{name} {share:.0%}" for name, share in parts[:MOST]]
    left = sum(share for _, share in parts[MOST:])
    rest = [f"all others {left:.0%}"] if left >= HARDLY else []
    return [f"  strain energy of {mode.kind} at {mode.frequency:.1f} Hz: {', '.join([*most, *rest])}"]


def _by_part(point: OperatingPoint, of_elements: Mapping[str, float]) -> dict[str, float]:
    """Sums over elements by name of bearing, joint or shaft: nobody knows the elements of a shaft's mesh by theirs."""
    shaft_of = {element: s.name for s in point.spindle.structure.shafts for element in s.elements}
    found: dict[str, float] = {}
    for name, value in of_elements.items():
        part = shaft_of.get(name, name)
        found[part] = found.get(part, 0.0) + value
    return found


def odd(*points: OperatingPoint) -> list[str]:
    """What is odd about conditions and bearings there: what moved may be that."""
    from thermospindle import front

    return [f"  {doubt}" for doubt in dict.fromkeys(d for p in points for d in front.odd(p))]


def behind(first: OperatingPoint, then: OperatingPoint, index: int, after: Mode) -> list[str]:
    """Where the energy is, and what the change of each element's stiffness does to the mode: df = f/2 phi^T dK phi / phi^T K phi, the
    mean of what the shapes at both ends say, which is right to the second order; and what is left, of masses, speed and higher orders."""
    mode = first.modes[index]
    ends = [_moved(first, then, first, mode), _moved(first, then, then, after)]
    change = _by_part(first, {name: sum(end[name] for end in ends) / 2 for name in ends[0]})
    moved = sorted(change.items(), key=lambda row: -abs(row[1]))[:MOST]
    told = [f"{name} {value:+.2f} Hz" for name, value in moved if abs(value) > 5e-3]
    whole = after.frequency - mode.frequency
    rest = whole - sum(value for _, value in moved if abs(value) > 5e-3)
    if abs(rest) > max(abs(whole) / 2, 5e-3):
        return [*energy(first, index), "  moved too far for the elements' parts in it to be told to first order"]
    told += [f"all else {rest:+.2f} Hz"] if told and abs(rest) > 5e-3 else []
    return [*energy(first, index), *([f"  moved by the stiffness of: {', '.join(told)}"] if told else [])]


def _moved(first: OperatingPoint, then: OperatingPoint, at: OperatingPoint, mode: Mode) -> dict[str, float]:
    """What the change of each element's stiffness does to a frequency (Hz), to first order about one of two conditions."""
    import numpy as np

    from thermospindle.model.rotor.chain import element_rows

    rows = {e.name: element_rows(at.chain, e) @ mode.shape for e in at.chain.elements}
    before, after = ({e.name: e.stiffness for e in p.chain.elements} for p in (first, then))
    quadratic: Callable[[Any, Any], float] = lambda row, k: float(np.real(row.conj() @ k @ row))  # noqa: E731
    total = sum(quadratic(rows[e.name], e.stiffness) for e in at.chain.elements)
    both = [name for name in rows if name in before and name in after]
    return {name: 0.5 * mode.frequency * quadratic(rows[name], after[name] - before[name]) / total for name in both}
