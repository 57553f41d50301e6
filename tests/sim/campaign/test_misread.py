"""FRFs of another quantity than is told, or with real and imaginary columns exchanged, are said as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import DATA, SCENE
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.campaign import Campaign, read_campaign
from thermospindle.sim.campaign.likeness import likenesses
from thermospindle.sim.identification.frf import POWER


@pytest.fixture(scope="module")
def spindle():
    return load(SCENE)


def told_as(campaign: Campaign, quantity: str, true: str) -> Campaign:
    """FRFs of a `true` quantity, told as another."""

    def of(frf):
        s = 2j * np.pi * np.maximum(frf.frequency, 1.0)
        return replace(frf, value=frf.value * s ** (POWER[true] - POWER[frf.quantity]), quantity=quantity)

    return replace(campaign, quantity=quantity, tests=tuple(replace(t, frf=of(t.frf)) for t in campaign.tests))


@pytest.mark.parametrize("true", POWER)
@pytest.mark.parametrize("quantity", POWER)
@pytest.mark.parametrize("name", ["foreign_none", "foreign_bond"])
def test_another_quantity_is_said(name, quantity, true, spindle):
    said = likenesses(spindle, told_as(read_campaign(DATA / name), quantity, true))
    if true == quantity:
        assert said == []
    else:
        assert said == [f"all FRFs fit those that hdd_2003 has far better as {true} than as {quantity}: is their quantity another than is told?"]


@pytest.mark.parametrize("quantity", POWER)
def test_exchanged_columns_are_said(quantity, spindle):
    own = told_as(read_campaign(DATA / "foreign_none"), quantity, quantity)
    exchanged = replace(own, tests=tuple(replace(t, frf=replace(t.frf, value=1j * t.frf.value.conj())) for t in own.tests))
    assert likenesses(spindle, exchanged) == ["all FRFs fit those that hdd_2003 has with their real and imaginary parts exchanged: is one column told as the other?"]


@pytest.mark.parametrize("times", [0.5, pytest.param(2.0, marks=pytest.mark.slow)])
def test_nothing_is_said_of_a_spindle_far_from_its_drawing(times, spindle):
    joints = tuple(replace(j, stiffness=tuple(times * k for k in j.stiffness)) for j in spindle.structure.joints)
    drawn = replace(spindle, structure=replace(spindle.structure, joints=joints))
    for name in ("foreign_none", "foreign_bond"):
        for quantity in POWER:
            assert likenesses(drawn, told_as(read_campaign(DATA / name), quantity, quantity)) == []
