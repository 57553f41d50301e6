"""How visible what is hidden is: what of its change of the FRFs tolerances and the model's own constant errors could not take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.blind.campaigns import Made
from tests.blind.hidden import Hidden
from tests.blind.laws import REFERENCE
from tests.blind.world import World, answer
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.tolerance import toleranced
from thermospindle.model.types import Array, ComplexArray


def visibility(made: Made, spindle: Spindle, lines: int = 160) -> list[float]:
    """Of every hidden piece: its change of the FRFs in standard errors, after all that build tolerances, temperatures, gains and each mode's
    constant error, and what couples any two, can take of it. Linear, about the built spindle; sqrt(10) is worth 5 in ln evidence. Of the piece itself and of a hundredth of it times a
    hundred the smaller: what moves peaks by many widths is no longer what small tolerances do, but a larger tolerance may do the same."""
    hammer = spindle.hammer
    frequency = np.linspace(*hammer.band, lines)
    plain = replace(made.world, stiffness_error=0.0, damping_error=0.0)

    def all_tests(s: Spindle, hidden: Sequence[Hidden] = (), warmer: float = 0.0) -> list[ComplexArray]:
        return [answer(s, Condition(p.temperature + warmer, p.speed), plain, hidden, p.place(spindle)).frf(frequency) for p in made.plans]

    base = all_tests(made.built)
    dense = made.campaign.tests[0].frf.frequency.size / lines  # type: ignore[union-attr]
    sd = []
    for v in base:
        largest = np.abs(v).max(axis=(0, 2), keepdims=True)
        of_value = hammer.noise_of_value * (made.record.kind == "line")
        sd.append(made.record.times * np.sqrt((of_value * np.abs(v)) ** 2 + (hammer.noise_of_largest * largest) ** 2) / np.sqrt(dense))

    def column(values: Sequence[ComplexArray]) -> Array:
        z = np.concatenate([((v - b) / s).ravel() for v, b, s in zip(values, base, sd, strict=True)])
        return np.concatenate([z.real, z.imag]) * np.sqrt(2)

    columns = []
    for parameter in toleranced(spindle):
        small = parameter.sd / 10
        columns.append(column(all_tests(parameter.apply(made.built, small))) * 10)
    warm = all_tests(made.built, (), 0.02)
    for k in range(len(base)):
        columns.append(
            column([w if i == k else b for i, (w, b) in enumerate(zip(warm, base, strict=True))]) * spindle.tolerances.temperature / 0.02
        )
    for i in range(len(spindle.points)):
        pick = (np.arange(len(spindle.points)) == i)[:, None, None]
        columns.append(column([b * (1 + spindle.tolerances.gain * pick) for b in base]))
        for k in range(len(base)):
            columns.append(column([b * (1 + made.world.gain_drift * pick * (j == k)) for j, b in enumerate(base)]))
    columns += _modal_columns(made, column, frequency, plain, spindle)
    a = np.array(columns).T
    lower = np.linalg.cholesky(np.eye(a.shape[1]) + a.T @ a)
    found = []
    for h in made.hidden:
        seen = []
        for share in (1.0, 0.01):
            d = column(all_tests(made.built, [replace(h, size=share * h.size)])) / share
            seen.append(float(np.sqrt(max(d @ d - np.sum(np.linalg.solve(lower, a.T @ d) ** 2), 0.0))))
        found.append(min(seen))
    return found


def _modal_columns(made: Made, column, frequency: Array, plain: World, spindle: Spindle) -> list[Array]:
    """Every mode's constant stiffness and damping error, and what couples every two of them, one at a time."""
    answers = [answer(made.built, Condition(p.temperature, p.speed), plain) for p in made.plans]
    reference = answer(made.built, Condition(REFERENCE), plain).linear
    root = np.sqrt(np.diag(reference.mass))
    square, vectors = np.linalg.eigh(reference.stiffness / root[:, None] / root[None, :])
    back = root[:, None] * vectors
    seen = np.flatnonzero((square > 1.0) & (square < (2 * np.pi * 1.2 * spindle.hammer.band[1]) ** 2))
    v = back[:, seen] * np.sqrt(square[seen])
    one, two = np.triu_indices(len(seen), 1)
    plainly = [at.frf(frequency) for at in answers]
    moved = []
    for at in answers:
        by_one = at.by_modes(frequency, v)
        by_sum = at.by_modes(frequency, v[:, one] + v[:, two])  # (v + w)(v + w)^T less v v^T and w w^T couples the two
        moved.append([np.concatenate([of_one, of_sum - of_one[one] - of_one[two]]) for of_one, of_sum in zip(by_one, by_sum, strict=True)])
    omega = np.sqrt(np.concatenate([square[seen], np.sqrt(square[seen][one] * square[seen][two])]))
    found = []
    for j, w in enumerate(omega):
        for kind, size in enumerate((2 * made.world.stiffness_error, made.world.damping_error * 0.02 / w)):
            if size:
                found.append(column([p + size * m[kind][j] for p, m in zip(plainly, moved, strict=True)]))
    return found
