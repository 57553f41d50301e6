"""Warm-up: losses heat the running spindle, its rings move, and preload, stiffness and natural frequencies drift with them.

The heat equation of the section (`thermal.heat`) and the axial equilibrium of the bearings (`model.bearing.pair`)
are solved together at every stage of every time step: Palmgren's friction depends on the lubricant's temperature
and on the preload, the preload on the temperature of the whole section. Spin-up takes seconds and is left out:
the speed stands from time zero. A chamber soak is the same with air at another temperature than the spindle's.

Effects of the scene act as at any operating point, with the mean temperature of the spindle (weighted with heat capacity) as the
condition's; those that prescribe region temperatures are left out whole, since region temperatures are what is computed here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.errors import BadInput, OutsideRange
from thermospindle.model.machine import Condition, RollerBearing, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import Mode, modes
from thermospindle.model.types import Array
from thermospindle.model.units import MINUTE, RPM
from thermospindle.sim.effects import of_scene
from thermospindle.sim.effects.effect import Effect, Values
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import OperatingPoint, drawing, operating_point
from thermospindle.thermal import conduction, friction, heat
from thermospindle.thermal.influence import influence
from thermospindle.thermal.readout import Reading, reading

TOLERANCE = 0.01  # K, estimated error of one time step
TIME_CONSTANTS = 8.0  # of the slowest decay that a warm-up lasts by default: the rest is 0.03 %
PARTS = 20  # of the square root of the time, for steps begin short, after each of which progress is told
STAGES = PARTS + 3
"""How often a warm-up tells of its progress."""
SHORTEST = 1e-3  # s that a warm-up lasts: in far less, temperatures move by their rounding
STEPS = 48  # at least, over a warm-up of that length


@dataclass(frozen=True, eq=False)
class Moment:
    """The spindle at one moment: region and bearing temperatures (C), friction heat (W) by bearing, and the operating point."""

    temperatures: Mapping[str, float]
    bearing_temperatures: Mapping[str, float]
    friction: Mapping[str, float]
    point: OperatingPoint

    @property
    def preload(self) -> dict[str, float]:
        return {b.name: b.preload for b in self.point.state.bearings}


@dataclass(frozen=True, eq=False)
class Warmup:
    """A warm-up from `start` (C) in air of `air` (C) at `speed` (rad/s).

    `moments` stand at `history.times` (s); `frequencies` (times, modes) in Hz follow the modes of the first moment by their shape,
    NaN where one has been lost; `steady` is the end of all times, `steady_frequencies` (modes,) its modes; `time_constant` (s) of
    the slowest decay about it. `left_out` names effects whose region temperatures are computed here instead. `feedback` is what
    comes back in the steady state of bearing loads that are added, through the heat that they make: at 1 it would run away. Where
    there is no steady state, and a time was told, `unsteady` says why, and the time constant is that of the loads at the start.
    """

    spindle: Spindle
    start: float
    air: float
    speed: float
    history: heat.History
    moments: tuple[Moment, ...]
    modes: tuple[Mode, ...]
    frequencies: Array
    steady: Moment | None
    steady_frequencies: Array
    time_constant: float
    left_out: tuple[str, ...]
    feedback: float = 0.0
    unsteady: str = ""

    @property
    def times(self) -> Array:
        return self.history.times

    @property
    def every(self) -> tuple[Moment, ...]:
        """All moments, and the steady state after them where there is one."""
        return self.moments if self.steady is None else (*self.moments, self.steady)

    @property
    def every_frequency(self) -> Array:
        """Frequencies (moments and the steady state, modes)."""
        return self.frequencies if self.steady is None else np.vstack([self.frequencies, self.steady_frequencies])


def warm_up(
    spindle: Spindle,
    speed: float,
    start: float,
    air: float | None = None,
    duration: float | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[str], None] = lambda done: None,
) -> Warmup:
    """From a uniform temperature `start` (C) at `speed` (rad/s) in `air` (C, as the start by default) for `duration` (s).

    `duration` is `TIME_CONSTANTS` slowest decays by default; modes in the hammer's band are followed.
    BadInput for a spindle without convection or a duration that is not positive; OutsideRange where a
    law does not reach within it; NotSettled where preload and friction drive each other up without end.
    """
    if duration is not None and not duration >= SHORTEST:
        raise BadInput(f"duration {duration:g} s: a warm-up needs a positive one, of {SHORTEST:g} s or more")
    if not spindle.regions or not spindle.ringed:
        lacking = "section" if not spindle.regions else "ball or roller rows between rings of the section"
        raise BadInput(f"{spindle.file or spindle.name}: {lacking}: there are none, and a warm-up needs a section that heat flows through and rows that make it")
    air = start if air is None else air
    effects = tuple((effect, values) for effect, values in of_scene(spindle) if not effect.temperatures)
    left_out = tuple(effect.name for effect, _ in of_scene(spindle) if effect.temperatures)
    drawn = drawing(spindle, Condition(start, speed), effects)
    model = conduction.model(drawn, influence(drawn).sections)
    if not model.cooled.any():
        raise BadInput(f"{spindle.file or spindle.name}: thermal.convection: cools no face, so the spindle would heat up without end")
    machine = _Machine(spindle, speed, effects, reading(model))
    reached: list[Reached] = []  # at first and last
    course: dict[float, Mapping[str, float]] = {}  # loads of friction (N) at every time

    def drive(time: float, nodal: Array) -> heat.Running:
        state = machine.point(nodal).state
        loads = friction.loads(spindle, state)
        reached[1:], course[time] = [Reached(time, nodal, loads, state)], loads
        return heat.Running(air, speed, loads)

    told = 0

    def passed(share: float, whole: float) -> None:
        nonlocal told
        while told < min(int(np.sqrt(share) * PARTS + 1e-9), PARTS):
            told += 1
            progress(f"{share * whole / MINUTE:.3g} of {whole / MINUTE:.3g} min")

    def marched(whole: float) -> heat.History:
        reached.clear()
        course.clear()
        drive(0.0, model.nodal(start))
        try:
            end = duration or whole
            return heat.march(model, drive, start, end, tolerance, whole / STEPS, lambda share: passed(share, end))
        except (OutsideRange, heat.NotSettled) as error:
            shorter = 0.9 * reached[-1].time / MINUTE
            until = f"; the way there is computed all the same: --minutes {shorter:.2g}" if shorter * MINUTE > SHORTEST else ""
            raise type(error)(f"{where} {_ran_away(machine, reached, course, error)}{until}") from None

    where = f"{spindle.file or spindle.name}: from {start:g} C in air of {air:g} C at {speed / RPM:g} rpm"

    def answered(history: heat.History, final: Array | None, constant: float, back: float = np.nan, unsteady: str = "") -> Warmup:
        progress(f"temperatures in {len(history.times) - 1} steps")
        moments = tuple(machine.moment(nodal) for nodal in history.nodal)
        steady = () if final is None else (machine.moment(final),)
        first = tuple(modes(moments[0].point.chain, highest=spindle.hammer.band[1]))
        followed = _followed(first, [*moments, *steady])
        progress("natural frequencies")
        end, lost = (steady[0], followed[-1]) if steady else (None, np.full(len(first), np.nan))
        return Warmup(spindle, start, air, speed, history, moments, first, followed[: len(moments)], end, lost, constant, left_out, back, unsteady)

    try:
        field = heat.settled(model, lambda nodal: drive(0.0, nodal), start)
    except (heat.NotSettled, OutsideRange) as error:
        loads = isinstance(error, heat.NotSettled)
        why = f"the bearings run away: {error}" if loads else f"the grease or a material is asked for a temperature that its law does not reach: {error}"
        if speed and (duration is not None or not loads):  # too hot on the way to the steady state, which says nothing of when that is
            try:
                constant = heat.slowest(model, model.field(model.nodal(start)), drive(0.0, model.nodal(start)))
            except OutsideRange:
                pass  # it is the start itself
            else:
                history = marched(TIME_CONSTANTS * constant)
                if duration is not None:
                    return answered(history, None, constant, unsteady=why if loads else f"on the way to it {why}")
        raise type(error)(f"{where} {why}; {_remedy(spindle)}") from None
    final = model.nodal(field)
    constant = heat.slowest(model, field, drive(0.0, final))
    back = heat.feedback(model, field, lambda nodal: drive(0.0, nodal))
    progress(f"steady state, time constant {constant:.0f} s")
    return answered(marched(TIME_CONSTANTS * constant), final, constant, back)


@dataclass(frozen=True, eq=False)
class Reached:
    """What a warm-up came to: a time (s), nodal temperatures (nodes,) C, and there the loads P1 (N)
    of the friction of bearings and their state."""

    time: float
    nodal: Array
    loads: Mapping[str, float]
    state: PairState


def _ran_away(machine: _Machine, reached: Sequence[Reached], course: Mapping[float, Mapping[str, float]], error: Exception) -> str:
    """How far a warm-up came that left a law: the bearing whose load of friction has grown most since
    the start, and ever faster, or the hottest where none has, and what helps."""
    begin, last = reached[0], reached[-1]
    after, regions = f"after {last.time / MINUTE:.3g} min", machine.read.region_means(last.nodal)
    temperatures = machine.read.model.bearing @ last.nodal
    ringed = machine.read.model.spindle.ringed
    grown = {b.name: abs(last.loads[b.name]) / max(abs(begin.loads[b.name]), 1e-9) for b in ringed}
    most = max(ringed, key=lambda b: grown[b.name])
    if grown[most.name] <= heat.GROWN or not (isinstance(error, heat.NotSettled | heat.RanAway) or _ever_faster(course, most.name)):
        hottest = ringed[int(np.argmax(temperatures))].name
        helps = f"what helps is a law that is told as far, or {_remedy(machine.spindle, hottest).removeprefix('what helps is ')}"
        return f"the bearings leave the range of a law {after}, {hottest} at {temperatures.max():.0f} C: {error}; {helps}"
    inner, outer = regions[most.inner_ring], regions[most.outer_ring]
    return (
        f"the bearings run away {after}: {most.name} has Palmgren's load of friction P1 = {last.loads[most.name]:.0f} N, {_times(grown[most.name], begin.loads[most.name])} at the start"
        f"{_axially(begin.state, last.state, most.name)}, with its inner ring at {inner:.0f} C and its outer one at {outer:.0f} C{_taken_up(last.state, most.name) if inner > outer else ''}; "
        f"the load heats it further ({error}); {_remedy(machine.spindle, most.name)}"
    )


def _ever_faster(course: Mapping[float, Mapping[str, float]], name: str) -> bool:
    """Whether a load of friction grew by more in the last third of the time than in the one before."""
    times = sorted(course)
    early, late, end = np.interp(np.array([1, 2, 3]) / 3 * times[-1], times, [abs(course[t][name]) for t in times])
    return bool(end - late > max(late - early, 0.0))


def _times(grown: float, load: float) -> str:
    return f"{grown:.2g} times its {load:.0f} N" if abs(load) >= 0.5 else "which was none"


def _axially(begin: PairState, last: PairState, name: str) -> str:
    """The axial load of a ball row now and at the start, in words; nothing of rollers, which float."""
    return "" if name in last.rollers else f" (axial load {last.bearing(name).preload:.0f} N, at the start {begin.bearing(name).preload:.0f} N)"


def _taken_up(state: PairState, name: str) -> str:
    """What an inner ring warmer than the outer one does to radial clearance: none is left where
    groove centres lie as far apart in r as balls without load have them."""
    row = None if name in state.rollers else state.bearing(name).row
    used_up = state.rollers[name].clearance <= 0.0 if row is None else row.radial >= row.unloaded_distance
    return f", a difference that {'has used up its' if used_up else 'takes up'} radial clearance"


def _remedy(spindle: Spindle, name: str | None = None) -> str:
    """What keeps the bearing `name`, or all of them, from running away; springs only where a preload has none."""
    rigid = any(s.spring is None for s in spindle.sets if name is None or name in s.bearings)
    helps = "a preload of springs, or less of it, which gives way to hot rings" if rigid else "less preload or more radial clearance"
    return f"what helps is more cooling (thermal.convection), less friction (thermal.friction), or {helps}"


@dataclass(frozen=True, eq=False)
class _Machine:
    """A spindle at a speed, asked for its operating point at nodal temperatures of one heat model."""

    spindle: Spindle
    speed: float
    effects: tuple[tuple[Effect, Values], ...]
    read: Reading

    def point(self, nodal: Array) -> OperatingPoint:
        capacity = self.read.model.lumped_capacity
        condition = Condition(float(capacity @ nodal / capacity.sum()), self.speed)
        return operating_point(self.spindle, condition, self.effects, lambda drawn: self.read.motions(drawn, nodal))

    def moment(self, nodal: Array) -> Moment:
        model, point = self.read.model, self.point(nodal)
        names = [b.name for b in model.spindle.ringed]
        made = heat.friction_heat(model, nodal, heat.Running(0.0, self.speed, friction.loads(self.spindle, point.state)))
        return Moment(
            self.read.region_means(nodal),
            dict(zip(names, (model.bearing @ nodal).tolist(), strict=True)),
            dict(zip(names, made.tolist(), strict=True)),
            point,
        )


def _followed(first: tuple[Mode, ...], moments: list[Moment]) -> Array:
    """Frequencies (moments, modes) of the modes `first`, each followed by its shape from moment to moment."""
    frequency = np.full((len(moments), len(first)), np.nan)
    last: dict[int, Mode] = dict(enumerate(first))
    for row, moment in zip(frequency, moments, strict=True):
        chain = moment.point.chain
        found = modes(chain)
        partners = follow(matrices(chain).mass, list(last.values()), found)
        last = {k: found[p] for k, p in zip(last, partners, strict=True) if p >= 0}
        for k, mode in last.items():
            row[k] = mode.frequency
    return frequency


def energy(warmup: Warmup) -> dict[str, float]:
    """Heat (J) of the whole warm-up: motor and friction in, convection out, and what the metal has stored, read from its temperature."""
    model, nodal = warmup.history.model, warmup.history.nodal
    sums = {name: float(sum(getattr(h, name) for h in warmup.history.heat)) for name in ("motor", "friction", "convection")}
    return sums | {"stored": float(model.lumped_capacity @ (nodal[-1] - nodal[0]))}


def most_friction(warmup: Warmup) -> float:
    """The largest friction heat (W) of all bearings together, at any time or in the end."""
    return max(sum(m.friction.values()) for m in warmup.every)


def roller_names(warmup: Warmup) -> list[str]:
    """Roller bearings with rings in the section, which warm up and make heat."""
    return [b.name for b in warmup.spindle.ringed if isinstance(b, RollerBearing)]


def rollers(warmup: Warmup, name: str) -> dict[str, list[float]]:
    """Series of a roller bearing, which has clearance where ball rows have preload and angle."""
    return {
        "temperature_C": [m.bearing_temperatures[name] for m in warmup.moments],
        "clearance_um": [1e6 * clearance(m, name) for m in warmup.moments],
        "radial_stiffness_N_per_m": [m.point.state.any_bearing(name).radial_stiffness for m in warmup.moments],
        "friction_W": [m.friction[name] for m in warmup.moments],
    }


def clearance(moment: Moment, name: str) -> float:
    """Diametral clearance (m) of a roller bearing at a moment, negative where its rollers are pressed."""
    return moment.point.state.rollers[name].clearance


def loose_rollers(moment: Moment) -> list[str]:
    """Roller bearings whose rollers nothing presses: they carry nothing."""
    return [name for name, state in moment.point.state.rollers.items() if state.load == 0.0]
