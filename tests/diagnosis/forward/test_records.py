"""Records that end before the answer has died away, and derivatives of theirs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.forward.made import made
from thermospindle.diagnosis.forward.linear import products, together
from thermospindle.diagnosis.forward.response import Response
from thermospindle.diagnosis.parameters.nuisance import (
    RECORD,
)
from thermospindle.model.rotor.poles import poles


@pytest.mark.parametrize("before", [0.0, 0.004])
def test_records_that_end_early(scene, before):
    """A record of T seconds and its discrete Fourier transform, mode by mode: p A e^(p t) from the
    hit, some time `before` which it began, to its end under the window."""
    decay = 15.0
    model, x = made(scene, window_decay=decay)
    x[[p.kind == RECORD for p in model.parameters]] = 1.0
    data, linear = model.tests[0], model.linear(0, x, [])
    p, rows = poles(linear.matrices), linear.chain
    duration = 1 / 40.0  # s, of lines 40 Hz apart
    lines = np.arange(10, 150) / duration
    away = 2j * np.pi * lines + decay + rows.decay - p.value[:, None]
    residue = (rows.response_rows @ p.right)[:, None, :] * (p.left @ rows.reference_rows.T).T[None] * p.value
    test = replace(data.test, pretrigger=before)
    at_lines = replace(data, test=test, frequency=lines, value=np.zeros((*data.value.shape[:2], len(lines)), complex))
    gain = np.ones(len(rows.gain))
    later = np.exp(-2j * np.pi * lines * rows.delay[:, None])
    exact = residue @ ((1 - np.exp(-away * (duration - before))) / away) * (rows.gain[:, None] * later)[:, None]
    cut, uncut = (Response(linear, at_lines, gain, share).value for share in (1.0, 0.0))
    assert np.abs(cut - exact).max() < 1e-9 * np.abs(exact).max()
    assert np.abs(uncut - exact).max() > 1e-3 * np.abs(exact).max()


def test_derivatives_of_records_that_end_early(scene):
    """By an element's mass, damping and stiffness, against central differences; without what they
    do to the end of the records they are wrong by parts in a hundred."""
    model, x = made(scene, window_decay=15.0)
    data, linear = replace(model.tests[0], test=replace(model.tests[0].test, pretrigger=0.004)), model.linear(0, x, [])
    m, gain, n = linear.matrices, np.ones(len(linear.chain.gain)), len(linear.matrices.mass)
    random = np.random.default_rng(4)
    for which in ("mass", "damping", "stiffness"):
        own = getattr(m, which)
        change = own * np.outer(*[random.uniform(0.5, 1.0, n)] * 2)  # of every element, and symmetrical
        rates = [change if k == which else np.zeros((n, n)) for k in ("mass", "damping", "stiffness")]

        def at(share, by):
            return Response(replace(linear, matrices=replace(m, **{which: own + by * change})), data, gain, share)  # noqa: B023

        for share, least, most in ((1.0, 0.0, 1e-3), (0.0, 1e-2, np.inf)):
            difference = (at(1.0, 1e-6).value - at(1.0, -1e-6).value) / 2e-6
            found = at(share, 0.0).moved(products(*rates))[0]
            assert least < np.abs(found - difference).max() / np.abs(difference).max() < most, (which, share)
        i, j = np.array([0, 1]), np.array([0, 3])
        vectors = random.standard_normal((n, 4))
        by_pair = [np.outer(vectors[:, a], vectors[:, b]) + np.outer(vectors[:, b], vectors[:, a]) for a, b in zip(i, j, strict=True)]
        zero = np.zeros((n, n))
        power = {"mass": 2, "damping": 1, "stiffness": 0}[which]
        at_once = np.concatenate(list(at(1.0, 0.0).moved_together(vectors, np.full(4, power), [(i, j)])))
        by_each = [products(*[pair if k == which else zero for k in ("mass", "damping", "stiffness")]) for pair in by_pair]
        apart = at(1.0, 0.0).moved(together(by_each))
        assert np.abs(at_once - apart).max() < 1e-9 * np.abs(apart).max()


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_change_of_more_products_than_degrees_of_freedom(scene, share):
    """Of all elements of all three matrices at once: the sum of what each does, beside one of few products."""
    model, x = made(scene, window_decay=15.0)
    data, linear = model.tests[0], model.linear(0, x, [])
    m, zero = linear.matrices, np.zeros_like(linear.matrices.mass)
    random = np.random.default_rng(4)
    changes = [own * np.outer(*[random.uniform(0.5, 1.0, len(own))] * 2) for own in (m.mass, m.damping, m.stiffness)]
    at = Response(linear, data, np.ones(len(linear.chain.gain)), share)
    few = products(zero, zero, np.diag(np.eye(len(zero))[0]) * m.stiffness[0, 0])
    every = products(*changes)
    assert len(every.power) > len(zero)
    apart = [products(*[change if k == which else zero for k in range(3)]) for which, change in enumerate(changes)]
    found, of_few = at.moved(together([every, few]))
    assert found == pytest.approx(sum(at.moved(by)[0] for by in apart), abs=1e-10 * np.abs(found).max())
    assert of_few == pytest.approx(at.moved(few)[0], abs=1e-10 * np.abs(of_few).max())


def test_changes_are_products_whatever_a_decomposition_does(scene, monkeypatch):
    """Divide and conquer did not converge on what temperature changed in the stiffness of five_bearing, a matrix without fault."""
    model, x = made(scene)
    m = model.linear(0, x, []).matrices
    there = products(m.mass, m.damping, m.stiffness)

    def fails(*args, **kinds):
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(np.linalg, "svd", fails)
    found = products(m.mass, m.damping, m.stiffness)
    assert found.power.tolist() == there.power.tolist()
    for power, whole in enumerate((m.stiffness, m.damping, m.mass)):
        of = found.power == power
        assert found.left[:, of] @ found.right[:, of].T == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())
