"""Hammer tests as time records: hits found and judged, windows, and FRFs with coherence and standard errors by `sim.hammer.estimate`.

A hit is taken out where a channel was overloaded (its extreme reached three times exactly, or beyond what the mapping says), where the hammer
struck twice, and where the record ends before it begins; the notes name each. H1, H2 and Hv (their geometric mean, with the phase of H1)
are Bendat & Piersol, *Random Data* (2010), ch. 6; Rocklin, Crowley and Vold (IMAC 1985) for Hv.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array
from thermospindle.sim.hammer.estimate import Windows, estimate
from thermospindle.sim.hammer.pulse import PRE_TRIGGER
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.importing import units
from thermospindle.sim.importing.mapping import RecordForm
from thermospindle.sim.importing.measured import Curve, End, Motion, Question, listed

TOUCHING = 0.05  # of a hit's peak, above which the hammer touches
WEAK = 0.15  # of the strongest hit of a record; weaker ones are no hits
NOISE = 6.0  # standard deviations of the force's noise, which no second pulse is
DECAYED = 1e-3  # of its peak, to which a response has fallen at the end of a record that needs no exponential window
ENDS_AT = 0.01  # value of the exponential window at the end of a record that needs one
REACH = 0.1  # of the largest force spectrum, down to which the hammer excites
HEARD = 0.7  # coherence, from which a response is that of the hammer
HELD = 3  # samples at exactly the extreme that tell an overload
BEFORE = 5  # times the lead of a hit, over which its channels' offsets are averaged
FEWEST = 8  # samples before a hit that tell an offset
TOLD = 0.01  # of a channel's largest value, from which an offset is worth a note
STEPS = 200  # of quantisation within an extreme, below which held samples tell nothing


@dataclass(frozen=True, eq=False)
class Hit:
    """One hit: the `force` (n,) of its pulse counted positive, and its `sense`, -1 where it was recorded negative; `response` (channels, n), `PRE_TRIGGER` before it, the response as `recorded`
    too; `where` names it."""

    where: str
    force: Array
    sense: float
    response: Array
    recorded: Array


@dataclass(frozen=True, eq=False)
class FromRecords:
    """FRFs made of time records, the damping (1/s) of the window left in them, the time (s) from a record's start to the middle of its hit, and what was done and asked."""

    curves: tuple[Curve, ...]
    window_decay: float
    hits: int
    notes: tuple[str, ...]
    questions: tuple[Question, ...]
    pretrigger: float = 0.0


