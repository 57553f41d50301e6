"""Measurement beside model, as the scene stands: modes, dampings, shapes and FRFs of every test, and one number for the whole.

Errors are computed - measured, in Hz, percent and standard errors; those hold estimator error, scatter of repeats beyond it, the
model's numerical floor, so they are never zero, and the error of the test's temperature (`thermometer`), which all modes of a test
share: the rms residual is sqrt(r^T C^-1 r / n) with its correlations. A measured mode with no computed one within `BELIEVABLE` is missing
from the model (or a false pole of the extraction), a computed mode in the band that was not measured is extra. Nothing is fitted here.
Sources: Ewins, *Modal Testing* (2000), 5.3: MAC (Allemang 1982), COMAC (Lieven, Ewins 1988); for FRFs see `correlation`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.compare.correlation import Correlation, assurance, comac, correlate, frac
from thermospindle.diagnosis.data.observe import Observation, observe
from thermospindle.diagnosis.prediction.modes import Predicted, predict
from thermospindle.diagnosis.prediction.partners import BELIEVABLE, by_hammer, crossings, group, numbered, partners, shapes
from thermospindle.diagnosis.prediction.temperature import temperature_slope, whitened, with_temperature
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.campaign.beside import beside, check_points, measured_at
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.effects import of_scene
from thermospindle.sim.hammer.excited import unseen
from thermospindle.sim.operating import OperatingPoint

SAME = 1e-3
"""Relative, within which a frequency with the mass of shafts where it is, and one with masses at nodes, are one mode's."""
GONE = 5.0
"""Standard errors that a missing mode counts as at least: whether it is there at all does not hang on how sure its frequency is."""


@dataclass(frozen=True)
class PairedMode:
    """A measured mode and the computed one behind it; damping ratios are None where not measured,
    `damping_sd` also where no error of one is told, `mac` where no shape can be compared (`partners.shapes`).

    `number` counts the computed modes at the coldest test at rest and follows them from there by shape. Modes closer than
    `partners.ALONE` (`close`) turn in their plane at the slightest asymmetry: their `mac` is the share of the measured shape in
    the plane of the computed ones.
    """

    number: int
    kind: str
    measured: float  # Hz
    computed: float  # Hz
    sd: float  # Hz
    damping_measured: float | None
    damping_computed: float
    damping_sd: float | None
    mac: float | None
    close: bool

    @property
    def error(self) -> float:
        return self.computed - self.measured

    @property
    def residual(self) -> float:
        return self.error / self.sd

    @property
    def damping_error(self) -> float | None:
        """Relative to the measured one."""
        return None if self.damping_measured is None else self.damping_computed / self.damping_measured - 1

    @property
    def damping_residual(self) -> float | None:
        if self.damping_measured is None or self.damping_sd is None:
            return None
        return (self.damping_computed - self.damping_measured) / self.damping_sd


@dataclass(frozen=True, eq=False)
class PairedShape:
    """The shape that a table tells of mode `number`: measured (n,) with its errors `sd` (n,), and
    the computed one in its size and phase (n,), at points of the campaign."""

    number: int
    measured: ComplexArray
    sd: Array
    computed: ComplexArray
    points: tuple[Point, ...]


@dataclass(frozen=True)
class TestComparison:
    """One test; `missing` measured and `extra` computed frequencies (Hz), of which those `hidden` no FRF of the
    test's points shows, `correlation` of its FRFs if it has any, `shapes` that its table tells of paired modes."""

    __test__ = False  # not one of pytest's

    test: Test
    modes: tuple[PairedMode, ...]
    missing: tuple[float, ...]
    extra: tuple[float, ...]
    correlation: Correlation | None
    residuals: Array  # (2m,) of measured [frequency, damping], whitened; a missing mode's in place of its frequency, 0 where there is none
    count: int  # of those there are
    offsets: Mapping[tuple[int, int], Array]  # by mode number and 0 for its frequency, 1 for its damping: what a relative error of one does to the residuals (2m,)
    beyond: str = ""  # the state of the bearings, where the model gives no FRFs of it
    shapes: tuple[PairedShape, ...] = ()
    hidden: tuple[float, ...] = ()

    @property
    def unpaired(self) -> tuple[tuple[str, tuple[float, ...]], ...]:
        """The frequencies (Hz) without a partner, by what is to be said of them."""
        seen = tuple(f for f in self.extra if f not in self.hidden)
        every = ("measured, not computed", self.missing), ("computed, not measured", seen), ("computed, and not to be seen from these points", self.hidden)
        return tuple((what, values) for what, values in every if values)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.test.id}: {len(self.modes)} modes paired, {len(self.missing)} missing, {len(self.extra)} more computed>"

    @property
    def squares(self) -> float:
        """r^T C^-1 r of all frequencies and dampings, and of the missing modes."""
        return float(self.residuals @ self.residuals)

    @property
    def frac(self) -> dict[tuple[int, int], float | None]:
        """By (response node, reference node)."""
        return {} if self.correlation is None else frac(self.correlation)


