"""Toleranced parameters of a spindle fitted to the lines of one test's FRFs, all else taken as known.

For scripts that follow one parameter through virtual tests: nothing is extracted, every line counts with its
own standard error, so nothing of the record is lost (maximum likelihood in the frequency domain: Pintelon &
Schoukens, *System Identification*, 2012, ch. 9). Where the model may be wrong it is the wrong tool: thousands
of lines then agree on a wrong value. `diagnosis.inference` grants the model errors of its own for that reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import matmul_toeplitz
from scipy.optimize import least_squares

from thermospindle.diagnosis.data.window import Window, apart
from thermospindle.model.built.tolerance import Toleranced
from thermospindle.model.drawing.measuring import HammerTest
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.identification.frf import POWER, Frf, record_length
from thermospindle.sim.operating import operating_point

STEP = 1e-5  # relative, for differences: far above what the bearing equilibrium is solved to
LONGEST = 30  # steps


@dataclass(frozen=True, eq=False)
class LineFit:
    """Relative deviations (p,) from the drawing with their covariance (p, p), and the chi2 of `lines` complex values, 1 each if the
    model holds."""

    names: tuple[str, ...]
    value: Array
    covariance: Array
    chi2: float
    lines: int
    steps: int

    @property
    def sd(self) -> Array:
        return np.sqrt(np.diag(self.covariance))


def fit_lines(spindle: Spindle, condition: Condition, frf: Frf, parameters: Sequence[Toleranced], window_decay: float = 0.0) -> LineFit:
    """Least squares (Levenberg-Marquardt), from the drawing, over the lines of the hammer's band.

    `window_decay` (1/s) is that of the exponential window that the FRFs were estimated with. Errors are those of `frf`, or where it has
    none (a single hit) the noise of the scene's measuring chain. ValueError if steps do not come to rest.
    """
    inside = (frf.frequency >= spindle.hammer.band[0]) & (frf.frequency <= spindle.hammer.band[1])
    frequency = frf.frequency[inside]
    to_mobility = (2j * np.pi * frequency + window_decay) ** -POWER[frf.quantity]
    measured = frf.value[..., inside] * to_mobility
    stated = frf.sd[..., inside] * np.abs(to_mobility) if frf.sd is not None else np.array(np.nan)
    sd = stated if np.all(np.isfinite(stated)) else chain_noise(spindle.hammer, measured)
    rows = [p.node for p in spindle.points]
    response = [rows.index(node) for node in frf.response_nodes]
    reference = [spindle.hammer.hammer_nodes.index(node) for node in frf.reference_nodes]

    def computed(x: Array) -> ComplexArray:
        built = spindle
        for parameter, value in zip(parameters, x, strict=True):
            built = parameter.apply(built, float(value))
        return operating_point(built, condition).frf(frequency, window_decay)[np.ix_(response, reference)]

    def stacked(value: ComplexArray) -> Array:
        """Real and imaginary parts in standard errors."""
        return np.sqrt(2) * np.concatenate([(value.real / sd).ravel(), (value.imag / sd).ravel()])

    def jacobian(x: Array) -> Array:
        here = computed(x)
        return np.stack([stacked(computed(x + STEP * unit) - here) / STEP for unit in np.eye(len(x))], axis=1)

    names = tuple(p.name for p in parameters)
    found = least_squares(lambda x: stacked(computed(x) - measured), np.zeros(len(names)), jacobian, method="lm", max_nfev=LONGEST)
    if not found.success:
        raise ValueError(f"the fit of {', '.join(names)} has not come to rest after {LONGEST} steps")
    covariance = np.asarray(np.linalg.inv(found.jac.T @ found.jac), float)
    if window_decay and np.isfinite(length := record_length(frf)):
        real, imaginary = found.jac.T.reshape(len(names), 2, -1, frequency.size).transpose(1, 2, 3, 0)
        half = covariance @ felt(real + 1j * imaginary, Window(window_decay, length)) @ covariance
        covariance = (half + half.T) / 2
    return LineFit(names, found.x, covariance, float(found.cost), measured.size, int(found.nfev))


def felt(slopes: ComplexArray, window: Window) -> Array:
    """Covariance (p, p) of what noise under a window, of unit variance a line, does along `slopes` (m, n, p) of m FRFs by p parameters."""
    lines = slopes.shape[1]
    alike = apart(np.arange(lines), window)
    return np.asarray(sum((own.conj().T @ matmul_toeplitz((alike, alike.conj()), own)).real for own in slopes), float)


def chain_noise(hammer: HammerTest, value: ComplexArray) -> Array:
    """Standard errors (n_resp, n_ref, n) of FRFs: a share of every line, and of the largest answer to that hammer."""
    largest = np.abs(value).max(axis=(0, 2), keepdims=True)
    return np.hypot(hammer.noise_of_value * np.abs(value), hammer.noise_of_largest * largest)
