"""What the model predicts of a campaign: the same features as observed, for any tolerances and effects.

Features of a test, one block each: ln frequency and ln damping of every paired mode, and ln ratios (amplitude, phase) of the shape of
modes that stand alone to their largest channel. Close modes turn in their plane at the slightest asymmetry, so their shapes are left
out; their frequencies are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from diagnosis.observe import SHAPE_FLOOR, Observation
from model.ball_row import Array
from model.machine import Spindle
from model.modes import ComplexArray, modes
from model.rotor_base import matrices
from model.tolerance import toleranced
from sim.effect import Effect, Values
from sim.operating import operating_point

ALONE = 0.03  # relative distance to the next mode from which a shape is used
SMALL = 0.05  # of the largest channel; smaller shape components are left out
FAR = 0.08  # ln frequency that costs as much as a fully different shape in pairing
UNLIKE = 3.0  # cost of a different kind, where only kinds are known

Applied = Sequence[tuple[Effect, Values]]


@dataclass(frozen=True, eq=False)
class Predicted:
    """Modes of one condition: frequency (k,) Hz, damping (k,), shape (k, n_resp) at the measuring points, kinds."""

    frequency: Array
    damping: Array
    shape: ComplexArray
    kind: tuple[str, ...]


@dataclass(frozen=True)
class Feature:
    """One number of the data: which test, which mode of it, what."""

    test: int
    mode: int
    what: str  # frequency, damping, amplitude or phase
    channel: int = -1
    against: int = -1


@dataclass(frozen=True, eq=False)
class Data:
    """Features of a campaign: values and the whitening matrix W with W^T W the inverse covariance."""

    observations: tuple[Observation, ...]
    features: tuple[Feature, ...]
    value: Array  # (n,)
    whiten: Array  # (n, n), block lower triangular
    sd: Array  # (n,)


def data_of(observations: Sequence[Observation]) -> Data:
    """Features and their covariance; tests are independent of each other."""
    features: list[Feature] = []
    values: list[float] = []
    blocks = []
    for t, o in enumerate(observations):
        m = len(o.frequency)
        known = [i for i in range(2 * m) if np.isfinite(o.covariance[i, i])]
        features += [Feature(t, i % m, "frequency" if i < m else "damping") for i in known]
        logs = np.concatenate([np.log(o.frequency), np.log(o.damping)])
        values += logs[known].tolist()
        blocks.append(o.covariance[np.ix_(known, known)])
        if o.shape is not None and o.shape_sd is not None:
            for i, largest, channel in _usable(o):
                ratio = np.log(o.shape[i, channel] / o.shape[i, largest])
                sd = np.hypot(o.shape_sd[i, channel] / abs(o.shape[i, channel]), SHAPE_FLOOR) / np.sqrt(2)
                sd = max(float(sd), SHAPE_FLOOR)
                features += [Feature(t, i, what, channel, largest) for what in ("amplitude", "phase")]
                values += [float(ratio.real), float(ratio.imag)]
                blocks += [np.array([[sd**2]]), np.array([[sd**2]])]
    n = len(values)
    whiten, sd = np.zeros((n, n)), np.zeros(n)
    start = 0
    for block in blocks:
        stop = start + len(block)
        whiten[start:stop, start:stop] = np.linalg.inv(np.linalg.cholesky(block))
        sd[start:stop] = np.sqrt(np.diag(block))
        start = stop
    return Data(tuple(observations), tuple(features), np.array(values), whiten, sd)


def _usable(o: Observation) -> list[tuple[int, int, int]]:
    """(mode, largest channel, channel) of the shape ratios worth comparing."""
    assert o.shape is not None
    found = []
    logs = np.log(o.frequency)
    for i in range(len(logs)):
        distance = np.min(np.abs(np.delete(logs, i) - logs[i])) if len(logs) > 1 else np.inf
        size = np.abs(o.shape[i])
        largest = int(np.argmax(size))
        if distance > ALONE:
            found += [(i, largest, c) for c in range(len(size)) if c != largest and size[c] > SMALL * size[largest]]
    return found


def predict(spindle: Spindle, observation: Observation, effects: Applied, warmer: float = 0.0) -> Predicted:
    """Modes at the condition of an observation, `warmer` kelvin above what its thermometer said, as the measuring chain shows them."""
    condition = replace(observation.condition, temperature=observation.condition.temperature + warmer)
    point = operating_point(spindle, condition, effects)
    found = modes(point.chain, matrices(point.chain), highest=1.5 * spindle.hammer.band[1])
    chain = point.measurement
    pole = np.array([m.pole for m in found]) - chain.decay
    seen = chain.gain * np.exp(-1j * np.abs(pole[:, None]) * chain.delay)
    shape = np.asarray(np.array([m.shape for m in found]) @ chain.response_rows.T * seen, complex)
    return Predicted(np.abs(pole) / (2 * np.pi), -pole.real / np.abs(pole), shape, tuple(m.kind for m in found))


def pair(o: Observation, p: Predicted) -> Array:
    """Index into the predicted modes of the partner of every observed one; -1 where there are too few.

    The assignment costs unlikeness of shape (of kind, without shapes) and distance in ln frequency over `FAR`, by its size: where some
    modes are far off, squares would rather move all of them by one place. Modes closer than `ALONE` that are not axial turn in their
    plane and keep their order.
    """
    distance = np.abs(np.log(o.frequency[:, None] / p.frequency[None, :])) / FAR
    if o.shape is not None:
        unlike = 1 - np.abs(_unit(o.shape).conj() @ _unit(p.shape).T) ** 2
    else:
        unlike = UNLIKE * (np.array(o.kind)[:, None] != np.array(p.kind)[None, :])
    partner = np.full(len(o.frequency), -1)
    rows, columns = linear_sum_assignment(distance + unlike)
    partner[rows] = columns
    radial = [i for i, j in enumerate(partner) if j >= 0 and p.kind[j] != "axial"]
    for group in np.split(np.array(radial, int), np.flatnonzero(np.diff(np.log(o.frequency[radial])) > ALONE) + 1):
        partner[group] = partner[group][np.argsort(p.frequency[partner[group]])]
    return partner


def _unit(shape: ComplexArray) -> ComplexArray:
    return shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-300)


def features_of(data: Data, predicted: Mapping[int, Predicted]) -> Array:
    """The predicted values (n,) of all features; zero for tests without a prediction."""
    value = np.zeros(len(data.features))
    pairs = {t: pair(data.observations[t], p) for t, p in predicted.items()}
    for k, f in enumerate(data.features):
        if f.test not in predicted:
            continue
        p, i = predicted[f.test], pairs[f.test][f.mode]
        if f.what == "frequency":
            value[k] = np.log(p.frequency[i])
        elif f.what == "damping":
            value[k] = np.log(max(p.damping[i], 1e-9))
        else:
            size = np.maximum(np.abs(p.shape[i]).max() * 1e-6, np.abs(p.shape[i, [f.channel, f.against]]))
            if f.what == "amplitude":
                value[k] = np.log(size[0] / size[1])
            else:  # the branch of the angle nearest to the measured one
                turn = np.angle(p.shape[i, f.channel] * p.shape[i, f.against].conj() * np.exp(-1j * data.value[k]))
                value[k] = data.value[k] + float(turn)
    return value


@dataclass(frozen=True, eq=False)
class Theory:
    """A spindle, the data it is to explain, and its nuisance parameters with their priors (all zero-mean, unit: relative or K)."""

    spindle: Spindle
    data: Data
    names: tuple[str, ...]
    sd: Array

    def test_of(self, i: int) -> int | None:
        """The test whose temperature nuisance parameter `i` is; None for a parameter of all tests."""
        first = len(self.names) - len(self.data.observations) - self.channels
        return i - first if 0 <= i - first < len(self.data.observations) else None

    @property
    def channels(self) -> int:
        return sum(name.startswith("gain") for name in self.names)

    def features(self, x: Array, effects: Applied = (), only: int | None = None) -> Array:
        """Predicted features (n,) for nuisance values x (len(names),) and effects; zero for other tests than `only`, if given."""
        build = toleranced(self.spindle)
        spindle = self.spindle
        for parameter, value in zip(build, x, strict=False):
            if value != 0.0:
                spindle = parameter.apply(spindle, float(value))
        tests = len(self.data.observations)
        warmer = x[len(build) : len(build) + tests]
        wanted = range(tests) if only is None else [only]
        predicted = {t: predict(spindle, self.data.observations[t], effects, float(warmer[t])) for t in wanted}
        return features_of(self.data, predicted) + self.gains(x)

    def gains(self, x: Array) -> Array:
        """What the channel gains in x (relative) add to the amplitude features."""
        gain = x[len(x) - self.channels :]
        added = np.zeros(len(self.data.features))
        for k, f in enumerate(self.data.features):
            if f.what == "amplitude":
                added[k] = gain[f.channel] - gain[f.against]
        return added


def theory(spindle: Spindle, data: Data) -> Theory:
    """The nuisance parameters: build tolerances, temperature error of every test, gain of every channel."""
    build = toleranced(spindle)
    channels = max((f.channel for f in data.features), default=-1) + 1
    channels = max([channels, *(f.against + 1 for f in data.features)])
    t = spindle.tolerances
    names = [p.name for p in build]
    names += [f"temperature of {o.test.id}" for o in data.observations]
    names += [f"gain of channel {i + 1}" for i in range(channels)]
    sd = [p.sd for p in build] + [t.temperature] * len(data.observations) + [t.gain] * channels
    return Theory(spindle, data, tuple(names), np.array(sd))
