"""A campaign of the model's exact FRFs with noise, and what `compare` says of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.diagnosis.exact_campaign import exact
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.data.observe import observe


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
