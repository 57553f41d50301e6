"""What is predicted of a test that has not been made."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from tests.virtual_campaign import drawn, model_of, virtual_campaign
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.prediction.next_test import _predicted
from thermospindle.model.machine import Condition


def test_no_test_is_proposed_where_bearings_have_lost_contact(spindle):
    """A router spindle was to be tested 7 K above where its front pair unloads, with modes at 8.7 Hz."""
    tests = (Condition(20.0), Condition(50.0))
    model = model_of(spindle, virtual_campaign(spindle, tests, 5, [], drawn(spindle, 2, 5), responses=(1, 6), frequency=np.arange(400.0, 6000.1, 80.0)))
    first = fit(model)
    none, found = Hypothesis(first, evidence(model, first)), SimpleNamespace(model=model)
    modes = _predicted(found, none, Condition(60.0))
    assert modes is not None
    assert modes[0].frequency > 300
    assert _predicted(found, none, Condition(150.0)) is None
