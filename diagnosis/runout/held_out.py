"""Lines of runout predicted and met: squares of what is left of a line whose phase nothing
predicts, and tests left out one after the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from thermospindle.diagnosis.runout.explanation import Explanation
from thermospindle.diagnosis.runout.fit import Family, fit_family, merged
from thermospindle.model.types import ComplexArray


def each_line(rows: Family) -> Iterator[Family]:
    """The rows of one line in one test, of all its probes together; probes without phases each by itself."""
    for t in np.unique(rows.test):
        for frequency in np.unique(rows.frequency[rows.test == t]):
            together = (rows.test == t) & (rows.frequency == frequency)
            each = [together] if rows.phased[together].all() else [together & (rows.node == n) for n in np.unique(rows.node[together])]
            yield from (rows.only(chosen) for chosen in each)


def scattered(own: Family) -> ComplexArray:
    """Covariance (R, R) of one line: its errors, and what the scene may have besides of its
    sources; each keeps step within its group of phases."""
    cover = np.diag(own.sd**2).astype(complex)
    for same in np.unique(own.phase, axis=1).T:
        column = own.shown * np.all(own.phase == same[:, None], axis=0) * own.likely
        cover += column @ column.conj().T
    return cover


def by_group(own: Family, amplitude: ComplexArray) -> list[ComplexArray]:
    """What sources of `amplitude` (Q,) show in the rows (R,) of a line, each group of phases by itself."""
    return [(own.shown * (own.phase == g)) @ amplitude for g in np.unique(own.phase)]


def squares(cover: ComplexArray, value: ComplexArray, moved: Sequence[ComplexArray]) -> float:
    """|value - moved|^2 over `cover` (R, R), E|error|^2, with the phases of all `moved` that suit best: nothing predicts them."""
    whiten = np.linalg.inv(np.linalg.cholesky(cover))
    left = whiten @ value
    for one in moved:
        shown = whiten @ one
        left = left - shown * np.exp(1j * np.angle(np.vdot(shown, left)))
    return float(np.vdot(left, left).real)


def amplitude_of(own: Family, explained: Explanation) -> ComplexArray:
    """Amplitudes (Q,) of the sources of a family that the effects of an explanation make at its sizes."""
    each = [s * own.of_effect(v.amplitudes) for v, s in zip(explained.variants, explained.size, strict=True)]
    return np.asarray(sum(each, np.zeros(len(own.likely), complex)))


def _squares(rows: Family, explained: Explanation | None) -> tuple[float, int]:
    """Squared error of lines as the scene predicts them, or the scene with an effect of a given
    size, in its standard errors, and how many numbers.

    What the scene has besides is of its likely size.
    """
    total, count = 0.0, 0
    for own in each_line(rows):
        moved = [] if explained is None else by_group(own, amplitude_of(own, explained))
        total, count = total + 2 * squares(scattered(own), own.value, moved), count + 2 * len(own.value)
    return total, count


def held_out(found: Explanation, parts: Sequence[Family]) -> tuple[float, float]:
    """Rms error of conditions left out one after the other: by the scene alone, and with the effects fitted to all others."""
    family = merged([parts[i] for i in sorted({i for v in found.variants for i in v.parts})])
    before, after, count = 0.0, 0.0, 0
    for t in np.unique(family.test):
        out = family.test == t
        if out.all():
            continue
        rest = family.only(~out)
        fit = fit_family(rest, [rest.of_effect(v.amplitudes) for v in found.variants], [v.prior for v in found.variants])
        one, n = _squares(family.only(out), None)
        before, after, count = before + one, after + _squares(family.only(out), replace(found, size=fit.size))[0], count + n
    if count == 0:
        return float("nan"), float("nan")
    return float(np.sqrt(before / count)), float(np.sqrt(after / count))
