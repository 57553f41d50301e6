"""What an explanation leaves of the data: how far its residuals say the same, and the light resonance that would make them.

A resonance that the drawing lacks (of the table, a fixture, a cable) is there in every test. It is no effect that changes over conditions,
and yet it spoils a fit by many standard errors, which tolerances are then strained to take. Where an explanation misses the data alike in
all tests, the oscillator on the machine that would make that is looked for, and becomes part of the model where the data ask for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.mode_table import TestData
from thermospindle.diagnosis.forward.derivatives import Derivatives, by_products_of_shares
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.forward.response import Light
from thermospindle.diagnosis.inference.fit import Fit
from thermospindle.diagnosis.inference.prior import Learned
from thermospindle.diagnosis.inference.problem import Linearisation, Problem
from thermospindle.diagnosis.inference.screening import linearised
from thermospindle.diagnosis.parameters.nuisance import SHARE_SD, Resonance
from thermospindle.model.types import Array, ComplexArray

LAGS = 12  # lines over which residuals are compared
SMALL, BY_CHANCE = 0.05, 3.0  # a correlation that says nothing, and its standard deviations by chance (of n numbers 1 / sqrt(n) each) up to which it says nothing either
LOOKED = 0.2  # correlation from which a light resonance is looked for
ALIKE = 0.5  # correlation of what is left in one test with what is left in another, from which it is called constant
DRIFTS = tuple(0.02 * k for k in range(-12, 13))  # of ln frequency over `RANGE_K`, of a resonance that moves with temperature
SPACING, DAMPING = 0.02, 0.02  # of neighbouring frequencies (ln) at which a light resonance is looked for, and its damping ratio there


@dataclass(frozen=True)
class Overlap:
    """How far residuals say the same: `lines`, 1 + 2 sum of their autocorrelation over neighbouring lines; `tests`,
    the mean correlation of one test's with another's. `inflation` is by how much fewer numbers they are worth.

    1, 0 and 1 for noise. What a model misses is smooth over lines, and what it misses everywhere (a resonance of the table) is there in
    every test: ln evidence is divided by the inflation (Bartlett 1946; Bayley & Hammersley, *J. R. Statist. Soc. Suppl.* 8 (1946) 184).
    """

    lines: float
    tests: float
    inflation: float


def overlap(model: CampaignModel, fit: Fit) -> Overlap:
    """Of the residuals that an explanation leaves in FRF lines."""
    problem = Problem(model, fit.mechanisms)
    left = [
        (d.frequency, np.concatenate([left.real, left.imag]))
        for t, d in enumerate(model.tests)
        if isinstance(d, LineData) and d.count
        for left in [problem.residual(t, fit.point).view(complex).reshape(-1, len(d.frequency))]
    ]
    total, square, count = np.zeros(LAGS), sum(float(np.mean(r * r)) for _, r in left), sum(r.size for _, r in left)
    if square <= 0.0:
        return Overlap(1.0, 0.0, 1.0)
    for _, r in left:
        total += [float(np.mean(r[:, k:] * r[:, :-k])) if r.shape[1] > k else 0.0 for k in range(1, LAGS + 1)]
    correlation = total / square
    seen = np.cumprod(correlation > says_nothing(count)).astype(bool)  # up to where it is lost in chance
    lines = float(1 + 2 * correlation[seen].sum())
    tests = between_tests(left, lines)
    return Overlap(lines, tests, lines * (1 + (len(left) - 1) * tests))


def says_nothing(count: float) -> float:
    """Up to where a correlation of so many numbers with as many others is chance, or too little to matter."""
    return max(SMALL, BY_CHANCE / float(np.sqrt(count)))


def between_tests(left: Sequence[tuple[Array, Array]], alike: float = 1.0) -> float:
    """Mean correlation of residuals (channels, lines) at frequencies (lines,) of one test with those
    of another at its nearest lines, `alike` of which say the same; what chance makes counts as none."""
    found = []
    for a, (lines, r) in enumerate(left):
        for b, (other_lines, other) in enumerate(left):
            if a != b and len(r) == len(other):
                there = other[:, np.abs(other_lines[None, :] - lines[:, None]).argmin(axis=1)].ravel()
                size = float(np.linalg.norm(r) * np.linalg.norm(there))
                correlation = float(r.ravel() @ there) / size if size else 0.0
                found.append(correlation if correlation > says_nothing(r.size / alike) else 0.0)
    return float(np.mean(found)) if found else 0.0


def light_resonance(model: CampaignModel, about: Fit, learned: Learned, drifts: Sequence[float] = (0.0,)) -> tuple[Resonance, float] | None:
    """The light resonance that would explain most beside the model `about`, its frequency moving by one of `drifts`, and
    the ln evidence that it promises; None where no test has FRF lines, or no mode of the reference is in their band.

    To first order the products of its shares count, a symmetric matrix; its shares are the first
    eigenvector's, those of modes beyond the band none.
    """
    lines = [d.frequency for d in model.tests if isinstance(d, LineData)]
    seen = model.reference.seen
    if not lines or not seen:
        return None
    problem = Problem(model, about.mechanisms, learned, about.moved)
    at = linearised(model, about)
    if any(d.smooth != 1.0 for d in model.tests if isinstance(d, LineData)):
        at = Linearisation(problem.length, [_alone(d, *row) for d, row in zip(model.tests, at.rows, strict=True)])
    x, effects = problem.parts(about.point)[0], problem.effects_of(about.point)
    gradient = problem.precision @ about.point + at.gradient
    inverse = np.asarray(np.linalg.inv(problem.precision + at.information), float)
    low, high = min(float(f.min()) for f in lines), max(float(f.max()) for f in lines)
    with_lines = [(t, d) for t, d in enumerate(model.tests) if isinstance(d, LineData)]
    shifts = np.array([[round(drift * model.far(t) / SPACING) for t, _ in with_lines] for drift in drifts])
    beyond, count = int(np.abs(shifts).max()), int(np.log(high / low) / SPACING) + 1
    grid = np.exp(np.log(low) + SPACING * np.arange(-beyond, count + beyond))
    lights = [Light(np.zeros((0, 0)), np.zeros(0), 2 * np.pi * float(f), DAMPING) for f in grid]
    k = seen * (seen + 1) // 2
    own = []
    for t, _ in with_lines:
        residual, by = at.rows[t]
        moved, s = by_products_of_shares(model, t, x, effects[t], seen)
        felt = np.array([-SHARE_SD**2 * light.felt(s)[0] for light in lights])
        cross, square, slope = by_frequency(moved, felt, residual, by.rows)
        own.append((by.numbers, by.times[:, None] * cross[:, by.of], square, slope))
    rows = []
    for drift, shift in zip(drifts, shifts, strict=True):
        cross, square, slope = np.zeros((count, len(inverse), k)), np.zeros((count, k, k)), np.zeros((count, k))
        for by, (numbers, of_cross, of_square, of_slope) in zip(shift, own, strict=True):
            there = slice(beyond + by, beyond + by + count)
            cross[:, numbers] += of_cross[there]
            square += of_square[there]
            slope += of_slope[there]
        for frequency, of_cross, of_square, of_slope in zip(grid[beyond : beyond + count], cross, square, slope, strict=True):
            products, gain = _promised(of_cross, of_square, of_slope, inverse, gradient, learned.errors)
            rows.append((gain, float(frequency), drift, SHARE_SD**2 * products))
    gain, frequency, drift, products = max(rows, key=lambda row: row[0])
    matrix = np.zeros((seen, seen))
    matrix[np.triu_indices(seen)] = products
    size, vector = np.linalg.eigh(matrix + np.triu(matrix, 1).T)
    shares = np.zeros(len(model.reference.omega))
    shares[:seen] = np.sqrt(max(size[-1], 0.0)) * vector[:, -1]
    return Resonance(frequency, DAMPING, tuple(shares.tolist()), (drift, 0.0)), gain - float(np.log(len(rows)))


def _alone(data: TestData, residual: Array, by: Derivatives) -> tuple[Array, Derivatives]:
    """Residuals and derivatives of a test with every line by itself (`LineData.alone`)."""
    return (data.alone(residual[None])[0], replace(by, rows=data.alone(by.rows))) if isinstance(data, LineData) else (residual, by)


def by_frequency(moved: ComplexArray, felt: ComplexArray, residual: Array, derivatives: Array) -> tuple[Array, Array, Array]:
    """Of columns that are the real and imaginary parts, one after the other, of `moved` (k, channels, L) times each
    of `felt` (F, L): their products with `derivatives` (n, N), (F, n, k), among themselves (F, k, k), and with the
    `residual` (N,), (F, k). What is felt is the same for all channels of a line, so that these are summed up once."""
    k, channels, lines = moved.shape
    every = np.concatenate([derivatives, residual[None]]).view(complex).reshape(-1, channels, lines)
    by_line = np.moveaxis(moved, -1, 0)  # (L, k, channels)
    turned = np.moveaxis(every.conj(), -1, 0)  # (L, n + 1, channels)
    with_each = (turned @ by_line.swapaxes(1, 2)).reshape(lines, -1)
    among = (by_line @ by_line.conj().swapaxes(1, 2)).real.reshape(lines, -1)
    found = (felt @ with_each).real.reshape(len(felt), -1, k)
    return found[:, :-1], (np.abs(felt) ** 2 @ among).reshape(len(felt), k, k), found[:, -1]


def _promised(cross: Array, square: Array, slope: Array, inverse: Array, gradient: Array, errors: float) -> tuple[Array, float]:
    """Parameters (k,) of prior width one whose derivatives, over all tests, make `cross` (n, k) with those of the model's
    parameters, `square` (k, k) among themselves and `slope` (k,) with the residual; and the ln evidence that they would gain."""
    information = (square - cross.T @ inverse @ cross) / errors**2 + np.eye(len(slope))
    left = (slope - cross.T @ inverse @ gradient) / errors**2
    found = np.asarray(-np.linalg.solve(information, left), float)
    return found, float(-0.5 * left @ found - 0.5 * np.linalg.slogdet(information)[1])
