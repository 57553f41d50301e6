"""Effects on balls and lubricant, each against something it did not produce."""

from dataclasses import replace

import numpy as np
import pytest

from tests.effect_points import COLD_FAST, REST, RUNNING, at
from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.machine import Condition
from thermospindle.model.material import Law
from thermospindle.sim.effects.bearing import ball_inertia, ball_material, grease_damping, lubricant_film
from thermospindle.sim.effects.temperature import loose_inserts
from thermospindle.sim.operating import operating_point
from thermospindle.thermal.expansion import expand


def test_ceramic_balls_against_hertz_and_growth(spindle):
    """K ~ 2 / ((1 - nu_b^2)/E_b + (1 - nu_r^2)/E_r) at equal geometry; the ball grows by 3.2e-6/K."""
    state, plain = (solve(s, Condition(20.0), {b.name: reference_motion(20.0) for b in s.bearings})
                    for s in (ball_material.EFFECT.spindle(spindle, REST, {"share": 1.0}), spindle))  # fmt: skip
    ring = (1 - 0.3**2) / 208e9
    softness = ring + (1 - 0.27**2) / 310e9
    assert state.bearings[0].row.constant / plain.bearings[0].row.constant == pytest.approx(2 * ring / softness, rel=1e-9)
    assert state.bearings[0].preload == pytest.approx(16.0, rel=1e-9)
    hybrid = ball_material.EFFECT.spindle(spindle, REST, {"share": 1.0})
    assert expand(hybrid, 60.0)["lower"].ball_strain == pytest.approx(3.2e-6 * 40, rel=1e-12)
    assert hybrid.materials[hybrid.bearings[0].ball_material].density == pytest.approx(3200.0)


def test_a_share_of_ceramic_follows_a_steel_given_over_temperature():
    law = loose_inserts.blend(Law((20.0, 40.0, 80.0), (10.0, 12.0, 20.0)), Law((0.0,), (4.0,)), 0.25)
    assert [law(t) for t in (20.0, 30.0, 60.0)] == pytest.approx([8.5, 9.25, 13.0])


def nijenbanning(radius, ratio, modulus, viscosity, speed, pressure_viscosity, load):
    """Central film by Nijenbanning, Venner & Moes, Wear 176 (1994) 217-229, Eqs. 34-37; `ratio` = R_x / R_y <= 1."""
    u = 2 * viscosity * speed / (modulus * radius)
    m, ell = load / (modulus * radius**2) * u**-0.75, pressure_viscosity * modulus * u**0.25
    shape = 1 + 0.006 * np.log(ratio) + 0.63 * ratio ** (4 / 7)
    rigid_iso = 145 * (1 + 0.796 * ratio ** (14 / 15)) ** (-15 / 7) / ratio * m**-2
    elastic_iso = 3.18 * shape ** (-14 / 25) * ratio ** (-1 / 15) * m ** (-2 / 15)
    rigid_piezo = 1.29 * (1 + 0.691 * ratio) ** (-2 / 3) * ell ** (2 / 3)
    elastic_piezo = 1.48 * shape ** (-7 / 20) * ratio ** (-1 / 24) * m ** (-1 / 12) * ell**0.75
    s = 1.5 * (1 + np.exp(-1.2 * elastic_iso / elastic_piezo))
    iso = (rigid_iso**1.5 + (elastic_iso**-4 + (1.8 / ratio) ** -4) ** (-3 / 8)) ** (2 * s / 3)
    return radius * np.sqrt(u) * (iso + (rigid_piezo**-8 + elastic_piezo**-8) ** (-s / 8)) ** (1 / s)


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.1])
@pytest.mark.parametrize("load", [20.0, 100.0])
def test_film_against_another_published_formula(ratio, load):
    """Two fits to independent numerical solutions (Twente multigrid, Leeds) at elastic-piezoviscous conditions; each claims 10 %."""
    steel, oil = 2.3e11, (0.04, 1.5, 2.2e-8)
    ellipticity = 1.03 * ratio**-0.64  # Hamrock & Dowson 1977
    found = lubricant_film.central_film(0.01, steel, ellipticity, *oil, load)
    assert found == pytest.approx(nijenbanning(0.01, ratio, steel, *oil, load), rel=0.1)


def test_film_speed_is_the_balls_rolling_speed(spindle):
    """verification.md: outer ring at 120 Hz, cage 69.527 Hz, ball spin 335.16 Hz: both surfaces pass the inner contact alike."""
    b = spindle.bearings[0]
    gamma = b.ball_diameter * np.cos(b.contact_angle) / b.pitch_diameter
    found = lubricant_film.entrainment(b, 240 * np.pi)
    assert found == pytest.approx(2 * np.pi * 335.16 * b.ball_diameter / 2, rel=1e-4)
    assert found == pytest.approx(2 * np.pi * 69.527 * b.pitch_diameter / 2 * (1 - gamma), rel=1e-4)


