"""How visible what is hidden is: what of its change of the FRFs tolerances and the model's own constant errors could not take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.blind.campaigns import BY_HAND, Made, beside, error_of_hits, faces_struck, glued
from tests.blind.departures import modal_errors
from tests.blind.hidden import Hidden
from tests.blind.world import World, answer, drawn_matrices, points_struck
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.effects.temperature.expansion_mismatch import expanding, with_material

SMALL = 1e-4  # share of a size, of a tolerance and of a prior width, at which its change is taken for linear
MOTIONS_SD = 0.01  # relative, of thermal motions, of the three widths that worlds are drawn with
MASSES_SD = 3e-3  # of shares of masses, alike
COEFFICIENT_SD = 0.01  # relative, of each material's coefficient of expansion: what tables give of one alloy differs by as much
INERTIA_SD = 0.1  # relative, of the balls' inertia loads: programs differ in the speed of the cage


@dataclass(frozen=True, eq=False)
class Seen:
    """What a campaign can tell apart: lines (Hz), standard errors of every test's FRFs there, and the columns (N, k) of all that
    may stand in for a change, each at one standard deviation: build tolerances, temperatures, gains and each mode's constant
    error, with what couples any two; in worlds that have them thermal motions, hammers' gains, and where sensors sit and look."""

    frequency: Array
    sd: tuple[Array, ...]
    columns: Array

    def whitened(self, moved: Sequence[ComplexArray]) -> Array:
        """Changes of all tests' FRFs in standard errors (N,)."""
        z = np.concatenate([(v / s).ravel() for v, s in zip(moved, self.sd, strict=True)])
        return np.concatenate([z.real, z.imag]) * np.sqrt(2)

    @cached_property
    def _lower(self) -> Array:
        return np.asarray(np.linalg.cholesky(np.eye(self.columns.shape[1]) + self.columns.T @ self.columns))

    def beside(self, changes: Array) -> Beside:
        """Changes (N, m), with what all else can take of them; of one that is nothing in a test nothing is multiplied there."""
        tests = len(self.sd)
        columns, parts = self.columns.reshape(2, tests, -1, self.columns.shape[1]), changes.reshape(2, tests, -1, changes.shape[1])
        alike = np.zeros((self.columns.shape[1], changes.shape[1]))
        for t in range(tests):
            acting = parts[:, t].any(axis=(0, 1))
            alike[:, acting] += sum(c[t].T @ p[t][:, acting] for c, p in zip(columns, parts, strict=True))
        return Beside(changes, np.linalg.solve(self._lower, alike))


@dataclass(frozen=True, eq=False)
class Beside:
    """Changes (N, m), and their products (k, m) with what all else does, so that products of what it leaves cost one product each."""

    changes: Array
    taken: Array

    def inner(self, other: Beside) -> Array:
        """Products (m, n) of what is left of these and of others."""
        return np.asarray(self.changes.T @ other.changes - self.taken.T @ other.taken)

    @property
    def whole(self) -> float:
        """Standard errors of what is left of one change (N, 1)."""
        return float(np.sqrt(max(self.inner(self)[0, 0], 0.0)))


