"""Heat that passes the air gaps between parts."""

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.bodies import nodes, two_rings
from thermospindle.model.drawing.heating import AirGap, Convection
from thermospindle.model.drawing.section import PARTS
from thermospindle.thermal import conduction, heat
from thermospindle.thermal.mesh import section_mesh


def test_all_heat_passes_the_air_gap(spindle):
    """The rings face each other from z = 2 to 6 mm: conductance h x 2 pi x 4 mm x 4 mm, over the area of the first region."""
    model = two_rings(spindle, gaps=(AirGap(("inner", "outer"), 500.0),))
    means = heat.steady(model, heat.running(model.spindle, 25.0, 100.0)).region_means()
    assert means["inner"] - means["outer"] == pytest.approx(2.0 / (500 * 2 * np.pi * 4e-3 * 4e-3), rel=1e-3)


@pytest.mark.parametrize("film", [50.0, 80.0])
def test_chamber_air_does_not_reach_into_a_gap(spindle, film):
    """Both rings with a film, no bearing: each loses the stretch z = 2 to 6 mm of its facing side, at its own radius."""
    own = replace(two_rings(spindle).spindle, bearings=())
    convections = tuple(Convection((name,), film) for name in ("inner", "outer"))
    own = replace(own, thermal=replace(own.thermal, convections=convections, gaps=(AirGap(("inner", "outer"), 500.0),)))
    model = conduction.model(own, {part: section_mesh(own, part, 0.7e-3) for part in PARTS})
    inner = (2e-3 + 4e-3) * 6e-3 + (4e-3**2 - 2e-3**2) - 4e-3 * 4e-3
    outer = (6e-3 + 9e-3) * 7e-3 + (9e-3**2 - 6e-3**2) - 6e-3 * 4e-3
    for part, area in zip(PARTS, (inner, outer), strict=True):
        assert model.film[model.spans[part]].sum() == pytest.approx(film * 2 * np.pi * area, rel=1e-9)
    assert model.convection @ np.ones(model.film.size) == pytest.approx(model.film, abs=1e-12)


def test_two_gaps_may_not_share_a_face(spindle):
    twice = (AirGap(("inner", "outer"), 500.0), AirGap(("outer", "inner"), 100.0))
    with pytest.raises(ValueError, match="two gaps share"):
        two_rings(spindle, gaps=twice)


def test_gap_couples_equal_heights(spindle):
    """A temperature that is the same function of height on both sides sends no heat across; one that differs sends h dT dA."""
    model = two_rings(spindle, gaps=(AirGap(("inner", "outer"), 500.0),))
    heights = np.concatenate([nodes(model, part)[1] for part in PARTS])
    assert model.exchange @ (3.0 + 1e3 * heights**2 / 9e-3) == pytest.approx(0.0, abs=1e-12)
    warm = np.concatenate([np.full(nodes(model, part).shape[1], t) for part, t in (("stationary", 1.0), ("rotating", 0.0))])
    crossing = (model.exchange @ warm)[model.spans["stationary"]].sum()
    assert crossing == pytest.approx(500 * 2 * np.pi * 4e-3 * 4e-3, rel=1e-9)


def test_axial_gap_and_regions_that_do_not_face(spindle):
    model = two_rings(spindle)
    own = model.spindle
    above = replace(own.region("outer"), r=(3e-3, 8e-3), z=(7e-3, 9e-3))
    disc = replace(own, regions=(own.region("inner"), above), bearings=())
    disc = replace(disc, thermal=replace(own.thermal, gaps=(AirGap(("inner", "outer"), 500.0),)))
    sections = {part: section_mesh(disc, part, 0.7e-3) for part in PARTS}
    exchange = conduction.model(disc, sections).exchange
    warm = np.zeros(exchange.shape[0])
    warm[: nodes(model, "stationary").shape[1]] = 1.0
    assert warm @ (exchange @ warm) == pytest.approx(500 * np.pi * (4e-3**2 - 3e-3**2), rel=1e-9)
    away = replace(disc, regions=(own.region("inner"), replace(above, r=(5e-3, 8e-3), z=(7e-3, 9e-3))))
    with pytest.raises(ValueError, match="face each other"):
        conduction.model(away, {part: section_mesh(away, part, 0.7e-3) for part in PARTS})
