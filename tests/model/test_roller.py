"""Cylindrical roller rows: line contact, Sjovall's load integrals, interference, clearance over temperature, and scenes with them."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.model.bearing.roller import EXPONENT, RollerRow, RollerState, line_constant, respond, roller_row, with_cage_at
from thermospindle.model.machine import Condition, RingMotion
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.scene.reading import build
from thermospindle.model.units import RPM
from thermospindle.sim.effects import by_name, usable
from thermospindle.sim.effects.effect import refusal
from thermospindle.sim.operating import operating_point

FILE = ROOT / "tests" / "scenes" / "inner_turning_spring" / "spindle.toml"
LENGTH = 0.011
CONSTANT = line_constant(LENGTH)


def row(clearance: float, rollers: int = 30, offsets: tuple[float, ...] = (0.0,)) -> RollerRow:
    return RollerRow(rollers, LENGTH, CONSTANT, clearance, offsets)


# ---------------------------------------------------------------- contact


def test_the_constant_is_that_of_the_standard() -> None:
    """ISO/TS 16281: Q = 35 948 L^(8/9) d^(10/9) in N and mm, both contacts."""
    assert line_constant(0.010) * 5e-6**EXPONENT == pytest.approx(35_948 * 10 ** (8 / 9) * 0.005 ** (10 / 9), rel=1e-12)


def test_the_constant_is_near_palmgrens() -> None:
    """Two contacts of 3.84e-5 Q^0.9 / L^0.8 mm each: 4 % stiffer than the standard's."""
    load = CONSTANT * 5e-6**EXPONENT
    assert 2 * 3.84e-5 * load**0.9 / 11**0.8 == pytest.approx(0.005, rel=0.04)


# ---------------------------------------------------------------- load distribution

HARRIS = [(0.1, 0.1268), (0.2, 0.1737), (0.3, 0.2055), (0.4, 0.2286), (0.5, 0.2453), (0.6, 0.2568), (0.7, 0.2636), (0.8, 0.2658), (0.9, 0.2628), (1.0, 0.2523)]
"""Load zone and Sjovall's integral of line contacts: Harris, Rolling Bearing Analysis, Table 7.1."""


def sjovall(zone: float) -> float:
    """J(e) = 1 / 2 pi integral (1 - (1 - cos psi) / 2 e)^n cos psi over the load zone."""
    end = np.arccos(np.clip(1 - 2 * zone, -1, 1))
    return quad(lambda psi: max(1 - (1 - np.cos(psi)) / (2 * zone), 0.0) ** EXPONENT * np.cos(psi), -end, end)[0] / (2 * np.pi)


@pytest.mark.parametrize(("zone", "printed"), HARRIS)
def test_sjovall_integral(zone: float, printed: float) -> None:
    """Pushed until the load zone is `zone`; below one half with clearance, above with interference."""
    deepest = 10e-6
    shift = deepest / (2 * zone)  # e = deepest / (2 shift)
    found = -respond(row(2 * (shift - deepest)), np.array([-shift, 0, 0, 0, 0])).force[0] / (30 * CONSTANT * deepest**EXPONENT)
    assert found == pytest.approx(sjovall(zone), rel=1e-9)
    assert found == pytest.approx(printed, rel=5e-3)


def test_the_most_loaded_roller_without_clearance() -> None:
    """Q_max = 4.08 F / Z (Harris, Eq. 7.24)."""
    loose, pushed = row(0.0), np.array([0.0, -3e-6, 0, 0, 0])
    most = with_cage_at(loose, pushed, np.pi / 2)[2].max()
    assert most == pytest.approx(CONSTANT * 3e-6**EXPONENT, rel=1e-9)
    assert most * 30 / -respond(loose, pushed).force[1] == pytest.approx(4.08, rel=2e-3)


@pytest.mark.parametrize("clearance", [-8e-6, -4e-6, 0.0, 5e-6])
def test_forces_are_the_mean_over_all_places_of_the_cage(clearance: float) -> None:
    """Roller by roller at many places of the cage, rings displaced and tilted; a single place is
    off by more than a hundred times what is left."""
    some, at = row(clearance, rollers=12, offsets=(-0.009, 0.009)), np.array([-5e-6, 3e-6, 0.0, 1e-4, -3e-4])
    places = [with_cage_at(some, at, turn) for turn in 2 * np.pi / 12 * (np.arange(4000) + 0.5) / 4000]
    force, tangent = (np.mean([place[k] for place in places], axis=0) for k in (0, 1))
    answer = respond(some, at)
    assert answer.force == pytest.approx(force, abs=1e-8 * np.abs(force).max())
    assert answer.tangent == pytest.approx(tangent, abs=1e-5 * np.abs(tangent).max())
    assert answer.load == pytest.approx(np.mean([place[2].sum() for place in places]), rel=1e-8)
    if clearance >= 0.0:
        assert np.abs(with_cage_at(some, at, 0.0)[1] - tangent).max() > 1e-3 * np.abs(tangent).max()


