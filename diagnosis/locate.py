"""Where the model fails, without any catalogue: which element would have to change, by how much, at which condition."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2 as chi_squared

from diagnosis.data import Data
from diagnosis.fit import linearise
from diagnosis.theory import Theory
from model.ball_row import Array
from model.machine import Condition, Spindle
from model.pair import PairState
from model.tolerance import Toleranced, toleranced
from sim.effect import Effect, Parameter, Values

FREE = 0.3  # prior standard deviation of a relative change that may be anything
SOLID = 0.03  # the same of a mass or inertia: what a part weighs does not go with temperature or speed
SMALL = 1e-3  # relative change for derivatives


@dataclass(frozen=True)
class Change:
    """What one element would have to do: relative `change` (with `sd`) at every condition, and how much of the misfit that removes.

    `pattern` says in a word what it goes with: constant, temperature (linear, curved or step), speed.
    """

    element: str
    conditions: tuple[tuple[float, float], ...]  # (temperature C, speed rad/s)
    change: tuple[float, ...]
    sd: tuple[float, ...]
    removes: float  # share of the chi2 left over
    pattern: str

    def words(self) -> str:
        rows = [
            f"{100 * c:+.1f} % at {t:g} C" + (f", {s * 30 / np.pi:.0f} rpm" if s else "")
            for (t, s), c in zip(self.conditions, self.change, strict=True)
        ]
        return f"{self.element} would have to change by {', '.join(rows)}; that removes {100 * self.removes:.0f} % of the misfit"


def elements(spindle: Spindle) -> list[Effect]:
    """Every element of the model as something that may change by a relative amount: bearings by direction, and all toleranced parts."""
    found = [_part(p) for p in toleranced(spindle) if p.name not in ("preload", "bearing damping")]
    for b in spindle.bearings:
        for direction, moves in (("radial", (0, 1)), ("axial", (2,))):
            found.append(_bearing(b.name, direction, moves))
        found.append(_bearing_damping(b.name))
    return found


def free_form(spindle: Spindle, change: Change) -> list[tuple[Effect, Values]]:
    """The element of a change as an effect that does it at every condition: linear in temperature between those of the nearest speed."""
    element = next(e for e in elements(spindle) if e.name == change.element)
    speeds = sorted({speed for _, speed in change.conditions})

    def size(condition: Condition) -> dict[str, float]:
        speed = min(speeds, key=lambda s: abs(s - abs(condition.speed)))
        known = sorted((t, c) for (t, s), c in zip(change.conditions, change.change, strict=True) if s == speed)
        temperature, changes = zip(*known, strict=True)
        return {"change": float(np.interp(condition.temperature, temperature, changes))}

    def following(hook: Callable[..., Any] | None) -> Callable[..., Any] | None:
        return None if hook is None else lambda s, condition, values, *state: hook(s, condition, size(condition), *state)

    return [(replace(element, spindle=following(element.spindle), pair=following(element.pair)), {"change": 0.0})]


def width(element: str) -> float:
    """Prior standard deviation of the relative change of an element at one condition."""
    return SOLID if element.endswith(("mass", "inertia")) else FREE


def _change(name: str) -> Parameter:
    return Parameter("change", "1", 0.0, 0.1, width(name), (-0.95, 5.0), f"relative change of the {name}", "free form")


def _named(name: str, **hooks) -> Effect:
    return Effect(name, name, "value (1 + change)", (_change(name),), "", (), "any size that keeps the model stable", **hooks)


def _part(parameter: Toleranced) -> Effect:
    def spindle(s: Spindle, condition: Condition, values: Values) -> Spindle:
        return parameter.apply(s, values["change"])

    return _named(parameter.name, spindle=spindle)


def _bearing(name: str, direction: str, moves: tuple[int, ...]) -> Effect:
    def pair(s: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        factor = np.ones(5)
        factor[list(moves)] = np.sqrt(1 + values["change"])
        scale = np.outer(factor, factor)
        changed = tuple(
            replace(b, stiffness=b.stiffness * scale, damping=b.damping * scale) if b.name == name else b for b in state.bearings
        )
        return replace(state, bearings=changed)

    return _named(f"{name} bearing {direction} stiffness", pair=pair)


def _bearing_damping(name: str) -> Effect:
    def pair(s: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        changed = tuple(replace(b, damping=b.damping * (1 + values["change"])) if b.name == name else b for b in state.bearings)
        return replace(state, bearings=changed)

    return _named(f"{name} bearing damping", pair=pair)


def locate(theory: Theory, most: int = 5) -> list[Change]:
    """Elements that would remove most of the misfit of the nominal spindle, each free to change at every condition; the best first.

    To first order about the nominal spindle, with all tolerances refitted at the same time. Where the misfit is far beyond the errors,
    the errors are enlarged until tolerances at their believed size leave a chi2 of one a number: otherwise tolerances would be
    dragged far off to fit what they cannot. Shapes are left out: where modes have crossed, they jump.
    """
    data = poles_only(theory.data)
    theory = replace(theory, data=data)
    nothing = np.zeros(len(theory.sd))
    here = theory.features(nothing)
    tolerances = data.whiten @ (linearise(theory) * theory.sd)
    residual = data.whiten @ (data.value - here)
    temper = enlarged(tolerances, residual)
    factor = np.linalg.cholesky(np.eye(len(residual)) + tolerances @ tolerances.T / temper**2) * temper
    rest = np.linalg.solve(factor, residual)
    where = [(o.condition.temperature, o.condition.speed) for o in data.observations]
    conditions = tuple(sorted(set(where)))
    rows = [np.array([where[f.test] == c for f in data.features]) for c in conditions]
    total = float(rest @ rest)
    changes = []
    for element in elements(theory.spindle):
        slope = (theory.features(nothing, [(element, {"change": SMALL})]) - here) / SMALL
        columns = np.linalg.solve(factor, data.whiten @ np.array([np.where(row, slope, 0.0) for row in rows]).T)
        normal = columns.T @ columns + np.eye(len(conditions)) / width(element.name) ** 2
        change = np.linalg.solve(normal, columns.T @ rest)
        left = rest - columns @ change
        sd = np.sqrt(np.diag(np.linalg.inv(normal)))
        removes = 1 - (float(left @ left) + float(change @ change) / width(element.name) ** 2) / total
        changes.append(
            Change(
                element.name, conditions, tuple(map(float, change)), tuple(map(float, sd)), float(removes), _pattern(conditions, change, sd)
            )
        )
    return sorted(changes, key=lambda c: -c.removes)[:most]


def poles_only(data: Data) -> Data:
    """The frequencies and damping ratios of the data, without shapes."""
    kept = [i for i, f in enumerate(data.features) if f.what in ("frequency", "damping")]
    return replace(
        data,
        features=tuple(data.features[i] for i in kept),
        value=data.value[kept],
        whiten=data.whiten[np.ix_(kept, kept)],
        sd=data.sd[kept],
    )


def enlarged(tolerances: Array, white: Array) -> float:
    """Factor on the errors at which the chi2 (n,) left by the tolerances (n, p) is one a number; one where it is less anyway."""
    value, vector = np.linalg.eigh(tolerances @ tolerances.T)
    squares = (vector.T @ white) ** 2

    def excess(log_t: float) -> float:
        return float(np.mean(squares / (np.exp(2 * log_t) + np.maximum(value, 0.0)))) - 1

    return 1.0 if excess(0.0) <= 0 else float(np.exp(brentq(excess, 0.0, 30.0, xtol=1e-3)))


def _pattern(conditions: Sequence[tuple[float, float]], change: Array, sd: Array) -> str:
    """The simplest of constant, linear and curved in temperature, step, and speed that leaves nothing significant."""
    t, s = np.array(conditions).T
    t = (t - t.mean()) / (np.ptp(t) or 1.0)
    s = s / (np.max(np.abs(s)) or 1.0)
    one = np.ones_like(t)
    shapes = {"constant": [one], "temperature (linear)": [one, t], "temperature (curved)": [one, t, t**2]}
    shapes["speed"] = [one, s**2]
    shapes["temperature and speed"] = [one, t, t**2, s**2]
    for name, basis in shapes.items():
        a = np.array(basis).T / sd[:, None]
        free = len(t) - len(basis)
        if free < 1:
            continue
        left = change / sd - a @ np.linalg.lstsq(a, change / sd, rcond=None)[0]
        if chi_squared.sf(float(left @ left), free) > 1e-3:
            return name
    return "temperature (step or irregular)"
