"""Measured, published, computed and identified natural frequencies side by side, and what differs, in sentences."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from markupsafe import Markup

from model.machine import Spindle
from model.modes import group_energy
from model.scene import BadInput
from sim import plots
from sim.campaign import Campaign, ModeRow, Test
from sim.operating import OperatingPoint, operating_point
from sim.plots import Peaks
from sim.run import Run, Step
from sim.shift import follow, match

RPM = 2 * np.pi / 60
SAME_TEMPERATURE = 0.5  # K within which a measurement counts as taken at a temperature of the run
STRIDE = 10.0  # K, over which a mode can be followed by its shape
CERTAIN = 2.0  # standard errors beyond which a difference is called one
CLOSE = 0.05  # relative distance of neighbours whose splitting is compared
PUBLISHED_COLUMNS = ("mode", "kind", "main_flexibility", "frequency_20C_Hz, frequency_60C_Hz, ...")


# ---------------------------------------------------------------- which mode is which


def measured_rows(run: Run) -> dict[str, dict[int, ModeRow]]:
    """Which measured mode is which computed one: by test id, the measured row by index of the computed mode at the first step.

    Measured modes come without shapes. So the k-th measured mode of a kind, in order of frequency, is taken for the k-th computed
    mode of this kind at the temperature of the run nearest to the test's; from there the computed mode is followed by its shape.
    A mode that the measurement missed would therefore shift the later ones of its kind by one place. Measured modes beyond
    the computed ones of their kind in the band, and tests at another speed, are left out.
    """
    numbers = numbered(run)
    return {name: row for campaign in run.measured for name, row in _rows_of(run, campaign, numbers).items()}


def _rows_of(run: Run, campaign: Campaign, numbers: Sequence[Mapping[int, int]]) -> dict[str, dict[int, ModeRow]]:
    """`measured_rows` of one campaign."""
    found = {}
    for test in (t for t in campaign.tests if t.modes and same_speed(t, run)):
        k = nearest(run, test.temperature)
        pairs = by_kind([(r.kind, r.frequency) for r in test.modes], [m.kind for m in run.steps[k].point.modes])
        found[test.id] = {numbers[k][c] - 1: test.modes[m] for m, c in pairs.items() if c in numbers[k]}
    return found


def by_kind(known: Sequence[tuple[str, float]], kinds: Sequence[str]) -> dict[int, int]:
    """Index among computed modes, whose `kinds` stand in order of frequency, by index of each `known` (kind, frequency): the
    k-th of a kind is the k-th of this kind."""
    pairs: dict[int, int] = {}
    for kind in dict.fromkeys(k for k, _ in known):
        own = sorted((i for i, (k, _) in enumerate(known) if k == kind), key=lambda i: known[i][1])
        pairs |= dict(zip(own, (i for i, k in enumerate(kinds) if k == kind), strict=False))
    return dict(sorted(pairs.items()))


def numbered(run: Run) -> list[dict[int, int]]:
    """At every step, the number of each mode by its index: modes in the band at the first step count from 1 in order of
    frequency, and are followed from there by their shapes."""
    rows = [{i: i + 1 for i in in_band(run.steps[0])}]
    for a, b in pairwise(s.point for s in run.steps):
        numbers = rows[-1]
        for here, there in pairwise(_path(a, b)):
            partner = _partners(here, there)
            numbers = {partner[i]: number for i, number in numbers.items() if i in partner}
        rows.append(numbers)
    return rows


def _partners(a: OperatingPoint, b: OperatingPoint) -> dict[int, int]:
    """Index at `b` by index at `a` of every mode that goes on; axial modes stay axial."""
    partner: dict[int, int] = {}
    for axial in (True, False):
        mine, theirs = ([i for i, m in enumerate(p.modes) if (m.kind == "axial") == axial] for p in (a, b))
        if mine and theirs:
            found = follow(a.linear.mass, [a.modes[i] for i in mine], [b.modes[j] for j in theirs])
            partner |= {i: theirs[k] for i, k in zip(mine, found, strict=True) if k >= 0}
    return partner


def _path(a: OperatingPoint, b: OperatingPoint) -> list[OperatingPoint]:
    """From one operating point to another in steps of at most `STRIDE`."""
    count = int(np.ceil(abs(b.condition.temperature - a.condition.temperature) / STRIDE - 1e-9))
    between = np.linspace(a.condition.temperature, b.condition.temperature, max(count, 1) + 1)[1:-1]
    return [a, *(operating_point(a.spindle, replace(a.condition, temperature=float(t))) for t in between), b]


def in_band(step: Step) -> list[int]:
    """Indices of the modes below the upper end of the scene's frequency band."""
    return [i for i, m in enumerate(step.point.modes) if m.frequency <= step.point.spindle.hammer.band[1]]


