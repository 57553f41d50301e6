"""The shift of a natural frequency: which modes have one, and where its temperatures may lie."""

from dataclasses import replace

import pytest

from thermospindle.model.errors import BadInput
from thermospindle.model.material import Law
from thermospindle.sim.identification import shift


@pytest.mark.parametrize("mode", [0, -1, 99])
def test_a_mode_that_is_not_there(spindle, mode):
    with pytest.raises(BadInput, match=rf"mode {mode}: hdd_2003 has modes 1 to \d+ at 20 C; they are counted from 1"):
        shift.frequency_shift(spindle, mode, 20.0, 60.0)


def test_a_mode_that_is_lost(spindle, monkeypatch):
    monkeypatch.setattr(shift, "follow", lambda mass, first, then: [0, -1, *range(2, len(first))])
    with pytest.raises(BadInput, match="mode 2: hdd_2003 has it at 20 C and no mode of its shape at 60 C"):
        shift.frequency_shift(spindle, 2, 20.0, 60.0)


def test_between_the_ends_of_a_law(spindle):
    """Steel given from 20 to 60 C, and a shift from one end to the other: its error is that of a law without ends."""
    found = []
    for low, high in ((20.0, 60.0), (0.0, 80.0)):
        steel = spindle.materials["steel"]
        law = Law((low, high), tuple(11.5e-6 for _ in range(2)))
        measured = replace(spindle, materials={**spindle.materials, "steel": replace(steel, thermal_expansion=law)})
        found.append(shift.frequency_shift(measured, 2, 20.0, 60.0))
    assert found[0].value == pytest.approx(found[1].value, rel=1e-9)
    assert found[0].sd == pytest.approx(found[1].sd, rel=0.01)


def test_an_axial_mode_that_lateral_ones_pass(stiffly_mounted):
    """They fall by a fifth, and shifts of -599 and -334 Hz were told with a MAC of zero: the numbers of frequencies alone."""
    assert shift.frequency_shift(stiffly_mounted, 5, 20.0, 100.0).value == pytest.approx(-0.1, abs=0.1)
    assert shift.frequency_shift(stiffly_mounted, 7, 20.0, 100.0).value == pytest.approx(-933.0, abs=1.0)


def test_a_deviation_moves_a_mode_past_another(stiffly_mounted):
    """An axial mode 6 Hz below two lateral ones, which a stiffer mount lifts beyond both: its error was 1625 Hz, that of its number."""
    mount, *others = stiffly_mounted.structure.joints
    joints = (replace(mount, stiffness=tuple(9.32 / 8 * k for k in mount.stiffness)), *others)
    close = replace(stiffly_mounted, structure=replace(stiffly_mounted.structure, joints=joints))
    found = [shift.frequency_shift(s, 5, 20.0, 100.0) for s in (stiffly_mounted, close)]
    assert found[1].start == pytest.approx(4490.6, abs=0.1)
    assert found[1].sd == pytest.approx(found[0].sd, rel=0.1)
