"""Operating points that the tests of effects look at."""

import numpy as np

from model.machine import Condition
from sim.operating import operating_point

RPM = np.pi / 30
REST, RUNNING = Condition(60.0), Condition(60.0, 7200 * RPM)
COLD_FAST = Condition(20.0, 20000 * RPM)


def at(spindle, condition, module, **values):
    """The operating point with one effect at its typical values but for `values`."""
    return operating_point(spindle, condition, [(module.EFFECT, module.EFFECT.typical() | values)])