def identified(step: Step) -> dict[int, int]:
    """Index of the identified mode by index of the computed one, paired by shape and frequency."""
    index = {id(m): i for i, m in enumerate(step.point.modes)}
    return {index[id(mode)]: i for i, mode in match(step).items()}


# ---------------------------------------------------------------- published frequencies


@dataclass(frozen=True)
class Published:
    """Somebody else's natural frequencies of the spindle at rest, from `published/<name>.csv` beside the scene.

    `frequency`: Hz by temperature (C), for every mode; `flexibility` is what the source names as its main flexibility, or empty.
    """

    title: str
    source: str
    kinds: tuple[str, ...]
    flexibility: tuple[str, ...]
    frequency: Mapping[float, tuple[float, ...]]


def published(spindle: Spindle) -> tuple[Published, ...]:
    """Every published table beside the scene file, by name."""
    folder = spindle.file.parent / "published" if spindle.file else Path("does not exist")
    return tuple(read_published(path) for path in sorted(folder.glob("*.csv")))


def read_published(path: Path) -> Published:
    """A table of published natural frequencies: comment lines (#) with title and source, then CSV.

    Columns: mode, kind, main_flexibility (may be left out) and a frequency_<T>C_Hz for every temperature. Raises `BadInput`.
    """
    text = path.read_text(encoding="utf-8").splitlines()
    comments = [line.lstrip("# ") for line in text if line.startswith("#")]
    reader = csv.DictReader(line for line in text if line and not line.startswith("#"))
    columns = {name: re.fullmatch(r"frequency_(-?[\d.]+)C_Hz", name) for name in reader.fieldnames or ()}
    temperatures = {name: float(m.group(1)) for name, m in columns.items() if m}
    unknown = [n for n in columns if n not in (*temperatures, "mode", "kind", "main_flexibility")]
    if unknown or not temperatures or "kind" not in columns:
        raise BadInput(f"{path}: columns {list(columns)}; expected are {', '.join(PUBLISHED_COLUMNS)}")
    rows = list(reader)
    try:
        frequency = {t: tuple(float(row[name]) for row in rows) for name, t in temperatures.items()}
    except (TypeError, ValueError) as error:
        raise BadInput(f"{path}: a frequency is no number: {error}") from None
    kinds, flexibility = (tuple(row.get(key) or "" for row in rows) for key in ("kind", "main_flexibility"))
    return Published(comments[0] if comments else path.stem, " ".join(comments[1:]), kinds, flexibility, frequency)


