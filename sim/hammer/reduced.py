"""Records of a hammer test by the reduced model, without MuJoCo: the linear spindle stepped
exactly, for long records and for beams too stiff to step.

M, C + G and K are projected on the basis of `model.rotor.reduced`, up to half the sampling rate and between the scene's points.
With the force held over a step the state (q, q') is carried on by the matrix exponential of its own equation (Franklin, Powell
& Workman, *Digital Control of Dynamic Systems*, 1998, 4.3), which has no error of its own at any step. What differs from the
whole linear model is the basis, 1e-5 of the largest response, and the images of the held force (`sim.hammer.test`), (pi f
step)^4 / 15 of a mass's FRF: the step is chosen so that this stays below `IMAGES` at the end of the band. Measured on
`five_bearing`, at lines where all points hardly move: 5e-5 of their rms (`tests/sim/hammer/test_reduced_records.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil

import numpy as np
import scipy

from thermospindle.model.drawing.measuring import HammerTest
from thermospindle.model.rotor.frf import point_rows
from thermospindle.model.rotor.reduced import Reduced, reduced
from thermospindle.model.types import Array
from thermospindle.sim.hammer.pulse import Hit, force
from thermospindle.sim.operating import OperatingPoint

IMAGES = 1e-5
MARGIN = 64  # samples of quiet simulated past the record, so that the anti-alias filter ends outside it
PIECES = 20  # of a record, after each of which progress is told


def with_long_step(test: HammerTest) -> HammerTest:
    """The settings with the longest step that divides the sampling interval and keeps the images of the held force small."""
    longest = (15 * IMAGES) ** 0.25 / (np.pi * test.band[1])
    return replace(test, step=1 / test.sample_rate / ceil(1 / test.sample_rate / longest))


def simulate_reduced(
    point: OperatingPoint, test: HammerTest, hits: Sequence[Sequence[Hit]], steps: int, progress: Callable[[str], None] = lambda done: None
) -> tuple[Array, Array]:
    """Held force (references, hits, steps) and mean velocity over the same steps (references, hits,
    responses, steps) of the hits on every hammer node."""
    rows = point_rows(point.spindle, point.chain)
    hammers = point_rows(point.spindle, point.chain, test.hammer_nodes)
    small = reduced(point.linear, np.concatenate([rows, hammers]), np.pi * test.sample_rate)
    held = np.array([[force(hit, test.step, steps) for hit in row] for row in hits])
    own, count = hammers @ small.basis, held.shape[1]
    carry, push = stepped(small, np.repeat(own, count, axis=0).T, test.step)
    seen = np.concatenate([rows @ small.basis, np.zeros((len(rows), len(small.mass)))], axis=1)
    read, at_once = seen @ (carry - np.eye(len(carry))) / test.step, seen @ push / test.step  # the way made in a step
    force_of = held.reshape(-1, steps)  # (references hits, steps)
    state = np.zeros((len(carry), len(force_of)))
    velocity = np.empty((len(force_of), len(rows), steps))
    for k, (first, after) in enumerate(pairwise(np.linspace(0, steps, PIECES + 1).astype(int).tolist()), 1):
        passed = np.empty((after - first, *state.shape))
        for i in range(first, after):
            passed[i - first] = state
            state = carry @ state + push * force_of[:, i]
        velocity[:, :, first:after] = (read @ passed).transpose(2, 1, 0) + at_once.T[:, :, None] * force_of[:, None, first:after]
        progress(f"{len(force_of)} hits, {k * 100 // PIECES} % of the records computed")
    return held, velocity.reshape(*held.shape[:2], len(rows), steps)


def stepped(small: Reduced, forces: Array, step: float) -> tuple[Array, Array]:
    """What carries the state (2r,) over a step, (2r, 2r), and what forces (r, m) held over it add, (2r, m)."""
    r, m = forces.shape
    inverse = np.linalg.inv(small.mass)
    whole = np.zeros((2 * r + m, 2 * r + m))
    whole[:r, r : 2 * r] = np.eye(r)
    whole[r : 2 * r, :r] = -inverse @ small.stiffness
    whole[r : 2 * r, r : 2 * r] = -inverse @ small.damping
    whole[r : 2 * r, 2 * r :] = inverse @ forces
    carried = scipy.linalg.expm(whole * step)
    return np.asarray(carried[: 2 * r, : 2 * r], float), np.asarray(carried[: 2 * r, 2 * r :], float)
