"""Hits of a hammer: found in the records of its force, taken out of them without what their sensors held before, and judged.

A hit cannot be used where a channel was overloaded (its extreme reached three times exactly, by it or by another hit of its
record, or beyond what the mapping says) or where the hammer struck twice, and is none where the record ends before it does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.types import Array
from thermospindle.sim.hammer.pulse import PRE_TRIGGER
from thermospindle.sim.importing import units
from thermospindle.sim.importing.mapping import RecordForm
from thermospindle.sim.importing.measured import End, Motion

TOUCHING = 0.05  # of a hit's peak, above which the hammer touches
WEAK = 0.15  # of the strongest hit of a record; weaker ones are no hits
NOISE = 6.0  # standard deviations of the force's noise, which no second pulse is
HELD = 3  # samples at exactly the extreme that tell an overload
BEFORE = 5  # times the lead of a hit, over which its channels' offsets are averaged
FEWEST = 8  # samples before a hit that tell an offset
TOLD = 0.01  # of a channel's largest value, from which an offset is worth a note
SAME = 5e-5  # of the limit that one hit tells, within which another has reached it: two steps of 16 bits, for the lower end of their range is one further off than the upper
STEPS = 200  # of quantisation within an extreme, below which held samples tell nothing


@dataclass(frozen=True, eq=False)
class Hit:
    """One hit: the `force` (n,) of its pulse counted positive, and its `sense`, -1 where it was recorded
    negative; `response` (channels, n), `PRE_TRIGGER` before it, the response as `recorded` too; `where` names it."""

    where: str
    force: Array
    sense: float
    response: Array
    recorded: Array


def check_numbers(path: Path, motions: Sequence[Motion]) -> None:
    """`BadInput` for the first sample that is no number, of which one makes a whole spectrum none."""
    for m in motions:
        wrong = np.argwhere(~np.isfinite(m.value))
        if len(wrong):
            row, sample = wrong[0]
            hit = f" of row {row + 1}" if len(m.value) > 1 else ""
            more = f", and {len(wrong) - 1} more of it are none either" if len(wrong) > 1 else ""
            raise BadInput(f"{path}: {m.where}: sample {sample + 1}{hit} is {m.value[row, sample]:g}, which is no number{more}; take the hit out of the file, or export it again")


def hits_of(path: Path, motions: Sequence[Motion], step: float, form: RecordForm) -> tuple[list[Hit], list[str]]:
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
    """Responses (channels, n) without what their sensors held before the blow, when nothing moves,
    and its share (channels,) of the largest value.

    `before` (channels, k) is that time, which ends `lead` samples into the responses. What was hit
    may go on at a constant speed or to another place, but no acceleration stays: of one, the straight
    line to its mean over the last tenth is taken out, which is the drift of a charge amplifier.
    """
    n, k = response.shape[-1], before.shape[-1]
    tail = max(n // 10, 1)
    last = response[:, -tail:].mean(axis=-1)
    first = before.mean(axis=-1) if k >= FEWEST else np.where(accelerations, last, 0.0)
    slope = np.where(accelerations, last - first, 0.0) / (n - tail / 2 + k / 2 - lead)
    line = first[:, None] + slope[:, None] * (np.arange(n) + (k + 1) / 2 - lead)
    still = response - line
    least = np.maximum(np.finfo(float).eps * np.abs(response).max(axis=-1), np.finfo(float).tiny)  # of what is a line and nothing else
    return still, np.abs(line).max(axis=-1) / np.maximum(np.abs(still).max(axis=-1), least)


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


@dataclass(frozen=True)
class Limit:
    """The `size` at which a channel stands `held` times in the hit `where`, and beyond which no hit of its record goes."""

    size: float
    held: int
    where: str


def limits_of(hits: Sequence[Hit]) -> list[Limit | None]:
    """The limits that the hits of one record tell, of the force and of every response; None of a channel that none of them overloads."""
    found: list[Limit | None] = []
    for by_hit in zip(*([h.force, *h.recorded] for h in hits), strict=True):
        told = [Limit(abs(held[0]), held[1], h.where) for h, value in zip(hits, by_hit, strict=True) if (held := _held(value))]
        largest = max(float(np.abs(value).max()) for value in by_hit)
        found.append(next((limit for limit in told if largest <= limit.size * (1 + SAME)), None))
    return found


def fault(hit: Hit, ends: Sequence[End], step: float, form: RecordForm, limits: Sequence[Limit | None]) -> str | None:
    """Why a hit cannot be used, `limits` being those of its record; None where it can."""
    channels = [("force", hit.force), *((e.label or "response", r) for e, r in zip(ends, hit.recorded, strict=True))]
    for (name, value), of_record in zip(channels, limits, strict=True):
        limit, largest = form.overload.get(name), float(np.abs(value).max())
        called = f"response {name}" if name.isdigit() else name
        if limit is not None and largest >= limit:
            return f"overload: {called} reaches {largest:.4g}, limit {limit:g}"
        if held := _held(value):
            return f"overload: {called} reaches {held[0]:.4g} and never more, {held[1]} times"
        if of_record is not None and largest >= of_record.size * (1 - SAME):
            return f"overload: {called} reaches {value[np.argmax(np.abs(value))]:.4g}, the limit at which {of_record.where.rpartition(': ')[-1]} stands {of_record.held} times"
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


def _held(value: Array) -> tuple[float, int] | None:
    """The extreme at which a channel stands exactly, and how often, where that tells an overload."""
    steps = np.abs(np.diff(value))
    smallest = steps[steps > 0].min(initial=np.inf)
    for extreme in (value.max(), value.min()):
        if abs(extreme) < 0.5 * np.abs(value).max() or abs(extreme) < STEPS * smallest:
            continue
        held = int(np.count_nonzero(value == extreme))
        if held >= HELD:
            return float(extreme), held
    return None