# ---------------------------------------------------------------- Table 2


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

    The temperatures are the outermost of the run at which something was measured or published, or its own if there are not two.
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
    ends = common if len(common) > 1 else own
    peaks = []
    for t in dict.fromkeys((min(ends), max(ends))):
        step, at = run.steps[own.index(t)], numbers[own.index(t)]
        modes, seen, pairs = step.point.modes, step.identified, identified(step)
        exact = {n: (modes[i].frequency, np.nan) for i, n in at.items()}
        found = {n: (float(seen.frequency[pairs[i]]), float(seen.frequency_sd[pairs[i]])) for i, n in at.items() if i in pairs}
        peaks += [replace(p, temperature=t) for p in known if abs(p.temperature - t) <= SAME_TEMPERATURE]
        peaks += [Peaks("computed", "computed", t, exact), Peaks("identified", "identified", t, found)]
    peaks.sort(key=lambda p: list(plots.SOURCES).index(p.source))
    missing = dict.fromkeys(p.label for p in known if p.label not in {q.label for q in peaks})
    elsewhere = [f"{x} at {', '.join(f'{p.temperature:g}' for p in known if p.label == x)} °C" for x in missing]
    lines = tuple(_row(run.steps[0], i, n, flexibility.get(n, "")) for i, n in numbers[0].items())
    return Table(lines, tuple(peaks), (min(ends), max(ends)), titles, tuple(elsewhere))


def _measured_peaks(run: Run, numbers: Sequence[Mapping[int, int]]) -> list[Peaks]:
    """Measured frequencies by campaign and temperature; repeated tests give their mean."""
    peaks = []
    for campaign in run.measured:
        rows = _rows_of(run, campaign, numbers)
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
    return f"measured, {campaign.folder.name if campaign.folder else campaign.title}" if several else "measured"


def _row(step: Step, index: int, number: int, flexibility: str) -> Row:
    mode = step.point.modes[index]
    shares = group_energy(step.point.chain, mode)
    largest = max(shares, key=lambda name: shares[name])
    return Row(number, mode.kind, largest, shares[largest], shares.get("bearings", 0.0), flexibility)


# ---------------------------------------------------------------- what a reader should see at once


def headlines(run: Run, table: Table) -> list[tuple[str, str, str]]:
    """(what, number, explanation): preload, bearing angle and stiffness, and how far the modes of each flexibility move."""
    cold, hot = table.temperatures
    first, last = (next(s.point.state for s in run.steps if temperature_of(s) == t) for t in (cold, hot))
    preload = [s.bearings[0].preload for s in (first, last)]
    if cold == hot:
        return [("Preload", f"{preload[0]:.1f} N", f"at {cold:g} °C")]
    pairs = list(zip(first.bearings, last.bearings, strict=True))[::-1]
    angle = " / ".join(f"{np.degrees(b.contact_angle - a.contact_angle):+.2f}" for a, b in pairs)
    radial = " / ".join(_change(a.radial_stiffness, b.radial_stiffness) for a, b in pairs)
    axial = " / ".join(_change(a.axial_stiffness, b.axial_stiffness) for a, b in pairs)
    names = " / ".join(b.name for _, b in pairs) + " bearing"
    cards = [
        (
            "Preload",
            f"{preload[0]:.1f} → {preload[1]:.1f} N",
            f"{100 * preload[1] / preload[0]:.0f} % of it is left at {hot:g} °C",
        ),
        ("Contact angle", f"{angle} degrees", f"{names}, from {cold:g} to {hot:g} °C"),
        ("Radial bearing stiffness", radial, f"{names}; axial {axial}"),
    ]
    groups: dict[tuple[str, str], list[int]] = {}
    for row in table.rows:
        named = (row.published_flexibility, "as published") if row.published_flexibility else (row.flexibility, "by the model")
        groups.setdefault(named, []).append(row.number)
    for (name, by), numbers in groups.items():
        shifts = ", ".join(f"{s[0]:+.1f}" for n in numbers if (s := table.shift("computed", n)))
        modes = f"Mode{'s' if len(numbers) > 1 else ''} {_listed(numbers)}"
        cards.append((f"{modes}: {name}, {by}", f"{shifts} Hz", f"computed shift from {cold:g} to {hot:g} °C"))
    return cards


def _change(before: float, after: float) -> str:
    return f"{100 * (after / before - 1):+.0f} %" if before else "from nothing"


