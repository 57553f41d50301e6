"""Defects that a review found in the diagnosis, each kept from coming back: laws that end at a test, names that carry meaning, repeats."""

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.mode_tables import tables
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.forward.rates import STEP, rates_of
from thermospindle.diagnosis.parameters.nuisance import GAIN, TEMPERATURE
from thermospindle.diagnosis.verdict import campaign_data
from thermospindle.model.material import BEYOND, Law


def with_law(spindle, low, high):
    """Expansion of steel given between two temperatures only, the same as before there."""
    steel = spindle.materials["steel"]
    value = steel.thermal_expansion(20.0)
    return replace(spindle, materials={**spindle.materials, "steel": replace(steel, thermal_expansion=Law((low, high), (value, value)))})


def test_a_law_that_ends_at_the_tests_stops_no_derivative(spindle):
    """A law from 20 to 60 C, tests at 20 and 60 C: derivatives by temperature, whose steps lead outside, are those of a law without ends."""
    found = []
    spindle = replace(spindle, tolerances=replace(spindle.tolerances, temperature=1.0))
    assert STEP * spindle.tolerances.temperature > BEYOND
    for low, high in ((20.0, 60.0), (0.0, 80.0)):
        model = campaign_data(with_law(spindle, low, high), tables(spindle, ()))
        rates = rates_of(model, np.zeros(len(model.parameters)), [[], []])
        own = [p for p in range(len(model.parameters)) if model.parameters[p].kind == TEMPERATURE]
        by_temperature = [rates.each[t][list(rates.numbers[t]).index(own[t])] for t in (0, 1)]
        found.append(np.array([p.left * (p.power == 0) @ p.right.T for p in by_temperature]))
    assert np.abs(found[0]).max() > 0
    assert found[0] == pytest.approx(found[1], rel=1e-3, abs=1e-4 * np.abs(found[1]).max())


def test_a_joint_called_gain_is_no_channel(spindle):
    """Nuisance parameters have a kind: what a joint or a test is called says nothing."""
    old = spindle.structure.joints[0].name
    joints = tuple(replace(j, name=f"gain of {j.name}") if j.name == old else j for j in spindle.structure.joints)
    named = replace(spindle, structure=replace(spindle.structure, joints=joints))
    campaign = tables(spindle, ())
    odd = replace(campaign, tests=tuple(replace(t, id=f"temperature of {t.id}") for t in campaign.tests))
    model, plain = campaign_data(named, odd), campaign_data(spindle, campaign)
    assert any(p.name.startswith("gain of") for p in model.parameters)
    assert not any(len(number) for m in (model, plain) for number, _ in m.numbers.gains)
    for kind in (GAIN, TEMPERATURE):
        assert sum(p.kind == kind for p in model.parameters) == sum(p.kind == kind for p in plain.parameters)


def test_repeats_at_nearly_one_temperature_are_left_out_together(spindle):
    """20.02 and 19.98 C are one condition: a twin left in would predict its twin."""
    model = campaign_data(spindle, tables(spindle, (), (20.02, 60.0, 19.98)))
    assert conditions_of(spindle, model.tests) == [[2, 0], [1]]
    one = campaign_data(spindle, tables(spindle, (), (20.0, 20.01)))
    assert conditions_of(spindle, one.tests) == [[0, 1]]
