"""FRF lines of a test as the inference takes them: compressed without loss (`blocks`), with noise
that their own scatter confirms (`noise`)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg.blas import ztrmm

from thermospindle.diagnosis.data.blocks import compressed, divided
from thermospindle.diagnosis.data.noise import (
    KNOWN,
    LINES_THAT_SCATTER,
    SCATTER,
    SILENT,
    confirmed,
    falls,
    of_neighbours,
    parts_of,
    smooth_sd,
    told,
    within_blocks,
)
from thermospindle.diagnosis.data.window import NONE, TOLD, Alike, Window, windowed
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Noise, Test
from thermospindle.sim.identification.frf import even, out_of, record_length
from thermospindle.sim.identification.padding import own_lines

CHANGED = 1.5  # times the step before, from which lines are another piece


@dataclass(frozen=True, eq=False)
class LineData:
    """One test: `value` (n_resp, n_ref, L) at `frequency` (L,) Hz in `quantity`; `sd` alike, the standard deviation sqrt(E |error|^2).

    `noise_from` says in words where the noise was taken from, `raw` how many lines the test had; errors that go together are `alike`.
    """

    test: Test
    condition: Condition
    frequency: Array
    value: ComplexArray
    sd: Array
    quantity: str
    noise_from: str
    raw: int
    alike: Alike | None = None

    @cached_property
    def duration(self) -> float:
        """Length (s) of the record that lines so far apart are the transform of."""
        return np.inf if self.test.frf is None else record_length(self.test.frf)

    @cached_property
    def whitening(self) -> ComplexArray | None:
        """W (n_resp, n_ref, L, L) by which values, each in its standard errors, become independent; None where they are."""
        if self.alike is None:
            return None
        return (self.alike if self.test.pretrigger is None else self.alike.hit(self.test.pretrigger)).whitening()

    def in_errors(self, value: ComplexArray) -> ComplexArray:
        """Differences (n_resp, n_ref, L) of FRFs as independent numbers, whose real and imaginary parts have unit variance."""
        return self.independent(value * (np.sqrt(2) / self.sd))

    def independent(self, scaled: ComplexArray) -> ComplexArray:
        """Values (..., n_resp, n_ref, L) in their standard errors as independent ones."""
        return scaled if self.whitening is None else _each(scaled, self.whitening)

    @property
    def smooth(self) -> float:
        """Variance of what is smooth over lines, over that of lines that are independent."""
        return 1.0 if self.alike is None else self.alike.window.smooth

    def alone(self, rows: Array) -> Array:
        """Rows (k, N) of independent numbers, the real and the imaginary part of one after the other, as
        numbers of every line by itself, taken for independent, with errors as large as those of what is smooth."""
        if self.whitening is None:
            return rows
        values = np.ascontiguousarray(rows).view(complex).reshape(len(rows), *self.value.shape)
        found = _each(values, np.asarray(np.linalg.inv(self.whitening), complex)) / np.sqrt(self.smooth)
        return np.ascontiguousarray(found).reshape(len(rows), -1).view(float)

    @property
    def sensors(self) -> tuple[int, ...]:
        """Nodes of the rows: what a channel is, in whatever order a test has them."""
        return () if self.test.frf is None else self.test.frf.response_nodes

    @property
    def hammers(self) -> tuple[int, ...]:
        """Nodes of the columns."""
        return () if self.test.frf is None else self.test.frf.reference_nodes

    @property
    def count(self) -> int:
        """Real numbers in the likelihood."""
        return 2 * self.value.size


def _each(value: ComplexArray, by: ComplexArray) -> ComplexArray:
    """Values (..., n_resp, n_ref, L) of every FRF times its own upper triangular matrix (n_resp, n_ref, L, L)."""
    every = value.reshape(-1, *by.shape[:3])
    found = np.empty(every.shape, complex)
    for i, j in np.ndindex(by.shape[:2]):
        found[:, i, j] = ztrmm(1.0, by[i, j].T, every[:, i, j].T, lower=1).T  # half of what a whole matrix takes, which is a third of a diagnosis
    return found.reshape(value.shape)


def line_data(test: Test, condition: Condition, stated: Noise | None, expected: Noise) -> LineData:
    """The lines of a test's FRFs above 0 Hz, without those of the running speed, and without those between the lines of
    a record that was filled up with zeros. Noise is that of the file (repeats, coherence), or `stated` by the campaign,
    or found in the scatter of neighbouring lines, starting from what the scene's measuring chain is `expected` to have."""
    assert test.frf is not None
    frf, closer = own_lines(test.frf)
    test = replace(test, frf=frf)
    use = (frf.frequency > 0) & ~out_of(frf, test.speed).out
    frequency, value = frf.frequency[use], frf.value[:, :, use]
    steps = np.diff(frequency)
    change = np.abs(np.log(steps[1:] / steps[:-1])) > np.log(CHANGED)  # lines left out, and where another part of a sweep begins
    gaps = sorted({*(np.flatnonzero(np.diff(np.flatnonzero(use)) > 1) + 1).tolist(), *((np.flatnonzero(change) + 1).tolist() if not even(frf.frequency) else ())})
    length = record_length(frf)
    hit = Window(test.window_decay, length) if test.pretrigger is None else Window(test.window_decay, length, test.pretrigger, TOLD)
    window = windowed(value, hit) if np.isfinite(length) else NONE
    sd, noise_from = told(frf, value, use, stated, expected, window)
    least = SILENT * float(np.abs(value).max())  # where symmetry forbids an answer there is rounding alone, or nothing
    sd = np.maximum(sd, least)
    falling = falls(value, sd, window, frequency)
    if falling is not None:
        sd = np.maximum(sd, smooth_sd(value, of_neighbours(value, window), frequency, falling))
    known, blocks = sd if noise_from in KNOWN else None, divided(value, sd, window, gaps)
    seen = within_blocks(value, blocks, window, frequency, falling)
    if seen is None and len(frequency) > LINES_THAT_SCATTER:  # noise stated too small divides every block to single lines
        blocks = divided(value, np.maximum(sd, smooth_sd(value, of_neighbours(value, window), frequency, falling)), window, gaps)
        seen = within_blocks(value, blocks, window, frequency, falling)
    for _ in range(2):
        if seen is None:
            break
        sd_seen = np.maximum(np.sqrt(seen), least)
        if known is not None and confirmed(known, sd_seen):
            sd, blocks = known, divided(value, known, window, gaps)
            break
        sd = sd_seen if known is None else np.maximum(known, sd_seen)
        noise_from = SCATTER if known is None else noise_from
        blocks = divided(value, sd, window, gaps)
        seen = within_blocks(value, blocks, window, frequency, falling)
    parts = parts_of(value, sd, frequency, falling) if window.damped else sd[None] ** 2
    at, kept, error, alike = compressed(frequency, value, parts, blocks, window)
    said = noise_from if closer == 1 else f"{noise_from}, of one line in {closer}: records are filled up with zeros"
    return LineData(test, condition, at, kept, error, frf.quantity, said, len(frequency), alike)
