"""Derivatives of the features by the nuisance parameters: the matrices by differences, poles and shapes from them exactly.

With H(s) = sum right left / (s - pole), so scaled that left (2 pole M + C) right = 1, a change dA = pole^2 dM + pole dC + dK moves
pole i by -left_i dA right_i and its vector by sum_j right_j (-left_j dA right_i) / (pole_i - pole_j) over all other poles of the state
form: Lancaster (1964), *AIAA J.* 2, 1659; Adhikari (1999), *AIAA J.* 37, 1452. Structural parameters leave the bearings alone,
whose equilibrium is then not solved again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from diagnosis.theory import Applied, Linearised, Predicted, Theory, linearised, pair, predicted
from model.ball_row import Array
from model.machine import Spindle
from model.modes import ComplexArray
from model.rotor_base import Matrices, matrices
from sim.operating import OperatingPoint, drawing

STEP = 0.03  # of a prior standard deviation, for differences of the matrices


def derivative(theory: Theory, x: Array, effects: Applied) -> Array:
    """Derivative (n, p) of all features by the nuisance parameters at nuisance values `x` (p,) beside `effects`."""
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
                moved = [matrices(_restructured(at.point, end, effects).chain) for end in ends]
            else:
                moved = [linearised(end, observation, effects, warmer[t]).matrices for end in ends]
            fill(i, moved, 2 * steps[i])
        h = float(STEP * theory.sd[build + t])
        fill(build + t, [linearised(spindle, observation, effects, warmer[t] + sign * h).matrices for sign in (1, -1)], 2 * h)
    return result


def _restructured(point: OperatingPoint, spindle: Spindle, effects: Applied) -> OperatingPoint:
    """The same bearings in another structure."""
    return replace(point, spindle=drawing(spindle, point.condition, effects))


def _filler(theory: Theory, t: int, at: Linearised, result: Array) -> Callable[[int, list[Matrices], float], None]:
    """A function that writes the rows of test `t` into a column of `result`, from the matrices at two ends `apart`."""
    seen: Predicted = predicted(at)
    partner, own = pair(theory.data.observations[t], seen), theory.data.rows[t]
    every, right, left = at.poles.value, at.poles.right, at.poles.left
    pole, shape = every[at.found], right[:, at.found]
    chain = at.point.measurement
    gap = pole[None, :] - every[:, None]
    gap[at.found, range(len(at.found))] = np.inf  # a vector's own part is a matter of scale
    rows, bare = chain.response_rows @ right, (chain.response_rows @ shape).T
    turn = -1j * chain.delay

    def fill(column: int, ends: list[Matrices], apart: float) -> None:
        mass, damping, stiffness = (
            (getattr(ends[0], key) - getattr(ends[1], key)) / apart for key in ("mass", "damping", "stiffness")
        )
        coupling: ComplexArray = np.asarray(-left @ ((mass @ shape) * pole**2 + (damping @ shape) * pole + stiffness @ shape), complex)
        moved = coupling[at.found, range(len(at.found))]
        size = np.real(seen.pole.conj() * moved) / np.abs(seen.pole) ** 2
        ratio = moved.real / seen.pole.real - size
        by_shape = (rows @ (coupling / gap)).T / _away_from_zero(bare) + turn * (size * np.abs(seen.pole))[:, None]
        result[own.frequency, column] = size[partner[own.mode_of_frequency]]
        result[own.damping, column] = ratio[partner[own.mode_of_damping]]
        if len(own.amplitude):
            mode = partner[own.mode_of_shape]
            difference = by_shape[mode, own.channel] - by_shape[mode, own.against]
            result[own.amplitude, column], result[own.phase, column] = difference.real, difference.imag

    return fill


def _away_from_zero(shape: ComplexArray) -> ComplexArray:
    least = 1e-6 * np.abs(shape).max(axis=1, keepdims=True)
    return np.where(np.abs(shape) < least, least, shape)
