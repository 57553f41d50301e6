"""Table 2 of Jang, Kim, Han, Kim (2003), measured column, on the ladder: what each model form makes of ten numbers, and what is left.

The standard error of 1 Hz is assumed (the paper prints none), and so is the section whose expansion decides the middle step.
"""

import numpy as np
import pytest

from tests.conftest import SCENE
from thermospindle.diagnosis.ladder.ladder import CLEAR, DISCREPANCY, TOLERANCES, ladder
from thermospindle.diagnosis.parameters.nuisance import STIFFNESS
from thermospindle.report.text.ladder import remaining
from thermospindle.sim.campaign.campaign import read_campaign

MEASURED, ANALYSED = np.array([3, -2, -28, -27, -19]), np.array([-1, -3, -24, -21, -14])  # Hz, shifts from 20 to 60 C, printed


@pytest.fixture(scope="module")
def climbed(spindle):
    return ladder(spindle, read_campaign(SCENE / "measured" / "jang_2003"), ())


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def test_fixed_stiffness_misses_every_shift_whole(climbed):
    assert climbed.step("fixed stiffness").rms_shift_Hz == pytest.approx(rms(MEASURED), abs=0.01)


def test_axial_equilibrium_misses_the_shifts_as_the_papers_own_analysis_does(climbed):
    """The paper's analysis misses its measured shifts by 4.3 Hz rms; printed in whole Hz. Mode 3, whose seat is assumed, misses
    4 Hz more. Of the mean square of the shifts the paper's analysis leaves 5 %, ours, whose section is assumed, less than 10 %."""
    assert climbed.step("axial equilibrium").rms_shift_Hz == pytest.approx(rms(ANALYSED - MEASURED), abs=1.4)
    assert climbed.step("axial equilibrium").rms_shift_Hz ** 2 < 0.1 * climbed.step("fixed stiffness").rms_shift_Hz ** 2


def test_radial_expansion_alone_overdoes_it(climbed):
    """Without the outer rings' moving apart, nothing replaces the preload that radial expansion takes: the upper bearing comes loose."""
    radial = climbed.step("radial expansion only")
    assert radial.lost_contact == ("T60: upper bearing lost contact",)
    assert radial.error > climbed.step("fixed stiffness").error > climbed.step("axial equilibrium").error


def test_the_papers_form_leads_with_all_tolerances_free(climbed):
    evidence = {name: e for name, _, _, e in climbed.forms}
    best = evidence.pop("axial equilibrium")
    assert best > max(evidence.values()) + CLEAR


def test_what_is_left_over(climbed):
    drawn, fitted = remaining(climbed)
    assert "mode 1 (axial) moves the other way than computed, +3.0 +- 1.4 Hz against -1.7" in drawn
    assert "modes 3 and 4 lie 50.0 +- 1.4 Hz apart in T20, computed 26.0" in drawn
    assert drawn.count("moves more than computed") == 3
    assert "mode 1 (axial) moves the other way" in fitted


def test_ten_numbers_carry_no_more_than_they_can(climbed):
    """Tolerances alone, the flange's unevenness among them, buy a fit with some of them where they are not believed; granted that
    the model is a hundredth wrong everywhere, they stay where they are, and most of what the data tell has gone into offsets."""
    strict, top = climbed.step(TOLERANCES), climbed.step(DISCREPANCY)
    assert top is climbed.top
    assert strict.error > 1.8
    assert strict.stretch > 1.4
    assert np.abs(strict.fitted.fit.point).max() > 3
    assert top.error < 0.9 * strict.error
    assert top.stretch < 1.0
    assert top.evidence > strict.evidence + 10
    assert top.fitted.learned.sizes[STIFFNESS] == pytest.approx(1e-2)
    assert top.fitted.fit.count == 10
    assert 3 < top.fitted.determined() < 9
    assert strict.held_out > 1.1 * strict.error  # a temperature left out is predicted worse than it is fitted
    assert top.held_out > 1.2 * top.error
    assert top.held_out < 0.9 * strict.held_out


@pytest.mark.slow
def test_no_effect_is_named(spindle):
    found = ladder(spindle, read_campaign(SCENE / "measured" / "jang_2003"))
    assert found.diagnosis.verdict.word in ("ambiguous", "unexplained")
    assert all(r.name.startswith(("or ", "nearest: ")) for r in found.steps[5:])
