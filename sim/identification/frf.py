"""FRFs of one modal test, and the physical checks that measured and virtual ones must pass before anything is built on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import combinations
from operator import methodcaller
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array
from thermospindle.sim.identification.modal import KINDS, scatter
from thermospindle.sim.identification.running_lines import RunningLines, running_lines

__tracebackhide__ = methodcaller("errisinstance", BadInput)  # pytest shows where it was asked
TO_POWER = {"receptance": 1j, "mobility": 1.0, "accelerance": -1j}
"""What an FRF may be, with the phase that turns it to mobility."""
POWER = {"receptance": -1, "mobility": 0, "accelerance": 1}
"""Power of i omega that turns a mobility into each quantity."""


@dataclass(frozen=True, eq=False)
class Frf:
    """The FRFs of one test, motion along each response point's direction over force along each reference point's direction.

    `frf["hub_top0", "seat90"]` or `frf[1, 6]` is one of them, (n,): response and reference by the names or numbers of their nodes.
    Equal means equal bit for bit. The sign of zeros in `value` is dropped: it means nothing, and UFF readers do not keep it.
    """

    frequency: np.ndarray  # (n,), Hz
    value: np.ndarray  # (responses, references, n), complex, SI: m/N, (m/s)/N or (m/s2)/N
    response_nodes: tuple[int, ...]
    reference_nodes: tuple[int, ...]
    quantity: str  # receptance, mobility or accelerance
    coherence: np.ndarray | None = None  # like value, real, 0 to 1; none of a single hit, which would agree with itself alone
    sd: np.ndarray | None = None  # like value, real, its unit: standard error sqrt(E |error|^2) of each complex value
    names: Mapping[int, str] = field(default_factory=dict, compare=False)  # of the nodes, where they are known

    def __repr__(self) -> str:
        lines = f"{len(self.frequency)} lines" + (f" from {self.frequency[0]:g} to {self.frequency[-1]:g} Hz" if len(self.frequency) else "")
        return f"<{type(self).__name__} {self.quantity}: {len(self.response_nodes)} responses, {len(self.reference_nodes)} references, {lines}>"

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", self.value + 0.0)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Frf) and all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self) if f.compare)

    def __getitem__(self, ends: tuple[int | str, int | str]) -> np.ndarray:
        """One FRF (n,), complex. Raises `BadInput` naming the nodes there are."""
        if not isinstance(ends, tuple) or len(ends) != 2:
            raise BadInput(f'{ends!r}: one of the FRFs is asked for by two nodes, response and reference, as frf["hub_top0", "hub_top90"]')
        places = [self._place(end, nodes) for end, nodes in zip(ends, (self.response_nodes, self.reference_nodes), strict=True)]
        return np.asarray(self.value[places[0], places[1]])

    @cached_property
    def _of_speeds(self) -> dict[float, RunningLines]:
        """What `out_of` found at the speeds (rad/s) that were asked."""
        return {}

    def _place(self, end: int | str, nodes: tuple[int, ...]) -> int:
        for place, node in enumerate(nodes):
            if end in (node, self.names.get(node)):
                return place
        what = "response" if nodes is self.response_nodes else "reference"
        raise BadInput(f"{end!r} is no {what} of these FRFs; there are {', '.join(f'{n} {self.names.get(n, str())}'.strip() for n in nodes)}")


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    return type(a) is type(b) and bool(a == b)


def decibel(value: np.ndarray) -> Array:
    """20 log10 |value|, of zero -300."""
    return np.asarray(20 * np.log10(np.maximum(np.abs(value), 1e-15)), float)


def even(values: np.ndarray) -> float:
    """The step of an axis (n,) that rises in even ones; 0 where it does not. Text files and headers
    round: two percent of a step and six digits are allowed."""
    steps = np.diff(values)
    if len(steps) == 0 or not np.all(np.isfinite(values)):
        return 0.0
    step = (values[-1] - values[0]) / len(steps)
    straight = values[0] + step * np.arange(len(values))
    near = np.abs(values - straight) <= 0.02 * step + 2e-5 * np.abs(values).max()
    return float(step) if step > 0 and near.all() and (steps > 0).all() else 0.0


def record_length(frf: Frf) -> float:
    """Length (s) of the record that lines so far apart are the discrete Fourier transform of;
    infinite for lines in uneven steps, which are of a sweep."""
    return 1 / step if (step := even(frf.frequency)) else np.inf


def gap(lines: np.ndarray, sweep: bool = True) -> int | None:
    """The line (n,) before which others are missing, None where none are: a step unlike the others,
    which in a `sweep` may grow and stay so, but not stand alone among even ones."""
    steps = np.diff(lines)
    step = np.median(steps)
    uneven = np.abs(steps - step) > 0.02 * step + 1e-5 * lines[1:]  # ASCII abscissae have six digits
    if sweep:
        beside = np.pad(uneven, 1)
        uneven &= ~(beside[:-2] | beside[2:])
    return int(np.argmax(uneven)) if uneven.any() else None


def out_of(frf: Frf, speed: float) -> RunningLines:
    """The lines of the running speed (rad/s) that stand in FRFs; looked for once."""
    known, speed = frf._of_speeds, abs(speed)
    if speed not in known:
        known[speed] = running_lines(frf.frequency, frf.value, speed)
    return known[speed]


def without(frf: Frf, lines: NDArray[np.bool_]) -> Frf:
    """The FRFs without some `lines` (n,)."""
    if not lines.any():
        return frf
    kept = ~lines
    coherence, sd = (None if v is None else v[:, :, kept] for v in (frf.coherence, frf.sd))
    return replace(frf, frequency=frf.frequency[kept], value=frf.value[:, :, kept], coherence=coherence, sd=sd)


def bridged(frf: Frf, lines: NDArray[np.bool_]) -> Frf:
    """The FRFs with some `lines` (n,) on straight ones between their neighbours: for checks of the whole band that need even steps."""
    if not lines.any():
        return frf
    x = np.arange(len(lines))
    value = frf.value.copy()
    for one in value.reshape(-1, len(lines)):
        one[lines] = np.interp(x[lines], x[~lines], one.real[~lines]) + 1j * np.interp(x[lines], x[~lines], one.imag[~lines])
    return replace(frf, value=value)


@dataclass(frozen=True)
class Limits:
    """What FRFs must keep to be accepted; the reasons stand at the checks."""

    coherence: float = 0.8  # smallest median, weighted by the size of the FRF
    reciprocity: float = 0.15  # largest |H_ij - H_ji| over the mean |H|, root mean squares over the lines
    negative_power: float = 0.01  # largest share of a driving point's strong lines that give power back
    falling: float = 0.2  # largest share of a driving point's lines between resonances where its susceptance falls


LIMITS = Limits()
FLOOR = 1e-3  # of the largest FRF of a test: its noise where no standard error is told, five times the 0.02 % of a good vibrometer
FINER = 4  # lines for one of a sweep with uneven steps, where the direction of time is looked at
ENOUGH = 16  # lines, from which their scatter tells noise
REACTIVE, STEP = 0.3, 0.05  # of its imaginary part a mobility's real part between resonances, and its change from line to line
HUGE = 1e100  # in any unit; squares of what is larger overflow
SILENT, HEARD = 0.02, 0.1
"""Of the strongest answer to a hammer: below the first symmetry forbids an answer, and noise alone has no coherence;
from the second on a sensor that hears the strongest hears it, and in between coherence may be as much lower."""
DRIFT = 1e-3  # of the same, below which what a record holds may be the drift of its sensor, or rounding: neither knows when the blow was


def check_frf(where: str | Path, frf: Frf, speed: float, limits: Limits = LIMITS) -> None:
    """Refuse (`BadInput`) FRFs with gaps, poor coherence, the wrong time direction, or that no passive structure can have.

    `where` is the file for the message, `speed` in rad/s.
    """
    if (largest := max(np.abs(frf.value.real).max(), np.abs(frf.value.imag).max())) > HUGE:
        raise BadInput(f"{where}: a value of {largest:g}: none beyond {HUGE:g} is a measurement")
    quiet = bridged(frf, out_of(frf, speed).out)  # the running speed's own lines answer no hammer
    for i, response in enumerate(frf.response_nodes):
        if not frf.value[i].any():
            raise BadInput(f"{where}: response {response}: zero on every line; a dead channel is not allowed")
        for j, reference in enumerate(frf.reference_nodes):
            key, value = f"{where}: H({response},{reference})", frf.value[i, j]
            share = np.linalg.norm(value) / max(np.linalg.norm(frf.value[:, j], axis=-1).max(), np.finfo(float).tiny)
            _check_axis(key, value)
            _check_gaps(key, frf.frequency, value)
            if frf.coherence is not None:
                asked = limits.coherence * float(np.clip((share - SILENT) / (HEARD - SILENT), 0.0, 1.0))
                _check_coherence(key, frf.coherence[i, j], np.abs(value), replace(limits, coherence=asked))
            if frf.sd is not None and not np.all(frf.sd[i, j] > 0):
                raise BadInput(f"{key}: standard error = {frf.sd[i, j].min():g}: must be positive on every line")
            if share > DRIFT:
                _check_direction_of_time(key, frf.frequency, quiet.value[i, j])
            if response == reference:
                mobility, noise = quiet.value[i, j] * TO_POWER[frf.quantity], _noise(frf, i, j)
                _check_driving_point(key, frf.frequency, mobility, noise, limits)
                _check_susceptance(key, frf.frequency, mobility, noise, 1 - KINDS[frf.quantity], limits)
    if speed == 0:
        _check_reciprocity(where, frf, limits)


def _noise(frf: Frf, i: int, j: int) -> np.ndarray:
    """Noise (n,) of an FRF: its standard errors; where it has none (a single hit), `FLOOR` of the test's largest value, or the
    scatter of neighbouring lines where that is larger: a receptance of an accelerometer is noise alone at low frequencies."""
    floor = np.maximum(FLOOR * np.abs(frf.value).max(), scatter(frf.value[i : i + 1, j : j + 1])[0, 0] if len(frf.frequency) > ENOUGH else 0.0)
    sd = np.full(len(frf.frequency), np.inf) if frf.sd is None else frf.sd[i, j]
    return np.where(np.isfinite(sd), sd, floor)


def _check_gaps(key: str, frequency: np.ndarray, value: np.ndarray) -> None:
    """No line filled with zero (but 0 Hz, and an FRF that is zero throughout by symmetry), no value held over five lines."""
    zero = (value == 0) & (frequency > 0)
    if zero.any() and value.any():
        raise BadInput(f"{key}: zero on {zero.sum()} lines, the first at {frequency[zero][0]:g} Hz; gaps are not allowed")
    held = np.convolve(np.diff(value) == 0, np.ones(4), "valid") == 4
    if held.any() and value.any():
        raise BadInput(f"{key}: the same value on five lines from {frequency[np.argmax(held)]:g} Hz; held values are not allowed")


def _check_coherence(key: str, coherence: np.ndarray, size: np.ndarray, limits: Limits) -> None:
    """The median weighted by |H|: low coherence at an antiresonance is no fault, at the resonances it is."""
    if not np.all((coherence >= 0) & (coherence <= 1)):
        raise BadInput(f"{key}: coherence from {coherence.min():g} to {coherence.max():g}; allowed is 0 to 1")
    order = np.argsort(coherence)
    weight = np.cumsum(size[order])
    median = coherence[order][np.searchsorted(weight, weight[-1] / 2)]
    if median < limits.coherence:
        raise BadInput(f"{key}: coherence = {median:.3g} (median weighted by |H|); at least {limits.coherence:g} is allowed")


def _check_direction_of_time(key: str, frequency: np.ndarray, value: np.ndarray) -> None:
    """A structure answers after the blow: the impulse response lies at t > 0, a conjugated FRF's at t < 0.

    Needs no resonance of its own at this point and no speed. Left out is |t| below the resolution of the Hann-weighted
    band, where prompt (mass-like) answers lie. Noise alone, as where symmetry forbids an answer, has half its energy
    on each side, scattering as 0.6/sqrt(n); the limit is five of these above, so that few lines decide nothing. Lines
    in uneven steps, as of a logarithmic sweep, are joined by straight ones for this check alone.
    """
    n = len(value)
    if n < 16 or not value.any():
        return
    limit = 0.5 + 3 / np.sqrt(n)
    if not even(frequency):
        n = min(FINER * n, int(np.ptp(frequency) / np.diff(frequency).min()) + 1)
        lines = np.linspace(frequency[0], frequency[-1], n)
        value = np.interp(lines, frequency, value.real) + 1j * np.interp(lines, frequency, value.imag)
    energy = np.abs(np.fft.ifft(value * np.hanning(n + 2)[1:-1])) ** 2
    after, before = energy[4 : n // 2].sum(), energy[n - n // 2 + 1 : n - 3].sum()
    share = before / (before + after)
    if share > limit:
        raise BadInput(
            f"{key}: {share:.0%} of the impulse response lies before the blow: the FRF is conjugated; allowed is {limit:.0%}, "
            "with time dependence exp(+i omega t)"
        )


def _check_axis(key: str, value: np.ndarray) -> None:
    steps = np.diff(value.real)
    if len(steps) >= ENOUGH and not value.imag.any() and steps.min() > 0 and np.ptp(steps) < 1e-4 * steps.mean():
        raise BadInput(f"{key}: real, and rising in even steps from {value.real[0]:g} to {value.real[-1]:g}: that is an axis, no FRF")


def _check_driving_point(key: str, frequency: np.ndarray, mobility: np.ndarray, noise: np.ndarray, limits: Limits) -> None:
    """A force does positive work on a passive structure where it acts: Re(mobility) > 0.

    Only lines above a tenth of the largest count, and only below -0.3 |mobility|, a phase error of 17 degrees beyond 90. Lines below ten
    times their `noise` (n,) do not count: three standard errors of it would turn them so far.
    """
    strong = (np.abs(mobility) >= 0.1 * np.abs(mobility).max()) & (np.abs(mobility) > 10 * noise)
    negative = strong & (mobility.real < -0.3 * np.abs(mobility))
    share = negative.sum() / max(strong.sum(), 1)
    if share > limits.negative_power:
        peak = frequency[np.argmax(np.abs(mobility) * negative)]
        raise BadInput(
            f"{key}: the driving point's mobility has a negative real part on {share:.0%} of its strong lines, the strongest at "
            f"{peak:g} Hz; allowed is {limits.negative_power:.0%} (a wrong sign, or another point than the hammer's)"
        )


def _check_susceptance(key: str, frequency: np.ndarray, turned: np.ndarray, noise: np.ndarray, power: int, limits: Limits) -> None:
    """Away from its resonances the imaginary part of a passive structure's mobility, where it is
    driven, rises with frequency (Foster, *Bell Syst. Tech. J.* 3 (1924) 259): an antiresonance stands
    between every two resonances. That tells where damping is so light that no line shows power.

    `turned` (n,) has a mobility's phase and is one times w^`power`. Steps of a twentieth count,
    beyond five of their errors, on lines that are reactive and of one sign.
    """
    scale = frequency ** float(power)
    mobility, error = turned * scale, noise * scale
    own = mobility.imag
    told = (np.abs(mobility.real) < REACTIVE * np.abs(own)) & (np.abs(mobility) > 10 * error)
    step = np.diff(own)
    counts = told[1:] & told[:-1] & (own[1:] * own[:-1] > 0) & (np.abs(step) > STEP * np.maximum(np.abs(own[1:]), np.abs(own[:-1])))
    counts &= np.abs(step) > 5 * np.hypot(error[1:], error[:-1])
    share = (counts & (step < 0)).sum() / max(counts.sum(), 1)
    if counts.sum() >= ENOUGH // 2 and share > limits.falling:
        raise BadInput(
            f"{key}: between resonances the imaginary part of the driving point's mobility falls on {share:.0%} of the lines, as where antiresonances are missing; "
            f"allowed is {limits.falling:.0%}: this is the answer of another point than the hammer's"
        )


def _check_reciprocity(where: str | Path, frf: Frf, limits: Limits) -> None:
    """At rest H_ij = H_ji; gyroscopic systems are not reciprocal. Ten standard deviations of two 1 % channel gains are allowed.

    Three times what noise makes of the difference is allowed beside it: where symmetry forbids an answer, both are noise alone.
    """
    both = [node for node in frf.reference_nodes if node in frf.response_nodes]
    for a, b in combinations(both, 2):
        places = [(frf.response_nodes.index(r), frf.reference_nodes.index(q)) for r, q in ((a, b), (b, a))]
        (ab, ba), noise = (frf.value[p] for p in places), np.linalg.norm([_noise(frf, *p) for p in places])
        size = (np.linalg.norm(ab) + np.linalg.norm(ba)) / 2
        if np.linalg.norm(ab - ba) > np.hypot(limits.reciprocity * size, 3 * noise):
            difference = np.linalg.norm(ab - ba) / size
            raise BadInput(
                f"{where}: H({a},{b}) and H({b},{a}) differ by {difference:.0%} at rest; reciprocity allows {limits.reciprocity:.0%}"
            )
