"""Units and channels that seem mistaken are said as FRFs are imported, and nothing is said of campaigns in which none is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import DATA, SCENE
from tests.sim.importing.exported import table
from thermospindle.model.scene.reading import load
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import Campaign, read_campaign
from thermospindle.sim.importing.frfs import likeness
from thermospindle.sim.importing.frfs.likeness import likenesses
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
    own = likeness._pairs
    for silent in ((1.0,), (1 / (2 * np.pi), 2 * np.pi)):
        monkeypatch.setattr(likeness, "_pairs", lambda s, c, t, scale, silent=silent: [] if scale in silent else own(s, c, t, scale))
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
