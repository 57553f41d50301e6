"""Temperature of the running spindle: steady, in time, and where the heat goes.

Bearing friction depends on the lubricant's temperature, so it is found together with the temperature: the heat equation is
linear but for one heat flow a bearing, which leaves one scalar equation a bearing. Where what drives the heat follows the
temperature in turn (bearing loads), `march` and `settled` repeat this until both agree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import SuperLU, eigsh, splu

from thermospindle.model.bearing.row import relative_speed
from thermospindle.model.errors import NoEquilibrium, OutsideRange
from thermospindle.model.machine import Spindle
from thermospindle.thermal import friction
from thermospindle.thermal.conduction import HeatModel
from thermospindle.thermal.temperature import TemperatureField

GAMMA = 2 - np.sqrt(2)
"""First stage of TR-BDF2 that gives both stages one matrix (Bank et al., IEEE Trans. CAD 4 (1985)): L-stable, second order."""

WEIGHTS = np.array([1 / (2 * (2 - GAMMA)), 1 / (2 * (2 - GAMMA)), (1 - GAMMA) / (2 - GAMMA)])
"""With which the flows at the start, the stage and the end of a step add up to the heat of the step."""

ERROR_WEIGHTS = WEIGHTS - np.array([(1 - WEIGHTS[0]) / 3, (3 * WEIGHTS[0] + 1) / 3, GAMMA / 6])
"""With which the same flows estimate the error of a step, by the embedded third-order formula: Hosea, Shampine, *Appl. Numer. Math.*
20 (1996) 21-37."""

RUNAWAY = 1000.0  # C, past any bearing's end; a search that gets there has none
ROUNDS = 200  # of loads and temperature after each other
GROWN = 1.5  # times a load, by its own heat, from which a search that leaves a law's range is told as one that runs away
STEP = 1e-3  # of the loads, to see what comes back of it
ALIKE = 1e-8  # relative change of the bearing loads at which they and the temperature agree
Drive = Callable[[float, np.ndarray], "Running"]
"""What drives the temperature at a time (s) and nodal temperatures (C)."""


class NotSettled(NoEquilibrium):
    """Bearing loads and the temperature that follows from them find no common value."""


class RanAway(OutsideRange):
    """A law is left on the way of loads and temperature that drive each other up."""


@dataclass(frozen=True)
class Running:
    """What drives the temperature: chamber air (C), speed (rad/s), the load of every bearing (N, by name) that `friction.loads` tells."""

    air: float
    speed: float
    loads: Mapping[str, float]


@dataclass(frozen=True)
class HeatFlows:
    """Heat flows (W), or heat (J) of a time: `motor` and `friction` come in, `convection` goes out, `crossing` passes from the
    rotating to the stationary part through bearings and gaps."""

    motor: float
    friction: float
    convection: float
    crossing: float

    @property
    def stored(self) -> float:
        return self.motor + self.friction - self.convection


@dataclass(frozen=True, eq=False)
class Step:
    """One time step: temperature (nodes,) at its end, heat (J) as the scheme adds it, estimated error (K, the largest)."""

    end: np.ndarray
    heat: HeatFlows
    error: float


@dataclass(frozen=True, eq=False)
class History:
    """Temperatures (times, nodes) of a model at `times` (s), and the heat (J) of every step, added as the time scheme does."""

    model: HeatModel
    times: np.ndarray
    nodal: np.ndarray
    heat: tuple[HeatFlows, ...]

    def field(self, k: int) -> TemperatureField:
        return self.model.field(self.nodal[k])

    @property
    def bearings(self) -> np.ndarray:
        """Temperature (times, bearings) of every bearing, the mean of its raceways."""
        return self.nodal @ self.model.bearing.T


def running(spindle: Spindle, air: float, speed: float, loads: Mapping[str, float] | None = None) -> Running:
    """Running conditions; bearings carry the loads of the reference state unless `loads` says else."""
    return Running(air, speed, friction.loads(spindle) if loads is None else dict(loads))


def steady(model: HeatModel, drive: Running) -> TemperatureField:
    """The steady temperature. ValueError without convection; OutsideRange where the viscosity law does not reach."""
    return settled(model, lambda _: drive, drive.air)


def settled(model: HeatModel, drive: Callable[[np.ndarray], Running], start: float) -> TemperatureField:
    """The steady temperature under loads that follow it, sought from a uniform `start` (C): raises
    as `steady`, and NotSettled where the two do not meet."""
    if not model.cooled.any():
        raise ValueError("a spindle without convection has no steady temperature")
    nothing = np.zeros(model.film.size)
    return model.field(_agreed(model, 0.0, nothing, nothing + start, drive)[0])


def transient(
    model: HeatModel,
    drive: Running | Callable[[float], Running],
    start: float | TemperatureField,
    times: Sequence[float],
) -> History:
    """Temperatures at `times` (s, rising), from `start` at the first of them, by one TR-BDF2 step between neighbours.

    `drive` may depend on time. Each distinct step is factorised once. OutsideRange where the viscosity law does not reach.
    """
    moments = np.asarray(times, dtype=float)
    steps = np.diff(moments)
    if moments.ndim != 1 or np.any(steps <= 0):
        raise ValueError("times must rise")
    nodal, heat = [model.nodal(start)], []
    for begin, length in zip(moments[:-1], steps, strict=True):
        done = step(model, (lambda t, _: drive(t)) if callable(drive) else (lambda *_: drive), begin, length, nodal[-1])
        nodal.append(done.end)
        heat.append(done.heat)
    return History(model, moments, np.array(nodal), tuple(heat))


def march(
    model: HeatModel, drive: Drive, start: float | TemperatureField, end: float, tolerance: float, longest: float = np.inf,
    told: Callable[[float], None] = lambda share: None,
) -> History:
    """Temperatures from time 0 to `end` (s) by TR-BDF2 steps, each with an estimated error of at most `tolerance` (K).

    Steps double or halve, so few matrices are factorised, and are at most `longest` (s); `told` hears after each what share of the time
    has passed. Raises NotSettled where temperature and drive find no agreement, OutsideRange where the viscosity law does not reach.
    """
    times, nodal, heat = [0.0], [model.nodal(start)], []
    length = end / 2**14
    while times[-1] < end * (1 - 1e-9):
        length = min(length, end - times[-1])
        done = step(model, drive, times[-1], length, nodal[-1])
        if done.error > tolerance and length > end * 1e-9:
            length /= 2
            continue
        times.append(times[-1] + length)
        nodal.append(done.end)
        heat.append(done.heat)
        told(times[-1] / end)
        if done.error < tolerance / 10 and 2 * length <= longest:  # twice the step makes eight times the error
            length *= 2
    return History(model, np.array(times), np.array(nodal), tuple(heat))


def step(model: HeatModel, drive: Drive, begin: float, length: float, last: np.ndarray) -> Step:
    """One TR-BDF2 step from temperatures `last` (nodes,) at time `begin`."""
    h = float(f"{GAMMA / 2 * length:.12e}")  # equal steps share their factors in spite of rounding
    old = drive(begin, last)
    rates = [_rate(model, last, old)]
    known = model.capacity @ last + h * rates[0]
    stage, mid = _agreed(model, h, known, last, lambda x: drive(begin + GAMMA * length, x))
    known = model.capacity @ (stage - (1 - GAMMA) ** 2 * last) / (GAMMA * (2 - GAMMA))
    end, new = _agreed(model, h, known, stage, lambda x: drive(begin + length, x))
    rates += [_rate(model, stage, mid), _rate(model, end, new)]
    error = _factors(model, h)[0].solve(length * ERROR_WEIGHTS @ np.array(rates))  # filtered: stiff parts do not count
    parts = [_values(flows(model, x, d)) for x, d in ((last, old), (stage, mid), (end, new))]
    return Step(end, HeatFlows(*(float(x) for x in length * WEIGHTS @ parts)), float(np.abs(error).max()))


def slowest(model: HeatModel, temperature: TemperatureField, drive: Running) -> float:
    """Time constant (s) of the slowest decay about a steady temperature: 1 / the smallest eigenvalue of (K - dH/dT) against C.

    Friction H falls as the lubricant warms, at the loads of `drive`. Inverse iteration on the sparse factors of K.
    """
    nodal, change = model.nodal(temperature), 0.01
    slope = [friction_heat(model, nodal + sign * change, drive) for sign in (0.5, -0.5)]
    fall = (slope[0] - slope[1]) / change
    feedback = sum(
        (-f * csr_array(csr_array(b[:, None]) @ csr_array(b[None, :])) for f, b in zip(fall, model.bearing, strict=True)),
        csr_array(model.conductance.shape),
    )
    value = eigsh(
        csc_array(model.conductance + feedback), k=1, M=csc_array(model.capacity), sigma=0.0, v0=model.cooled, return_eigenvectors=False
    )
    return float(1 / value[0])


def _rate(model: HeatModel, nodal: np.ndarray, drive: Running) -> np.ndarray:
    """C dT/dt (nodes,) in W."""
    return _outer_load(model, drive) + friction_heat(model, nodal, drive) @ model.bearing - model.conductance @ nodal


def _agreed(
    model: HeatModel, h: float, known: np.ndarray, guess: np.ndarray, drive: Callable[[np.ndarray], Running]
) -> tuple[np.ndarray, Running]:
    """The solution (C + h K) T = known + h heat (K T = known + heat for h = 0) and the drive that belongs to it: of `drive`, the loads
    may follow the temperature, and are repeated until they stay; air and speed may not."""
    factors, response = _factors(model, h)
    last = drive(guess)
    cold = factors.solve(known + (h or 1.0) * _outer_load(model, last))  # without friction
    if not last.speed or not model.spindle.ringed:
        return cold, last
    names, before, back, cool = list(last.loads), np.zeros(len(last.loads)), 0.0, last.loads
    for _ in range(ROUNDS):
        try:
            nodal = cold + _bearing_heat(model, model.bearing @ cold, response @ model.bearing.T, last) @ response
            if np.abs(nodal).max() > RUNAWAY:
                back = 1.0
                break
            now = drive(nodal)
        except OutsideRange as error:
            grown = {b: last.loads[b] / load for b, load in cool.items() if load and last.loads[b] > GROWN * load}
            if back > 0.5:
                near = f"it runs away, or nearly: of a load that is added {back:.0%} come back through its heat, and at 100% there is no steady state; on the way "
            elif grown:
                most = max(grown, key=lambda b: grown[b])
                near = f"it runs away, or nearly: its own heat makes the load P1 of the friction of {most} {grown[most]:.2g} times as large; on the way "
            else:
                raise
            raise RanAway(f"{near}{error}") from None
        asked, found = (np.array([d.loads[b] for b in names]) for d in (last, now))
        change = (found - asked) / (np.abs(asked) + 1e-3)
        if np.abs(change).max() <= ALIKE:
            return nodal, last
        if before.any():
            back = float(change @ before / (before @ before))
        last, before = (_ahead(now, found - asked, back), np.zeros(len(names))) if before.any() else (now, change)
    told = "each load heats the bearing to a larger one" if back >= 1 else f"their search ends after {ROUNDS} rounds"
    raise NotSettled(f"bearing loads and temperature do not settle: {told}")


def _ahead(now: Running, change: np.ndarray, back: float) -> Running:
    """Where loads that have changed by `change`, and by `back` times the change before, are bound for (Aitken): the sum of the geometric
    series. As they stand where they grow without end, and where the sum would turn a load round."""
    further = min(back, 0.95) / (1 - min(back, 0.95)) * change
    bound = {b: load + float(c) for (b, load), c in zip(now.loads.items(), further, strict=True)}
    return now if back >= 1 or any(bound[b] * load < 0 for b, load in now.loads.items()) else replace(now, loads=bound)


def feedback(model: HeatModel, temperature: TemperatureField, drive: Callable[[np.ndarray], Running]) -> float:
    """What comes back of bearing loads that are added to those of a steady temperature, through the heat that they make: at 1 it runs away.

    The largest eigenvalue of the map from loads to the loads at their steady temperature, by power iteration from loads all raised alike.
    """
    nodal = model.nodal(temperature)
    rest = drive(nodal)
    if not rest.speed or not model.spindle.ringed:
        return 0.0
    factors, response = _factors(model, 0.0)
    cold = factors.solve(_outer_load(model, rest))
    own, found = np.array(list(rest.loads.values())), 0.0
    added = STEP * np.abs(own)
    for _ in range(4):
        raised = replace(rest, loads=dict(zip(rest.loads, (own + added).tolist(), strict=True)))
        heated = cold + _bearing_heat(model, model.bearing @ cold, response @ model.bearing.T, raised) @ response
        back = np.array(list(drive(heated).loads.values())) - own
        if not back.any():
            return 0.0
        found = float(back @ added / (added @ added))
        added = STEP * np.abs(own).max() / np.abs(back).max() * back
    return found


def flows(model: HeatModel, temperature: np.ndarray | TemperatureField, drive: Running) -> HeatFlows:
    """The energy balance at one temperature: where heat comes from and goes to (W)."""
    nodal = model.nodal(temperature) if isinstance(temperature, TemperatureField) else temperature
    crossing = model.exchange @ nodal
    return HeatFlows(
        motor=float(motor_heat(model, drive).sum()),
        friction=float(friction_heat(model, nodal, drive).sum()),
        convection=float((model.convection @ nodal - model.film * drive.air - model.bath).sum()),
        crossing=float(crossing[model.spans["rotating"]].sum()) if "rotating" in model.spans else 0.0,
    )


def motor_heat(model: HeatModel, drive: Running) -> np.ndarray:
    """Heat (W) of every heat source at the speed of `drive`."""
    sources = model.spindle.thermal.sources
    return np.array([s.power * (abs(drive.speed) / s.speed) ** s.exponent if drive.speed else 0.0 for s in sources])


def friction_heat(model: HeatModel, nodal: np.ndarray, drive: Running) -> np.ndarray:
    """Friction heat (W) of every bearing at nodal temperatures."""
    if not drive.speed:
        return np.zeros(len(model.spindle.ringed))
    bearings = zip(model.spindle.ringed, _relative(model, drive), model.bearing @ nodal, strict=True)
    return np.array([friction.heat(model.spindle.thermal.friction, b, speed, float(t), drive.loads[b.name]) for b, speed, t in bearings])


def _relative(model: HeatModel, drive: Running) -> list[float]:
    """Speeds (rad/s) of the rings of every bearing against each other."""
    return [relative_speed(model.spindle, b, drive.speed) for b in model.spindle.ringed]


def _outer_load(model: HeatModel, drive: Running) -> np.ndarray:
    return model.film * drive.air + model.bath + motor_heat(model, drive) @ model.motor


def _values(flow: HeatFlows) -> tuple[float, float, float, float]:
    return flow.motor, flow.friction, flow.convection, flow.crossing


@lru_cache(maxsize=16)
def _factors(model: HeatModel, h: float) -> tuple[SuperLU, np.ndarray]:
    """Factors of C + h K (of K for h = 0), and its answer (bearings, nodes) to 1 W of friction in each bearing, times h or 1."""
    matrix = model.capacity + h * model.conductance if h else model.conductance
    factors = splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factors, (h or 1.0) * factors.solve(np.ascontiguousarray(model.bearing.T)).T


def _bearing_heat(model: HeatModel, cold: np.ndarray, gain: np.ndarray, drive: Running) -> np.ndarray:
    """Friction heat H (bearings,) with t = cold + gain H(t), t the bearing temperatures."""
    return friction.balanced(model.spindle.thermal.friction, model.spindle.ringed, _relative(model, drive), drive.loads, cold, gain)
