"""Closed forms of thermo-elasticity, and the adjoint influence against direct solutions."""

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.drawing.section import Region
from thermospindle.thermal.elastic import Elasticity, Race, Solid
from thermospindle.thermal.influence import elasticity, races
from thermospindle.thermal.mesh import section_mesh, tiled

STEEL, ALUMINIUM = Elasticity(208e9, 0.30), Elasticity(70e9, 0.33)
SHAPES = ("triangle", "quadrilateral")


def solid(regions, constants, size, shape="triangle"):
    return Solid(tiled("test", regions, size, shape), constants)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("bore", [0.0, 5e-3], ids=["solid", "hollow"])
def test_free_uniform_expansion_is_exact(shape, bore):
    """One strain everywhere, whatever the stiffness: u = strain (r, z - mean z). In the finite element space, so to rounding."""
    regions = (Region("a", "test", "", (bore, 8e-3), (0, 4e-3)), Region("b", "test", "", (8e-3, 12e-3), (1e-3, 3e-3)))
    part = solid(regions, {"a": STEEL, "b": ALUMINIUM}, 1.5e-3, shape)
    strain = 4.6e-4
    moved = part.displacement(strain * part.region_strains().sum(axis=0, keepdims=True))[0]
    expected = strain * (part.nodes - [0.0, part.axial_mean @ part.nodes[:, 1]])
    assert moved == pytest.approx(expected, abs=1e-12 * strain)


@pytest.mark.parametrize("shape", SHAPES)
def test_linear_axial_temperature_bends_without_stress(shape):
    """Strain b z in a free body leaves it stress-free: u = b (r z, (z^2 - r^2) / 2) + constant (Timoshenko, Goodier, sec. 13)."""
    part = solid((Region("a", "test", "", (2e-3, 8e-3), (0, 5e-3)),), {"a": STEEL}, 1.5e-3, shape)
    slope = 0.05
    z_points = np.asarray(part.scalar.global_coordinates())[1]
    moved = part.displacement(slope * z_points[None])[0]
    r, z = part.nodes.T
    axial = slope * (z**2 - r**2) / 2
    expected = np.column_stack([slope * r * z, axial - part.axial_mean @ axial])
    assert moved == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_bonded_rings():
    """Steel in aluminium, +40 K, plane stress: Lame's rings with one interface pressure. A disc 1/25 as thick as its rings
    are wide is in plane stress but near the interface, to about (thickness / width)^2."""
    regions = (Region("steel", "test", "", (5e-3, 6.5e-3), (0, 0.06e-3)), Region("al", "test", "", (6.5e-3, 10e-3), (0, 0.06e-3)))
    part = solid(regions, {"steel": STEEL, "al": ALUMINIUM}, 0.03e-3)
    strains = np.tensordot([12.5e-6 * 40, 23e-6 * 40], part.region_strains(), axes=1)
    moved = part.displacement(strains[None])[0]
    radial = [part.race_mean(Race(ring, r)) @ moved[:, 0] for ring, r in (("steel", 5e-3), ("al", 6.5e-3), ("al", 10e-3))]
    assert np.array(radial) * 1e6 == pytest.approx([3.3646, 4.0757, 7.6653], rel=1e-3)
    hoop_strain = radial[0] / 5e-3 - 12.5e-6 * 40
    assert 208e9 * hoop_strain == pytest.approx(35.966e6, rel=2e-3)  # the bore is free, so hoop stress is E x elastic strain