def frfs_of(files: Sequence[tuple[Path, Sequence[Motion]]], reference: End, form: RecordForm, measured: tuple[float, float] | None = None) -> FromRecords:
    """The FRFs of all records that one hammer point made, each file with its force and responses; where `form` has no band, within the one that the scene is `measured` in (Hz).

    Raises `BadInput` for a sample that is no number.
    """
    for path, motions in files:
        _check_numbers(path, motions)
    notes: list[str] = []
    every = ", ".join(dict.fromkeys(path.name for path, _ in files))
    name = listed(every.split(", "))
    ends = [m.end for m in files[0][1] if not m.force]
    if any([m.end for m in motions if not m.force] != ends for _, motions in files):
        question = Question(every, "test", "other responses than the files of the same hammer point beside them: a test = \"...\" of their own")
        return FromRecords((), 0.0, 0, (), (question,))
    scales, questions = _scales(files[0][1]), list[Question]()
    steps = {m.step for _, motions in files for m in motions}
    if max(steps) > min(steps) * (1 + 1e-6):
        questions.append(Question(every, "sample_rate_Hz", f"one sampling rate; its records have {listed(f'{1 / s:g} Hz' for s in sorted(steps))}"))
    if questions or scales is None:
        return FromRecords((), 0.0, 0, (), tuple(questions))
    step = min(steps)
    hits = []
    for path, motions in files:
        own, said = _hits(path, motions, step, form)
        hits += own
        notes += said
    good = []
    for hit in hits:
        if (fault := _fault(hit, ends, step, form)) is None:
            good.append(hit)
        else:
            notes.append(f"{hit.where}: left out, {fault}")
    if not good:
        what = f"all {len(hits)} hits are left out ({'; '.join(n.split(': left out, ')[-1] for n in notes[:3])})" if hits else "no hit is found in its force"
        return FromRecords((), 0.0, 0, tuple(notes), (Question(every, "records", f"a usable hit: {what}; double_hit_share and overload set what is refused"),))
    n = min(len(h.force) for h in good)
    pulse: Array = np.array([[h.force[:n] for h in good]], float) * scales[0]
    force = pulse * np.array([h.sense for h in good])[:, None]
    if (against := sum(h.sense < 0 for h in good)):
        notes.append(f"{name}: the force of {against} of {len(good)} hits is recorded negative, and is taken as it stands: a blow against the direction of {reference.label if reference.direction else 'its point'}")
    response: Array = np.array([[h.response[:, :n] for h in good]]) * np.array(scales[1:])[:, None]
    end = form.exponential_end or _needed(response)
    decay = -np.log(end) / (n * step)
    band = (form.band_Hz[0], form.band_Hz[1]) if form.band_Hz else _within(_band(force, step), measured)
    contact = max(_contact(f, step) for f in pulse[0])
    windows = Windows(contact + 1e-3, float(decay))
    found = estimate(step * np.arange(float(n)), force, response, windows, band, tuple(range(len(ends))), (0,))
    from_ = 0 if form.band_Hz else _first(found.h1, len(good))
    lines = slice(from_, None)
    if len(good) == 1:
        notes.append(f"{name}: a single hit: FRFs without coherence and standard errors")
    of = {"H1": found.h1.value, "H2": found.h2, "Hv": np.sqrt(np.abs(found.h1.value) * np.abs(found.h2)) * np.exp(1j * np.angle(found.h1.value))}
    curves = []
    for i, end_of in enumerate(ends):
        motion = [m for m in files[0][1] if not m.force][i]
        told = units.of_response(motion.unit)
        assert told is not None
        several = len(good) > 1
        coherence, sd = (None if v is None or not several else v[i, 0, lines] for v in (found.h1.coherence, found.h1.sd))
        curves.append(
            Curve(files[0][0], motion.where, end_of, reference, found.h1.frequency[lines], of[form.estimator][i, 0, lines], told[0], SI[told[0]], coherence, sd)
        )
    notes.append(
        f"{name}: {len(good)} of {len(hits)} hits, {form.estimator}, {found.h1.frequency[from_] if from_ else band[0]:.4g} to {band[1]:.4g} Hz in steps of {1 / (n * step):.4g} Hz, "
        + ("no exponential window" if end == 1 else f"exponential window down to {end:g}")
        + ("; below, nothing is coherent with the force" if from_ else "")
    )
    pushed = np.where(pulse[0] > TOUCHING * pulse[0].max(axis=-1, keepdims=True), pulse[0], 0.0)
    middle = step * float((pushed @ (np.arange(float(n)) + 0.5) / pushed.sum(axis=-1)).mean())
    return FromRecords(tuple(curves), float(decay), len(good), tuple(notes), (), middle)


SI = {"receptance": "m/N", "mobility": "(m/s)/N", "accelerance": "(m/s^2)/N"}


def open_units(name: str, motions: Sequence[Motion]) -> list[Question]:
    """Questions for the channels of a file whose unit is not told, or unknown."""
    open_ = [m for m in motions if (units.of_force if m.force else units.of_response)(m.unit) is None]
    return [Question(name, "columns", f"the unit of its {_channel(m)}; found is {m.unit or 'none'!r}", (m.where,)) for m in open_]


def _channel(motion: Motion) -> str:
    return f'force {motion.where!r}, as in "force [N]"' if motion.force else f'response {motion.where!r}, as in "response 3 [m/s^2]"'


def _scales(motions: Sequence[Motion]) -> list[float] | None:
    """Factors to SI of the force and of every response; None where a unit is not told, which `open_units` asks."""
    force = units.of_force(next(m for m in motions if m.force).unit)
    told = [units.of_response(m.unit) for m in motions if not m.force]
    return None if force is None or None in told else [force, *(t[1] for t in told if t is not None)]


