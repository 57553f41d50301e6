"""Temperature of the running spindle: steady, in time, and where the heat goes.

Bearing friction depends on the lubricant's temperature, so it is found together with the temperature: the heat equation is
linear but for one heat flow a bearing, which leaves one scalar equation a bearing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import csc_array
from scipy.sparse.linalg import SuperLU, splu

from model.machine import Spindle
from thermal import friction
from thermal.conduction import HeatModel
from thermal.temperature import TemperatureField

GAMMA = 2 - np.sqrt(2)
"""First stage of TR-BDF2 that gives both stages one matrix (Bank et al., IEEE Trans. CAD 4 (1985)): L-stable, second order."""

WEIGHTS = np.array([1 / (2 * (2 - GAMMA)), 1 / (2 * (2 - GAMMA)), (1 - GAMMA) / (2 - GAMMA)])
"""With which the flows at the start, the stage and the end of a step add up to the heat of the step."""


@dataclass(frozen=True)
class Running:
    """What drives the temperature: chamber air (C), speed (rad/s), axial load of every bearing (N, by name)."""

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
    """Running conditions; bearings carry the preload of the reference state unless `loads` says else."""
    return Running(air, speed, {b.name: spindle.pair.preload for b in spindle.bearings} if loads is None else dict(loads))


def steady(model: HeatModel, drive: Running) -> TemperatureField:
    """The steady temperature. ValueError without convection; OutsideRange where the viscosity law does not reach."""
    if not model.film.any():
        raise ValueError("a spindle without convection has no steady temperature")
    return model.field(_solve(model, 0.0, _outer_load(model, drive), drive))


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
    at = drive if callable(drive) else lambda _: drive
    nodal, heat = [model.nodal(start)], []
    conductance = model.conductance
    for begin, step in zip(moments[:-1], steps, strict=True):
        last, (old, mid, new) = nodal[-1], (at(begin), at(begin + GAMMA * step), at(begin + step))
        h = float(f"{GAMMA / 2 * step:.12e}")  # equal steps share their factors in spite of rounding
        load = _outer_load(model, old) + friction_heat(model, last, old) @ model.bearing
        known = model.capacity @ last + h * (load - conductance @ last)
        stage = _solve(model, h, known + h * _outer_load(model, mid), mid)
        known = model.capacity @ (stage - (1 - GAMMA) ** 2 * last) / (GAMMA * (2 - GAMMA))
        nodal.append(_solve(model, h, known + h * _outer_load(model, new), new))
        parts = [_values(flows(model, x, d)) for x, d in ((last, old), (stage, mid), (nodal[-1], new))]
        heat.append(HeatFlows(*(float(x) for x in step * WEIGHTS @ parts)))
    return History(model, moments, np.array(nodal), tuple(heat))


def flows(model: HeatModel, temperature: np.ndarray | TemperatureField, drive: Running) -> HeatFlows:
    """The energy balance at one temperature: where heat comes from and goes to (W)."""
    nodal = model.nodal(temperature) if isinstance(temperature, TemperatureField) else temperature
    crossing = model.exchange @ nodal
    return HeatFlows(
        motor=float(motor_heat(model, drive).sum()),
        friction=float(friction_heat(model, nodal, drive).sum()),
        convection=float((model.convection @ nodal - model.film * drive.air).sum()),
        crossing=float(crossing[model.spans["rotating"]].sum()) if "rotating" in model.spans else 0.0,
    )


def motor_heat(model: HeatModel, drive: Running) -> np.ndarray:
    """Heat (W) of every heat source at the speed of `drive`."""
    sources = model.spindle.thermal.sources
    return np.array([s.power * (abs(drive.speed) / s.speed) ** s.exponent if drive.speed else 0.0 for s in sources])


def friction_heat(model: HeatModel, nodal: np.ndarray, drive: Running) -> np.ndarray:
    """Friction heat (W) of every bearing at nodal temperatures."""
    if not drive.speed:
        return np.zeros(len(model.spindle.bearings))
    law, bearings = model.spindle.thermal.friction, zip(model.spindle.bearings, model.bearing @ nodal, strict=True)
    return np.array([friction.heat(law, b, drive.speed, float(t), drive.loads[b.name]) for b, t in bearings])


def _outer_load(model: HeatModel, drive: Running) -> np.ndarray:
    return model.film * drive.air + motor_heat(model, drive) @ model.motor


def _values(flow: HeatFlows) -> tuple[float, float, float, float]:
    return flow.motor, flow.friction, flow.convection, flow.crossing


@lru_cache(maxsize=16)
def _factors(model: HeatModel, h: float) -> tuple[SuperLU, np.ndarray]:
    """Factors of C + h K (of K for h = 0), and its answer (bearings, nodes) to 1 W of friction in each bearing, times h or 1."""
    matrix = model.capacity + h * model.conductance if h else model.conductance
    factors = splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return factors, (h or 1.0) * factors.solve(np.ascontiguousarray(model.bearing.T)).T


def _solve(model: HeatModel, h: float, known: np.ndarray, drive: Running) -> np.ndarray:
    """Solution of (C + h K) T = known + h friction(T), or of K T = known + friction(T) for h = 0."""
    factors, response = _factors(model, h)
    nodal = factors.solve(known)
    if not drive.speed or not model.spindle.bearings:
        return nodal
    heat = _bearing_heat(model, model.bearing @ nodal, response @ model.bearing.T, drive)
    return nodal + heat @ response


def _bearing_heat(model: HeatModel, cold: np.ndarray, gain: np.ndarray, drive: Running) -> np.ndarray:
    """Friction heat H (bearings,) with t = cold + gain H(t), t the bearing temperatures.

    Bearing after bearing, each by bracketing: friction falls with temperature and `gain` is symmetric and positive, so this
    is a descent on a convex function.
    """
    law, bearings = model.spindle.thermal.friction, model.spindle.bearings
    warmest = law.viscosity.temperature[-1] if len(law.viscosity.value) > 1 else np.inf

    def made(k: int, t: float) -> float:
        return friction.heat(law, bearings[k], drive.speed, t, drive.loads[bearings[k].name])

    heat = np.zeros(cold.size)
    for _ in range(200):
        before = heat.copy()
        for k, own in enumerate(np.diag(gain)):
            base = float(cold[k] + gain[k] @ heat - own * heat[k])
            most = base + 1.01 * own * made(k, base)  # friction jumps up by 0.8 % where nu n falls below 2000
            if most > warmest > base and warmest - base >= own * made(k, warmest):
                most = warmest  # the root is inside the viscosity table though the bracket is not
            heat[k] = made(k, brentq(lambda t, k=k, own=own, base=base: t - base - own * made(k, t), base, most, xtol=1e-12))
        if np.abs(gain @ (heat - before)).max() < 1e-10:
            return heat
    raise RuntimeError("bearing friction and temperature did not settle")
