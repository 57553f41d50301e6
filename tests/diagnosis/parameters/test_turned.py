"""A constant error of the stiffness between modes: it turns shapes, and frequencies are those that are stated."""

from __future__ import annotations

import numpy as np
import pytest

from thermospindle.diagnosis.parameters.reference import ReferenceModes

OMEGA = 2 * np.pi * np.array([700.0, 705.0, 1500.0, 1900.0, 4000.0, 7000.0])
SEEN = 4


def stated(size, seed=5):
    """Errors of `size` of every two modes of which one is seen, relative to their frequencies."""
    found = np.random.default_rng(seed).standard_normal((6, 6)) * size * np.outer(OMEGA, OMEGA)
    found = (found + found.T) / 2
    found[SEEN:, SEEN:] = 0.0
    return found


def reference(seen=SEEN):
    return ReferenceModes(OMEGA, np.full(6, 0.01), np.eye(6), tuple((str(i), "x") for i in range(6)), seen)


def frequencies(error):
    return np.sqrt(np.linalg.eigvalsh(np.diag(OMEGA**2) + error))


def test_frequencies_stay_as_stated():
    """Those of the error within modes that coincide alone; the rest would push them by a hundred
    times as much. Twice the error does eight times as much: the third order is left."""
    close = np.abs(np.subtract.outer(OMEGA, OMEGA)) < 0.1 * OMEGA
    off = []
    for size in (0.005, 0.01):
        own = stated(size)
        wanted = frequencies(np.where(close, own, 0.0))[:SEEN]
        with_it, without = (np.abs(frequencies(e)[:SEEN] / wanted - 1).max() for e in (reference().turned(own).whole, own))
        assert with_it < 0.1 * without
        off.append(with_it)
    assert off[1] / off[0] == pytest.approx(8, rel=0.5)


def test_shapes_turn_as_far_to_first_order():
    own = stated(1e-6)
    assert reference().turned(own).whole == pytest.approx(own, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("seen", [SEEN, 6])
def test_derivatives_by_pairs(seen):
    own = stated(0.02)
    i, j = np.triu_indices(6)
    i, j = i[i < SEEN], j[i < SEEN]
    vectors = reference(seen).turned(own).by_pairs(i, j).T
    for k, (a, b) in enumerate(zip(i, j, strict=True)):
        step = np.zeros((6, 6))
        step[a, b] = step[b, a] = 1.0
        wanted = (reference(seen).turned(own + step).whole - reference(seen).turned(own - step).whole) / 2
        one = np.eye(6)
        found = sum(np.outer(e, v) + np.outer(v, e) for e, v in ((one[a], vectors[k]), (one[b], vectors[len(i) + k])))
        assert found == pytest.approx(wanted, abs=1e-8)