def _check_numbers(path: Path, motions: Sequence[Motion]) -> None:
    """`BadInput` for the first sample that is no number, of which one makes a whole spectrum none."""
    for m in motions:
        wrong = np.argwhere(~np.isfinite(m.value))
        if len(wrong):
            row, sample = wrong[0]
            hit = f" of row {row + 1}" if len(m.value) > 1 else ""
            more = f", and {len(wrong) - 1} more of it are none either" if len(wrong) > 1 else ""
            raise BadInput(f"{path}: {m.where}: sample {sample + 1}{hit} is {m.value[row, sample]:g}, which is no number{more}; take the hit out of the file, or export it again")


def _hits(path: Path, motions: Sequence[Motion], step: float, form: RecordForm) -> tuple[list[Hit], list[str]]:
    """The hits of one file: rows where it has several, else what stands around each pulse of one long record; and notes."""
    forces = next(m for m in motions if m.force).value
    moving = [m for m in motions if not m.force]
    responses = np.stack([m.value for m in moving], axis=1)  # (hits, channels, n)
    accelerations: Array = np.array([(units.of_response(m.unit) or ("", 0.0))[0] == "accelerance" for m in moving])
    lead = round(PRE_TRIGGER / step)
    found: list[Hit] = []
    drifts: list[Array] = []
    strongest = max(np.abs(f - np.median(f)).max() for f in forces)
    for force, response in zip(forces, responses, strict=True):
        quiet = force - np.median(force)
        sense = float(np.sign(quiet[np.argmax(np.abs(quiet))]))
        quiet = sense * quiet
        starts = _starts(quiet, strongest, round(form.apart_s / step))
        length = round(form.hit_length_s / step) if form.hit_length_s else min([*np.diff(starts), len(force) - (starts[-1] if starts else 0) + lead])
        for start in starts:
            where = f"{path.name}: hit {len(found) + 1}" if len(starts) > 1 or len(forces) > 1 else path.name
            first = start - lead
            if start + min(length, round(form.apart_s / step)) - lead > len(force) or (form.hit_length_s and first + length > len(force)):
                continue  # the record ends with it
            pad = max(-first, 0)
            cut = slice(max(first, 0), first + length)
            before = response[:, max(start - BEFORE * lead, 0) : start]
            still, drift = _still(response[:, cut], before, lead - pad, accelerations)
            drifts.append(drift)
            found.append(Hit(where, np.pad(quiet[cut], (pad, 0)), sense, np.pad(still, ((0, 0), (pad, 0))), response[:, cut]))
    worst = np.max(drifts, axis=0, initial=0.0) if drifts else np.zeros(len(moving))
    wandering = [f"{m.where} {f'{d:.0%}' if d < 1 else 'more than its answer'}" for m, d in zip(moving, worst, strict=True) if d > TOLD]
    return found, [f"{path.name}: offset and drift taken out, in shares of the largest value: {', '.join(wandering)}"] if wandering else []


