"""How far rings move until their axial forces balance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.bearing.centred import Centres, centred_axial, centred_axial_force
from thermospindle.model.changed import changed
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.types import Array

MOST, LEAST = 100, 1e-6  # steps of many parts, and how short they get
STEPS = 20  # of Newton's method, which takes six
FARTHEST = 1e-4  # m, in one of them
EXACT, ROUNDED = 1e-17, 1e-15  # m, of what is left of a step, and below which a step that does not get shorter is rounding
REACH, NEAR = 1e-6, 1e-9  # m, first bracket about where nothing has moved, and about the answer of balls without inertia


@dataclass(frozen=True)
class Sleeve:
    """Rings that slide together on a spring: their rows, whether they go with the hub (1) or against it (-1), and the spring's push in the sense of z (N) and its
    rate (N/m; 0 for a constant force)."""

    rows: tuple[BallRow, ...]
    towards: int
    push: float
    rate: float


@dataclass(frozen=True)
class Rings:
    """What one movement of a hub (m) balances: rows whose outer rings it moves with it (1) or against it (-1), rows on sleeves, and the load on it (N)."""

    fixed: tuple[tuple[BallRow, int], ...]
    sleeves: tuple[Sleeve, ...]
    load: float

    @cached_property
    def heavy(self) -> bool:
        rows = [row for row, _ in self.fixed] + [row for s in self.sleeves for row in s.rows]
        return any(row.inertia is not None for row in rows)

    @property
    def massless(self) -> Rings:
        fixed = tuple((changed(row, inertia=None), towards) for row, towards in self.fixed)
        return Rings(fixed, tuple(changed(s, rows=tuple(changed(row, inertia=None) for row in s.rows)) for s in self.sleeves), self.load)


def equilibrium(rings: Rings, centres: Centres) -> tuple[float, ...]:
    """Movement (m) of the hub without imbalance, and of the rings on every sleeve, by Newton's method, or by bracketing where that does not arrive; that of balls
    with inertia is sought from the answer of balls without. `centres` keeps where balls settled. Raises `NoEquilibrium`."""
    without, nowhere = rings.massless if rings.heavy else rings, (0.0,) * (1 + len(rings.sleeves))
    found = _near(without, nowhere, centres) or _bracketed(without, nowhere, REACH, centres)
    if rings.heavy:
        found = _near(rings, found, centres) or _bracketed(rings, found, NEAR, centres)
    return found


def _near(rings: Rings, start: tuple[float, ...], centres: Centres) -> tuple[float, ...] | None:
    """The equilibrium near a start by Newton's method: of every sleeve f(r) + rate (r - h) = push, of the hub the sum of its rows and springs. None where steps do
    not end, are long, or nothing is pressed."""
    hub, slid = start[0], list(start[1:])
    last = 0.0
    for _ in range(STEPS):
        off, stiffness, own = -rings.load, 0.0, []
        for row, towards in rings.fixed:
            force, slope = centred_axial(row, towards * hub, centres)
            off += towards * force
            stiffness += slope
        for s, r in zip(rings.sleeves, slid, strict=True):
            spring = s.push - s.rate * (r - s.towards * hub)
            answers = [centred_axial(row, r, centres) for row in s.rows]
            held = sum(slope for _, slope in answers) + s.rate
            if held <= 0.0:
                return None
            missing = spring - sum(force for force, _ in answers)
            own.append((missing / held, s.towards * s.rate / held))  # how far it goes alone, and with the hub
            off += s.towards * (spring - s.rate * missing / held)
            stiffness += s.rate * (1 - s.rate / held)
        if stiffness <= 0.0:
            return None
        step = -off / stiffness
        moves = [step, *(alone + share * step for alone, share in own)]
        longest = max(map(abs, moves))
        if longest > FARTHEST:
            return None
        hub, slid = hub + step, [r + m for r, m in zip(slid, moves[1:], strict=True)]
        # steps that double their digits leave longest^3 / last^2
        if longest <= EXACT or longest**3 <= EXACT * last**2 or last / 2 < longest < ROUNDED:
            return hub, *slid
        last = longest
    return None


def _bracketed(rings: Rings, start: tuple[float, ...], reach: float, centres: Centres) -> tuple[float, ...]:
    """Every force rises with its movement: brackets about a `start`, for the sleeves within that of the hub."""

    def slid(s: Sleeve, at: float, hub: float) -> float:
        return _root(lambda r: sum(centred_axial_force(row, r, centres) for row in s.rows) + s.rate * (r - s.towards * hub) - s.push, at, reach)

    def imbalance(hub: float) -> float:
        found = sum(towards * centred_axial_force(row, towards * hub, centres) for row, towards in rings.fixed) - rings.load
        for s, at in zip(rings.sleeves, start[1:], strict=True):
            # whatever rings under a constant force do, it is the push
            found += s.towards * (s.push - s.rate * (slid(s, at, hub) - s.towards * hub) if s.rate else s.push)
        return found

    hub = _root(imbalance, start[0], reach)
    return hub, *(slid(s, at, hub) for s, at in zip(rings.sleeves, start[1:], strict=True))


def _root(imbalance: Callable[[float], float], start: float, reach: float) -> float:
    while reach < 5e-3:
        if imbalance(start - reach) <= 0 <= imbalance(start + reach):
            return float(scipy.optimize.brentq(imbalance, start - reach, start + reach, xtol=EXACT, rtol=1e-14))
        reach *= 4
    raise NoEquilibrium(f"the bearings find no axial equilibrium within {reach * 1e3:.1f} mm of hub movement")


# ---------------------------------------------------------------- of many parts


@dataclass(frozen=True, eq=False)
class Parts:
    """What the movements (m) of n parts along the axis balance: of every row its outer ring's movement against its inner one, `motion` (rows, n) times those of the parts, and the force (N) that was on it as
    it was put together, `at_reference` (rows,); sleeves: which rows slide on a spring, its push in the sense of z (N) and its rate; the `stiffness` (n, n) of joints between parts, and the `load` on them (n,)."""

    rows: tuple[BallRow, ...]
    motion: Array
    at_reference: Array
    sleeves: tuple[tuple[tuple[int, ...], float, float], ...]
    stiffness: Array
    load: Array

    def moves(self, y: Array) -> Array:
        """Movements (rows,) for those of the parts and, after these, of the rings on sleeves."""
        n = self.motion.shape[1]
        found = self.motion @ y[:n]
        for (own, _, _), slid in zip(self.sleeves, y[n:], strict=True):
            found[list(own)] = slid
        return np.asarray(found)

    def imbalance(self, y: Array, rows: tuple[BallRow, ...], centres: Centres) -> tuple[Array, Array]:
        """Of every part and sleeve what is out of balance (N), and its derivatives."""
        n, answers = self.motion.shape[1], np.array([centred_axial(row, float(m), centres) for row, m in zip(rows, self.moves(y), strict=True)])
        force, slope = answers.T
        sliding = [i for own, _, _ in self.sleeves for i in own]
        fixed = np.setdiff1d(np.arange(len(rows)), sliding)
        off, by = np.zeros(len(y)), np.zeros((len(y), len(y)))
        off[:n] = self.motion[fixed].T @ (force - self.at_reference)[fixed] + self.stiffness @ y[:n] - self.load
        by[:n, :n] = self.motion[fixed].T @ (slope[fixed, None] * self.motion[fixed]) + self.stiffness
        for k, (own, push, rate) in enumerate(self.sleeves, n):
            way = self.motion[own[0]]
            less = rate * (y[k] - way @ y[:n])  # than its push
            off[:n] -= way * less
            off[k] = sum(force[list(own)]) - push + less
            by[:n, :n] += rate * np.outer(way, way)
            by[:n, k] -= rate * way
            by[k, :n] -= rate * way
            by[k, k] = sum(slope[list(own)]) + rate
        return off, by


def balanced(parts: Parts, centres: Centres) -> Array:
    """Movement (m) of every row's outer ring against its inner one, by Newton's method, shortened as long as the next step would not be shorter (Deuflhard, *Newton Methods for Nonlinear Problems*, 2004, 3.3); that of
    balls with inertia is sought from the answer of balls without, whose energy is convex. Raises `NoEquilibrium`."""
    y = np.zeros(parts.motion.shape[1] + len(parts.sleeves))
    y = _stepped(parts, y, tuple(changed(row, inertia=None) for row in parts.rows), centres)
    return parts.moves(_stepped(parts, y, parts.rows, centres))


def _stepped(parts: Parts, y: Array, rows: tuple[BallRow, ...], centres: Centres) -> Array:
    off, by = parts.imbalance(y, rows, centres)
    last = np.inf
    for _ in range(MOST):
        move = _solved(by, -off)
        length = float(np.abs(move).max(initial=0.0))
        if length <= EXACT or (length < ROUNDED and length > last / 2):
            return y
        share = min(1.0, FARTHEST / length)
        while True:
            there = y + share * move
            off, here = parts.imbalance(there, rows, centres)
            if np.abs(_solved(by, off)).max() <= (1 - share / 4) * length or length < 1e3 * ROUNDED:
                break
            share /= 2
            if share < LEAST:
                raise NoEquilibrium("the bearings find no axial equilibrium")
        y, by, last = there, here, length
    raise NoEquilibrium("the bearings find no axial equilibrium")


def _solved(by: Array, off: Array) -> Array:
    """Where rows hang loose, the shortest move of many."""
    return np.asarray(np.linalg.lstsq(by, off, rcond=1e-14)[0])
