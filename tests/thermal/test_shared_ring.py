"""Two bearings in one tube: each raceway has its own thermal motion."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from thermospindle.model.bearing.pair import solve
from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Condition
from thermospindle.model.scene.checks import check_raceways
from thermospindle.thermal import conduction, heat
from thermospindle.thermal.expansion import expand
from thermospindle.thermal.influence import influence, races, raceways
from thermospindle.thermal.readout import reading


@pytest.fixture(scope="module")
def tube(spindle):
    """Both outer races in one steel tube, which is all that turns."""
    outer = Region("tube", "rotating", "steel", (5.349e-3, 6.5e-3), (2.0e-3, 21.0e-3))
    regions = (*(g for g in spindle.regions if g.part == "stationary"), outer)
    bearings = tuple(replace(b, outer_ring="tube") for b in spindle.bearings)
    thermal = replace(spindle.thermal, convections=(replace(spindle.thermal.convections[1], regions=("tube",)),), sources=(), gaps=())
    return replace(spindle, regions=regions, bearings=bearings, thermal=thermal)


def test_free_expansion_of_a_long_tube(tube):
    """A body of one material grows by its free strain: u_r = strain r, u_z = strain (z - mean z); each raceway by its own height."""
    motion, strain = expand(tube, 60.0), 11.5e-6 * 40
    for b in tube.bearings:
        assert motion[b.name].outer_r == pytest.approx(strain * 5.349e-3, rel=1e-9)
        assert motion[b.name].outer_z == pytest.approx(strain * (b.z - 11.5e-3), rel=1e-6)
    assert motion["upper"].outer_z - motion["lower"].outer_z == pytest.approx(strain * 11.5e-3, rel=1e-9)


@pytest.mark.slow
def test_the_tube_in_its_hub_moves_as_two_rings_of_it_would(spindle):
    """The sleeve of the reference made of steel, as one region and as three: the same part, the same motion of either raceway."""
    ends = (3.0e-3, 3.5e-3, 6.5e-3, 15.0e-3, 18.0e-3, 20.0e-3)
    rest = tuple(g for g in spindle.regions if "outer ring" not in g.name and g.name not in ("sleeve", "hub body"))
    sleeve, body = spindle.region("sleeve"), spindle.region("hub body")
    rest = (*rest, replace(sleeve, r=(6.5e-3, 7.5e-3)), replace(body, r=(6.5e-3, 12.5e-3)))
    names = ("a", "lower outer ring", "b", "upper outer ring", "c")
    pieces = tuple(Region(n, "rotating", "steel", (5.349e-3, 6.5e-3), z) for n, z in zip(names, pairwise(ends), strict=True))
    apart = replace(spindle, regions=(*rest, *pieces))
    one = replace(
        spindle,
        regions=(*rest, Region("tube", "rotating", "steel", (5.349e-3, 6.5e-3), (3.0e-3, 20.0e-3))),
        bearings=tuple(replace(b, outer_ring="tube", raceway_width=3.0e-3) for b in spindle.bearings),
    )
    found, expected = expand(one, 60.0), expand(apart, 60.0)
    for b in spindle.bearings:
        assert found[b.name].outer_r == pytest.approx(expected[b.name].outer_r, rel=2e-4)
        assert found[b.name].outer_z == pytest.approx(expected[b.name].outer_z, abs=2e-4 * 1e-5)
    assert found["upper"].outer_z - found["lower"].outer_z > 5e-6  # the mean of the whole tube would be one number


def test_preload_feels_it(tube):
    """A steel tube on steel rings back to back: the span grows, load lines apart or not, by what the shaft grows; preload stays put."""
    motion = expand(tube, 60.0)
    state = solve(tube, Condition(60.0), motion)
    mean = replace(motion["lower"], outer_z=0.0)
    wrong = solve(tube, Condition(60.0), motion | {"lower": mean, "upper": replace(motion["upper"], outer_z=0.0)})
    assert state.bearings[0].preload == pytest.approx(16.0, rel=0.03)
    assert wrong.bearings[0].preload < 0.7 * state.bearings[0].preload


def test_raceways_are_a_bearing_wide(tube, spindle):
    assert [race.z for race in races(spindle, "rotating")] == [None, None]  # a ring of its own counts whole
    for b in tube.bearings:
        outer = raceways(tube, b)[1]
        assert np.diff(outer.z)[0] == pytest.approx(1.9 * b.ball_diameter)
        assert np.mean(outer.z) == pytest.approx(b.z)
        told = replace(b, raceway_width=1e-3)
        assert np.diff(tube.raceway("tube", told))[0] == pytest.approx(1e-3)


def test_raceways_of_a_tandem_pair_meet(tube):
    """Bearings side by side are as wide as they are apart, a series 70 pair 1.89 ball diameters: less than where nobody is near."""
    ball = tube.bearings[0].ball_diameter
    low, high = (replace(b, z=z) for b, z in zip(tube.bearings, (8.0e-3, 8.0e-3 + 1.89 * ball), strict=True))
    pair = replace(tube, bearings=(low, high))
    assert pair.raceway("tube", low) == pytest.approx((8.0e-3 - 0.945 * ball, 8.0e-3 + 0.945 * ball))
    assert pair.raceway("tube", high)[0] == pytest.approx(pair.raceway("tube", low)[1])
    check_raceways(Path("spindle.toml"), pair)
    own = replace(tube, bearings=(low, replace(high, raceway_width=2.2 * ball)))  # a width that is told leaves the row beside less
    assert own.raceway("tube", low)[1] == pytest.approx(own.raceway("tube", own.bearings[1])[0])
    check_raceways(Path("spindle.toml"), own)


def test_heat_enters_each_raceway_where_it_is(tube):
    """Half of each bearing's friction enters the tube, at its own raceway and nowhere else; the
    quick reading agrees with the field's expansion."""
    model = conduction.model(tube, influence(tube).sections)
    load = {"lower": 0.0, "upper": 0.0}
    field = heat.steady(model, heat.Running(25.0, 754.0, load))
    nodal = model.nodal(field)
    quick, direct = reading(model).motions(tube, nodal), expand(tube, field)
    for b in tube.bearings:
        assert quick[b.name].outer_z == pytest.approx(direct[b.name].outer_z, rel=1e-9)
    low, high = (model.bearing[k][model.spans["rotating"]] for k in range(2))
    assert low.sum() == pytest.approx(0.5)
    assert high.sum() == pytest.approx(0.5)
    assert np.abs(low * high).max() == 0.0
