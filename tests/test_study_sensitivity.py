"""What moves a number, by regression and by shares of variance, against closed forms and scipy."""

import numpy as np
import pytest

from thermospindle.sim.study.indices import indices
from thermospindle.sim.study.sensitivity import sensitivity


def test_sensitivities_are_those_of_a_linear_answer():
    rng = np.random.default_rng(1)
    x = rng.normal(size=(4000, 3)) * [1.0, 0.1, 5.0]
    found = sensitivity(["a", "b", "c"], x, 3 * x[:, 0] - 40 * x[:, 1] + 7)  # contributions 3 : 4 : 0
    assert [found.coefficient[n] for n in "abc"] == pytest.approx([0.6, -0.8, 0.0], abs=0.03)
    assert found.r2 == pytest.approx(1.0)
    noisy = sensitivity(["a", "b", "c"], x, 3 * x[:, 0] + 3 * rng.normal(size=4000))
    assert noisy.r2 == pytest.approx(0.5, abs=0.05)
    assert sensitivity(["a", "b", "c"], x[:8], x[:8, 0]) is None  # too few draws to know an error


def test_what_fits_noise_names_nothing():
    """Thirty draws of twenty inputs that have nothing to do with the answer: without a look at
    draws left out, some coefficient of nearly every such regression is above 0.4."""
    named = largest = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        found = sensitivity([str(k) for k in range(20)], rng.normal(size=(30, 20)), rng.normal(size=30))
        named += bool(found.clear)
        largest += max(abs(v) for v in found.coefficient.values()) > 0.4
        assert found.unseen < 0.5
    assert largest > 150
    assert named == 0


def test_what_is_seen_in_draws_left_out_is_told_as_computed_one_by_one():
    rng = np.random.default_rng(3)
    x = rng.normal(size=(40, 3))
    y = x[:, 0] + 0.5 * rng.normal(size=40)
    missed, about = [], []
    for k in range(40):
        rest = np.arange(40) != k
        design = np.column_stack([np.ones(40), x])
        missed.append(y[k] - design[k] @ np.linalg.lstsq(design[rest], y[rest])[0])
        about.append(y[k] - y[rest].mean())
    found = sensitivity(["a", "b", "c"], x, y)
    assert found.unseen == pytest.approx(1 - np.sum(np.square(missed)) / np.sum(np.square(about)), rel=1e-9)
    assert found.clear == {"a"}


def ishigami(x):
    """Of (n, 3) uniform in -pi to pi (Ishigami, Homma 1990)."""
    return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def two_sets(n, seed):
    """Ishigami's function of a set, another, and the first with one input of the other each."""
    a, b = np.random.default_rng(seed).uniform(-np.pi, np.pi, size=(2, n, 3))
    mixed = [np.column_stack([b[:, j] if j == i else a[:, j] for j in range(3)]) for i in range(3)]
    return ishigami(a), ishigami(b), np.array([ishigami(m) for m in mixed])


def test_indices_are_those_of_ishigamis_function():
    """Closed form: V1 = (1 + 0.1 pi^4/5)^2 / 2, V2 = 49/8, V13 = 0.01 pi^8 (1/18 - 1/50), the third
    acts through the first alone; and their errors come true."""
    v1, v2, v13 = (1 + 0.1 * np.pi**4 / 5) ** 2 / 2, 49 / 8, 0.01 * np.pi**8 * (1 / 18 - 1 / 50)
    first, total = np.array([v1, v2, 0]) / (v1 + v2 + v13), np.array([v1 + v13, v2, v13]) / (v1 + v2 + v13)
    off = []
    for seed in range(40):
        found = indices(["a", "b", "c"], *two_sets(300, seed)).of
        off.append([(found[n].first - s) / found[n].first_sd for n, s in zip("abc", first, strict=True)] + [(found[n].total - t) / found[n].total_sd for n, t in zip("abc", total, strict=True)])
    assert np.sqrt(np.mean(np.square(off), axis=0)) == pytest.approx(np.ones(6), abs=0.35)
    assert np.abs(np.mean(off, axis=0)).max() < 0.5  # of a standard error, from 40


def test_indices_are_scipys():
    from scipy.stats import sobol_indices

    a, b, mixed = two_sets(256, 4)
    theirs = sobol_indices(func={"f_A": a[None], "f_B": b[None], "f_AB": mixed[:, None]}, n=256)
    ours = indices(["a", "b", "c"], a, b, mixed).of
    assert [ours[n].first for n in "abc"] == pytest.approx(theirs.first_order.ravel(), abs=1e-9)
    assert [ours[n].total for n in "abc"] == pytest.approx(theirs.total_order.ravel(), abs=1e-9)