def seen(made: Made, spindle: Spindle, lines: int = 320) -> Seen:
    """The same of one campaign, linear, about the built spindle."""
    hammer = spindle.hammer
    frequency = np.linspace(*hammer.band, lines)
    plain = replace(made.world, stiffness_error=0.0, damping_error=0.0)

    def all_tests(s: Spindle, warmer: float = 0.0, world: World = plain) -> list[ComplexArray]:
        return [answer(s, Condition(p.temperature + warmer, p.speed), world, (), p.place(spindle)).frf(frequency) for p in made.plans]

    base = all_tests(made.built)
    dense = made.campaign.tests[0].frf.frequency.size / lines  # type: ignore[union-attr]
    sd = []
    for test, v in zip(made.campaign.tests, base, strict=True):
        largest = np.abs(test.frf.value).max(axis=(0, 2), keepdims=True)  # type: ignore[union-attr]  # of all lines: peaks are narrower than these lines are apart
        if made.record.kind == "line":
            error = made.record.times * np.sqrt((hammer.noise_of_value * np.abs(v)) ** 2 + (hammer.noise_of_largest * largest) ** 2)
        else:
            error = np.broadcast_to(error_of_hits(frequency, hammer, made.record) * largest, v.shape)
        sd.append(error / np.sqrt(dense))
    found = Seen(frequency, tuple(sd), np.zeros((0, 0)))

    def column(values: Sequence[ComplexArray], other: Sequence[ComplexArray] = base) -> Array:
        return found.whitened([v - o for v, o in zip(values, other, strict=True)])

    # differences to either side: of columns that nearly cancel, what one side has of curvature would be left and be taken for visible
    columns = []
    for parameter in toleranced(spindle):
        more, less = (all_tests(parameter.apply(made.built, step * parameter.sd)) for step in (SMALL, -SMALL))
        columns.append(column(more, less) / (2 * SMALL))
    step = SMALL * spindle.tolerances.temperature
    warmer, colder = all_tests(made.built, step), all_tests(made.built, -step)
    for k in range(len(base)):
        only = [[v if i == k else b for i, (v, b) in enumerate(zip(side, base, strict=True))] for side in (warmer, colder)]
        columns.append(column(*only) / (2 * SMALL))
    for i in range(len(spindle.points)):
        pick = (np.arange(len(spindle.points)) == i)[:, None, None]
        columns.append(column([b * (1 + spindle.tolerances.gain * pick) for b in base]))
        for k in range(len(base)):
            columns.append(column([b * (1 + made.world.gain_drift * pick * (j == k)) for j, b in enumerate(base)]))
    for i in range(len(hammer.hammer_nodes) if made.world.hammer_gain else 0):
        pick = (np.arange(len(hammer.hammer_nodes)) == i)[None, :, None]
        columns.append(column([b * (1 + made.world.hammer_gain * pick) for b in base]))
        for k in range(len(base)):
            columns.append(column([b * (1 + made.world.hammer_drift * pick * (j == k)) for j, b in enumerate(base)]))
        for way in range(2):
            by = np.zeros((len(hammer.hammer_nodes), 2))
            by[i, way] = 1e-4
            hits = points_struck(spindle) + beside(faces_struck(spindle), by)
            aside = [
                (answer(made.built, Condition(p.temperature, p.speed), plain, (), p.place(spindle), hits).frf(frequency) - b) / 1e-4
                for p, b in zip(made.plans, base, strict=True)
            ]
            columns.append(column([b + max(made.world.miss, BY_HAND) * d for b, d in zip(base, aside, strict=True)]))
            columns += [column([b + made.world.miss_drift * d * (j == k) for j, (b, d) in enumerate(zip(base, aside, strict=True))]) for k in range(len(base))]
    for way in np.eye(4) if made.world.place or made.world.askew else ():
        off, turned = (sd * np.tile(by, (len(spindle.points), 1)) for sd, by in ((made.world.place, way[:2]), (made.world.askew, way[2:])))
        aside = [answer(made.built, Condition(p.temperature, p.speed), plain, (), p.place(spindle), None, glued(spindle, off, turned)).frf(frequency) for p in made.plans]
        for i in range(len(spindle.points)):
            pick = (np.arange(len(spindle.points)) == i)[:, None, None]
            columns.append(column([np.where(pick, moved, b) for moved, b in zip(aside, base, strict=True)]))
    for which, sd in (("motions", MOTIONS_SD), ("masses", MASSES_SD)):
        own = getattr(plain, which)
        for off in np.eye(len(own)) if own != getattr(World(), which) else ():
            further = [tuple(np.array(own) + by * sd * SMALL * off) for by in (1, -1)]
            more, less = (all_tests(made.built, world=replace(plain, **{which: values})) for values in further)
            columns.append(column(more, less) / (2 * SMALL))
    for i in range(len(spindle.points) if made.world.late else 0):
        pick = (np.arange(len(spindle.points)) == i)[:, None, None]
        columns.append(column([b * (1 - 2j * np.pi * frequency * made.world.late * pick) for b in base]))
    if made.world.hysteretic:
        more, less = (all_tests(made.built, world=replace(plain, hysteretic=plain.hysteretic + by * SMALL)) for by in (1, -1))
        columns.append(column(more, less) / (2 * SMALL))
    if made.world.own_orbits:
        columns.append(column(all_tests(made.built, world=replace(plain, own_orbits=False))))
    for name in made.built.used_materials:
        material = made.built.materials[name]
        more, less = (all_tests(with_material(made.built, expanding(material, by * COEFFICIENT_SD * SMALL))) for by in (1, -1))
        columns.append(column(more, less) / (2 * SMALL))
    more, less = (all_tests(replace(made.built, ball_inertia=made.built.ball_inertia * (1 + by * INERTIA_SD * SMALL))) for by in (1, -1))
    columns.append(column(more, less) / (2 * SMALL))
    columns += _modal_columns(made, column, frequency, plain, spindle)
    return replace(found, columns=np.array(columns).T)


