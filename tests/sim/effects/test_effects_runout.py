"""Effects on what excites a running spindle: the lines of each, their size in closed form, and that impact tests do not see them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.bearing.kinematics import row_kinematics
from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import motion_rows
from thermospindle.model.units import RPM
from thermospindle.sim.effects import by_name
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.excitation import excitation, harmonics, response


@pytest.fixture(scope="module")
def perfect(spindle):
    """The reference spindle without imperfections."""
    return replace(spindle, imperfections=Imperfections())


def excited(spindle, name, speed=7200.0, **values):
    effect = by_name(name)
    return operating_point(spindle, Condition(20.0, speed * RPM), [(effect, effect.typical() | values)])


def lines(point):
    return {(g.bearing, g.cause, g.order, g.direction): round(g.frequency, 2) for g in harmonics(point).line}


@pytest.mark.parametrize(
    ("name", "values", "expected"),
    [
        ("unbalance", {}, {("", "unbalance", 0, "radial"): 120.0}),
        ("ball_size", {"bearing": 0}, {("lower", "ball size", 0, "radial"): 69.53}),
        ("cage_unbalance", {"bearing": 1}, {("upper", "cage unbalance", 0, "radial"): 69.53}),
        (
            "ball_waviness",
            {"half_order": 1, "bearing": 0},
            {
                ("lower", "ball waviness", 2, "radial"): 739.85,  # 600.79 stands beside it
                ("lower", "ball waviness", 2, "axial"): 670.32,
            },
        ),
        ("race_waviness", {"multiple": 1, "offset": 0, "ring": 1, "bearing": 1}, {("upper", "outer waviness", 10, "axial"): 504.73}),
        ("race_waviness", {"multiple": 1, "offset": 0, "ring": 0, "bearing": 1}, {("upper", "inner waviness", 10, "axial"): 695.27}),
        ("race_waviness", {"multiple": 1, "offset": 1, "ring": 1, "bearing": 0}, {("lower", "outer waviness", 11, "radial"): 624.73}),
        ("race_waviness", {"multiple": 1, "offset": -1, "ring": 1, "bearing": 0}, {("lower", "outer waviness", 9, "radial"): 384.73}),
        ("race_waviness", {"multiple": 0, "offset": 1, "ring": 1, "bearing": 0}, {("lower", "outer waviness", 1, "radial"): 120.0}),
        ("race_waviness", {"multiple": 0, "offset": 1, "ring": 0, "bearing": 0}, {}),  # an eccentric race that stands still
    ],
)
def test_each_effect_has_its_lines_and_no_others(perfect, name, values, expected):
    """Frequencies of Jang & Jeong's spindle: 69.527, 504.73, 695.27, 2 fb 670.32 and 600.79 / 739.85 Hz."""
    point = excited(perfect, name, **values)
    assert lines(point) == expected
    if name == "ball_waviness":
        assert sorted(round(g.frequency, 2) for g in harmonics(point).line) == [600.79, 670.32, 739.85]


@pytest.mark.parametrize("name", ["unbalance", "race_waviness", "ball_size", "ball_waviness", "cage_unbalance"])
def test_the_response_is_proportional_to_the_size_and_modes_stay(perfect, name):
    effect = by_name(name)
    main = effect.parameters[0]
    once, twice = (excited(perfect, name, **{main.name: k * main.typical}) for k in (1, 2))
    one, two = (response(p, harmonics(p)) for p in (once, twice))
    assert np.abs(one).max() > 0
    assert two == pytest.approx(2 * one, rel=1e-9, abs=1e-9 * np.abs(one).max())
    plain = operating_point(perfect, once.condition, ())
    assert [m.frequency for m in once.modes] == [m.frequency for m in plain.modes]


def test_unbalance_is_a_turning_force_at_the_mass_centre(perfect):
    point = excited(perfect, "unbalance", amount=2.0, phase=90.0)
    force = harmonics(point).force[0]
    body = next(b for b in point.chain.bodies if b.turns)
    rows = motion_rows(point.chain, body.name, (0.0, 0.0, body.z))
    size = 2.0e-6 * (240 * np.pi) ** 2
    # towards +y at time zero, a quarter turn later towards -x
    expected = size * (rows[1] + 1j * rows[0])
    assert force == pytest.approx(expected, rel=1e-12, abs=1e-12 * size)


def test_unbalance_adds_to_the_scenes_as_vectors_at_any_height(spindle):
    """The scene's stands at 10 mm, the effect's at the mass centre: moving the first leaves a couple, and the sum of forces stays."""
    condition = Condition(20.0, 7200 * RPM)
    plain = operating_point(spindle, condition, ())
    effect = by_name("unbalance")
    own = effect.typical() | {"amount": 0.3}
    both = operating_point(spindle, condition, [(effect, own)])
    alone = operating_point(replace(spindle, imperfections=Imperfections()), condition, [(effect, own)])
    forces = [next(f for g, f in zip(e.line, e.mass, strict=True) if g.cause == "unbalance") for e in map(excitation, (plain, alone, both))]
    assert forces[2] == pytest.approx(forces[0] + forces[1], rel=1e-9, abs=1e-12 * np.abs(forces[2]).max())


def test_an_eccentric_turning_pair_of_races_moves_the_hub_by_its_eccentricity(perfect):
    """Both outer races displaced alike, slowly: the hub goes along as a whole."""
    condition = Condition(20.0, 60 * RPM)
    effect = by_name("race_waviness")
    values = effect.typical() | {"amplitude": 100.0, "multiple": 0, "ring": 1}
    point = operating_point(perfect, condition, [(effect, values | {"bearing": b}) for b in (0, 1)])
    found = harmonics(point)
    assert {g.name for g in found.line} == {"fo"}
    hub = motion_rows(point.chain, "hub", (0.0, 0.0, 0.015))[0] @ response(point, found).sum(axis=0)
    assert abs(hub) == pytest.approx(100e-9, rel=1e-4)


def test_cage_unbalance_grows_with_the_square_of_the_cage_speed(perfect):
    sizes = []
    for speed in (3600.0, 7200.0):
        point = excited(perfect, "cage_unbalance", speed, amount=0.2, bearing=1)
        cage = row_kinematics(point.spindle, point.state)["upper"].cage
        force = harmonics(point).force[0]
        rows = motion_rows(point.chain, "hub", (0.0, 0.0, 0.0165))[:2]
        assert np.abs(force).max() == pytest.approx(0.2e-6 * cage**2 * np.abs(rows).max(), rel=1e-9)
        sizes.append(np.abs(force).max())
    assert sizes[1] / sizes[0] == pytest.approx(4.0, rel=1e-9)


def test_ball_size_and_ball_waviness_add_to_the_balls_the_scene_has(spindle):
    condition = Condition(20.0, 7200 * RPM)
    for name, values in (("ball_size", {"difference": 500.0, "bearing": 0}), ("ball_waviness", {"amplitude": 300.0, "bearing": 0})):
        effect = by_name(name)
        made = operating_point(spindle, condition, [(effect, effect.typical() | values)]).imperfections
        before, after = spindle.imperfections.row("lower"), made.row("lower")
        if name == "ball_size":
            assert np.subtract(after.ball_diameter, before.ball_diameter) == pytest.approx([500e-9, *[0.0] * 9], abs=1e-15)
        else:
            assert after.ball_waves[1:] == before.ball_waves[1:]
            assert after.ball_waves[0][:-1] == before.ball_waves[0]
            assert (after.ball_waves[0][-1].order, after.ball_waves[0][-1].amplitude) == (2, pytest.approx(300e-9))
        assert made.row("upper") == spindle.imperfections.row("upper")