@pytest.mark.parametrize("shape", SHAPES)
def test_long_cylinder_with_radial_temperature(shape):
    """Mid-plane of a long hollow cylinder with strain c r^2 and free ends (Timoshenko, Goodier, sec. 151), and the element's
    rate: the displacement of second-order elements is right to the third order of their size."""
    bore, outside, c, nu = 5e-3, 10e-3, 4.0, 0.3
    tube = Region("tube", "test", "", (bore, outside), (0, 160e-3))  # its ends are felt to exp(-0.21 / mm x 80 mm) only
    errors = []
    for size in (1.25e-3, 0.625e-3):
        part = solid((tube,), {"tube": Elasticity(208e9, nu)}, size, shape)
        r_points = np.asarray(part.scalar.global_coordinates())[0]
        moved = part.displacement(c * r_points[None] ** 2)[0]
        middle = np.isclose(part.nodes[:, 1], 80e-3)
        r = part.nodes[middle, 0]
        within, whole = c * (r**4 - bore**4) / 4, c * (outside**4 - bore**4) / 4  # integrals of strain r dr
        square = outside**2 - bore**2
        plane = (1 + nu) / (1 - nu) / r * (within + ((1 - 2 * nu) * r**2 + bore**2) / square * whole)  # plane strain
        expected = plane - 2 * nu * whole / square * r  # drawn in by the axial strain that leaves no axial force
        errors.append(np.abs(moved[middle, 0] / expected - 1).max())
    assert errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) > 2.5


@pytest.mark.parametrize("part", ["stationary", "rotating"])
def test_influence_equals_direct_solution(spindle, part):
    """Ring motion by adjoint solutions is that of a direct solution, for region strains and for any field of strain."""
    section = section_mesh(spindle, part, 2e-3)
    body = Solid(section, elasticity(spindle))
    response, _ = body.respond(races(spindle, part))
    random = np.random.default_rng(1)
    region_strain = random.uniform(-1, 1, len(section.regions))
    rough = random.uniform(-1, 1, response.density[0].shape)
    fields = np.array([np.tensordot(region_strain, body.region_strains(), axes=1), rough])
    direct = [[body.race_mean(race) @ u for race in response.races] for u in body.displacement(fields)]
    scale = np.abs(direct[0]).max()
    assert response.gain @ region_strain == pytest.approx(np.ravel(direct[0]), abs=1e-10 * scale)
    by_density = np.einsum("ieq,feq->fi", response.density, fields)
    assert by_density == pytest.approx(np.reshape(direct, (2, -1)), abs=1e-10 * scale)
    shape = np.tensordot(region_strain, response.shape, axes=1)
    assert shape == pytest.approx(body.displacement(fields[:1])[0], abs=1e-10 * scale)


def test_only_the_ratio_of_moduli_matters(spindle):
    section, moduli = section_mesh(spindle, "rotating", 3e-3), elasticity(spindle)
    twice = {name: replace(e, youngs_modulus=2 * e.youngs_modulus) for name, e in moduli.items()}
    softer = moduli | {"sleeve": replace(moduli["sleeve"], youngs_modulus=35e9)}
    gains = [Solid(section, e).respond(races(spindle, "rotating"))[0].gain for e in (moduli, twice, softer)]
    assert gains[1] == pytest.approx(gains[0], rel=1e-9, abs=1e-12)
    assert np.abs(gains[2] - gains[0]).max() > 1e-3 * np.abs(gains[0]).max()


@pytest.mark.parametrize("part", ["stationary", "rotating"])
def test_stiffening_against_central_differences(spindle, part):
    """A relative change h of one modulus either way: to h^2. All moduli alike change no motion."""
    section, h = section_mesh(spindle, part, 2e-3), 1e-3
    constants = elasticity(spindle)
    hard = Solid(section, constants)
    found = hard.respond(races(spindle, part))[0]
    for m, name in enumerate(section.regions):
        gains = []
        for change in (h, -h):
            one = replace(constants[name], youngs_modulus=(1 + change) * constants[name].youngs_modulus)
            gains.append(hard.with_moduli({**constants, name: one}).respond(found.races)[0].gain)
        assert found.stiffening[..., m] == pytest.approx((gains[0] - gains[1]) / (2 * h), rel=2e-6, abs=1e-6 * np.abs(found.stiffening).max())
    assert np.abs(found.stiffening).max() > 0.01 * np.abs(found.gain).max()
    assert np.abs(found.stiffening.sum(axis=-1)).max() < 1e-9 * np.abs(found.stiffening).max()
