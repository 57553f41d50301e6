"""The running spindle in time: MuJoCo under the forces of its imperfections, at constant speed, in run-up and in coast-down.

Unbalance is an off-axis mass centre and a tilted inertia of the turning body; waviness, ball sizes and the cage act as generalised
forces known in advance, which MuJoCo takes step by step in C (Runge-Kutta 4), several spindles side by side on all cores.
A force is held over a step: it is taken at the middle of the step and made larger by what holding takes off, (1 - (omega h)^2 / 24), so
that nothing of the step is left in the response. The motor holds the speed: the spin hinge carries a flywheel's armature, which
adds no gyroscopic moment, and a known torque for a speed that changes.

A record at constant speed starts in the exact steady state of the linear model, so that nothing has to die out. Bearing stiffness,
contact angles, and with them the lines in orders, are those of the operating point's own speed in run-up and coast-down too; their
change with speed comes from ball inertia alone.

Long records are simulated piece by piece; each is decimated by a linear-phase filter (flat to 1e-4 up to 0.35 of the sample rate,
90 dB down from half of it) and forgotten, so that memory holds the record and one piece.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from thermospindle.model.carrier import unbalance_carrier
from thermospindle.model.errors import BadInput
from thermospindle.model.rotor.mjcf import DEAD_LOAD, joint_names, spin_dofs, spin_speeds
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.hammer.test import check_step
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.excitation import Excitation, Harmonics, at_speed, chain_response, excitation
from thermospindle.sim.side_by_side import SideBySide

FILTER_REACH = 24  # samples on either side that the anti-alias filter sees
PIECE = 0.05  # s, simulated at a time
MOST_STEPS = 5_000_000  # of one record, as of a hammer test's: a quarter of an hour of a large model
BLOCK = 256  # steps for which sines are tabulated
FLYWHEEL = 1e3  # armature of the spin hinge over the body's own polar inertia
POLAR_GIVEN = 0.01  # share of its polar moment that a tilted segment may give up to stay a body


@dataclass(frozen=True)
class SpeedProfile:
    """Speed over time, piecewise linear between `time` (s, rising from 0) and `speed` (rad/s); constant before and after."""

    time: tuple[float, ...]
    speed: tuple[float, ...]

    def at(self, time: NDArray[np.floating]) -> Array:
        """Speed (rad/s) at `time` (s)."""
        return np.interp(time, self.time, self.speed)

    def angle(self, time: NDArray[np.floating]) -> Array:
        """Angle (rad) turned since time 0: the exact integral of the speed."""
        knots, speed = np.array(self.time), np.array(self.speed)
        turned = np.concatenate([[0.0], np.cumsum(np.diff(knots) * (speed[1:] + speed[:-1]) / 2)])
        before = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 1)
        since = time - knots[before]
        found: Array = turned[before] + since * (speed[before] + self.at(time)) / 2
        return found


@dataclass(frozen=True, eq=False)
class RunningRecord:
    """A spindle that ran: time (n,) s, angle (n,) rad and speed (n,) rad/s of the turning body, displacement (n, dofs) m, rad.

    Angle and speed are the spindle's, of which every turning body has its own ratio. Displacements
    are those of the chain's degrees of freedom from the loaded state, in a frame that does not turn.
    """

    point: OperatingPoint
    element: str
    time: Array
    angle: Array
    speed: Array
    displacement: Array


def run_spindle(
    points: Sequence[OperatingPoint],
    duration: float,
    sample_rate: float,
    element: str = "linear",
    speed_profile: SpeedProfile | None = None,
    settle: float = 0.0,
    step: float | None = None,
    progress: Callable[[str], None] = lambda done: None,
) -> list[RunningRecord]:
    """Records of `duration` (s) at `sample_rate` (Hz) of spindles run side by side on all cores, by MuJoCo in C.

    Every point runs at its own speed, or all follow `speed_profile` (of the sign of the points' own speed). `settle` (s) is run before and
    thrown away: the start is exact for linear bearing elements, nearly so for "ball-by-ball" ones, whose springs are nonlinear but do not
    orbit (`sim.running.moving_balls` has balls that do). Raises `BadInput` for a sample rate
    that the integration step does not divide, a step too long for the stiffest mode, and a profile that does not fit.

    `step` (s) is the scene's hammer_test.step_us by default. Modes that turn by x = omega_mode step in a step are followed to x^5 / 120,
    and a stiffer mode's share of the motion, which follows the force at once, to about omega step: 1e-4 of the hub's motion, 2e-3 of the
    shaft's tilt at the scene's step, thirty times less at half of it.
    """
    from scipy.signal import firwin, upfirdn  # takes half a second to load

    step = step or points[0].spindle.hammer.step
    every = _every(points, step, sample_rate)
    samples, settled = round(duration * sample_rate), int(np.ceil(settle * sample_rate))
    if samples < 1:
        raise BadInput(f"duration = {duration:g} s: allowed is one sample of {1 / sample_rate:g} s or more")
    if (steps := record_steps(settled + samples, every)) > MOST_STEPS:
        raise BadInput(
            f"{points[0].spindle.file or points[0].spindle.name}: a record of {duration:g} s takes {steps:.2g} steps of {1e6 * step:.3g} us, for the stiffest mode of the model; allowed are "
            f"{MOST_STEPS:.0e}: longer elements, softer joints or heavier parts take fewer, so does a shorter record, and --path linear needs none"
        )
    runs = [_Run(point, element, step, -(FILTER_REACH + settled) * every * step, speed_profile) for point in points]
    taps = firwin(2 * FILTER_REACH * every + 1, 0.85 / every, window=("kaiser", 8.6))
    per_piece = _per_piece(sample_rate)
    needed = settled + samples + 2 * FILTER_REACH
    state = np.array([run.start for run in runs])
    nv = runs[0].model.nv
    tail = np.zeros((len(runs), 2 * FILTER_REACH * every, nv))
    filtered, turned = [], []
    with SideBySide([run.model for run in runs]) as pool:
        for first in range(0, needed, per_piece):
            count = min(per_piece, needed - first)
            forces = np.array([run.forces(first * every, count * every) for run in runs])
            moved, _ = pool.step(state, forces, mujoco.mjtState.mjSTATE_QFRC_APPLIED)
            state = moved[:, -1]
            position = np.concatenate([tail, moved[:, :, 1 : 1 + nv]], axis=1)
            tail = position[:, -tail.shape[1] :]
            ends = slice(2 * FILTER_REACH, 2 * FILTER_REACH + count)
            filtered.append(upfirdn(taps, position, 1, every, axis=1)[:, ends])
            turned.append(moved[:, ::every, :][:, :, [*[1 + d for d in runs[0].spins], *[1 + nv + d for d in runs[0].spins]]])
            progress(f"{(first + count) / needed:.0%} of {duration:g} s")
    late = settled + 2 * FILTER_REACH
    position = np.concatenate(filtered, axis=1)[:, late : late + samples]
    late -= FILTER_REACH
    spin = np.concatenate(turned, axis=1)[:, late : late + samples]
    time = np.arange(samples) / sample_rate
    return [
        RunningRecord(run.point, element, time, spin[i, :, k] / run.ratios[k], spin[i, :, len(run.spins) + k] / run.ratios[k], position[i][:, run.free])
        for i, run in enumerate(runs)
        for k in [int(np.abs(run.ratios).argmax())]  # what turns tells how far the spindle has
    ]


def record_steps(samples: int, every: int) -> int:
    """Integration steps of a record of so many samples, `every` steps each, and of what its filter sees on either side."""
    return (samples + 2 * FILTER_REACH) * every


def pieces(samples: int, sample_rate: float) -> int:
    """How often `run_spindle` tells of its progress in a record of so many samples, without what settles."""
    return -(-(samples + 2 * FILTER_REACH) // _per_piece(sample_rate))


def _per_piece(sample_rate: float) -> int:
    return max(1, round(PIECE * sample_rate))


def _every(points: Sequence[OperatingPoint], step: float, sample_rate: float) -> int:
    """Integration steps a sample."""
    every = round(1 / (sample_rate * step))
    if every < 1 or abs(every * sample_rate * step - 1) > 1e-6:
        raise BadInput(
            f"sample_rate = {sample_rate:g} Hz: allowed are whole fractions of the {1 / step:g} Hz of the integration (hammer_test.step_us)"
        )
    for point in points:
        check_step(point, step, "runout --path linear (the exact harmonic answer)")
    return every


def running_model(point: OperatingPoint, element: str = "linear", step: float | None = None) -> mujoco.MjModel:
    """The MuJoCo model of a running spindle, without hammers and vibrometers, with the dead loads that balls by themselves need: mass centre and inertia of the turning body nearest the
    unbalance (of a flexible shaft, a segment) off the axis by it, and a flywheel's armature on the spin.

    A static unbalance U at height h above the mass centre moves it by U / m and adds the product of inertia U h; a couple W adds W.
    """
    spec = point.spec(element)
    spec.option.timestep = step or point.spindle.hammer.step
    hammers = [a for a in spec.actuators if not a.name.startswith(DEAD_LOAD)]
    for thing in (*spec.sensors, *hammers, *(t for t in spec.tendons if t.name in {f"point{p.node}" for p in point.spindle.points})):
        spec.delete(thing)
    own, turning = point.imperfections, [b for b in point.chain.bodies if b.turns]
    for body in turning:
        spec.joint(f"{body.name}.spin").armature = FLYWHEEL * body.inertia[2]
    if not (own.unbalance or own.couple_unbalance):
        return spec.compile()
    carrier = unbalance_carrier(point.spindle, own)
    body = spec.body(carrier.name)
    static = own.unbalance * np.exp(1j * own.unbalance_phase)
    product = static * (own.unbalance_z - carrier.z) + own.couple_unbalance * np.exp(1j * own.couple_phase)
    body.ipos = [static.real / body.mass, static.imag / body.mass, 0.0]
    if product != 0.0:
        full = tilted_inertia(np.asarray(body.inertia), product, carrier.name)
        body.inertia = [0.0, 0.0, 0.0]
        body.fullinertia = full
    model = spec.compile()
    model.body_sameframe[model.body(carrier.name).id] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)  # MuJoCo takes an offset below 1 um for none
    return model


def tilted_inertia(inertia: Array, product: complex, name: str) -> list[float]:
    """Moments and products of inertia (xx, yy, zz, xy, xz, yz) of a body whose principal axes an unbalance tilts.

    A segment of a beam is a thin disc, whose polar moment is the sum of the others: tilted by no more than a hair its principal moments
    would be those of no body. What they lack, of second order in the tilt, is taken off the polar moment.
    """
    xx, yy, zz = inertia
    tilt = np.array([[0.0, 0.0, -product.real], [0.0, 0.0, -product.imag], [-product.real, -product.imag, 0.0]])
    lacking = 0.0
    for _ in range(3):
        small, middle, large = np.linalg.eigvalsh(np.diag([xx, yy, zz - lacking]) + tilt)
        lacking += 1.01 * max(large - small - middle, 0.0)
    if lacking > POLAR_GIVEN * zz:
        raise BadInput(
            f"imperfections: the unbalance tilts the inertia of {name} by {1e9 * abs(product):.3g} g mm2, which is too much for its "
            f"{1e9 * zz:.3g} g mm2 about the axis"
        )
    return [xx, yy, zz - lacking, 0.0, -product.real, -product.imag]


class _Run:
    """One spindle's model, starting state and forces, step by step from time `begin` (s)."""

    def __init__(self, point: OperatingPoint, element: str, step: float, begin: float, profile: SpeedProfile | None) -> None:
        self.point, self.step, self.profile = point, step, profile
        self.begin = begin - step  # MuJoCo gives states after a step
        self.model = running_model(point, element, step)
        self.spins = spin_dofs(self.model)
        self.ratios = np.array(list(spin_speeds(point.chain, 1.0).values()))
        names = joint_names(point.chain)
        self.free = [names.index(f"{body}.{move}") for body, move in point.chain.dofs]
        self.excitation = excitation(point)
        self.driven = self.excitation.without("unbalance")
        self.start = self._start()

    def _start(self) -> Array:
        """MuJoCo's full physics state in the linear steady state at `begin`."""
        speed, ratio = self.point.condition.speed, 1.0
        if self.profile is not None:
            _check_profile(self.profile, self.point)
            speed, ratio = self.profile.speed[0], self.profile.speed[0] / speed
        forces = at_speed(self.excitation, ratio)
        moved = chain_response(replace(self.point.chain, speed=speed), forces) * np.exp(2j * np.pi * forces.frequency * self.begin)[:, None]
        data = mujoco.MjData(self.model)
        mujoco.mj_resetData(self.model, data)
        data.qpos[self.free] = moved.sum(axis=0).real
        data.qvel[self.free] = (2j * np.pi * forces.frequency[:, None] * moved).sum(axis=0).real
        data.qpos[self.spins], data.qvel[self.spins] = self.ratios * speed * self.begin, self.ratios * speed
        state = np.empty(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(self.model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        return state

    def forces(self, first: int, steps: int) -> Array:
        """Generalised forces (steps, nv) held over the steps from number `first`."""
        found = np.zeros((steps, self.model.nv))
        start = self.begin + first * self.step
        if self.profile is None:
            found[:, self.free] = steady_forces(at_speed(self.driven, 1.0), start, self.step, steps)
        else:
            found[:, self.free] = changing_forces(self.driven, self.point.condition.speed, self.profile, start, self.step, steps)
            edges = self.profile.at(start + np.arange(steps + 1) * self.step)
            found[:, self.spins] = np.diff(edges)[:, None] / self.step * self.ratios * self._spin_inertia()
        return found

    def _spin_inertia(self) -> Array:
        """What resists a change of speed at every spin hinge (kg m2), flywheel included."""
        data, mass = mujoco.MjData(self.model), np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_forward(self.model, data)
        mujoco.mj_fullM(self.model, data, mass)
        return np.diag(mass)[self.spins]


def _check_profile(profile: SpeedProfile, point: OperatingPoint) -> None:
    if len(profile.time) != len(profile.speed) or profile.time[0] != 0.0 or np.any(np.diff(profile.time) <= 0):
        raise BadInput("speed_profile.time: must start at 0 and rise, with one speed for each entry")
    if point.condition.speed == 0.0 or min(s * point.condition.speed for s in profile.speed) < 0:
        raise BadInput(
            f"speed_profile.speed: from {min(profile.speed):g} to {max(profile.speed):g} rad/s for a point worked out at "
            f"{point.condition.speed:g} rad/s; allowed are speeds of one sign, and a point that turns"
        )


def steady_forces(forces: Harmonics, start: float, step: float, steps: int) -> Array:
    """Forces (steps, dofs) at constant speed, each held from start + i step for one step.

    Sines are tabulated for one block and turned on from block to block, exp(i w (t + s)) = exp(i w t) exp(i w s).
    """
    omega = 2 * np.pi * forces.frequency
    held = forces.force / np.sinc(omega * step / (2 * np.pi))[:, None]
    table: ComplexArray = np.exp(1j * np.outer((np.arange(BLOCK) + 0.5) * step, omega))
    blocks = -(-steps // BLOCK)
    turned = np.exp(1j * np.outer(start + np.arange(blocks) * BLOCK * step, omega))
    dofs = held.shape[1]
    phasors = (turned[:, :, None] * held).transpose(1, 0, 2).reshape(len(omega), blocks * dofs)
    product = table.real @ phasors.real - table.imag @ phasors.imag
    found: Array = product.reshape(BLOCK, blocks, dofs).transpose(1, 0, 2).reshape(blocks * BLOCK, dofs)[:steps]
    return found


def changing_forces(found: Excitation, speed: float, profile: SpeedProfile, start: float, step: float, steps: int) -> Array:
    """Forces (steps, dofs) along a speed profile; `speed` (rad/s) is that for which the lines' frequencies hold."""
    middle = start + (np.arange(steps) + 0.5) * step
    ratio = np.abs(2 * np.pi * np.array([line.frequency for line in found.line]) / speed)
    omega, angle = np.abs(profile.at(middle)), np.abs(profile.angle(middle)) * np.sign(middle)
    rise = np.sign(speed) * np.diff(profile.at(start + np.arange(steps + 1) * step)) / step
    turned = np.exp(1j * np.outer(angle, ratio))
    by_speed = 1j * ratio[:, None] * found.damping
    by_square = ratio[:, None] ** 2 * (found.mass + step**2 / 24 * found.stiffness)
    force = (turned @ found.stiffness).real + omega[:, None] * (turned @ by_speed).real + omega[:, None] ** 2 * (turned @ by_square).real
    if found.mass.any():
        force += rise[:, None] * (turned @ (-1j * ratio[:, None] * found.mass)).real
    return force
