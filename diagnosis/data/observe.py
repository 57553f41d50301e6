"""A campaign as the diagnosis sees it: for every test its modes, with covariances that are never zero."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from thermospindle.diagnosis.data.mode_table import mode_data
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.parallel import in_parallel
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test, condition_of
from thermospindle.sim.identification.frf import out_of, without
from thermospindle.sim.identification.modal import noise_model
from thermospindle.sim.identification.padding import own_lines
from thermospindle.sim.identification.pairing import REPEATED, ModeSet, at_shared, pairs
from thermospindle.sim.identification.remembered import extracted

FREQUENCY_FLOOR = 3e-5  # relative: finite elements and bearing equilibrium of the model itself
DAMPING_FLOOR = 3e-3  # relative
SHAPE_FLOOR = 3e-3  # relative, of a shape ratio
SILENT = 1e-5  # of the largest FRF value of a test: the least noise that is believed, half a step of 16 bits; where symmetry forbids an answer there is rounding alone
UNCERTAIN = 3e-3  # relative error of a frequency from which a pole says nothing


@dataclass(frozen=True, eq=False)
class Observation:
    """Modes of one test in order of frequency; m modes, n_resp channels.

    `covariance` (2m, 2m) of [ln frequency, ln damping]; damping not measured is NaN with infinite variance.
    `shape` (m, n_resp) and `shape_sd` are relative to the largest component; `residue` (m, n_ref) is that of
    the receptance between each reference and the channel with the largest component, `residue_sd` (m,)
    relative. A table of modes has no residues, shapes where it tells them, and says the `kind` of each mode.
    """

    test: Test
    condition: Condition
    frequency: Array
    damping: Array
    covariance: Array
    shape: ComplexArray | None
    shape_sd: Array | None
    residue: ComplexArray | None
    residue_sd: Array | None
    kind: tuple[str, ...] | None

    @property
    def modes(self) -> ModeSet:
        """For pairing."""
        strength = None if self.residue is None else 2 * np.pi * self.frequency * np.abs(self.residue).max(axis=1)
        return ModeSet(self.frequency, self.shape, self.kind or (), strength)

    @property
    def channels(self) -> int | None:
        """How many points the shapes have, None without shapes."""
        return None if self.shape is None else self.shape.shape[1]


def observe(
    campaign: Campaign, spindle: Spindle, progress: Callable[[str], None] = lambda done: None, workers: int = 1
) -> list[Observation]:
    """Mode tables of all tests; FRFs are turned into modes first, with the standard errors of the extraction.

    A test without standard errors has the noise its campaign states, or else that of the scene's measuring accuracy.
    """
    noise = campaign.noise or Noise(spindle.hammer.noise_of_value, spindle.hammer.noise_of_largest)
    observations = in_parallel(
        partial(_observed, noise), campaign.tests, workers, lambda o: progress(f"{o.test.id}: {len(o.frequency)} modes")
    )
    return [_repeated(o, [other for other in observations if other is not o]) for o in observations]


def _observed(noise: Noise, test: Test) -> Observation:
    return _from_frf(test, noise) if test.frf is not None else _from_table(test)


def _repeated(o: Observation, others: list[Observation]) -> Observation:
    """Without the modes that no other test shows anything like: a pole of the noise appears once, a mode of the machine again.
    A mode of another test speaks for one mode only: what splits a peak in two has the shape of both.

    Less than three tests of FRFs are taken as they are.
    """
    shown = [other for other in others if other.residue is not None]
    if o.residue is None or len(shown) < 2:
        return o
    again = np.zeros(len(o.frequency), bool)
    for other in shown:
        again[pairs(*at_shared(o.modes, other.modes, o.test.response_nodes, other.test.response_nodes), REPEATED)[:, 0]] = True
    return _only(o, again)


def _only(o: Observation, kept: NDArray[np.bool_]) -> Observation:
    """Some of the modes of a test of FRFs."""
    if o.shape is None or o.shape_sd is None or o.residue is None or o.residue_sd is None:
        raise ValueError("a table of modes has no residues")
    both = np.concatenate([kept, kept])
    return replace(
        o,
        frequency=o.frequency[kept],
        damping=o.damping[kept],
        covariance=o.covariance[np.ix_(both, both)],
        shape=o.shape[kept],
        shape_sd=o.shape_sd[kept],
        residue=o.residue[kept],
        residue_sd=o.residue_sd[kept],
    )


def _from_frf(test: Test, noise: Noise) -> Observation:
    assert test.frf is not None
    frf, _ = own_lines(test.frf)
    frf = without(frf, out_of(frf, test.speed).out)
    sd = frf.sd
    if sd is None or not np.all(np.isfinite(sd)):  # a single hit has no scatter
        sd = noise_model(frf.value, noise.of_value, noise.of_largest)
    sd = np.maximum(sd, SILENT * np.abs(frf.value).max())
    found = extracted(frf.frequency, frf.value, sd, frf.quantity, test.window_decay)
    scale = np.concatenate([found.frequency, found.damping])
    covariance = found.covariance / np.outer(scale, scale)
    largest = np.argmax(np.abs(found.shape), axis=1)
    residue = found.residues[np.arange(len(largest)), largest]
    floor = np.concatenate([np.full(len(found.frequency), f) for f in (FREQUENCY_FLOOR, DAMPING_FLOOR)])
    o = Observation(
        test,
        condition_of(test),
        found.frequency,
        found.damping,
        covariance + np.diag(floor**2),
        found.shape,
        found.shape_sd,
        residue,
        np.hypot(np.sqrt(2 * np.diag(covariance)[len(found.frequency) :]), SHAPE_FLOOR),
        None,
    )
    return _only(o, np.sqrt(np.diag(covariance)[: len(found.frequency)]) < UNCERTAIN)


def _from_table(test: Test) -> Observation:
    data = mode_data(test, condition_of(test), gain=0.0)
    variance = np.concatenate([data.frequency_sd**2 + FREQUENCY_FLOOR**2, data.damping_sd**2 + DAMPING_FLOOR**2])
    shape, shape_sd = data.shape, data.shape_sd
    if shape is not None and shape_sd is not None:
        largest = np.abs(shape).max(axis=1, keepdims=True)
        shape, shape_sd = shape / largest, shape_sd / largest
    return Observation(test, data.condition, data.frequency, data.damping, np.diag(variance), shape, shape_sd, None, None, data.kind)
