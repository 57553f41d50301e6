"""Where a fit without effects starts that stalls from the drawing: what moves peaks by many of their widths has no slope to follow
from there. Of 88 campaigns of a disk, of a mount that is otherwise, or both, 22 left 3 times the errors and more from the drawing, and
light resonances then stood in for these; of 54 with all tolerances 3 to 12 times as far off as stated 14; and all 12 with three joints
of the symmetric scene 41 or 53 % softer. From here one of these 154 does, with 53 %."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.forward.model import FAILED, CampaignModel
from thermospindle.diagnosis.forward.response import Response
from thermospindle.diagnosis.inference.fit import TEMPERS, Fit, fit
from thermospindle.diagnosis.inference.prior import Learned
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters.nuisance import BUILD
from thermospindle.model.types import Array, ComplexArray

OFF = (-20.0, -10.0, -5.0, 5.0, 10.0, 20.0)  # standard deviations by which a build tolerance is off
WIDE = 10.0  # times as wide as stated build tolerances may be where envelopes are to agree
STEP, STEPS = 0.05, 40  # standard deviations of a tolerance for differences, and steps at most
FAINT = 1e-3  # of a test's largest value, from which lines count for little
UNBEARABLE = 1e3  # nepers left of each line where no spindle can be built


def from_nearest_peaks(model: CampaignModel, count: int, wider: float) -> Fit | None:
    """A fit from so many build tolerances, one after the other, as bring peaks nearest, with tolerances so many times
    as wide until errors are as stated. None where it leads to what cannot be built."""
    n = len(model.parameters)
    problem, build = Problem(model.thinned, (), Learned({BUILD: wider}, 1.0)), np.eye(n)[: len(model.build)]
    start = np.zeros(n)
    for _ in range(count):
        start = min((start, *(start + off * row for row in build for off in OFF)), key=lambda p: problem.cost(p, TEMPERS[1]))
    return _fitted(model, start, wider)


def from_envelopes(model: CampaignModel, share: float) -> Fit | None:
    """A fit from the build tolerances with which the `envelope` of the first test's lines is that of the model, several of
    them off together. None where no test has lines, or where it leads to what cannot be built."""
    n, build, thin = len(model.parameters), len(model.build), model.thinned
    problem = Problem(thin, (), Learned({BUILD: WIDE}, 1.0))
    t, data = next(((t, d) for t, d in enumerate(thin.tests) if isinstance(d, LineData)), (0, None))
    if data is None:
        return None
    seen = envelope(data, share)
    measured = seen(data.value)

    def left(tolerances: Array) -> Array:
        x = problem.parts(np.append(tolerances, np.zeros(n - build)))[0]
        answer = thin.answer(t, x, thin.linear(t, x, []))
        assert isinstance(answer, Response)
        return np.append(seen(answer.value) - measured, tolerances / WIDE)

    def bearable(tolerances: Array) -> Array:
        try:
            return left(tolerances)
        except FAILED:
            return np.full(measured.size + build, UNBEARABLE)

    def slopes(tolerances: Array) -> Array:
        return np.stack([(left(tolerances + row) - left(tolerances - row)) / (2 * STEP) for row in STEP * np.eye(build)], axis=1)

    try:
        start = least_squares(bearable, np.zeros(build), slopes, max_nfev=STEPS).x
    except FAILED:
        return None
    return _fitted(model, np.append(start, np.zeros(n - build)), WIDE)


def envelope(data: LineData, share: float) -> Callable[[ComplexArray], Array]:
    """Of FRFs (n_resp, n_ref, L) at a test's lines the logarithm (n_resp, n_ref, L) of their amplitude (nepers), power being averaged over
    neighbouring lines by a Gaussian of standard deviation `share` of the band, and the noise's added. Where the difference of two FRFs
    no longer grows once peaks are some widths apart, that of logarithms does (Arruda, AIAA Journal 30, 1992, 855)."""
    f = data.frequency
    weights = np.exp(-0.5 * ((f[:, None] - f) / (share * (f[-1] - f[0]))) ** 2)
    weights /= weights.sum(axis=1, keepdims=True)
    floor = np.asarray(data.sd**2 @ weights.T + (FAINT * np.abs(data.value).max()) ** 2, float)
    return lambda value: np.asarray(0.5 * np.log(np.abs(value) ** 2 @ weights.T + floor), float)


def _fitted(model: CampaignModel, start: Array, wider: float) -> Fit | None:
    """From a start (n,) with build tolerances so many times as wide as stated until errors are as they are."""
    try:
        near = fit(model, (), start, tempers=TEMPERS[1:-1], learned=Learned({BUILD: wider}, 1.0))
        return fit(model, (), near.point, near.rates, TEMPERS[-1:])
    except FAILED:
        return None
