"""An effect whose sizes are not by its law is told so, however small it is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.verdict import departs
from thermospindle.model.machine import Condition
from thermospindle.sim.effects import by_name


@pytest.mark.parametrize(
    ("sizes", "departure", "told"),
    [
        ([0.1, 0.1, 0.1, 0.1], 0.0, False),
        ([0.1, 0.11, 0.09, 0.1], 0.1, False),
        ([0.1, 0.02, 0.1, 0.1], 0.3, True),
        ([-0.0005, 0.0105, -0.0009, -0.0013], 0.1, True),  # one test alone: a model that is 1 % off at speed, on a spindle from which nothing was missing
    ],
)
def test_sizes_that_are_not_by_the_law_are_told(sizes, departure, told):
    """Of a seat that gives, the same at every temperature and speed."""
    seat = variants(by_name("seat_clearance"))[0]
    found = SimpleNamespace(mechanisms=(seat,), evidence=SimpleNamespace(sizes=np.array([sizes]) + seat.size.neutral, learned=SimpleNamespace(departures=(departure,))))
    assert departs(found, 0, [Condition(20.0), Condition(20.0, 2500.0), Condition(40.0), Condition(50.0)]) is told
