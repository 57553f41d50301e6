"""What the workbench computes: a setting beside the tests of a campaign, or at conditions of its own where there is none.

Everything follows from a `Bench` (the scene, its tests, the effects that may be added) and a
`Setting`; nothing here knows of a page. Errors are those of `spindle compare`, number for number.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from thermospindle.diagnosis.compare.before_after import held_out
from thermospindle.diagnosis.compare.compare import TestComparison, compare, rms_residual
from thermospindle.diagnosis.compare.fit import Fitted, Free, fit
from thermospindle.diagnosis.data.observe import Observation, observe
from thermospindle.diagnosis.parameters.mechanism import REFERENCE_WIDTH
from thermospindle.diagnosis.runout.lines import modal_tests
from thermospindle.model.built.tolerance import Toleranced, deviated, toleranced
from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange
from thermospindle.model.machine import Addition, Condition, Spindle
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.scene.reading import load, scene_path
from thermospindle.model.types import Array, ComplexArray
from thermospindle.model.units import RPM
from thermospindle.report.workbench.state import FURTHEST, Setting, key_of, set_named
from thermospindle.sim.campaign.beside import beside
from thermospindle.sim.campaign.campaign import Campaign, Test, condition_of, read_campaign
from thermospindle.sim.effects import usable
from thermospindle.sim.effects.effect import HOOKS, Effect
from thermospindle.sim.effects.known import equipped
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import OperatingPoint, operating_point

LINES = 1500  # of an FRF that was not measured, over the scene's band
TEMPERATURES = 5  # of the conditions that stand in for tests
ABOVE = 1.1  # of the band, up to which modes are listed


@dataclass(frozen=True, eq=False)
class Shown:
    """A test, or a condition that stands in for one."""

    id: str
    condition: Condition
    test: Test | None = None


@dataclass(frozen=True, eq=False)
class Bench:
    """A scene as it was opened, `tests` that were measured (or conditions without any), and the effects that may be added to it."""

    scene: Path
    spindle: Spindle
    effects: tuple[Effect, ...]
    tolerances: tuple[Toleranced, ...]
    shown: tuple[Shown, ...]
    campaign: Campaign | None = None
    observations: tuple[Observation, ...] = ()
    effect_files: tuple[Path, ...] = ()
    left_out: tuple[str, ...] = ()  # tests that are left out at the beginning
    of_runout: tuple[str, ...] = ()  # tests of the campaign that have runout alone, which the bench does not show
    modes: dict[str, dict[int, Mode]] = field(default_factory=dict)  # of the scene as it was opened, by number at the first condition, where there are no tests

    def effect(self, name: str) -> Effect:
        return next(e for e in self.effects if e.name == name)

    def show(self, name: str) -> Shown:
        return next(s for s in self.shown if s.id == name)


@dataclass(frozen=True, eq=False)
class Curves:
    """One FRF: `computed` (n,) at `frequency` (n,) Hz, `measured` (n,) at the same lines, None where there is none; measured natural
    frequencies (k,) Hz of the test."""

    quantity: str
    frequency: Array
    computed: ComplexArray
    measured: ComplexArray | None
    peaks: Array


@dataclass(frozen=True)
class Cell:
    """One mode in one test: errors of frequency and damping ratio in standard errors, or without a campaign their change in percent."""

    mode: str
    test: str
    frequency: float
    damping: float | None
    says: str


@dataclass(frozen=True)
class Errors:
    """The whole: cells, rms errors in standard errors of fitted and left-out tests (None where
    there are none), what has no partner, in words."""

    cells: tuple[Cell, ...]
    fitted: float | None
    left_out: float | None
    remarks: tuple[str, ...] = ()


# ---------------------------------------------------------------- opening


def open_bench(
    scene: Path,
    campaign: Campaign | Path | None = None,
    effect_files: Sequence[Path] = (),
    progress: Callable[[str], None] = lambda done: None,
    left_out: Sequence[str] = (),
) -> Bench:
    """Read a scene and a campaign; FRFs are turned into modes once. Tests `left_out` are those that
    the scene was not fitted to where none are named.

    `BadInput` for what cannot be used, a campaign of runout alone among it.
    """
    file = scene_path(scene)
    spindle, catalogue = equipped(load(file), effect_files)
    present = {a.effect for a in spindle.effects}
    seen = tuple(e for e in usable(spindle, catalogue) if e.name not in present and any(getattr(e, h) for h in HOOKS if h != "imperfections"))
    bench = Bench(file, spindle, seen, tuple(toleranced(spindle)), (), effect_files=tuple(effect_files))
    if campaign is None:
        if left_out:
            raise BadInput(f"--held-out {left_out[0]}: without a campaign there is no test to leave out")
        points = {s: point for s in _conditions(spindle) if (point := _point_there(spindle, s)) is not None}
        if not points:
            raise BadInput(f"{file}: the bearings find no equilibrium at any temperature of the scene's range; spindle check says more")
        return replace(bench, shown=tuple(points), modes=_numbered(bench, points))
    every = campaign if isinstance(campaign, Campaign) else read_campaign(campaign)
    tests = modal_tests(every)
    if not tests.tests:
        raise BadInput(f"{every.folder or every.title}: holds runout tests alone; the workbench needs tests of modes (spindle compare and diagnose take runout)")
    unseen = held_out(spindle, tests, left_out)
    observed = observe(tests, spindle, progress)
    shown = tuple(Shown(t.id, condition_of(t), t) for t in tests.tests)
    of_runout = tuple(t.id for t in every.tests if t not in tests.tests)
    return replace(bench, campaign=tests, observations=tuple(observed), shown=shown, left_out=unseen, of_runout=of_runout)


def _conditions(spindle: Spindle) -> list[Shown]:
    """Five temperatures at rest, and the outermost two at the nominal speed where anything turns."""
    temperatures = np.linspace(*spindle.temperatures, TEMPERATURES)
    found = [Shown(f"{t:g} °C", Condition(float(t))) for t in temperatures]
    speed = spindle.nominal_speed
    if speed and spindle.structure.turns:
        found += [Shown(f"{t:g} °C, {speed / RPM:.0f} rpm", Condition(float(t), speed)) for t in temperatures[[0, -1]]]
    return found


def _point_there(spindle: Spindle, shown: Shown) -> OperatingPoint | None:
    """The operating point at a condition, None where the spindle has no equilibrium there."""
    try:
        return operating_point(spindle, shown.condition)
    except (NoEquilibrium, OutsideRange):
        return None


def _numbered(bench: Bench, points: Mapping[Shown, OperatingPoint]) -> dict[str, dict[int, Mode]]:
    """The modes of each condition by their numbers at the first, from where each is followed by its shape."""
    start = next(iter(points.values()))
    first = [m for m in start.modes if m.frequency <= ABOVE * bench.spindle.hammer.band[1]]
    followed = {s.id: follow(start.linear.mass, first, p.modes) for s, p in points.items()}
    return {s.id: {k: p.modes[j] for k, j in enumerate(followed[s.id], 1) if j >= 0} for s, p in points.items()}


# ---------------------------------------------------------------- computing


def built(bench: Bench, s: Setting) -> Spindle:
    """The spindle at a setting. `BadInput` for deviations that give none."""
    spindle = deviated(bench.spindle, s.deviations)
    added = tuple(Addition(name, dict(values), definition=bench.effect(name)) for name, values in s.effects.items())
    return replace(spindle, effects=(*spindle.effects, *added))


def _point(bench: Bench, spindle: Spindle, shown: Shown) -> OperatingPoint:
    if bench.campaign is not None and shown.test is not None:
        found = beside(spindle, bench.campaign, shown.test, shown.condition)
        if found is not None:
            return found.point
    return operating_point(spindle, shown.condition)


def modes_of(bench: Bench, s: Setting, shown: Shown) -> tuple[OperatingPoint, list[Mode]]:
    """The operating point, and its modes a little beyond the band."""
    point = _point(bench, built(bench, s), shown)
    return point, [m for m in point.modes if m.frequency <= ABOVE * bench.spindle.hammer.band[1]]


def channels(bench: Bench, shown: Shown) -> tuple[dict[int, str], dict[int, str]]:
    """Response and hammer nodes of a test with their names."""
    frf = shown.test.frf if shown.test else None
    names = {p.node: p.name for p in (bench.campaign if bench.campaign and frf else bench.spindle).points}
    responses = frf.response_nodes if frf else tuple(p.node for p in bench.spindle.points)
    hammers = frf.reference_nodes if frf else bench.spindle.hammer.hammer_nodes
    return {n: f"{n} {names[n]}" for n in responses}, {n: f"{n} {names[n]}" for n in hammers}


def curves(bench: Bench, s: Setting, shown: Shown, response: int, hammer: int) -> Curves:
    """The FRF between a response and a hammer node of a test."""
    spindle = built(bench, s)
    peaks = next((o.frequency for o in bench.observations if o.test.id == shown.id), np.zeros(0))
    found = beside(spindle, bench.campaign, shown.test, shown.condition) if bench.campaign and shown.test else None
    if found is None:  # nothing was measured, or a table of modes
        lines = np.linspace(*spindle.hammer.band, LINES)
        value = operating_point(spindle, shown.condition).frf(lines)
        row = [p.node for p in spindle.points].index(response), spindle.hammer.hammer_nodes.index(hammer)
        return Curves("mobility", lines, value[row], None, peaks)
    frf = found.measured
    row = frf.response_nodes.index(response), frf.reference_nodes.index(hammer)
    return Curves(frf.quantity, frf.frequency, found.computed(frf.frequency)[row], frf.value[row], peaks)


def errors(bench: Bench, s: Setting) -> Errors:
    """Errors of every mode in every test, as `spindle compare` has them; without a campaign the change from the scene as it was opened."""
    if bench.campaign is None:
        changes = [_changes(bench, s, shown) for shown in bench.shown]
        return Errors(tuple(c for cells, _ in changes for c in cells), None, None, tuple(words for _, words in changes if words))
    found = compare(built(bench, s), bench.campaign, bench.observations, frfs=False)
    cells = tuple(Cell(f"{m.number} {m.kind}", t.test.id, m.residual, m.damping_residual,
                       f"measured {m.measured:.1f} ± {m.sd:.2g} Hz, computed {m.computed:.1f} Hz") for t in found.tests for m in t.modes)  # fmt: skip
    remarks = tuple(
        f"{t.test.id}: {what} {', '.join(f'{f:.0f}' for f in values)} Hz"
        for t in found.tests for what, values in (("only measured", t.missing), ("only computed", t.extra)) if values
    )  # fmt: skip
    return Errors(cells, _rms(found.tests, s, False), _rms(found.tests, s, True), remarks)


def _rms(tests: Sequence[TestComparison], s: Setting, left_out: bool) -> float | None:
    own = [t for t in tests if (t.test.id in s.left_out) == left_out]
    return rms_residual(own) if any(t.count for t in own) else None


def _changes(bench: Bench, s: Setting, shown: Shown) -> tuple[list[Cell], str]:
    """What has become of the modes at a condition, and in words those that have no number or are not there any more."""
    named = bench.modes[bench.shown[0].id]  # a row has one name at all conditions
    own = bench.modes[shown.id]
    point = _point(bench, built(bench, s), shown)
    mass, then, first = point.linear.mass, point.modes, list(own.values())
    alike = bool(first) and len(first[0].shape) == len(mass)
    partner = follow(mass, first, then) if alike else [j if j < len(then) else -1 for j in range(len(first))]
    cells = [
        Cell(f"{k} {named[k].kind}", shown.id, 100 * (then[j].frequency / m.frequency - 1), 100 * (then[j].damping_ratio / m.damping_ratio - 1),
             f"{m.frequency:.1f} Hz as opened, {then[j].frequency:.1f} Hz now")
        for (k, m), j in zip(own.items(), partner, strict=True) if j >= 0
    ]  # fmt: skip
    kept = {k for k, j in zip(own, partner, strict=True) if j >= 0}
    gone = [f"mode {k}, {f'{own[k].frequency:.0f} Hz as opened' if k in own else 'not here'}" for k in named if k not in kept]
    return cells, f"{shown.id}: no mode has the shape of {'; '.join(gone)}" if gone else ""


# ---------------------------------------------------------------- fitting


def free_parameters(bench: Bench, s: Setting) -> list[Free]:
    """What a setting says is to be fitted. An effect's own prior is taken `REFERENCE_WIDTH` times as wide, as `diagnose` takes it."""
    found = []
    for name, values in s.effects.items():
        for p in bench.effect(name).parameters:
            if key_of(name, p.name) in s.free and not p.choices:
                found.append(Free(key_of(name, p.name), values[p.name], p.neutral, REFERENCE_WIDTH * p.prior_sd, p.limits))
    found += [Free(t.name, s.deviations.get(t.name, 0.0), 0.0, t.sd, FURTHEST) for t in bench.tolerances if t.name in s.free]
    return found


def fitted(bench: Bench, s: Setting, progress: Callable[[str], None] = lambda done: None) -> Fitted:
    """The free parameters of a setting fitted to all tests that are not left out. `BadInput` where there is nothing to fit, or to fit to."""
    free = free_parameters(bench, s)
    if bench.campaign is None:
        raise BadInput("without a campaign there is nothing to fit to")
    if not free:
        raise BadInput("tick fit beside a parameter first")
    if all(shown.id in s.left_out for shown in bench.shown):
        raise BadInput("every test is left out; one at least is needed to fit to")
    return fit(free, lambda values: built(bench, set_named(s, values)), bench.campaign, bench.observations, tuple(s.left_out), progress)
