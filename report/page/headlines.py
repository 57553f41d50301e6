"""What a reader of a report should see at once: headlines, and where the model does not meet the measurement, in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from thermospindle.model.machine import Spindle
from thermospindle.report.figures.report import Peaks
from thermospindle.report.page.comparison import Table
from thermospindle.sim.identification.numbering import temperature_of
from thermospindle.sim.run import Run

CERTAIN = 2.0  # standard errors beyond which a difference is called one
SAME = 0.05  # N, in which preloads differ that are told as one
APART = 0.5  # Hz, from which a difference from the published analysis is told of a second temperature
CLOSE = 0.05  # relative distance of neighbours whose splitting is compared


def headlines(run: Run, table: Table) -> list[tuple[str, str, str]]:
    """(what, number, explanation): preload, bearing angle and stiffness, and how far the modes of each flexibility move."""
    cold, hot = table.temperatures
    first, last = (next(s.point.state for s in run.steps if temperature_of(s) == t) for t in (cold, hot))
    pairs = list(zip(first.bearings, last.bearings, strict=True))[::-1]
    names = [b.name for _, b in pairs]
    if cold == hot:
        return [_preload(names, [a.preload for a, _ in pairs], f"at {cold:g} °C")] if pairs else []
    change, cards = f"from {cold:g} to {hot:g} °C", []
    if pairs:
        radial, which = _each(names, [_change(a.radial_stiffness, b.radial_stiffness) for a, b in pairs])
        axial, _ = _each(names, [_change(a.axial_stiffness, b.axial_stiffness) for a, b in pairs])
        cards = [
            _preload_change(names, [(a.preload, b.preload) for a, b in pairs], cold, hot),
            ("Contact angle", *_each(names, [f"{np.degrees(b.contact_angle - a.contact_angle):+z.2f}" for a, b in pairs], " degrees", change)),
            ("Radial bearing stiffness", radial, f"{which or change}; axial {axial}"),
        ]
    groups: dict[tuple[str, str], list[int]] = {}
    for row in table.rows:
        other = row.published_flexibility and row.flexibility.rstrip("s") not in row.published_flexibility
        groups.setdefault((row.flexibility, f" (published: {row.published_flexibility})" if other else ""), []).append(row.number)
    for (name, published), numbers in groups.items():
        shifts = [f"{s[0]:+z.1f}" if (s := table.shift("computed", n)) else "gone" for n in numbers]  # as where bearings have lost contact
        modes = f"Mode{'s' if len(numbers) > 1 else ''} {_listed(numbers)}"
        alike = {frozenset(["gone"]): "gone", frozenset(["+0.0"]): "less than 0.05 Hz"}.get(frozenset(shifts))
        cards.append((f"{modes}: {name} by the model{published}", alike or f"{', '.join(shifts)} Hz", f"computed shift from {cold:g} to {hot:g} °C"))
    return cards


def _each(names: Sequence[str], numbers: Sequence[str], unit: str = "", when: str = "") -> tuple[str, str]:
    """The number of every bearing, and an explanation that names the bearings in order; of more than two each stands beside its number."""
    if len(names) > 2:
        return ", ".join(f"{name}\u00a0{number}" for name, number in zip(names, numbers, strict=True)) + unit, when
    return " / ".join(numbers) + unit, ", ".join(filter(None, [" / ".join(names) + " bearing", when]))


def _preload(names: Sequence[str], of: Sequence[float], at: str) -> tuple[str, str, str]:
    """A card of the preload of every bearing, once where all have the same."""
    if max(of) - min(of) < SAME:
        return "Preload", f"{of[0]:.1f} N", at
    return "Preload", *_each(names, [f"{n:z.0f}" for n in of], " N", at)


def _preload_change(names: Sequence[str], of: Sequence[tuple[float, float]], cold: float, hot: float) -> tuple[str, str, str]:
    """A card of what becomes of it (before, after), once where all have the same."""
    if np.ptp(of, axis=0).max() >= SAME:
        return "Preload", *_each(names, [f"{a:z.0f}\u00a0→\u00a0{b:z.0f}" for a, b in of], " N", f"from {cold:g} to {hot:g} °C")
    before, after = of[0]
    if before and abs(after - before) < SAME:  # as springs hold it
        return "Preload", f"{before:z.1f} N", f"the same at {cold:g} and {hot:g} °C"
    told = f"none at {cold:g} °C" if not before else f"{100 * after / before:z.0f} % of it is left at {hot:g} °C" if after < before else f"{_change(before, after)} at {hot:g} °C"
    return "Preload", f"{before:z.1f} → {after:z.1f} N", told


def _change(before: float, after: float) -> str:
    return f"{round(100 * (after / before - 1)):+d} %" if before else "from nothing"


def misses(table: Table) -> list[str]:
    """Sentences on where the model does not meet the measurement, and on what else disagrees; every number is computed."""
    measured, own, paper = (table.of(source, table.temperatures[0]) for source in ("measured", "computed", "published"))
    if own is None:
        return []
    sentences: list[str] = []
    if measured is not None and set(measured.value) & set(own.value):
        sentences += [*_frequency_misses(table, measured, own), *_shift_misses(table, measured.label)]
        if paper is not None and (both := [n for n in paper.value if n in measured.value and n in own.value]):
            far, near = (max(abs(paper.value[n][0] - other.value[n][0]) for n in both) for other in (measured, own))
            apart = f"at most {near:.1f}" if near >= 0.05 else "less than 0.1"
            sentences.append(
                f"The published analysis misses the measurement too, by up to {far:.1f} Hz at {own.temperature:g} °C; "
                f"it differs from the model by {apart} Hz.{_parted(table, both)}"
            )
    for name in dict.fromkeys(r.published_flexibility for r in table.rows if r.published_flexibility):
        other = [r for r in table.rows if r.published_flexibility == name and r.flexibility.rstrip("s") not in name]
        shares = (f"mode {r.number}: {r.flexibility} {100 * r.share:.0f} %, bearings {100 * r.bearing_share:.0f} %" for r in other)
        if other:
            sentences.append(
                f"The publication names “{name}” as the main flexibility of modes for which most of the model's strain energy "
                f"sits elsewhere ({'; '.join(shares)})."
            )
    return sentences


def _parted(table: Table, numbers: Sequence[int]) -> str:
    """At which other temperature the published analysis is farthest from the model, where that is more than `APART`; else empty."""
    found = []
    for temperature in table.temperatures[1:]:
        paper, own = (table.of(source, temperature) for source in ("published", "computed"))
        if paper is not None and own is not None:
            found += [(abs(paper.value[n][0] - own.value[n][0]), temperature) for n in numbers if n in paper.value and n in own.value]
    most, where = max(found, default=(0.0, 0.0))
    return f" At {where:g} °C they differ by up to {most:.1f} Hz." if most > APART else ""


def _frequency_misses(table: Table, measured: Peaks, own: Peaks) -> Iterator[str]:
    """The largest miss at the first temperature, and neighbours of one kind whose distance is missed."""
    kinds = {r.number: r.kind for r in table.rows}
    off = {n: own.value[n][0] - f for n, (f, _) in measured.value.items() if n in own.value}
    worst = max(off, key=lambda n: abs(off[n]))
    f, miss = measured.value[worst][0], off[worst]
    yield (
        f"The largest miss at {own.temperature:g} °C is mode {worst} ({kinds[worst]}): computed {own.value[worst][0]:.1f} Hz, "
        f"measured {f:.1f} Hz, {abs(miss):.1f} Hz or {100 * abs(miss) / f:.1f} % too {'high' if miss > 0 else 'low'}. "
        f"Over all {len(off)} measured modes the difference runs from {min(off.values()):+z.1f} to {max(off.values()):+z.1f} Hz."
    )
    for a, b in pairwise(sorted(off, key=lambda n: measured.value[n][0])):
        apart, mine = (p.value[b][0] - p.value[a][0] for p in (measured, own))
        error = np.hypot(measured.value[a][1], measured.value[b][1])
        if kinds[a] == kinds[b] and apart < CLOSE * measured.value[a][0] and abs(apart - mine) > CERTAIN * error:
            yield f"Modes {a} and {b} ({kinds[a]}) are measured {apart:.1f} Hz apart, computed {mine:.1f} Hz."


def calibration(spindle: Spindle) -> str:
    """A sentence on the scene's calibrated numbers, with the reason that the scene gives; empty if there are none."""
    sources = Counter(p.source for p in spindle.provenance.values() if p.origin == "calibrated")
    reasons = "; ".join(filter(None, sources))
    return f"Agreement is partly made: {sources.total()} of the scene's numbers are calibrated ({reasons})." if sources else ""


