"""What a UFF file says of its axes, units and ends is used, each part alone, or refused in one sentence; FRFs are the rotor's own, written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY, POINTS
from tests.sim.importing.exported import DIRECTIONS, FRF, HEAD, PAIRS, SPINDLE, columns, imported, set_58, set_164, table
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.uff import read_frf
from thermospindle.sim.importing import units


def frfs(**how) -> str:
    """Every FRF in its place; `how` goes to the sets."""
    x, factor = how.pop("x", FREQUENCY), how.pop("factor", 1.0)
    return "".join(set_58(x, factor * h, (r, DIRECTIONS[r]), (q, DIRECTIONS[q]), **how) for (r, q), h in zip(PAIRS, FRF.value.reshape(len(PAIRS), -1), strict=True))


def written(folder, text, name="T20.uff"):
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize(
    ("text", "quantity", "factor"),
    [("in/s^2/lbf", "accelerance", 0.0254 / 4.4482216152605), ("(in/s2)/N", "accelerance", 0.0254), ("m/s/s/N", "accelerance", 1.0), ("(m/s/s)/N", "accelerance", 1.0)]
    + [(f"{g}/N", "accelerance", 9.80665) for g in ("g", "G", "gn")],
)
def test_ways_of_writing_an_acceleration(text, quantity, factor):
    assert units.of_frf(text) == (quantity, pytest.approx(factor))
    assert (units.length_factor(text) is None) == ("g" in text.lower())