@dataclass(frozen=True)
class Comparison:
    """A campaign beside a scene; `comac` by node, None where no mode moves it; `crossings` in words.

    `rms_residual` is over frequencies and dampings, correlations of their errors included. A missing mode counts as an error of
    `BELIEVABLE`, and of `GONE` standard errors at least, so that a model does not look better for losing a mode.
    """

    spindle: str
    campaign: str
    tests: tuple[TestComparison, ...]
    comac: Mapping[int, float | None]
    crossings: tuple[str, ...]
    built: bool = False  # whether the scene has build tolerances that were fitted

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.campaign!r} beside {self.spindle}: {len(self.tests)} tests, rms error {self.rms_residual:.3g} standard errors>"

    @property
    def rms_residual(self) -> float:
        return rms_residual(self.tests)

    def rms_of(self, tests: Sequence[str]) -> float:
        """The same over some tests, by id."""
        return rms_residual([t for t in self.tests if t.test.id in tests])


def rms_residual(tests: Sequence[TestComparison]) -> float:
    """The rms error of some tests in standard errors; infinite where nothing was measured."""
    count = sum(t.count for t in tests)
    return float(np.sqrt(sum(t.squares for t in tests) / count)) if count else float("inf")


def compare(
    spindle: Spindle,
    campaign: Campaign,
    observations: Sequence[Observation] | None = None,
    progress: Callable[[str], None] = lambda done: None,
    frfs: bool = True,
) -> Comparison:
    """Compare a scene, its own effects included, with a campaign; without `frfs` these are not
    correlated, which takes nine tenths of the time.

    Raises `BadInput` for points on bodies the scene has not.
    """
    check_points(spindle, campaign)
    observed = observe(campaign, spindle, progress) if observations is None else observations
    predicted = [_as_measured(spindle, campaign, o) for o in observed]
    chosen = [partners(o, p) for o, p in zip(observed, predicted, strict=True)]
    observed = [_at_its_temperature(spindle, campaign, o, p, i) for o, p, i in zip(observed, predicted, chosen, strict=True)]
    numbers = numbered(observed, predicted)
    scatter = _repeat_variance(observed, chosen, numbers)
    tests = []
    nodes = next((nodes for o in observed if (nodes := _shape_nodes(o))), ())
    pairs: list[tuple[ComplexArray, ComplexArray]] = []  # at these points
    for o, p, partner, number, extra in zip(observed, predicted, chosen, numbers, scatter, strict=True):
        tests.append(_test(spindle, campaign, o, p, partner, number, extra, frfs))
        if nodes and _shape_nodes(o) == nodes:
            pairs += shapes(o, p, partner).values()
        progress(f"{o.test.id}: compared")
    by_node = comac(nodes, pairs)
    return Comparison(spindle.name, campaign.title, tuple(tests), by_node, crossings(observed, predicted, numbers), spindle.build is not None)


def _shape_nodes(o: Observation) -> tuple[int, ...]:
    """The nodes at which a test shows shapes."""
    return o.test.frf.reference_nodes if o.test.frf is not None and by_hammer(o) else o.test.response_nodes


def _as_measured(spindle: Spindle, campaign: Campaign, o: Observation) -> Predicted:
    """Modes predicted for a test, with shapes at its response points."""
    found = predict(measured_at(spindle, campaign, o.test), o, of_scene(spindle), lumped=campaign.lumped_shafts)
    return found if o.shape is None else replace(found, shape=found.shape[:, : o.shape.shape[1]])


def _at_its_temperature(spindle: Spindle, campaign: Campaign, o: Observation, p: Predicted, partner: Integers) -> Observation:
    """The observation with the error of its temperature among its errors."""
    here = measured_at(spindle, campaign, o.test)
    slope = temperature_slope(here, o, p, of_scene(spindle), campaign.lumped_shafts).reshape(2, -1)
    return with_temperature(o, np.where(partner >= 0, slope[:, partner], 0.0).ravel(), spindle.tolerances.temperature)


