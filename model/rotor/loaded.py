"""Bearings under an external radial load: the whole spindle in equilibrium, each row displaced and tilted as the structure lets it.

Unknown are the motions u of all bodies from the preloaded state, in which everything is balanced: K u + sum over the rows of B^T (f(B u) - f(0)) = F,
K the stiffness of joints, beams and bearings given by numbers, B the motion of a row's outer ring against its inner one, f its forces. Shares
of the load follow. Without ball inertia all energies are convex, so that the answer is unique; it is where the search for heavy balls begins.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from thermospindle.model.bearing import ball_row, roller
from thermospindle.model.bearing.definitions import BearingSet
from thermospindle.model.bearing.pair import BearingState, PairState, damping_time
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.bearing.state import LinearState
from thermospindle.model.carrier import load_carrier
from thermospindle.model.errors import NoEquilibrium
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import RotorBase, element_rows, matrices, motion_rows, rotor_base
from thermospindle.model.rotor.static import displacement
from thermospindle.model.types import Array

SMALL = 1e-9
"""Of the load, what may be left of the balance."""
MOST_STEPS = 60
SLACK = 1.0
"""Rate (N/m) of a spring that keeps its force: a tenth of a millimetre changes that by 1e-4 N."""


@dataclass(frozen=True)
class _Row:
    """A row in the structure: `b` (5, n) as above; `force`, `tangent`, `energy` of its displacement, the last without ball inertia."""

    name: str
    b: Array
    force: Callable[[Array], Array]
    tangent: Callable[[Array], Array]
    energy: Callable[[Array], float]
    light: Callable[[Array], tuple[Array, Array]]  # force and tangent without ball inertia


def loaded(spindle: Spindle, state: PairState) -> PairState:
    """The state with its rows where the scene's radial load displaces them; the state itself where there is none.

    Stiffness is the tangent there, forces those of the most loaded ball or roller; bearings given by numbers bear their share and stay as stiff. Rings on a spring slide, without friction, as far as their rows
    push them. Raises `NoEquilibrium` where nothing bears the load.
    """
    if not any(spindle.radial_load):
        return state
    chain, moved = motion(spindle, state)
    balls = tuple(_displaced(spindle, b, _rows(chain, b.name) @ moved) for b in state.bearings)
    others = tuple(_pressed(spindle, b, _rows(chain, b.name) @ moved) for b in state.linear)
    return replace(state, bearings=balls, linear=others)


def motion(spindle: Spindle, state: PairState) -> tuple[RotorBase, Array]:
    """The chain at a centred state, and the motion (n,) of its degrees of freedom under the scene's radial load; raises as `loaded`."""
    chain = rotor_base(_rings_apart(spindle), state)
    rows = [_ball(chain, b) for b in state.bearings] + [_roller(chain, b) for b in state.linear if isinstance(b, RollerState)]
    own = {row.name for row in rows}
    linear = matrices(replace(chain, elements=tuple(e for e in chain.elements if e.name not in own)))
    carrier = load_carrier(spindle)
    load = motion_rows(chain, carrier.name, (0.0, 0.0, spindle.radial_load_z))[:2].T @ np.array(spindle.radial_load)
    return chain, _motion(linear.stiffness, np.diag(linear.mass), rows, load, float(np.hypot(*spindle.radial_load)))


def _rings_apart(spindle: Spindle) -> Spindle:
    """With every ring on a spring as a body of its own, of some mass, which no balance asks for; one without a rate keeps its force, and has next to none."""
    mass = float(np.median([b.mass for b in spindle.structure.bodies]))

    def free(s: BearingSet) -> BearingSet:
        return s if s.spring is None else replace(s, spring=replace(s.spring, rate=s.spring.rate or SLACK, mass=s.spring.mass or mass))

    return replace(spindle, sets=tuple(free(s) for s in spindle.sets))


def _ball(chain: RotorBase, b: BearingState) -> _Row:
    light = replace(b.row, inertia=None)

    def alone(q: Array) -> tuple[Array, Array]:
        answer = ball_row.respond(light, q)
        return answer.force, answer.tangent

    return _Row(
        b.name,
        _rows(chain, b.name),
        lambda q: ball_row.respond(b.row, q).force,
        lambda q: ball_row.respond(b.row, q).tangent,
        lambda q: ball_row.energy(light, q),
        alone,
    )


