"""What a ladder shows, in sentences with numbers."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from thermospindle.diagnosis.decision.loss import NAMING
from thermospindle.diagnosis.ladder.forms import AS_DRAWN
from thermospindle.diagnosis.ladder.ladder import CLEAR, DISCREPANCY, MODES, TOLERANCES, Ladder
from thermospindle.diagnosis.ladder.step import Step
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.prediction.next_test import in_words
from thermospindle.diagnosis.verdict import Diagnosis
from thermospindle.report.typeset import plain, plain_error

CERTAIN = 1000.0  # odds, beyond which models are not to be trusted so far
STRETCHED = 2.0  # standard deviations from which a tolerance is named
MOST = 5  # things named in one sentence
CLOSE = 0.05  # relative distance of two modes that are called a pair
FURTHER = 1.5  # times the error of natural frequencies, from which it is said to rise
WRONG = 3.0  # standard errors from which a shift or a split is called wrong
MISSED = {kinds_of.STIFFNESS: "natural frequencies", kinds_of.DAMPING: "damping ratios"}


def sentences(found: Ladder) -> list[str]:
    """What the ladder shows, in words with numbers."""
    every = (_forms(found), _tolerances(found), _discrepancy(found), *_effects(found), _counted(found), *remaining(found), *_tests(found))
    return [s for s in every if s]


def _forms(found: Ladder) -> str:
    drawn = [r for r in found.steps if r.fitted is None]
    shifts = all(r.rms_shift_Hz is not None for r in drawn)
    errors = [
        f"{r.rms_shift_Hz if shifts else r.rms_Hz:.1f} Hz with {r.name}" + (f" ({'; '.join(r.lost_contact)})" if r.lost_contact else "")
        for r in drawn
    ]
    wrong = f"As drawn, {'shifts' if shifts else 'frequencies'} are wrong by {', '.join(errors)} (rms)."
    if len(found.forms) == 1:
        return wrong.replace(f" with {AS_DRAWN}", "")
    ranked = sorted(found.forms, key=lambda f: -f[3])
    lead = ranked[0][3] - ranked[1][3]
    verb = "leads" if lead > CLEAR else "does not clearly lead"
    free = f"With all tolerances and a constant discrepancy free, {ranked[0][0]} {verb} {ranked[1][0]} by {evidence(lead)} in ln evidence"
    return f"{wrong} {free}."


def _tolerances(found: Ladder) -> str:
    drawn, r = found.drawn, found.step(TOLERANCES)
    build = [(p.name, float(x)) for p, x in zip(r.model.parameters, r.nuisance, strict=True) if p.kind == kinds_of.BUILD]
    far = sorted((row for row in build if abs(row[1]) > STRETCHED), key=lambda row: -abs(row[1]))
    more = f" and {len(far) - MOST} more" if len(far) > MOST else ""
    named = ", ".join(f"{name} ({x:+z.1f})" for name, x in far[:MOST])
    paid = f"beyond {STRETCHED:g} standard deviations are {named}{more}" if far else "none goes far"
    return f"The tolerances take the error from {drawn.error:.2f} to {r.error:.2f} standard errors; {paid}."


def _discrepancy(found: Ladder) -> str:
    """How wrong the model is at all conditions alike, and what granting that does."""
    below, r = found.step(TOLERANCES), found.step(DISCREPANCY)
    assert r.fitted is not None
    known = MISSED if np.isfinite(found.measured.damping_sd).any() else {kinds_of.STIFFNESS: MISSED[kinds_of.STIFFNESS]}
    missed = [f"{what} by {100 * r.fitted.learned.sizes[kind]:g} %" for kind, what in known.items() if r.fitted.learned.sizes.get(kind)]
    if not missed:
        return "A constant discrepancy of the model is not asked for: what is missing changes with the conditions, or nothing is."
    return (
        f"Without an effect the data ask for a model that is wrong at all conditions alike, in {' and in '.join(missed)} or so; where that is granted, the error is {r.error:.2f} instead of "
        f"{below.error:.2f}, tolerances lie {r.stretch:.2f} instead of {below.stretch:.2f} standard deviations from the drawing (ln evidence {evidence(r.evidence - below.evidence, '+')})."
    ) + _further(below, r)


def _further(below: Step, r: Step) -> str:
    """That natural frequencies are further off where the error of all data falls, which goes by every line of FRFs."""
    if not (r.error < below.error and r.rms_Hz > FURTHER * below.rms_Hz):
        return ""
    return f" But natural frequencies are further off, {r.rms_Hz:.2f} instead of {below.rms_Hz:.2f} Hz rms: the fit gains on other numbers than these, and is to be believed only where `compare` shows FRFs that agree."


def _effects(found: Ladder) -> Iterator[str]:
    named = () if found.diagnosis is None or found.diagnosis.verdict.word not in NAMING else found.diagnosis.verdict.effects
    for r in (r for r in found.steps if r.effects):
        below = found.step(r.above)
        gain = r.evidence - below.evidence
        unseen = f"left out {below.held_out:.2f} -> {r.held_out:.2f}, " if np.isfinite(r.held_out) else ""
        change = f"error {below.error:.2f} -> {r.error:.2f}, {unseen}tolerances "
        change += f"{below.stretch:.2f} -> {r.stretch:.2f} s.d., ln evidence {evidence(gain, '+')}"
        own = r.effects[-1:] if r.name.startswith("+") else r.effects
        constant = r.evidence - found.step(DISCREPANCY).evidence
        if found.left_out == MODES and gain > 0 and constant < 0:
            verdict = f"is not established: a constant error of every frequency is likelier by {evidence(-constant)} in ln evidence"
        elif gain > CLEAR:
            verdict = "is supported"
        elif gain > 0 and set(own) <= set(named):
            verdict = f"is what the diagnosis names, which weighs it against all others; the {CLEAR:g} in ln evidence asked of a step alone it does not reach"
        elif gain > 0:
            verdict = f"is not established: {CLEAR:g} in ln evidence is asked"
        else:
            verdict = "is not asked for by these data"
        yield f"{' + '.join(own)} {verdict} ({change}){_at_limits(r)}."
    if found.left_out == MODES:
        yield from _modes_left_out(found)
    if found.diagnosis is not None:
        yield diagnosed(found.diagnosis)


def diagnosed(found: Diagnosis) -> str:
    return f"Diagnosis: {found.verdict.word}. {found.verdict.reason}"


def leading(found: Ladder) -> str:
    """What is said before the table: the diagnosis, or of a ladder of named effects what each of
    them does; without any, what is wrong as drawn."""
    return diagnosed(found.diagnosis) if found.diagnosis is not None else next(_effects(found), _forms(found))


def _at_limits(r: Step) -> str:
    """Sizes that stand at the limit of what they may be, where an effect does the work of another."""
    sizes = [(m.name, m.size, r.values[m.name][m.size.name][0]) for m in (r.fitted.mechanisms if r.fitted else ()) if m.name == r.effects[-1]]
    at = [f"{name}.{q.name} = {value:g}" for name, q, value in sizes if value in q.limits and value != q.neutral]
    return f", at the limit of what it may be, {' and '.join(at)}: it does the work of something else" if at else ""


def _modes_left_out(found: Ladder) -> Iterator[str]:
    """How well each mode is predicted from the others, at one condition."""
    rows = [f"{r.held_out_percent:.2g} % with {r.name}" for r in found.steps if r.fitted and np.isfinite(r.held_out_percent)]
    if rows:
        yield f"Frequencies of modes predicted from the others by fits that have not seen them are off by {', '.join(rows)} (rms)."


def _counted(found: Ladder) -> str:
    top = found.top
    assert top.fitted is not None  # tolerances are always fitted
    numbers, parameters = top.fitted.fit.count, len(top.fitted.fit.point)
    counted = (
        f"Step {top.name!r} has {parameters} parameters, all with priors, and {numbers} numbers, which decide {top.fitted.determined():.1f} "
        "combinations of them"
    )
    if parameters >= numbers:
        counted += "; with fewer numbers than parameters the data identify none of them alone: each value is a belief that the data moved"
    return counted + "."


def remaining(found: Ladder) -> Iterator[str]:
    """What is wrong with shifts and pairs, as drawn and at the top; nothing where none is measured, as at one condition."""
    for r in dict.fromkeys((found.drawn, found.top)):
        shifts, splits = sorted(_shifts(found, r), reverse=True), list(_splits(found, r))
        wrong = [words for residual, words in shifts if residual > WRONG][:MOST] + [words for residual, words in splits if residual > WRONG]
        measured = " and ".join(f"no {what}" for what, rows in (("shift", shifts), ("split", splits)) if rows)
        if wrong:
            yield f"Left over at step {r.name!r}: {'; '.join(wrong)}."
        elif r.fitted is not None and measured:
            yield f"Left over at step {r.name!r}: {measured} wrong by more than {WRONG:g} standard errors."


def _numbers(found: Ladder, r: Step) -> dict[tuple[int, int], tuple[float, float, float]]:
    """(measured Hz, computed Hz, standard error Hz) by test and mode number."""
    m = found.measured
    rows = zip(m.test.tolist(), m.number.tolist(), m.frequency.tolist(), r.frequency.tolist(), m.sd.tolist(), strict=True)
    return {(t, n): (measured, computed, sd) for t, n, measured, computed, sd in rows if n and np.isfinite(computed)}


def _ends(found: Ladder) -> tuple[int, int]:
    """The coldest and the hottest test at the lowest speed."""
    where = [(abs(o.condition.speed), o.condition.temperature, t) for t, o in enumerate(found.measured.observations)]
    slow = [w for w in where if w[0] == min(where)[0]]
    return min(slow)[2], max(slow)[2]


def _shifts(found: Ladder, r: Step) -> Iterator[tuple[float, str]]:
    """Of every mode from the coldest to the hottest test: by how many standard errors it is wrong, and how in words."""
    numbers, (cold, hot) = _numbers(found, r), _ends(found)
    for mode, kind in found.measured.kinds.items():
        if cold != hot and (cold, mode) in numbers and (hot, mode) in numbers:
            (m0, c0, s0), (m1, c1, s1) = numbers[cold, mode], numbers[hot, mode]
            sd = float(np.hypot(s0, s1))
            residual = abs((c1 - c0) - (m1 - m0)) / sd
            more = "moves more" if abs(m1 - m0) > abs(c1 - c0) else "moves less"
            how = "moves the other way" if (m1 - m0) * (c1 - c0) < 0 else more
            yield residual, f"mode {mode} ({kind}) {how} than computed, {m1 - m0:+z.1f} +- {sd:.2g} Hz against {c1 - c0:+z.1f}"


def _splits(found: Ladder, r: Step) -> Iterator[tuple[float, str]]:
    """Of every pair of neighbours in the coldest test: by how many standard errors its distance is wrong, and how in words."""
    numbers, cold, kinds = _numbers(found, r), _ends(found)[0], found.measured.kinds
    for one, two in pairwise(kinds):
        pair = [numbers[cold, m] for m in (one, two) if (cold, m) in numbers]
        if len(pair) == 2 and "axial" not in (kinds[one], kinds[two]):
            (m0, c0, s0), (m1, c1, s1) = pair
            sd = float(np.hypot(s0, s1))
            if abs(m1 - m0) < CLOSE * m0:
                where = found.measured.observations[cold].test.id
                yield abs((c1 - c0) - (m1 - m0)) / sd, f"modes {one} and {two} lie {m1 - m0:.1f} +- {sd:.2g} Hz apart in {where}, computed {c1 - c0:.1f}"


def _tests(found: Ladder) -> Iterator[str]:
    """The test that separates two explanations best, and the mode in which it shows most."""
    for t in found.tests[:1]:
        one, two = max(zip(*t.predictions, strict=True), key=lambda m: abs(m[0].frequency - m[1].frequency) / np.hypot(m[0].sd, m[1].sd))
        yield (
            f"A test {in_words(t.condition)} would separate {t.separates[0]} from {t.separates[1]}, at odds of {_odds(t.odds)} to 1 if either is "
            f"right: a mode would lie at {plain_error(one.frequency, one.sd)} Hz or at {plain_error(two.frequency, two.sd)} Hz."
        )


def _odds(odds: float) -> str:
    return plain(odds, 2) if odds < CERTAIN else f"more than {CERTAIN:g}"


def evidence(value: float, sign: str = "") -> str:
    if abs(value) < 0.05:
        return "0.0"
    return f"{value:{sign}.1f}" if abs(value) < 1e5 else f"{value:{sign}.2e}"
