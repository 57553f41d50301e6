"""Derivatives of the features by the nuisance parameters: the matrices by differences, poles and shapes from them exactly.

With H(s) = sum right left / (s - pole), so scaled that left (2 pole M + C) right = 1, a change dA = pole^2 dM + pole dC + dK moves
pole i by -left_i dA right_i, its right vector by sum_j right_j (-left_j dA(pole_i) right_i) / (pole_i - pole_j) and its left one by
sum_j left_j (-left_i dA(pole_j) right_j) / (pole_i - pole_j) - left_i dM M^-1, sums over all other poles of the state form, which keep
that scale: Lancaster (1964), *AIAA J.* 2, 1659; Adhikari (1999), *AIAA J.* 37, 1452. Structural parameters leave the bearings alone,
whose equilibrium is then not solved again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from thermospindle.diagnosis.prediction.theory import Applied, Linearised, Predicted, Theory, linearised, pair, predicted
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.operating import OperatingPoint, drawing, operating_point

STEP = 0.03  # of a prior standard deviation, for differences of the matrices


def derivative(theory: Theory, x: Array, effects: Applied) -> Array:
    """Derivative (n, p) of all features by the nuisance parameters at nuisance values `x` (p,) beside `effects`."""
    effects = [*theory.present, *effects]
    n, build = len(theory.data.features), len(theory.build)
    spindle, warmer = theory.built(x), theory.warmer(x)
    steps = STEP * theory.sd[:build]
    built = [[p.apply(spindle, float(sign * h / (1 + v))) for sign in (1, -1)] for p, h, v in zip(theory.build, steps, x, strict=False)]
    result = np.zeros((n, len(theory.sd)))
    result[:, len(theory.sd) - theory.channels :] = theory.by_gain
    for t, observation in enumerate(theory.data.observations):
        at = linearised(spindle, observation, effects, warmer[t])
        fill = _filler(theory, t, at, result)
        for i, ends in enumerate(built):
            if all(end.bearings is spindle.bearings and end.pair is spindle.pair for end in ends):
                moved = [_restructured(at.point, end, effects) for end in ends]
            else:
                moved = [operating_point(end, at.point.condition, effects) for end in ends]
            fill(i, moved, 2 * steps[i])
        h = float(STEP * theory.sd[build + t])
        conditions = [replace(at.point.condition, temperature=at.point.condition.temperature + sign * h) for sign in (1, -1)]
        fill(build + t, [operating_point(spindle, condition, effects) for condition in conditions], 2 * h)
    return result


def _restructured(point: OperatingPoint, spindle: Spindle, effects: Applied) -> OperatingPoint:
    """The same bearings in another structure."""
    return replace(point, spindle=drawing(spindle, point.condition, effects))


def _filler(theory: Theory, t: int, at: Linearised, result: Array) -> Callable[[int, list[OperatingPoint], float], None]:
    """A function that writes the rows of test `t` into a column of `result`, from the points at two ends `apart`."""
    seen: Predicted = predicted(at)
    partner, own = pair(theory.data.observations[t], seen), theory.data.rows[t]
    lost = theory.data.of_modes(t, np.flatnonzero(partner < 0))
    every, right, left = at.poles.value, at.poles.right, at.poles.left
    found, chain = at.found, at.point.measurement
    inverse = np.linalg.inv(at.matrices.mass)
    gap = every[None, :] - every[:, None]  # [j, i] is pole i less pole j
    gap[gap == 0] = np.inf  # a vector's own part is a matter of scale, and so is that of another of exactly the same pole
    seen_right, seen_left = chain.response_rows @ right, left @ chain.reference_rows.T
    bare, part = _away_from_zero(seen_right[:, found].T), _away_from_zero(seen_left[found])
    late = -1j * chain.delay

    def fill(column: int, ends: list[OperatingPoint], apart: float) -> None:
        first, last = (matrices(end.chain) for end in ends)
        mass, damping, stiffness = ((getattr(first, key) - getattr(last, key)) / apart for key in ("mass", "damping", "stiffness"))
        coupling: ComplexArray = np.asarray(-left @ ((mass @ right) * every**2 + (damping @ right) * every + stiffness @ right), complex)
        mixed = coupling / gap
        moved = np.diag(coupling)[found]
        size = np.real(seen.pole.conj() * moved) / np.abs(seen.pole) ** 2
        ratio = moved.real / seen.pole.real - size
        by_row, by_hit = _rows_moved(at, ends, apart)
        by_shape = (seen_right @ mixed[:, found] + by_row @ right[:, found]).T / bare + late * (size * np.abs(seen.pole))[:, None]
        result[own.frequency, column] = size[partner[own.mode_of_frequency]]
        result[own.damping, column] = ratio[partner[own.mode_of_damping]]
        if len(own.amplitude):
            mode = partner[own.mode_of_shape]
            difference = by_shape[mode, own.channel] - by_shape[mode, own.against]
            result[own.amplitude, column], result[own.phase, column] = difference.real, difference.imag
        if len(own.size):
            mode = partner[own.mode_of_residue]
            by_part = (-mixed[found] @ seen_left - left[found] @ (mass @ inverse @ chain.reference_rows.T - by_hit.T)) / part
            total = by_shape[mode, own.channel_of_residue] + by_part[mode, own.reference]
            result[own.size, column], result[own.turn, column] = total.real, total.imag
        result[lost, column] = 0.0

    return fill


def _rows_moved(at: Linearised, ends: list[OperatingPoint], apart: float) -> tuple[Array, Array]:
    """Derivatives of response and reference rows, where the centre of mass of a body moves along the axis."""
    chain = at.point.measurement
    if all(end.chain.layout == at.point.chain.layout for end in ends):
        return np.zeros_like(chain.response_rows), np.zeros_like(chain.reference_rows)
    first, last = (end.measurement for end in ends)
    return (first.response_rows - last.response_rows) / apart, (first.reference_rows - last.reference_rows) / apart


def _away_from_zero(shape: ComplexArray) -> ComplexArray:
    least = 1e-6 * np.abs(shape).max(axis=1, keepdims=True)
    return np.where(np.abs(shape) < least, least, shape)
