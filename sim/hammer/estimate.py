"""FRFs from force and response records: windows, H1, H2, coherence, and the standard error of every line.

Bendat & Piersol, *Random Data* (2010), ch. 6; Ewins, *Modal Testing* (2000), 3.9-3.11.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.hammer.pulse import PRE_TRIGGER
from thermospindle.sim.identification.frf import Frf

STEPS = 300  # to the likeliest noise
LEAST = 1e-30  # of the mean noise power


@dataclass(frozen=True)
class Windows:
    """Force window: open for `open_for` s after the trigger of each pulse; exponential window exp(-decay t) on both channels.

    The same exponential on force and response evaluates the FRF at i omega + decay: every pole seems damped by `decay` (1/s) more,
    which modal extraction takes out again exactly.
    """

    open_for: float
    decay: float


@dataclass(frozen=True, eq=False)
class Estimate:
    """FRFs of one test. `h1` has coherence and standard errors, of a single hit neither; `h2` is
    the estimator biased by response noise instead."""

    h1: Frf
    h2: ComplexArray
    per_hit: ComplexArray  # (hits, responses, references, n)
    window_decay: float  # 1/s, damping still in the FRFs


def estimate(
    time: Array,
    force: Array,
    velocity: Array,
    windows: Windows,
    band: tuple[float, float],
    response_nodes: tuple[int, ...],
    reference_nodes: tuple[int, ...],
) -> Estimate:
    """Mobility FRFs from force (references, hits, n) and velocity (references, hits, responses, n)."""
    step = float(time[1] - time[0])
    frequency = np.fft.rfftfreq(len(time), step)
    lines = (frequency >= band[0] - 1e-9) & (frequency <= band[1] + 1e-9)
    exponential = np.exp(-windows.decay * time)
    f = np.fft.rfft(force * _force_window(time, force, windows.open_for) * exponential)[..., lines]
    v = np.fft.rfft(velocity * exponential)[..., lines]
    f = f[:, :, None, :]
    sff, svv, svf = (np.mean(s, axis=1) for s in (np.abs(f) ** 2, np.abs(v) ** 2, v * f.conj()))
    with np.errstate(divide="ignore", invalid="ignore"):  # of a dead channel, which `check_frf` refuses
        h1, h2 = svf / sff, svv / svf.conj()
        coherence = np.minimum(np.abs(svf) ** 2 / (sff * svv), 1.0) if force.shape[1] > 1 else None  # of one hit 1 whatever the noise
    per_hit = v / f
    order = (1, 0, 2)  # responses first
    frf = Frf(
        frequency[lines],
        np.ascontiguousarray(h1.transpose(order)),
        response_nodes,
        reference_nodes,
        "mobility",
        None if coherence is None else np.ascontiguousarray(coherence.transpose(order)),
        np.ascontiguousarray(_standard_error(v, f, h1).transpose(order)),
    )
    return Estimate(frf, np.ascontiguousarray(h2.transpose(order)), np.moveaxis(per_hit, (1, 2), (0, 1)), windows.decay)


def _force_window(time: Array, force: Array, open_for: float) -> Array:
    """One while the hammer touches, zero elsewhere; opened around every pulse found in the force (rebounds too)."""
    peak = np.abs(force).max(axis=-1, keepdims=True)
    touching = np.abs(force) > 0.05 * peak
    touching[..., time < PRE_TRIGGER / 2] = False
    width = max(round(2 * open_for / float(time[1] - time[0])), 3)
    return (scipy.ndimage.uniform_filter1d(touching.astype(float), width, axis=-1, mode="nearest") > 1e-9).astype(float)


def _standard_error(v: ComplexArray, f: ComplexArray, h1: ComplexArray) -> Array:
    """Standard error of H1, sqrt(E |error|^2), from the scatter between hits.

    The residual v - H1 f of a hit is the response channel's noise less H1 times the force channel's. Its power is a + b
    |H1|^2 + c |H1|^2 |f|^2 with a, b, c >= 0: noise of either channel that is white over the band, and noise in proportion
    to the line itself (speckle, scatter of the hit), which falls with the force of a soft tip where white noise does not.
    They are fitted to the residuals of all hits and lines of one FRF, each line weighted by its expected power: three hits
    alone say too little about one line. With a single hit there is no scatter, and the error is infinite.
    """
    hits = v.shape[1]
    if hits < 2:
        return np.full(h1.shape, np.inf)
    residual = np.sum(np.abs(v - h1[:, None] * f) ** 2, axis=1) / (hits - 1)  # one degree of freedom went into H1
    power = np.sum(np.abs(f) ** 2, axis=1)
    noise = np.empty(h1.shape)
    for index in np.ndindex(h1.shape[:2]):
        gain, force = np.abs(h1[index]) ** 2, power[index[0], 0] / hits
        noise[index] = _noise_power(residual[index], np.stack([np.ones_like(gain), gain, gain * force], axis=1))
    return np.sqrt(noise / power)


def _noise_power(residual: Array, terms: Array) -> Array:
    """The sum of not negative `terms` (n, m) under which residual powers (n,) are likeliest, each exponential about it
    as squares of complex noise are: its coefficients rise and fall by factors, each step to a likelier sum, from all
    terms alike (majorisation-minimisation of Fevotte & Idier 2011, *Neural Computation* 23, 2421, for beta = 0, exponent
    1 / (2 - beta); none of them is lost on the way, as one may be where squares are weighted with the fit itself)."""
    size = residual.mean()
    if size == 0:  # without noise
        return np.full_like(residual, 1e-300)
    residual, terms = residual / size, terms / np.maximum(terms.mean(axis=0), 1e-300)
    coefficients = np.full(terms.shape[1], 1 / terms.shape[1])
    for _ in range(STEPS):
        inverse = 1 / np.maximum(terms @ coefficients, LEAST)
        coefficients *= np.sqrt((residual * inverse**2) @ terms / np.maximum(inverse @ terms, LEAST))
    return np.asarray(np.maximum(terms @ coefficients, LEAST) * size)