def test_interference_stiffens_evenly() -> None:
    """Centred: Z / 2 n c d^(n-1) in every direction across, L^2 / 12 of it against tilt, and nothing along the axis."""
    pressed = 2e-6
    answer = respond(row(-2 * pressed))
    radial = 30 / 2 * EXPONENT * CONSTANT * pressed ** (EXPONENT - 1)
    assert answer.tangent == pytest.approx(np.diag([radial, radial, 0.0, radial * LENGTH**2 / 12, radial * LENGTH**2 / 12]), rel=1e-9, abs=1e-3)
    assert answer.force == pytest.approx(np.zeros(5), abs=1e-9)
    assert with_cage_at(row(-2 * pressed), np.zeros(5), 0.3)[2] == pytest.approx(CONSTANT * pressed**EXPONENT, rel=1e-12)
    assert answer.load == pytest.approx(30 * CONSTANT * pressed**EXPONENT, rel=1e-12)


def test_two_rows_tilt_about_their_middle() -> None:
    pressed, spacing = 2e-6, 0.018
    both = respond(row(-2 * pressed, offsets=(-spacing / 2, spacing / 2))).tangent
    one = respond(row(-2 * pressed)).tangent
    assert both[0, 0] == pytest.approx(2 * one[0, 0], rel=1e-12)
    assert both[3, 3] == pytest.approx(2 * one[3, 3] + 2 * one[0, 0] * spacing**2 / 4, rel=1e-9)


def test_loose_rollers_carry_nothing() -> None:
    answer = respond(row(10e-6), np.array([4e-6, 0, 0, 0, 0]))
    assert not answer.force.any()
    assert not answer.tangent.any()


@pytest.mark.parametrize("clearance", [-4e-6, 0.0, 5e-6])
def test_stiffness_is_the_derivative_of_force(clearance: float) -> None:
    at, step = np.array([-7e-6, 3e-6, 2e-6, 1e-4, -3e-4]), 1e-10
    some = row(clearance, offsets=(-0.009, 0.009))
    numeric = [(respond(some, at + step * e).force - respond(some, at - step * e).force) / (2 * step) for e in np.eye(5)]
    tangent = respond(some, at).tangent
    assert tangent == pytest.approx(np.array(numeric).T, abs=1e-5 * np.abs(tangent).max())
    assert tangent == pytest.approx(tangent.T, abs=1e-9 * np.abs(tangent).max())


# ---------------------------------------------------------------- in a scene


ROW = {
    "origin": "assumed", "source": "test", "rollers": 16, "roller_diameter_mm": 1.588, "roller_length_mm": 1.6, "pitch_diameter_mm": 9.1,
    "roller_material": "steel", "ring_material": "steel", "damping_ratio": 0.02,
}  # fmt: skip


def text(clearance_um: float) -> str:
    """The small shaft that turns in a housing, with a roller row above in place of its upper ball
    row; the lower one is pushed from outside."""
    raw = FILE.read_text(encoding="utf-8")
    head, pair = raw.split("[bearings.upper]", 1)
    _, tail = pair.split("# ---------------------------------------------------------------- rotor-base structure", 1)
    row = "".join(f"{key} = {json.dumps(value)}\n" for key, value in (ROW | {"mounted_clearance_um": clearance_um}).items())
    return f"""{head}
[roller_rows.above]
{row}
[bearings.upper]
origin = "assumed"
source = "test"
row = "above"
z_mm = 16.5
inner_ring = "upper inner ring"
outer_ring = "upper outer ring"
[sets.lower]
origin = "assumed"
source = "test"
bearings = ["lower"]
preload_N = 16.0
preload_kind = "spring"
# {tail}""".replace('outer_ring = "lower outer ring"', 'outer_ring = "lower outer ring"\nsense = "-z"')


def rollers_above(clearance_um: float = -3.0) -> dict:
    return tomllib.loads(text(clearance_um))


