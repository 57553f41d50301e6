"""A small part of the blind study: `make blind` runs all of it."""

import pytest

from tests.blind_score import outcome
from tests.blind_variants import Job, judge

CAMPAIGNS = [
    pytest.param((), {"right"}, id="nothing"),
    pytest.param(("channel_delay/one",), {"identified"}, id="channel_delay"),
    pytest.param(("grease_damping/exponential",), {"identified", "in the set"}, id="grease_damping"),
]


@pytest.mark.parametrize(("hidden", "allowed"), CAMPAIGNS)
def test_campaigns_with_a_hidden_effect(hidden, allowed):
    """By somebody else's formulas, half way between just visible and large, measured with noise on a spindle off its drawing."""
    row = judge(Job(hidden, (0.5,) * len(hidden), 7))
    assert outcome(row) in allowed
    if row["verdict"] == "identified":
        assert row["held_out"][1] < row["held_out"][0] / 3
