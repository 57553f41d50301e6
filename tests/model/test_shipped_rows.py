"""The bearings that come with the program: named by a scene's bearings, and what the scenes with them answer."""

import re

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.static import static
from thermospindle.model.scene.reading import load, shipped_rows
from thermospindle.sim.operating import operating_point

MK7702 = (ROOT / "scenes" / "mk7702" / "spindle.toml").read_text(encoding="utf-8")
FIVE = (ROOT / "scenes" / "five_bearing" / "spindle.toml").read_text(encoding="utf-8")


def with_rollers() -> str:
    """mk7702 with the shipped NN3020ASK behind, instead of its stiffness."""
    text, found = re.subn(r'z_mm = 439.5\n\[bearings.rear1.numbers\]\n(?:.+\n)+', 'z_mm = 439.5\nrow = "NN3020ASK"\n', MK7702)
    assert found == 1
    return text


@pytest.fixture
def made(tmp_path):
    def of(text):
        (tmp_path / "spindle.toml").write_text(text, encoding="utf-8")
        return load(tmp_path)

    return of


def test_every_shipped_row_has_origins_and_a_source():
    for kind, rows in shipped_rows().items():
        for name, row in rows.items():
            assert row["origin"] in ("printed", "assumed"), (kind, name)
            assert len(row["source"]) > 10, (kind, name)


def test_a_scene_takes_a_shipped_row_with_its_source():
    spindle = load("five_bearing")
    rear = spindle.bearing("rear2")
    assert (rear.balls, rear.pitch_diameter) == (18, pytest.approx(77.5e-3))
    assert spindle.provenance["ball_rows.B7012C.catalogue.preload_N"].origin == "printed"
    assert "B7012C" in spindle.provenance["ball_rows.B7012C.balls"].source


def test_what_a_scene_describes_itself_goes_before(made):
    row = shipped_rows()["ball_rows"]["B7012C"]
    own = "\n[ball_rows.B7012C]\n" + "".join(f"{k} = {v!r}\n" for k, v in (row | {"balls": 17}).items() if k not in ("catalogue", "origins"))
    own += "inner_conformity = 0.52\nouter_conformity = 0.52\n"
    assert made(FIVE.replace("\n[bearings.front1]", own + "\n[bearings.front1]")).bearing("rear2").balls == 17


def test_a_row_that_is_nowhere_is_refused_with_what_there_is(made):
    with pytest.raises(BadInput, match=r"bearings.front1.row = 'B7016C': no row of this scene, nor a shipped one; did you mean B7015C\?"):
        made(FIVE.replace('row = "B7015C"', 'row = "B7016C"', 1))


def test_rollers_behind_a_flexible_shaft_are_nearly_the_printed_spring(made):
    """Rollers that just touch have the printed radial stiffness; two rows also resist tilt, which the printed spring does not."""
    spindle = made(with_rollers())
    (state,) = [b for b in operating_point(spindle, Condition(20.0)).state.linear if b.name == "rear1"]
    assert state.stiffness[0, 0] == pytest.approx(2170e6, rel=1e-3)
    assert 0 < state.stiffness[3, 3] < 0.01 * spindle.structure.joints[0].stiffness[3]
    assert state.stiffness[2, 2] == 0.0  # they float
    nose = static(spindle, operating_point(spindle, Condition(20.0)).chain, spindle.points[0])
    assert nose.stiffness == pytest.approx(235.604e6, rel=2e-3)
    ours, printed = ([m.frequency for m in operating_point(s, Condition(20.0)).modes_below(2000.0)] for s in (spindle, load("mk7702")))
    assert np.allclose(ours, printed, rtol=5e-3)
    assert np.all(np.array(ours) >= np.array(printed) - 1e-3)
