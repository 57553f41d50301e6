"""What a runout test shows: amplitude and phase of every known line at every probe with standard
errors, and lines that theory does not know.

Lines are fitted by least squares at their known frequencies; lines too near to be separated in the record are
one, seen at its middle. What is left of the record around a line gives its standard error. The cage turns a
little faster or slower than computed, since a contact angle is not exact: one relative change of d cos(angle)
/ D of all bearings is found from the record first. In a spectrum the squares of a line's bins are added up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from thermospindle.model.bearing.kinematics import SIDEBANDS, Kinematics, Line, lines, row_kinematics
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Campaign, Test, condition_of
from thermospindle.sim.campaign.runout_record import WINDOWS, RunoutRecord
from thermospindle.sim.operating import OperatingPoint, operating_point
from thermospindle.sim.running.lines import TOGETHER, Fit, fit, groups
from thermospindle.sim.running.pulls import HIGHEST, in_forces, pulls_of

MULTIPLE = 4  # of the number of balls and of even ball orders: highest lines looked for
FELT = 3e-4  # of the strongest harmonic over azimuth with which displaced rings feel their balls, from which sidebands are looked for
REACH = {"none": 1, "hann": 2, "flattop": 4}  # bins on either side that hold a line of a spectrum: those that share bins are one
OF_BINS = 0.04  # relative error of an amplitude from bins
AROUND = 15  # bins on either side from which the floor around a line is estimated
SLIPS = np.linspace(-0.006, 0.006, 49)  # relative changes of d cos(angle) / D that are tried
FINE = 8  # places a bin at which a spectrum is looked at
CHANCE = 6.0  # standard deviations of what a fit to noise gains
SLIP_SD = 0.002  # how well a contact angle is believed, as that change
FORM, LEAKS = 0.015, 0.03  # relative error of a line's form, and of what it leaks into its neighbours, however well its frequency is known
APART = 6e-4  # how far the bearings' slips may differ from the common one
STANDS_OUT = 30.0  # squared amplitude over the median around it from which a peak is a line: chance of 1e-9 a bin
STRONG = 0.03  # of the strongest line of its probe: an unexplained line is at least so strong
MOST = 12  # unexplained lines looked for

Key = tuple[str, str, int, str]
"""What names a line at every speed and temperature: bearing, cause, order, name."""


def key_of(line: Line) -> Key:
    return line.bearing, line.cause, line.order, line.name


@dataclass(frozen=True, eq=False)
class SeenLine:
    """Lines of theory that are one in the record: `phasor` (probes,) m at `frequency` (Hz) and
    standard errors `sd` (probes,), E|error|^2 = sd^2."""

    frequency: float
    lines: tuple[Line, ...]
    phasor: ComplexArray
    sd: Array


@dataclass(frozen=True)
class UnexplainedLine:
    """A line that no line of theory explains."""

    test: str
    frequency: float  # Hz
    order: float  # of the turning frequency
    amplitude: float  # m, at the probe where it is strongest
    node: int


@dataclass(frozen=True, eq=False)
class Seen:
    """One test: `slip` is the relative change of d cos(angle) / D found; `phased` whether the probes' phases mean something."""

    test: Test
    condition: Condition
    nodes: tuple[int, ...]
    seen: tuple[SeenLine, ...]
    unexplained: tuple[UnexplainedLine, ...]
    slip: float
    phased: bool


def runout_tests(campaign: Campaign) -> Campaign:
    """The campaign with its runout tests alone."""
    return replace(campaign, tests=tuple(t for t in campaign.tests if t.runout is not None))


def modal_tests(campaign: Campaign) -> Campaign:
    """The campaign with its modal tests alone."""
    return replace(campaign, tests=tuple(t for t in campaign.tests if t.frf is not None or t.modes))


