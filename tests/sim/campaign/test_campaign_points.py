"""A campaign's points on the bodies of a scene: of another spindle, and of the same one with another mesh."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.verdict import diagnose
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.sim.campaign.beside import beside, check_points, doubtful, of_another, on_nodes
from thermospindle.sim.campaign.campaign import Campaign, Test, on_parts, read_campaign, write_campaign
from thermospindle.sim.campaign.simulated import hub_points, runout_campaign
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.run import Run, as_campaign

FOREIGN = ROOT / "tests" / "data" / "foreign_bond"


@pytest.mark.parametrize("verb", [compare, diagnose])
def test_a_foreign_campaign_is_refused_without_naming_every_segment(verb):
    with pytest.raises(BadInput, match=r"points\.1\.body = 'hub': no body of scene five_bearing; allowed are housing, spindle$"):
        verb(load(ROOT / "scenes" / "five_bearing"), read_campaign(FOREIGN))


def test_a_campaign_of_another_name_without_a_point_of_the_scene_is_said_to_be(spindle, capsys, tmp_path):
    """A table of modes without shapes was compared with any machine's without a word, for it has no
    points; one of a copy under another name that has the scene's points is its own."""
    measured, table = read_campaign(ROOT / "scenes" / "free_shaft" / "measured" / "modelab"), tmp_path / "table"
    [test] = measured.tests
    write_campaign(replace(measured, points=(), tests=(replace(test, modes=tuple(replace(row, shape=()) for row in test.modes)),)), table)
    assert main(["compare", str(ROOT / "scenes" / "mk7702"), str(table), "--json"]) == 0
    [said] = json.loads(capsys.readouterr().out)["warnings"]
    assert said.endswith("campaign.toml: spindle = 'free_shaft', and the scene is 'mk7702': no point of the campaign tells that they are one machine")
    assert of_another(load(ROOT / "scenes" / "free_shaft"), read_campaign(table)) == []
    own = replace(written(spindle), spindle="a copy")
    assert of_another(spindle, own) == []
    assert len(of_another(spindle, replace(own, points=()))) == 1


def test_temperatures_that_no_spindle_bears_are_said_of_a_campaign(spindle):
    own = written(spindle)
    assert doubtful(spindle, own) == []
    said, *_ = doubtful(spindle, replace(own, tests=(replace(own.tests[0], temperature=600.0),)))
    assert said.startswith("600 C lies outside -40 to 120 C")


def test_one_file_under_two_names_is_said(spindle):
    """As two temperatures it was taken in silence."""
    own = written(spindle)
    assert own.tests[0].frf is not None
    frf = replace(own.tests[0].frf, value=own.tests[0].frf.value * np.random.default_rng(0).normal(1.0, 0.1, own.tests[0].frf.value.shape))
    twice = (replace(own.tests[0], frf=frf), replace(own.tests[0], frf=frf, id="T40", temperature=40.0))
    assert doubtful(spindle, replace(own, tests=twice)) == [f"tests {own.tests[0].id} and T40 have the same FRFs to the last bit: is one file there under 2 names?"]


def written(spindle):
    """A campaign of two lines at rest, its points those of a spindle's scene as its files have them."""
    nodes = tuple(p.node for p in spindle.points)
    frf = Frf(np.array([800.0, 1200.0]), np.ones((len(nodes), 1, 2), complex), nodes, nodes[:1], "mobility")
    return Campaign("two lines", spindle.name, "mobility", spindle.points, (Test("cold", 20.0, 0.0, frf=frf),))


