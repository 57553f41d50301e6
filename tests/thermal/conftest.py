"""The reference spindle, and a cache of their own for these tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from thermospindle.model.machine import Spindle
from thermospindle.model.scene.reading import load

SCENE = Path(__file__).parents[2] / "scenes" / "hdd_2003"


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module", autouse=True)
def own_cache(cache: Path) -> Iterator[Path]:
    """Nothing computed by other code is read, nothing is left behind; tests elsewhere that come after these have the user's again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("THERMOSPINDLE_CACHE", str(cache))
        yield cache


@pytest.fixture(scope="session")
def spindle() -> Spindle:
    return load(SCENE)
