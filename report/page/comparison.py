"""Measured, published, computed and identified natural frequencies side by side: the table of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.model.rotor.modes import group_energy
from thermospindle.report.figures import report as plots
from thermospindle.report.figures.report import Peaks
from thermospindle.sim.campaign.campaign import Campaign
from thermospindle.sim.campaign.published import published
from thermospindle.sim.identification.numbering import identified, nearest, numbered, rows_of, temperature_of
from thermospindle.sim.identification.pairing import by_kind
from thermospindle.sim.run import Run, Step

SAME_TEMPERATURE = 0.5  # K within which a measurement counts as taken at a temperature of the run


@dataclass(frozen=True)
class Row:
    """One computed mode in the table of frequencies; `number` counts from 1 in order of frequency at the coldest temperature."""

    number: int
    kind: str
    flexibility: str  # group with the largest share of the strain energy
    share: float
    bearing_share: float
    published_flexibility: str


@dataclass(frozen=True)
class Table:
    """Natural frequencies of every source, at the two temperatures that are compared."""

    rows: tuple[Row, ...]
    peaks: tuple[Peaks, ...]
    temperatures: tuple[float, float]  # C, equal for a run at one temperature only
    titles: Mapping[str, str]  # of the sources, by label
    elsewhere: tuple[str, ...]  # sources without a frequency at these temperatures, in words

    def sources(self) -> dict[str, str]:
        """Kind of every source by its label, in the order of the columns."""
        return {p.label: p.source for p in self.peaks}

    def of(self, source: str, temperature: float) -> Peaks | None:
        """The first source of a kind at a temperature."""
        return next((p for p in self.peaks if p.source == source and p.temperature == temperature), None)

    def at(self, label: str, temperature: float, number: int) -> tuple[float, float] | None:
        """Frequency and its standard error (Hz, NaN where not known)."""
        values = [p.value for p in self.peaks if p.label == label and p.temperature == temperature]
        return values[0].get(number) if values else None

    def shift(self, label: str, number: int) -> tuple[float, float] | None:
        """Shift and its standard error (Hz) from the first to the second temperature; errors of the two are independent."""
        cold, hot = (self.at(label, t, number) for t in self.temperatures)
        if cold is None or hot is None or self.temperatures[0] == self.temperatures[1]:
            return None
        return hot[0] - cold[0], float(np.hypot(cold[1], hot[1]))

    def labels(self) -> dict[int, str]:
        """What the picture calls the modes: those that were measured or published, or all."""
        known = {n for p in self.peaks if p.source in ("measured", "published") for n in p.value}
        return {r.number: f"{r.number}  {r.kind}" for r in self.rows if r.number in known or not known}


def compared(run: Run) -> Table:
    """Measured, published, computed and identified frequencies side by side.

    The temperatures are the outermost of the run at which something was measured or published; with
    one such, that and the hottest; without, the run's own.
    """
    numbers, own = numbered(run), [temperature_of(s) for s in run.steps]
    papers = () if run.steps[0].point.condition.speed else published(run.spindle)
    known = _measured_peaks(run, numbers)
    flexibility: dict[int, str] = {}
    titles = {_label(run, c): f"{c.title}. {c.note}".strip() for c in run.measured if any(t.modes for t in c.tests)}
    for paper in papers:
        label = "published" if len(papers) == 1 else f"published, {paper.title}"
        titles[label] = f"{paper.title}. {paper.source}"
        for temperature, frequency in paper.frequency.items():
            k = nearest(run, temperature)
            pairs = by_kind(list(zip(paper.kinds, frequency, strict=True)), [m.kind for m in run.steps[k].point.modes])
            rows = {numbers[k][c]: i for i, c in pairs.items() if c in numbers[k]}
            flexibility = {n: paper.flexibility[i] for n, i in rows.items()} | flexibility
            known.append(Peaks("published", label, temperature, {n: (frequency[i], np.nan) for n, i in rows.items()}))
    common = [t for t in own if any(abs(p.temperature - t) <= SAME_TEMPERATURE for p in known)]
    ends = common if len(common) > 1 else [min(own), max(own)] if not common or common[0] in (min(own), max(own)) else [common[0], max(own)]
    peaks = []
    for t in dict.fromkeys((min(ends), max(ends))):
        step, at = run.steps[own.index(t)], numbers[own.index(t)]
        modes, estimate, pairs = step.point.modes, step.identified, identified(step)
        exact = {n: (modes[i].frequency, np.nan) for i, n in at.items()}
        found = {n: (float(estimate.frequency[pairs[i]]), float(estimate.frequency_sd[pairs[i]])) for i, n in at.items() if i in pairs}
        peaks += [replace(p, temperature=t) for p in known if abs(p.temperature - t) <= SAME_TEMPERATURE]
        peaks += [Peaks("computed", "computed", t, exact), Peaks("identified", "identified", t, found)]
    peaks.sort(key=lambda p: list(plots.SOURCES).index(p.source))
    missing = dict.fromkeys(p.label for p in known if p.label not in {q.label for q in peaks})
    elsewhere = [f"{x} at {', '.join(f'{p.temperature:g}' for p in known if p.label == x)} °C" for x in missing]
    first = own.index(min(ends))
    lines = tuple(_row(run.steps[first], i, n, flexibility.get(n, "")) for i, n in numbers[first].items())
    return Table(lines, tuple(peaks), (min(ends), max(ends)), titles, tuple(elsewhere))


def _measured_peaks(run: Run, numbers: Sequence[Mapping[int, int]]) -> list[Peaks]:
    """Measured frequencies by campaign and temperature; repeated tests give their mean."""
    peaks = []
    for campaign in run.measured:
        rows = rows_of(run, campaign, numbers)
        tests = [t for t in campaign.tests if t.id in rows]
        for temperature in dict.fromkeys(t.temperature for t in tests):
            value: dict[int, tuple[float, float]] = {}
            repeats = [rows[t.id] for t in tests if t.temperature == temperature]
            for index in sorted({i for r in repeats for i in r}):
                own = [r[index] for r in repeats if index in r]
                error = float(np.sqrt(sum(r.frequency_sd**2 for r in own))) / len(own)
                value[index + 1] = (float(np.mean([r.frequency for r in own])), error)
            peaks.append(Peaks("measured", _label(run, campaign), temperature, value))
    return peaks


def _label(run: Run, campaign: Campaign) -> str:
    several = sum(any(t.modes for t in c.tests) for c in run.measured) > 1
    return f"measured, {campaign.name}" if several else "measured"


def _row(step: Step, index: int, number: int, flexibility: str) -> Row:
    mode = step.point.modes[index]
    shares = group_energy(step.point.chain, mode)
    largest = max(shares, key=lambda name: shares[name])
    return Row(number, mode.kind, largest, shares[largest], shares.get("bearings", 0.0), flexibility)