def _roller(chain: RotorBase, b: RollerState) -> _Row:
    def alone(q: Array) -> tuple[Array, Array]:
        answer = roller.respond(b.row, q)
        return answer.force, answer.tangent

    return _Row(b.name, _rows(chain, b.name), lambda q: alone(q)[0], lambda q: alone(q)[1], lambda q: roller.energy(b.row, q), alone)


def _rows(chain: RotorBase, name: str) -> Array:
    return element_rows(chain, next(e for e in chain.elements if e.name == name))


def _motion(stiffness: Array, mass: Array, rows: Sequence[_Row], load: Array, size: float) -> Array:
    """Motion (n,) under a load (n,) of `size` N: the least potential, then Newton's method on the balance."""
    firm = stiffness + sum((row.b.T @ (np.trace(stiffness) / len(mass) * row.b) for row in rows), start=np.zeros_like(stiffness))
    if displacement(firm, load) is None:
        raise NoEquilibrium("nothing bears the radial load: the spindle is free to move under it")
    none = np.zeros(5)
    resting = [row.light(none)[0] for row in rows]
    unit = 1e-6 * np.sqrt(np.median(mass) / mass)
    work = 1e-6 * size

    def potential(v: Array) -> float:
        u = v * unit
        held = sum(row.energy(row.b @ u) - float(f @ (row.b @ u)) for row, f in zip(rows, resting, strict=True))
        return (0.5 * float(u @ stiffness @ u) + held - float(load @ u)) / work

    def gradient(v: Array) -> Array:
        u = v * unit
        held = sum((row.b.T @ (row.light(row.b @ u)[0] - f) for row, f in zip(rows, resting, strict=True)), start=np.zeros_like(u))
        return np.asarray(stiffness @ u + held - load) * unit / work

    def hessian(v: Array) -> Array:
        u = v * unit
        held = sum((row.b.T @ row.light(row.b @ u)[1] @ row.b for row in rows), start=np.zeros_like(stiffness))
        return (stiffness + held) * np.outer(unit, unit) / work + 1e-12 * np.eye(len(u))

    found = scipy.optimize.minimize(potential, np.zeros(len(load)), jac=gradient, hess=hessian, method="trust-exact", options={"gtol": 1e-7, "maxiter": 400})
    u = found.x * unit
    before = [row.force(none) for row in rows]
    for _ in range(MOST_STEPS):
        left = load - stiffness @ u - sum((row.b.T @ (row.force(row.b @ u) - f) for row, f in zip(rows, before, strict=True)), start=np.zeros_like(u))
        tangent = stiffness + sum((row.b.T @ _even(row.tangent(row.b @ u)) @ row.b for row in rows), start=np.zeros_like(stiffness))
        step = displacement(tangent, left)
        if step is None:
            break
        u = u + step
        if np.abs(step).max() <= SMALL * np.abs(u).max():
            return np.asarray(u)
    raise NoEquilibrium(f"the bearings find no balance under a radial load of {size:g} N")


def _even(tangent: Array) -> Array:
    return (tangent + tangent.T) / 2


def _displaced(spindle: Spindle, b: BearingState, q: Array) -> BearingState:
    answer = ball_row.respond(b.row, q)
    stiffness = _even(answer.tangent)
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
        preload=spindle.bearing(b.name).sense * float(answer.force[2]),
        stiffness=stiffness,
        damping=damping_time(spindle, spindle.bearing(b.name)) * stiffness,
        in_contact=bool(answer.in_contact.any()),
        displacement=tuple(float(x) for x in q),
        radial_force=(float(answer.force[0]), float(answer.force[1])),
    )


def _pressed(spindle: Spindle, b: LinearState, q: Array) -> LinearState:
    """A roller bearing with its rings displaced by q (5,), or one given by numbers, which is as stiff as before."""
    if not isinstance(b, RollerState):
        fx, fy = b.stiffness[:2] @ q
        return replace(b, radial_force=(float(fx), float(fy)))
    own = next(r for r in spindle.roller_bearings if r.name == b.name)
    force = roller.respond(b.row, q).force
    return replace(roller.state_at(spindle, own, b.row, q), radial_force=(float(force[0]), float(force[1])))