def look(spindle: Spindle, test: Test) -> Seen:
    """The lines of a runout test. `BadInput` where the record cannot hold the lines of the balls."""
    record, condition = test.runout, condition_of(test)
    assert record is not None
    point = operating_point(spindle, condition)
    kin = row_kinematics(point.spindle, point.state)
    first = highest_of_first(point.spindle, kin, condition.speed)
    if record.highest < 1.1 * first:
        raise BadInput(
            f"tests.{test.id}: runout holds nothing above {record.highest:.4g} Hz; the first lines of {'the balls' if kin else 'what turns'} reach {first:.4g} Hz, and a tenth more is needed"
        )
    limit = record.highest / (1.1 if record.kind == "time" else 1.02)
    together = (TOGETHER if record.kind == "time" else 2.0 * REACH[record.window] + 1) / record.length

    def at(slip: float) -> tuple[list[list[Line]], Array]:
        """Lines of the bearings that slip so, those that are one in the record together, and their frequencies (k,)."""
        known = [line for line in known_lines(point, slipped(kin, slip)) if line.frequency < limit]
        clusters = _clusters(known, together)
        return clusters, np.array([float(np.mean(sorted({g.frequency for g in cluster}))) for cluster in clusters])

    slip = _slip(record, at) if kin and record.kind == "time" else 0.0  # bins of a spectrum are no finer than its lines
    clusters, frequency = at(slip)
    turning = abs(condition.speed) / (2 * np.pi)
    if record.kind == "time":
        phasor, sd, left = _fitted(record, frequency)
        unexplained = _unexplained(test, record, left, frequency, np.abs(phasor).max(axis=1), turning, limit)
    else:
        phasor, sd = _summed(record, frequency)
        sd = np.hypot(sd, OF_BINS * np.abs(phasor))
        unexplained = ()
    further = known_lines(point, slipped(kin, slip + APART))
    moved = {key_of(g): g.frequency for g in further}
    uncertain = [max(abs(moved.get(key_of(g), g.frequency) - g.frequency) for g in cluster) for cluster in clusters]
    sd = np.sqrt(sd**2 + _form(clusters, frequency, np.abs(phasor), record.length, np.array(uncertain)) ** 2)
    found = tuple(SeenLine(float(f), tuple(c), phasor[:, i], sd[:, i]) for i, (f, c) in enumerate(zip(frequency, clusters, strict=True)))
    return Seen(test, condition, record.nodes, found, unexplained, slip, record.phased)


def expected(spindle: Spindle, condition: Condition, nodes: tuple[int, ...], seconds: float, like: Seen) -> Seen:
    """The lines that a test not made yet would show, without their phasors: a record of `seconds`
    at a condition, its slip, noise and probes as of `like`."""
    record = like.test.runout
    assert record is not None
    point = operating_point(spindle, condition)
    kin = row_kinematics(point.spindle, point.state)
    reach = max(record.highest / 1.1, highest_of_first(point.spindle, kin, condition.speed))
    known = [line for line in known_lines(point, slipped(kin, like.slip)) if line.frequency < reach]
    together = TOGETHER if record.kind == "time" else 2.0 * REACH[record.window] + 1
    noise = np.median([line.sd for line in like.seen], axis=0) * np.sqrt(record.length / seconds)
    sd = np.array([noise[like.nodes.index(n)] if n in like.nodes else np.median(noise) for n in nodes])
    found = []
    for cluster in _clusters(known, together / seconds):
        frequency = float(np.mean(sorted({g.frequency for g in cluster})))
        found.append(SeenLine(frequency, tuple(cluster), np.zeros(len(nodes), complex), sd))
    return Seen(Test("planned", condition.temperature, condition.speed), condition, nodes, tuple(found), (), like.slip, like.phased)


def felt_sidebands(point: OperatingPoint) -> dict[str, int]:
    """Of every row with displaced rings up to which sideband these feel their balls, by name; two at least."""
    found = {}
    for b in point.state.rolling:
        if any(b.displacement):
            size = {m: np.abs(pull).max() for m, pull in in_forces(pulls_of(b.row, b.displacement)).items()}
            found[b.name] = max([SIDEBANDS, *(abs(m) for m, own in size.items() if own > FELT * max(size.values()))])
    return found


def known_lines(point: OperatingPoint, kin: Mapping[str, Kinematics]) -> list[Line]:
    """The lines of theory that are looked for, each once: what an imperfection does across the axis
    and along it, where displaced rings make it do both, is one line."""
    found: dict[Key, Line] = {}
    for line in lines(point.spindle, kin, point.condition.speed, MULTIPLE, felt_sidebands(point), HIGHEST):
        other = found.setdefault(key_of(line), line)
        if other.direction != line.direction:
            found[key_of(line)] = replace(other, direction="radial and axial")
    return list(found.values())


def near_lines(point: OperatingPoint) -> set[Key]:
    """The lines whose sources are weighed: of displaced rows the nearest sidebands, and the cage's multiples. Farther ones
    of races and balls are only looked for, so that they are not taken for something unknown: they are weak, and many."""
    kin = row_kinematics(point.spindle, point.state)
    near = {key_of(line) for line in lines(point.spindle, kin, point.condition.speed, MULTIPLE)}
    return near | {key_of(line) for line in known_lines(point, kin) if line.cause == "ball size"}


def highest_of_first(spindle: Spindle, kin: Mapping[str, Kinematics], speed: float) -> float:
    """Frequency (Hz) of the highest line of theory up to the number of balls, and at least of what is unbalanced, of a spindle that turns."""
    return max(line.frequency for line in lines(spindle, kin, speed, 1))


