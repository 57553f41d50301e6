"""A test's FRFs and the scene's at some of its lines: which are loud, which pass a resonance, and how their phases agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.beside import beside
from thermospindle.sim.campaign.campaign import Campaign, Test, condition_of

SILENT = 1e-2
"""Of the largest FRF of a test, in rms: smaller ones are forbidden by symmetry, and their size is
noise; so are lines below as much of its median."""
ACROSS = -0.5
"""Mean cosine between measured and computed phases, below which an FRF is reversed: between -0.8
and -1 where it is, and above -0.25 where joints are twice as stiff as drawn."""
LARGEST = 1e30
"""Of any unit: a computed FRF as large as that is of a spindle that no bearing holds."""
MOST_LINES = 1000
"""Of an FRF that are looked at."""


@dataclass(frozen=True, eq=False)
class Compared:
    """FRFs of one test, measured and computed (responses, references, n) at lines (n,) Hz; `loud` (responses, references)
    ones in the model, and those that pass a resonance in both, `turning`: all lines may lie between two that are one."""

    frequency: Array
    measured: ComplexArray
    computed: ComplexArray
    response_nodes: tuple[int, ...]
    reference_nodes: tuple[int, ...]
    loud: NDArray[np.bool_]
    turning: NDArray[np.bool_]


def compared(spindle: Spindle, campaign: Campaign, test: Test, scale: float = 1.0) -> Compared | None:
    """A test at some of its lines, taken `scale` times as high as they are told; None of a table of
    modes, or where nothing holds the model, or it has no answer."""
    own = beside(spindle, campaign, test, condition_of(test))
    if own is None or not own.held or not len(own.measured.frequency):
        return None
    step = -(-len(own.measured.frequency) // MOST_LINES)
    frequency, measured = scale * own.measured.frequency[::step], own.measured.value[..., ::step]
    computed = own.computed(frequency)
    if not np.abs(computed).max() < LARGEST:
        return None
    size = np.sqrt(np.mean(np.abs(computed) ** 2, axis=-1))
    turns = [np.cos(np.angle(v * v[..., :1].conj())).min(axis=-1) < ACROSS for v in (measured, computed)]
    return Compared(frequency, measured, computed, own.measured.response_nodes, own.measured.reference_nodes, size > SILENT * size.max(), turns[0] & turns[1])


def cosines(a: ComplexArray, b: ComplexArray, computed: ComplexArray) -> Array:
    """Mean cosine (responses, references) between the phases of FRFs (responses, references, n) over the louder half of the computed lines."""
    loud = np.abs(computed) >= np.median(np.abs(computed), axis=-1, keepdims=True)
    return np.asarray(np.mean(np.cos(np.angle(a * b.conj())), axis=-1, where=loud), float)
