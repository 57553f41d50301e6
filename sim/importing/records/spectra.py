"""FRFs of the hits of one hammer point, with coherence and standard errors by `sim.hammer.estimate`.

H1, H2 and Hv (their geometric mean, with the phase of H1) are Bendat & Piersol, *Random Data*
(2010), ch. 6; Rocklin, Crowley and Vold (IMAC 1985) for Hv.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.hammer.estimate import Estimate, Windows, estimate
from thermospindle.sim.importing import units
from thermospindle.sim.importing.mapping import RecordForm
from thermospindle.sim.importing.measured import Curve, End, Motion, Question, listed
from thermospindle.sim.importing.records.grouped import Records
from thermospindle.sim.importing.records.hits import TOUCHING, Hit, check_numbers, fault, hits_of, limits_of
from thermospindle.sim.importing.records.windows import ENDS_AT, contact_time, end_needed, excited, first_heard, shared

FEWEST_HITS, CLIPPED, BESIDE = 3, 0.03, 3.0  # hits of which one can be told from the others; ln of a factor that is worth a note, and beside what the others differ by
ALIKE = 1.1  # times the shortest hits of a test, up to which others are cut to these
SI = {"receptance": "m/N", "mobility": "(m/s)/N", "accelerance": "(m/s^2)/N"}


@dataclass(frozen=True, eq=False)
class FromRecords:
    """FRFs made of time records, the damping (1/s) of the window left in them, the time (s) from a
    record's start to the middle of its hit, the length (s) of each hit, and what was done and asked."""

    curves: tuple[Curve, ...]
    window_decay: float
    hits: int
    notes: tuple[str, ...]
    questions: tuple[Question, ...]
    pretrigger: float = 0.0
    length: float = 0.0


def of_records(groups: Records, form: RecordForm, measured: tuple[float, float] | None = None) -> dict[tuple[str, End], FromRecords]:
    """The FRFs of every hammer point of every test (`frfs_of`). A test has one window: where one of its
    points needs it, all have it, whose damping is in all their FRFs then. And it has one length of hits, for
    its lines to be the same: the shortest where others are little longer, as by the jitter of a trigger."""
    found = {(test, reference): frfs_of(files, reference, form, measured) for (test, reference), files in groups.items()}
    windowed = {test for (test, _), made in found.items() if made.window_decay > 0}
    shortest: dict[str, float] = {}
    for (test, _), made in found.items():
        if made.curves:
            shortest[test] = min(made.length, shortest.get(test, made.length))
    for (test, reference), made in found.items():
        if made.curves:
            end = {"exponential_end": ENDS_AT} if test in windowed and made.window_decay == 0 else {}
            length = {"hit_length_s": shortest[test]} if shortest[test] < made.length <= ALIKE * shortest[test] else {}
            if end or length:
                found[test, reference] = frfs_of(groups[test, reference], reference, form.model_copy(update=end | length), measured)
    return found


def frfs_of(files: Sequence[tuple[Path, Sequence[Motion]]], reference: End, form: RecordForm, measured: tuple[float, float] | None = None) -> FromRecords:
    """The FRFs of all records that one hammer point made, each file with its force and responses;
    where `form` has no band, within the one that the scene is `measured` in (Hz).

    Raises `BadInput` for a sample that is no number.
    """
    for path, motions in files:
        check_numbers(path, motions)
    names = list(dict.fromkeys(path.name for path, _ in files))
    every, name = ", ".join(names), listed(names)
    moving = [m for m in files[0][1] if not m.force]
    scales = [_scales(motions) for _, motions in files]
    if (question := _apart(files, every)) is not None or None in scales:
        return FromRecords((), 0.0, 0, (), () if question is None else (question,))
    step = min(m.step for _, motions in files for m in motions)
    good, hits, notes = _usable(files, [s for s in scales if s is not None], step, form)
    if not good:
        why = dict.fromkeys(n.split(": left out, ")[-1] for n in notes if ": left out, " in n)
        what = f"all {hits} hits are left out ({listed(why, 3)})" if hits else "no hit is found in its force"
        return FromRecords((), 0.0, 0, tuple(notes), (Question(every, "records", f"a usable hit: {what}; double_hit_share and overload set what is refused"),))
    if against := sum(h.sense < 0 for h in good):
        to = reference.label if reference.direction else "its point"
        notes.append(f"{name}: the force of {against} of {len(good)} hits is recorded negative, and is taken as it stands: a blow against the direction of {to}")
    n = min(len(h.force) for h in good)
    pulse: Array = np.array([[h.force[:n] for h in good]], float)
    response: Array = np.array([[h.response[:, :n] for h in good]])
    end = form.exponential_end or end_needed(response)
    decay = float(-np.log(end) / (n * step))
    band = (form.band_Hz[0], form.band_Hz[1]) if form.band_Hz else shared(excited(pulse, step), measured)
    windows = Windows(max(contact_time(f, step) for f in pulse[0]) + 1e-3, decay)
    force = pulse * np.array([h.sense for h in good])[:, None]
    found = estimate(step * np.arange(float(n)), force, response, windows, band, tuple(range(len(moving))), (0,))
    first = 0 if form.band_Hz else first_heard(found.h1, len(good))
    curves = tuple(_curve(files[0][0], m, i, reference, found, form.estimator, first, len(good) > 1) for i, m in enumerate(moving))
    if len(good) == 1:
        notes.append(f"{name}: a single hit: FRFs without coherence and standard errors")
    notes += [
        f"{hit.where}: its FRFs are {100 * off:+.0f} % off those of the other {len(good) - 1} hits on all channels at all lines, as those of a force that was clipped are; overload = {{ force = ... }} of the mapping leaves such hits out"
        for hit, off in zip(good, _otherwise_large(found.per_hit[..., first:]), strict=True)
        if off
    ]
    notes.append(
        f"{name}: {len(good)} of {hits} hits, {form.estimator}, {found.h1.frequency[first] if first else band[0]:.4g} to {band[1]:.4g} Hz in steps of {1 / (n * step):.4g} Hz, "
        + ("no exponential window" if end == 1 else f"exponential window down to {end:g}")
        + ("; below, nothing is coherent with the force" if first else "")
    )
    pushed = np.where(pulse[0] > TOUCHING * pulse[0].max(axis=-1, keepdims=True), pulse[0], 0.0)
    middle = step * float((pushed @ (np.arange(float(n)) + 0.5) / pushed.sum(axis=-1)).mean())
    return FromRecords(curves, decay, len(good), tuple(notes), (), middle, n * step)


