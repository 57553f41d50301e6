"""The same mesh in CalculiX: displacements equal to 1e-3 of the largest.

`python tests/thermal/test_calculix.py` writes CalculiX's displacements to calculix.csv again.
"""

import csv
import shutil
import subprocess
import tempfile
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from thermospindle.model.scene.reading import load
from thermospindle.thermal.elastic import Solid
from thermospindle.thermal.influence import elasticity
from thermospindle.thermal.mesh import section_mesh

CCX = shutil.which("ccx")
KINDS = {"triangle": "CAX6", "quadrilateral": "CAX8"}


def deck(solid, constants, expansion, temperature):
    """A CalculiX input file: second-order elements counter-clockwise, corners first; the axis and one axial freedom held."""
    section, nodes = solid.section, solid.scalar.element_dofs.copy()
    corners = len(nodes) // 2
    r, z = solid.nodes[nodes[:corners]].transpose(2, 0, 1)
    clockwise = np.sum(r * np.roll(z, -1, axis=0) - np.roll(r, -1, axis=0) * z, axis=0) < 0
    turned = [*range(corners)[::-1], *[corners + (corners - 2 - k) % corners for k in range(corners)]]
    nodes[:, clockwise] = nodes[turned][:, clockwise]
    kind = KINDS["triangle" if corners == 3 else "quadrilateral"]
    lines = ["*NODE,NSET=ALL", *[f"{k + 1},{a:.12e},{b:.12e},0" for k, (a, b) in enumerate(solid.nodes)]]
    for index, name in enumerate(section.regions):
        lines.append(f"*ELEMENT,TYPE={kind},ELSET=R{index}")
        lines += [",".join(str(n) for n in (e + 1, *(nodes[:, e] + 1))) for e in section.elements(name)]
        lines += [f"*MATERIAL,NAME=M{index}", "*ELASTIC", f"{constants[name].youngs_modulus},{constants[name].poisson_ratio}"]
        lines += ["*EXPANSION,ZERO=0", f"{expansion[name]:.10g}", f"*SOLID SECTION,ELSET=R{index},MATERIAL=M{index}"]
    held = [f"{k + 1},1,1" for k in np.flatnonzero(solid.nodes[:, 0] == 0)]
    lines += ["*BOUNDARY", *held, "1,2,2", "*INITIAL CONDITIONS,TYPE=TEMPERATURE", "ALL,0"]
    lines += ["*STEP", "*STATIC", "*TEMPERATURE", f"ALL,{temperature}", "*NODE PRINT,NSET=ALL", "U", "*END STEP", ""]
    return "\n".join(lines)


PARTS = ("stationary", "rotating")
SHAPE = pytest.mark.parametrize("shape", KINDS)
PART = pytest.mark.parametrize("part", PARTS)
TABLE = Path(__file__).with_name("calculix.csv")


def heated(spindle, part, shape):
    """A part 40 K above the reference: its solid, the expansion of its regions (1/K) and our displacements (n, 2) in m."""
    section, constants = section_mesh(spindle, part, 1e-3, shape), elasticity(spindle)
    solid = Solid(section, constants)
    expansion = {name: spindle.materials[spindle.region(name).material].thermal_strain(21.0, 20.0) for name in section.regions}
    strains = np.tensordot([40 * expansion[name] for name in section.regions], solid.region_strains(), axes=1)
    return solid, expansion, solid.displacement(strains[None])[0]


def of_calculix(spindle, solid, expansion, folder):
    """Displacements (n, 2) that CalculiX gives on the same mesh."""
    (folder / "part.inp").write_text(deck(solid, elasticity(spindle), expansion, 40.0))
    subprocess.run([CCX, "part"], cwd=folder, check=True, capture_output=True, timeout=60)
    rows = [line.split() for line in (folder / "part.dat").read_text().splitlines()]
    theirs = np.array([row[1:3] for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    theirs[:, 1] -= solid.axial_mean @ theirs[:, 1]
    return theirs


def at_corners(spindle, part, solid, displacement):
    """Rows of r, z (mm) and u_r, u_z (um) at the corners of all regions of a part, where every mesh has a node."""
    corners = sorted({(r, z) for g in spindle.regions if g.part == part for r in g.r for z in g.z})
    rows = []
    for corner in corners:
        distance = np.linalg.norm(solid.nodes - corner, axis=1)
        assert distance.min() < 1e-9
        rows.append((*np.array(corner) * 1e3, *displacement[distance.argmin()] * 1e6))
    return np.array(rows)


def table(part, shape):
    with TABLE.open(newline="", encoding="utf-8") as file:
        rows = [row[2:] for row in csv.reader(file) if row[:2] == [part, shape]]
    return np.array(rows, float)


@PART
@SHAPE
def test_displacements_equal_those_calculix_gave(spindle, part, shape):
    """The table that this file, run with CalculiX installed, has written; needs no CalculiX."""
    solid, _, ours = heated(spindle, part, shape)
    there, here = table(part, shape), at_corners(spindle, part, solid, ours)
    assert len(there) > 10
    assert here[:, :2] == pytest.approx(there[:, :2], abs=1e-6)
    assert np.abs(here[:, 2:] - there[:, 2:]).max() < 1e-3 * np.abs(there[:, 2:]).max()


@pytest.mark.skipif(CCX is None, reason="CalculiX (ccx) is not installed; the test above has its numbers")
@PART
@SHAPE
def test_displacements_equal_those_of_calculix(spindle, tmp_path, part, shape):
    solid, expansion, ours = heated(spindle, part, shape)
    theirs = of_calculix(spindle, solid, expansion, tmp_path)
    assert theirs.shape == ours.shape
    assert np.abs(theirs - ours).max() < 1e-3 * np.abs(ours).max()
    assert at_corners(spindle, part, solid, theirs) == pytest.approx(table(part, shape), abs=1e-4)  # six digits


if __name__ == "__main__":
    reference = load("hdd_2003")
    with TABLE.open("w", newline="", encoding="utf-8") as file, tempfile.TemporaryDirectory() as scratch:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(["part", "element", "r_mm", "z_mm", "u_r_um", "u_z_um"])
        for part, shape in product(PARTS, KINDS):
            solid, expansion, _ = heated(reference, part, shape)
            found = at_corners(reference, part, solid, of_calculix(reference, solid, expansion, Path(scratch)))
            lines.writerows([part, shape, *(f"{x:.6g}" for x in row)] for row in found)
