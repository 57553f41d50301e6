"""The ladder's fits: forms compared, tests left out, effects that the scene has."""

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.mode_tables import tables
from thermospindle.diagnosis.decision.conditions import conditions_of
from thermospindle.diagnosis.inference.prior import CHANGING
from thermospindle.diagnosis.ladder.fitting import settled, without
from thermospindle.diagnosis.ladder.forms import FORMS
from thermospindle.diagnosis.ladder.ladder import CLEAR, DISCREPANCY, ladder
from thermospindle.diagnosis.ladder.left_out import LeftOut, least, missed, unseen
from thermospindle.diagnosis.ladder.step import as_drawn
from thermospindle.diagnosis.verdict import campaign_data
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Addition
from thermospindle.model.material import Law
from thermospindle.sim.effects import by_name


@pytest.mark.slow
@pytest.mark.parametrize("true", [FORMS[0], FORMS[2]], ids=lambda form: form.name)
def test_the_form_that_made_the_data_leads(spindle, true):
    """With all tolerances free, either way round: the comparison has no favourite."""
    found = ladder(spindle, tables(spindle, true.applied), ())
    ranked = sorted(found.forms, key=lambda f: -f[3])
    assert ranked[0][0] == true.name
    assert ranked[0][3] > ranked[1][3] + CLEAR
    assert ranked[0][1] < 1.5


def test_a_temperature_left_out_is_not_in_the_fit_that_predicts_it(spindle):
    """Frequencies at 60 C wrong by a twentieth leave the fit to 20 C as it was, to the last bit, and are missed by all of it."""
    plain = tables(spindle, ())
    cold, hot = plain.tests
    wrong = replace(plain, tests=(cold, replace(hot, modes=tuple(replace(m, frequency=1.05 * m.frequency) for m in hot.modes))))
    found = []
    for campaign in (plain, wrong):
        model = without(campaign_data(spindle, campaign), CHANGING)
        assert conditions_of(spindle, model.tests) == [[0], [1]]
        blind = settled(unseen(model, LeftOut((1,))))
        off = missed(blind, model.tests, LeftOut((1,)))
        found.append((blind.fit.point, off.squares, off.count))
    assert np.array_equal(found[0][0], found[1][0])
    assert found[0][2] == found[1][2] == 8
    assert found[0][1] < 25
    assert found[1][1] > 100 * 8


def test_what_is_missed_is_no_difference_of_large_numbers():
    """A reversed sensor puts a test 4e5 standard errors off, nearly all within reach of wide priors:
    as a difference of squares that came out negative, and its root was none. In closed form, of
    columns c q with q orthonormal: what is across them, and |p|^2 / (1 + c^2) of p along them."""
    random = np.random.default_rng(4)
    q = np.linalg.qr(random.normal(size=(500, 21)))[0]
    along, reach, across = 1e7 * random.normal(size=20), np.logspace(4, 8, 20), 3.0
    r = q[:, :20] @ along + across * q[:, 20]
    assert least(r, q[:, :20] * reach) == pytest.approx(across**2 + float(np.sum(along**2 / (1 + reach**2))), rel=1e-6)


def test_a_mean_where_no_spindle_can_be_built_predicts_nothing(spindle):
    """Laws from 20 to 60 C, tests at both ends: a learned mean that has the chamber at 19.7 C is
    none to predict the other test from; the fit itself serves."""
    steel = spindle.materials["steel"]
    ending = replace(steel, thermal_expansion=Law((20.0, 60.0), (11.5e-6, 11.5e-6)))
    measured = replace(spindle, materials={**spindle.materials, "steel": ending})
    model = without(campaign_data(measured, tables(measured, ())), CHANGING)
    blind = settled(unseen(model, LeftOut((1,))))
    colder = np.where(np.arange(len(blind.fit.point)) == model.numbers.temperature[0], -1.0, blind.evidence.mean)
    outside = replace(blind, evidence=replace(blind.evidence, mean=colder))
    assert np.array_equal(outside.posterior[0], outside.fit.point)
    assert missed(outside, model.tests, LeftOut((1,))).count == 8


@pytest.mark.slow
def test_effects_of_the_scene_stand_on_every_step(spindle):
    """A scene that has the effect already: nothing is missing, and it cannot be added again."""
    values = {"hub_share": 0.2}
    soak = by_name("soak_lag")
    equipped = replace(spindle, effects=(Addition("soak_lag", soak.neutral() | values),))
    campaign = tables(spindle, [(soak, soak.neutral() | values)])
    found = ladder(equipped, campaign, ())
    assert found.step("axial equilibrium").error < 2
    assert found.step(DISCREPANCY).effects == ()
    bare = replace(found.model, present=())
    assert as_drawn(bare, found.measured, "without it", ()).error > 100
    with pytest.raises(BadInput, match=r"--effects soak_lag: is in scene hdd_2003 already"):
        ladder(equipped, campaign, [soak])
    with pytest.raises(BadInput, match=r"--effects soak_lag: is named twice"):
        ladder(spindle, campaign, [soak, soak])
