"""What every possible imperfection of a spindle would show at the probes of runout tests, and how large each is likely to be.

A *source* is one kind of imperfection seen in one line: an unbalance, a wave of one order on one race, radial or
axial, the sizes of the balls of a row, their waves, a cage; between rings that a radial load or weight displaces also what
a perfect row does as its balls pass, once. What a source shows is linear in its complex amplitude.
That amplitude is unknown: a scene's imperfections are one draw, of which another spindle of the drawing has only the
size. Its likely size (rms) is the scene's own, pooled over rings, bearings and orders, races falling as 1/order and
balls as 1/order^2 as in `model.built.drawn`; where a scene has none of a kind, that of its grade "high precision".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.runout.lines import MULTIPLE, Key, Seen, felt_sidebands, key_of, near_lines
from thermospindle.model.bearing.kinematics import SIDEBANDS, VARYING
from thermospindle.model.built.drawn import GRADES, held_over
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.carrier import named, permissible_unbalance, unbalanced
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.beside import on_nodes
from thermospindle.sim.effects.effect import Effect, Values
from thermospindle.sim.operating import OperatingPoint, operating_point
from thermospindle.sim.running.excitation import at_speed, excitation, response

GRADE = GRADES["high precision"]
ECCENTRIC = 0.1e-6  # m, rms eccentricity of a race where the scene gives none
CAGE = 4e-9  # kg m, rms unbalance of a cage where the scene gives none: 0.5 g that is 8 um off centre
VARIES = 0.1  # of what a perfect row does between displaced rings, by which it may do otherwise: a load is not known better
FIRST, SECOND, PERFECT = "first", "second", "perfect"
"""Two sources share a line of a race (a radial and an axial wave) and of the turning part (static and couple unbalance);
what a perfect row does is one by itself."""

SourceKey = tuple[Key, str]


@dataclass(frozen=True, eq=False)
class Sources:
    """`shown[source]` (tests, probes) m per unit amplitude, `by_tolerance[source]` (parameters, tests, probes) its
    derivative by the relative build parameters `names` with standard deviations `sd`; `likely[source]` the rms amplitude
    (m, kg m, kg m2); `points` of the tests; `ratios` of the parts that turn, each speed over the spindle's once."""

    shown: Mapping[SourceKey, ComplexArray]
    by_tolerance: Mapping[SourceKey, ComplexArray]
    likely: Mapping[SourceKey, float]
    names: tuple[str, ...]
    sd: Array
    points: tuple[OperatingPoint, ...]
    probes: tuple[tuple[Point, ...], ...]
    ratios: tuple[float, ...]


def sources(spindle: Spindle, seen: Sequence[Seen], points: Sequence[Point]) -> Sources:
    """All sources of a spindle in runout tests whose probes are among `points`."""
    by_node = {p.node: p for p in on_nodes(spindle, points)}
    probes = [tuple(by_node[n] for n in s.nodes) for s in seen]
    width = max(len(p) for p in probes)
    nominal = [operating_point(spindle, s.condition) for s in seen]
    shown = _all(spindle, nominal, probes, width)
    build = toleranced(spindle)
    by_tolerance = {key: np.zeros((len(build), *value.shape), complex) for key, value in shown.items()}
    for k, parameter in enumerate(build):
        step = 0.3 * parameter.sd
        other = parameter.apply(spindle, step)
        moved = _all(other, [operating_point(other, s.condition) for s in seen], probes, width)
        for key, value in shown.items():  # a weak line that only one of the two has is left as it is
            by_tolerance[key][k] = (moved.get(key, value) - value) / step
    likely = {key: _likely(spindle, nominal[0].imperfections, key) for key in shown}
    ratios = tuple(sorted({abs(b.speed_ratio) for b in spindle.structure.bodies if b.turns and b.speed_ratio}))
    return Sources(
        shown, by_tolerance, likely, tuple(p.name for p in build), np.array([p.sd for p in build]), tuple(nominal), tuple(probes), ratios
    )


def _all(
    spindle: Spindle, at: Sequence[OperatingPoint], probes: Sequence[Sequence[Point]], width: int, far: bool = False
) -> dict[SourceKey, ComplexArray]:
    """What every source shows, of lines whose sources are weighed or, with `far`, of all."""
    found: dict[SourceKey, ComplexArray] = {}
    for t, point in enumerate(at):
        weighed = near_lines(point)
        for which, unit in units(spindle, felt_sidebands(point) if far else {}).items():
            every = phasors(point, unit, probes[t], which == PERFECT)
            for key, value in ((key, value) for key, value in every.items() if far or key in weighed or which == PERFECT):
                found.setdefault((key, which), np.zeros((len(at), width), complex))[t, : len(value)] = value
    return found


def phasors(point: OperatingPoint, imperfections: Imperfections, probes: Sequence[Point], perfect: bool = False) -> dict[Key, ComplexArray]:
    """Phasors (probes,) m of every line that imperfections would excite at a point; with `perfect` what perfect
    rows do between displaced rings is among them."""
    every = excitation(point, imperfections)
    forces = at_speed(every if perfect else every.without(VARYING), 1.0)
    moved = response(point, forces)
    rows = np.array([np.array(p.direction) @ motion_rows(point.chain, p.body, p.position)[:3] for p in probes])
    found: dict[Key, ComplexArray] = {}
    for line, one in zip(forces.line, moved, strict=True):
        found[key_of(line)] = found.get(key_of(line), 0) + rows @ one
    return found


