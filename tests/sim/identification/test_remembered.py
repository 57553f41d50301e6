"""Modes that were extracted before are the same to the last bit, and asked of nobody where anything
about the question or the file is another."""

from dataclasses import fields

import numpy as np
import pytest

from thermospindle.model.machine import Condition
from thermospindle.sim.identification import remembered
from thermospindle.sim.identification.modal import Modes, noise_model
from thermospindle.sim.operating import operating_point

LINES = np.arange(700.0, 1700.0, 4.0)


@pytest.fixture(scope="module")
def measured(spindle):
    value = operating_point(spindle, Condition(20.0)).frf(LINES)
    sd = noise_model(value, 3e-3, 2e-4)
    error = np.random.default_rng(0).standard_normal((2, *value.shape)) / np.sqrt(2)
    return value + sd * (error[0] + 1j * error[1]), sd


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Questions that were extracted, with an empty cache."""
    monkeypatch.setenv("THERMOSPINDLE_CACHE", str(tmp_path / "cache"))
    calls, real = [], remembered.extract
    monkeypatch.setattr(remembered, "extract", lambda *a, **k: calls.append(k) or real(*a, **k))
    return calls


def same(one: Modes, other: Modes) -> bool:
    return all(np.array_equal(getattr(one, f.name), getattr(other, f.name)) and type(getattr(one, f.name)) is type(getattr(other, f.name)) for f in fields(Modes))


def test_the_second_time_nothing_is_extracted_and_nothing_differs(measured, asked, tmp_path):
    first = remembered.extracted(LINES, *measured, "mobility", 0.0)
    again = remembered.extracted(LINES, *measured, "mobility", 0.0)
    assert len(asked) == 1
    assert len(first.frequency) == 2
    assert same(first, again)
    (file,) = (tmp_path / "cache").iterdir()
    assert file.stat().st_size < 20_000
    file.write_bytes(file.read_bytes()[:-50])
    assert same(first, remembered.extracted(LINES, *measured, "mobility", 0.0))
    assert len(asked) == 2


@pytest.mark.parametrize("change", ["value", "sd", "lines", "kind", "window"])
def test_another_question_is_extracted_anew(measured, asked, change):
    value, sd = measured
    remembered.extracted(LINES, value, sd, "mobility", 0.0)
    moved = value.copy()
    moved[0, 0, 0] *= 1 + 1e-15
    assert not np.array_equal(moved, value)
    remembered.extracted(
        LINES + 1e-9 if change == "lines" else LINES,
        moved if change == "value" else value,
        1.01 * sd if change == "sd" else sd,
        "receptance" if change == "kind" else "mobility",
        0.5 if change == "window" else 0.0,
    )
    assert len(asked) == 2


def test_new_code_does_not_trust_what_the_old_found(measured, asked, monkeypatch):
    remembered.extracted(LINES, *measured, "mobility", 0.0)
    monkeypatch.setattr(remembered, "_code", lambda: "another")
    remembered.extracted(LINES, *measured, "mobility", 0.0)
    assert len(asked) == 2