def slipped(kin: Mapping[str, Kinematics], slip: float) -> dict[str, Kinematics]:
    """Cage and ball speeds with d cos(angle) / D changed by a relative `slip` in every bearing."""

    def of(k: Kinematics) -> Kinematics:
        if not k.angled or k.outer == k.inner:
            return k
        gamma = (2 * k.cage - k.inner - k.outer) / (k.outer - k.inner)
        changed = gamma * (1 + slip)
        cage = (k.inner * (1 - changed) + k.outer * (1 + changed)) / 2
        return replace(k, cage=cage, spin=k.spin * (1 - changed**2) / (1 - gamma**2))

    return {name: of(k) for name, k in kin.items()}


def _clusters(known: list[Line], near: float) -> list[list[Line]]:
    """Lines in order of frequency, those within `near` (Hz) of the one before together."""
    rising = sorted(known, key=lambda g: g.frequency)
    return [[rising[i] for i in group] for group in groups([g.frequency for g in rising], near)]


def _form(clusters: list[list[Line]], frequency: Array, size: Array, length: float, uncertain: Array) -> Array:
    """Errors (probes, k) of lines of `size` (probes, k) that are not of noise: frequencies
    `uncertain` (k,) Hz, lines that beat, neighbours that leak.

    Lines fitted as one at their mean are off it by up to half their spread, as one whose frequency is uncertain is, and leak as much.
    """
    spread = np.array([c[-1].frequency - c[0].frequency for c in clusters]) * length
    off = uncertain * length
    apart = np.abs(frequency[:, None] - frequency) * length
    np.fill_diagonal(apart, np.inf)
    leaked = size**2 @ ((LEAKS + off + spread / 2)[:, None] / np.maximum(apart, 0.5)) ** 2
    return np.asarray(np.sqrt((size * (FORM + 1 - np.sinc(spread / 2) * np.sinc(off))) ** 2 + leaked))


# ---------------------------------------------------------------- the cage


def _squares(value: Array, length: int) -> Array:
    """Squares (probes, m) of the spectrum of a record (probes, n) under a Hann window, filled up with zeros to a `length`."""
    n = value.shape[1]
    return np.asarray(np.abs(np.fft.rfft((value - value.mean(axis=1, keepdims=True)) * np.hanning(n + 1)[:-1], length)) ** 2)


def _over(squares: Array, floor: Array) -> Array:
    """By how much squares are larger than a floor that they may be without."""
    return np.asarray(squares / np.maximum(floor, np.finfo(float).tiny))


def _slip(record: RunoutRecord, at: Callable[[float], tuple[list[list[Line]], Array]]) -> float:
    """The likeliest slip, with its prior, of a record whose lines are `at` some frequencies.

    By what the lines leave of the record, bin by bin by its logarithm over the floor, as errors with the wings of
    Student's distribution do (Lange, Little & Taylor, *J. Am. Statist. Assoc.* 84 (1989) 881): a strong line that no slip explains pulls no
    more than a weak one. Where that gains no more than a fit to noise does, by how strong the balls' lines are: which holds in noise, but is
    blunt, for a record shows two lines that lie near as one.
    """
    n = record.value.shape[1]
    fine = _squares(record.value, FINE * n)
    strength = _over(fine, np.median(fine, axis=1, keepdims=True)).sum(axis=0)
    frequency, floor = np.fft.rfftfreq(FINE * n, record.step), np.median(fine[:, ::FINE], axis=1, keepdims=True)

    def strong(slip: float) -> float:
        balls = {g.frequency for cluster in at(slip)[0] for g in cluster if g.bearing}
        return float(np.log1p(np.interp(sorted(balls), frequency, strength)).sum()) - 0.5 * (slip / SLIP_SD) ** 2

    def left(slip: float) -> float:
        rest = _least_squares(record, at(slip)[1]).residual
        return float(np.log1p(_over(_squares(rest, n), floor)).sum()) + 0.5 * (slip / SLIP_SD) ** 2

    scores = [strong(s) for s in SLIPS]
    best, step = int(np.clip(np.argmax(scores), 1, len(SLIPS) - 2)), float(SLIPS[1] - SLIPS[0])
    low, middle, high = scores[best - 1 : best + 2]
    bend = low - 2 * middle + high
    blunt = float(SLIPS[best] + (0.5 * (low - high) / bend * step if bend < 0 else 0.0))
    near = min(SLIPS[::2].tolist(), key=left)
    sharp = minimize_scalar(left, bounds=(near - 2 * step, near + 2 * step), method="bounded", options={"xatol": step / 25})
    chance = CHANCE * float(np.sqrt(len(at(blunt)[1]) * len(record.nodes)))
    return float(sharp.x) if sharp.fun < left(blunt) - chance or abs(sharp.x - blunt) < step else blunt


