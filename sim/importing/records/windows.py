"""What is kept of the records of a hammer test: the window that they need, the contact of the hammer, and the band that it excites."""

from __future__ import annotations

import numpy as np

from thermospindle.model.types import Array
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.importing.records.hits import TOUCHING

DECAYED = 1e-3  # of its peak, to which a response has fallen at the end of a record that needs no exponential window
RINGS = 20.0  # times the mean of a spectrum, by which a line stands above it that is no noise's: of that the largest of 1000 is 7 in the mean
STAYS = 0.7  # of its power in the middle of the record, from which a line has not decayed
SKIRT = 4  # lines on either side that a strong tone fills
ENDS_AT = 0.01  # value of the exponential window at the end of a record that needs one
REACH = 0.1  # of the largest force spectrum, down to which the hammer excites
HEARD = 0.7  # coherence, from which a response is that of the hammer


def end_needed(response: Array) -> float:
    """End value of the exponential window for responses (references, hits, channels, n): one where every one has died away
    within its record, to `DECAYED` of its peak or to noise, which is spread over all lines of its last twentieth while what
    still rings stands on a few; or to tones, as of what turns, which are as loud there as in the middle of the record."""
    n = response.shape[-1]
    m = -(-n // 20)
    tail, middle = response[..., -m:], response[..., n // 2 - m : n // 2]
    loud = np.abs(tail).max(axis=(-1, 1)) > DECAYED * np.abs(response).max(axis=(-1, 1))
    lines, before = (_power(part) for part in (tail, middle))
    usual = np.median(lines, axis=-1, keepdims=True)
    tones = (lines > RINGS * usual) & (lines > STAYS * before) & (before > STAYS * lines)
    filled = np.any([np.roll(tones, k, axis=-1) for k in range(-SKIRT, SKIRT + 1)], axis=0)
    lines = np.where(filled, np.minimum(usual, lines), lines)
    rings = (lines.max(axis=-1) > RINGS * lines.mean(axis=-1)) | (lines.shape[-1] < 2 * RINGS)
    return ENDS_AT if bool(np.any(loud & rings)) else 1.0


def _power(part: Array) -> Array:
    """Of the lines (references, channels, m) of a part of a record, over all its hits; tapered, so
    that a tone between lines stands on three."""
    m = part.shape[-1]
    return np.asarray((np.abs(np.fft.rfft((part - part.mean(axis=-1, keepdims=True)) * np.hanning(m + 2)[1:-1], axis=-1)[..., 1:]) ** 2).sum(axis=1))


def excited(force: Array, step: float) -> tuple[float, float]:
    """From the second line to where the hammer's force has fallen to `REACH`, at most 0.4 of the sampling rate."""
    spectrum = np.sqrt(np.mean(np.abs(np.fft.rfft(force[0])) ** 2, axis=0))
    frequency = np.fft.rfftfreq(force.shape[-1], step)
    fallen = np.flatnonzero((spectrum < REACH * spectrum.max()) & (np.arange(len(spectrum)) > np.argmax(spectrum)))
    high = frequency[fallen[0]] if len(fallen) else frequency[-1]
    return float(frequency[2]), float(min(high, 0.4 / step))


def shared(band: tuple[float, float], measured: tuple[float, float] | None) -> tuple[float, float]:
    """What the hammer excites of the band that the scene is measured in: what lies beyond has modes
    of its own, which the scene does not speak of; all of it where they share none."""
    low, high = max(band[0], measured[0]) if measured else band[0], min(band[1], measured[1]) if measured else band[1]
    return (low, high) if low < high else band


def first_heard(frf: Frf, hits: int) -> int:
    """The first line from which some response is coherent with the force, over a hundredth of the
    lines: what an accelerometer says of slow motion is noise and drift alone.

    Noise has a coherence of 1 / hits in the mean, and exceeds 1 - p^(1 / (hits - 1)) with
    probability p (Carter, *Proc. IEEE* 75 (1987) 236).
    """
    if frf.coherence is None:
        return 0
    least = max(HEARD, 1 - 0.1 ** (1 / (hits - 1)))
    every = frf.coherence.reshape(-1, len(frf.frequency))
    near = max(len(frf.frequency) // 100, 5)
    heard = np.array([np.quantile(every[:, k : k + near], 0.25, axis=-1).max() > least for k in range(len(frf.frequency) - near + 1)])
    return int(np.argmax(heard)) if heard.any() else 0


def contact_time(force: Array, step: float) -> float:
    """Duration (s) of the hammer's contact."""
    return float(np.count_nonzero(np.abs(force) > TOUCHING * np.abs(force).max())) * step
