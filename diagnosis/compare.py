"""Measurement beside model, as the scene stands: modes, dampings, shapes and FRFs of every test, and one number for the whole.

Errors are computed - measured, in Hz, percent and standard errors; those hold estimator error, scatter of repeats beyond it, and the
model's numerical floor, so they are never zero. A measured mode with no computed one within `BELIEVABLE` is missing from the model, a
computed mode in the band that was not measured is extra. Nothing is fitted here.
Sources: Ewins, *Modal Testing* (2000), 5.3: MAC (Allemang 1982), COMAC (Lieven, Ewins 1988), FRAC (Heylen, Lammens 1996).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from scipy.optimize import linear_sum_assignment

from diagnosis.observe import Observation, observe
from diagnosis.theory import ALONE, FAR, UNLIKE, Predicted, pair, predict
from model.ball_row import Array
from model.machine import Spindle
from model.modes import ComplexArray
from model.scene import BadInput
from sim.campaign import Campaign, Test
from sim.effects import of_scene
from sim.frf import TO_POWER, Frf
from sim.operating import operating_point

RPM = 2 * np.pi / 60
BELIEVABLE = 0.08  # relative frequency error up to which two modes are taken for the same
POWER = dict(zip(TO_POWER, (-1, 0, 1), strict=True))  # of i omega, from mobility to the other quantities
SILENT = 1e-6  # of the largest FRF of the test; smaller computed ones are forbidden by symmetry and have no shape to compare


@dataclass(frozen=True)
class PairedMode:
    """A measured mode and the computed one behind it; damping ratios are None where not measured, `mac` without shapes.

    `number` counts the computed modes at the coldest test at rest and follows them from there by shape. Modes closer than
    `theory.ALONE` (`close`) turn in their plane at the slightest asymmetry: their `mac` is the share of the measured shape in
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
    def pull(self) -> float:
        return self.error / self.sd

    @property
    def damping_pull(self) -> float | None:
        if self.damping_measured is None or self.damping_sd is None:
            return None
        return (self.damping_computed - self.damping_measured) / self.damping_sd


@dataclass(frozen=True)
class TestComparison:
    """One test; `missing` measured and `extra` computed frequencies (Hz); `frac` by (response node, reference node)."""

    __test__ = False  # not one of pytest's

    test: Test
    modes: tuple[PairedMode, ...]
    missing: tuple[float, ...]
    extra: tuple[float, ...]
    missing_pull: tuple[float, ...]  # of an error of `BELIEVABLE`
    frac: Mapping[tuple[int, int], float | None]


@dataclass(frozen=True)
class Comparison:
    """A campaign beside a scene; `comac` by node, None where no mode moves it; `crossings` in words.

    `rms_pull` is over frequencies and dampings. A missing mode counts as an error of `BELIEVABLE`, so that a model does not
    look better for losing a mode.
    """

    spindle: str
    campaign: str
    tests: tuple[TestComparison, ...]
    comac: Mapping[int, float | None]
    crossings: tuple[str, ...]
    rms_pull: float


def compare(
    spindle: Spindle,
    campaign: Campaign,
    observations: Sequence[Observation] | None = None,
    progress: Callable[[str], None] = lambda done: None,
) -> Comparison:
    """Compare a scene, its own effects included, with a campaign. Raises `BadInput` for points on bodies the scene has not."""
    for point in campaign.points:
        bodies = [b.name for b in spindle.structure.bodies]
        if point.body not in bodies:
            raise BadInput(
                f"{campaign.folder or campaign.title}: points.{point.node}.body = {point.body!r}: "
                f"no body of scene {spindle.name}; allowed are {', '.join(bodies)}"
            )
    observed = observe(campaign, spindle, progress) if observations is None else observations
    predicted = [_as_measured(spindle, campaign, o) for o in observed]
    chosen = [partners(o, p) for o, p in zip(observed, predicted, strict=True)]
    numbers = numbered(observed, predicted)
    scatter = _repeat_variance(observed, chosen)
    tests = []
    nodes = next((o.test.frf.response_nodes for o in observed if o.test.frf is not None), ())
    pairs: list[tuple[ComplexArray, ComplexArray]] = []  # at these points
    for o, p, partner, number, extra in zip(observed, predicted, chosen, numbers, scatter, strict=True):
        tests.append(_test(spindle, campaign, o, p, partner, number, extra))
        if o.shape is not None and o.test.frf is not None and o.test.frf.response_nodes == nodes:
            pairs += [(o.shape[i], expected) for i, expected in _expected_shapes(o, p, partner).items()]
        progress(f"{o.test.id}: compared")
    pulls = [x for t in tests for m in t.modes for x in (m.pull, m.damping_pull) if x is not None]
    pulls += [x for t in tests for x in t.missing_pull]
    rms = float(np.sqrt(np.mean(np.square(pulls)))) if pulls else float("inf")
    comac = _comac(nodes, pairs)
    return Comparison(spindle.name, campaign.title, tuple(tests), comac, _crossings(observed, predicted, numbers), rms)


