"""Smallest sizes: what a campaign with an effect of such a size holds of it, found by whole fits of other data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.virtual_campaign import drawn, effect, model_of, virtual_campaign
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.screening import screen, visibilities
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.prediction import detectable
from thermospindle.diagnosis.prediction.detectable import ASKED, _fitted_beside, smallest
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM

THREE = (Condition(20.0), Condition(55.0, 7200 * RPM), Condition(40.0))
NAMES = ("preload_loss", "sensor_mass", "channel_delay", "window_damping")


@pytest.fixture(scope="module")
def plain(spindle):
    """The fitted model of a campaign with nothing hidden, what was learned of it, and what screening says of some effects."""
    model = model_of(spindle, virtual_campaign(spindle, THREE, 4, [], drawn(spindle, 3, 4)))
    done = fit(model)
    learned = evidence(model, done).learned
    return model, done, learned, screen(model, done, 1.0, learned, [v for name in NAMES for v in variants(effect(name))], 1)


def visibility(model, about, learned, m, size):
    """Standard errors, as `learned`, that are left of an effect of `size` in all tests after all else is fitted anew beside it."""
    return float(np.sqrt(_fitted_beside(model, about, learned, m, size - m.size.neutral).cost)) / learned.errors


def test_what_is_left_at_the_smallest_size_is_worth_what_is_asked(plain):
    model, done, learned, looked = plain
    found = smallest(model, done, learned, looked, 1)
    assert set(found) == set(NAMES)
    for m, size in found.values():
        seen = visibility(model.thinned, done, learned, m, m.size.neutral + size)
        assert seen**2 / 2 - np.log1p((m.size.prior_sd * seen / size) ** 2) / 2 == pytest.approx(ASKED, rel=0.2)
        assert visibility(model.thinned, done, learned, m, m.size.neutral) == pytest.approx(0.0, abs=1e-9)


def test_what_is_nearly_a_tolerance_is_fitted_away(plain):
    """A sensor on the hub beside the hub's mass, its height and its inertias, each within its tolerance, and where sensors sit: what
    is left of it is little, and grows with it. Steps of Gauss and Newton alone led nowhere from 65 mg, and left 5000 standard errors."""
    model, done, learned, _ = plain
    sensor = next(m for m in variants(effect("sensor_mass")) if m.choices == {"turning_share": 1.0})
    assert [visibility(model.thinned, done, learned, sensor, size) for size in (0.0065, 0.065)] == pytest.approx([0.33, 3.2], rel=0.1)


@pytest.mark.parametrize(
    ("name", "worse", "least", "most"),
    [
        ("window_damping", lambda learned: replace(learned, errors=2.0), 0.45, 0.8),  # not what a tolerance limits, as that of channels does their delay
        ("preload_loss", lambda learned: replace(learned, sizes={**learned.sizes, kinds_of.STIFFNESS_DRIFT: 1e-3, kinds_of.DAMPING_DRIFT: 0.03}), 0.3, 0.8),
    ],
    ids=["errors twice as large", "modes that drift by a thousandth"],
)
def test_beside_a_model_that_is_worse_less_shows(plain, name, worse, least, most):
    """Errors and discrepancies are those learned, and not those that a fit starts with: what is
    stated of a good model is not stated of a bad one."""
    model, done, learned, looked = plain
    m, size = smallest(model, done, learned, looked, 1)[name]
    known, now = (visibility(model.thinned, done, of, m, m.size.neutral + size) for of in (learned, worse(learned)))
    assert least < now / known < most
    known, now = (visibilities(model, done, of, [m])[0] for of in (learned, worse(learned)))
    assert least < now / known < 0.97  # what drifts is beside what tolerances take already


@pytest.mark.parametrize(
    ("limit", "shown", "size"),
    [
        (1.0, lambda size: 40 * size if size <= 0.3 else np.inf, 0.0935),
        (1.0, lambda size: np.inf, None),
        (1.0, lambda size: 3 * size, None),
        (10.0, lambda size: 0.1 * size if size < 0.5 else 40 * size, 0.5),
        (10.0, lambda size: 4e3 * max(size - 2.0, 0.0) ** 2, 2.034),
    ],
    ids=["none can be built beyond 0.3", "none can be built", "the limit does not show", "what shows jumps", "nothing up to a clearance"],
)
def test_the_size_that_shows(limit, shown, size):
    """Sizes with which nothing stands are too large: of a machine-tool spindle one that is no
    number was told. What shows at one size and not at the next is found where it jumps; a rule of
    three alone went from one side of it to the other, and told one that was not seen."""
    m = variants(effect("preload_loss"))[0]
    found = detectable._size_that_shows(shown, m, 0.9 * limit, limit)
    assert (found is None) == (size is None)
    if size is not None:
        assert found == pytest.approx(size, rel=1.2 * detectable.NEAR)


@pytest.mark.parametrize(("name", "drift"), [("preload_loss", 1e-3), ("clearance_opening", 0.0)])
def test_what_shows_grows_with_the_size(plain, name, drift):
    """What moves peaks by their widths is fitted away as far as what moves them little: these
    showed by 15 and 13 standard errors, where fits beside them had stalled, and 4 and 9 are left."""
    model, done, learned, _ = plain
    learned, m = replace(learned, sizes={**learned.sizes, kinds_of.STIFFNESS_DRIFT: drift}), variants(effect(name))[0]
    seen = [visibility(model.thinned, done, learned, m, m.size.neutral + share * (m.size.typical - m.size.neutral)) / share for share in (0.1, 0.3, 1.0)]
    assert seen == pytest.approx([seen[0]] * 3, rel=0.1)


def test_what_tolerances_take_is_not_counted(plain):
    """A mass at a sensor is nearly a heavier body: to first order it would show at a sixth of the size that it needs."""
    model, done, learned, looked = plain
    m, size = smallest(model, done, learned, looked, 1)["sensor_mass"]
    promised = min(np.sqrt(2 * ASKED) * m.size.typical / s.visibility for s in looked if s.mechanism.name == "sensor_mass" and s.visibility > 0)
    assert size > 3 * promised


@pytest.mark.slow
@pytest.mark.parametrize(("times", "seen"), [(2.0, True), (0.4, False)])
def test_a_fit_finds_it_at_twice_that_size(spindle, plain, times, seen):
    model, done, learned, looked = plain
    m, size = smallest(model, done, learned, looked, 1)["preload_loss"]
    values = m.values(m.size.neutral + times * size, [q.neutral for q in m.shape])
    hidden = model_of(spindle, virtual_campaign(spindle, THREE, 4, [(m.effect, values)], drawn(spindle, 3, 4)))
    without, beside = fit(hidden), fit(hidden, (m,))
    assert (evidence(hidden, beside).ln - evidence(hidden, without).ln > ASKED / 2) == seen
