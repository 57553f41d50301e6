"""Operating points that the tests of effects look at."""


from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.operating import operating_point

REST, RUNNING = Condition(60.0), Condition(60.0, 7200 * RPM)
COLD_FAST = Condition(20.0, 20000 * RPM)


def at(spindle, condition, module, **values):
    """The operating point with one effect at its typical values but for `values`."""
    return operating_point(spindle, condition, [(module.EFFECT, module.EFFECT.typical() | values)])
