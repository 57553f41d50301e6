"""The operating point: from a spindle and a condition to bearing states and the linearised rotor-base chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from itertools import pairwise

import mujoco
from scipy.optimize import brentq

from model import mjcf
from model.machine import Condition, Spindle
from model.modes import Mode, modes
from model.pair import PairState, solve
from model.rotor_base import Matrices, RotorBase, rotor_base
from model.scene import content_hash
from model.table import StiffnessTable, tabulate
from thermal.expansion import expand


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """One spindle at one condition, with everything that follows from it computed when first asked."""

    spindle: Spindle
    condition: Condition
    state: PairState

    @cached_property
    def chain(self) -> RotorBase:
        return rotor_base(self.spindle, self.state)

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled MuJoCo model with linear bearing elements."""
        return mjcf.spec(self.spindle, self.state).compile()

    @cached_property
    def linear(self) -> Matrices:
        """M, C + G, K by central differences of the MuJoCo model."""
        return mjcf.linearise(self.model)

    @cached_property
    def modes(self) -> list[Mode]:
        """All oscillating modes, in order of frequency."""
        return modes(self.chain, self.linear)


def operating_point(spindle: Spindle, condition: Condition) -> OperatingPoint:
    """Thermal expansion of a uniform soak, axial equilibrium of the bearings, and what hangs on them."""
    return OperatingPoint(spindle, condition, solve(spindle, condition, expand(spindle, condition.temperature)))


def stiffness_table(spindle: Spindle, temperatures: Sequence[float], speeds: Sequence[float] = (0.0,)) -> StiffnessTable:
    """Bearing properties over temperature (C) and speed (rad/s), and the temperature at which a bearing unloads."""
    states = [[operating_point(spindle, Condition(t, speed)).state for speed in sorted(set(speeds))] for t in sorted(set(temperatures))]
    unloads = {b.name: _unloads(spindle, [row[0] for row in states], b.name) for b in spindle.bearings}
    return tabulate(states, unloads, provenance(spindle))


def _unloads(spindle: Spindle, states: Sequence[PairState], bearing: str) -> float | None:
    """Temperature (C) between two neighbouring states at which a bearing loses contact, to a millikelvin."""

    def deformation(temperature: float) -> float:
        condition = Condition(temperature, states[0].condition.speed)
        return operating_point(spindle, condition).state.bearing(bearing).deformation

    for cold, hot in pairwise(states):
        if cold.bearing(bearing).in_contact != hot.bearing(bearing).in_contact:
            return float(brentq(deformation, cold.condition.temperature, hot.condition.temperature, xtol=1e-3))
    return None if states[0].bearing(bearing).in_contact else states[0].condition.temperature


def provenance(spindle: Spindle) -> dict[str, str]:
    """What a result was made from: scene, its hash, versions of this program and of the libraries that compute."""
    libraries = {name: version(name) for name in ("thermospindle", "mujoco", "numpy", "scipy", "scikit-fem")}
    return {"scene": spindle.name, "scene_hash": content_hash(spindle)} | libraries
