"""A campaign of the model's exact FRFs with noise, and what `compare` says of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.conftest import ROOT
from tests.diagnosis.exact_campaign import exact
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import observe
from thermospindle.model.scene.reading import load


@pytest.fixture(scope="session")
def certain(spindle):
    """The spindle in a chamber whose temperature is known exactly: without the error that all modes of a test share."""
    return replace(spindle, tolerances=replace(spindle.tolerances, temperature=0.0))


@pytest.fixture(scope="session")
def clean(spindle):
    campaign = exact(spindle, (20.0, 60.0))
    return campaign, observe(campaign, spindle)


@pytest.fixture(scope="session")
def itself(spindle, clean):
    return compare(spindle, *clean)


@pytest.fixture(scope="session")
def coarse(tmp_path_factory):
    """The scene `free_shaft` with a coarser mesh: its four frequencies move by 1e-4."""
    folder = tmp_path_factory.mktemp("free_shaft")
    text = (ROOT / "scenes" / "free_shaft" / "spindle.toml").read_text(encoding="utf-8")
    (folder / "spindle.toml").write_text(text.replace("longest_element_mm = 25.0", "longest_element_mm = 65.0"), encoding="utf-8")
    return load(folder)
