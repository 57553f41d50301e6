"""Amplitudes of sources from the lines of runout tests, and the evidence for an effect among them.

Lines that share a source in any test are one *family*. In a family, with tests t, probes p and sources q,

    y_tp = sum over q of (h_tpq + sum over k of x_k dh_tpq/dx_k) exp(i psi_tg(q)) (c_q + a b_q) + error,

c_q ~ CN(0, likely_q^2) what the spindle has of a source, x_k ~ N(0, sd_k^2) the relative build deviations, a
the size of an effect that gives the source b_q a unit of size, N(0, prior^2), and psi the phases of groups of
sources that keep step: what turns with the turning part, and each bearing's lines of one frequency. Every test
starts with the balls elsewhere, so that psi is unknown, uniform, in every test. Every ball has its own phase in
every test too: c_q of ball waviness is another in every test. A probe without phase enters by its amplitude.

chi2 is made least from several starts; the evidence is Laplace's, phases with the variance pi^2 / 3 of a uniform one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from thermospindle.diagnosis.runout.lines import Key, Seen, SeenLine, key_of
from thermospindle.diagnosis.runout.sources import SourceKey, Sources
from thermospindle.model.types import Array, ComplexArray

UNIFORM = np.pi**2 / 3  # variance of a uniform phase
UNPHASED_STARTS, STEPS = 12, 60  # amplitudes alone have many more local minima
SAME = 0.01  # in chi2: two of the up to four starts with phases that end as near each other have found the best fit
RESTS = 1e-4  # relative fall of chi2, or step, from which a fit rests
TURNING = "turning"


@dataclass(frozen=True, eq=False)
class Family:
    """The data of lines that share sources: rows are (test, line, probe).

    `value` (R,), `sd` (R,) of the complex error, `phased` (R,); `shown` (R, Q), `by_tolerance` (K, R, Q); `phase` (R, Q)
    the number from 1 of the source's phase in the row, 0 where it shows nothing; `likely` (Q,); `source` names the columns
    and the test of those of one test alone; `free` is how many of the phases the amplitudes' own phases do not stand for.
    """

    value: ComplexArray
    sd: Array
    phased: NDArray[np.bool_]
    test: NDArray[np.int_]
    frequency: Array
    node: NDArray[np.int_]
    shown: ComplexArray
    by_tolerance: ComplexArray
    phase: NDArray[np.int_]
    likely: Array
    source: tuple[tuple[SourceKey, int | None], ...]
    tolerance_sd: Array
    free: int

    @property
    def keys(self) -> frozenset[Key]:
        return frozenset(s[0][0] for s in self.source)

    @property
    def count(self) -> int:
        """How many real numbers the data are, less the phases that nothing predicts."""
        return max(int(np.where(self.phased, 2, 1).sum()) - self.free, 1)

    def of_effect(self, amplitudes: Mapping[SourceKey, complex]) -> ComplexArray:
        """b (Q,) of an effect's amplitudes a unit of size."""
        return np.array([amplitudes.get(source, 0.0) for source, _ in self.source], complex)

    def only(self, rows: NDArray[np.bool_]) -> Family:
        """Some of the rows; sources and phases stay."""
        return Family(
            self.value[rows], self.sd[rows], self.phased[rows], self.test[rows], self.frequency[rows], self.node[rows], self.shown[rows],
            self.by_tolerance[:, rows], self.phase[rows], self.likely, self.source, self.tolerance_sd, self.free,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class FamilyFit:
    """`size` (effects,) of the effects with standard errors `size_sd`; `amplitude` (Q,) of what the
    spindle has besides, in units of `likely`; `residual` (R,) in standard errors; `chi2` with
    priors; `evidence` ln; `free_sd` (effects,) of the sizes without their priors."""

    size: Array
    size_sd: Array
    amplitude: ComplexArray
    model: ComplexArray
    chi2: float
    evidence: float
    free_sd: Array
    tolerance: Array = field(default_factory=lambda: np.zeros(0))


def families(seen: Sequence[Seen], found: Sources) -> list[Family]:
    """The lines of all tests, parted into families."""
    of_key: dict[Key, set[Key]] = {}
    known = {key for key, _ in found.shown}
    for s in seen:
        for line in s.seen:
            keys = {key_of(g) for g in line.lines} & known
            joined = set().union(keys, *(of_key.get(k, set()) for k in keys))
            for k in joined:
                of_key[k] = joined
    whole = {id(group): group for group in of_key.values()}
    return [made for group in whole.values() if (made := _family(seen, found, group)) is not None]


def _family(seen: Sequence[Seen], found: Sources, keys: set[Key]) -> Family | None:
    columns: list[tuple[SourceKey, int | None]] = []
    for source in found.shown:
        if source[0] in keys:
            each = range(len(seen)) if source[0][1] == "ball waviness" else [None]
            columns += [(source, t) for t in each]
    rows: list[tuple[int, int, SeenLine, NDArray[np.int_], bool]] = []
    phases: dict[tuple[int, str, str], int] = {}
    steady: set[tuple[int, str, str]] = set()
    for t, s in enumerate(seen):
        turning = abs(s.condition.speed) / (2 * np.pi)
        of_parts = {f"{ratio:g}": ratio * turning for ratio in found.ratios}
        for line in s.seen:
            own = {key_of(g): g for g in line.lines}
            if not own.keys() & keys:
                continue
            number = np.zeros(len(columns), int)
            for q, (source, only) in enumerate(columns):
                g = own.get(source[0])
                if g is None or only not in (None, t):
                    continue
                locked = next((name for name, f in of_parts.items() if abs(g.frequency - f) < 1e-6 * f), None)
                group = (TURNING, locked) if locked else (g.bearing, _kind_of(source[0]))
                number[q] = phases.setdefault((t, *group), len(phases) + 1)
                if source[0][1] != "ball waviness":
                    steady.add((t, *group))
            rows += [(t, p, line, number, s.phased) for p in range(len(s.nodes))]
    if not rows:
        return None
    tests, probes = np.array([r[0] for r in rows]), np.array([r[1] for r in rows])
    used = np.array([r[3] for r in rows])
    shown = np.array([found.shown[source][tests, probes] for source, _ in columns]).T * (used > 0)
    by = np.array([found.by_tolerance[source][:, tests, probes] for source, _ in columns]).transpose(1, 2, 0) * (used > 0)
    return Family(
        np.array([r[2].phasor[r[1]] for r in rows]),
        np.array([r[2].sd[r[1]] for r in rows]),
        np.array([r[4] for r in rows]),
        tests,
        np.array([r[2].frequency for r in rows]),
        np.array([seen[t].nodes[p] for t, p in zip(tests, probes, strict=True)]),
        shown,
        by,
        used,
        np.array([found.likely[source] for source, _ in columns]),
        tuple(columns),
        found.sd,
        len(steady) - len({group[1:] for group in steady}),
    )


def _kind_of(key: Key) -> str:
    """What names a group in every test: the cause and the multiple that fix the frequency."""
    _, cause, _, name = key
    if cause in ("ball size", "cage unbalance", "ball waviness"):  # the cage's clock, and what a ball adds to it
        return name
    return name if " - f" in name or " + f" in name or "(" in name else f"{cause} {name}"


def merged(parts: Sequence[Family]) -> Family:
    """Several families as one, with the tolerances in common."""
    if len(parts) == 1:
        return parts[0]
    rows, columns = [len(f.value) for f in parts], [len(f.likely) for f in parts]
    shown = np.zeros((sum(rows), sum(columns)), complex)
    by = np.zeros((len(parts[0].tolerance_sd), *shown.shape), complex)
    phase = np.zeros(shown.shape, int)
    r = c = first = 0
    for f, nr, nc in zip(parts, rows, columns, strict=True):
        shown[r : r + nr, c : c + nc], by[:, r : r + nr, c : c + nc] = f.shown, f.by_tolerance
        phase[r : r + nr, c : c + nc] = np.where(f.phase > 0, f.phase + first, 0)
        r, c, first = r + nr, c + nc, first + int(f.phase.max(initial=0))
    several = {
        name: np.concatenate([getattr(f, name) for f in parts]) for name in ("value", "sd", "phased", "test", "frequency", "node", "likely")
    }
    return Family(
        several["value"], several["sd"], several["phased"], several["test"], several["frequency"], several["node"], shown, by, phase,
        several["likely"], tuple(s for f in parts for s in f.source), parts[0].tolerance_sd, sum(f.free for f in parts),
    )  # fmt: skip


# ---------------------------------------------------------------- fitting


def fit_family(f: Family, effects: Sequence[ComplexArray] = (), priors: Sequence[float] = ()) -> FamilyFit:
    """The best fit of a family with effects whose sources are b (Q,) a unit of size, and sizes believed to be within `priors` of zero."""
    random = np.random.default_rng(0)
    problem = _Problem(f, np.array(effects, complex).reshape(len(effects), len(f.likely)), np.array(priors, float))
    phased = bool(f.phased.all())
    best = problem.least(problem.start(0, random))
    for start in (2, 1, 3) if phased else range(1, UNPHASED_STARTS):  # 2 begins with phases at random, 0 and 1 with those of the data
        found = problem.least(problem.start(start, random))
        agree = abs(found[0] - best[0]) < SAME
        if found[0] < best[0] - 1e-6:
            best = found
        if phased and agree:
            break
    return problem.summary(*best)


class _Problem:
    """Least squares in the scaled parameters: Re z, Im z (Q each; c = likely z), sizes over priors, phases, tolerances over sd."""

    def __init__(self, f: Family, b: ComplexArray, priors: Array) -> None:
        self.f, self.b, self.priors = f, b, priors
        self.q, self.n, self.m, self.k = len(f.likely), len(priors), int(f.phase.max(initial=0)), len(f.tolerance_sd)
        self.by = f.by_tolerance * f.tolerance_sd[:, None, None]
        precision = np.concatenate([np.full(2 * self.q, 2.0), np.ones(self.n), np.zeros(self.m), np.ones(self.k)])
        self.precision = precision
        self.scale = np.sqrt(2) / f.sd
        self.belief = np.where(precision > 0, precision, 1 / UNIFORM)
        groups = np.zeros((self.m, *f.phase.shape), bool)
        for g in range(self.m):
            groups[g] = f.phase == g + 1
        self.groups = groups

    def start(self, number: int, random: np.random.Generator) -> Array:
        p = np.zeros(len(self.precision))
        cut = 2 * self.q
        power = float(np.linalg.norm(self.f.value / self.f.sd))
        for i in range(self.n):
            alone = float(np.linalg.norm((self.f.shown @ self.b[i]) / self.f.sd))
            p[cut + i] = (1.0 if number % 2 == 0 else 0.4) * power / max(alone, 1e-300) / self.priors[i]
        if self.n == 0 or number >= 2:
            z = random.standard_normal((2, self.q)) * (0.1 if self.n else 0.7)
            p[: self.q], p[self.q : cut] = z
        p[cut + self.n : cut + self.n + self.m] = random.uniform(-np.pi, np.pi, self.m)
        if number % 4 < 2:  # phases in step with the data, one group after the other
            self._in_step(p)
        return p

    def _in_step(self, p: Array) -> None:
        u = self._amplitudes(p)
        if not u.any():
            u = u + self.f.likely
        first = 2 * self.q + self.n
        for g in range(self.m):
            own = (self.f.shown * self.groups[g]) @ u
            p[first + g] = float(np.angle(np.vdot(own / self.f.sd**2, self.f.value)))

    def _amplitudes(self, p: Array) -> ComplexArray:
        own = self.f.likely * (p[: self.q] + 1j * p[self.q : 2 * self.q])
        return np.asarray(own + (p[2 * self.q : 2 * self.q + self.n] * self.priors) @ self.b, complex)

    def model(self, p: Array) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """m (R,), turned and tolerated columns (R, Q), phase factors (R, Q), and u (Q,)."""
        first = 2 * self.q + self.n
        turn = np.exp(1j * np.concatenate([[0.0], p[first : first + self.m]]))[self.f.phase]
        column = (self.f.shown + np.tensordot(p[first + self.m :], self.by, 1)) * turn
        u = self._amplitudes(p)
        return column @ u, column, turn, u

    def residual(self, p: Array) -> Array:
        """Computed less measured in standard errors, two rows a complex number (the second zero for amplitudes), and below them the priors."""
        m = self.model(p)[0]
        phased = self.f.phased
        left = np.where(phased, m - self.f.value, np.abs(m) - np.abs(self.f.value)) * self.scale
        return np.concatenate([left.real, left.imag, np.sqrt(self.precision) * p])

    def jacobian(self, p: Array) -> Array:
        m, column, turn, u = self.model(p)
        parts: list[ComplexArray] = [column * self.f.likely, 1j * column * self.f.likely]
        parts.append(column @ (self.b * self.priors[:, None]).T if self.n else np.zeros((len(m), 0), complex))
        whole = column * u
        parts.append(1j * np.array([(whole * g).sum(axis=1) for g in self.groups]).reshape(self.m, len(m)).T)
        parts.append(np.einsum("krq,rq->rk", self.by, turn * u))
        jacobian = np.concatenate(parts, axis=1)
        unphased = ~self.f.phased
        if unphased.any():
            unit = m / np.maximum(np.abs(m), 1e-300)
            jacobian = np.where(unphased[:, None], (unit.conj()[:, None] * jacobian).real + 0j, jacobian)
        jacobian = jacobian * self.scale[:, None]
        return np.concatenate([jacobian.real, jacobian.imag, np.diag(np.sqrt(self.precision))])

    def least(self, p: Array) -> tuple[float, Array]:
        found = least_squares(self.residual, p, self.jacobian, method="lm", ftol=RESTS, xtol=RESTS, max_nfev=STEPS)
        return 2 * float(found.cost), found.x

    def summary(self, cost: float, p: Array) -> FamilyFit:
        jacobian = self.jacobian(p)[: 2 * len(self.f.value)]
        data = jacobian.T @ jacobian
        normal = data + np.diag(self.belief)
        evidence = -0.5 * cost - 0.5 * float(np.linalg.slogdet(normal)[1] - np.log(self.belief).sum())
        own = slice(2 * self.q, 2 * self.q + self.n)
        free = normal.copy()
        free[own, own] -= np.eye(self.n)
        sd = np.sqrt(np.diag(np.linalg.inv(normal))[own])
        with np.errstate(all="ignore"):
            free_sd = np.sqrt(np.maximum(np.diag(np.linalg.pinv(free))[own], 0.0)) if self.n else np.zeros(0)
        return FamilyFit(
            p[own] * self.priors, sd * self.priors, p[: self.q] + 1j * p[self.q : 2 * self.q], self.model(p)[0], cost, evidence,
            free_sd * self.priors, p[2 * self.q + self.n + self.m :],
        )  # fmt: skip