# ---------------------------------------------------------------- which mode is which


def _measured_at(spindle: Spindle, campaign: Campaign, frf: Frf | None) -> Spindle:
    """The spindle with a test's response points first and its hammer points, or as it is for a table of modes."""
    if frf is None:
        return spindle
    nodes = (*frf.response_nodes, *(n for n in frf.reference_nodes if n not in frf.response_nodes))
    points = {p.node: p for p in campaign.points}
    hammer = replace(spindle.hammer, hammer_nodes=frf.reference_nodes)
    return replace(spindle, points=tuple(points[n] for n in nodes), hammer=hammer)


def _as_measured(spindle: Spindle, campaign: Campaign, o: Observation) -> Predicted:
    """Modes predicted for a test, with shapes at its response points."""
    found = predict(_measured_at(spindle, campaign, o.test.frf), o, of_scene(spindle))
    return found if o.shape is None else replace(found, shape=found.shape[:, : o.shape.shape[1]])


def partners(o: Observation, p: Predicted) -> Array:
    """Index of the computed partner of every measured mode, -1 where none is within `BELIEVABLE`."""
    partner = pair(o, p)
    far = np.abs(p.frequency[partner] / o.frequency - 1) > BELIEVABLE
    return np.where(far | (partner < 0), -1, partner)


def _unit(shape: ComplexArray) -> ComplexArray:
    return shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-300)


def numbered(observed: Sequence[Observation], predicted: Sequence[Predicted]) -> list[dict[int, int]]:
    """Number of every computed mode by its index in each test, counted from 1 at the first and followed by shape and frequency.

    The first is the coldest at the lowest speed; each test follows the nearest one already numbered (10 K as far as 1000 rpm).
    """
    state = [(o.condition.temperature / 10, o.condition.speed / (1000 * RPM)) for o in observed]
    order = sorted(range(len(state)), key=lambda t: (abs(state[t][1]), state[t][0]))
    found: dict[int, dict[int, int]] = {}
    for t in order:
        if not found:
            found[t] = {i: i + 1 for i in range(len(predicted[t].frequency))}
            continue
        near = min(found, key=lambda s: abs(state[s][0] - state[t][0]) + abs(state[s][1] - state[t][1]))
        a, b = predicted[near], predicted[t]
        unit = [_unit(p.shape) for p in (a, b)]
        cost = np.abs(np.log(a.frequency[:, None] / b.frequency)) / FAR
        if unit[0].shape[1] == unit[1].shape[1]:
            cost = cost + 1 - np.abs(unit[0].conj() @ unit[1].T) ** 2
        cost = cost + UNLIKE * np.array([[(x == "axial") != (y == "axial") for y in b.kind] for x in a.kind])
        partner = {int(j): int(i) for i, j in zip(*linear_sum_assignment(cost), strict=True)}
        radial = [j for j in sorted(partner) if b.kind[j] != "axial"]
        for j, k in pairwise(radial):  # a close pair that stays one keeps its order
            i, h = partner[j], partner[k]
            if i > h and a.frequency[i] < (1 + ALONE) * a.frequency[h] and b.frequency[k] < (1 + ALONE) * b.frequency[j]:
                partner[j], partner[k] = h, i
        followed = {j: found[near][i] for j, i in partner.items()}
        following = max(max(f.values(), default=0) for f in found.values())
        for j in range(len(b.frequency)):
            if j not in followed:
                following += 1
                followed[j] = following
        found[t] = followed
    return [found[t] for t in range(len(observed))]


def _crossings(observed: Sequence[Observation], predicted: Sequence[Predicted], numbers: Sequence[Mapping[int, int]]) -> tuple[str, ...]:
    """Pairs of computed modes among the measured ones that change places, told once each."""
    first: dict[tuple[int, int], tuple[str, bool]] = {}
    told: dict[tuple[int, int], str] = {}
    for o, p, number in zip(observed, predicted, numbers, strict=True):
        inside = {n: p.frequency[i] for i, n in number.items() if p.frequency[i] <= 1.1 * o.frequency.max(initial=0.0)}
        for two in combinations(sorted(inside), 2):
            below = bool(inside[two[0]] < inside[two[1]])
            where, was = first.setdefault(two, (o.test.id, below))
            if below != was:
                told.setdefault(two, f"computed modes {two[0]} and {two[1]} change places between {where} and {o.test.id}")
    return tuple(told.values())


