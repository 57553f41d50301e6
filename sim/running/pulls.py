"""By what one rolling element pulls on its rings for what it meets, at every azimuth at which it may stand.

An element at azimuth p that meets the amplitude a pulls the holder of the outer ring by pull(p) a, pull(p) = sum over m of pull_m
exp(i m p). Between centred rings all elements are pressed alike, and m is 0 (along the axis) or +-1 (across it). Rings that a radial
load displaces press them by azimuth: the row is then asked at many, and the harmonics are those of what it answers.

Of a ball, k the exact 2x2 stiffness of the line between its groove centres and e the direction of a contact, B its kinematics:
-B^T k for a race that is displaced, -B^T k_n e for a ball too thick at a contact, and what all balls feel of the
cage, whose speed changes with what each meets. Of a roller, s = c (10/9) d^(1/9) for every slice of it that is pressed by d.

A perfect row pulls as well: -B^T f at each ball, whose sum over the balls changes with the place of the cage. Between centred rings it does not.

Of an imperfection the harmonics below half the number of elements are taken. Through the higher ones it does what changes with the place of
the cage, and so does the motion that it makes through the lower ones, times the stiffness that changes with that place: of the same size, and
where a ring follows its race of opposite sign. Both are left out; neither is anything while all elements are pressed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import count, takewhile

import numpy as np

from thermospindle.model.bearing.ball_row import (
    BallRow,
    Rolled,
    as_forces,
    at_one_speed,
    azimuths,
    centre_line,
    kinematics,
    massless,
    respond,
)
from thermospindle.model.bearing.heavy_ball.balance import thicker
from thermospindle.model.bearing.heavy_ball.inertia import MANY
from thermospindle.model.bearing.roller import RollerRow, at_azimuths
from thermospindle.model.types import Array, ComplexArray

HIGHEST = 6
"""Harmonics of a perfect row are taken up to this multiple of the number of elements."""
CENTRED, FEWEST, PLACES = 4, 16, 16
"""Azimuths at which a row is asked: between centred rings; between displaced ones at first, twice as many as long as
harmonics beyond a quarter of them are something, and in the end so many for each element, as where some are loose."""
SETTLED = 1e-8
"""Of the largest harmonic, what is nothing beyond that quarter."""
NOTHING = 1e-9
"""Of the largest pull for an input, below which one is nothing."""
ROUNDED = 1e-12
"""Of the largest entry of a compliance, below which one is rounding."""


@dataclass(frozen=True, eq=False)
class Pulls:
    """`by[m]` (5, inputs): harmonic m of an element's pull on the outer ring's holder, in N and N m per m of what it meets.

    Of a ball the inputs are race displacements along r and z, the outer one's less the inner one's, and thickness at the inner and the outer contact; of
    a roller what presses it, one input for each row. `perfect[m]` (5,): the same of a row without imperfections (N, N m), empty between centred rings.
    `compliance` (5, 5) of the whole row, the inverse of its mean tangent over all places of its cage, nothing along what it does not resist;
    `lever` (m) makes a moment a force.
    """

    by: Mapping[int, ComplexArray]
    perfect: Mapping[int, ComplexArray]
    compliance: Array
    lever: float


@lru_cache(maxsize=128)
def pulls_of(row: BallRow | RollerRow, displacement: tuple[float, ...] = ()) -> Pulls:
    """Those of a row, at a displacement (5,) of its outer ring; centred where there is none."""
    return _of_balls(row, displacement) if isinstance(row, BallRow) else _of_rollers(row, displacement)


def in_forces(pulls: Pulls) -> dict[int, ComplexArray]:
    """Harmonics (5, inputs) of an element's pull as forces alone, N per m of what it meets."""
    return {m: as_forces(pulls.lever)[:, None] * pull for m, pull in pulls.by.items()}


def _of_balls(row: BallRow, displacement: tuple[float, ...]) -> Pulls:
    q = np.array(displacement or (0.0,) * 5)
    near = respond(row).rolled

    def at(places: int) -> tuple[Array, Array, Array]:
        fine = replace(row, balls=places)
        force, local = _heavy(fine, q, near) if near is not None else _light(fine, q)
        b = kinematics(fine)
        return -np.einsum("jpk,jp->jk", b, force)[:, :, None], -local, np.einsum("jki,jil->kl", local[:, :, :2], b) * row.balls / places

    return _pulls(at, row.balls, bool(displacement), row.arm)


