"""Campaigns of another spindle: their points are on bodies that the scene has not."""

import pytest

from tests.conftest import ROOT
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.campaign import read_campaign

FOREIGN = ROOT / "tests" / "data" / "foreign_bond"


@pytest.mark.parametrize("verb", [compare, diagnose])
def test_a_foreign_campaign_is_refused_without_naming_every_segment(verb):
    with pytest.raises(BadInput, match=r"points\.1\.body = 'hub': no body of scene five_bearing; allowed are housing, spindle 0 to 23$"):
        verb(load(ROOT / "scenes" / "five_bearing"), read_campaign(FOREIGN))
