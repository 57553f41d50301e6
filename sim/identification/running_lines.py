"""Lines of the running speed in measured FRFs: on a turning spindle the motion of unbalance and
races stands beside the answer to the hammer.

At whole multiples of the turning frequency a line or two stick out of FRFs that are smooth there otherwise. What is
smooth is told from the lines on either side, as a polynomial and as a ratio of polynomials with one denominator for
all FRFs, which follows a resonance (the local rational method: Geerardyn, Lataire, Schoukens & Pintelon, *IEEE Trans.
Instrum. Meas.* 63 (2014) 1203). A line sticks out if it is beyond the scatter of its neighbours about both. At the
very ends of a band there are none on one side: where multiples stick out elsewhere, those there are left out unseen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from thermospindle.model.types import Array, ComplexArray

SIDE = 9  # neighbours on either side from which a line is told
OUT = 2  # lines on either side of one that its own spike may reach
FEWEST = 10  # neighbours
ONE_SIDE = 3  # of them on the side that has fewer
END = OUT + ONE_SIDE  # lines at either end of the band, which cannot be told from their neighbours
DEGREE, POLES = 3, 3  # of numerators and the common denominator
AGAIN = 2  # times that the denominator is found
CHANCE = 1e-6  # of a spike in a test without any
LEAST = 1e-8  # of the mean square of the neighbours: scatter that is believed
NAMED = 8  # of the lines left out; of more, the first ones and the last
DRIFT = 2e-3  # relative, by which the speed may differ from the one told


@dataclass(frozen=True, eq=False)
class RunningLines:
    """`out` (n,) which lines of FRFs are left out; `multiples` of the turning frequency that stick out, at `frequency` (Hz)."""

    out: NDArray[np.bool_]
    multiples: tuple[int, ...]
    frequency: tuple[float, ...]

    @property
    def span(self) -> str:
        """The first multiple to the last."""
        return "x to ".join(str(k) for k in sorted({self.multiples[0], self.multiples[-1]})) + "x"

    def words(self) -> str:
        """Which they are, in a sentence."""
        named = [f"{f:.1f} Hz ({k}x)" for k, f in zip(self.multiples, self.frequency, strict=True)]
        each = ", ".join(named) if len(named) <= NAMED else f"{', '.join(named[: NAMED - 1])} and {len(named) - NAMED + 1} more up to {named[-1]}"
        many = len(self.multiples) > 1
        return f"{'lines' if many else 'a line'} of the running speed stand{'' if many else 's'} in the FRFs, at {each}: {int(self.out.sum())} lines are left out where modes are fitted"


def running_lines(frequency: Array, value: ComplexArray, speed: float) -> RunningLines:
    """The lines at multiples of `speed` (rad/s) that stick out of FRFs `value` (responses,
    references, n) at `frequency` (n,) Hz; none at rest, or where lines are too few to tell."""
    turning = abs(speed) / (2 * np.pi)
    out = np.zeros(len(frequency), bool)
    none = RunningLines(out, (), ())
    if turning == 0.0 or len(frequency) <= 2 * FEWEST:
        return none
    low, high = frequency[1] - frequency[0], frequency[-1] - frequency[-2]
    multiples = np.arange(1, int((frequency[-1] + high / 2) / turning) + 1)
    multiples = multiples[multiples * turning >= max(frequency[0] - low / 2, low)]
    step = np.interp(multiples * turning, (frequency[1:] + frequency[:-1]) / 2, np.diff(frequency))  # that of the lines there: sweeps have uneven ones
    reach = np.maximum(1.5 * step, DRIFT * multiples * turning)
    apart = reach < turning / 2  # others are no lines between lines
    multiples, reach = multiples[apart], reach[apart]
    suspect = np.zeros(len(frequency), bool)
    for f, r in zip(multiples * turning, reach, strict=True):
        suspect |= np.abs(frequency - f) <= r
    limit = CHANCE / max(int(suspect.sum()) * value.shape[0] * value.shape[1], 1)
    found: list[tuple[int, float]] = []
    untold = np.zeros(len(frequency), bool)
    for k, r in zip(multiples.tolist(), reach, strict=True):
        own = [int(j) for j in np.flatnonzero(np.abs(frequency - k * turning) <= r) if frequency[j] > 0]
        untold[[j for j in own if min(j, len(frequency) - 1 - j) < END]] = True
        unlikely = {j: _chance(value, j, suspect, limit) for j in own}
        if unlikely and min(unlikely.values()) < limit:
            top = min(unlikely, key=lambda j: unlikely[j])
            found.append((k, float(frequency[top])))
            out[[j for j in own if unlikely[j] < limit or abs(j - top) < OUT]] = True
    if found:
        out |= untold
    return RunningLines(out, tuple(k for k, _ in found), tuple(f for _, f in found))


def _chance(value: ComplexArray, j: int, suspect: NDArray[np.bool_], limit: float) -> float:
    """Probability of the line `j` being so far off by the scatter of its neighbours, in the FRF where it is farthest off; some other
    one at or above `limit` where polynomials alone tell it."""
    near = np.arange(max(0, j - SIDE - OUT), min(value.shape[-1], j + SIDE + OUT + 1))
    near = near[(np.abs(near - j) > OUT) & ~suspect[near]]
    if len(near) < FEWEST or (near < j).sum() < ONE_SIDE or (near > j).sum() < ONE_SIDE:
        return 1.0
    x = (near - j) / (SIDE + OUT)
    here = value[:, :, near].reshape(-1, len(near))
    size = np.sqrt(np.mean(np.abs(here) ** 2, axis=1))
    used = size > 0
    here, at = here[used] / size[used, None], value[:, :, j].reshape(-1)[used] / size[used]
    if not len(at):
        return 1.0
    of_polynomials = float(np.min(_tail(here, at, x, 0)))
    return of_polynomials if of_polynomials >= limit else max(of_polynomials, float(np.min(_tail(here, at, x, POLES))))


def _tail(here: ComplexArray, at: ComplexArray, x: Array, poles: int) -> Array:
    """By FRF (rows of `here`) the probability (F distribution) of `at`, the value at x = 0, by what
    `here` leaves of polynomials over one denominator 1 + d_1 x + ... of all FRFs.

    Numerators and denominator by linear least squares, weighted anew with the denominator found
    (Sanathanan & Koerner 1963): the errors of both count.
    """
    powers = np.vander(x, DEGREE + 1, increasing=True)
    below, d, of_d = np.ones(len(x), complex), np.zeros(0, complex), np.zeros((0, 0), complex)
    for _ in range(AGAIN if poles else 0):
        weighted = here / np.abs(below)
        q = np.linalg.qr(powers / np.abs(below)[:, None])[0]
        left = np.array([weighted * x**p for p in range(poles + 1)])
        left = left - (left @ q) @ q.T  # numerators projected out
        solved = np.linalg.pinv(left[1:].reshape(poles, -1).T, rcond=1e-10)
        d, of_d = -solved @ left[0].ravel(), solved @ solved.conj().T
        below = 1 + sum(c * x ** (p + 1) for p, c in enumerate(d))
    weight = 1 / np.abs(below)
    from_lines = np.linalg.pinv(powers * weight[:, None]) * weight  # (DEGREE + 1, lines), of numerators
    numerator = from_lines @ (here * below).T
    left = here - (powers @ numerator).T / below
    freedom = len(x) - powers.shape[1] - poles / len(here)
    even = (np.abs(left) ** 2).sum(axis=1) / freedom
    of_value = np.median(np.abs(left / np.where(here == left, 1.0, here - left)) ** 2, axis=1) / np.log(2) * np.abs(numerator[0]) ** 2  # noise in proportion to the value
    variance = np.maximum(np.maximum(even, of_value), LEAST)
    moved = np.array([(here * x ** (p + 1)) @ from_lines[0] for p in range(poles)]).reshape(poles, len(here))  # the value at 0, by d
    by_d = np.einsum("pr,pq,qr->r", moved.conj(), of_d, moved).real * variance.mean()
    expected = variance * (1 + float((from_lines[0] ** 2).sum())) + by_d
    return np.asarray(scipy.special.fdtrc(2, 2 * freedom, np.abs(at - numerator[0]) ** 2 / expected))