def change(made: Made, spindle: Spindle, of: Seen, h: Hidden, share: float, world: World) -> Array:
    """What a `share` of one hidden piece does to all tests' FRFs in a `world`, over that share, in standard errors (N,)."""

    def all_tests(hidden: Sequence[Hidden]) -> list[ComplexArray]:
        return [
            answer(made.built, Condition(p.temperature, p.speed), world, hidden, p.place(spindle)).frf(of.frequency) for p in made.plans
        ]

    moved = zip(all_tests([replace(h, size=share * h.size)]), all_tests([]), strict=True)
    return of.whitened([(v - b) / share for v, b in moved])


def visibility(made: Made, spindle: Spindle, of: Seen) -> list[float]:
    """Of every hidden piece: its change of the FRFs in standard errors, after all that else may take of it;
    sqrt(10) is worth 5 in ln evidence. Of the piece itself and of a little of it over its share the smaller: what
    moves peaks by many widths is no longer what small tolerances do, but a larger tolerance may do the same."""
    plain = replace(made.world, stiffness_error=0.0, damping_error=0.0)
    return [_shows(of, [change(made, spindle, of, h, share, plain) for share in (1.0, SMALL)]) for h in made.hidden]


def visibility_beside(made: Made, spindle: Spindle, of: Seen) -> list[float]:
    """The same of every piece where two are hidden, after what the other, as much of it as there is
    in every test by itself, could take: the law of what is named is the data's."""
    plain = replace(made.world, stiffness_error=0.0, damping_error=0.0)
    changes = [[change(made, spindle, of, h, share, plain) for share in (1.0, SMALL)] for h in made.hidden]
    found = []
    for k, own in enumerate(changes):
        others = [_of_each_test(d, len(made.plans)) for j, both in enumerate(changes) if j != k for d in both]
        found.append(_shows(replace(of, columns=np.hstack([of.columns, *others])), own))
    return found


def _of_each_test(moved: Array, tests: int) -> Array:
    """A change (N,) in one test after the other (N, tests)."""
    parts = moved.reshape(2, tests, -1)
    return np.stack([(parts * (np.arange(tests) == k)[None, :, None]).ravel() for k in range(tests)], axis=1)


def _shows(of: Seen, changes: Sequence[Array]) -> float:
    return min(of.beside(d[:, None]).whole for d in changes)


def _modal_columns(made: Made, column, frequency: Array, plain: World, spindle: Spindle) -> list[Array]:
    """Every mode's constant stiffness and damping error, as the world draws them, and what couples every two of them, one at a time."""
    answers = [answer(made.built, Condition(p.temperature, p.speed), plain) for p in made.plans]
    plainly = [at.frf(frequency) for at in answers]
    found = []
    for kind, v in enumerate(modal_errors(drawn_matrices(spindle, made.world), spindle, (made.world.stiffness_error, made.world.damping_error))[:2]):
        v = v[:, np.abs(v).max(axis=0) > 1e-9 * np.abs(v).max()]  # not a rigid motion, which has neither stiffness nor damping
        v = np.pad(v, ((0, len(answers[0].linear.mass) - len(v)), (0, 0)))  # a weak mode comes after the drawing's
        one, two = np.triu_indices(v.shape[1], 1)
        moved = []
        for at in answers:
            of_one = at.by_modes(frequency, v)[kind]
            of_sum = at.by_modes(frequency, v[:, one] + v[:, two])[kind]  # (v + w)(v + w)^T less v v^T and w w^T couples the two
            moved.append(np.concatenate([of_one, of_sum - of_one[one] - of_one[two]]))
        found += [column([p + m[j] for p, m in zip(plainly, moved, strict=True)]) for j in range(len(moved[0]))]
    return found
