"""A small campaign in a folder, and a warm-up of the reference."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.made_campaign import campaign
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import write_campaign
from thermospindle.sim.warmup import warm_up

SPEED = 7200 * RPM


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A campaign's folder."""
    write_campaign(campaign(), tmp_path / "c")
    return tmp_path / "c"


@pytest.fixture(scope="session")
def warm(spindle):
    return warm_up(spindle, SPEED, 20.0)
