"""Coherence beside the FRF that it is of, from whichever file of its test, and in words what of it has no FRF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from thermospindle.sim.importing.files.labels import same_end
from thermospindle.sim.importing.measured import Curve, End, listed

OFF = 0.25  # of a step, by which the lines of a coherence may lie off those of its FRF
LACKING = 1  # lines of an FRF that its coherence may not have: that at 0 Hz, or the last one


def with_coherence(curves: Sequence[Curve], found: Sequence[Curve]) -> tuple[list[Curve], list[str]]:
    """The curves of a test, each with the coherence of its ends cut to the lines of both, and notes of every coherence and line left out."""
    of: dict[int, list[Curve]] = {}
    left: dict[tuple[str, str, str], list[str]] = {}  # of what is left out of a file, by what it is and why
    for coherence in found:
        own = [k for k, c in enumerate(curves) if _ends(c) == _ends(coherence)] or [k for k, c in enumerate(curves) if all(map(_alike, _ends(c), _ends(coherence)))]
        if len(own) == 1:
            of.setdefault(own[0], []).append(coherence)
        else:
            _leave(left, coherence, f"{len(own)} FRFs of its test are between these points" if own else "its test has no FRF between these points")
    made = list(curves)
    for k, beside in of.items():
        curve, first = curves[k], beside[0]
        if len(beside) > 1:
            for c in beside:
                _leave(left, c, f"{len(beside)} are of one FRF")
        elif (both := _lines_of_both(curve, first)) is None:
            f, g = first.frequency, curve.frequency
            _leave(left, first, f"{len(f)} lines from {f[0]:g} to {f[-1]:g} Hz are not the {len(g)} from {g[0]:g} to {g[-1]:g} Hz of the FRF")
        else:
            lines, at = both
            for line in np.setdiff1d(np.arange(len(curve.frequency)), lines).tolist():
                left.setdefault((curve.file.name, f"the line at {curve.frequency[line]:g} Hz of", "coherence has no such line"), []).append(curve.where)
            sd = None if curve.sd is None else curve.sd[lines]
            made[k] = replace(curve, frequency=curve.frequency[lines], value=curve.value[lines], sd=sd, coherence=first.value[at])
    return made, [f"{file}: {what} {listed(of_what, 4)} left out: {why}" for (file, what, why), of_what in left.items()]


def _leave(left: dict[tuple[str, str, str], list[str]], coherence: Curve, why: str) -> None:
    ends = " over ".join(end.label or "no point" for end in _ends(coherence))
    left.setdefault((coherence.file.name, "coherence of", why), []).append(f"{ends} ({coherence.where})")


def _ends(curve: Curve) -> tuple[End, End]:
    return curve.response, curve.reference


def _alike(one: End, other: End) -> bool:
    """Whether two ends may be one: the same place, and along one axis as far as both say."""
    return same_end(one, other) and (not one.direction or not other.direction or one.direction[1] == other.direction[1])


def _lines_of_both(curve: Curve, coherence: Curve) -> tuple[np.ndarray, np.ndarray] | None:
    """Which lines of a curve its coherence has, all but `LACKING` at an end, and which of the
    coherence these are; None where they are others."""
    own, there = curve.frequency, coherence.frequency
    if len(own) < 2 or len(coherence.value) != len(there) or len(there) < 2:
        return None
    right = np.clip(np.searchsorted(there, own), 1, len(there) - 1)
    nearest = np.where(own - there[right - 1] < there[right] - own, right - 1, right)
    lines = np.flatnonzero(np.abs(there[nearest] - own) <= OFF * np.abs(np.gradient(own)))
    if len(lines) < len(own) - LACKING or np.any(np.diff(lines) != 1):
        return None
    return lines, nearest[lines]
