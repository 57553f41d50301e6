"""Maps of the reference, and of a spindle whose modes fall through lines."""

from __future__ import annotations

import numpy as np
import pytest

from tests.mounting import told_preload
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.resonance.map import resonance_map

NOMINAL = Condition(20.0, 7200 * RPM)


@pytest.fixture(scope="session")
def found(spindle):
    return resonance_map(spindle, np.linspace(20, 60, 9), np.linspace(0, 14400, 17) * RPM, NOMINAL)


@pytest.fixture(scope="session")
def light(spindle):
    """The reference under a quarter of its preload: warm, little of it is left, and its modes fall
    through lines that the reference's never meet."""
    return told_preload(spindle, 4.2)


@pytest.fixture(scope="session")
def met(light):
    """The map of the lightly loaded spindle, up to a temperature just beyond where 30 (fo-fc) + fo meets the forward rocking mode."""
    return resonance_map(light, np.linspace(20, 58.5, 8), np.linspace(6000, 8400, 3) * RPM, NOMINAL)
