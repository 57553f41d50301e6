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


def by_name(turned: int, direction: int, sign: float = 1.0) -> str:
    """Ends by name alone, node 0; that of `turned` looks in another direction."""
    names = {1: "hub_top0", 3: "hub_side0", 6: "seat90"}
    text = ""
    for (r, q), h in zip(PAIRS, FRF.value.reshape(len(PAIRS), -1), strict=True):
        ends = [(0, direction if n == turned else DIRECTIONS[n]) for n in (r, q)]
        text += set_58(FREQUENCY, h * (sign if r == turned else 1) * (sign if q == turned else 1), *ends, names=(names[r], names[q]))
    return text


def test_the_direction_of_an_end_that_is_told_by_name_counts(tmp_path):
    """As that of one told by node does: its sign was left as it was."""
    frf = imported(tmp_path, "", written(tmp_path, by_name(3, 1, -1.0)))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-9)


def test_a_named_end_across_its_point_is_asked_about_and_may_be_told(tmp_path):
    file = written(tmp_path, by_name(3, 2))
    with pytest.raises(Unanswered, match=r"points: called: which points 'hub_side0:\+Y' are: a \[\[points\]\] with called = \[\"hub_side0:\+Y\"\]"):
        imported(tmp_path, "", file)
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD.replace('direction = "-X"', 'direction = "-X"\ncalled = ["hub_side0:+Y"]'))
    bring([file], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert read_campaign(tmp_path / "c").tests[0].frf.response_nodes == (1, 3, 6)


@pytest.mark.parametrize(
    ("text", "quantity", "factor"),
    [("in/s^2/lbf", "accelerance", 0.0254 / 4.4482216152605), ("(in/s2)/N", "accelerance", 0.0254), ("m/s/s/N", "accelerance", 1.0), ("(m/s/s)/N", "accelerance", 1.0)]
    + [(f"{g}/N", "accelerance", 9.80665) for g in ("g", "G", "gn")],
)
def test_ways_of_writing_an_acceleration(text, quantity, factor):
    assert units.of_frf(text) == (quantity, pytest.approx(factor))
    assert (units.length_factor(text) is None) == ("g" in text.lower())
