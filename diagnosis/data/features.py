"""What a campaign is to the diagnosis: one vector of features with its covariance.

Features of a test, one block each: ln frequency and ln damping of every mode, and of modes that stand alone ln ratios (amplitude,
phase) of the shape to its largest channel, and the residue there for every reference (size, turn). Close modes turn in their plane at the
slightest asymmetry, so their shapes are left out; their frequencies are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from thermospindle.diagnosis.data.observe import SHAPE_FLOOR, Observation
from thermospindle.model.types import Array

ALONE = 0.03  # relative distance to the next mode from which a shape is used
SMALL = 0.05  # of the largest channel; smaller shape components are left out

WHAT = ("frequency", "damping", "amplitude", "phase", "size", "turn")

Index = NDArray[np.int_]


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
            result[start:stop, start:stop] = np.linalg.inv(np.linalg.cholesky(positive(own)))
        start = stop
    return result


def positive(covariance: Array) -> Array:
    """The nearest covariance (n, n) whose correlations a Cholesky factor can carry: eigenvalues below 1e-12 are rounding.

    Members of a coincident pair of modes are unknown one by one and well known together, which no floor on the diagonal makes regular.
    """
    size = np.sqrt(np.diag(covariance))
    known, directions = np.linalg.eigh(covariance / size / size[:, None])
    if known[0] >= 1e-12:
        return covariance
    return (directions * np.maximum(known, 1e-12)) @ directions.T * size * size[:, None]


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
