"""The scenes of these tests."""

from __future__ import annotations

import pytest

from tests.diagnosis.forward.made import SCENES
from thermospindle.model.scene.reading import load


@pytest.fixture(scope="module", params=SCENES)
def scene(request):
    return load(SCENES[request.param])