@pytest.fixture(scope="module")
def above():
    return build(rollers_above(), FILE)


def test_a_roller_row_floats_and_carries_across(above) -> None:
    point = operating_point(above, Condition(20.0))
    state = point.state.any_bearing("upper")
    assert isinstance(state, RollerState)
    pressed = 1.5e-6
    modulus = 208e9 / (2 * (1 - 0.3**2))
    assert state.radial_stiffness == pytest.approx(16 / 2 * EXPONENT * line_constant(0.0016, modulus) * pressed ** (EXPONENT - 1), rel=1e-9)
    assert state.axial_stiffness == 0.0
    assert state.load == pytest.approx(16 * line_constant(0.0016, modulus) * pressed**EXPONENT, rel=1e-9)
    lateral = [e for e in point.chain.elements if e.name == "upper"]
    assert len(lateral) == 1


def test_mujoco_carries_rollers(above) -> None:
    point = operating_point(above, Condition(20.0))
    own, found = matrices(point.chain), mjcf.linearise(point.model)
    size = np.sqrt(np.abs(np.outer(np.diag(own.stiffness), np.diag(own.stiffness))))
    assert (np.abs(found.stiffness - own.stiffness) <= 1e-6 * size).all()


def test_clearance_follows_races_and_rollers(above) -> None:
    """A race that grows outward inside, one that grows outside, rollers that grow: c0 + 2 (outer - inner) - 2 D strain."""
    [b] = above.roller_bearings
    motion = RingMotion(5e-6, 0.0, 3e-6, 0.0, 0.0, 0.0, 2e-4, 30.0)
    assert roller_row(above, b, motion, 30.0).clearance == pytest.approx(-3e-6 + 2 * (3e-6 - 5e-6) - 2 * 1.588e-3 * 2e-4, rel=1e-12)


def test_a_spindle_of_one_steel_keeps_its_clearance(above) -> None:
    """Uniform warming of one material scales the gap between the races as it does the rollers."""
    steel = above.materials["steel"]
    alike = replace(above, materials={name: replace(steel, name=name) for name in above.materials})
    warm = operating_point(alike, Condition(60.0)).state.any_bearing("upper")
    region = alike.region
    gap = region("upper outer ring").r[0] - region("upper inner ring").r[1]
    strain = 11.5e-6 * 40
    assert warm.clearance == pytest.approx(-3e-6 + 2 * strain * (gap - 1.588e-3), abs=1e-10)


def test_a_warm_housing_of_aluminium_lets_the_rollers_go(above) -> None:
    """It widens the outer ring more than the steel shaft does the inner one: rollers that were pressed are less so,
    and softer. By bonded rings the outer race moves by some 5 um over 40 K, so that 3 um of interference are gone."""
    cold, warm, hot = (operating_point(above, Condition(t)).state.any_bearing("upper") for t in (20.0, 25.0, 60.0))
    assert cold.clearance < warm.clearance < hot.clearance
    assert cold.radial_stiffness > warm.radial_stiffness > hot.radial_stiffness == 0.0
    assert hot.load == 0.0 < hot.clearance


