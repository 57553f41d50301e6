"""Meshes follow the regions, refine, and are read from Gmsh files."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from skfem import MeshTri

from thermospindle.model.drawing.section import Region
from thermospindle.thermal.elastic import Solid
from thermospindle.thermal.expansion import influence
from thermospindle.thermal.influence import elasticity, races
from thermospindle.thermal.mesh import PartMesh, read_gmsh, section_mesh, tiled
from thermospindle.thermal.refine import strain_error

SHAPES = ("triangle", "quadrilateral")


def areas(section):
    """Section area (m2) of every region, by its own elements."""
    r, z = section.mesh.p[:, section.mesh.t]
    double = np.abs(np.sum(r * np.roll(z, -1, axis=0) - np.roll(r, -1, axis=0) * z, axis=0))
    return np.bincount(section.region_of, double / 2, minlength=len(section.regions))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("size", [0.4e-3, 5e-3], ids=["fine", "coarse"])
def test_regions_have_their_area_and_later_ones_cut(size, shape):
    regions = (
        Region("disc", "p", "", (0, 10e-3), (0, 3e-3)),
        Region("plug", "p", "", (2e-3, 4e-3), (1e-3, 5e-3)),
        Region("rim", "p", "", (10e-3, 11e-3), (-1e-3, 2e-3)),
    )
    section = tiled("p", regions, size, shape)
    assert areas(section) == pytest.approx(np.array([30 - 4, 8, 3]) * 1e-6)
    widths = np.ptp(section.mesh.p[:, section.mesh.t], axis=1)
    assert widths.max() <= size * (1 + 1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_refinement_keeps_regions(spindle, shape):
    section = section_mesh(spindle, "rotating", 2e-3, shape)
    marked = section.elements("upper outer ring")[:3]
    for finer in (section.refined(), section.refined(marked)):
        assert finer.mesh.nelements > section.mesh.nelements
        assert areas(finer) == pytest.approx(areas(section))
        centre = finer.mesh.p[:, finer.mesh.t].mean(axis=1)
        ring = spindle.region("upper outer ring")
        own = finer.elements("upper outer ring")
        assert np.all((centre[0][own] < ring.r[1]) & (centre[1][own] > ring.z[0]) & (centre[1][own] < ring.z[1]))


def test_exposed_faces(spindle):
    """All faces but the axis and those where regions are bonded: the surface area of the shaft, by hand."""
    section = section_mesh(spindle, "stationary", 1e-3)
    ends = section.mesh.p[:, section.mesh.facets[:, section.exposed(["shaft"])]]
    area = np.sum(2 * np.pi * ends[0].mean(axis=0) * np.linalg.norm(ends[:, 0] - ends[:, 1], axis=0))
    r, bare_height = 2.5e-3, (19 - 2 - 3 - 3) * 1e-3
    assert area == pytest.approx(2 * np.pi * r * bare_height + 2 * np.pi * r**2)


def test_faces_that_are_not_there_are_refused(spindle):
    section = section_mesh(spindle, "rotating", 2e-3)
    with pytest.raises(ValueError, match=r"no face of 'sleeve' at r = 0\.0071"):
        section.side("sleeve", 0, 7.1e-3)
    with pytest.raises(ValueError, match="no element of 'shaft'"):
        section.elements("shaft")


def test_loose_regions_are_named():
    regions = (Region("a", "p", "", (0, 1e-3), (0, 9e-3)), Region("loose", "p", "", (1e-3, 2e-3), (9e-3, 10e-3)))
    with pytest.raises(ValueError, match="loose not bonded"):  # they share one corner, which is no bond
        tiled("p", regions, 1e-3)


def test_error_estimate_sees_the_reentrant_corner(spindle):
    """On a uniform mesh the largest strain error of the hub is at a corner of the section."""
    section = section_mesh(spindle, "rotating", 0.5e-3)
    response, _ = Solid(section, elasticity(spindle)).respond(races(spindle, "rotating"))
    worst = section.mesh.t[:, np.argmax(strain_error(section, response.shape))]
    corners = {(r, z) for g in spindle.regions if g.part == "rotating" for r in g.r for z in g.z} | {(7.5e-3, 10e-3)}
    distance = [np.hypot(*(section.mesh.p[:, v] - corner)) for v in worst for corner in corners]
    assert min(distance) < 1e-9


def write_msh(path, section, names, scramble=False):
    """A Gmsh 2.2 file of a section whose regions carry `names`, besides a group that belongs to no part."""
    kind = "triangle" if section.mesh.t.shape[0] == 3 else "quad"
    tags = section.region_of + 11
    meshio.write(
        path,
        meshio.Mesh(
            np.column_stack([section.mesh.p.T, np.zeros(section.mesh.nvertices)]),
            [(kind, section.mesh.t.T), ("line", section.mesh.facets[:, :3].T)],
            cell_data={"gmsh:physical": [tags, np.full(3, 5)], "gmsh:geometrical": [tags, np.full(3, 5)]},
            field_data={name: np.array([11 + k, 2]) for k, name in enumerate(names)} | {"some line": np.array([5, 1])},
        ),
        file_format="gmsh22",
    )


@pytest.mark.parametrize("shape", SHAPES)
def test_gmsh_file_gives_back_the_mesh(spindle, tmp_path, shape):
    section = section_mesh(spindle, "rotating", 2e-3, shape)
    write_msh(tmp_path / "hub.msh", section, section.regions)
    read = read_gmsh(tmp_path / "hub.msh", spindle, "rotating")
    assert read.regions == section.regions
    assert areas(read) == pytest.approx(areas(section))
    gains = [Solid(s, elasticity(spindle)).respond(races(spindle, "rotating"))[0].gain for s in (section, read)]
    assert gains[1] == pytest.approx(gains[0], rel=1e-8, abs=1e-12)


def test_gmsh_mesh_refines_to_the_same_motions(spindle, tmp_path):
    """Gmsh's own unstructured mesh of the stationary part, read and refined, against the built-in one."""
    gmsh = pytest.importorskip("gmsh")
    regions = [g for g in spindle.regions if g.part == "stationary" and g.name != "flange boss"]
    alone = replace(spindle, regions=tuple(g for g in spindle.regions if g.name != "flange boss"))
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        boxes = [(2, gmsh.model.occ.addRectangle(g.r[0], g.z[0], 0, np.ptp(g.r), np.ptp(g.z))) for g in regions]
        _, pieces = gmsh.model.occ.fragment(boxes[:1], boxes[1:])
        gmsh.model.occ.synchronize()
        for g, piece in zip(regions, pieces, strict=True):
            gmsh.model.addPhysicalGroup(2, [tag for _, tag in piece], name=g.name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1.5e-3)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(tmp_path / "shaft.msh"))
    finally:
        gmsh.finalize()
    start = read_gmsh(tmp_path / "shaft.msh", spindle=alone, part="stationary")
    own, built_in = (influence(alone, 1e-3, sections=s).responses["stationary"].gain for s in ({"stationary": start}, None))
    assert np.abs(own - built_in).sum(axis=1).max() < 2e-3 * np.abs(built_in).sum(axis=1).max()


