"""The same mesh in CalculiX: displacements equal to 1e-3 of the largest."""

import shutil
import subprocess

import numpy as np
import pytest

from thermal.elastic import Solid
from thermal.influence import elasticity
from thermal.mesh import section_mesh

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


@pytest.mark.skipif(CCX is None, reason="CalculiX (ccx) is not installed")
@pytest.mark.parametrize("shape", KINDS)
@pytest.mark.parametrize("part", ["stationary", "rotating"])
def test_displacements_equal_those_of_calculix(spindle, tmp_path, part, shape):
    section, constants = section_mesh(spindle, part, 1e-3, shape), elasticity(spindle)
    solid = Solid(section, constants)
    expansion = {name: spindle.materials[spindle.region(name).material].thermal_strain(21.0, 20.0) for name in section.regions}
    strains = np.tensordot([40 * expansion[name] for name in section.regions], solid.region_strains(), axes=1)
    ours = solid.displacement(strains[None])[0]
    (tmp_path / "part.inp").write_text(deck(solid, constants, expansion, 40.0))
    subprocess.run([CCX, "part"], cwd=tmp_path, check=True, capture_output=True, timeout=60)
    rows = [line.split() for line in (tmp_path / "part.dat").read_text().splitlines()]
    theirs = np.array([row[1:3] for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    assert theirs.shape == ours.shape
    theirs[:, 1] -= solid.axial_mean @ theirs[:, 1]
    assert np.abs(theirs - ours).max() < 1e-3 * np.abs(ours).max()
