"""The measuring chain of a test: sensors off their places and directions, channels that are late,
hammers that miss their points, gains of both."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from thermospindle.diagnosis.forward.points import Applied
from thermospindle.diagnosis.parameters.numbers import Numbers
from thermospindle.model.changed import changed
from thermospindle.model.drawing.measuring import Point
from thermospindle.model.rotor.chain import Layout, row_of
from thermospindle.model.types import Array, Integers
from thermospindle.sim.effects.effect import Measurement
from thermospindle.sim.effects.measuring.hammer_position import off
from thermospindle.sim.operating import OperatingPoint

STEP = 1e-4  # m
WAYS = 0.0, np.pi / 2  # on a face


def measured(numbers: Numbers, t: int, point: OperatingPoint, x: Array) -> Measurement:
    """The measuring chain of a point in test `t` at nuisance values x (P,), without the gains of channels."""
    return _struck(numbers, t, point, _late(numbers, t, _heard(numbers, t, point, x), x), x)


def channel_gain(numbers: Numbers, t: int, x: Array) -> Array:
    """Gain (n_resp,) of the channel of each row of test `t`."""
    return _gain(numbers, x, *numbers.gains[t], numbers.channel_of[t])


def hammer_gain(numbers: Numbers, t: int, x: Array) -> Array:
    """Gain (n_ref,) of the hammer of each column of test `t`."""
    return _gain(numbers, x, *numbers.hammers[t], numbers.hammer_of[t])


def _gain(numbers: Numbers, x: Array, number: Integers, index: Integers, of: Integers) -> Array:
    """Gains of rows (or columns) that are `of` these channels (or hammers), which the parameters by
    `number` are the ln of, one or more for each `index`."""
    ln = x[number] * numbers.sd[number]
    return np.asarray(np.exp((of[:, None] == index) @ ln))


def _heard(numbers: Numbers, t: int, point: OperatingPoint, x: Array) -> Measurement:
    (number, which), of, chain = numbers.sensors, numbers.channel_of[t], point.measurement
    if not (len(of) and x[number].any()):
        return chain
    each = np.bincount(which, x[number] * numbers.sd[number]).reshape(-1, 4)[of]  # of every sensor, each way
    rows = chain.response_rows.copy()
    rows[: len(of)] += np.einsum("rw,wrn->rn", each, askew(point)[:, : len(of)])
    return changed(chain, response_rows=rows)


def _late(numbers: Numbers, t: int, chain: Measurement, x: Array) -> Measurement:
    (number, which), of = numbers.delays, numbers.channel_of[t]
    if not (len(of) and x[number].any()):
        return chain
    delay = chain.delay.copy()
    delay[: len(of)] += np.bincount(which, x[number] * numbers.sd[number])[of]
    return changed(chain, delay=delay)


def _struck(numbers: Numbers, t: int, point: OperatingPoint, chain: Measurement, x: Array) -> Measurement:
    (number, which), of = numbers.misses[t], numbers.hammer_of[t]
    gain = hammer_gain(numbers, t, x)
    if not (len(gain) and (x[number].any() or (gain != 1.0).any())):
        return chain
    missed = np.bincount(which, x[number] * numbers.sd[number], 2 * (of.max() + 1)).reshape(-1, 2)  # of every hammer, either way
    one, other = aside(point)
    rows = chain.reference_rows + missed[of, :1] * one + missed[of, 1:] * other
    return changed(chain, reference_rows=gain[:, None] * rows)


def replace_measuring(point: OperatingPoint, effects: Applied) -> OperatingPoint:
    """The same point under another list of effects that differs in the measuring chain alone; its chain and matrices are kept."""
    if tuple(effects) == point.effects:
        return point
    other = changed(point, effects=tuple(effects))
    other.__dict__["chain"] = point.chain
    if "_bare" in point.__dict__:
        other.__dict__["_bare"] = point.__dict__["_bare"]
    return other


def aside(point: OperatingPoint) -> Array:
    """How the rows of its hammers change a metre beside their points, the two ways on the face that is struck (2, n_ref, n)."""
    return _aside(point.chain.layout, tuple(point.spindle.point(node) for node in point.spindle.hammer.hammer_nodes))


def askew(point: OperatingPoint) -> Array:
    """How the rows of its points change a metre beside their places, the two ways on the face they
    lie on, and a radian out of their directions towards these (4, points, n)."""
    return _askew(point.chain.layout, point.spindle.points)


@lru_cache(maxsize=256)
def _aside(layout: Layout, aimed: tuple[Point, ...]) -> Array:
    found = np.array([[row_of(layout, off(p, STEP, way)) - row_of(layout, p) for p in aimed] for way in WAYS]) / STEP
    found.flags.writeable = False
    return found


@lru_cache(maxsize=256)
def _askew(layout: Layout, sensors: tuple[Point, ...]) -> Array:
    turned = np.array([[row_of(layout, changed(p, direction=_towards(p, way))) for p in sensors] for way in WAYS])
    found = np.concatenate([_aside(layout, sensors), turned])
    found.flags.writeable = False
    return found


def _towards(p: Point, way: float) -> tuple[float, float, float]:
    """The unit vector of a `way` on the face that a point lies on."""
    x, y, z = np.subtract(off(p, 1.0, way).position, p.position)
    return float(x), float(y), float(z)