# ---------------------------------------------------------------- a time record


def _fitted(record: RunoutRecord, frequency: Array) -> tuple[ComplexArray, Array, Array]:
    """Phasors (probes, k), standard errors (probes, k) and what is left of the record (probes, n)."""
    found = _least_squares(record, frequency)
    n, length = record.value.shape[1], record.length
    square = np.abs(np.fft.rfft(found.residual)) ** 2 * 4 / n**2
    bins = np.arange(square.shape[1]) / length
    floor = np.array([_floor(square, bins, f, frequency, length) for f in frequency]).T
    overlap = np.sinc((frequency[:, None] - frequency) * length)
    return found.phasor, np.sqrt(floor * np.diag(np.linalg.inv(overlap))), found.residual


def _least_squares(record: RunoutRecord, frequency: Array) -> Fit:
    try:
        return fit(record.axis, record.value, frequency)
    except ValueError as error:
        raise BadInput(f"runout: {error}; a longer record is needed") from None


def _floor(square: Array, bins: Array, f: float, fitted: Array, length: float) -> Array:
    """Mean squared amplitude (probes,) of the bins around f that hold no fitted line: their median over ln 2."""
    near = np.flatnonzero(np.abs(bins - f) < AROUND / length)
    free = near[np.abs(bins[near, None] - fitted).min(axis=1) > 0.6 / length]
    chosen = free if len(free) >= 5 else near
    return np.asarray(np.median(square[:, chosen], axis=1) / np.log(2))


def _unexplained(
    test: Test, record: RunoutRecord, left: Array, fitted: Array, strongest: Array, turning: float, limit: float
) -> tuple[UnexplainedLine, ...]:
    """Peaks of the rest that stand out of their surroundings and lie at no fitted line, strongest first."""
    n, length = left.shape[1], record.length
    window = np.hanning(n + 1)[:-1]
    amplitude = np.abs(np.fft.rfft(left * window)) * 2 / window.sum()
    frequency = np.fft.rfftfreq(n, record.step)
    free: NDArray[np.bool_] = (
        (np.abs(frequency[:, None] - fitted).min(axis=1) > 3 / length) & (frequency > 3 / length) & (frequency < limit)
    )
    found: list[UnexplainedLine] = []
    for i in np.argsort(-(amplitude / strongest[:, None]).max(axis=0) * free):
        if len(found) == MOST or not free[i]:
            break
        probe = int((amplitude[:, i] / strongest).argmax())
        around = amplitude[probe, max(0, i - AROUND) : i + AROUND + 1]
        near = any(abs(g.frequency - frequency[i]) < 4 / length for g in found)
        if amplitude[probe, i] < STRONG * strongest[probe]:
            break
        if not near and amplitude[probe, i] ** 2 > STANDS_OUT * _median(around) ** 2:
            order = float(frequency[i]) / turning
            found.append(UnexplainedLine(test.id, float(frequency[i]), order, float(amplitude[probe, i]), record.nodes[probe]))
    return tuple(found)


# ---------------------------------------------------------------- a spectrum


def _summed(record: RunoutRecord, frequency: Array) -> tuple[ComplexArray, Array]:
    """Amplitudes from the squares of the bins around each line less the floor's, with the phase of the highest bin; standard errors."""
    reach, bandwidth = REACH[record.window], WINDOWS[record.window]
    square = np.abs(record.value) ** 2
    phasor, sd = np.zeros((len(record.nodes), len(frequency)), complex), np.zeros((len(record.nodes), len(frequency)))
    places = np.rint((frequency - record.axis[0]) / record.step).astype(int)
    taken = np.zeros(square.shape[1], bool)
    for place in places:
        taken[max(0, place - reach) : place + reach + 1] = True
    for k, place in enumerate(places):
        low, high = max(0, place - reach), min(square.shape[1], place + reach + 1)
        around = np.arange(max(0, place - 2 * AROUND), min(square.shape[1], place + 2 * AROUND + 1))
        free = around[~taken[around]]
        floor = np.median(square[:, free if len(free) >= 5 else around], axis=1) / np.log(2)
        total = np.maximum(square[:, low:high].sum(axis=1) - (high - low) * floor, 0.0) / bandwidth
        top = square[:, low:high].sum(axis=0).argmax() + low
        phasor[:, k] = np.sqrt(total) * np.exp(1j * np.angle(record.value[:, top]))
        sd[:, k] = np.sqrt(floor * (high - low) / bandwidth)
    return phasor, sd


def _median(values: Array) -> float:
    """As numpy's of so few numbers, which takes thirty times as long over its cases."""
    ordered, n = np.sort(values), len(values)
    return float(ordered[(n - 1) // 2] + ordered[n // 2]) / 2
