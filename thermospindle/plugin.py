"""The pytest plugin: the fixture `spindle`. It imports nothing that computes until the fixture is used."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from thermospindle.testing import Spindles


@pytest.fixture(scope="session")
def spindle() -> Spindles:
    """Spindles and their operating points, each computed once: `spindle("hdd_2003")`,
    `spindle.point("hdd_2003", 60, speed_rpm=7200)`, `spindle.mode(...)`."""
    from thermospindle.testing import Spindles

    return Spindles()
