"""Imperfections: measured profiles, plausible draws from a seed, and their table in a scene file."""

import copy
from dataclasses import replace

import numpy as np
import pytest

from tests.model.conftest import FILE
from thermospindle.model.built.drawn import GRADES, drawn
from thermospindle.model.built.imperfections import Imperfections, RowImperfections, Wave, waves
from thermospindle.model.errors import BadInput
from thermospindle.model.scene.reading import build, content_hash, load


def test_waves_of_a_measured_profile():
    """A profile made of known waves and a mean gives them back."""
    azimuth = 2 * np.pi * np.arange(256) / 256
    made = {2: (30e-9, 0.3), 11: (4e-9, -2.0), 40: (1e-9, 1.0)}
    found = waves(1e-6 + sum(a * np.cos(n * azimuth + p) for n, (a, p) in made.items()), 40)
    assert [w.order for w in found] == list(range(1, 41))
    for wave in found:
        if wave.order in made:
            assert (wave.amplitude, wave.phase) == pytest.approx(made[wave.order], rel=1e-9)
        else:
            assert wave.amplitude < 1e-20
    with pytest.raises(ValueError, match="shows orders 1 to 127, not 128"):
        waves(np.zeros(256), 128)


def test_same_seed_same_spindle(spindle):
    assert drawn(spindle, 4) == drawn(spindle, 4)
    assert drawn(spindle, 4) != drawn(spindle, 5)


def test_unbalance_is_permissible_at_the_spindles_own_speed(spindle):
    """e = G / speed: twice as fast, half the unbalance."""
    fast = replace(spindle, nominal_speed=2 * spindle.nominal_speed)
    assert drawn(fast, 4).unbalance == pytest.approx(drawn(spindle, 4).unbalance / 2, rel=1e-12)


@pytest.mark.parametrize("name", GRADES)
def test_a_draw_keeps_the_limits_of_its_grade(spindle, name):
    """ISO 21940-11: m G / speed, the couple at half the span; ISO 3290-1: the set's diameters lie within V_DwL."""
    grade = GRADES[name]
    mass = next(b.mass for b in spindle.structure.bodies if b.turns)
    permissible = mass * grade.balance / spindle.nominal_speed
    sets = [drawn(spindle, seed, grade) for seed in range(50)]
    assert 0.3 * permissible < np.mean([s.unbalance for s in sets]) < 0.7 * permissible
    assert max(s.unbalance for s in sets) < permissible
    assert max(s.couple_unbalance for s in sets) < permissible * 11.5e-3 / 2
    rows = [row for s in sets for row in s.bearings.values()]
    assert (
        0.5 * grade.ball_lot
        < np.mean([np.ptp(r.ball_diameter) for r in rows])
        < max(np.ptp(r.ball_diameter) for r in rows)
        < grade.ball_lot
    )
    assert np.abs([np.mean(r.ball_diameter) for r in rows]).max() < 1e-20
    for order in (2, 10):
        amplitude = [w.amplitude for r in rows for race in (r.inner_radial, r.outer_axial) for w in race if w.order == order]
        assert np.sqrt(np.mean(np.square(amplitude))) == pytest.approx(grade.race * 2 / order, rel=0.2)


def test_balls_are_as_round_as_their_grade(spindle):
    """Deviation from spherical form along the rolling circle, its circumscribed circle against its lowest point, seldom above the limit."""
    angle = np.linspace(0, 2 * np.pi, 200)
    grade = GRADES["high precision"]
    balls = [w for seed in range(20) for r in drawn(spindle, seed).bearings.values() for w in r.ball_waves]
    deviation = np.array([np.ptp(sum(w.amplitude * np.cos(w.order * angle + w.phase) for w in own)) for own in balls])
    assert 0.2 * grade.ball_form < np.median(deviation) < 0.8 * grade.ball_form
    assert np.mean(deviation > grade.ball_form) < 0.05


def test_the_scene_holds_them_in_si(raw):
    raw["imperfections"]["bearings"]["lower"] = {
        "inner_axial": {"order": [10, 3], "amplitude_nm": [20.0, 5.0], "phase_deg": [90.0, 0.0]},
        "ball_diameter_nm": [10.0, *[0.0] * 9],
        "ball_waves": [{"order": 2, "amplitude_nm": [1.0] * 10, "phase_deg": [180.0] * 10}],
        "cage_unbalance_g_mm": 0.5,
    }
    raw["imperfections"] |= {"unbalance_g_mm": 2.0, "couple_unbalance_g_mm2": 3.0, "unbalance_z_mm": 4.0}
    found = build(raw, FILE).imperfections
    assert (found.unbalance, found.couple_unbalance, found.unbalance_z) == pytest.approx((2e-6, 3e-9, 4e-3))
    row = found.row("lower")
    assert row.inner_axial == (Wave(10, pytest.approx(20e-9), pytest.approx(np.pi / 2)), Wave(3, pytest.approx(5e-9), 0.0))
    assert row.outer_radial == ()
    assert row.ball_diameter == pytest.approx((1e-8, *[0.0] * 9))
    assert len(row.ball_waves) == 10
    assert row.ball_waves[4] == (Wave(2, pytest.approx(1e-9), pytest.approx(np.pi)),)
    assert row.cage_unbalance == pytest.approx(5e-7)