def test_film_shortens_the_unloaded_distance(spindle):
    """By scale (h_i + h_o); worked by hand at 60 C, 7200 rpm: U 1.29e-10, G 5029, W 3.8e-5, factor of k 0.99: h_i 0.0763 um (2 %)."""
    inner, outer = lubricant_film.films(spindle, spindle.bearings[0], RUNNING.speed, 60.0)
    assert inner == pytest.approx(0.0763e-6, rel=0.02)
    assert 1.1 < outer / inner < 1.2  # (R_o / R_i)^(1 - 0.67 + 2 0.067), R_o / R_i = (1 + gamma) / (1 - gamma)
    point, plain = at(spindle, RUNNING, lubricant_film, scale=0.5), operating_point(spindle, RUNNING, [])
    change = [p.state.bearings[0].row.unloaded_distance for p in (plain, point)]
    assert change[0] - change[1] == pytest.approx((inner + outer) / 2, rel=1e-3)  # the film's temperature is the rings'


def test_a_film_that_does_not_wedge_is_a_spring_in_series_with_the_balls(spindle):
    """Load over approach by a finite change of load: film h Q^-0.067 beside Hertz's delta ~ Q^(2/3), worked without derivatives."""
    values = {"scale": 2.0, "wedge": 0.0, "loss_factor": 0.4}
    plain, point = operating_point(spindle, RUNNING, []), at(spindle, RUNNING, lubricant_film, **values)
    omega = 2 * np.pi * spindle.structure.damping_frequency
    for drawn, b, old in zip(spindle.bearings, point.state.bearings, plain.state.bearings, strict=True):
        film = 2 * sum(lubricant_film.films(spindle, drawn, RUNNING.speed, 60.0))
        load = 1 + np.array([-1e-4, 1e-4])
        approach = np.diff(old.deformation * load ** (2 / 3)), np.diff(film * load**-0.067)
        share = -approach[1].item() / approach[0].item()  # a thinner film under more load adds to the approach
        assert b.deformation == old.deformation
        assert b.stiffness == pytest.approx(old.stiffness / (1 + share), rel=1e-6)
        complex_stiffness = 1 / (1 / (old.stiffness[2, 2] + 1j * omega * old.damping[2, 2]) + share / old.stiffness[2, 2] * (1 - 0.4j))
        assert omega * b.damping[2, 2] == pytest.approx(complex_stiffness.imag, rel=0.01)  # to first order in the losses


@pytest.mark.parametrize(("temperature", "ratio"), [(20.0, 1.0), (40.0, 26.0 / 63.1), (60.0, 13.2 / 63.1)])
def test_grease_damping_follows_the_viscosity_table(spindle, temperature, ratio):
    point, plain = (f(spindle, Condition(temperature)) for f in (
        lambda s, c: at(s, c, grease_damping, viscous_share=0.4), lambda s, c: operating_point(s, c, [])))  # fmt: skip
    for b, old in zip(point.state.bearings, plain.state.bearings, strict=True):
        assert b.damping == pytest.approx((0.6 + 0.4 * ratio) * old.damping, rel=1e-12)
        assert b.stiffness is not None
        assert np.array_equal(b.stiffness, old.stiffness)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_heavy_balls_against_the_cage_speed(spindle, share):
    """Radial balance of a ball: Q_o cos(a_o) - Q_i cos(a_i) = F_c - 2 M_g sin(a_o) / D with F_c = share m d_m omega_c^2 / 2.

    Cage and ball at 69.527 and 335.16 of 120 Hz (verification.md), M_g = m D^2 / 10 omega_b omega_c sin(beta); 1 %: the speeds
    are those of the loaded angle at rest.
    """
    row = at(spindle, COLD_FAST, ball_inertia, share=share).state.bearings[0].row
    answer = respond(row)
    found = answer.outer_ball_force * np.cos(answer.outer_angle) - answer.ball_force * np.cos(answer.inner_angle)
    mass, cage, angle = np.pi / 6 * 7800 * 1.588e-3**3, 69.527 / 120 * COLD_FAST.speed, np.radians(24.51)
    beta = np.arctan2(np.sin(angle), np.cos(angle) + 1.588 / 9.1)
    gyroscopic = 0.4 * 1.588 / 9.1 * 335.16 / 69.527 * np.sin(beta) * np.sin(angle)
    assert found == pytest.approx(np.full(10, share * mass * 9.1e-3 / 2 * cage**2 * (1 - gyroscopic)), rel=0.01)


def test_ball_inertia_of_the_scene_is_kept(spindle):
    heavy = replace(spindle, ball_inertia=0.6)
    assert ball_inertia.EFFECT.spindle(heavy, RUNNING, {"share": 0.5}).ball_inertia == pytest.approx(0.8)