def _repeat_variance(observed: Sequence[Observation], partners: Sequence[Array]) -> list[Array]:
    """For every test, variance (2m,) of ln frequency and ln damping that repeats of its condition show beyond their own errors."""
    extra = [np.zeros(2 * len(o.frequency)) for o in observed]
    seen: dict[tuple[Any, int, int], list[tuple[int, int]]] = {}
    for t, (o, partner) in enumerate(zip(observed, partners, strict=True)):
        m = len(o.frequency)
        for i in range(2 * m):
            if partner[i % m] >= 0 and np.isfinite(o.covariance[i, i]):
                seen.setdefault((o.condition, int(partner[i % m]), i // m), []).append((t, i))
    for places in seen.values():
        if len(places) > 1:
            value = [np.log(np.concatenate([observed[t].frequency, observed[t].damping])[i]) for t, i in places]
            own = np.mean([observed[t].covariance[i, i] for t, i in places])
            for t, i in places:
                extra[t][i] = max(0.0, float(np.var(value, ddof=1) - own))
    return extra


# ---------------------------------------------------------------- one test


def _test(
    spindle: Spindle, campaign: Campaign, o: Observation, p: Predicted, partner: Array, number: Mapping[int, int], extra: Array
) -> TestComparison:
    m = len(o.frequency)
    relative = np.sqrt(np.diag(o.covariance) + extra)
    expected = _expected_shapes(o, p, partner)
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
                float(o.damping[i]) if known else None,
                float(p.damping[j]),
                float(o.damping[i] * relative[m + i]) if known else None,
                None if o.shape is None else likeness(o.shape[i], expected[i]),
                len(_group(o, p, partner, i)) > 1,
            )
        )
    lost = np.flatnonzero(partner < 0)
    frf = o.test.frf
    low, high = spindle.hammer.band if frf is None else (frf.frequency[0], frf.frequency[-1])
    found = set(partner.tolist())
    return TestComparison(
        o.test,
        tuple(modes),
        tuple(o.frequency[lost].tolist()),
        tuple(float(f) for j, f in enumerate(p.frequency) if low <= f <= high and j not in found),
        tuple((BELIEVABLE / relative[lost]).tolist()),
        {} if frf is None else frac(_measured_at(spindle, campaign, frf), o, frf),
    )


def _group(o: Observation, p: Predicted, partner: Array, mode: int) -> list[int]:
    """Measured modes within `ALONE` of one, itself included, whose partners may turn in one plane with its own."""

    def axial(i: int) -> bool:
        return p.kind[partner[i]] == "axial"

    near = np.flatnonzero((np.abs(np.log(o.frequency / o.frequency[mode])) <= ALONE) & (partner >= 0)).tolist()
    return [i for i in near if axial(i) == axial(mode)]


def _expected_shapes(o: Observation, p: Predicted, partner: Array) -> dict[int, ComplexArray]:
    """Computed shape (n_resp,) for every paired measured mode: its partner's, in a close group the combination nearest to it."""
    if o.shape is None:
        return {}
    found = {}
    for i in np.flatnonzero(partner >= 0).tolist():
        basis = p.shape[partner[_group(o, p, partner, i)]].T
        found[i] = basis @ np.linalg.lstsq(basis, o.shape[i], rcond=None)[0]
    return found


def likeness(a: ComplexArray, b: ComplexArray) -> float | None:
    """|a^H b|^2 / (|a|^2 |b|^2): the MAC of two shapes, the FRAC of two FRFs; None where one of them is zero."""
    size = float(np.vdot(a, a).real * np.vdot(b, b).real)
    return min(1.0, float(abs(np.vdot(a, b)) ** 2) / size) if size > 0 else None


def frac(spindle: Spindle, o: Observation, measured: Frf) -> dict[tuple[int, int], float | None]:
    """FRAC of every response and reference against the exact FRF of the model at the test's lines above 0 Hz."""
    lines = measured.frequency > 0
    s: Any = measured.frequency[lines] - 1j * o.test.window_decay / (2 * np.pi)  # a window left in the FRFs damps the model's too
    computed = operating_point(spindle, o.condition).frf(s) * (2j * np.pi * s) ** POWER[measured.quantity]
    size = np.linalg.norm(computed, axis=-1)
    return {
        (response, reference): likeness(measured.value[i, j, lines], computed[i, j]) if size[i, j] > SILENT * size.max() else None
        for i, response in enumerate(measured.response_nodes)
        for j, reference in enumerate(measured.reference_nodes)
    }


