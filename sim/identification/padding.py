"""Records that were filled up with zeros before their transform: their lines lie closer than those
of the records, and say the same several times.

The inverse transform of a band of lines has the record in it, noise and all, up to where the zeros begin: there it falls by all that
the taper of the band's ends does not leak (Harris, *Proc. IEEE* 66 (1978) 51). An answer that dies away falls as well, but steadily.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.types import Array
from thermospindle.sim.identification.frf import Frf, even

PARTS = 128  # of the time that lines are apart for, in which what is there is compared
NEARLY = 1.05  # as many times closer as that
FEW = 512  # lines, from which it shows
FALLS, STEADY = 30.0, 3.0  # power of two parts before a fall over that of two after it, at least; and of the one before that over it, at most


def own_lines(frf: Frf) -> tuple[Frf, int]:
    """FRFs at the lines of their records alone, every k-th; and k, 1 where nothing was filled up."""
    k = padding(frf)
    if k == 1:
        return frf, 1
    kept = np.flatnonzero(np.rint(frf.frequency / even(frf.frequency)).astype(int) % k == 0)
    sd, coherence = (None if of is None else of[..., kept] for of in (frf.sd, frf.coherence))
    return replace(frf, frequency=frf.frequency[kept], value=frf.value[..., kept], sd=sd, coherence=coherence), k


def padding(frf: Frf) -> int:
    """How many times closer lines lie than those of their records, rounded down but for a twentieth."""
    if len(frf.frequency) < FEW or not even(frf.frequency):
        return 1
    there, falls = _power(frf.value), {}
    for part in range(4, PARTS - 4):
        before, earlier, after = there[part - 2 : part].mean(), there[part - 4 : part - 2].mean(), there[part + 1 : part + 3].mean()
        if before > FALLS * after and earlier < STEADY * before:
            falls[part] = before / max(after, 1e-300)
    return max(int(NEARLY * PARTS / (max(falls, key=lambda part: falls[part]) + 0.5)), 1) if falls else 1


def _power(value: np.ndarray) -> Array:
    """Mean power (PARTS,) over the time that lines are apart for, every FRF by its own."""
    from scipy.signal.windows import blackmanharris  # all of scipy.signal, which verbs without FRFs do without

    lines = value.shape[-1]
    there = np.abs(np.fft.ifft(value.reshape(-1, lines) * blackmanharris(lines))) ** 2
    heard = there.sum(axis=1) > 0
    shares = there[heard] / there[heard].sum(axis=1, keepdims=True)
    return np.array([part.mean() for part in np.array_split(shares, PARTS, axis=1)]) if heard.any() else np.ones(PARTS)
