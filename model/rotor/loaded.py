"""Bearings under radial loads and the spindle's weight: the whole spindle in equilibrium, each row
displaced and tilted as the structure lets it.

Unknown are the motions u of all bodies from the preloaded state, in which everything is balanced: K u + sum
over the rows of B^T (f(B u) - f(0)) = F, K the stiffness of joints, beams and bearings given by numbers, B
the motion of a row's outer ring against its inner one, f its forces. Shares of the load follow. Without ball
inertia all energies are convex, so that the answer is unique; it is where the search for heavy balls begins.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy

from thermospindle.model.bearing import ball_row, roller
from thermospindle.model.bearing.ball_row import BallRow, Rolled, RowForce
from thermospindle.model.bearing.definitions import BearingSet
from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.roller import RollerRow, RollerState
from thermospindle.model.bearing.state import LinearState
from thermospindle.model.carrier import load_carrier
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import RotorBase, element_rows, matrices, motion_rows, rotor_base
from thermospindle.model.rotor.static import displacement, firmly
from thermospindle.model.types import Array

SMALL, ROUNDED = 1e-9, 1e-15
"""Of the displacement, and in m or rad beside it, what may be left of the balance."""
MOST_STEPS = 60
SLACK = 1.0
"""Rate (N/m) of a spring that keeps its force: a tenth of a millimetre changes that by 1e-4 N."""


@dataclass(frozen=True)
class _Row:
    """A row of balls, at so many `places` of the cage (`ball_row.at_all_places`), or of rollers; `b` (m, n) as above."""

    b: Array
    row: BallRow | RollerRow
    places: int = 1

    def light(self, q: Array) -> tuple[Array, Array]:
        """Force and tangent of a displacement without ball inertia."""
        if isinstance(self.row, RollerRow):
            rolled = roller.respond(self.row, q)
            return rolled.force, rolled.tangent
        found = ball_row.respond(replace(self.row, inertia=None), q)
        return found.force / self.places, found.tangent / self.places

    def energy(self, q: Array) -> float:
        """Of a displacement, without ball inertia."""
        return roller.energy(self.row, q) if isinstance(self.row, RollerRow) else ball_row.energy(self.row, q) / self.places


Answer = Callable[[Sequence[Array]], list[tuple[Array, Array]]]
"""Force and tangent of every row at displacements of theirs."""


def _light(rows: Sequence[_Row]) -> Answer:
    return lambda qs: [row.light(q) for row, q in zip(rows, qs, strict=True)]


def _asked(rows: Sequence[_Row]) -> Callable[[Sequence[Array]], list[RowForce]]:
    """What rows of balls answer at displacements of theirs: sought together, from where the balls were when last asked;
    or, where loose ones lead nowhere from there, from where they were when first asked."""
    balls = [row.row for row in rows if isinstance(row.row, BallRow)]
    first: list[Rolled | None] = []
    last: list[Rolled | None] = [None] * len(balls)

    def ask(qs: Sequence[Array]) -> list[RowForce]:
        try:
            told = ball_row.respond_all(balls, qs, last)
        except NoEquilibrium:
            if not first:
                raise
            told = ball_row.respond_all(balls, qs, first)
        last[:] = [own.rolled for own in told]
        first[:] = first or last
        return told

    return ask


def loaded(spindle: Spindle, state: PairState) -> PairState:
    """The state with its rows where the scene's radial loads, and the weight of a spindle that
    lies, displace them; the state itself where there are none.

    Stiffness is the tangent there, the mean over all places of the cage, forces those of the most loaded ball or roller; bearings given by
    numbers bear their share and stay as stiff. Rings on a spring slide, without friction, as far as their rows push them. Raises `NoEquilibrium` where nothing bears the load.
    """
    if not spindle.loaded_across:
        return state
    chain, moved, told = _at_rest(spindle, state)
    balls = tuple(_displaced(spindle, b, _rows(chain, b.name) @ moved, *own) for b, own in zip(state.bearings, told, strict=True))
    others = tuple(_pressed(spindle, b, _rows(chain, b.name) @ moved) for b in state.linear)
    return replace(state, bearings=balls, linear=others)


def motion(spindle: Spindle, state: PairState) -> tuple[RotorBase, Array]:
    """The chain at a centred state, and the motion (n,) of its degrees of freedom under the scene's
    radial loads and weight; raises as `loaded`."""
    return _at_rest(spindle, state)[:2]


def _at_rest(spindle: Spindle, state: PairState) -> tuple[RotorBase, Array, list[tuple[RowForce, int]]]:
    """As `motion`, and what every ball row answers there, with its balls at how many places of the cage."""
    chain = rotor_base(_rings_apart(spindle), state)
    bearings: list[BearingState | RollerState] = [*state.bearings, *(b for b in state.linear if isinstance(b, RollerState))]
    own, rows = {b.name for b in bearings}, [_Row(_rows(chain, b.name), b.row) for b in bearings]
    linear = matrices(replace(chain, elements=tuple(e for e in chain.elements if e.name not in own)))
    forces = [(load_carrier(spindle, load).name, load.z, np.array(load.force)) for load in spindle.radial_loads]
    forces += [(b.name, b.z, b.mass * np.array(spindle.gravity)) for b in chain.bodies if any(spindle.gravity)]
    load = sum((motion_rows(chain, body, (0.0, 0.0, z))[:2].T @ force for body, z, force in forces), start=np.zeros(len(linear.mass)))
    balls, others = rows[: len(state.bearings)], rows[len(state.bearings) :]
    return chain, *_motion(linear.stiffness, np.diag(linear.mass), balls, others, load, sum(float(np.hypot(*force)) for _, _, force in forces))


def _rings_apart(spindle: Spindle) -> Spindle:
    """With every ring on a spring as a body of its own, of some mass, which no balance asks for;
    one without a rate keeps its force, and has next to none."""
    mass = float(np.median([b.mass for b in spindle.structure.bodies]))

    def free(s: BearingSet) -> BearingSet:
        return s if s.spring is None else replace(s, spring=replace(s.spring, rate=s.spring.rate or SLACK, mass=s.spring.mass or mass))

    return replace(spindle, sets=tuple(free(s) for s in spindle.sets))


def _rows(chain: RotorBase, name: str) -> Array:
    return element_rows(chain, next(e for e in chain.elements if e.name == name))


def _motion(
    stiffness: Array, mass: Array, balls: Sequence[_Row], rollers: Sequence[_Row], load: Array, size: float
) -> tuple[Array, list[tuple[RowForce, int]]]:
    """Motion (n,) under a load (n,) of `size` N: Newton's method on the balance without ball
    inertia, or the least potential where that does not arrive, then with it; and what rows of balls answer there.

    With any stiffness of the rows added to K, the balance has the load and forces along the rows alone at its right:
    u lies in the span of what these do to that structure, and all is sought there, in some thirty unknowns whatever
    the number of elements (the dual of substructuring: Farhat & Roux 1991, *Int. J. Numer. Meth. Eng.* 32, 1205).
    """
    rows = [*balls, *rollers]
    firm = stiffness + sum((row.b.T @ (np.trace(stiffness) / len(mass) * row.b) for row in rows), start=np.zeros_like(stiffness))
    held = firmly(firm, load)
    if held is None:
        raise NoEquilibrium("nothing bears the load across the axis: the spindle is free to move under it")
    unit = 1e-6 * np.sqrt(np.median(mass) / mass)
    pushed = np.linalg.solve(held, np.column_stack([load, *(row.b.T for row in rows)])) / unit[:, None]
    basis = unit[:, None] * np.linalg.qr(pushed / np.maximum(np.linalg.norm(pushed, axis=0), 1e-300))[0]
    structure = _Structure(basis.T @ stiffness @ basis, basis.T @ load, tuple(row.b @ basis for row in rows), basis)
    found = _balanced(structure, _light(rows), np.zeros(len(structure.load)))  # convex: where it arrives is the one answer
    if found is None:
        found = _least(structure, rows, 1e-6 * size)
    where, placed = structure.rows[: len(balls)], list(balls)
    for _ in range(2):  # as the cage stands, and at all places of the cage where these differ there
        asked, ask = placed, _asked(placed)
        found = _balanced(structure, partial(_heavy, asked, ask, rollers), found)
        if found is None:
            raise NoEquilibrium(f"the bearings find no balance under {size:.6g} N across the axis")
        placed = [_at_all_places(row, b @ found) for row, b in zip(balls, where, strict=True)]
        if [row.places for row in placed] == [row.places for row in asked]:
            break
    return np.asarray(basis @ found), [(own, row.places) for row, own in zip(asked, ask([b @ found for b in where]), strict=True)]


def _heavy(balls: Sequence[_Row], ask: Callable[[Sequence[Array]], list[RowForce]], rollers: Sequence[_Row], qs: Sequence[Array]) -> list[tuple[Array, Array]]:
    told = [(own.force / row.places, own.tangent / row.places) for row, own in zip(balls, ask(qs[: len(balls)]), strict=True)]
    return told + [row.light(q) for row, q in zip(rollers, qs[len(balls) :], strict=True)]


def _at_all_places(row: _Row, q: Array) -> _Row:
    """A row of balls with these at all places of the cage, where they differ at a displacement."""
    assert isinstance(row.row, BallRow)
    every, places = ball_row.at_all_places(row.row, q)
    return replace(row, row=every, places=places)


@dataclass(frozen=True)
class _Structure:
    """Stiffness (m, m), load (m,) and every row's motion (5, m) in the unknowns v (m,) of u = `basis` (n, m) v."""

    stiffness: Array
    load: Array
    rows: tuple[Array, ...]
    basis: Array


