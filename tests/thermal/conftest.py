"""The reference spindle, and a cache of their own for these tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from thermospindle.model.machine import Spindle
from thermospindle.model.scene.reading import load

SCENE = Path(__file__).parents[2] / "scenes" / "hdd_2003"


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Nothing computed by other code is read, nothing is left behind."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("THERMOSPINDLE_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session")
def spindle() -> Spindle:
    return load(SCENE)
