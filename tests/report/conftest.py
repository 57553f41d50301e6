"""The small run of `tests/sim` for tests of what shows it."""

import pytest

from tests.conftest import SCENE
from tests.sim.conftest import small_run
from thermospindle.model.scene.reading import load
from thermospindle.sim.run import Run, measured_campaigns


@pytest.fixture(scope="session")
def run() -> Run:
    spindle = load(SCENE)
    return small_run(spindle, (20.0, 60.0), measured_campaigns(spindle))