@pytest.mark.parametrize(
    ("names", "message"),
    [
        pytest.param({"sleeve": "slieve"}, "no physical surface is named 'sleeve' \\(rotating part\\)", id="misspelled"),
        pytest.param({"sleeve": "a", "hub plate": "b"}, "named 'sleeve', 'hub plate'", id="two missing"),
    ],
)
def test_gmsh_file_without_a_region_is_refused(spindle, tmp_path, names, message):
    section = section_mesh(spindle, "rotating", 3e-3)
    write_msh(tmp_path / "hub.msh", section, [names.get(name, name) for name in section.regions])
    with pytest.raises(ValueError, match=message):
        read_gmsh(tmp_path / "hub.msh", spindle, "rotating")


def test_gmsh_file_without_any_names_is_refused(spindle, tmp_path):
    section = section_mesh(spindle, "rotating", 3e-3)
    meshio.write(tmp_path / "hub.msh", meshio.Mesh(section.mesh.p.T, [("triangle", section.mesh.t.T)]), file_format="gmsh22")
    with pytest.raises(ValueError, match="no physical surface"):
        read_gmsh(tmp_path / "hub.msh", spindle, "rotating")


@pytest.mark.parametrize(
    "text", ["", "$MeshFormat\n", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 a b c\n", "\x00\xff" * 50], ids=["empty", "cut", "text", "bytes"]
)
def test_what_is_no_gmsh_file_is_refused(spindle, tmp_path, text):
    """meshio raises what it likes, and ends the program where it knows no reader."""
    (tmp_path / "hub.msh").write_text(text, encoding="latin-1")
    with pytest.raises(ValueError, match=r"hub\.msh: not a Gmsh file"):
        read_gmsh(tmp_path / "hub.msh", spindle, "rotating")


def test_a_gmsh_node_without_a_finite_place_is_refused(spindle, tmp_path):
    section = section_mesh(spindle, "rotating", 3e-3)
    section.mesh.p[0, 0] = np.nan
    write_msh(tmp_path / "hub.msh", section, list(section.regions))
    with pytest.raises(ValueError, match="no finite number"):
        read_gmsh(tmp_path / "hub.msh", spindle, "rotating")


def test_a_side_is_of_the_outline_alone():
    """A thin element has a facet inside that lies as near to the line as rounding: it is no part of the side, whose length it would add to."""
    points = np.array([[1.0, 2.0, 2.0, 1.0, 2.0 - 1e-8], [0.0, 0.0, 1.0, 1.0, 0.5]])
    triangles = np.array([[1, 2, 4], [0, 1, 4], [2, 3, 4], [0, 4, 3]]).T
    section = PartMesh("rotating", MeshTri(points, triangles), ("ring",), np.zeros(4, int))
    [facet] = section.side("ring", 0, 2.0)
    assert np.ptp(section.mesh.p[1][section.mesh.facets[:, facet]]) == 1.0