def scatter(spindle: Spindle, point: OperatingPoint, probes: Sequence[Point]) -> dict[Key, Array]:
    """Variance (probes,) m2 of every line among spindles of this drawing: what its sources of their
    likely sizes show, and what perfect rows do of another load."""
    found: dict[Key, Array] = {}
    for source, value in _all(spindle, [point], [probes], len(probes), far=True).items():
        varies = VARIES if source[1] == PERFECT else _likely(spindle, point.imperfections, source)
        found[source[0]] = found.get(source[0], np.zeros(len(probes))) + np.abs(varies * value[0]) ** 2
    return found


def units(spindle: Spindle, sidebands: Mapping[str, int]) -> dict[str, Imperfections]:
    """Imperfections in which every source has the amplitude 1, with race waves of so many `sidebands`, by row, or `SIDEBANDS`."""
    body = unbalanced(spindle)
    first, second = {}, {}
    for b in spindle.rolling:
        most = sidebands.get(b.name, SIDEBANDS)  # of which centred rings feel one
        sides = range(-most, most + 1)
        orders = sorted({n for k in range(MULTIPLE + 1) for by in sides if (n := k * b.balls + by) > 0})
        waves = tuple(Wave(n, 1.0, 0.0) for n in orders)
        balls = (tuple(Wave(n, 1.0, 0.0) for n in range(2, 2 * MULTIPLE + 1, 2)), *[()] * (b.elements - 1))
        first[b.name] = RowImperfections(waves, (), waves, (), (1.0, *[0.0] * (b.elements - 1)), balls, 1.0)
        second[b.name] = RowImperfections((), waves, (), waves)
    part = named(spindle, body)
    return {
        FIRST: Imperfections(1.0, body.z, bearings=first, unbalance_body=part),
        SECOND: Imperfections(unbalance_z=body.z, couple_unbalance=1.0, bearings=second, unbalance_body=part),
        PERFECT: Imperfections(),
    }


def of_effect(found: Sources, effect: Effect, values: Values) -> dict[SourceKey, complex]:
    """Amplitudes of the sources that make up an effect: what its own function adds to a spindle without imperfections.

    Within a line the parts of the sources come from the phasors at the probes of all tests, least squares.
    """
    if effect.imperfections is None:
        return {}
    shown: dict[Key, ComplexArray] = {}
    width = next(iter(found.shown.values())).shape
    for t, point in enumerate(found.points):
        made = effect.imperfections(point.spindle, point.state.condition, values, Imperfections())
        for key, value in phasors(point, made, found.probes[t]).items():
            shown.setdefault(key, np.zeros(width, complex))[t, : len(value)] = value
    amplitudes: dict[SourceKey, complex] = {}
    for key, value in shown.items():
        own = [(key, which) for which in (FIRST, SECOND) if (key, which) in found.shown]
        if not own:
            continue
        basis = np.array([found.shown[s].ravel() for s in own]).T
        size = np.linalg.norm(basis, axis=0)
        part = np.linalg.lstsq(basis / size, value.ravel(), rcond=1e-10)[0] / size
        amplitudes |= {
            s: complex(a) for s, a in zip(own, part, strict=True) if abs(a) > 1e-9 * np.abs(part * size).max() / size[own.index(s)]
        }
    return amplitudes


# ---------------------------------------------------------------- how large


def _likely(spindle: Spindle, made: Imperfections, source: SourceKey) -> float:
    """The rms amplitude of a source: the scene's level of its kind, or what the scene and its effects have of it, whichever is more."""
    (bearing, cause, order, _), which = source
    scene = spindle.imperfections
    if which == PERFECT:
        return 1.0
    if cause == "unbalance":
        body, span = unbalanced(spindle), held_over(spindle)
        static = 0.5 * permissible_unbalance(spindle, body, GRADE.balance)
        sizes = [scene.unbalance or static, made.unbalance]
        if which == SECOND:
            sizes = [scene.couple_unbalance or 0.5 * span * static, made.couple_unbalance + made.unbalance * abs(made.unbalance_z - body.z)]
        return max(sizes)
    row, rows = made.row(bearing), [scene.row(b.name) for b in spindle.rolling]
    if cause == "cage unbalance":
        return max(_rms([r.cage_unbalance for r in rows]) or CAGE, row.cage_unbalance)
    balls = next(b.elements for b in spindle.rolling if b.name == bearing)
    if cause == "ball size":
        level = _rms([d for r in rows for d in r.ball_diameter]) or GRADE.ball_lot / np.sqrt(12)
        return float(
            max(level * np.sqrt(balls), np.linalg.norm(np.subtract(row.ball_diameter or (0.0,), np.mean(row.ball_diameter or (0.0,)))))
        )
    if cause == "ball waviness":
        level = _rms([w.amplitude * (w.order / 2) ** 2 for r in rows for waves in r.ball_waves for w in waves if w.order % 2 == 0])
        level = (level or 0.2 * GRADE.ball_form) * (order / 2) ** -2.0
        own = [w.amplitude for waves in row.ball_waves for w in waves if w.order == order]
        return float(max(level * np.sqrt(balls), np.linalg.norm(own) if own else 0.0))
    kind = f"{cause.split()[0]}_{'radial' if which == FIRST else 'axial'}"
    own = [w.amplitude for w in getattr(row, kind) if w.order == order]
    return max(_race_level(rows, kind[6:], order), float(np.sum(own)))


def _race_level(rows: Sequence[RowImperfections], direction: str, order: int) -> float:
    waves = [w for r in rows for ring in ("inner", "outer") for w in getattr(r, f"{ring}_{direction}")]
    if order == 1:
        return _rms([w.amplitude for w in waves if w.order == 1]) or (ECCENTRIC if direction == "radial" else 0.1 * ECCENTRIC)
    return (_rms([w.amplitude * w.order / 2 for w in waves if w.order > 1]) or GRADE.race) * 2.0 / order


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
