"""Fixtures that every test may use."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does, before numpy loads

from pathlib import Path

import pytest

from model.machine import Condition, Spindle
from model.pair import reference_motion, solve
from model.scene import load
from thermal.expansion import expand

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "scenes" / "hdd_2003"


@pytest.fixture(scope="session")
def spindle() -> Spindle:
    return load(SCENE)


@pytest.fixture(scope="session")
def cold(spindle):
    """Both bearings at the reference temperature, at rest."""
    return solve(spindle, Condition(20.0), {b.name: reference_motion(20.0) for b in spindle.bearings})


@pytest.fixture(scope="session")
def hot(spindle):
    """Both bearings at 60 C, at rest."""
    return solve(spindle, Condition(60.0), expand(spindle, 60.0))