def _comac(nodes: Sequence[int], pairs: Sequence[tuple[ComplexArray, ComplexArray]]) -> dict[int, float | None]:
    """COMAC of every point over all paired modes of all tests: (sum |a b|)^2 / (sum |a|^2 sum |b|^2), shapes of unit length."""
    units = [(np.abs(a) / np.linalg.norm(a), np.abs(b) / np.linalg.norm(b)) for a, b in pairs if b.any()]
    if not units:
        return {}
    a, b = (np.array([u[k] for u in units]) for k in (0, 1))
    size = np.sum(a**2, axis=0) * np.sum(b**2, axis=0)
    value = np.sum(a * b, axis=0) ** 2
    return {node: float(v / s) if s > 0 else None for node, v, s in zip(nodes, value, size, strict=True)}


# ---------------------------------------------------------------- telling it


def comparison_json(c: Comparison) -> dict[str, Any]:
    return {
        "spindle": c.spindle,
        "campaign": c.campaign,
        "tests": [_test_json(t) for t in c.tests],
        "comac": {str(node): value for node, value in c.comac.items()},
        "crossings": list(c.crossings),
        "rms_pull": c.rms_pull if np.isfinite(c.rms_pull) else None,
    }


def _test_json(t: TestComparison) -> dict[str, Any]:
    return {
        "id": t.test.id,
        "temperature_C": t.test.temperature,
        "speed_rpm": t.test.speed / RPM,
        "modes": [_mode_json(m) for m in t.modes],
        "missing_Hz": list(t.missing),
        "extra_Hz": list(t.extra),
        "frac": {f"{response},{reference}": value for (response, reference), value in t.frac.items()},
    }


def _mode_json(m: PairedMode) -> dict[str, Any]:
    return {
        "mode": m.number,
        "kind": m.kind,
        "measured_Hz": m.measured,
        "sd_Hz": m.sd,
        "computed_Hz": m.computed,
        "error_Hz": m.error,
        "error_percent": 100 * m.error / m.measured,
        "pull": m.pull,
        "damping_measured": m.damping_measured,
        "damping_sd": m.damping_sd,
        "damping_computed": m.damping_computed,
        "damping_pull": m.damping_pull,
        "mac": m.mac,
        "close": m.close,
    }


def show_comparison(console: Console, c: Comparison) -> None:
    """One table of modes, one line a test for what has no partner, one table of FRAC and COMAC by point."""
    console.print(f"{c.campaign} beside scene {c.spindle}: rms pull {c.rms_pull:.3g} standard errors", highlight=False, markup=False)
    grid = _grid(
        "Modes, computed - measured",
        "test", "mode", "kind", "measured\nHz", "+-", "computed\nHz", "error\nHz", "error\n%", "error\ns.e.",
        "damping\n%", "computed\n%", "error\ns.e.", "MAC",
    )  # fmt: skip
    for t in c.tests:
        for m in t.modes:
            damping = "" if m.damping_measured is None else f"{100 * m.damping_measured:.3f}"
            pull = "" if m.damping_pull is None else f"{m.damping_pull:+.1f}"
            mac = "" if m.mac is None else f"{m.mac:.3f}" + ("*" if m.close else "")
            error = (f"{m.error:+.2f}", f"{100 * m.error / m.measured:+.2f}", f"{m.pull:+.1f}")
            name = t.test.id if m is t.modes[0] else ""
            frequencies = (f"{m.measured:.2f}", f"{m.sd:.2f}", f"{m.computed:.2f}")
            grid.add_row(name, str(m.number), m.kind, *frequencies, *error, damping, f"{100 * m.damping_computed:.3f}", pull, mac)
        grid.add_section()
    console.print(grid)
    if any(m.close and m.mac is not None for t in c.tests for m in t.modes):
        console.print("* close modes: share of the measured shape in the plane of the computed ones")
    for t in c.tests:
        for what, values in (("measured, not computed", t.missing), ("computed, not measured", t.extra)):
            if values:
                console.print(f"{t.test.id}: {what}: {', '.join(f'{f:.1f}' for f in values)} Hz", highlight=False)
    for line in c.crossings:
        console.print(line, highlight=False)
    if c.comac:
        references = sorted({reference for t in c.tests for _, reference in t.frac})
        points = _grid("COMAC, and smallest FRAC of all tests by hammer point", "node", "COMAC", *(f"hammer {r}" for r in references))
        for node, comac in c.comac.items():
            cells = []
            for r in references:
                known = [v for t in c.tests if (v := t.frac.get((node, r))) is not None]
                cells.append(f"{min(known):.3f}" if known else "-")
            points.add_row(str(node), "-" if comac is None else f"{comac:.4f}", *cells)
        console.print(points)


def _grid(title: str, *columns: str) -> Table:
    grid = Table(
        title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True
    )
    for column in columns:
        grid.add_column(column, justify="left" if column in ("test", "kind") else "right", no_wrap=column != "test", overflow="fold")
    return grid