def test_a_scene_may_draw_them(raw):
    """`seed` and `grade` alone: the same set as drawn in Python."""
    raw["imperfections"] = {"seed": 7, "grade": "precision", "origin": "assumed"}
    spindle = build(raw, FILE)
    assert spindle.imperfections == drawn(spindle, 7, GRADES["precision"])
    for grade in GRADES:  # every grade may stand in a scene
        raw["imperfections"]["grade"] = grade
        assert build(raw, FILE).imperfections.unbalance > 0


def test_a_scene_may_hold_a_measured_profile(raw):
    azimuth = 2 * np.pi * np.arange(128) / 128
    profile = (20 * np.cos(11 * azimuth + 0.4) + 300).tolist()
    upper(raw)["inner_radial"] = {"profile_nm": profile, "highest_order": 40}
    found = build(raw, FILE).imperfections.row("upper").inner_radial
    assert len(found) == 40
    assert (found[10].order, found[10].amplitude, found[10].phase) == (11, pytest.approx(20e-9), pytest.approx(0.4))
    assert max(w.amplitude for w in found if w.order != 11) < 1e-18


def test_a_scene_without_them_is_perfect(raw):
    raw.pop("imperfections")
    spindle = build(raw, FILE)
    assert spindle.imperfections == Imperfections()
    assert spindle.imperfections.row("lower") == RowImperfections()


def test_they_are_part_of_the_content(raw):
    first = content_hash(build(copy.deepcopy(raw), FILE))
    raw["imperfections"]["bearings"]["upper"]["outer_radial"]["amplitude_nm"][0] += 1.0
    assert content_hash(build(raw, FILE)) != first


def test_every_number_of_the_scene_has_an_origin():
    own = {key: p for key, p in load(FILE).provenance.items() if key.startswith("imperfections.")}
    assert len(own) > 30
    assert {p.origin for p in own.values()} == {"assumed"}
    assert all(p.source for p in own.values())


def upper(raw):
    return raw["imperfections"]["bearings"]["upper"]


REFUSED = [
    ("misspelt", lambda r: r["imperfections"].update(unbalance=1.0), "imperfections.unbalance: unknown key", "unbalance_g_mm"),
    (
        "negative",
        lambda r: r["imperfections"].update(unbalance_g_mm=-1.0),
        "imperfections.unbalance_g_mm = -1",
        "greater than or equal to 0",
    ),
    (
        "bearing",
        lambda r: r["imperfections"]["bearings"].update(middle={}),
        "imperfections.bearings.middle: names no bearing",
        "lower, upper",
    ),
    ("order-zero", lambda r: upper(r)["outer_radial"]["order"].__setitem__(0, 0), "outer_radial.order.1 = 0", "greater than or equal to 1"),
    ("columns", lambda r: upper(r)["outer_radial"]["phase_deg"].pop(), "imperfections.bearings.upper.outer_radial", "one entry each"),
    ("twice", lambda r: upper(r)["outer_radial"]["order"].__setitem__(0, 2), "imperfections.bearings.upper.outer_radial", "stands once"),
    ("balls", lambda r: upper(r)["ball_diameter_nm"].pop(), "imperfections.bearings.upper.ball_diameter_nm: has 9", "the 10 balls"),
    ("seed", lambda r: r["imperfections"].update(seed=1, grade="ordinary"), "imperfections", "beside them: bearings"),
    ("seed-alone", lambda r: r.update(imperfections={"seed": 1, "origin": "assumed"}), "imperfections", "one is missing"),
    ("grade", lambda r: r.update(imperfections={"seed": 1, "grade": "G5"}), "imperfections.grade = 'G5'", "high precision"),
    ("two-forms", lambda r: upper(r)["inner_axial"].update(profile_nm=[0.0] * 9, highest_order=2), "upper.inner_axial", "has either order"),
    (
        "short-profile",
        lambda r: upper(r).update(inner_axial={"profile_nm": [0.0] * 9, "highest_order": 5}),
        "upper.inner_axial",
        "below half of the 9 values",
    ),
    (
        "ball-waves",
        lambda r: upper(r)["ball_waves"][1]["phase_deg"].pop(),
        "imperfections.bearings.upper.ball_waves.2.phase_deg: has 9",
        "the 10 balls",
    ),
]


@pytest.mark.parametrize(("spoil", "key", "allowed"), [r[1:] for r in REFUSED], ids=[r[0] for r in REFUSED])
def test_refused(raw, spoil, key, allowed):
    spoil(raw)
    with pytest.raises(BadInput) as error:
        build(raw, FILE)
    assert str(error.value).startswith(str(FILE))
    assert key in str(error.value)
    assert allowed in str(error.value)


def test_no_row_means_a_perfect_one(spindle):
    only = replace(spindle.imperfections, bearings={"upper": spindle.imperfections.row("upper")})
    assert only.row("lower") == RowImperfections()
