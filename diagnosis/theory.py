"""What the model predicts of a campaign: the same features as observed, for any tolerances and effects.

Features of a test, one block each: ln frequency and ln damping of every paired mode, and of modes that stand alone ln ratios (amplitude,
phase) of the shape to its largest channel, and the residue there for every reference (size, turn). Close modes turn in their plane at the slightest asymmetry, so their shapes are left
out; their frequencies are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from diagnosis.observe import SHAPE_FLOOR, Observation
from model.ball_row import Array
from model.machine import Spindle
from model.modes import ComplexArray, Poles, kinds, oscillating, poles
from model.rotor_base import Matrices, matrices
from model.tolerance import Toleranced, toleranced
from sim.effect import Effect, Values
from sim.effects import of_scene
from sim.operating import OperatingPoint, operating_point

ALONE = 0.03  # relative distance to the next mode from which a shape is used
SMALL = 0.05  # of the largest channel; smaller shape components are left out
FAR = 0.08  # ln frequency that costs as much as a fully different shape in pairing
UNLIKE = 3.0  # cost of a different kind, where only kinds are known
TOLD = 0.3  # 1 - MAC with its partner below which a close mode is told by its shape
STRANGE = 4.0  # cost of a pair from which an observed mode rather has no partner
WITHOUT = 30.0  # standard errors by which the frequency of such a mode is missed, whatever the parameters

WHAT = ("frequency", "damping", "amplitude", "phase", "size", "turn")

Applied = Sequence[tuple[Effect, Values]]
Index = NDArray[np.int_]


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


@dataclass(frozen=True)
class Feature:
    """One number of the data: which test, which mode of it, what."""

    test: int
    mode: int
    what: str  # one of WHAT: amplitude and phase of channel / against; size and turn of the residue channel, reference `against`
    channel: int = -1
    against: int = -1


@dataclass(frozen=True, eq=False)
class Rows:
    """Indices of one test's features among all, by what they are, with the mode, channel and reference channel of each."""

    frequency: Index
    mode_of_frequency: Index
    damping: Index
    mode_of_damping: Index
    amplitude: Index
    phase: Index
    mode_of_shape: Index
    channel: Index
    against: Index
    size: Index
    turn: Index
    mode_of_residue: Index
    channel_of_residue: Index
    reference: Index


def _rows(features: Sequence[Feature], test: int) -> Rows:
    own = {what: [i for i, f in enumerate(features) if f.test == test and f.what == what] for what in WHAT}

    def index(what: str, key: str | None = None) -> Index:
        return np.array([getattr(features[i], key) if key else i for i in own[what]], int)

    return Rows(
        index("frequency"), index("frequency", "mode"), index("damping"), index("damping", "mode"), index("amplitude"), index("phase"),
        index("amplitude", "mode"), index("amplitude", "channel"), index("amplitude", "against"), index("size"), index("turn"),
        index("size", "mode"), index("size", "channel"), index("size", "against"),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Data:
    """Features of a campaign: values and the whitening matrix W with W^T W the inverse covariance."""

    observations: tuple[Observation, ...]
    features: tuple[Feature, ...]
    value: Array  # (n,)
    blocks: tuple[Array, ...]  # covariance, block by block
    whiten: Array  # (n, n), block lower triangular
    sd: Array  # (n,)

    @cached_property
    def rows(self) -> dict[int, Rows]:
        """Where the features of every test stand."""
        return {t: _rows(self.features, t) for t in range(len(self.observations))}

    def of_modes(self, test: int, modes: Index) -> Index:
        """Where the features of some modes of a test stand."""
        if not len(modes):
            return np.zeros(0, int)
        return np.array([i for i, f in enumerate(self.features) if f.test == test and f.mode in modes], int)


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
        if o.shape is not None and o.residue is not None and o.residue_sd is not None:
            for i, channel, reference in _sized(o):
                features += [Feature(t, i, what, channel, reference) for what in ("size", "turn")]
                values += [float(np.log(abs(o.residue[i, reference]))), float(np.angle(o.residue[i, reference]))]
                blocks += [np.array([[o.residue_sd[i] ** 2]])] * 2
    sd = np.sqrt(np.concatenate([np.diag(block) for block in blocks]))
    return Data(tuple(observations), tuple(features), np.array(values), tuple(blocks), whitening(blocks, np.zeros(len(sd))), sd)


def whitening(blocks: Sequence[Array], more: Array, enlarged: float = 1.0) -> Array:
    """W (n, n), lower triangular, with W^T W the inverse of the covariance: `blocks`, errors `enlarged` so many times, and variances
    `more` (n,)."""
    result = np.zeros((len(more), len(more)))
    start = 0
    for block in blocks:
        stop = start + len(block)
        if len(block) == 1:
            result[start, start] = (enlarged**2 * block[0, 0] + more[start]) ** -0.5
        else:
            own = enlarged**2 * block + np.diag(more[start:stop])
            result[start:stop, start:stop] = np.linalg.inv(np.linalg.cholesky(own))
        start = stop
    return result


def _alone(o: Observation) -> list[int]:
    """Modes whose shapes do not turn with those of a neighbour."""
    logs = np.log(o.frequency)
    return [i for i in range(len(logs)) if np.min(np.abs(np.delete(logs, i) - logs[i]), initial=np.inf) > ALONE]


def _usable(o: Observation) -> list[tuple[int, int, int]]:
    """(mode, largest channel, channel) of the shape ratios worth comparing."""
    assert o.shape is not None
    size = np.abs(o.shape)
    largest = [int(i) for i in np.argmax(size, axis=1)]
    channels = range(size.shape[1])
    return [(i, largest[i], c) for i in _alone(o) for c in channels if c != largest[i] and size[i, c] > SMALL * size[i, largest[i]]]


def _sized(o: Observation) -> list[tuple[int, int, int]]:
    """(mode, largest channel, reference) of the residues worth comparing."""
    assert o.shape is not None
    assert o.residue is not None
    size, largest = np.abs(o.residue), np.argmax(np.abs(o.shape), axis=1)
    return [(i, int(largest[i]), r) for i in _alone(o) for r in range(size.shape[1]) if size[i, r] > SMALL * size[i].max()]


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
        spindle, warmer = self.built(x), self.warmer(x)
        wanted = range(len(self.data.observations)) if only is None else [only]
        every = [*self.present, *effects]
        return features_of(self.data, {t: predict(spindle, self.data.observations[t], every, warmer[t]) for t in wanted}) + self.gains(x)

    @cached_property
    def build(self) -> list[Toleranced]:
        """The toleranced parameters of the spindle, the first of the nuisance parameters."""
        return toleranced(self.spindle)

    def built(self, x: Array) -> Spindle:
        """The spindle with its build tolerances at x."""
        spindle = self.spindle
        for parameter, value in zip(self.build, x, strict=False):
            if value != 0.0:
                spindle = parameter.apply(spindle, float(value))
        return spindle

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