def _repeat_variance(observed: Sequence[Observation], chosen: Sequence[Integers], numbers: Sequence[Mapping[int, int]]) -> list[Array]:
    """For every test, variance (2m,) of ln frequency and ln damping that repeats show beyond the errors of single tests.

    Pooled over all conditions that were repeated, mode by mode, with their degrees of freedom: two repeats alone say little. It
    holds for all tests of the campaign, also those made once.
    """
    extra = [np.zeros(2 * len(o.frequency)) for o in observed]
    seen: dict[tuple[int, int], dict[int, list[tuple[int, int]]]] = {}
    made = _first_alike([o.condition for o in observed], [o.test for o in observed])
    for t, (o, partner, number) in enumerate(zip(observed, chosen, numbers, strict=True)):
        m = len(o.frequency)
        for i in range(2 * m):
            if partner[i % m] >= 0 and np.isfinite(o.covariance[i, i]):
                which = (number[int(partner[i % m])], i // m)
                seen.setdefault(which, {}).setdefault(made[t], []).append((t, i))
    for by_condition in seen.values():
        repeated = [places for places in by_condition.values() if len(places) > 1]
        free = sum(len(places) - 1 for places in repeated)
        if free:
            beyond = sum((len(places) - 1) * _excess(observed, places) for places in repeated) / free
            for t, i in (place for places in by_condition.values() for place in places):
                extra[t][i] = max(0.0, beyond)
    return extra


def _first_alike(conditions: Sequence[Condition], tests: Sequence[Test]) -> list[int]:
    """For every test the first that it is a repeat of, or itself: at one condition one of which the same
    else was noted; or one of which `repeat` tells another count, for notes may say who measured, and when."""
    found: list[int] = []
    for t, (at, test) in enumerate(zip(conditions, tests, strict=True)):
        alike = [k for k in range(t) if conditions[k] == at]
        noted = [k for k in alike if tests[k].conditions == test.conditions]
        counted = [k for k in alike if tests[k].repeat != test.repeat]
        found.append(next((found[k] for k in (*noted, *counted)), t))
    return found


def _excess(observed: Sequence[Observation], places: Sequence[tuple[int, int]]) -> float:
    """Variance of the logarithms at (test, row) less the mean of their own variances."""
    value = [np.log(np.concatenate([observed[t].frequency, observed[t].damping])[i]) for t, i in places]
    return float(np.var(value, ddof=1) - np.mean([observed[t].covariance[i, i] for t, i in places]))


# ---------------------------------------------------------------- one test


def _test(
    spindle: Spindle, campaign: Campaign, o: Observation, p: Predicted, partner: Integers, number: Mapping[int, int], extra: Array, frfs: bool
) -> TestComparison:
    m = len(o.frequency)
    relative = np.sqrt(np.diag(o.covariance) + extra)
    shown = shapes(o, p, partner)
    modes = []
    for i in np.flatnonzero(partner >= 0).tolist():
        j, known = int(partner[i]), bool(np.isfinite(relative[m + i]))
        modes.append(
            PairedMode(
                number[j],
                p.kind[j],
                float(o.frequency[i]),
                float(p.frequency[j]),
                float(o.frequency[i] * relative[i]),
                float(o.damping[i]) if np.isfinite(o.damping[i]) else None,
                float(p.damping[j]),
                float(o.damping[i] * relative[m + i]) if known else None,
                assurance(*shown[i]) if i in shown else None,
                len(group(o, p, partner, i)) > 1,
            )
        )
    lost = np.flatnonzero(partner < 0)
    rows = np.flatnonzero(np.isfinite(relative) & (np.tile(partner, 2) >= 0))
    computed = np.concatenate([p.frequency, p.damping])[np.concatenate([partner, partner + len(p.frequency)])[rows]]
    error = np.log(computed / np.concatenate([o.frequency, o.damping])[rows])
    covariance = (o.covariance + np.diag(np.where(np.isfinite(relative), extra, 0.0)))[np.ix_(rows, rows)]
    residuals = np.zeros(2 * m)
    residuals[rows], residuals[lost] = whitened(error, covariance), np.maximum(BELIEVABLE / relative[lost], GONE)
    offsets: dict[tuple[int, int], Array] = {}
    for i, column in zip(rows.tolist(), whitened(np.eye(len(rows)), covariance).reshape(len(rows), len(rows)).T, strict=True):
        offset = offsets.setdefault((number[int(partner[i % m])], i // m), np.zeros(2 * m))
        offset[rows] = column
    frf = o.test.frf
    low, high = spindle.hammer.band if frf is None else (frf.frequency[0], frf.frequency[-1])
    found = set(partner.tolist())
    own = beside(spindle, campaign, o.test, o.condition) if frfs else None
    correlation = None if own is None else correlate(own)
    more = tuple(float(f) for j, f in enumerate(p.frequency) if low <= f <= high and j not in found)
    return TestComparison(
        o.test,
        tuple(modes),
        tuple(o.frequency[lost].tolist()),
        more,
        correlation,
        residuals,
        len(rows) + len(lost),
        offsets,
        own.point.state.status if own is not None and correlation is None else "",
        _told(campaign, o, shown, {i: number[int(partner[i])] for i in shown}),
        () if own is None else _hidden(own.point, more),
    )


def _hidden(point: OperatingPoint, extra: tuple[float, ...]) -> tuple[float, ...]:
    """Those of some computed frequencies (Hz) that no FRF of the operating point's points and hammers shows."""
    if not extra:
        return ()
    out_of_sight = [m.frequency for m in unseen(point, (min(extra) * (1 - SAME), max(extra) * (1 + SAME)), 0.0)]
    return tuple(f for f in extra if any(abs(f / other - 1) < SAME for other in out_of_sight))


def _told(campaign: Campaign, o: Observation, shown: Mapping[int, tuple[ComplexArray, ComplexArray]], number: Mapping[int, int]) -> tuple[PairedShape, ...]:
    """Shapes of a table of modes beside the computed ones."""
    if o.test.frf is not None or o.shape_sd is None:
        return ()
    by_node = {p.node: p for p in campaign.points}
    points = tuple(by_node[n] for n in o.test.shape_nodes)
    return tuple(PairedShape(number[i], measured, o.shape_sd[i], computed, points) for i, (measured, computed) in shown.items())
