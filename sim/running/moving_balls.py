"""Ball by ball, with the balls moving: the second way to the running spindle, without small amplitudes.

Every ball orbits with its cage, spins, and meets the waves of both races and its own; its Hertz contact pulls with K
max(deformation, 0)^1.5 along the line between the groove centres as they lie at that moment. Stiffness that changes as
balls pass, contact loss and all products of imperfections and motion are in it; the result of `sim.running.excitation`
must come out where amplitudes are small. Nothing of that module is used: profiles are added up at each ball, in time.

The damping of a bearing acts on the motion of its rings less that of the loads which the imperfections alone would make, as in the linear
model. The rest of the chain is linear and is carried over each step exactly (matrix exponential), with the contacts' difference from their
tangent linear in time over the step and corrected once (second-order exponential integrator: Hochbruck & Ostermann, *Acta Numerica*
2010).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from thermospindle.model.bearing.ball_row import BallRow, at_all_places, respond
from thermospindle.model.bearing.kinematics import Kinematics, row_kinematics
from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave
from thermospindle.model.carrier import unbalance_carrier
from thermospindle.model.rotor.chain import element_rows, matrices, motion_rows
from thermospindle.model.types import Array
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.excitation import at_speed, excitation, response


@dataclass(frozen=True, eq=False)
class BallContacts:
    """The contacts of one row at given times: arrays (times, balls).

    `cos`, `sin` of the balls' azimuths; `radial`, `axial`: heights of the outer race less the inner one where the ball is (m);
    `thick`: what the ball is too thick by between its two contacts, which lie opposite each other (m). `displacement` (5,): of the
    outer ring against the inner one where displacements are counted from.
    """

    row: BallRow
    displacement: Array
    cos: Array
    sin: Array
    radial: Array
    axial: Array
    thick: Array

    def force(self, at: int | slice, moved: Array, factor: Array | float = 1.0) -> Array:
        """Force (..., 5) on the outer ring, to hold it, at displacements (..., 5) of it against the inner ring.

        `at` picks times; `factor` multiplies the imperfections.
        """
        row, c, s = self.row, self.cos[at], self.sin[at]
        x, y, z, tilt_x, tilt_y = ((moved + self.displacement)[..., n, None] for n in range(5))
        across = x * c + y * s + factor * self.radial[at] - row.radial
        along = z + row.arm * (tilt_x * s - tilt_y * c) + factor * self.axial[at] + row.axial
        length = np.hypot(across, along)
        load = row.constant * np.maximum(length - row.unloaded_distance + factor * self.thick[at], 0.0) ** 1.5 / length
        force_r, force_z = load * across, load * along
        moments = (row.arm * force_z * s, -row.arm * force_z * c)
        return np.stack([np.sum(f, axis=-1) for f in (force_r * c, force_r * s, force_z, *moments)], axis=-1)


def ball_contacts(bearing: BearingState, kin: Kinematics, own: RowImperfections, time: Array) -> BallContacts:
    """The contacts of a row at `time` (n,) s: every profile read off where the ball is."""
    row, displacement = bearing.row, np.array(bearing.displacement or (0.0,) * 5)
    t = time[:, None]
    place = 2 * np.pi * np.arange(row.balls) / row.balls + kin.cage * t
    inner, outer = place - kin.inner * t, place - kin.outer * t
    thick = np.zeros(place.shape)
    if own.ball_diameter:
        thick += np.array(own.ball_diameter) - np.mean(own.ball_diameter)
    angle = kin.spin * np.sign(kin.turning) * time
    for j, waves in enumerate(own.ball_waves):
        thick[:, j] += _height(waves, angle) + _height(waves, angle + np.pi)
    radial = _height(own.outer_radial, outer) - _height(own.inner_radial, inner)
    axial = _height(own.outer_axial, outer) - _height(own.inner_axial, inner)
    return BallContacts(row, displacement, np.cos(place), np.sin(place), radial, axial, thick)


def _height(waves: Sequence[Wave], azimuth: Array) -> Array:
    found = np.zeros_like(azimuth)
    for w in waves:
        found += w.amplitude * np.cos(w.order * azimuth + w.phase)
    return found


def run_moving_balls(
    point: OperatingPoint, own: Imperfections, duration: float, factors: Sequence[float] = (1.0,), step: float = 5e-6
) -> tuple[Array, Array]:
    """Time (n,) s and displacement (factors, n, dofs) m, rad of the chain with imperfections at `factors` times `own`, side by side.

    Starts in the steady state of the linear model. Raises ValueError for balls with inertia and for bearings whose stiffness is not that of
    their rows (a film or a bond in series), for which there is no such second way here.
    """
    chain, linear = point.chain, matrices(point.chain)
    n, steps = len(chain.dofs), round(duration / step)
    elements = [next(e for e in chain.elements if e.name == b.name) for b in point.state.bearings]
    for element, bearing in zip(elements, point.state.bearings, strict=True):
        if bearing.row.inertia is not None or np.abs(element.stiffness - bearing.stiffness).max() > 1e-9 * np.abs(element.stiffness).max():
            raise ValueError(f"{bearing.name} bearing: moving balls need massless balls and a bearing that is its ball row alone")
    time: Array = np.linspace(0.0, steps * step, steps + 1)
    scale = np.array(factors, float)[:, None]
    rows, stiffness = [element_rows(chain, e) for e in elements], [e.stiffness for e in elements]
    kin = row_kinematics(point.spindle, point.state)
    contacts = [ball_contacts(b, kin[b.name], own.row(b.name), time) for b in point.state.bearings]
    held = [_mean_force(b) for b in point.state.bearings]
    given = scale[:, :, None] * _unbalance_forces(point, own, kin, time)
    for b, bearing in enumerate(point.state.bearings):  # damping of the loads that imperfections alone would make
        halves = ball_contacts(bearing, kin[bearing.name], own.row(bearing.name), np.append(time - step / 2, time[-1] + step / 2))
        lag = float(elements[b].damping[2, 2] / stiffness[b][2, 2])
        for f, factor in enumerate(factors):
            given[f] -= lag * np.diff(halves.force(slice(None), np.zeros(5), factor), axis=0) / step @ rows[b]

    def remainder(k: int, q: Array) -> Array:
        """Generalised forces (factors, n): what is given, and what the contacts pull beyond their tangent and their preload."""
        found = given[:, k].copy()
        for own_rows, tangent, preload, here in zip(rows, stiffness, held, contacts, strict=True):
            moved = q @ own_rows.T
            found -= (here.force(k, moved, scale) - preload - moved @ tangent) @ own_rows
        return found

    state_matrix = np.zeros((2 * n, 2 * n))
    state_matrix[:n, n:] = np.eye(n)
    inverse = np.linalg.inv(linear.mass)
    state_matrix[n:] = np.hstack([-inverse @ linear.stiffness, -inverse @ linear.damping])
    carry, first, second = _exponentials(state_matrix, np.vstack([np.zeros((n, n)), inverse]), step)
    perfect = _steady_start(point, Imperfections())
    state = perfect + scale * (_steady_start(point, own) - perfect)
    displacement = np.empty((len(factors), steps + 1, n))
    displacement[:, 0] = state[:, :n]
    before = force = remainder(0, state[:, :n])
    for k in range(1, steps + 1):
        free = state @ carry.T + force @ first.T
        ahead = remainder(k, (free + (force - before) @ second.T)[:, :n])
        state = free + (ahead - force) @ second.T
        before, force = force, remainder(k, state[:, :n])
        displacement[:, k] = state[:, :n]
    return time, displacement


def _mean_force(bearing: BearingState) -> Array:
    """Force (5,) that holds the outer ring, the mean over all places of the cage."""
    displacement = np.array(bearing.displacement or (0.0,) * 5)
    row, places = at_all_places(bearing.row, displacement)
    return respond(row, displacement).force / places


def difference_from_linear(
    point: OperatingPoint, own: Imperfections, factors: Sequence[float], settle: float = 0.04, duration: float = 0.04
) -> Array:
    """Share (factors,) by which the linear response misses what moving balls do: rms over time of the turning body's displacement (x, y, z)
    after `settle` (s), relative to the linear one."""
    time, moved = run_moving_balls(point, own, settle + duration, factors)
    turning = next(b.name for b in point.chain.bodies if b.turns)
    columns = [point.chain.dofs.index((turning, move)) for move in ("x", "y", "z")]
    late = time > settle
    made, perfect = (linear_motion(point, which, time[late])[:, columns] for which in (own, Imperfections()))
    linear = [perfect + f * (made - perfect) for f in factors]
    return np.array([_rms(m[late][:, columns] - one) / _rms(one) for m, one in zip(moved, linear, strict=True)])


def linear_motion(point: OperatingPoint, own: Imperfections, time: Array) -> Array:
    """Displacement (n, dofs) m, rad of the chain in the linear model at `time` (n,) s."""
    forces = at_speed(excitation(point, own), 1.0)
    return np.asarray(np.real(np.exp(2j * np.pi * np.outer(time, forces.frequency)) @ response(point, forces)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _steady_start(point: OperatingPoint, own: Imperfections) -> Array:
    forces = at_speed(excitation(point, own), 1.0)
    moved = response(point, forces)
    return np.concatenate([moved.sum(axis=0).real, (2j * np.pi * forces.frequency[:, None] * moved).sum(axis=0).real])


def _unbalance_forces(point: OperatingPoint, own: Imperfections, kin: Mapping[str, Kinematics], time: Array) -> Array:
    """Generalised forces (n_times, n) of all unbalances: that of the turning body, and of the cages on the outer body."""
    chain, carrier = point.chain, unbalance_carrier(point.spindle, own)
    speed = point.condition.speed * carrier.speed_ratio
    rows = motion_rows(chain, carrier.name, (0.0, 0.0, own.unbalance_z))
    static, couple = speed * time + own.unbalance_phase, speed * time + own.couple_phase
    found = own.unbalance * speed**2 * (np.stack([np.cos(static), np.sin(static)], axis=1) @ rows[:2])
    found += own.couple_unbalance * speed**2 * (np.stack([-np.sin(couple), np.cos(couple)], axis=1) @ rows[3:])
    for bearing in point.state.bearings:
        row, cage = own.row(bearing.name), kin[bearing.name].cage
        at = cage * time + row.cage_phase
        outer = motion_rows(chain, point.spindle.bearing(bearing.name).outer_body, (0.0, 0.0, bearing.z))
        found += row.cage_unbalance * cage**2 * (np.stack([np.cos(at), np.sin(at)], axis=1) @ outer[:2])
    return np.asarray(found)


def _exponentials(matrix: Array, inputs: Array, step: float) -> tuple[Array, Array, Array]:
    """exp(A h), and what an input does that is constant, and one that rises from 0 to 1, over a step of x' = A x + B u."""
    n, m = inputs.shape
    whole = np.zeros((n + 2 * m, n + 2 * m))
    whole[:n, :n], whole[:n, n : n + m] = matrix * step, inputs * step
    whole[n : n + m, n + m :] = np.eye(m)
    found = expm(whole)
    return found[:n, :n], found[:n, n : n + m], found[:n, n + m :]
