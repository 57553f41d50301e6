"""Tables of modes that tell shapes: read and written, refused, compared, and told apart by them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import ROOT, SCENE
from tests.made_campaign import campaign
from tests.virtual_campaign import mode_campaign, model_of
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.scene.reading import load
from thermospindle.model.units import RPM
from thermospindle.report.figures.compare import figures
from thermospindle.sim.campaign.campaign import Campaign, read_campaign, write_campaign
from thermospindle.sim.campaign.modes import ShapeAt

CONDITIONS = (Condition(20.0), Condition(50.0, 7200 * RPM))


def with_shapes() -> Campaign:
    own = campaign()
    shapes = [(ShapeAt(1, 1.0 + 0.0j, 0.01), ShapeAt(6, complex(1 / 3, -0.2), 0.02)), (ShapeAt(1, 0.0j, 0.01), ShapeAt(6, -1.0 + 0.0j, 0.01))]
    table = own.tests[1]
    return replace(own, tests=(own.tests[0], replace(table, modes=tuple(replace(m, shape=s) for m, s in zip(table.modes, shapes, strict=True)))))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_campaign(with_shapes(), tmp_path / "c")
    return tmp_path / "c"


def test_shapes_read_back_bit_for_bit(folder: Path) -> None:
    assert read_campaign(folder) == with_shapes()
    assert read_campaign(folder).tests[1].shape_nodes == (1, 6)
    assert (folder / "shapes.csv").read_text().splitlines()[:3] == ["test,mode,node,real,imaginary,sd", "T20.5_n7200,1,1,1.0,0.0,0.01", "T20.5_n7200,1,6,0.3333333333333333,-0.2,0.02"]


def test_an_imaginary_part_may_be_left_out(folder: Path) -> None:
    file = folder / "shapes.csv"
    file.write_text(file.read_text().replace(",0.0,0.01", ",,0.01"))
    assert read_campaign(folder) == with_shapes()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("2,6,-1.0", "3,6,-1.0", "shapes.csv: line 5: test = 'T20.5_n7200', mode = 3: the table of modes has no such mode"),
        ("2,6,-1.0", "2,7,-1.0", "shapes.csv: line 5: node = 7: no point of the campaign; allowed are 1, 3, 6"),
        ("2,6,-1.0", "2,1,-1.0", "shapes.csv: line 5: node = 1: mode 2 of test T20.5_n7200 has this node already"),
        ("2,6,-1.0", "2,3,-1.0", "shapes.csv: test T20.5_n7200: mode 2 is told at nodes 1, 3, mode 1 at 1, 6; all modes of a test need the same"),
        ("2,6,-1.0", "2,6,0", "shapes.csv: test T20.5_n7200: mode 2 moves at no node"),
        ("T20.5_n7200,2,6,-1.0,-0.0,0.01\n", "", "shapes.csv: test T20.5_n7200: mode 2 is told at nodes 1, mode 1 at 1, 6"),
        ("2,6,-1.0,-0.0,0.01", "2,6,-1.0,-0.0,", "shapes.csv: line 5: sd: missing"),
        ("2,6,-1.0,-0.0,0.01", "2,6,-1.0,-0.0,0", "shapes.csv: line 5: sd = '0': .*greater than 0"),
        ("2,6,-1.0", "2,6,one", "shapes.csv: line 5: real = 'one'"),
        ("imaginary", "phase", "shapes.csv: line 1: the columns must be test,mode,node,real,imaginary,sd"),
    ],
)  # fmt: skip
def test_shapes_that_cannot_be_used_are_refused(folder: Path, old: str, new: str, words: str) -> None:
    file = folder / "shapes.csv"
    text = file.read_text().replace("-1.0,0.0,", "-1.0,-0.0,")
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(BadInput, match=words):
        read_campaign(folder)


def test_shapes_need_modes(folder: Path) -> None:
    file = folder / "campaign.toml"
    file.write_text(file.read_text().replace('modes = "modes.csv"\n', ""))
    with pytest.raises(BadInput, match=r"campaign\.toml: shapes = 'shapes.csv': are those of modes, and modes are missing"):
        read_campaign(folder)


@pytest.fixture(scope="module")
def scene():
    return load(SCENE)


def test_a_table_with_shapes_is_compared_by_them(scene) -> None:
    nodes = [p.node for p in scene.points]
    found = compare(scene, mode_campaign(scene, CONDITIONS, 1, shapes=nodes))
    assert all(m.mac is not None and m.mac > 0.995 for t in found.tests for m in t.modes)
    assert set(found.comac) == set(nodes)
    assert all(m.mac is None for t in compare(scene, mode_campaign(scene, CONDITIONS, 1)).tests for m in t.modes)


@pytest.mark.parametrize("of", ["points of bodies", "points along a shaft"])
def test_shapes_are_drawn_point_by_point_or_over_height(scene, of) -> None:
    if of == "points along a shaft":
        shaft = ROOT / "scenes" / "free_shaft"
        found = compare(load(shaft), read_campaign(shaft / "measured" / "modelab"))
    else:
        found = compare(scene, mode_campaign(scene, CONDITIONS, 1, shapes=[p.node for p in scene.points]))
    first = found.tests[0]
    picture = figures(found)["shapes"]
    drawn = [axes for axes in picture.axes if axes.axison]
    assert [axes.get_title(loc="left").split()[0] for axes in drawn] == [str(n) for n in sorted(own.number for own in first.shapes)]
    for axes, own in zip(drawn, sorted(first.shapes, key=lambda own: own.number), strict=True):
        at, computed = axes.lines[0].get_data()
        order = np.argsort([p.position[2] for p in own.points]) if of == "points along a shaft" else np.arange(len(own.points))
        assert list(at) == pytest.approx(sorted(1e3 * p.position[2] for p in own.points) if of == "points along a shaft" else range(len(own.points)))
        alike = np.abs(np.vdot(own.computed[order], computed)) / np.linalg.norm(own.computed) / np.linalg.norm(computed)
        assert alike > 0.99
        assert np.abs(own.measured - own.computed).max() < 0.2
    labels = [t.get_text() for t in drawn[-1].get_xticklabels()]
    assert ("hub_top0" in labels) == (of == "points of bodies")


def test_residuals_of_shapes_have_the_scatter_that_is_told(scene) -> None:
    """At what they were made with, over 8 seeds; sensors are off by nothing here, so that the scene's tolerance of gains is left out."""
    exact = replace(scene, tolerances=replace(scene.tolerances, gain=1e-9))
    squares, count = 0.0, 0
    for seed in range(8):
        model = model_of(exact, mode_campaign(exact, CONDITIONS, seed, shapes=[1, 2, 3, 6, 7]))
        for t, data in enumerate(model.tests):
            r = model.residual(t, np.zeros(len(model.parameters)), [])
            assert len(r) == data.count
            own = r[2 * len(data.frequency) :]
            squares, count = squares + float(own @ own), count + len(own)
    assert 0.9 < np.sqrt(squares / count) < 1.1


def test_shapes_part_modes_that_lie_beside_each_other(scene) -> None:
    """A hub that rocks at 1821 Hz is told at 1950, what moves along the axis at 2010 is told at
    1900, and of what kind they are is not: by frequencies alone they are each other."""
    told = {1821.0: 1950.0, 2009.9: 1900.0}
    for nodes in ([p.node for p in scene.points], []):
        plain = mode_campaign(scene, CONDITIONS[:1], 1, shapes=nodes)
        test = plain.tests[0]
        near = {k: next(i for i, m in enumerate(test.modes) if abs(m.frequency / k - 1) < 1e-3) for k in told}
        rows = [replace(m, kind="unknown") for m in test.modes]
        for own, other in told.items():
            rows[near[own]] = replace(rows[near[own]], frequency=other)
        found = compare(scene, replace(plain, tests=(replace(test, modes=tuple(rows)),)))
        computed = {m.measured: m.computed for m in found.tests[0].modes}
        assert computed[1950.0] == pytest.approx(1821.0 if nodes else 2009.9, rel=1e-3)
        assert computed[1900.0] == pytest.approx(2009.9 if nodes else 1821.0, rel=1e-3)