def made(tmp_path, *changes):
    """The scene that `spindle new --like rotor` writes, with `changes` of its text."""
    text = (ROOT / "scenes" / "templates" / "rotor.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    scene = tmp_path / str(len(list(tmp_path.iterdir())))
    scene.mkdir()
    (scene / "spindle.toml").write_text(text, encoding="utf-8")
    return load(scene)


def test_points_stay_where_they_are_on_a_shaft_that_is_divided_otherwise(tmp_path):
    """Nodes are numbered by the mesh: with elements a third as long, `shaft 11` of the campaign's file is another place."""
    coarse, fine = made(tmp_path), made(tmp_path, ("longest_element_mm = 65.0", "longest_element_mm = 20.0"))
    campaign = written(coarse)
    check_points(fine, campaign)
    by_name = [replace(p, body=p.body.split()[0]) for p in campaign.points]  # as one would write it by hand
    at, frequency = Condition(20.0, 0.0), np.array([60.0, 400.0, 900.0])
    rows = (coarse, campaign.points), (fine, campaign.points), (fine, tuple(by_name))
    first, *others = (beside(spindle, replace(campaign, points=tuple(points)), campaign.tests[0], at).computed(frequency) for spindle, points in rows)
    for other in others:
        assert other == pytest.approx(first, rel=0.02, abs=0.002 * np.abs(first).max())


def test_the_mass_of_a_sensor_goes_with_its_point(spindle, tmp_path):
    """Through the campaign's file; where none is told there is no such key; and a test's model has it."""
    campaign = written(spindle)
    heavy = replace(campaign, points=tuple(replace(p, mass=2.5e-3) if p.node == 6 else p for p in campaign.points))
    for name, own in (("plain", campaign), ("heavy", heavy)):
        write_campaign(own, tmp_path / name)
        assert [p.mass for p in read_campaign(tmp_path / name).points] == pytest.approx([p.mass for p in own.points], rel=1e-12)
    assert "sensor_mass_g" not in (tmp_path / "plain" / "campaign.toml").read_text()
    text = (tmp_path / "heavy" / "campaign.toml").read_text()
    assert text.count("sensor_mass_g = 2.5") == 1
    at, frequency = Condition(20.0), np.array([800.0, 1200.0, 2000.0])
    plain, loaded = (beside(spindle, c, c.tests[0], at).computed(frequency) for c in (campaign, read_campaign(tmp_path / "heavy")))
    assert np.abs(loaded - plain).max() > 1e-3 * np.abs(plain).max()
    of_scene = replace(spindle, points=heavy.points)
    assert beside(of_scene, campaign, campaign.tests[0], at).computed(frequency) == pytest.approx(loaded, rel=1e-9)  # told there alone
    (tmp_path / "heavy" / "campaign.toml").write_text(text.replace("sensor_mass_g = 2.5", "sensor_mass_g = -2.5"))
    with pytest.raises(BadInput, match=r"points\.\d+\.sensor_mass_g = -2\.5: "):
        read_campaign(tmp_path / "heavy")


def test_a_point_beyond_a_shaft_that_was_shortened_is_refused(tmp_path):
    shorter = made(tmp_path, ("[[30, 600]]", "[[30, 580]]"), ("[0.0, 0.0, 600.0]", "[0.0, 0.0, 580.0]"))
    with pytest.raises(BadInput, match=r"points\.4: at z_mm = 600 beyond the shaft 'shaft' of scene \S+, which spans 0 to 580$"):
        check_points(shorter, written(made(tmp_path)))


def test_virtual_campaigns_name_shafts_and_not_their_nodes():
    """A height says where on it; what reads them finds the same nodes."""
    spindle = load(ROOT / "scenes" / "five_bearing")
    made = as_campaign(Run(spindle, (), ()), "virtual")
    assert {p.body for p in spindle.points} > {"housing"}
    assert {p.body for p in made.points} == {"spindle", "housing"}
    assert on_nodes(spindle, made.points) == spindle.points
    probes = hub_points(spindle)
    assert "spindle" not in {p.body for p in probes}
    assert {p.body for p in on_parts(spindle, probes)} == {"spindle"}
    assert on_nodes(spindle, on_parts(spindle, probes)) == probes
    turning = runout_campaign(spindle, [Condition(20.0, 100.0)], seconds=0.01, path="linear")
    assert {p.body for p in turning.points} == {"spindle"}
