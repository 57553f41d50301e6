"""Operating points that the tests of effects look at, their frequencies, and the machine with a tool."""

from functools import cache

import numpy as np

from tests.conftest import ROOT
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.modes import modes
from thermospindle.model.rotor.poles import poles
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

REST, RUNNING = Condition(60.0), Condition(60.0, 7200 * RPM)
COLD_FAST = Condition(20.0, 20000 * RPM)
NONE = np.zeros((5, 5))
"""Damping of an element without any."""


def at(spindle, condition, module, **values):
    """The operating point with one effect at its typical values but for `values`."""
    return operating_point(spindle, condition, [(module.EFFECT, module.EFFECT.typical() | values)])


def frequencies(point, highest=3000.0):
    return np.array([m.frequency for m in modes(point.chain, highest=highest)])


def undamped(chain):
    """Natural frequencies (Hz) of a chain that need not turn."""
    value = poles(matrices(chain)).value
    return np.sort(np.abs(value[value.imag > 1e-6])) / (2 * np.pi)


@cache
def with_tool():
    """The template of a machine tool, whose taper holds one."""
    return load(ROOT / "scenes" / "templates" / "machine-tool.toml")