@pytest.mark.parametrize("verb", ["table", "modes", "static", "check"])
def test_verbs_take_rollers(verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path)
    more = ["--temperatures", "20", "22"] if verb == "table" else []
    assert main([verb, str(tmp_path), *more, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    if verb == "table":
        rear = answer["bearings"]["upper"]
        assert rear["radial_stiffness_N_per_m"][0] > rear["radial_stiffness_N_per_m"][1] > 1e6
        assert rear["contact_angle_deg"] == [None, None]
        assert rear["contact_force_N"][0] > 1
    if verb == "check":
        assert answer["bearings"]["upper"]["kind"] == "roller row"
        assert answer["bearings"]["upper"]["clearance_um"] == pytest.approx(-3.0, abs=1e-6)


@pytest.mark.slow
def test_rollers_warm_up(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their clearance opens as the housing warms, and their friction is Palmgren's, by the sum of their contact loads."""
    write(tmp_path)
    assert main(["warmup", str(tmp_path), "--speed", "3000", "--minutes", "30", "--json"]) == 0
    bearings = json.loads(capsys.readouterr().out)["bearings"]
    assert list(bearings) == ["lower", "upper"]
    upper = bearings["upper"]
    assert upper["clearance_um"][0] == pytest.approx(-3.0, abs=1e-6)
    assert upper["clearance_um"][-1] > upper["clearance_um"][0]
    assert upper["radial_stiffness_N_per_m"][-1] < upper["radial_stiffness_N_per_m"][0]
    spindle = build(rollers_above(), FILE)
    pressed = 16 * line_constant(0.0016, 208e9 / (2 * (1 - 0.3**2))) * 1.5e-6**EXPONENT
    of_balls = 0.9 * 16.0 / np.tan(np.radians(24.51))  # N, of the row under its 16 N: Harris, Rolling Bearing Analysis, ch. 14
    more = spindle.thermal.friction.f1 * (pressed - of_balls) * 9.1e-3 * 3000 * RPM
    assert upper["friction_W"][0] - bearings["lower"]["friction_W"][0] == pytest.approx(more, rel=1e-6)


def write(folder: Path, clearance: float = -3.0) -> None:
    (folder / "spindle.toml").write_text(text(clearance), encoding="utf-8")


def test_loose_rollers_are_odd(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path, 8.0)
    assert main(["check", str(tmp_path), "--json"]) == 0
    assert any("bearing upper: its rollers are loose by 8 um" in words for words in json.loads(capsys.readouterr().out)["odd"])


def test_effects_of_ball_rows_have_nothing_to_act_on() -> None:
    raw = rollers_above()
    raw["bearings"]["lower"] = raw["bearings"]["upper"] | {"z_mm": 5.0, "inner_ring": "lower inner ring", "outer_ring": "lower outer ring"}
    for key in ("sets", "ball_rows"):
        raw.pop(key)
    only = build(raw, FILE)
    assert not only.bearings
    assert refusal(by_name("preload_loss"), only) == "nothing to act on here: the scene has no ball row"
    assert {"clearance_opening", "ball_inertia", "hertz_amplitude"} & {e.name for e in usable(only)} == set()
    assert operating_point(only, Condition(22.0)).modes


REFUSED = [
    (lambda r: r["roller_rows"]["above"].update(rollers=20), "rollers = 20: so many of roller_diameter_mm = 1.588 do not fit on the pitch circle of pitch_diameter_mm = 9.1; at most 18 do"),
    (lambda r: r["roller_rows"]["above"].update(rows=2), "row_spacing_mm is missing"),
    (lambda r: r["roller_rows"]["above"].update(row_spacing_mm=2.0), "row_spacing_mm is for several rows"),
    (lambda r: r["roller_rows"]["above"].update(roller_material="brass"), "roller_material = 'brass': allowed are aluminium, steel"),
    (lambda r: r["roller_rows"]["above"].update(roller_diameter_mm=1.2), "the raceways leave 1.597 mm for rollers of roller_diameter_mm = 1.2"),
    (lambda r: r["bearings"]["lower"].update(race_give_um_per_kN=0.1), "bearings.lower: race_give_um_per_kN is for a roller row"),
    (lambda r: r["bearings"]["upper"].update(sense="+z"), "bearings.upper: sense is for a ball row"),
    (lambda r: r["bearings"]["upper"].pop("inner_ring"), "inner_ring and outer_ring go together"),
    (lambda r: r["bearings"]["upper"].update(outer_ring="nose"), "outside its ring 'nose'"),
    (lambda r: r["roller_rows"].update(hdd=r["roller_rows"]["above"]), "roller_rows.hdd: a ball row has that name"),
    (lambda r: r["bearings"]["upper"].update(row="N9"), "bearings.upper.row = 'N9': no row of this scene, nor a shipped one; allowed are hdd, above, B7015C"),
]


@pytest.mark.parametrize(("change", "why"), REFUSED, ids=[why for _, why in REFUSED])
def test_what_is_no_roller_row_is_refused(change, why: str) -> None:
    raw = rollers_above()
    change(raw)
    with pytest.raises(ValueError, match=None) as refused:
        build(raw, FILE)
    assert why in str(refused.value)


def test_the_load_that_a_clearance_lets_through() -> None:
    """A row with clearance under a force: the ring moves until the rollers in its zone carry it, by its own equation."""
    clearance, force = 6e-6, 2000.0
    loose = row(clearance)
    shift = brentq(lambda x: -respond(loose, np.array([-x, 0, 0, 0, 0])).force[0] - force, 0.0, 1e-3)

    def carried(x: float) -> float:
        deepest = x - clearance / 2
        return 30 * CONSTANT * deepest**EXPONENT * sjovall(deepest / (2 * x)) - force

    assert shift == pytest.approx(brentq(carried, clearance / 2 + 1e-9, 1e-3), rel=1e-8)
