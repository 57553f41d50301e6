"""A small campaign in a folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.made_campaign import campaign
from thermospindle.sim.campaign.campaign import write_campaign


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A campaign's folder."""
    write_campaign(campaign(), tmp_path / "c")
    return tmp_path / "c"
