"""FRFs of another quantity than is told, or with real and imaginary parts exchanged: what fits the scene's once that is undone.

Accelerances told as mobilities are a quarter turn ahead of them and rise with frequency as these do not, and so with every
other two; exchanged, a + ib is b + ia, which is i times the conjugate: a quarter turn too, and as large as before. Either
is told where phases agree with the scene's in every FRF once it is undone, as they do in none as told; a quantity two turns
away has the phases of a sensor that is reversed, and is told where magnitudes scatter less about the scene's with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.compared import ACROSS, Compared, cosines
from thermospindle.sim.identification.frf import POWER

EXCHANGED = "exchanged"


def misread(spindle: Spindle, quantity: str, tests: Sequence[Compared]) -> str | None:
    """What is said of all FRFs of a campaign of one `quantity`; None where nothing is, or fewer than two pass a resonance."""
    if not tests or len(told := _phases(tests, quantity, quantity)) < 2:
        return None
    scatter = {other: _scatter(tests, quantity, other) for other in (*POWER, EXCHANGED)}
    fits = [
        other
        for other in scatter
        if other != quantity and told.max() < -ACROSS and _phases(tests, quantity, other).min() > -ACROSS and (other == EXCHANGED or scatter[other] < scatter[quantity])
    ]
    if not fits:
        return None
    best = min(fits, key=lambda other: scatter[other])
    if best == EXCHANGED:
        return f"all FRFs fit those that {spindle.name} has with their real and imaginary parts exchanged: is one column told as the other?"
    return f"all FRFs fit those that {spindle.name} has far better as {best} than as {quantity}: is their quantity another than is told?"


def _undone(value: ComplexArray, frequency: Array, quantity: str, other: str) -> ComplexArray:
    """FRFs (..., n) at lines (n,) Hz in the `quantity` that is told, if they were of another one, or exchanged."""
    return 1j * value.conj() if other == EXCHANGED else value * (2j * np.pi * frequency) ** (POWER[quantity] - POWER[other])


def _phases(tests: Sequence[Compared], quantity: str, other: str) -> Array:
    """Mean cosine between measured and computed phases of every loud FRF that passes a resonance."""
    return np.concatenate([cosines(_undone(t.measured, t.frequency, quantity, other), t.computed, t.computed)[t.loud & t.turning] for t in tests])


def _scatter(tests: Sequence[Compared], quantity: str, other: str) -> float:
    """Rms of ln magnitude between measured and computed over the loud FRFs, each about its own median."""

    def each() -> Iterator[Array]:
        for t in tests:
            value = _undone(t.measured, t.frequency, quantity, other)[t.loud]
            off = np.log(np.maximum(np.abs(value), 1e-300)) - np.log(np.maximum(np.abs(t.computed[t.loud]), 1e-300))
            yield (off - np.median(off, axis=-1, keepdims=True)).ravel()

    return float(np.sqrt(np.mean(np.concatenate(list(each())) ** 2)))