def _balanced(s: _Structure, answer: Answer, v: Array) -> Array | None:
    """The balance by Newton's method from v (m,); None where it does not arrive."""
    at_rest, last = [force for force, _ in answer([np.zeros(5)] * len(s.rows))], 0.0
    for _ in range(MOST_STEPS):
        found = answer([b @ v for b in s.rows])
        left = s.load - s.stiffness @ v - sum((b.T @ (f - f0) for b, (f, _), f0 in zip(s.rows, found, at_rest, strict=True)), start=np.zeros_like(v))
        tangent = s.stiffness + sum((b.T @ _even(k) @ b for b, (_, k) in zip(s.rows, found, strict=True)), start=np.zeros_like(s.stiffness))
        step = displacement(tangent, left)
        if step is None or not np.isfinite(step).all():
            return None
        v = v + step
        allowed, length = SMALL * np.abs(s.basis @ v).max() + ROUNDED, float(np.abs(s.basis @ step).max())
        if length <= allowed or length**3 <= allowed * last**2:  # steps that double their digits leave this
            return v
        last = length
    return None


def _least(s: _Structure, rows: Sequence[_Row], work: float) -> Array:
    """Where the potential without ball inertia is least, in units of a `work` (J): rows that lose contact on the way are no hindrance."""
    resting = [row.light(np.zeros(5))[0] for row in rows]

    def potential(v: Array) -> float:
        held = sum(row.energy(b @ v) - float(f @ (b @ v)) for row, b, f in zip(rows, s.rows, resting, strict=True))
        return (0.5 * float(v @ s.stiffness @ v) + held - float(s.load @ v)) / work

    def gradient(v: Array) -> Array:
        held = sum((b.T @ (row.light(b @ v)[0] - f) for row, b, f in zip(rows, s.rows, resting, strict=True)), start=np.zeros_like(v))
        return np.asarray(s.stiffness @ v + held - s.load) / work

    def hessian(v: Array) -> Array:
        held = sum((b.T @ row.light(b @ v)[1] @ b for row, b in zip(rows, s.rows, strict=True)), start=np.zeros_like(s.stiffness))
        return (s.stiffness + held) / work + 1e-12 * np.eye(len(v))

    found = scipy.optimize.minimize(potential, np.zeros(len(s.load)), jac=gradient, hess=hessian, method="trust-exact", options={"gtol": 1e-7, "maxiter": 400})
    return np.asarray(found.x)