def _pulls(at: Callable[[int], tuple[Array, Array, Array]], elements: int, displaced: bool, lever: float) -> Pulls:
    """Those of what a row answers `at` so many azimuths: pull of an element that is perfect (places, 5, 1),
    and by its inputs (places, 5, inputs); the row's mean tangent (5, 5)."""
    counts = [CENTRED] if not displaced else [*takewhile(lambda n: n < PLACES * elements, (FEWEST << k for k in count())), PLACES * elements]
    for places in counts:
        perfect, by, tangent = at(places)
        if _beyond(by, places // 4, lever) < SETTLED and _beyond(perfect, places // 4, lever) < SETTLED:
            break
    own = _harmonics(perfect, min(HIGHEST * elements, places // 2 - 1), lever) if displaced else {}
    most = min((elements - 1) // 2, places // 2 - 1) if displaced else 1
    return Pulls(_harmonics(by, most, lever), {m: g[:, 0] for m, g in own.items()}, _compliance(tangent, lever), lever)


def _beyond(pull: Array, number: int, lever: float) -> float:
    """The largest harmonic from such a number on, of the largest of all."""
    size = np.abs(np.fft.rfft(pull * as_forces(lever)[:, None], axis=0)).max(axis=(1, 2))
    return float(size[number:].max() / size.max()) if size.any() else 0.0


def _light(fine: BallRow, q: Array) -> tuple[Array, Array]:
    """Force (places, 2) on the outer groove's centre and what moves the ring (places, 5, 4), of balls without inertia."""
    line = centre_line(fine, q)
    force, stiffness, *_ = massless(fine, line)
    e = line / np.linalg.norm(line, axis=1)[:, None]
    push = np.einsum("jpq,jq->jp", stiffness, e)  # along the contact, k_n
    return force, np.einsum("jpk,jpi->jki", kinematics(fine), np.concatenate([stiffness, push[:, :, None], push[:, :, None]], axis=2))


def _heavy(fine: BallRow, q: Array, near: Rolled) -> tuple[Array, Array]:
    """The same of balls with inertia, which are `near` where centred rings have them, with what all of them feel of the cage's speed."""
    assert fine.inertia is not None
    line = centre_line(fine, q)
    starts = np.full(fine.balls, near.centres[0][0]), np.full(fine.balls, near.centres[1][0])
    (cage, here, each), = at_one_speed([fine], [line], [Rolled(near.cage, starts)])
    b = kinematics(fine)
    force, stiffness = np.stack(here.on_outer, -1), np.stack(here.stiffness(), -1).reshape(-1, 2, 2)
    ball = replace(fine, inertia=replace(fine.inertia, cage=cage)).ball
    pushes: Array = np.array(thicker(ball, here, each, tuple(line.T), MANY)).T  # (places, 3, 2): r, z and speed, by inner and outer
    moved = np.einsum("jpk,jpi->jki", b, np.concatenate([stiffness, pushes[:, :2]], axis=2))
    if fine.inertia.cage is None:
        by_itself = 1.0 - float(np.mean(each.by_cage))
        own = np.concatenate([np.stack(each.by_line, -1), pushes[:, 2]], axis=1) / by_itself
        all_feel = np.mean(np.einsum("jpk,jp->jk", b, np.stack(each.force_by_cage, -1)), axis=0)
        moved = moved + all_feel[:, None] * own[:, None, :]
    return force, moved


def _of_rollers(row: RollerRow, displacement: tuple[float, ...]) -> Pulls:
    q = np.array(displacement or (0.0,) * 5)

    def at(places: int) -> tuple[Array, Array, Array]:
        outward, load, slope = at_azimuths(row, q, azimuths(places))
        tangent = np.einsum("jrs,jrsk,jrsl->kl", slope, outward, outward) * row.rollers / places
        return np.einsum("jrs,jrsk->jk", load, outward)[:, :, None], np.einsum("jrs,jrsk->jkr", slope, outward), tangent

    lever = row.length / 2 + max(np.abs(row.offsets))
    return _pulls(at, row.rollers, bool(displacement), lever)


def _harmonics(pull: Array, most: int, lever: float) -> dict[int, ComplexArray]:
    """Harmonics up to number `most` of pulls (places, 5, inputs), those that are something."""
    found = np.fft.fft(pull, axis=0) / len(pull)
    every = {m: found[m] for m in range(-most, most + 1)}
    size = {m: np.abs(g * as_forces(lever)[:, None]) for m, g in every.items()}
    large = NOTHING * np.max([own.max(axis=0) for own in size.values()], axis=0)
    kept = {m: np.where(size[m] > large, g, 0.0) for m, g in every.items()}
    return {m: g for m, g in kept.items() if g.any()}


def _compliance(tangent: Array, lever: float) -> Array:
    """Inverse of a row's tangent, nothing along what it does not resist."""
    unit = as_forces(lever)
    scaled = np.linalg.pinv(tangent * np.outer(unit, unit), rcond=ROUNDED)
    return np.where(np.abs(scaled) > ROUNDED * np.abs(scaled).max(), scaled, 0.0) * np.outer(unit, unit)