def _shift_misses(table: Table, label: str) -> Iterator[str]:
    """Sentences on shifts that differ by more than `CERTAIN` standard errors of the measured one."""
    cold, hot = table.temperatures
    sure = []
    for row in table.rows:
        measured, own = table.shift(label, row.number), table.shift("computed", row.number)
        if measured and own and abs(measured[0] - own[0]) > CERTAIN * measured[1]:
            sure.append((row.number, row.kind, *measured, own[0]))
    for number, kind, value, error, own_value in sure:
        if value * own_value < 0:
            verbs = ("rises", "falls") if value > 0 else ("falls", "rises")
            yield (
                f"From {cold:g} to {hot:g} °C mode {number} ({kind}) {verbs[0]} by {abs(value):.1f} ± {error:.1f} Hz "
                f"when measured and {verbs[1]} by {abs(own_value):.1f} Hz when computed."
            )
    for further, words in ((True, "further"), (False, "less far")):
        same_way = [(n, m, c) for n, _, m, _, c in sure if m * c > 0 and (abs(m) > abs(c)) == further]
        if same_way:
            each = "; ".join(f"mode {n}: {m:+z.1f} against {c:+z.1f} Hz" for n, m, c in same_way)
            modes = _listed([n for n, _, _ in same_way])
            yield f"Measured frequencies move {words} than computed ones in modes {modes} ({each})."


def _listed(numbers: Sequence[int]) -> str:
    return " and ".join(filter(None, [", ".join(map(str, numbers[:-1])), str(numbers[-1])]))