def _otherwise_large(per_hit: ComplexArray) -> list[float]:
    """By what share the FRFs (hits, responses, 1, lines) of every hit are larger than those of the
    others, where that is the same on all channels at most lines, and more than these differ by; else 0."""
    size = np.abs(per_hit).reshape(len(per_hit), -1, per_hit.shape[-1])
    size = size[:, np.all(size > 0, axis=(0, 2))]  # NaN of a dead force, 0 of a dead response
    if len(size) < FEWEST_HITS or not size.size:
        return [0.0] * len(size)
    strong = np.median(size, axis=0)
    heard = strong >= np.median(strong, axis=-1, keepdims=True)
    found = []
    for k, own in enumerate(size):
        others = np.delete(size, k, axis=0)
        usual = np.median(others, axis=0)
        by_channel = [float(np.median(row[h])) for row, h in zip(np.log(own / usual), heard, strict=True)]
        scatter, off = float(np.median(np.abs(np.log(others / usual))[:, heard])), float(np.median(by_channel))
        alike = max(abs(one - off) for one in by_channel) < abs(off) / 2
        found.append(float(np.expm1(off)) if alike and abs(off) > max(CLIPPED, BESIDE * scatter) else 0.0)
    return found


def _apart(files: Sequence[tuple[Path, Sequence[Motion]]], names: str) -> Question | None:
    """What is asked where the files of one hammer point are no one test."""
    ends = [[m.end for m in motions if not m.force] for _, motions in files]
    if any(of != ends[0] for of in ends):
        return Question(names, "test", 'other responses than the files of the same hammer point beside them: a test = "..." of their own')
    quantities = [[told[0] if told else "" for m in motions if not m.force for told in [units.of_response(m.unit)]] for _, motions in files]
    if different := [of for of in map(set, zip(*quantities, strict=True)) if len(of - {""}) > 1]:  # of one that is not told the file is asked
        return Question(names, "columns", f"responses of one quantity in all files of a hammer point; some are {listed(sorted(different[0]))}")
    steps = {m.step for _, motions in files for m in motions}
    if max(steps) > min(steps) * (1 + 1e-6):
        return Question(names, "sample_rate_Hz", f"one sampling rate; its records have {listed(f'{1 / s:g} Hz' for s in sorted(steps))}")
    return None


def _usable(files: Sequence[tuple[Path, Sequence[Motion]]], scales: Sequence[Sequence[float]], step: float, form: RecordForm) -> tuple[list[Hit], int, list[str]]:
    """The hits of all files that can be used, in SI by the `scales` of each file, of how many, and why others cannot."""
    ends = [m.end for m in files[0][1] if not m.force]
    good: list[Hit] = []
    notes: list[str] = []
    left_out: list[str] = []
    hits = 0
    for (path, motions), (force, *moved) in zip(files, scales, strict=True):
        own, said = hits_of(path, motions, step, form)
        hits += len(own)
        notes += said
        limits = limits_of(own)
        for hit in own:
            if (wrong := fault(hit, ends, step, form, limits)) is None:
                good.append(replace(hit, force=force * hit.force, response=np.array(moved)[:, None] * hit.response))
            else:
                left_out.append(f"{hit.where}: left out, {wrong}")
    return good, hits, notes + left_out


def _curve(file: Path, motion: Motion, i: int, reference: End, found: Estimate, estimator: str, first: int, several: bool) -> Curve:
    """The FRF of response `i` from line `first`, with coherence and standard errors where `several` hits tell them."""
    lines = slice(first, None)
    h1, h2 = found.h1, found.h2
    of = {"H1": h1.value, "H2": h2, "Hv": np.sqrt(np.abs(h1.value) * np.abs(h2)) * np.exp(1j * np.angle(h1.value))}
    told = units.of_response(motion.unit)
    assert told is not None
    coherence, sd = (None if v is None or not several else v[i, 0, lines] for v in (h1.coherence, h1.sd))
    return Curve(file, motion.where, motion.end, reference, h1.frequency[lines], of[estimator][i, 0, lines], told[0], SI[told[0]], coherence, sd)


def open_channels(name: str, motions: Sequence[Motion]) -> list[Question]:
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
