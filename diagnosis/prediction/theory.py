"""What the model predicts of a campaign: the same features as observed, for any tolerances and effects."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from thermospindle.diagnosis.data.features import ALONE, Data
from thermospindle.diagnosis.data.observe import Observation
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.chain import Matrices, matrices
from thermospindle.model.rotor.modes import Poles, kinds, oscillating, poles
from thermospindle.model.tolerance import Toleranced, toleranced
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.effects import of_scene
from thermospindle.sim.effects.effect import HOOKS, Effect, Values
from thermospindle.sim.operating import OperatingPoint, operating_point

FAR = 0.08  # ln frequency that costs as much as a fully different shape in pairing
UNLIKE = 3.0  # cost of a different kind, where only kinds are known
TOLD = 0.3  # 1 - MAC with its partner below which a close mode is told by its shape
STRANGE = 4.0  # cost of a pair from which an observed mode rather has no partner
LATELY = 64  # linear models kept
WITHOUT = 30.0  # standard errors by which the frequency of such a mode is missed, whatever the parameters

Applied = Sequence[tuple[Effect, Values]]


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


@dataclass(frozen=True, eq=False)
class Linearised:
    """The linear model at the condition of a test, its poles, and which of them (k) lie in the band of the test."""

    point: OperatingPoint
    matrices: Matrices
    poles: Poles
    found: list[int]


def linearised(spindle: Spindle, observation: Observation, effects: Applied, warmer: float = 0.0) -> Linearised:
    """The model at the condition of an observation, `warmer` kelvin above what its thermometer said."""
    condition = replace(observation.condition, temperature=observation.condition.temperature + warmer)
    point = operating_point(spindle, condition, effects)
    linear = matrices(point.chain)
    found = poles(linear)
    return Linearised(point, linear, found, oscillating(found, 1.5 * spindle.hammer.band[1]))


def predicted(at: Linearised) -> Predicted:
    """Modes as the measuring chain shows them."""
    chain = at.point.measurement
    pole, right = at.poles.value[at.found] - chain.decay, at.poles.right[:, at.found]
    seen = chain.gain * np.exp(-1j * np.abs(pole[:, None]) * chain.delay)
    participation = at.poles.left[at.found] @ chain.reference_rows.T * (1 + chain.decay / pole[:, None])
    return Predicted(pole, (chain.response_rows @ right).T * seen, participation, kinds(at.matrices, right))


def predict(spindle: Spindle, observation: Observation, effects: Applied, warmer: float = 0.0) -> Predicted:
    return predicted(linearised(spindle, observation, effects, warmer))


def pair(o: Observation, p: Predicted) -> Array:
    """Index into the predicted modes of the partner of every observed one; -1 where none is left or like it.

    The assignment costs unlikeness of shape (of kind, without shapes) and distance in ln frequency over `FAR`, by its size: where some
    modes are far off, squares would rather move all of them by one place. Modes closer than `ALONE` that are not axial turn in their
    plane and keep their order, unless their shapes all tell them apart: those may cross.
    """
    distance = np.abs(np.log(o.frequency[:, None] / p.frequency[None, :])) / FAR
    if o.shape is not None:
        unlike = 1 - np.abs(_unit(o.shape).conj() @ _unit(p.shape).T) ** 2
    else:
        unlike = UNLIKE * (np.array(o.kind)[:, None] != np.array(p.kind)[None, :])
    cost = distance + unlike
    partner = np.full(len(o.frequency), -1)
    rows, columns = linear_sum_assignment(np.hstack([cost, np.full((len(cost), len(cost)), STRANGE)]))
    partner[rows] = np.where(columns < cost.shape[1], columns, -1)
    radial = [i for i, j in enumerate(partner) if j >= 0 and p.kind[j] != "axial"]
    for group in np.split(np.array(radial, int), np.flatnonzero(np.diff(np.log(o.frequency[radial])) > ALONE) + 1):
        if o.shape is not None and np.all(unlike[group, partner[group]] < TOLD):
            continue
        partner[group] = partner[group][np.argsort(p.frequency[partner[group]])]
    return partner


def _unit(shape: ComplexArray) -> ComplexArray:
    return shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-300)


def features_of(data: Data, at: Mapping[int, Predicted]) -> Array:
    """The predicted values (n,) of all features; zero for tests without a prediction."""
    value = np.zeros(len(data.features))
    for t, p in at.items():
        partner = pair(data.observations[t], p)
        own = data.rows[t]
        value[own.frequency] = np.log(p.frequency[partner[own.mode_of_frequency]])  # modes without a partner are put right below
        value[own.damping] = np.log(np.maximum(p.damping[partner[own.mode_of_damping]], 1e-9))
        if len(own.amplitude):
            size = np.abs(p.shape).max(axis=1, keepdims=True) * 1e-6
            shape = np.where(np.abs(p.shape) < size, size, p.shape)[partner[own.mode_of_shape]]
            ratio = _of(shape, own.channel) / _of(shape, own.against)
            value[own.amplitude] = np.log(np.abs(ratio))
            measured = data.value[own.phase]  # the branch of the angle nearest to the measured one
            value[own.phase] = measured + np.angle(ratio * np.exp(-1j * measured))
        if len(own.size):
            mode = partner[own.mode_of_residue]
            residue = _of(p.shape[mode], own.channel_of_residue) * _of(p.participation[mode], own.reference)
            value[own.size] = np.log(np.maximum(np.abs(residue), 1e-300))
            measured = data.value[own.turn]
            value[own.turn] = measured + np.angle(residue * np.exp(-1j * measured))
        lost = data.of_modes(t, np.flatnonzero(partner < 0))
        value[lost] = data.value[lost]
        missed = np.intersect1d(lost, own.frequency)
        value[missed] += WITHOUT * data.sd[missed]
    return value


def _of(shape: ComplexArray, channel: NDArray[np.int_]) -> ComplexArray:
    """The components (m,) of shapes (m, n_resp) at one channel each."""
    return np.asarray(np.take_along_axis(shape, channel[:, None], axis=1)[:, 0])


@dataclass(frozen=True, eq=False)
class Theory:
    """A spindle, the data it is to explain, and its nuisance parameters with their priors (all zero-mean, unit: relative or K)."""

    spindle: Spindle
    data: Data
    names: tuple[str, ...]
    sd: Array

    @cached_property
    def present(self) -> Applied:
        """The effects that the scene has already; those asked about come after them."""
        return tuple(of_scene(self.spindle))

    @property
    def channels(self) -> int:
        return sum(name.startswith("gain") for name in self.names)

    def features(self, x: Array, effects: Applied = (), only: int | None = None) -> Array:
        """Predicted features (n,) for nuisance values x (len(names),) and effects; zero for other tests than `only`, if given."""
        wanted = range(len(self.data.observations)) if only is None else [only]
        every = [*self.present, *effects]
        return features_of(self.data, {t: predicted(self.linearised(x, t, every)) for t in wanted}) + self.gains(x)

    def linearised(self, x: Array, test: int, effects: Applied) -> Linearised:
        """The linear model at nuisance values x at the condition of a test; what differs from a late one in the measuring chain alone is not
        worked out again."""
        # effects that are told apart by what they are stay alive in the point that is kept
        acting = [(id(e), *v.values()) for e, v in effects if any(getattr(e, hook) for hook in HOOKS if hook != "measurement")]
        key = (test, x[: len(x) - self.channels].tobytes(), tuple(acting))
        if key in self._lately:
            late = self._lately[key]
            return replace(late, point=replace(late.point, effects=tuple(effects)))
        if len(self._lately) >= LATELY:
            self._lately.clear()
        self._lately[key] = linearised(self.built(x), self.data.observations[test], effects, self.warmer(x)[test])
        return self._lately[key]

    @cached_property
    def _lately(self) -> dict[Hashable, Linearised]:
        return {}

    @cached_property
    def build(self) -> list[Toleranced]:
        """The toleranced parameters of the spindle, the first of the nuisance parameters."""
        return toleranced(self.spindle)

    def built(self, x: Array) -> Spindle:
        """The spindle with its build tolerances at x; the last one is kept."""
        key = x[: len(self.build)].tobytes()
        if key not in self._built:
            spindle = self.spindle
            for parameter, value in zip(self.build, x, strict=False):
                if value != 0.0:
                    spindle = parameter.apply(spindle, float(value))
            self._built.clear()
            self._built[key] = spindle
        return self._built[key]

    @cached_property
    def _built(self) -> dict[bytes, Spindle]:
        return {}

    def warmer(self, x: Array) -> list[float]:
        """By how much (K) every test is warmer than its thermometer said."""
        first = len(self.build)
        return [float(v) for v in x[first : first + len(self.data.observations)]]

    def gains(self, x: Array) -> Array:
        """What the channel gains in x (relative) add to the amplitude features."""
        return self.by_gain @ x[len(x) - self.channels :]

    @cached_property
    def by_gain(self) -> Array:
        """Derivative (n, channels) of the features by the channel gains: exact, for they are multiplied."""
        found = np.zeros((len(self.data.features), self.channels))
        for own in self.data.rows.values():
            found[own.amplitude, own.channel] += 1.0
            found[own.amplitude, own.against] -= 1.0
            found[own.size, own.channel_of_residue] += 1.0
        return found


def theory(spindle: Spindle, data: Data) -> Theory:
    """The nuisance parameters: build tolerances, temperature error of every test, gain of every channel."""
    build = toleranced(spindle)
    channels = max((o.shape.shape[1] for o in data.observations if o.shape is not None), default=0)
    t = spindle.tolerances
    names = [p.name for p in build]
    names += [f"temperature of {o.test.id}" for o in data.observations]
    names += [f"gain of channel {i + 1}" for i in range(channels)]
    sd = [p.sd for p in build] + [t.temperature] * len(data.observations) + [t.gain] * channels
    return Theory(spindle, data, tuple(names), np.array(sd))
