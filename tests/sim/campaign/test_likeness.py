"""Units and channels that seem mistaken are said as FRFs are imported, and nothing is said of campaigns in which none is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import DATA, SCENE
from tests.sim.importing.exported import table
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.verbs import workbench as verb
from thermospindle.report.verbs.compare import compare
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign import likeness
from thermospindle.sim.campaign.beside import far_from
from thermospindle.sim.campaign.campaign import Campaign, read_campaign, write_campaign
from thermospindle.sim.campaign.likeness import likenesses
from thermospindle.sim.importing.units import of_frf


@pytest.fixture(scope="module")
def spindle():
    return load(SCENE)


@pytest.fixture(scope="module")
def foreign() -> Campaign:
    """Computed by a program that shares no code with this one."""
    return read_campaign(DATA / "foreign_none")


def changed(campaign: Campaign, change: Callable[[np.ndarray], np.ndarray]) -> Campaign:
    return replace(campaign, tests=tuple(replace(t, frf=t.frf and replace(t.frf, value=change(t.frf.value))) for t in campaign.tests))


@pytest.mark.parametrize("name", ["foreign_none", "foreign_bond"])
def test_nothing_is_said_of_tests_that_another_program_made(name, spindle):
    """Of one in which a bond softens, whose modes move by percents, neither."""
    assert likenesses(spindle, read_campaign(DATA / name)) == []


def test_nothing_is_said_of_a_spindle_that_is_far_from_its_drawing(spindle, foreign):
    """Joints half or twice as stiff: peaks stand tens of widths from where the model has them."""
    for times in (0.5, 2.0):
        joints = tuple(replace(j, stiffness=tuple(times * k for k in j.stiffness)) for j in spindle.structure.joints)
        assert likenesses(replace(spindle, structure=replace(spindle.structure, joints=joints)), foreign) == []


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 9.80665, 1 / 9.80665])
def test_a_factor_between_units_is_said_of_what_has_it(factor, spindle, foreign):
    first = np.arange(7) == 0
    told = f"{factor:.4g} times" if factor > 1 else f"1/{1 / factor:.4g} of"
    for change, who in (
        (lambda v: factor * v, "all FRFs are"),
        (lambda v: v * np.where(first, factor, 1.0)[:, None, None], "the FRFs of response 1 (hub_top0) are"),
        (lambda v: v * np.where(first[:2], factor, 1.0)[None, :, None], "the FRFs of the hammer at 1 (hub_top0) are"),
    ):
        [said] = likenesses(spindle, changed(foreign, change))
        assert said.startswith(f"{who} about {told}")
    assert likenesses(spindle, changed(foreign, lambda v: 3.0 * v)) == []


@pytest.mark.parametrize(
    ("temperature", "speed", "said"),
    [
        (lambda c: c, lambda rpm: rpm, []),
        (lambda c: 1.8 * c + 32, lambda rpm: rpm, ["C: the scene is for 20 to 60 C (temperature_range_C); as degrees Fahrenheit they would be near"]),
        (lambda c: c + 273.15, lambda rpm: rpm, ["C: the scene is for 20 to 60 C (temperature_range_C); in kelvin they would be near"]),
        (lambda c: c + 200.0, lambda rpm: rpm, ["C: the scene is for 20 to 60 C (temperature_range_C)"]),
        (lambda c: c, lambda rpm: rpm / 60, ["tests turn with 120 rpm at most: the scene is for 7200 rpm (nominal_speed_rpm); as speeds in Hz, 7200 rpm, they would be near"]),
        (lambda c: c, lambda rpm: 2 * rpm, ["tests turn with up to 14400 rpm: the scene is for 7200 rpm (nominal_speed_rpm)"]),
        (lambda c: c, lambda rpm: 0 * rpm, []),
    ],
)
def test_temperatures_and_speeds_that_the_scene_is_not_for_are_said(spindle, foreign, temperature, speed, said):
    """In Fahrenheit, or in Hz, they were imported without a word."""
    assert max(t.speed for t in foreign.tests) == pytest.approx(7200 * RPM)
    told = far_from(spindle, replace(foreign, tests=tuple(replace(t, temperature=temperature(max(t.temperature, 40.0)), speed=speed(t.speed)) for t in foreign.tests)))
    assert len(told) == len(said)
    for sentence, end in zip(told, said, strict=True):
        assert sentence.endswith(end)


def of_one(campaign: Campaign, test: int, change: Callable[[np.ndarray], np.ndarray]) -> Campaign:
    """One of the tests alone changed."""
    rows = zip(campaign.tests, changed(campaign, change).tests, strict=True)
    return replace(campaign, tests=tuple(new if k == test else t for k, (t, new) in enumerate(rows)))


def test_what_is_mistaken_in_one_test_is_said_of_it(spindle, foreign):
    """A sensor glued on the other way round between two tests, one file in g, two cables exchanged:
    the others are right, and all together told nothing."""
    order, first = np.array([0, 1, 3, 2, 4, 5, 6]), np.where(np.arange(7) == 0, -1.0, 1.0)[:, None, None]
    for k in (0, 2):
        begins = f"test {foreign.tests[k].id}: "
        for change, what in (
            (lambda v: v / 9.80665, "all FRFs are about 1/9.807 of"),
            (lambda v: v / 22.5, "all FRFs are about 1/2"),
            (lambda v: first * v, "the FRFs of response 1 (hub_top0) have the other sign"),
            (lambda v: v[order], f"responses 3 ({spindle.points[2].name}) and 4 ({spindle.points[3].name}): each fits"),
        ):
            [said] = likenesses(spindle, of_one(foreign, k, change))
            assert said.startswith(begins + what)
    two = of_one(of_one(foreign, 0, lambda v: -v), 1, lambda v: -v)
    [said] = likenesses(spindle, two)
    assert said.startswith(f"tests {foreign.tests[0].id} and {foreign.tests[1].id}: all FRFs have the other sign")


def test_a_comparison_says_it_of_a_campaign_that_was_imported_without_the_scene(foreign, tmp_path, monkeypatch):
    """Of a sensor reversed in one test it told 0.538 as MAC, and no more."""
    fifth, p = np.where(np.arange(7) == 4, -1.0, 1.0)[:, None, None], load(SCENE).points[4]
    few = replace(foreign, tests=foreign.tests[:2])
    write_campaign(of_one(few, 1, lambda v: fifth * v), tmp_path / "c")
    [said] = compare(SCENE, tmp_path / "c").values["warnings"]
    assert said.startswith(f"test {few.tests[1].id}: the FRFs of response {p.node} ({p.name}) have the other sign")
    monkeypatch.setattr(verb, "server", lambda *_: (None, "http://127.0.0.1:1/token/"))
    assert verb.workbench(SCENE, tmp_path / "c", no_browser=True, out=tmp_path / "saved").values["warnings"] == [said]
    write_campaign(few, tmp_path / "d")
    assert compare(SCENE, tmp_path / "d").values["warnings"] == []


def test_a_sensitivity_left_out_is_said(spindle, foreign):
    """mV told as N: a factor of 22.5 that no two units have. Of an FRF that symmetry forbids a factor says nothing."""
    [said] = likenesses(spindle, changed(foreign, lambda v: v / 22.5))
    assert said.startswith("all FRFs are about 1/23 of")
    assert "sensitivity" in said
    frfs = [(t, t.frf) for t in foreign.tests if t.frf is not None]
    forbidden = [replace(t, frf=replace(f, value=f.value[2:3, 1:], response_nodes=f.response_nodes[2:3], reference_nodes=f.reference_nodes[1:], sd=None, coherence=None)) for t, f in frfs]
    assert likenesses(spindle, replace(foreign, tests=tuple(forbidden))) == []


@pytest.mark.parametrize("response", range(7))
def test_a_sensor_that_is_reversed_is_said(response, spindle, foreign):
    sign = np.where(np.arange(7) == response, -1.0, 1.0)
    p = spindle.points[response]
    [said] = likenesses(spindle, changed(foreign, lambda v: sign[:, None, None] * v))
    assert said.startswith(f"the FRFs of response {p.node} ({p.name}) have the other sign than those that hdd_2003 has")


def test_a_hammer_that_is_reversed_is_said(spindle, foreign):
    [said] = likenesses(spindle, changed(foreign, lambda v: v * np.array([1.0, -1.0])[:, None]))
    assert said.startswith(f"the FRFs of the hammer at {spindle.points[1].node} ({spindle.points[1].name}) have the other sign")
    [said] = likenesses(spindle, changed(foreign, lambda v: -v))
    assert said.startswith("all FRFs have the other sign")


def test_the_other_sense_of_rotation_is_said(spindle, foreign):
    """It was told as a spindle whose shaft had a tenth of its mass, and nothing missing."""
    turning = [t.id for t in foreign.tests if t.speed]
    assert len(turning) > 1
    [said] = likenesses(spindle, replace(foreign, tests=tuple(replace(t, speed=-t.speed) for t in foreign.tests)))
    assert said.startswith(f"tests {', '.join(turning[:-1])} and {turning[-1]}: FRFs from one plane to the other are those that hdd_2003 has turning the other way")
    one = [replace(t, speed=-t.speed) if t.id == turning[0] else t for t in foreign.tests]
    assert not [s for s in likenesses(spindle, replace(foreign, tests=tuple(one))) if "turning the other way" in s]  # in all, or in none: the others tell that it is told right


def test_lines_between_a_resonance_and_its_drawn_place_tell_no_sign(spindle, foreign):
    """All of them are across there."""
    frf = foreign.tests[0].frf
    assert frf is not None
    joints = tuple(replace(j, stiffness=tuple(0.6 * k for k in j.stiffness)) for j in spindle.structure.joints)
    softer = replace(spindle, structure=replace(spindle.structure, joints=joints))
    top = np.abs(frf.value[0, 0]).argmax()
    below = (frf.frequency < 0.985 * frf.frequency[top]) & (frf.frequency > 0.93 * frf.frequency[top])
    assert below.sum() > 10
    narrow = replace(foreign, tests=(replace(foreign.tests[0], frf=replace(frf, frequency=frf.frequency[below], value=frf.value[..., below], sd=None, coherence=None)),))
    assert [said for said in likenesses(softer, narrow) if "other sign" in said] == []


@pytest.mark.parametrize(
    ("scene", "campaign"),
    [("hdd_2003", "virtual/soak_20_60"), ("hdd_2003", "measured/jang_2003"), ("free_shaft", "measured/modelab")],
)
def test_nothing_is_said_of_shipped_campaigns(scene, campaign):
    folder = SCENE.parent / scene
    assert likenesses(load(folder), read_campaign(folder / campaign)) == []


@pytest.mark.parametrize(("a", "b"), [(0, 1), (0, 2), (2, 3), (3, 4), (4, 5), (5, 6)])
def test_two_channels_exchanged_are_said(a, b, spindle, foreign):
    order = np.arange(7)
    order[[a, b]] = b, a
    names = [f"{p.node} ({p.name})" for p in spindle.points]
    [said] = likenesses(spindle, changed(foreign, lambda v: v[order]))
    assert said.startswith(f"responses {names[a]} and {names[b]}: each fits")
    assert likenesses(spindle, changed(foreign, lambda v: v[:, ::-1])) == [said.replace(said.split(":")[0], "hammer points 1 (hub_top0) and 2 (hub_top90)")]


def test_import_says_it_and_changes_nothing(foreign, tmp_path):
    """Accelerances in m/s2 whose file says g."""
    frf = foreign.tests[0].frf
    assert frf is not None
    one = frf.value[0, 0] * (2j * np.pi * frf.frequency)
    for unit, count in (("(m/s^2)/N", 0), ("g/N", 1)):
        file = table(tmp_path / "T20.csv", ["Hz", f"H(1,1) real [{unit}]", f"H(1,1) imag [{unit}]"], [frf.frequency, one.real, one.imag])
        (tmp_path / "m.toml").write_text('[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
        out = tmp_path / f"c{count}"
        said = bring([file], mapping=tmp_path / "m.toml", scene=SCENE, out=out).values["warnings"]
        assert len(said) == count
        assert all("m/s2 told as g" in s for s in said)
        kept, found = read_campaign(out).tests[0].frf, of_frf(unit)
        assert kept is not None
        assert found is not None
        np.testing.assert_allclose(kept.value[0, 0], found[1] * one, rtol=1e-6)


def test_nothing_is_said_of_lines_where_the_model_has_no_answer(spindle, foreign, monkeypatch):
    """Neither with those that are told nor with others: what is compared with nothing fits nothing."""
    shifted = replace(foreign, tests=tuple(replace(t, frf=t.frf and replace(t.frf, frequency=2 * np.pi * t.frf.frequency)) for t in foreign.tests))
    own = likeness.compared
    for silent in ((1.0,), (1 / (2 * np.pi), 2 * np.pi)):
        monkeypatch.setattr(likeness, "compared", lambda s, c, t, scale, silent=silent: None if scale in silent else own(s, c, t, scale))
        assert not [said for said in likenesses(spindle, shifted) if "rad/s" in said]


@pytest.mark.parametrize(("scale", "mistake"), [(2 * np.pi, "rad/s told as Hz"), (0.5 / np.pi, "Hz told as rad/s")])
@pytest.mark.parametrize("name", ["foreign_none", "foreign_bond"])
def test_lines_in_rad_per_s_are_said(name, scale, mistake, spindle):
    """They reach into the band of the scene's hammer test, so that their frequencies alone tell nothing."""
    campaign = read_campaign(DATA / name)
    tests = tuple(replace(t, frf=t.frf and replace(t.frf, frequency=scale * t.frf.frequency)) for t in campaign.tests)
    [said] = likenesses(spindle, replace(campaign, tests=tests))
    assert said.startswith("all FRFs fit those that hdd_2003 has far better with lines from 40")
    assert mistake in said