def _even(tangent: Array) -> Array:
    return (tangent + tangent.T) / 2


def _displaced(spindle: Spindle, b: BearingState, q: Array, answer: RowForce, places: int) -> BearingState:
    stiffness, force = _even(answer.tangent) / places, answer.force / places
    share = answer.ball_force / max(float(answer.ball_force.sum()), 1e-300)
    most = int(np.argmax(answer.ball_force))
    return replace(
        b,
        contact_angle=float(share @ answer.inner_angle),
        outer_contact_angle=float(share @ answer.outer_angle),
        deformation=float(answer.deformation[most]),
        contact_force=float(answer.ball_force[most]),
        outer_contact_force=float(answer.outer_ball_force[most]),
        ball_stiffness=1.5 * b.row.constant * max(float(answer.deformation[most]), 0.0) ** 0.5,
        preload=spindle.bearing(b.name).sense * float(force[2]),
        stiffness=stiffness,
        damping=spindle.structure.damping_time(spindle.bearing(b.name).damping_ratio) * stiffness,
        in_contact=bool(answer.in_contact.any()),
        displacement=tuple(float(x) for x in q),
        radial_force=(float(force[0]), float(force[1])),
    )


def _pressed(spindle: Spindle, b: LinearState, q: Array) -> LinearState:
    """A roller bearing with its rings displaced by q (5,), or one given by numbers, which is as stiff as before."""
    if not isinstance(b, RollerState):
        fx, fy = b.stiffness[:2] @ q
        return replace(b, radial_force=(float(fx), float(fy)))
    own = next(r for r in spindle.roller_bearings if r.name == b.name)
    force = roller.respond(b.row, q).force
    return replace(roller.state_at(spindle, own, b.row, q), radial_force=(float(force[0]), float(force[1])))
