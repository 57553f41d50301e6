"""What the log of a run shows, as plain numbers: modal peaks side by side, a summary, which FRFs in which range.

Nothing here knows Rerun.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.types import Array
from thermospindle.sim.campaign.campaign import Test
from thermospindle.sim.hammer.excited import most_excited
from thermospindle.sim.identification.frf import Frf, decibel
from thermospindle.sim.identification.numbering import identified, in_band, numbered
from thermospindle.sim.identification.pairing import by_kind
from thermospindle.sim.identification.peak import Peak
from thermospindle.sim.operating import provenance
from thermospindle.sim.run import Run, as_campaign

Pair = tuple[int, int]  # response node, hammer node
FRAMES = 900  # about, of the sweep through the band
DRAWN = 5  # mode shapes in the overview
NOTHING = 60  # dB: an FRF so far below the largest is noise, its response vanishes by symmetry; it does not set the limits of plots

NO_COHERENCE = "of one hit there is no coherence"


def tests_of(run: Run) -> tuple[Test, ...]:
    """The run's virtual tests, with the ids they have in its campaign; ValueError if two have the same."""
    tests = as_campaign(run, run.spindle.title).tests
    if len({t.id for t in tests}) < len(tests):
        raise ValueError("two steps of the run have the same temperature and speed")
    return tests


def peaks(run: Run) -> list[Peak]:
    """Computed, identified and measured peaks; a measured mode is the model's one of its kind and order at the first step."""
    found: list[Peak] = []
    numbers = numbered(run)
    for step, test, number in zip(run.steps, tests_of(run), numbers, strict=True):
        modes, estimate = step.point.modes, step.identified
        for i, n in sorted(number.items(), key=lambda item: item[1]):
            found.append(Peak("computed", test.id, test.temperature, n, modes[i].kind, modes[i].frequency, np.nan, modes[i].damping_ratio))
        computed = {k: i for i, k in identified(step).items()}
        for k, (f, sd, damping) in enumerate(zip(estimate.frequency, estimate.frequency_sd, estimate.damping, strict=True)):
            i = computed.get(k, -1)
            kind = modes[i].kind if i >= 0 else "unknown"
            found.append(Peak("identified", test.id, test.temperature, number.get(i, 0), kind, float(f), float(sd), float(damping)))
    kinds = [run.steps[0].point.modes[i].kind for i in in_band(run.steps[0])]
    for campaign in run.measured:
        name = campaign.folder.name if campaign.folder else "measured"
        for test in campaign.tests:
            rows = sorted(test.modes, key=lambda r: r.frequency)
            number = by_kind([(r.kind, r.frequency) for r in rows], kinds)
            for k, row in enumerate(rows):
                damping = np.nan if row.damping_ratio is None else row.damping_ratio
                found.append(
                    Peak(name, test.id, test.temperature, number.get(k, -1) + 1, row.kind, row.frequency, row.frequency_sd, damping)
                )
    return found


def summary(run: Run, found: Sequence[Peak]) -> str:
    """Markdown: the peaks of every temperature beside each other, the state of the bearings, and where it all comes from."""
    temperatures = sorted({p.temperature for p in found})
    own = sorted(s.point.condition.temperature for s in run.steps)
    ends = list(dict.fromkeys((own[0], own[-1])))
    kinds = ["**computed**", "identified", *(["*measured*"] if run.measured else [])]
    lines = [f"Modal peaks, Hz: {' / '.join(kinds)}", "", *_table(found, ends)]
    lines += ["", "All temperatures:", "", *_table(found, temperatures)] if temperatures != ends else []
    named = [(f"{s.point.condition.temperature:g} °C", s) for s in run.steps]
    lines += ["", f"**{run.spindle.title}**", "", "Bearings:", ""]
    lines += [f"- {t}: {s.point.state.words}" for t, s in named]
    lines += ["", "Identification:", "", *(f"- {t}: {s.identified.status}" for t, s in named)]
    lines += [
        f"- {p.temperature:g} °C: {p.frequency:.1f} Hz is none of the model's modes"
        for p in found
        if p.source == "identified" and not p.mode
    ]
    lines += ["", "Measured:", "", *(f"- {c.title}" for c in run.measured)] if run.measured else []
    return "\n".join([*lines, *made_from(run.spindle)]) + "\n"


def made_from(spindle: Spindle) -> list[str]:
    """The end of every summary: scene and versions."""
    return ["", "Made from:", "", *(f"- {name}: {text}" for name, text in provenance(spindle).items())]


def _table(found: Sequence[Peak], temperatures: Sequence[float]) -> list[str]:
    sources = list(dict.fromkeys(p.source for p in found))
    value = {(p.source, p.temperature, p.mode): p.frequency for p in found if p.mode}
    lines = ["| mode | " + " | ".join(f"{t:g} °C" for t in temperatures) + " |", "|---|" + "---|" * len(temperatures)]
    for mode, kind in {p.mode: p.kind for p in found if p.source == "computed"}.items():
        cells = []
        for t in temperatures:
            known = [(k, value[s, t, mode]) for k, s in enumerate(sources) if (s, t, mode) in value]
            cells.append(" / ".join(("**{:.0f}**", "{:.0f}", "*{:.0f}*")[min(k, 2)].format(f) for k, f in known))
        lines.append(f"| {mode} {kind} | " + " | ".join(cells) + " |")
    return lines