def misses(table: Table) -> list[str]:
    """Sentences on where the model does not meet the measurement, and on what else disagrees; every number is computed."""
    measured, own, paper = (table.of(source, table.temperatures[0]) for source in ("measured", "computed", "published"))
    if own is None:
        return []
    says: list[str] = []
    if measured is not None and set(measured.value) & set(own.value):
        says += [*_frequency_misses(table, measured, own), *_shift_misses(table, measured.label)]
        if paper is not None and (both := [n for n in paper.value if n in measured.value and n in own.value]):
            far, near = (max(abs(paper.value[n][0] - other.value[n][0]) for n in both) for other in (measured, own))
            says.append(
                f"The published analysis misses the measurement too, by up to {far:.1f} Hz at {own.temperature:g} °C; "
                f"it differs from the model by at most {near:.1f} Hz."
            )
    for name in dict.fromkeys(r.published_flexibility for r in table.rows if r.published_flexibility):
        other = [r for r in table.rows if r.published_flexibility == name and r.flexibility.rstrip("s") not in name]
        shares = (f"mode {r.number}: {r.flexibility} {100 * r.share:.0f} %, bearings {100 * r.bearing_share:.0f} %" for r in other)
        if other:
            says.append(
                f"The publication names “{name}” as the main flexibility of modes for which most of the model's strain energy "
                f"sits elsewhere ({'; '.join(shares)})."
            )
    return says


def _frequency_misses(table: Table, measured: Peaks, own: Peaks) -> Iterator[str]:
    """The largest miss at the first temperature, and neighbours of one kind whose distance is missed."""
    kinds = {r.number: r.kind for r in table.rows}
    off = {n: own.value[n][0] - f for n, (f, _) in measured.value.items() if n in own.value}
    worst = max(off, key=lambda n: abs(off[n]))
    f, miss = measured.value[worst][0], off[worst]
    yield (
        f"The largest miss at {own.temperature:g} °C is mode {worst} ({kinds[worst]}): computed {own.value[worst][0]:.1f} Hz, "
        f"measured {f:.1f} Hz, {abs(miss):.1f} Hz or {100 * abs(miss) / f:.1f} % too {'high' if miss > 0 else 'low'}. "
        f"Over all {len(off)} measured modes the difference runs from {min(off.values()):+.1f} to {max(off.values()):+.1f} Hz."
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
            each = "; ".join(f"mode {n}: {m:+.1f} against {c:+.1f} Hz" for n, m, c in same_way)
            modes = _listed([n for n, _, _ in same_way])
            yield f"Measured frequencies move {words} than computed ones in modes {modes} ({each})."


def _listed(numbers: Sequence[int]) -> str:
    return " and ".join(filter(None, [", ".join(map(str, numbers[:-1])), str(numbers[-1])]))


def nearest(run: Run, temperature: float) -> int:
    """Index of the step nearest to a temperature (C)."""
    return min(range(len(run.steps)), key=lambda k: abs(temperature_of(run.steps[k]) - temperature))


def temperature_of(step: Step) -> float:
    return step.point.condition.temperature


def same_speed(test: Test, run: Run) -> bool:
    return bool(abs(test.speed - run.steps[0].point.condition.speed) < 0.5 * RPM)


def minus(text: str) -> str:
    """A true minus before digits, and units kept on the line of their number."""
    return re.sub(r"(?<=\d) (?=(%|Hz|N|°C)\b|%)", "\u00a0", re.sub(r"(?<![\w-])-(?=\d)", "−", text))


def signed(value: float, digits: int = 1) -> str:
    return minus(f"{value:+.{digits}f}")


def with_error(pair: tuple[float, float] | None, sign: bool = False, digits: int = 1) -> Markup:
    """A number with its standard error, to the error's first digit (two, if that is a one); an en dash for no number."""
    if pair is None:
        return Markup("–")
    value, error = pair
    if not 0 < error < np.inf:
        return Markup(minus(f"{value:{'+' if sign else ''}.{digits}f}"))
    digits = int(np.clip(-np.floor(np.log10(error / 2)), 0, 5))
    return Markup(minus(f"{value:{'+' if sign else ''}.{digits}f}") + f" <small>± {error:.{digits}f}</small>")
