"""Diagnoses of the machine-tool spindle: its virtual campaigns from all points, and from the FRF of
the nose to itself alone. Minutes each: `-m slow`."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.virtual_campaign import drawn, effect, virtual_campaign
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM

CONDITIONS = [Condition(20.0), Condition(35.0), Condition(20.0, 6000 * RPM), Condition(35.0, 12000 * RPM)]
OFFERED = ("preload_loss", "thermal_gradient", "lubricant_film", "seat_clearance", "sensor_gain", "window_damping")


@pytest.mark.slow
@pytest.mark.parametrize("nose", [False, True], ids=["all points", "nose alone"])
@pytest.mark.parametrize("hidden", ["", "preload_loss"])
def test_a_machine_tool_spindle_is_diagnosed(hidden, nose):
    """Six effects of the catalogue are offered, and all free forms."""
    spindle = load(ROOT / "scenes" / "five_bearing")
    own = [(effect(hidden), effect(hidden).typical())] if hidden else []
    points = {"responses": (spindle.points[0].node,), "references": (spindle.points[0].node,)} if nose else {}
    lines = np.arange(spindle.hammer.band[0], spindle.hammer.band[1], 4.0)
    campaign = virtual_campaign(spindle, CONDITIONS, 3, own, drawn(spindle, len(CONDITIONS), 5), frequency=lines, **points)
    verdict = diagnose(spindle, campaign, tuple(effect(n) for n in OFFERED)).verdict
    if not hidden:
        assert (verdict.word, verdict.effects) == ("none", ())
    else:
        assert (verdict.word, verdict.effects) == ("identified", (hidden,))
        assert verdict.held_out_gain > (5 if nose else 20)  # in ln probability density; 9 from the nose alone, where rings that move by 2.7 % more do nearly the same
