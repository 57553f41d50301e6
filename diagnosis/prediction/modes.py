"""The modes that a model has at the condition of a test, as its measuring points show them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.data.observe import Observation
from thermospindle.diagnosis.forward.linear import Linear, shown
from thermospindle.diagnosis.forward.model import Applied
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import kinds
from thermospindle.model.rotor.poles import oscillating, stiffest_of, with_mass_between
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.pairing import ModeSet
from thermospindle.sim.operating import mass_between, operating_point

BEYOND = 1.5  # of the hammer's band, up to which modes are computed


@dataclass(frozen=True, eq=False)
class Predicted:
    """Modes of one condition: pole (k,) rad/s, shape (k, n_resp) and participation (k, n_ref) as the measuring points see them, kinds.

    The residue of the receptance is shape times participation.
    """

    pole: ComplexArray
    shape: ComplexArray
    participation: ComplexArray
    kind: tuple[str, ...]

    @property
    def frequency(self) -> Array:
        """Undamped frequencies (k,), Hz."""
        return np.abs(self.pole) / (2 * np.pi)

    @property
    def damping(self) -> Array:
        """Damping ratios (k,)."""
        return np.asarray(-self.pole.real / np.abs(self.pole), float)

    def modes(self, channels: int | None = None) -> ModeSet:
        """For pairing, with shapes at the first `channels` points."""
        shape = self.shape[:, :channels]
        largest = [np.abs(x).max(axis=1, initial=0.0) for x in (shape, self.participation)]
        return ModeSet(self.frequency, shape, self.kind, 2 * np.pi * self.frequency * largest[0] * largest[1])


def predict(spindle: Spindle, observation: Observation, effects: Applied, warmer: float = 0.0, lumped: bool = False) -> Predicted:
    """Modes at the condition of an observation, `warmer` kelvin above what its thermometer said;
    `lumped` with the masses of shafts at nodes, as MuJoCo steps them."""
    condition = replace(observation.condition, temperature=observation.condition.temperature + warmer)
    point = operating_point(spindle, condition, effects)
    linear = Linear(matrices(point.chain), point.measurement, point.chain.layout, None if lumped else mass_between(point, spindle))
    return predicted(linear, BEYOND * spindle.hammer.band[1])


def predicted(linear: Linear, highest: float) -> Predicted:
    """Modes of a linear model up to `highest` (Hz) as its measuring chain shows them."""
    own, chain = with_mass_between(linear.matrices, linear.between), linear.chain
    found = oscillating(own, highest, stiffest_of(linear.matrices))
    pole, right = own.value[found] - chain.decay, own.right[:, found]
    participation = own.left[found] @ chain.reference_rows.T * (1 + chain.decay / pole[:, None])
    return Predicted(pole, shown(chain, pole, right), participation, kinds(linear.matrices, right))
