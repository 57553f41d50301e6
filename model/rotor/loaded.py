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

import numpy as np
import scipy

from thermospindle.model.bearing import ball_row, roller
from thermospindle.model.bearing.ball_row import BallRow
from thermospindle.model.bearing.definitions import BearingSet
from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.bearing.roller import RollerState
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
    """A row in the structure: `b` (5, n) as above; force and tangent of its displacement, these
    `light` without ball inertia, and so its `energy`."""

    name: str
    b: Array
    answer: Callable[[Array], tuple[Array, Array]]
    light: Callable[[Array], tuple[Array, Array]]
    energy: Callable[[Array], float]


def loaded(spindle: Spindle, state: PairState) -> PairState:
    """The state with its rows where the scene's radial loads, and the weight of a spindle that
    lies, displace them; the state itself where there are none.

    Stiffness is the tangent there, the mean over all places of the cage, forces those of the most loaded ball or roller; bearings given by
    numbers bear their share and stay as stiff. Rings on a spring slide, without friction, as far as their rows push them. Raises `NoEquilibrium` where nothing bears the load.
    """
    if not spindle.loaded_across:
        return state
    chain, moved = motion(spindle, state)
    balls = tuple(_displaced(spindle, b, _rows(chain, b.name) @ moved) for b in state.bearings)
    others = tuple(_pressed(spindle, b, _rows(chain, b.name) @ moved) for b in state.linear)
    return replace(state, bearings=balls, linear=others)


def motion(spindle: Spindle, state: PairState) -> tuple[RotorBase, Array]:
    """The chain at a centred state, and the motion (n,) of its degrees of freedom under the scene's
    radial loads and weight; raises as `loaded`."""
    chain = rotor_base(_rings_apart(spindle), state)
    rows = [_ball(chain, b, (b.row, 1)) for b in state.bearings] + [_roller(chain, b) for b in state.linear if isinstance(b, RollerState)]
    own = {row.name for row in rows}
    linear = matrices(replace(chain, elements=tuple(e for e in chain.elements if e.name not in own)))
    forces = [(load_carrier(spindle, load).name, load.z, np.array(load.force)) for load in spindle.radial_loads]
    forces += [(b.name, b.z, b.mass * np.array(spindle.gravity)) for b in chain.bodies if any(spindle.gravity)]
    load = sum((motion_rows(chain, body, (0.0, 0.0, z))[:2].T @ force for body, z, force in forces), start=np.zeros(len(linear.mass)))
    size, mass = sum(float(np.hypot(*force)) for _, _, force in forces), np.diag(linear.mass)
    moved = _motion(linear.stiffness, mass, rows, load, size)
    balls = {b.name: ball_row.at_all_places(b.row, _rows(chain, b.name) @ moved) for b in state.bearings}
    if all(places == 1 for _, places in balls.values()):
        return chain, moved
    return chain, _motion(linear.stiffness, mass, [*(_ball(chain, b, balls[b.name]) for b in state.bearings), *rows[len(state.bearings) :]], load, size)


def _rings_apart(spindle: Spindle) -> Spindle:
    """With every ring on a spring as a body of its own, of some mass, which no balance asks for;
    one without a rate keeps its force, and has next to none."""
    mass = float(np.median([b.mass for b in spindle.structure.bodies]))

    def free(s: BearingSet) -> BearingSet:
        return s if s.spring is None else replace(s, spring=replace(s.spring, rate=s.spring.rate or SLACK, mass=s.spring.mass or mass))

    return replace(spindle, sets=tuple(free(s) for s in spindle.sets))


def _ball(chain: RotorBase, b: BearingState, every: tuple[BallRow, int]) -> _Row:
    """Of a row with its balls at so many places of the cage (`ball_row.at_all_places`)."""
    row, places = every
    light = replace(row, inertia=None)

    def of(row: BallRow) -> Callable[[Array], tuple[Array, Array]]:
        last: ball_row.Rolled | None = None

        def answer(q: Array) -> tuple[Array, Array]:
            nonlocal last
            found = ball_row.respond(row, q, last)
            last = found.rolled
            return found.force / places, found.tangent / places

        return answer

    return _Row(b.name, _rows(chain, b.name), of(row), of(light), lambda q: ball_row.energy(light, q) / places)


def _roller(chain: RotorBase, b: RollerState) -> _Row:
    def answer(q: Array) -> tuple[Array, Array]:
        found = roller.respond(b.row, q)
        return found.force, found.tangent

    return _Row(b.name, _rows(chain, b.name), answer, answer, lambda q: roller.energy(b.row, q))


def _rows(chain: RotorBase, name: str) -> Array:
    return element_rows(chain, next(e for e in chain.elements if e.name == name))


def _motion(stiffness: Array, mass: Array, rows: Sequence[_Row], load: Array, size: float) -> Array:
    """Motion (n,) under a load (n,) of `size` N: Newton's method on the balance without ball
    inertia, or the least potential where that does not arrive, then with it.

    With any stiffness of the rows added to K, the balance has the load and forces along the rows alone at its right:
    u lies in the span of what these do to that structure, and all is sought there, in some thirty unknowns whatever
    the number of elements (the dual of substructuring: Farhat & Roux 1991, *Int. J. Numer. Meth. Eng.* 32, 1205).
    """
    firm = stiffness + sum((row.b.T @ (np.trace(stiffness) / len(mass) * row.b) for row in rows), start=np.zeros_like(stiffness))
    held = firmly(firm, load)
    if held is None:
        raise NoEquilibrium("nothing bears the load across the axis: the spindle is free to move under it")
    unit = 1e-6 * np.sqrt(np.median(mass) / mass)
    pushed = np.linalg.solve(held, np.column_stack([load, *(row.b.T for row in rows)])) / unit[:, None]
    basis = unit[:, None] * np.linalg.qr(pushed / np.maximum(np.linalg.norm(pushed, axis=0), 1e-300))[0]
    structure = _Structure(basis.T @ stiffness @ basis, basis.T @ load, tuple(row.b @ basis for row in rows), basis)
    start = _balanced(structure, [row.light for row in rows], np.zeros(len(structure.load)))  # convex: where it arrives is the one answer
    if start is None:
        start = _least(structure, rows, 1e-6 * size)
    found = _balanced(structure, [row.answer for row in rows], start)
    if found is None:
        raise NoEquilibrium(f"the bearings find no balance under {size:.6g} N across the axis")
    return np.asarray(basis @ found)


@dataclass(frozen=True)
class _Structure:
    """Stiffness (m, m), load (m,) and every row's motion (5, m) in the unknowns v (m,) of u = `basis` (n, m) v."""

    stiffness: Array
    load: Array
    rows: tuple[Array, ...]
    basis: Array


def _balanced(s: _Structure, answers: Sequence[Callable[[Array], tuple[Array, Array]]], v: Array) -> Array | None:
    """The balance by Newton's method from v (m,); None where it does not arrive."""
    at_rest, last = [answer(np.zeros(5))[0] for answer in answers], 0.0
    for _ in range(MOST_STEPS):
        found = [answer(b @ v) for answer, b in zip(answers, s.rows, strict=True)]
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


def _displaced(spindle: Spindle, b: BearingState, q: Array) -> BearingState:
    row, places = ball_row.at_all_places(b.row, q)
    answer = ball_row.respond(row, q, ball_row.respond(row).rolled)
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
