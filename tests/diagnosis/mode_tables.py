"""Campaigns of mode tables, which the model makes with errors drawn at random."""

import numpy as np

from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Campaign, Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.operating import operating_point

SD = 0.05  # Hz


def tables(spindle, effects, temperatures=(20.0, 60.0), seed=0) -> Campaign:
    """A campaign of mode tables made by MuJoCo's linearised model, with errors drawn at random."""
    random = np.random.default_rng(seed)
    tests = []
    for t in temperatures:
        found = operating_point(spindle, Condition(t), effects).modes
        modes = [m for m in found if 400 < m.frequency < 6000]
        rows = [ModeRow(f"T{t:g}", i, m.kind, m.frequency + SD * random.standard_normal(), SD) for i, m in enumerate(modes, 1)]
        tests.append(Test(f"T{t:g}", t, 0.0, modes=tuple(rows)))
    return Campaign("made up", spindle.name, "mobility", (), tuple(tests))
