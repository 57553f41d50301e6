"""What is tried besides what screening promises."""

from __future__ import annotations

import numpy as np
import pytest

from tests.virtual_campaign import drawn, effect, model_of, virtual_campaign
from thermospindle.diagnosis.forward.mechanism import variants
from thermospindle.diagnosis.forward.nuisance import STIFFNESS
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.inference.prior import steady
from thermospindle.diagnosis.inference.search import HIDING, _cost, _lasting
from thermospindle.model.machine import Condition

TESTS = (Condition(20.0), Condition(40.0), Condition(60.0))


def test_a_mass_that_strained_tolerances_hide_is_found(spindle):
    """Two grams within the hub, the same in every test: strained tolerances take all of it, and a scan of sizes as drawn finds it again."""
    disk = effect("added_disk")
    hidden = [(disk, {"mass": 2.0, "outer_radius": 14.0, "height": -11.0})]
    made = virtual_campaign(spindle, TESTS, 5, hidden, drawn(spindle, 3, 5), responses=(1, 3, 6), frequency=np.arange(400.0, 6000.1, 16.0))
    model = model_of(spindle, made)
    first = fit(model)
    none = settled(model, Hypothesis(first, evidence(model, first)))
    assert none.evidence.learned.errors == 1.0
    assert none.evidence.learned.sizes[STIFFNESS] < HIDING
    expected = steady(none.evidence.learned)
    mechanisms = [m for name in ("added_disk", "mount_compliance") for m in variants(effect(name))]
    found = _lasting(model, none, mechanisms, _cost(model, none, expected), expected, 1)
    assert [h.names for h in found] == [("added_disk",)]
    assert found[0].evidence.ln > none.evidence.ln + 12
    assert found[0].evidence.sizes[0] == pytest.approx(2.0, abs=1.0)
    assert found[0].evidence.learned.departures == (0.0,)