def bearing_series(run: Run, name: str) -> dict[tuple[str, str], Array]:
    """Quantities of one bearing over the temperatures, (temperatures,) by name and unit; k is stiffness.

    A ring gap is the outer ring's thermal motion less the inner ring's.
    """
    if any(name in s.point.state.rollers for s in run.steps):
        rolling = [s.point.state.rollers[name] for s in run.steps]
        of_rollers = {
            ("clearance", "µm"): [1e6 * s.clearance for s in rolling],
            ("roller force", "N"): [s.contact_force for s in rolling],
            ("k radial", "N/µm"): [1e-6 * s.radial_stiffness for s in rolling],
            ("k tilt", "N m/rad"): [s.tilt_stiffness for s in rolling],
        }
        return {key: np.array(values) for key, values in of_rollers.items()}
    states = [s.point.state.bearing(name) for s in run.steps]
    motions = [s.point.motions[name] for s in run.steps]
    series = {
        ("angle", "deg"): [np.degrees(s.contact_angle) for s in states],
        ("deformation", "µm"): [1e6 * s.deformation for s in states],
        ("ball force", "N"): [s.contact_force for s in states],
        ("preload", "N"): [s.preload for s in states],
        ("k radial", "N/µm"): [1e-6 * s.radial_stiffness for s in states],
        ("k axial", "N/µm"): [1e-6 * s.axial_stiffness for s in states],
        ("k tilt", "N m/rad"): [s.tilt_stiffness for s in states],
        ("ring gap r", "µm"): [1e6 * (m.outer_r - m.inner_r) for m in motions],
        ("ring gap z", "µm"): [1e6 * (m.outer_z - m.inner_z) for m in motions],
    }
    return {key: np.array(values) for key, values in series.items()}


# ---------------------------------------------------------------- what is shown where


@dataclass(frozen=True, eq=False)
class Shown:
    """What the log and its blueprint agree on."""

    run: Run
    tests: tuple[Test, ...]
    peaks: tuple[Peak, ...]
    modes: tuple[Mode, ...]  # in the band, at the first temperature
    drawn: tuple[int, ...]  # numbers of those that the overview draws, from 1: the ones that the hammers excite most
    pairs: tuple[Pair, ...]  # FRFs with views of their own, driving points first
    level: tuple[float, float]  # dB, limits of their plots
    band: tuple[int, int]  # Hz
    step: int  # Hz, between frames of the sweep

    @property
    def temperatures(self) -> list[float]:
        """In C, of the tests."""
        return [t.temperature for t in self.tests]

    @property
    def coherent(self) -> bool:
        """Whether the tests have a coherence: several hits do."""
        return frf_of(self.tests[0]).coherence is not None

    @property
    def measured(self) -> dict[tuple[str, str], list[Peak]]:
        """Measured peaks by campaign and test."""
        found: dict[tuple[str, str], list[Peak]] = {}
        for p in self.peaks:
            if p.source not in ("computed", "identified"):
                found.setdefault((p.source, p.test), []).append(p)
        return found


def shown(run: Run) -> Shown:
    """What to show of a run."""
    tests = tests_of(run)
    pairs = _pairs(frf_of(tests[0]))
    low, high = run.spindle.hammer.band
    level = np.array([decibel(one(frf_of(t).value, frf_of(t), pair)) for t in tests for pair in pairs])
    level = level[level.max(axis=1) > level.max() - NOTHING]
    point = run.steps[0].point
    modes = tuple(point.modes[i] for i in in_band(run.steps[0]))
    below = sum(m.frequency < low for m in modes)
    return Shown(
        run,
        tests,
        tuple(peaks(run)),
        modes,
        tuple(below + i + 1 for i in most_excited(point, modes[below:], DRAWN)),
        pairs,
        level_ends(level),
        (int(np.floor(low)), int(np.ceil(high))),
        max(round((high - low) / FRAMES), 1),
    )


def _pairs(frf: Frf) -> tuple[Pair, ...]:
    """Driving points, the other hammer point's answer to the first hammer, and one point more."""
    hammers, others = frf.reference_nodes, [n for n in frf.response_nodes if n not in frf.reference_nodes]
    return (*((h, h) for h in hammers), *((n, hammers[0]) for n in (*hammers[1:2], *others[-2:-1])))


def frf_of(test: Test) -> Frf:
    assert test.frf is not None  # virtual tests have FRFs
    return test.frf


def one(array: np.ndarray, frf: Frf, pair: Pair) -> np.ndarray:
    """The lines (n,) of one pair of an array (responses, references, n) of `frf`."""
    return array[frf.response_nodes.index(pair[0]), frf.reference_nodes.index(pair[1])]


def level_ends(level: Array) -> tuple[float, float]:
    """Ends of an axis for levels (dB), in tens: with room above the highest peak for its mark, and without the few deepest lines."""
    return float(10 * np.floor(np.percentile(level, 0.5) / 10) - 5), float(10 * np.ceil((level.max() + 3) / 10))
