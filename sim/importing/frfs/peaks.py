"""Modes of FRFs that are magnitudes alone: peaks that several of them share, or that stand alone, each fitted by one mode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from thermospindle.model.types import Array
from thermospindle.sim.identification.modal import scatter
from thermospindle.sim.importing.measured import Curve, ModeLine

PROMINENCE = 2.0  # of a peak over the valleys beside it, as a ratio
SHARED = 0.2  # of the FRFs of a test that show a peak at one place, two at least where there are several, from which it is a mode whatever is near
CLEAR = 10.0  # times the valleys beside it, from which a peak that fewer show is a mode, too, where no other mode is near
ALONE = 2.0  # half-power widths from other modes, beyond which none is near: nearer it may be one of these on the flank of another
TOGETHER = 0.25  # half-power widths between peaks of different FRFs that are one mode's, but one and a half lines at least
ABOVE_NOISE = 7.0  # standard deviations of the lines' own scatter, by which a peak stands over the valleys beside it
AROUND = 12  # lines on each side of a peak that its fit sees at least
LOWEST = 0.3  # of a peak's height, down to which its fit sees lines
LEAST_SD = 0.05  # of a line: what one number a line can tell of a frequency at best
NEIGHBOURS = 0.05  # half-power widths by which the flanks of other modes move the peak of one FRF: 0.02 to 0.07 where those of hdd_2003 were taken alone
HEAVY = 0.2  # damping ratio from which a hump is no mode


def from_peaks(curves: Sequence[Curve], speed: float) -> tuple[list[ModeLine], list[str]]:
    """Modes of a test's magnitudes: each peak is fitted by |a / (1 - r^2 + 2 i z r) + b|, r = f / f0, in every FRF that shows it.

    Frequency and damping are the medians over these FRFs, standard errors their scatter over the root of their number,
    0.05 of a line at least; of a peak in fewer than three FRFs those of the fit, and 0.05 half-power widths at least,
    and such a peak has a damping or is none. What is one peak is told by half-power widths, not by lines, so that
    finer lines lose no mode. Shapes and close pairs are beyond magnitudes. At a speed (rad/s) peaks at its multiples
    are no modes: the notes name them, and what is left out because few FRFs show it, not clearly or near another mode.
    """
    found: list[tuple[ModeLine, float]] = []  # with how far each stands above its valleys, as a ratio
    step = float(np.median(np.diff(curves[0].frequency)))
    for curve in curves:
        size = np.asarray(curve.value, float)
        tops, of = scipy.signal.find_peaks(np.log(np.maximum(size, 1e-9 * size.max())), prominence=np.log(PROMINENCE))
        noise = scatter(size[None, None])[0, 0]
        for top, drop in zip(tops.tolist(), of["prominences"], strict=True):
            if size[top] * -np.expm1(-drop) > ABOVE_NOISE * noise[top] and (mode := _peak(curve.frequency, size, top, drop, step)) is not None:
                found.append((mode, float(np.exp(drop))))
    groups: list[list[ModeLine]] = []
    outstanding = [mode for mode, above in found if above > CLEAR]
    for mode in sorted((mode for mode, _ in found), key=lambda m: m.frequency):
        own = next((g for g in reversed(groups) if _together(mode, g, step)), None)
        if own is None:
            groups.append([mode])
        else:
            own.append(mode)
    least = max(min(2, len(curves)), SHARED * len(curves))
    modes: list[ModeLine] = []
    harmonics, unsure, turning = [], [], abs(speed) / (2 * np.pi)
    for group in sorted(groups, key=lambda g: len(g) < least):  # those that enough FRFs share first
        mode = _median(group, step)
        nearest = turning * max(round(mode.frequency / turning), 1) if turning else -np.inf
        if len(group) < 3 and any(m.damping_ratio is None for m in group):  # one spike of noise has no width
            continue
        clear = len(group) >= least or any(m in outstanding for m in group)
        near = len(group) < least and any(abs(mode.frequency - m.frequency) < ALONE * max(_width(mode), _width(m)) for m in modes)
        if clear and abs(mode.frequency - nearest) <= step:
            harmonics.append(f"{mode.frequency:.5g}")
        elif clear and not near:
            modes.append(mode)
        else:
            unsure.append(f"{mode.frequency:.5g}")
    notes, name = [], curves[0].file.name
    if harmonics:
        notes.append(f"{name}: {_peaks(harmonics, 'a multiple of the running speed, no mode', 'multiples of the running speed, no modes')}")
    if unsure:
        notes.append(f"{name}: {_peaks(unsure, 'left out', 'left out')}: too few of its FRFs show it, or not clearly enough beside other modes")
    return sorted(modes, key=lambda m: m.frequency), notes


def _peaks(at: Sequence[str], one: str, several: str) -> str:
    return f"the peak at {at[0]} Hz is {one}" if len(at) == 1 else f"peaks at {', '.join(at)} Hz are {several}"


def _median(group: Sequence[ModeLine], step: float) -> ModeLine:
    """One mode of those that several FRFs show; 1.25 sd / sqrt(n) is the standard error of a median."""
    frequency = np.array([m.frequency for m in group])
    damping = np.array([m.damping_ratio for m in group if m.damping_ratio is not None])
    n = len(group)
    sd = 1.25 * float(np.std(frequency, ddof=1)) / np.sqrt(n) if n >= 3 else max(max(m.frequency_sd or 0.0, NEIGHBOURS * _width(m)) for m in group)
    told = len(damping) >= 3 or (n < 3 and len(damping) == n)
    spread = 1.25 * float(np.std(damping, ddof=1)) / np.sqrt(len(damping)) if len(damping) >= 3 else max((m.damping_ratio_sd or 0.0 for m in group), default=0.0)
    ratio = float(np.median(damping)) if told else None
    return ModeLine("", "unknown", float(np.median(frequency)), max(sd, LEAST_SD * step), ratio, max(spread, 0.02 * ratio) if ratio else None)


def _together(mode: ModeLine, group: Sequence[ModeLine], step: float) -> bool:
    away = mode.frequency - float(np.median([m.frequency for m in group]))
    return away <= min(_reach(mode, step), max(_reach(m, step) for m in group))


def _reach(mode: ModeLine, step: float) -> float:
    """How far (Hz) another FRF's peak may stand from this one and be the same mode's."""
    return max(1.5 * step, TOGETHER * _width(mode))


def _width(mode: ModeLine) -> float:
    """Half-power width, Hz; 0 where no damping was found."""
    return 2 * (mode.damping_ratio or 0.0) * mode.frequency


def _peak(frequency: Array, size: Array, top: int, drop: float, step: float) -> ModeLine | None:
    """The mode of a peak, from its flanks up to a half-power width on each side, or where that is a hump of several from twelve lines.

    The half-power width w is that of the steeper flank, which a mode alone leaves at the share h of its height at
    w / 2 sqrt(1/h^2 - 1) off its peak; h is that of the higher of the valleys beside it, if that is above a third.
    """
    height = max(LOWEST, float(np.exp(-drop)))
    low = np.flatnonzero(size <= height * size[top])
    k = int(np.searchsorted(low, top))
    steeper = min(np.abs(low[max(k - 1, 0) : k + 1] - top), default=len(size))
    reach = round(2 * steeper / np.sqrt(1 / height**2 - 1))
    wide = _fitted(frequency, size, top, reach, step) if reach > AROUND else None
    return wide or _fitted(frequency, size, top, AROUND, step)


def _fitted(frequency: Array, size: Array, top: int, reach: int, step: float) -> ModeLine | None:
    """One mode on a constant through the lines within `reach` of a peak that stand above a third of
    it, seven at least; None where that is no mode, or lies off the peak by half its half-power width."""
    near = np.arange(max(top - reach, 0), min(top + reach + 1, len(size)))
    lines = near[(size[near] > LOWEST * size[top]) | (np.abs(near - top) <= 3)]
    x, y = frequency[lines], size[lines] / size[top]

    def left(p: Array) -> Array:
        r = x / (p[0] * frequency[top])
        return np.abs(p[2] / (1 - r**2 + 2j * np.exp(p[1]) * r) + p[3] + 1j * p[4]) - y

    limits = np.array([[0.5, -20.0, -np.inf, -np.inf, -np.inf], [2.0, 3.0, np.inf, np.inf, np.inf]])  # ln damping of 1e-9 to 20
    fit = scipy.optimize.least_squares(left, [1.0, np.log(0.01), 0.02, 0.0, 0.0], x_scale=[1e-3, 1.0, 0.1, 0.1, 0.1], bounds=limits, max_nfev=200)
    damping, found = float(np.exp(fit.x[1])), float(fit.x[0] * frequency[top])
    if abs(found - frequency[top]) > max(2 * step, damping * found) or not 1e-6 < damping < HEAVY or len(lines) < 7:
        return None
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * 2 * fit.cost / max(len(lines) - 5, 1)
    sd, relative = float(np.sqrt(covariance[0, 0]) * frequency[top]), float(np.sqrt(covariance[1, 1]))
    told = relative < 0.5
    return ModeLine("", "unknown", found, max(sd, LEAST_SD * step), damping if told else None, damping * relative if told else None)
