"""Models stepped side by side: what each is alone to the last bit, whatever stands beside it; and what grows beyond all bounds is said."""

import copy

import mujoco
import numpy as np
import pytest

from thermospindle.model.errors import NotConverged
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.hammer.test import loaded_state
from thermospindle.sim.operating import operating_point
from thermospindle.sim.side_by_side import SideBySide


@pytest.fixture(scope="module")
def models():
    """The same flexible spindle at three conditions; entries of its tendons that are zero but for rounding are not the same in all."""
    spindle = load("five_bearing")
    return [operating_point(spindle, Condition(t, n * RPM)).model for t, n in ((20.0, 0.0), (60.0, 8000.0), (40.0, 4000.0))]


def struck(models, steps=200):
    control = np.zeros((len(models), steps, models[0].nu))
    control[:, :20, 0] = 50.0
    start = np.array([loaded_state(model) for model in models])
    with SideBySide(models) as pool:
        first, felt = pool.step(start, control[:, :50])
        second, more = pool.step(first[:, -1], control[:, 50:])
    return np.concatenate([first, second], axis=1), np.concatenate([felt, more], axis=1)


def test_models_of_different_size_do_not_touch_each_other(models):
    assert len({m.nwrap for m in models}) > 1, "models of one size would show nothing here"
    assert len({m.nv for m in models}) == 1
    together, seen = struck(models)
    for k, model in enumerate(models):
        alone, own = struck([model])
        np.testing.assert_array_equal(together[k], alone[0])
        np.testing.assert_array_equal(seen[k], own[0])
        assert np.abs(seen[k]).max() > 0


def test_more_models_than_cores(models):
    many, _ = struck(models[:2] * 4, 20)
    np.testing.assert_array_equal(many[0], many[6])


def test_what_controls_are_is_told_by_the_spec(models):
    force = np.zeros((1, 30, models[0].nv))
    force[:, :, 3] = 1.0
    with SideBySide(models[:1]) as pool:
        moved, _ = pool.step(loaded_state(models[0])[None], force, mujoco.mjtState.mjSTATE_QFRC_APPLIED)
        free, _ = pool.step(loaded_state(models[0])[None], 0 * force, mujoco.mjtState.mjSTATE_QFRC_APPLIED)
    assert np.abs(moved - free).max() > 1e-9


def test_what_grows_beyond_all_bounds_is_said(models, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log where it stands
    wild = copy.copy(models[1])
    wild.opt.timestep *= 5
    with pytest.raises(NotConverged, match=r"beyond all bounds in steps of .* us; a shorter hammer_test.step_us"):
        struck([models[0], wild], 2000)
