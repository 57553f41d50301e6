"""Published tables of measured modes that a scene ships."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import SCENE
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.published import published, read_published


def test_published_of_the_scene():
    """The analysis column of Table 2 as printed."""
    (paper,) = published(load(SCENE))
    assert paper.frequency == {20.0: (1002, 1545, 1795, 1821, 2010), 60.0: (1001, 1542, 1771, 1800, 1996)}
    assert paper.kinds == ("axial", "axial", "rocking", "rocking", "axial")
    assert paper.flexibility == ("base", "base", "ball bearing", "ball bearing", "ball bearing")
    assert "Jang" in paper.source


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("mode,kind,frequency_20_Hz\n1,axial,1002\n", "columns"),
        ("mode,kind\n1,axial\n", "columns"),
        ("mode,frequency_20C_Hz\n1,1002\n", "columns"),
        ("mode,kind,frequency_20C_Hz\n1,axial,fast\n", "'fast'"),
        ("mode,kind,frequency_20C_Hz\n1,axial\n", "no number"),
        ("mode,kind,frequency_20C_Hz\n1,axial,inf\n", "a frequency of inf Hz"),
        ("mode,kind,frequency_2.0.1C_Hz\n1,axial,1002\n", "columns"),
        ("mode,kind,frequency_20C_Hz\n1,axial," + 200_000 * "1", "cannot be read"),
        ("mode,kind,frequency_20C_Hz\n1,\udcff,1002\n", "cannot be read"),
    ],
)
def test_bad_published_table_is_refused_by_name(content: str, says: str, tmp_path: Path):
    path = tmp_path / "bad.csv"
    path.write_bytes(content.encode(errors="surrogateescape"))
    with pytest.raises(BadInput, match=says) as error:
        read_published(path)
    assert str(path) in str(error.value)