def _still(response: Array, before: Array, lead: int, accelerations: Array) -> tuple[Array, Array]:
    """Responses (channels, n) without what their sensors held before the blow, when nothing moves, and its share (channels,) of the largest value.

    `before` (channels, k) is that time, which ends `lead` samples into the responses. What was hit may go on at a constant speed or to another place, but no acceleration stays: of one, the straight
    line to its mean over the last tenth is taken out, which is the drift of a charge amplifier.
    """
    n, k = response.shape[-1], before.shape[-1]
    tail = max(n // 10, 1)
    last = response[:, -tail:].mean(axis=-1)
    first = before.mean(axis=-1) if k >= FEWEST else np.where(accelerations, last, 0.0)
    slope = np.where(accelerations, last - first, 0.0) / (n - tail / 2 + k / 2 - lead)
    line = first[:, None] + slope[:, None] * (np.arange(n) + k / 2 - lead)
    still = response - line
    return still, np.abs(line).max(axis=-1) / np.maximum(np.abs(still).max(axis=-1), np.finfo(float).tiny)


def _starts(force: Array, strongest: float, apart: int) -> list[int]:
    """Samples at which hits begin: pulses that are at least `apart` samples from the one before."""
    above = np.flatnonzero(force > WEAK * strongest)
    if len(above) == 0:
        return []
    first = above[np.r_[True, np.diff(above) > apart]]
    starts = []
    for index in first.tolist():
        while index > 0 and force[index - 1] > TOUCHING * WEAK * strongest:
            index -= 1
        starts.append(index)
    return starts


def _fault(hit: Hit, ends: Sequence[End], step: float, form: RecordForm) -> str | None:
    """Why a hit cannot be used; None where it can."""
    channels = [("force", hit.force), *((e.label or "response", r) for e, r in zip(ends, hit.recorded, strict=True))]
    for name, value in channels:
        limit = form.overload.get(name)
        called = f"response {name}" if name.isdigit() else name
        if limit is not None and np.abs(value).max() >= limit:
            return f"overload: {called} reaches {np.abs(value).max():.4g}, limit {limit:g}"
        if held := _held(value):
            return f"overload: {called} reaches {value[np.argmax(np.abs(value))]:.4g} and never more, {held} times"
    peak = int(np.argmax(hit.force[: round((PRE_TRIGGER + form.apart_s) / step)]))
    after = hit.force[peak:]
    released = np.flatnonzero(after < TOUCHING * hit.force[peak])
    if len(released):
        rest = after[released[0] :]
        noise = 1.4826 * float(np.median(np.abs(hit.force[len(hit.force) // 2 :])))
        second = float(rest.max())
        if second > max(form.double_hit_share * hit.force[peak], NOISE * noise):
            return f"double hit: {second / hit.force[peak]:.0%} of the first pulse, {1e3 * step * (released[0] + int(np.argmax(rest))):.3g} ms after it"
    return None


def _held(value: Array) -> int:
    """How often a channel stands exactly at an extreme where that tells an overload, else 0."""
    steps = np.abs(np.diff(value))
    smallest = steps[steps > 0].min(initial=np.inf)
    for extreme in (value.max(), value.min()):
        if abs(extreme) < 0.5 * np.abs(value).max() or abs(extreme) < STEPS * smallest:
            continue
        held = int(np.count_nonzero(value == extreme))
        if held >= HELD:
            return held
    return 0


def _needed(response: Array) -> float:
    """End value of the exponential window: one where every response has died away within its record."""
    tail = np.abs(response[..., -response.shape[-1] // 20 :]).max(axis=(-1, 1))
    floor = np.abs(response).max(axis=(-1, 1))
    return 1.0 if bool(np.all(tail <= DECAYED * floor)) else ENDS_AT


def _band(force: Array, step: float) -> tuple[float, float]:
    """From the second line to where the hammer's force has fallen to `REACH`, at most 0.4 of the sampling rate."""
    spectrum = np.sqrt(np.mean(np.abs(np.fft.rfft(force[0])) ** 2, axis=0))
    frequency = np.fft.rfftfreq(force.shape[-1], step)
    fallen = np.flatnonzero((spectrum < REACH * spectrum.max()) & (np.arange(len(spectrum)) > np.argmax(spectrum)))
    high = frequency[fallen[0]] if len(fallen) else frequency[-1]
    return float(frequency[2]), float(min(high, 0.4 / step))


def _within(excited: tuple[float, float], measured: tuple[float, float] | None) -> tuple[float, float]:
    """What the hammer excites of the band that the scene is measured in: what lies beyond has modes of its own, which the scene does not speak of; all of it where they share none."""
    low, high = max(excited[0], measured[0]) if measured else excited[0], min(excited[1], measured[1]) if measured else excited[1]
    return (low, high) if low < high else excited


def _first(frf: Frf, hits: int) -> int:
    """The first line from which some response is coherent with the force, over a hundredth of the lines: what an accelerometer says of slow motion is noise and drift alone.

    Noise has a coherence of 1 / hits in the mean, and exceeds 1 - p^(1 / (hits - 1)) with probability p (Carter, *Proc. IEEE* 75 (1987) 236).
    """
    if frf.coherence is None:
        return 0
    least = max(HEARD, 1 - 0.1 ** (1 / (hits - 1)))
    every = frf.coherence.reshape(-1, len(frf.frequency))
    near = max(len(frf.frequency) // 100, 5)
    heard = np.array([np.quantile(every[:, k : k + near], 0.25, axis=-1).max() > least for k in range(len(frf.frequency) - near + 1)])
    return int(np.argmax(heard)) if heard.any() else 0


def _contact(force: Array, step: float) -> float:
    """Duration (s) of the hammer's contact."""
    return float(np.count_nonzero(np.abs(force) > TOUCHING * np.abs(force).max())) * step
